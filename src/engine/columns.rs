//! The columnar half of the evaluator: numbers and conditions of a plan over a block of frames at a time.

use super::bits::{BLOCK, BitDelay, Bits, Held, NumberDelay, WORDS, flip_flop, frames_of, get, shifted, words};
use super::buffers::Buffers;
use super::kernels::{Side, at_least, compare, map, squares, zip};
use super::plan::{BitId, Condition, Number, NumberId, Plan, Step};
use crate::graph::Exact;
use crate::language::rules::{Arithmetic, Comparison};
use pulp::{Arch, NullaryFnOnce};

/// The columns of one block and the memory between blocks. Allocates when it is made and never again.
#[derive(Clone, Debug)]
pub struct Columns {
    numbers: Buffers,
    conditions: Vec<Bits>,
    number_memory: Vec<NumberMemory>,
    condition_memory: Vec<ConditionMemory>,
    fresh: bool,
}

#[derive(Clone, Debug)]
enum NumberMemory {
    None,
    Rate { past: NumberDelay, age: u32 },
    Delay(NumberDelay),
}

#[derive(Clone, Debug)]
enum ConditionMemory {
    None,
    Bit(bool),
    Count(u64),
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
    /// How many frames, 1 to [`BLOCK`].
    pub len: usize,
    /// Whether these are frames of the log.
    pub inside: bool,
}

impl Block<'_> {
    fn column(&self, at: u32) -> &[f64] {
        let column = self.columns.get(at as usize).copied().unwrap_or(&[]);
        column.get(self.start..self.start + self.len).unwrap_or(&ZEROS[..self.len])
    }
}

static ZEROS: [f64; BLOCK] = [0.0; BLOCK];

impl Columns {
    /// Room for the columns of a plan.
    pub fn new(plan: &Plan) -> Self {
        let number_memory = plan.numbers.iter().map(|(number, _)| match number {
            Number::Rate { frames, .. } => NumberMemory::Rate { past: NumberDelay::new(*frames as usize), age: 0 },
            Number::Delay(_, frames) => NumberMemory::Delay(NumberDelay::new(*frames as usize)),
            _ => NumberMemory::None,
        });
        let condition_memory = plan.conditions.iter().map(|(condition, _)| match condition {
            Condition::FlipFlop { .. } | Condition::Rises(..) => ConditionMemory::Bit(false),
            Condition::For(..) | Condition::WithinLast(..) => ConditionMemory::Count(0),
            Condition::Changes(_) => ConditionMemory::Number(0.0),
            Condition::Delay(_, frames) => ConditionMemory::Delay(BitDelay::new(*frames as usize)),
            _ => ConditionMemory::None,
        });
        let mut columns = Self {
            numbers: Buffers::new(plan),
            conditions: vec![[0; WORDS]; plan.conditions.len()],
            number_memory: number_memory.collect(),
            condition_memory: condition_memory.collect(),
            fresh: true,
        };
        columns.restart(plan);
        columns
    }

    /// Forgets everything: the next frame is the first one.
    pub fn restart(&mut self, plan: &Plan) {
        self.fresh = true;
        for memory in &mut self.number_memory {
            match memory {
                NumberMemory::None => {}
                NumberMemory::Rate { past, age } => {
                    past.clear();
                    *age = 0;
                }
                NumberMemory::Delay(delay) => delay.clear(),
            }
        }
        for (memory, (condition, _)) in self.condition_memory.iter_mut().zip(&plan.conditions) {
            match memory {
                ConditionMemory::None => {}
                // What begins true can not rise.
                ConditionMemory::Bit(bit) => *bit = matches!(condition, Condition::Rises(..)),
                ConditionMemory::Count(count) => {
                    *count = if let Condition::WithinLast(_, frames, _) = condition { u64::from(*frames) } else { 0 };
                }
                ConditionMemory::Number(number) => *number = 0.0,
                ConditionMemory::Delay(delay) => delay.clear(),
            }
        }
    }

