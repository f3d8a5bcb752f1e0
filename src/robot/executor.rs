//! A robot that follows targets: inverse kinematics of its arm, controllers of arm and fingers, and its own dynamics, a millisecond at a time.

use super::arm::{solve_arm, solve_arm_along};
use super::control::{Controller, FingerTarget, Gains, TipTarget};
use super::dynamics::{Motion, Posture};
use super::hand::{Angles, HandModel};
use super::plan::{Plan, Target};
use super::tree::Robot;
use crate::world::{MovedHand, MovedTip, Mover, Pushed, STEP_S, TouchLaw, World};
use nalgebra::{DVector, Isometry3, UnitQuaternion, Vector3};

/// The way of the palm is looked at this often, s, from so many starts of the arm.
const WAY_S: f64 = 0.1;
const STARTS: usize = 48;
/// The arm follows a plan in so many iterations a step, at this share of its largest speed at most.
const FOLLOWING: usize = 12;
const UNHURRIED: f64 = 0.7;
/// The first free motion is left out in so many parts.
const LEFT_OUT: u32 = 4;

/// A robot at the beginning of a task, and when of the task that is, s: a person may come from where the arm cannot be, so as much of the first free
/// motion is left out as must be.
pub(super) fn beginning(
    limb: &Robot,
    hand: &HandModel,
    plan: &Plan<'_>,
    gravity: Vector3<f64>,
) -> Result<(Executor, f64), String> {
    let mut refused = String::new();
    let (touched, released) = plan.touches();
    for part in 0..=LEFT_OUT {
        let from_s = touched * f64::from(part) / f64::from(LEFT_OUT);
        let times = (0..).map(|at| from_s + f64::from(at) * WAY_S).take_while(|time| *time <= released);
        let way: Vec<Isometry3<f64>> = times.map(|time| plan.at(time).palm).collect();
        match Executor::new(limb.clone(), hand.clone(), &plan.at(from_s), &way, gravity) {
            Ok(made) => return Ok((made, from_s)),
            Err(message) => refused = message,
        }
    }
    Err(refused)
}

/// A robot that follows targets.
pub struct Executor {
    robot: Robot,
    hand: HandModel,
    /// Where it is and how it moves.
    pub motion: Motion,
    posture: Posture,
    controller: Controller,
    /// The desired values of all degrees of freedom; those of the arm are used.
    wanted: Vec<f64>,
    palm: Isometry3<f64>,
    before: Option<Target>,
    torques: DVector<f64>,
    idle: Vec<Angles>,
}

impl Executor {
    /// A robot at rest at its first target, its arm so that it can bring the palm along `way`, which begins there.
    ///
    /// # Errors
    /// A way that the arm cannot go.
    pub fn new(
        robot: Robot,
        hand: HandModel,
        target: &Target,
        way: &[Isometry3<f64>],
        gravity: Vector3<f64>,
    ) -> Result<Self, String> {
        let mut q = vec![0.0; robot.dofs.len()];
        let mut root = Isometry3::identity();
        if hand.arm.is_empty() {
            // A hand without an arm is carried about.
            root = target.palm * robot.forward(&q)[hand.palm].inverse();
        } else {
            if !solve_arm_along(&robot, &hand, &root, way, &mut q, STARTS, 150) {
                let at = target.palm.translation.vector * 1e3;
                let place = format!("{:.0}, {:.0}, {:.0} mm", at.x, at.y, at.z);
                return Err(format!(
                    "begins with the palm at {place}; from there the arm cannot bring it along the whole way"
                ));
            }
        }
        let idle: Vec<Angles> = hand.fingers.iter().map(|finger| resting(&finger.ranges)).collect();
        for (finger, idle) in hand.fingers.iter().zip(&idle) {
            let tip = target.tips.iter().find(|(which, ..)| *which == finger.finger);
            let angles = tip.map_or(*idle, |(_, tip, _)| finger.reach(target.palm.inverse_transform_point(tip)).angles);
            for (dof, angle) in finger.dofs.iter().zip(angles) {
                q[*dof] = angle;
            }
        }
        let motion = Motion::new(root, DVector::from_vec(q.clone()), gravity);
        let posture = motion.posture(&robot, STEP_S);
        let controller = Controller::new(&robot, hand.fingers.len(), Gains::default());
        let torques = DVector::zeros(q.len());
        let palm = target.palm;
        Ok(Self { robot, hand, motion, posture, controller, wanted: q, palm, before: None, torques, idle })
    }

    /// Stretches a plan from a time on until the arm can follow it from where it is to be now; where that time is then, s.
    pub fn slow_down(&self, plan: &mut Plan<'_>, from_s: f64) -> f64 {
        if self.hand.arm.is_empty() {
            return from_s;
        }
        let mut q = self.wanted.clone();
        plan.slow_down(from_s, &mut |palm, dt| {
            let before = q.clone();
            solve_arm(&self.robot, &self.hand, &self.motion.root, palm, &mut q, FOLLOWING);
            let speed = |dof: &usize| (q[*dof] - before[*dof]).abs() / dt / (UNHURRIED * self.robot.dofs[*dof].speed);
            self.hand.arm.iter().map(speed).fold(0.0, f64::max)
        })
    }

