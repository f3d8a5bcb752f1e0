//! Grips as a hand knows them: the script's contact points, laid on the surface of the scene's object.

use super::{Grip, Operator};
use crate::base::error::InputError;
use crate::base::hands::{Finger, Side};
use crate::base::quantity::Length;
use crate::base::scene::{Hand, Scene};
use crate::world::World;
use crate::world::shapes::isometry;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

/// The palm is above the middle of the contact points by this, m.
const PALM_ABOVE_M: f64 = 0.100;
/// What a hand takes a body to weigh of which it knows nothing, N.
const LEAST_WEIGHT_N: f64 = 1e-3;

/// A grip of one hand.
#[derive(Clone)]
pub(super) struct Held {
    /// Index of the object in the scene.
    pub(super) object: usize,
    /// Weight of the object, N, as a hand knows it that has lifted it before.
    pub(super) weight: f64,
    pub(super) palm_in_object: Isometry3<f64>,
    /// How the object was turned at the start, for a round one.
    round: Option<UnitQuaternion<f64>>,
    /// For each finger of the hand: contact point and unit normal out of the object, palm frame; `None` for a finger that is not used.
    pub(super) contacts: Vec<Option<(Point3<f64>, Vector3<f64>)>>,
    /// The normal force to keep on either side, N; `None` while nothing is held.
    pub(super) squeeze: Option<f64>,
}

impl Held {
    /// The grip of this name, for this hand of the scene.
    ///
    /// # Errors
    /// A name or finger that operator, scene or hand do not have.
    pub(super) fn new(
        name: &str,
        scene: &Scene,
        operator: &Operator,
        hand: &Hand,
        world: &World,
    ) -> Result<Self, InputError> {
        let grip: &Grip = operator.grips.get(name).ok_or_else(|| {
            let known: Vec<_> = operator.grips.keys().map(|name| format!("`{name}`")).collect();
            refused(format!("names the grip `{name}`, the operator has {}", known.join(", ")))
        })?;
        let object = body(scene, &grip.object)?;
        if let Some(finger) = grip.contacts.keys().find(|finger| !hand.fingers.contains(finger)) {
            return Err(refused(format!(
                "uses the grip `{name}` with the {finger}, which the hand of the scene does not have"
            )));
        }
        if grip.contacts.is_empty() {
            return Err(refused(format!("uses the grip `{name}`, which has no contacts")));
        }
        let points = grip.contacts.values().map(vector);
        let middle = points.sum::<Vector3<f64>>() / grip.contacts.len() as f64;
        let palm = grip.palm.as_ref().map_or(middle + Vector3::z() * PALM_ABOVE_M, vector);
        let palm_in_object = Isometry3::from_parts(palm.into(), UnitQuaternion::identity());
        let contacts = hand.fingers.iter().map(|finger| {
            let (point, normal) = world.surface(object, vector(grip.contacts.get(finger)?).into())?;
            Some((palm_in_object.inverse_transform_point(&point), palm_in_object.inverse_transform_vector(&normal)))
        });
        let gravity = Vector3::from(scene.gravity.map(|part| part.0)).norm();
        let mass = scene.bodies.get_index(object).and_then(|(_, body)| body.mass).map_or(0.0, |mass| mass.0);
        let weight = (mass * gravity).max(LEAST_WEIGHT_N);
        let start = scene.bodies.get_index(object).and_then(|(_, body)| isometry([0.0; 3], body.rotation).ok());
        let round = start.filter(|_| grip.round).map(|start| start.rotation);
        Ok(Self { object, weight, palm_in_object, round, contacts: contacts.collect(), squeeze: None })
    }

    /// Where the palm is at this grip now, reference frame.
    pub(super) fn palm(&self, world: &World) -> Isometry3<f64> {
        let object = world.observation().bodies.get(self.object).map_or_else(Isometry3::identity, |body| body.pose);
        let object = Isometry3::from_parts(object.translation, self.round.unwrap_or(object.rotation));
        object * self.palm_in_object
    }

    /// The fingertips at this distance from the surface, palm frame; those that are not used are tucked.
    pub(super) fn opened(&self, distance: f64, hand: &Hand, side: Side) -> Vec<Point3<f64>> {
        let tips = hand.fingers.iter().zip(&self.contacts);
        tips.map(|(&finger, contact)| match contact {
            Some((point, normal)) => point + normal * (hand.tip_radius.0 + distance),
            None => tucked(finger, side),
        })
        .collect()
    }

    /// How many fingers are used.
    pub(super) fn used(&self) -> usize {
        self.contacts.iter().flatten().count()
    }

    /// Whether the thumb works against other fingers.
    pub(super) fn is_opposed(&self, hand: &Hand) -> bool {
        let thumb = hand
            .fingers
            .iter()
            .zip(&self.contacts)
            .any(|(&finger, contact)| finger == Finger::Thumb && contact.is_some());
        thumb && self.used() > 1
    }
}

/// Index of the body of this name.
///
/// # Errors
/// The scene has no such body.
pub(super) fn body(scene: &Scene, name: &str) -> Result<usize, InputError> {
    scene.bodies.get_index_of(name).ok_or_else(|| {
        let known: Vec<_> = scene.bodies.keys().map(|name| format!("`{name}`")).collect();
        refused(format!("names the body `{name}`, the scene has {}", known.join(", ")))
    })
}

/// An error whose place the caller knows.
pub(super) fn refused(message: String) -> InputError {
    InputError::new("", message)
}

/// Where a fingertip is that is not used, palm frame, m: curled in, clear of what the others touch.
pub(super) fn tucked(finger: Finger, side: Side) -> Point3<f64> {
    let [x, y, z] = match finger {
        Finger::Thumb => [-0.030, -0.030, -0.010],
        Finger::Index => [-0.030, 0.030, -0.010],
        Finger::Middle => [-0.010, 0.035, -0.010],
        Finger::Ring => [0.015, 0.030, 0.0],
        Finger::Little => [0.035, 0.020, 0.0],
        Finger::Palm => [0.0; 3],
    };
    Point3::new(if side == Side::Right { x } else { -x }, y, z)
}

fn vector(lengths: &[Length; 3]) -> Vector3<f64> {
    Vector3::from(lengths.map(|length| length.0))
}
