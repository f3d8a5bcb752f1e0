//! How right a result is: segmental F1 and what the search maximizes. The definitions are those of `score` (docs/score.md), in frames: time without a label is
//! cut out, and what is left is put together.

use std::ops::AddAssign;
use teachtree_engine::runs::Run;

/// A label as its position in the list of labels.
pub(crate) type LabelId = usize;

/// The weights of F1@50, F1@25, the share of right frames, and the mean overlap.
const WEIGHTS: [f64; 4] = [0.40, 0.15, 0.25, 0.20];

/// Labeled frames `[start, end)` of a track.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Span {
    pub start: usize,
    pub end: usize,
    pub label: LabelId,
}

/// What is true of a track.
#[derive(Clone, Debug, Default)]
pub(crate) struct Truth {
    /// In order and apart.
    pub spans: Vec<Span>,
    /// The same on the scale of scored frames; neighbors differ.
    pieces: Vec<Span>,
}

impl Truth {
    /// The truth of labeled spans, in order and apart.
    pub fn new(spans: Vec<Span>) -> Self {
        let mut pieces: Vec<Span> = Vec::new();
        let mut scored = 0;
        for span in &spans {
            let end = scored + span.end - span.start;
            push(&mut pieces, Span { start: scored, end, label: span.label });
            scored = end;
        }
        Self { spans, pieces }
    }

    /// The pairs of labels that follow each other, with the position of the second segment.
    pub fn boundaries(&self) -> impl Iterator<Item = (LabelId, LabelId, usize)> {
        self.pieces.windows(2).zip(1..).map(|(pair, at)| (pair[0].label, pair[1].label, at))
    }

    /// How many frames later a segment of the result begins than each true one; `None` where none of its label begins nearer than half of the true segment,
    /// and of the one before it.
    pub fn lateness(&self, result: &[Run]) -> Vec<Option<i64>> {
        let (_, result) = self.scored(result);
        let begins = |at: usize, truth: &Span| {
            let before = at.checked_sub(1).and_then(|before| self.pieces.get(before));
            let shorter = before.map_or(usize::MAX, |it| it.end - it.start).min(truth.end - truth.start);
            let first = result.partition_point(|piece| piece.start.saturating_add(shorter) < truth.start);
            let near = result[first..].iter().take_while(|piece| piece.start < truth.end);
            let late = near.filter(|piece| piece.label == truth.label).map(|it| it.start as i64 - truth.start as i64);
            late.min_by_key(|late| late.abs()).filter(|late| 2 * late.unsigned_abs() < shorter as u64)
        };
        self.pieces.iter().enumerate().map(|(at, truth)| begins(at, truth)).collect()
    }

    /// Compares a result, whose runs leave no frame out, with the truth.
    pub fn compare(&self, result: &[Run]) -> Counts {
        let (mut counts, result) = self.scored(result);
        counts.truths = self.pieces.len();
        let mut taken = vec![[false; 2]; self.pieces.len()];
        let mut first = 0;
        for piece in result.iter().filter(|piece| piece.label != NONE) {
            counts.results += 1;
            while self.pieces.get(first).is_some_and(|truth| truth.end <= piece.start) {
                first += 1;
            }
            let mut best = (0.0, 0);
            for (at, truth) in self.pieces.iter().enumerate().skip(first).take_while(|(_, it)| it.start < piece.end) {
                if truth.label == piece.label {
                    let both = truth.end.min(piece.end) - truth.start.max(piece.start);
                    let either = truth.end.max(piece.end) - truth.start.min(piece.start);
                    let overlap = both as f64 / either as f64;
                    if overlap > best.0 {
                        best = (overlap, at);
                    }
                }
            }
            let (overlap, at) = best;
            counts.overlap += overlap;
            for (asked, least) in [0.5, 0.25].into_iter().enumerate() {
                if overlap >= least && !taken[at][asked] {
                    taken[at][asked] = true;
                    counts.found[asked] += 1;
                }
            }
        }
        counts
    }

    /// The result on the scale of scored frames, and how many frames are right.
    fn scored(&self, result: &[Run]) -> (Counts, Vec<Span>) {
        let mut counts = Counts::default();
        let mut pieces: Vec<Span> = Vec::with_capacity(result.len());
        let (mut runs, mut scored) = (result.iter().peekable(), 0);
        for span in &self.spans {
            let mut at = span.start;
            while at < span.end {
                while runs.peek().is_some_and(|run| run.end <= at) {
                    runs.next();
                }
                let run = runs.peek();
                let end = run.map_or(span.end, |run| run.end.min(span.end));
                let label = run.and_then(|run| run.label).map_or(NONE, |label| label.primitive.index());
                if label == span.label {
                    counts.right += end - at;
                }
                push(&mut pieces, Span { start: scored, end: scored + end - at, label });
                scored += end - at;
                at = end;
            }
        }
        counts.frames = scored;
        (counts, pieces)
    }
}

/// The place of a label where a result has none.
const NONE: LabelId = LabelId::MAX;

fn push(pieces: &mut Vec<Span>, next: Span) {
    match pieces.last_mut() {
        Some(last) if last.label == next.label => last.end = next.end,
        _ => pieces.push(next),
    }
}

/// Counts from which every measure follows; those of tracks add up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Counts {
    /// Segments of the result that overlap a true one by 50 % and by 25 %.
    found: [usize; 2],
    truths: usize,
    results: usize,
    right: usize,
    frames: usize,
    overlap: f64,
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        for (found, more) in self.found.iter_mut().zip(other.found) {
            *found += more;
        }
        self.truths += other.truths;
        self.results += other.results;
        self.right += other.right;
        self.frames += other.frames;
        self.overlap += other.overlap;
    }
}

impl<'c> std::iter::Sum<&'c Counts> for Counts {
    fn sum<I: Iterator<Item = &'c Self>>(counts: I) -> Self {
        counts.fold(Self::default(), |mut sum, counts| {
            sum += *counts;
            sum
        })
    }
}

impl Counts {
    fn share(self, of: f64) -> f64 {
        2.0 * of / ((self.truths + self.results) as f64).max(1.0)
    }

    /// F1 of the segments at 50 % overlap, 0 to 1.
    pub fn f1(self) -> f64 {
        self.share(self.found[0] as f64)
    }

    /// The share of the labeled frames with the right label, 0 to 1.
    pub fn accuracy(self) -> f64 {
        self.right as f64 / (self.frames as f64).max(1.0)
    }

    /// What the search maximizes, 0 to 1.
    pub fn objective(self) -> f64 {
        let parts = [self.f1(), self.share(self.found[1] as f64), self.accuracy(), self.share(self.overlap)];
        parts.iter().zip(WEIGHTS).map(|(part, weight)| part * weight).sum()
    }
}
