//! A change for two hands: tasks and rollouts with a new pair of grasps, and its cost.

use super::moving::{FollowedPath, Moving};
use super::rollout::{Near, Rollout, are_apart, total};
use teachtree_base::scene::Scene;
use teachtree_command::Task;

/// Missing distance that is added for each place on its paths, and each step, at which a hand or an arm penetrates a body, m.
pub(super) const THROUGH_M: f64 = 0.02;

/// Returns the cost of two rollouts, m: the missing distance between them, and what penetrations of fixed bodies count.
pub(super) fn cost(near: &[Near], rollouts: &[Rollout; 2]) -> f64 {
    total(near) + rollouts.iter().map(|rollout| rollout.meets as f64 * THROUGH_M).sum::<f64>()
}

/// Tasks and rollouts with a new pair of grasps.
pub(super) struct Change {
    pub(super) tasks: [Task; 2],
    pub(super) rollouts: [Rollout; 2],
    pub(super) near: Vec<Near>,
    /// What penetrations on its paths count, beyond those of the present grasps, m.
    pub(super) through: f64,
}

impl Change {
    /// The cost of the change, m; smaller is better.
    pub(super) fn cost(&self) -> f64 {
        cost(&self.near, &self.rollouts) + self.through
    }

    /// Whether the hands count as apart, no path penetrates more than before, and no arm penetrates a fixed body.
    pub(super) fn is_clear(&self) -> bool {
        self.through < THROUGH_M / 2.0
            && are_apart(&self.near)
            && self.rollouts.iter().all(|rollout| rollout.meets == 0)
    }

    /// Takes tasks and a rollout of a hand from one of these postures, if that reduces the cost; `gain` is what the task gains on its path, m.
    pub(super) fn take_nearest(
        &mut self,
        hand: usize,
        begun: impl IntoIterator<Item = Moving>,
        (tasks, mut gain): (&[Task; 2], f64),
        all: &[Task],
        scene: &Scene,
        followed: FollowedPath,
    ) {
        for rollout in begun.into_iter().filter_map(|begun| Rollout::of(begun, all, scene, followed).ok()) {
            let met = (self.rollouts[hand].meets as f64 - rollout.meets as f64) * THROUGH_M;
            if let Some(near) = rollout.near_to(&self.rollouts[1 - hand], hand, total(&self.near) + met + gain) {
                self.rollouts[hand] = rollout;
                (self.through, gain) = (self.through - gain, 0.0);
                (self.tasks, self.near) = (tasks.clone(), near);
            }
        }
    }
}
