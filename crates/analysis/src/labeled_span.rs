//! Segments in the making: runs with a provenance of the rules that changed them.
//!
//! A lane holds the pieces of one track in one gap-free stretch. Invariants: pieces are in order, none is empty,
//! neighbors meet and have different labels.

use std::ops::Range;
use teachtree_engine::runs::Run;
use teachtree_language::rules::Label;

/// A segment in the making.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct LabeledSpan {
    /// Frames `[start, end)`.
    pub frames: Range<usize>,
    /// The primitive.
    pub label: Label,
    /// The rules that changed it, as positions in `Rules::relabels`, in the order in which they did.
    pub by: Vec<usize>,
}

/// Appends a piece, joining it to the last one when they meet and have the same label.
pub(super) fn append(lane: &mut Vec<LabeledSpan>, piece: LabeledSpan) {
    match lane.last_mut() {
        Some(last) if last.label == piece.label && last.frames.end == piece.frames.start => {
            last.frames.end = piece.frames.end;
            add(&mut last.by, &piece.by);
        }
        _ => lane.push(piece),
    }
}

/// Adds rules to a provenance, each once.
pub(super) fn add(provenance: &mut Vec<usize>, rules: &[usize]) {
    for rule in rules {
        if !provenance.contains(rule) {
            provenance.push(*rule);
        }
    }
}

/// The pieces of settled runs; a run without a label (`separate`) leaves a gap.
pub(super) fn pieces(runs: &[Run]) -> Vec<LabeledSpan> {
    let labeled = runs.iter().filter_map(|run| run.label.map(|label| (run, label)));
    labeled.map(|(run, label)| LabeledSpan { frames: run.start..run.end, label, by: Vec::new() }).collect()
}

/// The pieces of a lane that share a frame with an interval.
pub(super) fn within<'a>(lane: &'a [LabeledSpan], frames: &Range<usize>) -> &'a [LabeledSpan] {
    let start = lane.partition_point(|piece| piece.frames.end <= frames.start);
    let end = lane.partition_point(|piece| piece.frames.start < frames.end);
    lane.get(start..end).unwrap_or(&[])
}

/// The piece of a lane at a frame.
pub(super) fn at(lane: &[LabeledSpan], frame: usize) -> Option<&LabeledSpan> {
    within(lane, &(frame..frame + 1)).first()
}
