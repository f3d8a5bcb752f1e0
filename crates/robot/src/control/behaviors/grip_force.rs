//! Grip force: forces within what the hand may press with, and the slip reflex. A hand that feels an object about to slip holds it more firmly, as humans do.
//! People who hold with the least force that will do feel each slip coming; a robot that copied their forces without that would lose what they held.

use crate::control::behavior::{Behavior, GripForceTotals, HandObservation, Progress, holds};
use crate::model::hand::HandModel;
use crate::planning::plan::Target;
use nalgebra::Vector3;
use teachtree_base::hands::Finger;
use teachtree_command::FRICTION;
use teachtree_world::TipState;

/// Gains of the grip force; ours, tuned on the shipped scenes and with operators of little reserve (docs/sources.md, Control).
#[derive(Clone, Copy, Debug)]
struct Gains {
    /// A fingertip is about to slip when it feels more than this share of friction along the surface.
    about_to_slip: f64,
    /// Lighter touches are not heeded, N.
    felt_n: f64,
    /// How fast a hand holds more firmly while it feels that, and how fast it gives that up afterwards, 1/s.
    rises: f64,
    falls: f64,
    /// At most how much more firmly, as a share.
    most: f64,
    /// No fingertip is asked for more than this by the reflex, N: the touch law's ceiling is above it.
    hardest_n: f64,
    /// Nor for more than this share of what it may press with, whoever asks: forces are not as exact as that.
    share: f64,
}

impl Default for Gains {
    fn default() -> Self {
        Self { about_to_slip: 0.6, felt_n: 0.05, rises: 8.0, falls: 0.1, most: 1.5, hardest_n: 4.0, share: 0.9 }
    }
}

/// How much more firmly than in the demonstration a hand holds.
#[derive(Clone, Debug)]
pub(crate) struct GripForce {
    gains: Gains,
    /// What each finger may press with, N.
    limits: Vec<(Finger, f64)>,
    /// As a share of the commanded forces.
    more: f64,
    /// The grip force of the last step.
    grip: Option<GripForceTotals>,
}

impl GripForce {
    /// The grip force of a hand that has felt no slip yet.
    pub(super) fn new(hand: &HandModel) -> Self {
        let limits = hand.fingers.iter().map(|finger| (finger.finger, finger.force)).collect();
        Self { gains: Gains::default(), limits, more: 0.0, grip: None }
    }
}

impl Behavior for GripForce {
    /// Scales all forces uniformly to what the hand may press with, so that they stay in balance; then adds normal force, all fingers alike, to those that hold
    /// between thumb and fingers when one is about to slip.
    fn apply(&mut self, sensed: &HandObservation<'_>, target: &mut Target, dt_s: f64) -> Progress {
        let gains = self.gains;
        let limit =
            |finger: Finger| self.limits.iter().find(|(other, _)| *other == finger).map_or(f64::INFINITY, |it| it.1);
        let may = |finger: Finger| gains.share * limit(finger);
        let sum = |target: &Target| target.tips.iter().map(|(.., force)| force.norm()).sum::<f64>();
        let asked = sum(target);
        let most = target.tips.iter().map(|(finger, _, force)| force.norm() / may(*finger)).fold(0.0, f64::max);
        target.tips.iter_mut().for_each(|(.., force)| *force /= most.max(1.0));
        if !holds(target) {
            (self.more, self.grip) = (0.0, None);
            return Progress::Continue;
        }
        let within_limits = sum(target);
        let pressed: Vec<(Finger, Vector3<f64>, bool)> =
            sensed.tips.iter().filter_map(|tip| felt(tip, sensed.body, &gains)).collect();
        let slips = pressed.iter().any(|(.., slips)| *slips);
        self.more = if slips {
            (self.more + gains.rises * dt_s).min(gains.most)
        } else {
            self.more * (1.0 - gains.falls * dt_s)
        };
        let room = target.tips.iter().map(|(finger, _, force)| may(*finger).min(gains.hardest_n) / force.norm());
        let more = self.more.min((room.fold(f64::INFINITY, f64::min) - 1.0).max(0.0));
        for (finger, _, force) in &mut target.tips {
            if let Some((_, inward, _)) = pressed.iter().find(|(other, ..)| other == finger) {
                *force += inward * (force.dot(inward).max(0.0) * more);
            }
        }
        self.grip = Some(GripForceTotals { asked, within_limits, raised: sum(target) });
        Progress::Continue
    }

    fn grip(&self) -> Option<GripForceTotals> {
        self.grip
    }
}

/// The way into the surface where a fingertip touches a body, and whether it is about to slip there.
fn felt(tip: &TipState, body: usize, gains: &Gains) -> Option<(Finger, Vector3<f64>, bool)> {
    let touch = tip.touches.iter().find(|touch| touch.body == body)?;
    let inward = -touch.normal;
    let presses = touch.force.dot(&inward);
    let along = (touch.force - inward * presses).norm();
    Some((tip.finger, inward, presses > gains.felt_n && along > gains.about_to_slip * FRICTION * presses))
}
