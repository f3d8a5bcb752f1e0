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
    let binding = "hand_file: hand_wrist.rules
channels:
  right.palm.force: f<xyz>
  right.palm.rotation: q<wxyz>
sensors:
  right.palm.force: {frame: right.palm.rotation, tool: learned}
scene: {bodies: {table: {role: support}}}
";
    let [log, file] = [folder.join("wrist.csv"), folder.join("wrist.yaml")];
    std::fs::write(&log, text).unwrap();
    std::fs::write(&file, binding).unwrap();
    open(&OpenRequest { log, binding: Some(file), ..OpenRequest::default() }).unwrap()
}

fn force(recording: &Recording, row: usize) -> Vector3<f64> {
    Vector3::from(["x", "y", "z"].map(|axis| recording.columns[&format!("right.palm.force.{axis}")].values[row]))
}

#[test]
fn weight_and_bias_are_learned_from_a_tool_that_turns() {
    let folder = tempfile::tempdir().unwrap();
    let opened = wrist(0.6, folder.path());
    let messages: Vec<String> = opened.issues.iter().map(|issue| issue.message.clone()).collect();
    assert_eq!(messages, ["a tool of 430 g and a bias of 4.328 N are learned and subtracted"]);
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
    assert!((force(&opened.recording, 0) - BIAS).norm() > 4.0, "nothing is subtracted");
}
