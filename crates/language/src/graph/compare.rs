//! Compares two rule sets: lists their differences, and proves that one only adds to the other.
//!
//! Trees are compared by their leaves (`trees`), all other declarations by their meaning. `docs/proving.md` lists everything that can change
//! the analysis of a recording, and how each is compared. A difference that may change an analysis is a finding, so a proof holds for every
//! log.

mod declarations;
mod labels;
mod relabels;
mod tasks;
mod trees;

pub use trees::{Difference, TreeComparison, differences};

use crate::rules::{RelabelKind, Rules, TreeScope};
use labels::CommonLabels;

/// A declaration that prevents the proof that a rule set only adds to another one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// The declaration and its possible effect.
    pub what: String,
    /// Its place in the rule file.
    pub place: String,
}

/// Whether a rule set only adds to another one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExtensionProof {
    /// The new primitives.
    pub new: Vec<String>,
    /// The comparison of the trees. Differences have a leaf that is not new.
    pub trees: TreeComparison,
    /// The other declarations that may change the analysis of a recording without new primitives.
    pub findings: Vec<Finding>,
    /// If the proof fails: whether it holds for recordings of one hand.
    pub of_one_hand: bool,
}

impl ExtensionProof {
    /// Whether the proof holds for every recording.
    pub fn is_proved(&self) -> bool {
        self.trees.differences.is_empty() && !self.trees.is_cut && self.findings.is_empty()
    }
}

/// Tries to prove that base and extension analyze every recording alike, in each gap-free interval in which no tree gives a new primitive,
/// and that the trees give the base's leaves up to the first new primitive.
pub fn prove_extension(base: &Rules, extended: &Rules) -> ExtensionProof {
    let proof = proof(base, extended);
    let speaks_of_both = |rules: &Rules| {
        rules.tree(TreeScope::BothHands).is_some() || rules.relabels.iter().any(|rule| is_of_both(&rule.kind))
    };
    if proof.is_proved() || !speaks_of_both(extended) {
        return proof;
    }
    let of_one_hand = self::proof(&without_both(base), &without_both(extended)).is_proved();
    ExtensionProof { of_one_hand, ..proof }
}

fn proof(base: &Rules, extended: &Rules) -> ExtensionProof {
    let shared = CommonLabels::new(extended, base);
    let new = extended.primitives.iter().map(|primitive| primitive.name.clone());
    let new = new.filter(|name| base.primitive(name).is_none()).collect();
    let mut findings = declarations::changed(base, &shared);
    findings.extend(declarations::new_channels(base, extended));
    findings.extend(declarations::new_trees(base, &shared));
    findings.extend(tasks::acts(base, &shared));
    findings.extend(relabels::acts(base, &shared));
    ExtensionProof {
        new,
        trees: trees::trees(base, extended, &|label| shared.is_new(label)),
        findings,
        of_one_hand: false,
    }
}

/// Returns the rules that affect a recording of one hand.
fn without_both(rules: &Rules) -> Rules {
    let mut rules = rules.clone();
    rules.trees.retain(|tree| tree.scope == TreeScope::EachHand);
    rules.relabels.retain(|rule| !is_of_both(&rule.kind));
    rules
}

/// Whether a rule has no effect on recordings of one hand.
const fn is_of_both(kind: &RelabelKind) -> bool {
    matches!(kind, RelabelKind::BetweenInHands { .. } | RelabelKind::Separate { .. })
}

/// Lists the differences between the declarations of two rule sets, except in the leaves of their trees: declarations of the first set that
/// are missing from the second one, have another meaning or another position there, and new declarations.
pub fn declarations(one: &Rules, other: &Rules) -> Vec<String> {
    let mut lines = declarations::differences(one, other);
    lines.extend(tasks::differences(one, other));
    lines.extend(relabels::differences(one, other));
    lines
}

/// Returns the names that precede a name in the second list which they follow in the first one. Each list contains a name at most once.
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
