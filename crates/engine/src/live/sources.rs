//! Numbers and the conditions that compare them, on every frame: operations of one kind that do not wait for each other are done one after the other in
//! one loop, so that no branch per operation is needed.

use super::ranks::Ranks;
use crate::compiled::plan::{BitId, Condition, Number, NumberId, Plan, Step, Vector, position};
use crate::semantics::per_second;
use crate::summary;
use teachtree_language::rules::{Arithmetic, Comparison};

/// The sources of one rank, in the order of evaluation.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    batches: Vec<Batch>,
    rates: Vec<Rate>,
    summaries: Vec<Summary>,
    delays: Vec<Delay>,
    changes: Vec<Change>,
}

/// The index of a number among the values.
type Place = u32;

/// Operations of one kind; where they write comes last.
#[derive(Clone, Debug)]
enum Batch {
    Negate(Vec<(Place, Place)>),
    Abs(Vec<(Place, Place)>),
    Add(Vec<(Place, Place, Place)>),
    Subtract(Vec<(Place, Place, Place)>),
    Multiply(Vec<(Place, Place, Place)>),
    Divide(Vec<(Place, Place, Place)>),
    Min(Vec<(Place, Place, Place)>),
    Max(Vec<(Place, Place, Place)>),
    Atan2(Vec<(Place, Place, Place)>),
    MulSub(Vec<([Place; 3], Place)>),
    Sum(Vec<(Vec<Place>, Place)>),
    Dot(Vec<([Place; 3], [Place; 3], Place)>),
    Norm(Vec<([Place; 3], Place)>),
    Distance(Vec<([Place; 3], [Place; 3], Place)>),
    Count(Vec<(Vec<BitId>, Place)>),
    /// Positions in `Sources::rates`.
    Rate(Vec<(usize, Place)>),
    /// Positions in `Sources::summaries`.
    Summary(Vec<(usize, Place)>),
    /// Positions in `Sources::delays`.
    Delay(Vec<(usize, Place)>),
    Compare(Comparison, Vec<(Place, Place, BitId)>),
    NormSquaredCmp(Comparison, Vec<([Place; 3], f64, BitId)>),
    SquaredDistance(Comparison, Vec<([Place; 3], [Place; 3], f64, BitId)>),
    /// Positions in `Sources::changes`.
    Changes(Vec<(usize, BitId)>),
}

#[derive(Clone, Debug)]
struct Rate {
    number: Place,
    past: Vec<f64>,
    at: usize,
    age: usize,
    per_second: f64,
    restart: Option<BitId>,
}

#[derive(Clone, Debug)]
struct Summary {
    number: Place,
    since: Option<BitId>,
    restart: Option<BitId>,
    aggregation: summary::Aggregation,
    state: summary::State,
}

impl Summary {
    fn frame(&self, values: &[f64], bits: &[bool]) -> summary::Frame {
        let is = |id: Option<BitId>| id.is_some_and(|id| bits[id.index()]);
        summary::Frame { now: values[self.number as usize], holds: is(self.since), anew: is(self.restart) }
    }
}

#[derive(Clone, Debug)]
struct Delay {
    number: Place,
    past: Vec<f64>,
    at: usize,
}

#[derive(Clone, Debug)]
struct Change {
    number: Place,
    last: f64,
}

/// The index of a number of the plan: inputs first, then numbers; constants are filled in.
fn place(plan: &Plan, id: NumberId) -> Place {
    match plan.numbers[id.index()].0 {
        Number::Input(column) => column,
        _ => position(plan.inputs.len() + id.index()),
    }
}

/// The values before the first frame, and one half after them for conditions that are read from the log.
pub fn constants(plan: &Plan) -> Vec<f64> {
    let numbers =
        plan.numbers.iter().map(|(number, _)| if let Number::Constant(number) = number { number.get() } else { 0.0 });
    plan.inputs.iter().map(|_| 0.0).chain(numbers).chain([0.5]).collect()
}

