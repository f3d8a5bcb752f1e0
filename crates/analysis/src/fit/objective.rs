//! The agreement of a result with the true labels, as one number from 0 to 1 that a search can maximize.

use crate::score::Tally;
use serde::Serialize;

/// A boundary with an error of this or more contributes 0, s.
pub const TOLERANCE_S: f64 = 0.2;

/// The objective and its parts. Each is from 0 to 1, and 1 where the result equals the true labels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Objective {
    /// The sum of half the accuracy, a quarter of F1 and a quarter of `boundaries`.
    pub objective: f64,
    /// The share of the frames with the right name.
    pub accuracy: f64,
    /// F1 of the segments at 50 % overlap.
    pub f1: f64,
    /// The mean of `1 - error / TOLERANCE_S` over the true boundaries; 0 for a larger error or a missing boundary.
    pub boundaries: f64,
}

impl Objective {
    /// The objective of a recording. Without boundaries or segments to compare, the accuracy takes the place of that part.
    pub fn new(tally: &Tally) -> Self {
        let accuracy = tally.accuracy().unwrap_or_default();
        let f1 = tally.f1()[2].unwrap_or(accuracy);
        let near = tally
            .boundaries
            .iter()
            .map(|boundary| boundary.late_s.map_or(0.0, |late| 1.0 - (late.abs() / TOLERANCE_S).min(1.0)));
        let count = tally.boundaries.len();
        let boundaries = if count == 0 { accuracy } else { near.sum::<f64>() / count as f64 };
        Self { objective: 0.5 * accuracy + 0.25 * f1 + 0.25 * boundaries, accuracy, f1, boundaries }
    }
}

/// The mean over some recordings, by position.
pub fn mean(objectives: &[Objective], of: &[usize]) -> Objective {
    let chosen: Vec<&Objective> = of.iter().filter_map(|at| objectives.get(*at)).collect();
    let count = chosen.len().max(1) as f64;
    let over = |part: fn(&Objective) -> f64| chosen.iter().map(|objective| part(objective)).sum::<f64>() / count;
    Objective {
        objective: over(|objective| objective.objective),
        accuracy: over(|objective| objective.accuracy),
        f1: over(|objective| objective.f1),
        boundaries: over(|objective| objective.boundaries),
    }
}
