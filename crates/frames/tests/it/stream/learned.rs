//! What a binding has learned from the log: the weight of a tool.

use nalgebra::{UnitQuaternion, Vector3};
use std::fmt::Write;
use std::path::Path;
use teachtree_base::recording::Recording;
use teachtree_frames::{OpenRequest, OpenedLog, open};

/// The mass of the tool, kg, and the bias of the sensor, N.
const MASS: f64 = 0.43;
const BIAS: Vector3<f64> = Vector3::new(1.5, -0.7, 4.0);

/// A log of a wrist that turns by up to `angle` about two axes, with a tool, and pushes down by 12 N from 4 s to 7 s; 10 s at 100 Hz.
fn wrist(angle: f64, folder: &Path) -> OpenedLog {
    wrist_that_works(angle, 0.0, 1.0, folder)
}

/// The same in which the tool works for `longer` at 7 s, s, without turning, and whose force is read with a sign.
fn wrist_that_works(angle: f64, longer: f64, sign: f64, folder: &Path) -> OpenedLog {
    let mut text = String::from("time,fx,fy,fz,qw,qx,qy,qz\n");
    for row in 0..1000 + (longer * 100.0) as i32 {
        let stamp = f64::from(row) / 100.0;
        let time = if stamp < 6.99 { stamp } else { (stamp - longer).max(6.99) };
        let turn =
            UnitQuaternion::from_euler_angles(angle * (1.3 * time).sin(), angle * (0.9 * time).cos(), 0.2 * time);
        let pushed = if (4.0..7.0).contains(&time) { Vector3::new(3.0, 0.0, -12.0) } else { Vector3::zeros() };
        let weight = Vector3::new(0.0, 0.0, -9.81 * MASS);
        let ripple = 0.01 * f64::from(row % 7 - 3);
        let read = BIAS + turn.inverse() * (pushed - weight) * sign + Vector3::repeat(ripple);
        let _ = writeln!(text, "{stamp},{},{},{},{},{},{},{}", read.x, read.y, read.z, turn.w, turn.i, turn.j, turn.k);
    }
    opened(&text, BINDING, folder)
}

/// A tool of `mass` kg that a person leads: it moves freely for 2 s and 1.5 s, and wipes in between with 20 N or so, turned as the surface is; the person
/// pulls with 2 N or so. Each `number` is another recording of it.
fn wiping(mass: f64, number: u32, folder: &Path) -> OpenedLog {
    let mut text = String::from("time,fx,fy,fz,qw,qx,qy,qz\n");
    let phase = f64::from(number);
    for row in 0..1200 {
        let time = f64::from(row) / 100.0;
        let (one, other) = ((0.9 * time + phase).sin(), (0.7 * time + 2.0 * phase).cos());
        let turn = UnitQuaternion::from_euler_angles(0.3 * one, 0.2 * other, 0.0);
        let rubbed = if (2.0..10.5).contains(&time) {
            Vector3::new(6.0 * other, 4.0 * one, -20.0 - 5.0 * (0.4 * time + 3.0 * phase).sin())
        } else {
            Vector3::zeros()
        };
        let pulled = Vector3::new((1.1 * time + phase).sin(), (0.8 * time).cos(), (0.5 * time + phase).cos()) * 2.0;
        let read = BIAS + rubbed + pulled + turn.inverse() * Vector3::new(0.0, 0.0, 9.81 * mass);
        let _ = writeln!(text, "{time},{},{},{},{},{},{},{}", read.x, read.y, read.z, turn.w, turn.i, turn.j, turn.k);
    }
    opened(&text, BINDING, folder)
}

const BINDING: &str = "hand_file: hand_wrist.rules
channels:
  right.palm.force: f<xyz>
  right.palm.rotation: q<wxyz>
sensors:
  right.palm.force: {frame: right.palm.rotation, tool: learned}
scene: {bodies: {table: {role: support}}}
";

fn opened(text: &str, binding: &str, folder: &Path) -> OpenedLog {
    let [log, file] = [folder.join("wrist.csv"), folder.join("wrist.yaml")];
    std::fs::write(&log, text).unwrap();
    std::fs::write(&file, binding).unwrap();
    open(&OpenRequest { log, binding: Some(file), ..OpenRequest::default() }).unwrap()
}

/// The mass and its error in the message of a learned weight, g.
fn learned_mass(message: &str) -> Option<(f64, f64)> {
    let (mass, rest) = message.strip_prefix("a tool of ")?.split_once(" ± ")?;
    Some((mass.parse().ok()?, rest.split_once(" g")?.0.parse().ok()?))
}

fn force(recording: &Recording, row: usize) -> Vector3<f64> {
    Vector3::from(["x", "y", "z"].map(|axis| recording.columns[&format!("right.palm.force.{axis}")].values[row]))
}

