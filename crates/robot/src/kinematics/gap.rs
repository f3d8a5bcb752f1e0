//! Gaps between convex shapes, by parry: GJK where they are apart, separating axes where they overlap.
//!
//! A shape is a core and everything within a radius of it. The gap between two cores is the largest separation along any direction. Of cores that overlap it is
//! negative: minus the length of the shortest way out. Of segments and boxes, the normal of a face or the cross product of two edges is that direction
//! (S. Gottschalk, M. C. Lin and D. Manocha, *OBBTree*, 1996). Of cylinders and pieces of meshes, the expanding polytope algorithm (EPA) finds it. EPA fails on
//! some shapes with parallel faces, so normals of faces are tried as well.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use parry3d::math::{Pose, Vector};
use parry3d::query::PointQuery;
use parry3d::query::details::distance_segment_segment;
use parry3d::query::epa::EPA;
use parry3d::query::gjk::{self, CsoPoint, GJKResult, VoronoiSimplex};
use parry3d::shape::{Cylinder, Segment, SupportMap};
use std::f64::consts::FRAC_PI_2;
use teachtree_base::scene::{Part, Shape};
use teachtree_description::polytope::Polytope;
use teachtree_description::shape::CollisionShape;

/// Shapes nearer than this touch, m.
pub(crate) const TOUCHING_M: f64 = 1e-6;

/// A convex shape: all points within a radius of its core.
pub(crate) struct Convex<'s> {
    core: Core<'s>,
    /// m.
    radius: f64,
}

/// A core where it is.
enum Core<'s> {
    Segment(Segment),
    /// A box by its middle and from there to the middles of three faces.
    Box(Vector, [Vector; 3]),
    Cylinder(Pose, Cylinder),
    Piece(Pose, &'s Polytope),
}

/// Returns the gap between two shapes, m; minus the length of the shortest way out where they overlap.
pub fn gap(one: &CollisionShape, other: &CollisionShape) -> f64 {
    gap_below(one, other, f64::INFINITY).unwrap_or(f64::INFINITY)
}

/// Returns the gap of [`gap`] if it is less than `below`, m. Shapes that are farther apart cost less.
pub fn gap_below(one: &CollisionShape, other: &CollisionShape, below: f64) -> Option<f64> {
    Convex::from(one).gap_below(&Convex::from(other), below)
}

/// Returns the distance of a point from a shape, m; in its core, minus the radius of the shape.
pub fn distance(shape: &CollisionShape, point: &Point3<f64>) -> f64 {
    let shape = Convex::from(shape);
    shape.core.distance(point) - shape.radius
}

/// Returns the distance of a point from a polyhedron without its rounding, m; 0 in it.
pub(crate) fn distance_of_polytope(polytope: &Polytope, point: &Point3<f64>) -> f64 {
    Core::Piece(Pose::IDENTITY, polytope).distance(point)
}

impl<'s> From<&'s CollisionShape> for Convex<'s> {
    fn from(shape: &'s CollisionShape) -> Self {
        match shape {
            CollisionShape::Capsule(from, to, radius) => Self { core: segment(from, to), radius: *radius },
            CollisionShape::Box(at, half) => Self { core: cuboid(at, *half), radius: 0.0 },
            CollisionShape::Piece(at, polytope) => {
                Self { core: Core::Piece(pose(at), polytope), radius: polytope.radius }
            }
        }
    }
}

impl Convex<'static> {
    /// A part of a body that is at a pose.
    pub(crate) fn of_part(part: &Part, body: &Isometry3<f64>) -> Self {
        let at = body * part.pose();
        match part.shape {
            Shape::Box(edges) => Self { core: cuboid(&at, Vector3::from(edges.map(|edge| edge.0 / 2.0))), radius: 0.0 },
            Shape::Cylinder([radius, height]) => {
                // The axis of parry's cylinder is y.
                let upright = at * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), FRAC_PI_2);
                Self { core: Core::Cylinder(pose(&upright), Cylinder::new(height.0 / 2.0, radius.0)), radius: 0.0 }
            }
            Shape::Ball(radius) => {
                let center = at * Point3::origin();
                Self { core: segment(&center, &center), radius: radius.0 }
            }
        }
    }
}

impl Convex<'_> {
    /// Returns the gap to another shape, m, if it is less than `below`, m.
    pub(crate) fn gap_below(&self, other: &Convex<'_>, below: f64) -> Option<f64> {
        let round = self.radius + other.radius;
        let cores = match (&self.core, &other.core) {
            (Core::Segment(one), Core::Segment(other)) => distance_segment_segment(&Pose::IDENTITY, one, other),
            (one, other) => one.gap_below(other, below + round)?,
        };
        Some(cores - round).filter(|gap| *gap < below)
    }
}

