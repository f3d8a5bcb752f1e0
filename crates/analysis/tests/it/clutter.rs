//! A hand without contact sensors among several objects: the same holds as with the one that it carries.

use teachtree_analysis::{Analysis, TrackId, analyze};
use teachtree_base::hands::Side;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::scene::Scene;
use teachtree_base::units::Dimension;
use teachtree_base::yaml;
use teachtree_engine::evaluator::evaluate;
use teachtree_language::graph::lower;
use teachtree_language::{Request, load};

const PAN: &str = "pan: {role: object, radius: 60 mm}";
const OTHERS: &str = "cup: {role: object, radius: 50 mm}, bowl: {role: object, radius: 80 mm}";

/// From 0 to 1 while `t` goes from `from` to `to`.
fn part(t: f64, from: f64, to: f64) -> f64 {
    let part = ((t - from) / (to - from)).clamp(0.0, 1.0);
    part * part * (3.0 - 2.0 * part)
}

/// A hand carries a pan by its handle over a cup and a bowl, and pauses over each.
fn log(bodies: &str) -> Recording {
    let pan = |t: f64| {
        let x = 0.3 * part(t, 1.8, 2.8) + 0.3 * part(t, 4.0, 5.0) + 0.2 * part(t, 6.5, 7.5);
        [x, 0.0, 0.02 + 0.08 * (part(t, 1.2, 1.8) - part(t, 7.5, 8.0))]
    };
    let hand = |t: f64| {
        let [x, y, z] = pan(t);
        [x + 0.15, y, z + 0.03 + 0.25 * (1.0 - part(t, 0.0, 1.0) + part(t, 8.5, 9.2))]
    };
    let place = |name: &str, t: f64| match name {
        "pan" => pan(t),
        "cup" => [0.45, 0.02, 0.05],
        _ => [0.75, -0.02, 0.05],
    };
    let time: Vec<f64> = (0..1000).map(|row| f64::from(row) / 100.0).collect();
    let text = format!("bodies: {{{bodies}}}\nhands: {{right: {{fingers: [thumb, index]}}}}");
    let scene: Scene = yaml::read(&text, "scene").unwrap();
    let mut log = Recording { time, scene, ..Recording::default() };
    let mut add = |name: String, value: &dyn Fn(f64) -> f64| {
        let values = log.time.iter().map(|time| value(*time)).collect();
        log.columns.insert(name, Column { dimension: Dimension::LENGTH, values });
    };
    for (at, axis) in ["x", "y", "z"].into_iter().enumerate() {
        for (finger, side) in [("thumb", -0.01), ("index", 0.01)] {
            let across = if at == 1 { side } else { 0.0 };
            add(format!("right.{finger}.position.{axis}"), &|t| hand(t)[at] + across);
        }
        for body in ["pan", "cup", "bowl"] {
            if bodies.contains(body) {
                add(format!("{body}.position.{axis}"), &|t| place(body, t)[at]);
            }
        }
    }
    log
}

fn analyzed(recording: &Recording) -> Analysis {
    let request = Request { hand_file: Some("hand_vision.rules".into()), ..Request::default() };
    let rules = load(&request).rules.unwrap();
    let frames = teachtree_frames::frames(recording, &teachtree_analysis::channels(&rules)).unwrap();
    analyze(&rules, &frames, &evaluate(&lower(&rules), &frames).unwrap())
}

/// The carries of the hand: the object, start and end, s.
fn carries(found: &Analysis) -> Vec<(Option<String>, f64, f64)> {
    let track = found.track(TrackId::Hand(Side::Right)).unwrap();
    let carries = track.relabeled.iter().filter(|segment| segment.primitive == "Translate");
    carries.map(|segment| (segment.subject.object.clone(), segment.start_s, segment.end_s)).collect()
}

#[test]
fn a_carry_past_other_objects_is_one_hold() {
    let alone = carries(&analyzed(&log(PAN)));
    assert_eq!(alone.len(), 1, "{alone:?}");
    let among = carries(&analyzed(&log(&format!("{PAN}, {OTHERS}"))));
    assert_eq!(among, alone);
}
