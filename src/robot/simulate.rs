//! The robot in the world: commands in, a recording of what the robot did and a verdict on each task out.
//!
//! Every millisecond the plan gives targets, the arm's inverse kinematics follows the palm, the controllers give torques, the robot's
//! dynamics and the world's bodies move, and fingertips press on bodies by the law of the virtual environment. Only fingertips touch.

use super::arm::{solve_arm, solve_arm_along};
use super::control::{Controller, FingerTarget, Gains, TipTarget};
use super::dynamics::{Motion, Posture};
use super::hand::{Angles, HandModel};
use super::log::Log;
use super::plan::{Plan, Target};
use super::righting::Righting;
use super::tree::Robot;
use crate::base::error::InputError;
use crate::base::hands::{Finger, Side};
use crate::base::quantity::Quantity;
use crate::base::recording::Recording;
use crate::base::scene::{Hand, Scene};
use crate::command::{Commands, Task, axis_of_its_hole};
use crate::world::{Fingertips, MovedHand, MovedTip, Mover, Pushed, STEP_S, TouchLaw, World};
use nalgebra::{DVector, Isometry3, UnitQuaternion, Vector3};

/// The scene comes to rest for this many steps before the robot begins, and after a task.
const SETTLING: usize = 300;
/// Where the object must end, m, to be where the person left it.
pub const WITHIN_M: f64 = 0.005;
/// The same of its turn, rad.
pub const WITHIN_RAD: f64 = 3.0 * std::f64::consts::PI / 180.0;
/// The way of the palm is looked at this often, s, from so many starts of the arm.
const WAY_S: f64 = 0.1;
const STARTS: usize = 48;
/// The first free motion is left out in so many parts.
const LEFT_OUT: u32 = 4;
/// One step in so many is recorded: 250 a second.
pub const RECORDED: usize = 4;
/// No simulation is longer, s.
const LONGEST_S: f64 = 600.0;

/// What came of a task.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Its name.
    pub task: String,
    /// The object.
    pub object: String,
    /// How far the object is from where the person left it, m.
    pub off: f64,
    /// How far it is turned from there, rad; about the axis of a hole that it is in as it should, it may be.
    pub turned: f64,
    /// The largest distance of the palm from where it was to be, m.
    pub palm_error: f64,
    /// The largest force of a fingertip, N.
    pub largest_force: f64,
    /// The mean over time and fingers of how far the fingertip forces are from the commanded ones while held, N.
    pub force_error: f64,
    /// Whether the object is where the person left it.
    pub done: bool,
}

