//! Observers of a simulation: they record, measure and judge each step.
//!
//! An observer is one file with a type that receives each step. To add one: write the file, and name it in [`super::observers`].

use super::hand_agent::HandAgent;
use teachtree_world::{Observation, STEP_S};

/// A simulated step.
pub(super) struct Step<'a> {
    /// The number of the step since the beginning of the simulation, and since the beginning of the group of tasks.
    pub(super) number: usize,
    pub(super) in_group: usize,
    /// The sensor values after the step.
    pub(super) seen: &'a Observation,
    /// The hands, in the order of the scene.
    pub(super) hands: &'a [HandAgent<'a>],
}

impl Step<'_> {
    /// Returns the time of the step, s since the beginning.
    pub(super) fn time_s(&self) -> f64 {
        self.number as f64 * STEP_S
    }
}

/// An observer of a simulation.
pub(super) trait Observer {
    /// Receives a step.
    fn observe(&mut self, step: &Step<'_>);
}
