//! The channels of a canonical log (docs/logs.md): one type for what is written, read and looked up by name.
//!
//! ```text
//! <hand>.<finger>.position.{x,y,z}                m, reference frame
//! <hand>.<finger>.force.{x,y,z}                   N, of the fingertip on the object, reference frame
//! <hand>.<finger>.noise                           N, of that force at rest; `tare` in a binding gives it
//! <hand>.<finger>.level                           N, from which force on it is in contact; learned where it is left out
//! <hand>.<finger>.contact                         1 while the finger touches an object
//! <hand>.<finger>.contact.<object>                1 while it touches this object
//! <hand>.palm.rotation.{w,x,y,z}                  reference_from_palm
//! <hand>.gripper.closed, <hand>.gripper.opening   1 while closed; m
//! <hand>.wrist.torque.{x,y,z}                     N m, of the hand on what it touches, reference frame
//! <body>.position.{x,y,z} .rotation.{w,x,y,z} .velocity.{x,y,z} .angular_velocity.{x,y,z}
//! <object>.depth.<socket>                         m, positive inside
//! <object>.angle.<socket>                         rad, of a latch or a valve that never leaves its socket
//! contact.<a>.<b>                                 1 while they touch
//! contact.<a>.<b>.force.{x,y,z}                   N, of b on a, reference frame
//! contact.<a>.<b>.normal.{x,y,z}                  unit normal from b to a, reference frame
//! ```
//!
//! Some channels have the field's names too ([`field_names`]).

use super::channels::Shape;
use super::field_names;
use super::hands::{Finger, Side};
use super::units::Dimension;
use std::fmt;

/// A channel of a canonical log, one or several columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogChannel<'a> {
    /// Of a fingertip, or of the palm as a place that touches.
    Finger(Side, Finger, FingerPart),
    /// Whether a finger touches an object.
    Touch(Side, Finger, &'a str),
    /// The rotation of a palm.
    PalmRotation(Side),
    /// Whether a gripper is closed.
    GripperClosed(Side),
    /// How far a gripper is open.
    GripperOpening(Side),
    /// The torque that a sensor at the wrist measures.
    WristTorque(Side),
    /// Of a body.
    Body(&'a str, BodyPart),
    /// How deep an object is in a socket.
    Depth(&'a str, &'a str),
    /// How far an object is turned in a socket.
    Angle(&'a str, &'a str),
    /// Between two bodies.
    Contact(&'a str, &'a str, ContactPart),
}

/// What is measured of a finger.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FingerPart {
    /// Where its tip is.
    Position,
    /// The force of its tip.
    Force,
    /// How much that force varies at rest.
    Noise,
    /// The force from which it is in contact.
    Level,
    /// Whether it touches.
    Contact,
}

/// What is measured of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodyPart {
    /// Where its origin is.
    Position,
    /// How it is turned.
    Rotation,
    /// How fast its origin moves.
    Velocity,
    /// How fast it turns.
    AngularVelocity,
}

/// What is measured of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactPart {
    /// Whether the bodies touch.
    Flag,
    /// The force of the second on the first.
    Force,
    /// The unit normal from the second to the first.
    Normal,
}

impl FingerPart {
    /// What a recording of a simulation has of each finger.
    pub const TIP: [Self; 2] = [Self::Position, Self::Force];
    const ALL: [Self; 5] = [Self::Position, Self::Force, Self::Noise, Self::Level, Self::Contact];

    const fn name(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::Force => "force",
            Self::Noise => "noise",
            Self::Level => "level",
            Self::Contact => "contact",
        }
    }
}

impl BodyPart {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Position, Self::Rotation, Self::Velocity, Self::AngularVelocity];

    const fn name(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::Rotation => "rotation",
            Self::Velocity => "velocity",
            Self::AngularVelocity => "angular_velocity",
        }
    }
}

impl ContactPart {
    /// What a recording of a simulation has of each contact.
    pub const VECTORS: [Self; 2] = [Self::Force, Self::Normal];
}

impl<'a> LogChannel<'a> {
    /// The pose of a palm.
    pub const fn palm(side: Side) -> [Self; 2] {
        [Self::Finger(side, Finger::Palm, FingerPart::Position), Self::PalmRotation(side)]
    }

    /// The channel with this name, without a component; `None` for a name that is not canonical.
    pub fn parse(name: &'a str) -> Option<Self> {
        let parts: Vec<&str> = name.split('.').collect();
        if parts.iter().any(|part| part.is_empty()) {
            return None;
        }
        if let [side, rest @ ..] = parts.as_slice()
            && let Some(side) = Side::from_name(side)
        {
            return Self::of_hand(side, rest);
        }
        let body = |part: &str| BodyPart::ALL.into_iter().find(|it| it.name() == part);
        match *parts.as_slice() {
            ["contact", a, b] => Some(Self::Contact(a, b, ContactPart::Flag)),
            ["contact", a, b, "force"] => Some(Self::Contact(a, b, ContactPart::Force)),
            ["contact", a, b, "normal"] => Some(Self::Contact(a, b, ContactPart::Normal)),
            ["contact" | "both" | "time", ..] => None,
            [object, "angle", socket] => Some(Self::Angle(object, socket)),
            [object, "depth", socket] => Some(Self::Depth(object, socket)),
            [name, part] => Some(Self::Body(name, body(part)?)),
            _ => None,
        }
    }

