//! Mistakes of a setup, planted in recordings that have none: each is reported with its number, and nothing is reported without it.

use super::{ask, ask_contact};
use crate::shared::recordings::recording;
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::PI;
use std::path::Path;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::units::Dimension;
use teachtree_frames::streaming::StreamedLog;
use teachtree_frames::{OpenRequest, frames, open};
use teachtree_logs::read::csv;
use teachtree_world::{shipped, teach};

/// The kinds of these mistakes.
const KINDS: [&str; 10] = [
    "changed_offset",
    "distant_tool_point",
    "hanging_object",
    "implausible_rotation",
    "implausible_unit",
    "inconsistent_hold",
    "misplaced_socket",
    "missing_body",
    "overlapping_bodies",
    "reversed_flag",
];

fn taught(scene: &str, operator: &str, seed: u64) -> Recording {
    teach(&shipped::scene(scene).unwrap(), &shipped::operator(operator).unwrap(), seed).unwrap()
}

/// The mistakes that are reported of a recording.
fn mistakes(recording: &Recording) -> Vec<String> {
    let issues = frames(recording, &[ask("target")]).unwrap().issues;
    let found = issues.into_iter().filter(|issue| KINDS.contains(&issue.kind.name()));
    found.map(|issue| format!("{} {}: {}", issue.kind, issue.channel, issue.message)).collect()
}

/// Multiplies the columns of these channels.
fn scale(log: &mut Recording, channels: &[&str], factor: f64) {
    for (name, column) in &mut log.columns {
        if channels.iter().any(|channel| name.starts_with(channel)) {
            column.values.iter_mut().for_each(|value| *value *= factor);
        }
    }
}

/// Noise of a standard deviation of about one that is the same in each run.
fn noise(t: f64, seed: f64) -> f64 {
    let uniform = |by: f64| (((t * 1e3).round() * by + seed * 37.7).sin() * 43_758.545_3).fract();
    uniform(12.9898) + uniform(78.233) + uniform(39.425)
}

/// A gripper with a sensor at its wrist, which puts a plug into the hole of a block; noise 0.1 mm and 0.15 N.
const PLUG: &str = "
bodies:
  plug: {role: object, mass: 100 g, plug: [0 mm, 0 mm, -30 mm], parts: [{box: [25 mm, 25 mm, 60 mm]}]}
  table: {role: support, position: [0 mm, 0 mm, -25 mm], parts: [{box: [1 m, 1 m, 50 mm]}]}
  block:
    role: socket
    position: [300 mm, 0 mm, 20 mm]
    sockets: {hole: {rim: [0 mm, 0 mm, 20 mm], axis: [0, 0, 1], radius: 10 mm, depth: 40 mm, accepts: [plug]}}
    parts: [
      {box: [20 mm, 68 mm, 40 mm], at: [24 mm, 0 mm, 0 mm]},
      {box: [20 mm, 68 mm, 40 mm], at: [-24 mm, 0 mm, 0 mm]},
      {box: [28 mm, 20 mm, 40 mm], at: [0 mm, 24 mm, 0 mm]},
      {box: [28 mm, 20 mm, 40 mm], at: [0 mm, -24 mm, 0 mm]}]
hands:
  right: {fingers: [thumb, palm]}
";

/// The tool point at times, s and m: to the plug, up, over the hole, into it, and away.
const PATH: [(f64, [f64; 3]); 9] = [
    (0.0, [0.0, -0.2, 0.3]),
    (1.0, [0.0, -0.2, 0.3]),
    (2.0, [0.0, 0.0, 0.04]),
    (2.5, [0.0, 0.0, 0.04]),
    (3.5, [0.0, 0.0, 0.2]),
    (5.0, [0.3, 0.0, 0.2]),
    (6.5, [0.3, 0.0, 0.04]),
    (7.0, [0.3, 0.0, 0.04]),
    (8.5, [0.0, -0.2, 0.3]),
];
/// The gripper is closed from and to, s.
const CLOSED: [f64; 2] = [2.3, 6.8];

fn tool(t: f64, axis: usize) -> f64 {
    let after = PATH.iter().position(|(at, _)| *at > t).unwrap_or(PATH.len() - 1);
    let ((from, one), (to, other)) = (PATH[after - 1], PATH[after]);
    let share = ((t - from) / (to - from)).clamp(0.0, 1.0);
    let smooth = share * share * (3.0 - 2.0 * share);
    one[axis] + (other[axis] - one[axis]) * smooth
}

