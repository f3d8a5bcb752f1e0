//! Motion of bodies: poses from the log or from the scene, velocities from the log or differentiated, all without the tremor of a hand.
//!
//! A hand trembles at 8 to 12 Hz with up to a millimeter, and what it holds moves with 60 mm/s without going anywhere. So each velocity is
//! averaged over [`TREMOR_SECS`] around the frame, twice: the weights are a triangle of twice that width, the delay is none, and what is left
//! of a tremor is at most a twentieth. An average of a differentiated position is the way from the mean place before to the mean place after.

use super::source::Source;
use crate::clean::preprocess::CleanLog;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use std::array;
use std::borrow::Cow;
use teachtree_base::geometry::{pose, unit};
use teachtree_base::scene::Body as SceneBody;

/// Width of each of the two averages, s: the longest period of a tremor.
pub const TREMOR_SECS: f64 = 0.125;

/// Sums restart after this number of frames of a stretch.
pub const ANCHOR: usize = 128;

/// Returns the maximum number of frames before and after a frame on which its derived values depend; a multiple of [`ANCHOR`].
pub fn padding(rate_hz: f64) -> usize {
    ahead(rate_hz).next_multiple_of(ANCHOR)
}

/// Returns the maximum number of later frames on which the derived values of a frame depend.
pub fn ahead(rate_hz: f64) -> usize {
    let reach = (TREMOR_SECS * rate_hz / 2.0).round() as usize;
    2 * reach + 2
}

/// The rate at which slow quantities are evaluated, Hz.
const LOOKS: f64 = 25.0;

/// Every how many frames that is: a power of two, so that windows of a log have the same ones.
pub fn every(measured: &CleanLog) -> usize {
    let most = (measured.rate_hz / LOOKS).clamp(1.0, ANCHOR as f64) as usize;
    if most.is_power_of_two() { most } else { most.next_power_of_two() / 2 }
}

