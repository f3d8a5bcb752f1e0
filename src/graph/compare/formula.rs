//! Conditions as formulas, and whether some of them can hold together: decided on intervals of quantities, on states of hystereses and on
//! the leaf before. Different quantities are free, so what is found impossible is impossible on every log.

use super::written::{label, written};
use crate::language::rules::{Comparison, Expr, ExprKind, Hand, Rules, Type};
use std::collections::{BTreeMap, BTreeSet};

/// Signals that are opened one within the other; deeper ones are taken as they are.
const MAX_DEPTH: usize = 6;
/// Steps of one search; beyond them the answer is "perhaps".
const MAX_STEPS: usize = 100_000;

/// A condition.
#[derive(Clone, Debug)]
pub enum Formula {
    /// Known.
    Known(bool),
    /// Something that holds or does not.
    Atom(Atom),
    /// `from`: the names of the leaves, `none` among them.
    From(Vec<String>),
    /// Not.
    Not(Box<Self>),
    /// All of them.
    All(Vec<Self>),
    /// At least one.
    Any(Vec<Self>),
}

/// Something that holds or does not.
#[derive(Clone, Debug)]
pub struct Atom {
    /// By which equal ones are known.
    key: String,
    /// As its author wrote it.
    text: String,
    /// The quantity that it bounds, with its interval when it holds and when it does not.
    bound: Option<(String, [Interval; 2])>,
}

/// Where a quantity lies: the ends, and whether each is left out.
#[derive(Clone, Copy, Debug)]
pub struct Interval {
    low: (f64, bool),
    high: (f64, bool),
}

impl Interval {
    const ALL: Self = Self { low: (f64::NEG_INFINITY, false), high: (f64::INFINITY, false) };

    const fn above(low: f64, open: bool) -> Self {
        Self { low: (low, open), ..Self::ALL }
    }

    const fn below(high: f64, open: bool) -> Self {
        Self { high: (high, open), ..Self::ALL }
    }

    fn with(self, other: Self) -> Option<Self> {
        let low = match self.low.0.total_cmp(&other.low.0) {
            std::cmp::Ordering::Less => other.low,
            std::cmp::Ordering::Greater => self.low,
            std::cmp::Ordering::Equal => (self.low.0, self.low.1 || other.low.1),
        };
        let high = match self.high.0.total_cmp(&other.high.0) {
            std::cmp::Ordering::Less => self.high,
            std::cmp::Ordering::Greater => other.high,
            std::cmp::Ordering::Equal => (self.high.0, self.high.1 || other.high.1),
        };
        let empty = low.0 > high.0 || low.0 >= high.0 && (low.1 || high.1);
        (!empty).then_some(Self { low, high })
    }
}

/// A condition of a rule set as a formula.
pub fn formula(expr: &Expr, rules: &Rules, this: Hand) -> Formula {
    opened(expr, rules, this, 0)
}

fn opened(expr: &Expr, rules: &Rules, this: Hand, depth: usize) -> Formula {
    let all = |parts: &[Expr]| parts.iter().map(|part| opened(part, rules, this, depth)).collect();
    match &expr.kind {
        ExprKind::Bool(value) => Formula::Known(*value),
        ExprKind::Not(inner) => Formula::Not(Box::new(opened(inner, rules, this, depth))),
        ExprKind::And(parts) => Formula::All(all(parts)),
        ExprKind::Or(parts) => Formula::Any(all(parts)),
        ExprKind::From { labels, none } => {
            let names = labels.iter().map(|one| label(*one, rules));
            Formula::From(names.chain(none.then(|| "none".to_string())).collect())
        }
        ExprKind::Signal(id, hand) if depth < MAX_DEPTH && expr.ty == Type::BOOL => {
            let this = if *hand == Hand::This { this } else { *hand };
            opened(&rules.signals[id.index()].expr, rules, this, depth + 1)
        }
        _ => Formula::Atom(Atom {
            key: written(expr, rules, this),
            text: rules.sources.text(expr.span).split_whitespace().collect::<Vec<_>>().join(" "),
            bound: bound(expr, rules, this),
        }),
    }
}

/// The quantity that a single condition bounds. A quotient may be undefined, and then lies nowhere.
fn bound(expr: &Expr, rules: &Rules, this: Hand) -> Option<(String, [Interval; 2])> {
    if expr.ty.axis.is_some() {
        return None;
    }
    let (quantity, intervals) = match &expr.kind {
        ExprKind::Compare(comparison, a, b) => match (constant(a, rules), constant(b, rules)) {
            (None, Some(limit)) => (a, compared(*comparison, limit)?),
            (Some(limit), None) => (b, compared(comparison.swapped(), limit)?),
            _ => return None,
        },
        ExprKind::Hysteresis { value, on, off, rising: true } => {
            (value, [Interval::above(off.value, false), Interval::below(on.value, false)])
        }
        ExprKind::Hysteresis { value, on, off, rising: false } => {
            (value, [Interval::below(off.value, false), Interval::above(on.value, false)])
        }
        _ => return None,
    };
    let key = written(quantity, rules, this);
    let mut divides = false;
    quantity.walk(&mut |part| {
        divides |= matches!(part.kind, ExprKind::Arithmetic(crate::language::rules::Arithmetic::Divide, ..));
        // What a signal divides is not looked into.
        divides |= matches!(part.kind, ExprKind::Signal(..));
    });
    (!divides).then_some((key, intervals))
}

