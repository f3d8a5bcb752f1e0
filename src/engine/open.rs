//! Opening: the graph and the slots of a log in, the plan out. The only thing that can be wrong here is the log: its rate may not honour
//! a duration.

mod comparisons;
mod functions;
mod memory;
mod operators;

use super::plan::{BitId, Condition, Memory, MemoryId, Number, NumberId, OpenTree, Plan, Step};
use super::width::Width;
use crate::base::channels::{Axis, Shape};
use crate::base::error::InputError;
use crate::base::hands::Side;
use crate::base::shown::Shown;
use crate::graph::{Decision, Exact, Graph, Op, Test, Tree, ValueId};
use crate::language::rules::{Function, Hand, LatchId, TreeScope};
use crate::stream::frames::{ColumnKey, Layout};
use std::collections::{BTreeSet, HashMap};
use std::hash::Hash;
use std::rc::Rc;

/// The longest window, in samples: more than an hour at 1 kHz.
const MAX_WINDOW: f64 = 4e6;
/// The most memory from one frame to the next, in bytes.
const MAX_STATE: usize = 256 << 20;

/// Opens a graph for the slots of a log, and for numbers of a width.
///
/// # Errors
/// When the rate cannot honour a duration: shorter than one sample.
pub fn open(graph: &Graph, layout: &Layout, width: Width) -> Result<Plan, InputError> {
    let mut opening = Opening {
        graph,
        width,
        plan: Plan { layout: layout.clone(), ..Plan::default() },
        numbers: HashMap::new(),
        conditions: HashMap::new(),
        memories: HashMap::new(),
        inputs: HashMap::new(),
        imports: HashMap::new(),
        values: HashMap::new(),
        latches: HashMap::new(),
        targets: HashMap::new(),
        tallies: Vec::new(),
    };
    let trees = opening.list_trees();
    // The trees are known before their tests: `from` names a tree by its position.
    let empty = |root| Decision { tests: Vec::new(), root };
    let open =
        |(tree, side): &(&Tree, _)| OpenTree { scope: tree.scope, side: *side, decision: empty(tree.decision.root) };
    opening.plan.trees = trees.iter().map(open).collect();
    opening.make_all(&trees)?;
    for (at, (tree, side)) in trees.into_iter().enumerate() {
        let mut tests = Vec::with_capacity(tree.decision.tests.len());
        for test in &tree.decision.tests {
            let condition = opening.value(test.condition, side)?.single();
            let condition = opening.memory_of(condition);
            tests.push(Test { condition, yes: test.yes, no: test.no });
        }
        opening.plan.trees[at].decision.tests = tests;
    }
    opening.align_imports();
    opening.plan.drop_unread();
    let state = opening.plan.cost().state_bytes;
    if state > MAX_STATE {
        let message = format!("the windows need {} MB of state, at most {} MB are taken", state >> 20, MAX_STATE >> 20);
        return Err(
            InputError::new("rules", message).help("shorten the longest windows, or resample the log to a lower rate")
        );
    }
    Ok(opening.plan)
}

/// One number or condition.
#[derive(Clone, Copy, Debug)]
enum Item {
    Number(NumberId),
    Bit(BitId),
    Memory(MemoryId),
    /// How many memories are true, by position in `Opening::tallies`: a number that only a comparison with a constant can use.
    Tally(u32),
}

/// A value: for each slot its components; a value that is no array has one slot.
#[derive(Clone, Debug)]
struct Slots(Vec<Vec<Item>>);

impl Slots {
    fn single(&self) -> Item {
        self.0.first().and_then(|slot| slot.first()).copied().unwrap_or(Item::Bit(BitId(0)))
    }
}