/// Returns the frames at which checks of a whole log sample it. They are the same if the log is read in windows.
pub fn sampled(measured: &CleanLog) -> Vec<usize> {
    let step = every(measured);
    match &measured.window {
        Some(window) => window.core.clone().step_by(step).collect(),
        None => measured.stretches.iter().flat_map(|stretch| stretch.clone().step_by(step)).collect(),
    }
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

/// The motion of an object whose pose is known only while it is held.
pub struct HeldPath {
    /// Reference frame, m.
    pub position: [Vec<f64>; 3],
    /// Reference frame, m/s; zero while nothing holds the object.
    pub velocity: [Vec<f64>; 3],
}

/// The motion of a body between two frames.
pub struct Displacement {
    /// The displacement of its origin, m.
    pub by: f64,
    /// At most by how much it has turned, rad.
    pub turned: f64,
}

impl<'a> Motion<'a> {
    /// The motion of the body with this name. A body without a position in the log stays where the scene puts it.
    pub fn new(measured: &'a CleanLog, name: &str, body: &SceneBody) -> Self {
        let mut poses = Self::of_poses(measured, name, body);
        let (position, rotation) = (poses.position, poses.rotation);
        if position.is_some() || rotation.is_some() {
            poses.poses = (0..measured.len()).map(|frame| poses.pose_at(frame)).collect();
        }
        let logged = |channel: &str| {
            let columns = measured.vec3(&format!("{name}.{channel}"));
            columns.map(|columns| columns.map(|column| smoothed(measured, column)))
        };
        let noise = measured.positions.get(name).map_or(0.0, |noise| noise.limit);
        let velocity = logged("velocity").or_else(|| position.map(|position| above(slopes(measured, position), noise)));
        let angular_velocity =
            logged("angular_velocity").or_else(|| rotation.map(|rotation| turn_rates(measured, rotation)));
        Self { velocity, angular_velocity, ..poses }
    }

    /// Returns the body on another path.
    pub fn along(self, path: &'a HeldPath) -> Self {
        let position = Some(path.position.each_ref().map(Vec::as_slice));
        let moved = Self { position, velocity: Some(path.velocity.clone()), ..self };
        let frames = path.position.first().map_or(0, Vec::len);
        Self { poses: (0..frames).map(|frame| moved.pose_at(frame)).collect(), ..moved }
    }

    /// The poses alone: nothing is known of velocities.
    pub fn of_poses(measured: &'a CleanLog, name: &str, body: &SceneBody) -> Self {
        Self {
            position: measured.vec3(&format!("{name}.position")),
            rotation: measured.rotation(&format!("{name}.rotation")),
            at_start: pose(body.position.map(|length| length.0), body.rotation),
            poses: vec![],
            velocity: None,
            angular_velocity: None,
        }
    }

    /// Whether the log has the rotation of the body.
    pub const fn has_rotation(&self) -> bool {
        self.rotation.is_some()
    }

    /// reference_from_body at a frame.
    #[inline]
    pub fn pose(&self, frame: usize) -> Isometry3<f64> {
        self.poses.get(frame).copied().unwrap_or_else(|| self.pose_at(frame))
    }

    pub fn pose_at(&self, frame: usize) -> Isometry3<f64> {
        let rotation = self.rotation.map_or(self.at_start.rotation, |columns| quaternion(&columns, frame));
        Isometry3::from_parts(self.position(frame).into(), rotation)
    }

    /// Where the body's origin is, reference frame, m.
    #[inline]
    pub fn position(&self, frame: usize) -> Vector3<f64> {
        self.position.map_or(self.at_start.translation.vector, |columns| vector(&columns, frame))
    }

    /// Returns the motion of the body from one frame to another.
    pub fn moved(&self, from: usize, to: usize) -> Displacement {
        if self.poses.is_empty() {
            return Displacement { by: 0.0, turned: 0.0 };
        }
        let (before, after) = (self.pose(from), self.pose(to));
        let apart = (after.rotation.coords - before.rotation.coords).norm();
        // The difference of unit quaternions is twice the sine of a quarter of the angle, which is at least a third of the angle.
        Displacement { by: (after.translation.vector - before.translation.vector).norm(), turned: 3.0 * apart }
    }

    /// Where the body's origin is, reference frame, m.
    pub fn positions(&self) -> Source<'_, 3> {
        self.position.as_ref().map_or_else(|| Source::Same(self.at_start.translation.vector.into()), Source::from)
    }

    /// Velocity of the body's origin, reference frame, m/s.
    pub fn velocities(&self) -> Source<'_, 3> {
        self.velocity.as_ref().map_or(Source::ZERO, Source::from)
    }

    /// Angular velocity, reference frame, rad/s.
    pub fn angular_velocities(&self) -> Source<'_, 3> {
        self.angular_velocity.as_ref().map_or(Source::ZERO, Source::from)
    }

    /// Velocity of the body's origin, reference frame, m/s.
    pub fn velocity(&self, frame: usize) -> Vector3<f64> {
        self.velocity.as_ref().map_or_else(Vector3::zeros, |columns| vector(columns, frame))
    }

    /// Acceleration of the body with this name from sample to sample, tremor and all, reference frame, m/s².
    pub fn acceleration(&self, measured: &CleanLog, name: &str) -> [Vec<f64>; 3] {
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
pub fn quaternion([w, x, y, z]: &[&[f64]; 4], frame: usize) -> UnitQuaternion<f64> {
    unit([at(w, frame), at(x, frame), at(y, frame), at(z, frame)])
}

#[inline]
fn at(column: &[f64], frame: usize) -> f64 {
    column.get(frame).copied().unwrap_or_default()
}

/// The slope of each column at each frame, in its unit per second, without tremor.
pub fn slopes(measured: &CleanLog, columns: [&[f64]; 3]) -> [Vec<f64>; 3] {
    columns.map(|column| slope(measured, column))
}

/// The slope of a column at each frame, in its unit per second, without tremor.
pub fn slope(measured: &CleanLog, column: &[f64]) -> Vec<f64> {
    smoothed(measured, &differences(measured, |before, after| at(column, after) - at(column, before)))
}

/// Vectors that are not longer than `least` are zero.
fn above(mut columns: [Vec<f64>; 3], least: f64) -> [Vec<f64>; 3] {
    if least > 0.0 {
        let [x, y, z] = &mut columns;
        for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
            if *x * *x + *y * *y + *z * *z <= least * least {
                (*x, *y, *z) = (0.0, 0.0, 0.0);
            }
        }
    }
    columns
}

/// Returns the ratio of the noise of a column's [`slope`], in its unit per second, to the noise of the column, in its unit. One value in `rows` rows is
/// measured, the others are interpolated: the ratio is the largest of any row.
pub fn slope_gain(rate_hz: f64, rows: usize) -> f64 {
    let reach = (TREMOR_SECS * rate_hz / 2.0).round() as usize;
    let width = 2 * reach + 1;
    let mut weights = vec![rate_hz / 2.0, 0.0, -rate_hz / 2.0];
    for _ in 0..2 {
        let mut averaged = vec![0.0; weights.len() + width - 1];
        for (at, weight) in weights.iter().enumerate() {
            averaged.iter_mut().skip(at).take(width).for_each(|value| *value += weight / width as f64);
        }
        weights = averaged;
    }
    let gain = |phase: usize| {
        let mut measured = vec![0.0; (weights.len() + phase) / rows + 2];
        for (at, weight) in weights.iter().enumerate() {
            let (before, share) = ((at + phase) / rows, ((at + phase) % rows) as f64 / rows as f64);
            let parts = measured.iter_mut().skip(before).zip([1.0 - share, share]);
            parts.for_each(|(value, share)| *value += weight * share);
        }
        measured.iter().map(|weight| weight * weight).sum::<f64>().sqrt()
    };
    (0..rows).map(gain).fold(0.0, f64::max)
}

