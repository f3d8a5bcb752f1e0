//! What is to be grasped: contacts, the object and what is in the way.

use nalgebra::{Isometry3, Point3, Vector3};
use teachtree_base::hands::Finger;
use teachtree_base::scene::Body;

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