struct Opening<'a> {
    graph: &'a Graph,
    width: Width,
    plan: Plan,
    numbers: HashMap<Number, NumberId>,
    conditions: HashMap<Condition, BitId>,
    memories: HashMap<Memory, MemoryId>,
    inputs: HashMap<ColumnKey, u32>,
    imports: HashMap<BitId, u32>,
    values: HashMap<(ValueId, Option<Side>), Rc<Slots>>,
    latches: HashMap<(LatchId, Option<Side>), Item>,
    /// The hands whose targets a made value reads.
    targets: HashMap<(ValueId, Option<Side>), memory::Targets>,
    tallies: Vec<Vec<MemoryId>>,
}

fn share<K: Clone + Eq + Hash, V>(
    known: &mut HashMap<K, u32>,
    list: &mut Vec<V>,
    key: K,
    make: impl FnOnce(K) -> V,
) -> u32 {
    let next = u32::try_from(list.len()).unwrap_or(u32::MAX);
    let at = *known.entry(key.clone()).or_insert(next);
    if at == next {
        list.push(make(key));
    }
    at
}

impl<'a> Opening<'a> {
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

    fn side(hand: Hand, this: Option<Side>) -> Option<Side> {
        match hand {
            Hand::This => this,
            Hand::Named(side) => Some(side),
            Hand::Nobody => None,
        }
    }

    /// Whether the value of this hand exists in the log; a value of nobody always does.
    fn present(&self, side: Option<Side>) -> bool {
        side.is_none_or(|side| self.plan.layout.hand(side).is_some())
    }

    fn number(&mut self, number: Number, delay: u32) -> NumberId {
        let next = NumberId(u32::try_from(self.plan.numbers.len()).unwrap_or(u32::MAX));
        let id = *self.numbers.entry(number.clone()).or_insert(next);
        if id == next {
            self.plan.numbers.push((number, delay));
            self.plan.steps.push(Step::Number(id));
        }
        id
    }

    fn bit(&mut self, condition: Condition, delay: u32) -> BitId {
        let next = BitId(u32::try_from(self.plan.conditions.len()).unwrap_or(u32::MAX));
        let id = *self.conditions.entry(condition.clone()).or_insert(next);
        if id == next {
            self.plan.conditions.push((condition, delay));
            self.plan.steps.push(Step::Condition(id));
        }
        id
    }

    fn memory(&mut self, memory: Memory) -> MemoryId {
        let next = MemoryId(u32::try_from(self.plan.memories.len()).unwrap_or(u32::MAX));
        let id = *self.memories.entry(memory.clone()).or_insert(next);
        if id == next {
            self.plan.memories.push(memory);
        }
        id
    }

