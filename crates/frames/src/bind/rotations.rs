//! Rotations that are logged otherwise: roll, pitch and yaw, a rotation vector, or a matrix, become quaternions.

use super::pattern::Representation;
use crate::clean::preprocess::over_all;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::TAU;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::short_number::ShortNumber;
use teachtree_base::units::Dimension;
use teachtree_logs::issue::{Issue, IssueKind};

/// The forms of rotations that become quaternions.
pub const OTHERS: [Representation; 3] =
    [Representation::Angles, Representation::RotationVector, Representation::Matrix];

/// An angle beyond this is more than a turn, rad.
const BEYOND: f64 = 1.1 * TAU;
/// Turns may be counted, but nothing turns by more than this, rad, …
const TURNED: f64 = 2.5;
/// … in this time, s.
const WITHIN: f64 = 0.1;

/// Bad samples are fewer than this share of a log, and fewer than this number at its beginning.
const SHARE: f64 = 0.01;
const FIRST: usize = 3;

/// The channel of the last of three columns of angles, which is taken once.
pub fn channel_of_angles(column: &str) -> Option<String> {
    let forms = [Representation::Angles, Representation::RotationVector];
    let last = |form: Representation| column.strip_suffix(form.components().last()?)?.strip_suffix('.');
    forms.into_iter().find_map(last).map(str::to_string)
}

/// Returns an issue for a rotation whose angles, rad, are none: beyond a turn from the start on or suddenly, as degrees are. Turns that were counted come
/// one after the other.
pub fn beyond_a_turn(recording: &Recording, channel: &str) -> Option<Issue> {
    let time = &recording.time;
    let columns_of = |form: Representation| -> Option<Vec<&Column>> {
        form.components().iter().map(|letter| recording.columns.get(&format!("{channel}.{letter}"))).collect()
    };
    // The vector of a rotation jumps where its angle passes a turn: only the beginning counts.
    let is_vector = columns_of(Representation::Angles).is_none();
    let columns = columns_of(if is_vector { Representation::RotationVector } else { Representation::Angles })?;
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
        starts || (!is_vector && enough(beyond) && enough(sudden.count()))
    };
    if !columns.iter().any(is_odd) {
        return None;
    }
    let largest = columns.iter().flat_map(|column| measured(column)).map(|(_, value)| value.abs()).fold(0.0, f64::max);
    let message = format!(
        "its angles are read as radians and the largest is {}, expected within ±2π: if they are degrees, write `[deg]` after their columns",
        ShortNumber((largest * 1e2).round() / 1e2)
    );
    Some(over_all(time, IssueKind::IMPLAUSIBLE_ROTATION, channel, message))
}

/// Replaces the columns of the [`OTHERS`] by those of a quaternion w x y z.
pub fn to_quaternions(recording: &mut Recording) {
    for representation in OTHERS {
        let first = representation.components().first().map(|letter| format!(".{letter}")).unwrap_or_default();
        let channels: Vec<String> =
            recording.columns.keys().filter_map(|name| name.strip_suffix(&first)).map(str::to_string).collect();
        for channel in channels {
            let mut taken = vec![];
            for letter in representation.components() {
                taken.extend(recording.columns.shift_remove(&format!("{channel}.{letter}")));
            }
            let rows: Vec<[f64; 4]> = (0..recording.time.len())
                .map(|row| quaternion(representation, &taken.iter().map(|column| at(column, row)).collect::<Vec<_>>()))
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

/// The quaternion w x y z of three angles or a rotation vector, rad, or of nine elements row by row; of a matrix that is nearly a rotation, the nearest
/// one.
pub fn quaternion(form: Representation, values: &[f64]) -> [f64; 4] {
    let rotation = match values {
        _ if values.iter().any(|value| !value.is_finite()) => return [f64::NAN; 4],
        [x, y, z] if form == Representation::RotationVector => {
            UnitQuaternion::from_scaled_axis(Vector3::new(*x, *y, *z))
        }
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
