//! The plan of a run: the graph instantiated for the slots of a log, every array taken apart into single numbers and conditions.
//!
//! Three kinds of nodes, each list in evaluation order, equal nodes shared:
//! - *numbers* and *conditions* depend on the log alone; they are evaluated for a block of frames at a time ([`super::columns`]);
//! - *stateful nodes* depend on `from`, or on a latch that does; they are evaluated frame by frame ([`super::machine`]), and only
//!   on frames on which something changes.
//!
//! `within next` looks ahead: its column comes out late. Every column knows its *delay* in frames, columns that meet are brought to
//! the same delay, and the machine runs [`Plan::delay`] frames behind the input.

use crate::temporal_state::PastOperator;
use teachtree_base::hands::Side;
use teachtree_frames::frames::{ColumnKey, Layout};
use teachtree_language::graph::{Decision, FloatBits};
use teachtree_language::ops::{Samples, Summary};
use teachtree_language::rules::{Arithmetic, Comparison, Label, TreeScope};

/// Position in [`Plan::numbers`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NumberId(pub u32);
/// Position in [`Plan::conditions`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BitId(pub u32);
/// Position in [`Plan::stateful`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StatefulId(pub u32);

impl NumberId {
    /// The position as an index.
    #[inline]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}
impl BitId {
    /// The position as an index.
    #[inline]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}
impl StatefulId {
    /// The position as an index.
    #[inline]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// A position in a list of a plan. (Rules are a few megabytes at most, so plans are far from so long.)
#[allow(clippy::cast_possible_truncation, reason = "asserted")]
pub fn position(len: usize) -> u32 {
    debug_assert!(u32::try_from(len).is_ok(), "a plan of {len} nodes");
    len as u32
}

/// A vector, or the difference of two vectors without other users.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Vector {
    /// Its components.
    pub of: [NumberId; 3],
    /// The subtrahend.
    pub minus: Option<[NumberId; 3]>,
}

impl Vector {
    /// The numbers that it is made of.
    pub fn numbers(&self) -> impl Iterator<Item = NumberId> {
        self.of.into_iter().chain(self.minus.into_iter().flatten())
    }
}

/// A number per frame.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Number {
    /// A column of the log, by its position in [`Plan::inputs`].
    Input(u32),
    /// The same on every frame.
    Constant(FloatBits),
    /// `-a`.
    Negate(NumberId),
    /// `|a|`.
    Abs(NumberId),
    /// `a op b`.
    Arithmetic(Arithmetic, NumberId, NumberId),
    /// All of them, added from the first to the last; at least one.
    Sum(Vec<NumberId>),
    /// `ax*bx + ay*by + az*bz`.
    Dot([NumberId; 3], [NumberId; 3]),
    /// `a - b * c`.
    MulSub(NumberId, NumberId, NumberId),
    /// The angle of the point `(x, y)`, rad, of y and x.
    Atan2(NumberId, NumberId),
    /// `sqrt(x*x + y*y + z*z)`.
    Norm(Vector),
    /// The smaller; NaN loses.
    Min(NumberId, NumberId),
    /// The larger; NaN loses.
    Max(NumberId, NumberId),
    /// The number of true conditions.
    Count(Vec<BitId>),
    /// `(a - a before n frames) / (n / rate)`; 0 on the first `n` frames and after a restart.
    Rate {
        /// a.
        number: NumberId,
        /// n.
        frames: u32,
        /// Where to begin anew.
        restart: Option<BitId>,
    },
    /// A summary of the samples of a number.
    Summary {
        /// The kind of the summary.
        summary: Summary,
        /// The number.
        number: NumberId,
        /// The number of frames, or the condition since whose beginning samples count.
        samples: Samples<u32, BitId>,
        /// Where to begin anew.
        restart: Option<BitId>,
    },
    /// `a`, that many frames later.
    Delay(NumberId, u32),
}

/// True or false per frame.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Condition {
    /// A column of the log that is above one half.
    Input(u32),
    /// The same on every frame.
    Constant(bool),
    /// Whether the leaf of the frame before is one of some, by position in [`Plan::leaves`].
    Leaf(u32),
    /// Whether this is a frame of the log, rather than one after its end that lets delayed columns come out.
    InLog,
    /// Whether this is the first frame of a stretch.
    FirstFrame,
    /// Whether a column of the log differs from the frame before; false on the first frame.
    Changes(u32),
    /// `a op b`; false when one is NaN, except `!=`.
    Compare(Comparison, NumberId, NumberId),
    /// `x*x + y*y + z*z op c`: a length compared with a constant needs no root ([`super::instantiate`]).
    NormSquaredCmp(Comparison, Vector, FloatBits),
    /// Not a.
    Not(BitId),
    /// All of them; true of none.
    And(Vec<BitId>),
    /// At least one of them; false of none.
    Or(Vec<BitId>),
    /// At least this number of the bits, which is more than one and less than all of them.
    AtLeast(Vec<BitId>, u32),
    /// A flip-flop: set, else kept.
    FlipFlop {
        /// Becomes true.
        set: BitId,
        /// Stays as it was on the frame before, unless `set`.
        keep: BitId,
    },
    /// An operator over time on a, and where to begin anew.
    Temporal(PastOperator, BitId, Option<BitId>),
    /// `a`, that many frames later.
    Delay(BitId, u32),
}

