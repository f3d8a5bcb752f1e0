//! Two rule sets compared: how they differ, and whether one only adds to the other.
//!
//! Trees are compared by what they give (`trees`), all other declarations by what they say: `docs/proving.md` lists what can change the
//! analysis of a recording, and how each is compared. What is not known to change nothing is a finding, so that a proof holds for every log.

mod declarations;
mod labels;
mod relabels;
mod tasks;
mod trees;

pub use trees::{Compared, Difference, differences};

use crate::language::rules::{RelabelKind, Rules, TreeScope};
use labels::Shared;

/// A declaration that keeps one rule set from only adding to another one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// What it is, and what it may do.
    pub what: String,
    /// Where it stands.
    pub place: String,
}

/// Whether a rule set only adds to another one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Additive {
    /// The primitives that are new.
    pub new: Vec<String>,
    /// The trees; differences are those into a leaf that is not new.
    pub trees: Compared,
    /// The other declarations that may change the analysis of a recording in which no new primitive occurs.
    pub findings: Vec<Finding>,
    /// Where it is not proved: whether it is for recordings of one hand.
    pub of_one_hand: bool,
}

impl Additive {
    /// Whether it is proved.
    pub fn is_proved(&self) -> bool {
        self.trees.differences.is_empty() && !self.trees.is_cut && self.findings.is_empty()
    }
}

/// Tries to prove that the analysis of every recording by the extension is that by the base, in each gap-free stretch in which no tree gives
/// a primitive that is new; and that the trees give the base's leaves up to the first new one.
pub fn additive(base: &Rules, extended: &Rules) -> Additive {
    let proof = proof(base, extended);
    let speaks_of_both = |rules: &Rules| {
        rules.tree(TreeScope::BothHands).is_some() || rules.relabels.iter().any(|rule| is_of_both(&rule.kind))
    };
    if proof.is_proved() || !speaks_of_both(extended) {
        return proof;
    }
    let of_one_hand = self::proof(&without_both(base), &without_both(extended)).is_proved();
    Additive { of_one_hand, ..proof }
}

fn proof(base: &Rules, extended: &Rules) -> Additive {
    let shared = Shared::new(extended, base);
    let new = extended.primitives.iter().map(|primitive| primitive.name.clone());
    let new = new.filter(|name| base.primitive(name).is_none()).collect();
    let mut findings = declarations::changed(base, &shared);
    findings.extend(declarations::new_channels(base, extended));
    findings.extend(declarations::new_trees(base, &shared));
    findings.extend(tasks::acts(base, &shared));
    findings.extend(relabels::acts(base, &shared));
    Additive { new, trees: trees::trees(base, extended, &|label| shared.is_new(label)), findings, of_one_hand: false }
}

/// The rules as far as they have a part in a recording of one hand.
fn without_both(rules: &Rules) -> Rules {
    let mut rules = rules.clone();
    rules.trees.retain(|tree| tree.scope == TreeScope::EachHand);
    rules.relabels.retain(|rule| !is_of_both(&rule.kind));
    rules
}

/// Whether a rule changes nothing where there is one hand only.
const fn is_of_both(kind: &RelabelKind) -> bool {
    matches!(kind, RelabelKind::BetweenInHands { .. } | RelabelKind::Separate { .. })
}

/// How the declarations of two rule sets differ, other than in what their trees give: what of the first one is gone, means something else or
/// comes elsewhere in the second one, and what is new there.
pub fn declarations(one: &Rules, other: &Rules) -> Vec<String> {
    let mut lines = declarations::differences(one, other);
    lines.extend(tasks::differences(one, other));
    lines.extend(relabels::differences(one, other));
    lines
}

/// Names of the second list that stand before one that they follow in the first one; each is in both lists once.
fn moved<'n>(ours: &[&'n str], theirs: &[&'n str]) -> Vec<&'n str> {
    let mut last = None;
    let mut moved = Vec::new();
    for name in ours {
        let Some(at) = theirs.iter().position(|other| other == name) else { continue };
        if last.is_some_and(|last| at < last) {
            moved.push(*name);
        }
        last = Some(at);
    }
    moved
}
