//! What a log says in another way than it is read: degrees, quaternions in another order, the force of one finger turned.

use super::{ask, ask_contact};
use crate::shared::recordings::recording;
use teachtree_base::recording::Recording;
use teachtree_frames::OpenRequest;
use teachtree_frames::frames;
use teachtree_frames::open;
use teachtree_world::{shipped, teach};

fn taught(name: &str) -> Recording {
    teach(&shipped::scene(name).unwrap(), &shipped::operator(name).unwrap(), 1).unwrap()
}

/// What is reported of this kind.
fn printed(recording: &Recording, kind: &str) -> Vec<String> {
    let issues = frames(recording, &[ask_contact()]).unwrap().issues;
    let of_kind = issues.into_iter().filter(|issue| issue.kind == kind);
    of_kind.map(|issue| format!("{}: {}", issue.channel, issue.message)).collect()
}

#[test]
fn a_quaternion_in_another_order_is_reported() {
    let plain = taught("pick_and_place");
    assert_eq!(printed(&plain, "implausible_rotation"), [""; 0]);
    let mut said = vec![];
    for order in [["x", "y", "z", "w"], ["z", "w", "x", "y"]] {
        let mut log = plain.clone();
        for body in ["box", "block"] {
            let of = |letter: &str| plain.columns[&format!("{body}.rotation.{letter}")].values.clone();
            for (column, holds) in ["w", "x", "y", "z"].into_iter().zip(order) {
                log.columns[&format!("{body}.rotation.{column}")].values = of(holds);
            }
        }
        said.push(printed(&log, "implausible_rotation").join("\n"));
    }
    insta::assert_snapshot!(said.join("\n--\n"));
    // One that lies otherwise than the scene has it, beside one that is there, is in the order of that.
    let mut log = plain;
    for (column, value) in [("w", 0.0), ("x", 0.0), ("y", 0.0), ("z", 1.0)] {
        log.columns[&format!("block.rotation.{column}")].values.fill(value);
    }
    assert_eq!(printed(&log, "implausible_rotation"), [""; 0]);
}

#[test]
fn the_force_of_one_finger_that_is_turned_is_reported() {
    for name in shipped::names() {
        let plain = taught(name);
        assert_eq!(printed(&plain, "implausible_force"), [""; 0], "{name}");
    }
    let mut log = taught("pick_and_place");
    for axis in ["x", "y", "z"] {
        log.columns[&format!("right.thumb.force.{axis}")].values.iter_mut().for_each(|value| *value = -*value);
    }
    insta::assert_snapshot!(printed(&log, "implausible_force").join("\n"));
}

/// A can is 5 mm above the bottom of a bin of 150 mm, which the scene has as a solid: the shortest way out of its shape is down.
#[test]
fn what_rests_in_a_bin_without_a_cavity_is_not_pulled_down() {
    const SCENE: &str = "
bodies:
  can: {role: object, mass: 300 g, parts: [{box: [60 mm, 60 mm, 60 mm]}]}
  bin: {role: support, parts: [{box: [200 mm, 200 mm, 150 mm], at: [0 mm, 0 mm, 75 mm]}]}
hands: {right: {fingers: [thumb]}}
";
    let reported = |contact: &[(&str, &dyn Fn(f64) -> f64)]| {
        let mut columns: Vec<(&str, &dyn Fn(f64) -> f64)> = vec![
            ("right.thumb.position.x", &|_| 0.0),
            ("right.thumb.position.y", &|_| 0.0),
            ("right.thumb.position.z", &|_| 0.5),
            ("right.gripper.closed", &|t| f64::from(u8::from(t > 4.0))),
            ("can.position.x", &|_| 0.0),
            ("can.position.y", &|_| 0.0),
            ("can.position.z", &|_| 0.035),
        ];
        columns.extend(contact);
        let log = recording(SCENE, 100.0, 500, &columns);
        let found = frames(&log, &[ask("contacts.force")]).unwrap();
        assert!(super::column(&found, "contacts.force", 0, 2)[100] < -1.0);
        let issues = found.issues.into_iter().filter(|issue| issue.kind == "implausible_force");
        issues.map(|issue| issue.channel).collect::<Vec<_>>()
    };
    assert_eq!(reported(&[]), [""; 0]);
    assert_eq!(reported(&[("contact.can.bin", &|_| 1.0)]), [""; 0]);
    let logged: [(&str, &dyn Fn(f64) -> f64); 3] = [
        ("contact.can.bin.force.x", &|_| 0.0),
        ("contact.can.bin.force.y", &|_| 0.0),
        ("contact.can.bin.force.z", &|_| -3.0),
    ];
    assert_eq!(reported(&logged), ["contact.can.bin.force"]);
}

