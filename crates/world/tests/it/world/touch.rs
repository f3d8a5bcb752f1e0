//! The fingertip contact law, against closed forms.

use super::support::{MASS, WEIGHT, cube_on_base, hand, mean, run, scene, steps, world};
use nalgebra::Vector3;
use teachtree_base::hands::Finger;
use teachtree_world::{HandTarget, Observation, STEP_S, World};

const TWO: &str = "{right: {fingers: [thumb, index]}}";
const THREE: &str = "{right: {fingers: [thumb, index, middle]}}";
/// Where the ball (radius 10 mm) just touches the cube's face, m from its center.
const FACE: f64 = 0.07;
/// Stiffness of tip and coupling in series, N/m.
const SERIES: f64 = 1.0 / (1.0 / 1000.0 + 1.0 / 300.0);

fn force_on_cube(seen: &Observation) -> Vector3<f64> {
    seen.hands[0].tips.iter().map(|tip| tip.force_on(0)).sum()
}

/// Squeezes the cube between y faces with this normal force a side, then moves the hand up by `lift`; how high the cube went.
fn lifted_by(squeeze: f64) -> f64 {
    let mut world = world(&cube_on_base("", TWO));
    let inside = FACE - squeeze / SERIES;
    // The grip is at the center, so that the cube has no reason to turn.
    let at = |z: f64, y: f64| [hand(&[[0.0, -y, z], [0.0, y, z]])];
    for step in 0..steps(0.4) {
        let closed = (step as f64 / 200.0).min(1.0);
        world.step(&at(0.06, 0.08 + (inside - 0.08) * closed));
    }
    for step in 0..steps(3.0) {
        let t = step as f64 / steps(3.0) as f64;
        // So slow that acceleration and the springs' overshoot at lift-off stay below 1 % of the weight.
        world.step(&at(0.06 + 0.006 * t * t * (3.0 - 2.0 * t), inside));
    }
    for _ in 0..steps(0.5) {
        world.step(&at(0.066, inside));
    }
    world.observation().bodies[0].pose.translation.z - 0.06
}

#[test]
fn the_least_squeeze_that_lifts_the_cube_is_half_its_weight_over_static_friction() {
    let least = WEIGHT / 2.0 / 1.0;
    let held = lifted_by(least * 1.03);
    assert!(held > 0.003, "3 % above {least} N a side the cube rose {held} m");
    let slipped = lifted_by(least * 0.97);
    assert!(slipped < 0.0005, "3 % below {least} N a side the cube rose {slipped} m");
}

/// Ratio of friction to normal force, step by step, while a tip presses on the base with 1 N and, after 0.3 s, is drawn along at `speed` m/s.
fn rubbed(speed: f64) -> Vec<f64> {
    let mut world = world(&cube_on_base("", "{right: {fingers: [index]}}"));
    let above = 0.01 - 1.0 / SERIES;
    (0..steps(1.0))
        .map(|step| {
            let x = 0.3 + speed * (step as f64 * 1e-3 - 0.3).max(0.0);
            let force = world.step(&[hand(&[[x, 0.0, above]])]).hands[0].tips[0].force_on(1);
            force.xy().norm() / -force.z
        })
        .collect()
}

#[test]
fn friction_after_slip_is_dynamic_friction_times_normal_force() {
    let slipping = rubbed(0.05).split_off(steps(0.5));
    assert!(slipping.iter().all(|ratio| (ratio - 0.5).abs() < 1e-9), "{slipping:?}");
}

#[test]
fn a_tip_sticks_up_to_static_friction() {
    let ratio = rubbed(0.01);
    let most = ratio.iter().copied().fold(0.0, f64::max);
    assert!((0.98..=1.0 + 1e-9).contains(&most), "the largest friction was {most} of the normal force");
    assert!(ratio[..steps(0.3)].iter().skip(1).all(|ratio| *ratio < 1e-6), "no friction before it is drawn");
}

/// Mean finger force, N, and contact forces while two fingers on the -y face push the cube along y at 50 mm/s.
fn pushed(wall: &str, press: f64) -> (Vector3<f64>, Vector3<f64>) {
    let mut world = world(&cube_on_base(wall, TWO));
    let (mut on_cube, mut by_wall, mut samples) = (Vector3::zeros(), Vector3::zeros(), 0.0);
    for step in 0..steps(3.0) {
        let t = step as f64 * 1e-3;
        let y = -FACE - 0.002 + 0.05 * t;
        let x = press * (t / 0.5).min(1.0);
        let seen = world.step(&[hand(&[[-0.04 + x, y, 0.05], [0.04 + x, y, 0.05]])]);
        if t > 1.5 {
            on_cube += force_on_cube(seen);
            by_wall += seen.contact(0, seen.bodies.len() - 1).0;
            samples += 1.0;
        }
    }
    (on_cube / samples, by_wall / samples)
}

