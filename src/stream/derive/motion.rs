//! Motion of bodies: poses from the log or from the scene, velocities from the log or differentiated.
//!
//! The velocity at a frame is the slope of the least-squares line through the samples within [`HALF_WINDOW_SECS`] before and after it
//! (at least one on each side, at most [`SAMPLES_A_SIDE`], evenly picked; fewer at the ends of a stretch). For rotations the line runs through the
//! rotation vectors relative to the frame. It has no delay, and takes noise of σ on each of `2m + 1` samples a step `h` apart
//! down to `σ / (h √(m(m+1)(2m+1)/3))`.

use crate::base::scene::Body as SceneBody;
use crate::stream::geometry::{pose, unit};
use crate::stream::measured::Measured;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use std::borrow::Cow;
use std::ops::Range;

/// Half the window of differentiation, s.
pub const HALF_WINDOW_SECS: f64 = 0.050;
/// The most samples on each side of a frame.
pub const SAMPLES_A_SIDE: usize = 10;

/// Three columns x y z.
pub type Columns3<'a> = [Cow<'a, [f64]>; 3];

/// A body over the whole log.
pub struct Motion<'a> {
    position: Option<[&'a [f64]; 3]>,
    rotation: Option<[&'a [f64]; 4]>,
    at_start: Isometry3<f64>,
    velocity: Option<Columns3<'a>>,
    angular_velocity: Option<Columns3<'a>>,
}

impl<'a> Motion<'a> {
    /// The motion of the body with this name. A body without a position in the log stays where the scene puts it.
    pub fn new(measured: &'a Measured, name: &str, body: &SceneBody) -> Self {
        let position = measured.vec3(&format!("{name}.position"));
        let rotation = measured.rotation(&format!("{name}.rotation"));
        let borrowed =
            |channel: &str| measured.vec3(&format!("{name}.{channel}")).map(|columns| columns.map(Cow::Borrowed));
        let velocity =
            borrowed("velocity").or_else(|| position.map(|position| slopes(measured, position).map(Cow::Owned)));
        let angular_velocity = borrowed("angular_velocity")
            .or_else(|| rotation.map(|rotation| turn_rates(measured, rotation).map(Cow::Owned)));
        let at_start = pose(body.position.map(|length| length.0), body.rotation);
        Self { position, rotation, at_start, velocity, angular_velocity }
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

/// A vector at each frame, as three columns.
pub fn columns(measured: &Measured, value: impl Fn(usize) -> Vector3<f64>) -> [Vec<f64>; 3] {
    let rows: Vec<Vector3<f64>> = (0..measured.len()).map(value).collect();
    [0, 1, 2].map(|axis| rows.iter().map(|row| row[axis]).collect())
}

/// The slope of each column at each frame, in its unit per second.
pub fn slopes(measured: &Measured, columns: [&[f64]; 3]) -> [Vec<f64>; 3] {
    columns.map(|column| slope(measured, |frame| column.get(frame).copied().unwrap_or_default()))
}

/// The slope of a quantity at each frame, per second.
pub fn slope(measured: &Measured, value: impl Fn(usize) -> f64) -> Vec<f64> {
    over_windows(measured, |frame, window| {
        // Values relative to the frame, so that what does not change has a slope of exactly zero.
        let here = value(frame);
        line_slope(window.map(|other| (measured.time.get(other), value(other) - here)), frame_time(measured, frame))
    })
}

/// Angular velocity in the reference frame at each frame, rad/s.
fn turn_rates(measured: &Measured, rotation: [&[f64]; 4]) -> [Vec<f64>; 3] {
    let rates: Vec<Vector3<f64>> = over_windows(measured, |frame, window| {
        let here = quaternion(&rotation, frame).inverse();
        let turned: Vec<(usize, Vector3<f64>)> =
            window.map(|other| (other, (quaternion(&rotation, other) * here).scaled_axis())).collect();
        let now = frame_time(measured, frame);
        let along =
            |axis: usize| line_slope(turned.iter().map(|(other, turn)| (measured.time.get(*other), turn[axis])), now);
        Vector3::new(along(0), along(1), along(2))
    });
    columns(measured, |frame| rates.get(frame).copied().unwrap_or_default())
}

fn frame_time(measured: &Measured, frame: usize) -> f64 {
    measured.time.get(frame).copied().unwrap_or_default()
}

/// Computes a value at each frame from the frames of the window around it, within its stretch.
fn over_windows<T>(measured: &Measured, value: impl Fn(usize, Window) -> T) -> Vec<T> {
    let reach = ((HALF_WINDOW_SECS * measured.rate_hz).round() as usize).max(1);
    let stride = reach.div_ceil(SAMPLES_A_SIDE);
    let mut values = Vec::with_capacity(measured.len());
    for stretch in &measured.stretches {
        values.extend(stretch.clone().map(|frame| value(frame, window(frame, reach, stride, stretch))));
    }
    values
}

/// Frames around one: every `stride`-th, it among them.
type Window = std::iter::StepBy<Range<usize>>;

fn window(frame: usize, reach: usize, stride: usize, stretch: &Range<usize>) -> Window {
    let before = (frame - stretch.start).min(reach) / stride * stride;
    let end = (frame + reach + 1).min(stretch.end);
    (frame - before..end).step_by(stride)
}

/// The slope of the least-squares line through points of time and value; 0 for a single point.
fn line_slope<'t>(points: impl Iterator<Item = (Option<&'t f64>, f64)>, now: f64) -> f64 {
    let (mut n, mut t, mut x, mut tt, mut tx) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (time, value) in points {
        // Times relative to the frame keep the sums small.
        let time = time.map_or(0.0, |time| time - now);
        n += 1.0;
        t += time;
        x += value;
        tt += time * time;
        tx += time * value;
    }
    let spread = n * tt - t * t;
    if spread > 0.0 { (n * tx - t * x) / spread } else { 0.0 }
}
