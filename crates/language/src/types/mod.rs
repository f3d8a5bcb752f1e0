//! Checking of expressions: names become ids, every piece gets its type with its dimension. A piece that is wrong is reported once and
//! gives nothing, and what is built on it stays silent.

mod arrays;
mod constants;
mod equality;
mod functions;
mod paths;
mod summaries;

use super::codes;
use super::resolve::{Resolver, named};
use super::rules::{Arithmetic, Comparison, Expr, ExprKind, Hand, Type};
use super::syntax::{self, ExprKind as Syntax};
use teachtree_base::channels::{Axis, Shape};
use teachtree_base::diagnostic::{Diagnostic, Span};
use teachtree_base::units::Dimension;

/// Where an expression stands.
#[derive(Clone, Copy, Debug)]
pub struct Scope {
    /// Whose values are meant by bare names.
    pub hand: Hand,
    /// Whether latches and `from` may be read.
    memory: bool,
    /// The operator that looks ahead in which it stands, with its place: `within next`, `bridging` or `lasting`.
    ahead: Option<(&'static str, Span)>,
    /// The number over time that it stands in.
    summary: Option<Span>,
}

impl Scope {
    /// In `for each hand`.
    pub const HAND: Self = Self { hand: Hand::This, memory: false, ahead: None, summary: None };
    /// Outside `for each hand`.
    pub const SHARED: Self = Self { hand: Hand::Shared, memory: false, ahead: None, summary: None };

    /// The same where bare names are those of this hand.
    pub const fn of(self, hand: Hand) -> Self {
        Self { hand, ..self }
    }

    /// The same where latches and `from` may be read.
    pub const fn with_memory(self) -> Self {
        Self { memory: true, ..self }
    }
}

/// What an array runs over, in words.
const fn over(axis: Axis) -> &'static str {
    match axis {
        Axis::Fingers => "finger",
        Axis::Contacts => "contact",
    }
}

/// The type in words: `a force (N)`, `a condition`, `a vec3 (m/s) per finger`.
pub fn describe(ty: Type) -> String {
    let element = match ty.shape {
        Shape::Bool => "a condition".to_string(),
        Shape::Scalar => ty.dimension.to_string(),
        Shape::Vec3 if ty.dimension == Dimension::NONE => "a vec3 of plain numbers".to_string(),
        Shape::Vec3 => format!("a vec3 ({})", ty.dimension.si_unit()),
        Shape::Rotation => "a rotation".to_string(),
        Shape::Object => "an object".to_string(),
    };
    match ty.axis {
        Some((axis, _)) => format!("{element} per {}", over(axis)),
        None => element,
    }
}

