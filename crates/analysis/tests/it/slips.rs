//! Slips of a held object whose measured position scatters or is late.

use crate::one_gripper::{Signal, along, log, segments, starts};
use std::f64::consts::TAU;
use teachtree_analysis::Segment;

/// The length of the log, s.
const LASTS_S: u32 = 40;

/// A tracker of an object.
#[derive(Clone, Copy, Debug)]
struct Tracker {
    /// The standard deviation of each coordinate, m.
    deviation_m: f64,
    /// The number of samples of the log, at 100 Hz, with the same pose.
    rows: u32,
    has_velocity: bool,
    /// The age of a pose, s.
    late_s: f64,
}

/// White noise with a normal distribution of the standard deviation 1, by sample and axis.
pub fn noise(sample: f64, axis: f64) -> f64 {
    let even = |salt: f64| ((sample * 12.9898 + (axis + salt) * 78.233).sin() * 43758.5453).rem_euclid(1.0);
    (-2.0 * (1.0 - even(0.0)).ln()).sqrt() * (TAU * even(5.0)).cos()
}

/// A gripper carries a cup from 2 s on. The cup slides by `way_m` in the gripper from 20 s to 20.25 s, if that is not zero.
fn carried(tracker: Tracker, way_m: f64) -> Vec<Segment> {
    const SCENE: &str = "{bodies: {cup: {role: object, radius: 60 mm}}, hands: {right: {fingers: [thumb]}}}";
    let Tracker { deviation_m, rows, has_velocity, late_s } = tracker;
    let measured = |t: f64| ((t * 100.0).round() / f64::from(rows)).floor();
    let scatter = |t: f64, axis: f64| deviation_m * noise(measured(t), axis);
    let x = |t: f64| along(t, &[(2.0, 0.0), (12.0, 0.3), (22.0, 0.6), (36.0, 0.0)]);
    let z = |t: f64| along(t, &[(2.0, 0.1), (6.0, 0.4), (36.0, 0.4), (38.0, 0.1)]);
    let slid = |t: f64| along(t, &[(20.0, 0.0), (20.25, way_m)]);
    let y = |t: f64| {
        let part = along(t, &[(24.0, 0.0), (26.0, 1.0), (29.0, 1.0), (31.0, 0.0)]);
        0.4 * part.powi(3) * (10.0 - 15.0 * part + 6.0 * part.powi(2))
    };
    let at = |t: f64| measured(t) * f64::from(rows) / 100.0 - late_s;
    let (cup_x, cup_y) = (|t: f64| x(at(t)) + scatter(t, 1.0), |t: f64| y(at(t)) + scatter(t, 2.0));
    let cup_z = |t: f64| z(at(t)) - slid(at(t)) + scatter(t, 3.0);
    let speed = |place: &dyn Fn(f64) -> f64, t: f64| (place(t + 0.01) - place(t - 0.01)) / 0.02;
    let (speed_x, speed_y) = (|t: f64| speed(&x, t), |t: f64| speed(&y, t));
    let speed_z = |t: f64| speed(&|t| z(t) - slid(t), t);
    let closed = |t: f64| f64::from(u8::from((1.0..39.0).contains(&t)));
    let mut signals: Vec<Signal> = vec![
        ("right.thumb.position.x", &x),
        ("right.thumb.position.y", &y),
        ("right.thumb.position.z", &z),
        ("right.palm.rotation.w", &|_| 1.0),
        ("right.palm.rotation.x", &|_| 0.0),
        ("right.palm.rotation.y", &|_| 0.0),
        ("right.palm.rotation.z", &|_| 0.0),
        ("right.gripper.closed", &closed),
        ("cup.position.x", &cup_x),
        ("cup.position.y", &cup_y),
        ("cup.position.z", &cup_z),
    ];
    let velocity: [Signal; 3] =
        [("cup.velocity.x", &speed_x), ("cup.velocity.y", &speed_y), ("cup.velocity.z", &speed_z)];
    if has_velocity {
        signals.extend(velocity);
    }
    segments(&log(SCENE, LASTS_S, &signals), &["failures.rules"], "hand_gripper.rules")
}

