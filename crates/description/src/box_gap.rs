//! Gaps of boxes to segments and to each other, in closed form, in the frame of a box.
//!
//! The gap is at least the widest separation along a face normal or a cross product of two edges. If nothing separates the shapes, the narrowest overlap is the depth
//! of the penetration (S. Gottschalk, M. C. Lin and D. Manocha, *OBBTree*, 1996).

use nalgebra::{Isometry3, Matrix3, Vector3};

/// Axes shorter than this have no direction.
const SHORT_AXIS: f64 = 1e-6;
/// Segments and boxes that are nearer than this touch, m.
const TOUCHING_M: f64 = 1e-6;

/// Returns the gap between a segment and a box about the origin with these half edges, m; negative by the depth of a penetration. `None` if it is at least `below`, m.
/// The segment leads from `begins` along `way`, m.
pub(crate) fn segment_to_box(
    begins: &Vector3<f64>,
    way: &Vector3<f64>,
    half: &Vector3<f64>,
    below: f64,
) -> Option<f64> {
    let mut widest = f64::NEG_INFINITY;
    for axis in 0..3 {
        let ends = [begins[axis], begins[axis] + way[axis]];
        widest = widest.max(ends[0].min(ends[1]) - half[axis]).max(-half[axis] - ends[0].max(ends[1]));
    }
    if widest >= below {
        return None;
    }
    let apart = outside(&(begins + way * nearest_share(begins, way, half)), half).norm();
    if apart >= TOUCHING_M {
        return Some(apart).filter(|gap| *gap < below);
    }
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()].iter().filter_map(|edge| direction(&way.cross(edge))) {
        let (along, reach) = (axis.dot(begins), axis.abs().dot(half));
        // The axis is across the segment, which has one place on it.
        widest = widest.max(along.abs() - reach);
    }
    Some(widest.min(0.0)).filter(|gap| *gap < below)
}

/// Returns the gap between a box about the origin and another one at a pose, with these half edges, m; negative by the depth of a penetration. `None` if it is at
/// least `below`, m.
pub(crate) fn box_to_box(
    half: &Vector3<f64>,
    pose: &Isometry3<f64>,
    other_half: &Vector3<f64>,
    below: f64,
) -> Option<f64> {
    let turn: Matrix3<f64> = pose.rotation.to_rotation_matrix().into_inner();
    let there = pose.translation.vector;
    let separation =
        |axis: &Vector3<f64>| axis.dot(&there).abs() - axis.abs().dot(half) - turn.tr_mul(axis).abs().dot(other_half);
    let own = [Vector3::x(), Vector3::y(), Vector3::z()];
    let theirs = [0, 1, 2].map(|axis| Vector3::from(turn.column(axis)));
    let across = || own.iter().flat_map(|one| theirs.iter().filter_map(|other| direction(&one.cross(other))));
    let mut widest = f64::NEG_INFINITY;
    for axis in own.into_iter().chain(theirs).chain(across()) {
        widest = widest.max(separation(&axis));
        if widest >= below {
            return None;
        }
    }
    if widest <= 0.0 {
        return Some(widest);
    }
    // The nearest points of two boxes are on an edge of this box, or at a corner of the other one.
    let back = pose.inverse();
    let mut least = below;
    for corner in corners(other_half) {
        least = least.min(outside(&(turn * corner + there), half).norm());
    }
    for axis in 0..3 {
        let way = back.rotation * (own[axis] * (2.0 * half[axis]));
        for (_, corner) in corners(half).into_iter().enumerate().filter(|(index, _)| index >> axis & 1 == 0) {
            let begins = back.rotation * corner + back.translation.vector;
            let share = nearest_share(&begins, &way, other_half);
            least = least.min(outside(&(begins + way * share), other_half).norm());
        }
    }
    Some(least).filter(|gap| *gap < below)
}

/// Returns the share of a segment at which it is nearest to a box about the origin. Half the squared distance is convex along the segment, and its slope is linear
/// between the planes of the faces, so that at most six places narrow its root down to an interval in which it is linear.
fn nearest_share(begins: &Vector3<f64>, way: &Vector3<f64>, half: &Vector3<f64>) -> f64 {
    let slope = |share: f64| way.dot(&outside(&(begins + way * share), half));
    let (mut low, mut high) = ((0.0, slope(0.0)), (1.0, slope(1.0)));
    if low.1 >= 0.0 {
        return 0.0;
    }
    if high.1 <= 0.0 {
        return 1.0;
    }
    for (axis, face) in (0..3).flat_map(|axis| [(axis, -half[axis]), (axis, half[axis])]) {
        let share = (face - begins[axis]) / way[axis];
        if low.0 < share && share < high.0 {
            let there = (share, slope(share));
            if there.1 < 0.0 { low = there } else { high = there }
        }
    }
    low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1)
}

/// Returns the vector to a point from the nearest point of a box about the origin.
pub(crate) fn outside(point: &Vector3<f64>, half: &Vector3<f64>) -> Vector3<f64> {
    point.zip_map(half, |value, half| value - value.clamp(-half, half))
}

/// Returns the unit vector along an axis; `None` if it has no direction.
fn direction(axis: &Vector3<f64>) -> Option<Vector3<f64>> {
    axis.try_normalize(SHORT_AXIS)
}

/// Returns the corners of a box about the origin.
fn corners(half: &Vector3<f64>) -> [Vector3<f64>; 8] {
    [0, 1, 2, 3, 4, 5, 6, 7].map(|corner: u8| {
        let side = |axis: u8| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
        Vector3::new(side(0), side(1), side(2)).component_mul(half)
    })
}
