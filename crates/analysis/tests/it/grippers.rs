//! Two grippers of which the closed flags and the positions are known, and one object.

use teachtree_analysis::{Analysis, TrackId, analyze};
use teachtree_base::recording::{Column, Recording};
use teachtree_base::scene::Scene;
use teachtree_base::units::Dimension;
use teachtree_base::yaml;
use teachtree_engine::evaluator::evaluate;
use teachtree_language::graph::lower;
use teachtree_language::{Request, load};

const SCENE: &str =
    "{bodies: {bar: {role: object, radius: 100 mm}}, hands: {left: {fingers: [thumb]}, right: {fingers: [thumb]}}}";

/// Two grippers so far apart, m, that close at 0.5 s, at the bar and beside it, and move it by 0.3 m from 1 s to 3 s.
fn log(apart: f64) -> Recording {
    let along = |t: f64| 0.3 * ((t - 1.0) / 2.0).clamp(0.0, 1.0);
    let scene: Scene = yaml::read(SCENE, "scene").unwrap();
    let time: Vec<f64> = (0..200).map(|row| f64::from(row) / 50.0).collect();
    let mut log = Recording { time, scene, ..Recording::default() };
    let mut add = |name: &str, dimension: Dimension, value: &dyn Fn(f64) -> f64| {
        let values = log.time.iter().map(|time| value(*time)).collect();
        log.columns.insert(name.into(), Column { dimension, values });
    };
    for (name, x) in [("left.thumb", -apart), ("right.thumb", 0.05), ("bar", 0.0)] {
        add(&format!("{name}.position.x"), Dimension::LENGTH, &|_| x);
        add(&format!("{name}.position.y"), Dimension::LENGTH, &along);
        add(&format!("{name}.position.z"), Dimension::LENGTH, &|_| 0.0);
    }
    for side in ["left", "right"] {
        add(&format!("{side}.gripper.closed"), Dimension::NONE, &|t| if t < 0.5 { 0.0 } else { 1.0 });
    }
    log
}

/// Whether both hands hold the bar together at some time.
fn share(log: &Recording) -> bool {
    let request = Request {
        files: vec!["bimanual.rules".into()],
        hand_file: Some("hand_gripper.rules".into()),
        ..Request::default()
    };
    let rules = load(&request).rules.unwrap();
    let frames = teachtree_frames::frames(log, &teachtree_analysis::channels(&rules)).unwrap();
    let found: Analysis = analyze(&rules, &frames, &evaluate(&lower(&rules), &frames).unwrap());
    let both = found.track(TrackId::Both).unwrap();
    both.segments.iter().any(|segment| segment.primitive == "EqualGrasp")
}

#[test]
fn grippers_far_apart_do_not_hold_one_object() {
    assert!(share(&log(0.15)), "0.2 m apart, on a bar of 0.2 m");
    assert!(!share(&log(0.68)), "0.73 m apart");
}
