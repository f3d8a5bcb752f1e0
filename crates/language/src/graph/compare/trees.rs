//! Finds cases in which the trees of two rule sets give different leaves.
//!
//! Every path through one tree is paired with every path through the other. A pair with different leaves counts only if its conditions
//! can hold together (`formula`), so a proof holds for every log. Each difference has an example case.

use crate::formula::{Answer, Formula, Reader, possible, written};
use crate::rules::{self, Expr, Hand, Label, Rules, Then, Tree, TreeScope};
use std::collections::BTreeSet;

/// Maximum number of reported differences for a pair of trees.
const MAX_TOLD: usize = 20;
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
struct Way<'a> {
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
        let this = if scope == TreeScope::EachHand { Hand::This } else { Hand::Nobody };
        match (one.tree(scope), other.tree(scope)) {
            (Some(ours), Some(theirs)) => {
                compared.trees.push(theirs.name.clone());
                compare_trees(&Half::new(one, ours, this), &Half::new(other, theirs, this), is_new, &mut compared);
            }
            (Some(tree), None) | (None, Some(tree)) => compared.alone.push(tree.name.clone()),
            (None, None) => {}
        }
    }
    compared
}

/// One of the two trees.
struct Half<'a> {
    reader: Reader<'a>,
    name: &'a str,
    this: Hand,
    ways: Vec<Way<'a>>,
}

impl<'a> Half<'a> {
    fn new(rules: &'a Rules, tree: &'a Tree, this: Hand) -> Self {
        let way = |way: rules::Way<'a>| {
            let (leaf, label) = match &way.choice.then {
                Then::Primitive(label) => (rules.label_name(*label), Some(*label)),
                Then::Separate => ("separate".into(), None),
                Then::Stay | Then::Branch(_) => ("stay".into(), None),
            };
            let asked = way
                .asked
                .into_iter()
                .map(|(_, condition, wanted)| (written(condition, rules, this), condition, wanted));
            Way { asked: asked.collect(), leaf, label, place: rules.sources.place(way.choice.span) }
        };
        let ways = tree.root.ways().into_iter().map(way).collect();
        Self { reader: Reader::new(rules), name: &tree.name, this, ways }
    }
}

fn compare_trees(one: &Half, other: &Half, is_new: &dyn Fn(Label) -> bool, compared: &mut TreeComparison) {
    // The possible previous leaves are those of the first tree.
    let mut leaves: BTreeSet<String> = one.ways.iter().filter_map(|way| way.label.map(|_| way.leaf.clone())).collect();
    leaves.insert("none".into());
    if one.ways.iter().any(|way| way.leaf == "separate") {
        leaves.insert("separate".into());
    }
    let mut cut = 0;
    for theirs in &other.ways {
        if theirs.label.is_some_and(is_new) {
            continue;
        }
        for ours in &one.ways {
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
            let formulas = |half: &Half, way: &Way| -> Vec<(Formula, bool)> {
                way.asked.iter().map(|(_, expr, wanted)| (half.reader.formula(expr, half.this), *wanted)).collect()
            };
            let all: Vec<(Formula, bool)> = formulas(one, ours).into_iter().chain(formulas(other, theirs)).collect();
            let wanted: Vec<(&Formula, bool)> = all.iter().map(|(formula, wanted)| (formula, *wanted)).collect();
            match possible(&wanted, before) {
                Answer::No => {}
                Answer::Perhaps => {
                    compared.is_cut = true;
                    cut += 1;
                    if cut >= MAX_CUT {
                        return;
                    }
                }
                Answer::Yes(_) if compared.differences.len() >= MAX_TOLD => {
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
fn opposite(one: &Way, other: &Way) -> bool {
    one.asked
        .iter()
        .any(|(ours, _, wanted)| other.asked.iter().any(|(theirs, _, other)| ours == theirs && wanted != other))
}
