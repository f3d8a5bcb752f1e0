//! Convex parts of a scene's bodies as parry shapes, with the distances to a point and to another body.

use super::conversion;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use parry3d::query;
use parry3d::shape::SharedShape;
use teachtree_base::error::InputError;
use teachtree_base::pose::directed;
use teachtree_base::scene::{Body, Part, Shape};

/// Maximum number of convex parts of a body.
const MAX_PARTS: usize = 256;

/// The shape of a body: the union of convex parts.
#[derive(Clone)]
pub(super) struct Solid {
    parts: Vec<SolidPart>,
    /// The bounding box of all parts.
    room: Aabb,
}

/// A convex part with its place in the body frame.
#[derive(Clone)]
pub(super) struct SolidPart {
    pub(super) shape: SharedShape,
    pub(super) body_from_part: Isometry3<f64>,
    room: Aabb,
}

/// A box along the axes of its frame, m.
#[derive(Clone, Copy)]
pub(super) struct Aabb {
    low: Point3<f64>,
    high: Point3<f64>,
}

/// The point of a solid's surface that is nearest to a given point; body frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfacePoint {
    /// Signed distance, m: negative inside.
    pub(super) distance: f64,
    /// The surface point.
    pub(super) point: Point3<f64>,
    /// Unit normal out of the solid; `None` when the given point lies on the surface itself.
    pub(super) normal: Option<Vector3<f64>>,
}

/// The lowest and the highest corner of the bounding box of a body, m, body frame; `None` for a body without a shape.
pub(super) fn corners(body: &Body) -> Option<[Point3<f64>; 2]> {
    Solid::new("", body).ok().map(|solid| [solid.room.low, solid.room.high])
}

impl Solid {
    /// The solid of a body of the scene; `name` is its name in errors.
    ///
    /// # Errors
    /// No part, too many parts, a size out of range, or an invalid rotation.
    pub(super) fn new(name: &str, body: &Body) -> Result<Self, InputError> {
        if body.parts.is_empty() {
            let message = "has no parts, expected at least one shape to simulate";
            return Err(InputError::new(format!("bodies.{name}"), message));
        }
        if body.parts.len() > MAX_PARTS {
            let message = format!("has {} parts, at most {MAX_PARTS} are simulated", body.parts.len());
            return Err(InputError::new(format!("bodies.{name}.parts"), message));
        }
        let part = |(number, part)| {
            SolidPart::new(part).map_err(|message| InputError::new(format!("bodies.{name}.parts.{number}"), message))
        };
        let parts = body.parts.iter().enumerate().map(part).collect::<Result<Vec<SolidPart>, _>>()?;
        let rooms = parts.iter().map(|part| part.room);
        let room = rooms.reduce(|one, other| Aabb { low: one.low.inf(&other.low), high: one.high.sup(&other.high) });
        Ok(Self { room: room.unwrap_or(Aabb { low: Point3::origin(), high: Point3::origin() }), parts })
    }

    /// The convex parts.
    pub(super) fn parts(&self) -> &[SolidPart] {
        &self.parts
    }

    /// Volume of all parts, m^3; parts are meant not to overlap.
    pub(super) fn volume(&self) -> f64 {
        self.parts.iter().map(|part| part.shape.mass_properties(1.0).mass()).sum()
    }

    /// The nearest surface point; inside an overlap of parts, that of the part in which the point is deepest.
    pub(super) fn nearest(&self, point_in_body: Point3<f64>) -> SurfacePoint {
        self.nearest_within(point_in_body, f64::INFINITY)
    }

    /// The nearest surface point, when it is nearer than `reach`, m. Most fingertips are far from most bodies, which a bounding box of each part decides.
    pub(super) fn within(&self, point_in_body: Point3<f64>, reach: f64) -> Option<SurfacePoint> {
        if self.room.is_farther(&point_in_body, reach) {
            return None;
        }
        Some(self.nearest_within(point_in_body, reach)).filter(|nearest| nearest.distance < reach)
    }

    /// The nearest surface point of the parts that may be nearer than `reach`, m.
    fn nearest_within(&self, point_in_body: Point3<f64>, reach: f64) -> SurfacePoint {
        let mut best = SurfacePoint { distance: f64::INFINITY, point: point_in_body, normal: None };
        for part in self.parts.iter().filter(|part| !part.room.is_farther(&point_in_body, reach)) {
            let nearest = part.nearest(point_in_body);
            if nearest.distance < best.distance {
                best = nearest;
            }
        }
        best
    }

