//! Behaviors of a hand: corrections of its targets by sensor feedback.
//!
//! A behavior is one file with a type that corrects the target of each step. To add one: write the file, and name it in [`super::behaviors`].

use crate::planning::plan::Target;
use nalgebra::{Isometry3, Vector3};
use std::fmt;
use teachtree_base::hands::Finger;
use teachtree_world::TipState;

/// The minimum force of a finger that takes part in holding, N.
pub(crate) const HOLDS_N: f64 = 0.1;

/// The sensor values of a hand in a step, and the state of its task.
pub(crate) struct HandObservation<'a> {
    /// Index of the task.
    pub(crate) task: usize,
    /// The seen pose of the object, reference frame.
    pub(crate) object: Isometry3<f64>,
    /// Index of the object among the bodies of the scene.
    pub(crate) body: usize,
    /// The sensed states of the fingertips.
    pub(crate) tips: &'a [TipState],
    /// The transform from the demonstrated pose of the hole to its seen pose, reference frame.
    pub(crate) hole_off: Isometry3<f64>,
    /// Whether the object is being inserted.
    pub(crate) inserts: bool,
    /// Whether another hand holds the object too.
    pub(crate) shared: bool,
}

impl HandObservation<'_> {
    /// Returns the force of all fingertips on the object, reference frame, N.
    pub(crate) fn force(&self) -> Vector3<f64> {
        self.tips.iter().map(|tip| tip.force_on(self.body)).sum()
    }
}

/// Whether the plan advances.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Progress {
    /// The plan advances.
    Continue,
    /// The plans of all hands wait.
    Wait,
}

/// A behavior of one hand, with its state.
pub(crate) trait Behavior {
    /// Corrects the target of a step of `dt_s`, s, by the sensor values, and returns whether the plan advances.
    fn apply(&mut self, sensed: &HandObservation<'_>, target: &mut Target, dt_s: f64) -> Progress;

    /// Returns the current grip force, if the behavior controls it and the hand holds an object.
    fn grip(&self) -> Option<GripForceTotals> {
        None
    }

    /// Returns the result of a search in a task, if it searched.
    fn searched(&self, _task: usize) -> Option<SearchResult> {
        None
    }
}

/// Sums of the forces of the holding fingertips, N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GripForceTotals {
    /// The requested sum.
    pub(crate) asked: f64,
    /// The sum within the hand's force limit.
    pub(crate) within_limits: f64,
    /// The sum after the slip reflex has raised it.
    pub(crate) raised: f64,
}

/// The result of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SearchResult {
    /// The hole was found at this distance from its expected position, m.
    Found(f64),
    /// No hole was found within this distance of its expected position, m.
    NotWithin(f64),
}

/// Formats the result as a message.
impl fmt::Display for SearchResult {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Found(off) => write!(to, "hole found {:.1} mm from where it was expected", off * 1e3),
            Self::NotWithin(within) => write!(to, "hole not found within {:.1} mm", within * 1e3),
        }
    }
}

/// Returns whether a target holds an object between thumb and fingers.
pub(crate) fn holds(target: &Target) -> bool {
    let presses = |thumb: bool| {
        let mut those = target.tips.iter().filter(|(finger, ..)| (*finger == Finger::Thumb) == thumb);
        those.any(|(.., force)| force.norm() > HOLDS_N)
    };
    presses(true) && presses(false)
}
