//! Contact levels of sensors that feel contacts of several kinds, and of tools that rest, move and touch.

use super::{ask_fingers, column};
use std::f64::consts::TAU;
use teachtree_base::channels::{ChannelSpec, Fallback, Shape};
use teachtree_base::recording::{Column, Recording};
use teachtree_base::units::Dimension;
use teachtree_frames::frames;

/// The least force of a contact in the rules, N.
const LEAST: f64 = 5.0;

/// Noise that is the same in every run, from -1 to 1.
fn noise(row: usize, axis: usize) -> f64 {
    let hash = (row * 3 + axis).wrapping_mul(2_654_435_761) % 10_007;
    hash as f64 / 5003.5 - 1.0
}

/// A palm that feels these forces for these times, s and N, one after the other, within 0.1 s; at 100 Hz.
fn palm(phases: &[(f64, f64)]) -> Recording {
    let targets: Vec<f64> =
        phases.iter().flat_map(|(lasts_s, force)| vec![*force; (lasts_s * 100.0) as usize]).collect();
    let mut force = 0.0;
    let mut columns = [vec![], vec![], vec![]];
    for (row, target) in targets.iter().enumerate() {
        force += (target - force).clamp(-target.max(force) / 10.0, target.max(force) / 10.0);
        // It sways by a tenth, as friction does.
        let felt = force * (1.0 + 0.1 * (TAU * row as f64 / 90.0).sin());
        for (axis, share) in [0.6, 0.0, -0.8].into_iter().enumerate() {
            columns[axis].push(share * felt + 0.15 * noise(row, axis));
        }
    }
    let named = ["x", "y", "z"].into_iter().zip(columns);
    let columns = named
        .map(|(axis, values)| (format!("right.palm.force.{axis}"), Column { dimension: Dimension::FORCE, values }));
    let time = (0..targets.len()).map(|row| row as f64 * 0.01).collect();
    Recording { time, columns: columns.collect(), ..Recording::default() }
}

/// The learned level, N, and the messages about it.
fn level(phases: &[(f64, f64)]) -> (f64, Vec<String>) {
    let force = ask_fingers("force", Shape::Vec3, Dimension::FORCE);
    let level =
        ChannelSpec { absent: Fallback::Constant(LEAST), ..ask_fingers("level", Shape::Scalar, Dimension::FORCE) };
    let frames = frames(&palm(phases), &[force, level]).unwrap();
    let about = frames.issues.iter().filter(|issue| issue.kind.name().ends_with("contact_level"));
    (column(&frames, "fingers.level", 0, 0)[0], about.map(|issue| issue.message.clone()).collect())
}

#[test]
fn a_jam_does_not_raise_the_level_of_a_touch() {
    let (plain, about) = level(&[(5.0, 0.0), (6.0, 12.0), (2.0, 0.0)]);
    assert!((0.3..4.0).contains(&plain) && about.is_empty(), "{plain} N, {about:?}");
    for (jam_s, jam) in [(0.6, 65.0), (2.0, 40.0), (2.0, 65.0), (6.0, 65.0), (12.0, 90.0)] {
        let (found, about) = level(&[(5.0, 0.0), (6.0, 12.0), (jam_s, jam), (1.0, 0.0)]);
        assert!((0.3..4.0).contains(&found), "{found} N with a jam of {jam} N for {jam_s} s; {about:?}");
    }
}

#[test]
fn two_kinds_of_contact_are_reported_with_the_level_between_them() {
    let (_, about) = level(&[(5.0, 0.0), (6.0, 12.0), (6.0, 65.0), (1.0, 0.0)]);
    let [message] = about.as_slice() else { panic!("{about:?}") };
    assert!(message.contains("three groups: without contact, about 1") && message.contains("and about 6"), "{message}");
    let bound = message.split("bind `right.palm.level: = ").nth(1).unwrap().split(' ').next().unwrap();
    assert!((13.0..60.0).contains(&bound.parse::<f64>().unwrap()), "{message}");
}

#[test]
fn motion_is_not_a_weaker_kind_of_contact() {
    // It rests, moves with 3 N, and rubs with 22 N.
    let (found, about) = level(&[(5.0, 0.0), (1.5, 3.0), (6.0, 22.0), (1.5, 3.0), (2.0, 0.0)]);
    assert!((2.5..14.0).contains(&found), "{found} N");
    // A touch may be as weak as that.
    let [message] = about.as_slice() else { panic!("{about:?}") };
    assert!(message.contains("about 3.") && message.contains("are contact too"), "{message}");
}

#[test]
fn readings_that_are_far_above_a_contact_and_not_taken_for_one_are_reported() {
    // Touches of any force from 2 N to 60 N, and jams of more than 1000 N.
    let touches = (0..40).map(|at| (0.2, 2.0 * 1.09_f64.powi(at)));
    let phases: Vec<(f64, f64)> =
        std::iter::once((3.0, 0.0)).chain(touches).chain([(3.0, 1500.0), (1.0, 0.0)]).collect();
    let (found, about) = level(&phases);
    assert!(found > 100.0, "{found} N");
    let [message] = about.as_slice() else { panic!("{about:?}") };
    assert!(
        message.contains("a tenth of the readings below that are above") && message.ends_with("= 5 N`"),
        "{message}"
    );
}

#[test]
fn contacts_of_every_force_below_a_jam_are_not_free_motion() {
    // Touches of any force from 2 N to 460 N, and jams of 1500 N.
    let touches = (0..40).map(|at| (0.2, 2.0 * 1.15_f64.powi(at)));
    let phases: Vec<(f64, f64)> =
        std::iter::once((3.0, 0.0)).chain(touches).chain([(3.0, 1500.0), (1.0, 0.0)]).collect();
    let (found, about) = level(&phases);
    assert!((found - LEAST).abs() < 1e-9, "{found} N");
    let [message] = about.as_slice() else { panic!("{about:?}") };
    assert!(message.contains("contact is above 5 N, the threshold of the rules"), "{message}");
}
