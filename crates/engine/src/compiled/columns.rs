//! The columnar half of the evaluator: numbers and conditions of a plan over a block of frames at a time.

use super::bits::{BLOCK, BitDelay, Bits, NumberDelay, WORDS, flip_flop, frames_of, get, words};
use super::buffers::Buffers;
use super::kernels::{
    Map, Sum, add, at_least, compare, compare_both, dot, squared_distance, squares, stands_still, write,
};
use super::plan::{BitId, Condition, Number, NumberId, Plan, Step, Vector};
use crate::semantics::{mismatched, per_second};
use crate::summary;
use crate::temporal_state::State;
use pulp::{Arch, NullaryFnOnce};
use teachtree_language::rules::{Arithmetic, Comparison};

/// The columns of one block and the memory between blocks. Allocates when it is made and never again.
#[derive(Clone, Debug)]
pub struct Columns {
    numbers: Buffers,
    conditions: Vec<Bits>,
    pub(super) memory: Memory,
}

/// The state between blocks.
#[derive(Clone, Debug)]
pub struct Memory {
    numbers: Vec<NumberMemory>,
    conditions: Vec<ConditionMemory>,
    /// Frames before this block.
    now: u64,
}

#[derive(Clone, Debug)]
enum NumberMemory {
    None,
    Rate { past: NumberDelay, age: u32 },
    Summary(summary::State),
    Delay(NumberDelay),
}

#[derive(Clone, Debug)]
enum ConditionMemory {
    None,
    Bit(bool),
    Temporal(State),
    Number(f64),
    Delay(BitDelay),
}

/// A block of input: columns in the order of `Plan::inputs`, or none of them when the frames lie after the end of the log.
#[derive(Clone, Copy, Debug)]
pub struct Block<'a> {
    /// The columns; at least `start + len` long each.
    pub columns: &'a [&'a [f64]],
    /// The first frame of the block in the columns.
    pub start: usize,
    /// Number of frames, 1 to [`BLOCK`].
    pub len: usize,
    /// Number of frames of the same stretch that directly precede `start` in the columns.
    pub known: usize,
    /// Whether these are frames of the log.
    pub inside: bool,
    /// The bits of `Plan::leaves`, where there are some.
    pub leaves: &'a [Vec<u64>],
}

impl<'a> Block<'a> {
    #[inline(always)]
    fn column(&self, at: u32) -> &'a [f64] {
        self.earlier(at, 0).unwrap_or(&ZEROS[..self.len])
    }

    /// Returns the column `frames` frames earlier, if it is known.
    #[inline(always)]
    fn earlier(&self, at: u32, frames: usize) -> Option<&'a [f64]> {
        let start = self.start.checked_sub(frames).filter(|_| frames <= self.known)?;
        self.columns.get(at as usize)?.get(start..start + self.len)
    }
}

static ZEROS: [f64; BLOCK] = [0.0; BLOCK];

impl Columns {
    /// Room for the columns of a plan.
    pub fn new(plan: &Plan) -> Self {
        let number_memory = plan.numbers.iter().map(|(number, _)| match number {
            Number::Rate { frames, .. } => NumberMemory::Rate { past: NumberDelay::new(*frames as usize), age: 0 },
            Number::Summary { samples, .. } => NumberMemory::Summary(summary::State::new(samples)),
            Number::Delay(_, frames) => NumberMemory::Delay(NumberDelay::new(*frames as usize)),
            _ => NumberMemory::None,
        });
        let condition_memory = plan.conditions.iter().map(|(condition, _)| match condition {
            Condition::FlipFlop { .. } => ConditionMemory::Bit(false),
            Condition::Temporal(operator, ..) => ConditionMemory::Temporal(State::new(*operator)),
            Condition::Changes(_) => ConditionMemory::Number(0.0),
            Condition::Delay(_, frames) => ConditionMemory::Delay(BitDelay::new(*frames as usize)),
            _ => ConditionMemory::None,
        });
        Self {
            numbers: Buffers::new(plan),
            conditions: vec![[0; WORDS]; plan.conditions.len()],
            memory: Memory { numbers: number_memory.collect(), conditions: condition_memory.collect(), now: 0 },
        }
    }

