//! Bodies that are lost for longer than drop-outs are bridged.

use super::{ask, column};
use crate::shared::recordings::recording;
use std::ops::Range;
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;
use teachtree_frames::frames;

const SCENE: &str = "
bodies:
  left_box: {role: object, radius: 50 mm}
  right_box: {role: object, radius: 50 mm}
hands:
  left: {fingers: [thumb]}
  right: {fingers: [thumb]}
";

/// Each hand moves its box, 0.8 m apart from the other one; the left box is not seen from 2 s to 3 s.
fn log(far: f64) -> Recording {
    let x = |t: f64| 0.1 * t;
    let other_x = move |t: f64| far + 0.1 * t;
    let lost_x = |t: f64| if (2.0..3.0).contains(&t) { f64::NAN } else { x(t) };
    let lost = |t: f64| if (2.0..3.0).contains(&t) { f64::NAN } else { 0.0 };
    let zero = |_: f64| 0.0;
    recording(
        SCENE,
        100.0,
        500,
        &[
            ("left.thumb.position.x", &x),
            ("left.thumb.position.y", &zero),
            ("left.thumb.position.z", &zero),
            ("right.thumb.position.x", &other_x),
            ("right.thumb.position.y", &zero),
            ("right.thumb.position.z", &zero),
            ("left_box.position.x", &lost_x),
            ("left_box.position.y", &lost),
            ("left_box.position.z", &lost),
            ("right_box.position.x", &other_x),
            ("right_box.position.y", &zero),
            ("right_box.position.z", &zero),
        ],
    )
}

#[test]
fn only_the_hand_that_involves_a_lost_body_loses_frames() {
    let frames = frames(&log(0.8), &[ask("target.position")]).unwrap();
    let only = |rows: Range<usize>| vec![rows];
    assert_eq!(frames.stretches, only(0..500));
    assert_eq!(frames.unseen.get(&Side::Left), Some(&only(200..300)));
    assert_eq!(frames.unseen.get(&Side::Right), None);
    let issue = frames.issues.iter().find(|issue| issue.channel == "left_box").unwrap();
    assert!(issue.message.contains("the frames of the left hand are left out"), "{}", issue.message);
    assert!(column(&frames, "target.position", 0, 0).iter().all(|value| !value.is_nan()));
}

#[test]
fn a_body_that_all_hands_involve_leaves_a_gap() {
    let frames = frames(&log(0.1), &[ask("target.position")]).unwrap();
    assert_eq!(frames.stretches, [0..200, 200..400]);
    assert!(frames.unseen.is_empty());
}

#[test]
fn a_body_that_no_hand_involves_costs_no_frame() {
    let mut log = log(0.8);
    log.columns["left.thumb.position.z"].values.fill(0.5);
    let frames = frames(&log, &[ask("target.position")]).unwrap();
    let whole = 0..500;
    assert_eq!((frames.stretches.as_slice(), frames.unseen.is_empty()), (std::slice::from_ref(&whole), true));
    assert!(frames.issues.iter().any(|issue| issue.message.contains("no hand is near it")), "{:?}", frames.issues);
}

/// A tracker writes a lost body as 0 0 0. The rows of another sensor are between its own.
#[test]
fn zeros_of_a_lost_body_are_not_interpolated() {
    use crate::shared::files::{bound, folder, values};
    let rows = |offset: f64, value: &dyn Fn(u32) -> f64| -> String {
        let row = |row: u32| format!("{},{},0,0\n", offset + f64::from(row) * 0.02, value(row));
        std::iter::once("time,x,y,z\n".to_string()).chain((0..100).map(row)).collect()
    };
    let body = rows(0.0, &|row| if (40..50).contains(&row) { 0.0 } else { 0.5 + f64::from(row) * 1e-3 });
    let hand = rows(0.007, &|row| 0.3 + f64::from(row) * 1e-3);
    let folder = folder(&[("log/body.csv", &body), ("log/hand.csv", &hand)]);
    for (bridge, is_bridged) in [("100 ms", false), ("300 ms", true)] {
        let binding = format!(
            "resample: 50 Hz\nbridge: {bridge}\nchannels: {{cube.position: body.<xyz>, right.palm.position: hand.<xyz>}}\n"
        );
        let (log, issues) = bound(&folder.path().join("log"), &binding).unwrap();
        assert!(issues.iter().any(|issue| issue.message.starts_with("10 samples are exactly 0 0 0")), "{issues:?}");
        let x = values(&log, "cube.position.x");
        for (time, value) in log.time.iter().zip(x) {
            let is_lost = (0.781..0.999).contains(time) && !is_bridged;
            assert_eq!(value.is_nan(), is_lost, "{time}: {value}");
            assert!(is_lost || (value - (0.5 + time * 0.05)).abs() < 1e-6, "{time}: {value}");
        }
    }
}