#[test]
fn pushing_along_the_base_takes_friction_times_weight() {
    let (force, _) = pushed("", 0.0);
    assert!((force.y - 0.4 * WEIGHT).abs() < 0.002, "pushed with {force}");
    assert!(force.x.abs() < 0.002 && force.z.abs() < 0.01, "pushed with {force}");
}

#[test]
fn pushing_along_a_wall_takes_the_friction_of_both() {
    let wall =
        "  wall: {role: wall, friction: 0.4, position: [110 mm, 0 mm, 200 mm], parts: [{box: [100 mm, 2 m, 400 mm]}]}";
    let (force, by_wall) = pushed(wall, 0.0003);
    assert!(by_wall.x < -0.05, "the wall is touched: {by_wall}");
    let carried = WEIGHT - force.z;
    assert!((force.y - 0.4 * carried - 0.4 * -by_wall.x).abs() < 0.002, "pushed with {force}, wall {by_wall}");
    assert!((by_wall.y - 0.4 * by_wall.x).abs() < 0.002, "friction of the wall {by_wall}");
}

#[test]
fn the_displayed_force_has_a_ceiling() {
    let mut world = world(&cube_on_base("", THREE));
    let mut most: f64 = 0.0;
    for step in 0..steps(1.0) {
        let y = 0.09 - 0.07 * (step as f64 / 500.0).min(1.0);
        let seen = world.step(&[hand(&[[0.0, -y, 0.09], [0.012, y, 0.09], [-0.012, y, 0.09]])]);
        most = seen.hands[0].tips.iter().map(|tip| tip.force_on(0).norm()).fold(most, f64::max);
    }
    assert!((4.5..=5.0 + 1e-9).contains(&most), "the largest force was {most} N");
}

const TEN: &str =
    "{left: {fingers: [thumb, index, middle, ring, little]}, right: {fingers: [thumb, index, middle, ring, little]}}";

/// Two hands whose fingers press on the y faces from both sides, at a distance `d` from the middle and a height `z`, against the other hand's thumb.
fn ten_tips(d: f64, z: f64) -> [HandTarget; 2] {
    [-1.0, 1.0].map(|side| {
        let spread = [-0.04, -0.02, 0.02, 0.04].map(|x| [x, d, z]);
        hand(&[[0.0, -d, z], spread[0], spread[1], spread[2], spread[3]].map(|[x, y, z]| [x, y * side, z]))
    })
}

/// Closes ten fingertips on the cube within 0.3 s and holds it for the rest of a second.
fn grip_with_ten(world: &mut World, inside: f64) {
    for step in 0..steps(1.0) {
        let d = 0.075 + (inside - 0.075) * (step as f64 / 300.0).min(1.0);
        world.step(&ten_tips(d, 0.08));
    }
}

#[test]
fn ten_fingertips_on_a_light_cube_stay_still() {
    let mut world = world(&cube_on_base("", TEN));
    let inside = FACE - 1.0 / SERIES;
    grip_with_ten(&mut world, inside);
    let held = ten_tips(inside, 0.08);
    for _ in 0..steps(1.0) {
        let seen = world.step(&held);
        assert!(seen.bodies[0].velocity.norm() < 1e-3, "{}", seen.bodies[0].velocity);
        let forces = seen.hands.iter().flat_map(|hand| &hand.tips).map(|tip| tip.force_on(0).norm());
        assert!(forces.clone().fold(0.0, f64::max) < 5.0 && forces.sum::<f64>() > 5.0);
    }
}

#[test]
fn a_cube_of_20_g_squeezed_hard_by_ten_fingertips_stays_still() {
    let text = "
  cube: {role: object, mass: 20 g, friction: 0.4, position: [0 mm, 0 mm, 60 mm], parts: [{box: [120 mm, 120 mm, 120 mm]}]}
  base: {role: support, friction: 0.4, position: [0 mm, 0 mm, -50 mm], parts: [{box: [2 m, 2 m, 100 mm]}]}";
    let mut world = world(&scene(&format!("bodies:{text}\nhands: {TEN}\n")));
    let inside = FACE - 4.0 / SERIES;
    grip_with_ten(&mut world, inside);
    let forces = |seen: &Observation| -> Vec<Vector3<f64>> {
        seen.hands.iter().flat_map(|hand| &hand.tips).map(|tip| tip.force_on(0)).collect()
    };
    let mut before = forces(world.observation());
    for _ in 0..steps(1.0) {
        let seen = world.step(&ten_tips(inside, 0.08));
        let (velocity, spin) = (seen.bodies[0].velocity, seen.bodies[0].angular_velocity);
        assert!(velocity.norm() < 1e-3 && spin.norm() < 1e-2, "{velocity} {spin}");
        let now = forces(seen);
        for (now, before) in now.iter().zip(&before) {
            assert!((now.y.abs() / 4.0 - 1.0).abs() < 0.02, "pressed with {now}, expected 4 N");
            assert!((now - before).norm() < 0.01, "{before} became {now} in a step");
        }
        before = now;
    }
}