    /// Forgets everything: the next frame is the first one.
    pub fn restart(&mut self) {
        self.memory.now = 0;
        for memory in &mut self.memory.numbers {
            match memory {
                NumberMemory::None => {}
                NumberMemory::Rate { past, age } => {
                    past.clear();
                    *age = 0;
                }
                NumberMemory::Summary(state) => state.restart(),
                NumberMemory::Delay(delay) => delay.clear(),
            }
        }
        for memory in &mut self.memory.conditions {
            match memory {
                ConditionMemory::None => {}
                ConditionMemory::Bit(bit) => *bit = false,
                ConditionMemory::Temporal(state) => state.restart(),
                ConditionMemory::Number(number) => *number = 0.0,
                ConditionMemory::Delay(delay) => delay.clear(),
            }
        }
    }

    /// The bits of a condition over the block that was run last.
    pub fn condition(&self, id: BitId) -> &Bits {
        &self.conditions[id.index()]
    }

    /// The numbers of a step over the block that was run last, which are neither an input nor constant.
    pub fn number_of(&self, id: NumberId, len: usize) -> &[f64] {
        self.numbers.get(id, len)
    }

    /// Returns the state for the next block.
    pub fn memory(&self) -> Memory {
        self.memory.clone()
    }

    /// Continues from the state after the block with this memory.
    pub fn resume(&mut self, memory: &Memory) {
        self.memory.clone_from(memory);
    }

    /// Evaluates a block.
    pub fn run(&mut self, plan: &Plan, block: &Block<'_>) {
        Arch::new().dispatch(Steps { columns: self, plan, block });
        self.memory.now += block.len as u64;
    }

    #[inline(always)]
    fn number(&mut self, plan: &Plan, id: NumberId, block: &Block<'_>) {
        let number = &plan.numbers[id.index()].0;
        // Inputs are read where they are, and constants stay.
        if matches!(number, Number::Input(_) | Number::Constant(_)) {
            return;
        }
        let mut taken = self.numbers.take(id);
        let Some(out) = taken.get_mut(..block.len) else { return };
        let arg = |id: &NumberId| number_column(plan, &self.numbers, *id, block);
        let memory = &mut self.memory.numbers[id.index()];
        match number {
            Number::Input(_) | Number::Constant(_) => {}
            Number::Negate(a) => write(Map((arg(a),), |a: f64| -a), out),
            Number::Abs(a) => write(Map((arg(a),), |a: f64| a.abs()), out),
            Number::Arithmetic(operation, a, b) => match (plan.constant(*a), plan.constant(*b)) {
                (None, Some(b)) => match operation {
                    Arithmetic::Add => write(Map((arg(a),), |a: f64| a + b), out),
                    Arithmetic::Subtract => write(Map((arg(a),), |a: f64| a - b), out),
                    Arithmetic::Multiply => write(Map((arg(a),), |a: f64| a * b), out),
                    Arithmetic::Divide => write(Map((arg(a),), |a: f64| a / b), out),
                },
                _ => match operation {
                    Arithmetic::Add => write(Map((arg(a), arg(b)), |a: f64, b: f64| a + b), out),
                    Arithmetic::Subtract => write(Map((arg(a), arg(b)), |a: f64, b: f64| a - b), out),
                    Arithmetic::Multiply => write(Map((arg(a), arg(b)), |a: f64, b: f64| a * b), out),
                    Arithmetic::Divide => write(Map((arg(a), arg(b)), |a: f64, b: f64| a / b), out),
                },
            },
            Number::Sum(all) => sum(all, arg, out),
            Number::Dot(a, b) => write(dot(a.each_ref().map(arg), b.each_ref().map(arg)), out),
            Number::MulSub(a, b, c) => write(Map((arg(a), arg(b), arg(c)), |a: f64, b: f64, c: f64| a - b * c), out),
            Number::Norm(Vector { of, minus: None }) => write(Map((squares(of.each_ref().map(arg)),), f64::sqrt), out),
            Number::Norm(Vector { of, minus: Some(minus) }) => {
                write(Map((squared_distance(of.each_ref().map(arg), minus.each_ref().map(arg)),), f64::sqrt), out);
            }
            Number::Min(a, b) => write(Map((arg(a), arg(b)), |a: f64, b: f64| a.min(b)), out),
            Number::Max(a, b) => write(Map((arg(a), arg(b)), |a: f64, b: f64| a.max(b)), out),
            Number::Atan2(y, x) => write(Map((arg(y), arg(x)), |y: f64, x: f64| y.atan2(x)), out),
            Number::Count(bits) => {
                out.fill(0.0);
                for bits in bits {
                    let bits = &self.conditions[bits.index()];
                    for (at, out) in out.iter_mut().enumerate() {
                        *out += if get(bits, at) { 1.0 } else { 0.0 };
                    }
                }
            }
            Number::Rate { number, frames, restart } => {
                let NumberMemory::Rate { past, age } = memory else { return mismatched() };
                let (now, per_second) = (arg(number), per_second(plan.layout.rate_hz, *frames));
                let before = match plan.numbers[number.index()].0 {
                    Number::Input(column) if *age >= *frames => block.earlier(column, *frames as usize),
                    _ => None,
                };
                let restart = restart.map(|restart| &self.conditions[restart.index()]);
                let restarts = restart
                    .is_some_and(|bits| (0..words(block.len)).any(|at| bits[at] & frames_of(block.len, at) != 0));
                match before.filter(|_| !restarts) {
                    // Read where it is; the delay line only learns what comes last.
                    Some(before) => {
                        past.pass(now);
                        write(Map((now, before), |now: f64, before: f64| (now - before) * per_second), out);
                    }
                    None => {
                        past.run(now, out);
                        for (at, (out, now)) in out.iter_mut().zip(now.iter()).enumerate() {
                            if restart.is_some_and(|bits| get(bits, at)) {
                                *age = 0;
                            }
                            *out = if *age >= *frames { (*now - *out) * per_second } else { 0.0 };
                            *age = (*age + 1).min(*frames);
                        }
                    }
                }
            }
            Number::Summary { summary, number, samples, restart } => {
                let NumberMemory::Summary(state) = memory else { return mismatched() };
                let aggregation = summary::Aggregation { summary: *summary, rate: plan.layout.rate_hz };
                write(arg(number), out);
                let bits = |id: &BitId| &self.conditions[id.index()];
                match (samples.since().map(bits), restart.as_ref().map(bits)) {
                    (None, None) => state.block(aggregation, out, |_| (false, false)),
                    (since, restart) => state.block(aggregation, out, |at| {
                        let is = |bits: Option<&Bits>| bits.is_some_and(|bits| get(bits, at));
                        (is(since), is(restart))
                    }),
                }
            }
            Number::Delay(a, _) => {
                let NumberMemory::Delay(delay) = memory else { return mismatched() };
                delay.run(arg(a), out);
            }
        }
        self.numbers.put_back(id, taken);
    }

