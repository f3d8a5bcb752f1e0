//! A robot that follows targets: inverse kinematics of its arm, controllers of arm and fingers, and its own dynamics, a millisecond at a time.

use super::impedance::{Controller, FingerTarget, Gains, TipTarget};
use super::palm_compliance::PalmCompliance;
use crate::dynamics::motion::{DynamicsTerms, Motion};
use crate::kinematics::arm_ik::PoseError;
use crate::kinematics::finger::FingerModel;
use crate::kinematics::joint_positions::JointPositions;
use crate::model::hand::HandModel;
use crate::model::robot::Robot;
use crate::planning::plan::Target;
use crate::planning::start::Start;
use nalgebra::{DVector, Isometry3, UnitQuaternion, Vector3};
use std::collections::VecDeque;
use teachtree_world::{HandMotion, HandMover, STEP_S, TipMotion, TipWrench, TouchLaw};

/// The speed at which idle fingers move out of the way, rad/s.
const IDLE_RAD_S: f64 = 2.0;
/// A robot that follows targets.
pub struct Executor {
    robot: Robot,
    hand: HandModel,
    /// Its configuration and rates.
    pub motion: Motion,
    posture: DynamicsTerms,
    controller: Controller,
    /// The desired values of all degrees of freedom; those of the arm are used.
    wanted: Vec<f64>,
    palm: Isometry3<f64>,
    /// The residual of the arm's inverse kinematics.
    missed: PoseError,
    before: Option<Target>,
    torques: DVector<f64>,
    /// The computed torques that have not reached the motors, oldest first, and the number of steps until they do.
    sent: VecDeque<DVector<f64>>,
    motor_delay: usize,
    idle: Vec<JointPositions>,
    yielding: PalmCompliance,
}

impl Executor {
    /// Returns a robot at rest at its start; `gravity` is in the reference frame, m/s².
    pub fn new(robot: Robot, hand: HandModel, start: Start, gravity: Vector3<f64>) -> Self {
        let Start { q, root, fingers, palm } = start;
        let motion = Motion::new(root, DVector::from_vec(q.clone()), gravity);
        let posture = motion.posture(&robot.tree, STEP_S);
        let controller = Controller::new(&robot.tree, hand.fingers.len(), Gains::default());
        let torques = DVector::zeros(q.len());
        Self {
            robot,
            hand,
            motion,
            posture,
            controller,
            wanted: q,
            palm,
            missed: PoseError { m: 0.0, rad: 0.0 },
            before: None,
            torques,
            sent: VecDeque::new(),
            motor_delay: 0,
            idle: fingers,
            yielding: PalmCompliance::default(),
        }
    }

    /// Delays the torques of all motors by this number of milliseconds. A hand without an arm still follows its palm pose at once.
    #[must_use]
    pub fn with_motor_delay(self, steps: usize) -> Self {
        Self { motor_delay: steps, ..self }
    }

    /// Returns the desired values of all degrees of freedom.
    pub fn wanted(&self) -> Vec<f64> {
        self.wanted.clone()
    }

    /// Returns the model of the robot.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// Returns the poses of its links, reference frame.
    pub fn poses(&self) -> &[Isometry3<f64>] {
        &self.posture.poses
    }

    /// Returns the pose of the palm, reference frame.
    pub fn palm(&self) -> Isometry3<f64> {
        self.posture.poses[self.hand.palm]
    }

    /// The last commanded pose of the palm.
    pub fn wanted_palm(&self) -> Isometry3<f64> {
        self.palm
    }

    /// Returns the torques (N m) or forces (N) of the motors, one for each degree of freedom.
    pub(crate) fn torques(&self) -> &DVector<f64> {
        &self.torques
    }

    /// Returns the error of the palm at the desired joint positions against the last commanded pose.
    pub(crate) fn missed(&self) -> PoseError {
        self.missed
    }

    /// Returns the torque (N m) or force (N) by which the last command exceeded the limit of a motor.
    pub(crate) fn lacking(&self, dof: usize) -> f64 {
        self.controller.lacking(dof)
    }

