//! Feeling for a hole that is not where it is expected.

use crate::program::{complained, demonstrate, said, teachtree};
use nalgebra::{Isometry3, Translation3, Vector3};
use proptest::prelude::*;
use teachtree_base::geometry::{perpendiculars, pose};
use teachtree_command::hole_of;
use teachtree_robot::control::behaviors::peg_search::WITHIN_M;
use teachtree_robot::control::behaviors::spiral_path::SpiralPath;
use teachtree_robot::planning::time_scale::Pause;
use teachtree_world as world;

proptest! {
    /// Every place of the disc comes as near as half the pitch, in steps that are no longer than asked for.
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

/// A clock that waits stands still soon, and goes on as soon; one that never waits loses nothing.
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

/// The holder stands elsewhere than it was taught and nobody says so: 2 mm away the hole is found, 8 mm away it is not, and the program says that.
#[test]
fn a_hole_that_is_not_where_it_is_expected_is_felt_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let (log, commands, out) = (path("log.csv"), path("commands.json"), path("robot.csv"));
    demonstrate("peg_in_hole", &[], &log);
    assert!(teachtree(&["command", &log, "-o", &commands]).status.success());
    let taught = include_str!("../../../scenes/peg_in_hole.yaml");
    let at = "position: [90 mm, 20 mm, 20 mm]";
    let with_holder = |x: &str, y: &str| {
        assert!(taught.contains(at));
        let file = path(&format!("holder_{x}_{y}.yaml"));
        std::fs::write(&file, taught.replace(at, &format!("position: [{x} mm, {y} mm, 20 mm]"))).unwrap();
        teachtree(&["simulate", &commands, "--scene", &file, "-o", &out])
    };
    let found = with_holder("88.5", "21.4");
    assert!(found.status.success(), "{}{}", said(&found), complained(&found));
    let printed = said(&found);
    let off = printed.split("hole found ").nth(1).and_then(|rest| rest.split(" mm").next()).unwrap();
    let off: f64 = off.parse().unwrap();
    assert!((off - 2.05).abs() < 0.8, "{printed}");
    let again = teachtree(&["analyze", &out]);
    assert!(said(&again).contains("peg_in_hole"), "{}", said(&again));

    let lost = with_holder("84.0", "25.5");
    assert_eq!(lost.status.code(), Some(1), "{}", said(&lost));
    let sentence = format!("hole not found within {:.1} mm", WITHIN_M * 1e3);
    assert!(said(&lost).contains(&sentence), "{}", said(&lost));
}

/// This person knocked the peg askew before taking it; the robot finds it upright, takes it as it stands, and brings it onto the person's way as it carries it.
#[test]
fn what_stands_otherwise_is_brought_onto_its_way_when_it_is_carried() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let (log, commands, out) = (path("log.csv"), path("commands.json"), path("robot.csv"));
    let scene = "hold_and_insert";
    demonstrate(scene, &["--seed", "9"], &log);
    assert!(teachtree(&["command", &log, "-o", &commands]).status.success());
    let done = teachtree(&["simulate", &commands, "--scene", scene, "-o", &out]);
    assert!(done.status.success(), "{}{}", said(&done), complained(&done));
}
