//! Mutations of rules, to find out which changes no test notices: a comparison reversed, thresholds doubled, a window twice as long.

mod witness;

pub use witness::witness;

use super::ops::{Operand, Samples};
use super::rules::{Branch, Comparison, Consequent, Constant, Expr, ExprKind, Rules};
use teachtree_base::diagnostic::Span;

const TURNED: &str = "the comparison reversed";
const DOUBLED: &str = "the thresholds doubled";
const HALVED: &str = "the thresholds halved";
const MORE_OFTEN: &str = "once more often";
const LONGER: &str = "the time doubled";

/// Rules with one change.
#[derive(Clone, Debug)]
pub struct Mutant {
    /// The change.
    pub what: &'static str,
    /// The place.
    pub span: Span,
    /// The changed rules.
    pub rules: Rules,
}

/// The mutants of a rule set, one after the other.
pub fn mutants(rules: &Rules) -> impl Iterator<Item = Mutant> {
    (0..).map_while(|at| {
        let mut changed = rules.clone();
        let mut counter = Counter { left: at, done: None };
        counter.rules(&mut changed);
        counter.done.map(|(what, span)| Mutant { what, span, rules: changed })
    })
}

/// Counts places that can be changed, and changes one of them.
struct Counter {
    left: usize,
    done: Option<(&'static str, Span)>,
}

impl Counter {
    fn rules(&mut self, rules: &mut Rules) {
        for signal in &mut rules.signals {
            self.expr(&mut signal.expr);
        }
        for latch in &mut rules.latches {
            self.expr(&mut latch.set);
            self.expr(&mut latch.clear);
        }
        for tree in &mut rules.trees {
            self.branch(&mut tree.root);
        }
    }

    fn branch(&mut self, branch: &mut Branch) {
        for choice in &mut branch.choices {
            if let Some(condition) = &mut choice.condition {
                self.expr(condition);
            }
            if let Consequent::Branch(below) = &mut choice.then {
                self.branch(below);
            }
        }
    }

    fn expr(&mut self, expr: &mut Expr) {
        if self.done.is_some() {
            return;
        }
        let span = expr.span;
        match &mut expr.kind {
            ExprKind::Compare(comparison, ..) => {
                let turned = negated(*comparison);
                self.change(TURNED, span, || *comparison = turned);
            }
            ExprKind::Hysteresis { on, off, .. } => {
                // Both by the same factor, so that they stay in their order.
                self.change(DOUBLED, span, || {
                    scale(on, 2.0);
                    scale(off, 2.0);
                });
                self.change(HALVED, span, || {
                    scale(on, 0.5);
                    scale(off, 0.5);
                });
            }
            ExprKind::Temporal(temporal, _) => {
                let kinds: Vec<Operand> = temporal.kinds().collect();
                for (constant, kind) in temporal.constants_mut().into_iter().zip(kinds) {
                    match kind {
                        Operand::Times => self.change(MORE_OFTEN, span, || constant.value += 1.0),
                        _ => self.change(LONGER, span, || scale(constant, 2.0)),
                    }
                }
            }
            ExprKind::Rate(_, time) | ExprKind::Summary(_, _, Samples::Last(time)) => {
                self.change(LONGER, span, || scale(time, 2.0));
            }
            _ => {}
        }
        for argument in expr.arguments_mut() {
            self.expr(argument);
        }
    }

    fn change(&mut self, what: &'static str, span: Span, change: impl FnOnce()) {
        if self.done.is_some() {
            return;
        }
        match self.left.checked_sub(1) {
            Some(left) => self.left = left,
            None => {
                change();
                self.done = Some((what, span));
            }
        }
    }
}

fn scale(constant: &mut Constant, factor: f64) {
    constant.value *= factor;
}

const fn negated(comparison: Comparison) -> Comparison {
    match comparison {
        Comparison::Less => Comparison::GreaterEqual,
        Comparison::LessEqual => Comparison::Greater,
        Comparison::Greater => Comparison::LessEqual,
        Comparison::GreaterEqual => Comparison::Less,
        Comparison::Equal => Comparison::NotEqual,
        Comparison::NotEqual => Comparison::Equal,
    }
}
