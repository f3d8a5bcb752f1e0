//! Conditions that never hold or always hold by themselves, wherever they stand.

use super::expressions;
use super::proof::Prover;
use crate::codes;
use crate::rules::{Expr, ExprKind, Rules};
use std::collections::BTreeSet;
use teachtree_base::diagnostic::{Diagnostic, Span};

/// Conditions in the `named` files that never or always hold, with the warnings; save choices that are `reported` already.
pub fn idle_conditions<'a>(rules: &'a Rules, named: &BTreeSet<u32>, reported: &[Span]) -> Vec<(&'a Expr, Diagnostic)> {
    let mut lint = Conditions { prover: Prover::new(rules), findings: Vec::new() };
    // All that may come before: a leaf of any primitive, none, or nothing that `from` can name.
    lint.prover.before =
        rules.label_names().chain(["none", "separate"].map(str::to_string)).collect::<BTreeSet<_>>().into();
    let within = |place: &Span, all: Span| place.file == all.file && all.start <= place.start && place.end <= all.end;
    for (condition, this) in expressions(rules) {
        let span = condition.span;
        if named.contains(&span.file) && !reported.iter().any(|place| within(place, span)) {
            lint.prover.this = this;
            lint.look(condition);
        }
    }
    lint.findings
}

struct Conditions<'a> {
    prover: Prover<'a>,
    findings: Vec<(&'a Expr, Diagnostic)>,
}

impl<'a> Conditions<'a> {
    /// Looks at a condition, and into it when there is nothing to say of the whole.
    fn look(&mut self, expr: &'a Expr) {
        let can_be = |wanted: bool| match expr.kind {
            // If each part always holds, the parts are reported instead of the whole.
            ExprKind::And(_) => wanted,
            ExprKind::Or(_) => !wanted,
            // One that always holds makes an array of what stands beside it (`rules/hand_holding.rules`).
            ExprKind::Compare(..) | ExprKind::Hysteresis { .. } => wanted,
            _ => false,
        };
        for wanted in [true, false] {
            if can_be(wanted) && self.reports(expr, wanted) {
                return;
            }
        }
        expr.arguments().into_iter().for_each(|argument| self.look(argument));
    }

    /// Reports a condition that never comes out so.
    fn reports(&mut self, expr: &'a Expr, wanted: bool) -> bool {
        let Some(requirement) = self.prover.requirement(expr, wanted) else { return false };
        if !self.prover.is_impossible(&[(&requirement.formula, wanted)]) {
            return false;
        }
        let finding = if wanted {
            Diagnostic::warning(codes::NEVER_HOLDS, "this condition never holds")
        } else {
            Diagnostic::warning(codes::ALWAYS_HOLDS, "this condition always holds")
        };
        let finding = self.prover.alone(finding, &requirement);
        let finding = match self.prover.reason(&[requirement]) {
            Some(reason) => finding.note(reason),
            None => finding,
        };
        let word = if wanted { "false" } else { "true" };
        self.findings.push((expr, finding.help(format!("correct it; if this is intended, write `{word}`"))));
        true
    }
}
