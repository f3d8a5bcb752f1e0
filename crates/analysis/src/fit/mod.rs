//! Params that are learned from labeled recordings: the search in a space of params for better values, and cross-validation on recordings that are held
//! out. docs/fitting.md describes both.
//!
//! Invariants: nothing is read, run or printed here; the same objectives give the same result; a point whose rules cannot run is never chosen.

mod cross_validation;
mod json;
mod objective;
mod search;

pub use cross_validation::{CrossValidation, Fold, HeldGroups, MIN_LOGS, Verdict, cross_validation};
pub use json::{SCHEMA, json};
pub use objective::{Objective, mean, tolerance_s};
pub use search::{MIN_GAIN, Progress, idle, search};

use std::rc::Rc;

/// A param that may be changed; all in the unit in which it is written.
#[derive(Clone, Debug, PartialEq)]
pub struct FitParam {
    /// Its name.
    pub name: String,
    /// The unit.
    pub unit: String,
    /// The value in the file.
    pub value: f64,
    /// The declared range.
    pub range: (f64, f64),
}

/// A value for each param, in its unit.
pub type ParamVector = Vec<f64>;

/// Evaluates points: returns for each point the objective of each recording, or `None` if its rules cannot run.
pub type Objectives<'a> = dyn FnMut(&[ParamVector]) -> Vec<Option<Rc<[Objective]>>> + 'a;

/// A parameter of the fit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Space {
    /// The params.
    pub params: Vec<FitParam>,
    /// Pairs that are the two thresholds of one hysteresis, which are also moved together; by position.
    pub pairs: Vec<(usize, usize)>,
}

/// The result of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The recordings, as the user named them.
    pub logs: Vec<String>,
    /// The parameters of the fit.
    pub space: Space,
    /// A boundary with an error of this or more contributes 0, s.
    pub tolerance_s: f64,
    /// The params that change nothing on these recordings, by position.
    pub idle: Vec<usize>,
    /// The values that were found for all recordings.
    pub point: ParamVector,
    /// The mean objective of all recordings with the values in the files.
    pub before: Objective,
    /// The same with those that were found.
    pub after: Objective,
    /// The result of the cross-validation.
    pub held_out: Option<CrossValidation>,
    /// The verdict on the fit.
    pub verdict: Verdict,
}

impl Fit {
    /// The params that were changed: the position of each, and its value.
    pub fn changed(&self) -> Vec<(usize, f64)> {
        let all = self.space.params.iter().zip(&self.point).enumerate();
        all.filter(|(_, (param, value))| param.value.to_bits() != value.to_bits())
            .map(|(at, (_, value))| (at, *value))
            .collect()
    }
}

impl Space {
    /// The values in the files.
    pub fn start(&self) -> ParamVector {
        self.params.iter().map(|param| param.value).collect()
    }
}

impl FitParam {
    /// The text of a value: `12 mm/s`.
    pub fn show(&self, value: f64) -> String {
        let number = number(value);
        if self.unit.is_empty() { number } else { format!("{number} {}", self.unit) }
    }

    /// The value at a part of the range, 0 to 1: even steps of the value, or of its logarithm where the range spans a factor of four or more.
    fn at(&self, part: f64) -> f64 {
        let (low, high) = self.range;
        let value = if self.is_geometric() { low * (high / low).powf(part) } else { low + (high - low) * part };
        rounded(value, 3).clamp(low, high)
    }

    /// The part of the range at which a value lies.
    fn part(&self, value: f64) -> f64 {
        let (low, high) = self.range;
        let part =
            if self.is_geometric() { (value / low).ln() / (high / low).ln() } else { (value - low) / (high - low) };
        if part.is_finite() { part.clamp(0.0, 1.0) } else { 0.0 }
    }

    fn is_geometric(&self) -> bool {
        self.range.0 > 0.0 && self.range.1 >= 4.0 * self.range.0
    }
}

/// Returns a value rounded to `digits` significant digits.
fn rounded(value: f64, digits: usize) -> f64 {
    format!("{:.*e}", digits.saturating_sub(1), value).parse().unwrap_or(value)
}

/// A number as people write it.
fn number(value: f64) -> String {
    let short = format!("{value}");
    // Only the very small are written with a power of ten.
    if short.len() > 9 { format!("{value:e}") } else { short }
}
