//! Channels of a recording at chosen rows.

use crate::base::log_channel::{BodyPart, LogChannel};
use crate::base::pose::pose;
use crate::base::recording::Recording;
use nalgebra::{Isometry3, Vector3};

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

/// A rotation, w x y z.
fn rotations(recording: &Recording, channel: &LogChannel<'_>, rows: &[usize]) -> Option<Vec<[f64; 4]>> {
    let [w, x, y, z] = ["w", "x", "y", "z"].map(|part| column(recording, &format!("{channel}.{part}"), rows));
    let (w, x, y, z) = (w?, x?, y?, z?);
    Some((0..rows.len()).map(|at| [w[at], x[at], y[at], z[at]]).collect())
}
