//! Instantiation: the graph and the slots of a log in, the plan out. The only thing that can be wrong here is the log: its rate may not honour
//! a duration.

mod cheaper_comparisons;
mod functions;
mod operators;
mod stateful_nodes;
mod summaries;

use super::plan::{
    BitId, Condition, Number, NumberId, Plan, PreviousLeaf, StatefulId, StatefulNode, Step, TreeInstance, position,
};
use crate::semantics::{absent, internal, samples, slots};
use std::collections::{BTreeSet, HashMap};
use std::hash::Hash;
use std::rc::Rc;
use teachtree_base::channels::{Axis, DISTANCE_KNOWN, Shape};
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_frames::frames::{ColumnKey, Layout};
use teachtree_language::graph::{Decision, FloatBits, Graph, Op, Test, Tree, ValueId};
use teachtree_language::rules::{Function, Label, LatchId, TreeScope};

/// The most memory from one frame to the next, in bytes.
const MAX_STATE: usize = 256 << 20;

/// Instantiates a graph for the slots of a log.
///
/// # Errors
/// When the rate cannot honour a duration: shorter than one sample.
pub fn instantiate(graph: &Graph, layout: &Layout) -> Result<Plan, InputError> {
    let mut instantiation = Instantiation::new(graph, layout);
    let trees = instantiation.list_trees();
    // The trees are known before their tests: `from` names a tree by its position.
    let empty = |root| Decision { tests: Vec::new(), root };
    let open = |(tree, side): &(&Tree, _)| TreeInstance {
        scope: tree.scope,
        side: *side,
        decision: empty(tree.decision.root),
    };
    instantiation.plan.trees = trees.iter().map(open).collect();
    let tests = trees.iter().flat_map(|(tree, side)| tree.decision.tests.iter().map(|test| (test.condition, *side)));
    instantiation.make_all(tests.collect())?;
    for (at, (tree, side)) in trees.into_iter().enumerate() {
        let asked = &tree.decision.tests;
        let conditions: Vec<Item> =
            asked.iter().map(|test| instantiation.value(test.condition, side)?.single()).collect::<Result<_, _>>()?;
        let reached = tree.decision.reached(|test| instantiation.known(conditions[test]));
        let mut tests = Vec::with_capacity(asked.len());
        for ((test, condition), reached) in asked.iter().zip(conditions).zip(reached) {
            // No frame reaches the other tests, so the run does not wait for their conditions.
            let condition = if reached { condition } else { instantiation.truth(false) };
            let condition = instantiation.stateful_of(condition)?;
            tests.push(Test { condition, yes: test.yes, no: test.no });
        }
        instantiation.plan.trees[at].decision.tests = tests;
    }
    instantiation.align_imports();
    instantiation.finish()
}

/// A value whose columns are read when they were evaluated.
#[derive(Clone, Debug)]
pub struct Output {
    /// Numbers per element.
    pub width: usize,
    /// Whether it has a value per finger or contact.
    pub is_array: bool,
    /// For each slot the steps of its components.
    pub slots: Vec<Vec<Step>>,
}

/// Instantiates values of a graph, each for a hand or for none, for a log whose leaves are known: `from` reads them, so that everything is columns.
///
/// # Errors
/// When the rate cannot honor a duration: shorter than one sample.
pub fn instantiate_outputs(
    graph: &Graph,
    layout: &Layout,
    values: &[(ValueId, Option<Side>)],
) -> Result<(Plan, Vec<Output>), InputError> {
    let mut instantiation = Instantiation { leaves: Some(HashMap::new()), ..Instantiation::new(graph, layout) };
    instantiation.make_all(values.to_vec())?;
    let mut outputs = Vec::with_capacity(values.len());
    for (id, side) in values {
        let step = |item: &Item| match item {
            Item::Number(id) => Ok(Step::Number(*id)),
            Item::Bit(id) => Ok(Step::Condition(*id)),
            Item::Stateful(_) | Item::Tally(_) => {
                Err(internal("a value is known only frame by frame though the leaves are"))
            }
        };
        let slots = instantiation.value(*id, *side)?;
        let slots =
            slots.0.iter().map(|slot| slot.iter().map(step).collect()).collect::<Result<Vec<Vec<Step>>, _>>()?;
        instantiation.plan.outputs.extend(slots.iter().flatten());
        let ty = graph.value(*id).ty;
        outputs.push(Output { width: ty.shape.components().len(), is_array: ty.axis.is_some(), slots });
    }
    Ok((instantiation.finish()?, outputs))
}

/// One number or condition.
#[derive(Clone, Copy, Debug)]
enum Item {
    Number(NumberId),
    Bit(BitId),
    Stateful(StatefulId),
    /// The number of true stateful nodes, by position in `Instantiation::tallies`. Only a comparison with a constant can use this number.
    Tally(u32),
}

