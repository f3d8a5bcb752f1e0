//! Relabeling: a lane and a rule in, a lane with the same frames out (grammar/README.md, Tasks).
//!
//! Invariants: the frames of a lane never change, only the labels and where they meet; every piece that a rule changes carries the rule;
//! a rule reads the lane as it was before the rule, and its matches do not overlap.

use super::interval_labels::samples;
use super::labeled_span::{LabeledSpan, add, append};
use super::measures::{Measures, POSITION};
use std::ops::Range;
use teachtree_language::rules::{Label, RelabelKind, RelabelRule, Repetition};

/// Applies a rule on one lane; `None` when it changes nothing. Rules over both hands change nothing here.
pub(super) fn in_lane(
    lane: &[LabeledSpan],
    at: usize,
    rule: &RelabelRule,
    measures: &Measures,
) -> Option<Vec<LabeledSpan>> {
    let (matches, becomes) = match &rule.kind {
        RelabelKind::Between { what, run, between, becomes, .. } => {
            let what = LabelPattern { labels: what, run: *run, rule, measures };
            (what.between(lane, between), *becomes)
        }
        RelabelKind::Become { what, becomes } => {
            let each = lane.iter().enumerate().filter(|(_, piece)| stands(what, piece.label));
            (each.map(|(place, _)| place..place + 1).collect(), *becomes)
        }
        RelabelKind::Sequence { elements, becomes } => (sequences(lane, elements), *becomes),
        RelabelKind::BetweenInHands { .. } | RelabelKind::Separate { .. } => return None,
    };
    rewrite(lane, &matches, becomes, at)
}

/// Applies a rule over the lanes of both hands; `None` when it changes nothing.
pub(super) fn in_hands(
    lanes: [&[LabeledSpan]; 2],
    at: usize,
    rule: &RelabelRule,
    measures: [&Measures; 2],
) -> Option<[Vec<LabeledSpan>; 2]> {
    let RelabelKind::BetweenInHands { becomes: Some(becomes), .. } = &rule.kind else {
        return None;
    };
    let [left, right] = lanes;
    let matches = matches_in_hands(lanes, rule, measures);
    let rewritten = [rewrite(left, &matches[0], *becomes, at), rewrite(right, &matches[1], *becomes, at)];
    match rewritten {
        [None, None] => None,
        [of_left, of_right] => {
            Some([of_left.unwrap_or_else(|| left.to_vec()), of_right.unwrap_or_else(|| right.to_vec())])
        }
    }
}

/// The frames that a rule over both hands gives back to them (`becomes separate`), in order, apart.
pub(super) fn separated_in_hands(
    lanes: [&[LabeledSpan]; 2],
    rule: &RelabelRule,
    measures: [&Measures; 2],
) -> Vec<Range<usize>> {
    let RelabelKind::BetweenInHands { becomes: None, .. } = &rule.kind else {
        return Vec::new();
    };
    let found = matches_in_hands(lanes, rule, measures);
    let mut frames: Vec<Range<usize>> =
        lanes.iter().zip(&found).flat_map(|(lane, found)| found.iter().map(|range| span(lane, range))).collect();
    frames.sort_by_key(|range| range.start);
    let mut apart: Vec<Range<usize>> = Vec::new();
    for range in frames {
        match apart.last_mut().filter(|last| range.start <= last.end) {
            Some(last) => last.end = last.end.max(range.end),
            None => apart.push(range),
        }
    }
    apart
}

/// Where a rule over both hands fits, in each lane. Which hand is the one and which the other is tried both ways; the two matches must share time.
fn matches_in_hands(
    lanes: [&[LabeledSpan]; 2],
    rule: &RelabelRule,
    measures: [&Measures; 2],
) -> [Vec<Range<usize>>; 2] {
    let mut matches = [Vec::new(), Vec::new()];
    let RelabelKind::BetweenInHands { what, run, one, other, .. } = &rule.kind else {
        return matches;
    };
    let ([left, right], [of_left, of_right]) = (lanes, measures);
    let what_left = LabelPattern { labels: what, run: *run, rule, measures: of_left };
    let what_right = LabelPattern { labels: what, run: *run, rule, measures: of_right };
    for (ours, theirs) in [(one, other), (other, one)] {
        let of_right = what_right.between(right, theirs);
        for of_left in what_left.between(left, ours) {
            let time = span(left, &of_left);
            let partner = of_right.partition_point(|range| span(right, range).end <= time.start);
            if let Some(partner) = of_right.get(partner).filter(|range| span(right, range).start < time.end) {
                matches[0].push(of_left);
                matches[1].push(partner.clone());
            }
        }
    }
    for found in &mut matches {
        found.sort_by_key(|range| range.start);
        found.dedup();
    }
    matches
}