    /// Where the palm is.
    pub fn palm(&self) -> Isometry3<f64> {
        self.posture.poses[self.hand.palm]
    }

    /// Where the palm was told to be last.
    pub fn wanted_palm(&self) -> Isometry3<f64> {
        self.palm
    }

    /// One millisecond towards a target.
    pub fn step(&mut self, target: &Target, world: &mut World) {
        let before = self.before.replace(target.clone()).unwrap_or_else(|| target.clone());
        // The arm.
        let arm: Vec<(f64, f64)> = if self.hand.arm.is_empty() {
            self.carry(target);
            Vec::new()
        } else {
            let last: Vec<f64> = self.hand.arm.iter().map(|&dof| self.wanted[dof]).collect();
            let root = self.motion.root;
            solve_arm(&self.robot, &self.hand, &root, &target.palm, &mut self.wanted, 2);
            let limits = self.hand.arm.iter().zip(last).map(|(&dof, last)| {
                let most = self.robot.dofs[dof].speed * STEP_S;
                let next = last + (self.wanted[dof] - last).clamp(-most, most);
                (dof, next, (next - last) / STEP_S)
            });
            let limits: Vec<_> = limits.collect();
            for (dof, next, _) in &limits {
                self.wanted[*dof] = *next;
            }
            limits.into_iter().map(|(_, next, rate)| (next, rate)).collect()
        };
        self.palm = target.palm;
        // The fingers.
        let seen = world.observation();
        let exerted: Vec<Vector3<f64>> =
            seen.hands[0].tips.iter().map(|tip| tip.touches.iter().map(|touch| touch.force).sum()).collect();
        let fingers: Vec<FingerTarget> = self
            .hand
            .fingers
            .iter()
            .zip(&self.idle)
            .map(|(finger, idle)| {
                let of = |target: &Target| target.tips.iter().find(|(which, ..)| *which == finger.finger).copied();
                match of(target) {
                    None => FingerTarget::Idle(*idle),
                    Some((_, position, force)) => {
                        // The pad gives way under the force that it is to exert.
                        let given = |force: Vector3<f64>| force / TouchLaw::default().stiffness;
                        let earlier = of(&before).map_or(position, |(_, at, force)| at + given(force));
                        let position = position + given(force);
                        let velocity = (position - earlier) / STEP_S;
                        let posture = finger.angles(self.motion.q.as_slice());
                        FingerTarget::Tip(TipTarget { position, velocity, force, posture })
                    }
                }
            })
            .collect();
        self.torques = self.controller.torques(
            &self.robot,
            &self.hand,
            &self.motion,
            &self.posture,
            &arm,
            &fingers,
            &exerted,
            STEP_S,
        );
        world.step_moved(self);
    }

    /// Carries a hand without an arm to where its palm is wanted.
    fn carry(&mut self, target: &Target) {
        let palm_from_root = self.palm_from_root();
        let root = target.palm * palm_from_root;
        self.motion.root_velocity = (root.translation.vector - self.motion.root.translation.vector) / STEP_S;
        self.motion.root_spin = (root.rotation * self.motion.root.rotation.inverse()).scaled_axis() / STEP_S;
    }

    fn palm_from_root(&self) -> Isometry3<f64> {
        self.posture.poses[self.hand.palm].inverse() * self.motion.root
    }
}

impl Mover for Executor {
    fn hand(&self, _: usize) -> MovedHand {
        let tips = self.hand.fingers.iter().map(|finger| {
            let (position, velocity, spin) = self.posture.point(finger.tip_link, finger.tip_in_link);
            MovedTip { position, velocity, spin }
        });
        MovedHand { palm: self.palm(), tips: tips.collect() }
    }

    fn advance(&mut self, pushed: &[Vec<Pushed>], dt: f64) {
        let mut outside = DVector::zeros(self.robot.dofs.len());
        for (finger, pushed) in self.hand.fingers.iter().zip(pushed.iter().flatten()) {
            if *pushed != Pushed::default() {
                let (point, ..) = self.posture.point(finger.tip_link, finger.tip_in_link);
                let wrench = (pushed.force, pushed.torque);
                self.posture.add_wrench(&self.robot, finger.tip_link, point, wrench, &mut outside);
            }
        }
        self.motion.step(&self.robot, &self.posture, &self.torques, &outside, dt);
        let turn = UnitQuaternion::from_scaled_axis(self.motion.root_spin * dt);
        let root = &mut self.motion.root;
        root.translation.vector += self.motion.root_velocity * dt;
        root.rotation = turn * root.rotation;
        self.posture = self.motion.posture(&self.robot, dt);
    }
}

/// Angles of a finger that does nothing: a little bent.
pub(super) fn resting(ranges: &[[f64; 2]]) -> Angles {
    let mut angles = Angles::default();
    for (index, ([low, high], angle)) in ranges.iter().zip(&mut angles).enumerate() {
        *angle = if index == 0 { (low + high) / 2.0 } else { low + 0.12 * (high - low) };
    }
    angles
}
