//! Pressing what is held against something, by the force that the fingers feel.

use super::grips::HandGrip;
use super::guarded_motion::{FOLLOWING, SEEKING};
use super::sensor_history::SensorSample;
use crate::STEP_S;
use nalgebra::Vector3;

/// The touch is noticed at this share of the force that is wanted.
const NOTICED: f64 = 0.2;

/// An object on its way to something, then pressed against it.
pub(super) struct PressMotion {
    /// Direction, unit.
    pub(super) toward: Vector3<f64>,
    /// Force on the object in that direction, N.
    pub(super) force: f64,
    /// How long, s.
    pub(super) time: f64,
    /// How far it still may be, m.
    pub(super) left: f64,
    /// How long it has been pressed, s.
    pub(super) pressed: Option<f64>,
}

impl PressMotion {
    /// The velocity that is wanted now, m/s, and whether it has been pressed for long enough.
    pub(super) fn step(&mut self, grip: &HandGrip, felt: &SensorSample) -> (Vector3<f64>, bool) {
        // What the fingers carry in the air is not pressing.
        let pressed = felt.total().dot(&self.toward);
        if pressed > NOTICED * self.force && grip.squeeze.is_some() {
            self.pressed.get_or_insert(0.0);
        }
        let speed = (2.0 * FOLLOWING * (self.force - pressed)).clamp(-SEEKING, SEEKING);
        match &mut self.pressed {
            Some(time) => *time += STEP_S,
            None => self.left -= speed * STEP_S,
        }
        let long_enough = self.pressed.is_some_and(|time| time >= self.time);
        (self.toward * speed, long_enough || self.left <= 0.0)
    }
}
