//! The operators of the language for one element: a slot of an array, or a single value.

use super::memory::Targets;
use super::{Item, Opening, only_bits, tally_misused};
use crate::base::channels::Shape;
use crate::base::error::InputError;
use crate::base::hands::Side;
use crate::engine::plan::{BitId, Condition, Memory, Number, NumberId};
use crate::graph::{Op, ValueId};
use crate::language::rules::{Arithmetic, Comparison, Window};

impl Opening<'_> {
    /// One element of an operation that maps over arrays.
    pub(super) fn element(
        &mut self,
        op: &Op,
        args: &[&[Item]],
        arg: Option<ValueId>,
        this: Option<Side>,
    ) -> Result<Vec<Item>, InputError> {
        let tally = args.iter().any(|arg| matches!(arg.first(), Some(Item::Tally(_))));
        if tally && !matches!(op, Op::Compare(_) | Op::Hysteresis { .. }) {
            return Err(tally_misused());
        }
        let targets = arg.map(|arg| self.targets(arg, this)).unwrap_or_default();
        let conditions = || args.iter().filter_map(|arg| arg.first().copied()).collect::<Vec<_>>();
        Ok(match op {
            Op::Negate => self.each(args[0], |opening, a| {
                let delay = opening.number_delay(a);
                opening.number(Number::Negate(a), delay)
            }),
            Op::Arithmetic(operation) => self.arithmetic(*operation, args[0], args[1]),
            Op::Compare(comparison) => {
                let object = arg.is_some_and(|arg| self.graph.value(arg).ty.shape == Shape::Object);
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
            Op::Not => vec![self.not(args[0][0])],
            Op::And => vec![self.all(&conditions())],
            Op::Or => vec![self.any(&conditions())],
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
                        let (set, clear) = (self.memory_of(set), self.memory_of(back));
                        let restart = self.restart_memory(targets);
                        Item::Memory(self.memory(Memory::Latch { set, clear, restart }))
                    }
                    other => other,
                }]
            }
            Op::Window(window, duration) => {
                let frames = self.frames(*duration)?;
                vec![self.window(*window, args[0][0], frames, targets)]
            }
            Op::Rate(duration) => {
                let frames = self.frames(*duration)?;
                let mut out = Vec::new();
                for item in args[0] {
                    let Item::Number(number) = *item else { continue };
                    let delay = self.number_delay(number);
                    let restart = self.restart_on(targets, delay);
                    out.push(Item::Number(self.number(Number::Rate { number, frames, restart }, delay)));
                }
                out
            }
            Op::Rises | Op::Falls => {
                let item = if matches!(op, Op::Falls) { self.not(args[0][0]) } else { args[0][0] };
                vec![match item {
                    Item::Bit(bit) => {
                        let delay = self.bit_delay(bit);
                        let restart = self.restart_on(targets, delay);
                        Item::Bit(self.bit(Condition::Rises(bit, restart), delay))
                    }
                    other => {
                        let (memory, restart) = (self.memory_of(other), self.restart_memory(targets));
                        Item::Memory(self.memory(Memory::Rises(memory, restart)))
                    }
                }]
            }
            Op::Call(function) => self.call(*function, args),
            Op::Bool(_)
            | Op::Number(_)
            | Op::Channel(..)
            | Op::Latch(..)
            | Op::From { .. }
            | Op::Pick(_)
            | Op::Component(_) => Vec::new(),
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
    pub(super) fn arithmetic(&mut self, operation: Arithmetic, a: &[Item], b: &[Item]) -> Vec<Item> {
        (0..a.len().max(b.len()))
            .filter_map(|at| match (a.get(at).or_else(|| a.first()), b.get(at).or_else(|| b.first())) {
                (Some(Item::Number(a)), Some(Item::Number(b))) => Some(Item::Number(self.binary(operation, *a, *b))),
                _ => None,
            })
            .collect()
    }

    pub(super) fn compare_tally(
        &mut self,
        tally: u32,
        comparison: Comparison,
        number: NumberId,
    ) -> Result<Item, InputError> {
        let Number::Constant(number) = self.plan.numbers[number.index()].0 else { return Err(tally_misused()) };
        let memories = self.tallies[tally as usize].clone();
        Ok(Item::Memory(self.memory(Memory::Count(memories, comparison, number))))
    }

    /// No object is not the same object as no object.
    pub(super) fn same_object(&mut self, comparison: Comparison, a: NumberId, b: NumberId) -> BitId {
        let zero = self.constant(0.0);
        let (equal, some) = (self.compare(Comparison::Equal, a, b), self.compare(Comparison::GreaterEqual, a, zero));
        let (both, delay) = self.bits_together(&[equal, some]);
        let same = self.bit(Condition::And(both), delay);
        if comparison == Comparison::NotEqual { self.bit(Condition::Not(same), delay) } else { same }
    }

    pub(super) fn not(&mut self, item: Item) -> Item {
        match item {
            Item::Bit(bit) => {
                let delay = self.bit_delay(bit);
                Item::Bit(self.bit(Condition::Not(bit), delay))
            }
            other => {
                let memory = self.memory_of(other);
                Item::Memory(self.memory(Memory::Not(memory)))
            }
        }
    }

    pub(super) fn all(&mut self, items: &[Item]) -> Item {
        match only_bits(items) {
            Some(bits) => {
                let (bits, delay) = self.bits_together(&bits);
                Item::Bit(self.bit(Condition::And(bits), delay))
            }
            None => {
                let all = items.iter().map(|item| self.memory_of(*item)).collect();
                Item::Memory(self.memory(Memory::And(all)))
            }
        }
    }

    pub(super) fn any(&mut self, items: &[Item]) -> Item {
        match only_bits(items) {
            Some(bits) => {
                let (bits, delay) = self.bits_together(&bits);
                Item::Bit(self.bit(Condition::Or(bits), delay))
            }
            None => {
                let any = items.iter().map(|item| self.memory_of(*item)).collect();
                Item::Memory(self.memory(Memory::Or(any)))
            }
        }
    }

    pub(super) fn window(&mut self, window: Window, item: Item, frames: u32, targets: Targets) -> Item {
        match (window, item) {
            // What is true within the next n frames is true within the last n frames, n - 1 frames later; nothing is true after the end.
            (Window::WithinNext, Item::Bit(bit)) => {
                let delay = self.bit_delay(bit);
                let inside = self.bit(Condition::Inside, 0);
                let inside = self.late_bit(inside, delay);
                let condition = self.bit(Condition::And(vec![bit, inside]), delay);
                Item::Bit(self.bit(Condition::WithinLast(condition, frames, None), delay + frames - 1))
            }
            (_, Item::Bit(bit)) => {
                let delay = self.bit_delay(bit);
                let restart = self.restart_on(targets, delay);
                Item::Bit(match window {
                    Window::For => self.bit(Condition::For(bit, frames, restart), delay),
                    _ => self.bit(Condition::WithinLast(bit, frames, restart), delay),
                })
            }
            (window, other) => {
                let (memory, restart) = (self.memory_of(other), self.restart_memory(targets));
                Item::Memory(match window {
                    Window::For => self.memory(Memory::For(memory, frames, restart)),
                    _ => self.memory(Memory::WithinLast(memory, frames, restart)),
                })
            }
        }
    }
}
