//! The scene of a log: bodies with shapes, roles and sockets, as plain data. It is read from YAML and written beside a CSV log;
//! `world` simulates it, and `frames` uses it to derive contacts, depths and distances.

use super::hands::{Finger, Side};
use super::quantity::{Acceleration, Length, Mass, above_zero, not_below_zero, with_direction};
use super::short_number::ShortNumber;
use indexmap::IndexMap;
use nalgebra::Vector3;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use std::ops::RangeInclusive;

/// Bodies and hands, in the reference frame (z up).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// The name of the scene.
    #[serde(default)]
    pub name: String,
    /// Gravity, reference frame, along -z or zero; default 9.81 m/s^2 downward.
    #[serde(default = "standard_gravity", deserialize_with = "downwards")]
    pub gravity: [Acceleration; 3],
    /// The bodies by name, in file order.
    pub bodies: IndexMap<String, Body>,
    /// The hands and their fingertips, in the order of the log.
    #[serde(default)]
    pub hands: IndexMap<Side, Hand>,
}

/// The schema of scene files.
pub fn schema() -> schemars::Schema {
    schemars::schema_for!(Scene)
}

impl Scene {
    /// Returns the gravity, reference frame, m/s^2.
    pub fn gravity(&self) -> Vector3<f64> {
        Vector3::from(self.gravity.map(|part| part.0))
    }

    /// Returns the direction against gravity, unit, reference frame; zero without gravity.
    pub fn up(&self) -> Vector3<f64> {
        (-self.gravity()).try_normalize(1e-9).unwrap_or_default()
    }
}

/// One rigid body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Its role in the task.
    pub role: Role,
    /// Its shape; several convex parts form a hollow body. Empty if the shape is unknown.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<Part>,
    /// Radius of the bounding ball about the body's origin; computed from the shape if left out.
    #[serde(default, deserialize_with = "above_zero", skip_serializing_if = "Option::is_none")]
    pub radius: Option<Length>,
    /// Mass of a movable body.
    #[serde(default, deserialize_with = "above_zero", skip_serializing_if = "Option::is_none")]
    pub mass: Option<Mass>,
    /// Coefficient of friction against other bodies, static and dynamic (fingertips have their own law).
    #[serde(default = "paper_friction", deserialize_with = "not_below_zero")]
    pub friction: f64,
    /// Position of the body's origin at the start, reference frame.
    #[serde(default)]
    pub position: [Length; 3],
    /// Rotation of the body at the start, quaternion w x y z.
    #[serde(default = "no_rotation", deserialize_with = "with_direction")]
    pub rotation: [f64; 4],
    /// Sockets fixed to this body: holes, or pegs that hollow objects are put on.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub sockets: IndexMap<String, Socket>,
    /// The point of this body that enters a socket, body frame; default the origin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plug: Option<[Length; 3]>,
    /// The hand that this body is fixed to during the whole recording.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fixed_to: Option<Side>,
}

impl Body {
    /// Returns the radius of the bounding ball about the body's origin, m: the given one, else that of the parts.
    pub fn bounding_radius(&self) -> f64 {
        self.radius.map_or_else(|| self.parts.iter().map(Part::bounding_radius).fold(0.0, f64::max), |radius| radius.0)
    }
}

/// The role of a body in the task.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// May be handled; a candidate for `target`.
    Object,
    /// Carries objects, such as a table or base.
    Support,
    /// Beside the objects; a contact with it does not carry.
    Wall,
    /// Fixed, with sockets.
    Socket,
}

/// A convex part of a body.
#[derive(Clone, Debug, PartialEq, Serialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// The shape, about the part's own origin.
    #[serde(flatten)]
    pub shape: Shape,
    /// Position of the part in the body frame.
    #[serde(default)]
    pub at: [Length; 3],
    /// Rotation of the part in the body frame, quaternion w x y z.
    #[serde(default = "no_rotation")]
    pub turned: [f64; 4],
}

