//! A change for two hands: tasks and rollouts with a new pair of grasps, and its cost.

use super::moving::{FollowedPath, Moving};
use super::rollout::{Near, Rollout, are_apart, total};
use teachtree_base::scene::Scene;
use teachtree_command::Task;

/// Tasks and rollouts with a new pair of grasps.
pub(super) struct Change {
    pub(super) tasks: [Task; 2],
    pub(super) rollouts: [Rollout; 2],
    pub(super) near: Vec<Near>,
    /// The increase of the penetration depth, m.
    pub(super) through: f64,
}

impl Change {
    /// The cost of the change, m; smaller is better.
    pub(super) fn cost(&self) -> f64 {
        total(&self.near) + self.through
    }

    /// Whether the hands count as apart and no path penetrates more than before.
    pub(super) fn is_clear(&self) -> bool {
        self.through == 0.0 && are_apart(&self.near)
    }

    /// Takes tasks and a rollout of a hand from one of these postures, if that reduces the missing distance.
    pub(super) fn take_nearest(
        &mut self,
        hand: usize,
        begun: impl IntoIterator<Item = Moving>,
        tasks: &[Task; 2],
        all: &[Task],
        scene: &Scene,
        followed: FollowedPath,
    ) {
        for rollout in begun.into_iter().filter_map(|begun| Rollout::of(begun, all, scene, followed).ok()) {
            if let Some(near) = rollout.near_to(&self.rollouts[1 - hand], hand, total(&self.near)) {
                self.rollouts[hand] = rollout;
                (self.tasks, self.near) = (tasks.clone(), near);
            }
        }
    }
}
