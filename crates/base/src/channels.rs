//! The vocabulary of channels: the types of a value per frame, and the derived channels that `frames` computes for the rules.
//! A log contains the raw channels; a rule file declares those that it reads in `stream { … }`.

use super::hands::Side;
use super::units::Dimension;

/// The type of one element of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Shape {
    /// True or false; 1.0 or 0.0 in a column.
    Bool,
    /// One number.
    Scalar,
    /// Three numbers x, y, z.
    Vec3,
    /// A unit quaternion w, x, y, z.
    Rotation,
    /// An object of the scene: its index in column form, -1.0 for none.
    Object,
}

impl Shape {
    /// Returns the suffixes of the component columns; one empty suffix for a value in one column.
    pub const fn components(self) -> &'static [&'static str] {
        match self {
            Self::Bool | Self::Scalar | Self::Object => &[""],
            Self::Vec3 => &["x", "y", "z"],
            Self::Rotation => &["w", "x", "y", "z"],
        }
    }
}

/// The index set of an array. The slots are fixed when a log is opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Axis {
    /// The fingers of a hand.
    Fingers,
    /// The bodies that a hand's target may touch.
    Contacts,
}

/// A channel: a value per frame that rules can read.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelSpec {
    /// The name in rules, such as `fingers.force`, `target.velocity`, `gripper.closed`.
    pub name: String,
    /// Whether each hand has its own channel.
    pub per_hand: bool,
    /// Whether it is an array.
    pub axis: Option<Axis>,
    /// The type of an element.
    pub shape: Shape,
    /// The dimension of an element; `NONE` for bool, rotation and object.
    pub dimension: Dimension,
    /// The treatment of logs without the channel.
    pub absent: Fallback,
}

/// The treatment of a channel that a log lacks.
#[derive(Clone, Debug, PartialEq)]
pub enum Fallback {
    /// The log is refused.
    Refused,
    /// A constant in SI units for every component; for a rotation, its angle, which must be 0.
    Constant(f64),
    /// A hysteresis on the norm of another channel, element by element: true above `on` until below `off` (both SI).
    NormAbove {
        /// The name of the other channel; same axis, a vec3.
        channel: String,
        /// Upper threshold, which sets the flag.
        on: f64,
        /// Lower threshold, which clears it.
        off: f64,
        /// Whether a rule reads the channel; otherwise a log may lack `of` too.
        needed: bool,
    },
    /// Derived from other channels and the scene; see [`derived`].
    Derived,
}

/// A derived channel with its documentation.
pub struct DerivedChannel {
    /// The name in rules.
    pub name: &'static str,
    /// Whether each hand has its own channel.
    pub per_hand: bool,
    /// Whether it is an array.
    pub axis: Option<Axis>,
    /// The type of an element.
    pub shape: Shape,
    /// Dimension of an element.
    pub dimension: Dimension,
    /// Units, frame and sign, for the reference and for hover texts.
    pub doc: &'static str,
    /// Whether it is an average of frames before and after, without the tremor of a hand.
    pub is_averaged: bool,
}

impl DerivedChannel {
    const fn averaged(self) -> Self {
        Self { is_averaged: true, ..self }
    }

    /// Returns the channel as a rule file would declare it.
    pub fn spec(&self) -> ChannelSpec {
        ChannelSpec {
            name: self.name.into(),
            per_hand: self.per_hand,
            axis: self.axis,
            shape: self.shape,
            dimension: self.dimension,
            absent: Fallback::Derived,
        }
    }
}

const fn hand(name: &'static str, shape: Shape, dimension: Dimension, doc: &'static str) -> DerivedChannel {
    DerivedChannel { name, per_hand: true, axis: None, shape, dimension, doc, is_averaged: false }
}

const fn contact(name: &'static str, shape: Shape, dimension: Dimension, doc: &'static str) -> DerivedChannel {
    DerivedChannel { name, per_hand: true, axis: Some(Axis::Contacts), shape, dimension, doc, is_averaged: false }
}

const fn global(name: &'static str, shape: Shape, dimension: Dimension, doc: &'static str) -> DerivedChannel {
    DerivedChannel { name, per_hand: false, axis: None, shape, dimension, doc, is_averaged: false }
}

/// Whether the log contains the distance of a hand from its target. The engine knows the value before the first frame and omits conditions that it
/// makes irrelevant.
pub const DISTANCE_KNOWN: &str = "distance_known";

/// Whether the log shows when a hand holds something.
pub const GRASP_KNOWN: &str = "grasp_known";

/// Whether the log shows how a hand is turned against what it holds.
pub const ROTATION_KNOWN: &str = "rotation_known";

