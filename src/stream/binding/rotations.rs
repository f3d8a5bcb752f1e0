//! Rotations that are logged otherwise: roll, pitch and yaw, or a matrix, become quaternions.

use super::pattern::Form;
use crate::base::recording::{Column, Recording};
use crate::base::units::Dimension;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

/// Replaces the columns of [`Form::Angles`] and [`Form::Matrix`] by those of a quaternion w x y z.
pub fn to_quaternions(recording: &mut Recording) {
    for form in [Form::Angles, Form::Matrix] {
        let first = form.components().first().map(|letter| format!(".{letter}")).unwrap_or_default();
        let channels: Vec<String> =
            recording.columns.keys().filter_map(|name| name.strip_suffix(&first)).map(str::to_string).collect();
        for channel in channels {
            let mut taken = vec![];
            for letter in form.components() {
                taken.extend(recording.columns.shift_remove(&format!("{channel}.{letter}")));
            }
            let rows: Vec<[f64; 4]> = (0..recording.time.len())
                .map(|row| quaternion(&taken.iter().map(|column| at(column, row)).collect::<Vec<_>>()))
                .collect();
            for (place, letter) in Form::Quaternion.components().iter().enumerate() {
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
fn quaternion(values: &[f64]) -> [f64; 4] {
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