/// The keys of a part. Serde does not name the wrong key of a flattened shape, so they are read one by one.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PartKeys {
    #[serde(default, deserialize_with = "edges")]
    r#box: Option<[Length; 3]>,
    #[serde(default, deserialize_with = "radius_and_height")]
    cylinder: Option<[Length; 2]>,
    #[serde(default, deserialize_with = "above_zero")]
    ball: Option<Length>,
    #[serde(default)]
    at: [Length; 3],
    #[serde(default = "no_rotation", deserialize_with = "with_direction")]
    turned: [f64; 4],
}

impl<'de> Deserialize<'de> for Part {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let PartKeys { r#box, cylinder, ball, at, turned } = PartKeys::deserialize(from)?;
        let shapes = [
            ("box", r#box.map(Shape::Box)),
            ("cylinder", cylinder.map(Shape::Cylinder)),
            ("ball", ball.map(Shape::Ball)),
        ];
        let found: Vec<(&str, Shape)> =
            shapes.into_iter().filter_map(|(key, shape)| shape.map(|shape| (key, shape))).collect();
        match found.as_slice() {
            [(_, shape)] => Ok(Self { shape: *shape, at, turned }),
            [] => Err(D::Error::custom("has no shape, expected one of `box`, `cylinder`, `ball`")),
            [(one, _), (other, _), ..] => {
                Err(D::Error::custom(format!("has `{one}` and `{other}`, expected one shape a part")))
            }
        }
    }
}

fn edges<'de, D: Deserializer<'de>>(from: D) -> Result<Option<[Length; 3]>, D::Error> {
    sizes(from, "three edge lengths, along x, y and z")
}

fn radius_and_height<'de, D: Deserializer<'de>>(from: D) -> Result<Option<[Length; 2]>, D::Error> {
    sizes(from, "two lengths, the radius and the height")
}

/// Reads the sizes of a shape.
fn sizes<'de, D: Deserializer<'de>, const N: usize>(from: D, wanted: &str) -> Result<Option<[Length; N]>, D::Error> {
    let sizes: Vec<Length> = above_zero(from)?;
    let found = sizes.len();
    let sizes =
        sizes.try_into().map_err(|_| D::Error::custom(format!("found a list of {found}, expected {wanted}")))?;
    Ok(Some(sizes))
}

impl Part {
    /// Returns the radius of a ball about the body's origin that contains this part, m.
    fn bounding_radius(&self) -> f64 {
        norm(self.at.map(|length| length.0)) + self.radius()
    }

    /// Returns the radius of a ball about the center of this part that contains it, m.
    fn radius(&self) -> f64 {
        match self.shape {
            Shape::Box(edges) => norm(edges.map(|edge| edge.0 / 2.0)),
            Shape::Cylinder([radius, height]) => norm([radius.0, height.0 / 2.0, 0.0]),
            Shape::Ball(radius) => radius.0,
        }
    }
}

fn norm(parts: [f64; 3]) -> f64 {
    parts.iter().map(|part| part * part).sum::<f64>().sqrt()
}

/// A convex shape.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// A box with these full edge lengths.
    Box([Length; 3]),
    /// A cylinder about z: radius, full height.
    Cylinder([Length; 2]),
    /// A ball of this radius.
    Ball(Length),
}

/// No edge, radius or height may be smaller or larger, m: a scene is something on a table, and `80 m` a slip for `80 mm`.
const SIZES_M: RangeInclusive<f64> = 1e-4..=10.0;

