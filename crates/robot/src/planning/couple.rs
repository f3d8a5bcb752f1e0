//! Pairs of choices of a grasp, one of each hand, in the order in which they are looked at.

use std::cmp::Ordering;
use std::collections::BTreeMap;

/// Two choices, by their places in the lists.
#[derive(Clone, Copy)]
pub(super) struct Couple {
    pub(super) choices: [usize; 2],
    /// How much is too near at the steps that are looked at, m in all, and by how much for its ways.
    pub(super) left: f64,
    pub(super) through: f64,
    pub(super) measure: f64,
    /// The postures in which their arms begin, by their places in the list.
    pub(super) postures: [usize; 2],
}

impl Couple {
    /// The order in which they are looked at.
    pub(super) fn order(&self, other: &Self) -> Ordering {
        self.left.total_cmp(&other.left).then(other.measure.total_cmp(&self.measure))
    }
}

/// Couples in their order, with each choice in so many of them at most.
pub(super) fn of_many_kinds(mut couples: Vec<Couple>, alike: usize) -> Vec<Couple> {
    couples.sort_by(Couple::order);
    let mut used: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    couples.retain(|couple| {
        let own = [0, 1].map(|hand| (hand, couple.choices[hand]));
        let may = own.iter().all(|choice| used.get(choice).is_none_or(|used| *used < alike));
        if may {
            own.into_iter().for_each(|choice| *used.entry(choice).or_default() += 1);
        }
        may
    });
    couples
}
