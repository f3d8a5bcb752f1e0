//! Rigid bodies under gravity and Coulomb friction, against closed forms.

use super::support::{MASS, WEIGHT, cube_on_base, run, world};
use nalgebra::Vector3;
use teachtree_base::quantity::Quantity;
use teachtree_base::scene::Scene;
use teachtree_base::yaml;

/// Contact impulses settle to the weight within this, N.
const FORCE_TOLERANCE: f64 = 1e-3;

#[test]
fn resting_force_is_the_weight() {
    let mut world = world(&cube_on_base("", "{}"));
    run(&mut world, 1.0, |_| ());
    run(&mut world, 0.5, |seen| {
        let (force, normal) = seen.contact(0, 1);
        assert!(
            (force - Vector3::new(0.0, 0.0, WEIGHT)).norm() < FORCE_TOLERANCE,
            "force of the base on the cube: {force}"
        );
        assert!((normal - Vector3::z()).norm() < 1e-6, "normal from the base to the cube: {normal}");
        assert!(seen.bodies[0].velocity.norm() < 1e-5);
    });
    let sunk = 0.06 - world.observation().bodies[0].pose.translation.z;
    assert!((0.0..1e-4).contains(&sunk), "the cube sank {sunk} m");
}

#[test]
fn free_fall_takes_the_time_it_should() {
    let mut falling = cube_on_base("", "{}");
    falling.bodies[0].position[2].0 = 10.0;
    let mut world = world(&falling);
    run(&mut world, 1.0, |_| ());
    let state = world.observation().bodies[0];
    // Semi-implicit steps of 1 ms (or a quarter of it) lead the parabola by at most g t dt / 2.
    let ahead = 9.81 * 1e-3 / 2.0;
    assert!((10.0 - state.pose.translation.z - 9.81 / 2.0).abs() <= ahead + 1e-9);
    assert!((state.velocity.z + 9.81).abs() < 1e-9);
}

/// A block on a base that is tilted about y; gravity is what is tilted, so that the block starts without a gap.
fn slides_at(tilt: f64) -> f64 {
    let mut tilted = cube_on_base("", "{}");
    tilted.gravity[0].0 = 9.81 * tilt.sin();
    tilted.gravity[2].0 = -9.81 * tilt.cos();
    let mut world = world(&tilted);
    run(&mut world, 0.2, |_| ());
    let start = world.observation().bodies[0].pose.translation.x;
    run(&mut world, 2.0, |_| ());
    world.observation().bodies[0].pose.translation.x - start
}

#[test]
fn a_block_starts_to_slide_at_the_angle_of_friction() {
    let angle = 0.4_f64.atan();
    let held = slides_at(angle * 0.99);
    assert!(held.abs() < 1e-4, "1 % below atan(μ) it moved {held} m in 2 s");
    // 1 % above: a = g (sin - μ cos), 1/2 a t² over 2 s.
    let tilt = angle * 1.01;
    let expected = 9.81 * (tilt.sin() - 0.4 * tilt.cos()) * 2.0;
    let moved = slides_at(tilt);
    assert!(moved > 0.8 * expected && moved < 1.3 * expected, "moved {moved} m, expected {expected} m");
}

/// Where a cylinder that lies across a base tilted by so much is after a time: where it was put, m, and its turn.
fn rolls_at(tilt: f64, seconds: f64) -> f64 {
    let text = "name: roll
bodies:
  can: {role: object, mass: 100 g, friction: 0.5, position: [0 mm, 0 mm, 28 mm], rotation: [0.7071067811865476, 0.7071067811865476, 0, 0], parts: [{cylinder: [28 mm, 140 mm]}]}
  base: {role: support, friction: 0.5, position: [0 mm, 0 mm, -10 mm], parts: [{box: [3000 mm, 600 mm, 20 mm]}]}
hands: {}";
    let mut tilted: Scene = yaml::read(text, "roll.yaml").unwrap();
    tilted.gravity = [9.81 * tilt.sin(), 0.0, -9.81 * tilt.cos()].map(Quantity);
    let mut world = world(&tilted);
    run(&mut world, seconds, |_| ());
    world.observation().bodies[0].pose.translation.x
}

