//! The list of behaviors: every hand has each of them.

use super::behavior::Behavior;
use super::grip_force::GripForce;
use super::peg_search::PegSearch;
use super::pose_correction::PoseCorrection;
use crate::base::scene::Scene;
use crate::command::Task;
use crate::robot::model::hand::HandModel;

/// Returns the behaviors of a hand at the beginning of a group of tasks, in the order in which they correct a target: each sees the target as the one before
/// has left it.
pub(crate) fn behaviors(hand: &HandModel, tasks: &[Task], scene: &Scene) -> Vec<Box<dyn Behavior>> {
    vec![Box::new(PegSearch::new(tasks, scene)), Box::new(PoseCorrection::new(scene)), Box::new(GripForce::new(hand))]
}
