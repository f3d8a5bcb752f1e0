//! Durations that the usual rate cannot honour.

use super::expressions;
use crate::base::diagnostic::Diagnostic;
use crate::language::codes;
use crate::language::ops::Takes;
use crate::language::rules::{Constant, Expr, ExprKind, LEAST_SAMPLES, RelabelKind, Rules};
use std::collections::BTreeSet;

/// The rate at which demonstrations are usually recorded, Hz.
const USUAL_RATE_HZ: f64 = 1000.0;

/// Warns of windows, settlings and durations of tasks and relabelling rules in the `named` files that are shorter than a sample.
pub fn short_durations(rules: &Rules, named: &BTreeSet<u32>) -> Vec<Diagnostic> {
    let mut durations: Vec<&Constant> = Vec::new();
    expressions(rules).into_iter().for_each(|(expr, _)| windows(expr, &mut durations));
    durations.extend(rules.trees.iter().filter_map(|tree| tree.settle.as_ref()));
    // What is asked of segments may be nothing; no window may.
    let asked = rules.tasks.iter().flat_map(|task| &task.keys).filter_map(|key| key.lasting.as_ref());
    let limits = rules.relabels.iter().filter_map(|rule| match &rule.kind {
        RelabelKind::Between { shorter, .. } | RelabelKind::BetweenInHands { shorter, .. } => shorter.as_ref(),
        RelabelKind::Become { .. } | RelabelKind::Sequence { .. } | RelabelKind::Separate { .. } => None,
    });
    durations.extend(asked.chain(limits).filter(|duration| duration.value > 0.0));
    let short =
        |duration: &&&Constant| duration.value * USUAL_RATE_HZ < LEAST_SAMPLES && named.contains(&duration.span.file);
    let finding = |duration: &Constant| {
        let told = format!("this is {} ms", duration.value * 1e3);
        Diagnostic::warning(codes::SHORT_DURATION, "this duration is shorter than a sample at 1 kHz")
            .at(duration.span, told)
            .note("logs whose samples are further apart than that are refused")
            .help("make it 1 ms or more; for the current sample alone write the condition without a window")
    };
    durations.iter().filter(short).map(|duration| finding(duration)).collect()
}

fn windows<'a>(expr: &'a Expr, durations: &mut Vec<&'a Constant>) {
    expr.walk(&mut |part| match &part.kind {
        ExprKind::Rate(_, duration) => durations.push(duration),
        ExprKind::Temporal(temporal, _) => {
            let constants = temporal.constants().into_iter().zip(temporal.kinds());
            durations.extend(constants.filter(|(_, kind)| *kind == Takes::Duration).map(|(constant, _)| constant));
        }
        _ => {}
    });
}
