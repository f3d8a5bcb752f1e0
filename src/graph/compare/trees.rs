//! Where the trees of two rule sets give different leaves.
//!
//! Every way through one tree is paired with every way through the other. A pair with different leaves counts only if its conditions can
//! hold together (`formula`), so a proof holds for every log; a difference comes with the case that shows it.

use crate::language::formula::{Answer, Formula, Reader, possible, written};
use crate::language::rules::{self, Expr, Hand, Label, Rules, Then, Tree, TreeScope};
use std::collections::BTreeSet;

/// Differences of one pair of trees that are reported.
const MAX_TOLD: usize = 20;
/// Pairs of ways that may be too much work; the rest is not looked at then.
const MAX_CUT: usize = 10;

/// A case in which two trees give different leaves on a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The tree.
    pub tree: String,
    /// What holds and what does not, as it is written.
    pub conditions: Vec<(String, bool)>,
    /// A leaf before, where it matters.
    pub before: Option<String>,
    /// What the first rule set gives.
    pub one: String,
    /// What the second one gives.
    pub other: String,
    /// Where the second one says so.
    pub place: String,
}

/// What came of comparing two trees.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Compared {
    /// The trees that were compared, by name.
    pub trees: Vec<String>,
    /// The trees that only one of them has.
    pub alone: Vec<String>,
    /// Where they differ.
    pub differences: Vec<Difference>,
    /// Whether some pair of ways was too much work: then unreported trees may differ too.
    pub is_cut: bool,
}

/// Where the trees of two rule sets give different leaves.
pub fn differences(one: &Rules, other: &Rules) -> Compared {
    trees(one, other, &|_| false)
}

/// A way through a tree.
struct Way<'a> {
    asked: Vec<(String, &'a Expr, bool)>,
    /// The label, or `stay`, or `separate`.
    leaf: String,
    label: Option<Label>,
    place: String,
}

/// The same, without leaves of the second rule set that are new.
pub(super) fn trees(one: &Rules, other: &Rules, is_new: &dyn Fn(Label) -> bool) -> Compared {
    let mut compared = Compared::default();
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

/// One of two trees.
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

fn compare_trees(one: &Half, other: &Half, is_new: &dyn Fn(Label) -> bool, compared: &mut Compared) {
    // The leaves before: those that the first tree gives.
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
            // `stay` is the leaf before: it differs only after another one, and never stands after none.
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

/// Whether two ways ask the same condition to come out differently.
fn opposite(one: &Way, other: &Way) -> bool {
    one.asked
        .iter()
        .any(|(ours, _, wanted)| other.asked.iter().any(|(theirs, _, other)| ours == theirs && wanted != other))
}
