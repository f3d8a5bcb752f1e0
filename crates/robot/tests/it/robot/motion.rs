//! Dynamics against closed forms and energy; controllers; a finger that presses and a hand that holds.

use super::kinematics::shipped;
use crate::demonstrated::commanded;
use nalgebra::{DVector, Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use teachtree_base::hands::{Finger, Side};
use teachtree_base::meaning::Meaning;
use teachtree_base::scene::Scene;
use teachtree_base::yaml;
use teachtree_command::{Commands, Contact, GraspSpec, Segment, Task, Tip};
use teachtree_robot::control::executor::Executor;
use teachtree_robot::control::impedance::limited;
use teachtree_robot::dynamics::motion::Motion;
use teachtree_robot::planning::plan::Target;
use teachtree_robot::planning::start::Start;
use teachtree_robot::simulation::{Performance, simulate};
use teachtree_robot::{JointKind, Robot};
use teachtree_world::{self as world, Fingertips, TipState, World};

const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

#[test]
fn torques_of_gravity_hold_the_robot_still() {
    let robot = shipped("both_hands").limb(Side::Right).unwrap();
    let mut motion = Motion::new(Isometry3::identity(), robot.tree.middle() * 0.7, GRAVITY);
    let start = motion.q.clone();
    for _ in 0..200 {
        let posture = motion.posture(&robot.tree, 0.001);
        let torques = posture.gravity.clone();
        motion.step(&robot.tree, &posture, &torques, &DVector::zeros(robot.tree.dofs.len()), 0.001);
    }
    assert!((motion.q - start).amax() < 1e-9);
}

#[test]
fn a_falling_robot_keeps_its_energy() {
    let mut robot = shipped("both_hands").limb(Side::Right).unwrap();
    for dof in &mut robot.tree.dofs {
        (dof.damping, dof.friction, dof.range) = (0.0, 0.0, [-100.0, 100.0]);
    }
    let mut q = robot.tree.middle();
    for (index, value) in q.iter_mut().enumerate() {
        *value = 0.3 + 0.1 * (index as f64).sin();
    }
    let mut motion = Motion::new(Isometry3::identity(), q, GRAVITY);
    let none = DVector::zeros(robot.tree.dofs.len());
    let energy = |motion: &Motion| {
        let posture = motion.posture(&robot.tree, 1e-5);
        let kinetic = 0.5 * motion.rates.dot(&(&posture.mass * &motion.rates));
        let lifted =
            robot.tree.links.iter().zip(&posture.poses).map(|(link, pose)| link.mass * 9.81 * (pose * link.centre).z);
        (kinetic, kinetic + lifted.sum::<f64>())
    };
    let (_, before) = energy(&motion);
    for _ in 0..10_000 {
        let posture = motion.posture(&robot.tree, 2e-5);
        motion.step(&robot.tree, &posture, &none, &none, 2e-5);
    }
    let (kinetic, after) = energy(&motion);
    assert!(kinetic > 1.0, "it fell: {kinetic} J");
    // Semi-implicit steps of 20 µs.
    assert!((after - before).abs() < 0.002 * kinetic, "{before} J and {after} J, of them {kinetic} J of motion");
}

#[test]
fn what_leaves_a_controller_is_finite_and_within_the_motors() {
    let robot = shipped("gifu_hand_iii_right");
    let mut torques = DVector::from_element(16, 100.0);
    torques[3] = f64::NAN;
    torques[4] = -f64::INFINITY;
    let torques = limited(&robot.tree, torques);
    assert_eq!((torques[3], torques[4]), (0.0, 0.0));
    for (torque, dof) in torques.iter().zip(&robot.tree.dofs) {
        assert!(torque.abs() <= dof.torque);
    }
}

#[test]
fn the_arm_finds_poses_again() {
    finds_poses_again(&shipped("both_hands"));
}

#[test]
fn an_arm_on_a_rail_with_a_gear_finds_poses_again() {
    let mut robot = shipped("both_hands");
    let arm = robot.hands[&Side::Right].arm.clone();
    let mut joints = robot.tree.links.iter_mut().filter_map(|link| link.joint.as_mut());
    let rail = joints.find(|joint| joint.dof == arm[0]).unwrap();
    rail.kind = JointKind::Prismatic;
    let geared = joints.find(|joint| joint.dof == arm[3]).unwrap();
    geared.ratio = -0.5;
    finds_poses_again(&robot);
}

fn finds_poses_again(robot: &Robot) {
    let hand = &robot.hands[&Side::Right];
    let mut q: Vec<f64> = robot.tree.middle().iter().copied().collect();
    for (&dof, value) in hand.arm.iter().zip([0.4, 0.6, 0.9, -0.5, 0.8, 0.3]) {
        q[dof] = value;
    }
    let palm = robot.tree.forward_kinematics(&q)[hand.palm];
    let mut found = q.clone();
    for &dof in &hand.arm {
        found[dof] += 0.25;
    }
    let missing = hand.arm_on(&robot.tree).inverse_kinematics(&Isometry3::identity(), &palm, &mut found, 100);
    assert!(missing.m < 1e-6 && missing.rad < 1e-6, "{missing:?}");
    assert!(
        (robot.tree.forward_kinematics(&found)[hand.palm].translation.vector - palm.translation.vector).norm() < 1e-6
    );
}

fn scene(text: &str) -> Scene {
    yaml::read(text, "scene.yaml").unwrap()
}

#[test]
fn one_finger_holds_one_newton_within_five_percent() {
    let robot = shipped("gifu_hand_iii_right");
    let hand = robot.hands[&Side::Right].clone();
    // The palm looks down; the index finger presses on a table below it.
    let palm = Isometry3::from_parts(
        Translation3::new(0.0, 0.0, 0.08),
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI),
    );
    let scene = scene(
        "bodies: {table: {role: support, position: [0 mm, 0 mm, -50 mm], parts: [{box: [1 m, 1 m, 100 mm]}]}}
hands: {right: {fingers: [thumb, index, middle, ring, little], tip_radius: 7 mm}}",
    );
    let mut world = World::new(&scene, Fingertips::default()).unwrap();
    let above = |height: f64| Point3::new(0.19, 0.038, height);
    let target = |height: f64, force: f64| Target {
        palm,
        tips: vec![(Finger::Index, above(height), Vector3::new(0.0, 0.0, -force))],
        idle: Vec::new(),
        object: Isometry3::identity(),
        free: false,
        pushed: false,
    };
    let mut runs = vec![{
        let start = Start::new(&robot, &hand, &target(0.012, 0.0), &[palm]).unwrap();
        Executor::new(robot, hand, start, GRAVITY)
    }];
    let mut step_to = |target: Target, world: &mut World| {
        let felt = |tip: &TipState| tip.touches.iter().map(|touch| touch.force).sum();
        let exerted: Vec<Vector3<f64>> = world.observation().hands[0].tips.iter().map(felt).collect();
        runs[0].set_target(&target, &exerted);
        world.step_moved(&mut runs);
    };
    for step in 0..300 {
        step_to(target(0.012 - 0.005 * f64::from(step) / 300.0, 0.0), &mut world);
    }
    let mut forces = Vec::new();
    for step in 0..1500 {
        step_to(target(0.007, (f64::from(step) / 200.0).min(1.0)), &mut world);
        if step >= 500 {
            forces.push(-world.observation().hands[0].tips[1].touches.iter().map(|touch| touch.force.z).sum::<f64>());
        }
    }
    let (low, high) =
        forces.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), force| (low.min(*force), high.max(*force)));
    assert!(low > 0.95 && high < 1.05, "{low} to {high} N");
}

