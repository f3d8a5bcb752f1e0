//! Righting: a hand makes up for how an object hangs otherwise than it should, since fingertips hold it only softly about the line between them, and it
//! may have slipped. Integral control of the object's pose, as it is seen.
//!
//! What hangs between two tips turns about the line between them as on a hinge, which friction hardly slows down: the palm turns against that.
//!
//! What fingers only push cannot be turned as one likes: they go about it as it turns, and bring its middle back onto its way.

use super::plan::Target;
use crate::base::hands::Finger;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// How fast, 1/s, how far at most, rad and m, and how fast it is forgotten after letting go, 1/s.
const RATE: f64 = 2.0;
const MOST_RAD: f64 = 0.35;
const MOST_M: f64 = 0.020;
const FORGOTTEN: f64 = 4.0;
/// How fast fingers go about what they push, 1/s.
const FOLLOWS: f64 = 5.0;
/// Against the swing of what hangs between two tips the palm turns by this much for a rad/s, s, and at most so far, rad; the swing is seen within this time, s.
const SWINGS_S: f64 = 0.015;
const SWINGS_RAD: f64 = 0.15;
const SEEN_S: f64 = 0.005;
/// A finger takes part in holding from this force on, N.
const HOLDS_N: f64 = 0.1;

/// What the hand is turned and moved by.
pub(super) struct Righting {
    turned: Vector3<f64>,
    moved: Vector3<f64>,
    /// How an object that hangs between two tips was turned one step before, and how fast it turns about the line between them, rad/s.
    before: Option<UnitQuaternion<f64>>,
    swings: Vector3<f64>,
    /// The direction in which a support carries, unit; zero without gravity.
    up: Vector3<f64>,
}

impl Righting {
    /// Of a hand that has made up for nothing yet; `gravity` is in the reference frame.
    pub(super) fn new(gravity: Vector3<f64>) -> Self {
        let up = -gravity.try_normalize(1e-9).unwrap_or_default();
        Self { turned: Vector3::zeros(), moved: Vector3::zeros(), before: None, swings: Vector3::zeros(), up }
    }

    /// Turns and moves palm and fingertips of a target, the turn about the middle of the grasp, or of what is pushed; `object` is where the object is, `dt` the step, s.
    /// It moves only what is free: elsewhere the object is where it is for a reason. While another hand holds the object
    /// as well (`shared`), nothing is added to what was made up for: two hands would turn it about two places.
    pub(super) fn apply(&mut self, target: &mut Target, object: &Isometry3<f64>, shared: bool, dt: f64) {
        let held = holds(target);
        if held && !shared {
            let error = (target.object.rotation * object.rotation.inverse()).scaled_axis();
            self.turned += error * (RATE * dt);
            self.turned *= (MOST_RAD / self.turned.norm().max(1e-9)).min(1.0);
            if target.free {
                let error = target.object.translation.vector - object.translation.vector;
                self.moved += error * (RATE * dt);
                self.moved *= (MOST_M / self.moved.norm().max(1e-9)).min(1.0);
            }
        } else if target.pushed && !shared {
            let follows = (object.rotation * target.object.rotation.inverse()).scaled_axis();
            self.turned += (follows - self.turned) * (FOLLOWS * dt);
            self.turned *= (MOST_RAD / self.turned.norm().max(1e-9)).min(1.0);
            if target.free {
                let error = target.object.translation.vector - object.translation.vector;
                // Not into its support.
                self.moved += (error - self.up * self.up.dot(&error)) * (RATE * dt);
                self.moved *= (MOST_M / self.moved.norm().max(1e-9)).min(1.0);
            }
        } else if !held && !target.pushed {
            self.turned *= 1.0 - FORGOTTEN * dt;
            self.moved *= 1.0 - FORGOTTEN * dt;
        }
        let against =
            if held && !shared && target.free { self.against_swing(target, object, dt) } else { self.at_rest() };
        let middle = if target.pushed {
            target.object.translation.vector
        } else {
            target.tips.iter().map(|(_, tip, _)| tip.coords).sum::<Vector3<f64>>() / target.tips.len().max(1) as f64
        };
        let turn = UnitQuaternion::from_scaled_axis(self.turned + against);
        let about = Translation3::from(middle + self.moved) * turn * Translation3::from(-middle);
        target.palm = about * target.palm;
        for (_, tip, _) in &mut target.tips {
            *tip = about * *tip;
        }
    }

    /// The turn of the palm against the swing of what hangs between two tips, rad.
    fn against_swing(&mut self, target: &Target, object: &Isometry3<f64>, dt: f64) -> Vector3<f64> {
        let [(_, one, _), (_, other, _)] = &target.tips[..] else { return self.at_rest() };
        let Some(line) = (other - one).try_normalize(1e-6) else { return self.at_rest() };
        let before = self.before.replace(object.rotation).unwrap_or(object.rotation);
        let rate = (object.rotation * before.inverse()).scaled_axis() / dt;
        self.swings += (line * line.dot(&rate) - self.swings) * (dt / SEEN_S).min(1.0);
        let turn = -self.swings * SWINGS_S;
        turn * (SWINGS_RAD / turn.norm().max(1e-9)).min(1.0)
    }

    /// Nothing swings.
    fn at_rest(&mut self) -> Vector3<f64> {
        (self.before, self.swings) = (None, Vector3::zeros());
        Vector3::zeros()
    }
}

/// Whether a target is to hold an object between thumb and fingers.
pub(super) fn holds(target: &Target) -> bool {
    let presses = |thumb: bool| {
        let mut those = target.tips.iter().filter(|(finger, ..)| (*finger == Finger::Thumb) == thumb);
        those.any(|(.., force)| force.norm() > HOLDS_N)
    };
    presses(true) && presses(false)
}
