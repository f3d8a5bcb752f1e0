//! The compiled evaluator: blocks of frames in, leaves out; any block size gives the same leaves.

use super::bits::BLOCK;
use super::columns::{Block, Columns};
use super::instantiate::instantiate;
use super::machine::Machine;
use super::plan::Plan;
use crate::runs::{Leaves, Run, append};
use teachtree_base::error::InputError;
use teachtree_frames::frames::{Frames, Layout};
use teachtree_language::graph::Graph;

/// A run in progress.
#[derive(Clone, Debug)]
pub struct Evaluator {
    plan: Plan,
    columns: Columns,
    machine: Machine,
    /// Frames taken in since the stretch began.
    taken: usize,
}

impl Evaluator {
    /// Instantiates a graph for a log with these slots.
    ///
    /// # Errors
    /// When the rate cannot honour a duration of the rules.
    pub fn new(graph: &Graph, layout: &Layout) -> Result<Self, InputError> {
        let plan = instantiate(graph, layout)?;
        Ok(Self { columns: Columns::new(&plan), machine: Machine::new(&plan), plan, taken: 0 })
    }

    /// The plan that is run.
    pub const fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Takes frames `start..start + len` of columns in the order of `Plan::inputs`. Runs of leaves that end are given to `emit` with the
    /// position of their tree in `Plan::trees`; frames are counted from the beginning of the stretch.
    pub fn push(&mut self, columns: &[&[f64]], start: usize, len: usize, emit: &mut impl FnMut(usize, Run)) {
        for offset in (0..len).step_by(BLOCK) {
            let len = BLOCK.min(len - offset);
            self.block(&Block { columns, start: start + offset, len, known: offset, inside: true, leaves: &[] }, emit);
        }
    }

    /// Ends a stretch: the delayed frames come out, the running leaves end, and the next frame begins anew.
    pub fn finish(&mut self, emit: &mut impl FnMut(usize, Run)) {
        if self.taken > 0 {
            let delay = self.plan.delay as usize;
            for offset in (0..delay).step_by(BLOCK) {
                let len = BLOCK.min(delay - offset);
                self.block(&Block { columns: &[], start: 0, len, known: 0, inside: false, leaves: &[] }, emit);
            }
            self.machine.finish(emit);
        }
        self.columns.restart();
        self.machine.restart();
        self.taken = 0;
    }

    /// Runs a function and then restores the state before it, for example to evaluate the end of a log that continues. State within a block is not copied.
    pub fn aside<T>(&mut self, run: impl FnOnce(&mut Self) -> T) -> T {
        let (memory, machine, taken) = (self.columns.memory.clone(), self.machine.clone(), self.taken);
        let found = run(self);
        (self.columns.memory, self.machine, self.taken) = (memory, machine, taken);
        found
    }

    fn block(&mut self, block: &Block<'_>, emit: &mut impl FnMut(usize, Run)) {
        self.columns.run(&self.plan, block);
        // The machine is behind by the plan's delay: the first frames that come out lie before the beginning.
        let skip = (self.plan.delay as usize).saturating_sub(self.taken).min(block.len);
        self.machine.run(&self.plan, &self.columns, skip, block.len, emit);
        self.taken += block.len;
    }
}

/// Evaluates a whole log, stretch by stretch.
///
/// # Errors
/// When the rate of the log cannot honour a duration of the rules.
pub fn evaluate(graph: &Graph, frames: &Frames) -> Result<Vec<Leaves>, InputError> {
    evaluate_in_blocks(graph, frames, usize::MAX)
}

/// Like the above, with at most `block` frames at a time. The leaves do not depend on `block`.
///
/// # Errors
/// When the rate of the log cannot honour a duration of the rules.
pub fn evaluate_in_blocks(graph: &Graph, frames: &Frames, block: usize) -> Result<Vec<Leaves>, InputError> {
    let mut evaluator = Evaluator::new(graph, &frames.layout)?;
    let inputs = evaluator.plan().inputs.clone();
    let columns: Vec<&[f64]> = inputs.iter().map(|key| frames.column(*key).unwrap_or(&[])).collect();
    let sides: Vec<_> = evaluator.plan().trees.iter().map(|tree| tree.side).collect();
    let mut all = Vec::with_capacity(frames.stretches.len());
    for stretch in &frames.stretches {
        let mut leaves = Leaves { frames: stretch.clone(), ..Leaves::default() };
        let mut emit = |tree: usize, run: Run| {
            let run = Run { start: run.start + stretch.start, end: run.end + stretch.start, ..run };
            match sides.get(tree).copied().flatten() {
                Some(side) => append(leaves.hands.entry(side).or_default(), run),
                None => append(&mut leaves.both, run),
            }
        };
        let mut start = stretch.start;
        while start < stretch.end {
            let len = block.max(1).min(stretch.end - start);
            evaluator.push(&columns, start, len, &mut emit);
            start += len;
        }
        evaluator.finish(&mut emit);
        all.push(leaves);
    }
    Ok(all)
}
