//! A robot that follows targets: inverse kinematics of its arm, controllers of arm and fingers, and its own dynamics, a millisecond at a time.

use super::arm::{solve_arm, solve_arm_along};
use super::control::{Controller, FingerTarget, Gains, TipTarget};
use super::dynamics::{Motion, Posture};
use super::hand::{Angles, HandModel};
use super::jaws::Yielding;
use super::plan::{Plan, Target};
use super::tree::Robot;
use crate::world::{MovedHand, MovedTip, Mover, Pushed, STEP_S, TouchLaw};
use nalgebra::{DVector, Isometry3, UnitQuaternion, Vector3};

/// The way of the palm is looked at this often, s, from so many starts of the arm.
const WAY_S: f64 = 0.1;
const STARTS: usize = 48;
/// The arm follows a plan in so many iterations a step, at this share of its largest speed at most.
const FOLLOWING: usize = 12;
const UNHURRIED: f64 = 0.7;
/// Fingers that take no part go where they are out of the way, rad/s.
const IDLE_RAD_S: f64 = 2.0;
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
    yielding: Yielding,
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
        let mut idle = Vec::new();
        for finger in &hand.fingers {
            let angles = target.angles(finger);
            idle.push(angles);
            for (dof, angle) in finger.dofs.iter().zip(angles) {
                q[*dof] = angle;
            }
        }
        let motion = Motion::new(root, DVector::from_vec(q.clone()), gravity);
        let posture = motion.posture(&robot, STEP_S);
        let controller = Controller::new(&robot, hand.fingers.len(), Gains::default());
        let torques = DVector::zeros(q.len());
        let palm = target.palm;
        Ok(Self {
            robot,
            hand,
            motion,
            posture,
            controller,
            wanted: q,
            palm,
            before: None,
            torques,
            idle,
            yielding: Yielding::default(),
        })
    }

    /// The values of all degrees of freedom that are wanted now.
    pub fn wanted(&self) -> Vec<f64> {
        self.wanted.clone()
    }

    /// Stretches a plan from a time on until the arm can follow it from `q`, which goes along; where that time is then, s.
    pub fn slow_down(&self, plan: &mut Plan<'_>, from_s: f64, q: &mut [f64]) -> f64 {
        if self.hand.arm.is_empty() {
            return from_s;
        }
        plan.slow_down(from_s, &mut |palm, dt| {
            let before = q.to_vec();
            solve_arm(&self.robot, &self.hand, &self.motion.root, palm, q, FOLLOWING);
            let speed = |dof: &usize| (q[*dof] - before[*dof]).abs() / dt / (UNHURRIED * self.robot.dofs[*dof].speed);
            self.hand.arm.iter().map(speed).fold(0.0, f64::max)
        })
    }

    /// What it is.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// Where its links are, reference frame.
    pub fn poses(&self) -> &[Isometry3<f64>] {
        &self.posture.poses
    }

    /// Where the palm is.
    pub fn palm(&self) -> Isometry3<f64> {
        self.posture.poses[self.hand.palm]
    }

    /// Where the palm was told to be last.
    pub fn wanted_palm(&self) -> Isometry3<f64> {
        self.palm
    }

    /// Decides what its motors do in the next millisecond to come to a target; `exerted` are the forces of its fingertips, as they are measured, N.
    pub fn aim(&mut self, target: &Target, exerted: &[Vector3<f64>]) {
        let yielded = self.hand.jaws.as_ref().map(|jaws| self.yielding.apply(target, jaws, exerted, STEP_S));
        let target = yielded.as_ref().unwrap_or(target);
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
        let fingers: Vec<FingerTarget> = self
            .hand
            .fingers
            .iter()
            .zip(&mut self.idle)
            .map(|(finger, idle)| {
                let of = |target: &Target| target.tips.iter().find(|(which, ..)| *which == finger.finger).copied();
                match of(target) {
                    None => {
                        for (angle, wanted) in idle.iter_mut().zip(target.angles(finger)) {
                            *angle += (wanted - *angle).clamp(-IDLE_RAD_S * STEP_S, IDLE_RAD_S * STEP_S);
                        }
                        FingerTarget::Idle(*idle)
                    }
                    Some((_, position, force)) => {
                        *idle = finger.angles(self.motion.q.as_slice());
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
            exerted,
            STEP_S,
        );
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

    fn moved(&self) -> MovedHand {
        let tips = self.hand.fingers.iter().map(|finger| {
            let (position, velocity, spin) = self.posture.point(finger.tip_link, finger.tip_in_link);
            MovedTip { position, velocity, spin }
        });
        MovedHand { palm: self.palm(), tips: tips.collect() }
    }

    fn go_on(&mut self, pushed: &[Pushed], dt: f64) {
        let mut outside = DVector::zeros(self.robot.dofs.len());
        for (finger, pushed) in self.hand.fingers.iter().zip(pushed) {
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

/// Robots that move the hands of a scene, in its order.
impl Mover for Vec<Executor> {
    fn hand(&self, hand: usize) -> MovedHand {
        self[hand].moved()
    }

    fn advance(&mut self, pushed: &[Vec<Pushed>], dt: f64) {
        for (runs, pushed) in self.iter_mut().zip(pushed) {
            runs.go_on(pushed, dt);
        }
    }
}
