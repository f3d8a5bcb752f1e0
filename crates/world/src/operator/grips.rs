//! Grips as a hand knows them: the script's contact points, laid on the surface of the scene's object.

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
    /// Weight of the object, N, as a hand of scale 1 knows it that has lifted it before.
    pub(super) weight: f64,
    pub(super) palm_in_object: Isometry3<f64>,
    /// How large the hand is over the person's.
    scale: f64,
    /// How the object was turned at the start, for a round one.
    round: Option<UnitQuaternion<f64>>,
    /// For each finger of the hand: contact point and unit normal out of the object, palm frame; `None` for a finger that is not used.
    pub(super) contacts: Vec<Option<Contact>>,
    /// The normal force to keep on either side, N; `None` while nothing is held.
    pub(super) squeeze: Option<f64>,
}

impl HandGrip {
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
            None => tucked(finger, side) * self.scale,
        })
        .collect()
    }

    /// How many fingers are used.
    pub(super) fn used(&self) -> usize {
        self.contacts.iter().flatten().count()
    }

    /// Half of the distance between opposing contact points, m. Fingers without an object meet this far below its surface.
    pub(super) fn half_width(&self) -> f64 {
        let contacts = || self.contacts.iter().flatten();
        let width =
            |(point, normal): &Contact| contacts().map(|(other, _)| (point - other).dot(normal)).fold(0.0, f64::max);
        contacts().map(width).fold(f64::INFINITY, f64::min) / 2.0
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

/// Moves the fingers that are on one face of an object apart, `scale` times as far from their middle as they were, or as far as the face goes.
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
        // All fingers of a flat face are moved by the same scale: that of the one that comes to its edge first.
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

/// The grip of this name; an error without a place where the operator has none.
pub(super) fn named<'a>(operator: &'a Operator, name: &str) -> Result<&'a Grip, InputError> {
    operator.grips.get(name).ok_or_else(|| {
        let known: Vec<_> = operator.grips.keys().map(|name| format!("`{name}`")).collect();
        let error = refused(format!("names the grip `{name}`, the operator has {}", known.join(", ")));
        meaning(error, nearest(name, operator.grips.keys().map(String::as_str)))
    })
}

/// An error with the name that was meant, where one is near.
fn meaning(error: InputError, near: Option<&str>) -> InputError {
    match near {
        Some(near) => error.help(format!("did you mean `{near}`?")),
        None => error,
    }
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
