//! The delayed sensory input of an operator.

use super::grips::HandGrip;
use crate::Observation;
use crate::bodies::BodyContact;
use nalgebra::{Isometry3, Vector3};
use std::collections::VecDeque;

/// The minimum force of a noticed contact, N.
const NOTICED_N: f64 = 0.03;

/// The latest samples.
pub(super) struct SensorHistory {
    samples: VecDeque<SensorSample>,
    longest: usize,
    /// The scale by which sensed forces are divided, because the forces of a script are those of hands of scale 1.
    force_scale: f64,
}

/// The sensory input at one instant.
#[derive(Default)]
pub(super) struct SensorSample {
    /// Force of each fingertip of this hand on the object in question, N, reference frame.
    pub(super) tips: Vec<Vector3<f64>>,
    contacts: Vec<BodyContact>,
}

impl SensorHistory {
    /// Returns a history of `longest` steps for hands of this `force_scale`.
    pub(super) fn new(longest: usize, force_scale: f64) -> Self {
        Self { samples: VecDeque::with_capacity(longest + 1), longest, force_scale }
    }

    /// Adds the forces of the hand `hand` on `object`, and the seen state.
    pub(super) fn record(&mut self, seen: &Observation, hand: usize, object: usize) {
        let mut sample = if self.samples.len() > self.longest {
            self.samples.pop_front().unwrap_or_default()
        } else {
            SensorSample::default()
        };
        sample.tips.clear();
        let tips = seen.hands.get(hand).into_iter().flat_map(|hand| &hand.tips);
        sample.tips.extend(tips.map(|tip| tip.force_on(object) / self.force_scale));
        sample.contacts.clone_from(&seen.contacts);
        self.samples.push_back(sample);
    }

    /// Returns the sample of this number of steps ago, or the oldest one.
    pub(super) fn steps_ago(&self, steps: usize) -> Option<&SensorSample> {
        let newest = self.samples.len().checked_sub(1)?;
        self.samples.get(newest.saturating_sub(steps))
    }
}

impl SensorSample {
    /// Whether two bodies touched, as seen or felt.
    pub(super) fn touching(&self, body: usize, other: usize) -> bool {
        self.contacts.iter().any(|contact| {
            ((contact.body, contact.other) == (body, other) || (contact.body, contact.other) == (other, body))
                && contact.force.norm() > NOTICED_N
        })
    }

    /// Returns the normal force on each side of a grip, N.
    pub(super) fn squeeze(&self, grip: &HandGrip, palm: &Isometry3<f64>) -> f64 {
        let contacts = self.tips.iter().zip(&grip.contacts);
        let pressed = contacts.filter_map(|(force, contact)| Some(-force.dot(&(palm * contact.as_ref()?.1))));
        pressed.sum::<f64>() / 2.0
    }

    /// Returns the sum of the fingertips' forces, N.
    pub(super) fn total(&self) -> Vector3<f64> {
        self.tips.iter().sum()
    }
}