fn plug_log() -> Recording {
    let closed = |t: f64| f64::from(u8::from((CLOSED[0]..CLOSED[1]).contains(&t)));
    let plug = |t: f64, axis: usize| {
        let carried = tool(t.clamp(CLOSED[0], CLOSED[1]), axis);
        carried - if axis == 2 { 0.01 } else { 0.0 } + 1e-4 * noise(t, axis as f64)
    };
    let hand = |t: f64, axis: usize| tool(t, axis) + 1e-4 * noise(t, 10.0 + axis as f64);
    let force = |t: f64, axis: usize| {
        0.15 * noise(t, 20.0 + axis as f64) + if axis == 2 && closed(t) > 0.0 { 0.98 } else { 0.0 }
    };
    recording(
        PLUG,
        100.0,
        1200,
        &[
            ("right.thumb.position.x", &|t| hand(t, 0)),
            ("right.thumb.position.y", &|t| hand(t, 1)),
            ("right.thumb.position.z", &|t| hand(t, 2)),
            ("right.palm.force.x", &|t| force(t, 0)),
            ("right.palm.force.y", &|t| force(t, 1)),
            ("right.palm.force.z", &|t| force(t, 2)),
            ("right.gripper.closed", &closed),
            ("plug.position.x", &|t| plug(t, 0)),
            ("plug.position.y", &|t| plug(t, 1)),
            ("plug.position.z", &|t| plug(t, 2)),
        ],
    )
}

#[test]
fn no_simulated_operator_has_one() {
    assert_eq!(mistakes(&plug_log()), [""; 0]);
    for name in shipped::names() {
        assert_eq!(mistakes(&taught(name, name, 2)), [""; 0], "{name}");
    }
    for (operator, scene) in shipped::failing() {
        assert_eq!(mistakes(&taught(scene, operator, 1)), [""; 0], "{operator}");
    }
}

#[test]
fn millimeters_that_are_read_as_meters_are_reported() {
    let (plug, place) = (plug_log(), taught("pick_and_place", "pick_and_place", 1));
    let with = |log: &Recording, channels: &[&str], factor: f64| {
        let mut log = log.clone();
        scale(&mut log, channels, factor);
        mistakes(&log).join("\n")
    };
    let found = [
        with(&plug, &["right.thumb.position"], 1e3),
        with(&plug, &["right.thumb.position"], 1e-3),
        with(&plug, &["plug.position"], 1e3),
        with(&plug, &["plug.position"], 1e-3),
        with(&plug, &["plug.position", "right.thumb.position"], 1e3),
        with(&plug, &["right.thumb.position"], 1e2),
        // One body of several, and one that stands still.
        with(&place, &["box.position"], 1e3),
        with(&place, &["block.position"], 1e3),
        with(&place, &["right.thumb.position", "right.index.position", "right.middle.position"], 1e3),
    ];
    insta::assert_snapshot!(found.join("\n--\n"));
}

#[test]
fn meters_that_are_read_as_millimeters_everywhere_are_reported() {
    let all =
        ["right.thumb.position", "right.index.position", "right.middle.position", "box.position", "block.position"];
    for (log, channels, found) in [
        (
            plug_log(),
            &["right.thumb.position", "plug.position"][..],
            "its gripper opens and closes, and it is never farther than ",
        ),
        (taught("pick_and_place", "pick_and_place", 1), &all[..], "its fingertips are at most "),
    ] {
        let mut log = log;
        scale(&mut log, channels, 1e-3);
        let issues = mistakes(&log).join("\n");
        let wanted = format!("implausible_unit right.thumb.position: {found}");
        let advice = "it is probably in m and read in mm or cm; write the unit after its columns, ` [m]`";
        assert!(issues.starts_with(&wanted) && issues.ends_with(advice), "{issues}");
    }
}