#[test]
fn weight_and_bias_are_learned_from_a_tool_that_turns() {
    let folder = tempfile::tempdir().unwrap();
    let opened = wrist(0.6, folder.path());
    let messages: Vec<String> = opened.issues.iter().map(|issue| issue.message.clone()).collect();
    let [message] = messages.as_slice() else { panic!("{messages:?}") };
    assert_eq!(learned_mass(message).map(|(mass, _)| mass), Some(430.0), "{message}");
    assert!(learned_mass(message).is_some_and(|(_, error)| (0.0..20.0).contains(&error)), "{message}");
    assert!(message.contains("and a bias of 4.328 ± 0."), "{message}");
    for row in (0..1000).step_by(50) {
        let pushed = if (400..700).contains(&row) { Vector3::new(3.0, 0.0, -12.0) } else { Vector3::zeros() };
        let found = force(&opened.recording, row);
        // The ripple of the sensor is 0.03 N on each axis.
        assert!((found - pushed).norm() < 0.08, "row {row}: {found}, pushed {pushed}");
    }
}

#[test]
fn a_tool_that_works_for_long_is_weighed_while_it_turns() {
    let folder = tempfile::tempdir().unwrap();
    // It is in contact for 23 of 30 s.
    let opened = wrist_that_works(0.6, 20.0, 1.0, folder.path());
    for row in [0, 300, 2800, 2999] {
        let found = force(&opened.recording, row);
        assert!(found.norm() < 0.08, "row {row}: {found}, free");
    }
    let found = force(&opened.recording, 1500);
    assert!((found - Vector3::new(3.0, 0.0, -12.0)).norm() < 0.08, "{found}");
}

#[test]
fn a_force_of_the_other_sign_is_weighed_and_reported() {
    let folder = tempfile::tempdir().unwrap();
    let opened = wrist_that_works(0.6, 0.0, -1.0, folder.path());
    let messages: Vec<String> = opened.issues.iter().map(|issue| issue.message.clone()).collect();
    assert!(messages.len() == 1 && messages[0].contains("opposite sign: bind it with a minus"), "{messages:?}");
    assert!((force(&opened.recording, 500) - Vector3::new(-3.0, 0.0, 12.0)).norm() < 0.08);
}

#[test]
fn the_weight_of_a_tool_that_hardly_turns_is_not_made_up() {
    let folder = tempfile::tempdir().unwrap();
    let opened = wrist(0.02, folder.path());
    let kinds: Vec<String> = opened.issues.iter().map(|issue| issue.kind.to_string()).collect();
    assert_eq!(kinds, ["unknown_weight"]);
    assert!(opened.issues[0].message.contains("it hardly turns"), "{}", opened.issues[0].message);
    assert!((force(&opened.recording, 0) - BIAS).norm() > 4.0, "nothing is subtracted");
}

#[test]
fn a_mass_that_the_readings_contradict_is_refused_with_its_uncertainty() {
    let folder = tempfile::tempdir().unwrap();
    let mut uncertain = 0;
    for number in 0..8 {
        let opened = wiping(0.3, number, folder.path());
        let [issue] = opened.issues.as_slice() else { panic!("{:?}", opened.issues) };
        assert_eq!(issue.kind, "unknown_weight", "{}", issue.message);
        assert!(issue.message.contains("nothing is subtracted"), "{}", issue.message);
        uncertain += u32::from(issue.message.contains("the best fit is ") && issue.message.contains(" ± "));
        assert!((force(&opened.recording, 0) - BIAS).norm() > 1.0, "nothing is subtracted");
    }
    assert!(uncertain >= 4, "{uncertain} of 8");
}

#[test]
fn a_contact_that_lasts_is_not_the_bias_of_the_sensor() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from("time,fx,fy,fz,qw,qx,qy,qz\n");
    for row in 0..1500 {
        let time = f64::from(row) / 100.0;
        let turn = UnitQuaternion::from_euler_angles(0.5 * (1.3 * time).sin(), 0.4 * (0.9 * time).cos(), 0.0);
        // It presses with the same force in its own frame, in whatever way it is turned.
        let pressed = if (1.0..14.0).contains(&time) { Vector3::new(0.0, 0.0, -20.0) } else { Vector3::zeros() };
        let read = BIAS + pressed + turn.inverse() * Vector3::new(0.0, 0.0, 9.81 * MASS);
        let _ = writeln!(text, "{time},{},{},{},{},{},{},{}", read.x, read.y, read.z, turn.w, turn.i, turn.j, turn.k);
    }
    let opened = opened(&text, BINDING, folder.path());
    let [issue] = opened.issues.as_slice() else { panic!("{:?}", opened.issues) };
    assert!(issue.message.contains("N off at its beginning and at its end"), "{}", issue.message);
}
