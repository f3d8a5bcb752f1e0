//! Cells that differ from their scene, against closed forms.

use super::kinematics::shipped;
use super::motion::lift;
use nalgebra::{Isometry3, Translation3, Vector3};
use teachtree_base::hands::Side;
use teachtree_base::quantity::Quantity;
use teachtree_robot::MAX_DOFS;
use teachtree_robot::control::executor::Executor;
use teachtree_robot::planning::plan::Target;
use teachtree_robot::planning::start::Start;
use teachtree_robot::simulation::pose_sensor::PoseSensor;
use teachtree_robot::simulation::{CellVariation, Performance, simulate_varied};
use teachtree_world::{BodyState, Observation};

/// The lift of the cube in a varied cell.
fn lifted(variation: &CellVariation) -> Performance {
    let robot = shipped("gifu_hand_iii_right");
    let (mut commands, scene) = lift(1.0, 1.0);
    teachtree_robot::map(&mut commands, &robot, &scene).unwrap();
    simulate_varied(&commands, &robot, &scene, variation, &mut |_| ()).unwrap()
}

/// Fingertips carry a weight up to μ Σ f_n: 0.49 N at 3 N require μ = 0.16, and 1.6 times the weight 0.26. Fingertips have μ = 1 without variation.
#[test]
fn friction_and_mass_decide_whether_an_object_is_held() {
    let done = |friction: f64, mass: f64| {
        let outcome = &lifted(&CellVariation { friction, mass, ..CellVariation::default() }).outcomes[0];
        assert_eq!(outcome.done, outcome.causes.is_empty(), "{outcome:?}");
        outcome.done
    };
    assert!(done(0.22, 1.0));
    assert!(!done(0.13, 1.0));
    assert!(!done(0.22, 1.6));
}

/// A held object is brought to its place as the sensor sees it.
#[test]
fn an_object_ends_off_by_the_error_of_its_measured_pose() {
    let pose_error = [0.002, 0.0, 0.0].map(Quantity);
    let outcome = &lifted(&CellVariation { pose_error, ..CellVariation::default() }).outcomes[0];
    assert!((outcome.off - 0.002).abs() < 2e-4, "{outcome:?}");
    // An object that is displaced and measured is brought to the demonstrated place.
    let object_offset = [0.01, -0.005].map(Quantity);
    let object_turn = Quantity(0.1);
    let outcome = &lifted(&CellVariation { object_offset, object_turn, ..CellVariation::default() }).outcomes[0];
    assert!(outcome.done && outcome.off < 1e-3, "{outcome:?}");
}

/// A fingertip of stiffness K that presses with f sinks by f / K into the object; K is 1000 N/m without variation.
#[test]
fn softer_fingertips_sink_deeper() {
    let held = |contact_stiffness: f64| {
        let Performance { recording, .. } = lifted(&CellVariation { contact_stiffness, ..CellVariation::default() });
        let last = |name: &str| *recording.columns[name].values.last().unwrap();
        (last("right.thumb.position.y") - last("cube.position.y"), last("right.thumb.force.y"))
    };
    let [(soft, soft_n), (usual, usual_n)] = [0.3, 1.0].map(held);
    let (deeper, expected) = (soft - usual, soft_n / 300.0 - usual_n / 1000.0);
    assert!(expected > 0.0015 && (deeper - expected).abs() < 0.05 * expected, "{deeper} m, expected {expected} m");
}

/// Bodies at a place that moves by 1 m in a step.
fn seen(step: usize) -> Observation {
    let pose = Isometry3::from(Translation3::new(step as f64, 0.0, 0.0));
    let body = BodyState { pose, velocity: Vector3::zeros(), angular_velocity: Vector3::zeros() };
    Observation { time_s: 0.0, hands: Vec::new(), bodies: vec![body; 2], contacts: Vec::new() }
}

#[test]
fn measured_poses_are_late_and_off() {
    let pose_error = [0.0, 0.25, 0.0].map(Quantity);
    let variation = CellVariation { pose_delay: Quantity(0.030), pose_error, ..CellVariation::default() };
    let mut sensor = PoseSensor::new(&variation, &seen(0));
    for step in 1..100 {
        sensor.measure(&seen(step));
        let measured = sensor.poses()[1].translation.vector;
        assert_eq!(measured, Vector3::new(step.saturating_sub(30) as f64, 0.25, 0.0));
    }
}

/// Standard deviations, and the correlation over 20 ms, which is 1/e. Bodies have their own noise, and a seed gives the same noise again.
#[test]
fn noise_has_its_deviation_and_correlation() {
    const STEPS: usize = 200_000;
    let (pose_noise, rotation_noise) = (Quantity(0.001), Quantity(0.01));
    let series = |seed: u64| {
        let variation = CellVariation { pose_noise, rotation_noise, seed, ..CellVariation::default() };
        let mut sensor = PoseSensor::new(&variation, &seen(0));
        let steps = (0..STEPS).map(|_| {
            sensor.measure(&seen(0));
            let [one, other] = [0, 1].map(|body| sensor.poses()[body]);
            [one.translation.x, other.translation.x, one.rotation.scaled_axis().y]
        });
        steps.collect::<Vec<[f64; 3]>>()
    };
    let noise = series(1);
    let mean = |of: &dyn Fn(usize) -> f64| (0..STEPS - 20).map(of).sum::<f64>() / (STEPS - 20) as f64;
    let deviations = [0, 1, 2].map(|column| mean(&|step| noise[step][column].powi(2)).sqrt());
    for (found, expected) in deviations.iter().zip([0.001, 0.001, 0.01]) {
        assert!((found / expected - 1.0).abs() < 0.05, "{deviations:?}");
    }
    let correlation = mean(&|step| noise[step][0] * noise[step + 20][0]) / deviations[0].powi(2);
    assert!((correlation - (-1.0_f64).exp()).abs() < 0.05, "{correlation}");
    let between = mean(&|step| noise[step][0] * noise[step][1]) / (deviations[0] * deviations[1]);
    assert!(between.abs() < 0.05, "{between}");
    assert!(noise == series(1) && noise != series(2));
}

/// A finger at rest begins to move when the delay is over.
#[test]
fn torques_reach_the_motors_after_the_delay() {
    let robot = shipped("gifu_hand_iii_right");
    let hand = robot.hands[&Side::Right].clone();
    let palm = Isometry3::identity();
    let target = |lowered: f64| Target {
        palm,
        tips: Vec::new(),
        idle: vec![(hand.fingers[1].finger, [lowered; MAX_DOFS])],
        object: Isometry3::identity(),
        free: false,
        pushed: false,
    };
    let moves_after = |delay: usize| {
        let start = Start::new(&robot, &hand, &target(0.2), &[palm]).unwrap();
        let mut executor = Executor::new(robot.clone(), hand.clone(), start, Vector3::zeros()).with_motor_delay(delay);
        let none = vec![Vector3::zeros(); hand.fingers.len()];
        for _ in 0..200 {
            executor.set_target(&target(0.2), &none);
            teachtree_world::HandMover::advance(&mut executor, &[], 0.001);
        }
        let rest = executor.motion.q.clone();
        (0..100).find(|_| {
            executor.set_target(&target(0.6), &none);
            teachtree_world::HandMover::advance(&mut executor, &[], 0.001);
            (&executor.motion.q - &rest).amax() > 1e-7
        })
    };
    let at_once = moves_after(0).unwrap();
    assert_eq!(moves_after(15), Some(at_once + 15));
}
