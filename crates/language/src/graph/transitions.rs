//! The possible transitions between leaves of a tree: for each previous leaf, the paths whose conditions can hold together.
//!
//! An arrow from A to B says that a frame after a leaf A can give B, decided on intervals of quantities, on hystereses and on what a latch
//! lets hold on the frame itself (`language::formula`). What a latch remembers of earlier frames is left open. So an arrow that is missing never
//! occurs, on any log; one that is drawn may still need a past that never comes.

use super::{AbstractValue, lower};
use crate::formula::{Answer, Formula, Reader, solve};
use crate::rules::{Consequent, Expr, ExprKind, Hand, LatchId, LeafPath, Rules, Tree, TreeScope};
use std::collections::{BTreeMap, BTreeSet};

/// The label before the first frame.
pub const NONE: &str = "none";
/// The leaf of a tree over both hands while nothing is coordinated.
pub const SEPARATE: &str = "separate";

/// Which leaf can follow which in one tree, before settling.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Transitions {
    /// The tree.
    pub tree: String,
    /// Whom it labels.
    pub scope: TreeScope,
    /// `none`, then the leaves that can be reached, in the order of the tree.
    pub leaves: Vec<String>,
    /// Leaves that stand in the tree but are never reached.
    pub never: Vec<String>,
    /// From one leaf to another one, by their positions in `leaves`; in that order.
    pub arrows: BTreeMap<(usize, usize), Arrow>,
}

/// That one leaf can follow another one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Arrow {
    /// Whether it was decided that it can; else that was too much work.
    pub is_decided: bool,
    /// The choices that lead there, by the places where they stand.
    pub places: Vec<String>,
}

/// Decides for each tree of a rule set which leaf can follow which.
pub fn transitions(rules: &Rules) -> Vec<Transitions> {
    let graph = lower(rules);
    let of = |tree: &Tree| {
        // What no channel whatsoever lets be reached: constants of hand models are followed here.
        let labels = super::reachable_leaves(&graph, tree.scope, |_, _| AbstractValue::Unknown, |_, _| true);
        let can = labels.into_iter().map(|label| rules.label_name(label)).collect();
        Search::new(rules, tree, &can).run()
    };
    rules.trees.iter().map(of).collect()
}

/// A path through a tree with its conditions as formulas.
struct FormulaPath {
    /// The leaf; none for `stay`.
    leaf: Option<String>,
    formulas: Vec<(Formula, bool)>,
    place: String,
}

struct Search<'a> {
    tree: &'a Tree,
    paths: Vec<FormulaPath>,
    /// The leaves that stand in the tree, in its order.
    standing: Vec<String>,
}

impl<'a> Search<'a> {
    fn new(rules: &'a Rules, tree: &'a Tree, can: &BTreeSet<String>) -> Self {
        let this = if tree.scope == TreeScope::EachHand { Hand::This } else { Hand::Shared };
        let (reader, paths) = (Reader::new(rules), tree.root.paths());
        let leaf = |path: &LeafPath| match &path.choice.then {
            Consequent::Primitive(label) => Some(rules.label_name(*label)),
            Consequent::Separate => Some(SEPARATE.to_string()),
            Consequent::Stay | Consequent::Branch(_) => None,
        };
        let mut standing = Vec::new();
        for leaf in paths.iter().filter_map(leaf) {
            if !standing.contains(&leaf) {
                standing.push(leaf);
            }
        }
        let asked = paths.iter().filter_map(|path| {
            let leaf = leaf(path);
            if leaf.as_ref().is_some_and(|leaf| leaf != SEPARATE && !can.contains(leaf)) {
                return None;
            }
            let conditions = path.asked.iter().map(|(_, condition, wanted)| (reader.formula(condition, this), *wanted));
            let formulas = conditions.chain(of_latches(path, rules, &reader, this)).collect();
            Some(FormulaPath { leaf, formulas, place: rules.sources.place(path.choice.span) })
        });
        Self { paths: asked.collect(), standing, tree }
    }

    /// From `none` on, each leaf that is reached is a leaf before in its turn.
    fn run(self) -> Transitions {
        let mut found: BTreeMap<(String, String), Arrow> = BTreeMap::new();
        let mut reached = vec![NONE.to_string()];
        let mut next = 0;
        while let Some(before) = reached.get(next).cloned() {
            next += 1;
            for path in &self.paths {
                // `stay` gives no other leaf.
                let Some(leaf) = path.leaf.as_ref().filter(|leaf| **leaf != before) else { continue };
                let wanted: Vec<(&Formula, bool)> = path.formulas.iter().map(|(one, wanted)| (one, *wanted)).collect();
                let is_decided = match solve(&wanted, BTreeSet::from([before.clone()])) {
                    Answer::No => continue,
                    Answer::Yes(_) => true,
                    Answer::Unknown => false,
                };
                let arrow = found.entry((before.clone(), leaf.clone()));
                let arrow = arrow.or_insert_with(|| Arrow { is_decided: false, places: Vec::new() });
                arrow.is_decided |= is_decided;
                arrow.places.push(path.place.clone());
                if !reached.contains(leaf) {
                    reached.push(leaf.clone());
                }
            }
        }
        let (in_order, never): (Vec<String>, Vec<String>) =
            self.standing.into_iter().partition(|leaf| reached.contains(leaf));
        let leaves: Vec<String> = std::iter::once(NONE.to_string()).chain(in_order).collect();
        let at = |name: &String| leaves.iter().position(|leaf| leaf == name);
        let arrows = found.iter().filter_map(|((from, to), arrow)| Some(((at(from)?, at(to)?), arrow.clone())));
        let arrows = arrows.collect();
        Transitions { tree: self.tree.name.clone(), scope: self.tree.scope, leaves, never, arrows }
    }
}

/// What holds of the latches that a way asks for, on the frame itself: one that is set is not cleared, one that is not was not set or is cleared.
fn of_latches(path: &LeafPath, rules: &Rules, reader: &Reader<'_>, this: Hand) -> Vec<(Formula, bool)> {
    let mut named: Vec<(LatchId, Hand, &Expr)> = Vec::new();
    for (_, condition, _) in &path.asked {
        condition.walk(&mut |part| {
            if let ExprKind::Latch(id, hand) = &part.kind
                && !named.iter().any(|(known, whose, _)| known == id && whose == hand)
            {
                named.push((*id, *hand, part));
            }
        });
    }
    let mut clauses = Vec::new();
    for (id, hand, part) in named {
        let latch = &rules.latches[id.index()];
        let whose = hand.seen_from(this);
        // `from` in a latch of somebody else speaks of other leaves than these.
        let own = whose == this;
        let known = |expr: &Expr| own || !reads_from(expr);
        let is_set = || reader.formula(part, this);
        let set = || reader.formula(&latch.set, whose);
        let clear = || reader.formula(&latch.clear, whose);
        let not = |one: Formula| Formula::Not(Box::new(one));
        if known(&latch.clear) {
            clauses.push((Formula::Any(vec![not(is_set()), not(clear())]), true));
        }
        // The latch of a hand that a recording lacks is never set, whatever holds.
        let is_there = own || this == Hand::Shared;
        if is_there && known(&latch.clear) && known(&latch.set) {
            clauses.push((Formula::Any(vec![is_set(), not(set()), clear()]), true));
        }
    }
    clauses
}

fn reads_from(expr: &Expr) -> bool {
    let mut reads = false;
    expr.walk(&mut |part| reads |= matches!(part.kind, ExprKind::From { .. } | ExprKind::Latch(..)));
    reads
}
