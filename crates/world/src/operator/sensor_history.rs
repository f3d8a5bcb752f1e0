//! What an operator feels and sees, a reaction time late.

use crate::Observation;
use crate::bodies::BodyContact;
use nalgebra::Vector3;
use std::collections::VecDeque;

/// A contact is noticed from this force on, N.
const NOTICED_N: f64 = 0.03;

/// The samples of the last moments.
pub(super) struct SensorHistory {
    samples: VecDeque<SensorSample>,
    longest: usize,
}

/// What was felt and seen at one instant.
#[derive(Default)]
pub(super) struct SensorSample {
    /// Force of each fingertip of this hand on the object in question, N, reference frame.
    pub(super) tips: Vec<Vector3<f64>>,
    contacts: Vec<BodyContact>,
}

impl SensorHistory {
    /// Senses that remember `longest` steps.
    pub(super) fn new(longest: usize) -> Self {
        Self { samples: VecDeque::with_capacity(longest + 1), longest }
    }

    /// Takes in what hand number `hand` feels of `object` now, and what is seen.
    pub(super) fn record(&mut self, seen: &Observation, hand: usize, object: usize) {
        let mut sample = if self.samples.len() > self.longest {
            self.samples.pop_front().unwrap_or_default()
        } else {
            SensorSample::default()
        };
        sample.tips.clear();
        sample.tips.extend(seen.hands.get(hand).iter().flat_map(|hand| &hand.tips).map(|tip| tip.force_on(object)));
        sample.contacts.clone_from(&seen.contacts);
        self.samples.push_back(sample);
    }

    /// What was felt this many steps ago, or the oldest that is remembered.
    pub(super) fn steps_ago(&self, steps: usize) -> Option<&SensorSample> {
        let newest = self.samples.len().checked_sub(1)?;
        self.samples.get(newest.saturating_sub(steps))
    }
}

impl SensorSample {
    /// Whether two bodies were seen, or felt, to touch.
    pub(super) fn touching(&self, body: usize, other: usize) -> bool {
        self.contacts.iter().any(|contact| {
            ((contact.body, contact.other) == (body, other) || (contact.body, contact.other) == (other, body))
                && contact.force.norm() > NOTICED_N
        })
    }

    /// The sum of the fingertips' forces, N.
    pub(super) fn total(&self) -> Vector3<f64> {
        self.tips.iter().sum()
    }
}