/// Every derived channel. `frames` computes exactly these; the language knows their types from here.
pub const DERIVED: &[DerivedChannel] = &[
    hand(
        "target",
        Shape::Object,
        Dimension::NONE,
        "the object that this hand touches, else the one that it carries, else the one nearest to its fingertips; it changes only while the hand touches and carries nothing",
    ),
    hand("target.position", Shape::Vec3, Dimension::LENGTH, "origin of the target, reference frame"),
    hand("target.rotation", Shape::Rotation, Dimension::NONE, "rotation reference_from_target"),
    hand(
        "target.hold_rotation",
        Shape::Rotation,
        Dimension::NONE,
        "rotation reference_from_target where the log has it, else that of the hand, reference_from_palm: what is held firmly turns with the hand",
    ),
    hand(
        "target.velocity",
        Shape::Vec3,
        Dimension::SPEED,
        "velocity of the target's origin without the tremor of a hand, reference frame",
    )
    .averaged(),
    hand(
        "target.angular_velocity",
        Shape::Vec3,
        Dimension::ANGULAR_SPEED,
        "angular velocity of the target without tremor, reference frame",
    )
    .averaged(),
    hand(
        "target.radius",
        Shape::Scalar,
        Dimension::LENGTH,
        "radius of the sphere about the target's origin that contains it",
    ),
    hand(
        "target.weight",
        Shape::Scalar,
        Dimension::FORCE,
        "mass of the target times gravity; 0 when the mass is not known",
    ),
    hand(
        "target.noise",
        Shape::Scalar,
        Dimension::LENGTH,
        "standard deviation of a coordinate of the target's measured position, from the whole log; 0 where it is small or not known",
    ),
    hand(
        "target.spin",
        Shape::Scalar,
        Dimension::ANGULAR_SPEED,
        "angular velocity of the target about the axis of the socket it is in, else about the normal of the contact that carries it, else about the vertical",
    )
    .averaged(),
    hand(
        "target.depth",
        Shape::Scalar,
        Dimension::LENGTH,
        "how far the target's plug point is below the rim of the socket it is in, positive inside; 0 when it is in none",
    ),
    hand(
        "target.sinking",
        Shape::Scalar,
        Dimension::SPEED,
        "speed at which the target's depth grows, without tremor; negative when it is pulled out, 0 when it is in no socket",
    )
    .averaged(),
    hand(
        "target.fixed",
        Shape::Bool,
        Dimension::NONE,
        "the target is fixed to this hand, which holds it all the time (`fixed_to` in the scene)",
    ),
    hand(
        "target.over_socket",
        Shape::Bool,
        Dimension::NONE,
        "the target's plug point is near the axis of a socket, above its rim or at most 5 mm below: searching for the hole",
    ),
    hand(
        "target.in_plain_socket",
        Shape::Bool,
        Dimension::NONE,
        "the socket that the target is in has neither thread nor bearing: the scene gives it no `pitch`",
    ),
    contact("contacts.force", Shape::Vec3, Dimension::FORCE, "force of the other body on the target, reference frame"),
    contact(
        "contacts.normal",
        Shape::Vec3,
        Dimension::NONE,
        "unit normal of the contact, from the other body to the target, reference frame; zero without contact",
    ),
    contact(
        "contacts.velocity",
        Shape::Vec3,
        Dimension::SPEED,
        "velocity of the other body's origin, reference frame; zero for a fixed body",
    )
    .averaged(),
    contact(
        "contacts.handled",
        Shape::Bool,
        Dimension::NONE,
        "the other body is touched by the other hand, or plugged into the target",
    ),
    hand(
        DISTANCE_KNOWN,
        Shape::Bool,
        Dimension::NONE,
        "the log has the positions of this hand's fingertips and of all objects, and no object is fixed to the hand; the same on all frames",
    ),
    hand(
        GRASP_KNOWN,
        Shape::Bool,
        Dimension::NONE,
        "the log has the contact or the force of one of this hand's fingertips, or the flag or the opening of its gripper; the same on all frames",
    ),
    hand(
        ROTATION_KNOWN,
        Shape::Bool,
        Dimension::NONE,
        "the log has the rotation of this hand or of its target",
    ),
    DerivedChannel {
        axis: Some(Axis::Fingers),
        ..hand(
            "fingers.distance",
            Shape::Scalar,
            Dimension::LENGTH,
            "distance of the fingertip from the surface of the parts of the target, or of the ball of its `radius`; negative inside",
        )
    },
    hand("load", Shape::Scalar, Dimension::FORCE, "norm of the sum of this hand's finger forces on its target"),
    hand(
        "push",
        Shape::Vec3,
        Dimension::FORCE,
        "sum of this hand's finger forces on its target without the tremor of the hand, reference frame",
    )
    .averaged(),
    global(
        "closing",
        Shape::Scalar,
        Dimension::SPEED,
        "speed at which the depth of one hand's target in the other's grows; negative when it is pulled out",
    )
    .averaged(),
    global(
        "targets.contact",
        Shape::Bool,
        Dimension::NONE,
        "the two hands' targets touch each other; what `in_contact(left.target, right.target)` reads",
    ),
];

/// Whether the hand touches its target.
pub const TARGET_TOUCHED: &str = "target.touched";
/// The body that the target is in or against while the hand touches it, as its number in the scene; -1 for none.
pub const PARTNER: &str = "target.partner";
/// Whether the target is in a socket of that body.
pub const TARGET_INSIDE: &str = "target.inside";

/// Derived channels that name what a hand handles: the subjects of segments are found from them (`analysis`). Rules cannot read them.
pub const HANDLING: [&str; 3] = [TARGET_TOUCHED, PARTNER, TARGET_INSIDE];

/// A channel of [`HANDLING`], one number a hand.
pub fn handling(name: &str) -> ChannelSpec {
    ChannelSpec {
        name: name.into(),
        per_hand: true,
        axis: None,
        shape: Shape::Scalar,
        dimension: Dimension::NONE,
        absent: Fallback::Derived,
    }
}

/// The derived channel with this name.
pub fn derived(name: &str) -> Option<&'static DerivedChannel> {
    DERIVED.iter().find(|channel| channel.name == name)
}

/// Returns the hands whose targets a channel of `side` depends on. A change of such a target restarts the operators that read the channel.
pub fn reads_target(name: &str, side: Option<Side>) -> Vec<Side> {
    let of_hand = name == "target" || name.starts_with("target.") || name.starts_with("contacts.");
    match side {
        Some(side) if of_hand => vec![side],
        None if name == "closing" || name == "targets.contact" => Side::BOTH.to_vec(),
        _ => Vec::new(),
    }
}
