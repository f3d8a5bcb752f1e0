//! The durations of rules, and those that the usual rate cannot honor.

use super::expressions;
use crate::codes;
use crate::ops::{Operand, Samples};
use crate::rules::{Constant, Expr, ExprKind, LEAST_SAMPLES, Rules};
use std::collections::BTreeSet;
use teachtree_base::diagnostic::Diagnostic;

/// The rate at which demonstrations are usually recorded, Hz.
const USUAL_RATE_HZ: f64 = 1000.0;

/// Warns of durations of rules in the `named` files that are shorter than a sample.
pub fn short_durations(rules: &Rules, named: &BTreeSet<u32>) -> Vec<Diagnostic> {
    let is_short =
        |duration: &&Constant| duration.value * USUAL_RATE_HZ < LEAST_SAMPLES && named.contains(&duration.span.file);
    let finding = |duration: &Constant| {
        let message = format!("this is {} ms", duration.value * 1e3);
        Diagnostic::warning(codes::SHORT_DURATION, "this duration is shorter than a sample at 1 kHz")
            .at(duration.span, message)
            .note("logs whose samples are further apart than that are refused")
            .help("make it 1 ms or more; for the current sample alone write the condition without a window")
    };
    let of_segments = of_segments(rules);
    of_windows(rules).into_iter().chain(of_segments).filter(is_short).map(finding).collect()
}

/// The durations of windows in conditions and signals.
pub fn of_windows(rules: &Rules) -> Vec<&Constant> {
    let mut durations = Vec::new();
    expressions(rules).into_iter().for_each(|(expr, _)| windows(expr, &mut durations));
    durations
}

/// The durations of settling, tasks and relabeling. Those of tasks and relabeling may be zero, and are then left out.
pub fn of_segments(rules: &Rules) -> Vec<&Constant> {
    let settling = rules.trees.iter().filter_map(|tree| tree.settle.as_ref());
    let keys = rules.tasks.iter().flat_map(|task| &task.keys).filter_map(|key| key.lasting.as_ref());
    let limits = rules.relabels.iter().filter_map(|rule| rule.kind.shorter_time());
    settling.chain(keys.chain(limits).filter(|duration| duration.value > 0.0)).collect()
}

fn windows<'a>(expr: &'a Expr, durations: &mut Vec<&'a Constant>) {
    expr.walk(&mut |part| match &part.kind {
        ExprKind::Rate(_, duration) | ExprKind::Summary(_, _, Samples::Last(duration)) => durations.push(duration),
        ExprKind::Temporal(temporal, _) => {
            let constants = temporal.constants().into_iter().zip(temporal.kinds());
            durations.extend(constants.filter(|(_, kind)| *kind == Operand::Duration).map(|(constant, _)| constant));
        }
        _ => {}
    });
}
