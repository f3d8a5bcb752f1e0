//! A request for a grasp: contacts, the object and the obstacles.

use nalgebra::{Isometry3, Point3, Vector3};
use teachtree_base::hands::Finger;
use teachtree_base::scene::Body;

/// Largest angle between a grasping pad and the surface normal, rad (80 degrees).
pub const LARGEST_PAD_ANGLE: f64 = 80.0 * std::f64::consts::PI / 180.0;
/// Largest angle between a pushing pad and the surface normal, rad (95 degrees: the end of the finger).
pub const LARGEST_PUSHING_ANGLE: f64 = 95.0 * std::f64::consts::PI / 180.0;
/// Largest overlap of shapes that count as clear of each other, m.
pub const CLEAR_M: f64 = 1e-4;

/// The contact of one finger; object frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Which finger.
    pub finger: Finger,
    /// The point of the object's surface.
    pub point: Point3<f64>,
    /// Unit normal out of the object.
    pub normal: Vector3<f64>,
}

/// A body that the hand must not touch, with its pose.
#[derive(Clone, Debug)]
pub struct Obstacle<'a> {
    /// The pose in the frame of the object.
    pub object_from_obstacle: Isometry3<f64>,
    /// Its shape.
    pub body: &'a Body,
}

/// The object and its contacts.
#[derive(Clone, Debug)]
pub struct GraspRequest<'a> {
    /// The demonstrated contacts, at most one a finger.
    pub contacts: Vec<Contact>,
    /// The object.
    pub object: &'a Body,
    /// The obstacles while it is held.
    pub obstacles: Vec<Obstacle<'a>>,
}