    #[inline(always)]
    fn bits(&mut self, plan: &Plan, id: BitId, block: &Block<'_>) {
        let len = block.len;
        let (before, rest) = self.conditions.split_at_mut(id.index());
        let words = words(len);
        let Some(out) = rest.first_mut().and_then(|out| out.get_mut(..words)) else { return };
        let arg = |id: &BitId| &before[id.index()][..words];
        let now = self.memory.now;
        let memory = &mut self.memory.conditions[id.index()];
        match &plan.conditions[id.index()].0 {
            Condition::Input(column) => compare(Comparison::Greater, block.column(*column), 0.5, len, out),
            Condition::Constant(value) => out.fill(if *value { u64::MAX } else { 0 }),
            Condition::Leaf(at) => match block.leaves.get(*at as usize) {
                Some(bits) => out.copy_from_slice(&bits[..words]),
                None => out.fill(0),
            },
            Condition::InLog => out.fill(if block.inside { u64::MAX } else { 0 }),
            Condition::FirstFrame => {
                out.fill(0);
                out[0] = u64::from(now == 0);
            }
            Condition::Changes(column) => {
                let ConditionMemory::Number(last) = memory else { return mismatched() };
                let column = block.column(*column);
                let mut before = if now == 0 { column.first().copied().unwrap_or_default() } else { *last };
                out.fill(0);
                // Compared by bits: objects are counted, not measured. Most columns stand still.
                if block.inside && !stands_still(column, before, len) {
                    for (at, now) in column.iter().enumerate() {
                        out[at / 64] |= u64::from(now.to_bits() != before.to_bits()) << (at % 64);
                        before = *now;
                    }
                }
                *last = column.get(len - 1).copied().unwrap_or(before);
            }
            Condition::Compare(comparison, a, b) => {
                let arg = |id: &NumberId| number_column(plan, &self.numbers, *id, block);
                match (plan.constant(*a), plan.constant(*b)) {
                    (Some(a), Some(b)) => out.fill(if comparison.holds(a, b) { u64::MAX } else { 0 }),
                    (None, Some(b)) => compare(*comparison, arg(a), b, len, out),
                    (Some(a), None) => compare(comparison.swapped(), arg(b), a, len, out),
                    (None, None) => compare_both(*comparison, arg(a), arg(b), len, out),
                }
            }
            Condition::NormSquaredCmp(comparison, Vector { of, minus }, threshold) => {
                let arg = |id: &NumberId| number_column(plan, &self.numbers, *id, block);
                let (of, threshold) = (of.each_ref().map(arg), threshold.get());
                match minus {
                    None => compare(*comparison, squares(of), threshold, len, out),
                    Some(minus) => {
                        compare(*comparison, squared_distance(of, minus.each_ref().map(arg)), threshold, len, out)
                    }
                }
            }
            Condition::Not(a) => {
                for (out, a) in out.iter_mut().zip(arg(a)) {
                    *out = !a;
                }
            }
            Condition::And(all) => fold(all, arg, out, u64::MAX, |all, one| all & one),
            Condition::Or(any) => fold(any, arg, out, 0, |any, one| any | one),
            Condition::AtLeast(conditions, wanted) => at_least(conditions.iter().map(arg), *wanted, out),
            Condition::FlipFlop { set, keep } => {
                let ConditionMemory::Bit(memory) = memory else { return mismatched() };
                flip_flop(arg(set), arg(keep), len, memory, out);
            }
            Condition::Temporal(operator, a, restart) => {
                let ConditionMemory::Temporal(state) = memory else { return mismatched() };
                state.block(*operator, now, arg(a), restart.as_ref().map(arg), len, out);
            }
            Condition::Delay(a, _) => {
                let ConditionMemory::Delay(delay) = memory else { return mismatched() };
                delay.run(arg(a), len, out);
            }
        }
    }

