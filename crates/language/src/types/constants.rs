//! Constants: thresholds and durations, computed from numbers and params.

use super::{Scope, describe};
use crate::codes;
use crate::resolve::Resolver;
use crate::rules::{Constant, Expr, ExprKind, MOST_TIMES, ParamId};
use crate::syntax;
use teachtree_base::channels::Shape;
use teachtree_base::diagnostic::{Diagnostic, Span};
use teachtree_base::short_number::ShortNumber;
use teachtree_base::units::Dimension;

/// Nothing is remembered or looked ahead for longer, s.
const LONGEST_S: f64 = 3600.0;

impl Resolver {
    /// A constant scalar, of this dimension when one is wanted.
    pub fn constant(&mut self, expr: &syntax::Expr, wanted: Option<Dimension>, scope: Scope) -> Option<Constant> {
        let checked = self.expr(expr, scope)?;
        if checked.ty.shape != Shape::Scalar || checked.ty.axis.is_some() {
            self.report(
                Diagnostic::error(codes::NOT_CONSTANT, "a constant number is expected here")
                    .at(checked.span, format!("this is {}", describe(checked.ty))),
            );
            return None;
        }
        if let Some(wanted) = wanted.filter(|wanted| *wanted != checked.ty.dimension) {
            let finding = Diagnostic::error(codes::WRONG_TYPE, format!("{wanted} is expected here"))
                .at(checked.span, format!("this is {}", describe(checked.ty)));
            let bare = expr.is_bare_number();
            self.report(if bare { self.with_units(finding, checked.span, wanted) } else { finding });
            return None;
        }
        let mut params = Vec::new();
        let value = self.value(&checked, &mut params)?;
        if !value.is_finite() {
            self.report(
                Diagnostic::error(codes::OUT_OF_RANGE, "this constant is not finite")
                    .at(checked.span, "it is divided by zero, or too large"),
            );
            return None;
        }
        params.sort_unstable();
        params.dedup();
        Some(Constant { value, dimension: checked.ty.dimension, params, span: expr.span })
    }

    /// A threshold for `value`.
    pub(super) fn threshold(&mut self, value: &Expr, expr: &syntax::Expr, scope: Scope) -> Option<Constant> {
        let constant = self.constant(expr, None, scope)?;
        if constant.dimension == value.ty.dimension {
            return Some(constant);
        }
        let (one, two) = (super::element(value.ty), super::element(super::scalar(constant.dimension)));
        let finding = Diagnostic::error(codes::COMPARED_KINDS, format!("cannot compare {one} with {two}"))
            .at(expr.span, format!("this is {}", constant.dimension))
            .at(value.span, format!("this is {}", describe(value.ty)));
        let bare = expr.is_bare_number();
        self.report(if bare { self.with_units(finding, expr.span, value.ty.dimension) } else { finding });
        None
    }

    /// Gives examples for a number that has no unit. Not a fix: only the author knows the intended unit.
    pub fn with_units(&self, finding: Diagnostic, number: Span, wanted: Dimension) -> Diagnostic {
        let number = self.rules.sources.text(number).trim_matches(['(', ')', ' ']);
        let examples: Vec<String> = example_units(wanted).iter().map(|unit| format!("`{number} {unit}`")).collect();
        finding.help(format!("write the unit, such as {}", examples.join(" or ")))
    }

    /// Reports thresholds of a hysteresis that leave no band, or one the wrong way round.
    pub fn threshold_order(&mut self, on: &Constant, off: &Constant, rising: bool) -> Option<()> {
        let in_order = if rising { off.value <= on.value } else { off.value >= on.value };
        if in_order {
            return Some(());
        }
        let (begin, until) = if rising { ("above", "below") } else { ("below", "above") };
        let message = if rising { "at least" } else { "at most" };
        self.report(
            Diagnostic::error(codes::THRESHOLD_ORDER, "the thresholds are in the wrong order")
                .at(off.span, format!("it ends {until} this, {} {}", off.value, off.dimension.si_unit()))
                .at(on.span, format!("it begins {begin} this, {} {}", on.value, on.dimension.si_unit()))
                .help(format!("in `{begin} a until {until} b`, `a` is {message} `b`")),
        );
        None
    }

    /// Reports a duration that is not a time ahead, or longer than what is remembered.
    pub fn want_duration(&mut self, duration: &Constant) -> Option<()> {
        let wanted = match duration.value {
            short if short <= 0.0 => "a duration is greater than 0",
            long if long > LONGEST_S => "a duration is at most an hour",
            _ => return Some(()),
        };
        self.report(
            Diagnostic::error(codes::OUT_OF_RANGE, wanted)
                .at(duration.span, format!("this is {} s", ShortNumber(duration.value))),
        );
        None
    }

    /// Reports a number of times that is none, or more than is counted. What is written as a number is a whole one; what is computed from params is
    /// rounded up when the rules are run.
    pub fn want_times(&mut self, times: &Constant) -> Option<()> {
        let wanted = match times.value {
            few if few <= 0.0 => "expected a count of 1 or more",
            many if many > MOST_TIMES => "expected a count of 1000 or less",
            part if part.fract() != 0.0 && times.params.is_empty() => "a whole number is expected here",
            _ => return Some(()),
        };
        self.report(
            Diagnostic::error(codes::OUT_OF_RANGE, wanted)
                .at(times.span, format!("this is {}", ShortNumber(times.value))),
        );
        None
    }

    fn value(&mut self, expr: &Expr, params: &mut Vec<ParamId>) -> Option<f64> {
        Some(match &expr.kind {
            ExprKind::Number(value) => *value,
            ExprKind::Param(id) => {
                params.push(*id);
                self.param_value(*id)?.value
            }
            ExprKind::Negate(inner) => -self.value(inner, params)?,
            ExprKind::Arithmetic(operation, left, right) => {
                let (left, right) = (self.value(left, params)?, self.value(right, params)?);
                operation.apply(left, right)
            }
            _ => {
                self.report(
                    Diagnostic::error(codes::NOT_CONSTANT, "a constant is expected here")
                        .at(expr.span, "this changes from frame to frame")
                        .help("only numbers and params are constant"),
                );
                return None;
            }
        })
    }
}

/// Units in which quantities of this dimension are usually written, the likeliest first.
fn example_units(dimension: Dimension) -> Vec<String> {
    let units: &[&str] = match dimension {
        Dimension::LENGTH => &["mm", "m"],
        Dimension::MASS => &["g", "kg"],
        Dimension::TIME => &["ms", "s"],
        Dimension::ANGLE => &["deg", "rad"],
        Dimension::SPEED => &["mm/s", "m/s"],
        Dimension::ACCELERATION => &["mm/s^2", "m/s^2"],
        Dimension::ANGULAR_SPEED => &["deg/s", "rad/s"],
        Dimension::FORCE => &["N", "mN"],
        _ => return vec![dimension.si_unit()],
    };
    units.iter().map(ToString::to_string).collect()
}
