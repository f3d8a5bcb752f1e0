//! The weight of a tool and the bias of its force sensor, from a log in which the tool turns.
//!
//! While nothing is touched, a sensor reads `bias - mass * sensor_from_reference * gravity` (the force on the object, sensor frame). Both are fitted
//! to all samples with weights that fall with the distance from the fit, so that contacts count little. All samples in which the sensor is turned alike
//! count as one: a tool stays as it is while it works, for however long.

use nalgebra::{Matrix3x4, Matrix4, UnitQuaternion, Vector3, Vector4};
use std::collections::BTreeMap;

/// How many samples are looked at.
const LOOKED_AT: usize = 4000;
/// Steps of the fit; it is settled long before.
const STEPS: usize = 50;
/// The least standard deviation of the direction of gravity in the sensor frame: below it, weight and bias cannot be told apart.
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

/// What a tool weighs, and what its sensor reads without it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tool {
    /// Mass, kg; negative where the sensor reads the force of the object on the tool.
    pub mass: f64,
    /// Bias, sensor frame, N.
    pub bias: Vector3<f64>,
}

/// Fits the tool to readings (sensor frame, N) at orientations (reference_from_sensor) under `gravity` (reference frame, m/s²).
/// `None` where the tool hardly turns, or where no one tool describes enough of the log.
pub fn learned(readings: &[Vector3<f64>], turns: &[UnitQuaternion<f64>], gravity: Vector3<f64>) -> Option<Tool> {
    let stride = readings.len().div_ceil(LOOKED_AT).max(1);
    let samples: Vec<(Vector3<f64>, Vector3<f64>)> = (readings.iter().zip(turns).step_by(stride))
        .map(|(reading, reference_from_sensor)| (*reading, reference_from_sensor.inverse() * gravity))
        .filter(|(reading, gravity)| reading.iter().chain(gravity.iter()).all(|value| value.is_finite()))
        .collect();
    if samples.is_empty() || gravity.norm() < 1e-9 {
        return None;
    }
    let shares = shares(&samples, gravity.norm());
    let whole: f64 = shares.iter().sum();
    let weighted = || samples.iter().zip(&shares).map(|((_, gravity), share)| (gravity, *share));
    let mean = weighted().map(|(gravity, share)| gravity * share).sum::<Vector3<f64>>() / whole;
    let spread = weighted().map(|(gravity, share)| share * (gravity - mean).norm_squared()).sum::<f64>() / whole;
    if spread.sqrt() < TURNS * gravity.norm() {
        return None;
    }
    let mut tool = Tool { mass: 0.0, bias: Vector3::zeros() };
    let mut weights = shares.clone();
    for _ in 0..STEPS {
        tool = fit(&samples, &weights)?;
        for ((weight, share), sample) in weights.iter_mut().zip(&shares).zip(&samples) {
            *weight = share / distance(&tool, sample).max(RESOLUTION);
        }
    }
    let mut distances: Vec<(f64, f64)> =
        samples.iter().zip(&shares).map(|(sample, share)| (distance(&tool, sample), *share)).collect();
    distances.sort_by(|(one, _), (other, _)| one.total_cmp(other));
    // The quarter of the samples that lie closest are free for certain; what they scatter by is the noise.
    let mut so_far = 0.0;
    let quarter = distances.iter().find(|(_, share)| {
        so_far += share;
        so_far >= whole / 4.0
    });
    let noise = quarter?.0.max(RESOLUTION);
    let near = samples.iter().zip(&shares).map(
        |(sample, share)| {
            if distance(&tool, sample) <= WITHIN * noise { *share } else { 0.0 }
        },
    );
    let near: Vec<f64> = near.collect();
    let described = near.iter().sum::<f64>() / whole;
    tool = fit(&samples, &near)?;
    (described >= DESCRIBED && tool.mass.abs() <= HEAVIEST_KG).then_some(tool)
}

/// How much each sample counts: all that are turned alike together as one.
fn shares(samples: &[(Vector3<f64>, Vector3<f64>)], gravity: f64) -> Vec<f64> {
    let cell = |(_, direction): &(Vector3<f64>, Vector3<f64>)| {
        let [x, y, z] = [direction.x, direction.y, direction.z].map(|part| (part / gravity / ALIKE).round() as i64);
        (x, y, z)
    };
    let mut counts: BTreeMap<(i64, i64, i64), usize> = BTreeMap::new();
    for sample in samples {
        *counts.entry(cell(sample)).or_default() += 1;
    }
    samples.iter().map(|sample| 1.0 / counts.get(&cell(sample)).copied().unwrap_or(1) as f64).collect()
}

fn distance(tool: &Tool, (reading, gravity_in_sensor): &(Vector3<f64>, Vector3<f64>)) -> f64 {
    (reading - tool.bias + gravity_in_sensor * tool.mass).norm()
}

/// Weighted least squares.
fn fit(samples: &[(Vector3<f64>, Vector3<f64>)], weights: &[f64]) -> Option<Tool> {
    let (mut left, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for ((reading, gravity_in_sensor), weight) in samples.iter().zip(weights) {
        let mut rows = Matrix3x4::identity();
        rows.set_column(3, &-gravity_in_sensor);
        left += rows.transpose() * rows * *weight;
        right += rows.transpose() * reading * *weight;
    }
    let found = left.cholesky()?.solve(&right);
    Some(Tool { mass: found.w, bias: found.xyz() })
}
