//! Conditions of a rule set read as formulas.

use super::written::{label, written};
use super::{Atom, Formula, Interval};
use crate::base::channels::Shape;
use crate::language::rules::{Arithmetic, Comparison, Constant, Expr, ExprKind, Function, Hand, Rules};

/// Signals that are opened one within the other; deeper ones are taken as they are.
const MAX_DEPTH: usize = 6;
/// Pieces of a formula beyond which signals are taken as they are.
const MAX_SIZE: usize = 2_000;

/// What a number may be. (The numbers of a log are far from where `f64` ends.)
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Quality {
    Finite,
    /// The least of nothing.
    Infinite,
    /// Not a number: every comparison with it is false.
    Undefined,
}

/// Reads the conditions of a rule set.
pub struct Reader<'a> {
    rules: &'a Rules,
    /// Of each signal.
    qualities: Vec<Quality>,
    /// Whether a signal that is a constant is read as that constant.
    opens_constants: bool,
}

impl<'a> Reader<'a> {
    /// Reads conditions as they are.
    pub fn new(rules: &'a Rules) -> Self {
        let mut reader = Self { rules, qualities: Vec::with_capacity(rules.signals.len()), opens_constants: true };
        for signal in &rules.signals {
            // A signal reads earlier ones only.
            let quality = reader.quality(&signal.expr);
            reader.qualities.push(quality);
        }
        reader
    }

    /// Reads conditions as if signals that are constants could come out either way: so a hand file says what its hardware cannot tell,
    /// and a tree that asks for it all the same is as it should be.
    pub fn with_open_constants(rules: &'a Rules) -> Self {
        Self { opens_constants: false, ..Self::new(rules) }
    }

    /// A condition, in a tree or declaration of `this`; of an array, for any of its slots.
    pub fn formula(&self, expr: &Expr, this: Hand) -> Formula {
        let mut left = MAX_SIZE;
        self.opened(expr, this, 0, &mut left)
    }

    fn opened(&self, expr: &Expr, this: Hand, depth: usize, left: &mut usize) -> Formula {
        *left = left.saturating_sub(1);
        let mut all = |parts: &[Expr]| parts.iter().map(|part| self.opened(part, this, depth, left)).collect();
        match &expr.kind {
            ExprKind::Bool(value) => Formula::Known(*value),
            ExprKind::And(parts) => Formula::All(all(parts)),
            ExprKind::Or(parts) => Formula::Any(all(parts)),
            ExprKind::Not(inner) => Formula::Not(Box::new(self.opened(inner, this, depth, left))),
            ExprKind::From { labels, none } => {
                let names = labels.iter().map(|one| label(*one, self.rules));
                Formula::From(names.chain(none.then(|| "none".to_string())).collect())
            }
            ExprKind::Signal(id, hand) if depth < MAX_DEPTH && *left > 0 => {
                let this = if *hand == Hand::This { this } else { *hand };
                match self.rules.signals.get(id.index()) {
                    Some(signal) if self.opens_constants || !matches!(signal.expr.kind, ExprKind::Bool(_)) => {
                        self.opened(&signal.expr, this, depth + 1, left)
                    }
                    _ => self.atom(expr, this),
                }
            }
            _ => self.atom(expr, this),
        }
    }

    fn atom(&self, expr: &Expr, this: Hand) -> Formula {
        Formula::Atom(Atom {
            key: written(expr, self.rules, this),
            text: self.rules.sources.text(expr.span).split_whitespace().collect::<Vec<_>>().join(" "),
            bound: self.bound(expr, this),
        })
    }

