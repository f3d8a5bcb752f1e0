//! The leaves that the trees can reach when some channels have no values.
//!
//! Every value is either one constant in all its elements and components, or an empty array, or unknown. A tree is walked along both
//! ways of a test whose condition is unknown, and the condition is known from there on: a later test of it goes the same way. `from` holds only of
//! leaves that are reached, so the walk is repeated until nothing is added.

use super::{Decision, Graph, Leaf, Op, Target, ValueId};
use crate::ops::{AbstractValue, Summary, of_function};
use crate::rules::{Arithmetic, ChannelId, Comparison, Function, Hand, Label, TreeScope};
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::hands::FingerPick;

/// The labels that trees can reach: of a hand's tree where `scope` is `EachHand`, of the tree over both hands else. `has` says whether a hand
/// has one of the fingers that a rule picks of it.
pub fn reachable_leaves(
    graph: &Graph,
    scope: TreeScope,
    channel: impl Fn(ChannelId, Hand) -> AbstractValue,
    has: impl Fn(FingerPick, Hand) -> bool,
) -> BTreeSet<Label> {
    let mut reached: BTreeSet<Label> = BTreeSet::new();
    loop {
        let this = if scope == TreeScope::EachHand { Hand::This } else { Hand::Shared };
        let (channel, has) = (&channel, &has);
        let mut walk = Walk { graph, channel, has, reached: &reached, scope, this, values: BTreeMap::new() };
        let mut found = reached.clone();
        for tree in graph.trees.iter().filter(|tree| tree.scope == scope) {
            let below = asked_below(&tree.decision);
            let mut open = vec![(tree.decision.root, Answers::new())];
            let mut seen = BTreeSet::new();
            while let Some((target, mut answers)) = open.pop() {
                let at = match target {
                    Target::Leaf(Leaf::Primitive(label)) => {
                        found.insert(label);
                        continue;
                    }
                    Target::Leaf(Leaf::Stay | Leaf::Separate) => continue,
                    Target::Test(at) => at as usize,
                };
                // Only what is asked again distinguishes two ways to a test.
                answers.retain(|condition, _| below.get(at).is_some_and(|below| below.contains(condition)));
                if seen.len() >= MOST_WAYS {
                    answers.clear();
                }
                let Some(test) = tree.decision.tests.get(at).filter(|_| seen.insert((at, answers.clone()))) else {
                    continue;
                };
                let known = answers.get(&test.condition).copied().or_else(|| walk.value(test.condition).truth());
                for (answer, next) in [(true, test.yes), (false, test.no)] {
                    if known.is_none_or(|known| known == answer) {
                        let mut answers = answers.clone();
                        answers.insert(test.condition, answer);
                        open.push((next, answers));
                    }
                }
            }
        }
        if found.len() == reached.len() {
            return found;
        }
        reached = found;
    }
}

/// The answers of the tests on the path to a test.
type Answers = BTreeMap<ValueId, bool>;

/// How many combinations of a test and earlier answers are distinguished in a tree. Beyond that, answers are forgotten and a repeated test may go either way.
const MOST_WAYS: usize = 1 << 14;

/// The largest product of tests and repeated conditions of a tree; in larger trees no answer is remembered.
const MOST_REMEMBERED: usize = 1 << 20;

/// Of the conditions that several tests ask for, those that each test, or one that it leads to, asks for.
fn asked_below(decision: &Decision) -> Vec<BTreeSet<ValueId>> {
    let mut counts: BTreeMap<ValueId, usize> = BTreeMap::new();
    decision.tests.iter().for_each(|test| *counts.entry(test.condition).or_default() += 1);
    counts.retain(|_, count| *count > 1);
    if counts.len().saturating_mul(decision.tests.len()) > MOST_REMEMBERED {
        return vec![];
    }
    let mut below: Vec<BTreeSet<ValueId>> = Vec::with_capacity(decision.tests.len());
    for test in &decision.tests {
        let mut asked = BTreeSet::new();
        if counts.contains_key(&test.condition) {
            asked.insert(test.condition);
        }
        for target in [test.yes, test.no] {
            // Targets stand before the tests that lead to them.
            if let Target::Test(at) = target {
                asked.extend(below.get(at as usize).into_iter().flatten());
            }
        }
        below.push(asked);
    }
    below
}

