//! Palm compliance: admittance control of a gripper's palm in the directions in which its jaws cannot control forces.
//!
//! A finger controls its force in all directions; a jaw only along its line of motion, and the arm holds it stiffly across that line. The palm therefore moves
//! by the missing force like a spring, so that a gripper can press a stamp down or yield at the rim of a hole:
//!
//! ```text
//! ẋ = (f_d - f - K x) / D        x: shift of the palm, f_d, f: sums of commanded and exerted jaw forces, without those that jaws with a motor each control
//! ```
//!
//! `K = 2 K_p / (1 + K_f)` is the equivalent stiffness of two fingertips under impedance control (docs/sources.md, Control).

use crate::control::impedance::Gains;
use crate::model::gripper::{Jaw, Jaws};
use crate::planning::plan::Target;
use nalgebra::{Translation3, Vector3};
use teachtree_world::TouchLaw;

/// D over the stiffness of both contacts, along the line of the jaws and across it, s. This is the time constant of the force; it is slower than the arm.
const FOLLOWS_S: [f64; 2] = [0.08, 0.114];
/// The maximum shift of the palm, m.
const MOST_M: f64 = 0.02;

/// Returns the line from the thumb to the other jaw at the opening of the target, palm frame.
fn line_of(jaws: &Jaws, target: &Target) -> Vector3<f64> {
    let tip = |jaw: &Jaw| target.tips.iter().find(|(finger, ..)| *finger == jaw.finger).map(|(_, tip, _)| *tip);
    let [thumb, other] = [&jaws.pair[0], &jaws.pair[1]];
    let opening = tip(thumb).zip(tip(other)).map(|(one, two)| (two - one).norm() - thumb.radius - other.radius);
    let share = opening.map_or(0.5, |opening| jaws.share(opening).clamp(0.0, 1.0));
    jaws.stance(share).along.into_inner()
}

/// The shift of a palm, reference frame, m.
#[derive(Clone, Debug, Default)]
pub(crate) struct PalmCompliance {
    shift: Vector3<f64>,
}

impl PalmCompliance {
    /// Returns a target, shifted by the force error of the fingertips (N) over a step of `dt` (s).
    pub(crate) fn apply(
        &mut self,
        target: &Target,
        (jaws, law): (&Jaws, &TouchLaw),
        exerted: &[Vector3<f64>],
        dt: f64,
    ) -> Target {
        let gains = Gains::default();
        let stiffness = 2.0 * gains.stiffness / (1.0 + gains.force_feedback);
        let asked: Vector3<f64> = target.tips.iter().map(|(.., force)| force).sum();
        let touches = asked != Vector3::zeros() && exerted.iter().any(|force| *force != Vector3::zeros());
        let mut missing = if touches { asked - exerted.iter().sum::<Vector3<f64>>() } else { Vector3::zeros() };
        let line = target.palm.rotation * line_of(jaws, target);
        if !jaws.geared {
            missing -= line * line.dot(&missing);
        }
        let pull = missing - self.shift * stiffness;
        let along = line * line.dot(&pull);
        let [slow_along, slow_across] =
            [law.stiffness * FOLLOWS_S[0], law.tangential_stiffness * FOLLOWS_S[1]].map(|half| 2.0 * half);
        let shift = self.shift + (along / slow_along + (pull - along) / slow_across) * dt;
        if shift.iter().all(|part| part.is_finite()) {
            self.shift = shift * (MOST_M / shift.norm().max(1e-9)).min(1.0);
        }
        let by = Translation3::from(self.shift);
        let mut shifted = target.clone();
        shifted.palm = by * target.palm;
        for (_, tip, _) in &mut shifted.tips {
            *tip = by * *tip;
        }
        shifted
    }
}
