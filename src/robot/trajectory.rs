//! What the joints of arm and hand are to do, with its times: for controllers that take a joint trajectory instead of targets of palm and fingertips.
//!
//! It has the fields of ROS 2's `trajectory_msgs/JointTrajectory`. Joints follow the targets of [`Plan`] by the inverse kinematics alone; what both
//! hands do at the same time is slowed down, in one measure, until no joint is faster or speeds up more than it may. Forces are in the commands, not here.

use super::Robot;
use super::arm::solve_arm;
use super::executor::beginning;
use super::hand::HandModel;
use super::plan::{Plan, minimum_jerk};
use super::stage::{Plans, Stage, at_task, found, sides, stages};
use super::tree::Dof;
use crate::base::error::InputError;
use crate::base::geometry;
use crate::base::hands::Side;
use crate::base::scene::Scene;
use crate::command::{Commands, Task};
use nalgebra::{Isometry3, Vector3};
use serde::Serialize;
use std::collections::BTreeMap;

/// Points in a second, before it is slowed down.
const RATE_HZ: f64 = 50.0;
/// Fingers take the shape of another grasp in this time, s.
const RESHAPING_S: f64 = 0.8;
/// Steps of the arm's inverse from one point to the next.
const ITERATIONS: usize = 20;
/// A task that would have to be slower than this many times has a joint that jumps.
const SLOWEST: f64 = 20.0;

/// A joint trajectory: `trajectory_msgs/JointTrajectory`, and what was slowed down for it.
#[derive(Clone, Debug, Serialize)]
pub struct JointTrajectory {
    /// Frame and time that it refers to.
    pub header: Header,
    /// The joints that are driven, in the order of the numbers below.
    pub joint_names: Vec<String>,
    /// The way, from the first point on.
    pub points: Vec<JointTrajectoryPoint>,
    /// How much slower than planned tasks are, in order; not written.
    #[serde(skip)]
    pub slowed: Vec<Slowed>,
}

/// Tasks that are slowed down together.
#[derive(Clone, Debug, PartialEq)]
pub struct Slowed {
    /// Which, counted from zero.
    pub tasks: Vec<usize>,
    /// How many times slower, at least 1.
    pub times: f64,
    /// The joint that asks for it; none when nothing is slowed down.
    pub joint: String,
}

/// `std_msgs/Header`.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Header {
    /// Zero: at once.
    pub stamp: Duration,
    /// The reference frame of the scene.
    pub frame_id: String,
}

/// `builtin_interfaces/Duration`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Duration {
    /// Whole seconds.
    pub sec: i32,
    /// The rest, ns.
    pub nanosec: u32,
}

/// `trajectory_msgs/JointTrajectoryPoint`; rad or m, and their derivatives by s.
#[derive(Clone, Debug, Serialize)]
pub struct JointTrajectoryPoint {
    /// Of each joint.
    pub positions: Vec<f64>,
    /// Of each joint.
    pub velocities: Vec<f64>,
    /// Of each joint.
    pub accelerations: Vec<f64>,
    /// Since the beginning.
    pub time_from_start: Duration,
}

impl Duration {
    fn of(time_s: f64) -> Self {
        let nanoseconds = (time_s * 1e9).round() as i64;
        Self { sec: (nanoseconds / 1_000_000_000) as i32, nanosec: (nanoseconds % 1_000_000_000) as u32 }
    }

    /// In s.
    pub fn seconds(self) -> f64 {
        f64::from(self.sec) + f64::from(self.nanosec) * 1e-9
    }
}

impl JointTrajectory {
    /// Its text.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn json(&self) -> Result<String, InputError> {
        let failed = |error| InputError::new("the trajectory", format!("cannot be written: {error}"));
        serde_json::to_string(self).map(|text| text + "\n").map_err(failed)
    }
}