impl Sources {
    /// The numbers of a rank and the conditions that compare them.
    pub fn of(plan: &Plan, ranks: &Ranks, rank: u32) -> Self {
        let mut sources = Self::default();
        let mut levels = Levels::new(plan);
        let mut steps: Vec<(u32, Step)> = Vec::new();
        for step in plan.steps.iter().filter(|step| ranks.of_step(**step) == rank) {
            let wanted = match step {
                Step::Number(id) => !matches!(plan.numbers[id.index()].0, Number::Input(_) | Number::Constant(_)),
                Step::Condition(id) => matches!(
                    plan.conditions[id.index()].0,
                    Condition::Input(_)
                        | Condition::Changes(_)
                        | Condition::Compare(..)
                        | Condition::NormSquaredCmp(..)
                ),
            };
            if wanted {
                steps.push((levels.of(plan, *step), *step));
            }
        }
        // Operations of a level read only what is below it: they may stand in any order.
        steps.sort_by_key(|(level, _)| *level);
        let mut begun = 0;
        let mut level = 0;
        for (of_step, step) in steps {
            if of_step != level {
                (level, begun) = (of_step, sources.batches.len());
            }
            let batch = sources.batch(plan, step);
            let like = |known: &&mut Batch| std::mem::discriminant(*known) == std::mem::discriminant(&batch);
            match sources.batches[begun..].iter_mut().filter(like).find(|known| known.same_comparison(&batch)) {
                Some(known) => known.join(batch),
                None => sources.batches.push(batch),
            }
        }
        sources
    }

    /// A step as a batch of its own.
    fn batch(&mut self, plan: &Plan, step: Step) -> Batch {
        let at = |id: &NumberId| place(plan, *id);
        let three = |ids: &[NumberId; 3]| ids.map(|id| place(plan, id));
        match step {
            Step::Number(id) => {
                let out = place(plan, id);
                match &plan.numbers[id.index()].0 {
                    // These are not steps; the sum of nothing does nothing.
                    Number::Input(_) | Number::Constant(_) => Batch::Sum(Vec::new()),
                    Number::Negate(a) => Batch::Negate(vec![(at(a), out)]),
                    Number::Abs(a) => Batch::Abs(vec![(at(a), out)]),
                    Number::Arithmetic(operation, a, b) => {
                        let batch = match operation {
                            Arithmetic::Add => Batch::Add,
                            Arithmetic::Subtract => Batch::Subtract,
                            Arithmetic::Multiply => Batch::Multiply,
                            Arithmetic::Divide => Batch::Divide,
                        };
                        batch(vec![(at(a), at(b), out)])
                    }
                    Number::Min(a, b) => Batch::Min(vec![(at(a), at(b), out)]),
                    Number::Max(a, b) => Batch::Max(vec![(at(a), at(b), out)]),
                    Number::Atan2(y, x) => Batch::Atan2(vec![(at(y), at(x), out)]),
                    Number::MulSub(a, b, c) => Batch::MulSub(vec![([at(a), at(b), at(c)], out)]),
                    Number::Sum(all) => Batch::Sum(vec![(all.iter().map(at).collect(), out)]),
                    Number::Dot(a, b) => Batch::Dot(vec![(three(a), three(b), out)]),
                    Number::Norm(Vector { of, minus: None }) => Batch::Norm(vec![(three(of), out)]),
                    Number::Norm(Vector { of, minus: Some(minus) }) => {
                        Batch::Distance(vec![(three(of), three(minus), out)])
                    }
                    Number::Count(bits) => Batch::Count(vec![(bits.clone(), out)]),
                    Number::Rate { number, frames, restart } => {
                        self.rates.push(Rate {
                            number: at(number),
                            past: vec![0.0; *frames as usize],
                            at: 0,
                            age: 0,
                            per_second: per_second(plan.layout.rate_hz, *frames),
                            restart: *restart,
                        });
                        Batch::Rate(vec![(self.rates.len() - 1, out)])
                    }
                    Number::Summary { summary, number, samples, restart } => {
                        self.summaries.push(Summary {
                            number: at(number),
                            since: samples.since().copied(),
                            restart: *restart,
                            aggregation: summary::Aggregation { summary: *summary, rate: plan.layout.rate_hz },
                            state: summary::State::new(samples),
                        });
                        Batch::Summary(vec![(self.summaries.len() - 1, out)])
                    }
                    Number::Delay(number, frames) => {
                        self.delays.push(Delay { number: at(number), past: vec![0.0; *frames as usize], at: 0 });
                        Batch::Delay(vec![(self.delays.len() - 1, out)])
                    }
                }
            }
            Step::Condition(id) => match &plan.conditions[id.index()].0 {
                Condition::Input(column) => {
                    let half = position(plan.inputs.len() + plan.numbers.len());
                    Batch::Compare(Comparison::Greater, vec![(*column, half, id)])
                }
                Condition::Compare(comparison, a, b) => Batch::Compare(*comparison, vec![(at(a), at(b), id)]),
                Condition::NormSquaredCmp(comparison, Vector { of, minus: None }, threshold) => {
                    Batch::NormSquaredCmp(*comparison, vec![(three(of), threshold.get(), id)])
                }
                Condition::NormSquaredCmp(comparison, Vector { of, minus: Some(minus) }, threshold) => {
                    Batch::SquaredDistance(*comparison, vec![(three(of), three(minus), threshold.get(), id)])
                }
                Condition::Changes(column) => {
                    self.changes.push(Change { number: *column, last: 0.0 });
                    Batch::Changes(vec![(self.changes.len() - 1, id)])
                }
                // These are events.
                _ => Batch::Sum(Vec::new()),
            },
        }
    }