/// The chapter's cube, grasped by thumb, index and middle finger, lifted by 60 mm and held for a time.
pub(super) fn lift(held_s: f64, firmly: f64) -> (Commands, Scene) {
    let scene = scene(
        "name: lift
bodies:
  cube: {role: object, mass: 50 g, friction: 0.4, position: [100 mm, 0 mm, 60 mm], parts: [{box: [120 mm, 120 mm, 120 mm]}]}
  base: {role: support, friction: 0.4, position: [0 mm, 0 mm, -10 mm], parts: [{box: [640 mm, 600 mm, 20 mm]}]}
hands: {right: {fingers: [thumb, index, middle], tip_radius: 10 mm}}",
    );
    let contacts = [
        (Finger::Thumb, [0.0, -0.06, 0.03]),
        (Finger::Index, [-0.015, 0.06, 0.03]),
        (Finger::Middle, [0.015, 0.06, 0.03]),
    ];
    let squeezed = [1.5, 0.75, 0.75].map(|force| force * firmly);
    let weight = [0.245, 0.1225, 0.1225];
    let segment = |primitive: &str, seconds: f64, from: f64, to: f64, lifted: f64| {
        let n = (seconds * 100.0) as usize + 1;
        let share = |at: usize| teachtree_base::easing::minimum_jerk(at as f64 / (n - 1) as f64);
        Segment {
            primitive: primitive.into(),
            does: if primitive == "Grasp" { Meaning::Close } else { Meaning::Carry },
            duration_s: seconds,
            grasp: Some(0),
            touching: true,
            object: (0..n).map(|at| [0.1, 0.0, 0.06 + from + (to - from) * share(at), 1.0, 0.0, 0.0, 0.0]).collect(),
            hand: vec![[0.0, 0.0, 0.03]; n],
            tips: contacts
                .iter()
                .zip(squeezed)
                .zip(weight)
                .map(|(((finger, point), squeeze), weight)| Tip {
                    finger: *finger,
                    position: vec![*point; n],
                    force: vec![[0.0, -squeeze * point[1].signum(), weight * lifted]; n],
                    demonstrated_force: Vec::new(),
                })
                .collect(),
            ..Segment::default()
        }
    };
    let grasp = GraspSpec {
        contacts: contacts
            .iter()
            .map(|(finger, point)| Contact { finger: *finger, point: *point, normal: [0.0, point[1].signum(), 0.0] })
            .collect(),
        ..GraspSpec::default()
    };
    let task = Task {
        track: Side::Right,
        task: "lift".into(),
        object: "cube".into(),
        grasps: vec![grasp],
        segments: vec![
            segment("Grasp", 0.5, 0.0, 0.0, 0.0),
            segment("Translate", 1.5, 0.0, 0.06, 1.0),
            segment("Translate", held_s, 0.06, 0.06, 1.0),
        ],
        start_s: 0.0,
        end_s: 0.0,
        into: None,
        left_out: vec![],
    };
    (
        Commands { schema: teachtree_command::SCHEMA.into(), rate_hz: 100.0, tasks: vec![task], ..Commands::default() },
        scene,
    )
}

