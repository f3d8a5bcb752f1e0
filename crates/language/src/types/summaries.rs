//! Numbers over time: `mean(x over last d)`, `earliest(x since c)`.

use super::{Scope, describe, scalar};
use crate::codes;
use crate::ops::{self, Operand, Output, Samples, Summary};
use crate::resolve::Resolver;
use crate::rules::{Expr, ExprKind, Type};
use crate::syntax::{self, Path};
use teachtree_base::channels::Shape;
use teachtree_base::diagnostic::{Diagnostic, Span};
use teachtree_base::units::Dimension;

impl Resolver {
    /// `mean(x over last d)`
    pub(super) fn summary(
        &mut self,
        path: &Path,
        value: &syntax::Expr,
        samples: &Samples<Box<syntax::Expr>, Box<syntax::Expr>>,
        span: Span,
        scope: Scope,
    ) -> Option<Expr> {
        let name = path.text();
        let Some(operator) = ops::function(&name) else {
            self.unknown_function(path);
            return None;
        };
        let signature = operator.signatures.iter().find(|signature| signature.over_time);
        let (Some(summary), Some(signature)) = (Summary::named(&name), signature) else {
            self.no_summary(&name, path.span, samples);
            return None;
        };
        let inside = Scope { summary: Some(path.span), ..scope };
        let value = self.expr(value, inside);
        let samples = match samples {
            Samples::Last(duration) => self.constant(duration, Some(Dimension::TIME), scope).and_then(|duration| {
                self.want_duration(&duration)?;
                Some(Samples::Last(duration))
            }),
            Samples::Since(condition) => self.expr(condition, inside).and_then(|condition| {
                self.want_bool(&condition, "`since` takes")?;
                Some(Samples::Since(Box::new(condition)))
            }),
        };
        let (value, samples) = (value?, samples?);
        let ty = self.summarized(&name, signature, &value, span)?;
        let axis = match &samples {
            Samples::Last(_) => ty.axis,
            Samples::Since(condition) => self.merged(&value, condition)?,
        };
        Some(Expr { kind: ExprKind::Summary(summary, Box::new(value), samples), ty: Type { axis, ..ty }, span })
    }

    /// The type of what is made of the samples of a value.
    fn summarized(&mut self, name: &str, signature: &ops::Signature, value: &Expr, span: Span) -> Option<Type> {
        let who = format!("`{name}` over time takes");
        let wanted = match (signature.takes.first(), value.ty.shape) {
            (Some(Operand::NumberOrCondition), Shape::Scalar | Shape::Vec3 | Shape::Bool)
            | (Some(Operand::Value), Shape::Scalar | Shape::Vec3 | Shape::Rotation) => None,
            (Some(Operand::NumberOrCondition), _) => Some("a number, a vec3 or a condition"),
            (Some(Operand::Value), _) => Some("a number, a vec3 or a rotation"),
            _ => {
                self.want(value, Shape::Scalar, &who)?;
                None
            }
        };
        if let Some(wanted) = wanted {
            self.report(
                Diagnostic::error(codes::WRONG_TYPE, format!("{who} {wanted}"))
                    .at(value.span, format!("this is {}", describe(value.ty))),
            );
            return None;
        }
        // Of a condition the share of frames on which it holds, or the time.
        let ty = match value.ty.shape {
            Shape::Bool => Type { axis: value.ty.axis, ..scalar(Dimension::NONE) },
            _ => value.ty,
        };
        match signature.gives {
            Output::TimesTime => {
                let dimension = self.carried(ty.dimension.times(Dimension::TIME), span)?;
                Some(Type { dimension, ..ty })
            }
            _ => Some(ty),
        }
    }

    fn no_summary(&mut self, name: &str, place: Span, samples: &Samples<Box<syntax::Expr>, Box<syntax::Expr>>) {
        let (written, read) = match samples {
            Samples::Last(duration) => ("`over last`", duration.span),
            Samples::Since(condition) => ("`since`", condition.span),
        };
        let names: Vec<String> = Summary::ALL.iter().map(|summary| format!("`{}`", summary.name())).collect();
        let (last, rest) = names.split_last().map_or((String::new(), &[][..]), |(last, rest)| (last.clone(), rest));
        let finding = Diagnostic::error(codes::WRONG_COUNT, format!("`{name}` does not take samples over time"))
            .at(place, "this is computed from one frame")
            .at(read, format!("{written} is written here"));
        self.report(match name {
            "any" | "all" | "count" => finding.help(
                "`(condition) within last 200 ms` tests whether it held, `mean(condition over last 200 ms)` gives the share of the time",
            ),
            _ => finding.help(format!("{} and {last} do", rest.join(", "))),
        });
    }

    /// Reports when what stands before a window is not a condition.
    pub(super) fn want_watched(&mut self, watched: &Expr, window: &str) -> Option<()> {
        if matches!(watched.ty.shape, Shape::Scalar | Shape::Vec3) {
            self.report(
                Diagnostic::error(codes::WRONG_TYPE, format!("`{window}` takes a condition"))
                    .at(watched.span, format!("this is {}", describe(watched.ty)))
                    .help("compare it with a threshold; `max(x over last 200 ms)` is the largest of the last samples"),
            );
            return None;
        }
        self.want_bool(watched, &format!("`{window}` watches"))
    }
}
