//! The graph as text: one value or test a line, in order, without hashes.

use super::{Graph, Leaf, Op, Target, Value, ValueId};
use crate::ops::{Operand, of_function};
use crate::rules::{Arithmetic, Comparison, Hand, TreeScope};
use std::fmt::Write;
use teachtree_base::hands::{FingerPick, Side};
use teachtree_base::units::Dimension;

/// The whole graph: values, latches, trees.
pub fn text(graph: &Graph) -> String {
    let mut out = String::new();
    for (value, at) in graph.values.iter().zip(0..) {
        let _ = writeln!(out, "v{at:<4} {}", show(graph, value));
    }
    for latch in &graph.latches {
        let (set, clear) = (latch.set.0, latch.clear.0);
        let each = if latch.per_hand { " for each hand" } else { "" };
        let _ = writeln!(out, "latch {}{each}: set v{set} clear v{clear}", latch.name);
    }
    for tree in &graph.trees {
        let scope = match tree.scope {
            TreeScope::EachHand => "for each hand",
            TreeScope::BothHands => "for both hands",
        };
        let settle = millis(tree.settle_s);
        let _ =
            writeln!(out, "tree {} {scope}, settle {settle}: start {}", tree.name, target(graph, tree.decision.root));
        for (at, test) in tree.decision.tests.iter().enumerate().rev() {
            let asked = show(graph, graph.value(test.condition));
            let (yes, no) = (target(graph, test.yes), target(graph, test.no));
            let _ = writeln!(out, "  {at:<4} v{:<4} {asked}   yes {yes}   no {no}", test.condition.0);
        }
    }
    out
}

fn target(graph: &Graph, target: Target) -> String {
    match target {
        Target::Test(at) => at.to_string(),
        Target::Leaf(Leaf::Primitive(label)) => graph.label_name(label).to_string(),
        Target::Leaf(Leaf::Stay) => "stay".into(),
        Target::Leaf(Leaf::Separate) => "separate".into(),
    }
}

fn millis(seconds: f64) -> String {
    format!("{} ms", round(seconds * 1e3))
}

/// At most nine significant decimals, as short as they can be.
fn round(number: f64) -> f64 {
    let scaled = (number * 1e9).round() / 1e9;
    if scaled.is_finite() { scaled + 0.0 } else { number }
}

const fn hand(hand: Hand) -> &'static str {
    match hand {
        Hand::This | Hand::Shared => "",
        Hand::Other => "other.",
        Hand::Named(Side::Left) => "left.",
        Hand::Named(Side::Right) => "right.",
    }
}

fn number(number: f64, dimension: Dimension) -> String {
    let unit = dimension.si_unit();
    let number = round(number);
    if unit.is_empty() { number.to_string() } else { format!("{number} {unit}") }
}

fn show(graph: &Graph, value: &Value) -> String {
    let args: Vec<String> = value.args.iter().map(|id| format!("v{}", id.0)).collect();
    let first = args.first().map_or("", String::as_str);
    let dimension = |id: Option<&ValueId>| id.map_or(Dimension::NONE, |id| graph.value(*id).ty.dimension);
    match &value.op {
        Op::Bool(bool) => bool.to_string(),
        Op::Number(exact) => number(exact.get(), value.ty.dimension),
        Op::Channel(channel, whose) => {
            let name = graph.channels.get(channel.index()).map_or("?", |channel| channel.name.as_str());
            format!("{}{name}", hand(*whose))
        }
        Op::Latch(latch, whose) => {
            let name = graph.latches.get(latch.index()).map_or("?", |latch| latch.name.as_str());
            format!("{}{name}", hand(*whose))
        }
        Op::From { labels, none, .. } => {
            let names: Vec<&str> =
                none.then_some("none").into_iter().chain(labels.iter().map(|label| graph.label_name(*label))).collect();
            format!("from({})", names.join(", "))
        }
        Op::Pick(FingerPick::One(finger)) => format!("{first}[{finger}]"),
        Op::Pick(FingerPick::Opposing) => format!("{first}[opposing]"),
        Op::Pick(FingerPick::Tips) => format!("{first}[tips]"),
        Op::Component(at) => format!("{first}.{}", ["x", "y", "z"].get(usize::from(*at)).unwrap_or(&"?")),
        Op::Negate => format!("-{first}"),
        Op::Arithmetic(operation) => args.join(match operation {
            Arithmetic::Add => " + ",
            Arithmetic::Subtract => " - ",
            Arithmetic::Multiply => " * ",
            Arithmetic::Divide => " / ",
        }),
        Op::Compare(comparison) => args.join(match comparison {
            Comparison::Less => " < ",
            Comparison::LessEqual => " <= ",
            Comparison::Greater => " > ",
            Comparison::GreaterEqual => " >= ",
            Comparison::Equal => " == ",
            Comparison::NotEqual => " != ",
        }),
        Op::Not => format!("not {first}"),
        Op::And => args.join(" and "),
        Op::Or => args.join(" or "),
        Op::Hysteresis { on, off, rising } => {
            let dimension = dimension(value.args.first());
            let (on, off) = (number(on.get(), dimension), number(off.get(), dimension));
            let (up, down) = if *rising { ("above", "below") } else { ("below", "above") };
            format!("{first} {up} {on} until {down} {off}")
        }
        Op::Temporal(temporal) => temporal.written(first, |constant, kind| match kind {
            Operand::Times => round(constant.get()).to_string(),
            _ => millis(constant.get()),
        }),
        Op::Rate(duration) => format!("rate({first}, {})", millis(duration.get())),
        Op::Summary(summary, Some(duration)) => {
            format!("{}({first} over last {})", summary.name(), millis(duration.get()))
        }
        Op::Summary(summary, None) => {
            format!("{}({first} since {})", summary.name(), args.get(1).map_or("?", String::as_str))
        }
        Op::Call(function) => format!("{}({})", of_function(*function).name, args.join(", ")),
    }
}
