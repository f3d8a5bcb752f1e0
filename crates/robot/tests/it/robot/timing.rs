//! How fast a way of joints is gone, beside closed forms and, for ways made at random, beside what a controller makes of its points.

use super::kinematics::shipped;
use proptest::prelude::*;
use teachtree_robot::Dof;
use teachtree_robot::planning::toppra::{Knot, timed};

const STEP_S: f64 = 0.01;
/// What the polynomial between two points may exceed a limit by.
const SPARE: f64 = 1.02;
/// The limit of jerk with rounding.
const ALL_OF_JERK: f64 = 1.0 + 1e-6;

/// Joints like those of the shipped arm.
fn joints(count: usize) -> Vec<Dof> {
    let arm = shipped("both_hands").tree.dofs;
    let like: Vec<Dof> = arm.into_iter().filter(|dof| dof.name.contains("arm")).collect();
    (0..count).map(|at| Dof { speed: 3.0, acceleration: 10.0, ..like[at].clone() }).collect()
}

/// A path from zero by legs: steps of [`STEP_S`], and the speed of each joint, rad/s.
fn sampled(legs: &[(usize, Vec<f64>)]) -> Vec<Vec<f64>> {
    let mut samples = vec![vec![0.0; legs[0].1.len()]];
    for (steps, speeds) in legs {
        for _ in 0..*steps {
            let last = samples.last().unwrap();
            samples.push(last.iter().zip(speeds).map(|(last, speed)| last + speed * STEP_S).collect());
        }
    }
    samples
}

/// The largest shares of the limits that cubic polynomials through positions and velocities of the points come to.
fn shares(knots: &[Knot], dofs: &[Dof]) -> (f64, f64) {
    let (mut fastest, mut hardest) = (0.0_f64, 0.0_f64);
    for pair in knots.windows(2) {
        let h = pair[1].time_s - pair[0].time_s;
        for (joint, dof) in dofs.iter().enumerate() {
            let of = |knot: &Knot| (knot.positions[joint], knot.velocities[joint]);
            let ((p0, v0), (p1, v1)) = (of(&pair[0]), of(&pair[1]));
            let mean = (p1 - p0) / h;
            // The velocity is a parabola through both ends and 1.5 of the mean less a quarter of both.
            let middle = 1.5 * mean - 0.25 * (v0 + v1);
            let ends = [(6.0 * mean - 4.0 * v0 - 2.0 * v1) / h, (4.0 * v1 + 2.0 * v0 - 6.0 * mean) / h];
            fastest = fastest.max(middle.abs().max(v0.abs()).max(v1.abs()) / dof.speed);
            hardest = hardest.max(ends[0].abs().max(ends[1].abs()) / dof.acceleration);
        }
    }
    (fastest, hardest)
}

/// From rest to rest over 3 rad at up to 3 rad/s and 10 rad/s²: 0.3 s to speed up and slow down, 0.9 s between.
#[test]
fn a_straight_way_takes_as_long_as_a_trapezoid() {
    let dofs = joints(1);
    // As planned it takes half a second.
    let samples: Vec<Vec<f64>> = (0..=500).map(|at| vec![f64::from(at) * 0.006]).collect();
    let quick = timed(&samples, 1e-3, &dofs);
    let time_s = quick.knots.last().unwrap().time_s;
    // A tenth of the acceleration is reserved for the polynomials between the points, and motion restarts gently after a corner.
    assert!((1.3..1.6).contains(&time_s), "{time_s} s");
    assert_eq!(quick.at_limit, Some(0));
    let (fastest, hardest) = shares(&quick.knots, &dofs);
    assert!(fastest > 0.98 && hardest > 0.85, "{fastest}, {hardest}: it could be faster");
}

/// What keeps the limits is done as planned, to the sample.
#[test]
fn what_can_be_done_as_planned_is() {
    let dofs = joints(2);
    let smooth = |time: f64| vec![0.4 * (1.0 - time.cos()), 0.2 * (2.0 * time).sin().powi(2)];
    let samples: Vec<Vec<f64>> = (0..=628).map(|at| smooth(f64::from(at) * STEP_S)).collect();
    let same = timed(&samples, STEP_S, &dofs);
    assert_eq!((same.knots.len(), same.at_limit), (631, None));
    assert!((same.slower - 1.0).abs() < 1e-9, "{}", same.slower);
}

/// A corner, where the velocity of a way changes at once, is slowed down for and not jumped over.
#[test]
fn a_corner_is_rounded() {
    let dofs = joints(1);
    let samples: Vec<Vec<f64>> = (0..=200).map(|at| vec![(f64::from(at) - 100.0).abs() * 0.02]).collect();
    let made = timed(&samples, STEP_S, &dofs);
    let (fastest, hardest) = shares(&made.knots, &dofs);
    assert!(fastest <= SPARE && hardest <= SPARE, "{fastest}, {hardest}");
    // 2 rad/s turned about at 10 rad/s² take at least 0.2 s longer of 2 s, as do beginning and end together.
    assert!((1.2..1.6).contains(&made.slower), "{}", made.slower);
    // A change of velocity by v within the step h is cut off by v h / 6.
    let nearest = made.knots.iter().map(|knot| knot.positions[0]).fold(f64::INFINITY, f64::min);
    assert!((nearest - 4.0 * STEP_S / 6.0).abs() < 1e-12, "{nearest} rad from the corner");
}

