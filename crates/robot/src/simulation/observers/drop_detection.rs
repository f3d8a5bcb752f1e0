//! What falls off: an object far below everything in the scene is lost, and nothing more can be done with it.

use crate::simulation::observer::{Observer, Step};
use nalgebra::Vector3;
use teachtree_base::scene::Scene;

/// An object this far below everything that was there in the beginning is lost, m.
const LOST_BELOW_M: f64 = 1.0;

/// When each body was borne last, and whether it is lost.
pub(crate) struct DropDetection {
    /// Where gravity pulls; zero without.
    down: Vector3<f64>,
    /// How far down along it the lowest body began, m.
    lowest: f64,
    borne_s: Vec<f64>,
    fell_s: Vec<Option<f64>>,
}

impl DropDetection {
    /// Before anything falls.
    pub(crate) fn new(scene: &Scene) -> Self {
        let down = -scene.up();
        let depths = scene.bodies.values().map(|body| down.dot(&Vector3::from(body.position.map(|part| part.0))));
        let lowest = depths.fold(f64::NEG_INFINITY, f64::max);
        let bodies = scene.bodies.len();
        Self { down, lowest, borne_s: vec![0.0; bodies], fell_s: vec![None; bodies] }
    }

    /// When a body fell off, s: when something bore it for the last time; `None` while it is there.
    pub(crate) fn fell_s(&self, body: usize) -> Option<f64> {
        self.fell_s[body]
    }
}

impl Observer for DropDetection {
    fn observe(&mut self, step: &Step<'_>) {
        let (seen, time_s) = (step.seen, step.time_s());
        for contact in seen.contacts.iter().filter(|contact| contact.force != Vector3::zeros()) {
            self.borne_s[contact.body] = time_s;
            self.borne_s[contact.other] = time_s;
        }
        for touch in seen.hands.iter().flat_map(|hand| &hand.tips).flat_map(|tip| &tip.touches) {
            self.borne_s[touch.body] = time_s;
        }
        for (body, fell_s) in self.fell_s.iter_mut().enumerate().filter(|(_, fell_s)| fell_s.is_none()) {
            let depth = self.down.dot(&seen.bodies[body].pose.translation.vector);
            *fell_s = (depth > self.lowest + LOST_BELOW_M).then_some(self.borne_s[body]);
        }
    }
}
