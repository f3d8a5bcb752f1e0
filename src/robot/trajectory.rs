//! What the joints of arm and hand are to do, with its times: for controllers that take a joint trajectory instead of targets of palm and fingertips.
//!
//! It has the fields of ROS 2's `trajectory_msgs/JointTrajectory`. Joints follow the targets of [`Plan`] by the inverse kinematics alone; the whole
//! task is slowed down, in one measure, until no joint is faster or speeds up more than it may. Forces are in the commands, not here.

use super::Robot;
use super::arm::solve_arm;
use super::executor::beginning;
use super::hand::HandModel;
use super::mapping::from_seven;
use super::plan::{Found, Plan, minimum_jerk};
use super::stage::sides;
use crate::base::error::InputError;
use crate::base::geometry;
use crate::base::scene::Scene;
use crate::command::Commands;
use nalgebra::Isometry3;
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
    /// How many times slower than planned each task is, and the joint that asks for it; not written.
    #[serde(skip)]
    pub slowed: Vec<(f64, String)>,
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

/// The joint trajectory of one hand's commands in a scene, whose objects may stand elsewhere than they were taught.
///
/// # Errors
/// As [`super::simulate::simulate`]; a joint that would have to jump.
pub fn trajectory(commands: &Commands, robot: &Robot, scene: &Scene) -> Result<JointTrajectory, InputError> {
    let refuse = |message: &str| InputError::new("commands", message);
    let &[side] = sides(&commands.tasks).map_err(|message| refuse(&message))?.as_slice() else {
        return Err(refuse("are of both hands, wanted those of one for a joint trajectory: leave out `--trajectory`"));
    };
    let limb = robot.limb(side)?;
    let lacks = || InputError::new("commands", "are of no hand of the robot");
    let hand = limb.hands.get(&side).cloned().ok_or_else(lacks)?;
    let taught_radius = scene.hands.get(&side).map_or(0.010, |hand| hand.tip_radius.0);
    let header = Header { stamp: Duration::default(), frame_id: "world".into() };
    let joint_names = limb.dofs.iter().map(|dof| dof.name.clone()).collect();
    let mut made = JointTrajectory { header, joint_names, points: Vec::new(), slowed: Vec::new() };
    let mut places: BTreeMap<&str, Isometry3<f64>> = BTreeMap::new();
    // The joints, the root of the limb and the palm at the end of the task before.
    let mut stands: Option<(Vec<f64>, Isometry3<f64>, Isometry3<f64>)> = None;
    for (number, task) in commands.tasks.iter().enumerate() {
        let at_task = |message: String| InputError::new(format!("task {} ({})", number + 1, task.task), message);
        let object = scene.bodies.get(&task.object);
        let object =
            object.ok_or_else(|| at_task(format!("is about `{}`, which is no body of the scene", task.object)))?;
        let stood = || geometry::pose(object.position.map(|length| length.0), object.rotation);
        let found = places.get(task.object.as_str()).copied().unwrap_or_else(stood);
        let taught = task.segments.first().and_then(|segment| segment.object.first());
        let off = taught.map_or_else(Isometry3::identity, |taught| found * from_seven(taught).inverse());
        let found = Found { off, until_s: f64::INFINITY };
        let plan = Plan::new(task, &limb, &hand, found, stands.as_ref().map(|(.., palm)| palm), taught_radius);
        let plan = plan.map_err(at_task)?;
        let (mut q, root, from_s) = match stands.take() {
            Some((q, root, _)) => (q, root, 0.0),
            None => {
                let (made, from_s) = beginning(&limb, &hand, &plan, nalgebra::Vector3::zeros()).map_err(at_task)?;
                (made.motion.q.as_slice().to_vec(), made.motion.root, from_s)
            }
        };
        let way = joints(&limb, &hand, &plan, &root, &mut q, from_s);
        let (slower, joint) = slowing(&limb, &way);
        if slower > SLOWEST {
            return Err(at_task(format!("makes the joint `{joint}` jump")));
        }
        append(&mut made.points, &way, slower);
        made.slowed.push((slower, joint));
        places.insert(&task.object, plan.taught_end());
        stands = Some((q, root, plan.at(plan.duration()).palm));
    }
    Ok(made)
}

/// The values of all degrees of freedom at each point of a task. `q` goes along.
fn joints(
    limb: &Robot,
    hand: &HandModel,
    plan: &Plan<'_>,
    root: &Isometry3<f64>,
    q: &mut [f64],
    from_s: f64,
) -> Vec<Vec<f64>> {
    let before = q.to_vec();
    let points = ((plan.duration() - from_s) * RATE_HZ).ceil().max(1.0) as usize;
    let mut way = Vec::with_capacity(points + 1);
    for point in 0..=points {
        let since = point as f64 / RATE_HZ;
        let target = plan.at((from_s + since).min(plan.duration()));
        if !hand.arm.is_empty() {
            solve_arm(limb, hand, root, &target.palm, q, ITERATIONS);
        }
        let shaped = minimum_jerk(since / RESHAPING_S);
        for finger in &hand.fingers {
            let angles = target.angles(finger);
            for (dof, angle) in finger.dofs.iter().zip(angles) {
                q[*dof] = before[*dof] + (angle - before[*dof]) * shaped;
            }
        }
        way.push(q.to_vec());
    }
    way
}

/// How many times slower a task has to be for its joints' limits, at least 1, and the joint that asks for most.
fn slowing(limb: &Robot, way: &[Vec<f64>]) -> (f64, String) {
    let mut most = (1.0, String::new());
    for (joint, dof) in limb.dofs.iter().enumerate() {
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