/// True or false per frame, known only when the frame before is labeled.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum StatefulNode {
    /// A condition of the log, by its position in [`Plan::imports`].
    Import(u32),
    /// The leaf of the frame before in this tree was one of these.
    From {
        /// Position in [`Plan::trees`].
        tree: u32,
        /// Labels, unsided ones for both sides.
        labels: Vec<Label>,
        /// Whether the first frame counts.
        none: bool,
    },
    /// The same on every frame.
    Constant(bool),
    /// Not a.
    Not(StatefulId),
    /// All of them.
    And(Vec<StatefulId>),
    /// At least one of them.
    Or(Vec<StatefulId>),
    /// The number of true conditions, compared with a number.
    Count(Vec<StatefulId>, Comparison, FloatBits),
    /// Set, else kept; the flag of memory number.
    Latch {
        /// Sets it, unless `clear`.
        set: StatefulId,
        /// Clears it.
        clear: StatefulId,
        /// Where to begin anew.
        restart: Option<StatefulId>,
    },
    /// An operator over time on a, and where to begin anew.
    Temporal(PastOperator, StatefulId, Option<StatefulId>),
}

/// The next step of the evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// A number.
    Number(NumberId),
    /// A condition.
    Condition(BitId),
}

/// A tree instantiated for a hand, or for both.
#[derive(Clone, Debug)]
pub struct TreeInstance {
    /// Whom it labels.
    pub scope: TreeScope,
    /// The hand, for a tree for each hand.
    pub side: Option<Side>,
    /// The tests.
    pub decision: Decision<StatefulId>,
}

/// Whether the leaf of the frame before is one of some.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct PreviousLeaf {
    /// The hand of the tree, none for the one over both.
    pub tree: Option<Side>,
    /// Labels, unsided ones for both sides.
    pub labels: Vec<Label>,
    /// Whether the first frame counts.
    pub none: bool,
}

/// The plan.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// The slots it was instantiated for.
    pub layout: Layout,
    /// The columns that a block brings, in this order.
    pub inputs: Vec<ColumnKey>,
    /// Numbers with their delays.
    pub numbers: Vec<(Number, u32)>,
    /// Conditions with their delays.
    pub conditions: Vec<(Condition, u32)>,
    /// Numbers and conditions in the order of evaluation.
    pub steps: Vec<Step>,
    /// The conditions that the machine reads; all have the delay of the plan.
    pub imports: Vec<BitId>,
    /// The queries about known leaves; empty without known leaves.
    pub leaves: Vec<PreviousLeaf>,
    /// The numbers and conditions whose columns are read when they were evaluated.
    pub outputs: Vec<Step>,
    /// Memories.
    pub stateful: Vec<StatefulNode>,
    /// The trees: hands first, then both.
    pub trees: Vec<TreeInstance>,
    /// The delay of the machine behind the input, frames.
    pub delay: u32,
}

/// The cost of a run, determined before the first frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cost {
    /// Numbers computed per frame.
    pub numbers: usize,
    /// Conditions computed per frame.
    pub conditions: usize,
    /// Conditions with memory of labels, computed on frames on which something changes.
    pub stateful: usize,
    /// Tests on the longest paths through all trees.
    pub tests: usize,
    /// Bytes of memory from one frame to the next.
    pub state_bytes: usize,
    /// Frames that the engine looks ahead, before settling.
    pub look_ahead_frames: u32,
}

impl Plan {
    /// A number that is the same on every frame.
    #[inline]
    pub fn constant(&self, id: NumberId) -> Option<f64> {
        match self.numbers[id.index()].0 {
            Number::Constant(number) => Some(number.get()),
            _ => None,
        }
    }

    /// Returns the delay of a step's column behind the input, frames.
    pub fn delay_of(&self, step: Step) -> u32 {
        match step {
            Step::Number(id) => self.numbers[id.index()].1,
            Step::Condition(id) => self.conditions[id.index()].1,
        }
    }

    /// The position among the inputs of a number that is a column of the log.
    pub fn input_of(&self, id: NumberId) -> Option<usize> {
        match self.numbers[id.index()].0 {
            Number::Input(column) => Some(column as usize),
            _ => None,
        }
    }

