//! Expressions as canonical text, by which those of two rule sets are compared: names for ids, so that equal text means equal meaning as long as
//! the declarations of those names are equal too.

use crate::ops::Samples;
use crate::rules::{Expr, ExprKind, Hand, Label, Rules};
use std::fmt::Write;

/// An expression of a rule set, in a tree or declaration of `this`.
pub fn canonical_text(expr: &Expr, rules: &Rules, this: Hand) -> String {
    let mut text = String::new();
    write(expr, rules, this, &mut text);
    text
}

/// A label by name; one without a side stands for both.
pub fn label(label: Label, rules: &Rules) -> String {
    rules.label_name(label)
}

const fn whose(hand: Hand, this: Hand) -> &'static str {
    match hand.seen_from(this) {
        Hand::This => "",
        Hand::Other => "other",
        Hand::Named(side) => side.name(),
        Hand::Shared => "both",
    }
}

fn write(expr: &Expr, rules: &Rules, this: Hand, text: &mut String) {
    let _ = match &expr.kind {
        ExprKind::Bool(value) => write!(text, "{value}"),
        ExprKind::Number(number) => write!(text, "{number:e}"),
        ExprKind::Param(id) => write!(text, "param {}", rules.params[id.index()].name),
        ExprKind::Channel(id, hand) => {
            write!(text, "channel {}.{}", whose(*hand, this), rules.channels[id.index()].name)
        }
        ExprKind::Signal(id, hand) => write!(text, "signal {}.{}", whose(*hand, this), rules.signals[id.index()].name),
        ExprKind::Latch(id, hand) => write!(text, "latch {}.{}", whose(*hand, this), rules.latches[id.index()].name),
        ExprKind::Pick(_, pick) => write!(text, "pick {pick:?}"),
        ExprKind::Component(_, at) => write!(text, "component {at}"),
        ExprKind::Negate(_) => write!(text, "negate"),
        ExprKind::Arithmetic(operation, ..) => write!(text, "{operation:?}"),
        ExprKind::Compare(comparison, ..) => write!(text, "{comparison:?}"),
        ExprKind::Not(_) => write!(text, "not"),
        ExprKind::And(_) => write!(text, "and"),
        ExprKind::Or(_) => write!(text, "or"),
        ExprKind::Hysteresis { on, off, rising, .. } => {
            write!(text, "hysteresis {:e} {:e} {rising}", on.value, off.value)
        }
        ExprKind::Temporal(temporal, _) => {
            // The name of the variant where constants follow.
            let variant = format!("{temporal:?}");
            let constants = temporal.constants();
            let name = if constants.is_empty() { Some(temporal.name()) } else { variant.split(['(', ' ']).next() };
            text.push_str(name.unwrap_or_default());
            constants.into_iter().try_for_each(|constant| write!(text, " {:e}", constant.value))
        }
        ExprKind::Rate(_, duration) => write!(text, "rate {:e}", duration.value),
        ExprKind::Summary(summary, _, Samples::Last(duration)) => {
            write!(text, "{} over {:e}", summary.name(), duration.value)
        }
        ExprKind::Summary(summary, _, Samples::Since(_)) => write!(text, "{} since", summary.name()),
        ExprKind::Call(function, _) => write!(text, "{function:?}"),
        ExprKind::From { labels, none } => {
            let labels: Vec<String> = labels.iter().map(|one| label(*one, rules)).collect();
            write!(text, "from {} {none}", labels.join(" "))
        }
    };
    let arguments = expr.arguments();
    if !arguments.is_empty() {
        text.push('(');
        for argument in arguments {
            write(argument, rules, this, text);
            text.push(',');
        }
        text.push(')');
    }
}
