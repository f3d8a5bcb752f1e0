//! The history of the current stretch: stamps, leaves, and the columns that tasks read, since the last frame before which all results are final.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;
use teachtree_analysis::{self as analysis, Analysis};
use teachtree_base::channels::TARGET_TOUCHED;
use teachtree_base::hands::Side;
use teachtree_engine::evaluator::Evaluator;
use teachtree_engine::runs::{Leaves, Run, append};
use teachtree_frames::frames::{ColumnKey, Frames};
use teachtree_frames::live::LiveChunk;
use teachtree_frames::spilled_columns::Series;
use teachtree_language::Rules;
use teachtree_language::rules::Label;

/// A stretch so far. Indices of frames begin at the first kept frame.
#[derive(Default)]
pub struct History {
    /// The index of the first kept frame in the log.
    pub first: usize,
    /// Stamps, layout and names; the columns are apart.
    frames: Frames,
    columns: BTreeMap<ColumnKey, Vec<f64>>,
    /// The leaves that have ended.
    leaves: Leaves,
    /// The known parts of the leaves that have not ended.
    open: Leaves,
}

impl Series for History {
    fn has(&self, key: ColumnKey) -> bool {
        self.columns.contains_key(&key)
    }

    fn part(&self, key: ColumnKey, frames: Range<usize>) -> Cow<'_, [f64]> {
        let column = self.columns.get(&key).map_or(&[][..], Vec::as_slice);
        Cow::Borrowed(column.get(frames.start..frames.end.min(column.len())).unwrap_or_default())
    }
}

impl History {
    /// Returns the number of kept frames.
    pub fn len(&self) -> usize {
        self.frames.time.len()
    }

    /// Returns the stamp of a frame, s.
    pub fn time_s(&self, frame: usize) -> Option<f64> {
        self.frames.time.get(frame).copied()
    }

    /// Takes stamps and, of the channels that `keeps` names by position, columns.
    pub fn take(&mut self, chunk: &LiveChunk, keeps: impl Fn(u32) -> bool) {
        let LiveChunk { frames, core, time, .. } = chunk;
        if self.frames.channels.is_empty() {
            self.frames = Frames {
                layout: frames.layout.clone(),
                channels: frames.channels.clone(),
                objects: frames.objects.clone(),
                bodies: frames.bodies.clone(),
                attached: frames.attached.clone(),
                ..Frames::default()
            };
        }
        self.frames.time.extend_from_slice(time);
        for (key, column) in frames.columns.iter().filter(|(key, _)| keeps(key.channel)) {
            self.columns.entry(*key).or_default().extend(column.get(core.clone()).unwrap_or(&[]));
        }
    }

    /// Takes a leaf that has ended. Its indices begin at `stretch`, the first frame of the stretch.
    pub fn leaf(&mut self, side: Option<Side>, run: Run, stretch: usize) {
        let at = |frame: usize| (frame + stretch).saturating_sub(self.first);
        let run = Run { start: at(run.start), end: at(run.end), ..run };
        append(lane(&mut self.leaves, side), run);
    }

    /// Analyzes the first `len` frames, whose leaves are all known; `evaluator` returned the leaves.
    pub fn analysis(&mut self, rules: &Rules, evaluator: &mut Evaluator, stretch: usize, len: usize) -> Analysis {
        let (mut leaves, mut open, first) = (self.leaves.clone(), Leaves::default(), self.first);
        open_leaves(evaluator, &mut |side, run: Run| {
            let at = |frame: usize| (frame + stretch).saturating_sub(first).min(len);
            let run = Run { start: at(run.start), end: at(run.end), ..run };
            append(lane(&mut leaves, side), run);
            append(lane(&mut open, side), run);
        });
        (self.open, leaves.frames) = (open, 0..len);
        self.frames.len = len;
        self.frames.stretches = std::iter::once(0..len).collect();
        analysis::analyze_series(rules, &self.frames, self, &[leaves])
    }

    /// Returns the first of some frames at which the leaf of every hand is its `rest`, and the tree over both hands has no leaf.
    pub fn first_at_rest(&self, rests: &BTreeMap<Side, Label>, frames: Range<usize>) -> Option<usize> {
        let mut at = frames.start;
        while at < frames.end {
            match self.not_at_rest(rests, at)? {
                Some(run) => at = run.end,
                None => return Some(at),
            }
        }
        None
    }

