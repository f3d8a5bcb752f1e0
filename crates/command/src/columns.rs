//! Channels of a recording at chosen rows.

use nalgebra::{Isometry3, Vector3};
use teachtree_base::log_channel::{BodyPart, LogChannel};
use teachtree_base::pose::{pose, slerp};
use teachtree_base::recording::Recording;

/// Maximum distance between a time and the row that counts for it, s.
const SAME_S: f64 = 1e-9;

/// The samples of a column at these rows; what was not measured is as before, and before that zero.
fn column(recording: &Recording, name: &str, rows: &[usize]) -> Option<Vec<f64>> {
    let column = recording.columns.get(name)?;
    let mut last = 0.0;
    Some(
        rows.iter()
            .map(|&row| {
                last = column.values.get(row).copied().filter(|value| value.is_finite()).unwrap_or(last);
                last
            })
            .collect(),
    )
}

/// A channel of three components.
pub(super) fn vectors(recording: &Recording, channel: &LogChannel<'_>, rows: &[usize]) -> Option<Vec<Vector3<f64>>> {
    let [x, y, z] = ["x", "y", "z"].map(|part| column(recording, &format!("{channel}.{part}"), rows));
    let (x, y, z) = (x?, y?, z?);
    Some((0..rows.len()).map(|at| Vector3::new(x[at], y[at], z[at])).collect())
}

/// Where a body was.
pub(super) fn poses(recording: &Recording, body: &str, rows: &[usize]) -> Option<Vec<Isometry3<f64>>> {
    let places = vectors(recording, &LogChannel::Body(body, BodyPart::Position), rows)?;
    let turns = rotations(recording, &LogChannel::Body(body, BodyPart::Rotation), rows);
    let posed = |(at, place): (usize, &Vector3<f64>)| {
        let turn = turns.as_ref().and_then(|turns| turns.get(at)).copied().unwrap_or([1.0, 0.0, 0.0, 0.0]);
        pose([place.x, place.y, place.z], turn)
    };
    Some(places.iter().enumerate().map(posed).collect())
}

/// A time in a recording: a row, and how much of the way from the row before it to this one is gone then, 0 to 1.
#[derive(Clone, Copy)]
pub(super) struct RowTime {
    pub(super) row: usize,
    pub(super) share: f64,
}

impl RowTime {
    /// A time, s; before the first row that one, and after the last row that one.
    pub(super) fn at(recording: &Recording, time_s: f64) -> Self {
        let last = recording.time.len().saturating_sub(1);
        let row = recording.time.partition_point(|t| *t < time_s - SAME_S);
        let before = row.checked_sub(1).filter(|_| row <= last).and_then(|before| recording.time.get(before));
        let (row, share) = match (before, recording.time.get(row)) {
            (Some(before), Some(after)) if *after > time_s + SAME_S => (row, (time_s - before) / (after - before)),
            _ => (row.min(last), 1.0),
        };
        Self { row, share }
    }
}

/// The values at times of a recording: what `at_rows` has at rows, and `between` makes of those of two rows next to each other.
pub(super) fn interpolated<T: Copy>(
    times: &[RowTime],
    at_rows: impl Fn(&[usize]) -> Option<Vec<T>>,
    between: impl Fn(T, T, f64) -> T,
) -> Option<Vec<T>> {
    let rows: Vec<usize> = times.iter().map(|time| time.row).collect();
    let values = at_rows(&rows)?;
    if times.iter().all(|time| time.share == 1.0) {
        return Some(values);
    }
    let before = at_rows(&rows.iter().map(|row| row.saturating_sub(1)).collect::<Vec<_>>())?;
    let at = |((time, value), before): ((&RowTime, T), T)| {
        if time.share == 1.0 { value } else { between(before, value, time.share) }
    };
    Some(times.iter().zip(values).zip(before).map(at).collect())
}

/// Positions at times of a recording, straight from row to row.
pub(super) fn positions_at(
    recording: &Recording,
    channel: &LogChannel<'_>,
    times: &[RowTime],
) -> Option<Vec<Vector3<f64>>> {
    interpolated(times, |rows| vectors(recording, channel, rows), |one, other, share| one.lerp(&other, share))
}

/// Where a body was at times of a recording, straight from row to row.
pub(super) fn poses_at(recording: &Recording, body: &str, times: &[RowTime]) -> Option<Vec<Isometry3<f64>>> {
    let between = |one: Isometry3<f64>, other: Isometry3<f64>, share: f64| {
        let place = one.translation.vector.lerp(&other.translation.vector, share);
        Isometry3::from_parts(place.into(), slerp(&one.rotation, &other.rotation, share))
    };
    interpolated(times, |rows| poses(recording, body, rows), between)
}

/// A rotation, w x y z.
fn rotations(recording: &Recording, channel: &LogChannel<'_>, rows: &[usize]) -> Option<Vec<[f64; 4]>> {
    let [w, x, y, z] = ["w", "x", "y", "z"].map(|part| column(recording, &format!("{channel}.{part}"), rows));
    let (w, x, y, z) = (w?, x?, y?, z?);
    Some((0..rows.len()).map(|at| [w[at], x[at], y[at], z[at]]).collect())
}