/// Where a quantity lies when it compares so with a limit, and when it does not.
fn compared(comparison: Comparison, limit: f64) -> Option<[Interval; 2]> {
    Some(match comparison {
        Comparison::Less => [Interval::below(limit, true), Interval::above(limit, false)],
        Comparison::LessEqual => [Interval::below(limit, false), Interval::above(limit, true)],
        Comparison::Greater => [Interval::above(limit, true), Interval::below(limit, false)],
        Comparison::GreaterEqual => [Interval::above(limit, false), Interval::below(limit, true)],
        Comparison::Equal | Comparison::NotEqual => return None,
    })
}

fn constant(expr: &Expr, rules: &Rules) -> Option<f64> {
    match &expr.kind {
        ExprKind::Number(number) => Some(*number),
        ExprKind::Param(id) => Some(rules.params[id.index()].value),
        ExprKind::Negate(inner) => constant(inner, rules).map(|number| -number),
        ExprKind::Arithmetic(operation, a, b) => Some(operation.apply(constant(a, rules)?, constant(b, rules)?)),
        _ => None,
    }
}

/// A state in which formulas come out as they were asked to.
#[derive(Clone, Debug, Default)]
pub struct Case {
    /// What holds and what does not, by key, with its text.
    atoms: BTreeMap<String, (String, bool)>,
    quantities: BTreeMap<String, Interval>,
    /// The leaves that may come before.
    pub before: BTreeSet<String>,
}

impl Case {
    /// What holds and what does not, as their authors wrote it.
    pub fn conditions(&self) -> impl Iterator<Item = (&str, bool)> {
        self.atoms.values().map(|(text, holds)| (text.as_str(), *holds))
    }

    fn assume(&mut self, atom: &Atom, holds: bool) -> bool {
        if let Some((_, known)) = self.atoms.get(&atom.key) {
            return *known == holds;
        }
        self.atoms.insert(atom.key.clone(), (atom.text.clone(), holds));
        let Some((quantity, [when, when_not])) = &atom.bound else { return true };
        let known = self.quantities.get(quantity).copied().unwrap_or(Interval::ALL);
        match known.with(if holds { *when } else { *when_not }) {
            Some(narrower) => {
                self.quantities.insert(quantity.clone(), narrower);
                true
            }
            None => false,
        }
    }
}

/// Whether formulas can come out as wanted.
pub enum Answer {
    /// Never.
    No,
    /// In this case.
    Yes(Case),
    /// It was too much work to find out.
    Perhaps,
}

/// Looks for a case in which each formula comes out as wanted, after one of the leaves `before`.
pub fn possible(wanted: &[(&Formula, bool)], before: BTreeSet<String>) -> Answer {
    let mut steps = 0;
    let case = Case { before, ..Case::default() };
    match search(wanted.iter().copied().rev().collect(), case, &mut steps) {
        Some(case) => Answer::Yes(case),
        None if steps > MAX_STEPS => Answer::Perhaps,
        None => Answer::No,
    }
}

fn search(mut open: Vec<(&Formula, bool)>, mut case: Case, steps: &mut usize) -> Option<Case> {
    loop {
        *steps += 1;
        if *steps > MAX_STEPS {
            return None;
        }
        let Some((formula, wanted)) = open.pop() else { return Some(case) };
        match (formula, wanted) {
            (Formula::Known(value), _) if *value == wanted => {}
            (Formula::Known(_), _) => return None,
            (Formula::Atom(atom), _) => {
                if !case.assume(atom, wanted) {
                    return None;
                }
            }
            (Formula::From(leaves), _) => {
                case.before.retain(|leaf| leaves.iter().any(|name| covers(name, leaf)) == wanted);
                if case.before.is_empty() {
                    return None;
                }
            }
            (Formula::Not(inner), _) => open.push((inner, !wanted)),
            (Formula::All(parts), true) | (Formula::Any(parts), false) => {
                open.extend(parts.iter().rev().map(|part| (part, wanted)));
            }
            (Formula::All(parts) | Formula::Any(parts), _) => {
                return parts.iter().find_map(|part| {
                    let mut open = open.clone();
                    open.push((part, wanted));
                    search(open, case.clone(), steps)
                });
            }
        }
    }
}

/// Whether a label as it is written in `from` stands for a leaf: one without a side for both.
fn covers(name: &str, leaf: &str) -> bool {
    name == leaf || leaf.split_once('(').is_some_and(|(bare, _)| bare == name)
}