#[test]
fn a_cylinder_rolls_as_it_should_and_not_by_itself() {
    // What is left of a step's lag moves it by a hundredth of what a slope of 0.01 degrees would.
    assert!(rolls_at(0.0, 5.0).abs() < 1e-4, "{} m", rolls_at(0.0, 5.0));
    // Rolling without slip: a = g sin / (1 + 1/2).
    let tilt = 2.0_f64.to_radians();
    let expected = 9.81 * tilt.sin() / 1.5 / 2.0;
    let moved = rolls_at(tilt, 1.0);
    assert!((moved - expected).abs() < 0.01 * expected, "{moved} m, expected {expected} m");
}

/// A cylinder lies on another one that is fixed, at 20 degrees to the side of its top, and slides down without friction and without a turn.
#[test]
fn a_cylinder_slides_down_another_one_as_it_should() {
    let (start, end) = (20.0_f64.to_radians(), 40.0_f64.to_radians());
    let apart = 0.056;
    let [x, z] = [apart * start.sin(), apart * start.cos()].map(|way| way * 1e3);
    let text = format!(
        "name: slide
bodies:
  can: {{role: object, mass: 100 g, friction: 0, position: [{x} mm, 0 mm, {z} mm], rotation: [0.7071067811865476, 0.7071067811865476, 0, 0], parts: [{{cylinder: [28 mm, 140 mm]}}]}}
  log: {{role: support, friction: 0, position: [0 mm, 0 mm, 0 mm], rotation: [0.7071067811865476, 0.7071067811865476, 0, 0], parts: [{{cylinder: [28 mm, 140 mm]}}]}}
hands: {{}}"
    );
    let mut world = world(&yaml::read(&text, "slide.yaml").unwrap());
    let seen = (0..1000).find_map(|_| {
        run(&mut world, 1e-3, |_| ());
        let can = world.observation().bodies[0];
        let [x, z] = [can.pose.translation.x, can.pose.translation.z];
        (x.atan2(z) > end).then_some((x, z, can.velocity.norm()))
    });
    let (x, z, speed) = seen.unwrap();
    // What it has lost in height it has in speed.
    let expected = (2.0 * 9.81 * apart * (start.cos() - x.atan2(z).cos())).sqrt();
    assert!((speed - expected).abs() < 0.01 * expected, "{speed} m/s, expected {expected} m/s");
    assert!((x.hypot(z) - apart).abs() < 1e-4, "{} m apart, expected {apart} m", x.hypot(z));
}

#[test]
fn friction_on_a_slope_is_reported() {
    let tilt = 0.2_f64;
    let mut tilted = cube_on_base("", "{}");
    tilted.gravity[0].0 = 9.81 * tilt.sin();
    tilted.gravity[2].0 = -9.81 * tilt.cos();
    let mut world = world(&tilted);
    run(&mut world, 1.0, |_| ());
    let (force, _) = world.observation().contact(0, 1);
    let expected = MASS * 9.81 * Vector3::new(-tilt.sin(), 0.0, tilt.cos());
    assert!((force - expected).norm() < 5.0 * FORCE_TOLERANCE, "force {force}, expected {expected}");
}

#[test]
fn impacts_and_rest_gain_no_energy() {
    let mut dropped = cube_on_base("", "{}");
    dropped.bodies[0].position[2].0 = 0.16;
    dropped.bodies[0].rotation = [0.95, 0.2, 0.1, 0.05];
    let mut world = world(&dropped);
    let inertia = MASS * 0.12 * 0.12 / 6.0;
    let mut least = f64::INFINITY;
    run(&mut world, 3.0, |seen| {
        let cube = seen.bodies[0];
        let energy = WEIGHT * cube.pose.translation.z
            + MASS / 2.0 * cube.velocity.norm_squared()
            + inertia / 2.0 * cube.angular_velocity.norm_squared();
        // A corner that went in by up to 1 mm at the impact is pushed out again: m g × 1 mm.
        assert!(energy < least + WEIGHT * 1e-3, "energy rose from {least} J to {energy} J at {} s", seen.time_s);
        least = least.min(energy);
    });
    assert!(world.observation().bodies[0].velocity.norm() < 1e-4, "it came to rest");
}

