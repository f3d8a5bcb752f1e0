//! Functions: how many arguments they take, of which types, and what they give.

use super::{Scope, describe, scalar};
use crate::base::channels::Shape;
use crate::base::diagnostic::{Diagnostic, Span};
use crate::base::hands::Side;
use crate::base::units::Dimension;
use crate::language::codes;
use crate::language::resolve::Resolver;
use crate::language::rules::{Expr, ExprKind, Function, Type};
use crate::language::syntax::{self, ExprKind as Syntax, Path};

/// A function as it is called, and what it gives.
pub struct Signature {
    /// Its name, which is reserved.
    pub name: &'static str,
    /// How it may be written.
    pub calls: &'static [&'static str],
    /// What it gives.
    pub doc: &'static str,
}

const fn function(name: &'static str, calls: &'static [&'static str], doc: &'static str) -> Signature {
    Signature { name, calls, doc }
}

/// The functions.
pub const FUNCTIONS: &[Signature] = &[
    function("abs", &["abs(x)"], "the size of a number, without its sign"),
    function("all", &["all(conditions)"], "whether every one of an array of conditions holds"),
    function("any", &["any(conditions)"], "whether one of an array of conditions holds"),
    function("count", &["count(conditions)"], "how many of an array of conditions hold"),
    function("dot", &["dot(a, b)"], "the scalar product of two vec3"),
    function("falls", &["falls(condition)"], "true on the frame on which the condition ceases to hold"),
    function(
        "in_contact",
        &["in_contact(left.target, right.target)"],
        "whether the two hands' targets touch each other",
    ),
    function("max", &["max(array)", "max(a, b)"], "the largest of an array, or of two numbers"),
    function(
        "mean",
        &["mean(array)"],
        "the sum of an array divided by the number of its elements; zero when it has none",
    ),
    function("min", &["min(array)", "min(a, b)"], "the smallest of an array, or of two numbers"),
    function("norm", &["norm(v)"], "the length of a vec3"),
    function(
        "rate",
        &["rate(x, 100 ms)"],
        "how fast a number changes: its difference over the time, divided by the time",
    ),
    function("rises", &["rises(condition)"], "true on the frame on which the condition begins to hold"),
    function(
        "squeeze_of",
        &["squeeze_of(left.fingers, right.fingers)"],
        "the force with which both hands press an object between them",
    ),
    function("sum", &["sum(array)"], "the sum of an array; zero when it has no elements"),
    function(
        "tangential",
        &["tangential(v, contacts.normal)"],
        "the part of a vec3 that is at right angles to a direction",
    ),
];

/// The function with this name.
pub fn signature(name: &str) -> Option<&'static Signature> {
    FUNCTIONS.iter().find(|function| function.name == name)
}

impl Resolver {
    /// `norm(x)`
    pub(super) fn call(&mut self, path: &Path, arguments: &[syntax::Expr], span: Span, scope: Scope) -> Option<Expr> {
        let name = path.text();
        let name = name.as_str();
        let Some(signature) = signature(name) else {
            self.unknown_function(path);
            return None;
        };
        let counts: &[usize] = match name {
            "dot" | "tangential" | "rate" | "squeeze_of" | "in_contact" => &[2],
            "min" | "max" => &[1, 2],
            _ => &[1],
        };
        if !counts.contains(&arguments.len()) {
            let wanted = match counts {
                [1] => "one argument",
                [2] => "two arguments",
                _ => "one or two arguments",
            };
            self.report(
                Diagnostic::error(codes::WRONG_COUNT, format!("`{name}` takes {wanted}"))
                    .at(span, format!("{} given", arguments.len()))
                    .help(format!("write `{}`", signature.calls.join("`, or `"))),
            );
            return None;
        }
        match (name, arguments) {
            ("rate", [value, duration]) => self.rate(value, duration, span, scope),
            ("squeeze_of", [one, two]) => self.squeeze_of(one, two, span, scope),
            ("in_contact", [one, two]) => self.in_contact(one, two, span, scope),
            ("rises" | "falls", [condition]) => {
                let condition = self.expr(condition, scope)?;
                self.want_bool(&condition, &format!("`{name}` watches"))?;
                let ty = condition.ty;
                let condition = Box::new(condition);
                let kind = if name == "rises" { ExprKind::Rises(condition) } else { ExprKind::Falls(condition) };
                Some(Expr { kind, ty, span })
            }
            _ => {
                let read: Vec<Option<Expr>> = arguments.iter().map(|argument| self.expr(argument, scope)).collect();
                let arguments = read.into_iter().collect::<Option<Vec<Expr>>>()?;
                let (function, ty) = self.plain(name, &arguments)?;
                Some(Expr { kind: ExprKind::Call(function, arguments), ty, span })
            }
        }
    }

