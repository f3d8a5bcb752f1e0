//! Grips of a hand: the script's contact points, projected onto the surface of the scene's object.

use super::{Grip, Operator};
use crate::World;
use crate::shapes::isometry;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use teachtree_base::error::InputError;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::quantity::Length;
use teachtree_base::scene::{Hand, Scene};
use teachtree_base::spelling::nearest;

/// The height of the palm above the middle of the contact points, m.
const PALM_ABOVE_M: f64 = 0.100;
/// The weight that a hand assumes for an unknown body, N.
const LEAST_WEIGHT_N: f64 = 1e-3;
/// Minimum cosine between the normals of fingers on one side of an object. `FLAT` is the same for fingers on a flat face. A point that moves along a face or a
/// round side stays on it while the surface is within `ON_FACE_M` or `ON_ROUND_M` (m), and the cosine between the normals is at least `TURNED`.
const ONE_SIDE: f64 = 0.25;
const FLAT: f64 = 0.999;
const ON_FACE_M: f64 = 1e-4;
const ON_ROUND_M: f64 = 4e-3;
const TURNED: f64 = 0.85;
/// Number of distances that are tried for fingers that would leave the face.
const SPREADS: u32 = 20;

/// A point of a surface and the unit normal out of it.
type Contact = (Point3<f64>, Vector3<f64>);

/// A grip of one hand.
#[derive(Clone)]
pub(super) struct HandGrip {
    /// Index of the object in the scene.
    pub(super) object: usize,
    /// Weight of the object for a hand of scale 1, N.
    pub(super) weight: f64,
    pub(super) palm_in_object: Isometry3<f64>,
    /// The size of the hand relative to the operator's hand.
    scale: f64,
    /// The initial orientation of a round object.
    round: Option<UnitQuaternion<f64>>,
    /// The contact point and outward unit normal of each finger, palm frame; `None` for an unused finger.
    pub(super) contacts: Vec<Option<Contact>>,
    /// The normal force to keep on either side, N; `None` while nothing is held.
    pub(super) squeeze: Option<f64>,
}

impl HandGrip {
    /// Returns the grip of this name, for this hand of the scene.
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
        let grip = named(operator, name)?;
        let in_grip = |key: &str, error: InputError| InputError { place: format!("grips.{name}.{key}"), ..error };
        let object = body(scene, &grip.object).map_err(|error| in_grip("object", error))?;
        if let Some(finger) = grip.contacts.keys().find(|finger| !hand.fingers.contains(finger)) {
            return Err(refused(format!(
                "uses the grip `{name}` with the {finger}, which the hand of the scene does not have"
            )));
        }
        if grip.contacts.is_empty() {
            return Err(in_grip("contacts", refused("has no contacts".into())));
        }
        let scale = operator.hands_scale;
        let points = grip.contacts.values().map(vector);
        let middle = points.sum::<Vector3<f64>>() / grip.contacts.len() as f64;
        let palm = grip.palm.as_ref().map_or(middle + Vector3::z() * PALM_ABOVE_M, vector);
        let palm_in_object =
            Isometry3::from_parts((palm + (palm - middle) * (scale - 1.0)).into(), UnitQuaternion::identity());
        let mut contacts: Vec<Option<Contact>> = hand
            .fingers
            .iter()
            .map(|finger| world.surface(object, vector(grip.contacts.get(finger)?).into()))
            .collect();
        spread(&mut contacts, scale, |point| world.surface(object, point));
        let in_palm = |(point, normal): Contact| {
            (palm_in_object.inverse_transform_point(&point), palm_in_object.inverse_transform_vector(&normal))
        };
        let contacts = contacts.into_iter().map(|contact| contact.map(in_palm)).collect();
        let gravity = Vector3::from(scene.gravity.map(|part| part.0)).norm();
        let mass = scene.bodies.get_index(object).and_then(|(_, body)| body.mass).map_or(0.0, |mass| mass.0);
        let weight = (mass * gravity / operator.force_scale).max(LEAST_WEIGHT_N);
        let start = scene.bodies.get_index(object).and_then(|(_, body)| isometry([0.0; 3], body.rotation).ok());
        let round = start.filter(|_| grip.round).map(|start| start.rotation);
        Ok(Self { object, weight, palm_in_object, scale, round, contacts, squeeze: None })
    }

    /// Returns the current pose of the palm at this grip, reference frame.
    pub(super) fn palm(&self, world: &World) -> Isometry3<f64> {
        let object = world.observation().bodies.get(self.object).map_or_else(Isometry3::identity, |body| body.pose);
        let object = Isometry3::from_parts(object.translation, self.round.unwrap_or(object.rotation));
        object * self.palm_in_object
    }

    /// Returns the fingertips at this distance from the surface, palm frame; unused ones are tucked.
    pub(super) fn opened(&self, distance: f64, hand: &Hand, side: Side) -> Vec<Point3<f64>> {
        let tips = hand.fingers.iter().zip(&self.contacts);
        tips.map(|(&finger, contact)| match contact {
            Some((point, normal)) => point + normal * (hand.tip_radius.0 + distance),
            None => tucked(finger, side) * self.scale,
        })
        .collect()
    }

    /// Returns the number of used fingers.
    pub(super) fn used(&self) -> usize {
        self.contacts.iter().flatten().count()
    }

    /// Returns half of the distance between opposing contact points, m. Without the object, fingers would meet this far below its surface.
    pub(super) fn half_width(&self) -> f64 {
        let contacts = || self.contacts.iter().flatten();
        let width =
            |(point, normal): &Contact| contacts().map(|(other, _)| (point - other).dot(normal)).fold(0.0, f64::max);
        contacts().map(width).fold(f64::INFINITY, f64::min) / 2.0
    }

    /// Whether the thumb opposes other fingers.
    pub(super) fn is_opposed(&self, hand: &Hand) -> bool {
        let thumb = hand
            .fingers
            .iter()
            .zip(&self.contacts)
            .any(|(&finger, contact)| finger == Finger::Thumb && contact.is_some());
        thumb && self.used() > 1
    }
}

