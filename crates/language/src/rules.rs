//! The checked rule set: what the language front end hands to `graph`, `engine` and `analysis`.
//!
//! Every name is resolved to an id, every expression has a type with its dimension, every `extend` is spliced in,
//! every list stands in the order in which it is evaluated. All numbers are SI. There is nothing left that could fail
//! except that a log lacks what a channel needs, or has a rate that cannot honour a duration.

mod expr;
mod kinds;
mod lookup;
mod paths;

pub use expr::{Arithmetic, Comparison, Constant, Expr, ExprKind, Function, LEAST_SAMPLES, MOST_TIMES};
pub use kinds::{MOST_KINDS, Pattern};
pub use lookup::folded;
pub use paths::LeafPath;

use teachtree_base::channels::{Axis, ChannelSpec, Shape};
use teachtree_base::diagnostic::{Sources, Span};
use teachtree_base::hands::Side;
use teachtree_base::meaning::Meaning;
use teachtree_base::units::Dimension;

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $name(pub u32);
        impl $name {
            /// The position in the list of its kind.
            pub const fn index(self) -> usize {
                self.0 as usize
            }
        }
    };
}

id!(/// Position in [`Rules::params`].
    ParamId);
id!(/// Position in [`Rules::channels`].
    ChannelId);
id!(/// Position in [`Rules::signals`].
    SignalId);
id!(/// Position in [`Rules::latches`].
    LatchId);
id!(/// Position in [`Rules::primitives`].
    PrimitiveId);
id!(/// Position in [`Rules::tasks`].
    TaskId);

/// A checked rule set.
#[derive(Clone, Debug, Default)]
pub struct Rules {
    /// The files it came from, the first one as the user named it.
    pub sources: Sources,
    /// Named thresholds and durations.
    pub params: Vec<Param>,
    /// The channels that any expression reads (raw ones declared in `stream`, derived ones), each once.
    pub channels: Vec<ChannelSpec>,
    /// Signals; each reads only channels and earlier signals.
    pub signals: Vec<Signal>,
    /// Latches; each reads signals, earlier latches and `from`.
    pub latches: Vec<Latch>,
    /// Primitives in order of declaration.
    pub primitives: Vec<Primitive>,
    /// The trees: at most one for each hand, at most one over both hands.
    pub trees: Vec<Tree>,
    /// Tasks by priority: the first that matches names the task.
    pub tasks: Vec<Task>,
    /// Tasks that are made of tasks, by priority.
    pub composites: Vec<Composite>,
    /// Relabeling rules in order.
    pub relabels: Vec<RelabelRule>,
}

/// A named threshold or duration.
#[derive(Clone, Debug, PartialEq)]
pub struct Param {
    /// The name.
    pub name: String,
    /// The value, SI, overrides applied.
    pub value: f64,
    /// The dimension.
    pub dimension: Dimension,
    /// The declared range, SI: what `fit` may search.
    pub range: Option<(f64, f64)>,
    /// Where it is declared.
    pub span: Span,
}

/// The type of an expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Type {
    /// The type of an element.
    pub shape: Shape,
    /// The dimension of an element.
    pub dimension: Dimension,
    /// The array it runs over, if it is one, and whose.
    pub axis: Option<(Axis, Hand)>,
}

impl Type {
    /// A single true or false.
    pub const BOOL: Self = Self { shape: Shape::Bool, dimension: Dimension::NONE, axis: None };
}

/// The hand to which a value belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Hand {
    /// The current hand: inside `for each hand`.
    This,
    /// The opposite hand: `other.load` inside `for each hand`.
    Other,
    /// A hand by name: `left.load`.
    Named(Side),
    /// Neither hand: the value is declared once, not per hand.
    Shared,
}

impl Hand {
    /// Returns the hand of the value in a declaration or tree of the hand `this`; `None` for a value that is declared once.
    pub const fn side(self, this: Option<Side>) -> Option<Side> {
        match self {
            Self::This => this,
            Self::Other => match this {
                Some(this) => Some(this.other()),
                None => None,
            },
            Self::Named(side) => Some(side),
            Self::Shared => None,
        }
    }

    /// Returns the hand of the value as seen from outside a declaration or tree of the hand `this`.
    #[must_use]
    pub const fn seen_from(self, this: Self) -> Self {
        match (self, this) {
            (Self::This, this) => this,
            (Self::Other, Self::This) => Self::Other,
            (Self::Other, Self::Other) => Self::This,
            (Self::Other, Self::Named(side)) => Self::Named(side.other()),
            (Self::Other, Self::Shared) => Self::Shared,
            (whose @ (Self::Named(_) | Self::Shared), _) => whose,
        }
    }
}

