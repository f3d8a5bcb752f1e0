//! Calls: what the table of operators says of the arguments and the result, checked.

use super::{Scope, describe, scalar};
use crate::codes;
use crate::ops::{self, CheckedForm, Operand, Operator, Output, Signature, TemporalOperator};
use crate::resolve::Resolver;
use crate::rules::{Constant, Expr, ExprKind, Function, Hand, Type};
use crate::syntax::{self, ExprKind as Syntax, Path};
use teachtree_base::channels::Shape;
use teachtree_base::diagnostic::{Diagnostic, Span};
use teachtree_base::hands::Side;
use teachtree_base::units::Dimension;

impl Resolver {
    /// `norm(x)`
    pub(super) fn call(&mut self, path: &Path, arguments: &[syntax::Expr], span: Span, scope: Scope) -> Option<Expr> {
        let name = path.text();
        let Some(operator) = ops::function(&name) else {
            self.unknown_function(path);
            return None;
        };
        let Some(signature) = operator
            .signatures
            .iter()
            .find(|signature| !signature.over_time && signature.takes.len() == arguments.len())
        else {
            self.wrong_count(operator, arguments.len(), span);
            return None;
        };
        match (operator.becomes, arguments) {
            (CheckedForm::Rate, [value, duration]) => self.rate(value, duration, span, scope),
            (CheckedForm::Call(Function::SqueezeOf), [one, two]) => self.squeeze_of(one, two, span, scope),
            (CheckedForm::Contact, [one, two]) => self.in_contact(one, two, span, scope),
            (CheckedForm::Temporal, [condition, constants @ ..]) => {
                let condition = self.expr(condition, scope)?;
                self.want_bool(&condition, &format!("`{name}` watches"))?;
                let constants = self.constants(constants.iter().zip(signature.takes.iter().skip(1).copied()), scope)?;
                let (temporal, ty) = (self.over_time(&name, constants)?, condition.ty);
                Some(Expr { kind: ExprKind::Temporal(temporal, Box::new(condition)), ty, span })
            }
            (CheckedForm::Call(function), _) => {
                let read: Vec<Option<Expr>> = arguments.iter().map(|argument| self.expr(argument, scope)).collect();
                let arguments = read.into_iter().collect::<Option<Vec<Expr>>>()?;
                let signature = of_rotations(operator, &arguments).unwrap_or(signature);
                let ty = self.applied(&name, signature, &arguments)?;
                Some(Expr { kind: ExprKind::Call(function, arguments), ty, span })
            }
            _ => None,
        }
    }

    /// The constants of an operator over time, each with what it is. All of them are read, so that each mistake is reported.
    pub(super) fn constants<'e>(
        &mut self,
        constants: impl Iterator<Item = (&'e syntax::Expr, Operand)>,
        scope: Scope,
    ) -> Option<Vec<(Constant, Operand)>> {
        let read: Vec<Option<(Constant, Operand)>> = constants
            .map(|(constant, takes)| {
                let wanted = if takes == Operand::Times { Dimension::NONE } else { Dimension::TIME };
                Some((self.constant(constant, Some(wanted), scope)?, takes))
            })
            .collect();
        read.into_iter().collect()
    }

    /// The operator over time with these constants, when each lies in its range.
    pub(super) fn over_time(
        &mut self,
        name: &str,
        constants: Vec<(Constant, Operand)>,
    ) -> Option<TemporalOperator<Constant>> {
        for (constant, takes) in &constants {
            match takes {
                Operand::Times => self.want_times(constant)?,
                _ => self.want_duration(constant)?,
            }
        }
        TemporalOperator::new(name, constants.into_iter().map(|(constant, _)| constant).collect())
    }

    fn wrong_count(&mut self, operator: &Operator, given: usize, span: Span) {
        let counts: Vec<usize> = operator
            .signatures
            .iter()
            .filter(|signature| !signature.over_time)
            .map(|signature| signature.takes.len())
            .collect();
        let wanted = match counts.as_slice() {
            [] => "samples over time",
            [1] => "one argument",
            [2] | [2, 2] => "two arguments",
            [3] => "three arguments",
            _ => "one or two arguments",
        };
        self.report(
            Diagnostic::error(codes::WRONG_COUNT, format!("`{}` takes {wanted}", operator.name))
                .at(span, format!("{given} given"))
                .help(format!("write `{}`", operator.calls().join("`, or `"))),
        );
    }

