//! What is written is read back to the same bits, whole or not at all.

use crate::shared::recordings::recording;
use proptest::prelude::*;
use teachtree_base::recording::{Column, Event, Recording};
use teachtree_base::units::Dimension;
use teachtree_frames::OpenRequest;
use teachtree_frames::open;
use teachtree_logs::read::csv;

const SCENE: &str = "
name: box
bodies:
  cube: {role: object, mass: 50 g, position: [0.1 m, 0.2 m, 60 mm], parts: [{box: [120 mm, 120 mm, 120 mm]}]}
  base: {role: support}
hands:
  right: {fingers: [thumb, index]}
";

#[test]
fn a_recording_survives_writing_and_reading() {
    let mut written = recording(
        SCENE,
        1000.0,
        50,
        &[("cube.position.x", &|t| (t * 7.0).sin() / 3.0), ("right.thumb.force.z", &|t| -0.0 * t)],
    );
    written.labels.insert(
        "right.label".into(),
        (0..50).map(|row| if row < 20 { "Move".into() } else { "a, \"b\"".into() }).collect(),
    );
    written.events =
        vec![Event { time_s: 0.02, kind: "contact_made".into(), subjects: vec!["right.thumb".into(), "cube".into()] }];
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("demonstration.csv");
    csv::write(&written, &log).unwrap();
    let opened = open(&OpenRequest { log, ..OpenRequest::default() }).unwrap();
    assert_eq!(opened.recording, written);
    assert_eq!(opened.issues, []);
    let mut files: Vec<String> =
        folder.path().read_dir().unwrap().map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    files.sort();
    assert_eq!(files, ["demonstration.csv", "demonstration.events.csv", "demonstration.scene.yaml"]);
}

#[test]
fn the_scene_may_also_carry_the_whole_name_of_the_log() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("demonstration.csv");
    csv::write(&recording(SCENE, 100.0, 3, &[]), &log).unwrap();
    std::fs::rename(folder.path().join("demonstration.scene.yaml"), folder.path().join("demonstration.csv.scene.yaml"))
        .unwrap();
    assert_eq!(csv::read(&log, None).unwrap().recording.scene.name, "box");
}

#[test]
fn a_log_that_cannot_be_written_leaves_the_old_one() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("demonstration.csv");
    let whole = recording(SCENE, 100.0, 3, &[]);
    csv::write(&whole, &log).unwrap();
    let mut broken = whole.clone();
    broken.columns.insert("cube.position.x".into(), Column { dimension: Dimension::LENGTH, values: vec![1.0] });
    assert!(csv::write(&broken, &log).is_err());
    assert_eq!(csv::read(&log, None).unwrap().recording, whole);
    assert!(csv::write(&whole, &folder.path().join("no/such/folder.csv")).is_err());
}

proptest! {
    #[test]
    fn every_number_survives(values in prop::collection::vec(prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO, 2..20)) {
        let mut written = Recording { time: (0..values.len()).map(|row| row as f64 * 0.1).collect(), ..Recording::default() };
        written.columns.insert("cube.position.x".into(), Column { dimension: Dimension::LENGTH, values });
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("numbers.csv");
        csv::write(&written, &log).unwrap();
        let read = csv::read(&log, None).unwrap().recording;
        let bits = |recording: &Recording| -> Vec<u64> { recording.columns["cube.position.x"].values.iter().map(|value| value.to_bits()).collect() };
        prop_assert_eq!(bits(&read), bits(&written));
        prop_assert_eq!(&read.time, &written.time);
    }
}
