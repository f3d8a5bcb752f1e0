//! The shapes of links: bars with round ends, boxes and convex pieces of meshes, their masses, and the gaps between them.
//!
//! Shapes are convex. Gaps of boxes to bars and to boxes have a closed form. Otherwise alternating steps, each to the nearest point of the other shape, find the
//! nearest points (W. Cheney and A. A. Goldstein, *Proximity Maps for Convex Sets*, 1959). The depth of a penetration is the shortest way out along an axis that may
//! separate the shapes (S. Gottschalk, M. C. Lin and D. Manocha, *OBBTree*, 1996).

use super::box_gap::{box_to_box, outside, segment_to_box};
use super::polytope::Polytope;
use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};
use std::sync::Arc;
use teachtree_base::quantity::Length;
use teachtree_base::scene::{Body, Part, Shape};

/// Maximum number of alternating steps of the search for a gap.
const STEPS: usize = 200;
/// A step that is shorter ends the search for a gap, m.
pub const SHORT_M: f64 = 1e-6;

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

    /// Returns a bound of the displacement of any point since the same shape was placed as `before`, m; infinite if it is another kind of shape.
    pub fn displacement(&self, before: &Self) -> f64 {
        let of_frame = |at: &Isometry3<f64>, before: &Isometry3<f64>, reach: f64| {
            // A rotation by an angle moves a point by 2 sin(angle / 2) times its distance; unit quaternions differ by 2 sin(angle / 4), which is more than half of that.
            let [now, then] = [at.rotation.coords, before.rotation.coords];
            (at.translation.vector - before.translation.vector).norm()
                + 2.0 * (now - then).norm().min((now + then).norm()) * reach
        };
        match (self, before) {
            (Self::Capsule(from, to, _), Self::Capsule(before_from, before_to, _)) => {
                (from - before_from).norm().max((to - before_to).norm())
            }
            (Self::Box(at, half), Self::Box(before, _)) => of_frame(at, before, half.norm()),
            (Self::Piece(at, polytope), Self::Piece(before, _)) => {
                let (center, radius) = polytope.bounding_ball();
                of_frame(at, before, center.coords.norm() + radius)
            }
            _ => f64::INFINITY,
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

    /// Returns the distance of a point, m; negative in round shapes by up to their radius, zero in boxes.
    pub fn distance(&self, point: &Point3<f64>) -> f64 {
        match self {
            Self::Box(at, half) => outside(&at.inverse_transform_point(point).coords, half).norm(),
            _ => (self.nearest(point) - point).norm() - self.radius(),
        }
    }

    /// Returns the gap to another shape, m; negative by the way out for shapes that are in each other. Of pieces of meshes only the
    /// normals of faces are tried, so that the way out may be a shorter one.
    pub fn gap(&self, other: &Self) -> f64 {
        self.gap_below(other, f64::INFINITY).unwrap_or(f64::INFINITY)
    }

    /// The gap to another shape as [`CollisionShape::gap`] gives it, m; `None` where it is no less than `below`, m. Where that is above zero, a plane between them may
    /// show it early.
    pub fn gap_below(&self, other: &Self, below: f64) -> Option<f64> {
        match (self, other) {
            (Self::Capsule(from, to, radius), Self::Box(at, half))
            | (Self::Box(at, half), Self::Capsule(from, to, radius)) => {
                let begins = at.inverse_transform_point(from).coords;
                let way = at.inverse_transform_vector(&(to - from));
                segment_to_box(&begins, &way, half, below + radius).map(|gap| gap - radius)
            }
            (Self::Box(ours, half), Self::Box(theirs, other_half)) => {
                box_to_box(half, &ours.inv_mul(theirs), other_half, below)
            }
            _ => self.gap_by_steps(other, below),
        }
    }

    /// [`CollisionShape::gap_below`] by alternating steps.
    fn gap_by_steps(&self, other: &Self, below: f64) -> Option<f64> {
        let round = self.radius() + other.radius();
        let bars = matches!((self, other), (Self::Capsule(..), Self::Capsule(..)));
        let mut at = self.start_point(other);
        let mut there = other.nearest(&at);
        // Between two bars, one step from there is the last.
        let steps = if bars { 1 } else { STEPS };
        for step in 0..steps {
            let next = self.nearest(&there);
            let moved = (next - at).norm();
            (at, there) = (next, other.nearest(&next));
            if moved < SHORT_M {
                break;
            }
            // Points go on toward each other slowly where faces are askew.
            if !bars
                && below > 0.0
                && below.is_finite()
                && (step + 1).is_power_of_two()
                && let Some(axis) = (there - at).try_normalize(SHORT_M)
            {
                let between = other.extent(&axis)[0] - self.extent(&axis)[1];
                if between - round >= below {
                    return None;
                }
            }
        }
        let apart = (at - there).norm();
        // The cores of bars are lines, which are not in each other.
        let apart = match apart < SHORT_M {
            true if bars => 0.0,
            true => -self.penetration(other).max(0.0),
            false => apart,
        };
        Some(apart - round).filter(|gap| *gap < below)
    }

    /// Returns the penetration depth of the cores of two shapes, one of them a piece of a mesh, m; zero without a penetration. Only normals of faces are tried.
    fn penetration(&self, other: &Self) -> f64 {
        let axes = self.normals().into_iter().chain(other.normals());
        let mut least = f64::INFINITY;
        for axis in axes.filter_map(|axis| axis.try_normalize(1e-6)) {
            let ([low, high], [from, to]) = (self.extent(&axis), other.extent(&axis));
            least = least.min(high - from).min(to - low);
            if least <= 0.0 {
                return 0.0;
            }
        }
        if least.is_finite() { least } else { 0.0 }
    }

    /// The normals of a core's faces, of two that are opposite one.
    fn normals(&self) -> Vec<Vector3<f64>> {
        match self {
            Self::Capsule(..) => Vec::new(),
            Self::Box(at, _) => [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| at * axis).into(),
            Self::Piece(at, polytope) => polytope.normals().map(|normal| at * normal).collect(),
        }
    }

    /// From where to where a core reaches along an axis, m.
    fn extent(&self, axis: &Vector3<f64>) -> [f64; 2] {
        let along = |point: &Point3<f64>| axis.dot(&point.coords);
        match self {
            Self::Capsule(from, to, _) => {
                let [from, to] = [from, to].map(along);
                [from.min(to), from.max(to)]
            }
            Self::Box(at, half) => {
                let reach = at.inverse_transform_vector(axis).abs().dot(half);
                [-reach, reach].map(|reach| along(&at.translation.vector.into()) + reach)
            }
            Self::Piece(at, polytope) => {
                let ends = polytope.points.iter().map(|point| along(&(at * point)));
                ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], end| [low.min(end), high.max(end)])
            }
        }
    }

    /// Returns a bar along the longest edge of [`Self::bounding_box`] that holds the shape.
    pub fn bounding_bar(&self) -> Self {
        if let Self::Capsule(..) = self {
            return self.clone();
        }
        let (at, half) = self.bounding_box();
        let axis = half.imax();
        let reach = Vector3::ith(axis, half[axis]);
        let radius = (half - reach).norm();
        Self::Capsule(at * Point3::from(-reach), at * Point3::from(reach), radius)
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

    /// A point of the shape from which it is near to another one. Of bars it is the nearest to the other's line, so that nearly parallel ones, between which
    /// each step is a short one, are there at once (C. Ericson, *Real-Time Collision Detection*, 5.1.9).
    fn start_point(&self, other: &Self) -> Point3<f64> {
        if let (Self::Capsule(from, to, _), Self::Capsule(from_of_other, to_of_other, _)) = (self, other) {
            let (ours, theirs, between) = (to - from, to_of_other - from_of_other, from - from_of_other);
            let (a, b, e) = (ours.norm_squared(), ours.dot(&theirs), theirs.norm_squared());
            let (c, f) = (ours.dot(&between), theirs.dot(&between));
            let apart = a * e - b * b;
            if apart > f64::EPSILON * a * e {
                return from + ours * ((b * f - c * e) / apart).clamp(0.0, 1.0);
            }
        }
        self.nearest(&other.nearest(&self.middle()))
    }

    fn middle(&self) -> Point3<f64> {
        match self {
            Self::Capsule(from, to, _) => nalgebra::center(from, to),
            Self::Box(at, _) => at.translation.vector.into(),
            Self::Piece(at, polytope) => at * Point3::from(polytope.bounding_box.0.translation.vector),
        }
    }

    /// How thick the shape is about its core, m.
    fn radius(&self) -> f64 {
        match self {
            Self::Capsule(_, _, radius) => *radius,
            Self::Box(..) => 0.0,
            Self::Piece(_, polytope) => polytope.radius,
        }
    }

    /// The point of the shape's core that is nearest to a point.
    fn nearest(&self, to: &Point3<f64>) -> Point3<f64> {
        match self {
            Self::Capsule(from, end, _) => {
                let way: Vector3<f64> = end - from;
                let share = (to - from).dot(&way) / way.norm_squared().max(f64::MIN_POSITIVE);
                from + way * share.clamp(0.0, 1.0)
            }
            Self::Box(at, half) => {
                let own = at.inverse_transform_point(to).coords;
                at * Point3::from(own.zip_map(half, |value, half| value.clamp(-half, half)))
            }
            Self::Piece(at, polytope) => at * polytope.nearest(&at.inverse_transform_point(to)),
        }
    }

    /// Volume, m^3, center, and inertia about the center for a density of 1 kg/m^3.
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

/// Center of mass and inertia about it, of a mass spread evenly over solids. Without any, a ball of 10 mm.
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
