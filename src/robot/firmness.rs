//! Firmness: a hand that feels an object about to slip holds it more firmly, as people do (the grip reflex). People who hold with the least force that
//! will do feel each slip coming; a robot that copied their forces without that would lose what they held.

use super::hand::HandModel;
use super::plan::Target;
use super::righting::holds;
use crate::base::hands::Finger;
use crate::command::FRICTION;
use crate::world::TipState;
use nalgebra::Vector3;

/// A fingertip is about to slip when it feels more than this share of friction along the surface.
const ABOUT_TO_SLIP: f64 = 0.6;
/// Lighter touches tell nothing, N.
const FELT_N: f64 = 0.05;
/// How fast a hand holds more firmly while it feels that, and how fast it gives that up afterwards, 1/s; and at most how much more firmly, as a share.
const RISES: f64 = 8.0;
const FALLS: f64 = 0.1;
const MOST: f64 = 1.5;
/// No fingertip is asked for more than this on its account, N: the touch law's ceiling is above it.
const HARDEST_N: f64 = 4.0;
/// Nor for more than this share of what it may press with, whoever asks: forces are not as exact as that.
const SHARE: f64 = 0.9;

/// How much more firmly than it was taught a hand holds.
#[derive(Default)]
pub(super) struct Firmness {
    more: f64,
}

impl Firmness {
    /// Leaves the forces of a target to what the hand may press with, all fingers alike, so that they stay in balance; and adds to those that hold between thumb and fingers what keeps the object from slipping, into its surface;
    /// `tips` are the fingertips as they are felt, `body` the object, `dt` the step, s.
    pub(super) fn apply(&mut self, target: &mut Target, hand: &HandModel, tips: &[TipState], body: usize, dt: f64) {
        let may = |finger: Finger| SHARE * hand.finger(finger).map_or(f64::INFINITY, |finger| finger.force);
        let asked = target.tips.iter().map(|(finger, _, force)| force.norm() / may(*finger)).fold(0.0, f64::max);
        target.tips.iter_mut().for_each(|(.., force)| *force /= asked.max(1.0));
        if !holds(target) {
            self.more = 0.0;
            return;
        }
        let pressed: Vec<(Finger, Vector3<f64>, bool)> = tips.iter().filter_map(|tip| felt(tip, body)).collect();
        let slips = pressed.iter().any(|(.., slips)| *slips);
        self.more = if slips { (self.more + RISES * dt).min(MOST) } else { self.more * (1.0 - FALLS * dt) };
        // All fingers alike, so that they stay in balance.
        let room = target.tips.iter().map(|(finger, _, force)| may(*finger).min(HARDEST_N) / force.norm());
        let more = self.more.min((room.fold(f64::INFINITY, f64::min) - 1.0).max(0.0));
        for (finger, _, force) in &mut target.tips {
            if let Some((_, inward, _)) = pressed.iter().find(|(other, ..)| other == finger) {
                *force += inward * (force.dot(inward).max(0.0) * more);
            }
        }
    }
}

/// The way into the surface where a fingertip touches a body, and whether it is about to slip there.
fn felt(tip: &TipState, body: usize) -> Option<(Finger, Vector3<f64>, bool)> {
    let touch = tip.touches.iter().find(|touch| touch.body == body)?;
    let inward = -touch.normal;
    let presses = touch.force.dot(&inward);
    let along = (touch.force - inward * presses).norm();
    Some((tip.finger, inward, presses > FELT_N && along > ABOUT_TO_SLIP * FRICTION * presses))
}
