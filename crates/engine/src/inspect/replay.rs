//! A run of columns over a stretch whose results stay: conditions as bits, numbers by evaluating their block again.

use super::column::{Bits, Column, ConditionColumn};
use crate::compiled::bits::{BLOCK, words};
use crate::compiled::columns::{Block, Columns, Memory};
use crate::compiled::instantiate::{Output, instantiate_outputs};
use crate::compiled::plan::{BitId, NumberId, Plan, PreviousLeaf, Step};
use crate::runs::{Leaves, Run};
use std::collections::BTreeMap;
use std::ops::Range;
use std::rc::Rc;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_frames::frames::Frames;
use teachtree_language::graph::{Graph, ValueId};

/// Maximum memory of the states between blocks, bytes; above it, states are kept at larger distances.
const MAX_STATES: usize = 64 << 20;

/// A run over one stretch.
pub(super) struct Replay<'a> {
    leaves: &'a Leaves,
    plan: Plan,
    outputs: Vec<Output>,
    /// The columns of the log over the stretch, in the order of the plan's inputs.
    inputs: Vec<&'a [f64]>,
    /// The blocks in which the stretch is evaluated, those after its end among them.
    blocks: Vec<Range<usize>>,
    columns: Columns,
    /// The block that `columns` holds.
    held: usize,
    /// The state before every `spacing`th block.
    states: Vec<Memory>,
    spacing: usize,
    /// The conditions among the outputs, by position in the plan.
    bits: BTreeMap<u32, Rc<Bits>>,
}

/// The leaves of a tree.
pub(super) fn runs_of(leaves: &Leaves, side: Option<Side>) -> &[Run] {
    match side {
        Some(side) => leaves.hands.get(&side).map_or(&[], Vec::as_slice),
        None => &leaves.both,
    }
}

impl<'a> Replay<'a> {
    /// Evaluates values, each for a hand or for none, on the stretch of these leaves.
    ///
    /// # Errors
    /// When the rate of the log cannot honor a duration.
    pub fn new(
        graph: &Graph,
        values: &[(ValueId, Option<Side>)],
        frames: &'a Frames,
        leaves: &'a Leaves,
    ) -> Result<Self, InputError> {
        let (plan, outputs) = instantiate_outputs(graph, &frames.layout, values)?;
        let stretch = leaves.frames.clone();
        let input = |key| frames.column(key).and_then(|column| column.get(stretch.clone())).unwrap_or(&[]);
        let inputs = plan.inputs.iter().map(|key| input(*key)).collect();
        let delays = outputs.iter().flat_map(|output| output.slots.iter().flatten()).map(|node| plan.delay_of(*node));
        let (len, delay) = (stretch.len(), delays.max().unwrap_or(0) as usize);
        let part = |start: usize, end: usize| (start..end).step_by(BLOCK).map(move |at| at..(at + BLOCK).min(end));
        let blocks: Vec<Range<usize>> = part(0, len).chain(part(len, len + delay)).collect();
        let spacing = (plan.cost().state_bytes * blocks.len()).div_ceil(MAX_STATES).max(1);
        let (columns, bits) = (Columns::new(&plan), BTreeMap::new());
        let mut replay =
            Self { leaves, plan, outputs, inputs, blocks, columns, held: 0, states: Vec::new(), spacing, bits };
        replay.record();
        Ok(replay)
    }

    fn record(&mut self) {
        let conditions = self.outputs.iter().flat_map(|output| output.slots.iter().flatten());
        let mut bits: BTreeMap<u32, Bits> = conditions
            .filter_map(|node| if let Step::Condition(id) = node { Some((id.0, Bits::default())) } else { None })
            .collect();
        for at in 0..self.blocks.len() {
            if at % self.spacing == 0 {
                self.states.push(self.columns.memory());
            }
            self.run(at);
            let len = self.blocks.get(at).map_or(0, Range::len);
            for (id, bits) in &mut bits {
                bits.extend(self.columns.condition(BitId(*id)), len);
            }
        }
        self.bits = bits.into_iter().map(|(id, bits)| (id, Rc::new(bits))).collect();
    }

    /// Evaluates a block; the one before was evaluated last.
    fn run(&mut self, at: usize) {
        let Some(block) = self.blocks.get(at).cloned() else { return };
        let inside = block.start < self.leaves.frames.len();
        let columns: Vec<&[f64]> = self.inputs.iter().map(|input| input.get(block.clone()).unwrap_or(&[])).collect();
        let leaves: Vec<Vec<u64>> =
            self.plan.leaves.iter().map(|before| bits_before(before, self.leaves, &block)).collect();
        let columns: &[&[f64]] = if inside { &columns } else { &[] };
        let block = Block { columns, start: 0, len: block.len(), known: 0, inside, leaves: &leaves };
        self.columns.run(&self.plan, &block);
        self.held = at;
    }