#[test]
fn the_hand_lifts_the_cube_and_holds_it_within_a_millimetre() {
    for name in ["gifu_hand_iii_right", "both_hands"] {
        let robot = shipped(name);
        let (mut commands, scene) = lift(if name == "both_hands" { 2.0 } else { 10.0 }, 1.0);
        teachtree_robot::map(&mut commands, &robot, &scene).unwrap();
        let grasp = &commands.tasks[0].grasps[0];
        assert!(grasp.mapped.is_some(), "{:?}", grasp.infeasible);
        let Performance { recording, outcomes, .. } = simulate(&commands, &robot, &scene, &mut |_| ()).unwrap();
        let outcome = &outcomes[0];
        assert!(outcome.done, "{name}: {outcome:?}");
        // From when it hangs still: grasp 0.9 s, lift 1.5 s, and half a second.
        let (held, end) = (2900 / teachtree_robot::simulation::recorder::RECORDED, recording.time.len() - 1);
        let column = |name: &str| &recording.columns[name].values;
        for axis in ["x", "y", "z"] {
            let values = &column(&format!("cube.position.{axis}"))[held..end];
            let (low, high) =
                values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
            assert!(high - low < 1e-3, "{name}, {axis}: {low} to {high}");
        }
    }
}

/// Between strokes the screw stays rotated, by 139° before the third one. A hand does not have to follow from the first orientation.
#[test]
fn every_stroke_on_a_screw_gets_a_grasp() {
    let (robot, scene) = (shipped("both_hands"), world::scene("turn_screw").unwrap());
    let mut commands = commanded("turn_screw", 7);
    teachtree_robot::map(&mut commands, &robot, &scene).unwrap();
    let grasps: Vec<_> = commands.tasks.iter().flat_map(|task| &task.grasps).collect();
    assert_eq!(grasps.len(), 3);
    for grasp in grasps {
        assert!(grasp.mapped.is_some(), "{:?}", grasp.infeasible);
    }
}

