//! The operators of the language for one element: a slot of an array, or a single value.

use super::stateful_nodes::Targets;
use super::{Instantiation, Item, only_bits, tally_misused};
use crate::compiled::plan::{BitId, Condition, Number, NumberId, StatefulNode};
use crate::semantics::{internal, times};
use crate::temporal_state::ReducedOperator;
use teachtree_base::channels::Shape;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_language::graph::{FloatBits, Op, ValueId};
use teachtree_language::ops::{Operand, TemporalOperator};
use teachtree_language::rules::{Arithmetic, Comparison};

impl Instantiation<'_> {
    /// One element of an operation that maps over arrays.
    pub(super) fn element(
        &mut self,
        op: &Op,
        args: &[&[Item]],
        reads: &[ValueId],
        this: Option<Side>,
    ) -> Result<Vec<Item>, InputError> {
        let tally = args.iter().any(|arg| matches!(arg.first(), Some(Item::Tally(_))));
        if tally && !matches!(op, Op::Compare(_) | Op::Hysteresis { .. }) {
            return Err(tally_misused());
        }
        let targets = reads.iter().fold(Targets::default(), |all, arg| all.and(self.targets(*arg, this)));
        let conditions = || args.iter().filter_map(|arg| arg.first().copied()).collect::<Vec<_>>();
        Ok(match op {
            Op::Negate => self.each(args[0], |instantiation, a| {
                let delay = instantiation.number_delay(a);
                instantiation.number(Number::Negate(a), delay)
            }),
            Op::Arithmetic(operation) => self.arithmetic(*operation, args[0], args[1])?,
            Op::Compare(comparison) => {
                let object = reads.first().is_some_and(|arg| self.graph.value(*arg).ty.shape == Shape::Object);
                vec![match (args[0][0], args[1][0]) {
                    (Item::Number(a), Item::Number(b)) if object => Item::Bit(self.same_object(*comparison, a, b)),
                    (Item::Number(a), Item::Number(b)) => Item::Bit(self.compare(*comparison, a, b)),
                    (Item::Tally(tally), Item::Number(number)) => self.compare_tally(tally, *comparison, number)?,
                    (Item::Number(number), Item::Tally(tally)) => {
                        self.compare_tally(tally, comparison.swapped(), number)?
                    }
                    _ => return Err(tally_misused()),
                }]
            }
            Op::Not => vec![self.not(single(args)?)?],
            Op::And => vec![self.all(&conditions())?],
            Op::Or => vec![self.any(&conditions())?],
            Op::Hysteresis { on, off, rising } => {
                let (beyond, back) = if *rising {
                    (Comparison::Greater, Comparison::Less)
                } else {
                    (Comparison::Less, Comparison::Greater)
                };
                let (on, off) = (self.constant(on.get()), self.constant(off.get()));
                vec![match args[0][0] {
                    Item::Number(number) => {
                        let delay = self.number_delay(number);
                        let set = self.compare(beyond, number, on);
                        let back = self.compare(back, number, off);
                        let keep = self.bit(Condition::Not(back), delay);
                        Item::Bit(self.flip_flop(set, keep, targets, delay))
                    }
                    Item::Tally(tally) => {
                        let set = self.compare_tally(tally, beyond, on)?;
                        let back = self.compare_tally(tally, back, off)?;
                        let (set, clear) = (self.stateful_of(set)?, self.stateful_of(back)?);
                        let restart = self.restart_node(targets)?;
                        Item::Stateful(self.stateful(StatefulNode::Latch { set, clear, restart }))
                    }
                    Item::Bit(_) | Item::Stateful(_) => {
                        return Err(internal("a hysteresis expects a number"));
                    }
                }]
            }
            Op::Temporal(temporal) => {
                let temporal = self.in_samples(temporal)?;
                vec![self.temporal(temporal, single(args)?, targets)?]
            }
            Op::Rate(duration) => {
                let frames = self.frames(*duration)?;
                let mut out = Vec::new();
                for item in args[0] {
                    let Item::Number(number) = *item else { return Err(internal("a rate expects numbers")) };
                    let delay = self.number_delay(number);
                    let restart = self.restart_on(targets, delay);
                    out.push(Item::Number(self.number(Number::Rate { number, frames, restart }, delay)));
                }
                out
            }
            Op::Summary(summary, duration) => self.summary(*summary, *duration, args, targets)?,
            Op::Call(function) => self.call(*function, args)?,
            Op::Bool(_)
            | Op::Number(_)
            | Op::Channel(..)
            | Op::Latch(..)
            | Op::From { .. }
            | Op::Pick(_)
            | Op::Component(_) => return Err(internal("a value without slots is taken apart by slots")),
        })
    }

    pub(super) fn each(&mut self, items: &[Item], mut f: impl FnMut(&mut Self, NumberId) -> NumberId) -> Vec<Item> {
        items
            .iter()
            .map(|item| match item {
                Item::Number(number) => Item::Number(f(self, *number)),
                other => *other,
            })
            .collect()
    }

    pub(super) fn binary(&mut self, operation: Arithmetic, a: NumberId, b: NumberId) -> NumberId {
        let ([a, b], delay) = self.together([a, b]);
        self.number(Number::Arithmetic(operation, a, b), delay)
    }

    /// `vec3 op vec3`, `vec3 op scalar`, `scalar op vec3` and scalars, component by component.
    pub(super) fn arithmetic(
        &mut self,
        operation: Arithmetic,
        a: &[Item],
        b: &[Item],
    ) -> Result<Vec<Item>, InputError> {
        let components = (0..a.len().max(b.len())).map(|at| {
            match (a.get(at).or_else(|| a.first()), b.get(at).or_else(|| b.first())) {
                (Some(Item::Number(a)), Some(Item::Number(b))) => Ok(Item::Number(self.binary(operation, *a, *b))),
                _ => Err(internal("arithmetic expects numbers")),
            }
        });
        components.collect()
    }

    pub(super) fn compare_tally(
        &mut self,
        tally: u32,
        comparison: Comparison,
        number: NumberId,
    ) -> Result<Item, InputError> {
        let Number::Constant(number) = self.plan.numbers[number.index()].0 else { return Err(tally_misused()) };
        let stateful = self.tallies[tally as usize].clone();
        Ok(Item::Stateful(self.stateful(StatefulNode::Count(stateful, comparison, number))))
    }

    /// Two missing objects are not equal.
    pub(super) fn same_object(&mut self, comparison: Comparison, a: NumberId, b: NumberId) -> BitId {
        let zero = self.constant(0.0);
        let (equal, some) = (self.compare(Comparison::Equal, a, b), self.compare(Comparison::GreaterEqual, a, zero));
        let (both, delay) = self.bits_together(&[equal, some]);
        let same = self.bit(Condition::And(both), delay);
        if comparison == Comparison::NotEqual { self.bit(Condition::Not(same), delay) } else { same }
    }

    pub(super) fn not(&mut self, item: Item) -> Result<Item, InputError> {
        if let Some(known) = self.known(item) {
            return Ok(self.truth(!known));
        }
        Ok(match item {
            Item::Bit(bit) => {
                let delay = self.bit_delay(bit);
                Item::Bit(self.bit(Condition::Not(bit), delay))
            }
            other => {
                let memory = self.stateful_of(other)?;
                Item::Stateful(self.stateful(StatefulNode::Not(memory)))
            }
        })
    }

    /// Returns the value of a condition that is the same on every frame, `None` for any other.
    pub(super) fn known(&self, item: Item) -> Option<bool> {
        match item {
            Item::Bit(bit) => match self.plan.conditions[bit.index()].0 {
                Condition::Constant(known) => Some(known),
                _ => None,
            },
            _ => None,
        }
    }

    pub(super) fn truth(&mut self, value: bool) -> Item {
        Item::Bit(self.bit(Condition::Constant(value), 0))
    }

    /// Returns the conditions that decide whether all hold (whether any holds, if `neutral` is false), `None` if a constant decides. Constants are left
    /// out, so that a run does not wait for a condition without effect.
    fn undecided(&self, items: &[Item], neutral: bool) -> Option<Vec<Item>> {
        let decides = |item: &Item| self.known(*item) == Some(!neutral);
        let is_open = |item: &&Item| self.known(**item).is_none();
        (!items.iter().any(decides)).then(|| items.iter().filter(is_open).copied().collect())
    }

    pub(super) fn all(&mut self, items: &[Item]) -> Result<Item, InputError> {
        let Some(items) = self.undecided(items, true) else { return Ok(self.truth(false)) };
        Ok(match only_bits(&items) {
            _ if items.is_empty() => self.truth(true),
            Some(bits) => {
                let (bits, delay) = self.bits_together(&bits);
                Item::Bit(self.bit(Condition::And(bits), delay))
            }
            None => {
                let all = items.iter().map(|item| self.stateful_of(*item)).collect::<Result<_, _>>()?;
                Item::Stateful(self.stateful(StatefulNode::And(all)))
            }
        })
    }

    pub(super) fn any(&mut self, items: &[Item]) -> Result<Item, InputError> {
        let Some(items) = self.undecided(items, false) else { return Ok(self.truth(true)) };
        Ok(match only_bits(&items) {
            _ if items.is_empty() => self.truth(false),
            Some(bits) => {
                let (bits, delay) = self.bits_together(&bits);
                Item::Bit(self.bit(Condition::Or(bits), delay))
            }
            None => {
                let any = items.iter().map(|item| self.stateful_of(*item)).collect::<Result<_, _>>()?;
                Item::Stateful(self.stateful(StatefulNode::Or(any)))
            }
        })
    }

    /// An operator over time with its constants in samples; a number of times is rounded up.
    fn in_samples(&self, temporal: &TemporalOperator<FloatBits>) -> Result<TemporalOperator<u32>, InputError> {
        let mut samples = Vec::new();
        for (constant, kind) in temporal.constants().into_iter().zip(temporal.kinds()) {
            samples.push(match kind {
                Operand::Times => times(constant.get()),
                _ => self.frames(*constant)?,
            });
        }
        TemporalOperator::new(temporal.name(), samples)
            .ok_or_else(|| internal("an operator over time lacks a constant"))
    }

    fn temporal(&mut self, temporal: TemporalOperator<u32>, item: Item, targets: Targets) -> Result<Item, InputError> {
        let Some(ReducedOperator { operator, negated, ahead }) = ReducedOperator::of(temporal) else {
            return Err(internal("the graph did not write an operator over time out"));
        };
        let item = if negated { self.not(item)? } else { item };
        Ok(match (item, ahead) {
            // Conditions do not hold after the end.
            (Item::Bit(bit), Some(ahead)) => {
                let delay = self.bit_delay(bit);
                let inside = self.bit(Condition::InLog, 0);
                let inside = self.late_bit(inside, delay);
                let condition = self.bit(Condition::And(vec![bit, inside]), delay);
                Item::Bit(self.bit(Condition::Temporal(operator, condition, None), delay + ahead))
            }
            (Item::Bit(bit), None) => {
                let delay = self.bit_delay(bit);
                let restart = self.restart_on(targets, delay);
                Item::Bit(self.bit(Condition::Temporal(operator, bit, restart), delay))
            }
            (_, Some(_)) => return Err(internal("`within next` looks at what is known only frame by frame")),
            (other, None) => {
                let (memory, restart) = (self.stateful_of(other)?, self.restart_node(targets)?);
                Item::Stateful(self.stateful(StatefulNode::Temporal(operator, memory, restart)))
            }
        })
    }
}

/// The value of the first argument, which is not a vector.
fn single(args: &[&[Item]]) -> Result<Item, InputError> {
    let item = args.first().and_then(|arg| arg.first()).copied();
    item.ok_or_else(|| internal("an operator lacks its argument"))
}
