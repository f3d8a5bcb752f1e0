//! Conditions of a rule set read as formulas.

use super::canonical_text::{canonical_text, label};
use super::{Atom, Bound, Formula, Interval, Number, Quantity, Test};
use crate::ops::{self, Range, Summary};
use crate::rules::{Arithmetic, Comparison, Expr, ExprKind, Function, Hand, Rules};
use std::rc::Rc;
use teachtree_base::channels::Shape;

/// Signals that are opened one within the other; deeper ones are taken as they are.
const MAX_DEPTH: usize = 16;
/// Pieces of a formula beyond which signals are taken as they are.
const MAX_SIZE: usize = 2_000;

/// The class of a number: finite, infinite or NaN. (The numbers of a log are far from the limits of `f64`.)
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum NumberClass {
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
    number_classes: Vec<NumberClass>,
    /// Whether a signal that is a constant is read as that constant.
    opens_constants: bool,
}

impl<'a> Reader<'a> {
    /// Reads conditions as they are.
    pub fn new(rules: &'a Rules) -> Self {
        let mut reader = Self { rules, number_classes: Vec::with_capacity(rules.signals.len()), opens_constants: true };
        for signal in &rules.signals {
            // A signal reads earlier ones only.
            let number_class = reader.number_class(&signal.expr);
            reader.number_classes.push(number_class);
        }
        reader
    }

    /// Reads conditions as if signals that are constants could come out either way: a hand model declares constants for quantities that its hardware cannot
    /// measure, and a tree may still read them.
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
            ExprKind::Bool(value) => Formula::Constant(*value),
            ExprKind::And(parts) => Formula::All(all(parts)),
            ExprKind::Or(parts) => Formula::Any(all(parts)),
            ExprKind::Not(inner) => Formula::Not(Box::new(self.opened(inner, this, depth, left))),
            ExprKind::From { labels, none } => {
                let names = labels.iter().map(|one| label(*one, self.rules));
                Formula::From(names.chain(none.then(|| "none".to_string())).collect())
            }
            ExprKind::Signal(id, hand) if depth < MAX_DEPTH && *left > 0 => {
                let this = hand.seen_from(this);
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
        if let Some(value) = self.known(expr, this) {
            return Formula::Constant(value);
        }
        let (key, text) = (canonical_text(expr, self.rules, this), self.text(expr, this));
        match &expr.kind {
            // Two objects are the same one, or they are not.
            ExprKind::Compare(Comparison::NotEqual, a, b) if a.ty.shape == Shape::Object => {
                let kind = ExprKind::Compare(Comparison::Equal, a.clone(), b.clone());
                let key = canonical_text(&Expr { kind, ..expr.clone() }, self.rules, this);
                let same = Atom { key: key.into(), text: text.replace("!=", "=="), bound: None };
                Formula::Not(Box::new(Formula::Atom(Rc::new(same))))
            }
            _ => Formula::Atom(Rc::new(Atom { key: key.into(), text, bound: self.bound(expr, this) })),
        }
    }

    /// How a single condition comes out that compares constants, or a quantity with itself. A param may be a switch, so that both of its ways are meant.
    fn known(&self, expr: &Expr, this: Hand) -> Option<bool> {
        if !self.opens_constants && expr.reads_params() {
            return None;
        }
        match &expr.kind {
            // With itself.
            ExprKind::Compare(comparison, a, b)
                if a.ty.shape == Shape::Scalar
                    && self.number_class(a) != NumberClass::Undefined
                    && canonical_text(a, self.rules, this) == canonical_text(b, self.rules, this) =>
            {
                Some(comparison.holds(0.0, 0.0))
            }
            ExprKind::Compare(comparison, a, b) => Some(comparison.holds(self.constant(a)?, self.constant(b)?)),
            ExprKind::Hysteresis { value, on, rising, .. } => {
                let value = self.constant(value)?;
                Some(if *rising { value > on.value } else { value < on.value })
            }
            _ => None,
        }
    }

    /// A piece as its author wrote it; when that does not say whose it is, since it stands in a declaration for each hand, with the hand.
    fn text(&self, expr: &Expr, this: Hand) -> String {
        let text = self.rules.text_of(expr);
        match this {
            Hand::Named(side) if expr.reads_this_hand() => format!("{side}: {text}"),
            Hand::Other if expr.reads_this_hand() => format!("other hand: {text}"),
            _ => text,
        }
    }

