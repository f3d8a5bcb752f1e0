//! The only meeting point of nalgebra, our vocabulary, with the glam types of parry and rapier.

use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use parry3d::math::{Matrix, Pose, Rotation, Vector};

/// A vector for parry and rapier.
pub(super) fn vector(vector: Vector3<f64>) -> Vector {
    vector.into()
}

/// A point for parry and rapier.
pub(super) fn point(point: Point3<f64>) -> Vector {
    point.coords.into()
}

/// A pose for parry and rapier.
pub(super) fn pose(pose: &Isometry3<f64>) -> Pose {
    Pose::from_parts(vector(pose.translation.vector), rotation(pose.rotation))
}

/// A matrix for parry and rapier.
pub(super) fn matrix(matrix: Matrix3<f64>) -> Matrix {
    matrix.into()
}

/// A matrix of ours.
pub(super) fn our_matrix(matrix: Matrix) -> Matrix3<f64> {
    matrix.into()
}

/// A vector of ours.
pub(super) fn our_vector(vector: Vector) -> Vector3<f64> {
    vector.into()
}

/// A point of ours.
pub(super) fn our_point(point: Vector) -> Point3<f64> {
    Point3::from(our_vector(point))
}

/// A pose of ours.
pub(super) fn our_pose(pose: &Pose) -> Isometry3<f64> {
    Isometry3::from_parts(our_vector(pose.translation).into(), our_rotation(pose.rotation))
}

fn rotation(rotation: UnitQuaternion<f64>) -> Rotation {
    rotation.into()
}

fn our_rotation(rotation: Rotation) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(rotation.into())
}