    /// The numbers and conditions that a step reads.
    pub fn reads(&self, step: Step) -> (Vec<NumberId>, Vec<BitId>) {
        match step {
            Step::Number(id) => match &self.numbers[id.index()].0 {
                Number::Input(_) | Number::Constant(_) => (vec![], vec![]),
                Number::Negate(a) | Number::Abs(a) | Number::Delay(a, _) => (vec![*a], vec![]),
                Number::Arithmetic(_, a, b) | Number::Min(a, b) | Number::Max(a, b) | Number::Atan2(a, b) => {
                    (vec![*a, *b], vec![])
                }
                Number::Sum(all) => (all.clone(), vec![]),
                Number::Dot(a, b) => ([*a, *b].concat(), vec![]),
                Number::MulSub(a, b, c) => (vec![*a, *b, *c], vec![]),
                Number::Norm(vector) => (vector.numbers().collect(), vec![]),
                Number::Count(bits) => (vec![], bits.clone()),
                Number::Rate { number, restart, .. } => (vec![*number], restart.iter().copied().collect()),
                Number::Summary { number, samples, restart, .. } => {
                    (vec![*number], samples.since().into_iter().chain(restart).copied().collect())
                }
            },
            Step::Condition(id) => match &self.conditions[id.index()].0 {
                Condition::Input(_)
                | Condition::Constant(_)
                | Condition::Leaf(_)
                | Condition::InLog
                | Condition::FirstFrame
                | Condition::Changes(_) => (vec![], vec![]),
                Condition::Compare(_, a, b) => (vec![*a, *b], vec![]),
                Condition::NormSquaredCmp(_, vector, _) => (vector.numbers().collect(), vec![]),
                Condition::Not(a) | Condition::Delay(a, _) => (vec![], vec![*a]),
                Condition::And(bits) | Condition::Or(bits) | Condition::AtLeast(bits, _) => (vec![], bits.clone()),
                Condition::FlipFlop { set, keep } => (vec![], vec![*set, *keep]),
                Condition::Temporal(_, a, restart) => (vec![], std::iter::once(*a).chain(*restart).collect()),
            },
        }
    }

    /// Leaves out the steps that nothing reads which the machine reads.
    pub fn drop_unread(&mut self) {
        let mut numbers = vec![false; self.numbers.len()];
        let mut conditions = vec![false; self.conditions.len()];
        for import in &self.imports {
            conditions[import.index()] = true;
        }
        for output in &self.outputs {
            match output {
                Step::Number(id) => numbers[id.index()] = true,
                Step::Condition(id) => conditions[id.index()] = true,
            }
        }
        let mut steps = std::mem::take(&mut self.steps);
        // Whatever is read was made before: from the last step to the first.
        for step in steps.iter().rev() {
            let read = match step {
                Step::Number(id) => numbers[id.index()],
                Step::Condition(id) => conditions[id.index()],
            };
            if read {
                let (of_numbers, of_conditions) = self.reads(*step);
                of_numbers.iter().for_each(|id| numbers[id.index()] = true);
                of_conditions.iter().for_each(|id| conditions[id.index()] = true);
            }
        }
        steps.retain(|step| match step {
            Step::Number(id) => numbers[id.index()],
            Step::Condition(id) => conditions[id.index()],
        });
        self.steps = steps;
    }

    /// Returns the cost of a run.
    pub fn cost(&self) -> Cost {
        let words = |frames: u32| (frames as usize).div_ceil(64) * 8;
        let steps = || self.steps.iter();
        let numbers = || {
            steps()
                .filter_map(|step| if let Step::Number(id) = step { Some(&self.numbers[id.index()].0) } else { None })
        };
        let conditions = || {
            steps().filter_map(
                |step| if let Step::Condition(id) = step { Some(&self.conditions[id.index()].0) } else { None },
            )
        };
        let kept_numbers = numbers().map(|number| match number {
            Number::Rate { frames, .. } => *frames as usize * 8 + 12,
            Number::Summary { samples, .. } => samples.last().map_or(0, |frames| *frames as usize * 8) + 24,
            Number::Delay(_, frames) => *frames as usize * 8 + 8,
            _ => 0,
        });
        let kept_conditions = conditions().map(|condition| match condition {
            Condition::Delay(_, frames) => words(*frames) + 8,
            Condition::Temporal(operator, ..) => operator.bytes(),
            Condition::Changes(_) => 8,
            Condition::FlipFlop { .. } => 1,
            _ => 0,
        });
        let stateful = self.stateful.iter().map(|memory| match memory {
            // Frames are counted, fewer than 2^32.
            StatefulNode::Temporal(PastOperator::For(_) | PastOperator::WithinLast(_), ..) => 4,
            StatefulNode::Temporal(operator, ..) => operator.bytes(),
            StatefulNode::Latch { .. } => 1,
            _ => 0,
        });
        Cost {
            numbers: numbers().count(),
            conditions: conditions().count(),
            stateful: self.stateful.len(),
            tests: self.trees.iter().map(|tree| tree.decision.depth()).sum(),
            state_bytes: kept_numbers.sum::<usize>()
                + kept_conditions.sum::<usize>()
                + stateful.sum::<usize>()
                + self.trees.len() * std::mem::size_of::<Label>(),
            look_ahead_frames: self.delay,
        }
    }
}