    /// Returns the last such frame.
    pub fn last_at_rest(&self, rests: &BTreeMap<Side, Label>, frames: Range<usize>) -> Option<usize> {
        let mut at = frames.end.checked_sub(1)?;
        while at >= frames.start {
            match self.not_at_rest(rests, at)? {
                Some(run) => at = run.start.checked_sub(1)?,
                None => return Some(at),
            }
        }
        None
    }

    /// Returns a leaf at a frame that is not a rest, if one exists; `None` if the leaves are unknown.
    fn not_at_rest(&self, rests: &BTreeMap<Side, Label>, frame: usize) -> Option<Option<Run>> {
        let at = |runs: &[Run], open: &[Run]| {
            let known = runs
                .get(runs.partition_point(|run| run.end <= frame))
                .or_else(|| open.iter().find(|run| run.end > frame));
            known.filter(|run| run.start <= frame).copied()
        };
        for (side, rest) in rests {
            let run = at(own(&self.leaves, *side), own(&self.open, *side))?;
            if run.label != Some(*rest) {
                return Some(Some(run));
            }
        }
        if !(self.leaves.both.is_empty() && self.open.both.is_empty()) {
            let run = at(&self.leaves.both, &self.open.both)?;
            if run.label.is_some() {
                return Some(Some(run));
            }
        }
        Some(None)
    }

    /// Returns the first of some frames at which a hand touches its target.
    pub fn first_touched(&self, side: Side, frames: Range<usize>) -> Option<usize> {
        let channel = self.frames.channel(TARGET_TOUCHED)?;
        let key = ColumnKey { channel, side: Some(side), slot: 0, component: 0 };
        let touched = self.columns.get(&key)?.get(frames.clone())?;
        touched.iter().position(|flag| *flag > 0.5).map(|at| frames.start + at)
    }

    /// Drops the frames before `before`.
    pub fn forget(&mut self, before: usize) {
        self.first += before;
        self.frames.time.drain(..before.min(self.frames.time.len()));
        self.columns.values_mut().for_each(|column| drop(column.drain(..before.min(column.len()))));
        let cut = |runs: &mut Vec<Run>| {
            runs.retain(|run| run.end > before);
            for run in runs {
                (run.start, run.end) = (run.start.saturating_sub(before), run.end - before);
            }
        };
        self.leaves.hands.values_mut().for_each(cut);
        cut(&mut self.leaves.both);
    }

    /// Drops all frames: the stretch has ended with frame `first`.
    pub fn restart(&mut self, first: usize) {
        self.first = first;
        self.frames.time.clear();
        self.columns.values_mut().for_each(Vec::clear);
        (self.leaves, self.open) = (Leaves::default(), Leaves::default());
    }
}

fn own(leaves: &Leaves, side: Side) -> &[Run] {
    leaves.hands.get(&side).map_or(&[], Vec::as_slice)
}

fn lane(leaves: &mut Leaves, side: Option<Side>) -> &mut Vec<Run> {
    match side {
        Some(side) => leaves.hands.entry(side).or_default(),
        None => &mut leaves.both,
    }
}

/// Returns the leaves that an evaluator has not returned yet, as if the log ended here.
fn open_leaves(evaluator: &mut Evaluator, each: &mut dyn FnMut(Option<Side>, Run)) {
    let sides = sides(evaluator);
    evaluator.aside(|ended| ended.finish(&mut |tree, run| each(sides.get(tree).copied().flatten(), run)));
}

/// Returns the leaf of each tree at the newest frame, as if the log ended with it, from an evaluator that has taken the frames before the newest ones.
pub fn last_leaves(evaluator: &mut Evaluator, chunk: &LiveChunk) -> BTreeMap<Option<Side>, Option<Label>> {
    let sides = sides(evaluator);
    let mut last = BTreeMap::new();
    let mut emit = |tree: usize, run: Run| {
        last.insert(sides.get(tree).copied().flatten(), run.label);
    };
    evaluator.aside(|ended| {
        push(ended, chunk.frames, &chunk.newest, &mut emit);
        ended.finish(&mut emit);
    });
    last
}

/// Returns the side of each tree.
pub fn sides(evaluator: &Evaluator) -> Vec<Option<Side>> {
    evaluator.plan().trees.iter().map(|tree| tree.side).collect()
}

/// Passes frames to an evaluator.
pub fn push(evaluator: &mut Evaluator, frames: &Frames, range: &Range<usize>, emit: &mut impl FnMut(usize, Run)) {
    let inputs = evaluator.plan().inputs.clone();
    let columns: Vec<&[f64]> = inputs.iter().map(|key| frames.column(*key).unwrap_or(&[])).collect();
    evaluator.push(&columns, range.start, range.len(), emit);
}
