//! Pose correction: integral control of the seen pose of a held object, with sway damping ([`SwayDamping`]) added to its rotation. Fingertips hold an object
//! only softly about the line between them, and the object may have slipped.
//!
//! A pushed object cannot be turned freely: the fingers move around it as it turns, and bring its center back onto the path.

use super::sway_damping::SwayDamping;
use crate::control::behavior::{Behavior, HandObservation, Progress, holds};
use crate::model::hand::HandModel;
use crate::planning::plan::Target;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use teachtree_base::scene::Scene;

/// Gains of pose correction; ours, tuned on the shipped scenes (docs/sources.md, Control).
#[derive(Clone, Copy, Debug)]
struct Gains {
    /// Integral gain, 1/s.
    rate: f64,
    /// The largest correction, rad and m.
    most_rad: f64,
    most_m: f64,
    /// The rate at which the correction decays after release, 1/s.
    forgotten: f64,
    /// The rate at which fingers move around a pushed object, 1/s.
    follows: f64,
}

impl Default for Gains {
    fn default() -> Self {
        Self { rate: 2.0, most_rad: 0.35, most_m: 0.020, forgotten: 4.0, follows: 5.0 }
    }
}

/// The rotation and displacement of the hand.
#[derive(Clone, Debug)]
pub(crate) struct PoseCorrection {
    gains: Gains,
    turned: Vector3<f64>,
    moved: Vector3<f64>,
    /// The sway damping; `None` for flat pads, between which objects do not swing.
    sway: Option<SwayDamping>,
    /// The unit vector against gravity; zero without gravity.
    up: Vector3<f64>,
}

impl PoseCorrection {
    /// Returns a correction of zero.
    pub(super) fn new(scene: &Scene, hand: &HandModel) -> Self {
        let (turned, moved) = (Vector3::zeros(), Vector3::zeros());
        let sway = (!hand.has_flat_pads()).then(SwayDamping::default);
        Self { gains: Gains::default(), turned, moved, sway, up: scene.up() }
    }

    /// Integrates the pose error of the object.
    fn gather(&mut self, target: &Target, object: &Isometry3<f64>, held: bool, shared: bool, dt: f64) {
        let Gains { rate, most_rad, most_m, forgotten, follows } = self.gains;
        let error = target.object.translation.vector - object.translation.vector;
        if held && !shared {
            self.turned += (target.object.rotation * object.rotation.inverse()).scaled_axis() * (rate * dt);
            self.turned = within(self.turned, most_rad);
            if target.free {
                self.moved = within(self.moved + error * (rate * dt), most_m);
            }
        } else if target.pushed && !shared {
            let about = (object.rotation * target.object.rotation.inverse()).scaled_axis();
            self.turned += (about - self.turned) * (follows * dt);
            self.turned = within(self.turned, most_rad);
            if target.free {
                // The correction must not press the object into its support.
                self.moved = within(self.moved + (error - self.up * self.up.dot(&error)) * (rate * dt), most_m);
            }
        } else if !held && !target.pushed {
            self.turned *= 1.0 - forgotten * dt;
            self.moved *= 1.0 - forgotten * dt;
        }
    }
}

impl Behavior for PoseCorrection {
    /// Rotates and moves palm and fingertips; the center of the rotation is the middle of the grasp, or the center of a pushed object. Corrects only
    /// unconstrained directions: contacts determine the others. Adds no correction while another hand holds the object too, because the centers of rotation
    /// would differ.
    fn apply(&mut self, sensed: &HandObservation<'_>, target: &mut Target, dt_s: f64) -> Progress {
        let held = holds(target);
        self.gather(target, &sensed.object, held, sensed.shared, dt_s);
        let hangs = held && !sensed.shared && target.free;
        let against = self.sway.as_mut().map_or_else(Vector3::zeros, |sway| {
            if hangs { sway.turn(target, &sensed.object, dt_s) } else { sway.rest() }
        });
        let middle = if target.pushed {
            target.object.translation.vector
        } else {
            target.tips.iter().map(|(_, tip, _)| tip.coords).sum::<Vector3<f64>>() / target.tips.len().max(1) as f64
        };
        let turn = UnitQuaternion::from_scaled_axis(self.turned + against);
        let about = Translation3::from(middle + self.moved) * turn * Translation3::from(-middle);
        target.palm = about * target.palm;
        for (_, tip, _) in &mut target.tips {
            *tip = about * *tip;
        }
        Progress::Continue
    }
}

/// Returns the vector, shortened to this length if it is longer.
fn within(vector: Vector3<f64>, most: f64) -> Vector3<f64> {
    vector * (most / vector.norm().max(1e-9)).min(1.0)
}
