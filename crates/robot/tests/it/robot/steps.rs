//! The arm's controller against the law that it states: steps of each joint, a load that no model knows, motors at their limits, and wants that are no
//! numbers. The robot is the arm of `both_hands` with its hand, all joints free, under gravity; and one whose joints share most of their inertia.

use super::kinematics::shipped;
use nalgebra::{DVector, Isometry3, Vector3};
use teachtree_base::hands::Side;
use teachtree_robot::control::impedance::{Controller, FingerTarget, Gains};
use teachtree_robot::dynamics::motion::Motion;
use teachtree_robot::{self as robot, Dof, HandModel, Robot};

const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);
const DT: f64 = 0.001;
/// The law moves each joint as if it were alone; only friction is shared. Rise times may be so much longer or shorter than those of the law alone.
const RISE: f64 = 0.1;
/// And a joint may overshoot by so much more of the step.
const OVERSHOOT: f64 = 0.02;
/// And draw another one along by so much of it.
const DRAWN: f64 = 0.05;
/// A second after a step, so much of it is left.
const STEADY: f64 = 0.01;

/// An arm at a posture, its hand at rest, and its controller.
struct Rig {
    robot: Robot,
    hand: HandModel,
    motion: Motion,
    controller: Controller,
    fingers: Vec<FingerTarget>,
}

impl Rig {
    fn new() -> Self {
        Self::of(shipped("both_hands").limb(Side::Right).unwrap(), &[0.4, 0.6, 0.9, -0.5, 0.8, 0.3])
    }

    fn of(robot: Robot, arm: &[f64]) -> Self {
        let hand = robot.hands[&Side::Right].clone();
        let mut q = robot.tree.middle();
        for (&dof, &value) in hand.arm.iter().zip(arm) {
            q[dof] = value;
        }
        let motion = Motion::new(Isometry3::identity(), q, GRAVITY);
        let controller = Controller::new(&robot.tree, hand.fingers.len(), Gains::default());
        let idle = hand.fingers.iter().map(|finger| FingerTarget::Idle(finger.angles(motion.q.as_slice())));
        let fingers = idle.collect();
        Self { robot, hand, motion, controller, fingers }
    }

    fn arm(&self) -> Vec<f64> {
        self.hand.arm.iter().map(|&dof| self.motion.q[dof]).collect()
    }

    /// A millisecond towards these values of the arm, with other torques on all joints; what the motors gave.
    fn step(&mut self, wanted: &[f64], outside: &DVector<f64>) -> DVector<f64> {
        let posture = self.motion.posture(&self.robot.tree, DT);
        let wanted: Vec<(f64, f64)> = wanted.iter().map(|value| (*value, 0.0)).collect();
        let Self { robot, hand, motion, controller, fingers } = self;
        let none = vec![Vector3::zeros(); fingers.len()];
        let torques = controller.torques(&robot.tree, hand, motion, &posture, &wanted, fingers, &none, DT);
        motion.step(&robot.tree, &posture, &torques, outside, DT);
        torques
    }

    /// The acceleration of a joint by its own torque, rad/s² for 1 N m, while the other ones are free.
    fn mobility(&self, dof: usize) -> f64 {
        self.motion.posture(&self.robot.tree, DT).mass.try_inverse().unwrap()[(dof, dof)]
    }

    fn nothing(&self) -> DVector<f64> {
        DVector::zeros(self.robot.tree.dofs.len())
    }
}

/// A joint alone under the law, q'' = ω² e - 2 ζ ω q' + k_i ∫e - friction / M, as shares of a step: what is wanted stands still, so nothing makes up for
/// the friction.
fn alone(inertia: f64, dof: &Dof, by: f64) -> Vec<f64> {
    let Gains { arm_omega, arm_zeta, arm_integral, .. } = Gains::default();
    let (mut q, mut rate, mut integral) = (0.0, 0.0_f64, 0.0);
    let mut way = Vec::new();
    for _ in 0..1500 {
        let error = by - q;
        integral += error * DT;
        let law = arm_omega.powi(2) * error - 2.0 * arm_zeta * arm_omega * rate + arm_integral * integral;
        rate += DT * (law - (dof.damping * rate + dof.friction * (rate / 0.02).tanh()) / inertia);
        q += DT * rate;
        way.push(q / by);
    }
    way
}

