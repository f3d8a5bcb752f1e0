//! Poses: rigid transforms from positions and quaternions, and the seven numbers by which files write them.

use super::scene::{Body, Part};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

/// Turns that differ by less are the same, rad.
const SAME_TURN_RAD: f64 = 1e-9;

/// A pose as seven numbers: position x y z, m, and quaternion w x y z.
pub type PoseArray = [f64; 7];

/// Returns the pose of a position, m, and a quaternion w x y z; a quaternion without direction is not a rotation.
#[inline]
pub fn pose(position: [f64; 3], rotation: [f64; 4]) -> Isometry3<f64> {
    let [x, y, z] = position;
    Isometry3::from_parts(Translation3::new(x, y, z), unit(rotation))
}

/// Returns the unit quaternion of w x y z; no rotation when it has no direction.
#[inline]
pub fn unit(quaternion: [f64; 4]) -> UnitQuaternion<f64> {
    directed(quaternion, 1e-9).unwrap_or_else(UnitQuaternion::identity)
}

/// Returns the unit quaternion of w x y z; `None` when its norm is at most `least` or it is not finite.
#[inline]
pub fn directed([w, x, y, z]: [f64; 4], least: f64) -> Option<UnitQuaternion<f64>> {
    UnitQuaternion::try_new(Quaternion::new(w, x, y, z), least)
        .filter(|rotation| rotation.coords.iter().all(|part| part.is_finite()))
}

/// Returns a pose as seven numbers.
#[inline]
pub fn pose_array(pose: &Isometry3<f64>) -> PoseArray {
    let (at, turn) = (pose.translation.vector, pose.rotation);
    [at.x, at.y, at.z, turn.w, turn.i, turn.j, turn.k]
}

/// Returns the pose of seven numbers.
#[inline]
pub fn pose_from_array([x, y, z, a, b, c, d]: &PoseArray) -> Isometry3<f64> {
    pose([*x, *y, *z], [*a, *b, *c, *d])
}

impl Body {
    /// Returns the pose of the body at the start, `world_from_body`.
    #[inline]
    pub fn pose(&self) -> Isometry3<f64> {
        pose(self.position.map(|length| length.0), self.rotation)
    }
}

impl Part {
    /// Returns the pose of the part in its body, `body_from_part`.
    #[inline]
    pub fn pose(&self) -> Isometry3<f64> {
        pose(self.at.map(|length| length.0), self.turned)
    }
}

/// The rotation a share of the way from one to another, 0 to 1, along the shortest arc.
#[inline]
pub fn slerp(from: &UnitQuaternion<f64>, to: &UnitQuaternion<f64>, share: f64) -> UnitQuaternion<f64> {
    from.try_slerp(to, share, SAME_TURN_RAD).unwrap_or(*to)
}