struct Walk<'a, F, P> {
    graph: &'a Graph,
    channel: &'a F,
    has: &'a P,
    /// The leaves that are reached so far.
    reached: &'a BTreeSet<Label>,
    scope: TreeScope,
    /// The hand in whose tree or declaration a value stands.
    this: Hand,
    values: BTreeMap<(ValueId, Hand), AbstractValue>,
}

impl<F: Fn(ChannelId, Hand) -> AbstractValue, P: Fn(FingerPick, Hand) -> bool> Walk<'_, F, P> {
    fn value(&mut self, id: ValueId) -> AbstractValue {
        let place = (id, self.this);
        if let Some(known) = self.values.get(&place) {
            return *known;
        }
        // A latch may read a value that reads it: it is unknown until it is known.
        self.values.insert(place, AbstractValue::Unknown);
        let known = self.computed(id);
        self.values.insert(place, known);
        known
    }

    /// Returns the condition that sets a latch of this hand, or of no hand.
    fn of_hand(&mut self, id: ValueId, hand: Hand) -> AbstractValue {
        let own = self.this;
        self.this = hand.seen_from(own);
        let known = self.value(id);
        self.this = own;
        known
    }

    fn computed(&mut self, id: ValueId) -> AbstractValue {
        let value = self.graph.value(id);
        let args: Vec<AbstractValue> = value.args.iter().map(|arg| self.value(*arg)).collect();
        let first = args.first().copied().unwrap_or(AbstractValue::Unknown);
        let second = args.get(1).copied().unwrap_or(AbstractValue::Unknown);
        match &value.op {
            Op::Bool(value) => AbstractValue::bool(*value),
            Op::Number(number) => AbstractValue::Constant(number.get()),
            Op::Channel(channel, hand) => (self.channel)(*channel, hand.seen_from(self.this)),
            Op::Latch(latch, hand) => match self.graph.latches.get(latch.index()).map(|latch| latch.set) {
                Some(set) if self.of_hand(set, *hand) == AbstractValue::FALSE => AbstractValue::FALSE,
                _ => AbstractValue::Unknown,
            },
            Op::From { tree, labels, none } => self.from(tree.seen_from(self.this), labels, *none),
            // A finger that the hand lacks reads zero.
            Op::Pick(pick @ FingerPick::One(_)) if !self.has_fingers(*pick, &value.args) => AbstractValue::FALSE,
            Op::Pick(pick) if !self.has_fingers(*pick, &value.args) => AbstractValue::Empty,
            Op::Pick(FingerPick::One(_)) => match first {
                AbstractValue::Constant(value) if value != 0.0 => AbstractValue::Unknown,
                other => other,
            },
            Op::Pick(_) | Op::Component(_) => first,
            Op::Negate => first.each(|value| -value),
            Op::Arithmetic(kind) => arithmetic(*kind, first, second),
            Op::Compare(kind) => compare(*kind, first, second),
            Op::Not => first.each(|value| f64::from(u8::from(value < 0.5))),
            Op::And => joined(&args, false),
            Op::Or => joined(&args, true),
            Op::Hysteresis { on, rising, .. } => {
                first.each(|value| f64::from(u8::from(if *rising { value > on.get() } else { value < on.get() })))
            }
            Op::Temporal(temporal) => {
                temporal.operator().map_or(AbstractValue::Unknown, |operator| (operator.known)(&args))
            }
            Op::Rate(_) => first.each(|_| 0.0),
            Op::Summary(..) if args.contains(&AbstractValue::Empty) => AbstractValue::Empty,
            Op::Summary(Summary::Min | Summary::Max | Summary::Earliest, _) => first,
            // Sums of other numbers are rounded.
            Op::Summary(Summary::Mean | Summary::Integral, _) if first == AbstractValue::FALSE => first,
            Op::Summary(Summary::Mean | Summary::Integral, _) => AbstractValue::Unknown,
            // Of an array without slots `any` is false and `all` is true, whatever its elements would be.
            Op::Call(Function::Any) if first == AbstractValue::Constant(1.0) && !self.has_slots(&value.args) => {
                AbstractValue::Unknown
            }
            Op::Call(Function::All) if first == AbstractValue::FALSE && !self.has_slots(&value.args) => {
                AbstractValue::Unknown
            }
            Op::Call(function) => (of_function(*function).known)(&args),
        }
    }

    /// Whether an array has a slot for certain: one of the channels that it is made of is known to have a value.
    fn has_slots(&self, args: &[ValueId]) -> bool {
        args.iter().any(|arg| {
            let value = self.graph.value(*arg);
            match &value.op {
                Op::Channel(channel, hand) => {
                    value.ty.axis.is_some()
                        && matches!((self.channel)(*channel, hand.seen_from(self.this)), AbstractValue::Constant(_))
                }
                // None of the fingers may be picked.
                Op::Pick(_) => false,
                _ => value.ty.axis.is_some() && self.has_slots(&value.args),
            }
        })
    }

    /// Whether the hand whose fingers are picked has one of them.
    fn has_fingers(&self, pick: FingerPick, args: &[ValueId]) -> bool {
        let whose = args.first().and_then(|array| self.graph.value(*array).ty.axis).map_or(self.this, |(_, hand)| hand);
        (self.has)(pick, whose.seen_from(self.this))
    }

    fn from(&self, tree: Hand, labels: &[Label], none: bool) -> AbstractValue {
        let own = match self.scope {
            TreeScope::EachHand => tree != Hand::Shared,
            TreeScope::BothHands => tree == Hand::Shared,
        };
        let can = none || !own || labels.iter().any(|pattern| self.reached.iter().any(|label| pattern.covers(*label)));
        if can { AbstractValue::Unknown } else { AbstractValue::FALSE }
    }
}

