//! The shapes of links: bars with round ends, boxes and convex pieces of meshes, and their masses.

use super::polytope::Polytope;
use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use std::sync::Arc;
use teachtree_base::quantity::Length;
use teachtree_base::scene::{Body, Part, Shape};

/// A shape of a link.
#[derive(Clone, Debug, PartialEq)]
pub enum CollisionShape {
    /// A round bar from one point to the other, m, and its radius.
    Capsule(Point3<f64>, Point3<f64>, f64),
    /// A box about a pose with these half edges, m.
    Box(Isometry3<f64>, Vector3<f64>),
    /// A convex piece of a mesh at a pose.
    Piece(Isometry3<f64>, Arc<Polytope>),
}

impl CollisionShape {
    /// Returns the same shape in the frame in which its own frame is `pose`.
    pub fn moved(&self, pose: &Isometry3<f64>) -> Self {
        match self {
            Self::Capsule(from, to, radius) => Self::Capsule(pose * from, pose * to, *radius),
            Self::Box(at, half) => Self::Box(pose * at, *half),
            Self::Piece(at, polytope) => Self::Piece(pose * at, polytope.clone()),
        }
    }

    /// Returns a box about the shape that is at least as large: the frame of its middle, and its half edges, m.
    pub fn bounding_box(&self) -> (Isometry3<f64>, Vector3<f64>) {
        match self {
            Self::Capsule(from, to, radius) => {
                let turn = UnitQuaternion::rotation_between(&Vector3::z(), &(to - from)).unwrap_or_default();
                let half = Vector3::new(*radius, *radius, (to - from).norm() / 2.0 + radius);
                (Isometry3::from_parts(nalgebra::center(from, to).into(), turn), half)
            }
            Self::Box(at, half) => (*at, *half),
            Self::Piece(at, polytope) => {
                let (middle, half) = polytope.bounding_box;
                (at * middle, half.add_scalar(polytope.radius))
            }
        }
    }

    /// Returns the center and the radius of a ball that holds the shape.
    pub fn bounding_ball(&self) -> (Point3<f64>, f64) {
        match self {
            Self::Capsule(from, to, radius) => (nalgebra::center(from, to), (to - from).norm() / 2.0 + radius),
            Self::Box(at, half) => (at.translation.vector.into(), half.norm()),
            Self::Piece(at, polytope) => {
                let (center, radius) = polytope.bounding_ball();
                (at * center, radius)
            }
        }
    }

    /// Volume, m^3, centre, and inertia about the centre for a density of 1 kg/m^3.
    pub fn mass_properties(&self) -> (f64, Point3<f64>, Matrix3<f64>) {
        use std::f64::consts::PI;
        match self {
            Self::Capsule(from, to, radius) => {
                let along = to - from;
                let length = along.norm();
                let cylinder = PI * radius * radius * length;
                let ball = 4.0 / 3.0 * PI * radius.powi(3);
                let r2 = radius * radius;
                // About the bar, and across it: a cylinder and two half balls at its ends.
                let about = cylinder * r2 / 2.0 + ball * 0.4 * r2;
                let across = cylinder * (length * length / 12.0 + r2 / 4.0)
                    + ball * (0.4 * r2 + length * length / 4.0 + 3.0 / 8.0 * length * radius);
                let axis = along.try_normalize(1e-12).unwrap_or_else(Vector3::x);
                let outer = axis * axis.transpose();
                let inertia = Matrix3::identity() * across + outer * (about - across);
                (cylinder + ball, nalgebra::center(from, to), inertia)
            }
            Self::Box(pose, half) => {
                let volume = 8.0 * half.x * half.y * half.z;
                let [x2, y2, z2] = [half.x * half.x, half.y * half.y, half.z * half.z];
                let own = Matrix3::from_diagonal(&Vector3::new(y2 + z2, x2 + z2, x2 + y2)) * (volume / 3.0);
                let turn = pose.rotation.to_rotation_matrix();
                (volume, pose.translation.vector.into(), turn * own * turn.inverse())
            }
            Self::Piece(at, polytope) => {
                let (volume, center, own) = polytope.mass_properties();
                let turn = at.rotation.to_rotation_matrix();
                (volume, at * center, turn * own * turn.inverse())
            }
        }
    }
}

/// The shapes of a body, its frame. A cylinder counts as the box about it.
pub fn solids(body: &Body) -> Vec<CollisionShape> {
    body.parts.iter().map(solid).collect()
}

fn solid(part: &Part) -> CollisionShape {
    let half = |edges: [Length; 3]| Vector3::from(edges.map(|edge| edge.0 / 2.0));
    match part.shape {
        Shape::Box(edges) => CollisionShape::Box(part.pose(), half(edges)),
        Shape::Cylinder([radius, height]) => {
            CollisionShape::Box(part.pose(), Vector3::new(radius.0, radius.0, height.0 / 2.0))
        }
        Shape::Ball(radius) => {
            let middle = part.pose() * Point3::origin();
            CollisionShape::Capsule(middle, middle, radius.0)
        }
    }
}

/// Centre of mass and inertia about it, of a mass spread evenly over solids. Without any, a ball of 10 mm.
pub fn inertia_of(mass: f64, solids: &[CollisionShape]) -> (Point3<f64>, Matrix3<f64>) {
    let parts: Vec<_> = solids.iter().map(CollisionShape::mass_properties).collect();
    let volume: f64 = parts.iter().map(|(volume, ..)| volume).sum();
    if volume <= 0.0 {
        return (Point3::origin(), Matrix3::identity() * (0.4 * mass * 1e-4));
    }
    let centre =
        Point3::from(parts.iter().map(|(volume, centre, _)| centre.coords * *volume).sum::<Vector3<f64>>() / volume);
    let about = parts.iter().map(|(volume, at, inertia)| {
        let arm = at - centre;
        inertia + (Matrix3::identity() * arm.norm_squared() - arm * arm.transpose()) * *volume
    });
    (centre, about.sum::<Matrix3<f64>>() * (mass / volume))
}
