//! The decision graph: checked rules in, one shared graph out. It knows no log; `engine` opens it against the slots of one.
//!
//! Two layers. *Values* are expression nodes; equal expressions are one node, also across signals, latches and trees
//! (an operator with memory too: every operator advances on every frame, so equal operators on equal inputs have equal memory).
//! *Decisions* are the trees with their conditions taken apart at `and`, `or` and `not`: each test has two targets, equal tests with
//! equal targets are one, so the size stays linear in the rules.
//!
//! INVARIANT (order): the arguments of a value stand before it; the targets of a test stand before it.

pub mod compare;
mod decision;
mod lower;
mod reachable_leaves;
mod render;
mod required_channels;
pub mod transitions;

pub use crate::ops::AbstractValue;
pub use decision::{Decision, Leaf, Target, Test};
pub use lower::{lower, lower_values};
pub use reachable_leaves::reachable_leaves;
pub use render::text;
pub use required_channels::{RequiredChannels, required_channels};

use crate::ops::{Summary, TemporalOperator};
use crate::rules::{Arithmetic, ChannelId, Comparison, Function, Hand, Label, LatchId, TreeScope, Type};
use teachtree_base::channels::ChannelSpec;
use teachtree_base::hands::FingerPick;

/// Position in [`Graph::values`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ValueId(pub u32);

impl ValueId {
    /// The position as an index.
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// A number that is compared by its bits, so that it can be part of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct FloatBits(u64);

impl FloatBits {
    /// The number as a key; both zeros differ, since a quotient by them does.
    pub const fn new(number: f64) -> Self {
        Self(number.to_bits())
    }

    /// The number.
    pub fn get(self) -> f64 {
        f64::from_bits(self.0)
    }
}

/// The compiled rules.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    /// The channels that values read; the same list as `Rules::channels`.
    pub channels: Vec<ChannelSpec>,
    /// Expression nodes.
    pub values: Vec<Value>,
    /// Latches in the order in which they are updated.
    pub latches: Vec<Latch>,
    /// The trees.
    pub trees: Vec<Tree>,
    /// Names of labels, for rendering.
    pub label_names: Vec<(Label, String)>,
}

/// An expression node.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Value {
    /// Its computation.
    pub op: Op,
    /// Its arguments.
    pub args: Vec<ValueId>,
    /// Its type.
    pub ty: Type,
}

/// The computation of a value; see `language::rules::ExprKind` for the meaning of each kind.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "each is the operation of the same name in `ExprKind`")]
pub enum Op {
    Bool(bool),
    Number(FloatBits),
    Channel(ChannelId, Hand),
    Latch(LatchId, Hand),
    /// The tree of a hand, or of both hands (`Shared`).
    From {
        tree: Hand,
        labels: Vec<Label>,
        none: bool,
    },
    Pick(FingerPick),
    Component(u8),
    Negate,
    Arithmetic(Arithmetic),
    Compare(Comparison),
    Not,
    And,
    Or,
    Hysteresis {
        on: FloatBits,
        off: FloatBits,
        rising: bool,
    },
    /// With its constants, in SI.
    Temporal(TemporalOperator<FloatBits>),
    /// With the duration in s.
    Rate(FloatBits),
    /// A summary of the samples over a duration in s, or since the second argument began.
    Summary(Summary, Option<FloatBits>),
    Call(Function),
}

/// One bit of memory.
#[derive(Clone, Debug)]
pub struct Latch {
    /// The name, without the hand.
    pub name: String,
    /// Whether every hand has its own; then `set` and `clear` speak of `Hand::This`.
    pub per_hand: bool,
    /// Sets it.
    pub set: ValueId,
    /// Clears it; wins.
    pub clear: ValueId,
}

/// A tree as a decision graph.
#[derive(Clone, Debug)]
pub struct Tree {
    /// The name.
    pub name: String,
    /// Whom it labels; a tree for each hand speaks of `Hand::This`.
    pub scope: TreeScope,
    /// Minimum duration of a leaf, s.
    pub settle_s: f64,
    /// The tests.
    pub decision: Decision,
}

impl Graph {
    /// A value by its id.
    pub fn value(&self, id: ValueId) -> &Value {
        &self.values[id.index()]
    }

    /// Whether its trees give the same leaves as those of another graph on every log: settling may differ.
    pub fn decides_like(&self, other: &Self) -> bool {
        let latches = |graph: &Self| {
            graph.latches.iter().map(|latch| (latch.per_hand, latch.set, latch.clear)).collect::<Vec<_>>()
        };
        let trees = |graph: &Self| {
            graph
                .trees
                .iter()
                .map(|tree| (tree.scope, tree.decision.root, tree.decision.tests.clone()))
                .collect::<Vec<_>>()
        };
        self.channels == other.channels
            && self.values == other.values
            && latches(self) == latches(other)
            && trees(self) == trees(other)
    }

    /// The name of a label.
    pub fn label_name(&self, label: Label) -> &str {
        self.label_names.iter().find(|(known, _)| *known == label).map_or("?", |(_, name)| name.as_str())
    }
}