    /// The room that the solid takes in another frame.
    pub(super) fn room(&self, frame_from_body: &Isometry3<f64>) -> Aabb {
        let middle = frame_from_body * nalgebra::center(&self.room.low, &self.room.high);
        let half =
            frame_from_body.rotation.to_rotation_matrix().matrix().abs() * (self.room.high - self.room.low) / 2.0;
        Aabb { low: middle - half, high: middle + half }
    }

    /// The surface point nearest to a point and the normal there; a point on the surface itself takes the normal of the face about it.
    pub(super) fn surface(&self, point_in_body: Point3<f64>) -> (Point3<f64>, Vector3<f64>) {
        let nearest = self.nearest(point_in_body);
        let inside = nearest.point + (Point3::origin() - nearest.point) * 1e-3;
        let normal = nearest.normal.or_else(|| self.nearest(inside).normal).unwrap_or_else(Vector3::z);
        (nearest.point, normal)
    }

    /// The gap to another solid, m; 0 when they touch or overlap. Poses are those of the two bodies in one frame.
    pub(super) fn gap(&self, world_from_self: &Isometry3<f64>, other: &Self, world_from_other: &Isometry3<f64>) -> f64 {
        let mut gap = f64::INFINITY;
        for part1 in &self.parts {
            let pose1 = conversion::pose(&(world_from_self * part1.body_from_part));
            for part2 in &other.parts {
                let pose2 = conversion::pose(&(world_from_other * part2.body_from_part));
                if let Ok(found) = query::distance(&pose1, &*part1.shape, &pose2, &*part2.shape) {
                    gap = gap.min(found.distance);
                }
            }
        }
        gap
    }
}

impl SolidPart {
    fn new(part: &Part) -> Result<Self, String> {
        part.check()?;
        let shape = match part.shape {
            Shape::Box([x, y, z]) => SharedShape::cuboid(x.0 / 2.0, y.0 / 2.0, z.0 / 2.0),
            // parry's cylinder stands along y, ours along z: the part is turned below.
            Shape::Cylinder([radius, height]) => SharedShape::cylinder(height.0 / 2.0, radius.0),
            Shape::Ball(radius) => SharedShape::ball(radius.0),
        };
        let mut body_from_part = isometry(part.at.map(|length| length.0), part.turned)?;
        if matches!(part.shape, Shape::Cylinder(_)) {
            body_from_part *= UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
        }
        let around = shape.compute_aabb(&conversion::pose(&body_from_part));
        let room = Aabb { low: conversion::our_point(around.mins), high: conversion::our_point(around.maxs) };
        Ok(Self { shape, body_from_part, room })
    }

    fn nearest(&self, point_in_body: Point3<f64>) -> SurfacePoint {
        let point_in_part = self.body_from_part.inverse_transform_point(&point_in_body);
        let found = self.shape.project_local_point(conversion::point(point_in_part), false);
        let surface_in_part = conversion::our_point(found.point);
        let outwards = if found.is_inside { surface_in_part - point_in_part } else { point_in_part - surface_in_part };
        let distance = outwards.norm();
        SurfacePoint {
            distance: if found.is_inside { -distance } else { distance },
            point: self.body_from_part * surface_in_part,
            normal: outwards.try_normalize(1e-9).map(|normal| self.body_from_part * normal),
        }
    }
}

impl Aabb {
    /// Whether a point is surely farther than this; a nanometre covers rounding.
    pub(super) fn is_farther(&self, point: &Point3<f64>, reach: f64) -> bool {
        let reach = reach + 1e-9;
        (0..3).any(|axis| point[axis] < self.low[axis] - reach || point[axis] > self.high[axis] + reach)
    }
}

/// The pose with this position (m) and quaternion (w x y z), which is normalised.
pub(super) fn isometry(position: [f64; 3], [w, x, y, z]: [f64; 4]) -> Result<Isometry3<f64>, String> {
    let rotation = directed([w, x, y, z], 1e-6)
        .ok_or_else(|| format!("is turned by [{w}, {x}, {y}, {z}], expected a quaternion w x y z that is not zero"))?;
    Ok(Isometry3::from_parts(Vector3::from(position).into(), rotation))
}
