//! Two results held against the same labels, where labels can decide between them.
//!
//! Labels know the primitives of the rules that they were made with. Where one of two rule sets finds a primitive that it alone declares and that the labels
//! never name, they say nothing about it: this time is left out for both, and counted.

use super::name_map::KnownNames;
use super::truth::{Span, Truth};
use super::{Stage, Tally, score};
use crate::json::Meta;
use crate::{Analysis, Segment, Track, TrackId};
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::error::InputError;

/// A result and its reference.
pub struct ComparedResult<'a> {
    /// The labels, in the names of its rules.
    pub truth: &'a Truth,
    /// The result.
    pub found: &'a Analysis,
    /// The inputs of the analysis.
    pub meta: &'a Meta,
    /// The names of its rules.
    pub known: &'a KnownNames,
}

/// The agreement of two results with labels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comparison {
    /// The share of the time that was compared in which each agrees; `None` where no time was.
    pub accuracy: [Option<f64>; 2],
    /// The time that was compared, s.
    pub scored_s: f64,
    /// The primitives that the labels do not know, with the time in which one of the results has them, s.
    pub unknown: BTreeMap<String, f64>,
}

/// Compares two results of a recording with its labels.
///
/// # Errors
/// As [`score`].
pub fn compare(sides: [&ComparedResult; 2]) -> Result<Comparison, InputError> {
    let [one, other] = sides;
    let unknown: Vec<(TrackId, &Segment)> = [unknown(one, other), unknown(other, one)].concat();
    let mut compared = Comparison::default();
    for (who, segment) in &unknown {
        let spans = one.truth.tracks.iter().filter(|track| track.who == *who).flat_map(|track| &track.primitives);
        let shared = |span: &Span| (span.end_s.min(segment.end_s) - span.start_s.max(segment.start_s)).max(0.0);
        let time: f64 = spans.map(shared).sum();
        if time > 0.0 {
            *compared.unknown.entry(segment.primitive.clone()).or_default() += time;
        }
    }
    for (accuracy, side) in compared.accuracy.iter_mut().zip(sides) {
        let mut truth = side.truth.clone();
        for track in &mut truth.tracks {
            for (_, segment) in unknown.iter().filter(|(who, _)| *who == track.who) {
                let left = track.primitives.iter().flat_map(|span| outside(span, segment));
                track.primitives = left.collect();
            }
        }
        let mut all = Tally::default();
        let rows = score(&truth, side.found, Stage::Relabeled, side.meta)?;
        rows.iter().for_each(|row| all.add(&row.tally));
        *accuracy = all.accuracy();
        compared.scored_s = all.scored_s();
    }
    Ok(compared)
}

/// The segments of a result with a primitive that the labels never name and the rules beside do not have.
fn unknown<'a>(side: &ComparedResult<'a>, beside: &ComparedResult) -> Vec<(TrackId, &'a Segment)> {
    let spans = side.truth.tracks.iter().flat_map(|track| &track.primitives);
    let named: BTreeSet<&str> = spans.flat_map(|span| span.names.iter().map(String::as_str)).collect();
    let primitives = &side.found.primitives;
    let is_unknown = |segment: &&Segment| {
        let counted = primitives.counts_for(&segment.primitive, |name| named.contains(name));
        !named.contains(counted) && !beside.known.primitives.contains(&segment.primitive)
    };
    let of = |track: &'a Track| track.relabeled.iter().filter(is_unknown).map(move |segment| (track.who, segment));
    side.found.tracks.iter().flat_map(of).collect()
}

/// The parts of a span before and after a segment.
fn outside(span: &Span, segment: &Segment) -> Vec<Span> {
    let before = Span { end_s: span.end_s.min(segment.start_s), ..span.clone() };
    let after = Span { start_s: span.start_s.max(segment.end_s), ..span.clone() };
    [before, after].into_iter().filter(|part| part.start_s < part.end_s).collect()
}
