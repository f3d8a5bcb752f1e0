//! The weight of a tool and the bias of its force sensor, from a log in which the tool turns.
//!
//! While nothing is touched, a sensor reads `bias - mass * sensor_from_reference * gravity` (the force on the object, sensor frame). Where the mounting of the
//! sensor is not known, the readings of the free tool are turned by an unknown rotation, which is fitted too. All samples take part, with weights that fall
//! with the distance from the fit, so that contacts count little. All samples in which the sensor is turned alike count as one: a tool does not change while it
//! works, for however long.
//!
//! The uncertainty of the mass is the larger one of two estimates: the least-squares covariance, in which each orientation is one observation, and the
//! jackknife over parts of the recording. The first one is large if the tool turns little against the scatter of the readings; the second one if parts of
//! the recording disagree, as they do where the readings contain forces of contact.

use nalgebra::{Matrix3, Matrix3x4, Matrix4, UnitQuaternion, Vector3, Vector4};
use std::collections::BTreeMap;
use std::fmt;

/// Maximum number of samples of the fit.
const LOOKED_AT: usize = 4000;
/// Steps of the fit; it is settled long before.
const STEPS: usize = 50;
/// The least standard deviation of the direction of gravity in the sensor frame: below it, weight and bias cannot be distinguished.
const TURNS: f64 = 0.1;
/// Samples count as turned alike where the directions of gravity are in one cell of this size, as a share of its length.
const ALIKE: f64 = 0.05;
/// The heaviest tool, kg.
const HEAVIEST_KG: f64 = 100.0;
/// The least share of samples that the fit has to describe within `WITHIN` times the distance within which a quarter of them are.
const DESCRIBED: f64 = 0.4;
const WITHIN: f64 = 4.0;
/// A distance below which samples count alike, N: the resolution of a good sensor.
const RESOLUTION: f64 = 0.02;

/// The smallest singular value of a tool that turns about one axis, as a share of the largest one.
const ONE_AXIS: f64 = 0.05;
/// A mass is known where its standard deviation is below this, kg: the weight of less is not contact.
const KNOWN_KG: f64 = 0.075;
/// The same as a share of the mass.
const KNOWN_SHARE: f64 = 0.15;
/// The share of a recording that is its beginning, and its end; the tool is free in one of them.
const END: f64 = 0.02;
/// A reading this far from the fit may still be one of the free tool, N: it drifts.
const DRIFT: f64 = 1.0;
/// In how many parts the recording is divided for the jackknife.
const PARTS: usize = 10;

/// The reading of a sensor with a free tool: `bias + per_gravity * gravity`, gravity in the frame of the sensor or of the body that it is fixed to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tool {
    /// N.
    pub bias: Vector3<f64>,
    /// kg; a multiple of a rotation.
    per_gravity: Matrix3<f64>,
}

impl Tool {
    /// A tool of a mass, kg, on a sensor that is turned as its frame is.
    pub fn of_mass(mass: f64) -> Self {
        Self { bias: Vector3::zeros(), per_gravity: Matrix3::identity() * -mass }
    }

    /// Mass, kg; negative where the sensor reads the force of the object on the tool.
    pub fn mass(&self) -> f64 {
        -self.per_gravity.determinant().cbrt()
    }

    /// A reading without the tool, N.
    pub fn taken_off(&self, reading: Vector3<f64>, gravity: Vector3<f64>) -> Vector3<f64> {
        reading - self.bias - self.per_gravity * gravity
    }
}

/// A tool that was learned, with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearnedTool {
    pub tool: Tool,
    /// Standard deviation of the mass, kg.
    pub mass_sd: f64,
    /// Standard deviation of the bias, N: of its components together.
    pub bias_sd: f64,
    /// The variation of the weight in the frame of the sensor as the tool turns, root mean square, N.
    pub explained: f64,
    /// The residual of the fit, root mean square, N.
    pub residual: f64,
}

