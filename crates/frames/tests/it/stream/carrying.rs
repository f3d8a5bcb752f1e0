//! The target of a hand whose touch no channel shows, among several objects.

use super::{ask, column};
use crate::shared::recordings::recording;
use teachtree_base::recording::Recording;
use teachtree_frames::frames;

const SCENE: &str = "
bodies:
  cup: {role: object, radius: 40 mm}
  bowl: {role: object, radius: 80 mm, position: [300 mm, 0 m, 0 m]}
hands:
  right: {fingers: [thumb, index]}
";

/// From 0 to 1 while `t` goes from `from` to `to`.
fn part(t: f64, from: f64, to: f64) -> f64 {
    let part = ((t - from) / (to - from)).clamp(0.0, 1.0);
    part * part * (3.0 - 2.0 * part)
}

/// A hand takes the cup by a handle at 1 s, carries it over the bowl, stays there from 2.5 s to 4 s, and puts it down beyond at 5.5 s; `grips`: flags of the
/// thumb on the cup.
fn carried(grips: bool) -> Recording {
    let cup = |t: f64| {
        [
            0.6 * (part(t, 1.2, 2.5) * 0.42 + part(t, 4.0, 5.5) * 0.58),
            0.0,
            0.12 * (part(t, 1.0, 1.5) - part(t, 5.0, 5.5)),
        ]
    };
    let hand = move |t: f64| {
        let [x, y, z] = cup(t);
        [x + 0.10, y, z + 0.02 + 0.2 * (1.0 - part(t, 0.0, 0.8)) + 0.2 * part(t, 6.0, 7.0)]
    };
    let of = |axis: usize| (move |t: f64| cup(t)[axis], move |t: f64| hand(t)[axis]);
    let ((x, tip_x), (y, tip_y), (z, tip_z)) = (of(0), of(1), of(2));
    let flag = |t: f64| if (1.0..5.6).contains(&t) { 1.0 } else { 0.0 };
    let mut columns: Vec<(&str, &dyn Fn(f64) -> f64)> = vec![
        ("cup.position.x", &x),
        ("cup.position.y", &y),
        ("cup.position.z", &z),
        ("bowl.position.x", &|_| 0.3),
        ("bowl.position.y", &|_| 0.0),
        ("bowl.position.z", &|_| 0.0),
        ("right.thumb.position.x", &tip_x),
        ("right.thumb.position.y", &tip_y),
        ("right.thumb.position.z", &tip_z),
        ("right.index.position.x", &tip_x),
        ("right.index.position.y", &tip_y),
        ("right.index.position.z", &tip_z),
    ];
    if grips {
        columns.push(("right.thumb.contact.cup", &flag));
    }
    recording(SCENE, 100.0, 750, &columns)
}

#[test]
fn the_target_of_a_carry_stays_however_near_other_objects_are() {
    let log = carried(false);
    let frames = frames(&log, &[ask("target")]).unwrap();
    let (target, time) = (column(&frames, "target", 0, 0), &frames.time);
    for (target, time) in target.iter().zip(time).filter(|(_, time)| (1.2..6.0).contains(*time)) {
        assert_eq!(*target, 0.0, "the bowl at {time} s");
    }
}

#[test]
fn a_hand_that_leaves_takes_the_nearest_object_again() {
    let mut log = carried(false);
    // The hand goes back to the bowl after it has put the cup down, and does not take it.
    for finger in ["thumb", "index"] {
        let time = log.time.clone();
        for (axis, wanted) in [("x", 0.3), ("z", 0.05)] {
            let values = &mut log.columns[&format!("right.{finger}.position.{axis}")].values;
            for (value, time) in values.iter_mut().zip(&time) {
                *value += (wanted - *value) * part(*time, 6.2, 7.2);
            }
        }
    }
    let frames = frames(&log, &[ask("target")]).unwrap();
    assert_eq!(*column(&frames, "target", 0, 0).last().unwrap(), 1.0);
}

#[test]
fn flags_decide_where_there_are_any() {
    let mut log = carried(true);
    // The flags say bowl, whatever moves.
    let flag = log.columns.shift_remove("right.thumb.contact.cup").unwrap();
    log.columns.insert("right.thumb.contact.bowl".into(), flag);
    let frames = frames(&log, &[ask("target")]).unwrap();
    let (target, time) = (column(&frames, "target", 0, 0), &frames.time);
    assert!(target.iter().zip(time).filter(|(_, time)| (1.1..5.5).contains(*time)).all(|(target, _)| *target == 1.0));
}
