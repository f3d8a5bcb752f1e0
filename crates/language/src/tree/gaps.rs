//! Branches that leave frames without a choice: no `else`, and nothing that proves that one of the choices always holds.

use super::conditions;
use crate::formula::{Answer, Formula, Frame, Reader, solve_within};
use crate::rules::{Branch, Consequent, Expr, Hand, Rules, Tree, TreeScope};
use std::collections::BTreeSet;
use std::rc::Rc;

/// Steps of all proofs about a tree.
const MAX_STEPS: usize = 300_000;
/// Maximum size of all formulas of a tree; beyond it, only the conditions of the branch itself are examined.
const MAX_SIZE: usize = 300_000;
/// How a leaf is called that another file may bring.
const OTHER: &str = "another primitive";

/// A branch that is not proved to have a choice for every frame.
#[derive(Clone, Debug)]
pub struct Gap<'a> {
    /// The branch.
    pub branch: &'a Branch,
    /// A frame that gets there and on which none of its choices holds; `None` when looking for one was too much work.
    pub frame: Option<Frame>,
    /// What was asked on the way and of the choices, with how it comes out on that frame.
    pub asked: Vec<(&'a Expr, bool)>,
}

/// The gaps of a tree, in order.
pub fn gaps<'a>(rules: &'a Rules, tree: &'a Tree) -> Vec<Gap<'a>> {
    let (this, more) = match tree.scope {
        TreeScope::EachHand => (Hand::This, None),
        TreeScope::BothHands => (Hand::Shared, Some("separate")),
    };
    // Leaves that other files may bring are among those before, so that no extension makes a gap.
    let before = rules.label_names().chain(more.into_iter().chain(["none", OTHER]).map(str::to_string));
    let mut search = Search {
        reader: None,
        rules,
        this,
        before: before.collect::<BTreeSet<_>>().into(),
        steps: MAX_STEPS,
        size: MAX_SIZE,
        asked: Vec::new(),
        gaps: Vec::new(),
    };
    search.branch(&tree.root);
    search.gaps
}

struct Search<'a> {
    /// Made when it is needed: hardly a branch is without `else`.
    reader: Option<Reader<'a>>,
    rules: &'a Rules,
    this: Hand,
    before: Rc<BTreeSet<String>>,
    steps: usize,
    size: usize,
    asked: Vec<(&'a Expr, bool)>,
    gaps: Vec<Gap<'a>>,
}

impl<'a> Search<'a> {
    fn branch(&mut self, branch: &'a Branch) {
        let start = self.asked.len();
        for choice in &branch.choices {
            self.asked.extend(choice.condition.iter().map(|condition| (condition, true)));
            if let Consequent::Branch(below) = &choice.then {
                self.branch(below);
            }
            if let (Some(_), Some((_, wanted))) = (&choice.condition, self.asked.last_mut()) {
                *wanted = false;
            }
        }
        if branch.choices.iter().all(|choice| choice.condition.is_some()) {
            self.look(branch, start);
        }
        self.asked.truncate(start);
    }

    /// Searches a frame on which all conditions have the required outcomes.
    fn look(&mut self, branch: &'a Branch, start: usize) {
        let own: Vec<&Expr> = self.asked.iter().skip(start).map(|(condition, _)| *condition).collect();
        if conditions::exhaustive(&own) {
            return;
        }
        let (mut frame, mut is_proved) = (None, false);
        if self.size > 0 && self.steps > 0 {
            let reader = self.reader.get_or_insert_with(|| Reader::new(self.rules));
            let formulas: Vec<(Formula, bool)> =
                self.asked.iter().map(|(expr, wanted)| (reader.formula(expr, self.this), *wanted)).collect();
            self.size = self.size.saturating_sub(formulas.iter().map(|(formula, _)| formula.size()).sum());
            let wanted: Vec<(&Formula, bool)> = formulas.iter().map(|(formula, wanted)| (formula, *wanted)).collect();
            match solve_within(&wanted, Rc::clone(&self.before), &mut self.steps) {
                Answer::No => is_proved = true,
                Answer::Yes(case) => frame = case.frame(&wanted),
                Answer::Unknown => {}
            }
        }
        if !is_proved {
            self.gaps.push(Gap { branch, frame, asked: self.asked.clone() });
        }
    }
}
