//! Contacts with a support that the log has as flags: the poses show which of them carry.

use super::{ask, column};
use crate::shared::recordings::recording;
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;
use teachtree_frames::frames;
use teachtree_frames::frames::Frames;

/// A function of time.
type Signal<'a> = &'a dyn Fn(f64) -> f64;

const CUBE: &str = "cube: {role: object, radius: 40 mm}";

/// A cube at a height, touched by the right hand, and flagged with `body`.
fn log(object: &str, height: Signal, touched: Signal, flagged: Signal) -> Recording {
    let scene = format!("bodies:\n  {object}\n  env: {{role: support}}\nhands:\n  right: {{fingers: [thumb]}}\n");
    recording(
        &scene,
        100.0,
        600,
        &[
            ("right.thumb.position.x", &|_| 0.0),
            ("right.thumb.position.y", &|_| 0.0),
            ("right.thumb.position.z", height),
            ("right.thumb.contact", touched),
            ("cube.position.x", &|_| 0.0),
            ("cube.position.y", &|_| 0.0),
            ("cube.position.z", height),
            ("contact.cube.env", flagged),
        ],
    )
}

/// Upward force of the support on the target at a time, N.
fn carried(frames: &Frames, time: f64) -> f64 {
    let slot = frames.layout.hand(Side::Right).unwrap().contacts.iter().position(|name| name == "env").unwrap();
    column(frames, "contacts.force", slot as u32, 2)[(time * 100.0).round() as usize]
}

fn found(log: &Recording) -> Frames {
    frames(log, &[ask("contacts.force"), ask("contacts.normal"), ask("target")]).unwrap()
}

/// On the table until 1 s, in the air from 1.5 s to 4 s, on a shelf 300 mm higher from 4.5 s on.
fn to_shelf(t: f64) -> f64 {
    let up = ((t - 1.0) / 0.5).clamp(0.0, 1.0);
    let onto = ((t - 4.0) / 0.5).clamp(0.0, 1.0);
    0.02 + 0.4 * up - 0.1 * onto
}

const HELD: Signal<'static> = &|t| if (0.8..4.8).contains(&t) { 1.0 } else { 0.0 };

#[test]
fn what_touches_a_held_object_in_the_air_does_not_carry_it() {
    // The flag stays on all along: the log names the links of the robot as it names its table.
    let frames = found(&log(CUBE, &to_shelf, HELD, &|_| 1.0));
    assert_eq!(carried(&frames, 0.5), 1.0);
    assert_eq!(carried(&frames, 2.5), 0.0, "in the air");
    assert_eq!(carried(&frames, 5.5), 1.0, "on the shelf");
}

#[test]
fn the_table_carries_an_object_that_is_put_down_and_taken_up_again() {
    // It touches the table from 3 s to 3.5 s, held.
    let height = |t: f64| {
        0.02 + 0.1 * ((t - 1.0) / 0.5).clamp(0.0, 1.0) - 0.1 * ((t - 2.5) / 0.5).clamp(0.0, 1.0)
            + 0.1 * ((t - 3.5) / 0.5).clamp(0.0, 1.0)
    };
    let flagged = |t: f64| if t < 1.05 || (2.95..3.55).contains(&t) { 1.0 } else { 0.0 };
    let frames = found(&log(CUBE, &height, HELD, &flagged));
    assert_eq!((carried(&frames, 0.5), carried(&frames, 2.0), carried(&frames, 3.2)), (1.0, 0.0, 1.0));
}

#[test]
fn a_pad_that_only_a_held_stamp_touches_carries_it() {
    let height = |t: f64| 0.02 + 0.1 * ((t - 2.0).abs() - 0.3).clamp(0.0, 1.0);
    let frames = found(&log(CUBE, &height, &|_| 1.0, &|t| if (1.7..2.3).contains(&t) { 1.0 } else { 0.0 }));
    assert_eq!(carried(&frames, 2.0), 1.0);
}

#[test]
fn the_wrist_does_not_carry_the_plate_that_is_fixed_to_it() {
    let plate = "cube: {role: object, radius: 40 mm, fixed_to: right}";
    let frames = found(&log(plate, &|t| 0.5 + 0.01 * t, &|_| 0.0, &|t| if t > 2.0 { 1.0 } else { 0.0 }));
    assert_eq!(carried(&frames, 3.0), 0.0);
    let normal = column(&frames, "contacts.normal", 0, 2);
    assert!(normal.iter().all(|z| *z == 0.0));
}