/// Simulates the commands of one hand in a scene.
///
/// # Errors
/// Commands of a hand that the robot does not have or of both hands, grasps that could not be mapped, poses out of the arm's reach.
pub fn simulate(
    commands: &Commands,
    robot: &Robot,
    scene: &Scene,
    progress: &mut dyn FnMut(f64),
) -> Result<(Recording, Vec<Outcome>), InputError> {
    let side = commanded_side(commands)?;
    let limb = robot.limb(side)?;
    let lacks = || InputError::new("commands", "are of no hand of the robot");
    let hand = limb.hands.get(&side).cloned().ok_or_else(lacks)?;
    // The scene has the robot's hand in place of the person's.
    let taught_radius = scene.hands.get(&side).map_or(0.010, |hand| hand.tip_radius.0);
    let mut scene = scene.clone();
    let fingers: Vec<Finger> = hand.fingers.iter().map(|finger| finger.finger).collect();
    let tip_radius = hand.fingers.first().map_or(0.007, |finger| finger.radius);
    scene.hands = [(side, Hand { fingers, tip_radius: Quantity(tip_radius) })].into_iter().collect();
    let mut world = World::new(&scene, Fingertips::default())?;
    let gravity = Vector3::from(scene.gravity.map(|part| part.0));
    let mut executor: Option<Executor> = None;
    let mut log = Log::new(&scene, world.observation());
    let mut outcomes = Vec::new();
    let whole: f64 = commands.tasks.iter().map(Task::duration_s).sum::<f64>().max(1e-3);
    let mut done_s = 0.0;
    for (number, task) in commands.tasks.iter().enumerate() {
        let at_task = |message: String| InputError::new(format!("task {} ({})", number + 1, task.task), message);
        let body = scene
            .bodies
            .get_index_of(&task.object)
            .ok_or_else(|| at_task(format!("is about `{}`, which is no body of the scene", task.object)))?;
        let found = world.observation().bodies[body].pose;
        let palm = executor.as_ref().map(Executor::wanted_palm);
        let plan = Plan::new(task, &hand, &found, palm.as_ref(), taught_radius).map_err(at_task)?;
        if plan.duration() > LONGEST_S {
            return Err(at_task(format!("takes {:.0} s, at most {LONGEST_S} s are simulated", plan.duration())));
        }
        let mut begins_s = 0.0;
        let runs = match &mut executor {
            Some(runs) => runs,
            None => {
                let (made, from_s) = beginning(&limb, &hand, &plan, gravity).map_err(at_task)?;
                begins_s = from_s;
                let (runs, still) = (executor.insert(made), plan.at(from_s));
                for _ in 0..SETTLING {
                    runs.step(&still, &mut world);
                }
                runs
            }
        };
        let mut righting = Righting::default();
        let (mut palm_error, mut largest_force, mut force_errors) = (0.0_f64, 0.0_f64, (0.0, 0.0));
        let steps = ((plan.duration() - begins_s) / STEP_S).round() as usize;
        for step in 0..=steps + SETTLING {
            let time = (begins_s + step as f64 * STEP_S).min(plan.duration());
            let mut target = plan.at(time);
            righting.apply(&mut target, &world.observation().bodies[body].pose, STEP_S);
            runs.step(&target, &mut world);
            if step.is_multiple_of(RECORDED) {
                log.record(world.observation());
            }
            palm_error = palm_error.max((runs.palm().translation.vector - target.palm.translation.vector).norm());
            let seen = world.observation();
            for (index, tip) in seen.hands[0].tips.iter().enumerate() {
                let force = tip.force_on(body);
                largest_force = largest_force.max(force.norm());
                let wanted = target.tips.iter().find(|(finger, ..)| *finger == hand.fingers[index].finger);
                if let Some((.., wanted)) = wanted.filter(|(.., wanted)| wanted.norm() > 0.05) {
                    force_errors = (force_errors.0 + (force - wanted).norm(), force_errors.1 + 1.0);
                }
            }
            if step.is_multiple_of(500) {
                progress(((done_s + time.min(task.duration_s())) / whole).min(1.0));
            }
        }
        done_s += task.duration_s();
        let end = world.observation().bodies[body].pose;
        let wanted = plan.taught_end();
        let off = (end.translation.vector - wanted.translation.vector).norm();
        // What is in a hole may have turned about its axis.
        let axis = |pose: &Isometry3<f64>| axis_of_its_hole(&scene, &task.object, &scene.bodies[body], pose);
        let turned = match (axis(&end), axis(&wanted)) {
            (Some(axis), Some(_)) => {
                let own = |pose: &Isometry3<f64>| pose.inverse_transform_vector(&axis);
                own(&end).angle(&own(&wanted))
            }
            _ => end.rotation.angle_to(&wanted.rotation),
        };
        outcomes.push(Outcome {
            task: task.task.clone(),
            object: task.object.clone(),
            off,
            turned,
            palm_error,
            largest_force,
            force_error: force_errors.0 / f64::max(force_errors.1, 1.0),
            done: off <= WITHIN_M && turned <= WITHIN_RAD,
        });
    }
    Ok((log.finish(&scene), outcomes))
}

/// The hand that commands are for: one, the same for all tasks.
pub(super) fn commanded_side(commands: &Commands) -> Result<Side, InputError> {
    let refuse = |message: String| InputError::new("commands", message);
    let Some(first) = commands.tasks.first() else { return Err(refuse("have no tasks, nothing is to be done".into())) };
    if commands.tasks.iter().any(|task| task.track != first.track) {
        return Err(refuse(
            "are of both hands, wanted those of one: coordination of two arms is not simulated yet".into(),
        ));
    }
    Side::from_name(&first.track).ok_or_else(|| refuse(format!("are of no hand: `{}`", first.track)))
}

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
