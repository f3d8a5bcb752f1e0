//! Arrays of several dimensions as columns: the first dimension is time, the others are spread (`qpos[0]`, `qpos[1]`, …).
//!
//! A matrix of four by four is a pose: `name.position.x` to `name.rotation.z`, also if it is transposed. Arrays with more than [`MAX_WIDTH`] numbers a row (images) have no
//! columns.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

/// The most numbers a row that are spread into columns.
pub(super) const MAX_WIDTH: usize = 256;
/// Tolerance of a rotation matrix for orthonormal rows, and of its last row for 0 0 0 1: files in 32 bits round.
const ORTHONORMAL: f64 = 1e-3;
/// The names of the columns of a pose.
const POSE: [&str; 7] =
    ["position.x", "position.y", "position.z", "rotation.w", "rotation.x", "rotation.y", "rotation.z"];

/// The conversion of an array's rows to columns.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ArrayColumns {
    name: String,
    /// The dimensions after the first one, those of a pose left out.
    dimensions: Vec<usize>,
    poses: bool,
}

impl ArrayColumns {
    /// The columns of an array whose dimensions after the first one are these; `None` if a row has more than [`MAX_WIDTH`] numbers, or none.
    /// `first` is its first row, which distinguishes poses from other matrices.
    pub fn new(name: &str, dimensions: &[usize], first: &[f64]) -> Option<Self> {
        let width = width(dimensions)?;
        let (mut dimensions, mut poses) = (dimensions.to_vec(), false);
        if dimensions.ends_with(&[4, 4])
            && first.len() == width
            && first.chunks_exact(16).all(|matrix| Order::ALL.iter().any(|order| order.pose(matrix).is_some()))
        {
            dimensions.truncate(dimensions.len() - 2);
            poses = true;
        }
        Some(Self { name: name.into(), dimensions, poses })
    }

    /// Whether the columns are poses.
    pub fn has_poses(&self) -> bool {
        self.poses
    }

    /// The names of the columns.
    pub fn titles(&self) -> Vec<String> {
        let mut titles = vec![self.name.clone()];
        for dimension in &self.dimensions {
            titles = titles.iter().flat_map(|title| (0..*dimension).map(move |at| format!("{title}[{at}]"))).collect();
        }
        if self.poses {
            titles = titles.iter().flat_map(|title| POSE.map(|part| format!("{title}.{part}"))).collect();
        }
        titles
    }

    /// The columns of these values, row by row. A matrix that is not a pose is not measured.
    pub fn columns(&self, values: &[f64]) -> Vec<Vec<f64>> {
        let places: usize = self.dimensions.iter().product();
        let width = if self.poses { places * 16 } else { places };
        let count = if self.poses { places * POSE.len() } else { places };
        let mut columns = vec![Vec::with_capacity(values.len() / width.max(1)); count];
        let order = if self.poses { Order::of(values) } else { Order::Rows };
        // A quaternion and its negative are one rotation: the one nearer to that of the row before keeps the columns steady.
        let mut before = vec![UnitQuaternion::identity(); if self.poses { places } else { 0 }];
        for row in values.chunks_exact(width.max(1)) {
            if !self.poses {
                columns.iter_mut().zip(row).for_each(|(column, value)| column.push(*value));
                continue;
            }
            let parts = row.chunks_exact(16).zip(&mut before).flat_map(|(matrix, before)| match order.pose(matrix) {
                Some((position, rotation)) => {
                    let sign = if rotation.coords.dot(&before.coords) < 0.0 { -1.0 } else { 1.0 };
                    *before = UnitQuaternion::new_unchecked(rotation.into_inner() * sign);
                    let [x, y, z] = position;
                    [x, y, z, before.w, before.i, before.j, before.k]
                }
                None => [f64::NAN; 7],
            });
            columns.iter_mut().zip(parts).for_each(|(column, value)| column.push(value));
        }
        columns
    }
}

/// Returns the number of values of a row; `None` for 0 or too many.
pub(super) fn width(dimensions: &[usize]) -> Option<usize> {
    let width = dimensions.iter().try_fold(1_usize, |width, dimension| width.checked_mul(*dimension))?;
    (1..=MAX_WIDTH).contains(&width).then_some(width)
}

/// The order of the numbers of a matrix: row by row, or column by column, as MATLAB and libfranka store it.
#[derive(Clone, Copy, PartialEq)]
enum Order {
    Rows,
    Columns,
}

impl Order {
    const ALL: [Self; 2] = [Self::Rows, Self::Columns];

    /// The order in which more of these matrices are poses. At the origin both are possible, and elsewhere one.
    fn of(values: &[f64]) -> Self {
        let count = |order: Self| values.chunks_exact(16).filter(|matrix| order.pose(matrix).is_some()).count();
        if count(Self::Columns) > count(Self::Rows) { Self::Columns } else { Self::Rows }
    }

    /// The position and the rotation of a matrix, if it is a pose.
    fn pose(self, matrix: &[f64]) -> Option<([f64; 3], UnitQuaternion<f64>)> {
        if self == Self::Rows {
            return pose(matrix);
        }
        let mut transposed = [0.0; 16];
        for (at, value) in matrix.iter().enumerate() {
            *transposed.get_mut(at % 4 * 4 + at / 4)? = *value;
        }
        pose(&transposed)
    }
}

/// The position and the rotation of a matrix of four by four, row by row, if it is a pose.
fn pose(matrix: &[f64]) -> Option<([f64; 3], UnitQuaternion<f64>)> {
    let &[a, b, c, x, d, e, f, y, g, h, i, z, l0, l1, l2, l3] = matrix else { return None };
    let near = |value: f64, wanted: f64| (value - wanted).abs() <= ORTHONORMAL;
    let rotation = Matrix3::new(a, b, c, d, e, f, g, h, i);
    let off = (rotation * rotation.transpose() - Matrix3::identity()).abs().max();
    let is_pose = near(l0, 0.0) && near(l1, 0.0) && near(l2, 0.0) && near(l3, 1.0);
    // A comparison with NaN is false.
    let is_rotation = off <= 2.0 * ORTHONORMAL && rotation.determinant() > 0.0;
    (is_pose && is_rotation)
        .then(|| ([x, y, z], UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation))))
}
