//! The distance field of the shapes that a hand must not penetrate: convex parts of the object and of the obstacles, with distance and gradient.

use super::grasp_request::GraspRequest;
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use teachtree_base::scene::{Body, Shape};

/// Largest distance of an obstacle from the object at which it matters, m: more than a hand's length.
const FAR_M: f64 = 0.4;

/// A convex part of the object or of an obstacle.
pub(super) struct ConvexPart {
    part_from_object: Isometry3<f64>,
    /// Its middle, object frame.
    pub(super) centre: Point3<f64>,
    shape: Shape,
}

/// A part in the frame of the palm.
pub(super) struct PalmFramePart {
    turn: Matrix3<f64>,
    shift: Vector3<f64>,
    shape: Shape,
}

/// Returns the parts of the object, then those of near obstacles, and the number of the object's parts.
pub(super) fn parts(request: &GraspRequest<'_>) -> (Vec<ConvexPart>, usize) {
    let mut parts = of_body(request.object, &Isometry3::identity());
    let own = parts.len();
    for obstacle in &request.obstacles {
        let near = |part: &ConvexPart| part.seen_from(&Isometry3::identity()).distance(&Point3::origin()) < FAR_M;
        parts.extend(of_body(obstacle.body, &obstacle.object_from_obstacle).into_iter().filter(near));
    }
    (parts, own)
}

fn of_body(body: &Body, object_from_body: &Isometry3<f64>) -> Vec<ConvexPart> {
    let part = |part: &teachtree_base::scene::Part| {
        let object_from_part = object_from_body * part.pose();
        ConvexPart {
            part_from_object: object_from_part.inverse(),
            centre: object_from_part.translation.vector.into(),
            shape: part.shape,
        }
    };
    body.parts.iter().map(part).collect()
}

impl ConvexPart {
    pub(super) fn seen_from(&self, object_from_palm: &Isometry3<f64>) -> PalmFramePart {
        let part_from_palm = self.part_from_object * object_from_palm;
        PalmFramePart {
            turn: part_from_palm.rotation.to_rotation_matrix().into_inner(),
            shift: part_from_palm.translation.vector,
            shape: self.shape,
        }
    }
}

impl PalmFramePart {
    /// Signed distance of a point of the palm's frame to the surface, m, negative inside.
    pub(super) fn distance(&self, point: &Point3<f64>) -> f64 {
        self.shape.distance(&(self.turn * point.coords + self.shift))
    }

    /// The gradient of the distance at a point, unit vector, frame of the palm.
    pub(super) fn out(&self, point: &Point3<f64>) -> Vector3<f64> {
        self.turn.tr_mul(&self.shape.outward(&(self.turn * point.coords + self.shift)))
    }
}
