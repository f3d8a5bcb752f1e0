//! The state of the world in one millisecond, as far as the ground truth uses it.

use crate::simulation::{BodyState, Observation};
use nalgebra::{Isometry3, Point3, Vector3};
use teachtree_base::geometry::surface_distance;
use teachtree_base::hands::Finger;
use teachtree_base::scene::Body;

/// The state of the world in one millisecond.
pub(crate) struct WorldState {
    pub(super) hands: Vec<Vec<Tip>>,
    pub(super) palms: Vec<Isometry3<f64>>,
    pub(super) bodies: Vec<BodyState>,
    pub(super) contacts: Vec<Contact>,
}

/// A fingertip.
pub(super) struct Tip {
    pub(super) finger: Finger,
    pub(super) position: Point3<f64>,
    /// The touched bodies, and the force on each, N.
    touches: Vec<(usize, Vector3<f64>)>,
}

/// Two bodies that may touch.
pub(super) struct Contact {
    pub(super) body: usize,
    pub(super) other: usize,
    /// The unit normal from the other body to this one.
    pub(super) normal: Vector3<f64>,
    pub(super) touching: bool,
    /// The force of the other body on this one, N.
    pub(super) force: Vector3<f64>,
}

impl WorldState {
    /// Returns the state of an observation.
    pub(crate) fn new(seen: &Observation) -> Self {
        let hands = seen.hands.iter().map(|hand| {
            let tips = hand.tips.iter().map(|tip| Tip {
                finger: tip.finger,
                position: tip.position,
                touches: tip.touches.iter().map(|touch| (touch.body, touch.force)).collect(),
            });
            tips.collect()
        });
        let contacts = seen.contacts.iter().map(|contact| Contact {
            body: contact.body,
            other: contact.other,
            normal: contact.normal,
            touching: contact.force.norm() > 0.0,
            force: contact.force,
        });
        let palms = seen.hands.iter().map(|hand| hand.palm).collect();
        Self { hands: hands.collect(), palms, bodies: seen.bodies.clone(), contacts: contacts.collect() }
    }

    /// Whether a fingertip of this hand presses on one of these bodies.
    pub(crate) fn touches_any(&self, bodies: &[usize]) -> bool {
        self.hands.iter().flatten().any(|tip| bodies.iter().any(|body| tip.force_on(*body).is_some()))
    }

    /// Returns the middle of the fingertips of a hand, m.
    pub(super) fn middle(&self, hand: usize) -> Point3<f64> {
        let tips = &self.hands[hand];
        let sum: Vector3<f64> = tips.iter().map(|tip| tip.position.coords).sum();
        (sum / tips.len().max(1) as f64).into()
    }

    /// Returns the distance of the nearest fingertip of a hand from the surface of a body, m.
    pub(super) fn distance(&self, hand: usize, shape: &Body, body: usize) -> f64 {
        let pose = &self.bodies[body].pose;
        let tips = self.hands[hand].iter();
        tips.map(|tip| surface_distance(shape, &pose.inverse_transform_point(&tip.position)))
            .fold(f64::INFINITY, f64::min)
    }

    /// Returns the distance between the pads of the thumb and of the nearest other finger, m; `None` without a thumb or another finger. It is negative if
    /// the balls of the fingertips overlap.
    pub(crate) fn opening(&self, hand: usize, tip_radius: f64) -> Option<f64> {
        let tips = &self.hands[hand];
        let thumb = tips.iter().find(|tip| tip.finger == Finger::Thumb)?;
        let others = tips.iter().filter(|tip| tip.finger != Finger::Thumb);
        let nearest = others.map(|tip| (tip.position - thumb.position).norm()).min_by(f64::total_cmp)?;
        Some(nearest - 2.0 * tip_radius)
    }

    /// Whether a fingertip of this hand presses on a body.
    pub(super) fn is_touched(&self, hand: usize, body: usize) -> bool {
        self.hands[hand].iter().any(|tip| tip.force_on(body).is_some())
    }

    /// Whether a body touches another one.
    pub(super) fn is_in_contact(&self, body: usize) -> bool {
        self.contacts_of(body).next().is_some()
    }

    /// Returns the force of the body `of` on the body `on`, N.
    pub(super) fn force_between(&self, on: usize, of: usize) -> Vector3<f64> {
        let forces = self.contacts.iter().filter_map(|contact| match (contact.body, contact.other) {
            pair if pair == (on, of) => Some(contact.force),
            pair if pair == (of, on) => Some(-contact.force),
            _ => None,
        });
        forces.sum()
    }

    /// Returns the contacts of a body: the other body, and the normal from the other body to this one.
    pub(super) fn contacts_of(&self, body: usize) -> impl Iterator<Item = (usize, Vector3<f64>)> {
        self.contacts.iter().filter(|contact| contact.touching).filter_map(move |contact| match body {
            body if body == contact.body => Some((contact.other, contact.normal)),
            body if body == contact.other => Some((contact.body, -contact.normal)),
            _ => None,
        })
    }
}

impl Tip {
    /// Returns the force of this fingertip on a body, N; `None` without contact.
    pub(super) fn force_on(&self, body: usize) -> Option<Vector3<f64>> {
        self.touches.iter().find(|(touched, force)| *touched == body && force.norm() > 0.0).map(|(_, force)| *force)
    }
}
