//! Sway damping: an object between two tips swings about the line between them, as on a hinge with little friction. The palm rotates against the swing.

use crate::planning::plan::Target;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// Gains of sway damping; ours, tuned on the shipped scenes with a hinge grasp (docs/sources.md, Control).
#[derive(Clone, Copy, Debug)]
struct Gains {
    /// The rotation of the palm per angular rate, s.
    turn_s: f64,
    /// The maximum rotation of the palm, rad.
    most_rad: f64,
    /// The time constant of the rate's low-pass filter, s.
    seen_s: f64,
}

impl Default for Gains {
    fn default() -> Self {
        Self { turn_s: 0.015, most_rad: 0.15, seen_s: 0.005 }
    }
}

/// The sway of an object between two tips.
#[derive(Clone, Debug, Default)]
pub(super) struct SwayDamping {
    gains: Gains,
    /// The orientation of the object one step before.
    before: Option<UnitQuaternion<f64>>,
    /// The angular rate of the object about the line between the tips, rad/s.
    rate: Vector3<f64>,
}

impl SwayDamping {
    /// Returns the rotation of the palm against the sway of an object between two tips, as a scaled axis, rad; zero for other grasps. `dt_s` is the step, s.
    pub(super) fn turn(&mut self, target: &Target, object: &Isometry3<f64>, dt_s: f64) -> Vector3<f64> {
        let [(_, one, _), (_, other, _)] = &target.tips[..] else { return self.rest() };
        let Some(line) = (other - one).try_normalize(1e-6) else { return self.rest() };
        let before = self.before.replace(object.rotation).unwrap_or(object.rotation);
        let rate = (object.rotation * before.inverse()).scaled_axis() / dt_s;
        self.rate += (line * line.dot(&rate) - self.rate) * (dt_s / self.gains.seen_s).min(1.0);
        let turn = -self.rate * self.gains.turn_s;
        turn * (self.gains.most_rad / turn.norm().max(1e-9)).min(1.0)
    }

    /// Resets the sway of a hand without an object. Returns a rotation of zero.
    pub(super) fn rest(&mut self) -> Vector3<f64> {
        (self.before, self.rate) = (None, Vector3::zeros());
        Vector3::zeros()
    }
}