/// Moves the fingers on one face of an object apart: `scale` times as far from their middle, or to the edge of the face.
fn spread(contacts: &mut [Option<Contact>], scale: f64, surface: impl Fn(Point3<f64>) -> Option<Contact>) {
    if scale == 1.0 {
        return;
    }
    let were: Vec<(usize, Contact)> =
        contacts.iter().enumerate().filter_map(|(finger, contact)| Some((finger, (*contact)?))).collect();
    for &(finger, (point, normal)) in &were {
        let face = were.iter().filter(|(_, (_, other))| other.dot(&normal) > ONE_SIDE);
        let middle =
            face.clone().map(|(_, (point, _))| point.coords).sum::<Vector3<f64>>() / face.clone().count() as f64;
        let flat = face.clone().all(|(_, (_, other))| other.dot(&normal) > FLAT);
        let off = if flat { ON_FACE_M } else { ON_ROUND_M };
        // All fingers of a flat face have the same scale: that of the finger that reaches the edge first.
        let moved = |(point, normal): &Contact, scale: f64| {
            let wanted = point + (point.coords - middle) * (scale - 1.0);
            surface(wanted).filter(|(on, out)| (on - wanted).norm() < off && out.dot(normal) > TURNED)
        };
        let fits = |scale: &f64| face.clone().all(|(_, contact)| moved(contact, *scale).is_some());
        let tried = (0..=SPREADS).map(|left| 1.0 + (scale - 1.0) * (f64::from(left) / f64::from(SPREADS)));
        let scale = tried.rev().find(fits).unwrap_or(1.0);
        contacts[finger] = moved(&(point, normal), scale).or(Some((point, normal)));
    }
}

/// Index of the body of this name.
///
/// # Errors
/// The scene has no such body.
pub(super) fn body(scene: &Scene, name: &str) -> Result<usize, InputError> {
    scene.bodies.get_index_of(name).ok_or_else(|| {
        let known: Vec<_> = scene.bodies.keys().map(|name| format!("`{name}`")).collect();
        let error = refused(format!("names the body `{name}`, the scene has {}", known.join(", ")));
        meaning(error, nearest(name, scene.bodies.keys().map(String::as_str)))
    })
}

/// Returns the grip of this name, or an error without a place if the operator has no such grip.
pub(super) fn named<'a>(operator: &'a Operator, name: &str) -> Result<&'a Grip, InputError> {
    operator.grips.get(name).ok_or_else(|| {
        let known: Vec<_> = operator.grips.keys().map(|name| format!("`{name}`")).collect();
        let error = refused(format!("names the grip `{name}`, the operator has {}", known.join(", ")));
        meaning(error, nearest(name, operator.grips.keys().map(String::as_str)))
    })
}

/// Adds a similar name to an error, if there is one.
fn meaning(error: InputError, near: Option<&str>) -> InputError {
    match near {
        Some(near) => error.help(format!("did you mean `{near}`?")),
        None => error,
    }
}

/// Returns an error whose place the caller adds.
pub(super) fn refused(message: String) -> InputError {
    InputError::new("", message)
}

/// Returns the position of an unused fingertip, palm frame, m: curled in, clear of the object.
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
