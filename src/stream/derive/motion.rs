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

/// Sums are taken from every so many frames of a stretch on.
pub const ANCHOR: usize = 128;

/// How many frames before and after a frame have a part in what is derived of it, at most; a multiple of [`ANCHOR`].
pub fn looked_at(rate_hz: f64) -> usize {
    let reach = (TREMOR_SECS * rate_hz / 2.0).round() as usize;
    (2 * reach + 2).next_multiple_of(ANCHOR)
}

/// Three columns x y z.
pub type Columns3<'a> = [Cow<'a, [f64]>; 3];

/// A body over the whole log.
pub struct Motion<'a> {
    position: Option<[&'a [f64]; 3]>,
    rotation: Option<[&'a [f64]; 4]>,
    at_start: Isometry3<f64>,
    /// reference_from_body at each frame, of a body that moves.
    poses: Vec<Isometry3<f64>>,
    velocity: Option<[Vec<f64>; 3]>,
    angular_velocity: Option<[Vec<f64>; 3]>,
}

impl<'a> Motion<'a> {
    /// The motion of the body with this name. A body without a position in the log stays where the scene puts it.
    pub fn new(measured: &'a Measured, name: &str, body: &SceneBody) -> Self {
        let mut poses = Self::of_poses(measured, name, body);
        let (position, rotation) = (poses.position, poses.rotation);
        if position.is_some() || rotation.is_some() {
            poses.poses = (0..measured.len()).map(|frame| poses.pose_at(frame)).collect();
        }
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
            poses: vec![],
            velocity: None,
            angular_velocity: None,
        }
    }

    /// reference_from_body at a frame.
    #[inline]
    pub fn pose(&self, frame: usize) -> Isometry3<f64> {
        self.poses.get(frame).copied().unwrap_or_else(|| self.pose_at(frame))
    }

    fn pose_at(&self, frame: usize) -> Isometry3<f64> {
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
#[inline]
pub fn vector<C: AsRef<[f64]>>([x, y, z]: &[C; 3], frame: usize) -> Vector3<f64> {
    Vector3::new(at(x.as_ref(), frame), at(y.as_ref(), frame), at(z.as_ref(), frame))
}

#[inline]
fn quaternion([w, x, y, z]: &[&[f64]; 4], frame: usize) -> UnitQuaternion<f64> {
    unit([at(w, frame), at(x, frame), at(y, frame), at(z, frame)])
}

#[inline]
fn at(column: &[f64], frame: usize) -> f64 {
    column.get(frame).copied().unwrap_or_default()
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
    // Sums begin anew every so many values, so that neither their errors grow nor a part of a log is averaged otherwise than the whole.
    let mut sums = Vec::with_capacity(values.len() + 1);
    let mut totals = Vec::with_capacity(values.len() / ANCHOR + 1);
    for group in values.chunks(ANCHOR) {
        let mut sum = 0.0;
        for value in group {
            sums.push(sum);
            sum += value;
        }
        totals.push(sum);
    }
    sums.push(if values.len().is_multiple_of(ANCHOR) { 0.0 } else { totals.last().copied().unwrap_or_default() });
    let at = |list: &[f64], index: usize| list.get(index).copied().unwrap_or_default();
    let mean = |index: usize| {
        let (from, to) = (index.saturating_sub(reach), (index + reach + 1).min(values.len()));
        let (first, last) = (from / ANCHOR, to / ANCHOR);
        let between = match last - first {
            0 => -at(&sums, from),
            1 => at(&totals, first) - at(&sums, from),
            _ => (first + 1..last).fold(at(&totals, first) - at(&sums, from), |sum, group| sum + at(&totals, group)),
        };
        (between + at(&sums, to)) / (to - from) as f64
    };
    (0..values.len()).map(mean).collect()
}