/// A plug that jumps out of its hole and back, 2 m/s fast: its steps in the hand are short beside that.
#[test]
fn one_fast_step_does_not_hide_a_wrong_unit() {
    let mut log = plug_log();
    let times = log.time.clone();
    let jump = |time: f64| (0.4 - 2.0 * (time - 9.2).abs()).max(0.0);
    let heights = &mut log.columns["plug.position.z"].values;
    heights.iter_mut().zip(times).for_each(|(height, time)| *height += jump(time));
    assert_eq!(mistakes(&log), [""; 0]);
    scale(&mut log, &["plug.position"], 1e-3);
    assert!(mistakes(&log).join("\n").starts_with("implausible_unit plug.position"), "{:?}", mistakes(&log));
}

#[test]
fn an_opening_of_no_gripper_is_reported() {
    let opens_to = |width: f64| {
        let mut log = plug_log();
        let opening = |closed: &f64| if *closed > 0.5 { 0.3 * width } else { width };
        let values = log.columns["right.gripper.closed"].values.iter().map(opening).collect();
        log.columns.insert("right.gripper.opening".into(), Column { dimension: Dimension::LENGTH, values });
        mistakes(&log)
    };
    for width in [2e-3, 0.08, 0.9] {
        assert_eq!(opens_to(width), [""; 0], "{width} m");
    }
    let advice = "it is probably in m and read in mm or cm; write the unit after its column, ` [m]`";
    let small =
        format!("implausible_unit right.gripper.opening: its usual openings are 0.024 mm and 0.080 mm: {advice}");
    assert_eq!(opens_to(80e-6), [small]);
    let advice = "it is probably in mm and read in a larger unit; write the unit after its column, ` [mm]`";
    let large =
        format!("implausible_unit right.gripper.opening: its usual openings are 24000 mm and 80000 mm: {advice}");
    assert_eq!(opens_to(80.0), [large]);
}

/// The mistakes of a recording in a scene with one body moved, m.
fn moved(log: &Recording, body: &str, by: [f64; 3]) -> String {
    let mut log = log.clone();
    for (position, by) in log.scene.bodies[body].position.iter_mut().zip(by) {
        position.0 += by;
    }
    mistakes(&log).join("\n")
}

#[test]
fn bodies_that_overlap_at_rest_and_objects_that_hang_are_reported() {
    let (plug, place) = (plug_log(), taught("pick_and_place", "pick_and_place", 1));
    let stack = taught("independent", "independent", 1);
    let found = [
        moved(&plug, "table", [0.0, 0.0, 0.03]),
        moved(&place, "base", [0.0, 0.0, 0.03]),
        moved(&stack, "base", [0.0, 0.0, 0.008]),
        moved(&plug, "table", [0.0, 0.0, -0.03]),
        moved(&place, "base", [0.0, 0.0, -0.03]),
        moved(&stack, "base", [0.0, 0.0, -0.008]),
        moved(&place, "base", [2.0, 0.0, 0.0]),
    ];
    insta::assert_snapshot!(found.join("\n--\n"));
    // Contacts from shapes allow for so much.
    assert_eq!(moved(&plug, "table", [0.0, 0.0, 0.004]), "");
    assert_eq!(moved(&place, "base", [0.0, 0.0, -0.004]), "");
    // One object of two whose origin is elsewhere.
    let mut log = place;
    log.columns["block.position.z"].values.iter_mut().for_each(|height| *height -= 0.025);
    insta::assert_snapshot!("one_object_of_two", mistakes(&log).join("\n"));
}

#[test]
fn a_socket_beside_the_insertions_is_reported() {
    let (plug, peg) = (plug_log(), taught("peg_in_hole", "peg_in_hole", 1));
    let mut without_shapes = plug.clone();
    without_shapes.scene.bodies["block"].parts.clear();
    without_shapes.scene.bodies["plug"].parts.clear();
    // It stands 20 mm higher at first, so that its height shows when it is in the hole.
    let times = without_shapes.time.clone();
    let heights = &mut without_shapes.columns["plug.position.z"].values;
    let pedestal = |t: f64| 0.02 * (3.5 - t).clamp(0.0, 1.0);
    heights.iter_mut().zip(times).for_each(|(height, time)| *height += pedestal(time));
    assert_eq!(mistakes(&without_shapes), [""; 0]);
    let ring = taught("ring_and_pole", "ring_and_pole", 1);
    let mut rim = ring;
    rim.scene.bodies["cylinder"].sockets["pole"].rim[0].0 += 0.02;
    let found = [
        moved(&plug, "block", [0.02, 0.0, 0.0]),
        moved(&peg, "holder", [0.0, -0.02, 0.0]),
        moved(&without_shapes, "block", [0.0, 0.02, 0.0]),
        mistakes(&rim).join("\n"),
    ];
    insta::assert_snapshot!(found.join("\n--\n"));
}

