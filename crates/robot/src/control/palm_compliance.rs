//! Palm compliance: the palm of a gripper gives way to forces, and presses with them, where its jaws cannot.
//!
//! A finger exerts force in all directions by itself; a jaw only along its line, and across that the arm holds it as firmly as it can. So that a gripper presses
//! a stamp down, or gives way at the rim of a hole, as fingers do, its palm follows the force that is missing like a spring (admittance control):
//!
//! ```text
//! ẋ = (f_d - f - K x) / D        x: shift of the palm, f_d, f: sums of what the jaws are to exert and exert, without what jaws with a motor each do themselves
//! ```
//!
//! which is what impedance control of two fingertips comes to, docs/sources.md, Control: `K = 2 K_p / (1 + K_f)`.

use crate::control::impedance::Gains;
use crate::model::gripper::{Jaw, Jaws};
use crate::planning::plan::Target;
use nalgebra::{Translation3, Vector3};
use teachtree_world::TouchLaw;

/// D along the line of the jaws and across it, as times the stiffness of both contacts, s: the force follows within this time, slower than arms do.
const FOLLOWS_S: [f64; 2] = [0.08, 0.114];
/// The palm gives way no farther, m.
const MOST_M: f64 = 0.02;

/// The line from the thumb to the other jaw as far open as the target has them, palm frame.
fn line_of(jaws: &Jaws, target: &Target) -> Vector3<f64> {
    let tip = |jaw: &Jaw| target.tips.iter().find(|(finger, ..)| *finger == jaw.finger).map(|(_, tip, _)| *tip);
    let [thumb, other] = [&jaws.pair[0], &jaws.pair[1]];
    let opening = tip(thumb).zip(tip(other)).map(|(one, two)| (two - one).norm() - thumb.radius - other.radius);
    let share = opening.map_or(0.5, |opening| jaws.share(opening).clamp(0.0, 1.0));
    jaws.stance(share).along.into_inner()
}

/// How far a palm gives way, reference frame, m.
#[derive(Clone, Debug, Default)]
pub(crate) struct PalmCompliance {
    shift: Vector3<f64>,
}

impl PalmCompliance {
    /// A target shifted by what the forces of the fingertips, N, are not as they are to be, after a step of `dt`, s.
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