/// A learned value is shown with this many standard deviations: it is within them in 95 % of the cases.
pub const DEVIATIONS: f64 = 2.0;

impl fmt::Display for LearnedTool {
    /// Mass and bias, each with its error.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (mass, bias) = (self.tool.mass().abs() * 1e3, self.tool.bias.norm());
        let (mass_error, bias_error) = (DEVIATIONS * self.mass_sd * 1e3, DEVIATIONS * self.bias_sd);
        write!(f, "a tool of {mass:.0} ± {mass_error:.0} g and a bias of {bias:.3} ± {bias_error:.3} N")
    }
}

/// The reason why a log does not show the weight of a tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum UnknownTool {
    /// It has no readings, or no gravity.
    NoReadings,
    /// The direction of gravity in the frame of the sensor scatters by this only, rad.
    HardlyTurns(f64),
    /// The best mass describes this share of the orientations only.
    HardlyFree(f64),
    /// Readings at the beginning and the end differ from the fit by this at least, N.
    EndsDiffer(f64),
    /// The best mass, kg, has this standard deviation, kg.
    Uncertain { mass: f64, mass_sd: f64 },
}

impl LearnedTool {
    fn is_known(&self) -> bool {
        self.mass_sd <= KNOWN_KG.max(KNOWN_SHARE * self.tool.mass().abs()) && self.tool.mass().abs() <= HEAVIEST_KG
    }
}

/// A reading, and gravity, both in the frame of the sensor.
type Sample = (Vector3<f64>, Vector3<f64>);

/// The mounting of a sensor on the frame with known orientations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mounting {
    /// The sensor has the axes of the frame.
    Known,
    /// The rotation of the sensor is unknown.
    Unknown,
}

/// Fits the tool to readings (sensor frame, N) at orientations (reference_from_sensor) under `gravity` (reference frame, m/s²).
///
/// # Errors
/// The tool hardly turns, no one tool describes enough of the log, or the mass is uncertain.
pub fn learned(
    readings: &[Vector3<f64>],
    turns: &[UnitQuaternion<f64>],
    gravity: Vector3<f64>,
    mounting: Mounting,
) -> Result<LearnedTool, UnknownTool> {
    let fit = match mounting {
        Mounting::Known => fit_mass,
        Mounting::Unknown => fit_turned_mass,
    };
    let stride = readings.len().div_ceil(LOOKED_AT).max(1);
    let samples: Vec<Sample> = (readings.iter().zip(turns).step_by(stride))
        .map(|(reading, reference_from_sensor)| (*reading, reference_from_sensor.inverse() * gravity))
        .filter(|(reading, gravity)| reading.iter().chain(gravity.iter()).all(|value| value.is_finite()))
        .collect();
    if samples.is_empty() || gravity.norm() < 1e-9 {
        return Err(UnknownTool::NoReadings);
    }
    let shares = shares(&samples, gravity.norm());
    let turned = spread(&samples, &shares) / gravity.norm();
    if turned < TURNS {
        return Err(UnknownTool::HardlyTurns(turned));
    }
    let (near, within) = near(&samples, &shares, fit).ok_or(UnknownTool::NoReadings)?;
    let described = near.iter().sum::<f64>() / shares.iter().sum::<f64>();
    if described < DESCRIBED {
        return Err(UnknownTool::HardlyFree(described));
    }
    let found = with_uncertainty(&samples, &near, fit).ok_or(UnknownTool::NoReadings)?;
    let off = off_at_ends(&found.tool, &samples);
    if off > within.max(DRIFT) {
        return Err(UnknownTool::EndsDiffer(off));
    }
    let LearnedTool { tool, mass_sd, .. } = found;
    if found.is_known() { Ok(found) } else { Err(UnknownTool::Uncertain { mass: tool.mass(), mass_sd }) }
}