/// The joint trajectory of commands in a scene, whose objects may stand elsewhere than they were taught. The joints of both hands are in one
/// trajectory, and tasks that both did at the same time are slowed down together.
///
/// # Errors
/// As [`super::simulate::simulate`]; a joint that would have to jump.
pub fn trajectory(commands: &Commands, robot: &Robot, scene: &Scene) -> Result<JointTrajectory, InputError> {
    let tasks = &commands.tasks;
    let sides = sides(tasks).map_err(|message| InputError::new("commands", message))?;
    let mut places: BTreeMap<&str, Isometry3<f64>> = BTreeMap::new();
    for (number, task) in tasks.iter().enumerate() {
        let lacks = || at_task(tasks, number, format!("is about `{}`, which is no body of the scene", task.object));
        let body = scene.bodies.get(&task.object).ok_or_else(lacks)?;
        places.insert(&task.object, geometry::pose(body.position.map(|length| length.0), body.rotation));
    }
    let stages = stages(tasks);
    let begin = |side: &Side| Moving::new(*side, tasks, &stages, &places, robot, scene);
    let mut hands = sides.iter().map(begin).collect::<Result<Vec<Moving>, _>>()?;
    let dofs: Vec<Dof> = hands.iter().flat_map(|hand| hand.limb.dofs.iter().cloned()).collect();
    let shared = dofs.iter().find(|dof| dofs.iter().filter(|other| other.name == dof.name).count() > 1);
    if let Some(Dof { name, .. }) = shared {
        let message =
            format!("both arms are moved by the joint `{name}`, wanted joints of one arm each for a trajectory");
        return Err(InputError::new("the robot", message));
    }
    let header = Header { stamp: Duration::default(), frame_id: "world".into() };
    let joint_names = dofs.iter().map(|dof| dof.name.clone()).collect();
    let mut made = JointTrajectory { header, joint_names, points: Vec::new(), slowed: Vec::new() };
    for numbers in &stages {
        let plans = hands.iter_mut().map(|hand| hand.plans(tasks, numbers, &places)).collect::<Result<Vec<_>, _>>()?;
        let stage = Stage::new(plans);
        let way = way(&mut hands, &stage);
        let (slower, joint) = slowing(&dofs, &way);
        if slower > SLOWEST {
            let of_joint = |hand: &&Moving| hand.limb.dof(&joint).is_some();
            let side = hands.iter().find(of_joint).map_or("", |hand| hand.side.name());
            let number = numbers.iter().find(|number| tasks[**number].track == side).copied().unwrap_or_default();
            return Err(at_task(tasks, number, format!("makes the joint `{joint}` jump")));
        }
        append(&mut made.points, &way, slower);
        made.slowed.push(Slowed { tasks: numbers.clone(), times: slower, joint });
        for &number in numbers {
            places.insert(&tasks[number].object, stage.taught_end(tasks, &tasks[number].object));
        }
    }
    Ok(made)
}

/// A hand with its arm on its way.
struct Moving {
    side: Side,
    limb: Robot,
    hand: HandModel,
    taught_radius: f64,
    root: Isometry3<f64>,
    /// All degrees of freedom now, and as they were when the task began that is done now.
    q: Vec<f64>,
    before: Vec<f64>,
    /// That task, and when it began.
    doing: Option<(usize, f64)>,
    /// Where the palm was aimed at last; `None` before its first task.
    palm: Option<Isometry3<f64>>,
    /// When of its first plan it begins, and of every other: at once, s.
    from_s: f64,
}

impl Moving {
    /// A hand where its first task begins.
    fn new(
        side: Side,
        tasks: &[Task],
        stages: &[Vec<usize>],
        places: &BTreeMap<&str, Isometry3<f64>>,
        robot: &Robot,
        scene: &Scene,
    ) -> Result<Self, InputError> {
        let limb = robot.limb(side)?;
        let lacks = || InputError::new("commands", "are of no hand of the robot");
        let hand = limb.hands.get(&side).cloned().ok_or_else(lacks)?;
        let taught_radius = scene.hands.get(&side).map_or(0.010, |hand| hand.tip_radius.0);
        let number = tasks.iter().position(|task| task.track == side.name()).ok_or_else(lacks)?;
        let stage = stages.iter().find(|stage| stage.contains(&number)).map_or(&[][..], Vec::as_slice);
        let refuse = |message: String| at_task(tasks, number, message);
        let found = found(tasks, stage, number, &places[tasks[number].object.as_str()]);
        let plan = Plan::new(&tasks[number], &limb, &hand, found, None, taught_radius).map_err(refuse)?;
        let (runs, from_s) = beginning(&limb, &hand, &plan, Vector3::zeros()).map_err(refuse)?;
        let q = runs.motion.q.as_slice().to_vec();
        let root = runs.motion.root;
        Ok(Self { side, limb, hand, taught_radius, root, before: q.clone(), q, doing: None, palm: None, from_s })
    }

