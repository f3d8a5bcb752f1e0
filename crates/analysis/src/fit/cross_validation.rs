//! The judgement: recordings are held out in groups, the others are fitted, and what that brings on those held out is the gain.

use super::{Objective, Objectives, ParamVector, Progress, Space, mean, search};
use serde::Serialize;
use std::collections::BTreeMap;
use std::f64::consts::FRAC_2_PI;

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
    /// The number of groups of recordings, which the test compares.
    pub groups: usize,
    /// The mean gain of a group; that of a group is the mean of its recordings.
    pub gain: f64,
    /// The lower bound of the gain with 95 % confidence (Student's t over groups, one-sided).
    pub at_least: f64,
    /// The probability of such a gain or a larger one where there is none, by the same test.
    pub p_value: f64,
}

/// The groups of recordings, such as people: those of a group are held out together, and their gains are not independent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HeldGroups {
    /// The group of each recording, counted from 0 without gaps.
    pub of_logs: Vec<usize>,
    /// The number of folds: group `g` is held out in fold `g % folds`.
    pub folds: usize,
}

impl HeldGroups {
    /// Each recording is a group.
    pub fn of_recordings(logs: usize, folds: usize) -> Self {
        Self { of_logs: (0..logs).collect(), folds }
    }
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

/// Fits all recordings but those of each fold in its turn. The number of folds is at least 2, and not more than that of the groups.
pub fn cross_validation(
    space: &Space,
    groups: &HeldGroups,
    still: &[usize],
    objectives: &mut Objectives,
    progress: &mut Progress,
) -> CrossValidation {
    let mut folds = Vec::new();
    for fold in 0..groups.folds {
        let is_held = |log: &usize| groups.of_logs[*log] % groups.folds == fold;
        let (held, others): (Vec<usize>, Vec<usize>) = (0..groups.of_logs.len()).partition(is_held);
        let mut inner = |part: f64| progress((fold as f64 + part) / groups.folds as f64);
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
    let mut gains: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    let logs = folds.iter().flat_map(|fold| &fold.logs);
    for (log, (before, after)) in logs.zip(before.iter().zip(&after)) {
        gains.entry(groups.of_logs[*log]).or_default().push(after.objective - before.objective);
    }
    let gains: Vec<f64> = gains.values().map(|gains| gains.iter().sum::<f64>() / gains.len() as f64).collect();
    let (gain, at_least, p_value) = test(&gains);
    let all: Vec<usize> = (0..before.len()).collect();
    let (before, after) = (mean(&before, &all), mean(&after, &all));
    CrossValidation { folds, before, after, groups: gains.len(), gain, at_least, p_value }
}

impl CrossValidation {
    /// Whether the gain is beyond its spread.
    pub fn is_borne_out(&self) -> bool {
        self.at_least > 0.0
    }
}

/// Returns the mean of some numbers, its lower bound with 95 % confidence, `mean - t(n - 1) sd / √n`, and the p-value of a mean of 0 or less.
fn test(numbers: &[f64]) -> (f64, f64, f64) {
    let count = numbers.len().max(1) as f64;
    let mean = numbers.iter().sum::<f64>() / count;
    let squares: f64 = numbers.iter().map(|number| (number - mean) * (number - mean)).sum();
    let Some(freedom) = numbers.len().checked_sub(1).filter(|freedom| *freedom > 0) else {
        return (mean, f64::NEG_INFINITY, 1.0);
    };
    let error = (squares / freedom as f64 / count).sqrt();
    let p_value = if error > 0.0 { exceeded(mean / error, freedom) } else { f64::from(mean <= 0.0) };
    (mean, mean - student(freedom) * error, p_value)
}

/// The probability that Student's t with `freedom` degrees of freedom exceeds `t`: its finite series (Abramowitz and Stegun 26.7.3 and 26.7.4).
fn exceeded(t: f64, freedom: usize) -> f64 {
    let angle = (t / (freedom as f64).sqrt()).atan();
    let (sine, cosine) = angle.sin_cos();
    let is_odd = freedom % 2 == 1;
    // The factors of the terms: 2/3, 4/5, … for odd degrees of freedom, 1/2, 3/4, … for even ones.
    let first = if is_odd { 2 } else { 1 };
    let (mut term, mut sum) = if freedom == 1 { (0.0, 0.0) } else { (1.0, 1.0) };
    for step in (first..freedom.saturating_sub(2)).step_by(2) {
        term *= cosine * cosine * step as f64 / (step + 1) as f64;
        sum += term;
    }
    let within = if is_odd { FRAC_2_PI * (angle + sine * cosine * sum) } else { sine * sum };
    0.5 * (1.0 - within)
}

/// Returns the 95 % quantile of Student's t with `freedom` degrees of freedom: the value that is exceeded in 5 % of all cases.
fn student(freedom: usize) -> f64 {
    // The greatest quantile is 6.3, of one degree of freedom.
    let (mut low, mut high) = (0.0, 7.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if exceeded(middle, freedom) > 0.05 { low = middle } else { high = middle }
    }
    high
}
