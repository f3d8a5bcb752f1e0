//! The agreement of two people who labeled the same recordings: Cohen's kappa (Cohen 1960) over frames, and the distances of their boundaries.
//!
//! κ = (p − pₑ) / (1 − pₑ), where p is the share of frames with one label, and pₑ the share that two people with the same frequencies of labels would have by
//! chance. Invariants: both people count alike; counts of recordings add up in any grouping.

pub mod json;

use super::score::statistics::quantile;
use std::collections::{BTreeMap, BTreeSet};

/// Boundaries that are further apart do not stand for each other, s.
pub const SAME_BOUNDARY_S: f64 = 1.0;

/// An interval with a label.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// The label.
    pub label: String,
    /// Start, s.
    pub start_s: f64,
    /// End, s.
    pub end_s: f64,
}

/// Counts of two people's labels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Agreement {
    /// Frames that both labeled, by the label of the first person and of the second one.
    pub frames: BTreeMap<(String, String), usize>,
    /// Frames that only one of them labeled: the first, the second.
    pub alone: [usize; 2],
    /// The boundaries by the label that begins there.
    pub boundaries: BTreeMap<String, Boundaries>,
}

/// Boundaries of two people into one label.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Boundaries {
    /// The distances of matched boundaries, s, not negative.
    pub distances_s: Vec<f64>,
    /// Those that stand alone: of the first person, of the second one.
    pub alone: [usize; 2],
}

impl Agreement {
    /// Compares the labels of one track; spans are in order and apart, `time` is when the frames of the recording were, s, in order.
    pub fn new(one: &[Span], other: &[Span], time: &[f64]) -> Self {
        let mut agreement = Self::default();
        let label = |spans: &[Span], time: f64| {
            let at = spans.partition_point(|span| span.end_s <= time);
            spans.get(at).filter(|span| span.start_s <= time).map(|span| span.label.clone())
        };
        for time in time {
            match (label(one, *time), label(other, *time)) {
                (Some(one), Some(other)) => *agreement.frames.entry((one, other)).or_default() += 1,
                (Some(_), None) => agreement.alone[0] += 1,
                (None, Some(_)) => agreement.alone[1] += 1,
                (None, None) => {}
            }
        }
        // The start of the first label is not a boundary.
        let [one, other] = [one, other].map(|spans| spans.get(1..).unwrap_or_default());
        let labels: BTreeSet<&str> = one.iter().chain(other).map(|span| span.label.as_str()).collect();
        for label in labels {
            let starts = |spans: &[Span]| -> Vec<f64> {
                spans.iter().filter(|span| span.label == label).map(|span| span.start_s).collect()
            };
            agreement.boundaries.insert(label.into(), boundaries(&starts(one), &starts(other)));
        }
        agreement
    }

    /// Adds another one.
    pub fn add(&mut self, other: &Self) {
        for (pair, count) in &other.frames {
            *self.frames.entry(pair.clone()).or_default() += count;
        }
        self.alone = [0, 1].map(|at: usize| self.alone.iter().chain(&other.alone).skip(at).step_by(2).sum());
        for (label, boundaries) in &other.boundaries {
            self.boundaries.entry(label.clone()).or_default().add(boundaries);
        }
    }

    /// Frames that both labeled.
    pub fn both(&self) -> usize {
        self.frames.values().sum()
    }

    /// The share of these with one label, 0 to 1; `None` without frames.
    pub fn share(&self) -> Option<f64> {
        let same: usize = self.frames.iter().filter(|((one, other), _)| one == other).map(|(_, count)| count).sum();
        (self.both() > 0).then(|| same as f64 / self.both() as f64)
    }

    /// Cohen's kappa, −1 to 1; `None` where both have only one and the same label, so that nothing can be said.
    pub fn kappa(&self) -> Option<f64> {
        let mut totals: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
        for ((one, other), count) in &self.frames {
            totals.entry(one).or_default()[0] += count;
            totals.entry(other).or_default()[1] += count;
        }
        let all = self.both() as f64;
        let chance: f64 = totals.values().map(|[one, other]| *one as f64 / all * (*other as f64 / all)).sum();
        (chance < 1.0).then(|| Some((self.share()? - chance) / (1.0 - chance))).flatten()
    }

    /// Returns the agreement on one label against all others.
    pub fn of_label(&self, label: &str) -> Self {
        let name = |text: &str| if text == label { label.to_string() } else { String::new() };
        let mut agreement = Self::default();
        for ((one, other), count) in &self.frames {
            *agreement.frames.entry((name(one), name(other))).or_default() += count;
        }
        agreement.boundaries =
            self.boundaries.get(label).map(|own| (label.to_string(), own.clone())).into_iter().collect();
        agreement
    }

    /// The labels that a person used, in order.
    pub fn labels(&self) -> BTreeSet<&str> {
        let of_frames = self.frames.keys().flat_map(|(one, other)| [one.as_str(), other.as_str()]);
        of_frames.chain(self.boundaries.keys().map(String::as_str)).collect()
    }

    /// Frames to which both gave the same label; what is not a label of [`of_label`](Self::of_label) does not count.
    pub fn same(&self) -> usize {
        self.frames.iter().filter(|((one, other), _)| one == other && !one.is_empty()).map(|(_, count)| count).sum()
    }

    /// The boundaries of all labels.
    pub fn all_boundaries(&self) -> Boundaries {
        let mut all = Boundaries::default();
        self.boundaries.values().for_each(|own| all.add(own));
        all
    }
}

impl Boundaries {
    fn add(&mut self, other: &Self) {
        self.distances_s.extend(&other.distances_s);
        self.alone = [0, 1].map(|at: usize| self.alone.iter().chain(&other.alone).skip(at).step_by(2).sum());
    }

    /// The distance that a share `q` of the pairs does not exceed, s; `None` without pairs.
    pub fn quantile_s(&self, q: f64) -> Option<f64> {
        let mut sorted = self.distances_s.clone();
        sorted.sort_by(f64::total_cmp);
        quantile(&sorted, q)
    }
}

/// Pairs those starts of which each is the nearest to the other. Both are in order.
fn boundaries(one: &[f64], other: &[f64]) -> Boundaries {
    let nearest = |to: f64, list: &[f64]| {
        let distance = |at: &usize| list.get(*at).map_or(f64::INFINITY, |start| (start - to).abs());
        let after = list.partition_point(|start| *start < to);
        (after.saturating_sub(1)..list.len().min(after + 1)).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    };
    let pairs = one.iter().enumerate().filter_map(|(at, start)| {
        let theirs = *other.get(nearest(*start, other)?)?;
        let is_mutual = nearest(theirs, one) == Some(at);
        let distance_s = (theirs - start).abs();
        (is_mutual && distance_s <= SAME_BOUNDARY_S).then_some(distance_s)
    });
    let distances_s: Vec<f64> = pairs.collect();
    let alone = [one, other].map(|starts| starts.len() - distances_s.len());
    Boundaries { distances_s, alone }
}
