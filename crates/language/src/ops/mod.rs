//! The table of the operators of the language: how each is written, what it takes and gives, what it does, and what can be said of its result without a log.
//!
//! The checker of types, the parser, the language server and the proofs read it; `crates/engine/tests/it/language/operators.rs` walks it and holds the
//! evaluators, the editors' grammars and the language reference against it. Signs (`+`, `<`, `and`, `not`) are part of the grammar and have no row.

mod abstract_value;
mod summary;
mod table;
mod temporal_operator;

pub use abstract_value::AbstractValue;
pub use summary::{Samples, Summary};
pub use table::OPERATORS;
pub use temporal_operator::TemporalOperator;

use super::rules::{ExprKind, Function};

/// The kind of an operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A function of values of one frame, element by element.
    Function,
    /// A function that makes one value of all elements of an array, on one frame.
    Set,
    /// An operator with memory or look-ahead.
    Temporal,
}

/// The form of an operator in a checked expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CheckedForm {
    /// `ExprKind::Call`.
    Call(Function),
    /// `ExprKind::Temporal`.
    Temporal,
    /// `ExprKind::Rate`.
    Rate,
    /// `ExprKind::Summary`.
    Summary(Summary),
    /// `ExprKind::Hysteresis`.
    Hysteresis,
    /// The channel `targets.contact`.
    Contact,
}

/// The type of an operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operand {
    /// A condition.
    Condition,
    /// An array of conditions.
    Conditions,
    /// A scalar.
    Scalar,
    /// A scalar of the dimension of the first place.
    SameScalar,
    /// An array of scalars.
    Scalars,
    /// A scalar or vec3.
    Number,
    /// A scalar, vec3 or rotation.
    Value,
    /// A scalar, vec3 or condition.
    NumberOrCondition,
    /// An array of scalars or vec3.
    Numbers,
    /// A vec3.
    Vec3,
    /// A vec3 without a dimension.
    Direction,
    /// A rotation.
    Rotation,
    /// A constant of the dimension of the first place.
    Threshold,
    /// A constant time.
    Duration,
    /// A constant number, how often.
    Times,
    /// `left.what` and `right.what`, one in each of two places.
    OfHand(&'static str),
}

/// The type of the result of an operator. The axis is that of its arguments, unless it is one value of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// A condition.
    Condition,
    /// One condition of an array.
    OneCondition,
    /// A count, a plain number.
    Count,
    /// The type of the first place.
    Same,
    /// An element of the first place.
    Element,
    /// A scalar of the dimension of the first place.
    Length,
    /// A scalar of the product of the dimensions.
    Product,
    /// A vec3 of the product of the dimensions.
    CrossProduct,
    /// A vec3 of the dimension of the first place.
    Vec3,
    /// An angle.
    Angle,
    /// The type of the first place, per time.
    PerTime,
    /// The type of the first place, times time.
    TimesTime,
    /// One force.
    Force,
}

/// The possible values of a computed number when the numbers of the log are finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Range {
    /// A whole number, 0 or more.
    Counted,
    /// One of the arguments, up to its sign.
    Chosen,
    /// An element of an array, or an infinity when it has none.
    Extreme,
    /// Computed: where an argument is infinite it may be not a number.
    Computed,
}

/// One way to write an operator.
#[derive(Clone, Copy, Debug)]
pub struct Signature {
    /// The syntax, with placeholders.
    pub written: &'static str,
    /// The types of its operands, in the order in which they are written.
    pub takes: &'static [Operand],
    /// The type of its result.
    pub gives: Output,
    /// The possible values of a numeric result.
    pub range: Range,
    /// Whether its value is taken over time: `x over last d`, `x since c`.
    pub over_time: bool,
}

/// A row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Operator {
    /// Its words, joined by blanks: `norm`, `within last`.
    pub name: &'static str,
    /// What it is.
    pub kind: Kind,
    /// Its form in a checked expression.
    pub becomes: CheckedForm,
    /// The ways to write it.
    pub signatures: &'static [Signature],
    /// What it gives, in one line.
    pub doc: &'static str,
    /// An expression with it, of a hand under the shipped rules.
    pub example: &'static str,
    /// Whether its number is never negative.
    pub never_negative: bool,
    /// The value of a condition on the first frame of a stretch, if it does not depend on its inputs.
    pub at_start: Option<bool>,
    /// Returns the abstraction of its result from those of its arguments.
    pub known: fn(&[AbstractValue]) -> AbstractValue,
}

impl Operator {
    /// Whether it is written as a call, `name(…)`.
    pub fn is_called(&self) -> bool {
        self.signatures
            .iter()
            .all(|signature| signature.written.split_once('(').is_some_and(|(head, _)| head == self.name))
    }

    /// The ways to write it.
    pub fn calls(&self) -> Vec<&'static str> {
        self.signatures.iter().map(|signature| signature.written).collect()
    }
}

/// The operators that are called, by name.
pub fn functions() -> impl Iterator<Item = &'static Operator> {
    OPERATORS.iter().filter(|operator| operator.is_called())
}

/// The operator that is called by this name.
pub fn function(name: &str) -> Option<&'static Operator> {
    functions().find(|operator| operator.name == name)
}

/// The operator with these words.
pub fn by_name(name: &str) -> Option<&'static Operator> {
    OPERATORS.iter().find(|operator| operator.name == name)
}

/// The operator of an expression, where it has one.
pub fn of(kind: &ExprKind) -> Option<&'static Operator> {
    match kind {
        ExprKind::Call(function, _) => Some(of_function(*function)),
        ExprKind::Temporal(temporal, _) => temporal.operator(),
        ExprKind::Summary(summary, ..) => function(summary.name()),
        ExprKind::Rate(..) => OPERATORS.iter().find(|operator| operator.becomes == CheckedForm::Rate),
        ExprKind::Hysteresis { rising, .. } => by_name(if *rising { "above until below" } else { "below until above" }),
        _ => None,
    }
}

/// The row of a function.
pub fn of_function(function: Function) -> &'static Operator {
    let row = OPERATORS.iter().find(|operator| operator.becomes == CheckedForm::Call(function));
    debug_assert!(row.is_some(), "{function:?} has no row");
    row.unwrap_or(&table::UNKNOWN)
}
