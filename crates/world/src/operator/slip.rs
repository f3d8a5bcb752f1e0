//! A grip that loosens until the object slips, and tightens again when the operator notices the slip, or drops the object.

use super::grips::HandGrip;
use super::sensor_history::SensorSample;
use crate::{STEP_S, World};
use nalgebra::{Isometry3, Point3};

/// The speeds at which the fingers open, and at which they close to catch the object, m/s.
const LOOSENING: f64 = 0.010;
const CATCHING: f64 = 0.060;
/// Factor of the squeeze of a caught object, and the longest time in which an object is caught, s.
const FIRMER: f64 = 1.3;
const CATCHING_S: f64 = 0.5;
/// An object without contact for this time (s), or that has fallen this far (m), is lost.
const DROPPED_S: f64 = 0.15;
const DROPPED_M: f64 = 0.025;

/// A grip that loosens.
pub(super) struct SlipMotion {
    /// The object is caught when it has slipped this far, m.
    pub(super) distance: f64,
    /// The squeeze before, N.
    pub(super) squeeze: f64,
    /// Height of the object against the palm at the start, m.
    pub(super) height: f64,
    /// The time since the object was caught, s.
    pub(super) catching: Option<f64>,
    /// The time without contact, s.
    pub(super) empty: f64,
}

impl SlipMotion {
    /// Moves the fingertips (palm frame) by a step, and returns whether the motion is over. The grip holds again only if the object was caught.
    pub(super) fn step(
        &mut self,
        grip: &mut HandGrip,
        world: &World,
        felt: &SensorSample,
        palm: &Isometry3<f64>,
        tips: &mut [Point3<f64>],
    ) -> bool {
        let slipped = world
            .observation()
            .bodies
            .get(grip.object)
            .map_or(0.0, |body| self.height - (body.pose.translation.vector.z - palm.translation.vector.z));
        if slipped >= self.distance {
            self.catching.get_or_insert(0.0);
        }
        let speed = match &mut self.catching {
            Some(time) => {
                *time += STEP_S;
                -CATCHING
            }
            None => LOOSENING,
        };
        let mut pressed = 0.0;
        for ((tip, contact), force) in tips.iter_mut().zip(&grip.contacts).zip(&felt.tips) {
            let Some((_, normal)) = contact else { continue };
            *tip += normal * speed * STEP_S;
            pressed += -force.dot(&(palm * normal)) / 2.0;
        }
        self.empty = if felt.total().norm() > 0.0 { 0.0 } else { self.empty + STEP_S };
        let caught = self.catching.is_some_and(|time| pressed >= FIRMER * self.squeeze || time >= CATCHING_S);
        let over = caught || self.empty > DROPPED_S || slipped > DROPPED_M;
        if over {
            grip.squeeze = caught.then_some(FIRMER * self.squeeze);
        }
        over
    }
}