#[test]
fn a_velocity_that_is_not_that_of_the_pose_is_reported() {
    for name in shipped::names() {
        assert_eq!(printed(&taught(name), "implausible_velocity"), [""; 0], "{name}");
    }
    let (screw, carried) = (taught("turn_screw"), taught("pick_and_place"));
    let changed = |plain: &Recording, channel: &str, change: fn(f64) -> f64| {
        let mut log = plain.clone();
        let of_channel = log.columns.iter_mut().filter(|(name, _)| name.starts_with(channel));
        of_channel.for_each(|(_, column)| column.values.iter_mut().for_each(|value| *value = change(*value)));
        printed(&log, "implausible_velocity").join("\n")
    };
    let said = [
        changed(&screw, "screw.angular_velocity.z", |value| value + 0.3),
        changed(&screw, "screw.angular_velocity", f64::to_degrees),
        changed(&screw, "screw.velocity.x", |value| value - 0.02),
        changed(&carried, "box.velocity", |value| -value),
        changed(&carried, "box.velocity", |value| value * 1.2),
    ];
    insta::assert_snapshot!(said.join("\n--\n"));
    // A body that is set elsewhere in the middle does not contradict its velocity all along.
    let mut log = screw;
    let half = log.time.len() / 2;
    log.columns["screw.position.x"].values.iter_mut().skip(half).for_each(|value| *value += 0.3);
    assert_eq!(printed(&log, "implausible_velocity"), [""; 0]);
    // Nor does one that turns by more than a whole turn between two looks.
    let (mut log, rate) = (carried, 60.0);
    for (column, value) in [("w", f64::cos as fn(f64) -> f64), ("x", |_| 0.0), ("y", |_| 0.0), ("z", f64::sin)] {
        let values = log.time.iter().map(|time| value(rate * time / 2.0)).collect();
        log.columns[&format!("box.rotation.{column}")].values = values;
    }
    for (axis, value) in [("x", 0.0), ("y", 0.0), ("z", rate)] {
        log.columns[&format!("box.angular_velocity.{axis}")].values.fill(value);
    }
    assert_eq!(printed(&log, "implausible_velocity"), [""; 0]);
    log.columns["box.angular_velocity.z"].values.fill(-rate);
    assert_eq!(printed(&log, "implausible_velocity").len(), 1);
}

/// What a binding of this says of a log whose object is turned by an angle of time.
fn angles(folder: &std::path::Path, unit: &str, angle: impl Fn(f64) -> f64) -> Vec<String> {
    let (log, binding) = (folder.join("log.csv"), folder.join("binding.yaml"));
    let row = |row: u32| {
        let time = f64::from(row) / 100.0;
        format!("{time},0,0,{},0,0,0,0,0,{}\n", angle(time), 1.0 + f64::from(row % 7) * 1e-3)
    };
    let rows: String = (0..400).map(row).collect();
    std::fs::write(&log, format!("t,roll,pitch,yaw,x,y,z,fx,fy,fz\n{rows}")).unwrap();
    let text = format!(
        "time: t\nchannels:\n  right.thumb.position: <xyz>\n  right.thumb.force: f<xyz>\n  cube.rotation: <rpy=roll pitch yaw>{unit}\n\
         scene:\n  bodies:\n    cube: {{role: object, radius: 60 mm}}\n"
    );
    std::fs::write(&binding, text).unwrap();
    let opened = open(&OpenRequest { log, binding: Some(binding), ..OpenRequest::default() }).unwrap();
    opened.issues.iter().map(|issue| format!("{} {}: {}", issue.kind, issue.channel, issue.message)).collect()
}

#[test]
fn degrees_that_are_read_as_radians_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    insta::assert_snapshot!(angles(folder, "", |_| 90.0).join("\n"));
    // As a hand turns it, from nothing to 120 degrees in a second.
    let turned = |time: f64| 120.0 * time.min(1.0);
    assert_eq!(angles(folder, "", turned).len(), 1);
    assert_eq!(angles(folder, "", |time| (170.0 + 10.0 * time) % 360.0 - 180.0).len(), 1);
    assert_eq!(angles(folder, " [deg]", turned), [""; 0]);
    assert_eq!(angles(folder, " [deg]", |time| 720.0 * time), [""; 0]);
    // A bad sample is not a degree.
    for bad_s in [0.0, 0.5] {
        let printed = angles(folder, "", |time| if time == bad_s { 90.0 } else { 0.3 });
        assert!(printed.iter().all(|line| line.starts_with("impossible_jump ")), "{printed:?}");
        assert_eq!(printed.len(), 1);
    }
    // Turns that are counted.
    assert_eq!(angles(folder, "", |time| 12.0 * time), [""; 0]);
    assert_eq!(angles(folder, "", |time| (6.0 * time).sin() * 3.1), [""; 0]);
}