/// A value per frame.
#[derive(Clone, Debug)]
pub struct Signal {
    /// The name, without the hand.
    pub name: String,
    /// Whether every hand has its own.
    pub per_hand: bool,
    /// Its type.
    pub ty: Type,
    /// What it is.
    pub expr: Expr,
}

/// One bit of memory. After both conditions are known on a frame: cleared when `clear` holds, else set when `set` holds.
#[derive(Clone, Debug)]
pub struct Latch {
    /// The name, without the hand.
    pub name: String,
    /// Whether every hand has its own.
    pub per_hand: bool,
    /// Sets it.
    pub set: Expr,
    /// Clears it; wins.
    pub clear: Expr,
    /// Where it is declared.
    pub span: Span,
}

/// A primitive motion. It is a kind of another one, or says what a hand does, or neither.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Primitive {
    /// The name.
    pub name: String,
    /// Whether it is sided: `MainGrasp(side)`.
    pub sided: bool,
    /// The primitive that it is a kind of.
    pub is: Option<PrimitiveId>,
    /// What a hand does in it, if it is not a kind of another one; of a sided one, the hand of its side.
    pub does: Option<Meaning>,
    /// What the other hand does in a sided one, if that is something else.
    pub other: Option<Meaning>,
    /// Where it is declared.
    pub span: Span,
}

/// A primitive with its side. In a leaf the side is given exactly when the primitive is sided; in a pattern it may be left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Label {
    /// The primitive.
    pub primitive: PrimitiveId,
    /// The side of a sided primitive.
    pub side: Option<Side>,
}

impl Label {
    /// Whether this pattern stands for `label`.
    pub fn covers(self, label: Self) -> bool {
        self.primitive == label.primitive && (self.side.is_none() || self.side == label.side)
    }
}

/// An ordered, guarded decision tree.
#[derive(Clone, Debug)]
pub struct Tree {
    /// The name.
    pub name: String,
    /// Whom it labels.
    pub scope: TreeScope,
    /// How long a leaf must last.
    pub settle: Option<Constant>,
    /// Its choices.
    pub root: Branch,
    /// Where it is declared.
    pub span: Span,
}

/// Whom a tree labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TreeScope {
    /// `for each hand`.
    EachHand,
    /// `for left, right`.
    BothHands,
}

/// Choices; the first whose condition holds is taken, for good. They are exhaustive: the last one is `else`, or it was proved.
#[derive(Clone, Debug)]
pub struct Branch {
    /// The choices in order, extensions spliced in.
    pub choices: Vec<Choice>,
    /// Where it stands.
    pub span: Span,
}

/// One choice.
#[derive(Clone, Debug)]
pub struct Choice {
    /// Its name, if it has one.
    pub name: Option<String>,
    /// Its condition; `None` for `else`.
    pub condition: Option<Expr>,
    /// What follows.
    pub then: Consequent,
    /// Where it stands; its file names the extension that brought it.
    pub span: Span,
}

/// The consequent of a choice: a leaf or more choices.
#[derive(Clone, Debug)]
pub enum Consequent {
    /// A leaf: this primitive.
    Primitive(Label),
    /// A leaf that keeps the primitive of the frame before. Never reachable from `none`.
    Stay,
    /// A leaf of a tree over both hands: no coordination, each hand's own tree counts.
    Separate,
    /// More choices.
    Branch(Branch),
}

/// A task: a span of segments from `first` to `last` that has the keys.
#[derive(Clone, Debug)]
pub struct Task {
    /// The name.
    pub name: String,
    /// The primitive that opens the span.
    pub first: Pattern,
    /// The primitive that closes it.
    pub last: Pattern,
    /// Keys: any of them, or all of them.
    pub keys: Vec<Key>,
    /// Whether all keys are needed (`and`) rather than any (`or`).
    pub all_keys: bool,
    /// Primitives that must not occur.
    pub without: Vec<Label>,
    /// Whether a new touch after `last`, without a `first` in between, continues the same task.
    pub joined: bool,
    /// Whether it is a failure; every other task is a success.
    pub failure: bool,
    /// Where it is declared.
    pub span: Span,
}

/// A task that is made of tasks of one hand, one after the other.
#[derive(Clone, Debug)]
pub struct Composite {
    /// The name.
    pub name: String,
    /// The tasks, in order; at least one.
    pub parts: Vec<Part>,
    /// Whether it is a failure; every other one is a success.
    pub failure: bool,
    /// Where it is declared.
    pub span: Span,
}

/// A task within a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// The task.
    pub task: TaskId,
    /// Whether it may come several times in a row.
    pub many: bool,
}

