//! One gap-free stretch on its way from leaves to relabeled lanes.
//!
//! In: the leaves of the trees. Out: for each hand a lane of settled labels with the coordination of both hands laid over them
//! (grammar/README.md, Meaning of a run, points 4 and 5), and what is left of the coordination after relabeling.

use super::labeled_span::{LabeledSpan, add, append, at, pieces, within};
use std::collections::BTreeMap;
use std::ops::Range;
use teachtree_base::hands::Side;
use teachtree_engine::runs::{Leaves, Run, cover, settle};
use teachtree_language::rules::{Label, Rules, Tree, TreeScope};

/// Minimum number of frames of a leaf, by tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Settling {
    hand: usize,
    both: usize,
}

impl Settling {
    /// The settling times of the trees at a rate; none for a tree that says none.
    pub fn new(rules: &Rules, rate_hz: f64) -> Self {
        let frames = |tree: Option<&Tree>| {
            tree.and_then(|tree| tree.settle.as_ref()).map_or(0, |settle| samples(settle.value, rate_hz))
        };
        Self { hand: frames(rules.tree(TreeScope::EachHand)), both: frames(rules.tree(TreeScope::BothHands)) }
    }
}

/// A duration as a number of frames, rounded.
pub(super) fn samples(duration_s: f64, rate_hz: f64) -> usize {
    // A cast from f64 saturates; a negative or undefined duration is none.
    (duration_s * rate_hz).round() as usize
}

/// The lanes of one stretch.
#[derive(Clone, Debug)]
pub(super) struct IntervalLabels<'a> {
    leaves: &'a Leaves,
    /// The frames in which a hand has no labels.
    unseen: &'a BTreeMap<Side, Vec<Range<usize>>>,
    settling: Settling,
    /// The settled labels of each hand as the trees gave them.
    pub raw: BTreeMap<Side, Vec<LabeledSpan>>,
    /// The settled coordination as its tree gave it, with gaps where it is `separate`.
    pub raw_both: Vec<LabeledSpan>,
    /// The same labels of each hand, to be relabeled.
    pub hands: BTreeMap<Side, Vec<LabeledSpan>>,
    /// The leaves of coordination that have not been given back to the hands.
    both: Vec<Run>,
    /// The rules that gave coordination back.
    separated_by: Vec<usize>,
}

impl<'a> IntervalLabels<'a> {
    /// Covers and settles the leaves of a stretch. Hands have no labels in `unseen` frames, and no coordination.
    pub fn new(leaves: &'a Leaves, unseen: &'a BTreeMap<Side, Vec<Range<usize>>>, settling: Settling) -> Self {
        let both = unseen.values().fold(leaves.both.clone(), |both, unseen| without_label(&both, unseen));
        let raw_both = pieces(&settle(&both, settling.both));
        let raw: BTreeMap<_, _> = settled_hands(leaves, unseen, &both, settling.hand).collect();
        Self { leaves, unseen, settling, hands: raw.clone(), raw, raw_both, both, separated_by: Vec::new() }
    }

    /// The frames of the stretch.
    pub fn frames(&self) -> Range<usize> {
        self.leaves.frames.clone()
    }