    fn number(&self, expr: &Expr, this: Hand) -> Rc<Number> {
        let key = canonical_text(expr, self.rules, this);
        let shown = Some((self.text(expr, this), expr.ty.dimension));
        let natural = match &expr.kind {
            _ if !never_negative(expr) => Interval::ALL,
            // A share.
            ExprKind::Summary(Summary::Mean, value, _) if value.ty.shape == Shape::Bool => {
                Interval::above(0.0, false).with(Interval::below(1.0, false)).unwrap_or(Interval::ALL)
            }
            _ => Interval::above(0.0, false),
        };
        let whole = range(expr) == Some(Range::Counted);
        Rc::new(Number {
            key: key.into(),
            shown,
            natural,
            whole,
            undefined: self.number_class(expr) == NumberClass::Undefined,
        })
    }

    /// Returns the constraint of a single condition on a quantity.
    fn bound(&self, expr: &Expr, this: Hand) -> Option<Bound> {
        let one = |expr| Quantity::One(self.number(expr, this));
        let (quantity, test) = match &expr.kind {
            ExprKind::Compare(_, a, _) if a.ty.shape != Shape::Scalar => return None,
            ExprKind::Compare(comparison, a, b) => match (self.constant(a), self.constant(b)) {
                (None, Some(limit)) => (one(a), Test::Compared(*comparison, limit)),
                (Some(limit), None) => (one(b), Test::Compared(comparison.swapped(), limit)),
                // Which of two is the larger one is a quantity too: their difference.
                (None, None) => {
                    let (a, b) = (self.number(a, this), self.number(b, this));
                    if a.key <= b.key {
                        (Quantity::Difference(a, b), Test::Compared(*comparison, 0.0))
                    } else {
                        (Quantity::Difference(b, a), Test::Compared(comparison.swapped(), 0.0))
                    }
                }
                (Some(_), Some(_)) => return None,
            },
            ExprKind::Hysteresis { value, on, off, rising } => {
                (one(value), Test::Hysteresis { on: on.value, off: off.value, rising: *rising })
            }
            // That any holds says that at least one is counted.
            ExprKind::Call(Function::Any, args) => {
                let [array] = args.as_slice() else { return None };
                let key = format!("{:?}({},)", Function::Count, canonical_text(array, self.rules, this));
                let natural = Interval::above(0.0, false);
                let number = Number { key: key.into(), shown: None, natural, whole: true, undefined: false };
                (Quantity::One(Rc::new(number)), Test::Compared(Comparison::GreaterEqual, 1.0))
            }
            _ => return None,
        };
        Some(Bound { quantity, test })
    }

    fn number_class(&self, expr: &Expr) -> NumberClass {
        let worst =
            || expr.arguments().into_iter().map(|arg| self.number_class(arg)).max().unwrap_or(NumberClass::Finite);
        let counted = |worst: NumberClass| if worst == NumberClass::Finite { worst } else { NumberClass::Undefined };
        match &expr.kind {
            ExprKind::Signal(id, _) => self.number_classes.get(id.index()).copied().unwrap_or(NumberClass::Undefined),
            ExprKind::Arithmetic(Arithmetic::Divide, ..) => NumberClass::Undefined,
            ExprKind::Negate(_) | ExprKind::Component(..) | ExprKind::Pick(..) => worst(),
            // A condition is zero and one.
            ExprKind::Summary(_, value, _) if value.ty.shape == Shape::Bool => NumberClass::Finite,
            ExprKind::Summary(Summary::Min | Summary::Max | Summary::Earliest, value, _) => self.number_class(value),
            ExprKind::Summary(Summary::Mean | Summary::Integral, value, _) => counted(self.number_class(value)),
            ExprKind::Call(..) => match range(expr) {
                Some(Range::Counted) => NumberClass::Finite,
                Some(Range::Extreme) => worst().max(NumberClass::Infinite),
                Some(Range::Chosen) => worst(),
                Some(Range::Computed) | None => counted(worst()),
            },
            // Infinities cancel.
            _ => counted(worst()),
        }
    }

    /// The value of a number that is computed from constants alone; `None` also when it is not finite.
    pub fn constant(&self, expr: &Expr) -> Option<f64> {
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

fn never_negative(expr: &Expr) -> bool {
    // No sample of it is, so nothing that is made of them.
    if let ExprKind::Summary(_, value, _) = &expr.kind {
        return value.ty.shape == Shape::Bool || value.ty.shape == Shape::Scalar && never_negative(value);
    }
    ops::of(&expr.kind).is_some_and(|operator| operator.never_negative)
}

/// Returns the table's bounds for the number that a call returns.
fn range(expr: &Expr) -> Option<Range> {
    let places = expr.arguments().len();
    ops::of(&expr.kind)?
        .signatures
        .iter()
        .find(|signature| signature.takes.len() == places)
        .map(|signature| signature.range)
}
