//! What is to be grasped: contacts, the object and what is in the way; and why there is no grasp.

use nalgebra::{Isometry3, Point3, Vector3};
use teachtree_base::hands::Finger;
use teachtree_base::scene::Body;
use teachtree_command::FRICTION;

/// A pad that grasps may look past the surface normal by this angle, rad (80 degrees).
pub const LARGEST_PAD_ANGLE: f64 = 80.0 * std::f64::consts::PI / 180.0;
/// One that only pushes by this one, rad (95 degrees: the end of the finger).
pub const LARGEST_PUSHING_ANGLE: f64 = 95.0 * std::f64::consts::PI / 180.0;
/// Shapes are clear of each other when they overlap by no more than this, m.
pub const CLEAR_M: f64 = 1e-4;

/// Where one finger touched the object; object frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Which finger.
    pub finger: Finger,
    /// The point of the object's surface.
    pub point: Point3<f64>,
    /// Unit normal out of the object.
    pub normal: Vector3<f64>,
}

/// A body that the hand must not touch, and where it is.
#[derive(Clone, Debug)]
pub struct Obstacle<'a> {
    /// The pose in the frame of the object.
    pub object_from_obstacle: Isometry3<f64>,
    /// Its shape.
    pub body: &'a Body,
}

/// What is to be held, and where.
#[derive(Clone, Debug)]
pub struct GraspRequest<'a> {
    /// The demonstrated contacts, at most one a finger.
    pub contacts: Vec<Contact>,
    /// The object.
    pub object: &'a Body,
    /// What else is there while it is held.
    pub obstacles: Vec<Obstacle<'a>>,
}

/// Why there is no grasp.
#[derive(Clone, Debug, PartialEq)]
pub enum Failure {
    /// The hand has no such finger.
    Lacks(Finger),
    /// Of the best pose, the finger that stays farthest from its contact, and how far, m.
    OutOfReach(Finger, f64),
    /// Every finger reaches, but hand, object, obstacles and fingers are not clear of each other: the worst overlap, m, and between whom.
    InTheWay(f64, String),
    /// The arm cannot bring the palm to any pose that was found.
    ArmOutOfReach,
    /// Every finger reaches, but a pad looks away from the surface: by this angle, rad.
    PadTurnedAway(Finger, f64),
    /// Nothing touches against the thumb, or no thumb against what touches: there is nothing to be held between jaws.
    OneSided,
    /// Jaws do not open as far as they must: so far, m, and at most as far.
    TooWide(f64, f64),
    /// Jaws do not close as far as they must: so far, m, and at least as far.
    TooNarrow(f64, f64),
    /// The line between the jaws leans from the surface at one of them by this angle, rad, and friction does not hold it there.
    SlipsOff(Finger, f64),
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Lacks(finger) => write!(f, "the hand has no {finger} finger"),
            Self::OutOfReach(finger, miss) => {
                write!(f, "{finger} cannot reach its contact: {:.1} mm are missing", miss * 1e3)
            }
            Self::InTheWay(overlap, who) => write!(f, "{who} are in each other's way by {:.1} mm", overlap * 1e3),
            Self::ArmOutOfReach => f.write_str("the arm cannot bring the palm there"),
            Self::PadTurnedAway(finger, angle) => {
                write!(f, "the pad of {finger} looks {:.0} degrees past the surface", angle.to_degrees())
            }
            Self::OneSided => f.write_str(
                "a gripper holds between thumb and fingers, and here only one side touches: it does not push",
            ),
            Self::TooWide(wanted, most) => {
                let [wanted, most] = [wanted, most].map(|opening| opening * 1e3);
                let missing = wanted - most;
                write!(f, "the jaws open to {most:.1} mm, and {wanted:.1} mm are needed: {missing:.1} mm are missing")
            }
            Self::TooNarrow(wanted, least) => {
                let [wanted, least] = [wanted, least].map(|opening| opening * 1e3);
                let over = least - wanted;
                write!(f, "the jaws close to {least:.1} mm, and {wanted:.1} mm are needed: {over:.1} mm remain open")
            }
            Self::SlipsOff(finger, angle) => {
                let [angle, most] = [*angle, FRICTION.atan()].map(|angle| angle.to_degrees().round());
                write!(
                    f,
                    "the {finger} jaw slips off: the line between the jaws leans by {angle} degrees there, and friction holds up to {most}"
                )
            }
        }
    }
}