/// A value: for each slot its components; a value that is not an array has one slot.
#[derive(Clone, Debug)]
struct Slots(Vec<Vec<Item>>);

impl Slots {
    fn single(&self) -> Result<Item, InputError> {
        let item = self.0.first().and_then(|slot| slot.first()).copied();
        item.ok_or_else(|| internal("an array stands where a single value is asked for"))
    }
}

struct Instantiation<'a> {
    graph: &'a Graph,
    plan: Plan,
    numbers: HashMap<Number, NumberId>,
    conditions: HashMap<Condition, BitId>,
    stateful: HashMap<StatefulNode, StatefulId>,
    inputs: HashMap<ColumnKey, u32>,
    imports: HashMap<BitId, u32>,
    values: HashMap<(ValueId, Option<Side>), Rc<Slots>>,
    latches: HashMap<(LatchId, Option<Side>), Item>,
    /// The hands whose targets a made value reads.
    targets: HashMap<(ValueId, Option<Side>), stateful_nodes::Targets>,
    tallies: Vec<Vec<StatefulId>>,
    /// The queries about known leaves.
    leaves: Option<HashMap<PreviousLeaf, u32>>,
}

fn share<K: Clone + Eq + Hash, V>(
    known: &mut HashMap<K, u32>,
    list: &mut Vec<V>,
    key: K,
    make: impl FnOnce(K) -> V,
) -> u32 {
    let next = position(list.len());
    let at = *known.entry(key.clone()).or_insert(next);
    if at == next {
        list.push(make(key));
    }
    at
}

impl<'a> Instantiation<'a> {
    fn new(graph: &'a Graph, layout: &Layout) -> Self {
        Self {
            graph,
            plan: Plan { layout: layout.clone(), ..Plan::default() },
            numbers: HashMap::new(),
            conditions: HashMap::new(),
            stateful: HashMap::new(),
            inputs: HashMap::new(),
            imports: HashMap::new(),
            values: HashMap::new(),
            latches: HashMap::new(),
            targets: HashMap::new(),
            tallies: Vec::new(),
            leaves: None,
        }
    }

    /// The plan without what nothing reads.
    fn finish(mut self) -> Result<Plan, InputError> {
        self.plan.drop_unread();
        let state = self.plan.cost().state_bytes;
        if state > MAX_STATE {
            let message =
                format!("the windows need {} MB of state, expected at most {} MB", state >> 20, MAX_STATE >> 20);
            let help = "shorten the longest windows, or resample the log to a lower rate";
            return Err(InputError::new("rules", message).help(help));
        }
        Ok(self.plan)
    }

    /// The queries about the leaf of the frame before.
    fn from(&mut self, tree: Option<Side>, labels: &[Label], none: bool) -> Item {
        if let Some(known) = &mut self.leaves {
            let before = PreviousLeaf { tree, labels: labels.to_vec(), none };
            let at = share(known, &mut self.plan.leaves, before, |before| before);
            return Item::Bit(self.bit(Condition::Leaf(at), 0));
        }
        let at = self.plan.trees.iter().position(|known| known.side == tree);
        match at.map(position) {
            Some(tree) => Item::Stateful(self.stateful(StatefulNode::From { tree, labels: labels.to_vec(), none })),
            None => Item::Bit(self.bit(Condition::Constant(false), 0)),
        }
    }

    /// The trees to run: the one for each hand for every hand there is, then the one over both when both are there.
    fn list_trees(&self) -> Vec<(&'a Tree, Option<Side>)> {
        let mut trees = Vec::new();
        for tree in &self.graph.trees {
            if tree.scope == TreeScope::EachHand {
                trees.extend(self.plan.layout.hands.iter().map(|hand| (tree, Some(hand.side))));
            }
        }
        if self.plan.layout.hands.len() == 2 {
            trees.extend(self.graph.trees.iter().filter(|tree| tree.scope == TreeScope::BothHands).map(|t| (t, None)));
        }
        trees
    }

    /// Whether the value of this hand exists in the log; a value of no hand always does.
    fn present(&self, side: Option<Side>) -> bool {
        side.is_none_or(|side| self.plan.layout.hand(side).is_some())
    }

    fn number(&mut self, number: Number, delay: u32) -> NumberId {
        let next = NumberId(position(self.plan.numbers.len()));
        let id = *self.numbers.entry(number.clone()).or_insert(next);
        if id == next {
            self.plan.numbers.push((number, delay));
            self.plan.steps.push(Step::Number(id));
        }
        id
    }

    fn bit(&mut self, condition: Condition, delay: u32) -> BitId {
        let next = BitId(position(self.plan.conditions.len()));
        let id = *self.conditions.entry(condition.clone()).or_insert(next);
        if id == next {
            self.plan.conditions.push((condition, delay));
            self.plan.steps.push(Step::Condition(id));
        }
        id
    }

