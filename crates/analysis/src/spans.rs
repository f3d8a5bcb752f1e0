//! Spans of tasks: labels in, one at a time, spans from a first to a last primitive out as they close
//! (grammar/README.md, Meaning of a run, point 6; docs/sources.md, A12).
//!
//! A span begins with the first primitive, and continues over further ones (it includes an aborted approach) until the last primitive
//! has come. What comes then begins the next span: the first primitive again, or a new touch.

use super::labeled_span::LabeledSpan;
use std::ops::Range;
use teachtree_language::rules::{Label, Pattern};

/// A span of a lane.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Span {
    /// The pieces, by position in the lane.
    pub pieces: Range<usize>,
    /// Whether it begins with the first primitive.
    pub has_first: bool,
    /// Whether it ends with the last primitive.
    pub has_last: bool,
    /// Whether the beginning was cut off.
    pub open_start: bool,
    /// Whether the end was cut off.
    pub open_end: bool,
}

/// Finds the spans from `first` to `last`.
pub(super) struct Spans<'a> {
    first: &'a Pattern,
    last: &'a Pattern,
    /// How many pieces have been taken.
    taken: usize,
    current: Option<Span>,
}

impl<'a> Spans<'a> {
    fn new(first: &'a Pattern, last: &'a Pattern) -> Self {
        Self { first, last, taken: 0, current: None }
    }

    /// Takes the next label and returns the span that it closes: the one before, when that had reached its last primitive.
    fn push(&mut self, label: Label) -> Option<Span> {
        let at = self.taken;
        self.taken += 1;
        // Kinds of the last primitive, one after the other, end it together.
        let closed = self.current.take_if(|span| span.has_last && !self.last.covers(label));
        let span = self.current.get_or_insert_with(|| {
            let has_first = self.first.covers(label);
            // Only the beginning of a stretch cuts a span: later, what is not the first primitive is a new touch.
            Span { pieces: at..at, has_first, has_last: false, open_start: at == 0 && !has_first, open_end: false }
        });
        span.pieces.end = at + 1;
        span.has_last = self.last.covers(label);
        closed
    }

    /// Ends the stretch and returns the span that is still there.
    fn finish(self) -> Option<Span> {
        self.current.map(|span| Span { open_end: !span.has_last, ..span })
    }

    /// All spans of a lane.
    pub fn of(lane: &[LabeledSpan], first: &'a Pattern, last: &'a Pattern) -> Vec<Span> {
        let mut spans = Self::new(first, last);
        let mut found: Vec<Span> = lane.iter().filter_map(|piece| spans.push(piece.label)).collect();
        found.extend(spans.finish());
        found
    }
}

/// Joins neighboring spans wherever `goes_on` says so; a span that begins with the first primitive is never joined to the one before.
pub(super) fn join(spans: &[Span], goes_on: impl Fn(&Span, &Span) -> bool) -> Vec<Span> {
    let rows = spans.chunk_by(|one, next| !next.has_first && goes_on(one, next));
    rows.filter_map(|row| {
        let (one, last) = (row.first()?, row.last()?);
        Some(Span {
            pieces: one.pieces.start..last.pieces.end,
            has_first: one.has_first,
            has_last: last.has_last,
            open_start: one.open_start,
            open_end: last.open_end,
        })
    })
    .collect()
}
