//! What a result is worth beside the truth, as one number from 0 to 1 that a search can climb.

use crate::analysis::score::Tally;
use serde::Serialize;

/// A boundary that is off by this or more is worth nothing, s.
pub const TOLERANCE_S: f64 = 0.2;

/// The worth of a result, and of what it is made; all from 0 to 1, and 1 where the result is the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Worth {
    /// Half the accuracy, a quarter of F1 and of the boundaries.
    pub worth: f64,
    /// The share of the frames with the right name.
    pub accuracy: f64,
    /// F1 of the segments at 50 % overlap.
    pub f1: f64,
    /// The mean of `1 - off / TOLERANCE_S` over the boundaries of the truth; 0 for one that is further off, or missing.
    pub boundaries: f64,
}

impl Worth {
    /// The worth of the counts of a recording; what it says nothing about counts as its accuracy.
    pub fn new(tally: &Tally) -> Self {
        let accuracy = tally.accuracy().unwrap_or_default();
        let f1 = tally.f1()[2].unwrap_or(accuracy);
        let near = tally
            .boundaries
            .iter()
            .map(|boundary| boundary.late_s.map_or(0.0, |late| 1.0 - (late.abs() / TOLERANCE_S).min(1.0)));
        let count = tally.boundaries.len();
        let boundaries = if count == 0 { accuracy } else { near.sum::<f64>() / count as f64 };
        Self { worth: 0.5 * accuracy + 0.25 * f1 + 0.25 * boundaries, accuracy, f1, boundaries }
    }
}

/// The mean over some recordings, by position.
pub fn mean(worths: &[Worth], of: &[usize]) -> Worth {
    let chosen: Vec<&Worth> = of.iter().filter_map(|at| worths.get(*at)).collect();
    let count = chosen.len().max(1) as f64;
    let over = |part: fn(&Worth) -> f64| chosen.iter().map(|worth| part(worth)).sum::<f64>() / count;
    Worth {
        worth: over(|worth| worth.worth),
        accuracy: over(|worth| worth.accuracy),
        f1: over(|worth| worth.f1),
        boundaries: over(|worth| worth.boundaries),
    }
}