impl Resolver {
    /// Checks an expression.
    pub fn expr(&mut self, expr: &syntax::Expr, scope: Scope) -> Option<Expr> {
        let span = expr.span;
        let made = |kind, ty| Some(Expr { kind, ty, span });
        match &expr.kind {
            Syntax::Bool(value) => made(ExprKind::Bool(*value), Type::BOOL),
            Syntax::Number { value, dimension, .. } => made(ExprKind::Number(*value), scalar(*dimension)),
            Syntax::Path(path) => self.path(path, scope),
            Syntax::Call(function, arguments) => self.call(function, arguments, span, scope),
            Syntax::Summary(function, value, samples) => self.summary(function, value, samples, span, scope),
            Syntax::From(labels, none) => self.from(labels, *none, span, scope),
            Syntax::Group(inner) => self.expr(inner, scope).map(|inner| Expr { span, ..inner }),
            Syntax::Pick(inner, name) => self.pick(inner, name, span, scope),
            Syntax::Component(inner, name) => {
                let inner = self.expr(inner, scope)?;
                self.component(inner, name, span)
            }
            Syntax::Negate(inner) => {
                let inner = self.expr(inner, scope)?;
                self.want_number(&inner, "`-` turns")?;
                let ty = inner.ty;
                made(ExprKind::Negate(Box::new(inner)), ty)
            }
            Syntax::Arithmetic(operation, left, right) => {
                let (left, right) = self.both(left, right, scope)?;
                let ty = self.arithmetic(*operation, &left, &right)?;
                made(ExprKind::Arithmetic(*operation, Box::new(left), Box::new(right)), ty)
            }
            Syntax::Compare(comparison, left, right) => {
                let bare = [left, right].map(|side| side.is_bare_number());
                let (left, right) = self.both(left, right, scope)?;
                let ty = self.comparison(*comparison, &left, &right, bare)?;
                made(ExprKind::Compare(*comparison, Box::new(left), Box::new(right)), ty)
            }
            Syntax::Not(inner) => {
                let inner = self.expr(inner, scope)?;
                self.want_bool(&inner, "`not` turns")?;
                let ty = inner.ty;
                made(ExprKind::Not(Box::new(inner)), ty)
            }
            Syntax::And(operands) => {
                let (operands, ty) = self.junction(operands, "`and` joins", scope)?;
                made(ExprKind::And(operands), ty)
            }
            Syntax::Or(operands) => {
                let (operands, ty) = self.junction(operands, "`or` joins", scope)?;
                made(ExprKind::Or(operands), ty)
            }
            Syntax::Hysteresis { value, on, off, rising } => self.hysteresis(value, on, off, *rising, span, scope),
            Syntax::Temporal(temporal, condition) => {
                let inside = if temporal.looks_ahead() {
                    let ahead = Span { start: condition.span.end, ..span };
                    Scope { ahead: Some((temporal.name(), self.trimmed(ahead))), ..scope }
                } else {
                    scope
                };
                let condition = self.expr(condition, inside);
                let written = temporal.constants().into_iter().map(|constant| &**constant);
                let constants = self.constants(written.zip(temporal.kinds()), scope);
                let (condition, constants) = (condition?, constants?);
                self.want_watched(&condition, temporal.name())?;
                let temporal = self.over_time(temporal.name(), constants)?;
                let ty = condition.ty;
                made(ExprKind::Temporal(temporal, Box::new(condition)), ty)
            }
        }
    }

    /// A place without the blanks before it.
    fn trimmed(&self, span: Span) -> Span {
        let text = self.rules.sources.text(span);
        let blanks = u32::try_from(text.len() - text.trim_start().len()).unwrap_or(0);
        Span { start: span.start + blanks, ..span }
    }

    /// Both sides of an operator; each is checked, so that each mistake is reported.
    fn both(&mut self, left: &syntax::Expr, right: &syntax::Expr, scope: Scope) -> Option<(Expr, Expr)> {
        let left = self.expr(left, scope);
        let right = self.expr(right, scope);
        left.zip(right)
    }

    /// A single condition, as latches and choices need it; `who` says what takes it.
    pub fn condition(&mut self, expr: &syntax::Expr, scope: Scope, who: &str) -> Option<Expr> {
        let checked = self.expr(expr, scope)?;
        self.want_bool(&checked, who)?;
        if let Some((axis, _)) = checked.ty.axis {
            let over = over(axis);
            let text = self.rules.sources.text(expr.span).to_string();
            self.report(
                Diagnostic::error(codes::WRONG_TYPE, format!("{who} a single condition"))
                    .at(expr.span, format!("this is one condition per {over}"))
                    .fix("ask for `any` of them, or for `all`", expr.span, format!("any({text})")),
            );
            return None;
        }
        Some(checked)
    }

    fn from(&mut self, labels: &[syntax::Label], none: bool, span: Span, scope: Scope) -> Option<Expr> {
        self.memory_allowed("`from`", span, None, scope)?;
        let labels = self.labels(labels)?;
        let labels = self.with_kinds(&labels, &named(&labels));
        Some(Expr { kind: ExprKind::From { labels, none }, ty: Type::BOOL, span })
    }