    /// Forgets everything.
    pub fn restart(&mut self) {
        for rate in &mut self.rates {
            rate.past.fill(0.0);
            (rate.at, rate.age) = (0, 0);
        }
        for summary in &mut self.summaries {
            summary.state.restart();
        }
        for delay in &mut self.delays {
            delay.past.fill(0.0);
            delay.at = 0;
        }
        for change in &mut self.changes {
            change.last = 0.0;
        }
    }

    /// Works out this frame, from the conditions as they are known, and returns whether a condition has changed. It may be asked again.
    pub fn run(&self, values: &mut [f64], bits: &mut [bool], first: bool, inside: bool) -> bool {
        let mut changed = false;
        for batch in &self.batches {
            changed |= match batch {
                Batch::Compare(comparison, all) => compare(*comparison, all, values, bits),
                Batch::NormSquaredCmp(comparison, all) => {
                    tests(*comparison, all.iter().map(|(of, square, id)| (squares(values, of), *square, *id)), bits)
                }
                Batch::SquaredDistance(comparison, all) => {
                    let each = all.iter().map(|(a, b, square, id)| (squared_distance(values, a, b), *square, *id));
                    tests(*comparison, each, bits)
                }
                Batch::Changes(all) => {
                    let mut changed = false;
                    for (at, id) in all {
                        let change = &self.changes[*at];
                        let now = values[change.number as usize];
                        let changes = inside && !first && now.to_bits() != change.last.to_bits();
                        changed |= bits[id.index()] != changes;
                        bits[id.index()] = changes;
                    }
                    changed
                }
                numbers => {
                    self.numbers(numbers, values, bits);
                    false
                }
            };
        }
        changed
    }

