//! `==` and `!=` between numbers: only between those that are counted or written, never measured.

use crate::codes;
use crate::ops::Summary;
use crate::resolve::Resolver;
use crate::rules::{Comparison, Expr, ExprKind, Function};
use teachtree_base::diagnostic::Diagnostic;

impl Resolver {
    /// Reports numbers that are asked to be equal though one of them is measured.
    pub(super) fn want_exact(&mut self, comparison: Comparison, left: &Expr, right: &Expr) -> Option<()> {
        if !matches!(comparison, Comparison::Equal | Comparison::NotEqual) {
            return Some(());
        }
        let Some(measured) = [left, right].into_iter().find(|side| !self.is_exact(side)) else {
            return Some(());
        };
        let message =
            if comparison == Comparison::Equal { "this hardly ever holds" } else { "this nearly always holds" };
        self.report(
            Diagnostic::error(
                codes::MEASURED_EQUALITY,
                format!("a measured number is never exactly another: {message}"),
            )
            .at(measured.span, "this is measured")
            .help("compare with `<` or `>`; `abs(a - b) < c` asks whether two numbers are near"),
        );
        None
    }

    /// Whether a number comes from constants and counts alone. (Of a signal it is known from its declaration.)
    pub fn is_exact(&self, expr: &Expr) -> bool {
        match &expr.kind {
            ExprKind::Number(_) | ExprKind::Param(_) | ExprKind::Call(Function::Count, _) => true,
            ExprKind::Signal(id, _) => self.exact_signals.contains(id),
            ExprKind::Negate(_)
            | ExprKind::Arithmetic(..)
            | ExprKind::Call(Function::Abs | Function::Min | Function::Max | Function::Sum, _) => {
                expr.arguments().into_iter().all(|argument| self.is_exact(argument))
            }
            ExprKind::Summary(Summary::Min | Summary::Max | Summary::Earliest, value, _) => self.is_exact(value),
            _ => false,
        }
    }
}
