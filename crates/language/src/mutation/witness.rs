//! The kind of recording on which a mutant gives other labels: the required events, and the primitives that depend on them.

use super::Mutant;
use crate::formula::shown;
use crate::ops::{Samples, TemporalOperator};
use crate::rules::{Branch, Consequent, Constant, Expr, ExprKind, Label, LatchId, Rules, SignalId};
use std::collections::BTreeSet;

/// The most primitives that are named.
const NAMED: usize = 3;

/// Describes a recording that would notice a mutant of these rules: `a recording with Hold in which …`.
pub fn witness(rules: &Rules, mutant: &Mutant) -> Option<String> {
    let changed = changed(rules, mutant)?;
    let event = event(rules, changed, mutant.what)?;
    let labels = labels_of(rules, changed);
    let names: BTreeSet<String> = labels.into_iter().map(|label| rules.label_name(label)).collect();
    let names: Vec<String> = names.into_iter().collect();
    let with = match names.as_slice() {
        [one] => format!(" with {one}"),
        [others @ .., last] if names.len() <= NAMED => format!(" with {} or {last}", others.join(", ")),
        _ => String::new(),
    };
    Some(format!("a recording{with} in which {event}"))
}

/// The expression that a mutant changes.
fn changed<'r>(rules: &'r Rules, mutant: &Mutant) -> Option<&'r Expr> {
    let mut found = None;
    let mut look = |expr: &'r Expr| {
        let is_kind = match &expr.kind {
            ExprKind::Compare(..) => mutant.what == super::TURNED,
            ExprKind::Hysteresis { .. } => matches!(mutant.what, super::DOUBLED | super::HALVED),
            ExprKind::Temporal(..) | ExprKind::Rate(..) | ExprKind::Summary(..) => {
                matches!(mutant.what, super::LONGER | super::MORE_OFTEN)
            }
            _ => false,
        };
        if is_kind && expr.span == mutant.span {
            found = Some(expr);
        }
    };
    let latches = rules.latches.iter().flat_map(|latch| [&latch.set, &latch.clear]);
    rules.signals.iter().map(|signal| &signal.expr).chain(latches).for_each(|expr| expr.walk(&mut look));
    for tree in &rules.trees {
        for_each_condition(&tree.root, &mut |condition, _| condition.walk(&mut look));
    }
    found
}

/// The conditions under which a change of this expression has an effect.
fn event(rules: &Rules, expr: &Expr, what: &str) -> Option<String> {
    let text = |expr: &Expr| format!("`{}`", without_parentheses(&rules.text_of(expr)));
    let value = |constant: &Constant, factor: f64| shown(constant.value * factor, constant.dimension);
    let span = |constant: &Constant| format!("{} to {}", value(constant, 1.0), value(constant, 2.0));
    Some(match &expr.kind {
        ExprKind::Compare(..) => format!("{} holds for a while and fails for a while", text(expr)),
        ExprKind::Hysteresis { value: of, on, .. } => {
            let (from, to) = if what == super::DOUBLED { (1.0, 2.0) } else { (0.5, 1.0) };
            format!("{} peaks or settles between {} and {}", text(of), value(on, from), value(on, to))
        }
        ExprKind::Temporal(temporal, of) => {
            let of = text(of);
            match temporal {
                TemporalOperator::For(time) | TemporalOperator::Lasting(time) => {
                    format!("{of} holds for {}", span(time))
                }
                TemporalOperator::WithinLast(time) => format!("{of} was last true {} before", span(time)),
                TemporalOperator::WithinNext(time) => format!("{of} becomes true {} later", span(time)),
                TemporalOperator::Bridging(time) => format!("{of} is lost for {}", span(time)),
                TemporalOperator::AtLeast { times, within } if what == super::MORE_OFTEN => {
                    format!("{of} begins {} times within {}, and no more", times.value, value(within, 1.0))
                }
                TemporalOperator::AtLeast { times, within } => {
                    format!("{of} begins {} times within {}", times.value, span(within))
                }
                TemporalOperator::Rises | TemporalOperator::Falls => return None,
            }
        }
        ExprKind::Rate(of, time) | ExprKind::Summary(_, of, Samples::Last(time)) => {
            format!("{} changes within {}", text(of), span(time))
        }
        _ => return None,
    })
}

/// A text without the parentheses around all of it.
fn without_parentheses(text: &str) -> &str {
    let Some(inner) = text.strip_prefix('(').and_then(|rest| rest.strip_suffix(')')) else { return text };
    let mut open = 0_i32;
    let is_whole = inner.chars().all(|letter| {
        open += i32::from(letter == '(') - i32::from(letter == ')');
        open >= 0
    });
    if is_whole { inner } else { text }
}

/// The primitives at the choices that depend on an expression, also through signals and latches.
fn labels_of(rules: &Rules, changed: &Expr) -> BTreeSet<Label> {
    let (mut signals, mut latches) = (BTreeSet::<SignalId>::new(), BTreeSet::<LatchId>::new());
    let depends = |expr: &Expr, signals: &BTreeSet<SignalId>, latches: &BTreeSet<LatchId>| {
        let mut depends = false;
        expr.walk(&mut |part| {
            depends |= match &part.kind {
                ExprKind::Signal(id, _) => signals.contains(id),
                ExprKind::Latch(id, _) => latches.contains(id),
                _ => std::ptr::eq(part, changed),
            };
        });
        depends
    };
    // Signals read earlier signals, latches read signals and earlier latches.
    for (at, signal) in (0_u32..).zip(&rules.signals) {
        if depends(&signal.expr, &signals, &latches) {
            signals.insert(SignalId(at));
        }
    }
    for (at, latch) in (0_u32..).zip(&rules.latches) {
        if depends(&latch.set, &signals, &latches) || depends(&latch.clear, &signals, &latches) {
            latches.insert(LatchId(at));
        }
    }
    let mut labels = BTreeSet::new();
    for tree in &rules.trees {
        for_each_condition(&tree.root, &mut |condition, then| {
            if depends(condition, &signals, &latches) {
                leaves(then, &mut labels);
            }
        });
    }
    labels
}

/// Calls `visit` for each condition of a branch and of those below it, with what follows.
fn for_each_condition<'r>(branch: &'r Branch, visit: &mut dyn FnMut(&'r Expr, &'r Consequent)) {
    for choice in &branch.choices {
        choice.condition.iter().for_each(|condition| visit(condition, &choice.then));
        if let Consequent::Branch(below) = &choice.then {
            for_each_condition(below, visit);
        }
    }
}

fn leaves(then: &Consequent, labels: &mut BTreeSet<Label>) {
    match then {
        Consequent::Primitive(label) => {
            labels.insert(*label);
        }
        Consequent::Stay | Consequent::Separate => {}
        Consequent::Branch(below) => below.choices.iter().for_each(|choice| leaves(&choice.then, labels)),
    }
}