/// Angular velocity in the reference frame at each frame, rad/s, without tremor.
fn turn_rates(measured: &CleanLog, rotation: [&[f64]; 4]) -> [Vec<f64>; 3] {
    let turned = |before: usize, after: usize| {
        (quaternion(&rotation, after) * quaternion(&rotation, before).inverse()).scaled_axis()
    };
    let rates = differences(measured, turned);
    [0, 1, 2].map(|axis| smoothed(measured, &rates.iter().map(|rate| rate[axis]).collect::<Vec<f64>>()))
}

/// Returns the rate of change from the frame before to the frame after, per second; at the ends of a stretch to or from the frame itself.
fn differences<T>(measured: &CleanLog, change: impl Fn(usize, usize) -> T) -> Vec<T>
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
pub fn smoothed(measured: &CleanLog, column: &[f64]) -> Vec<f64> {
    let reach = (TREMOR_SECS * measured.rate_hz / 2.0).round() as usize;
    moving_average(measured, &moving_average(measured, column, reach), reach)
}

/// The mean of what lies at most `reach` frames before and after each, within its stretch.
pub fn moving_average(measured: &CleanLog, column: &[f64], reach: usize) -> Vec<f64> {
    if reach == 0 {
        return column.to_vec();
    }
    let mut means = Vec::with_capacity(column.len());
    for stretch in &measured.stretches {
        average(column.get(stretch.clone()).unwrap_or_default(), reach, &mut means);
    }
    means
}

/// The mean of what lies at most `reach` before and after each value; of fewer values at the ends.
fn average(values: &[f64], reach: usize, means: &mut Vec<f64>) {
    // Rest and the absence of contacts last long.
    if values.iter().all(|value| *value == 0.0) {
        return means.resize(means.len() + values.len(), 0.0);
    }
    // Sums restart at fixed distances: their errors stay small, and a part of a log has the same averages as the whole.
    let mut sums = vec![0.0; values.len() + 1];
    let (groups, rest) = values.as_chunks::<ANCHOR>();
    let (group_sums, rest_sums) = sums.split_at_mut(groups.len() * ANCHOR);
    let mut totals = Vec::with_capacity(groups.len() + 1);
    // Groups are added up side by side: one addition waits for the one before.
    let (group_sums, _) = group_sums.as_chunks_mut::<ANCHOR>();
    let ((fours, ones), (four_sums, one_sums)) = (groups.as_chunks::<4>(), group_sums.as_chunks_mut::<4>());
    fours.iter().zip(four_sums).for_each(|(group, sums)| totals.extend(add_up(group, sums)));
    for (group, sums) in ones.iter().zip(one_sums) {
        totals.extend(add_up(array::from_ref(group), array::from_mut(sums)));
    }
    let mut sum = 0.0;
    for (before, value) in rest_sums.iter_mut().zip(rest.iter().chain(&[0.0])) {
        *before = sum;
        sum += value;
    }
    if !rest.is_empty() {
        totals.push(sum);
    }
    let mut index = 0;
    while index < values.len() {
        let (from, to) = (index.saturating_sub(reach), (index + reach + 1).min(values.len()));
        let (first, last) = (from / ANCHOR, to / ANCHOR);
        // As long as both ends move on within their groups, the same is added up.
        let run = if index < reach || to == values.len() {
            1
        } else {
            (ANCHOR - from % ANCHOR).min(ANCHOR - to % ANCHOR).min(values.len() - to)
        };
        let ends = [from, to].map(|end| sums.get(end..end + run).unwrap_or_default());
        let (total, between) = match totals.get(first..last).unwrap_or_default() {
            [] => (0.0, &[][..]),
            [total, between @ ..] => (*total, between),
        };
        let count = (to - from) as f64;
        let [starts, ends] = [ends[0].iter(), ends[1].iter()];
        match between {
            [] => means.extend(starts.zip(ends).map(|(start, end)| (total - start + end) / count)),
            some => means.extend(
                starts
                    .zip(ends)
                    .map(|(start, end)| (some.iter().fold(total - start, |sum, group| sum + group) + end) / count),
            ),
        }
        index += run;
    }
}

/// What lies before each value of each group, added up; the sum of each group.
fn add_up<const N: usize>(groups: &[[f64; ANCHOR]; N], sums: &mut [[f64; ANCHOR]; N]) -> [f64; N] {
    let mut total = [0.0; N];
    for at in 0..ANCHOR {
        for ((total, group), before) in total.iter_mut().zip(groups).zip(sums.iter_mut()) {
            before[at] = *total;
            *total += group[at];
        }
    }
    total
}
