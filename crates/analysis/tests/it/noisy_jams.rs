//! A peg that is stuck on the rim of its hole, seen by a camera with noise.

use crate::one_gripper::{Signal, along, analysis, log};
use teachtree_analysis::TrackId;
use teachtree_base::hands::Side;

const SCENE: &str = "
bodies:
  peg: {role: object, mass: 150 g, parts: [{box: [20 mm, 20 mm, 60 mm]}], plug: [0 mm, 0 mm, -30 mm]}
  block:
    role: socket
    position: [300 mm, 0 mm, 0 mm]
    sockets: {hole: {rim: [0 mm, 0 mm, 40 mm], axis: [0, 0, 1], radius: 2 mm, depth: 25 mm}}
hands: {right: {fingers: [thumb, palm]}}
";

/// A number between -1 and 1 that changes without order.
fn scatter(index: f64) -> f64 {
    ((index * 12.9898).sin() * 43758.547).fract()
}

/// The jams of a gripper that presses a peg onto the rim with 10 N from 7 s to 8.6 s, seen by a camera at 15 Hz whose samples scatter by up to `noise_m`.
/// The log has the positions between its samples on a straight line.
fn jams(noise_m: f64) -> Vec<(f64, f64)> {
    let x = |t: f64| along(t, &[(3.0, 0.0), (5.0, 0.302)]);
    let lifted = |t: f64| along(t, &[(3.0, 0.03), (4.0, 0.15), (6.0, 0.15), (7.0, 0.0705), (8.6, 0.0705), (9.5, 0.15)]);
    let seen = |t: f64, path: &dyn Fn(f64) -> f64, axis: f64| {
        let at = |frame: f64| path(frame / 15.0) + noise_m * scatter(3.0 * frame + axis);
        let (frame, part) = ((t * 15.0).floor(), (t * 15.0).fract());
        at(frame) * (1.0 - part) + at(frame + 1.0) * part
    };
    let height = |t: f64| if t < 2.5 { along(t, &[(0.0, 0.3), (1.5, 0.04)]) } else { lifted(t) + 0.01 };
    let (seen_x, seen_y, seen_z) =
        (|t: f64| seen(t, &x, 0.0), |t: f64| seen(t, &|_| 0.0, 1.0), |t: f64| seen(t, &lifted, 2.0));
    let force = |t: f64| match t {
        t if (7.0..8.6).contains(&t) => -10.0,
        t if t > 3.0 => 1.5,
        _ => 0.0,
    };
    let signals: [Signal; 10] = [
        ("right.thumb.position.x", &x),
        ("right.thumb.position.y", &|_| 0.0),
        ("right.thumb.position.z", &height),
        ("right.gripper.closed", &|t| f64::from(u8::from(t > 2.0))),
        ("right.palm.force.x", &|_| 0.0),
        ("right.palm.force.y", &|_| 0.0),
        ("right.palm.force.z", &force),
        ("peg.position.x", &seen_x),
        ("peg.position.y", &seen_y),
        ("peg.position.z", &seen_z),
    ];
    let found = analysis(&log(SCENE, 11, &signals), &["failures.rules"], "hand_gripper_wrist.rules");
    let segments = &found.track(TrackId::Hand(Side::Right)).unwrap().relabeled;
    segments.iter().filter(|it| it.primitive == "Jam").map(|it| (it.start_s, it.end_s)).collect()
}

/// The noise alone makes speeds above `jam_speed`.
#[test]
fn the_noise_of_a_camera_does_not_interrupt_a_jam() {
    for noise_m in [0.0, 0.0005, 0.001] {
        let found = jams(noise_m);
        assert!(
            found.len() == 1 && (found[0].0 - 7.0).abs() < 0.15 && (found[0].1 - 8.6).abs() < 0.15,
            "{noise_m}: {found:?}"
        );
    }
}
