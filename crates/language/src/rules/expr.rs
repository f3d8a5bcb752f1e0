//! Expressions of a checked rule set: every name is an id, every piece has its type, all numbers are SI.

use super::{ChannelId, Hand, Label, LatchId, ParamId, SignalId, Type};
use crate::ops::{Samples, Summary, TemporalOperator};
use teachtree_base::diagnostic::Span;
use teachtree_base::hands::FingerPick;
use teachtree_base::units::Dimension;

/// An expression with its type.
#[derive(Clone, Debug)]
pub struct Expr {
    /// What it computes.
    pub kind: ExprKind,
    /// Its type.
    pub ty: Type,
    /// Where it stands.
    pub span: Span,
}

/// What an expression computes. Operators map over arrays; a single value beside an array is used for every element.
#[derive(Clone, Debug)]
pub enum ExprKind {
    /// `true`, `false`.
    Bool(bool),
    /// A number in SI.
    Number(f64),
    /// A param.
    Param(ParamId),
    /// A channel of the log or a derived one.
    Channel(ChannelId, Hand),
    /// A signal.
    Signal(SignalId, Hand),
    /// A latch: its bit after this frame's update (in a tree), or the bit so far (in a later latch, also after its update).
    Latch(LatchId, Hand),
    /// `touches[thumb]`, `touches[opposing]`.
    Pick(Box<Expr>, FingerPick),
    /// `.x`, `.y`, `.z` as 0, 1, 2.
    Component(Box<Expr>, u8),
    /// `-x`.
    Negate(Box<Expr>),
    /// `a + b`, `a - b`, `a * b`, `a / b`; `vec3 * scalar` and `vec3 / scalar` too.
    Arithmetic(Arithmetic, Box<Expr>, Box<Expr>),
    /// A comparison of scalars, or `==` and `!=` of objects.
    Compare(Comparison, Box<Expr>, Box<Expr>),
    /// `not a`.
    Not(Box<Expr>),
    /// `a and b and …`, two or more.
    And(Vec<Expr>),
    /// `a or b or …`, two or more.
    Or(Vec<Expr>),
    /// `x above on until below off` when `rising`; `x below on until above off` when not. Thresholds are constant.
    Hysteresis {
        /// The quantity.
        value: Box<Expr>,
        /// Threshold to become true (strictly beyond).
        on: Constant,
        /// Threshold to become false again (strictly beyond).
        off: Constant,
        /// Whether true is above.
        rising: bool,
    },
    /// An operator over time on a condition: `(c) for d`, `rises(c)`.
    Temporal(TemporalOperator<Constant>, Box<Expr>),
    /// `rate(x, d)`: the difference over `d`, divided by `d`; 0 until `d` has passed.
    Rate(Box<Expr>, Constant),
    /// `mean(x over last d)`, `earliest(x since c)`: what is made of the samples of a number, or of a condition.
    Summary(Summary, Box<Expr>, Samples<Constant, Box<Expr>>),
    /// A function.
    Call(Function, Vec<Expr>),
    /// `from(A, B, none)`: the tree's own leaf of the frame before, before settling. In a declaration per hand: of that hand's tree.
    From {
        /// Labels; an unsided label of a sided primitive stands for both sides.
        labels: Vec<Label>,
        /// Whether `none` is listed.
        none: bool,
    },
}

/// The most often that a condition is counted.
pub const MOST_TIMES: f64 = 1000.0;

/// A constant scalar: its value now, and the params it was computed from (for `--set`, `fit` and explanations).
#[derive(Clone, Debug, PartialEq)]
pub struct Constant {
    /// The value, SI.
    pub value: f64,
    /// Its dimension.
    pub dimension: Dimension,
    /// The params that it names.
    pub params: Vec<ParamId>,
    /// Where it stands.
    pub span: Span,
}

/// An operation on numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Arithmetic {
    /// Sum.
    Add,
    /// Difference.
    Subtract,
    /// Product.
    Multiply,
    /// Quotient; a division by zero gives an infinity or NaN, and every comparison with NaN is false.
    Divide,
}

impl Arithmetic {
    /// The result.
    pub fn apply(self, a: f64, b: f64) -> f64 {
        match self {
            Self::Add => a + b,
            Self::Subtract => a - b,
            Self::Multiply => a * b,
            Self::Divide => a / b,
        }
    }
}

/// A comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Comparison {
    /// `<`
    Less,
    /// `<=`
    LessEqual,
    /// `>`
    Greater,
    /// `>=`
    GreaterEqual,
    /// `==`
    Equal,
    /// `!=`
    NotEqual,
}

impl Comparison {
    /// Whether it holds; with NaN only `!=` does.
    #[allow(clippy::float_cmp, reason = "the language compares as it is written")]
    pub fn holds(self, a: f64, b: f64) -> bool {
        match self {
            Self::Less => a < b,
            Self::LessEqual => a <= b,
            Self::Greater => a > b,
            Self::GreaterEqual => a >= b,
            Self::Equal => a == b,
            Self::NotEqual => a != b,
        }
    }