/// From 10 % to 90 %, s, and by how much the largest is above 1.
fn rise_and_overshoot(way: &[f64]) -> (f64, f64) {
    let first = |share: f64| way.iter().position(|value| *value >= share).unwrap() as f64 * DT;
    (first(0.9) - first(0.1), way.iter().copied().fold(0.0, f64::max) - 1.0)
}

#[test]
fn each_joint_of_the_arm_answers_a_step_as_the_law_says() {
    for joint in 0..6 {
        let mut rig = Rig::new();
        let (before, nothing) = (rig.arm(), rig.nothing());
        // Small enough that no motor comes to its limit, large beside what dry friction holds.
        let by = 0.005;
        let mut wanted = before.clone();
        wanted[joint] += by;
        let arm = rig.hand.arm.clone();
        let dof = &rig.robot.tree.dofs[arm[joint]];
        let (law_rise, law_overshoot) = rise_and_overshoot(&alone(1.0 / rig.mobility(arm[joint]), dof, by));
        let mut way = Vec::new();
        for _ in 0..1500 {
            let torques = rig.step(&wanted, &nothing);
            let limit = rig.robot.tree.dofs[rig.hand.arm[joint]].torque;
            assert!(torques[rig.hand.arm[joint]].abs() < limit, "joint {joint} is not at its limit");
            let shares: Vec<f64> = rig.arm().iter().zip(&before).map(|(now, before)| (now - before) / by).collect();
            way.push(shares[joint]);
            for other in (0..6).filter(|other| *other != joint) {
                let drawn = shares[other].abs();
                assert!(drawn <= DRAWN, "joint {joint} draws {other} along by {drawn} of its step");
            }
        }
        let (rise, overshoot) = rise_and_overshoot(&way);
        assert!((rise / law_rise - 1.0).abs() <= RISE, "joint {joint} rises in {rise} s, the law in {law_rise} s");
        assert!(
            overshoot <= law_overshoot + OVERSHOOT,
            "joint {joint} goes {overshoot} too far, the law {law_overshoot}"
        );
        assert!((way[1000] - 1.0).abs() <= STEADY, "joint {joint} is at {} of its step after a second", way[1000]);
    }
}

/// Gravity is compensated, so nothing moves; a load that the model does not know pulls a joint off by no more than the spring alone would give, M⁻¹ τ / ω², and
/// the integral brings it back.
#[test]
fn gravity_moves_nothing_and_an_unknown_load_is_made_up_for() {
    let mut rig = Rig::new();
    let (before, nothing) = (rig.arm(), rig.nothing());
    for _ in 0..1000 {
        rig.step(&before, &nothing);
    }
    for (now, before) in rig.arm().iter().zip(&before) {
        assert!((now - before).abs() < 1e-6, "{} rad off under gravity alone", now - before);
    }
    for joint in 0..6 {
        let mut rig = Rig::new();
        let (before, mut load) = (rig.arm(), rig.nothing());
        let dof = rig.hand.arm[joint];
        load[dof] = 0.1 * rig.robot.tree.dofs[dof].torque;
        let spring = load[dof] * rig.mobility(dof) / Gains::default().arm_omega.powi(2);
        let mut farthest = 0.0_f64;
        for _ in 0..1500 {
            rig.step(&before, &load);
            farthest = farthest.max((rig.arm()[joint] - before[joint]).abs());
        }
        let left = (rig.arm()[joint] - before[joint]).abs();
        assert!(farthest <= spring, "joint {joint}: {farthest} rad, the spring alone {spring} rad");
        assert!(left <= STEADY * spring, "joint {joint}: {left} rad are left of {farthest} rad");
    }
}

/// A step that is far too large: motors stay at their limits, and the joint comes back from it without having wound up.
#[test]
fn motors_at_their_limits_do_not_wind_up() {
    for joint in 0..6 {
        let mut rig = Rig::new();
        let (before, nothing) = (rig.arm(), rig.nothing());
        let mut wanted = before.clone();
        wanted[joint] += 1.0;
        let (mut farthest, mut at_limit) = (0.0_f64, 0);
        for _ in 0..3000 {
            let torques = rig.step(&wanted, &nothing);
            for (torque, dof) in torques.iter().zip(&rig.robot.tree.dofs) {
                assert!(torque.abs() <= dof.torque, "{torque} N m of {}", dof.name);
            }
            at_limit +=
                usize::from(torques[rig.hand.arm[joint]].abs() >= rig.robot.tree.dofs[rig.hand.arm[joint]].torque);
            farthest = farthest.max(rig.arm()[joint] - before[joint]);
        }
        assert!(at_limit > 10, "joint {joint} was at its limit for {at_limit} ms");
        assert!(farthest < 1.5, "joint {joint} went {farthest} rad for a step of 1 rad");
        let left = (rig.arm()[joint] - wanted[joint]).abs();
        assert!(left < 1e-3, "joint {joint} is {left} rad off in the end");
    }
}