#[test]
fn a_heavy_cube_pressed_onto_the_base_by_five_fingertips_bears_all_of_them() {
    let text = "
  cube: {role: object, mass: 2 kg, friction: 0.4, position: [0 mm, 0 mm, 60 mm], parts: [{box: [120 mm, 120 mm, 120 mm]}]}
  base: {role: support, friction: 0.4, position: [0 mm, 0 mm, -50 mm], parts: [{box: [2 m, 2 m, 100 mm]}]}";
    let hands = "{right: {fingers: [thumb, index, middle, ring, little]}}";
    let mut world = world(&scene(&format!("bodies:{text}\nhands: {hands}\n")));
    let over = |z: f64| {
        [hand(&[[0.0, 0.0], [0.03, 0.04], [0.03, -0.04], [-0.03, 0.04], [-0.03, -0.04]].map(|[x, y]| [x, y, z]))]
    };
    let pressed = 0.12 + 0.01 - 3.0 / SERIES;
    for step in 0..steps(1.0) {
        world.step(&over(0.135 + (pressed - 0.135) * (step as f64 / 300.0).min(1.0)));
    }
    for _ in 0..steps(0.5) {
        let seen = world.step(&over(pressed));
        let (by_tips, by_base) = (force_on_cube(seen).z, seen.contact(0, 1).0.z);
        assert!((by_tips / -15.0 - 1.0).abs() < 0.02, "pressed with {by_tips} N, expected 15 N");
        assert!((by_base / (15.0 + 2.0 * 9.81) - 1.0).abs() < 0.02, "the base bears {by_base} N");
        assert!(seen.bodies[0].velocity.norm() < 1e-3, "{}", seen.bodies[0].velocity);
    }
}

#[test]
fn ten_fingertips_that_slip_along_a_cube_of_20_g_do_not_shake_it() {
    let text = "
  cube: {role: object, mass: 20 g, friction: 0.4, position: [0 mm, 0 mm, 60 mm], parts: [{box: [120 mm, 120 mm, 120 mm]}]}
  base: {role: support, friction: 0.4, position: [0 mm, 0 mm, -50 mm], parts: [{box: [2 m, 2 m, 100 mm]}]}
  lid: {role: wall, friction: 0.4, position: [0 mm, 0 mm, 171 mm], parts: [{box: [2 m, 2 m, 100 mm]}]}";
    let mut world = world(&scene(&format!("bodies:{text}\nhands: {TEN}\n")));
    let inside = FACE - 1.0 / SERIES;
    for step in 0..steps(0.5) {
        world.step(&ten_tips(0.075 + (inside - 0.075) * (step as f64 / 300.0).min(1.0), 0.03));
    }
    let mut velocity = Vector3::zeros();
    let friction = 10.0 * 0.5 * 1.0;
    for step in 0..steps(0.6) {
        let t = step as f64 * 1e-3;
        let seen = world.step(&ten_tips(inside, 0.03 + 0.1 * t));
        let shaken = (seen.bodies[0].velocity - velocity).norm();
        velocity = seen.bodies[0].velocity;
        if t > 0.25 {
            let mut forces = seen.hands.iter().flat_map(|hand| &hand.tips).map(|tip| tip.force_on(0));
            assert!(forces.all(|force| (force.z / force.y.abs() - 0.5).abs() < 0.02), "every tip slips");
            assert!(shaken < 1e-4, "step {step}: shaken by {shaken} m/s");
            let by_lid = seen.contact(0, 2).0.z;
            assert!((by_lid / (0.02 * 9.81 - friction) - 1.0).abs() < 0.02, "the lid bears {by_lid} N");
        }
    }
}