impl Core<'_> {
    /// The gap to another core, m; `None` if it is above zero and no less than `below`, m.
    fn gap_below(&self, other: &Core<'_>, below: f64) -> Option<f64> {
        let below = below.max(0.0);
        if self.least_gap(other).max(other.least_gap(self)) >= below {
            return None;
        }
        let (found, simplex) = self.closest(other, below)?;
        match found {
            GJKResult::ClosestPoints(ours, theirs, _) => Some(ours.distance(theirs)),
            GJKResult::Intersection => Some(self.overlap(other, &simplex)),
            GJKResult::NoIntersection(_) | GJKResult::Proximity(_) => None,
        }
    }

    /// The distance of a point, m; 0 in the core.
    fn distance(&self, point: &Point3<f64>) -> f64 {
        match self.closest(&segment(point, point), f64::INFINITY) {
            Some((GJKResult::ClosestPoints(ours, theirs, _), _)) => ours.distance(theirs),
            _ => 0.0,
        }
    }

    /// The gap to the ball about another core, m, or less; 0 and less prove nothing.
    fn least_gap(&self, other: &Core<'_>) -> f64 {
        let (from, reach) = other.ball();
        let distance = match self {
            Self::Segment(segment) => segment.distance_to_local_point(from, true),
            Self::Box(middle, halves) => {
                let beyond =
                    |half: &Vector| ((from - *middle).dot(*half).abs() / half.length() - half.length()).max(0.0);
                Vector::from(halves.each_ref().map(beyond)).length()
            }
            Self::Cylinder(..) | Self::Piece(..) => {
                let (middle, radius) = self.ball();
                middle.distance(from) - radius
            }
        };
        distance - reach
    }

    /// The result of GJK for cores nearer than `below`, m, with its last simplex; `None` where a number is not finite, which parry asserts.
    fn closest(&self, other: &Core<'_>, below: f64) -> Option<(GJKResult, VoronoiSimplex)> {
        let toward = (other.ball().0 - self.ball().0).try_normalize().unwrap_or(Vector::X);
        let first = CsoPoint::from_shapes(&Pose::IDENTITY, self, other, toward);
        if !first.point.length_squared().is_finite() {
            return None;
        }
        let mut simplex = VoronoiSimplex::new();
        simplex.reset(first);
        let found = gjk::closest_points(&Pose::IDENTITY, self, other, below, true, &mut simplex);
        Some((found, simplex))
    }

    /// The largest separation of cores that overlap, m: minus the length of the shortest way out. One of them is no segment.
    fn overlap(&self, other: &Core<'_>, simplex: &VoronoiSimplex) -> f64 {
        let theirs = other.edges();
        let crossed = self.edges().into_iter().flat_map(|edge| theirs.iter().map(move |other| edge.cross(*other)));
        let has_all_axes = [self, other].iter().all(|core| matches!(core, Core::Segment(_) | Core::Box(..)));
        let expanded = || EPA::new().closest_points(&Pose::IDENTITY, self, other, simplex);
        let expanded = if has_all_axes { None } else { expanded() }.map(|(.., normal)| normal);
        let axes = self.normals().into_iter().chain(other.normals()).chain(crossed).chain(expanded);
        let separations = axes
            .filter_map(Vector::try_normalize)
            .map(|axis| self.separation(other, axis).max(self.separation(other, -axis)));
        separations.fold(f64::NEG_INFINITY, f64::max)
    }

    /// How far another core is ahead of this one along a direction, m: the gap is no smaller.
    fn separation(&self, other: &Core<'_>, axis: Vector) -> f64 {
        (other.local_support_point(-axis) - self.local_support_point(axis)).dot(axis)
    }

    /// The middle and the radius, m, of a ball that contains the core.
    fn ball(&self) -> (Vector, f64) {
        match self {
            Self::Segment(segment) => ((segment.a + segment.b) / 2.0, segment.length() / 2.0),
            Self::Box(middle, [x, y, z]) => (*middle, (*x + *y + *z).length()),
            Self::Cylinder(at, cylinder) => (at.translation, cylinder.radius.hypot(cylinder.half_height)),
            Self::Piece(at, polytope) => {
                let (middle, radius) = polytope.bounding_ball();
                (*at * vector(middle.coords), radius)
            }
        }
    }

    /// Along the normals of flat faces; one of two that are opposite.
    fn normals(&self) -> Vec<Vector> {
        match self {
            Self::Segment(_) => Vec::new(),
            Self::Box(_, halves) => halves.to_vec(),
            Self::Cylinder(at, _) => vec![at.rotation * Vector::Y],
            Self::Piece(at, polytope) => polytope.normals.iter().map(|normal| at.rotation * vector(*normal)).collect(),
        }
    }

    /// The directions of edges of a segment or a box.
    fn edges(&self) -> Vec<Vector> {
        match self {
            Self::Segment(segment) => vec![segment.b - segment.a],
            Self::Box(..) => self.normals(),
            Self::Cylinder(..) | Self::Piece(..) => Vec::new(),
        }
    }
}

impl SupportMap for Core<'_> {
    fn local_support_point(&self, toward: Vector) -> Vector {
        match self {
            Self::Segment(segment) => segment.local_support_point(toward),
            Self::Box(middle, halves) => {
                halves.iter().fold(*middle, |at, half| at + *half * 1.0_f64.copysign(half.dot(toward)))
            }
            Self::Cylinder(at, cylinder) => cylinder.support_point(at, toward),
            Self::Piece(at, polytope) => {
                *at * vector(polytope.farthest(&(at.rotation.inverse() * toward).into()).coords)
            }
        }
    }
}

fn segment(from: &Point3<f64>, to: &Point3<f64>) -> Core<'static> {
    Core::Segment(Segment::new(vector(from.coords), vector(to.coords)))
}

fn cuboid(at: &Isometry3<f64>, half: Vector3<f64>) -> Core<'static> {
    let axes = at.rotation.to_rotation_matrix();
    Core::Box(vector(at.translation.vector), [0, 1, 2].map(|axis| vector(axes.matrix().column(axis) * half[axis])))
}

fn vector(vector: Vector3<f64>) -> Vector {
    vector.into()
}

fn pose(pose: &Isometry3<f64>) -> Pose {
    Pose::from_parts(vector(pose.translation.vector), pose.rotation.into())
}
