//! The behaviors: every hand has each of them. To add one, write a file in `behaviors`, and name it twice here: as a module, and in the list.

mod grip_force;
pub mod peg_search;
mod pose_correction;
pub mod spiral_path;
mod sway_damping;

use super::behavior::Behavior;
use crate::model::hand::HandModel;
use grip_force::GripForce;
use peg_search::PegSearch;
use pose_correction::PoseCorrection;
use teachtree_base::scene::Scene;
use teachtree_command::Task;

/// Returns the behaviors of a hand at the beginning of a group of tasks. They correct a target in this order; each receives the target with the corrections of
/// the behaviors before it.
pub(crate) fn behaviors(hand: &HandModel, tasks: &[Task], scene: &Scene) -> Vec<Box<dyn Behavior>> {
    vec![
        Box::new(PegSearch::new(tasks, scene)),
        Box::new(PoseCorrection::new(scene, hand)),
        Box::new(GripForce::new(hand)),
    ]
}