    fn stateful(&mut self, memory: StatefulNode) -> StatefulId {
        let next = StatefulId(position(self.plan.stateful.len()));
        let id = *self.stateful.entry(memory.clone()).or_insert(next);
        if id == next {
            self.plan.stateful.push(memory);
        }
        id
    }

    fn constant(&mut self, number: f64) -> NumberId {
        self.number(Number::Constant(FloatBits::new(number)), 0)
    }

    fn input(&mut self, key: ColumnKey) -> u32 {
        share(&mut self.inputs, &mut self.plan.inputs, key, |key| key)
    }

    /// The delay of a number; a constant has any, so it asks for none.
    fn number_delay(&self, id: NumberId) -> u32 {
        self.plan.numbers[id.index()].1
    }

    fn bit_delay(&self, id: BitId) -> u32 {
        self.plan.conditions[id.index()].1
    }

    fn late_number(&mut self, id: NumberId, delay: u32) -> NumberId {
        let (number, own) = &self.plan.numbers[id.index()];
        match delay.saturating_sub(*own) {
            0 => id,
            _ if matches!(number, Number::Constant(_)) => id,
            more => self.number(Number::Delay(id, more), delay),
        }
    }

    fn late_bit(&mut self, id: BitId, delay: u32) -> BitId {
        let (condition, own) = &self.plan.conditions[id.index()];
        match delay.saturating_sub(*own) {
            0 => id,
            _ if matches!(condition, Condition::Constant(_)) => id,
            more => self.bit(Condition::Delay(id, more), delay),
        }
    }

    /// Some numbers brought to the same delay.
    fn together<const N: usize>(&mut self, numbers: [NumberId; N]) -> ([NumberId; N], u32) {
        let delay = numbers.iter().map(|id| self.number_delay(*id)).max().unwrap_or(0);
        (numbers.map(|id| self.late_number(id, delay)), delay)
    }

    fn bits_together(&mut self, bits: &[BitId]) -> (Vec<BitId>, u32) {
        let delay = bits.iter().map(|bit| self.bit_delay(*bit)).max().unwrap_or(0);
        (bits.iter().map(|bit| self.late_bit(*bit, delay)).collect(), delay)
    }

    /// Lifts a condition of the log into the machine.
    fn stateful_of(&mut self, item: Item) -> Result<StatefulId, InputError> {
        Ok(match item {
            Item::Stateful(memory) => memory,
            Item::Bit(bit) => {
                if let Condition::Constant(value) = self.plan.conditions[bit.index()].0 {
                    return Ok(self.stateful(StatefulNode::Constant(value)));
                }
                let import = share(&mut self.imports, &mut self.plan.imports, bit, |bit| bit);
                self.stateful(StatefulNode::Import(import))
            }
            Item::Number(_) | Item::Tally(_) => return Err(internal("a number stands where a condition is asked for")),
        })
    }

    /// Brings everything that the machine reads to one delay.
    fn align_imports(&mut self) {
        let (imports, delay) = self.bits_together(&self.plan.imports.clone());
        self.plan.imports = imports;
        self.plan.delay = delay;
    }

    /// A duration in frames.
    fn frames(&self, duration: FloatBits) -> Result<u32, InputError> {
        samples(duration.get(), self.plan.layout.rate_hz)
    }

    /// Makes the values that are asked for and all that they are made of, arguments first, so that no call goes deeper than one value.
    fn make_all(&mut self, mut open: Vec<(ValueId, Option<Side>)>) -> Result<(), InputError> {
        let mut needed = BTreeSet::new();
        while let Some((id, this)) = open.pop() {
            if !needed.insert((id, this)) {
                continue;
            }
            let value = self.graph.value(id);
            if let Op::Latch(latch, hand) = &value.op {
                let (latch, side) = (&self.graph.latches[latch.index()], hand.side(this));
                open.extend([(latch.set, side), (latch.clear, side)]);
            }
            open.extend(value.args.iter().map(|arg| (*arg, this)));
        }
        for (id, this) in needed {
            let targets = self.find_targets(id, this);
            self.targets.insert((id, this), targets);
            self.value(id, this)?;
        }
        Ok(())
    }

    fn value(&mut self, id: ValueId, this: Option<Side>) -> Result<Rc<Slots>, InputError> {
        if let Some(slots) = self.values.get(&(id, this)) {
            return Ok(Rc::clone(slots));
        }
        let slots = Rc::new(self.make(id, this)?);
        self.values.insert((id, this), Rc::clone(&slots));
        Ok(slots)
    }

