//! Kinds of primitives: `primitive Lift is Translate`.
//!
//! Where a list or rule names primitives, any other primitive counts for the nearest one above it that is named there. So a kind counts for
//! its parent, unless it is itself named; the lists of [`Rules`](super::Rules) contain the kinds beside what is written.

use super::{Label, Labels, Primitive, PrimitiveId, Rules};
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::hands::Side;
use teachtree_base::meaning::{Meaning, Primitives};

/// The most kinds that a primitive may have, kinds of kinds included.
pub const MOST_KINDS: usize = 64;

/// A primitive in a pattern, with the kinds that count for it.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Pattern {
    /// The written label.
    pub label: Label,
    /// The kinds that count for it.
    pub kinds: Labels,
}

impl Pattern {
    /// A label without kinds.
    pub const fn of(label: Label) -> Self {
        Self { label, kinds: Vec::new() }
    }

    /// Whether this pattern stands for `label`.
    pub fn covers(&self, label: Label) -> bool {
        self.label.covers(label) || self.kinds.iter().any(|kind| kind.covers(label))
    }

    /// Whether this pattern stands for all that the other one stands for.
    pub fn includes(&self, other: &Self) -> bool {
        other.labels().all(|label| self.covers(label))
    }

    /// The label and its kinds.
    pub fn labels(&self) -> impl Iterator<Item = Label> + '_ {
        std::iter::once(self.label).chain(self.kinds.iter().copied())
    }
}

impl Rules {
    /// Returns a primitive and its ancestors up to a root.
    pub fn lineage(&self, primitive: PrimitiveId) -> impl Iterator<Item = &Primitive> {
        let first = self.primitives.get(primitive.index());
        // A circle was reported; the bound ends the search in such incomplete rules.
        let above = |one: &&Primitive| self.primitives.get(one.is?.index());
        std::iter::successors(first, above).take(MOST_KINDS + 1)
    }

    /// What a hand does in a primitive: what its root says; `None` where it says nothing.
    pub fn meaning(&self, primitive: PrimitiveId) -> Option<Meaning> {
        self.lineage(primitive).find_map(|one| one.does)
    }

    /// What this hand does under a label; `None` for the track of both, and where nothing says it.
    pub fn meaning_for(&self, label: Label, hand: Option<Side>) -> Option<Meaning> {
        let root = self.lineage(label.primitive).find(|one| one.does.is_some())?;
        let is_other = label.side.zip(hand).is_some_and(|(side, hand)| side != hand);
        root.other.filter(|_| is_other).or(root.does)
    }

    /// What is known of each label that a leaf may give, by name.
    pub fn by_name(&self) -> Primitives {
        let known = self.labels().map(|label| {
            let above = self.primitives.get(label.primitive.index()).and_then(|one| one.is);
            let above = above.map(|primitive| {
                let sided = self.primitives.get(primitive.index()).is_some_and(|above| above.sided);
                self.label_name(Label { primitive, side: label.side.filter(|_| sided) })
            });
            (self.label_name(label), (self.meaning(label.primitive), above))
        });
        Primitives { known: known.collect() }
    }

    /// The kinds of each primitive that has any, directly.
    pub fn kinds(&self) -> BTreeMap<PrimitiveId, Vec<PrimitiveId>> {
        let mut kinds: BTreeMap<PrimitiveId, Vec<PrimitiveId>> = BTreeMap::new();
        for (primitive, id) in self.primitives.iter().zip((0..).map(PrimitiveId)) {
            if let Some(above) = primitive.is {
                kinds.entry(above).or_default().push(id);
            }
        }
        kinds
    }

    /// The kinds that count for a label where the `named` primitives are named, in order of declaration within a parent.
    pub fn kinds_of(
        &self,
        label: Label,
        named: &BTreeSet<PrimitiveId>,
        kinds: &BTreeMap<PrimitiveId, Vec<PrimitiveId>>,
    ) -> Labels {
        let mut found = Vec::new();
        let mut open = vec![label.primitive];
        while let Some(at) = open.pop().filter(|_| found.len() <= MOST_KINDS) {
            for kind in kinds.get(&at).into_iter().flatten().filter(|kind| !named.contains(kind)) {
                let sided = self.primitives.get(kind.index()).is_some_and(|kind| kind.sided);
                found.push(Label { primitive: *kind, side: label.side.filter(|_| sided) });
                open.push(*kind);
            }
        }
        found
    }
}