    /// The quantity that a single condition bounds. What is not a number lies nowhere when a comparison holds, and anywhere when it does not.
    fn bound(&self, expr: &Expr, this: Hand) -> Option<(String, [Option<Interval>; 2])> {
        let (quantities, [when, when_not]) = match &expr.kind {
            ExprKind::Compare(_, a, _) if a.ty.shape != Shape::Scalar => return None,
            ExprKind::Compare(comparison, a, b) => match (self.constant(a), self.constant(b)) {
                (None, Some(limit)) => ([Some(a), None], compared(*comparison, limit)),
                (Some(limit), None) => ([Some(b), None], compared(comparison.swapped(), limit)),
                // Which of two is the larger one is a quantity too: their difference.
                (None, None) => ([Some(a), Some(b)], compared(*comparison, 0.0)),
                (Some(_), Some(_)) => return None,
            },
            ExprKind::Hysteresis { value, on, off, rising } => {
                // On what is not a number it stays as it is.
                if self.quality(value) == Quality::Undefined {
                    return None;
                }
                ([Some(value), None], hysteresis(on, off, *rising))
            }
            _ => return None,
        };
        let undefined = quantities.iter().flatten().any(|quantity| self.quality(quantity) == Quality::Undefined);
        let natural = match quantities {
            [Some(one), None] if never_negative(one) => Interval::above(0.0, false),
            _ => Interval::ALL,
        };
        let when_not = if undefined { Some(Interval::ALL) } else { when_not.with(natural) };
        let (key, [when, when_not]) = match quantities.map(|one| one.map(|one| written(one, self.rules, this))) {
            [Some(one), Some(two)] if two < one => {
                (format!("{two} against {one}"), [Some(when), when_not].map(|side| side.map(Interval::mirrored)))
            }
            [Some(one), Some(two)] => (format!("{one} against {two}"), [Some(when), when_not]),
            [one, _] => (one?, [when.with(natural), when_not]),
        };
        Some((key, [when, when_not]))
    }

    fn quality(&self, expr: &Expr) -> Quality {
        let worst = || expr.arguments().into_iter().map(|arg| self.quality(arg)).max().unwrap_or(Quality::Finite);
        let counted = |worst: Quality| if worst == Quality::Finite { worst } else { Quality::Undefined };
        match &expr.kind {
            ExprKind::Signal(id, _) => self.qualities.get(id.index()).copied().unwrap_or(Quality::Undefined),
            ExprKind::Arithmetic(Arithmetic::Divide, ..) => Quality::Undefined,
            ExprKind::Call(Function::Count, _) => Quality::Finite,
            ExprKind::Call(Function::Min | Function::Max, args) if args.len() == 1 => worst().max(Quality::Infinite),
            ExprKind::Call(Function::Abs | Function::Min | Function::Max, _)
            | ExprKind::Negate(_)
            | ExprKind::Component(..)
            | ExprKind::Pick(..) => worst(),
            // Infinities cancel.
            _ => counted(worst()),
        }
    }

    fn constant(&self, expr: &Expr) -> Option<f64> {
        let number = match &expr.kind {
            ExprKind::Number(number) => *number,
            ExprKind::Param(id) => self.rules.params.get(id.index())?.value,
            ExprKind::Negate(inner) => -self.constant(inner)?,
            ExprKind::Arithmetic(operation, a, b) => operation.apply(self.constant(a)?, self.constant(b)?),
            _ => return None,
        };
        number.is_finite().then_some(number)
    }
}

/// Where a quantity lies when it compares so with a limit, and when it does not.
const fn compared(comparison: Comparison, limit: f64) -> [Interval; 2] {
    match comparison {
        Comparison::Less => [Interval::below(limit, true), Interval::above(limit, false)],
        Comparison::LessEqual => [Interval::below(limit, false), Interval::above(limit, true)],
        Comparison::Greater => [Interval::above(limit, true), Interval::below(limit, false)],
        Comparison::GreaterEqual => [Interval::above(limit, false), Interval::below(limit, true)],
        Comparison::Equal => [Interval::at(limit), Interval::ALL],
        Comparison::NotEqual => [Interval::ALL, Interval::at(limit)],
    }
}

/// Where a quantity lies while its hysteresis holds, and while it does not.
const fn hysteresis(on: &Constant, off: &Constant, rising: bool) -> [Interval; 2] {
    if rising {
        [Interval::above(on.value.min(off.value), false), Interval::below(on.value, false)]
    } else {
        [Interval::below(on.value.max(off.value), false), Interval::above(on.value, false)]
    }
}

const fn never_negative(expr: &Expr) -> bool {
    matches!(expr.kind, ExprKind::Call(Function::Abs | Function::Norm | Function::Count, _))
}
