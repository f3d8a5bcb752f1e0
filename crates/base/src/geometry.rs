//! Distances to the shapes of a scene, without a physics library: box, cylinder and ball have closed forms.

use crate::scene::{Body, Part, Shape};
use nalgebra::{Isometry3, Point3, Vector3};

pub use super::pose::{pose, unit};

/// Two unit directions at right angles to each other and to a unit direction.
pub fn perpendiculars(axis: &Vector3<f64>) -> [Vector3<f64>; 2] {
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
            parts: body.parts.iter().map(|part| (part.pose(), part.shape)).collect(),
            radius: body.bounding_radius(),
        }
    }

    /// Places the parts of a body; a body with a given radius is the ball of this radius.
    pub fn of_radius_or_parts(body: &Body) -> Self {
        match body.radius {
            Some(radius) => Self { parts: vec![], radius: radius.0 },
            None => Self::new(body),
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

fn part_distance(part: &Part, point_in_body: &Point3<f64>) -> f64 {
    shape_distance(&part.pose(), part.shape, point_in_body)
}

fn shape_distance(body_from_part: &Isometry3<f64>, shape: Shape, point_in_body: &Point3<f64>) -> f64 {
    shape.distance(&body_from_part.inverse_transform_point(point_in_body).coords)
}

impl Shape {
    /// Returns the distance of a point of the shape's own frame to its surface, m, negative inside.
    pub fn distance(self, point: &Vector3<f64>) -> f64 {
        let p = point;
        match self {
            Self::Ball(radius) => p.norm() - radius.0,
            Self::Box([x, y, z]) => beyond(&[p.x.abs() - x.0 / 2.0, p.y.abs() - y.0 / 2.0, p.z.abs() - z.0 / 2.0]),
            Self::Cylinder([radius, height]) => beyond(&[across_z(p) - radius.0, p.z.abs() - height.0 / 2.0]),
        }
    }

    /// Returns the direction in which that distance grows fastest at a point, unit; inside, out of the nearest face.
    pub fn outward(self, point: &Vector3<f64>) -> Vector3<f64> {
        let p = point;
        let way = match self {
            Self::Ball(_) => *p,
            Self::Box([x, y, z]) => {
                let over = p.abs() - Vector3::new(x.0, y.0, z.0) / 2.0;
                let way = if over.max() <= 0.0 { Vector3::ith(over.imax(), 1.0) } else { over.sup(&Vector3::zeros()) };
                way.zip_map(p, f64::copysign)
            }
            Self::Cylinder([radius, height]) => {
                let across = across_z(p);
                let (round, flat) = (across - radius.0, p.z.abs() - height.0 / 2.0);
                let (round, flat) = match (round > 0.0 || flat > 0.0, round > flat) {
                    (true, _) => (round.max(0.0), flat.max(0.0)),
                    (false, true) => (1.0, 0.0),
                    (false, false) => (0.0, 1.0),
                };
                let across = across.max(1e-12);
                Vector3::new(round * p.x / across, round * p.y / across, flat.copysign(p.z))
            }
        };
        way.try_normalize(1e-12).unwrap_or_else(Vector3::x)
    }
}

/// How far a point is from the z axis.
fn across_z(p: &Vector3<f64>) -> f64 {
    (p.x * p.x + p.y * p.y).sqrt()
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
    let body_from_part = part.pose();
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
