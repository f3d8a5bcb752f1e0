//! A change of two hands: tasks and walks with a pair of grasps chosen anew, and its cost.

use super::moving::Moving;
use super::walk::{Near, Walk, total};
use teachtree_base::scene::Scene;
use teachtree_command::Task;

/// Tasks and walks with a pair of grasps chosen anew.
pub(super) struct Change {
    pub(super) tasks: [Task; 2],
    pub(super) walks: [Walk; 2],
    pub(super) near: Vec<Near>,
    /// The increase of the penetration depth, m.
    pub(super) through: f64,
}

impl Change {
    /// The cost of the change, m; smaller is better.
    pub(super) fn cost(&self) -> f64 {
        total(&self.near) + self.through
    }

    /// Takes tasks and a walk of a hand from one of these postures, where that leaves less too near.
    pub(super) fn take_nearest(
        &mut self,
        hand: usize,
        begun: impl IntoIterator<Item = Moving>,
        tasks: &[Task; 2],
        all: &[Task],
        scene: &Scene,
    ) {
        for walk in begun.into_iter().filter_map(|begun| Walk::of(begun, all, scene)) {
            let near = walk.near_to(&self.walks[1 - hand], hand);
            if total(&near) < total(&self.near) {
                self.walks[hand] = walk;
                (self.tasks, self.near) = (tasks.clone(), near);
            }
        }
    }
}