fn arithmetic(kind: Arithmetic, left: AbstractValue, right: AbstractValue) -> AbstractValue {
    match (left, right) {
        (AbstractValue::Empty, _) | (_, AbstractValue::Empty) => AbstractValue::Empty,
        (AbstractValue::Constant(a), AbstractValue::Constant(b)) => AbstractValue::Constant(match kind {
            Arithmetic::Add => a + b,
            Arithmetic::Subtract => a - b,
            Arithmetic::Multiply => a * b,
            Arithmetic::Divide => a / b,
        }),
        _ => AbstractValue::Unknown,
    }
}

fn compare(kind: Comparison, left: AbstractValue, right: AbstractValue) -> AbstractValue {
    match (left, right) {
        (AbstractValue::Empty, _) | (_, AbstractValue::Empty) => AbstractValue::Empty,
        (AbstractValue::Constant(a), AbstractValue::Constant(b)) => AbstractValue::bool(match kind {
            Comparison::Less => a < b,
            Comparison::LessEqual => a <= b,
            Comparison::Greater => a > b,
            Comparison::GreaterEqual => a >= b,
            Comparison::Equal => a.total_cmp(&b).is_eq(),
            Comparison::NotEqual => a.total_cmp(&b).is_ne(),
        }),
        _ => AbstractValue::Unknown,
    }
}

/// `and` and `or`: one argument that `decides` is enough.
fn joined(args: &[AbstractValue], decides: bool) -> AbstractValue {
    if args.iter().any(|arg| arg.truth() == Some(decides)) {
        AbstractValue::bool(decides)
    } else if args.contains(&AbstractValue::Empty) {
        AbstractValue::Empty
    } else if args.iter().all(|arg| arg.truth().is_some()) {
        AbstractValue::bool(!decides)
    } else {
        AbstractValue::Unknown
    }
}