    /// The bits of a condition over the block that was run last.
    pub fn condition(&self, id: BitId) -> &Bits {
        &self.conditions[id.index()]
    }

    /// Evaluates a block.
    pub fn run(&mut self, plan: &Plan, block: &Block<'_>) {
        Arch::new().dispatch(Steps { columns: self, plan, block });
        self.fresh = false;
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
        let memory = &mut self.number_memory[id.index()];
        match number {
            Number::Input(_) | Number::Constant(_) => {}
            Number::Negate(a) => map(arg(a), out, |a| -a),
            Number::Abs(a) => map(arg(a), out, |a| a.abs()),
            Number::Arithmetic(operation, a, b) => match operation {
                Arithmetic::Add => zip(arg(a), arg(b), out, |a, b| a + b),
                Arithmetic::Subtract => zip(arg(a), arg(b), out, |a, b| a - b),
                Arithmetic::Multiply => zip(arg(a), arg(b), out, |a, b| a * b),
                Arithmetic::Divide => zip(arg(a), arg(b), out, |a, b| a / b),
            },
            Number::Norm(vector) => squares(vector.each_ref().map(arg), out, f64::sqrt),
            Number::SquaredNorm(vector) => squares(vector.each_ref().map(arg), out, |squared| squared),
            Number::Min(a, b) => zip(arg(a), arg(b), out, |a, b| a.min(b)),
            Number::Max(a, b) => zip(arg(a), arg(b), out, |a, b| a.max(b)),
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
                let NumberMemory::Rate { past, age } = memory else { return };
                let number = arg(number);
                past.run(number, out);
                let per_second = plan.layout.rate_hz / f64::from(*frames);
                let restart = restart.map(|restart| &self.conditions[restart.index()]);
                let restarts = restart
                    .is_some_and(|bits| (0..words(block.len)).any(|at| bits[at] & frames_of(block.len, at) != 0));
                if *age >= *frames && !restarts {
                    for (out, now) in out.iter_mut().zip(number) {
                        *out = (now - *out) * per_second;
                    }
                } else {
                    for (at, (out, now)) in out.iter_mut().zip(number).enumerate() {
                        if restart.is_some_and(|bits| get(bits, at)) {
                            *age = 0;
                        }
                        *out = if *age >= *frames { (now - *out) * per_second } else { 0.0 };
                        *age = (*age + 1).min(*frames);
                    }
                }
            }
            Number::Delay(a, _) => {
                let NumberMemory::Delay(delay) = memory else { return };
                delay.run(arg(a), out);
            }
        }
        self.numbers.put_back(id, taken);
    }

    #[inline(always)]
    fn bits(&mut self, plan: &Plan, id: BitId, block: &Block<'_>) {
        let len = block.len;
        let (before, rest) = self.conditions.split_at_mut(id.index());
        let Some(out) = rest.first_mut() else { return };
        let arg = |id: &BitId| &before[id.index()];
        let memory = &mut self.condition_memory[id.index()];
        match &plan.conditions[id.index()].0 {
            Condition::Input(column) => compare(Comparison::Greater, block.column(*column), Side::Constant(0.5), out),
            Condition::Constant(value) => *out = [if *value { u64::MAX } else { 0 }; WORDS],
            Condition::Inside => *out = [if block.inside { u64::MAX } else { 0 }; WORDS],
            Condition::First => {
                *out = [0; WORDS];
                out[0] = u64::from(self.fresh);
            }
            Condition::Changes(column) => {
                let ConditionMemory::Number(last) = memory else { return };
                let column = block.column(*column);
                let mut before = if self.fresh { column[0] } else { *last };
                *out = [0; WORDS];
                for (at, now) in column.iter().enumerate() {
                    // Compared by bits: objects are counted, not measured.
                    let changed = block.inside && now.to_bits() != before.to_bits();
                    out[at / 64] |= u64::from(changed) << (at % 64);
                    before = *now;
                }
                *last = before;
            }
            Condition::Compare(comparison, a, b) => {
                let (a, b) = (side(plan, &self.numbers, *a, block), side(plan, &self.numbers, *b, block));
                match (a, b) {
                    (Side::Column(a), b) => compare(*comparison, a, b, out),
                    (Side::Constant(a), Side::Column(b)) => compare(comparison.swapped(), b, Side::Constant(a), out),
                    (Side::Constant(a), Side::Constant(b)) => {
                        *out = [if comparison.holds(a, b) { u64::MAX } else { 0 }; WORDS];
                    }
                }
            }
            Condition::Not(a) => {
                for (out, a) in out.iter_mut().zip(arg(a)) {
                    *out = !a;
                }
            }
            Condition::And(all) => {
                *out = [u64::MAX; WORDS];
                for one in all {
                    for (out, one) in out.iter_mut().zip(arg(one)) {
                        *out &= one;
                    }
                }
            }
            Condition::Or(any) => {
                *out = [0; WORDS];
                for one in any {
                    for (out, one) in out.iter_mut().zip(arg(one)) {
                        *out |= one;
                    }
                }
            }
            Condition::AtLeast(conditions, wanted) => at_least(conditions.iter().map(arg), *wanted, out),
            Condition::FlipFlop { set, keep } => {
                let ConditionMemory::Bit(memory) = memory else { return };
                flip_flop(arg(set), arg(keep), len, memory, out);
            }
            Condition::For(a, frames, restart) => {
                let ConditionMemory::Count(count) = memory else { return };
                let held = Held { count, limit: u64::from(*frames) };
                held.throughout(arg(a), restart.as_ref().map(arg), len, out);
            }
            Condition::WithinLast(a, frames, restart) => {
                let ConditionMemory::Count(count) = memory else { return };
                let held = Held { count, limit: u64::from(*frames) };
                held.at_least_once(arg(a), restart.as_ref().map(arg), len, out);
            }
            Condition::Rises(a, restart) => {
                let ConditionMemory::Bit(memory) = memory else { return };
                let now = arg(a);
                shifted(now, *memory, out);
                for (word, (out, now)) in out.iter_mut().zip(now).enumerate() {
                    *out = now & !*out & !restart.map_or(0, |restart| arg(&restart)[word]);
                }
                *memory = get(now, len - 1);
            }
            Condition::Delay(a, _) => {
                let ConditionMemory::Delay(delay) = memory else { return };
                delay.run(arg(a), len, out);
            }
        }
    }

    /// The frames of the block on which one of these conditions differs from the frame before; `last` holds their bits at its end.
    pub fn changes(&self, conditions: &[BitId], last: &mut [bool], len: usize) -> Bits {
        let mut changes = [0; WORDS];
        let mut earlier = [0; WORDS];
        for (id, last) in conditions.iter().zip(last) {
            let bits = self.condition(*id);
            shifted(bits, *last, &mut earlier);
            for ((changes, now), earlier) in changes.iter_mut().zip(bits).zip(&earlier) {
                *changes |= now ^ earlier;
            }
            *last = get(bits, len - 1);
        }
        for (word, changes) in changes.iter_mut().enumerate() {
            *changes &= if word < words(len) { frames_of(len, word) } else { 0 };
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
fn number_column<'a>(plan: &Plan, numbers: &'a Buffers, id: NumberId, block: &'a Block<'_>) -> &'a [f64] {
    match plan.numbers[id.index()].0 {
        Number::Input(column) => block.column(column),
        _ => numbers.get(id, block.len),
    }
}

#[inline(always)]
fn side<'a>(plan: &Plan, numbers: &'a Buffers, id: NumberId, block: &'a Block<'_>) -> Side<'a> {
    match plan.numbers[id.index()].0 {
        Number::Constant(number) => Side::Constant(Exact::get(number)),
        _ => Side::Column(number_column(plan, numbers, id, block)),
    }
}