    /// Its plans of a stage, one after the other.
    fn plans<'t>(
        &mut self,
        tasks: &'t [Task],
        stage: &[usize],
        places: &BTreeMap<&str, Isometry3<f64>>,
    ) -> Result<Plans<'t>, InputError> {
        let mut plans: Plans<'t> = Vec::new();
        let mut palm = self.palm;
        if palm.is_some() {
            self.from_s = 0.0;
        }
        for &number in stage.iter().filter(|number| tasks[**number].track == self.side.name()) {
            let found = found(tasks, stage, number, &places[tasks[number].object.as_str()]);
            let plan = Plan::new(&tasks[number], &self.limb, &self.hand, found, palm.as_ref(), self.taught_radius);
            let plan = plan.map_err(|message| at_task(tasks, number, message))?;
            palm = Some(plan.at(plan.duration()).palm);
            plans.push((number, plan));
        }
        Ok(plans)
    }

    /// Goes on to a time of a plan; `at_s` is the time of the stage.
    fn go_on(&mut self, (task, plan, own_s): (usize, &Plan<'_>, f64), at_s: f64) {
        if self.doing.is_none_or(|(doing, _)| doing != task) {
            self.before.clone_from(&self.q);
            self.doing = Some((task, at_s));
        }
        let target = plan.at(own_s);
        self.palm = Some(target.palm);
        if !self.hand.arm.is_empty() {
            solve_arm(&self.limb, &self.hand, &self.root, &target.palm, &mut self.q, ITERATIONS);
        }
        let since = at_s - self.doing.map_or(at_s, |(_, since)| since);
        let shaped = minimum_jerk(since / RESHAPING_S);
        for finger in &self.hand.fingers {
            let angles = target.angles(finger);
            for (dof, angle) in finger.dofs.iter().zip(angles) {
                self.q[*dof] = self.before[*dof] + (angle - self.before[*dof]) * shaped;
            }
        }
    }
}

/// The values of all degrees of freedom of all hands at each point of a stage.
fn way(hands: &mut [Moving], stage: &Stage<'_>) -> Vec<Vec<f64>> {
    let from_s: Vec<f64> = hands.iter().map(|hand| hand.from_s).collect();
    let begins_s = stage.begins_s(&from_s);
    let points = ((stage.clock.over() - begins_s) * RATE_HZ).ceil().max(1.0) as usize;
    let mut way = Vec::with_capacity(points + 1);
    for point in 0..=points {
        let since = point as f64 / RATE_HZ;
        for (place, hand) in hands.iter_mut().enumerate() {
            if let Some(now) = stage.at(place, begins_s + since, hand.from_s) {
                hand.go_on(now, since);
            }
        }
        way.push(hands.iter().flat_map(|hand| hand.q.iter().copied()).collect());
    }
    hands.iter_mut().for_each(|hand| hand.doing = None);
    way
}

/// How many times slower a stage has to be for its joints' limits, at least 1, and the joint that asks for most.
fn slowing(dofs: &[Dof], way: &[Vec<f64>]) -> (f64, String) {
    let mut most = (1.0, String::new());
    for (joint, dof) in dofs.iter().enumerate() {
        for at in 0..way.len() {
            let (velocity, acceleration) = derivatives(way, at, joint);
            let asks = (velocity.abs() / dof.speed).max((acceleration.abs() / dof.acceleration).sqrt());
            if asks > most.0 {
                most = (asks, dof.name.clone());
            }
        }
    }
    most
}

/// Velocity and acceleration of a joint at a point, by differences; at rest at both ends.
fn derivatives(way: &[Vec<f64>], at: usize, joint: usize) -> (f64, f64) {
    let value = |at: usize| way.get(at).and_then(|q| q.get(joint)).copied().unwrap_or_default();
    let last = way.len().saturating_sub(1);
    let (before, next) = (value(at.saturating_sub(1)), value((at + 1).min(last)));
    let velocity = if at == 0 || at == last { 0.0 } else { (next - before) * RATE_HZ / 2.0 };
    (velocity, (next - 2.0 * value(at) + before) * RATE_HZ * RATE_HZ)
}

fn append(points: &mut Vec<JointTrajectoryPoint>, way: &[Vec<f64>], slower: f64) {
    let begins_s = points.last().map_or(0.0, |last| last.time_from_start.seconds() + slower / RATE_HZ);
    // Six decimals, as everything that is written: a thousandth of a millimetre at the end of an arm.
    let rounded = |value: f64| (value * 1e6).round() / 1e6;
    for (at, q) in way.iter().enumerate() {
        let moves: Vec<(f64, f64)> = (0..q.len()).map(|joint| derivatives(way, at, joint)).collect();
        points.push(JointTrajectoryPoint {
            positions: q.iter().map(|value| rounded(*value)).collect(),
            velocities: moves.iter().map(|(velocity, _)| rounded(velocity / slower)).collect(),
            accelerations: moves.iter().map(|(_, acceleration)| rounded(acceleration / slower / slower)).collect(),
            time_from_start: Duration::of(begins_s + at as f64 * slower / RATE_HZ),
        });
    }
}