    fn numbers(&self, batch: &Batch, values: &mut [f64], bits: &[bool]) {
        match batch {
            Batch::Negate(all) => unary(all, values, |a| -a),
            Batch::Abs(all) => unary(all, values, f64::abs),
            Batch::Add(all) => binary(all, values, |a, b| a + b),
            Batch::Subtract(all) => binary(all, values, |a, b| a - b),
            Batch::Multiply(all) => binary(all, values, |a, b| a * b),
            Batch::Divide(all) => binary(all, values, |a, b| a / b),
            Batch::Min(all) => binary(all, values, f64::min),
            Batch::Max(all) => binary(all, values, f64::max),
            Batch::Atan2(all) => binary(all, values, f64::atan2),
            Batch::MulSub(all) => {
                for ([a, b, c], out) in all {
                    values[*out as usize] = values[*a as usize] - values[*b as usize] * values[*c as usize];
                }
            }
            Batch::Sum(all) => {
                for (parts, out) in all {
                    let Some((first, rest)) = parts.split_first() else { continue };
                    let mut sum = values[*first as usize];
                    for part in rest {
                        sum += values[*part as usize];
                    }
                    values[*out as usize] = sum;
                }
            }
            Batch::Dot(all) => {
                for (a, b, out) in all {
                    let product = |at: usize| values[a[at] as usize] * values[b[at] as usize];
                    values[*out as usize] = product(0) + product(1) + product(2);
                }
            }
            Batch::Norm(all) => {
                for (of, out) in all {
                    values[*out as usize] = squares(values, of).sqrt();
                }
            }
            Batch::Distance(all) => {
                for (a, b, out) in all {
                    values[*out as usize] = squared_distance(values, a, b).sqrt();
                }
            }
            Batch::Count(all) => {
                for (ids, out) in all {
                    let count: u32 = ids.iter().map(|id| u32::from(bits[id.index()])).sum();
                    values[*out as usize] = f64::from(count);
                }
            }
            Batch::Rate(all) => {
                for (at, out) in all {
                    let rate = &self.rates[*at];
                    let anew = rate.restart.is_some_and(|id| bits[id.index()]);
                    let (now, before) = (values[rate.number as usize], rate.past[rate.at]);
                    let known = rate.age >= rate.past.len() && !anew;
                    values[*out as usize] = if known { (now - before) * rate.per_second } else { 0.0 };
                }
            }
            Batch::Summary(all) => {
                for (at, out) in all {
                    let summary = &self.summaries[*at];
                    values[*out as usize] = summary.state.value(summary.aggregation, summary.frame(values, bits));
                }
            }
            Batch::Delay(all) => {
                for (at, out) in all {
                    let delay = &self.delays[*at];
                    values[*out as usize] = delay.past[delay.at];
                }
            }
            // These are conditions.
            Batch::Compare(..) | Batch::NormSquaredCmp(..) | Batch::SquaredDistance(..) | Batch::Changes(_) => {}
        }
    }

    /// Advances to the next frame.
    pub fn advance(&mut self, values: &[f64], bits: &[bool]) {
        for rate in &mut self.rates {
            rate.past[rate.at] = values[rate.number as usize];
            rate.at = if rate.at + 1 == rate.past.len() { 0 } else { rate.at + 1 };
            let age = if rate.restart.is_some_and(|id| bits[id.index()]) { 0 } else { rate.age };
            rate.age = (age + 1).min(rate.past.len());
        }
        for summary in &mut self.summaries {
            let frame = summary.frame(values, bits);
            summary.state.advance(summary.aggregation, frame);
        }
        for delay in &mut self.delays {
            delay.past[delay.at] = values[delay.number as usize];
            delay.at = if delay.at + 1 == delay.past.len() { 0 } else { delay.at + 1 };
        }
        for change in &mut self.changes {
            change.last = values[change.number as usize];
        }
    }
}

