//! Drop detection: an object far below everything in the scene is lost, and no later command moves it.

use crate::simulation::observer::{Observer, Step};
use nalgebra::Vector3;
use teachtree_base::scene::Scene;

/// An object this far below the lowest initial body is lost, m.
const LOST_BELOW_M: f64 = 1.0;

/// The time at which each body was last supported, and whether it is lost.
pub(crate) struct DropDetection {
    /// The direction of gravity; zero without gravity.
    down: Vector3<f64>,
    /// The initial coordinate of the lowest body along that direction, m.
    lowest: f64,
    borne_s: Vec<f64>,
    fell_s: Vec<Option<f64>>,
}

impl DropDetection {
    /// Returns the detector before any step.
    pub(crate) fn new(scene: &Scene) -> Self {
        let down = -scene.up();
        let depths = scene.bodies.values().map(|body| down.dot(&Vector3::from(body.position.map(|part| part.0))));
        let lowest = depths.fold(f64::NEG_INFINITY, f64::max);
        let bodies = scene.bodies.len();
        Self { down, lowest, borne_s: vec![0.0; bodies], fell_s: vec![None; bodies] }
    }

    /// Returns the time at which a lost body was last supported, s; `None` for a body that is not lost.
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