#[test]
fn noise_of_a_position_is_not_a_slip() {
    for deviation_m in [0.5e-3, 1e-3, 2e-3] {
        for (rows, has_velocity) in [(1, false), (1, true), (6, false)] {
            let tracker = Tracker { deviation_m, rows, has_velocity, late_s: 0.0 };
            let found = carried(tracker, 0.0);
            assert!(!starts(&found, "Translate").is_empty(), "{tracker:?}: {found:?}");
            assert!(starts(&found, "Slip").is_empty(), "{tracker:?}: {:?}", starts(&found, "Slip"));
            // A slip is found that the noise cannot hide.
            let slips = starts(&carried(tracker, 16.0 * deviation_m), "Slip");
            assert!(slips.len() == 1 && (slips[0] - 20.0).abs() < 0.35, "{tracker:?}: {slips:?}");
        }
    }
    // Without noise, a small one is enough.
    let exact = Tracker { deviation_m: 0.0, rows: 1, has_velocity: false, late_s: 0.0 };
    assert_eq!(starts(&carried(exact, 5e-3), "Slip").len(), 1);
}

/// A late pose is behind a hand that speeds up, and in its place again when the hand rests.
#[test]
fn a_late_camera_does_not_make_a_slip() {
    for late_s in [0.045, 0.08] {
        for rows in [1, 6] {
            let tracker = Tracker { deviation_m: 0.0, rows, has_velocity: false, late_s };
            let found = starts(&carried(tracker, 0.0), "Slip");
            assert!(found.is_empty(), "{tracker:?}: {found:?}");
            let slips = starts(&carried(tracker, 0.015), "Slip");
            assert!(slips.len() == 1 && (slips[0] - 20.0 - late_s).abs() < 0.35, "{tracker:?}: {slips:?}");
        }
    }
}

/// A gripper moves at 0.3 m/s and brakes within 0.25 s. A box slides down in it by 12 mm from 5 s to 5.6 s, or its camera is late and scatters.
#[test]
fn a_slip_goes_on_while_the_hand_brakes() {
    const SCENE: &str = "
bodies:
  box: {role: object, parts: [{box: [50 mm, 50 mm, 50 mm]}]}
  table: {role: support, position: [0 m, 0 m, -10 mm], parts: [{box: [3 m, 3 m, 20 mm]}]}
hands: {right: {fingers: [thumb, palm]}}
";
    let slips = |brakes_s: f64, way_m: f64, late_s: f64, deviation_m: f64| {
        let x = |t: f64| {
            let braked = (t - brakes_s).clamp(0.0, 0.25);
            0.3 * ((t.min(brakes_s) - 3.75).max(0.0) + braked - braked * braked / 0.5)
        };
        let z = |t: f64| 0.03 + along(t, &[(2.6, 0.0), (3.4, 0.2), (7.5, 0.2), (8.5, 0.0)]);
        let slid = |t: f64| way_m * ((t - 5.0) / 0.6).clamp(0.0, 1.0);
        let scatter = |t: f64, axis: f64| deviation_m * noise((t * 100.0).round(), axis);
        let box_x = |t: f64| x(t - late_s) + scatter(t, 1.0);
        let box_z = |t: f64| (z(t - late_s) - slid(t)).max(0.03) - 0.005 + scatter(t, 3.0);
        let signals: [Signal; 11] = [
            ("right.thumb.position.x", &x),
            ("right.thumb.position.y", &|_| 0.0),
            ("right.thumb.position.z", &z),
            ("right.palm.rotation.w", &|_| 1.0),
            ("right.palm.rotation.x", &|_| 0.0),
            ("right.palm.rotation.y", &|_| 0.0),
            ("right.palm.rotation.z", &|_| 0.0),
            ("right.gripper.closed", &|t| f64::from(u8::from((2.0..9.0).contains(&t)))),
            ("box.position.x", &box_x),
            ("box.position.y", &|t| scatter(t, 2.0)),
            ("box.position.z", &box_z),
        ];
        let found = segments(&log(SCENE, 10, &signals), &["failures.rules"], "hand_gripper.rules");
        let slips = found.into_iter().filter(|segment| segment.primitive == "Slip");
        slips.map(|slip| [slip.start_s, slip.end_s]).collect::<Vec<[f64; 2]>>()
    };
    let without_brake = slips(7.0, 0.012, 0.0, 0.0);
    assert!(matches!(without_brake[..], [[_, end_s]] if (end_s - 5.6).abs() < 0.25), "{without_brake:?}");
    for brakes_s in [5.1, 5.3, 5.5] {
        assert_eq!(slips(brakes_s, 0.012, 0.0, 0.0), without_brake, "{brakes_s}");
    }
    // Neither a late camera nor its noise makes a slip, nor do both.
    for deviation_m in [0.0, 0.5e-3, 2e-3] {
        assert_eq!(slips(5.3, 0.0, 0.1, deviation_m), [] as [[f64; 2]; 0], "{deviation_m}");
    }
}