/// A key primitive of a task with what it must have reached.
#[derive(Clone, Debug)]
pub struct Key {
    /// The primitive.
    pub label: Pattern,
    /// `lasting 150 ms`: a segment at least that long.
    pub lasting: Option<Constant>,
    /// `travelling 20 mm`: the target got at least that far from where it was when the segment began.
    pub travelling: Option<Constant>,
    /// `turning 10 deg`: the target turned by at least that angle within the segments of this primitive.
    pub turning: Option<Constant>,
    /// Where it stands.
    pub span: Span,
}

/// A relabeling rule.
#[derive(Clone, Debug)]
pub struct RelabelRule {
    /// The task it is for; `None` runs before recognition.
    pub task: Option<TaskId>,
    /// What it does.
    pub kind: RelabelKind,
    /// The rule as its author wrote it, blanks folded: the trail (`by`) of a rewritten segment.
    pub text: String,
    /// Where it stands.
    pub span: Span,
}

/// Alternatives `(P or Q)`.
pub type Labels = Vec<Label>;

/// What a relabeling rule does. The time of rewritten segments belongs to the surviving label.
#[derive(Clone, Debug)]
pub enum RelabelKind {
    /// `X [shorter than d] between A and B becomes C`; with `run`, X is `(P or Q)+`: one or more neighbors.
    Between {
        /// X.
        what: Labels,
        /// Whether X is a run.
        run: bool,
        /// Only when all of X together is shorter than this time, or takes the target less far than this length.
        shorter: Option<Constant>,
        /// A and B.
        between: (Labels, Labels),
        /// C.
        becomes: Label,
    },
    /// `X between A and B in one hand and between C and D in the other becomes E`: looks at both hands' tracks at the same interval.
    BetweenInHands {
        /// X.
        what: Labels,
        /// Whether X is a run.
        run: bool,
        /// Only when all of X together is shorter than this time, or takes the target less far than this length.
        shorter: Option<Constant>,
        /// A and B in one hand.
        one: (Labels, Labels),
        /// C and D in the other.
        other: (Labels, Labels),
        /// E, in both hands; `None` gives the time back to the hands' own trees (`separate`).
        becomes: Option<Label>,
    },
    /// `X, Y become Z`.
    Become {
        /// X, Y.
        what: Labels,
        /// Z.
        becomes: Label,
    },
    /// `sequence A, (B or C)*, D becomes E`.
    Sequence {
        /// The elements.
        elements: Vec<(Labels, Repetition)>,
        /// E.
        becomes: Label,
    },
    /// `X in both without K, L becomes separate`: an interval of coordination with label X, in a stretch of coordination without K and L,
    /// is given back to the hands' own trees.
    Separate {
        /// X.
        what: Labels,
        /// K, L.
        without: Labels,
    },
}

impl RelabelKind {
    /// The bound on what is rewritten: a time, or a way of the target.
    pub const fn shorter(&self) -> Option<&Constant> {
        match self {
            Self::Between { shorter, .. } | Self::BetweenInHands { shorter, .. } => shorter.as_ref(),
            Self::Become { .. } | Self::Sequence { .. } | Self::Separate { .. } => None,
        }
    }

    /// That bound, if it is a time.
    pub fn shorter_time(&self) -> Option<&Constant> {
        self.shorter().filter(|limit| limit.dimension == Dimension::TIME)
    }

    /// That bound, if it is a way of the target.
    pub fn shorter_way(&self) -> Option<&Constant> {
        self.shorter().filter(|limit| limit.dimension == Dimension::LENGTH)
    }

    /// The label that it gives; `None` where it gives coordination back to the hands.
    pub const fn becomes(&self) -> Option<Label> {
        match self {
            Self::Between { becomes, .. } | Self::Become { becomes, .. } | Self::Sequence { becomes, .. } => {
                Some(*becomes)
            }
            Self::BetweenInHands { becomes, .. } => *becomes,
            Self::Separate { .. } => None,
        }
    }

    /// The labels that it rewrites.
    pub fn rewrites(&self) -> Labels {
        match self {
            Self::Between { what, .. }
            | Self::BetweenInHands { what, .. }
            | Self::Become { what, .. }
            | Self::Separate { what, .. } => what.clone(),
            Self::Sequence { elements, .. } => elements.iter().flat_map(|(labels, _)| labels).copied().collect(),
        }
    }
}

/// How often an element of a sequence stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Repetition {
    /// Once.
    Once,
    /// Any number of times, also none: `*`.
    ZeroOrMore,
    /// Once or more: `+`.
    OneOrMore,
}
