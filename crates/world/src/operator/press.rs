//! Presses a held object against a body, controlled by the sensed forces of the fingers.

use super::grips::HandGrip;
use super::guarded_motion::{FOLLOWING, SEEKING};
use super::sensor_history::SensorSample;
use crate::STEP_S;
use nalgebra::Vector3;

/// The contact is detected at this share of the desired force.
const NOTICED: f64 = 0.2;

/// An object that is moved to a body and then pressed against it.
pub(super) struct PressMotion {
    /// Direction, unit.
    pub(super) toward: Vector3<f64>,
    /// Force on the object in that direction, N.
    pub(super) force: f64,
    /// Duration of the press, s.
    pub(super) time: f64,
    /// Remaining maximum distance, m.
    pub(super) left: f64,
    /// Duration of the press so far, s.
    pub(super) pressed: Option<f64>,
}

impl PressMotion {
    /// Returns the desired velocity, m/s, and whether the press is over.
    pub(super) fn step(&mut self, grip: &HandGrip, felt: &SensorSample) -> (Vector3<f64>, bool) {
        // The weight of the object does not count as pressing.
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