impl Batch {
    fn same_comparison(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Compare(a, _), Self::Compare(b, _))
            | (Self::NormSquaredCmp(a, _), Self::NormSquaredCmp(b, _))
            | (Self::SquaredDistance(a, _), Self::SquaredDistance(b, _)) => a == b,
            _ => true,
        }
    }

    /// Takes in another batch of its kind.
    fn join(&mut self, other: Self) {
        match (self, other) {
            (Self::Negate(all), Self::Negate(more)) | (Self::Abs(all), Self::Abs(more)) => all.extend(more),
            (Self::Add(all), Self::Add(more))
            | (Self::Subtract(all), Self::Subtract(more))
            | (Self::Multiply(all), Self::Multiply(more))
            | (Self::Divide(all), Self::Divide(more))
            | (Self::Min(all), Self::Min(more))
            | (Self::Max(all), Self::Max(more))
            | (Self::Atan2(all), Self::Atan2(more)) => all.extend(more),
            (Self::MulSub(all), Self::MulSub(more)) | (Self::Norm(all), Self::Norm(more)) => all.extend(more),
            (Self::Sum(all), Self::Sum(more)) => all.extend(more),
            (Self::Dot(all), Self::Dot(more)) | (Self::Distance(all), Self::Distance(more)) => all.extend(more),
            (Self::Count(all), Self::Count(more)) => all.extend(more),
            (Self::Rate(all), Self::Rate(more))
            | (Self::Summary(all), Self::Summary(more))
            | (Self::Delay(all), Self::Delay(more)) => all.extend(more),
            (Self::Compare(_, all), Self::Compare(_, more)) => all.extend(more),
            (Self::NormSquaredCmp(_, all), Self::NormSquaredCmp(_, more)) => all.extend(more),
            (Self::SquaredDistance(_, all), Self::SquaredDistance(_, more)) => all.extend(more),
            (Self::Changes(all), Self::Changes(more)) => all.extend(more),
            // Only batches of one kind are joined.
            _ => {}
        }
    }
}

/// Returns the number of steps of the rank that precede a step.
struct Levels(Vec<u32>);

impl Levels {
    fn new(plan: &Plan) -> Self {
        Self(vec![0; plan.numbers.len()])
    }

    /// The level of a step; what it reads was asked for before.
    fn of(&mut self, plan: &Plan, step: Step) -> u32 {
        let level = plan.reads(step).0.iter().map(|id| self.0[id.index()]).max().unwrap_or(0);
        if let Step::Number(id) = step {
            self.0[id.index()] = level + 1;
        }
        level
    }
}

fn unary(all: &[(Place, Place)], values: &mut [f64], f: impl Fn(f64) -> f64) {
    for (a, out) in all {
        values[*out as usize] = f(values[*a as usize]);
    }
}

fn binary(all: &[(Place, Place, Place)], values: &mut [f64], f: impl Fn(f64, f64) -> f64) {
    for (a, b, out) in all {
        values[*out as usize] = f(values[*a as usize], values[*b as usize]);
    }
}

fn squares(values: &[f64], [x, y, z]: &[Place; 3]) -> f64 {
    let [x, y, z] = [values[*x as usize], values[*y as usize], values[*z as usize]];
    x * x + y * y + z * z
}

fn squared_distance(values: &[f64], a: &[Place; 3], b: &[Place; 3]) -> f64 {
    let part = |at: usize| values[a[at] as usize] - values[b[at] as usize];
    let [x, y, z] = [part(0), part(1), part(2)];
    x * x + y * y + z * z
}

fn compare(comparison: Comparison, all: &[(Place, Place, BitId)], values: &[f64], bits: &mut [bool]) -> bool {
    tests(comparison, all.iter().map(|(a, b, id)| (values[*a as usize], values[*b as usize], *id)), bits)
}

/// Writes down what each comparison says, and whether one says something else than before.
fn tests(comparison: Comparison, all: impl Iterator<Item = (f64, f64, BitId)>, bits: &mut [bool]) -> bool {
    match comparison {
        Comparison::Less => test(all, bits, |a, b| a < b),
        Comparison::LessEqual => test(all, bits, |a, b| a <= b),
        Comparison::Greater => test(all, bits, |a, b| a > b),
        Comparison::GreaterEqual => test(all, bits, |a, b| a >= b),
        Comparison::Equal => test(all, bits, |a, b| a == b),
        Comparison::NotEqual => test(all, bits, |a, b| a != b),
    }
}

fn test(all: impl Iterator<Item = (f64, f64, BitId)>, bits: &mut [bool], f: impl Fn(f64, f64) -> bool) -> bool {
    let mut changed = false;
    for (a, b, id) in all {
        let holds = f(a, b);
        changed |= bits[id.index()] != holds;
        bits[id.index()] = holds;
    }
    changed
}
