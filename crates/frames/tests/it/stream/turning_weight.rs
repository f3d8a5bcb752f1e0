//! Heavy tools that turn, on wrist sensors about whose tools a binding says nothing.

use crate::shared::files::folder;
use nalgebra::{UnitQuaternion, Vector3};
use std::fmt::Write as _;
use teachtree_frames::{OpenRequest, OpenedLog, open};

const BIAS: Vector3<f64> = Vector3::new(1.0, -2.0, 0.5);
/// When the tool presses, s.
const PRESSED: [(f64, f64); 3] = [(4.0, 4.6), (8.0, 8.4), (12.0, 13.0)];

/// A log of a tool of `mass` kg that turns by `angle` rad or so, and presses down by 25 N; the sensor is mounted in its own way. 16 s at 100 Hz.
fn log(mass: f64, angle: f64, pulled: f64) -> String {
    let mounted = UnitQuaternion::from_euler_angles(0.4, -0.2, 2.1);
    let mut text = String::from("time,fx,fy,fz,px,py,pz,qw,qx,qy,qz\n");
    for row in 0..1600 {
        let time = f64::from(row) / 100.0;
        let turn =
            UnitQuaternion::from_euler_angles(angle * (0.7 * time).sin(), angle * (0.5 * time).cos(), 0.2 * time);
        let is_pressed = PRESSED.iter().any(|(from, to)| (*from..*to).contains(&time));
        let pressed = Vector3::new(0.0, 0.0, if is_pressed { -25.0 } else { 0.0 });
        let person = Vector3::new((1.1 * time).sin(), (1.7 * time).cos(), (0.6 * time).sin()) * pulled;
        let weight = Vector3::new(0.0, 0.0, 9.81 * mass);
        let ripple = 0.1 * f64::from(row % 7 - 3);
        let read = BIAS + mounted * (turn.inverse() * (pressed + weight)) + person + Vector3::repeat(ripple);
        let _ = write!(text, "{time},{},{},{},{},0,0.2,", read.x, read.y, read.z, 0.02 * time);
        let _ = writeln!(text, "{},{},{},{}", turn.w, turn.i, turn.j, turn.k);
    }
    text
}

fn opened(text: &str, rotation: &str, sensors: &str) -> OpenedLog {
    let binding = format!(
        "hand_file: hand_wrist.rules
channels:
  right.palm.force: f<xyz>
  right.palm.position: p<xyz>
  tool.position: p<xyz>
  {rotation}: q<wxyz>
{sensors}
scene: {{bodies: {{tool: {{role: object, radius: 50 mm, fixed_to: right}}}}}}
"
    );
    let folder = folder(&[("log.csv", text), ("b.yaml", &binding)]);
    let [log, binding] = ["log.csv", "b.yaml"].map(|name| folder.path().join(name));
    open(&OpenRequest { log, binding: Some(binding), ..OpenRequest::default() }).unwrap()
}

/// The largest force without contact and the least one in contact, N.
fn forces(opened: &OpenedLog) -> (f64, f64) {
    let column = |axis: &str| &opened.recording.columns[&format!("right.palm.force.{axis}")].values;
    let (x, y, z) = (column("x"), column("y"), column("z"));
    let (mut free, mut contact) = (0.0_f64, f64::INFINITY);
    for (row, time) in opened.recording.time.iter().enumerate() {
        let force = Vector3::new(x[row], y[row], z[row]).norm();
        if PRESSED.iter().any(|(from, to)| (*from..*to).contains(time)) {
            contact = contact.min(force);
        } else {
            free = free.max(force);
        }
    }
    (free, contact)
}

fn weights(opened: &OpenedLog) -> Vec<&str> {
    opened.issues.iter().filter(|issue| issue.kind == "learned_weight").map(|it| it.message.as_str()).collect()
}

#[test]
fn what_the_orientation_explains_is_not_contact_however_the_sensor_is_mounted() {
    let text = log(2.0, 0.6, 0.0);
    let frame = "sensors: {right.palm.force: {frame: right.palm.rotation}}";
    for (rotation, sensors) in [("right.palm.rotation", ""), ("tool.rotation", ""), ("right.palm.rotation", frame)] {
        let opened = opened(&text, rotation, sensors);
        let (free, contact) = forces(&opened);
        assert!(free < 2.0 && contact > 20.0, "{rotation}: free up to {free} N, contact from {contact} N");
        let [message] = weights(&opened)[..] else { panic!("{:?}", opened.issues) };
        let mass = message.split("a tool of ").nth(1).unwrap().split(' ').next().unwrap().parse::<f64>().unwrap();
        assert!((mass - 2000.0).abs() < 100.0, "{message}");
    }
}

#[test]
fn a_weight_that_the_binding_names_is_not_learned() {
    let opened = opened(&log(2.0, 0.6, 0.0), "right.palm.rotation", "sensors: {right.palm.force: {tool: 0 g}}");
    let (free, _) = forces(&opened);
    assert!(free > 15.0 && weights(&opened).is_empty(), "{free} N");
}

#[test]
fn forces_that_do_not_turn_with_the_tool_are_left_as_they_are() {
    // A light tool, one that hardly turns, and a person who pulls as much as the tool weighs.
    for (mass, angle, pulled) in [(0.1, 0.6, 0.0), (2.0, 0.02, 0.0), (0.5, 0.3, 6.0)] {
        let opened = opened(&log(mass, angle, pulled), "right.palm.rotation", "");
        assert_eq!(weights(&opened), Vec::<&str>::new(), "{mass} kg, {angle} rad, {pulled} N");
    }
}
