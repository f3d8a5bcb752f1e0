//! What a piece has to be, and which arrays go together.

use super::{describe, scalar};
use crate::codes;
use crate::ops::Samples;
use crate::resolve::Resolver;
use crate::rules::{Expr, ExprKind, Hand, Type};
use crate::syntax;
use crate::types::Scope;
use teachtree_base::channels::{Axis, Shape};
use teachtree_base::diagnostic::{Diagnostic, Span};
use teachtree_base::hands::{Finger, FingerPick};

impl Resolver {
    /// Reports when an expression does not have this shape; `who` says what takes it.
    pub(super) fn want(&mut self, expr: &Expr, shape: Shape, who: &str) -> Option<()> {
        if expr.ty.shape == shape {
            return Some(());
        }
        let wanted = match shape {
            Shape::Bool => "a condition",
            Shape::Scalar => "a number",
            Shape::Vec3 => "a vec3",
            Shape::Rotation => "a rotation",
            Shape::Object => "an object",
        };
        let finding = Diagnostic::error(codes::WRONG_TYPE, format!("{who} {wanted}"))
            .at(expr.span, format!("this is {}", describe(expr.ty)));
        self.report(match (shape, expr.ty.shape) {
            (Shape::Scalar, Shape::Vec3) => {
                finding.help("`norm(v)` is the length of a vec3, `v.z` its component upwards")
            }
            (Shape::Bool, Shape::Scalar) => finding.help("compare it with a threshold, such as `> 0.05 N`"),
            (Shape::Scalar, Shape::Bool) => finding.help("`count(c)` returns how many conditions of an array hold"),
            _ => finding,
        });
        None
    }

    pub(super) fn want_bool(&mut self, expr: &Expr, who: &str) -> Option<()> {
        self.want(expr, Shape::Bool, who)
    }

    /// A scalar or a vec3.
    pub(super) fn want_number(&mut self, expr: &Expr, who: &str) -> Option<()> {
        if expr.ty.shape == Shape::Vec3 { Some(()) } else { self.want(expr, Shape::Scalar, who) }
    }

    /// Reports when an expression is not an array.
    pub(super) fn want_array(&mut self, expr: &Expr, function: &str) -> Option<()> {
        if expr.ty.axis.is_some() {
            return Some(());
        }
        self.report(
            Diagnostic::error(codes::WRONG_TYPE, format!("`{function}` takes an array over fingers or contacts"))
                .at(expr.span, format!("this is {}", describe(expr.ty))),
        );
        None
    }

    /// The axis of two operands together: a single value beside an array is used for every element.
    pub(super) fn merged(&mut self, left: &Expr, right: &Expr) -> Option<Option<(Axis, Hand)>> {
        if left.ty.axis.is_some() && right.ty.axis.is_some() {
            self.same_slots(left, right)?;
        }
        Some(left.ty.axis.or(right.ty.axis))
    }

    /// Reports when two arrays do not run over the same slots.
    pub(super) fn same_slots(&mut self, left: &Expr, right: &Expr) -> Option<()> {
        let (one, two) = (self.slots(left), self.slots(right));
        if left.ty.axis == right.ty.axis && self.picked(left) == self.picked(right) {
            return Some(());
        }
        self.report(
            Diagnostic::error(codes::DIFFERENT_ARRAYS, "these arrays do not run over the same slots")
                .at(right.span, format!("this runs over {two}"))
                .at(left.span, format!("this runs over {one}"))
                .help("reduce one of them with `any`, `all`, `sum`, `mean`, `min` or `max`"),
        );
        None
    }

    /// `the fingers of the left hand`
    fn slots(&self, expr: &Expr) -> String {
        let Some((axis, hand)) = expr.ty.axis else {
            return "nothing".to_string();
        };
        let what = match (axis, self.picked(expr)) {
            (Axis::Contacts, _) => "contacts",
            (Axis::Fingers, None) => "fingers",
            (Axis::Fingers, Some(FingerPick::Opposing)) => "opposing fingers",
            (Axis::Fingers, Some(_)) => "fingertips",
        };
        match hand {
            Hand::Named(side) => format!("the {what} of the {side} hand"),
            Hand::Other => format!("the {what} of the other hand"),
            Hand::This | Hand::Shared => format!("the {what} of this hand"),
        }
    }