/// Returns the scatter of the directions of gravity about their mean, m/s².
fn spread(samples: &[Sample], weights: &[f64]) -> f64 {
    let whole: f64 = weights.iter().sum();
    let weighted = || samples.iter().zip(weights).map(|((_, gravity), weight)| (gravity, *weight));
    let mean = weighted().map(|(gravity, weight)| gravity * weight).sum::<Vector3<f64>>() / whole;
    (weighted().map(|(gravity, weight)| weight * (gravity - mean).norm_squared()).sum::<f64>() / whole).sqrt()
}

/// The shares of the samples that the robust fit describes, zero for the others, and how far from the fit these samples are at most, N.
fn near(samples: &[Sample], shares: &[f64], fit: Fit) -> Option<(Vec<f64>, f64)> {
    let whole: f64 = shares.iter().sum();
    let mut tool = Tool::of_mass(0.0);
    let mut weights = shares.to_vec();
    for _ in 0..STEPS {
        tool = fit(samples, &weights)?;
        for ((weight, share), sample) in weights.iter_mut().zip(shares).zip(samples) {
            *weight = share / distance(&tool, sample).max(RESOLUTION);
        }
    }
    let mut distances: Vec<(f64, f64)> =
        samples.iter().zip(shares).map(|(sample, share)| (distance(&tool, sample), *share)).collect();
    distances.sort_by(|(one, _), (other, _)| one.total_cmp(other));
    // The quarter of the samples that lie closest are free for certain; what they scatter by is the noise.
    let mut so_far = 0.0;
    let quarter = distances.iter().find(|(_, share)| {
        so_far += share;
        so_far >= whole / 4.0
    });
    let within = WITHIN * quarter?.0.max(RESOLUTION);
    let is_near = |sample: &Sample| distance(&tool, sample) <= within;
    let near = samples.iter().zip(shares).map(|(sample, share)| if is_near(sample) { *share } else { 0.0 }).collect();
    Some((near, within))
}

/// Returns the residual of a fit at the beginning or the end, N: the smaller one of the two medians.
fn off_at_ends(tool: &Tool, samples: &[Sample]) -> f64 {
    let count = ((samples.len() as f64 * END) as usize).max(1);
    let median = |samples: &[Sample]| {
        let mut distances: Vec<f64> = samples.iter().map(|sample| distance(tool, sample)).collect();
        distances.sort_by(f64::total_cmp);
        distances.get(distances.len() / 2).copied().unwrap_or_default()
    };
    let [first, last] = [samples.get(..count), samples.get(samples.len().saturating_sub(count)..)];
    median(first.unwrap_or_default()).min(median(last.unwrap_or_default()))
}

/// The tool that fits samples with these weights, whose sum is the number of orientations.
fn with_uncertainty(samples: &[Sample], weights: &[f64], fit: Fit) -> Option<LearnedTool> {
    let tool = fit(samples, weights)?;
    let orientations: f64 = weights.iter().sum();
    let square: f64 =
        samples.iter().zip(weights).map(|(sample, weight)| weight * distance(&tool, sample).powi(2)).sum();
    let spread = spread(samples, weights);
    let mean: Vector3<f64> = samples.iter().zip(weights).map(|((_, gravity), weight)| gravity * *weight).sum();
    // Least squares; three components for each orientation, and four unknowns.
    let variance = square / (3.0 * orientations - 4.0).max(1.0);
    let of_mass = variance / (orientations * spread.powi(2));
    let of_bias = 3.0 * variance / orientations + of_mass * (mean / orientations).norm_squared();
    let known = LearnedTool {
        tool,
        mass_sd: f64::INFINITY,
        bias_sd: f64::INFINITY,
        explained: tool.mass().abs() * spread,
        residual: (square / orientations).sqrt(),
    };
    let part = samples.len().div_ceil(PARTS).max(1);
    let without = |left_out: usize| {
        let weights: Vec<f64> =
            (0..).zip(weights).map(|(at, weight)| if at / part == left_out { 0.0 } else { *weight }).collect();
        fit(samples, &weights)
    };
    // If the tool turns only in one part of the recording, the quality of the fit is unknown.
    let Some(tools) = (0..PARTS).map(without).collect::<Option<Vec<Tool>>>() else { return Some(known) };
    let count = tools.len() as f64;
    let mean_mass = tools.iter().map(Tool::mass).sum::<f64>() / count;
    let mean_bias = tools.iter().map(|tool| tool.bias).sum::<Vector3<f64>>() / count;
    let jackknife = |squares: f64| squares * (count - 1.0) / count;
    let mass_differs = jackknife(tools.iter().map(|tool| (tool.mass() - mean_mass).powi(2)).sum());
    let bias_differs = jackknife(tools.iter().map(|tool| (tool.bias - mean_bias).norm_squared()).sum());
    Some(LearnedTool { mass_sd: mass_differs.max(of_mass).sqrt(), bias_sd: bias_differs.max(of_bias).sqrt(), ..known })
}

