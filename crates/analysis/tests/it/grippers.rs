//! Two grippers of which the closed flags and the positions are known, and one object.

use std::ops::Range;
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

/// Two grippers so far apart, m, at the bar and beside it, which move by 0.3 m with it from 1 s to 3 s. Each is closed in an interval, s: the left one, the right one.
fn log(apart: f64, closed: [Range<f64>; 2]) -> Recording {
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
    for (side, closed) in ["left", "right"].into_iter().zip(closed) {
        add(&format!("{side}.gripper.closed"), Dimension::NONE, &|t| f64::from(u8::from(closed.contains(&t))));
    }
    log
}

/// The primitives of both hands together.
fn together(log: &Recording) -> Vec<String> {
    let request = Request {
        files: vec!["bimanual.rules".into()],
        hand_file: Some("hand_gripper.rules".into()),
        ..Request::default()
    };
    let rules = load(&request).rules.unwrap();
    let frames = teachtree_frames::frames(log, &teachtree_analysis::channels(&rules)).unwrap();
    let found: Analysis = analyze(&rules, &frames, &evaluate(&lower(&rules), &frames).unwrap());
    let both = found.track(TrackId::Both).unwrap();
    both.relabeled.iter().map(|segment| segment.primitive.clone()).collect()
}

#[test]
fn grippers_far_apart_do_not_hold_one_object() {
    let closed = [0.5..4.0, 0.5..4.0];
    assert_eq!(together(&log(0.15, closed.clone())), ["EqualGrasp"], "0.2 m apart, on a bar of 0.2 m");
    assert!(together(&log(0.68, closed)).is_empty(), "0.73 m apart");
}

/// The left gripper opens before the right one closes. For a short time neither holds the bar.
#[test]
fn a_hand_over_may_have_a_gap() {
    for (from_s, passed) in [(1.8, true), (2.1, true), (2.3, true), (2.6, true), (3.0, false)] {
        let found = together(&log(0.15, [0.5..2.0, from_s..4.0]));
        assert_eq!(found, if passed { vec!["Pass"] } else { vec![] }, "the right one closes at {from_s} s");
    }
}