    /// Evaluates the block of a frame again, unless it is the one that was evaluated last.
    fn go_to(&mut self, frame: usize) {
        let at = self.blocks.partition_point(|block| block.end <= frame);
        if at == self.held {
            return;
        }
        if at != self.held + 1 {
            let from = at / self.spacing;
            if let Some(state) = self.states.get(from) {
                self.columns.resume(state);
            }
            (from * self.spacing..at).for_each(|before| self.run(before));
        }
        self.run(at);
    }

    /// A value on some frames of the stretch.
    pub fn column(&mut self, output: usize, frames: Range<usize>) -> Column {
        let Some(Output { width, is_array, slots }) = self.outputs.get(output).cloned() else {
            debug_assert!(false, "there is no output {output}");
            return Column::new(1, false, Vec::new());
        };
        let mut columns = vec![vec![0.0; width * frames.len()]; slots.len()];
        for (slot, column) in slots.iter().zip(&mut columns) {
            for (component, node) in slot.iter().enumerate().take(width) {
                let places = column.iter_mut().skip(component).step_by(width);
                match node {
                    Step::Condition(id) => {
                        let truth = self.bits(id.0).map(|bits| ConditionColumn::new(false, vec![bits]));
                        for (place, frame) in places.zip(frames.clone()) {
                            let holds = truth.as_ref().is_some_and(|truth| truth.holds(0, frame));
                            *place = if holds { 1.0 } else { 0.0 };
                        }
                    }
                    Step::Number(id) => self.numbers(*id, frames.clone(), places),
                }
            }
        }
        Column::new(width, is_array, columns)
    }

    fn numbers<'p>(&mut self, id: NumberId, frames: Range<usize>, mut places: impl Iterator<Item = &'p mut f64>) {
        if let Some(constant) = self.plan.constant(id) {
            places.for_each(|place| *place = constant);
            return;
        }
        let delay = self.plan.delay_of(Step::Number(id)) as usize;
        if let Some(input) = self.plan.input_of(id).and_then(|input| self.inputs.get(input)) {
            places.zip(frames).for_each(|(place, frame)| *place = input.get(frame).copied().unwrap_or(0.0));
            return;
        }
        let mut frame = frames.start;
        while frame < frames.end {
            self.go_to(frame + delay);
            let Some(block) = self.blocks.get(self.held).filter(|block| block.contains(&(frame + delay))) else {
                debug_assert!(false, "frame {frame} is in no block");
                return;
            };
            let end = frames.end.min(block.end - delay);
            let numbers = self.columns.number_of(id, block.len());
            let part = numbers.get(frame + delay - block.start..end + delay - block.start).unwrap_or(&[]);
            places.by_ref().zip(part).for_each(|(place, number)| *place = *number);
            frame = end;
        }
    }

    fn bits(&self, id: u32) -> Option<(Rc<Bits>, usize)> {
        let delay = self.plan.delay_of(Step::Condition(BitId(id))) as usize;
        self.bits.get(&id).map(|bits| (Rc::clone(bits), delay))
    }

    /// A condition on all frames of the stretch.
    pub fn truth(&self, output: usize) -> ConditionColumn {
        let Some(output) = self.outputs.get(output) else { return ConditionColumn::new(false, Vec::new()) };
        let slots = output.slots.iter().filter_map(|slot| match slot.first() {
            Some(Step::Condition(id)) => self.bits(id.0),
            _ => None,
        });
        ConditionColumn::new(output.is_array, slots.collect())
    }
}

/// On which frames of a block the leaf of the frame before was one of some.
fn bits_before(before: &PreviousLeaf, leaves: &Leaves, block: &Range<usize>) -> Vec<u64> {
    let (runs, start) = (runs_of(leaves, before.tree), leaves.frames.start);
    let mut bits = vec![0; words(block.len())];
    let mut set = |frame: usize| bits[(frame - block.start) / 64] |= 1 << ((frame - block.start) % 64);
    if block.start == 0 && before.none && !runs.is_empty() && !block.is_empty() {
        set(0);
    }
    // The leaf of a frame is read on the next one.
    let first = runs.partition_point(|run| run.end + 1 - start <= block.start);
    for run in runs.iter().skip(first).take_while(|run| run.start + 1 - start < block.end) {
        if run.label.is_some_and(|label| before.labels.iter().any(|pattern| pattern.covers(label))) {
            let frames = (run.start + 1 - start).max(block.start)..(run.end + 1 - start).min(block.end);
            frames.for_each(&mut set);
        }
    }
    bits
}