    /// The comparison with its sides exchanged: `a < b` is `b > a`.
    #[must_use]
    pub const fn swapped(self) -> Self {
        match self {
            Self::Less => Self::Greater,
            Self::LessEqual => Self::GreaterEqual,
            Self::Greater => Self::Less,
            Self::GreaterEqual => Self::LessEqual,
            same @ (Self::Equal | Self::NotEqual) => same,
        }
    }
}

/// The shortest duration that a log honors, in samples: half a percent below one, for a rate that is only nearly round.
pub const LEAST_SAMPLES: f64 = 0.995;

/// A function of the language.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Function {
    /// `abs(x)` of a scalar.
    Abs,
    /// `norm(v)` of a vec3: `sqrt(x*x + y*y + z*z)`.
    Norm,
    /// `dot(a, b)`: `ax*bx + ay*by + az*bz`.
    Dot,
    /// `tangential(v, n)`: `v - n * dot(v, n)`.
    Tangential,
    /// `vec3(x, y, z)` of three scalars of one dimension.
    Vec3,
    /// `cross(a, b)` of two vec3.
    Cross,
    /// `angle(a, b)`, rad, 0 to π: of two vec3 `atan2(norm(cross(a, b)), dot(a, b))`; of two rotations `2 atan2(norm(v), |w|)` of the quaternion
    /// `(w, v)` that takes one to the other.
    Angle,
    /// `in_frame(v, r)`: a vec3 of the reference frame in the frame that `r` turns the reference frame to, `r⁻¹ v`.
    InFrame,
    /// `from_frame(v, r)`: a vec3 of that frame in the reference frame, `r v`.
    FromFrame,
    /// `sum(array)` of scalars or vec3, from the first slot to the last; zero for an empty array.
    Sum,
    /// `mean(array)`: the sum divided by the number of slots; zero for an empty array.
    Mean,
    /// `min(array)` of scalars, or `min(a, b)`; +infinity for an empty array.
    Min,
    /// `max(array)` of scalars, or `max(a, b)`; -infinity for an empty array.
    Max,
    /// `count(array)` of bools: how many are true.
    Count,
    /// `any(array)` of bools.
    Any,
    /// `all(array)` of bools.
    All,
    /// `squeeze_of(left.fingers, right.fingers)`: `(sum of norms - norm of sum) / 2` over the finger forces of both hands;
    /// its two arguments are the channels `fingers.force` of the hands.
    SqueezeOf,
}

/// The expressions that an expression is made of, shared or to be changed.
macro_rules! arguments {
    ($kind:expr, $iter:ident) => {
        match $kind {
            ExprKind::Bool(_)
            | ExprKind::Number(_)
            | ExprKind::Param(_)
            | ExprKind::Channel(..)
            | ExprKind::Signal(..)
            | ExprKind::Latch(..)
            | ExprKind::From { .. } => Vec::new(),
            ExprKind::Pick(one, _)
            | ExprKind::Component(one, _)
            | ExprKind::Negate(one)
            | ExprKind::Not(one)
            | ExprKind::Hysteresis { value: one, .. }
            | ExprKind::Temporal(_, one)
            | ExprKind::Rate(one, _)
            | ExprKind::Summary(_, one, Samples::Last(_)) => vec![one],
            ExprKind::Arithmetic(_, one, two)
            | ExprKind::Compare(_, one, two)
            | ExprKind::Summary(_, one, Samples::Since(two)) => vec![one, two],
            ExprKind::And(many) | ExprKind::Or(many) | ExprKind::Call(_, many) => many.$iter().collect(),
        }
    };
}

impl Expr {
    /// The expressions that this one is made of; constants are not among them.
    pub fn arguments(&self) -> Vec<&Self> {
        arguments!(&self.kind, iter)
    }

    /// The same expressions, to be changed.
    pub fn arguments_mut(&mut self) -> Vec<&mut Self> {
        arguments!(&mut self.kind, iter_mut)
    }

    /// Whether it reads something of the hand at hand.
    pub fn reads_this_hand(&self) -> bool {
        let mut reads = false;
        self.walk(&mut |part| {
            reads |= matches!(
                part.kind,
                ExprKind::Channel(_, Hand::This | Hand::Other)
                    | ExprKind::Signal(_, Hand::This | Hand::Other)
                    | ExprKind::Latch(_, Hand::This | Hand::Other)
            );
        });
        reads
    }

    /// Whether it is computed from a param.
    pub fn reads_params(&self) -> bool {
        let mut reads = false;
        self.walk(&mut |part| {
            reads |= match &part.kind {
                ExprKind::Param(_) => true,
                ExprKind::Hysteresis { on, off, .. } => !on.params.is_empty() || !off.params.is_empty(),
                _ => false,
            };
        });
        reads
    }

    /// Calls `visit` for this expression and everything in it.
    pub fn walk<'a>(&'a self, visit: &mut dyn FnMut(&'a Self)) {
        visit(self);
        for argument in self.arguments() {
            argument.walk(visit);
        }
    }
}