    fn of_hand(side: Side, rest: &[&'a str]) -> Option<Self> {
        match *rest {
            ["gripper", "closed"] => Some(Self::GripperClosed(side)),
            ["gripper", "opening"] => Some(Self::GripperOpening(side)),
            ["wrist", "torque"] => Some(Self::WristTorque(side)),
            [finger, "contact", object] => Some(Self::Touch(side, Finger::from_name(finger)?, object)),
            [finger, part] => {
                let [finger, part] = field_names::inside_of_hand(finger, part).unwrap_or([finger, part]);
                if (finger, part) == (Finger::Palm.name(), "rotation") {
                    return Some(Self::PalmRotation(side));
                }
                let part = FingerPart::ALL.into_iter().find(|it| it.name() == part)?;
                Some(Self::Finger(side, Finger::from_name(finger)?, part))
            }
            _ => None,
        }
    }

    /// The type of its values.
    pub const fn shape(&self) -> Shape {
        match self {
            Self::Finger(_, _, FingerPart::Position | FingerPart::Force)
            | Self::Body(_, BodyPart::Position | BodyPart::Velocity | BodyPart::AngularVelocity)
            | Self::WristTorque(_)
            | Self::Contact(_, _, ContactPart::Force | ContactPart::Normal) => Shape::Vec3,
            Self::PalmRotation(_) | Self::Body(_, BodyPart::Rotation) => Shape::Rotation,
            Self::Finger(_, _, FingerPart::Contact)
            | Self::Touch(..)
            | Self::GripperClosed(_)
            | Self::Contact(_, _, ContactPart::Flag) => Shape::Bool,
            Self::Finger(_, _, FingerPart::Noise | FingerPart::Level)
            | Self::GripperOpening(_)
            | Self::Depth(..)
            | Self::Angle(..) => Shape::Scalar,
        }
    }

    /// The dimension of its values.
    pub const fn dimension(&self) -> Dimension {
        match self {
            Self::Finger(_, _, FingerPart::Position)
            | Self::Body(_, BodyPart::Position)
            | Self::GripperOpening(_)
            | Self::Depth(..) => Dimension::LENGTH,
            Self::Finger(_, _, FingerPart::Force | FingerPart::Noise | FingerPart::Level)
            | Self::Contact(_, _, ContactPart::Force) => Dimension::FORCE,
            Self::WristTorque(_) => Dimension::TORQUE,
            Self::Body(_, BodyPart::Velocity) => Dimension::SPEED,
            Self::Body(_, BodyPart::AngularVelocity) => Dimension::ANGULAR_SPEED,
            Self::Angle(..) => Dimension::ANGLE,
            Self::Finger(_, _, FingerPart::Contact)
            | Self::Touch(..)
            | Self::PalmRotation(_)
            | Self::GripperClosed(_)
            | Self::Body(_, BodyPart::Rotation)
            | Self::Contact(_, _, ContactPart::Flag | ContactPart::Normal) => Dimension::NONE,
        }
    }

    /// The bodies that it names, which a scene has to know.
    pub const fn bodies(&self) -> [Option<&'a str>; 2] {
        match self {
            Self::Touch(_, _, body) | Self::Body(body, _) | Self::Depth(body, _) | Self::Angle(body, _) => {
                [Some(body), None]
            }
            Self::Contact(one, other, _) => [Some(one), Some(other)],
            Self::Finger(..)
            | Self::PalmRotation(_)
            | Self::GripperClosed(_)
            | Self::GripperOpening(_)
            | Self::WristTorque(_) => [None, None],
        }
    }

    /// Its columns in their order: `right.thumb.force.x`, …
    pub fn columns(&self) -> Vec<String> {
        let column = |component: &&str| {
            if component.is_empty() { self.to_string() } else { format!("{self}.{component}") }
        };
        self.shape().components().iter().map(column).collect()
    }
}

/// The columns of these channels with their dimensions, in their order.
pub fn columns(channels: &[LogChannel<'_>]) -> Vec<(String, Dimension)> {
    channels.iter().flat_map(|it| it.columns().into_iter().map(|name| (name, it.dimension()))).collect()
}

impl fmt::Display for LogChannel<'_> {
    /// The name: `right.thumb.force`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Finger(side, finger, part) => write!(f, "{side}.{finger}.{}", part.name()),
            Self::Touch(side, finger, object) => write!(f, "{side}.{finger}.contact.{object}"),
            Self::PalmRotation(side) => write!(f, "{side}.palm.rotation"),
            Self::GripperClosed(side) => write!(f, "{side}.gripper.closed"),
            Self::GripperOpening(side) => write!(f, "{side}.gripper.opening"),
            Self::WristTorque(side) => write!(f, "{side}.wrist.torque"),
            Self::Body(body, part) => write!(f, "{body}.{}", part.name()),
            Self::Depth(object, socket) => write!(f, "{object}.depth.{socket}"),
            Self::Angle(object, socket) => write!(f, "{object}.angle.{socket}"),
            Self::Contact(one, other, ContactPart::Flag) => write!(f, "contact.{one}.{other}"),
            Self::Contact(one, other, ContactPart::Force) => write!(f, "contact.{one}.{other}.force"),
            Self::Contact(one, other, ContactPart::Normal) => write!(f, "contact.{one}.{other}.normal"),
        }
    }
}
