//! Memory and its restarts: latches, and what makes an operator with memory begin anew.

use super::{Item, Opening};
use crate::base::error::InputError;
use crate::base::hands::Side;
use crate::engine::plan::{BitId, Condition, Memory, MemoryId};
use crate::graph::{Op, ValueId};
use crate::language::rules::LatchId;
use crate::stream::frames::ColumnKey;
use std::collections::BTreeSet;

impl Opening<'_> {
    /// The condition that restarts whatever reads the targets that this value reads, at the given delay.
    pub(super) fn restart(&mut self, value: ValueId, this: Option<Side>, delay: u32) -> Option<BitId> {
        let targets = self.targets(&[value], this);
        self.restart_on(&targets, delay)
    }

    /// What comes out of a delay before the first frame is nothing, so an operator with memory behind one restarts on that frame too.
    pub(super) fn restart_on(&mut self, targets: &BTreeSet<Side>, delay: u32) -> Option<BitId> {
        let mut restarts = Vec::new();
        if delay > 0 {
            let first = self.bit(Condition::First, 0);
            restarts.push(self.late_bit(first, delay));
        }
        let channel = self.graph.channels.iter().position(|channel| channel.name == "target");
        if let Some(channel) = channel.and_then(|at| u32::try_from(at).ok()) {
            let sides: Vec<Side> = targets.iter().copied().filter(|side| self.present(Some(*side))).collect();
            for side in sides {
                let input = self.input(ColumnKey { channel, side: Some(side), slot: 0, component: 0 });
                let change = self.bit(Condition::Changes(input), 0);
                restarts.push(self.late_bit(change, delay));
            }
        }
        match restarts.as_slice() {
            [] => None,
            [one] => Some(*one),
            _ => Some(self.bit(Condition::Or(restarts), delay)),
        }
    }

    /// The hands whose targets these values read, also through latches.
    pub(super) fn targets(&self, values: &[ValueId], this: Option<Side>) -> BTreeSet<Side> {
        let mut targets = BTreeSet::new();
        let mut open: Vec<(ValueId, Option<Side>)> = values.iter().map(|value| (*value, this)).collect();
        let mut seen = BTreeSet::new();
        while let Some((id, this)) = open.pop() {
            if !seen.insert((id, this)) {
                continue;
            }
            let value = self.graph.value(id);
            match &value.op {
                Op::Channel(channel, hand) => {
                    let name = self.graph.channels[channel.index()].name.as_str();
                    targets.extend(crate::base::channels::reads_target(name, Self::side(*hand, this)));
                }
                Op::Latch(latch, hand) => {
                    let latch = &self.graph.latches[latch.index()];
                    let this = Self::side(*hand, this);
                    open.extend([(latch.set, this), (latch.clear, this)]);
                }
                _ => open.extend(value.args.iter().map(|arg| (*arg, this))),
            }
        }
        targets
    }

    /// A latch of a hand. Latches stand in order, so this is never deep.
    pub(super) fn latch(&mut self, id: LatchId, side: Option<Side>) -> Result<Item, InputError> {
        if let Some(item) = self.latches.get(&(id, side)) {
            return Ok(*item);
        }
        let latch = &self.graph.latches[id.index()];
        let (set_value, clear_value) = (latch.set, latch.clear);
        let item = if self.present(side) {
            let set = self.value(set_value, side)?.single();
            let clear = self.value(clear_value, side)?.single();
            let targets = self.targets(&[set_value, clear_value], side);
            match (set, clear) {
                (Item::Bit(set), Item::Bit(clear)) => {
                    let (both, delay) = self.bits_together(&[set, clear]);
                    let kept = self.bit(Condition::Not(both[1]), delay);
                    let set = self.bit(Condition::And(vec![both[0], kept]), delay);
                    Item::Bit(self.flip_flop(set, kept, &targets, delay))
                }
                _ => {
                    let (set, clear) = (self.memory_of(set), self.memory_of(clear));
                    let restart = self.restart_memory(&targets);
                    Item::Memory(self.memory(Memory::Latch { set, clear, restart }))
                }
            }
        } else {
            Item::Bit(self.bit(Condition::Constant(false), 0))
        };
        self.latches.insert((id, side), item);
        Ok(item)
    }

    pub(super) fn restart_memory(&mut self, targets: &BTreeSet<Side>) -> Option<MemoryId> {
        let restart = self.restart_on(targets, 0)?;
        Some(self.memory_of(Item::Bit(restart)))
    }

    /// A flip-flop that forgets when a target changes: on such a frame nothing is kept.
    pub(super) fn flip_flop(&mut self, set: BitId, keep: BitId, targets: &BTreeSet<Side>, delay: u32) -> BitId {
        let keep = match self.restart_on(targets, delay) {
            Some(restart) => {
                let steady = self.bit(Condition::Not(restart), delay);
                self.bit(Condition::And(vec![keep, steady]), delay)
            }
            None => keep,
        };
        self.bit(Condition::FlipFlop { set, keep }, delay)
    }
}