    /// Puts pieces (in order, apart) in the place of what a hand's lane has there.
    pub fn put_back<'p>(&mut self, side: Side, pieces: impl Iterator<Item = &'p LabeledSpan>) {
        let Some(lane) = self.hands.get_mut(&side) else { return };
        let new: Vec<LabeledSpan> = pieces.cloned().collect();
        let kept = lane.iter().filter(|old| within(&new, &old.frames).is_empty()).cloned();
        let mut all: Vec<LabeledSpan> = kept.chain(new.iter().cloned()).collect();
        all.sort_by_key(|piece| piece.frames.start);
        lane.clear();
        all.into_iter().for_each(|piece| append(lane, piece));
    }

    /// The coordination after relabeling: where rules gave both hands the same label, that one, else what the tree said.
    pub fn coordination(&self) -> Vec<LabeledSpan> {
        let mut settled = pieces(&settle(&self.both, self.settling.both));
        mark(&mut settled, &self.raw_both, &self.separated_by);
        let (Some(left), Some(right)) = (self.hands.get(&Side::Left), self.hands.get(&Side::Right)) else {
            return settled;
        };
        let mut coordination = Vec::new();
        for piece in &settled {
            for frames in cuts(&piece.frames, left, right) {
                let mut label = piece.label;
                let mut by = piece.by.clone();
                if let (Some(one), Some(other)) = (at(left, frames.start), at(right, frames.start))
                    && one.label == other.label
                    && one.label != label
                    && !(one.by.is_empty() && other.by.is_empty())
                {
                    label = one.label;
                    add(&mut by, &one.by);
                    add(&mut by, &other.by);
                }
                append(&mut coordination, LabeledSpan { frames, label, by });
            }
        }
        coordination
    }

    /// Gives coordination labeled `what` back to the hands' own trees, wherever it is not in one go with a label of `without`;
    /// then the hands are covered and settled again, and relabeling restarts. Returns `false` if no such coordination exists.
    pub fn separate(&mut self, rule: usize, what: &[Label], without: &[Label]) -> bool {
        let coordination = self.coordination();
        let given_back: Vec<Range<usize>> = coordination
            .chunk_by(|one, next| one.frames.end == next.frames.start)
            .filter(|go| !go.iter().any(|piece| without.iter().any(|label| label.covers(piece.label))))
            .flatten()
            .filter(|piece| what.iter().any(|label| label.covers(piece.label)))
            .map(|piece| piece.frames.clone())
            .collect();
        self.give_back(rule, &given_back)
    }

    /// Gives the coordination of intervals (in order, disjoint) back to the hands' own trees. Returns `false` without such coordination.
    pub fn give_back(&mut self, rule: usize, intervals: &[Range<usize>]) -> bool {
        if intervals.is_empty() {
            return false;
        }
        let kept = without_label(&self.both, intervals);
        if kept == self.both {
            return false;
        }
        self.both = kept;
        add(&mut self.separated_by, &[rule]);
        self.hands = settled_hands(self.leaves, self.unseen, &self.both, self.settling.hand).collect();
        for (side, lane) in &mut self.hands {
            mark(lane, self.raw.get(side).map_or(&[], Vec::as_slice), &self.separated_by);
        }
        true
    }
}

fn settled_hands(
    leaves: &Leaves,
    unseen: &BTreeMap<Side, Vec<Range<usize>>>,
    both: &[Run],
    frames: usize,
) -> impl Iterator<Item = (Side, Vec<LabeledSpan>)> {
    leaves.hands.iter().map(move |(side, own)| {
        let covered = cover(own, both);
        let Some(unseen) = unseen.get(side) else { return (*side, pieces(&settle(&covered, frames))) };
        // The intervals before and after frames without labels settle independently.
        let seen = without_label(&covered, unseen);
        let groups = seen.chunk_by(|one, next| one.label.is_none() == next.label.is_none());
        (*side, groups.flat_map(|runs| pieces(&settle(runs, frames))).collect())
    })
}

/// Names the rules that gave coordination back on every piece that is not what the trees gave.
fn mark(lane: &mut [LabeledSpan], raw: &[LabeledSpan], rules: &[usize]) {
    for piece in lane {
        // Intervals that settle differently without the coordination may lie outside of it.
        let before = within(raw, &piece.frames);
        if before.is_empty() || before.iter().any(|before| before.label != piece.label) {
            add(&mut piece.by, rules);
        }
    }
}

/// An interval cut wherever one of two lanes changes.
fn cuts(frames: &Range<usize>, left: &[LabeledSpan], right: &[LabeledSpan]) -> Vec<Range<usize>> {
    let inner = within(left, frames).iter().chain(within(right, frames)).map(|piece| piece.frames.start);
    let mut at: Vec<usize> = inner.filter(|start| frames.contains(start)).chain([frames.start, frames.end]).collect();
    at.sort_unstable();
    at.dedup();
    at.windows(2).filter_map(|pair| Some(*pair.first()?..*pair.last()?)).collect()
}

/// Runs whose label is taken away in some intervals (in order, apart).
fn without_label(runs: &[Run], intervals: &[Range<usize>]) -> Vec<Run> {
    let given_back: Vec<Run> =
        intervals.iter().map(|frames| Run { start: frames.start, end: frames.end, label: None }).collect();
    let mut left = Vec::with_capacity(runs.len() + 2 * given_back.len());
    let mut next = given_back.iter().peekable();
    for run in runs {
        let mut start = run.start;
        while start < run.end {
            while next.peek().is_some_and(|gone| gone.end <= start) {
                next.next();
            }
            let (end, label) = match next.peek() {
                Some(gone) if gone.start <= start => (gone.end.min(run.end), None),
                Some(gone) => (gone.start.min(run.end), run.label),
                None => (run.end, run.label),
            };
            teachtree_engine::runs::append(&mut left, Run { start, end, label });
            start = end;
        }
    }
    left
}
