//! The alignment of the pad of a fingertip with the surface.

use super::grasp_request::LARGEST_PAD_ANGLE;

/// Smallest alignment: larger angles have a cost of their own in the search.
const LEAST: f64 = 0.1;

/// Returns the alignment of a pad, and its derivative by the cosine of the angle between the pad and the direction into the surface.
///
/// It is the cosine of that angle: the share of a force normal to the surface that presses along the axis of the pad, where a sensor and the soft part of a
/// fingertip are. For a finger that only pushes, and may touch with the end of the finger, angles are scaled so that both limits have the same alignment.
pub fn pad_alignment(cosine: f64, largest_angle: f64) -> (f64, f64) {
    let scale = LARGEST_PAD_ANGLE / largest_angle;
    let cosine = cosine.clamp(-1.0, 1.0);
    let angle = cosine.acos();
    let alignment = (scale * angle).cos();
    if alignment <= LEAST {
        return (LEAST, 0.0);
    }
    let sine = angle.sin();
    let slope = if sine < 1e-6 { scale * scale } else { scale * (scale * angle).sin() / sine };
    (alignment, slope)
}
