//! Cooperation of two hands: each hand has the phases and the motion of the other one, and follows it while both hold one object.

use super::grips::HandGrip;
use super::sensor_history::SensorSample;
use nalgebra::Vector3;
use teachtree_base::easing::minimum_jerk;
use teachtree_base::hands::Side;

/// The time in which a hand takes over a load, s.
const TAKING_OVER_S: f64 = 0.6;
/// The gain (m/s per N) and the maximum speed (m/s) of the force control.
const FOLLOWING: f64 = 0.010;
const FASTEST: f64 = 0.030;

/// The state of the other hand.
#[derive(Clone, Copy)]
pub(crate) struct PartnerHand<'a> {
    /// The phases that have begun so far, each with its hand.
    pub(crate) begun: &'a [(Side, String)],
    /// The displacement of the other hand in the last step, m.
    pub(crate) shift: Vector3<f64>,
}

impl PartnerHand<'_> {
    /// Whether the other hand has begun this phase.
    pub(super) fn has_begun(&self, own: Side, phase: &str) -> bool {
        self.begun.iter().any(|(side, begun)| *side != own && begun == phase)
    }
}

/// A motion that follows the other hand.
pub(super) struct FollowMotion {
    /// The share of the weight to carry.
    pub(super) share: f64,
    /// The additional force on the object, N.
    pub(super) push: Vector3<f64>,
    /// The phase of the other hand that ends it.
    pub(super) until: Option<String>,
    /// The maximum duration, s.
    pub(super) duration: f64,
    /// The force at the beginning, N.
    pub(super) before: Option<Vector3<f64>>,
}

impl FollowMotion {
    /// Returns the desired velocity relative to the other hand, m/s, `time` seconds after the start.
    pub(super) fn step(&mut self, time: f64, grip: &HandGrip, felt: &SensorSample) -> Vector3<f64> {
        let force = felt.total();
        let before = *self.before.get_or_insert(force);
        let wanted = Vector3::z() * (self.share * grip.weight) + self.push;
        let now = before.lerp(&wanted, minimum_jerk(time / TAKING_OVER_S));
        let velocity = FOLLOWING * (now - force);
        velocity * (FASTEST / velocity.norm().max(FASTEST))
    }
}
