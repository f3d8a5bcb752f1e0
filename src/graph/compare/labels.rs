//! The labels of a rule set that another one has too.

use crate::base::hands::Side;
use crate::language::rules::{Label, PrimitiveId, Rules};
use std::collections::BTreeSet;

/// Labels by name; of a sided primitive one for each side.
pub type Names = BTreeSet<String>;

/// A rule set with the primitives that another one has too. The others are new.
pub struct Shared<'r> {
    /// The rule set.
    pub rules: &'r Rules,
    is_new: Vec<bool>,
}

impl<'r> Shared<'r> {
    /// The primitives of a rule set that `base` has too.
    pub fn new(rules: &'r Rules, base: &Rules) -> Self {
        let is_new = |name: &String| base.primitive(name).is_none();
        Self { rules, is_new: rules.primitives.iter().map(|primitive| is_new(&primitive.name)).collect() }
    }

    /// All primitives of a rule set.
    pub fn all(rules: &'r Rules) -> Self {
        Self { rules, is_new: Vec::new() }
    }

    /// Whether a label is of a new primitive.
    pub fn is_new(&self, label: Label) -> bool {
        self.is_new.get(label.primitive.index()).copied().unwrap_or(false)
    }

    /// The leaves that labels stand for, without new ones. (Those of a list contain the kinds that count there.)
    pub fn names(&self, labels: impl IntoIterator<Item = Label>) -> Names {
        let old = labels.into_iter().filter(|label| !self.is_new(*label));
        old.flat_map(|label| self.leaves(label)).map(|label| self.rules.label_name(label)).collect()
    }

    /// A label without a side stands for both.
    fn leaves(&self, label: Label) -> Vec<Label> {
        let is_sided = |id: PrimitiveId| self.rules.primitives.get(id.index()).is_some_and(|one| one.sided);
        if label.side.is_some() || !is_sided(label.primitive) {
            return vec![label];
        }
        Side::BOTH.map(|side| Label { side: Some(side), ..label }).to_vec()
    }
}
