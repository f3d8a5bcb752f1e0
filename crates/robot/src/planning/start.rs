//! Start positions of a robot: joint positions from which its arm can move the palm along the whole path of a plan.

use super::plan::{Plan, Target};
use crate::kinematics::arm_ik::{PathFailure, PathPosture};
use crate::kinematics::joint_positions::JointPositions;
use crate::kinematics::surroundings::Surroundings;
use crate::model::hand::HandModel;
use crate::model::robot::Robot;
use nalgebra::Isometry3;
use std::collections::BTreeMap;

/// Interval at which the path of the palm is sampled, s; number of starts of the inverse kinematics, and iterations of each.
const WAY_S: f64 = 0.1;
const STARTS: usize = 48;
const ITERATIONS: usize = 150;
/// Number of parts in which the first free motion is shortened.
const LEFT_OUT: u32 = 4;

/// A robot at rest at its first target.
#[derive(Clone, Debug)]
pub struct Start {
    /// Values of all degrees of freedom.
    pub q: Vec<f64>,
    /// The pose of the root, `world_from_root`.
    pub root: Isometry3<f64>,
    /// The joint positions of each finger.
    pub fingers: Vec<JointPositions>,
    /// The target pose of the palm.
    pub palm: Isometry3<f64>,
}

impl Start {
    /// Returns the start at a target, with an arm that can move the palm along `way`, which begins there. A hand without an arm moves freely.
    ///
    /// # Errors
    /// A path that the arm cannot follow.
    pub fn new(robot: &Robot, hand: &HandModel, target: &Target, way: &[Isometry3<f64>]) -> Result<Self, String> {
        Self::all(robot, hand, target, way, &Surroundings::default()).map(|mut all| all.swap_remove(0))
    }

    /// Returns the starts in all postures of the arm from which it can follow the path, at least one: those with the fewest collisions first, then those farthest from
    /// their limits.
    fn all(
        robot: &Robot,
        hand: &HandModel,
        target: &Target,
        way: &[Isometry3<f64>],
        surroundings: &Surroundings,
    ) -> Result<Vec<Self>, String> {
        let rest = vec![0.0; robot.tree.dofs.len()];
        let (mut root, mut postures) = (Isometry3::identity(), vec![rest.clone()]);
        if hand.arm.is_empty() {
            root = target.palm * robot.tree.forward_kinematics(&rest)[hand.palm].inverse();
        } else {
            let arm = hand.arm_on(&robot.tree);
            let mut found: Vec<PathPosture> =
                arm.postures_along(&root, way, &rest, (STARTS, ITERATIONS), surroundings).collect();
            found.sort_by(|a, b| a.met.cmp(&b.met).then(a.off_middle.total_cmp(&b.off_middle)));
            postures = found.into_iter().map(|posture| posture.q).collect();
        }
        if postures.is_empty() {
            let place = place_of(&target.palm);
            return Err(format!("begins with the palm at {place}; the arm cannot move it along the whole path"));
        }
        Ok(postures.into_iter().map(|q| Self::at(hand, target, root, q)).collect())
    }

    /// Returns the start at a target with the arm in a posture.
    fn at(hand: &HandModel, target: &Target, root: Isometry3<f64>, mut q: Vec<f64>) -> Self {
        let fingers: Vec<JointPositions> = hand.fingers.iter().map(|finger| target.angles(finger)).collect();
        for (finger, angles) in hand.fingers.iter().zip(&fingers) {
            for (dof, angle) in finger.dofs.iter().zip(angles) {
                q[*dof] = *angle;
            }
        }
        Self { q, root, fingers, palm: target.palm }
    }

    /// Returns the start of a plan in the posture that the arm reaches from this one, by the names of joints; `None` if it cannot follow the whole path from there, or if
    /// the robot has no arm.
    pub(crate) fn near(robot: &Robot, hand: &HandModel, plan: &Plan<'_>, arm: &BTreeMap<String, f64>) -> Option<Self> {
        let (way, target, root) = (way_of(plan, 0.0), plan.at(0.0), Isometry3::identity());
        let mut q = vec![0.0; robot.tree.dofs.len()];
        for dof in &hand.arm {
            q[*dof] = *arm.get(&robot.tree.dofs[*dof].name)?;
        }
        let moves = !hand.arm.is_empty();
        let arm = hand.arm_on(&robot.tree);
        arm.inverse_kinematics(&root, &target.palm, &mut q, ITERATIONS);
        (moves && arm.follows(&root, &way, &q)).then(|| Self::at(hand, &target, root, q))
    }

    /// Returns the starts of a plan, first the one nearest to the arm's posture in its commands, otherwise the best one; and the time in the plan, s. The operator's hand
    /// may come from outside the arm's workspace, so the first free motion is shortened as far as necessary.
    ///
    /// # Errors
    /// A plan whose path the arm cannot follow from any start.
    pub(crate) fn of_plan(
        robot: &Robot,
        hand: &HandModel,
        plan: &Plan<'_>,
        surroundings: &Surroundings,
    ) -> Result<(Vec<Self>, f64), String> {
        let mut refused = String::new();
        let (touched, _) = plan.touches();
        let way = |from_s: f64| way_of(plan, from_s);
        for part in 0..=LEFT_OUT {
            let from_s = touched * f64::from(part) / f64::from(LEFT_OUT);
            let way = way(from_s);
            match Self::all(robot, hand, &plan.at(from_s), &way, surroundings) {
                Ok(mut all) => {
                    let far = |start: &Self| plan.arm().iter().map(|(dof, at)| (start.q[*dof] - at).abs()).sum::<f64>();
                    all.sort_by(|a, b| far(a).total_cmp(&far(b)));
                    return Ok((all, from_s));
                }
                Err(message) => refused = message,
            }
        }
        Err(missed(robot, hand, plan, touched, &way(touched)).unwrap_or(refused))
    }
}

/// Returns the path of the palm from a time of a plan on, s, until the release.
fn way_of(plan: &Plan<'_>, from_s: f64) -> Vec<Isometry3<f64>> {
    let (_, released) = plan.touches();
    let times = (0..).map(|at| from_s + f64::from(at) * WAY_S).take_while(|time| *time <= released);
    times.map(|time| plan.at(time).palm).collect()
}

/// Formats a position for messages.
fn place_of(pose: &Isometry3<f64>) -> String {
    let at = pose.translation.vector * 1e3;
    format!("{:.0}, {:.0}, {:.0} mm in the reference frame", at.x, at.y, at.z)
}

/// Formats the pose at which an arm fails to follow a plan's path from a time on, s.
fn missed(robot: &Robot, hand: &HandModel, plan: &Plan<'_>, from_s: f64, way: &[Isometry3<f64>]) -> Option<String> {
    let (root, rest) = (Isometry3::identity(), vec![0.0; robot.tree.dofs.len()]);
    let arm = hand.arm_on(&robot.tree);
    let PathFailure { pose, missing, at_limit } = arm.missed_along(&root, way, &rest, (STARTS, ITERATIONS))?;
    let (primitive, _) = plan.primitive(from_s + pose as f64 * WAY_S);
    let (place, m, rad) = (place_of(way.get(pose)?), missing.m * 1e3, missing.rad.to_degrees());
    let joint = at_limit.map_or_else(String::new, |dof| format!(", with `{}` at its limit", robot.tree.dofs[dof].name));
    Some(format!(
        "the arm cannot move the palm along the whole path: in {primitive} the palm is to be at {place}, and {m:.1} mm and {rad:.1} degrees are missing{joint}"
    ))
}