    /// The frames of the block on which one of these conditions differs from the frame before; `last` holds their bits at its end.
    pub fn changes(&self, conditions: &[BitId], last: &mut [bool], len: usize) -> Bits {
        let words = words(len);
        let mut changes = [0; WORDS];
        for (id, last) in conditions.iter().zip(last) {
            let bits = self.condition(*id);
            let mut carry = u64::from(*last);
            for (changes, now) in changes.iter_mut().zip(&bits[..words]) {
                *changes |= now ^ (now << 1 | carry);
                carry = now >> 63;
            }
            *last = get(bits, len - 1);
        }
        for (word, changes) in changes.iter_mut().enumerate().take(words) {
            *changes &= frames_of(len, word);
        }
        changes
    }
}

/// All steps of a plan over one block.
struct Steps<'a, 'b> {
    columns: &'a mut Columns,
    plan: &'a Plan,
    block: &'a Block<'b>,
}

impl NullaryFnOnce for Steps<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { columns, plan, block } = self;
        for step in &plan.steps {
            match step {
                Step::Number(id) => columns.number(plan, *id, block),
                Step::Condition(id) => columns.bits(plan, *id, block),
            }
        }
    }
}

#[inline(always)]
fn number_column<'a>(plan: &Plan, numbers: &'a Buffers, id: NumberId, block: &Block<'a>) -> &'a [f64] {
    match plan.numbers[id.index()].0 {
        Number::Input(column) => block.column(column),
        _ => numbers.get(id, block.len),
    }
}

/// Puts conditions together, word by word.
#[inline(always)]
fn fold<'a>(
    ids: &[BitId],
    arg: impl Fn(&BitId) -> &'a [u64],
    out: &mut [u64],
    nothing: u64,
    f: impl Fn(u64, u64) -> u64,
) {
    let rest = match ids {
        [] => {
            out.fill(nothing);
            return;
        }
        [one] => {
            out.copy_from_slice(arg(one));
            return;
        }
        [a, b, rest @ ..] => {
            for ((out, a), b) in out.iter_mut().zip(arg(a)).zip(arg(b)) {
                *out = f(*a, *b);
            }
            rest
        }
    };
    for one in rest {
        for (out, one) in out.iter_mut().zip(arg(one)) {
            *out = f(*out, *one);
        }
    }
}

/// The sum of some columns, from the first to the last: in one go for the fingers of a hand.
#[inline(always)]
fn sum<'a>(all: &[NumberId], arg: impl Fn(&NumberId) -> &'a [f64] + Copy, out: &mut [f64]) {
    let rest = match all {
        [] => return,
        [a, b, c, d, e, rest @ ..] => {
            write(Sum([a, b, c, d, e].map(arg)), out);
            rest
        }
        [a, b, c, d] => return write(Sum([a, b, c, d].map(arg)), out),
        [a, b, c] => return write(Sum([a, b, c].map(arg)), out),
        [a, b] => return write(Sum([a, b].map(arg)), out),
        [a] => return write(arg(a), out),
    };
    for a in rest {
        add(arg(a), out);
    }
}
