//! Labels over time as runs, settling, and covering by coordination (grammar/README.md, Meaning of a run, points 4 and 5).

use std::collections::BTreeMap;
use std::ops::Range;
use teachtree_base::hands::Side;
use teachtree_language::rules::Label;

/// A run of frames `[start, end)` with one label; `None` stands for `separate` in a tree over both hands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// First frame.
    pub start: usize,
    /// One past the last frame.
    pub end: usize,
    /// The label.
    pub label: Option<Label>,
}

/// The leaves of the trees in one gap-free stretch, before settling.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Leaves {
    /// The stretch.
    pub frames: Range<usize>,
    /// The leaves of each hand's tree; neighbors differ, no frame is left out.
    pub hands: BTreeMap<Side, Vec<Run>>,
    /// The leaves of the tree over both hands; empty without such a tree, or for a log with one hand.
    pub both: Vec<Run>,
}

/// Appends a run, joining it to the last one when the labels are equal.
pub fn append(runs: &mut Vec<Run>, run: Run) {
    if run.start == run.end {
        return;
    }
    match runs.last_mut() {
        Some(last) if last.label == run.label && last.end == run.start => last.end = run.end,
        _ => runs.push(run),
    }
}

/// A hand's own leaves with the coordination of both hands laid over them, wherever it is not `separate`.
pub fn cover(own: &[Run], both: &[Run]) -> Vec<Run> {
    let mut covered = Vec::with_capacity(own.len() + 2 * both.len());
    let mut coordination = both.iter().peekable();
    for run in own {
        let mut start = run.start;
        while start < run.end {
            while coordination.peek().is_some_and(|over| over.end <= start) {
                coordination.next();
            }
            let (end, label) = match coordination.peek() {
                Some(over) if over.start <= start => (over.end.min(run.end), over.label.or(run.label)),
                Some(over) => (over.start.min(run.end), run.label),
                None => (run.end, run.label),
            };
            append(&mut covered, Run { start, end, label });
            start = end;
        }
    }
    covered
}

/// Settling as a filter on runs: constant cost, delay exactly the settling time.
///
/// The first leaf settles at once. A different leaf opens a pending stretch; if the settled label returns, the stretch is dropped;
/// when it has lasted `frames` all of it takes the current leaf. What is still pending at the end is dropped.
#[derive(Clone, Debug)]
pub struct Settler {
    frames: usize,
    settled: Option<Run>,
    pending_since: Option<usize>,
}

impl Settler {
    /// A filter that lets a leaf settle after `frames` frames; 0 and 1 let everything through.
    pub fn new(frames: usize) -> Self {
        Self { frames, settled: None, pending_since: None }
    }

    /// Takes the next run of leaves (neighboring runs may have equal labels) and returns the settled run that it closes, if it closes one.
    pub fn push(&mut self, leaf: Run) -> Option<Run> {
        let Some(settled) = &mut self.settled else {
            self.settled = Some(leaf);
            return None;
        };
        if leaf.label == settled.label {
            self.pending_since = None;
            settled.end = leaf.end;
            return None;
        }
        let since = *self.pending_since.get_or_insert(leaf.start);
        if leaf.end - since < self.frames {
            return None;
        }
        self.pending_since = None;
        let closed = Run { end: since, ..*settled };
        *settled = Run { start: since, ..leaf };
        Some(closed)
    }

    /// Ends the recording at frame `end` and returns the last settled run.
    pub fn finish(self, end: usize) -> Option<Run> {
        self.settled.map(|settled| Run { end, ..settled })
    }
}

/// Settles a whole stretch of leaves.
pub fn settle(leaves: &[Run], frames: usize) -> Vec<Run> {
    let mut settler = Settler::new(frames);
    let mut settled: Vec<Run> = leaves.iter().filter_map(|leaf| settler.push(*leaf)).collect();
    settled.extend(leaves.last().and_then(|last| settler.finish(last.end)));
    settled
}