#[test]
fn an_object_whose_origin_stays_above_the_rim_is_reported_with_its_lower_end() {
    let mut log = taught("peg_pullout_from_hole", "peg_pullout_from_hole", 1);
    // The peg is 28 mm deep in the hole, and its origin is 12 mm above the rim.
    log.scene.bodies["holder"].sockets["hole"].rim[2].0 -= 0.012;
    assert_eq!(mistakes(&log), [""; 0]);
    log.scene.bodies["peg"].plug = None;
    let with_shape = mistakes(&log);
    log.scene.bodies["peg"].parts.clear();
    let without_shape = mistakes(&log);
    let lines = [
        (with_shape, "write `plug: [0 mm, 0 mm, -40 mm]`"),
        (without_shape, "write `plug` with its lower end, which is beyond `[0 mm, 0 mm, -12 mm]`"),
    ];
    for (found, line) in lines {
        let begin = "misplaced_socket peg.position: its origin never enters the socket `hole`, and rests 12 mm above";
        assert!(matches!(&found[..], [issue] if issue.starts_with(begin) && issue.contains(line)), "{found:?}");
    }
}

/// The bottom of the hole is as high as the table on which the plug stands before, and the body of the hole has no shape.
#[test]
fn a_socket_at_table_height_beside_the_insertions_is_reported() {
    let mut log = plug_log();
    log.scene.bodies["block"].parts.clear();
    assert_eq!(mistakes(&log), [""; 0]);
    for (by, distance, line) in [
        ([0.025, 0.0, 0.0], "25 mm", "`position: [300 mm, 0 mm, 20 mm]` of `block` instead of `[325 mm, 0 mm, 20 mm]`"),
        (
            [0.0, -0.015, 0.0],
            "15 mm",
            "`position: [300 mm, 0 mm, 20 mm]` of `block` instead of `[300 mm, -15 mm, 20 mm]`",
        ),
    ] {
        let found = moved(&log, "block", by);
        let begin =
            format!("misplaced_socket block.position: `plug` is inserted {distance} beside the socket `hole`, 40 mm");
        assert!(found.starts_with(&begin) && found.contains(line), "{found}");
    }
    // A wall may be between.
    assert_eq!(moved(&log, "block", [0.03, 0.0, 0.0]), "");
}

/// The plug is turned by 60° about the vertical and tilted while the gripper carries it; `read` are the places of w, x, y, z in the columns.
fn turned_plug(read: [(&str, [usize; 4]); 2]) -> Vec<String> {
    let mut log = plug_log();
    let turn = |time: f64| {
        let share = ((time - 3.5) / 1.5).clamp(0.0, 1.0);
        let tilt = 0.5 * (std::f64::consts::TAU * share).sin();
        UnitQuaternion::from_euler_angles(tilt, 0.6 * tilt, share * PI / 3.0)
    };
    let in_hand = UnitQuaternion::from_euler_angles(PI, 0.2, 0.3);
    for ((channel, places), of_body) in read.into_iter().zip([in_hand, UnitQuaternion::identity()]) {
        let turns = log.time.iter().map(|time| (turn(*time) * of_body).into_inner().coords);
        let parts: Vec<[f64; 4]> = turns.map(|q| [q.w, q.x, q.y, q.z]).collect();
        for (part, place) in ["w", "x", "y", "z"].into_iter().zip(places) {
            let values = parts.iter().map(|parts| parts[place]).collect();
            log.columns.insert(format!("{channel}.{part}"), Column { dimension: Dimension::NONE, values });
        }
    }
    mistakes(&log)
}

