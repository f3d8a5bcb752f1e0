//! Velocities of bodies that are not those of their poses: with an offset, in another unit or in another frame, all along.
//!
//! A velocity says where a body will be; so over some time its mean is the way divided by the time, and the mean angular velocity is the turn divided by the
//! time. Single samples that cannot be are found before (`clean::spikes`); here a whole column is judged, and nothing is changed.

use super::motion::{Motion, TREMOR_SECS, every};
use crate::clean::preprocess::CleanLog;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::ops::Range;
use teachtree_base::scene::Body;
use teachtree_logs::issue::{Issue, IssueKind};

/// A contradiction is reported from this many looks on, at up to 25 a second.
const LEAST_LOOKS: usize = 25;
/// The share of the looks in which a velocity differs by more than its limit.
const SHARE: f64 = 0.5;

/// A velocity and its reference.
struct Quantity {
    /// The channel of the velocity, and that of the pose.
    name: &'static str,
    pose: &'static str,
    /// Maximum difference of consistent velocities, m/s or rad/s.
    limit: f64,
    unit: &'static str,
}

const VELOCITY: Quantity = Quantity { name: "velocity", pose: "position", limit: 0.01, unit: "m/s" };
const ANGULAR_VELOCITY: Quantity = Quantity { name: "angular_velocity", pose: "rotation", limit: 0.1, unit: "rad/s" };

/// The comparison of a velocity with the pose so far.
#[derive(Default)]
pub struct VelocityComparison {
    looks: usize,
    /// In how many the difference was above the limit, and its sum over these.
    differs: usize,
    difference: Vector3<f64>,
    /// The sum of all differences, none counted as longer than five limits: a body that was set elsewhere is not an offset.
    bounded: Vector3<f64>,
    /// Sums of the logged times the real velocity and of the squared real one, over the looks in which the body moves.
    product: f64,
    square: f64,
    moves: usize,
    span: Option<[f64; 2]>,
}

/// By body and velocity.
pub type Velocities = BTreeMap<(String, &'static str), VelocityComparison>;

/// Compares the logged velocities of a body with its poses, 25 times a second at most.
pub fn compare(measured: &CleanLog, name: &str, body: &Body, seen: &mut Velocities) {
    let poses = Motion::of_poses(measured, name, body);
    let moved = |from: usize, to: usize| poses.position(to) - poses.position(from);
    // From frame to frame, since a body may turn by more than a whole turn in between.
    let turn =
        |from: usize, to: usize| (poses.pose_at(to).rotation * poses.pose_at(from).rotation.inverse()).scaled_axis();
    let turned = |from: usize, to: usize| (from..to).map(|frame| turn(frame, frame + 1)).sum();
    if measured.vec3(&format!("{name}.position")).is_some() {
        compare_one(measured, name, &VELOCITY, &moved, seen);
    }
    if measured.rotation(&format!("{name}.rotation")).is_some() {
        compare_one(measured, name, &ANGULAR_VELOCITY, &turned, seen);
    }
}

/// Like the above, for one velocity; `change` returns the change of the pose between two frames.
fn compare_one(
    measured: &CleanLog,
    name: &str,
    quantity: &Quantity,
    change: &dyn Fn(usize, usize) -> Vector3<f64>,
    seen: &mut Velocities,
) {
    let reach = (TREMOR_SECS * measured.rate_hz / 2.0).round() as usize;
    let Some(logged) = measured.vec3(&format!("{name}.{}", quantity.name)).filter(|_| reach > 0) else { return };
    let found = seen.entry((name.to_string(), quantity.name)).or_default();
    let time = |frame: usize| measured.time.get(frame).copied().unwrap_or_default();
    for (frame, stretch) in looks(measured) {
        let (Some(from), to) = (frame.checked_sub(reach), frame + reach) else { continue };
        if from >= stretch.start && to < stretch.end {
            let real = change(from, to) / (time(to) - time(from));
            found.look(quantity, time(frame), mean(logged, from..to), real);
        }
    }
}

/// The evaluated frames, each with its stretch.
fn looks<'a>(measured: &'a CleanLog) -> impl Iterator<Item = (usize, &'a Range<usize>)> {
    let (step, core) = (every(measured), measured.window.as_ref().map(|window| window.core.clone()));
    measured.stretches.iter().flat_map(move |stretch| {
        let core = core.clone().unwrap_or_else(|| stretch.clone());
        core.step_by(step).filter(|frame| stretch.contains(frame)).map(move |frame| (frame, stretch))
    })
}

/// The mean over the time from the first frame to the one after the last, by trapezoids.
fn mean(columns: [&[f64]; 3], frames: Range<usize>) -> Vector3<f64> {
    let n = frames.len() as f64;
    let mean = |column: &[f64]| {
        let values = column.get(frames.start..=frames.end).unwrap_or_default();
        let ends = values.first().zip(values.last()).map_or(0.0, |(first, last)| (first + last) / 2.0);
        (values.iter().sum::<f64>() - ends) / n
    };
    columns.map(mean).into()
}

impl VelocityComparison {
    fn look(&mut self, quantity: &Quantity, at: f64, logged: Vector3<f64>, real: Vector3<f64>) {
        let difference = logged - real;
        if !difference.iter().all(|part| part.is_finite()) {
            return;
        }
        self.looks += 1;
        self.span = Some([self.span.map_or(at, |[first, _]| first), at]);
        self.bounded += difference.cap_magnitude(5.0 * quantity.limit);
        if difference.norm() > quantity.limit {
            self.differs += 1;
            self.difference += difference;
        }
        // Smaller motions are partly noise.
        if real.norm() > 5.0 * quantity.limit {
            self.moves += 1;
            self.product += logged.dot(&real);
            self.square += real.norm_squared();
        }
    }

    /// Returns the fault of a velocity.
    fn fault(&self, quantity: &Quantity) -> Option<String> {
        let Quantity { limit, unit, pose, .. } = quantity;
        let times = self.product / self.square;
        if self.moves >= LEAST_LOOKS && !(0.5..=2.0).contains(&times) {
            return Some(format!(
                "the velocity is {} times the derivative of the {pose}: it is in another unit or frame, or its sign is wrong; leave this channel \
                 out to derive it from the {pose}",
                rounded(times)
            ));
        }
        let is_offset = (self.bounded / self.looks as f64).norm() > *limit;
        let lasts = self.looks >= LEAST_LOOKS && self.differs as f64 >= SHARE * self.looks as f64;
        (lasts && is_offset).then(|| {
            let [x, y, z] = (self.difference / self.differs as f64).map(rounded).into();
            format!(
                "the velocity differs from the derivative of the {pose} by ({x}, {y}, {z}) {unit} on average: subtract its value at rest; leave \
                 this channel out to derive it from the {pose}"
            )
        })
    }
}

/// Returns an issue for each velocity that contradicts the pose.
pub fn issues(velocities: &Velocities) -> Vec<Issue> {
    let issue = |((body, name), seen): (&(String, &'static str), &VelocityComparison)| {
        let quantity = [VELOCITY, ANGULAR_VELOCITY].into_iter().find(|quantity| quantity.name == *name)?;
        let ([start_s, end_s], message) = (seen.span?, seen.fault(&quantity)?);
        Some(Issue {
            kind: IssueKind::IMPLAUSIBLE_VELOCITY,
            start_s,
            end_s,
            channel: format!("{body}.{name}"),
            message,
        })
    };
    velocities.iter().filter_map(issue).collect()
}

/// A number with three digits after the point.
fn rounded(value: f64) -> f64 {
    // No negative zero.
    (value * 1000.0).round() / 1000.0 + 0.0
}
