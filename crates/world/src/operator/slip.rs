//! A grip that loosens until the object slips, and tightens again when that is noticed; or does not.

use super::grips::HandGrip;
use super::sensor_history::SensorSample;
use crate::{STEP_S, World};
use nalgebra::{Isometry3, Point3};

/// How fast the fingers let go, and how fast they catch, m/s.
const LOOSENING: f64 = 0.010;
const CATCHING: f64 = 0.060;
/// Factor of the squeeze of a caught object, and the longest time in which an object is caught, s.
const FIRMER: f64 = 1.3;
const CATCHING_S: f64 = 0.5;
/// An object that has not been felt for this long, s, or has fallen this far, m, is gone.
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
    /// For how long it has been caught, s.
    pub(super) catching: Option<f64>,
    /// For how long nothing has been touched, s.
    pub(super) empty: f64,
}

impl SlipMotion {
    /// Moves the fingertips (palm frame) for another step; whether it is over. The grip holds again only when the object was caught.
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
