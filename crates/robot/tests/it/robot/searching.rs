//! Feeling for a hole that is not where it is expected.

use nalgebra::{Isometry3, Translation3, Vector3};
use proptest::prelude::*;
use teachtree_base::geometry::{perpendiculars, pose};
use teachtree_command::hole_of;
use teachtree_robot::control::behaviors::spiral_path::SpiralPath;
use teachtree_robot::planning::time_scale::Pause;
use teachtree_world as world;

proptest! {
    /// Every place of the disc comes as near as half the pitch, in steps of at most the requested length.
    #[test]
    fn a_spiral_covers_its_disc(pitch in 0.1e-3..1.0e-3, within in 1e-3..5e-3, far in 0.0..1.0_f64, angle in 0.0..std::f64::consts::TAU) {
        let within: f64 = within;
        let place = [far.sqrt() * within * angle.cos(), far.sqrt() * within * angle.sin()];
        let step: f64 = 0.02e-3;
        let mut spiral = SpiralPath::new(pitch, within);
        let (mut nearest, mut before, mut steps) = (f64::INFINITY, spiral.place(), 0);
        loop {
            let [x, y] = spiral.place();
            prop_assert!((x - before[0]).hypot(y - before[1]) <= 1.05 * step, "from {before:?} to {x}, {y}");
            prop_assert!(x.hypot(y) <= within + pitch / 2.0 + step, "{x}, {y} is far outside of {within}");
            nearest = f64::min(nearest, (x - place[0]).hypot(y - place[1]));
            (before, steps) = ([x, y], steps + 1);
            if !spiral.advance(step) {
                break;
            }
        }
        prop_assert!(nearest <= pitch / 2.0 + step, "{place:?} is {nearest} from the nearest turn of {pitch}");
        // No way that leaves no gap is much shorter than the area by the pitch.
        let area = std::f64::consts::PI * (within + pitch / 2.0).powi(2);
        prop_assert!(f64::from(steps) * step < 1.1 * area / pitch + pitch, "{steps} steps");
    }

    #[test]
    fn directions_across_are_at_right_angles(x in -1.0..1.0, y in -1.0..1.0, z in -1.0..1.0) {
        prop_assume!(Vector3::new(x, y, z).norm() > 1e-3);
        let axis: Vector3<f64> = Vector3::new(x, y, z).normalize();
        let [one, other] = perpendiculars(&axis);
        for off in [one.dot(&axis), other.dot(&axis), one.dot(&other), one.norm() - 1.0, other.norm() - 1.0] {
            prop_assert!(off.abs() < 1e-12, "{off}");
        }
    }
}

/// How much wider a hole is, and a ring than its pole, is read off the shapes.
#[test]
fn the_clearance_of_a_hole_is_known_from_its_shapes() {
    let cases = [("peg_in_hole", "peg", "holder", 0.5e-3), ("peg_in_hole_tight", "peg", "holder", 0.15e-3)];
    for (scene, object, holder, wider) in cases {
        let scene = world::scene(scene).unwrap();
        let body = &scene.bodies[holder];
        let socket = &body.sockets[0];
        let plug = Vector3::from(scene.bodies[object].plug.unwrap().map(|length| length.0));
        let rim = pose(body.position.map(|length| length.0), body.rotation)
            * Translation3::from(Vector3::from(socket.rim.map(|length| length.0)) - Vector3::from(socket.axis) * 0.02);
        let at = |beside: f64| Translation3::new(beside, 0.0, 0.0) * rim * Translation3::from(-plug);
        let nothing = |_: &str| None::<Isometry3<f64>>;
        let hole = hole_of(&scene, object, &at(0.0), &nothing).unwrap();
        assert!((hole.clearance.unwrap() - wider).abs() < 2e-5, "{:?}", hole.clearance);
        assert!((hole.axis - Vector3::z()).norm() < 1e-9);
        assert_eq!(hole_of(&scene, object, &at(0.1), &nothing), None);
    }
}

/// A waiting clock stops and restarts within a short time; a clock that never waits loses no time.
#[test]
fn a_clock_waits() {
    let mut pace = Pause::default();
    let mut run = |waits: bool, steps: usize| {
        (0..steps).for_each(|_| pace.advance(waits, 0.001));
        pace.waited_s()
    };
    assert_eq!(run(false, 1000), 0.0);
    let waited = run(true, 1000);
    assert!((waited - 0.95).abs() < 0.002, "{waited}");
    let waited = run(false, 1000);
    assert!((waited - 1.0).abs() < 0.002, "{waited}");
    assert_eq!(run(false, 1000), waited);
}
