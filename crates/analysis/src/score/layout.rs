//! Truth and result of a track on one scale: named spans and segments in, two rows of pieces over the scored time out.
//!
//! Scored is the time that has a true name and a result. The rest (masked, or in a gap of the recording) is cut out and what is left is put
//! together, as is usual where only a part of the frames is labeled; so neighbors of one name become one piece.
//! The result uses the labels of the truth: see [`Layout::new`].

use super::name_map::SEPARATE;
use super::truth::Span;
use crate::{Segment, Track, TrackId};
use std::collections::{BTreeMap, BTreeSet};

/// Times that differ by less are the same, s: stamps are written with a few digits and added up.
pub(super) const SAME_S: f64 = 1e-6;

/// A stretch of scored time with one true and one resulting name.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    /// The true piece, by position.
    pub truth: usize,
    /// The resulting piece, by position.
    pub result: usize,
    /// The duration, s.
    pub length_s: f64,
    /// Whether the resulting name is one of the right ones.
    pub right: bool,
}

/// A piece of one row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LabeledSpan {
    /// Its name, in the words of the truth.
    pub name: String,
    /// Start in scored time, s.
    pub start_s: f64,
    /// End in scored time, s.
    pub end_s: f64,
    /// Start and end by the clock, s.
    pub clock_s: (f64, f64),
    /// Whether it begins where the scored time does, or after something that was cut out: then its start is not a boundary.
    pub cut: bool,
}

/// Both rows of a track.
#[derive(Clone, Debug, Default)]
pub(super) struct Layout {
    /// The truth.
    pub truth: Vec<LabeledSpan>,
    /// The result.
    pub result: Vec<LabeledSpan>,
    /// The scored time, in order.
    pub cells: Vec<Cell>,
}

/// The labels of an interval of scored time.
struct ScoredInterval<'a> {
    names: &'a [String],
    label: &'a str,
    start_s: f64,
    end_s: f64,
    /// Start in scored time, s.
    scored_s: f64,
    cut: bool,
}

impl Layout {
    /// Lays truth and result out.
    ///
    /// Where the truth has alternatives, `Move|Approach`, that is one class: a resulting segment whose name is among the alternatives of true
    /// segments gets the class with which it shares most time, else as the only class that has its name, and neighbors of one class are one
    /// segment.
    pub fn new(truth: &[Span], result: &[(&str, f64, f64)]) -> Self {
        let moments = moments(truth, result);
        let truths: Vec<&[ScoredInterval]> = moments.chunk_by(|one, next| one.names == next.names).collect();
        let results: Vec<&[ScoredInterval]> = moments.chunk_by(|one, next| one.label == next.label).collect();
        let truth: Vec<LabeledSpan> =
            truths.iter().filter_map(|part| piece(part, part.first()?.names.join("|"))).collect();
        let known: BTreeSet<&[String]> = moments.iter().map(|moment| moment.names).collect();
        let classes: Vec<String> = results.iter().map(|part| class(part, &known)).collect();
        let mut result: Vec<LabeledSpan> = Vec::new();
        let mut position = Vec::new();
        for (part, name) in results.iter().zip(classes) {
            match result.last_mut() {
                Some(last) if last.name == name => {
                    if let Some(more) = piece(part, name) {
                        last.end_s = more.end_s;
                        last.clock_s.1 = more.clock_s.1;
                    }
                }
                _ => result.extend(piece(part, name)),
            }
            position.push(result.len().saturating_sub(1));
        }
        let of_truth = numbered(&truths, |at| at);
        let of_result = numbered(&results, |at| position.get(at).copied().unwrap_or_default());
        let cells = moments.iter().zip(of_truth.into_iter().zip(of_result)).map(|(moment, (truth, result))| Cell {
            truth,
            result,
            length_s: moment.end_s - moment.start_s,
            right: moment.names.iter().any(|name| name == moment.label),
        });
        Self { cells: cells.collect(), truth, result }
    }
}

/// Returns the segments of a track: name, start and end (s). A track of both hands is `separate` wherever the `analyzed` time has no coordinated
/// primitive.
pub(super) fn segments<'a>(
    track: &'a Track,
    segments: &'a [Segment],
    analyzed: &[(f64, f64)],
) -> Vec<(&'a str, f64, f64)> {
    let own = segments.iter().map(|segment| (segment.primitive.as_str(), segment.start_s, segment.end_s));
    if track.who != TrackId::Both {
        return own.collect();
    }
    let own: Vec<_> = own.collect();
    let mut filled: Vec<(&str, f64, f64)> = Vec::new();
    for (start_s, end_s) in analyzed {
        let mut from = *start_s;
        for (name, start, end) in own.iter().filter(|(_, start, end)| *start < *end_s && *end > *start_s) {
            filled.push((SEPARATE, from, *start));
            filled.push((name, *start, *end));
            from = *end;
        }
        filled.push((SEPARATE, from, *end_s));
    }
    filled.retain(|(_, start, end)| end - start > SAME_S);
    filled
}

/// The time in which a truth and a result are, in order.
fn moments<'a>(truth: &'a [Span], result: &[(&'a str, f64, f64)]) -> Vec<ScoredInterval<'a>> {
    let mut moments: Vec<ScoredInterval> = Vec::new();
    let (mut truths, mut results) = (truth.iter().peekable(), result.iter().peekable());
    let mut scored_s = 0.0;
    while let (Some(span), Some((label, start, end))) = (truths.peek(), results.peek()) {
        let (start_s, end_s) = (span.start_s.max(*start), span.end_s.min(*end));
        if end_s - start_s > SAME_S {
            let cut = moments.last().is_none_or(|last| start_s - last.end_s > SAME_S);
            moments.push(ScoredInterval { names: &span.names, label, start_s, end_s, scored_s, cut });
            scored_s += end_s - start_s;
        }
        if span.end_s <= *end {
            truths.next();
        } else {
            results.next();
        }
    }
    moments
}

fn piece(part: &[ScoredInterval], name: String) -> Option<LabeledSpan> {
    let (first, last) = (part.first()?, part.last()?);
    Some(LabeledSpan {
        name,
        start_s: first.scored_s,
        end_s: last.scored_s + (last.end_s - last.start_s),
        clock_s: (first.start_s, last.end_s),
        cut: first.cut,
    })
}

/// What a resulting segment is called: the true class with which it shares most time, of those that it may belong to; when it shares none, the only
/// one; else its own name.
fn class(part: &[ScoredInterval], known: &BTreeSet<&[String]>) -> String {
    let mut shared: BTreeMap<&[String], f64> = BTreeMap::new();
    for moment in part.iter().filter(|moment| moment.names.iter().any(|name| name == moment.label)) {
        *shared.entry(moment.names).or_default() += moment.end_s - moment.start_s;
    }
    let best = shared.into_iter().reduce(|best, next| if next.1 > best.1 { next } else { best });
    let label = part.first().map_or("", |moment| moment.label);
    let mut may_be = known.iter().filter(|names| names.iter().any(|name| name == label));
    match (best, may_be.next(), may_be.next()) {
        (Some((names, _)), ..) => names.join("|"),
        (None, Some(only), None) => only.join("|"),
        _ => label.to_string(),
    }
}

/// For every moment the number of the part that it is in, as `number` has it.
fn numbered(parts: &[&[ScoredInterval]], number: impl Fn(usize) -> usize) -> Vec<usize> {
    parts.iter().enumerate().flat_map(|(at, part)| std::iter::repeat_n(number(at), part.len())).collect()
}
