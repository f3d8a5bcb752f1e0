//! Joint trajectories of arm and hand, for controllers that take them instead of targets of palm and fingertips.
//!
//! It has the fields of ROS 2's `trajectory_msgs/JointTrajectory`. Joints follow the targets of [`super::plan::Plan`] by the inverse kinematics alone;
//! where a joint would exceed its limits, both hands are slowed down by the same factor ([`super::toppra`]). Forces are in the commands, not here.

use super::gripper_goal::{GripperGoal, gripper_goals};
use super::moving::Moving;
use super::posture::Posture;
use super::schedule::{Schedule, at_task, groups, sides};
use super::toppra::{TimedPath, timed};
use crate::Robot;
use nalgebra::Isometry3;
use serde::Serialize;
use std::collections::BTreeMap;
use teachtree_base::easing::minimum_jerk;
use teachtree_base::error::InputError;
use teachtree_base::scene::Scene;
use teachtree_command::Commands;
use teachtree_description::tree::Dof;

/// Points per second before it is slowed down: the rate of commands.
const RATE_HZ: f64 = 100.0;
/// Minimum duration of the path from the present posture, s.
const LEADS_IN_S: f64 = 0.5;
/// Multiple of the speed limit above which a joint counts as jumping.
const SLOWEST: f64 = 20.0;

/// A joint trajectory: `trajectory_msgs/JointTrajectory`, and the groups that were slowed down.
#[derive(Clone, Debug, Serialize)]
pub struct JointTrajectory {
    /// Its frame and time.
    pub header: Header,
    /// The driven joints, in the order of the numbers below.
    pub joint_names: Vec<String>,
    /// The points.
    pub points: Vec<JointTrajectoryPoint>,
    /// The controllers, with the indices of their joints among the names; not written.
    #[serde(skip)]
    pub groups: Vec<(String, Vec<usize>)>,
    /// The factors by which groups of tasks are slowed down, in order; not written.
    #[serde(skip)]
    pub slowed: Vec<Slowdown>,
    /// The motions of grippers, in order of time; not written.
    #[serde(skip)]
    pub grippers: Vec<GripperGoal>,
}

/// Tasks that are slowed down together.
#[derive(Clone, Debug, PartialEq)]
pub struct Slowdown {
    /// Their indices.
    pub tasks: Vec<usize>,
    /// The factor, at least 1.
    pub times: f64,
    /// The joint that is longest at its limit; `None` if no joint is.
    pub joint: Option<String>,
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
    /// The remaining nanoseconds.
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
    /// Returns it as JSON.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn json(&self) -> Result<String, InputError> {
        let failed = |error| InputError::new("the trajectory", format!("cannot be written: {error}"));
        serde_json::to_string(self).map(|text| text + "\n").map_err(failed)
    }
}

/// Returns the joint trajectory of commands in a scene, whose objects may have other poses than in the demonstration. The joints of both hands are in one
/// trajectory, and simultaneous tasks are slowed down together. It begins at rest at the `present` posture, if given.
///
/// # Errors
/// As [`crate::simulation::run::simulate`]; a joint that would have to jump, a pose out of the arm's reach; a posture without one of the joints.
pub fn trajectory(
    commands: &Commands,
    robot: &Robot,
    scene: &Scene,
    present: Option<&Posture>,
) -> Result<JointTrajectory, InputError> {
    let tasks = &commands.tasks;
    let sides = sides(commands, robot)?;
    let mut places: BTreeMap<&str, Isometry3<f64>> = BTreeMap::new();
    for (number, task) in tasks.iter().enumerate() {
        let lacks = || at_task(tasks, number, format!("is about `{}`, which is not a body of the scene", task.object));
        let body = scene.bodies.get(&task.object).ok_or_else(lacks)?;
        places.insert(&task.object, body.pose());
    }
    let mut hands = Vec::new();
    for &side in &sides {
        let place = |object: &str| places.get(object).copied();
        hands.push(Moving::begin(side, &robot.limb(side)?, tasks, scene, &place)?.swap_remove(0));
    }
    let dofs: Vec<Dof> = hands.iter().flat_map(|hand| hand.limb.tree.dofs.iter().cloned()).collect();
    let shared = dofs.iter().find(|dof| dofs.iter().filter(|other| other.name == dof.name).count() > 1);
    if let Some(Dof { name, .. }) = shared {
        let message =
            format!("both arms are moved by the joint `{name}`, expected joints of one arm each for a trajectory");
        return Err(InputError::new("the robot", message));
    }
    let header = Header { stamp: Duration::default(), frame_id: "world".into() };
    let joint_names = dofs.iter().map(|dof| robot.controller_name(&dof.name).to_string()).collect();
    let groups_of_joints = controllers(&hands);
    let mut made = JointTrajectory {
        header,
        joint_names,
        points: Vec::new(),
        groups: groups_of_joints,
        slowed: Vec::new(),
        grippers: Vec::new(),
    };
    for numbers in &groups(tasks) {
        let mut plans = Vec::new();
        for hand in &mut hands {
            // The joints have enough time at the end.
            let place = &|object: &str| places.get(object).copied();
            plans.push(hand.planner.plans(tasks, numbers, &hand.limb, hand.palm, place, &mut |_, from_s| from_s)?);
        }
        let schedule = Schedule::new(plans);
        let way = way(&mut hands, &schedule).map_err(|(number, message)| at_task(tasks, number, message))?;
        if let Some((joint, time_s)) = jump(&dofs, &way) {
            let name = &dofs[joint].name;
            let own = |hand: &&Moving| hand.limb.tree.dof(name).is_some();
            let side = hands.iter().find(own).map(|hand| hand.planner.side);
            let number = numbers.iter().find(|number| Some(tasks[**number].track) == side).copied().unwrap_or_default();
            return Err(at_task(tasks, number, format!("makes the joint `{name}` jump, {time_s:.2} s into it")));
        }
        if let (Some(present), true, Some(first)) = (present, made.points.is_empty(), way.first()) {
            let from = present.of(&made.joint_names)?;
            append(&mut made.points, timed(&lead_in(&from, first, &dofs), 1.0 / RATE_HZ, &dofs));
        }
        let timed = timed(&way, 1.0 / RATE_HZ, &dofs);
        let joint = timed.at_limit.map(|joint| dofs[joint].name.clone());
        made.slowed.push(Slowdown { tasks: numbers.clone(), times: timed.slower, joint });
        append(&mut made.points, timed);
        for &number in numbers {
            places.insert(&tasks[number].object, schedule.demonstrated_end(tasks, &tasks[number].object));
        }
    }
    let hand_controllers: Vec<String> = hands.iter().map(|hand| controller(&hands, hand, "hand")).collect();
    let points = made.points.iter().map(|point| (point.time_from_start.seconds(), &point.positions[..]));
    made.grippers = gripper_goals(robot, &hands, &hand_controllers, tasks, &points.collect::<Vec<(f64, &[f64])>>());
    Ok(made)
}

