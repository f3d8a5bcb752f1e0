//! Goals of the controllers of grippers: the positions of the jaws at each closing and opening, and the effort of the commanded force.

use super::moving::Moving;
use crate::model::gripper::Jaws;
use crate::model::robot::Robot;
use nalgebra::Vector3;
use std::fmt::Write;
use teachtree_base::hands::Side;
use teachtree_command::Task;

/// Largest motion between two points of jaws at rest, m.
const STILL_M: f64 = 1e-5;
/// Smallest motion of a closing or an opening, m.
const MOVED_M: f64 = 1e-3;

/// A motion of jaws, from rest to rest.
#[derive(Clone, Debug, PartialEq)]
pub struct GripperGoal {
    /// The name of the controller, as in the parts of the trajectory.
    pub controller: String,
    /// Its start, s since the beginning of the trajectory.
    pub time_s: f64,
    /// Whether the jaws close.
    pub closes: bool,
    /// The driven joints.
    pub joints: Vec<GripperJoint>,
}

/// A joint at the end of such a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct GripperJoint {
    /// Its name at the controller.
    pub name: String,
    /// Its position, rad or m.
    pub position: f64,
    /// The largest effort, N m or N: for the commanded force when jaws close, that of the motor when they open.
    pub effort: f64,
}

impl GripperGoal {
    /// `control_msgs/action/GripperCommand`, for a gripper with one motor.
    pub fn gripper_command(&self) -> Option<String> {
        let [joint] = &self.joints[..] else { return None };
        let GripperJoint { position, effort, .. } = joint;
        Some(format!("{}command: {{position: {position:.6}, max_effort: {effort:.6}}}\n", self.heading()))
    }

    /// `control_msgs/action/ParallelGripperCommand`.
    pub fn parallel_gripper_command(&self) -> String {
        let list = |of: &dyn Fn(&GripperJoint) -> String| self.joints.iter().map(of).collect::<Vec<_>>().join(", ");
        let mut text = self.heading();
        let _ = writeln!(
            text,
            "command: {{name: [{}], position: [{}], velocity: [], effort: [{}]}}",
            list(&|joint| format!("{:?}", joint.name)),
            list(&|joint| format!("{:.6}", joint.position)),
            list(&|joint| format!("{:.6}", joint.effort))
        );
        text
    }

    fn heading(&self) -> String {
        format!("# {}, {:.2} s after the beginning of the trajectory\n", self.verb(), self.time_s)
    }

    /// Returns `close` or `open`.
    pub fn verb(&self) -> &'static str {
        if self.closes { "close" } else { "open" }
    }
}

/// Returns the goals of all grippers in a trajectory, in order of time. `controllers` are the names of the hands' controllers; points have a time, s, and the positions of all
/// joints of the hands, in their order.
pub(super) fn gripper_goals(
    robot: &Robot,
    hands: &[Moving],
    controllers: &[String],
    tasks: &[Task],
    points: &[(f64, &[f64])],
) -> Vec<GripperGoal> {
    let mut goals = Vec::new();
    let mut base = 0;
    for (hand, controller) in hands.iter().zip(controllers) {
        let values = |(_, positions): &(f64, &[f64])| positions.get(base..base + hand.q.len()).map(<[f64]>::to_vec);
        if let Some(jaws) = &hand.planner.hand.jaws {
            let way: Vec<Vec<f64>> = points.iter().filter_map(values).collect();
            let openings: Vec<f64> = way.iter().filter_map(|q| hand.planner.hand.opening(q)).collect();
            let mut forces = forces(tasks, hand.planner.side).into_iter();
            let mut force = 0.0;
            for (from, to) in moves(&openings) {
                let closes = openings[to] < openings[from];
                if closes {
                    force = forces.next().unwrap_or(force);
                }
                let share = jaws.share(openings[to]);
                goals.push(GripperGoal {
                    controller: controller.clone(),
                    time_s: points[from].0,
                    closes,
                    joints: joints(robot, hand, jaws, &way[to], closes.then_some((share, force))),
                });
            }
        }
        base += hand.q.len();
    }
    goals.sort_by(|one, other| one.time_s.total_cmp(&other.time_s));
    goals
}

/// Returns the ranges of points in which jaws with these openings, m, close or open.
fn moves(openings: &[f64]) -> Vec<(usize, usize)> {
    let direction = |at: usize| {
        let by = openings[at + 1] - openings[at];
        if by.abs() < STILL_M { 0 } else { by.signum() as i8 }
    };
    let steps: Vec<usize> = (0..openings.len().saturating_sub(1)).collect();
    let runs = steps.chunk_by(|one, next| direction(*one) == direction(*next));
    let ends = runs.filter(|run| direction(run[0]) != 0).map(|run| (run[0], run[run.len() - 1] + 1));
    ends.filter(|(from, to)| (openings[*to] - openings[*from]).abs() > MOVED_M).collect()
}

/// Returns the largest commanded force of a fingertip in each grasp of a hand, N, in order of time.
fn forces(tasks: &[Task], side: Side) -> Vec<f64> {
    let mut forces = Vec::new();
    for task in tasks.iter().filter(|task| task.track == side) {
        for grasp in 0..task.grasps.len() {
            let held = task.segments.iter().filter(|segment| segment.touching && segment.grasp == Some(grasp));
            let all = held.flat_map(|segment| &segment.tips).flat_map(|tip| &tip.force);
            forces.push(all.map(|force| Vector3::from(*force).norm()).fold(0.0, f64::max));
        }
    }
    forces
}

/// Returns the joints of jaws at these positions of the hand's degrees of freedom, with the effort of a force.
fn joints(robot: &Robot, hand: &Moving, jaws: &Jaws, q: &[f64], pressing: Option<(f64, f64)>) -> Vec<GripperJoint> {
    let mut driven: Vec<(usize, usize)> = Vec::new();
    for (index, jaw) in jaws.pair.iter().enumerate() {
        let dof = hand.planner.hand.finger(jaw.finger).and_then(|finger| finger.dofs.first().copied());
        driven.extend(dof.filter(|dof| driven.iter().all(|(_, other)| other != dof)).map(|dof| (index, dof)));
    }
    let joint = |(index, dof): (usize, usize)| {
        let model = &hand.limb.tree.dofs[dof];
        let effort = pressing.map_or(model.torque, |(share, force)| jaws.effort(index, share, force));
        let name = robot.controller_name(&model.name).to_string();
        GripperJoint { name, position: q[dof], effort: effort.min(model.torque) }
    };
    driven.into_iter().map(joint).collect()
}
