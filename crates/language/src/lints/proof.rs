//! Proofs for the warnings about conditions: proves that outcomes are impossible together, and returns a minimal set of them.
//!
//! A proof may be too much work; then nothing is said.

use crate::formula::{Answer, Formula, Frame, Reader, solve_within};
use crate::rules::{Expr, ExprKind, Hand, Rules};
use std::collections::BTreeSet;
use std::rc::Rc;
use teachtree_base::diagnostic::Diagnostic;

/// Steps of all proofs about a rule set.
const MAX_STEPS: usize = 300_000;
/// Steps of one proof.
const MAX_STEPS_EACH: usize = 10_000;
/// Pieces of all formulas of a rule set.
const MAX_SIZE: usize = 300_000;
/// Single conditions that a reason lists.
const MAX_LISTED: usize = 4;

/// Proves, within bounds.
pub struct Prover<'a> {
    reader: Reader<'a>,
    /// The hand `this` in the current context.
    pub this: Hand,
    /// The leaves that may come before.
    pub before: Rc<BTreeSet<String>>,
    steps: usize,
    size: usize,
}

/// A condition and its wanted result.
#[derive(Clone, Debug)]
pub struct Requirement<'a> {
    /// The condition.
    pub expr: &'a Expr,
    /// The condition as a formula.
    pub formula: Formula,
    /// The wanted outcome.
    pub wanted: bool,
}

impl<'a> Prover<'a> {
    /// Reads the conditions of a rule set.
    pub fn new(rules: &'a Rules) -> Self {
        let reader = Reader::with_open_constants(rules);
        Self { reader, this: Hand::Shared, before: Rc::default(), steps: MAX_STEPS, size: MAX_SIZE }
    }

    /// Returns a condition with its wanted result as a requirement; `None` when the limit of formulas is reached.
    pub fn requirement(&mut self, expr: &'a Expr, wanted: bool) -> Option<Requirement<'a>> {
        let formula = (self.size > 0).then(|| self.reader.formula(expr, self.this))?;
        self.size = self.size.saturating_sub(formula.size());
        Some(Requirement { expr, formula, wanted })
    }

    /// Whether it is proved that these never come out so together.
    pub fn is_impossible(&mut self, all: &[(&Formula, bool)]) -> bool {
        let given = MAX_STEPS_EACH.min(self.steps);
        let mut left = given;
        let answer = solve_within(all, Rc::clone(&self.before), &mut left);
        self.steps -= given - left;
        matches!(answer, Answer::No)
    }

    /// A frame on which all of these come out so, when one is found.
    pub fn frame(&mut self, all: &[(&Formula, bool)]) -> Option<Frame> {
        let given = MAX_STEPS_EACH.min(self.steps);
        let mut left = given;
        let answer = solve_within(all, Rc::clone(&self.before), &mut left);
        self.steps -= given - left;
        match answer {
            Answer::Yes(case) => case.frame(all),
            Answer::No | Answer::Unknown => None,
        }
    }

    /// Returns a minimal set of outcomes that are impossible together. Later ones are kept in preference to earlier ones.
    pub fn least<T: Clone>(&mut self, mut all: Vec<T>, formula: impl Fn(&T) -> (&Formula, bool)) -> Vec<T> {
        let mut at = 0;
        while at < all.len() {
            let rest: Vec<(&Formula, bool)> =
                all.iter().enumerate().filter(|(other, _)| *other != at).map(|(_, one)| formula(one)).collect();
            if self.is_impossible(&rest) {
                all.remove(at);
            } else {
                at += 1;
            }
        }
        all
    }

    /// A condition taken apart into what has to come out how, so that it comes out as wanted.
    pub fn parts(&mut self, requirement: &Requirement<'a>) -> Vec<Requirement<'a>> {
        let mut parts = Vec::new();
        parts_of(requirement.expr, requirement.wanted, &mut parts);
        let read = parts.into_iter().map(|(expr, wanted)| self.requirement(expr, wanted)).collect::<Option<Vec<_>>>();
        read.unwrap_or_else(|| vec![requirement.clone()])
    }

    /// Shows a condition that never comes out as asked, with the parts of it that are the reason.
    pub fn alone(&mut self, finding: Diagnostic, requirement: &Requirement<'a>) -> Diagnostic {
        let parts = self.parts(requirement);
        let parts = self.least(parts, |part| (&part.formula, part.wanted));
        let text = |part: &Requirement| match (parts.len(), part.wanted) {
            (1, true) if matches!(part.expr.kind, ExprKind::From { .. }) => "the previous leaf is never one of these",
            (1, true) => "this never holds",
            (1, false) => "this always holds",
            (_, true) if requirement.wanted => "this has to hold …",
            (_, false) if requirement.wanted => "this must not hold …",
            (_, false) => "this holds where the rest does not",
            (_, true) => "this does not hold where the rest does not",
        };
        if parts.is_empty() {
            return finding
                .at(requirement.expr.span, if requirement.wanted { "this never holds" } else { "this always holds" });
        }
        parts.iter().fold(finding, |finding, part| finding.at(part.expr.span, text(part)))
    }

    /// The single conditions behind a contradiction, in words; `None` when they are too many or not single.
    pub fn reason(&mut self, all: &[Requirement<'a>]) -> Option<String> {
        let single = all.iter().flat_map(|requirement| requirement.formula.parts(requirement.wanted)).collect();
        let single = self.least(single, |one: &(&Formula, bool)| *one);
        // That something holds and does not is to be seen without words.
        let distinct: BTreeSet<_> = single.iter().map(|(formula, _)| formula.text()).collect();
        if distinct.len() < single.len() {
            return None;
        }
        let texts: Option<Vec<String>> = single
            .iter()
            .map(|(formula, wanted)| Some(format!("{}`{}`", if *wanted { "" } else { "not " }, formula.text()?)))
            .collect();
        let texts = texts.filter(|texts| (2..=MAX_LISTED).contains(&texts.len()))?;
        let (last, others) = texts.split_last()?;
        Some(format!("no frame has {} and {last} at once", others.join(", ")))
    }
}

fn parts_of<'a>(expr: &'a Expr, wanted: bool, parts: &mut Vec<(&'a Expr, bool)>) {
    match (&expr.kind, wanted) {
        (ExprKind::Not(inner), _) => parts_of(inner, !wanted, parts),
        (ExprKind::And(all), true) | (ExprKind::Or(all), false) => {
            all.iter().for_each(|part| parts_of(part, wanted, parts));
        }
        _ => parts.push((expr, wanted)),
    }
}