#[test]
fn quaternions_in_another_order_than_the_hand_are_reported() {
    let (right, scalar_last, scalar_first) = ([0, 1, 2, 3], [1, 2, 3, 0], [3, 0, 1, 2]);
    let with = |hand, plug| turned_plug([("right.palm.rotation", hand), ("plug.rotation", plug)]);
    assert_eq!(with(right, right), [""; 0]);
    for (found, channel, pattern) in [
        (with(scalar_last, right), "right.palm.rotation", "write `<xyzw=…>` instead of `<wxyz=…>`"),
        (with(right, scalar_last), "plug.rotation", "write `<xyzw=…>` instead of `<wxyz=…>`"),
        (with(scalar_first, right), "right.palm.rotation", "write `<wxyz=…>` instead of `<xyzw=…>`"),
        (with(right, scalar_first), "plug.rotation", "write `<wxyz=…>` instead of `<xyzw=…>`"),
    ] {
        let begin =
            format!("implausible_rotation {channel}: while the right hand grips `plug`, their turns differ by ");
        assert!(found.iter().any(|it| it.starts_with(&begin) && it.contains(pattern)), "{found:?}");
    }
}

#[test]
fn a_reversed_gripper_flag_is_reported() {
    let turn = |log: &mut Recording| {
        log.columns["right.gripper.closed"].values.iter_mut().for_each(|flag| *flag = 1.0 - *flag);
    };
    let mut plug = plug_log();
    turn(&mut plug);
    let mut place = taught("pick_and_place", "pick_and_place", 1);
    let force = |finger: &str| -> Vec<f64> {
        let part = |axis: &str| place.columns[&format!("right.{finger}.force.{axis}")].values.clone();
        let (x, y, z) = (part("x"), part("y"), part("z"));
        x.iter().zip(&y).zip(&z).map(|((x, y), z)| x.hypot(*y).hypot(*z)).collect()
    };
    let closed = force("thumb").iter().zip(force("index")).map(|(a, b)| f64::from(u8::from(a.min(b) > 0.05))).collect();
    place.columns.insert("right.gripper.closed".into(), Column { dimension: Dimension::NONE, values: closed });
    assert_eq!(mistakes(&place), [""; 0]);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let text = std::fs::read_to_string(root.join("demos/robosuite/lift_hdf5.binding.yaml")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let binding = folder.path().join("lift.binding.yaml");
    let mut found = vec![mistakes(&plug).join("\n")];
    for comparison in ["< 25 mm", "> 25 mm"] {
        std::fs::write(&binding, text.replace("< 25 mm", comparison)).unwrap();
        let log = root.join("demos/robosuite/lift.hdf5#demo_1");
        let opened = open(&OpenRequest { log, binding: Some(binding.clone()), ..OpenRequest::default() }).unwrap();
        found.push(mistakes(&opened.recording).join("\n"));
    }
    insta::assert_snapshot!(found.join("\n--\n"));
}

/// The recording with the tool point moved by a vector of its frame, m; the tool is turned about its z axis, which points downward, as it moves.
fn tool_point_at(offset: [f64; 3], has_rotation: bool) -> String {
    let mut log = plug_log();
    let turn = |time: f64| {
        Rotation3::from_axis_angle(&Vector3::z_axis(), time / 20.0) * Rotation3::from_axis_angle(&Vector3::x_axis(), PI)
    };
    let turns: Vec<Rotation3<f64>> = log.time.iter().map(|time| turn(*time)).collect();
    for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
        let values = &mut log.columns[&format!("right.thumb.position.{letter}")].values;
        values.iter_mut().zip(&turns).for_each(|(value, turn)| *value -= (turn * Vector3::from(offset))[axis]);
    }
    if has_rotation {
        for (part, letter) in ["w", "x", "y", "z"].into_iter().enumerate() {
            // nalgebra stores x y z w.
            let value = |turn: &Rotation3<f64>| UnitQuaternion::from_rotation_matrix(turn).coords[(part + 3) % 4];
            let column = Column { dimension: Dimension::NONE, values: turns.iter().map(value).collect() };
            log.columns.insert(format!("right.palm.rotation.{letter}"), column);
        }
    }
    mistakes(&log).join("\n")
}

