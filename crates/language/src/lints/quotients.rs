//! Quotients whose divisor is zero.

use super::expressions;
use crate::codes;
use crate::formula::Reader;
use crate::rules::{Arithmetic, ExprKind, Rules};
use std::collections::BTreeSet;
use teachtree_base::diagnostic::Diagnostic;

/// Warns of divisions in the `named` files by a constant that is zero.
pub fn zero_divisors(rules: &Rules, named: &BTreeSet<u32>) -> Vec<Diagnostic> {
    let reader = Reader::new(rules);
    let mut findings = Vec::new();
    for (expr, _) in expressions(rules).into_iter().filter(|(expr, _)| named.contains(&expr.span.file)) {
        expr.walk(&mut |part| {
            let ExprKind::Arithmetic(Arithmetic::Divide, _, divisor) = &part.kind else { return };
            if reader.constant(divisor).is_some_and(|divisor| divisor.abs() <= 0.0) {
                findings.push(
                    Diagnostic::warning(codes::ZERO_DIVISOR, "this divides by zero")
                        .at(divisor.span, "this is 0")
                        .note("the result is infinite or NaN; NaN is neither above nor below any threshold")
                        .help("divide by something else"),
                );
            }
        });
    }
    findings
}
