//! What a binding has learned from the log: the weight of a tool, the place of a fixture.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use std::fmt::Write;
use std::path::Path;
use teachtree::{Log, Rules};
use teachtree_base::quantity::Quantity;
use teachtree_base::recording::Recording;
use teachtree_base::scene::Scene;
use teachtree_frames::{OpenRequest, OpenedLog, open};
use teachtree_world::{shipped, teach};

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
    let told: Vec<String> = opened.issues.iter().map(|issue| issue.message.clone()).collect();
    assert_eq!(told, ["a tool of 430 g and a bias of 4.328 N are learned and subtracted"]);
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
fn a_force_of_the_other_sign_is_weighed_and_told() {
    let folder = tempfile::tempdir().unwrap();
    let opened = wrist_that_works(0.6, 0.0, -1.0, folder.path());
    let told: Vec<String> = opened.issues.iter().map(|issue| issue.message.clone()).collect();
    assert!(told.len() == 1 && told[0].contains("opposite sign: bind it with a minus"), "{told:?}");
    assert!((force(&opened.recording, 500) - Vector3::new(-3.0, 0.0, 12.0)).norm() < 0.08);
}

/// A tool of 1 kg that does not turn, on a biased sensor: the surface on which it stands from 4 s to 7 s bears some of its weight, so that the reading is smaller.
#[test]
fn what_a_recording_begins_and_ends_with_is_without_contact() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from("time,fx,fy,fz\n");
    for row in 0..1000 {
        let time = f64::from(row) / 100.0;
        let pushed = if (4.0..7.0).contains(&time) { -6.0 } else { 0.0 };
        let _ = writeln!(text, "{time},1.0,{},{}", 0.01 * f64::from(row % 7 - 3), 9.81 + pushed);
    }
    let [log, file] = ["log.csv", "log.yaml"].map(|name| folder.path().join(name));
    std::fs::write(&log, text).unwrap();
    let scene = "scene: {bodies: {tool: {role: object, radius: 30 mm, fixed_to: right}, table: {role: support}}}";
    std::fs::write(&file, format!("hand_file: hand_wrist.rules\nchannels: {{right.palm.force: f<xyz>}}\n{scene}\n"))
        .unwrap();
    let log = Log::options().binding(&file).open(&log).unwrap();
    let analysis = Rules::for_log(&log).unwrap().analyze(&log).unwrap();
    let biased: Vec<String> = analysis.issues().iter().map(|issue| issue.message.clone()).collect();
    assert!(biased.iter().any(|message| message.starts_with("reads 9.861 N without contact")), "{biased:?}");
    let pressed: Vec<String> = analysis.segments().into_iter().map(|segment| segment.to_string()).collect();
    assert!(pressed.iter().any(|segment| segment.contains("Press") && segment.contains("4.000")), "{pressed:?}");
}

#[test]
fn the_weight_of_a_tool_that_hardly_turns_is_not_made_up() {
    let folder = tempfile::tempdir().unwrap();
    let opened = wrist(0.02, folder.path());
    let kinds: Vec<String> = opened.issues.iter().map(|issue| issue.kind.to_string()).collect();
    assert_eq!(kinds, ["unknown_weight"]);
    assert!((force(&opened.recording, 0) - BIAS).norm() > 4.0, "nothing is subtracted");
}

/// A demonstration of a peg in a hole.
fn peg_in_hole() -> Recording {
    teach(&shipped::scene("peg_in_hole").unwrap(), &shipped::operator("peg_in_hole").unwrap(), 1).unwrap()
}

/// The plug point of the peg in a row, reference frame, m.
fn plug(recording: &Recording, row: usize) -> Point3<f64> {
    let value = |part: &str| recording.columns[&format!("peg.{part}")].values[row];
    let turn =
        nalgebra::Quaternion::new(value("rotation.w"), value("rotation.x"), value("rotation.y"), value("rotation.z"));
    let at = Vector3::new(value("position.x"), value("position.y"), value("position.z"));
    let plug = recording.scene.bodies["peg"].plug.map_or(Vector3::zeros(), |plug| plug.map(|length| length.0).into());
    Point3::from(at + UnitQuaternion::from_quaternion(turn) * plug)
}

/// The primitives of the right hand where the holder's place is as `places` says, its position in the scene counted from `from`, reference frame, m.
fn told(recording: &Recording, from: Point3<f64>, places: &str) -> (Vec<String>, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let [log, binding, scene] = ["log.csv", "log.yaml", "other.yaml"].map(|name| folder.path().join(name));
    teachtree_logs::read::formats::write(recording, &log).unwrap();
    let mut moved: Scene = recording.scene.clone();
    let holder = moved.bodies.get_mut("holder").unwrap();
    for (length, from) in holder.position.iter_mut().zip(&from.coords) {
        *length = Quantity(length.0 - from);
    }
    std::fs::write(&binding, places).unwrap();
    std::fs::write(&scene, serde_json::to_string(&moved).unwrap()).unwrap();
    let log = Log::options().binding(&binding).scene(&scene).open(&log).unwrap();
    let analysis = Rules::for_log(&log).unwrap().analyze(&log).unwrap();
    let issues = analysis.issues().iter().map(|issue| issue.kind.to_string()).filter(|kind| kind == "unknown_place");
    (analysis.segments().into_iter().map(|segment| segment.to_string()).collect(), issues.collect())
}

#[test]
fn a_fixture_is_where_the_object_came_to_rest_in_it() {
    let recording = peg_in_hole();
    let rest = plug(&recording, recording.time.len() - 1);
    let (wanted, _) = told(&recording, Point3::origin(), "{}");
    assert!(wanted.iter().any(|segment| segment.contains("Insert")), "{wanted:?}");
    let (elsewhere, _) = told(&recording, rest, "{}");
    assert!(!elsewhere.iter().any(|segment| segment.contains("Insert")), "{elsewhere:?}");
    let (found, issues) = told(&recording, rest, "places: {holder: {by: peg, when: rest}}");
    assert_eq!((found, issues), (wanted, vec![]));
}

#[test]
fn a_fixture_that_is_never_touched_has_no_place() {
    let recording = peg_in_hole();
    let places = "places: {holder: {by: peg, when: first_contact, above: 900 N}}";
    let (found, issues) = told(&recording, Point3::origin(), places);
    assert_eq!(issues, ["unknown_place"]);
    assert!(!found.iter().any(|segment| segment.contains("Insert")), "{found:?}");
}