    /// The type of what a function gives; its arguments are checked from the first to the last.
    fn applied(&mut self, name: &str, signature: &Signature, arguments: &[Expr]) -> Option<Type> {
        let who = format!("`{name}` takes");
        for (argument, takes) in arguments.iter().zip(signature.takes) {
            match takes {
                Operand::Condition | Operand::Conditions => self.want_bool(argument, &who)?,
                Operand::Scalar | Operand::SameScalar | Operand::Scalars | Operand::Threshold => {
                    self.want(argument, Shape::Scalar, &who)?;
                }
                Operand::Number | Operand::Numbers => self.want_number(argument, &who)?,
                // These are of forms that look at samples.
                Operand::Value | Operand::NumberOrCondition => {}
                Operand::Vec3 | Operand::Direction => self.want(argument, Shape::Vec3, &who)?,
                Operand::Rotation => self.want(argument, Shape::Rotation, &who)?,
                Operand::Duration | Operand::Times | Operand::OfHand(_) => return None,
            }
            if matches!(takes, Operand::Conditions | Operand::Scalars | Operand::Numbers) {
                self.want_array(argument, name)?;
            }
        }
        let first = arguments.first()?;
        let mut axis = first.ty.axis;
        for (at, argument) in arguments.iter().enumerate().skip(1) {
            match signature.takes.get(at) {
                Some(Operand::Direction) => self.want_direction(argument)?,
                Some(Operand::SameScalar) if first.ty.dimension != argument.ty.dimension => {
                    let [a, b] = [first, argument].map(|one| super::element(one.ty));
                    let message = format!("`{name}` cannot take {a} and {b} together");
                    self.report(super::two_sides(codes::COMPARED_KINDS, message, first, argument));
                    return None;
                }
                _ => {}
            }
            for before in arguments.iter().take(at) {
                axis = axis.or(self.merged(before, argument)?);
            }
        }
        Some(match signature.gives {
            Output::Condition => Type { axis, ..Type::BOOL },
            Output::OneCondition => Type::BOOL,
            Output::Count => scalar(Dimension::NONE),
            Output::Same => Type { axis, ..first.ty },
            Output::Element => Type { axis: None, ..first.ty },
            Output::Length => Type { axis, ..scalar(first.ty.dimension) },
            Output::Product => {
                let last = arguments.last()?;
                let dimension = first.ty.dimension.times(last.ty.dimension);
                Type { axis, ..scalar(self.carried(dimension, first.span.to(last.span))?) }
            }
            Output::CrossProduct => {
                let last = arguments.last()?;
                let dimension = first.ty.dimension.times(last.ty.dimension);
                Type { axis, shape: Shape::Vec3, dimension: self.carried(dimension, first.span.to(last.span))? }
            }
            Output::Vec3 => Type { axis, shape: Shape::Vec3, dimension: first.ty.dimension },
            Output::Angle => Type { axis, ..scalar(Dimension::ANGLE) },
            Output::PerTime => {
                let dimension = self.carried(first.ty.dimension.over(Dimension::TIME), first.span)?;
                Type { dimension, ..first.ty }
            }
            Output::TimesTime => {
                let dimension = self.carried(first.ty.dimension.times(Dimension::TIME), first.span)?;
                Type { dimension, ..first.ty }
            }
            Output::Force => scalar(Dimension::FORCE),
        })
    }

    fn want_direction(&mut self, normal: &Expr) -> Option<()> {
        if normal.ty.dimension == Dimension::NONE {
            return Some(());
        }
        self.report(
            Diagnostic::error(codes::WRONG_TYPE, "a direction, such as `contacts.normal`, is expected here")
                .at(normal.span, format!("this is {}", describe(normal.ty))),
        );
        None
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
                self.channel_of("fingers.force", Some(Hand::Named(side)), place, scope)
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

    pub(super) fn unknown_function(&mut self, path: &Path) {
        let name = path.text();
        if self.names.values.contains_key(&name) || self.names.channel(&name).is_some() {
            self.report(
                Diagnostic::error(codes::UNKNOWN_NAME, format!("`{name}` is not a function"))
                    .at(path.span, "parentheses follow as if it were one"),
            );
            return;
        }
        self.unknown("function", &name, path.span, |_| ops::functions().map(|known| known.name.to_string()).collect());
    }
}

/// The form of rotations of a function that has one, where the first argument is a rotation.
fn of_rotations(operator: &'static Operator, arguments: &[Expr]) -> Option<&'static Signature> {
    let is_rotation = arguments.first()?.ty.shape == Shape::Rotation;
    operator.signatures.iter().find(|signature| is_rotation && signature.takes.first() == Some(&Operand::Rotation))
}
