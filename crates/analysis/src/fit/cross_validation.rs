//! The judgement: recordings are held out in groups, the others are fitted, and what that brings on those held out is the gain.

use super::{Objective, Objectives, ParamVector, Progress, Space, mean, search};
use serde::Serialize;

/// Recordings below which nothing is said of others.
pub const MIN_LOGS: usize = 4;

/// The result of a cross-validation.
#[derive(Clone, Debug, PartialEq)]
pub struct CrossValidation {
    /// The groups.
    pub folds: Vec<Fold>,
    /// The mean objective of recordings while they are held out, with the values in the files.
    pub before: Objective,
    /// This value with the params fitted on the others.
    pub after: Objective,
    /// The mean gain of a recording.
    pub gain: f64,
    /// The lower bound of the gain with 95 % confidence (Student's t, one-sided).
    pub at_least: f64,
}

/// A group of recordings that was held out.
#[derive(Clone, Debug, PartialEq)]
pub struct Fold {
    /// The recordings, by position.
    pub logs: Vec<usize>,
    /// The params fitted on the others.
    pub point: ParamVector,
    /// The objective of each held-out recording, with the values in the files.
    pub before: Vec<Objective>,
    /// This value with the fitted params.
    pub after: Vec<Objective>,
}

/// The verdict on a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The fitted params are better on held-out recordings.
    Gain,
    /// No other values are better on these recordings.
    NothingToGain,
    /// Better on the recordings that were fitted, but not beyond the spread on those held out.
    NotBorneOut,
    /// Too few recordings to hold any out.
    TooFew,
}

/// Fits all recordings but each group in its turn. `groups` is at least 2, and not more than the recordings are.
pub fn cross_validation(
    space: &Space,
    logs: usize,
    groups: usize,
    still: &[usize],
    objectives: &mut Objectives,
    progress: &mut Progress,
) -> CrossValidation {
    let mut folds = Vec::new();
    for group in 0..groups {
        let (held, others): (Vec<usize>, Vec<usize>) = (0..logs).partition(|log| log % groups == group);
        let mut inner = |part: f64| progress((group as f64 + part) / groups as f64);
        let point = search(space, &others, still, objectives, &mut inner);
        let mut found = objectives(&[space.start(), point.clone()]).into_iter();
        let mut of_held = || -> Vec<Objective> {
            let all = found.next().flatten();
            held.iter().filter_map(|log| all.as_ref()?.get(*log).copied()).collect()
        };
        let (before, after) = (of_held(), of_held());
        folds.push(Fold { logs: held, point, before, after });
    }
    let before: Vec<Objective> = folds.iter().flat_map(|fold| fold.before.iter().copied()).collect();
    let after: Vec<Objective> = folds.iter().flat_map(|fold| fold.after.iter().copied()).collect();
    let gains: Vec<f64> = before.iter().zip(&after).map(|(before, after)| after.objective - before.objective).collect();
    let (gain, at_least) = bound(&gains);
    let all: Vec<usize> = (0..before.len()).collect();
    CrossValidation { folds, before: mean(&before, &all), after: mean(&after, &all), gain, at_least }
}

impl CrossValidation {
    /// Whether the gain is beyond its spread.
    pub fn is_borne_out(&self) -> bool {
        self.at_least > 0.0
    }
}

/// Returns the mean of some numbers, and its lower bound with 95 % confidence: `mean - t(n - 1) sd / √n`.
fn bound(numbers: &[f64]) -> (f64, f64) {
    let count = numbers.len().max(1) as f64;
    let mean = numbers.iter().sum::<f64>() / count;
    let squares: f64 = numbers.iter().map(|number| (number - mean) * (number - mean)).sum();
    let Some(freedom) = numbers.len().checked_sub(1).filter(|freedom| *freedom > 0) else {
        return (mean, f64::NEG_INFINITY);
    };
    let error = (squares / freedom as f64 / count).sqrt();
    (mean, mean - student(freedom) * error)
}

/// Returns the 95 % quantile of Student's t with `freedom` degrees of freedom.
fn student(freedom: usize) -> f64 {
    const TABLE: [f64; 10] = [6.314, 2.920, 2.353, 2.132, 2.015, 1.943, 1.895, 1.860, 1.833, 1.812];
    const NORMAL: f64 = 1.645;
    match freedom.checked_sub(1).and_then(|at| TABLE.get(at)) {
        Some(quantile) => *quantile,
        // The first terms of the expansion in 1 / freedom, good to 0.002 from 11 on.
        None => NORMAL + (NORMAL.powi(3) + NORMAL) / (4.0 * freedom as f64),
    }
}
