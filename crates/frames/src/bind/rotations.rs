//! Rotations that are logged otherwise: roll, pitch and yaw, or a matrix, become quaternions.

use super::pattern::Representation;
use crate::clean::preprocess::over_all;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use std::f64::consts::TAU;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::short_number::ShortNumber;
use teachtree_base::units::Dimension;
use teachtree_logs::issue::{Issue, IssueKind};

/// An angle beyond this is more than a turn, rad.
const BEYOND: f64 = 1.1 * TAU;
/// Turns may be counted, but nothing turns by more than this, rad, …
const TURNED: f64 = 2.5;
/// … in this time, s.
const WITHIN: f64 = 0.1;

/// This share of a log's samples is more than its bad ones, and so are so many at its beginning.
const SHARE: f64 = 0.01;
const FIRST: usize = 3;

/// Returns an issue for a rotation whose angles, rad, are none: beyond a turn from the start on or suddenly, as degrees are. Turns that were counted come
/// one after the other.
pub fn beyond_a_turn(recording: &Recording, channel: &str) -> Option<Issue> {
    let time = &recording.time;
    let columns =
        Representation::Angles.components().iter().map(|letter| recording.columns.get(&format!("{channel}.{letter}")));
    let columns: Vec<&Column> = columns.collect::<Option<_>>()?;
    let measured = |column: &Column| -> Vec<(f64, f64)> {
        let samples = time.iter().copied().zip(column.values.iter().copied());
        samples.filter(|(_, value)| value.is_finite()).collect()
    };
    let is_odd = |column: &&Column| {
        let samples = measured(column);
        let enough = |count: usize| count as f64 > SHARE * samples.len() as f64;
        let is_beyond = |(_, value): &&(f64, f64)| value.abs() > BEYOND;
        let starts = samples.iter().take(FIRST).filter(is_beyond).count() == FIRST;
        let beyond = samples.iter().filter(is_beyond).count();
        let mut from = 0;
        let sudden = samples.iter().enumerate().skip(1).filter(|(row, (at, value))| {
            while from + 1 < *row && samples.get(from).is_some_and(|(then, _)| at - then > WITHIN) {
                from += 1;
            }
            let turned = samples
                .get(from)
                .map_or(0.0, |(then, before)| (value - before).abs() * WITHIN / (at - then).max(WITHIN));
            turned > TURNED
        });
        starts || (enough(beyond) && enough(sudden.count()))
    };
    if !columns.iter().any(is_odd) {
        return None;
    }
    let largest = columns.iter().flat_map(|column| measured(column)).map(|(_, value)| value.abs()).fold(0.0, f64::max);
    let message = format!(
        "its angles are read as radians and the largest is {}, expected within ±2π: are they degrees? Then say `[deg]` behind their columns",
        ShortNumber((largest * 1e2).round() / 1e2)
    );
    Some(over_all(time, IssueKind::IMPLAUSIBLE_ROTATION, channel, message))
}

/// Replaces the columns of [`Representation::Angles`] and [`Representation::Matrix`] by those of a quaternion w x y z.
pub fn to_quaternions(recording: &mut Recording) {
    for representation in [Representation::Angles, Representation::Matrix] {
        let first = representation.components().first().map(|letter| format!(".{letter}")).unwrap_or_default();
        let channels: Vec<String> =
            recording.columns.keys().filter_map(|name| name.strip_suffix(&first)).map(str::to_string).collect();
        for channel in channels {
            let mut taken = vec![];
            for letter in representation.components() {
                taken.extend(recording.columns.shift_remove(&format!("{channel}.{letter}")));
            }
            let rows: Vec<[f64; 4]> = (0..recording.time.len())
                .map(|row| quaternion(&taken.iter().map(|column| at(column, row)).collect::<Vec<_>>()))
                .collect();
            for (place, letter) in Representation::Quaternion.components().iter().enumerate() {
                let values = rows.iter().map(|row| row.get(place).copied().unwrap_or(f64::NAN)).collect();
                recording.columns.insert(format!("{channel}.{letter}"), Column { dimension: Dimension::NONE, values });
            }
        }
    }
}

fn at(column: &Column, row: usize) -> f64 {
    column.values.get(row).copied().unwrap_or(f64::NAN)
}

/// The quaternion w x y z of three angles, rad, or of nine elements row by row; of a matrix that is nearly a rotation, the nearest one.
pub fn quaternion(values: &[f64]) -> [f64; 4] {
    let rotation = match values {
        _ if values.iter().any(|value| !value.is_finite()) => return [f64::NAN; 4],
        [roll, pitch, yaw] => UnitQuaternion::from_euler_angles(*roll, *pitch, *yaw),
        values => {
            let matrix = Matrix3::from_row_slice(values);
            // Far from a rotation it is a damaged sample, or not in this order.
            let off = (matrix * matrix.transpose() - Matrix3::identity()).norm();
            if off > 0.1 || matrix.determinant() < 0.0 {
                return [f64::NAN; 4];
            }
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_eps(&matrix, 1e-9, 50, Rotation3::identity()))
        }
    };
    [rotation.w, rotation.i, rotation.j, rotation.k]
}
