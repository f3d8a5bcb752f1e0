//! Converts pest's pairs to expressions of the syntax tree.
//!
//! INVARIANT (bounded nesting): no expression is deeper than [`MAX_DEPTH`], so that every later pass may recurse.

use super::grammar::Rule;
use super::mistakes::unknown_unit;
use super::piece::Piece;
use crate::codes;
use crate::ops::{Samples, TemporalOperator};
use crate::rules::{Arithmetic, Comparison};
use crate::syntax::{Expr, ExprKind, Label, Name, Path};
use pest::iterators::Pair;
use teachtree_base::diagnostic::{Diagnostic, Span};
use teachtree_base::hands::Side;
use teachtree_base::units::{self, Dimension};

/// Operators that may lie one within the other.
pub const MAX_DEPTH: u32 = 128;

/// Builds syntax from the pairs of one piece; findings are those that the grammar cannot see.
pub struct Builder<'s, 'a, 'f> {
    /// The piece.
    pub piece: Piece<'s, 'a>,
    /// What is wrong with it.
    pub findings: &'f mut Vec<Diagnostic>,
}

/// A pair of our grammar.
pub type RulePair<'a> = Pair<'a, Rule>;

impl Builder<'_, '_, '_> {
    /// A word.
    pub fn name(&self, pair: &RulePair<'_>) -> Name {
        Name { text: pair.as_str().to_string(), span: self.piece.span(pair) }
    }

    /// Words joined by dots.
    pub fn path(&self, pair: &RulePair<'_>) -> Path {
        let span = self.piece.span(pair);
        let mut start = span.start;
        let parts = pair.as_str().split('.').map(|part| {
            let end = start.saturating_add(u32::try_from(part.len()).unwrap_or(0));
            let name = Name { text: part.to_string(), span: self.piece.place(start, end) };
            start = end.saturating_add(1);
            name
        });
        Path { parts: parts.collect(), span }
    }

    /// `MainGrasp(left)`
    pub fn label(&self, pair: RulePair<'_>) -> Option<Label> {
        let span = self.piece.span(&pair);
        let mut inner = pair.into_inner();
        let name = self.name(&inner.next()?);
        let side = inner.next().map(|side| if side.as_str().contains("left") { Side::Left } else { Side::Right });
        Some(Label { name, side, span })
    }

    /// The first child of a pair as an expression.
    pub fn inner(&mut self, pair: RulePair<'_>) -> Option<Expr> {
        let inner = pair.into_inner().next()?;
        self.expression(inner)
    }

    /// Converts a pair to an expression. Reports an error and returns `None`.
    pub fn expression(&mut self, pair: RulePair<'_>) -> Option<Expr> {
        let span = self.piece.span(&pair);
        let expr = match pair.as_rule() {
            Rule::expression => self.list(pair, ExprKind::Or)?,
            Rule::conjunction => self.list(pair, ExprKind::And)?,
            Rule::negation => self.negation(pair)?,
            Rule::comparison => self.comparison(pair)?,
            Rule::sum | Rule::product => self.chain(pair)?,
            Rule::operand => self.operand(pair)?,
            Rule::duration | Rule::count => self.inner(pair)?,
            Rule::group => {
                let inner = pair.into_inner().find(|part| part.as_rule() == Rule::expression)?;
                let inner = self.expression(inner)?;
                Expr::new(ExprKind::Group(Box::new(inner)), span)
            }
            Rule::quantity => self.quantity(pair)?,
            Rule::number => self.number(pair.as_str().parse().ok()?, Dimension::NONE, true, span)?,
            Rule::truth => Expr::new(ExprKind::Bool(pair.as_str() == "true"), span),
            Rule::path => Expr::new(ExprKind::Path(self.path(&pair)), span),
            Rule::reference => self.reference(pair)?,
            Rule::from => self.from(pair)?,
            _ => return None,
        };
        if expr.depth > MAX_DEPTH {
            self.findings.push(
                Diagnostic::error(codes::TOO_DEEP, format!("operators are nested more than {MAX_DEPTH} deep"))
                    .at(expr.span, "this is too long a chain")
                    .help("split it into signals"),
            );
            return None;
        }
        Some(expr)
    }

    /// `a or b or c`, `a and b and c`; one operand alone is itself.
    fn list(&mut self, pair: RulePair<'_>, kind: fn(Vec<Expr>) -> ExprKind) -> Option<Expr> {
        let span = self.piece.span(&pair);
        let parts = pair.into_inner().filter(|part| !matches!(part.as_rule(), Rule::kw_or | Rule::kw_and));
        // Every operand is read, so that each mistake is reported.
        let read: Vec<Option<Expr>> = parts.map(|part| self.expression(part)).collect();
        let mut operands = read.into_iter().collect::<Option<Vec<Expr>>>()?;
        if operands.len() == 1 { operands.pop() } else { Some(Expr::new(kind(operands), span)) }
    }

    fn negation(&mut self, pair: RulePair<'_>) -> Option<Expr> {
        let span = self.piece.span(&pair);
        let mut starts = Vec::new();
        let mut value = None;
        for part in pair.into_inner() {
            if part.as_rule() == Rule::kw_not {
                starts.push(self.piece.span(&part).start);
            } else {
                value = self.expression(part);
            }
        }
        let not = |value, start| Expr::new(ExprKind::Not(Box::new(value)), Span { start, ..span });
        Some(starts.into_iter().rev().fold(value?, not))
    }

    fn comparison(&mut self, pair: RulePair<'_>) -> Option<Expr> {
        let span = self.piece.span(&pair);
        let mut parts = pair.into_inner();
        let left = parts.next().map(|left| self.expression(left))?;
        let Some(tail) = parts.next() else {
            return left;
        };
        if tail.as_rule() == Rule::compared {
            let mut tail = tail.into_inner();
            let comparison = comparison(tail.next()?.as_str());
            let right = tail.next().and_then(|right| self.expression(right));
            let kind = ExprKind::Compare(comparison, Box::new(left?), Box::new(right?));
            return Some(Expr::new(kind, span));
        }
        let mut thresholds = tail.into_inner();
        let rising = thresholds.next()?.as_rule() == Rule::kw_above;
        let read: Vec<Option<Expr>> =
            thresholds.filter(|part| part.as_rule() == Rule::sum).map(|part| self.expression(part)).collect();
        let mut thresholds = read.into_iter();
        let (on, off) = (thresholds.next()??, thresholds.next()??);
        let (value, on, off) = (Box::new(left?), Box::new(on), Box::new(off));
        Some(Expr::new(ExprKind::Hysteresis { value, on, off, rising }, span))
    }

    /// `a + b - c`, `a * b / c`, from left to right.
    fn chain(&mut self, pair: RulePair<'_>) -> Option<Expr> {
        let mut parts = pair.into_inner();
        let mut left = parts.next().map(|first| self.expression(first))?;
        while let (Some(operator), Some(right)) = (parts.next(), parts.next()) {
            let operation = match operator.as_rule() {
                Rule::plus => Arithmetic::Add,
                Rule::minus => Arithmetic::Subtract,
                Rule::times => Arithmetic::Multiply,
                _ => Arithmetic::Divide,
            };
            let right = self.expression(right);
            left = left.zip(right).map(|(left, right)| {
                let span = left.span.to(right.span);
                Expr::new(ExprKind::Arithmetic(operation, Box::new(left), Box::new(right)), span)
            });
        }
        left
    }

    fn operand(&mut self, pair: RulePair<'_>) -> Option<Expr> {
        let mut signs = Vec::new();
        let mut value: Option<Expr> = None;
        for part in pair.into_inner() {
            let place = self.piece.span(&part);
            match part.as_rule() {
                Rule::minus => signs.push(place.start),
                rule @ (Rule::pick | Rule::component) => {
                    let name =
                        part.into_inner().find(|word| word.as_rule() == Rule::name).map(|word| self.name(&word))?;
                    let inner = value?;
                    let span = inner.span.to(place);
                    let inner = Box::new(inner);
                    let kind =
                        if rule == Rule::pick { ExprKind::Pick(inner, name) } else { ExprKind::Component(inner, name) };
                    value = Some(Expr::new(kind, span));
                }
                Rule::window => value = self.window(value?, part),
                _ => value = Some(self.expression(part)?),
            }
        }
        let value = value?;
        let end = value.span;
        let negate = |value, start| Expr::new(ExprKind::Negate(Box::new(value)), Span { start, ..end });
        Some(signs.into_iter().rev().fold(value, negate))
    }

    fn window(&mut self, condition: Expr, pair: RulePair<'_>) -> Option<Expr> {
        let place = self.piece.span(&pair);
        let (mut words, mut constants) = (Vec::new(), Vec::new());
        for part in pair.into_inner() {
            match part.as_rule() {
                Rule::duration | Rule::count => constants.push(Box::new(self.expression(part)?)),
                _ => words.push(part.as_str()),
            }
        }
        if !matches!(condition.kind, ExprKind::Group(_)) {
            let word = words.first().copied().unwrap_or_default();
            self.findings.push(
                Diagnostic::error(codes::BARE_WINDOW, format!("`{word}` takes a condition in parentheses"))
                    .at(condition.span, "the extent of the condition is ambiguous")
                    .help(format!("put the whole condition into parentheses: `(moving and near) {word} …`")),
            );
            return None;
        }
        let span = condition.span.to(place);
        let temporal = TemporalOperator::new(&words.join(" "), constants)?;
        Some(Expr::new(ExprKind::Temporal(temporal, Box::new(condition)), span))
    }

    fn quantity(&mut self, pair: RulePair<'_>) -> Option<Expr> {
        let span = self.piece.span(&pair);
        let mut parts = pair.into_inner();
        let number = parts.next()?;
        let value: f64 = number.as_str().parse().ok()?;
        let Some(unit) = parts.next() else {
            return self.number(value, Dimension::NONE, true, span);
        };
        let (in_si, dimension) = self.unit(&unit)?;
        self.number(value * in_si, dimension, false, span)
    }

    fn number(&mut self, value: f64, dimension: Dimension, bare: bool, span: Span) -> Option<Expr> {
        if !value.is_finite() {
            self.findings
                .push(Diagnostic::error(codes::OUT_OF_RANGE, "this number is too large").at(span, "more than 1e308"));
            return None;
        }
        Some(Expr::new(ExprKind::Number { value, dimension, bare }, span))
    }

    /// Returns the SI value and the dimension of a written unit. Reports an unknown unit and returns `None`.
    pub fn unit(&mut self, pair: &RulePair<'_>) -> Option<(f64, Dimension)> {
        let place = self.piece.span(pair);
        match units::compound(pair.as_str()) {
            Ok((in_si, dimension)) if in_si.is_finite() && in_si > 0.0 => Some((in_si, dimension)),
            Ok(_) | Err(_) => {
                self.findings.push(unknown_unit(pair.as_str(), place));
                None
            }
        }
    }

    fn reference(&mut self, pair: RulePair<'_>) -> Option<Expr> {
        let span = self.piece.span(&pair);
        let mut parts = pair.into_inner();
        let path = self.path(&parts.next()?);
        let Some(arguments) = parts.next() else {
            return Some(Expr::new(ExprKind::Path(path), span));
        };
        let mut samples = None;
        let mut read: Vec<Option<Expr>> = Vec::new();
        for part in arguments.into_inner() {
            match part.as_rule() {
                Rule::expression => read.push(self.expression(part)),
                Rule::samples => samples = Some(self.samples(part)),
                _ => {}
            }
        }
        if let Some(samples) = samples {
            let value = Box::new(read.pop()??);
            return Some(Expr::new(ExprKind::Summary(path, value, samples?), span));
        }
        Some(Expr::new(ExprKind::Call(path, read.into_iter().collect::<Option<_>>()?), span))
    }

    /// `over last 200 ms`, `since grasped`
    fn samples(&mut self, pair: RulePair<'_>) -> Option<Samples<Box<Expr>, Box<Expr>>> {
        let part = pair.into_inner().find(|part| matches!(part.as_rule(), Rule::duration | Rule::expression))?;
        let lasting = part.as_rule() == Rule::duration;
        let read = Box::new(self.expression(part)?);
        Some(if lasting { Samples::Last(read) } else { Samples::Since(read) })
    }

    fn from(&mut self, pair: RulePair<'_>) -> Option<Expr> {
        let span = self.piece.span(&pair);
        let mut labels = Vec::new();
        let mut none = false;
        for listed in pair.into_inner().filter(|part| part.as_rule() == Rule::from_label) {
            let listed = listed.into_inner().next()?;
            if listed.as_rule() == Rule::label {
                labels.push(self.label(listed)?);
            } else {
                none = true;
            }
        }
        Some(Expr::new(ExprKind::From(labels, none), span))
    }
}

fn comparison(operator: &str) -> Comparison {
    match operator {
        "<" => Comparison::Less,
        "<=" => Comparison::LessEqual,
        ">" => Comparison::Greater,
        ">=" => Comparison::GreaterEqual,
        "==" => Comparison::Equal,
        _ => Comparison::NotEqual,
    }
}
