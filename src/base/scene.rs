//! The scene that a log carries: bodies with shapes, roles and sockets, as plain data. It is read from YAML, written beside a CSV,
//! simulated by `world` and consulted by `stream` when contacts, depths and distances are derived.

use super::hands::{Finger, Side};
use super::quantity::{Acceleration, Length, Mass, above_zero, not_below_zero, with_direction};
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

/// Bodies and hands, in the reference frame (z up).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// A name for people.
    #[serde(default)]
    pub name: String,
    /// Gravity in the reference frame; 9.81 m/s^2 downwards when left out.
    #[serde(default = "standard_gravity")]
    pub gravity: [Acceleration; 3],
    /// The bodies by name, in file order.
    pub bodies: IndexMap<String, Body>,
    /// The hands and their fingertips, in the order of the log.
    #[serde(default)]
    pub hands: IndexMap<Side, Hand>,
}

/// One rigid body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// What it is for the task.
    pub role: Role,
    /// Its shape; several convex parts make a hollow body. Empty for a body of which nothing is known but its name.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<Part>,
    /// Radius of the ball about the body's origin that holds it; from the shape when left out.
    #[serde(default, deserialize_with = "above_zero", skip_serializing_if = "Option::is_none")]
    pub radius: Option<Length>,
    /// Mass of a movable body.
    #[serde(default, deserialize_with = "above_zero", skip_serializing_if = "Option::is_none")]
    pub mass: Option<Mass>,
    /// Coefficient of friction against other bodies (static and dynamic are the same here; fingertips have their own law).
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
    /// The point of this body that enters a socket, body frame; the origin when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plug: Option<[Length; 3]>,
    /// The hand that this body is fixed to during the whole recording (`holds: always`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fixed_to: Option<Side>,
}

impl Body {
    /// Radius of the ball about the body's origin that holds it, m: as given, else from the parts.
    pub fn bounding_radius(&self) -> f64 {
        self.radius.map_or_else(|| self.parts.iter().map(Part::bounding_radius).fold(0.0, f64::max), |radius| radius.0)
    }
}

/// What a body is for the task.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// May be handled: a candidate for `target`.
    Object,
    /// Carries objects: table, base.
    Support,
    /// Stands beside: touched by an object, it is a contact that does not carry.
    Wall,
    /// Fixed, with sockets.
    Socket,
}

/// A convex part of a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// The shape, about the part's own origin.
    #[serde(flatten)]
    pub shape: Shape,
    /// Position of the part in the body frame.
    #[serde(default)]
    pub at: [Length; 3],
    /// Rotation of the part in the body frame, quaternion w x y z.
    #[serde(default = "no_rotation", deserialize_with = "with_direction")]
    pub turned: [f64; 4],
}

impl Part {
    /// Radius of a ball about the body's origin that holds this part, m.
    fn bounding_radius(&self) -> f64 {
        let norm = |parts: [f64; 3]| parts.iter().map(|part| part * part).sum::<f64>().sqrt();
        let own = match self.shape {
            Shape::Box(edges) => norm(edges.map(|edge| edge.0 / 2.0)),
            Shape::Cylinder([radius, height]) => norm([radius.0, height.0 / 2.0, 0.0]),
            Shape::Ball(radius) => radius.0,
        };
        norm(self.at.map(|length| length.0)) + own
    }
}

/// A convex shape.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// A box with these full edge lengths.
    Box(#[serde(deserialize_with = "above_zero")] [Length; 3]),
    /// A cylinder about z: radius, full height.
    Cylinder(#[serde(deserialize_with = "above_zero")] [Length; 2]),
    /// A ball of this radius.
    Ball(#[serde(deserialize_with = "above_zero")] Length),
}

/// Where an object can be put in, or on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Socket {
    /// Where the plug point of the object is when it is about to enter, frame of the socket's body.
    pub rim: [Length; 3],
    /// Unit direction out of the socket, frame of the socket's body: an object goes in against it.
    #[serde(deserialize_with = "with_direction")]
    pub axis: [f64; 3],
    /// How far from the axis the plug point may be while inserted.
    #[serde(deserialize_with = "above_zero")]
    pub radius: Length,
    /// How deep an object can go.
    #[serde(deserialize_with = "above_zero")]
    pub depth: Length,
    /// The objects that fit; all when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accepts: Option<Vec<String>>,
    /// A thread: the axial way of one turn; 0 for a bearing, such as that of a latch or a valve, in which a body turns and stays where it is.
    /// A plain hole or peg when left out: what is in it may be twisted, but that is no Turn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pitch: Option<Length>,
}

/// A hand of the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hand {
    /// The fingers it has, in order; `palm` where the palm's contact is measured.
    pub fingers: Vec<Finger>,
    /// Radius of the fingertip balls.
    #[serde(default = "tip_radius", deserialize_with = "above_zero")]
    pub tip_radius: Length,
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