#[test]
fn what_fingertips_feel_is_what_moves_the_cube() {
    let mut world = world(&cube_on_base("", TEN));
    let inside = FACE - 2.0 / SERIES;
    grip_with_ten(&mut world, inside);
    let mut velocity = world.observation().bodies[0].velocity;
    let (mut fastest, mut turned): (f64, f64) = (0.0, 0.0);
    for step in 0..steps(2.0) {
        // Lifted clear of the base, and shaken.
        let t = step as f64 * 1e-3;
        let targets = ten_tips(inside, 0.08 + 0.04 * t).map(|target| HandTarget {
            tips: target.tips.iter().map(|tip| tip + Vector3::new(0.005, 0.003, 0.0) * (20.0 * t).sin()).collect(),
            ..target
        });
        let seen = world.step(&targets);
        let gained = (seen.bodies[0].velocity - velocity) * MASS / STEP_S;
        velocity = seen.bodies[0].velocity;
        let felt = force_on_cube(seen) + seen.hands[1].tips.iter().map(|tip| tip.force_on(0)).sum::<Vector3<f64>>();
        let wanted = felt + seen.contact(0, 1).0 - Vector3::z() * WEIGHT;
        assert!((gained - wanted).norm() < 1e-6, "step {step}: gained {gained}, felt {wanted}");
        (fastest, turned) = (fastest.max(velocity.norm()), turned.max(seen.bodies[0].angular_velocity.norm()));
    }
    assert!(fastest > 0.05 && turned > 0.05, "it was shaken: {fastest} m/s, {turned} rad/s");
}

#[test]
fn a_pinch_of_two_tips_resists_a_twist_by_its_patches_only() {
    // Gripped 5 mm beside the center of mass: m g × 5 mm of torque about the line between the tips.
    let swing = |squeeze: f64| {
        let mut world = world(&cube_on_base("", TWO));
        let inside = FACE - squeeze / SERIES;
        let at = |z: f64, y: f64| [hand(&[[0.005, -y, z], [0.005, y, z]])];
        for step in 0..steps(0.5) {
            world.step(&at(0.06, 0.075 + (inside - 0.075) * (step as f64 / 300.0).min(1.0)));
        }
        for step in 0..steps(1.0) {
            world.step(&at(0.06 + 0.03 * step as f64 * 1e-3, inside));
        }
        world.observation().bodies[0].pose.rotation.angle()
    };
    // Two patches of 4 mm hold 2 × 2/3 × 4 mm × 0.5 × f against 2.45 mN m once they slip.
    let (firm, loose) = (swing(2.5), swing(0.4));
    assert!(firm < 0.5 * loose, "turned by {firm} rad when squeezed firmly, {loose} rad when squeezed loosely");
}

#[test]
fn what_flat_pads_hold_beside_its_middle_sinks_as_far_as_they_twist() {
    // Gripped 5 mm beside the center of mass, which is 2.45 mN m about the line between the pads. A disc of the radius r of an elastic foundation that has
    // 700 N/m for 4 mm twists by 700 N/m (r / 4 mm)² r² / 2 a rad.
    let sunk = |pad: f64| {
        let mut world = world(&cube_on_base("", TWO));
        [Finger::Thumb, Finger::Index].into_iter().for_each(|finger| world.set_pad(0, finger, pad));
        let inside = FACE - 2.5 / SERIES;
        let at = |z: f64, y: f64| [hand(&[[0.005, -y, z], [0.005, y, z]])];
        for step in 0..steps(0.5) {
            world.step(&at(0.06, 0.075 + (inside - 0.075) * (step as f64 / 300.0).min(1.0)));
        }
        for step in 0..steps(4.0) {
            world.step(&at(0.06 + (0.015 * step as f64 * 1e-3).min(0.03), inside));
        }
        world.observation().bodies[0].pose.rotation.angle()
    };
    for pad in [0.008, 0.010, 0.012] {
        let (twisted, expected) =
            (sunk(pad), WEIGHT * 0.005 / (2.0 * 700.0 * (pad / 0.004_f64).powi(2) * pad * pad / 2.0));
        assert!((twisted / expected - 1.0).abs() < 0.03, "pads of {pad} m twist by {twisted} rad, expected {expected}");
    }
}

#[test]
fn observations_name_the_finger_and_what_it_touches() {
    let mut world = world(&cube_on_base("", TWO));
    let targets = [hand(&[[0.0, -FACE + 0.0005, 0.06], [0.3, 0.0, -0.001 + 0.01]])];
    let force = mean(&mut world, &targets, 0.5, |seen| seen.hands[0].tips[0].force_on(0));
    assert!((force.y - 0.0005 * SERIES).abs() < 0.01, "{force}");
    let tips = &world.observation().hands[0].tips;
    assert_eq!((tips[0].finger, tips[1].finger), (Finger::Thumb, Finger::Index));
    assert_eq!(tips[0].touches.iter().map(|touch| touch.body).collect::<Vec<_>>(), [0]);
    assert_eq!(
        tips[1].touches.iter().map(|touch| touch.body).collect::<Vec<_>>(),
        [1],
        "the index presses on the base"
    );
    run(&mut world, 0.1, |_| ());
    assert_eq!(world.observation().hands[0].tips[0].touches.len(), 1, "missing targets leave the tips where they were");
}
