//! Curves through samples, and shares of motions.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use teachtree_base::pose::{PoseArray, pose_from_array, slerp};

/// Returns a share of a screw motion: a rotation about an axis in space and a translation along it.
pub(crate) fn screw_motion(whole: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
    let Some((axis, angle)) = whole.rotation.axis_angle().filter(|(_, angle)| *angle > 1e-6) else {
        return share_of(whole, share);
    };
    let (moved, along) = (whole.translation.vector, axis.dot(&whole.translation.vector));
    let across = moved - axis.into_inner() * along;
    // The fixed point: (1 - R) c = across.
    let centre = (across + axis.cross(&across) / (angle / 2.0).tan()) / 2.0;
    let turn = UnitQuaternion::from_axis_angle(&axis, angle * share);
    let translation = centre - turn * centre + axis.into_inner() * (along * share);
    Isometry3::from_parts(Translation3::from(translation), turn)
}

/// Returns a part of a displacement.
pub(crate) fn share_of(whole: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
    let turn = slerp(&UnitQuaternion::identity(), &whole.rotation, share);
    Isometry3::from_parts(Translation3::from(whole.translation.vector * share), turn)
}

/// Returns the two samples around a share of a list, and the share between them.
pub(crate) fn between<T: Copy>(samples: &[T], share: f64) -> Option<(usize, f64)> {
    let last = samples.len().checked_sub(1)?;
    let at = share.clamp(0.0, 1.0) * last as f64;
    let index = (at.floor() as usize).min(last.saturating_sub(1));
    Some((index, at - index as f64))
}

/// Returns a point of the Catmull–Rom spline through samples, whose velocity is continuous.
pub(crate) fn vector_at(samples: &[[f64; 3]], share: f64) -> Vector3<f64> {
    let Some((index, t)) = between(samples, share) else { return Vector3::zeros() };
    let last = samples.len() - 1;
    let at = |offset: isize| Vector3::from(samples[index.saturating_add_signed(offset).min(last)]);
    let (a, b, c, d) = (at(-1), at(0), at(1), at(2));
    let a = if index == 0 { 2.0 * b - c } else { a };
    let d = if index + 2 > last { 2.0 * c - b } else { d };
    0.5 * (2.0 * b + (c - a) * t + (2.0 * a - 5.0 * b + 4.0 * c - d) * t * t + (3.0 * b - a - 3.0 * c + d) * t * t * t)
}

pub(crate) fn pose_at(samples: &[PoseArray], share: f64) -> Isometry3<f64> {
    let Some((index, t)) = between(samples, share) else { return Isometry3::identity() };
    let places: Vec<[f64; 3]> = samples[index.saturating_sub(1)..(index + 3).min(samples.len())]
        .iter()
        .map(|it| [it[0], it[1], it[2]])
        .collect();
    let inner = (index - index.saturating_sub(1)) as f64 + t;
    let place = vector_at(&places, inner / (places.len() - 1).max(1) as f64);
    let turn = |index: usize| pose_from_array(&samples[index.min(samples.len() - 1)]).rotation;
    Isometry3::from_parts(Translation3::from(place), slerp(&turn(index), &turn(index + 1), t))
}

/// Returns the length of the path of an object, m.
pub(crate) fn way_of(object: &[PoseArray]) -> f64 {
    let step = |pair: &[PoseArray]| {
        let place = |at: usize| pose_from_array(&pair[at]).translation.vector;
        (place(1) - place(0)).norm()
    };
    object.windows(2).map(step).sum()
}

/// Returns the duration that poses of an object, demonstrated in `duration_s`, must take so that its acceleration is at most `most`, m/s².
pub(crate) fn gentle_s(object: &[PoseArray], duration_s: f64, most: f64) -> f64 {
    let at = |index: usize| pose_from_array(&object[index]).translation.vector;
    let step = duration_s / (object.len().max(2) - 1) as f64;
    let speeds_up = |index: usize| (at(index + 2) - at(index + 1) * 2.0 + at(index)).norm() / (step * step);
    let fastest = (0..object.len().saturating_sub(2)).map(speeds_up).filter(|it| it.is_finite()).fold(0.0, f64::max);
    duration_s * (fastest / most).sqrt()
}