    fn constant(&mut self, number: f64) -> NumberId {
        self.number(Number::Constant(Exact::new(self.width.round(number))), 0)
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
    fn memory_of(&mut self, item: Item) -> MemoryId {
        match item {
            Item::Memory(memory) => memory,
            Item::Bit(bit) => {
                if let Condition::Constant(value) = self.plan.conditions[bit.index()].0 {
                    return self.memory(Memory::Constant(value));
                }
                let import = share(&mut self.imports, &mut self.plan.imports, bit, |bit| bit);
                self.memory(Memory::Import(import))
            }
            // The checker lets no number stand where a condition is wanted.
            Item::Number(_) | Item::Tally(_) => self.memory(Memory::Constant(false)),
        }
    }

    /// Brings everything that the machine reads to one delay.
    fn align_imports(&mut self) {
        let (imports, delay) = self.bits_together(&self.plan.imports.clone());
        self.plan.imports = imports;
        self.plan.delay = delay;
    }

    /// A duration in frames.
    fn frames(&self, duration: Exact) -> Result<u32, InputError> {
        frames(duration.get(), self.plan.layout.rate_hz)
    }

    /// Makes the values that trees ask for and all that they are made of, arguments first, so that no call goes deeper than one value.
    fn make_all(&mut self, trees: &[(&Tree, Option<Side>)]) -> Result<(), InputError> {
        let mut open: Vec<(ValueId, Option<Side>)> = Vec::new();
        for (tree, side) in trees {
            open.extend(tree.decision.tests.iter().map(|test| (test.condition, *side)));
        }
        let mut needed = BTreeSet::new();
        while let Some((id, this)) = open.pop() {
            if !needed.insert((id, this)) {
                continue;
            }
            let value = self.graph.value(id);
            if let Op::Latch(latch, hand) = &value.op {
                let (latch, side) = (&self.graph.latches[latch.index()], Self::side(*hand, this));
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
            Op::Channel(channel, hand) => self.channel(channel.0, Self::side(*hand, this)),
            Op::Latch(latch, hand) => single(self.latch(*latch, Self::side(*hand, this))?),
            Op::From { tree, labels, none } => {
                let side = Self::side(*tree, this);
                let tree = self.plan.trees.iter().position(|tree| tree.side == side);
                single(match tree.and_then(|at| u32::try_from(at).ok()) {
                    Some(tree) => Item::Memory(self.memory(Memory::From { tree, labels: labels.clone(), none: *none })),
                    None => Item::Bit(self.bit(Condition::Constant(false), 0)),
                })
            }
            Op::Pick(pick) => {
                let hand = match graph.value(value.args[0]).ty.axis {
                    Some((Axis::Fingers, hand)) => Self::side(hand, this),
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
                self.reduce(*function, &args)
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
                    out.push(self.element(op, &each, value.args.first().copied(), this)?);
                }
                Slots(out)
            }
        })
    }

    /// A value of something that the log does not have.
    fn nothing(&mut self, shape: Shape) -> Slots {
        let components = shape.components().len();
        let item = match shape {
            Shape::Bool => Item::Bit(self.bit(Condition::Constant(false), 0)),
            Shape::Object => Item::Number(self.constant(-1.0)),
            _ => Item::Number(self.constant(0.0)),
        };
        Slots(vec![vec![item; components]])
    }

    fn channel(&mut self, channel: u32, side: Option<Side>) -> Slots {
        let spec = &self.graph.channels[channel as usize];
        let (shape, axis) = (spec.shape, spec.axis);
        let hand = side.and_then(|side| self.plan.layout.hand(side));
        let slots = match (axis, hand) {
            (None, _) => 1,
            (Some(Axis::Fingers), Some(hand)) => hand.fingers.len(),
            (Some(Axis::Contacts), Some(hand)) => hand.contacts.len(),
            (Some(_), None) => 0,
        };
        if !self.present(side) {
            return if axis.is_some() { Slots(Vec::new()) } else { self.nothing(shape) };
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
fn reduces(function: Function, graph: &Graph, value: &crate::graph::Value) -> bool {
    let array = value.args.first().is_some_and(|arg| graph.value(*arg).ty.axis.is_some());
    match function {
        Function::Sum | Function::Mean | Function::Count | Function::Any | Function::All | Function::SqueezeOf => true,
        Function::Min | Function::Max => value.args.len() == 1 && array,
        Function::Abs | Function::Norm | Function::Dot | Function::Tangential => false,
    }
}

/// A duration in frames at a rate.
///
/// # Errors
/// When it is shorter than one sample, or longer than the program can count.
pub fn frames(duration_s: f64, rate_hz: f64) -> Result<u32, InputError> {
    let samples = duration_s * rate_hz;
    // Half a percent for a rate that is only nearly round.
    if samples < 0.995 {
        let (duration, period) = (duration_s * 1e3, 1e3 / rate_hz);
        let message =
            format!("a duration of {duration:.3} ms is shorter than one sample ({period:.3} ms at {rate_hz:.1} Hz)");
        let help = "resample the log to a higher rate in its binding, or override the param that sets the duration";
        return Err(InputError::new("rules", message).help(help));
    }
    if samples > MAX_WINDOW {
        let message = format!(
            "a duration of {} s is {:.0} samples at {rate_hz:.1} Hz, at most {MAX_WINDOW:.0} are counted",
            Shown(duration_s),
            Shown(samples)
        );
        return Err(InputError::new("rules", message));
    }
    // In range: checked above.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 1 and MAX_WINDOW")]
    let frames = samples.round() as u32;
    Ok(frames.max(1))
}
