//! Sway damping: what hangs between two tips turns about the line between them as on a hinge, which friction hardly slows down. The palm turns against that.

use crate::planning::plan::Target;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// Gains of sway damping; ours, tuned on the shipped scenes with a hinge grasp (docs/sources.md, Control).
#[derive(Clone, Copy, Debug)]
struct Gains {
    /// The turn of the palm for a rate of 1 rad/s, s.
    turn_s: f64,
    /// At most so far, rad.
    most_rad: f64,
    /// Time constant with which the rate is seen, s.
    seen_s: f64,
}

impl Default for Gains {
    fn default() -> Self {
        Self { turn_s: 0.015, most_rad: 0.15, seen_s: 0.005 }
    }
}

/// How an object that hangs between two tips sways.
#[derive(Clone, Debug, Default)]
pub(super) struct SwayDamping {
    gains: Gains,
    /// How the object was turned one step before.
    before: Option<UnitQuaternion<f64>>,
    /// How fast it turns about the line between the tips, rad/s.
    rate: Vector3<f64>,
}

impl SwayDamping {
    /// Returns the turn of the palm against the sway of what hangs between two tips, as a scaled axis, rad; zero for other grasps. `dt_s` is the step, s.
    pub(super) fn turn(&mut self, target: &Target, object: &Isometry3<f64>, dt_s: f64) -> Vector3<f64> {
        let [(_, one, _), (_, other, _)] = &target.tips[..] else { return self.rest() };
        let Some(line) = (other - one).try_normalize(1e-6) else { return self.rest() };
        let before = self.before.replace(object.rotation).unwrap_or(object.rotation);
        let rate = (object.rotation * before.inverse()).scaled_axis() / dt_s;
        self.rate += (line * line.dot(&rate) - self.rate) * (dt_s / self.gains.seen_s).min(1.0);
        let turn = -self.rate * self.gains.turn_s;
        turn * (self.gains.most_rad / turn.norm().max(1e-9)).min(1.0)
    }

    /// Forgets the sway: nothing hangs. Returns no turn.
    pub(super) fn rest(&mut self) -> Vector3<f64> {
        (self.before, self.rate) = (None, Vector3::zeros());
        Vector3::zeros()
    }
}