/// Targets are NaN for some time: all torques are finite, the arm keeps its position, and it continues afterwards without an effect.
#[test]
fn wants_that_are_not_numbers_move_nothing_and_are_forgotten() {
    for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut rig = Rig::new();
        let (before, nothing) = (rig.arm(), rig.nothing());
        let (idle, fingers) = (rig.fingers.clone(), rig.fingers.len());
        for _ in 0..200 {
            rig.fingers = vec![FingerTarget::Idle([wrong; 8]); fingers];
            let torques = rig.step(&[wrong; 6], &nothing);
            assert!(torques.iter().all(|torque| torque.is_finite()));
        }
        rig.fingers = idle;
        for (now, before) in rig.arm().iter().zip(&before) {
            assert!((now - before).abs() < 1e-3, "{} rad off after {wrong}", now - before);
        }
        for _ in 0..1500 {
            rig.step(&before, &nothing);
        }
        for (now, before) in rig.arm().iter().zip(&before) {
            assert!((now - before).abs() < 1e-5, "{} rad off after {wrong} has passed", now - before);
        }
    }
}

/// An arm of two joints about one line, and a gripper.
const COAXIAL: &str = "
name: coaxial
root: base
links:
  base: {mass: 1 kg, source: a test}
  light: {mass: 200 g, parts: [{box: [40 mm, 40 mm, 40 mm]}], source: a test}
  palm: {mass: 1 kg, parts: [{box: [100 mm, 200 mm, 60 mm]}], source: a test}
  thumb: {mass: 20 g, source: a test}
  index: {mass: 20 g, source: a test}
joints:
  first: {parent: base, child: light, axis: [0, 0, 1], range: [-2 rad, 2 rad], torque: 12 N m, speed: 2 rad/s, source: a test}
  second: {parent: light, child: palm, axis: [0, 0, 1], range: [-2 rad, 2 rad], torque: 12 N m, speed: 2 rad/s, source: a test}
  left: {parent: palm, child: thumb, axis: [0, 1, 0], travel: [0 mm, 40 mm], force: 20 N, slide_speed: 200 mm/s, source: a test}
  right: {parent: palm, child: index, axis: [0, -1, 0], coupled: {to: left, ratio: 1}, source: a test}
hand:
  side: right
  palm: palm
  fingers:
    thumb: {link: thumb, tip: [0 mm, 8 mm, 45 mm], radius: 8 mm, pad: [0, -1, 0], force: 20 N, source: a test}
    index: {link: index, tip: [0 mm, -8 mm, 45 mm], radius: 8 mm, pad: [0, 1, 0], force: 20 N, source: a test}
";

/// Three joints of a Panda that points down are about nearly one line. A light link between two such joints moves by itself with a small part of the inertia
/// that each of them turns: a controller that gives each joint the torque for that inertia shakes the link.
#[test]
fn joints_that_share_nearly_all_of_their_inertia_answer_a_step_as_the_law_says() {
    let mut rig = Rig::of(robot::read(COAXIAL, "coaxial.yaml").unwrap(), &[0.3, 0.4]);
    let mass = rig.motion.posture(&rig.robot.tree, DT).mass;
    assert!(mass[(0, 0)] * rig.mobility(0) > 20.0, "{mass}");
    let (before, nothing) = (rig.arm(), rig.nothing());
    let wanted = [before[0], before[1] + 0.005];
    let mut strongest = 0.0_f64;
    for step in 0..1000 {
        let torques = rig.step(&wanted, &nothing);
        if step >= 500 {
            strongest = strongest.max(torques[0].abs()).max(torques[1].abs());
        }
    }
    for (now, wanted) in rig.arm().iter().zip(wanted) {
        assert!((now - wanted).abs() <= STEADY * 0.005, "{} rad off", now - wanted);
    }
    assert!(strongest < 0.05, "{strongest} N m at rest");
}
