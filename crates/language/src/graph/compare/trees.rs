//! Finds cases in which the trees of two rule sets give different leaves.
//!
//! Every path through one tree is paired with every path through the other. A pair with different leaves counts only if its conditions
//! can hold together (`formula`), so a proof holds for every log. Each difference has an example case.

use crate::formula::{Answer, Formula, Reader, canonical_text, solve};
use crate::rules::{self, Consequent, Expr, Hand, Label, Rules, Tree, TreeScope};
use std::collections::BTreeSet;

/// Maximum number of reported differences for a pair of trees.
const MAX_REPORTED: usize = 20;
/// Maximum number of undecided pairs of paths. The comparison then stops.
const MAX_CUT: usize = 10;

/// A case in which two trees give different leaves on a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The tree.
    pub tree: String,
    /// The text of each condition, and whether it holds.
    pub conditions: Vec<(String, bool)>,
    /// The previous leaf, if it matters.
    pub before: Option<String>,
    /// The leaf of the first rule set.
    pub one: String,
    /// The leaf of the second rule set.
    pub other: String,
    /// The place of that leaf in the second rule set.
    pub place: String,
}

/// The comparison of the trees of two rule sets.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TreeComparison {
    /// The names of the compared trees.
    pub trees: Vec<String>,
    /// The trees that only one of them has.
    pub alone: Vec<String>,
    /// The cases in which the leaves differ.
    pub differences: Vec<Difference>,
    /// Whether the comparison stopped early, or some pair of paths was undecided. The trees may then differ in further cases.
    pub is_cut: bool,
}

/// Finds cases in which the trees of two rule sets give different leaves.
pub fn differences(one: &Rules, other: &Rules) -> TreeComparison {
    trees(one, other, &|_| false)
}

/// A path through a tree.
struct ComparedPath<'a> {
    asked: Vec<(String, &'a Expr, bool)>,
    /// The label, or `stay`, or `separate`.
    leaf: String,
    label: Option<Label>,
    place: String,
}

/// Compares the trees, ignoring leaves of the second rule set that are new.
pub(super) fn trees(one: &Rules, other: &Rules, is_new: &dyn Fn(Label) -> bool) -> TreeComparison {
    let mut compared = TreeComparison::default();
    for scope in [TreeScope::EachHand, TreeScope::BothHands] {
        let this = if scope == TreeScope::EachHand { Hand::This } else { Hand::Shared };
        match (one.tree(scope), other.tree(scope)) {
            (Some(ours), Some(theirs)) => {
                compared.trees.push(theirs.name.clone());
                compare_trees(
                    &ComparedTree::new(one, ours, this),
                    &ComparedTree::new(other, theirs, this),
                    is_new,
                    &mut compared,
                );
            }
            (Some(tree), None) | (None, Some(tree)) => compared.alone.push(tree.name.clone()),
            (None, None) => {}
        }
    }
    compared
}

/// One of the two trees.
struct ComparedTree<'a> {
    reader: Reader<'a>,
    name: &'a str,
    this: Hand,
    paths: Vec<ComparedPath<'a>>,
}

impl<'a> ComparedTree<'a> {
    fn new(rules: &'a Rules, tree: &'a Tree, this: Hand) -> Self {
        let path = |path: rules::LeafPath<'a>| {
            let (leaf, label) = match &path.choice.then {
                Consequent::Primitive(label) => (rules.label_name(*label), Some(*label)),
                Consequent::Separate => ("separate".into(), None),
                Consequent::Stay | Consequent::Branch(_) => ("stay".into(), None),
            };
            let asked = path
                .asked
                .into_iter()
                .map(|(_, condition, wanted)| (canonical_text(condition, rules, this), condition, wanted));
            ComparedPath { asked: asked.collect(), leaf, label, place: rules.sources.place(path.choice.span) }
        };
        let paths = tree.root.paths().into_iter().map(path).collect();
        Self { reader: Reader::new(rules), name: &tree.name, this, paths }
    }
}

fn compare_trees(
    one: &ComparedTree,
    other: &ComparedTree,
    is_new: &dyn Fn(Label) -> bool,
    compared: &mut TreeComparison,
) {
    // The possible previous leaves are those of the first tree.
    let mut leaves: BTreeSet<String> =
        one.paths.iter().filter_map(|path| path.label.map(|_| path.leaf.clone())).collect();
    leaves.insert("none".into());
    if one.paths.iter().any(|path| path.leaf == "separate") {
        leaves.insert("separate".into());
    }
    let mut cut = 0;
    for theirs in &other.paths {
        if theirs.label.is_some_and(is_new) {
            continue;
        }
        for ours in &one.paths {
            if ours.leaf == theirs.leaf || opposite(ours, theirs) {
                continue;
            }
            // `stay` gives the previous leaf: it differs only after another leaf, and it requires a previous leaf.
            let mut before = leaves.clone();
            for (stays, gives) in [(ours, theirs), (theirs, ours)] {
                if stays.leaf == "stay" {
                    before.retain(|leaf| *leaf != gives.leaf && *leaf != "none");
                }
            }
            if before.is_empty() {
                continue;
            }
            let formulas = |tree: &ComparedTree, path: &ComparedPath| -> Vec<(Formula, bool)> {
                path.asked.iter().map(|(_, expr, wanted)| (tree.reader.formula(expr, tree.this), *wanted)).collect()
            };
            let all: Vec<(Formula, bool)> = formulas(one, ours).into_iter().chain(formulas(other, theirs)).collect();
            let wanted: Vec<(&Formula, bool)> = all.iter().map(|(formula, wanted)| (formula, *wanted)).collect();
            match solve(&wanted, before) {
                Answer::No => {}
                Answer::Unknown => {
                    compared.is_cut = true;
                    cut += 1;
                    if cut >= MAX_CUT {
                        return;
                    }
                }
                Answer::Yes(_) if compared.differences.len() >= MAX_REPORTED => {
                    compared.is_cut = true;
                    return;
                }
                Answer::Yes(case) => {
                    let conditions = case.conditions().map(|(text, holds)| (text.to_string(), holds)).collect();
                    let before = case.before.iter().next().filter(|_| case.before.len() < leaves.len()).cloned();
                    compared.differences.push(Difference {
                        tree: other.name.to_string(),
                        conditions,
                        before,
                        one: ours.leaf.clone(),
                        other: theirs.leaf.clone(),
                        place: theirs.place.clone(),
                    });
                }
            }
        }
    }
}

/// Whether two paths require opposite values of the same condition.
fn opposite(one: &ComparedPath, other: &ComparedPath) -> bool {
    one.asked
        .iter()
        .any(|(ours, _, wanted)| other.asked.iter().any(|(theirs, _, other)| ours == theirs && wanted != other))
}
