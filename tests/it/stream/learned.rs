//! What a binding has learned from the log, in the analysis: the bias of a sensor, the place of a fixture.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use std::fmt::Write;
use teachtree::{Log, Rules};
use teachtree_base::quantity::Quantity;
use teachtree_base::recording::Recording;
use teachtree_base::scene::Scene;
use teachtree_world::{shipped, teach};

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
    assert_eq!(issues, [""; 0]);
    // A place that is learned to fractions of a millimeter moves a boundary by a row.
    let times = |segments: &[String]| -> Vec<f64> {
        let numbers =
            segments.iter().flat_map(|segment| segment.split([' ', ',']).filter_map(|word| word.parse().ok()));
        numbers.collect()
    };
    let (of_found, of_wanted) = (times(&found), times(&wanted));
    assert_eq!(of_found.len(), of_wanted.len(), "{found:?}");
    assert!(of_found.iter().zip(&of_wanted).all(|(one, other)| (one - other).abs() < 0.0015), "{found:?} {wanted:?}");
    let names =
        |segments: &[String]| segments.iter().map(|it| it.split(',').next().unwrap().to_string()).collect::<Vec<_>>();
    assert_eq!(names(&found), names(&wanted));
}

#[test]
fn a_fixture_that_is_never_touched_has_no_place() {
    let recording = peg_in_hole();
    let places = "places: {holder: {by: peg, when: first_contact, above: 900 N}}";
    let (found, issues) = told(&recording, Point3::origin(), places);
    assert_eq!(issues, ["unknown_place"]);
    assert!(!found.iter().any(|segment| segment.contains("Insert")), "{found:?}");
}