    fn make(&mut self, id: ValueId, this: Option<Side>) -> Result<Slots, InputError> {
        let graph = self.graph;
        let value = graph.value(id);
        let single = |item: Item| Slots(vec![vec![item]]);
        let args = value.args.iter().map(|arg| self.value(*arg, this)).collect::<Result<Vec<_>, _>>()?;
        Ok(match &value.op {
            Op::Bool(bool) => single(Item::Bit(self.bit(Condition::Constant(*bool), 0))),
            Op::Number(number) => single(Item::Number(self.constant(number.get()))),
            Op::Channel(channel, hand) => self.channel(channel.0, hand.side(this)),
            Op::Latch(latch, hand) => single(self.latch(*latch, hand.side(this))?),
            Op::From { tree, labels, none } => single(self.from(tree.side(this), labels, *none)),
            Op::Pick(pick) => {
                let hand = match graph.value(value.args[0]).ty.axis {
                    Some((Axis::Fingers, hand)) => hand.side(this),
                    _ => None,
                };
                let fingers = hand.and_then(|side| self.plan.layout.hand(side)).map_or(&[][..], |hand| &hand.fingers);
                let picked: Vec<Vec<Item>> = fingers
                    .iter()
                    .zip(&args[0].0)
                    .filter(|(finger, _)| pick.picks(**finger))
                    .map(|(_, slot)| slot.clone())
                    .collect();
                if value.ty.axis.is_none() && picked.is_empty() { self.nothing(value.ty.shape) } else { Slots(picked) }
            }
            Op::Component(at) => Slots(args[0].0.iter().map(|slot| vec![slot[usize::from(*at)]]).collect()),
            Op::Call(function) if value.ty.axis.is_none() && reduces(*function, graph, value) => {
                self.reduce(*function, &args)?
            }
            op => {
                let slots = args.iter().zip(&value.args).filter(|(_, id)| graph.value(**id).ty.axis.is_some());
                let slots = slots.map(|(arg, _)| arg.0.len()).min().unwrap_or(1);
                let mut out = Vec::with_capacity(slots);
                for slot in 0..slots {
                    let each: Vec<&[Item]> = args
                        .iter()
                        .map(|arg| arg.0.get(slot).or_else(|| arg.0.first()).map_or(&[][..], Vec::as_slice))
                        .collect();
                    out.push(self.element(op, &each, &value.args, this)?);
                }
                Slots(out)
            }
        })
    }

    /// A value of something that the log does not have.
    fn nothing(&mut self, shape: Shape) -> Slots {
        let (components, number) = (shape.components().len(), absent(shape));
        let item = match shape {
            Shape::Bool => Item::Bit(self.bit(Condition::Constant(number > 0.5), 0)),
            _ => Item::Number(self.constant(number)),
        };
        Slots(vec![vec![item; components]])
    }

    fn channel(&mut self, channel: u32, side: Option<Side>) -> Slots {
        let spec = &self.graph.channels[channel as usize];
        let (shape, axis) = (spec.shape, spec.axis);
        let slots = slots(&self.plan.layout, axis, side);
        if !self.present(side) {
            return if axis.is_some() { Slots(Vec::new()) } else { self.nothing(shape) };
        }
        if spec.name == DISTANCE_KNOWN {
            let hand = side.and_then(|side| self.plan.layout.hand(side));
            let known = hand.is_some_and(|hand| hand.knows_distance);
            return Slots(vec![vec![self.truth(known)]]);
        }
        let mut out = Vec::with_capacity(slots);
        for slot in (0..slots).filter_map(|slot| u32::try_from(slot).ok()) {
            let mut components = Vec::new();
            for component in (0..shape.components().len()).filter_map(|at| u32::try_from(at).ok()) {
                let input = self.input(ColumnKey { channel, side, slot, component });
                components.push(match shape {
                    Shape::Bool => Item::Bit(self.bit(Condition::Input(input), 0)),
                    _ => Item::Number(self.number(Number::Input(input), 0)),
                });
            }
            out.push(components);
        }
        Slots(out)
    }
}

fn tally_misused() -> InputError {
    InputError::new("rules", "a count of conditions that read `from` or a latch can only be compared with a number")
}

fn only_bits(items: &[Item]) -> Option<Vec<BitId>> {
    items.iter().map(|item| if let Item::Bit(bit) = item { Some(*bit) } else { None }).collect()
}

/// Whether a call makes one value of an array, rather than mapping over it.
fn reduces(function: Function, graph: &Graph, value: &teachtree_language::graph::Value) -> bool {
    let array = value.args.first().is_some_and(|arg| graph.value(*arg).ty.axis.is_some());
    match function {
        Function::Sum | Function::Mean | Function::Count | Function::Any | Function::All | Function::SqueezeOf => true,
        Function::Min | Function::Max => value.args.len() == 1 && array,
        Function::Abs
        | Function::Norm
        | Function::Dot
        | Function::Tangential
        | Function::Vec3
        | Function::Cross
        | Function::Angle
        | Function::InFrame
        | Function::FromFrame => false,
    }
}