/// Returns the weight of each sample: all samples with the same orientation together count as one.
fn shares(samples: &[Sample], gravity: f64) -> Vec<f64> {
    let cell = |(_, direction): &Sample| {
        let [x, y, z] = [direction.x, direction.y, direction.z].map(|part| (part / gravity / ALIKE).round() as i64);
        (x, y, z)
    };
    let mut counts: BTreeMap<(i64, i64, i64), usize> = BTreeMap::new();
    for sample in samples {
        *counts.entry(cell(sample)).or_default() += 1;
    }
    samples.iter().map(|sample| 1.0 / counts.get(&cell(sample)).copied().unwrap_or(1) as f64).collect()
}

fn distance(tool: &Tool, (reading, gravity_in_sensor): &Sample) -> f64 {
    tool.taken_off(*reading, *gravity_in_sensor).norm()
}

/// Fits a tool to weighted samples.
type Fit = fn(&[Sample], &[f64]) -> Option<Tool>;

/// Weighted least squares of bias and mass.
fn fit_mass(samples: &[Sample], weights: &[f64]) -> Option<Tool> {
    let (mut left, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for ((reading, gravity), weight) in samples.iter().zip(weights) {
        let mut rows = Matrix3x4::identity();
        rows.set_column(3, &-gravity);
        left += rows.transpose() * rows * *weight;
        right += rows.transpose() * reading * *weight;
    }
    let found = left.cholesky()?.solve(&right);
    Some(Tool { bias: found.xyz(), ..Tool::of_mass(found.w) })
}

/// Like the above, with an unknown rotation between sensor and frame (Umeyama 1991).
fn fit_turned_mass(samples: &[Sample], weights: &[f64]) -> Option<Tool> {
    let whole: f64 = weights.iter().sum();
    let (mut reading_mean, mut gravity_mean) = (Vector3::zeros(), Vector3::zeros());
    for ((reading, gravity), weight) in samples.iter().zip(weights) {
        reading_mean += reading * (*weight / whole);
        gravity_mean += gravity * (*weight / whole);
    }
    let (mut product, mut square) = (Matrix3::zeros(), 0.0);
    for ((reading, gravity), weight) in samples.iter().zip(weights) {
        let gravity = gravity - gravity_mean;
        product += (reading - reading_mean) * gravity.transpose() * *weight;
        square += gravity.norm_squared() * *weight;
    }
    let parts = product.svd(true, true);
    let (mut u, v_t) = (parts.u?, parts.v_t?);
    // A tool that turns about one axis leaves the sign along that axis open; it is chosen so that the mass is positive.
    let least = parts.singular_values.imin();
    if parts.singular_values.min() < ONE_AXIS * parts.singular_values.max() && (u * v_t).determinant() > 0.0 {
        u.column_mut(least).neg_mut();
    }
    let turn = u * v_t;
    let per_gravity = turn * (parts.singular_values.sum() / square);
    let is_found = per_gravity.iter().all(|value| value.is_finite());
    is_found.then(|| Tool { bias: reading_mean - per_gravity * gravity_mean, per_gravity })
}
