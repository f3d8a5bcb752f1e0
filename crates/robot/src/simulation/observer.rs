//! Observers of a simulation: what is recorded, measured and judged of each step.
//!
//! An observer is one file with a type that looks at each step. To add one: write the file, and name it in [`super::observers`].

use super::hand_agent::HandAgent;
use teachtree_world::{Observation, STEP_S};

/// A step that was made.
pub(super) struct Step<'a> {
    /// Its number since the beginning of the simulation, and of the group of tasks.
    pub(super) number: usize,
    pub(super) in_group: usize,
    /// What is felt and seen after it.
    pub(super) seen: &'a Observation,
    /// The hands, in the order of the scene.
    pub(super) hands: &'a [HandAgent<'a>],
}

impl Step<'_> {
    /// Returns when it was, s since the beginning.
    pub(super) fn time_s(&self) -> f64 {
        self.number as f64 * STEP_S
    }
}

/// An observer of a simulation.
pub(super) trait Observer {
    /// Looks at a step.
    fn observe(&mut self, step: &Step<'_>);
}