#[test]
fn a_flange_that_is_bound_as_the_tool_point_is_reported() {
    let palm = "write `right.thumb.position: {at: [";
    let reported = |offset: [f64; 3], has_rotation: bool, parts: &[&str]| {
        let found = tool_point_at(offset, has_rotation);
        assert!(
            found.starts_with("distant_tool_point right.thumb.position: ") && found.lines().count() == 1,
            "{found}"
        );
        parts.iter().for_each(|part| assert!(found.contains(part), "{part}: {found}"));
    };
    let distance = "stays 130 mm from the surface of `plug`";
    reported([0.0, 0.0, 0.15], true, &[distance, &format!("{palm}0 mm, 0 mm, 160 mm], of: right.palm}}`")]);
    reported([0.0, 0.0, 0.15], false, &[distance, "bind the rotation of the flange as `right.palm.rotation`", palm]);
    reported([0.02, 0.0, 0.25], true, &["stays 230 mm", &format!("{palm}20 mm, 0 mm, 260 mm], of: right.palm}}`")]);
    reported([0.0, 0.15, 0.0], true, &["its position or that of the object is in another frame"]);
    // A fingertip may be so far from the surface.
    assert_eq!(tool_point_at([0.0, 0.0, 0.05], true), "");
    assert_eq!(tool_point_at([0.0; 3], true), "");
}

#[test]
fn holds_without_common_motion_are_reported() {
    let plug = plug_log();
    // The frame of the object is turned by 90° about the vertical.
    let turned = |log: &Recording, object: &str| {
        let mut log = log.clone();
        let [x, y] = ["x", "y"].map(|axis| log.columns[&format!("{object}.position.{axis}")].values.clone());
        log.columns[&format!("{object}.position.x")].values = y.iter().map(|y| -y).collect();
        log.columns[&format!("{object}.position.y")].values = x;
        mistakes(&log).join("\n")
    };
    // Its clock is late.
    let late = |log: &Recording, object: &str, rows: usize| {
        let mut log = log.clone();
        for axis in ["x", "y", "z"] {
            let column = &mut log.columns[&format!("{object}.position.{axis}")].values;
            let first = column[0];
            column.splice(0..0, std::iter::repeat_n(first, rows));
            column.truncate(log.time.len());
        }
        mistakes(&log).join("\n")
    };
    // The pose is of another thing, which goes round.
    let mut other = plug.clone();
    for (axis, value) in [("x", f64::sin as fn(f64) -> f64), ("y", f64::cos)] {
        other.columns[&format!("plug.position.{axis}")].values =
            plug.time.iter().map(|t| 0.1 * value(2.0 * t)).collect();
    }
    let found = [turned(&plug, "plug"), late(&plug, "plug", 180), mistakes(&other).join("\n")];
    insta::assert_snapshot!(found.join("\n--\n"));
}

#[test]
fn an_offset_of_a_force_sensor_that_changes_is_reported() {
    let shifted = |from_s: f64, by: f64| {
        let mut log = plug_log();
        let times = log.time.clone();
        let values = &mut log.columns["right.palm.force.x"].values;
        values.iter_mut().zip(times).filter(|(_, time)| *time >= from_s).for_each(|(value, _)| *value += by);
        mistakes(&log).join("\n")
    };
    // During the hold, in free motion, and less than a weight that turns.
    let found = [shifted(4.0, 3.0), shifted(8.4, -2.0)];
    insta::assert_snapshot!(found.join("\n--\n"));
    assert_eq!(shifted(4.0, 0.6), "");
}

#[test]
fn a_log_in_windows_has_the_mistakes_of_the_whole_log() {
    // Also with stamps that count from 1970.
    for zero_s in [0.0, 1.7e9] {
        let mut log = taught("several_tasks", "several_tasks", 1);
        log.scene.bodies["base"].position[2].0 += 0.03;
        log.time.iter_mut().for_each(|time| *time += zero_s);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        csv::write(&log, &path).unwrap();
        let request = OpenRequest { log: path, ..OpenRequest::default() };
        let whole = open(&request).unwrap().frames(&[ask_contact()]).unwrap().issues;
        let flow = StreamedLog::open(&request).and_then(|flow| flow.look_through(&[ask_contact()])).unwrap();
        assert_eq!((flow.zero_stamp_s, flow.time[0]), (zero_s, 0.0));
        let (_, flowing) = flow.parts(&mut |_| Ok(())).unwrap();
        assert_eq!(flowing, whole);
        assert!(whole.iter().any(|issue| issue.kind == "overlapping_bodies"));
    }
}