#[test]
fn stacked_objects_report_the_force_between_them() {
    let second =
        "  top: {role: object, mass: 80 g, position: [0 mm, 0 mm, 170 mm], parts: [{box: [100 mm, 100 mm, 100 mm]}]}";
    let mut world = world(&cube_on_base(second, "{}"));
    run(&mut world, 1.0, |_| ());
    let seen = world.observation();
    let (on_cube, normal) = seen.contact(0, 2);
    assert!((on_cube - Vector3::new(0.0, 0.0, -0.08 * 9.81)).norm() < 5.0 * FORCE_TOLERANCE, "{on_cube}");
    assert!((normal + Vector3::z()).norm() < 1e-6, "{normal}");
    assert!((seen.contact(0, 1).0.z - 0.13 * 9.81).abs() < 5.0 * FORCE_TOLERANCE);
    assert_eq!(seen.contact(2, 0).0, -on_cube);
}

#[test]
fn every_shape_rests_on_its_base() {
    let others =
        "  can: {role: object, mass: 60 g, position: [200 mm, 0 mm, 50 mm], parts: [{cylinder: [20 mm, 100 mm]}]}
  marble: {role: object, mass: 30 g, position: [400 mm, 0 mm, 15 mm], parts: [{ball: 15 mm}]}
  bridge:
    {role: object, mass: 90 g, position: [600 mm, 0 mm, 0 mm], parts: [
      {box: [20 mm, 20 mm, 40 mm], at: [-40 mm, 0 mm, 20 mm]}, {box: [20 mm, 20 mm, 40 mm], at: [40 mm, 0 mm, 20 mm]},
      {box: [100 mm, 20 mm, 10 mm], at: [0 mm, 0 mm, 45 mm]}]}";
    let mut world = world(&cube_on_base(others, "{}"));
    let start = world.observation().clone();
    run(&mut world, 1.0, |_| ());
    for (body, mass) in [(2, 0.06), (3, 0.03), (4, 0.09)] {
        let seen = world.observation();
        let moved = seen.bodies[body].pose.translation.vector - start.bodies[body].pose.translation.vector;
        assert!(moved.norm() < 2e-4, "body {body} moved by {moved}");
        assert!((seen.contact(body, 1).0.z - mass * 9.81).abs() < FORCE_TOLERANCE, "body {body}");
    }
    let (point, normal) = world.surface(2, [0.03, 0.0, 0.01].into()).unwrap();
    assert!(
        (point.coords - Vector3::new(0.02, 0.0, 0.01)).norm() < 1e-9 && (normal - Vector3::x()).norm() < 1e-9,
        "a can stands along z"
    );
    assert!((world.gap(2, 3) - 0.2 + 0.035).abs() < 1e-3, "gap {}", world.gap(2, 3));
}

#[test]
fn scenes_that_cannot_be_simulated_are_refused() {
    let refused = |text: &str| {
        let read = teachtree_base::yaml::read(text, "scene.yaml");
        let made = read.and_then(|scene| teachtree_world::World::new(&scene, teachtree_world::Fingertips::default()));
        made.err().map(|error| error.to_string()).unwrap()
    };
    insta::assert_snapshot!(refused("bodies: {cup: {role: object, mass: 50 g}}"));
    insta::assert_snapshot!(refused("bodies: {cup: {role: object, parts: [{ball: 20 mm}]}}"));
    insta::assert_snapshot!(refused("bodies: {cup: {role: object, mass: 50 g, parts: [{ball: 0 mm}]}}"));
    insta::assert_snapshot!(refused(
        "bodies: {cup: {role: object, mass: 50 g, rotation: [0, 0, 0, 0], parts: [{ball: 20 mm}]}}"
    ));
    insta::assert_snapshot!(refused("{bodies: {}, hands: {left: {fingers: [thumb, palm]}}}"));
}