    /// Sets the motor commands of the next millisecond for a target; `exerted` are the measured forces of its fingertips, N.
    pub fn set_target(&mut self, target: &Target, exerted: &[Vector3<f64>]) {
        let law = self.hand.fingers.first().map_or_else(TouchLaw::default, touch_law);
        let yielded = self.hand.jaws.as_ref().map(|jaws| self.yielding.apply(target, (jaws, &law), exerted, STEP_S));
        let target = yielded.as_ref().unwrap_or(target);
        let before = self.before.replace(target.clone()).unwrap_or_else(|| target.clone());
        // The arm.
        let arm: Vec<(f64, f64)> = if self.hand.arm.is_empty() {
            self.carry(target);
            Vec::new()
        } else {
            let last: Vec<f64> = self.hand.arm.iter().map(|&dof| self.wanted[dof]).collect();
            let root = self.motion.root;
            let arm = self.hand.arm_on(&self.robot.tree);
            self.missed = arm.inverse_kinematics(&root, &target.palm, &mut self.wanted, 2);
            let limits = self.hand.arm.iter().zip(last).map(|(&dof, last)| {
                let most = self.robot.tree.dofs[dof].speed * STEP_S;
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
                        // The pad deforms under the commanded force.
                        let stiffness = touch_law(finger).stiffness;
                        let given = |force: Vector3<f64>| force / stiffness;
                        let earlier = of(&before).map_or(position, |(_, at, force)| at + given(force));
                        let position = position + given(force);
                        let velocity = (position - earlier) / STEP_S;
                        let posture = finger.angles(self.motion.q.as_slice());
                        FingerTarget::Tip(TipTarget { position, velocity, force, posture })
                    }
                }
            })
            .collect();
        let torques = self.controller.torques(
            &self.robot.tree,
            &self.hand,
            &self.motion,
            &self.posture,
            &arm,
            &fingers,
            exerted,
            STEP_S,
        );
        self.sent.push_back(torques);
        // The first torque acts at once.
        while self.sent.len() > self.motor_delay + 1 {
            self.sent.pop_front();
        }
        if let Some(arrived) = self.sent.front() {
            self.torques.copy_from(arrived);
        }
    }

    /// Moves a hand without an arm to the commanded pose of its palm.
    fn carry(&mut self, target: &Target) {
        let palm_from_root = self.palm_from_root();
        let root = target.palm * palm_from_root;
        self.motion.root_velocity = (root.translation.vector - self.motion.root.translation.vector) / STEP_S;
        self.motion.root_spin = (root.rotation * self.motion.root.rotation.inverse()).scaled_axis() / STEP_S;
    }

    fn palm_from_root(&self) -> Isometry3<f64> {
        self.posture.poses[self.hand.palm].inverse() * self.motion.root
    }

    pub(crate) fn moved(&self) -> HandMotion {
        let tips = self.hand.fingers.iter().map(|finger| {
            let (position, velocity, spin) = self.posture.point(finger.tip_link, finger.tip_in_link);
            TipMotion { position, velocity, spin }
        });
        HandMotion { palm: self.palm(), tips: tips.collect() }
    }

    pub(crate) fn advance(&mut self, pushed: &[TipWrench], dt: f64) {
        let mut outside = DVector::zeros(self.robot.tree.dofs.len());
        for (finger, pushed) in self.hand.fingers.iter().zip(pushed) {
            if *pushed != TipWrench::default() {
                let (point, ..) = self.posture.point(finger.tip_link, finger.tip_in_link);
                let wrench = (pushed.force, pushed.torque);
                self.posture.add_wrench(&self.robot.tree, finger.tip_link, point, wrench, &mut outside);
            }
        }
        self.motion.step(&self.robot.tree, &self.posture, &self.torques, &outside, dt);
        let turn = UnitQuaternion::from_scaled_axis(self.motion.root_spin * dt);
        let root = &mut self.motion.root;
        root.translation.vector += self.motion.root_velocity * dt;
        root.rotation = turn * root.rotation;
        self.posture = self.motion.posture(&self.robot.tree, dt);
    }
}

/// Returns the contact law of a finger.
fn touch_law(finger: &FingerModel) -> TouchLaw {
    let law = TouchLaw::default();
    finger.pad_radius.map_or(law, |radius| law.with_pad(radius))
}

impl HandMover for Executor {
    fn moved(&self) -> HandMotion {
        self.moved()
    }

    fn advance(&mut self, pushed: &[TipWrench], dt: f64) {
        self.advance(pushed, dt);
    }
}
