//! The agreement of a result with the true labels, as one number from 0 to 1 that a search can maximize.

use crate::score::name_map::SEPARATE;
use crate::score::{Tally, Truth};
use serde::Serialize;

/// The least and the greatest tolerance of boundaries, s.
const TOLERANCE_S: [f64; 2] = [0.2, 2.0];

/// The tolerance of boundaries for some true labels, s: a quarter of the median duration of their segments, at least 0.2 s and at most 2 s.
pub fn tolerance_s<'t>(truths: impl Iterator<Item = &'t Truth>) -> f64 {
    let spans = truths.flat_map(|truth| &truth.tracks).flat_map(|track| &track.primitives);
    let labeled = spans.filter(|span| span.names.iter().all(|name| name != SEPARATE));
    let mut durations: Vec<f64> = labeled.map(|span| span.end_s - span.start_s).collect();
    durations.sort_by(f64::total_cmp);
    let [least, most] = TOLERANCE_S;
    durations.get(durations.len() / 2).map_or(least, |median| (0.25 * median).clamp(least, most))
}

/// The objective and its parts. Each is from 0 to 1, and 1 where the result equals the true labels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Objective {
    /// The sum of half the accuracy, a quarter of F1 and a quarter of `boundaries`.
    pub objective: f64,
    /// The share of the frames with the right name.
    pub accuracy: f64,
    /// F1 of the segments at 50 % overlap.
    pub f1: f64,
    /// The mean of `1 - error / tolerance` over the true boundaries; 0 for a larger error or a missing boundary.
    pub boundaries: f64,
}

impl Objective {
    /// The objective of a recording; a boundary with an error of `tolerance_s` or more contributes 0. Without boundaries or segments to compare, the accuracy takes the place of that part.
    pub fn new(tally: &Tally, tolerance_s: f64) -> Self {
        let accuracy = tally.accuracy().unwrap_or_default();
        let f1 = tally.f1()[2].unwrap_or(accuracy);
        let near = tally
            .boundaries
            .iter()
            .map(|boundary| boundary.late_s.map_or(0.0, |late| 1.0 - (late.abs() / tolerance_s).min(1.0)));
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
