//! Where rules find a primitive in a recording, and how well that agrees with marks.

use super::{MarkedTrack, ShownRecording};
use std::ops::AddAssign;
use teachtree_base::error::InputError;
use teachtree_base::hands::{Side, TrackId};
use teachtree_engine::evaluator::evaluate;
use teachtree_engine::runs::{Leaves, cover, settle};
use teachtree_frames::frames::Frames;
use teachtree_language::graph::lower;
use teachtree_language::rules::{Label, Rules, TreeScope};

/// Start and end, s.
pub(super) type Span = [f64; 2];

/// What is asked of a recording: the name of the primitive, the tree that gives it, and whether it is sided.
#[derive(Clone, Copy)]
pub(super) struct Question<'a> {
    pub name: &'a str,
    pub scope: TreeScope,
    pub sided: bool,
}

/// The times at which rules find a primitive in a track.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FoundTrack {
    pub who: TrackId,
    pub side: Option<Side>,
    pub spans: Vec<Span>,
}

/// Where each of some rule sets finds the primitive in a recording, by track.
///
/// # Errors
/// When the recording cannot be evaluated.
pub(super) fn found(
    recording: &ShownRecording,
    rules: &[&Rules],
    question: Question,
) -> Result<Vec<Vec<FoundTrack>>, InputError> {
    let mut last: Option<(&Rules, Frames)> = None;
    let mut all = Vec::new();
    for rules in rules.iter().copied() {
        let frames = match last {
            Some((other, frames)) if other.channels == rules.channels => frames,
            _ => (recording.frames)(&rules.channels)?,
        };
        all.push(tracks(rules, &frames, question)?);
        last = Some((rules, frames));
    }
    Ok(all)
}

fn tracks(rules: &Rules, frames: &Frames, question: Question) -> Result<Vec<FoundTrack>, InputError> {
    let tracks: Vec<(TrackId, Option<Side>)> = match (question.scope, question.sided) {
        (TreeScope::EachHand, _) => frames.layout.hands.iter().map(|hand| (TrackId::Hand(hand.side), None)).collect(),
        (TreeScope::BothHands, true) => Side::BOTH.map(|side| (TrackId::Both, Some(side))).to_vec(),
        (TreeScope::BothHands, false) => vec![(TrackId::Both, None)],
    };
    let mut found: Vec<FoundTrack> =
        tracks.iter().map(|(who, side)| FoundTrack { who: *who, side: *side, spans: Vec::new() }).collect();
    for leaves in evaluate(&lower(rules), frames)? {
        for track in &mut found {
            let spans = spans(rules, frames, &leaves, question.name, track);
            track.spans.extend(spans);
        }
    }
    Ok(found)
}

/// The times of a primitive in a stretch of a track: leaves of a hand are settled, and covered by those of both hands.
fn spans(rules: &Rules, frames: &Frames, leaves: &Leaves, name: &str, track: &FoundTrack) -> Vec<Span> {
    let settle_of = |scope| {
        let settle_s = rules.tree(scope).and_then(|tree| tree.settle.as_ref()).map_or(0.0, |it| it.value);
        (settle_s * frames.layout.rate_hz).round() as usize
    };
    let both = settle(&leaves.both, settle_of(TreeScope::BothHands));
    let runs = match track.who {
        TrackId::Both => both,
        TrackId::Hand(hand) => {
            let own = leaves.hands.get(&hand).map_or(&[][..], Vec::as_slice);
            cover(&settle(own, settle_of(TreeScope::EachHand)), &both)
        }
    };
    let asked = rules.primitive(name);
    let is_asked = |label: Label| Some(label.primitive) == asked && label.side == track.side;
    let start_s = |frame: usize| frames.time.get(frame).copied().unwrap_or_default();
    let end_s = |frame: usize| start_s(frame - 1) + frames.layout.rate_hz.recip();
    let runs = runs.iter().filter(|run| run.label.is_some_and(is_asked));
    runs.map(|run| [start_s(run.start), end_s(run.end)]).collect()
}

/// How well intervals agree with marks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Recognition {
    /// Marked intervals.
    pub marked: usize,
    /// Intervals that were found, where it is known whether they are right.
    pub found: usize,
    /// Marked intervals that a found one overlaps by half of both together.
    pub matched: usize,
    /// The time that is marked and found, found only, and marked only, s.
    pub right_s: f64,
    /// See `right_s`.
    pub wrong_s: f64,
    /// See `right_s`.
    pub missed_s: f64,
}

impl Recognition {
    /// Compares intervals with what is known about their track.
    pub(super) fn new(track: &MarkedTrack, found: &[Span]) -> Self {
        let marked = &track.marked;
        let is_known = |span: &&Span| track.known.as_ref().is_none_or(|known| common_s(span, known) > 0.0);
        let known_s = |span: &Span| track.known.as_ref().map_or(length_s(span), |known| common_s(span, known));
        let right_s: f64 = found.iter().map(|span| common_s(span, marked)).sum();
        let all_s: f64 = found.iter().map(|span| known_s(span).max(common_s(span, marked))).sum();
        let is_match = |mark: &Span, span: &Span| {
            let both_s = overlap_s(mark, span);
            2.0 * both_s >= length_s(mark) + length_s(span) - both_s
        };
        Self {
            marked: marked.len(),
            found: found.iter().filter(is_known).count(),
            matched: marked.iter().filter(|mark| found.iter().any(|span| is_match(mark, span))).count(),
            right_s,
            wrong_s: all_s - right_s,
            missed_s: marked.iter().map(length_s).sum::<f64>() - right_s,
        }
    }

    /// The share of the time that is marked or found which is both, 0 to 1.
    pub fn overlap(&self) -> f64 {
        self.right_s / (self.right_s + self.wrong_s + self.missed_s).max(f64::MIN_POSITIVE)
    }

    /// How well the marks are found, 0 to 1: half F1 of the intervals at 50 % overlap, half the overlap in time.
    pub(super) fn worth(&self) -> f64 {
        let f1 = 2.0 * self.matched as f64 / ((self.marked + self.found) as f64).max(1.0);
        0.5 * (f1 + self.overlap())
    }
}

impl AddAssign for Recognition {
    fn add_assign(&mut self, other: Self) {
        self.marked += other.marked;
        self.found += other.found;
        self.matched += other.matched;
        self.right_s += other.right_s;
        self.wrong_s += other.wrong_s;
        self.missed_s += other.missed_s;
    }
}

pub(super) fn length_s(span: &Span) -> f64 {
    span[1] - span[0]
}

/// The time that two spans have in common, s.
pub(super) fn overlap_s(one: &Span, other: &Span) -> f64 {
    (one[1].min(other[1]) - one[0].max(other[0])).max(0.0)
}

/// The time of a span that is in some spans apart, s.
fn common_s(one: &Span, others: &[Span]) -> f64 {
    others.iter().map(|other| overlap_s(one, other)).sum()
}
