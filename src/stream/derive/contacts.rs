//! What the target of a hand touches: one slot a body that some object may touch.
//!
//! Contacts come from the log, `contact.<a>.<b>`, read in either orientation. [`contacts`] is the only place that asks where a contact comes from.

use super::motion::vector;
use crate::stream::measured::Measured;
use nalgebra::Vector3;

/// A force on a contact that is less than this has no direction worth the name, N.
const DIRECTED_ABOVE: f64 = 1e-6;
/// Two bodies touch while the force between them is above this, N …
pub const TOUCH_ON: f64 = 0.05;
/// … until it is below this, N.
pub const TOUCH_OFF: f64 = 0.02;

/// The contact between two bodies over the whole log, as seen by the first.
#[derive(Clone, Copy)]
pub struct Contact<'a> {
    force: Option<[&'a [f64]; 3]>,
    normal: Option<[&'a [f64]; 3]>,
    flag: Option<&'a [f64]>,
    /// 1 when the log has it as seen by the first body, -1 when by the second.
    sign: f64,
}

impl<'a> Contact<'a> {
    /// The contact between two bodies, if the log has it.
    pub fn between(measured: &'a Measured, body: &str, other: &str) -> Option<Self> {
        let read = |a: &str, b: &str, sign: f64| {
            let name = format!("contact.{a}.{b}");
            let (force, flag) = (measured.vec3(&format!("{name}.force")), measured.scalar(&name));
            (force.is_some() || flag.is_some()).then(|| Self {
                force,
                normal: measured.vec3(&format!("{name}.normal")),
                flag,
                sign,
            })
        };
        read(body, other, 1.0).or_else(|| read(other, body, -1.0))
    }

    /// Force of the other body on this one, reference frame, N.
    pub fn force(&self, frame: usize) -> Vector3<f64> {
        self.force.map_or_else(Vector3::zeros, |force| vector(&force, frame) * self.sign)
    }

    /// Unit normal from the other body to this one, reference frame: as logged, else the direction of the force; zero without contact.
    pub fn normal(&self, frame: usize) -> Vector3<f64> {
        let normal = self.normal.map_or_else(Vector3::zeros, |normal| vector(&normal, frame) * self.sign);
        normal
            .try_normalize(1e-6)
            .or_else(|| self.force(frame).try_normalize(DIRECTED_ABOVE))
            .unwrap_or_else(Vector3::zeros)
    }

    /// Whether the bodies touch at each frame of a log: as logged, else from the force.
    pub fn touching(&self, frame: usize, was: bool) -> bool {
        match self.flag.and_then(|flag| flag.get(frame)) {
            Some(flag) => *flag > 0.5,
            None if was => self.force(frame).norm() >= TOUCH_OFF,
            None => self.force(frame).norm() > TOUCH_ON,
        }
    }
}

/// The bodies that some object may touch, as indices in the scene, in scene order.
pub fn partners(measured: &Measured, objects: &[usize]) -> Vec<usize> {
    let name = |body: usize| measured.scene.bodies.get_index(body).map(|(name, _)| name.as_str());
    let touched = |body: &usize| {
        let pairs = objects.iter().filter(|object| *object != body);
        pairs
            .filter_map(|object| name(*object).zip(name(*body)))
            .any(|(object, body)| Contact::between(measured, object, body).is_some())
    };
    (0..measured.scene.bodies.len()).filter(touched).collect()
}