/// The largest share of their limits to which third divided differences of the points come, six times which is the mean jerk over four points.
fn jerks(knots: &[Knot], dofs: &[Dof]) -> f64 {
    let mut largest = 0.0_f64;
    for four in knots.windows(4) {
        for (joint, dof) in dofs.iter().enumerate() {
            let mut differences: Vec<f64> = four.iter().map(|knot| knot.positions[joint]).collect();
            for order in 1..4 {
                for at in 0..4 - order {
                    let time_s = four[at + order].time_s - four[at].time_s;
                    differences[at] = (differences[at + 1] - differences[at]) / time_s;
                }
            }
            largest = largest.max((6.0 * differences[0] / dof.jerk).abs());
        }
    }
    largest
}

/// From rest to rest over 3 rad with at most 100 rad/s³: seven parts of constant jerk take 1.4 s.
#[test]
fn a_limit_of_jerk_takes_little_longer_than_seven_parts_of_constant_jerk() {
    let samples: Vec<Vec<f64>> = (0..=500).map(|at| vec![f64::from(at) * 0.006]).collect();
    let dofs: Vec<Dof> = joints(1).into_iter().map(|dof| Dof { jerk: 100.0, ..dof }).collect();
    let made = timed(&samples, 1e-3, &dofs);
    let (fastest, hardest) = shares(&made.knots, &dofs);
    assert!(fastest <= SPARE && hardest <= SPARE, "{fastest} of the speed, {hardest} of the acceleration");
    let jerk = jerks(&made.knots, &dofs);
    assert!((0.85..=ALL_OF_JERK).contains(&jerk), "{jerk} of the jerk");
    // A tenth of the limits is reserved, and motion restarts gently after a corner.
    let time_s = made.knots.last().unwrap().time_s;
    assert!((1.4..1.8).contains(&time_s), "{time_s} s");
    let free = timed(&samples, 1e-3, &joints(1));
    assert!(jerks(&free.knots, &dofs) > 2.0, "the limit changes something");
}

/// At this corner the jerk over four points was 6.8 % above the limit while it was kept within the intervals and between their middles.
#[test]
fn a_limit_of_jerk_is_kept_over_four_points_at_a_corner() {
    let samples = sampled(&[(10, vec![-2.0, -6.0, -8.0]), (15, vec![-2.0, -5.0, -7.0])]);
    let dofs: Vec<Dof> = joints(3).into_iter().map(|dof| Dof { jerk: 100.0, ..dof }).collect();
    let made = timed(&samples, STEP_S, &dofs);
    let jerk = jerks(&made.knots, &dofs);
    assert!((0.99..=ALL_OF_JERK).contains(&jerk), "{jerk} of the jerk");
}

#[test]
fn nothing_and_one_place_are_ways() {
    for jerk in [f64::INFINITY, 100.0] {
        let dofs: Vec<Dof> = joints(1).into_iter().map(|dof| Dof { jerk, ..dof }).collect();
        assert!(timed(&[], STEP_S, &dofs).knots.len() <= 1);
        let still = timed(&[vec![0.5]], STEP_S, &dofs);
        assert!(still.knots.iter().all(|knot| (knot.positions[0] - 0.5).abs() < 1e-12 && knot.velocities[0] == 0.0));
    }
}

proptest! {
    /// Ways with corners, pauses and speeds beyond the limits.
    #[test]
    fn limits_are_kept_between_the_points(
        legs in prop::collection::vec((5_usize..60, prop::collection::vec(-8.0_f64..8.0, 3)), 1..8),
        jerk in prop_oneof![7 => Just(f64::INFINITY), 1 => 20.0_f64..2000.0],
    ) {
        let dofs: Vec<Dof> = joints(3).into_iter().map(|dof| Dof { jerk, ..dof }).collect();
        let samples = sampled(&legs);
        let made = timed(&samples, STEP_S, &dofs);
        let (fastest, hardest) = shares(&made.knots, &dofs);
        prop_assert!(fastest <= SPARE && hardest <= SPARE, "{fastest} of the speed, {hardest} of the acceleration");
        let jerk = jerks(&made.knots, &dofs);
        prop_assert!(jerk <= ALL_OF_JERK, "{jerk} of the jerk");
        prop_assert!(made.knots.windows(2).all(|pair| pair[1].time_s > pair[0].time_s && pair[1].time_s.is_finite()));
        let (first, last) = (&made.knots[0], made.knots.last().unwrap());
        for knot in [first, last] {
            prop_assert!(knot.velocities.iter().all(|velocity| *velocity == 0.0));
        }
        for (made, sample) in last.positions.iter().zip(samples.last().unwrap()) {
            prop_assert!((made - sample).abs() < 1e-12);
        }
    }
}
