//! Motion of bodies: poses from the log or from the scene, velocities from the log or differentiated, all without the tremor of a hand.
//!
//! A hand trembles at 8 to 12 Hz with up to a millimetre, and what it holds moves with 60 mm/s without going anywhere. So each velocity is
//! averaged over [`TREMOR_SECS`] around the frame, twice: the weights are a triangle of twice that width, the delay is none, and what is left
//! of a tremor is at most a twentieth. An average of a differentiated position is the way from the mean place before to the mean place after.

use crate::base::geometry::{pose, unit};
use crate::base::scene::Body as SceneBody;
use crate::stream::measured::Measured;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use std::borrow::Cow;

/// Width of each of the two averages, s: the longest period of a tremor.
pub const TREMOR_SECS: f64 = 0.125;

/// Three columns x y z.
pub type Columns3<'a> = [Cow<'a, [f64]>; 3];

/// A body over the whole log.
pub struct Motion<'a> {
    position: Option<[&'a [f64]; 3]>,
    rotation: Option<[&'a [f64]; 4]>,
    at_start: Isometry3<f64>,
    velocity: Option<[Vec<f64>; 3]>,
    angular_velocity: Option<[Vec<f64>; 3]>,
}

impl<'a> Motion<'a> {
    /// The motion of the body with this name. A body without a position in the log stays where the scene puts it.
    pub fn new(measured: &'a Measured, name: &str, body: &SceneBody) -> Self {
        let poses = Self::of_poses(measured, name, body);
        let (position, rotation) = (poses.position, poses.rotation);
        let logged = |channel: &str| {
            let columns = measured.vec3(&format!("{name}.{channel}"));
            columns.map(|columns| columns.map(|column| steady(measured, column)))
        };
        let velocity = logged("velocity").or_else(|| position.map(|position| slopes(measured, position)));
        let angular_velocity =
            logged("angular_velocity").or_else(|| rotation.map(|rotation| turn_rates(measured, rotation)));
        Self { velocity, angular_velocity, ..poses }
    }

    /// The poses alone: nothing is known of velocities.
    pub fn of_poses(measured: &'a Measured, name: &str, body: &SceneBody) -> Self {
        Self {
            position: measured.vec3(&format!("{name}.position")),
            rotation: measured.rotation(&format!("{name}.rotation")),
            at_start: pose(body.position.map(|length| length.0), body.rotation),
            velocity: None,
            angular_velocity: None,
        }
    }

    /// reference_from_body at a frame.
    pub fn pose(&self, frame: usize) -> Isometry3<f64> {
        let position = self.position.map_or(self.at_start.translation.vector, |columns| vector(&columns, frame));
        let rotation = self.rotation.map_or(self.at_start.rotation, |columns| quaternion(&columns, frame));
        Isometry3::from_parts(position.into(), rotation)
    }

    /// Velocity of the body's origin, reference frame, m/s.
    pub fn velocity(&self, frame: usize) -> Vector3<f64> {
        self.velocity.as_ref().map_or_else(Vector3::zeros, |columns| vector(columns, frame))
    }

    /// Acceleration of the body with this name from sample to sample, tremor and all, reference frame, m/s².
    pub fn acceleration(&self, measured: &Measured, name: &str) -> [Vec<f64>; 3] {
        let rates = |column: &[f64]| {
            let value = |frame: usize| column.get(frame).copied().unwrap_or_default();
            differences(measured, |before, after| value(after) - value(before))
        };
        let logged = measured.vec3(&format!("{name}.velocity"));
        let velocity = logged.map(|columns| columns.map(<[f64]>::to_vec)).or_else(|| Some(self.position?.map(rates)));
        velocity.map_or_else(|| [(); 3].map(|()| vec![0.0; measured.len()]), |columns| columns.map(|it| rates(&it)))
    }

    /// Angular velocity, reference frame, rad/s.
    pub fn angular_velocity(&self, frame: usize) -> Vector3<f64> {
        self.angular_velocity.as_ref().map_or_else(Vector3::zeros, |columns| vector(columns, frame))
    }
}

/// The vector at a frame.
pub fn vector<C: AsRef<[f64]>>(columns: &[C; 3], frame: usize) -> Vector3<f64> {
    let [x, y, z] = columns.each_ref().map(|column| column.as_ref().get(frame).copied().unwrap_or_default());
    Vector3::new(x, y, z)
}

fn quaternion(columns: &[&[f64]; 4], frame: usize) -> UnitQuaternion<f64> {
    unit(columns.map(|column| column.get(frame).copied().unwrap_or_default()))
}

/// The slope of each column at each frame, in its unit per second, without tremor.
pub fn slopes(measured: &Measured, columns: [&[f64]; 3]) -> [Vec<f64>; 3] {
    columns.map(|column| slope(measured, |frame| column.get(frame).copied().unwrap_or_default()))
}

/// The slope of a quantity at each frame, per second, without tremor.
pub fn slope(measured: &Measured, value: impl Fn(usize) -> f64) -> Vec<f64> {
    steady(measured, &differences(measured, |before, after| value(after) - value(before)))
}

/// Angular velocity in the reference frame at each frame, rad/s, without tremor.
fn turn_rates(measured: &Measured, rotation: [&[f64]; 4]) -> [Vec<f64>; 3] {
    let turned = |before: usize, after: usize| {
        (quaternion(&rotation, after) * quaternion(&rotation, before).inverse()).scaled_axis()
    };
    let rates = differences(measured, turned);
    [0, 1, 2].map(|axis| steady(measured, &rates.iter().map(|rate| rate[axis]).collect::<Vec<f64>>()))
}

/// What changes from the frame before to the frame after, per second; at the ends of a stretch to or from the frame itself.
fn differences<T>(measured: &Measured, change: impl Fn(usize, usize) -> T) -> Vec<T>
where
    T: Default + std::ops::Div<f64, Output = T>,
{
    let mut rates = Vec::with_capacity(measured.len());
    for stretch in &measured.stretches {
        for frame in stretch.clone() {
            let (before, after) = (frame.saturating_sub(1).max(stretch.start), (frame + 1).min(stretch.end - 1));
            let time = |frame: usize| measured.time.get(frame).copied().unwrap_or_default();
            let seconds = time(after) - time(before);
            rates.push(if seconds > 0.0 { change(before, after) / seconds } else { T::default() });
        }
    }
    rates
}

/// Takes the tremor out of a column, stretch by stretch.
pub fn steady(measured: &Measured, column: &[f64]) -> Vec<f64> {
    let reach = (TREMOR_SECS * measured.rate_hz / 2.0).round() as usize;
    averaged(measured, &averaged(measured, column, reach), reach)
}

/// The mean of what lies at most `reach` frames before and after each, within its stretch.
pub fn averaged(measured: &Measured, column: &[f64], reach: usize) -> Vec<f64> {
    if reach == 0 {
        return column.to_vec();
    }
    let stretches = measured.stretches.iter();
    stretches.flat_map(|stretch| average(column.get(stretch.clone()).unwrap_or_default(), reach)).collect()
}

/// The mean of what lies at most `reach` before and after each value; of fewer values at the ends.
fn average(values: &[f64], reach: usize) -> Vec<f64> {
    let mut sums = Vec::with_capacity(values.len() + 1);
    sums.push(0.0);
    sums.extend(values.iter().scan(0.0, |sum, value| {
        *sum += value;
        Some(*sum)
    }));
    let mean = |index: usize| {
        let (from, to) = (index.saturating_sub(reach), (index + reach + 1).min(values.len()));
        match (sums.get(from), sums.get(to)) {
            (Some(before), Some(after)) => (after - before) / (to - from) as f64,
            _ => 0.0,
        }
    };
    (0..values.len()).map(mean).collect()
}
