//! Labels that two rule sets have in common.

use crate::rules::{Label, PrimitiveId, Rules};
use std::collections::BTreeSet;
use teachtree_base::hands::Side;

/// Labels by name; a sided primitive has one for each side.
pub type Names = BTreeSet<String>;

/// A rule set whose primitives are divided into those of another rule set and new ones.
pub struct CommonLabels<'r> {
    /// The rule set.
    pub rules: &'r Rules,
    is_new: Vec<bool>,
}

impl<'r> CommonLabels<'r> {
    /// Treats primitives that `base` lacks as new.
    pub fn new(rules: &'r Rules, base: &Rules) -> Self {
        let is_new = |name: &String| base.primitive(name).is_none();
        Self { rules, is_new: rules.primitives.iter().map(|primitive| is_new(&primitive.name)).collect() }
    }

    /// Treats no primitive as new.
    pub fn all(rules: &'r Rules) -> Self {
        Self { rules, is_new: Vec::new() }
    }

    /// Whether the primitive of a label is new.
    pub fn is_new(&self, label: Label) -> bool {
        self.is_new.get(label.primitive.index()).copied().unwrap_or(false)
    }

    /// Returns the names of the leaves that labels refer to, without new ones. (The labels of a list already include the kinds of a primitive.)
    pub fn names(&self, labels: impl IntoIterator<Item = Label>) -> Names {
        let old = labels.into_iter().filter(|label| !self.is_new(*label));
        old.flat_map(|label| self.leaves(label)).map(|label| self.rules.label_name(label)).collect()
    }

    /// Returns the leaves of a label. A label without a side refers to both sides.
    fn leaves(&self, label: Label) -> Vec<Label> {
        let is_sided = |id: PrimitiveId| self.rules.primitives.get(id.index()).is_some_and(|one| one.sided);
        if label.side.is_some() || !is_sided(label.primitive) {
            return vec![label];
        }
        Side::BOTH.map(|side| Label { side: Some(side), ..label }).to_vec()
    }
}
