//! Guarded motions: fingers that close until they reach their force, and a hand that moves straight until it touches a body.

use super::grips::HandGrip;
use super::motion::bump;
use super::sensor_history::SensorSample;
use crate::{STEP_S, World};
use nalgebra::{Isometry3, Point3, Vector3};
use teachtree_base::easing::minimum_jerk;

/// Fingers without contact stop this far below the surface, m.
pub(super) const CLOSED_BELOW_M: f64 = 0.020;
/// The time in which a finger accelerates to its speed, s.
const GATHERING_S: f64 = 0.1;
/// The speed of the hand at an expected contact (m/s), and its increase with the remaining distance (1/s).
const ARRIVING: f64 = 0.015;
const SLOWING: f64 = 3.0;
/// A hand slows down at a force above this (N) and above the weight of its object; at three times this force it moves back.
pub(super) const EASING: f64 = 0.5;
/// This force for an object that is set down, of any weight: the table carries it.
pub(super) const LANDING: f64 = 0.3;
/// The speed of the search for a lost contact, m/s.
pub(super) const SEEKING: f64 = 0.025;
/// The gain of the pressing force's control, m/s per N.
pub(super) const FOLLOWING: f64 = 0.006;

/// Fingers that close.
pub(super) struct CloseMotion {
    /// The delay of each finger, s.
    pub(super) delays: Vec<f64>,
    /// Which fingers have reached their force. Unused fingers count as stopped from the start.
    pub(super) stopped: Vec<bool>,
    /// The force of each finger, N.
    pub(super) share: Vec<f64>,
    /// Speed of the fingertips, m/s.
    pub(super) speed: f64,
    /// The overrun of the palm during the closing, m, and its duration, s.
    pub(super) overrun: Vector3<f64>,
    pub(super) overrun_time: f64,
    /// Fingers without contact stop this far below the surface, m.
    pub(super) below: f64,
}

impl CloseMotion {
    /// Moves fingertips (palm frame) and palm by a step, `time` seconds after the start. Returns whether all fingers have reached their force and the hand is
    /// at rest.
    pub(super) fn step(
        &mut self,
        time: f64,
        grip: &HandGrip,
        felt: Option<&SensorSample>,
        tip_radius: f64,
        tips: &mut [Point3<f64>],
        palm: &mut Isometry3<f64>,
    ) -> bool {
        for (finger, contact) in grip.contacts.iter().enumerate() {
            let (Some((point, normal)), false) = (contact, self.stopped[finger]) else { continue };
            let below = tip_radius - (tips[finger] - point).dot(normal);
            let pressed =
                felt.and_then(|felt| felt.tips.get(finger)).map_or(0.0, |force| -force.dot(&(*palm * normal)));
            if pressed >= self.share[finger] || below >= self.below {
                self.stopped[finger] = true;
                continue;
            }
            let gathered = minimum_jerk((time - self.delays[finger]) / GATHERING_S);
            // The force approaches its target slowly.
            let easing = (1.0 - pressed / self.share[finger]).clamp(0.15, 1.0);
            tips[finger] -= normal * (self.speed * gathered * easing * STEP_S);
        }
        let went = |time: f64| minimum_jerk(time / self.overrun_time.max(STEP_S));
        palm.translation.vector += self.overrun * (went(time) - went(time - STEP_S));
        let rests = self.overrun == Vector3::zeros() || time >= self.overrun_time;
        rests && self.stopped.iter().all(|stopped| *stopped)
    }
}

/// A straight path that a contact ends.
pub(super) struct GuardedMove {
    /// Direction, unit.
    pub(super) along: Vector3<f64>,
    /// Speed, m/s.
    pub(super) speed: f64,
    /// Length, m.
    pub(super) distance: f64,
    /// The distance covered so far, m.
    pub(super) gone: f64,
    /// The body that ends the path, and the distance to it at the end, m.
    pub(super) until: Option<(usize, f64)>,
    /// Whether that body was touched.
    pub(super) has_met: bool,
    pub(super) press: Option<WallPressMotion>,
}

/// A force that keeps the object against a body during a motion.
pub(super) struct WallPressMotion {
    pub(super) against: usize,
    /// Direction towards it, unit.
    pub(super) toward: Vector3<f64>,
    /// Force, N.
    pub(super) force: f64,
    /// The deviation of the hand towards the body, m, the length of the path over which it occurs, m, and the deviation so far, m.
    pub(super) waver: f64,
    pub(super) span: f64,
    pub(super) wavered: f64,
}

impl GuardedMove {
    /// Returns the desired velocity, m/s, and whether the path is over. Uses the forces of one reaction time ago, and for reflexes the current ones. The
    /// deviation moves the palm directly.
    pub(super) fn step(
        &mut self,
        grip: &HandGrip,
        world: &World,
        felt: &SensorSample,
        reflex: &SensorSample,
        palm: &mut Isometry3<f64>,
    ) -> (Vector3<f64>, bool) {
        let left = self.distance - self.gone;
        let (gap, reached) = self.until.map_or((f64::INFINITY, false), |(until, within)| {
            let gap = world.gap(grip.object, until) - within;
            (gap, felt.touching(grip.object, until) || within > 0.0 && gap <= 0.0)
        });
        let speed = self.speed.min(ARRIVING + SLOWING * gap.min(left).max(0.0));
        let eases = if self.along.z < 0.0 { LANDING } else { grip.weight.max(EASING) };
        let met = reflex.total().dot(&self.along) / eases;
        let mut wanted = self.along * speed * (2.0 - met).clamp(-1.0, 1.0);
        if let Some(press) = &mut self.press {
            let towards = if felt.touching(grip.object, press.against) {
                (FOLLOWING * (press.force - felt.total().dot(&press.toward))).clamp(-SEEKING, SEEKING)
            } else {
                SEEKING
            };
            wanted += press.toward * towards;
            let waver = press.waver * bump(self.gone / press.span);
            palm.translation.vector += press.toward * (waver - press.wavered);
            press.wavered = waver;
        }
        self.gone += speed * STEP_S;
        // The hand senses the contact that ends the path with a delay.
        self.has_met |= reached || self.until.is_some_and(|(until, _)| reflex.touching(grip.object, until));
        (wanted, left <= 0.0 || reached)
    }

    /// Returns the index of the body that should have ended the path and was not touched.
    pub(super) fn unmet(&self) -> Option<usize> {
        self.until.filter(|_| !self.has_met).map(|(until, _)| until)
    }
}