    /// Whether memory of the tree may be read here (grammar/README.md, Meaning of a run, point 2).
    fn memory_allowed(&mut self, what: &str, span: Span, declared: Option<Span>, scope: Scope) -> Option<()> {
        let finding = match scope.ahead {
            Some((name, window)) => {
                Diagnostic::error(codes::READS_MEMORY, format!("`{name}` cannot be applied to {what}"))
                    .at(span, "its future values are not known yet")
                    .at(window, "this looks ahead")
            }
            None if scope.memory && scope.summary.is_some() => {
                let finding =
                    Diagnostic::error(codes::READS_MEMORY, format!("a summary over time cannot be applied to {what}"))
                        .at(span, "this is memory of the tree");
                let finding = scope
                    .summary
                    .into_iter()
                    .fold(finding, |finding, place| finding.at(place, "this is computed from the log alone"));
                finding.help("use a signal, such as `grasped`")
            }
            None if !scope.memory => Diagnostic::error(codes::READS_MEMORY, format!("a signal cannot read {what}"))
                .at(span, "this remembers")
                .help("latches and choices of a tree can; a signal is computed from the log alone"),
            None => return Some(()),
        };
        self.report(match declared {
            Some(declared) => finding.at(declared, "declared as a latch"),
            None => finding,
        });
        None
    }

    fn junction(&mut self, operands: &[syntax::Expr], who: &str, scope: Scope) -> Option<(Vec<Expr>, Type)> {
        let read: Vec<Option<Expr>> = operands.iter().map(|operand| self.expr(operand, scope)).collect();
        let wrong = read.iter().flatten().filter(|operand| operand.ty.shape != Shape::Bool).count();
        for operand in read.iter().flatten() {
            let _reported = self.want_bool(operand, who);
        }
        let operands = read.into_iter().collect::<Option<Vec<Expr>>>().filter(|_| wrong == 0)?;
        let mut ty = Type::BOOL;
        let mut widest: Option<&Expr> = None;
        for operand in operands.iter().filter(|operand| operand.ty.axis.is_some()) {
            match widest {
                Some(first) => {
                    self.same_slots(first, operand)?;
                }
                None => widest = Some(operand),
            }
            ty.axis = operand.ty.axis;
        }
        Some((operands, ty))
    }

    fn arithmetic(&mut self, operation: Arithmetic, left: &Expr, right: &Expr) -> Option<Type> {
        let word = match operation {
            Arithmetic::Add => "`+` adds",
            Arithmetic::Subtract => "`-` subtracts",
            Arithmetic::Multiply => "`*` multiplies",
            Arithmetic::Divide => "`/` divides",
        };
        self.want_number(left, word)?;
        self.want_number(right, word)?;
        let axis = self.merged(left, right)?;
        let (shape, dimension) = match operation {
            Arithmetic::Add | Arithmetic::Subtract => {
                if (left.ty.shape, left.ty.dimension) != (right.ty.shape, right.ty.dimension) {
                    let message = if operation == Arithmetic::Add { "add" } else { "subtract" };
                    let (one, two) = if left.ty.shape == right.ty.shape {
                        (element(left.ty), element(right.ty))
                    } else {
                        (describe(left.ty), describe(right.ty))
                    };
                    let message = if operation == Arithmetic::Add {
                        format!("cannot {message} {two} to {one}")
                    } else {
                        format!("cannot {message} {two} from {one}")
                    };
                    self.report(two_sides(codes::ADDED_KINDS, message, left, right));
                    return None;
                }
                (left.ty.shape, Some(left.ty.dimension))
            }
            Arithmetic::Multiply => {
                if left.ty.shape == Shape::Vec3 && right.ty.shape == Shape::Vec3 {
                    let finding =
                        two_sides(codes::WRONG_TYPE, "`*` does not multiply two vec3".to_string(), left, right);
                    self.report(finding.help("`dot(a, b)` is their dot product"));
                    return None;
                }
                let shape = if left.ty.shape == Shape::Vec3 { Shape::Vec3 } else { right.ty.shape };
                (shape, left.ty.dimension.times(right.ty.dimension))
            }
            Arithmetic::Divide => {
                self.want(right, Shape::Scalar, "`/` divides by")?;
                (left.ty.shape, left.ty.dimension.over(right.ty.dimension))
            }
        };
        let dimension = self.carried(dimension, left.span.to(right.span))?;
        Some(Type { shape, dimension, axis })
    }