/// Returns the controllers: one for the arm and one for the hand of each side.
fn controllers(hands: &[Moving]) -> Vec<(String, Vec<usize>)> {
    let mut groups = Vec::new();
    let mut base = 0;
    for hand in hands {
        let arm = &hand.planner.hand.arm;
        let (arm, rest): (Vec<usize>, Vec<usize>) = (0..hand.q.len()).partition(|dof| arm.contains(dof));
        for (what, dofs) in [("arm", arm), ("hand", rest)] {
            if !dofs.is_empty() {
                groups.push((controller(hands, hand, what), dofs.into_iter().map(|dof| base + dof).collect()));
            }
        }
        base += hand.q.len();
    }
    groups
}

/// Returns the name of the controller of an arm or a hand.
fn controller(hands: &[Moving], hand: &Moving, what: &str) -> String {
    if hands.len() > 1 { format!("{}_{what}", hand.planner.side) } else { what.into() }
}

/// Returns a straight motion in joint space from one posture to another, with minimum jerk.
fn lead_in(from: &[f64], to: &[f64], dofs: &[Dof]) -> Vec<Vec<f64>> {
    let ways = from.iter().zip(to).map(|(from, to)| (to - from).abs());
    // The peaks of a minimum-jerk motion of length and time 1.
    let needs = |(way, dof): (f64, &Dof)| {
        let speed_s = 1.875 * way / dof.speed;
        speed_s.max((5.774 * way / dof.acceleration).sqrt()).max((60.0 * way / dof.jerk).cbrt())
    };
    let time_s = ways.zip(dofs).map(needs).fold(LEADS_IN_S, f64::max);
    let points = (time_s * RATE_HZ).ceil().max(1.0) as usize;
    let point = |at: usize| {
        let share = minimum_jerk(at as f64 / points as f64);
        from.iter().zip(to).map(|(from, to)| from + (to - from) * share).collect()
    };
    (0..=points).map(point).collect()
}

/// Returns the values of all degrees of freedom of all hands at each point of a group, or the number of a task and its error.
fn way(hands: &mut [Moving], schedule: &Schedule<'_>) -> Result<Vec<Vec<f64>>, (usize, String)> {
    let begins_s = schedule.begins_s();
    let points = ((schedule.time.over() - begins_s) * RATE_HZ).ceil().max(1.0) as usize;
    let mut way = Vec::with_capacity(points + 1);
    for point in 0..=points {
        let since = point as f64 / RATE_HZ;
        for (place, hand) in hands.iter_mut().enumerate() {
            if let Some((number, plan, own_s)) = schedule.at(place, begins_s + since) {
                hand.advance(plan, own_s).map_err(|missed| (number, format!("{missed}, after {since:.2} s")))?;
            }
        }
        way.push(hands.iter().flat_map(|hand| hand.q.iter().copied()).collect());
    }
    Ok(way)
}

/// Returns a joint that jumps from one sample to the next, and the time, s since the beginning of the group.
fn jump(dofs: &[Dof], way: &[Vec<f64>]) -> Option<(usize, f64)> {
    way.windows(2).enumerate().find_map(|(at, pair)| {
        let far = |joint: &usize| (pair[1][*joint] - pair[0][*joint]).abs() > SLOWEST * dofs[*joint].speed / RATE_HZ;
        (0..dofs.len()).find(far).map(|joint| (joint, at as f64 / RATE_HZ))
    })
}

fn append(points: &mut Vec<JointTrajectoryPoint>, timed: TimedPath) {
    let begins_s = points.last().map_or(0.0, |last| last.time_from_start.seconds() + 1.0 / RATE_HZ);
    // Six decimals, as in all outputs: a thousandth of a millimeter at the end of an arm.
    let rounded = |values: Vec<f64>| values.into_iter().map(|value| (value * 1e6).round() / 1e6).collect();
    points.extend(timed.knots.into_iter().map(|knot| JointTrajectoryPoint {
        positions: rounded(knot.positions),
        velocities: rounded(knot.velocities),
        accelerations: rounded(knot.accelerations),
        time_from_start: Duration::of(begins_s + knot.time_s),
    }));
}
