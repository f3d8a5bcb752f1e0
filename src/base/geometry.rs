//! Distances to the shapes of a scene, without a physics library: box, cylinder and ball have closed forms.

use crate::base::scene::{Body, Part, Shape};
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// A pose from a position and a quaternion w x y z; a quaternion without direction is no rotation.
pub fn pose(position: [f64; 3], rotation: [f64; 4]) -> Isometry3<f64> {
    let [x, y, z] = position;
    Isometry3::from_parts(Translation3::new(x, y, z), unit(rotation))
}

/// A unit quaternion from w x y z; no rotation when it has no direction.
pub fn unit([w, x, y, z]: [f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-9).unwrap_or_else(UnitQuaternion::identity)
}

/// Two unit directions at right angles to each other and to a unit direction.
pub fn across(axis: &Vector3<f64>) -> [Vector3<f64>; 2] {
    // The axis that is least along it keeps away from a cross product of nothing.
    let least = Vector3::from_fn(|row, _| if row == axis.iamin() { 1.0 } else { 0.0 });
    let one = (least - axis * axis.dot(&least)).normalize();
    [one, axis.cross(&one)]
}

/// Distance from a point to the surface of a body, m, negative inside. A body without shape is the ball that holds it.
pub fn surface_distance(body: &Body, point_in_body: &Point3<f64>) -> f64 {
    if body.parts.is_empty() {
        return point_in_body.coords.norm() - body.bounding_radius();
    }
    body.parts.iter().map(|part| part_distance(part, point_in_body)).fold(f64::INFINITY, f64::min)
}

/// A body whose parts are placed, to be asked for many distances.
pub struct Solid {
    parts: Vec<(Isometry3<f64>, Shape)>,
    radius: f64,
}

impl Solid {
    /// Places the parts of a body.
    pub fn new(body: &Body) -> Self {
        Self {
            parts: body.parts.iter().map(|part| (placed(part), part.shape)).collect(),
            radius: body.bounding_radius(),
        }
    }

    /// The same as [`surface_distance`], m.
    pub fn distance(&self, point_in_body: &Point3<f64>) -> f64 {
        if self.parts.is_empty() {
            return point_in_body.coords.norm() - self.radius;
        }
        let distances = self.parts.iter().map(|(at, shape)| shape_distance(at, *shape, point_in_body));
        distances.fold(f64::INFINITY, f64::min)
    }

    /// How far the origin of the body is from the middle of its nearest part, m: no point is farther from the surface than this and its way
    /// to the origin together.
    pub fn inset(&self) -> f64 {
        let middles = self.parts.iter().map(|(at, _)| at.translation.vector.norm());
        middles.min_by(f64::total_cmp).unwrap_or_default()
    }
}

/// body_from_part.
fn placed(part: &Part) -> Isometry3<f64> {
    pose(part.at.map(|length| length.0), part.turned)
}

fn part_distance(part: &Part, point_in_body: &Point3<f64>) -> f64 {
    shape_distance(&placed(part), part.shape, point_in_body)
}

fn shape_distance(body_from_part: &Isometry3<f64>, shape: Shape, point_in_body: &Point3<f64>) -> f64 {
    let p = body_from_part.inverse_transform_point(point_in_body);
    match shape {
        Shape::Ball(radius) => p.coords.norm() - radius.0,
        Shape::Box([x, y, z]) => beyond(&[p.x.abs() - x.0 / 2.0, p.y.abs() - y.0 / 2.0, p.z.abs() - z.0 / 2.0]),
        Shape::Cylinder([radius, height]) => beyond(&[p.x.hypot(p.y) - radius.0, p.z.abs() - height.0 / 2.0]),
    }
}

/// How far a point is beyond faces that stand at right angles: the way to the nearest corner outside, minus the way to the nearest face inside.
fn beyond(over: &[f64]) -> f64 {
    let outside = over.iter().map(|over| over.max(0.0).powi(2)).sum::<f64>().sqrt();
    let inside = over.iter().copied().fold(f64::NEG_INFINITY, f64::max).min(0.0);
    outside + inside
}

/// The outward normal, body frame, of the face that a point is in front of: the face that it is farthest beyond, of the part it is nearest to.
/// `None` for a body without shape, and where no direction is to be had.
pub fn face_normal(body: &Body, point_in_body: &Point3<f64>) -> Option<Vector3<f64>> {
    let distance = |part: &&Part| part_distance(part, point_in_body);
    let part = body.parts.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    let body_from_part = placed(part);
    let p = body_from_part.inverse_transform_point(point_in_body).coords;
    let (radial, axial) = (Vector3::new(p.x, p.y, 0.0), Vector3::new(0.0, 0.0, p.z));
    let out = match part.shape {
        Shape::Ball(_) => p,
        Shape::Cylinder([radius, height]) if p.x.hypot(p.y) - radius.0 > p.z.abs() - height.0 / 2.0 => radial,
        Shape::Cylinder(_) => axial,
        Shape::Box(edges) => {
            let over = Vector3::from_iterator(p.iter().zip(edges).map(|(p, edge)| p.abs() - edge.0 / 2.0));
            let axis = over.imax();
            Vector3::from_fn(|row, _| if row == axis { p[axis] } else { 0.0 })
        }
    };
    out.try_normalize(1e-9).map(|out| body_from_part.rotation * out)
}