    /// A function of its arguments on one frame.
    fn plain(&mut self, name: &str, arguments: &[Expr]) -> Option<(Function, Type)> {
        let takes = format!("`{name}` takes");
        let first = arguments.first()?;
        let reduced = Type { axis: None, ..first.ty };
        match (name, arguments) {
            ("abs", [x]) => {
                self.want(x, Shape::Scalar, &takes)?;
                Some((Function::Abs, x.ty))
            }
            ("norm", [v]) => {
                self.want(v, Shape::Vec3, &takes)?;
                Some((Function::Norm, Type { shape: Shape::Scalar, ..v.ty }))
            }
            ("dot", [a, b]) => {
                self.want(a, Shape::Vec3, &takes)?;
                self.want(b, Shape::Vec3, &takes)?;
                let axis = self.merged(a, b)?;
                let dimension = self.carried(a.ty.dimension.times(b.ty.dimension), a.span.to(b.span))?;
                Some((Function::Dot, Type { axis, ..scalar(dimension) }))
            }
            ("tangential", [v, normal]) => {
                self.want(v, Shape::Vec3, &takes)?;
                self.want(normal, Shape::Vec3, &takes)?;
                if normal.ty.dimension != Dimension::NONE {
                    self.report(
                        Diagnostic::error(codes::WRONG_TYPE, "a direction, such as `contacts.normal`, is wanted here")
                            .at(normal.span, format!("this is {}", describe(normal.ty))),
                    );
                    return None;
                }
                let axis = self.merged(v, normal)?;
                Some((Function::Tangential, Type { axis, ..v.ty }))
            }
            ("sum" | "mean", [x]) => {
                self.want_number(x, &takes)?;
                self.want_array(x, name)?;
                Some((if name == "sum" { Function::Sum } else { Function::Mean }, reduced))
            }
            ("min" | "max", [x]) => {
                self.want(x, Shape::Scalar, &takes)?;
                self.want_array(x, name)?;
                Some((if name == "min" { Function::Min } else { Function::Max }, reduced))
            }
            ("min" | "max", [a, b]) => {
                self.want(a, Shape::Scalar, &takes)?;
                self.want(b, Shape::Scalar, &takes)?;
                if a.ty.dimension != b.ty.dimension {
                    let message = format!("cannot compare {} with {}", super::element(a.ty), super::element(b.ty));
                    self.report(super::two_sides(codes::COMPARED_KINDS, message, a, b));
                    return None;
                }
                let axis = self.merged(a, b)?;
                Some((if name == "min" { Function::Min } else { Function::Max }, Type { axis, ..a.ty }))
            }
            (_, [x]) => {
                self.want_bool(x, &takes)?;
                self.want_array(x, name)?;
                Some(match name {
                    "count" => (Function::Count, scalar(Dimension::NONE)),
                    "any" => (Function::Any, Type::BOOL),
                    _ => (Function::All, Type::BOOL),
                })
            }
            _ => None,
        }
    }

    fn rate(&mut self, value: &syntax::Expr, duration: &syntax::Expr, span: Span, scope: Scope) -> Option<Expr> {
        let value = self.expr(value, scope);
        let duration = self.constant(duration, Some(Dimension::TIME), scope);
        let (value, duration) = (value?, duration?);
        self.want_number(&value, "`rate` watches")?;
        self.want_duration(&duration)?;
        let dimension = self.carried(value.ty.dimension.over(Dimension::TIME), span)?;
        let ty = Type { dimension, ..value.ty };
        Some(Expr { kind: ExprKind::Rate(Box::new(value), duration), ty, span })
    }

    /// `squeeze_of(left.fingers, right.fingers)`
    fn squeeze_of(&mut self, one: &syntax::Expr, two: &syntax::Expr, span: Span, scope: Scope) -> Option<Expr> {
        let hands = self.both_hands(one, two, "fingers", "squeeze_of")?;
        let forces: Vec<Option<Expr>> = hands
            .into_iter()
            .map(|(side, place)| {
                if self.names.channel("fingers.force").is_none() {
                    self.unknown("channel", "fingers.force", place, |_| Vec::new());
                }
                self.channel_of("fingers.force", Some(side), place, scope)
            })
            .collect();
        let forces = forces.into_iter().collect::<Option<Vec<Expr>>>()?;
        Some(Expr { kind: ExprKind::Call(Function::SqueezeOf, forces), ty: scalar(Dimension::FORCE), span })
    }

    /// `in_contact(left.target, right.target)`
    fn in_contact(&mut self, one: &syntax::Expr, two: &syntax::Expr, span: Span, scope: Scope) -> Option<Expr> {
        self.both_hands(one, two, "target", "in_contact")?;
        self.channel_of("targets.contact", None, span, scope)
    }

    /// The two hands of `f(left.what, right.what)`, in the order in which they are written.
    fn both_hands(
        &mut self,
        one: &syntax::Expr,
        two: &syntax::Expr,
        what: &str,
        function: &str,
    ) -> Option<[(Side, Span); 2]> {
        let side = |expr: &syntax::Expr| match &expr.bare().kind {
            Syntax::Path(path) => match path.parts.as_slice() {
                [side, name] if name.text == what => Side::from_name(&side.text),
                _ => None,
            },
            _ => None,
        };
        match (side(one), side(two)) {
            (Some(first), Some(second)) if first != second => Some([(first, one.span), (second, two.span)]),
            _ => {
                let wanted = format!("`{function}` takes `left.{what}` and `right.{what}`");
                self.report(
                    Diagnostic::error(codes::WRONG_TYPE, wanted.clone())
                        .at(one.span.to(two.span), "something else is given")
                        .fix("write both hands", one.span.to(two.span), format!("left.{what}, right.{what}")),
                );
                None
            }
        }
    }

    fn unknown_function(&mut self, path: &Path) {
        let name = path.text();
        if self.names.values.contains_key(&name) || self.names.channel(&name).is_some() {
            self.report(
                Diagnostic::error(codes::UNKNOWN_NAME, format!("`{name}` is no function"))
                    .at(path.span, "parentheses follow as if it were one"),
            );
            return;
        }
        self.unknown("function", &name, path.span, |_| FUNCTIONS.iter().map(|known| known.name.to_string()).collect());
    }
}
