//! Motions of operators: minimum-jerk motions from point to point, and smoothed velocities of guarded motions.

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};
use teachtree_base::easing::minimum_jerk;
use teachtree_base::pose::slerp;

/// The largest speed of a minimum-jerk motion over its mean speed.
const PEAK_OVER_MEAN: f64 = 1.875;
/// Minimum duration of a motion, s: the time to start and stop an arm.
const SHORTEST_S: f64 = 0.25;
/// Time constant of each of the two lags of a guided velocity, s.
const LAG_S: f64 = 0.04;

/// A smooth bump that is 0 at both ends and 1 in the middle.
pub(super) fn bump(share: f64) -> f64 {
    let s = share.clamp(0.0, 1.0);
    let product = 4.0 * s * (1.0 - s);
    product * product * product
}

/// Returns the duration of a minimum-jerk motion over `distance` (m) with the maximum speed `speed` (m/s), s.
pub(super) fn duration(distance: f64, speed: f64) -> f64 {
    (PEAK_OVER_MEAN * distance / speed.max(1e-3)).max(SHORTEST_S)
}

/// A minimum-jerk motion of the palm and of the fingertips in the palm's frame.
pub(super) struct Transport {
    pub(super) from_palm: Isometry3<f64>,
    pub(super) to_palm: Isometry3<f64>,
    pub(super) from_tips: Vec<Point3<f64>>,
    pub(super) to_tips: Vec<Point3<f64>>,
    /// The delay of each fingertip, s; 0 for fingertips that are not listed.
    pub(super) delays: Vec<f64>,
    /// The height and direction of the arch of the path, m.
    pub(super) arch: Vector3<f64>,
    pub(super) duration: f64,
}

impl Transport {
    /// Returns palm and fingertips `time` seconds after the start.
    pub(super) fn at(&self, time: f64) -> (Isometry3<f64>, Vec<Point3<f64>>) {
        let share = time / self.duration;
        let s = minimum_jerk(share);
        let rotation = slerp(&self.from_palm.rotation, &self.to_palm.rotation, s);
        let translation =
            self.from_palm.translation.vector.lerp(&self.to_palm.translation.vector, s) + self.arch * bump(share);
        let delays = self.delays.iter().copied().chain(std::iter::repeat(0.0));
        let tips = self.from_tips.iter().zip(&self.to_tips).zip(delays);
        let tips =
            tips.map(|((from, to), delay)| from + (to - from) * minimum_jerk((time - delay) / self.duration)).collect();
        (Isometry3::from_parts(translation.into(), rotation), tips)
    }

    /// Whether everything has arrived `time` seconds after the start.
    pub(super) fn is_over(&self, time: f64) -> bool {
        time >= self.duration + self.delays.iter().copied().fold(0.0, f64::max)
    }
}

/// A minimum-jerk turn of the palm about an upright axis.
pub(super) struct TurnMotion {
    pub(super) from_palm: Isometry3<f64>,
    /// A point of the axis.
    pub(super) centre: Point3<f64>,
    /// The direction of the axis.
    pub(super) axis: Unit<Vector3<f64>>,
    /// The angle, counter-clockwise as seen against the axis, rad.
    pub(super) angle: f64,
    pub(super) duration: f64,
}

impl TurnMotion {
    /// Returns the palm `time` seconds after the start.
    pub(super) fn at(&self, time: f64) -> Isometry3<f64> {
        let angle = self.angle * minimum_jerk(time / self.duration);
        let turned = UnitQuaternion::from_axis_angle(&self.axis, angle);
        let arm = self.from_palm.translation.vector - self.centre.coords;
        Isometry3::from_parts((self.centre.coords + turned * arm).into(), turned * self.from_palm.rotation)
    }
}

/// A velocity that follows the desired one through two first-order lags, so that it has no steps; m/s.
#[derive(Default)]
pub(super) struct LagFilter {
    halfway: Vector3<f64>,
    velocity: Vector3<f64>,
}

impl LagFilter {
    /// Returns the velocity after another `dt` seconds.
    pub(super) fn towards(&mut self, wanted: Vector3<f64>, dt: f64) -> Vector3<f64> {
        self.halfway += (wanted - self.halfway) * (dt / LAG_S);
        self.velocity += (self.halfway - self.velocity) * (dt / LAG_S);
        self.velocity
    }
}