    /// Which fingers an array over fingers is picked to; `None` for all slots.
    pub fn picked(&self, expr: &Expr) -> Option<FingerPick> {
        expr.ty.axis?;
        match &expr.kind {
            ExprKind::Pick(_, pick) => Some(*pick),
            ExprKind::Signal(id, _) => self.signal_picks.get(id.index()).copied().flatten(),
            ExprKind::Component(inner, _)
            | ExprKind::Negate(inner)
            | ExprKind::Not(inner)
            | ExprKind::Hysteresis { value: inner, .. }
            | ExprKind::Temporal(_, inner)
            | ExprKind::Rate(inner, _)
            | ExprKind::Summary(_, inner, Samples::Last(_)) => self.picked(inner),
            ExprKind::Arithmetic(_, left, right)
            | ExprKind::Compare(_, left, right)
            | ExprKind::Summary(_, left, Samples::Since(right)) => self.picked(left).or_else(|| self.picked(right)),
            ExprKind::And(parts) | ExprKind::Or(parts) | ExprKind::Call(_, parts) => {
                parts.iter().find_map(|part| self.picked(part))
            }
            ExprKind::Bool(_)
            | ExprKind::Number(_)
            | ExprKind::Param(_)
            | ExprKind::Channel(..)
            | ExprKind::Latch(..)
            | ExprKind::From { .. } => None,
        }
    }

    /// `touches[thumb]`, `touches[opposing]`
    pub(super) fn pick(&mut self, inner: &syntax::Expr, name: &syntax::Name, span: Span, scope: Scope) -> Option<Expr> {
        let inner = self.expr(inner, scope)?;
        let pick = match name.text.as_str() {
            "opposing" => FingerPick::Opposing,
            "tips" => FingerPick::Tips,
            finger => match Finger::from_name(finger) {
                Some(finger) => FingerPick::One(finger),
                None => {
                    self.unknown("finger", finger, name.span, |_| {
                        let fingers = Finger::ALL.into_iter().map(Finger::name);
                        fingers.chain(["opposing", "tips"]).map(str::to_string).collect()
                    });
                    return None;
                }
            },
        };
        if !matches!(inner.ty.axis, Some((Axis::Fingers, _))) {
            self.report(
                Diagnostic::error(codes::NO_COMPONENT, format!("`[{}]` picks from an array over fingers", name.text))
                    .at(inner.span, format!("this is {}", describe(inner.ty))),
            );
            return None;
        }
        if self.picked(&inner).is_some() {
            self.report(
                Diagnostic::error(codes::NO_COMPONENT, "fingers are picked only once")
                    .at(name.span, "picked again")
                    .at(inner.span, "picked already"),
            );
            return None;
        }
        let axis = if matches!(pick, FingerPick::One(_)) { None } else { inner.ty.axis };
        let ty = Type { axis, ..inner.ty };
        Some(Expr { kind: ExprKind::Pick(Box::new(inner), pick), ty, span })
    }

    /// `.x`, `.y`, `.z`
    pub(super) fn component(&mut self, inner: Expr, name: &syntax::Name, span: Span) -> Option<Expr> {
        let component = match name.text.as_str() {
            "x" => Some(0),
            "y" => Some(1),
            "z" => Some(2),
            _ => None,
        };
        match component {
            Some(component) if inner.ty.shape == Shape::Vec3 => {
                let ty = Type { axis: inner.ty.axis, ..scalar(inner.ty.dimension) };
                Some(Expr { kind: ExprKind::Component(Box::new(inner), component), ty, span })
            }
            _ => {
                let finding = Diagnostic::error(codes::NO_COMPONENT, format!("this has no component `{}`", name.text))
                    .at(name.span, "there is no such component")
                    .at(inner.span, format!("this is {}", describe(inner.ty)));
                let fingers = matches!(inner.ty.axis, Some((Axis::Fingers, _)));
                self.report(if fingers && Finger::from_name(&name.text).is_some() {
                    finding.help(format!("write `[{}]` to pick a finger", name.text))
                } else if inner.ty.shape == Shape::Vec3 {
                    finding.help("a vec3 has `.x`, `.y` and `.z`")
                } else {
                    finding
                });
                None
            }
        }
    }
}
