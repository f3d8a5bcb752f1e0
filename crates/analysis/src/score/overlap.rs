//! Segmental F1: which segments of a result overlap a true one enough (Lea et al. 2017, "Temporal convolutional networks for action
//! segmentation and detection").

use super::layout::LabeledSpan;
use std::collections::BTreeMap;

/// The overlaps that are asked for, as intersection over union.
pub const OVERLAPS: [f64; 3] = [0.10, 0.25, 0.50];
/// Rounding may not decide whether an overlap is reached.
const ROUNDING: f64 = 1e-9;

/// Segments of one name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Matches {
    /// True ones.
    pub truths: usize,
    /// Resulting ones.
    pub results: usize,
    /// Resulting ones that overlap a true one as much as [`OVERLAPS`] asks.
    pub found: [usize; 3],
}

impl Matches {
    /// Adds others.
    pub fn add(&mut self, other: Self) {
        self.truths += other.truths;
        self.results += other.results;
        for (found, more) in self.found.iter_mut().zip(other.found) {
            *found += more;
        }
    }

    /// F1 at each overlap: twice the found, over true and resulting ones together. `None` where there are no segments.
    pub fn f1(&self) -> [Option<f64>; 3] {
        self.found.map(|found| super::statistics::ratio(2.0 * found as f64, (self.truths + self.results) as f64))
    }
}

/// Counts the segments by name. Each result takes the true segment of its name with the greatest overlap; it is found when that overlap is
/// enough and no result before it has found that segment.
pub(super) fn matches(truth: &[&LabeledSpan], result: &[&LabeledSpan]) -> BTreeMap<String, Matches> {
    let mut counted: BTreeMap<String, Matches> = BTreeMap::new();
    for piece in truth {
        counted.entry(piece.name.clone()).or_default().truths += 1;
    }
    let mut taken = vec![[false; 3]; truth.len()];
    for piece in result {
        let matches = counted.entry(piece.name.clone()).or_default();
        matches.results += 1;
        let best = truth
            .iter()
            .enumerate()
            .filter(|(_, truth)| truth.name == piece.name)
            .map(|(at, truth)| (at, overlap(truth, piece)))
            .reduce(|best, next| if next.1 > best.1 { next } else { best });
        let Some((at, overlap)) = best else { continue };
        let Some(taken) = taken.get_mut(at) else { continue };
        for ((taken, found), asked) in taken.iter_mut().zip(&mut matches.found).zip(OVERLAPS) {
            if overlap >= asked - ROUNDING && !*taken {
                *taken = true;
                *found += 1;
            }
        }
    }
    counted
}

/// Intersection over union.
fn overlap(one: &LabeledSpan, other: &LabeledSpan) -> f64 {
    let both = one.end_s.min(other.end_s) - one.start_s.max(other.start_s);
    let either = one.end_s.max(other.end_s) - one.start_s.min(other.start_s);
    if either > 0.0 { both.max(0.0) / either } else { 0.0 }
}