impl Part {
    /// Checks the sizes of the part and how far it is from the middle of its body.
    ///
    /// # Errors
    /// What is smaller than 0.1 mm, or larger or farther away than 10 m.
    pub fn check(&self) -> Result<(), String> {
        let check = |what: &str, size: Length| {
            if SIZES_M.contains(&size.0) {
                return Ok(());
            }
            Err(format!("has {what} {} m, expected 0.1 mm to 10 m", ShortNumber(size.0)))
        };
        match self.shape {
            Shape::Box(edges) => edges.into_iter().try_for_each(|edge| check("an edge of", edge))?,
            Shape::Cylinder([radius, height]) => {
                check("a height of", height)?;
                check("a radius of", radius)?;
            }
            Shape::Ball(radius) => check("a radius of", radius)?,
        }
        match self.at.iter().find(|length| length.0.abs() > *SIZES_M.end()) {
            Some(far) => Err(format!("is {} m from the middle of its body, expected at most 10 m", ShortNumber(far.0))),
            None => Ok(()),
        }
    }
}

/// A hole that objects are put into, or a peg that they are put on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Socket {
    /// Position of the object's plug point just before it enters, frame of the socket's body.
    pub rim: [Length; 3],
    /// Unit direction out of the socket, frame of the socket's body; objects enter against it.
    #[serde(deserialize_with = "with_direction")]
    pub axis: [f64; 3],
    /// Largest distance of the plug point from the axis while inserted.
    #[serde(deserialize_with = "above_zero")]
    pub radius: Length,
    /// Largest depth of an object.
    #[serde(deserialize_with = "above_zero")]
    pub depth: Length,
    /// The objects that fit; default all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accepts: Option<Vec<String>>,
    /// Axial travel per turn of a thread; 0 for a bearing, such as that of a latch or a valve, in which a body turns without axial travel.
    /// `None` for a plain hole or peg: a body that is twisted in it makes no Turn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pitch: Option<Length>,
}

/// A hand of the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hand {
    /// Its fingers, in order; `palm` if the contact of the palm is measured. A robot has `tcp`, and `wrist` if the force there is measured.
    #[schemars(with = "Vec<FingerName>")]
    pub fingers: Vec<Finger>,
    /// Radius of the fingertip balls.
    #[serde(default = "tip_radius", deserialize_with = "above_zero")]
    pub tip_radius: Length,
}

/// The name of a finger in a scene.
#[derive(schemars::JsonSchema)]
#[schemars(untagged)]
#[allow(dead_code, reason = "it is only described")]
enum FingerName {
    Finger(Finger),
    OfRobot(RobotPart),
}

/// What a robot has in place of fingers.
#[derive(schemars::JsonSchema)]
#[schemars(rename_all = "snake_case")]
#[allow(dead_code, reason = "it is only described")]
enum RobotPart {
    /// The tool center point, in place of a thumb.
    Tcp,
    /// The force sensor at the wrist, in place of a palm.
    Wrist,
}

/// Reads gravity.
///
/// # Errors
/// Gravity that does not point along -z: the reference frame is z up.
fn downwards<'de, D: Deserializer<'de>>(from: D) -> Result<[Acceleration; 3], D::Error> {
    let read = <[Acceleration; 3]>::deserialize(from)?;
    match read.map(|part| part.0) {
        [0.0, 0.0, z] if z <= 0.0 && z.is_finite() => Ok(read),
        [x, y, z] => {
            let [x, y, z] = [x, y, z].map(ShortNumber);
            Err(serde::de::Error::custom(format!(
                "found gravity [{x}, {y}, {z}] m/s^2, expected it along -z, such as [0, 0, -9.81]: turn the scene so that z is up"
            )))
        }
    }
}

fn standard_gravity() -> [Acceleration; 3] {
    let [x, y, z] = [0.0, 0.0, -9.81];
    [super::quantity::Quantity(x), super::quantity::Quantity(y), super::quantity::Quantity(z)]
}

const fn paper_friction() -> f64 {
    0.4
}

const fn no_rotation() -> [f64; 4] {
    [1.0, 0.0, 0.0, 0.0]
}

const fn tip_radius() -> Length {
    super::quantity::Quantity(0.010)
}
