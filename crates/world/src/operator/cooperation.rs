//! Two hands of one operator: a hand knows which phases the other one has begun and how it moves, and moves along with it while both are at one object.

use super::grips::HandGrip;
use super::sensor_history::SensorSample;
use nalgebra::Vector3;
use teachtree_base::easing::minimum_jerk;
use teachtree_base::hands::Side;

/// A load is taken over in this time, s.
const TAKING_OVER_S: f64 = 0.6;
/// How fast the hand follows a force that is too large or too small, m/s per N, and at most, m/s.
const FOLLOWING: f64 = 0.010;
const FASTEST: f64 = 0.030;

/// What a hand knows of the other one.
#[derive(Clone, Copy)]
pub(crate) struct PartnerHand<'a> {
    /// The phases that have begun so far, and whose they are.
    pub(crate) begun: &'a [(Side, String)],
    /// How far the other hand has just gone, m.
    pub(crate) shift: Vector3<f64>,
}

impl PartnerHand<'_> {
    /// Whether the other hand has begun this phase.
    pub(super) fn has_begun(&self, own: Side, phase: &str) -> bool {
        self.begun.iter().any(|(side, begun)| *side != own && begun == phase)
    }
}

/// Moving along.
pub(super) struct FollowMotion {
    /// The share of the weight to carry.
    pub(super) share: f64,
    /// The force to put on the object besides, N.
    pub(super) push: Vector3<f64>,
    /// The phase of the other hand that ends it.
    pub(super) until: Option<String>,
    /// How long it takes otherwise, s.
    pub(super) duration: f64,
    /// The force at the beginning, N.
    pub(super) before: Option<Vector3<f64>>,
}

impl FollowMotion {
    /// The velocity that is wanted besides that of the other hand, m/s, `time` seconds after the start.
    pub(super) fn step(&mut self, time: f64, grip: &HandGrip, felt: &SensorSample) -> Vector3<f64> {
        let force = felt.total();
        let before = *self.before.get_or_insert(force);
        let wanted = Vector3::z() * (self.share * grip.weight) + self.push;
        let now = before.lerp(&wanted, minimum_jerk(time / TAKING_OVER_S));
        let velocity = FOLLOWING * (now - force);
        velocity * (FASTEST / velocity.norm().max(FASTEST))
    }
}
