//! Grip force: limits of the finger forces, and the slip reflex. A hand that feels an object about to slip holds it more firmly, as humans do. People hold with
//! little more than the least sufficient force because they feel each slip early. A robot that copied their forces without this reflex would drop objects.

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
    /// Contact forces below this are ignored, N.
    felt_n: f64,
    /// The rates at which the extra force rises while a fingertip is about to slip and falls afterwards, 1/s.
    rises: f64,
    falls: f64,
    /// The maximum extra force, as a share of the commanded forces.
    most: f64,
    /// The maximum force of a fingertip that the reflex commands, N; the limit of the touch law is above it.
    hardest_n: f64,
    /// The maximum share of a finger's force limit that any command uses, because forces are inexact.
    share: f64,
}

impl Default for Gains {
    fn default() -> Self {
        Self { about_to_slip: 0.6, felt_n: 0.05, rises: 8.0, falls: 0.1, most: 1.5, hardest_n: 4.0, share: 0.9 }
    }
}

/// The slip reflex of a hand.
#[derive(Clone, Debug)]
pub(crate) struct GripForce {
    gains: Gains,
    /// The force limit of each finger, N.
    limits: Vec<(Finger, f64)>,
    /// The extra force, as a share of the commanded forces.
    more: f64,
    /// The grip force of the last step.
    grip: Option<GripForceTotals>,
}

impl GripForce {
    /// Returns the grip force of a hand before any slip.
    pub(super) fn new(hand: &HandModel) -> Self {
        let limits = hand.fingers.iter().map(|finger| (finger.finger, finger.force)).collect();
        Self { gains: Gains::default(), limits, more: 0.0, grip: None }
    }
}

impl Behavior for GripForce {
    /// Scales all forces uniformly to the hand's limits, so that they stay in balance. When one of the fingertips that hold between thumb and fingers is about
    /// to slip, adds the same normal force to each of them.
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

/// Returns the inward surface normal where a fingertip touches a body, and whether the fingertip is about to slip there.
fn felt(tip: &TipState, body: usize, gains: &Gains) -> Option<(Finger, Vector3<f64>, bool)> {
    let touch = tip.touches.iter().find(|touch| touch.body == body)?;
    let inward = -touch.normal;
    let presses = touch.force.dot(&inward);
    let along = (touch.force - inward * presses).norm();
    Some((tip.finger, inward, presses > gains.felt_n && along > gains.about_to_slip * FRICTION * presses))
}