#[test]
fn what_keeps_a_hand_from_a_grasp_is_named_with_its_place() {
    let (mut commands, scene) = lift(1.0, 1.0);
    // It was taught some time after the recording began.
    let task = &mut commands.tasks[0];
    (task.start_s, task.end_s) = (7.0, 10.0);
    for (segment, demonstrated_start_s) in task.segments.iter_mut().zip([7.0, 7.5, 9.0]) {
        segment.demonstrated_start_s = demonstrated_start_s;
    }
    let why = |beside: &[(&str, &str)]| {
        let mut scene = scene.clone();
        for (name, body) in beside {
            let body = format!("{{role: wall, {body}}}");
            scene.bodies.insert((*name).into(), yaml::read(&body, "body").unwrap());
        }
        let mut commands = commands.clone();
        teachtree_robot::map(&mut commands, &shipped("gifu_hand_iii_right"), &scene).unwrap();
        commands.tasks[0].grasps[0].infeasible.clone().unwrap_or_default()
    };
    // Clear of the cube where it stands, but not of the fingers after it.
    let rail = "position: [100 mm, 75 mm, 60 mm], parts: [{box: [120 mm, 20 mm, 120 mm]}]";
    let printed =
        why(&[("rail", rail), ("far", "position: [100 mm, 275 mm, 60 mm], parts: [{box: [120 mm, 20 mm, 20 mm]}]")]);
    assert!(printed.ends_with("it could be held without `rail` where `cube` is taken, at 7.0 s"), "{printed}");
    // High enough to be met where the cube is let go too.
    let high = "position: [100 mm, 75 mm, 120 mm], parts: [{box: [120 mm, 20 mm, 240 mm]}]";
    let printed = why(&[("rail", high)]);
    assert!(printed.ends_with("it could be held without `rail`"), "{printed}");
    // Two of them, each of which is enough.
    let other = "position: [100 mm, -75 mm, 60 mm], parts: [{box: [120 mm, 20 mm, 120 mm]}]";
    let printed = why(&[("rail", rail), ("other", other)]);
    assert!(printed.ends_with("it could be held without the bodies around it"), "{printed}");
    assert_eq!(why(&[]), "");
}

/// Commanded are forces with which friction just carries the weight. The hand feels that the cube is about to slip, and holds it more firmly.
#[test]
fn a_hand_that_feels_slip_holds_more_firmly() {
    let robot = shipped("gifu_hand_iii_right");
    let (mut commands, scene) = lift(2.0, 0.2);
    teachtree_robot::map(&mut commands, &robot, &scene).unwrap();
    let Performance { outcomes, .. } = simulate(&commands, &robot, &scene, &mut |_| ()).unwrap();
    assert!(outcomes[0].done, "{:?}", outcomes[0]);
    assert!(outcomes[0].largest_force > 0.4, "0.39 N would do: {:?}", outcomes[0]);
}

/// A person may press harder than the hand may: all fingers press less, in the same measure, and hold what they held.
#[test]
fn no_finger_presses_harder_than_the_hand_may() {
    let robot = shipped("gifu_hand_iii_right");
    let limits: Vec<f64> = robot.hands[&Side::Right].fingers.iter().map(|finger| finger.force).collect();
    let limit = limits.iter().copied().fold(0.0, f64::max);
    let (mut commands, scene) = lift(1.0, 4.0);
    assert!(commands.tasks[0].segments[0].tips[0].force[0][1] > limit, "the thumb is asked for more than it may");
    teachtree_robot::map(&mut commands, &robot, &scene).unwrap();
    let Performance { outcomes, .. } = simulate(&commands, &robot, &scene, &mut |_| ()).unwrap();
    let (outcome, forces) = (&outcomes[0], &outcomes[0].forces);
    // The hand cannot exert the commanded force, and this is reported.
    assert!(outcome.done && !forces.kept(), "{outcome:?}");
    assert!(forces.largest <= limit && forces.allowed == limit && forces.largest > 0.8 * limit, "{outcome:?}");
}

/// An object that stands elsewhere than it was taught is brought onto the taught way, though the first part of it in which it is held is short.
#[test]
fn what_stands_elsewhere_ends_where_it_was_taught_to() {
    let robot = shipped("gifu_hand_iii_right");
    let (mut commands, mut scene) = lift(0.5, 1.0);
    // The lift comes in two parts, the first of a twentieth of a second.
    let lift = commands.tasks[0].segments[1].clone();
    let part = |from: usize, to: usize| {
        let mut part = lift.clone();
        part.object = part.object[from..=to].to_vec();
        part.hand = part.hand[from..=to].to_vec();
        for tip in &mut part.tips {
            tip.position = tip.position[from..=to].to_vec();
            tip.force = tip.force[from..=to].to_vec();
        }
        part.duration_s = (to - from) as f64 / 100.0;
        part
    };
    let last = lift.object.len() - 1;
    commands.tasks[0].segments.splice(1..2, [part(0, 5), part(5, last)]);
    teachtree_robot::map(&mut commands, &robot, &scene).unwrap();
    let cube = scene.bodies.get_mut("cube").unwrap();
    cube.position[0].0 += 0.02;
    cube.position[1].0 -= 0.02;
    let half = 5.0_f64.to_radians();
    cube.rotation = [half.cos(), 0.0, 0.0, half.sin()];
    let Performance { outcomes, .. } = simulate(&commands, &robot, &scene, &mut |_| ()).unwrap();
    let outcome = &outcomes[0];
    assert!(outcome.done && outcome.forces.kept(), "{outcome:?}");
}
