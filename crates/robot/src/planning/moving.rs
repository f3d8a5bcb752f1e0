//! A hand with its arm that follows its plans by inverse kinematics alone.

use super::hand_planner::{HandPlanner, PoseLookup};
use super::plan::Plan;
use super::start::Start;
use crate::kinematics::arm_ik::PoseError;
use crate::model::robot::Robot;
use nalgebra::Isometry3;
use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::scene::Scene;
use teachtree_command::Task;

/// Iterations of the arm's inverse kinematics from one point to the next.
const ITERATIONS: usize = 20;
/// Largest residual of a palm pose that counts as reached, m and rad.
const MISSED: PoseError = PoseError { m: 2e-3, rad: 2e-2 };

/// A hand with its arm in motion.
#[derive(Clone)]
pub(super) struct Moving {
    pub(super) planner: HandPlanner,
    /// Its robot, and the pose of its root: a hand without an arm moves freely.
    pub(super) limb: Robot,
    pub(super) root: Isometry3<f64>,
    /// The current values of all degrees of freedom.
    pub(super) q: Vec<f64>,
    /// The last target of the palm.
    pub(super) palm: Isometry3<f64>,
}

/// A target that an arm does not reach.
#[derive(Clone, Debug)]
pub(super) struct MissedPose {
    primitive: String,
    missing: PoseError,
    /// Whether the hand has released its object by then.
    is_released: bool,
}

impl Display for MissedPose {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (m, rad) = (self.missing.m * 1e3, self.missing.rad.to_degrees());
        write!(f, "in {} the palm stays {m:.1} mm and {rad:.1} degrees from its target", self.primitive)
    }
}

/// The part of its path that an arm must be able to follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FollowedPath {
    /// All of it.
    Whole,
    /// Up to the release of each object; then the arm may stay behind its target.
    ToReleases,
}

impl FollowedPath {
    /// Accepts a target that the arm need not reach.
    pub(super) fn accept(self, missed: MissedPose) -> Result<(), MissedPose> {
        if self == Self::ToReleases && missed.is_released { Ok(()) } else { Err(missed) }
    }
}

impl Moving {
    /// Returns a hand before its first task, in each possible start posture of the arm; the first one is preferred.
    ///
    /// # Errors
    /// As [`HandPlanner::begin`].
    pub(super) fn begin(
        side: Side,
        limb: &Robot,
        tasks: &[Task],
        scene: &Scene,
        place: &PoseLookup<'_>,
    ) -> Result<Vec<Self>, InputError> {
        let (planner, starts, target) = HandPlanner::begin(side, limb, tasks, scene, place)?;
        let begun = starts.into_iter().map(|Start { q, root, .. }| {
            let (planner, limb) = (planner.clone(), limb.clone());
            Self { planner, limb, root, q, palm: target.palm }
        });
        Ok(begun.collect())
    }

    /// Returns a hand before its first task, in the start posture that its arm reaches from this one; `None` if it cannot follow the whole path from there.
    pub(super) fn begin_near(
        side: Side,
        limb: &Robot,
        tasks: &[Task],
        scene: &Scene,
        place: &PoseLookup<'_>,
        arm: &BTreeMap<String, f64>,
    ) -> Option<Self> {
        let (planner, start, target) = HandPlanner::begin_near(side, limb, tasks, scene, place, arm)?;
        let Start { q, root, .. } = start;
        Some(Self { planner, limb: limb.clone(), root, q, palm: target.palm })
    }

    /// Advances to a time of a plan, s.
    ///
    /// # Errors
    /// A target that the arm does not reach; the hand is then as near to it as the arm comes.
    pub(super) fn advance(&mut self, plan: &Plan<'_>, own_s: f64) -> Result<(), MissedPose> {
        let target = plan.at(own_s);
        let mut missing = PoseError { m: 0.0, rad: 0.0 };
        self.palm = target.palm;
        let hand = &self.planner.hand;
        if hand.arm.is_empty() {
            self.root = target.palm * self.limb.tree.forward_kinematics(&self.q)[hand.palm].inverse();
        } else {
            let root = &self.root;
            missing = hand.arm_on(&self.limb.tree).inverse_kinematics(root, &target.palm, &mut self.q, ITERATIONS);
        }
        for finger in &hand.fingers {
            for (dof, angle) in finger.dofs.iter().zip(target.angles(finger)) {
                self.q[*dof] = angle;
            }
        }
        if missing.m > MISSED.m || missing.rad > MISSED.rad {
            let (_, released_s) = plan.touches();
            let primitive = plan.primitive(own_s).0.to_owned();
            return Err(MissedPose { primitive, missing, is_released: own_s > released_s });
        }
        Ok(())
    }
}
