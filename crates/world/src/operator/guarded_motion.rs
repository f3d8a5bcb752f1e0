//! Motions that are guided by touch: fingers that close until they feel enough, and a hand that goes straight on until it meets something.

use super::grips::HandGrip;
use super::motion::bump;
use super::sensor_history::SensorSample;
use crate::{STEP_S, World};
use nalgebra::{Isometry3, Point3, Vector3};
use teachtree_base::easing::minimum_jerk;

/// Fingers that find nothing stop this far below the surface, m.
pub(super) const CLOSED_BELOW_M: f64 = 0.020;
/// A finger needs this long to come up to speed, s.
const GATHERING_S: f64 = 0.1;
/// The hand is as slow as this when it expects a contact, m/s, and faster by this for every metre that is left, 1/s.
const ARRIVING: f64 = 0.015;
const SLOWING: f64 = 3.0;
/// A hand eases off when it meets more than this, N, or more than the weight of what it handles; at three times as much it turns back.
pub(super) const EASING: f64 = 0.5;
/// The same for what is set down, however heavy it is: the table bears it.
pub(super) const LANDING: f64 = 0.3;
/// Speed at which a lost contact is sought, m/s.
pub(super) const SEEKING: f64 = 0.025;
/// How fast the hand follows a pressing force that is too large or too small, m/s per N.
pub(super) const FOLLOWING: f64 = 0.006;

/// Fingers that close.
pub(super) struct CloseMotion {
    /// How late each finger starts, s.
    pub(super) delays: Vec<f64>,
    /// Which fingers have found their force; those that are not used have from the start.
    pub(super) stopped: Vec<bool>,
    /// The force of each finger, N.
    pub(super) share: Vec<f64>,
    /// Speed of the fingertips, m/s.
    pub(super) speed: f64,
    /// How far the palm still moves on meanwhile, m, and how long that takes, s.
    pub(super) overrun: Vector3<f64>,
    pub(super) overrun_time: f64,
    /// Fingers that find nothing stop this far below the surface, m.
    pub(super) below: f64,
}

impl CloseMotion {
    /// Moves fingertips (palm frame) and palm for another step, `time` seconds after the start; whether all fingers have found their force and the
    /// hand has come to rest.
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
            // The last of the force is built up slowly.
            let easing = (1.0 - pressed / self.share[finger]).clamp(0.15, 1.0);
            tips[finger] -= normal * (self.speed * gathered * easing * STEP_S);
        }
        let went = |time: f64| minimum_jerk(time / self.overrun_time.max(STEP_S));
        palm.translation.vector += self.overrun * (went(time) - went(time - STEP_S));
        let rests = self.overrun == Vector3::zeros() || time >= self.overrun_time;
        rests && self.stopped.iter().all(|stopped| *stopped)
    }
}

/// A straight way that is guided by touch.
pub(super) struct GuardedMove {
    /// Direction, unit.
    pub(super) along: Vector3<f64>,
    /// m/s.
    pub(super) speed: f64,
    /// m.
    pub(super) distance: f64,
    /// How much of it lies behind, m.
    pub(super) gone: f64,
    /// The body that ends it, and the distance at which it does, m.
    pub(super) until: Option<(usize, f64)>,
    /// Whether that body was met.
    pub(super) has_met: bool,
    pub(super) press: Option<WallPressMotion>,
}

/// Keeping the object against a body under way.
pub(super) struct WallPressMotion {
    pub(super) against: usize,
    /// Direction towards it, unit.
    pub(super) toward: Vector3<f64>,
    /// N.
    pub(super) force: f64,
    /// How far the hand wavers, m, towards the body, over this much of the way, m; and how far it has.
    pub(super) waver: f64,
    pub(super) span: f64,
    pub(super) wavered: f64,
}

impl GuardedMove {
    /// The velocity that is wanted now, m/s, from what was felt a reaction time ago and, by reflex, just now; and whether the way is over.
    /// The waver moves the palm by itself.
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
        // What ends the way is felt later than it is met.
        self.has_met |= reached || self.until.is_some_and(|(until, _)| reflex.touching(grip.object, until));
        (wanted, left <= 0.0 || reached)
    }

    /// The body that should have ended it and was not met, by its index in the scene.
    pub(super) fn unmet(&self) -> Option<usize> {
        self.until.filter(|_| !self.has_met).map(|(until, _)| until)
    }
}
