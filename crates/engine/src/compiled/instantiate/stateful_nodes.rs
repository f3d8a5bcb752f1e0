//! Stateful nodes and their restarts: latches, and the events that reset an operator with memory.

use super::{Instantiation, Item};
use crate::compiled::plan::{BitId, Condition, StatefulId, StatefulNode};
use teachtree_base::channels::reads_target;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_frames::frames::ColumnKey;
use teachtree_language::graph::{Op, ValueId};
use teachtree_language::rules::LatchId;

/// Hands whose targets something reads: by [`Side::index`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Targets([bool; 2]);

impl Targets {
    fn of(sides: &[Side]) -> Self {
        Self(Side::BOTH.map(|side| sides.contains(&side)))
    }

    pub(super) fn and(self, other: Self) -> Self {
        Self([self.0[0] || other.0[0], self.0[1] || other.0[1]])
    }

    fn sides(self) -> impl Iterator<Item = Side> {
        Side::BOTH.into_iter().filter(move |side| self.0[side.index()])
    }
}

impl Instantiation<'_> {
    /// A delay has no output before the first frame, so an operator with memory behind a delay restarts on that frame too.
    pub(super) fn restart_on(&mut self, targets: Targets, delay: u32) -> Option<BitId> {
        let mut restarts = Vec::new();
        if delay > 0 {
            let first = self.bit(Condition::FirstFrame, 0);
            restarts.push(self.late_bit(first, delay));
        }
        let channel = self.graph.channels.iter().position(|channel| channel.name == "target");
        if let Some(channel) = channel.and_then(|at| u32::try_from(at).ok()) {
            let sides: Vec<Side> = targets.sides().filter(|side| self.present(Some(*side))).collect();
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

    /// The hands whose targets a value reads, also through latches; its arguments are known already.
    pub(super) fn find_targets(&self, id: ValueId, this: Option<Side>) -> Targets {
        let value = self.graph.value(id);
        match &value.op {
            Op::Channel(channel, hand) => {
                let name = self.graph.channels[channel.index()].name.as_str();
                Targets::of(&reads_target(name, hand.side(this)))
            }
            Op::Latch(latch, hand) => self.latch_targets(*latch, hand.side(this)),
            _ => value.args.iter().fold(Targets::default(), |all, arg| all.and(self.targets(*arg, this))),
        }
    }

    /// The hands whose targets a made value reads.
    pub(super) fn targets(&self, id: ValueId, this: Option<Side>) -> Targets {
        let targets = self.targets.get(&(id, this)).copied();
        debug_assert!(targets.is_some(), "{id:?} was made before what it reads");
        targets.unwrap_or_default()
    }

    fn latch_targets(&self, id: LatchId, side: Option<Side>) -> Targets {
        let latch = &self.graph.latches[id.index()];
        self.targets(latch.set, side).and(self.targets(latch.clear, side))
    }

    /// A latch of a hand; what sets and clears it is made already.
    pub(super) fn latch(&mut self, id: LatchId, side: Option<Side>) -> Result<Item, InputError> {
        if let Some(item) = self.latches.get(&(id, side)) {
            return Ok(*item);
        }
        let latch = &self.graph.latches[id.index()];
        let (set_value, clear_value) = (latch.set, latch.clear);
        let item = if self.present(side) {
            let set = self.value(set_value, side)?.single()?;
            let clear = self.value(clear_value, side)?.single()?;
            let targets = self.latch_targets(id, side);
            match (set, clear) {
                (Item::Bit(set), Item::Bit(clear)) => {
                    let (both, delay) = self.bits_together(&[set, clear]);
                    let kept = self.bit(Condition::Not(both[1]), delay);
                    let set = self.bit(Condition::And(vec![both[0], kept]), delay);
                    Item::Bit(self.flip_flop(set, kept, targets, delay))
                }
                _ => {
                    let (set, clear) = (self.stateful_of(set)?, self.stateful_of(clear)?);
                    let restart = self.restart_node(targets)?;
                    Item::Stateful(self.stateful(StatefulNode::Latch { set, clear, restart }))
                }
            }
        } else {
            Item::Bit(self.bit(Condition::Constant(false), 0))
        };
        self.latches.insert((id, side), item);
        Ok(item)
    }

    pub(super) fn restart_node(&mut self, targets: Targets) -> Result<Option<StatefulId>, InputError> {
        self.restart_on(targets, 0).map(|restart| self.stateful_of(Item::Bit(restart))).transpose()
    }

    /// A flip-flop that forgets when a target changes: on such a frame nothing is kept.
    pub(super) fn flip_flop(&mut self, set: BitId, keep: BitId, targets: Targets, delay: u32) -> BitId {
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
