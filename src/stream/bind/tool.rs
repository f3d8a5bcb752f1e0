//! The weight of a tool and the bias of its force sensor, from a log in which the tool turns.
//!
//! While nothing is touched, a sensor reads `bias - mass * sensor_from_reference * gravity` (the force on the object, sensor frame). Both are fitted
//! to all samples with weights that fall with the distance from the fit, so that contacts, which are a minority, count little.

use nalgebra::{Matrix3x4, Matrix4, UnitQuaternion, Vector3, Vector4};

/// How many samples are looked at.
const LOOKED_AT: usize = 4000;
/// Steps of the fit; it is settled long before.
const STEPS: usize = 50;
/// The least standard deviation of the direction of gravity in the sensor frame: below it, weight and bias cannot be told apart.
const TURNS: f64 = 0.1;
/// The heaviest tool, kg.
const HEAVIEST_KG: f64 = 100.0;
/// The least share of samples that the fit has to describe within `WITHIN` times the median distance.
const DESCRIBED: f64 = 0.4;
const WITHIN: f64 = 4.0;
/// A distance below which samples count alike, N: the resolution of a good sensor.
const RESOLUTION: f64 = 0.02;

/// What a tool weighs, and what its sensor reads without it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tool {
    /// Mass, kg.
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
    let count = samples.len() as f64;
    let mean = samples.iter().map(|(_, gravity)| gravity).sum::<Vector3<f64>>() / count;
    let spread = samples.iter().map(|(_, gravity)| (gravity - mean).norm_squared()).sum::<f64>() / count;
    if samples.is_empty() || spread.sqrt() < TURNS * gravity.norm() || gravity.norm() < 1e-9 {
        return None;
    }
    let mut tool = Tool { mass: 0.0, bias: Vector3::zeros() };
    let mut weights = vec![1.0; samples.len()];
    for _ in 0..STEPS {
        tool = fit(&samples, &weights)?;
        for (weight, sample) in weights.iter_mut().zip(&samples) {
            *weight = 1.0 / distance(&tool, sample).max(RESOLUTION);
        }
    }
    let mut distances: Vec<f64> = samples.iter().map(|sample| distance(&tool, sample)).collect();
    distances.sort_by(f64::total_cmp);
    // The quarter of the samples that lie closest are free for certain; what they scatter by is the noise.
    let noise = distances.get(distances.len() / 4).copied()?.max(RESOLUTION);
    let near: Vec<f64> =
        samples.iter().map(|sample| f64::from(u8::from(distance(&tool, sample) <= WITHIN * noise))).collect();
    let described = near.iter().sum::<f64>() / count;
    tool = fit(&samples, &near)?;
    (described >= DESCRIBED && (0.0..=HEAVIEST_KG).contains(&tool.mass)).then_some(tool)
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