fn stands(labels: &[Label], label: Label) -> bool {
    labels.iter().any(|pattern| pattern.covers(label))
}

fn span(lane: &[LabeledSpan], range: &Range<usize>) -> Range<usize> {
    let pieces = lane.get(range.clone()).unwrap_or(&[]);
    pieces.first().map_or(0, |piece| piece.frames.start)..pieces.last().map_or(0, |piece| piece.frames.end)
}

/// `X`, or `(P or Q)+`, with the bound of its rule.
struct LabelPattern<'a> {
    labels: &'a [Label],
    run: bool,
    rule: &'a RelabelRule,
    measures: &'a Measures<'a>,
}

impl LabelPattern<'_> {
    /// Whether frames are shorter than the rule says, in time or by the way of the target.
    fn is_short(&self, frames: &Range<usize>) -> bool {
        let kind = &self.rule.kind;
        kind.shorter_time().is_none_or(|limit| frames.len() < samples(limit.value, self.measures.rate_hz()))
            && kind.shorter_way().is_none_or(|limit| {
                // A condition that the log cannot decide does not hold.
                self.measures.has(POSITION) && self.measures.travelled(frames) < limit.value
            })
    }

    /// Returns the intervals of these labels between two neighbors. A run is as long as possible: a neighbor that is itself one of the
    /// labels ends the run only if no other neighbor is farther out.
    fn between(&self, lane: &[LabeledSpan], (before, after): &(Vec<Label>, Vec<Label>)) -> Vec<Range<usize>> {
        let is = |at: Option<usize>, labels: &[Label]| {
            at.and_then(|at| lane.get(at)).is_some_and(|piece| stands(labels, piece.label))
        };
        let mut found = Vec::new();
        let mut at = 0;
        while at < lane.len() {
            if !is(Some(at), self.labels) {
                at += 1;
                continue;
            }
            let mut end = at + 1;
            while self.run && is(Some(end), self.labels) {
                end += 1;
            }
            let start = (at..end).find(|start| is(start.checked_sub(1), before));
            let stop = (at + 1..=end).rev().find(|stop| is(Some(*stop), after));
            if let (Some(start), Some(stop)) = (start, stop)
                && start < stop
                && self.is_short(&span(lane, &(start..stop)))
            {
                found.push(start..stop);
            }
            at = end;
        }
        found
    }
}

/// Returns the consecutive matches of a sequence: the leftmost matches, each as long as possible.
fn sequences(lane: &[LabeledSpan], elements: &[(Vec<Label>, Repetition)]) -> Vec<Range<usize>> {
    // longest[at][element]: where the farthest match of the remaining elements ends that begins at this piece.
    let mut longest = vec![vec![None; elements.len() + 1]; lane.len() + 1];
    for at in (0..=lane.len()).rev() {
        longest[at][elements.len()] = Some(at);
        for (element, (labels, repeat)) in elements.iter().enumerate().rev() {
            let here = lane.get(at).is_some_and(|piece| stands(labels, piece.label));
            let done = if here { longest[at + 1][element + 1] } else { None };
            let again = if here { longest[at + 1][element] } else { None };
            longest[at][element] = match repeat {
                Repetition::Once => done,
                Repetition::OneOrMore => done.max(again),
                Repetition::ZeroOrMore => longest[at][element + 1].max(again),
            };
        }
    }
    let mut found = Vec::new();
    let mut at = 0;
    while at < lane.len() {
        match longest[at][0] {
            Some(end) if end > at => {
                found.push(at..end);
                at = end;
            }
            _ => at += 1,
        }
    }
    found
}

/// Gives ranges of pieces (in order, apart) a label; `None` when all of them have it.
fn rewrite(lane: &[LabeledSpan], matches: &[Range<usize>], becomes: Label, rule: usize) -> Option<Vec<LabeledSpan>> {
    let mut rewritten = Vec::with_capacity(lane.len());
    let mut changed = false;
    let mut next = matches.iter().peekable();
    for (at, piece) in lane.iter().enumerate() {
        while next.peek().is_some_and(|range| range.end <= at) {
            next.next();
        }
        let mut piece = piece.clone();
        if piece.label != becomes && next.peek().is_some_and(|range| range.contains(&at)) {
            changed = true;
            piece.label = becomes;
            add(&mut piece.by, &[rule]);
        }
        append(&mut rewritten, piece);
    }
    changed.then_some(rewritten)
}