    fn comparison(&mut self, comparison: Comparison, left: &Expr, right: &Expr, bare: [bool; 2]) -> Option<Type> {
        let equality = matches!(comparison, Comparison::Equal | Comparison::NotEqual);
        if equality && left.ty.shape == Shape::Object && right.ty.shape == Shape::Object {
            return Some(Type::BOOL);
        }
        for side in [left, right] {
            if side.ty.shape != Shape::Scalar {
                let finding = Diagnostic::error(codes::WRONG_TYPE, "only numbers are compared".to_string())
                    .at(side.span, format!("this is {}", describe(side.ty)));
                self.report(match side.ty.shape {
                    Shape::Bool if side.ty.axis.is_some() => {
                        finding.help("`count(c)` returns how many of the conditions hold")
                    }
                    Shape::Bool => finding.help("join conditions by `and`, `or` and `not`"),
                    Shape::Vec3 => finding.help("`norm(v)` is its length, `v.z` its component upwards"),
                    Shape::Object if !equality => finding.help("objects are only equal (`==`) or not (`!=`)"),
                    _ => finding,
                });
                return None;
            }
        }
        if left.ty.dimension != right.ty.dimension {
            let message = format!("cannot compare {} with {}", element(left.ty), element(right.ty));
            let finding = two_sides(codes::COMPARED_KINDS, message, left, right);
            self.report(match bare {
                [_, true] => self.with_units(finding, right.span, left.ty.dimension),
                [true, _] => self.with_units(finding, left.span, right.ty.dimension),
                _ => finding,
            });
            return None;
        }
        self.want_exact(comparison, left, right)?;
        let axis = self.merged(left, right)?;
        Some(Type { axis, ..Type::BOOL })
    }

    /// Reports a dimension whose powers are too high to carry.
    fn carried(&mut self, dimension: Option<Dimension>, span: Span) -> Option<Dimension> {
        if dimension.is_none() {
            let finding = Diagnostic::error(codes::WRONG_TYPE, "the unit of this has a power that is too high");
            self.report(finding.at(span, "no supported quantity has this unit"));
        }
        dimension
    }

    fn hysteresis(
        &mut self,
        value: &syntax::Expr,
        on: &syntax::Expr,
        off: &syntax::Expr,
        rising: bool,
        span: Span,
        scope: Scope,
    ) -> Option<Expr> {
        let value = self.expr(value, scope);
        // Without the value, its thresholds are still read for their own mistakes.
        let Some(value) = value else {
            self.constant(on, None, scope);
            self.constant(off, None, scope);
            return None;
        };
        self.want(&value, Shape::Scalar, if rising { "`above` compares" } else { "`below` compares" })?;
        let on = self.threshold(&value, on, scope);
        let off = self.threshold(&value, off, scope);
        let (on, off) = (on?, off?);
        self.threshold_order(&on, &off, rising)?;
        let ty = Type { axis: value.ty.axis, ..Type::BOOL };
        Some(Expr { kind: ExprKind::Hysteresis { value: Box::new(value), on, off, rising }, ty, span })
    }
}

/// The type of a number.
pub const fn scalar(dimension: Dimension) -> Type {
    Type { shape: Shape::Scalar, dimension, axis: None }
}

/// The kind of quantity of an element, in words.
fn element(ty: Type) -> String {
    let word = match ty.shape {
        Shape::Scalar | Shape::Vec3 => ty.dimension.word().map(str::to_string),
        _ => None,
    };
    word.unwrap_or_else(|| describe(Type { axis: None, ..ty }))
}

/// A report that points at both sides of an operator.
fn two_sides(code: &'static str, message: String, left: &Expr, right: &Expr) -> Diagnostic {
    Diagnostic::error(code, message)
        .at(right.span, format!("this is {}", describe(right.ty)))
        .at(left.span, format!("this is {}", describe(left.ty)))
}
