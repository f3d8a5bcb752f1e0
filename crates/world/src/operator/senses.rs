//! What an operator feels and sees, a reaction time late.

use crate::Observation;
use crate::bodies::BodyContact;
use nalgebra::Vector3;
use std::collections::VecDeque;

/// A contact is noticed from this force on, N.
const NOTICED_N: f64 = 0.03;

/// The glimpses of the last moments.
pub(super) struct Senses {
    glimpses: VecDeque<Glimpse>,
    longest: usize,
}

/// What was felt and seen at one instant.
#[derive(Default)]
pub(super) struct Glimpse {
    /// Force of each fingertip of this hand on the object in question, N, reference frame.
    pub(super) tips: Vec<Vector3<f64>>,
    contacts: Vec<BodyContact>,
}

impl Senses {
    /// Senses that remember `longest` steps.
    pub(super) fn new(longest: usize) -> Self {
        Self { glimpses: VecDeque::with_capacity(longest + 1), longest }
    }

    /// Takes in what hand number `hand` feels of `object` now, and what is seen.
    pub(super) fn take_in(&mut self, seen: &Observation, hand: usize, object: usize) {
        let mut glimpse = if self.glimpses.len() > self.longest {
            self.glimpses.pop_front().unwrap_or_default()
        } else {
            Glimpse::default()
        };
        glimpse.tips.clear();
        glimpse.tips.extend(seen.hands.get(hand).iter().flat_map(|hand| &hand.tips).map(|tip| tip.force_on(object)));
        glimpse.contacts.clone_from(&seen.contacts);
        self.glimpses.push_back(glimpse);
    }

    /// What was felt this many steps ago, or the oldest that is remembered.
    pub(super) fn ago(&self, steps: usize) -> Option<&Glimpse> {
        let newest = self.glimpses.len().checked_sub(1)?;
        self.glimpses.get(newest.saturating_sub(steps))
    }
}

impl Glimpse {
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
