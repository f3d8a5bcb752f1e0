//! Pairs of candidate grasps, one of each hand, in the order in which they are checked.

use std::cmp::Ordering;
use std::collections::BTreeMap;

/// Two choices, by their indices in the lists.
#[derive(Clone, Copy)]
pub(super) struct GraspPair {
    pub(super) choices: [usize; 2],
    /// Missing distance summed over the sampled steps, m, and the part of it that is due to paths.
    pub(super) left: f64,
    pub(super) through: f64,
    pub(super) measure: f64,
    /// The start postures of their arms, by their indices in the list.
    pub(super) postures: [usize; 2],
}

impl GraspPair {
    /// The order in which pairs are checked: by missing distance, then by measure.
    pub(super) fn order(&self, other: &Self) -> Ordering {
        self.left.total_cmp(&other.left).then(other.measure.total_cmp(&self.measure))
    }
}

/// Returns pairs in their order, with each choice in at most `alike` of them.
pub(super) fn of_many_kinds(mut pairs: Vec<GraspPair>, alike: usize) -> Vec<GraspPair> {
    pairs.sort_by(GraspPair::order);
    let mut used: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    pairs.retain(|pair| {
        let own = [0, 1].map(|hand| (hand, pair.choices[hand]));
        let may = own.iter().all(|choice| used.get(choice).is_none_or(|used| *used < alike));
        if may {
            own.into_iter().for_each(|choice| *used.entry(choice).or_default() += 1);
        }
        may
    });
    pairs
}
