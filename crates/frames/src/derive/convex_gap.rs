//! The signed gap between two convex shapes, without a physics library.
//!
//! A direction separates two shapes by `s(d) = (a - b)·d - h_a(d) - h_b(d)`, with their centers `a`, `b` and half widths `h` along it, which have
//! closed forms for box, cylinder and ball. The gap is the largest `s` over all directions: positive where they are apart, minus the
//! way out where they overlap. It is looked for among the directions that can be the one (face normals, products of edges, the way between
//! centers), and with a cylinder refined from there. That of a ball has a closed form.
//!
//! Any direction gives a gap that is not too large. For two boxes the sign is exact, and so is the depth of an overlap; beside edges and
//! corners the gap is short by up to a factor of 1.8. With a ball it is exact, with a cylinder within 50 µm, as long as it is less than [`NEAR`].

use nalgebra::{Isometry3, Matrix3, Unit, Vector3};
use std::f64::consts::FRAC_1_SQRT_2;
use teachtree_base::geometry::pose;
use teachtree_base::scene::{Body, Part, Shape};

/// The gap of shapes farther apart than this is not refined, m.
pub const NEAR: f64 = 0.010;
/// The refinement ends at steps of this angle, rad: less than 10 µm for what a hand can hold.
const FINEST: f64 = 1e-5;

/// A gap with a smaller error is not refined, m; maximum number of points for that.
const EXACT: f64 = 1e-6;
const APPROACHES: usize = 64;

/// A gap with the direction in which it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// The signed distance, m; negative for an overlap.
    pub width: f64,
    /// Unit vector from the other shape to this one, reference frame.
    pub normal: Vector3<f64>,
}

/// A convex part at its place.
struct ConvexPart {
    shape: Shape,
    /// Its center, reference frame, m.
    centre: Vector3<f64>,
    /// Its axes, reference frame, are the columns.
    axes: Matrix3<f64>,
}

/// The gaps between each two parts of a body and another one that are narrower than `wanted`, m, and the narrowest of all; nothing when one
/// of the bodies has no shape.
pub fn gaps(
    (body, reference_from_body): (&Body, &Isometry3<f64>),
    (other, reference_from_other): (&Body, &Isometry3<f64>),
    wanted: f64,
) -> Vec<Gap> {
    let placed = |body: &Body, at| body.parts.iter().map(|part| ConvexPart::new(part, at)).collect::<Vec<_>>();
    let (parts, others) = (placed(body, reference_from_body), placed(other, reference_from_other));
    let pairs = parts.iter().flat_map(|part| others.iter().map(move |other| (part, other)));
    let mut roughly: Vec<(usize, (&ConvexPart, &ConvexPart), Gap)> =
        pairs.enumerate().map(|(index, (part, other))| (index, (part, other), part.rough_gap(other))).collect();
    roughly.sort_by(|(.., one), (.., other)| one.width.total_cmp(&other.width));
    let mut narrowest = f64::INFINITY;
    let mut gaps = Vec::new();
    for (index, (part, other), rough) in roughly {
        // Refinement only widens gaps: all others are too wide.
        if rough.width > narrowest.max(wanted) {
            break;
        }
        let gap = part.refined(other, rough);
        narrowest = narrowest.min(gap.width);
        gaps.push((index, gap));
    }
    gaps.sort_by_key(|(index, _)| *index);
    gaps.into_iter().map(|(_, gap)| gap).collect()
}

impl ConvexPart {
    fn new(part: &Part, reference_from_body: &Isometry3<f64>) -> Self {
        let body_from_part = pose(part.at.map(|length| length.0), part.turned);
        let reference_from_part = reference_from_body * body_from_part;
        let axes = reference_from_part.rotation.to_rotation_matrix().into_inner();
        Self { shape: part.shape, centre: reference_from_part.translation.vector, axes }
    }

    fn between(&self, other: &Self) -> Vector3<f64> {
        self.centre - other.centre
    }

    /// Returns the bound on the gap from a direction.
    fn along(&self, other: &Self, direction: Unit<Vector3<f64>>) -> Gap {
        let between = self.between(other);
        // Both shapes are the same seen from either side: only the side of the center counts.
        let normal = if direction.dot(&between) < 0.0 { -direction } else { direction };
        Gap { width: between.dot(&normal) - self.half_width(&normal) - other.half_width(&normal), normal: *normal }
    }

    /// The gap by the directions that can be the one.
    fn rough_gap(&self, other: &Self) -> Gap {
        let between = self.between(other);
        let apart = between.norm() - self.radius() - other.radius();
        let line = Unit::try_new(between, 1e-12).unwrap_or(Vector3::z_axis());
        if apart > NEAR {
            return Gap { width: apart, normal: line.into_inner() };
        }
        if let Some(gap) = self.gap_of_ball(other) {
            return gap;
        }
        let mut best = self.along(other, line);
        for direction in self.directions(other) {
            let gap = self.along(other, direction);
            if gap.width > best.width {
                best = gap;
            }
        }
        best
    }

    /// The refined gap, if one shape is a cylinder.
    fn refined(&self, other: &Self, rough: Gap) -> Gap {
        let refines = matches!(
            (self.shape, other.shape),
            (Shape::Cylinder(_), Shape::Cylinder(_) | Shape::Box(_)) | (Shape::Box(_), Shape::Cylinder(_))
        );
        if !refines || rough.width >= NEAR {
            return rough;
        }
        let (best, at_most) = self.approached(other, rough);
        if at_most - best.width < EXACT {
            return best;
        }
        let kinks: Vec<Vector3<f64>> = self.flat().chain(other.flat()).collect();
        refined(best, &kinks, |direction| self.along(other, direction))
    }

    /// Goes to and fro between shapes that are apart, from each point to the nearest one of the other shape: the best gap on the way, and how wide
    /// it is at most, m.
    fn approached(&self, other: &Self, rough: Gap) -> (Gap, f64) {
        let (mut best, mut at_most) = (rough, f64::INFINITY);
        let mut own = Some(self.centre);
        for _ in 0..APPROACHES {
            let Some((there, here)) =
                own.and_then(|own| other.nearest_to(&own)).and_then(|there| Some((there, self.nearest_to(&there)?)))
            else {
                break;
            };
            own = Some(here);
            let Some(way) = Unit::try_new(here - there, 1e-9) else { break };
            let gap = self.along(other, way);
            let was = std::mem::replace(&mut at_most, (here - there).norm());
            if gap.width > best.width {
                best = gap;
            }
            if at_most - best.width < EXACT || was - at_most < EXACT / 10.0 {
                break;
            }
        }
        (best, at_most)
    }

    /// The point of the shape that is nearest to a point outside; nothing inside.
    fn nearest_to(&self, point: &Vector3<f64>) -> Option<Vector3<f64>> {
        let way = self.way_out(&self.axes.tr_mul(&(point - self.centre)));
        (way.width > 0.0).then(|| point - self.axes * way.normal * way.width)
    }

    /// The gap when one of the two is a ball, which has a closed form.
    fn gap_of_ball(&self, other: &Self) -> Option<Gap> {
        let (ball, radius, shape, side) = match (self.shape, other.shape) {
            (Shape::Ball(radius), _) => (self, radius, other, 1.0),
            (_, Shape::Ball(radius)) => (other, radius, self, -1.0),
            _ => return None,
        };
        let way = shape.way_out(&shape.axes.tr_mul(&ball.between(shape)));
        Some(Gap { width: way.width - radius.0, normal: shape.axes * way.normal * side })
    }

    /// Returns distance and direction from the surface to a point, in the axes of the shape.
    fn way_out(&self, p: &Vector3<f64>) -> Gap {
        let along = |axis: usize, half: f64| (p[axis].abs() - half, Vector3::ith(axis, 1.0_f64.copysign(p[axis])));
        let round = |way: Vector3<f64>, radius: f64| {
            let normal = way.try_normalize(1e-12).unwrap_or(Vector3::x());
            (way.norm() - radius, normal)
        };
        // Faces that stand at right angles to each other, as far as the point is beyond them.
        let none = (f64::NEG_INFINITY, Vector3::zeros());
        let faces = match self.shape {
            Shape::Box([x, y, z]) => [along(0, x.0 / 2.0), along(1, y.0 / 2.0), along(2, z.0 / 2.0)],
            Shape::Cylinder([radius, height]) => {
                [round(Vector3::new(p.x, p.y, 0.0), radius.0), along(2, height.0 / 2.0), none]
            }
            Shape::Ball(radius) => [round(*p, radius.0), none, none],
        };
        let beyond: Vector3<f64> = faces.iter().map(|(over, normal)| normal * over.max(0.0)).sum();
        if let Some(normal) = beyond.try_normalize(1e-12) {
            return Gap { width: beyond.norm(), normal };
        }
        let nearest = faces.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        nearest.map_or(Gap { width: 0.0, normal: Vector3::z() }, |(width, normal)| Gap { width, normal })
    }

    /// The directions in which faces and edges touch.
    fn directions(&self, other: &Self) -> Vec<Unit<Vector3<f64>>> {
        let crossed = self.flat().flat_map(|one| other.flat().map(move |two| one.cross(&two)));
        // The radial direction from the axis of a cylinder towards the other center.
        let between = self.between(other);
        let radial = [self, other].into_iter().filter_map(|round| match round.shape {
            Shape::Cylinder(_) => {
                let axis = round.axes.column(2);
                Some(between - axis * axis.dot(&between))
            }
            _ => None,
        });
        let all = self.flat().chain(other.flat()).chain(crossed).chain(radial);
        all.filter_map(|direction| Unit::try_new(direction, 1e-6)).collect()
    }

    /// The normals of the flat faces.
    fn flat(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        let round = match self.shape {
            Shape::Box(_) => 0,
            Shape::Cylinder(_) => 2,
            Shape::Ball(_) => 3,
        };
        self.axes.column_iter().skip(round).map(|axis| axis.into_owned())
    }

    /// Returns the extent of the shape from its center along a direction, m.
    fn half_width(&self, direction: &Vector3<f64>) -> f64 {
        let d = self.axes.tr_mul(direction);
        match self.shape {
            Shape::Box([x, y, z]) => (d.x.abs() * x.0 + d.y.abs() * y.0 + d.z.abs() * z.0) / 2.0,
            Shape::Cylinder([radius, height]) => radius.0 * (d.x * d.x + d.y * d.y).sqrt() + d.z.abs() * height.0 / 2.0,
            Shape::Ball(radius) => radius.0,
        }
    }

    fn radius(&self) -> f64 {
        match self.shape {
            Shape::Box(edges) => edges.iter().map(|edge| edge.0 * edge.0).sum::<f64>().sqrt() / 2.0,
            Shape::Cylinder([radius, height]) => radius.0.hypot(height.0 / 2.0),
            Shape::Ball(radius) => radius.0,
        }
    }
}

/// Turns the direction of a gap by smaller and smaller steps as long as the gap grows.
///
/// Half widths have a kink where the direction is square to a face's normal, and a cylinder's another one along its axis. The largest gap is
/// often on such a ridge: steps go along each and onto it, and from the nearest one to all sides. Any others would creep, or stop short.
fn refined(mut best: Gap, kinks: &[Vector3<f64>], along: impl Fn(Unit<Vector3<f64>>) -> Gap) -> Gap {
    let mut step = 0.3;
    while step > FINEST {
        let normal = best.normal;
        let beside = || {
            let least = normal.iamin();
            normal.cross(&Vector3::from_fn(|row, _| if row == least { 1.0 } else { 0.0 })).normalize()
        };
        let ridge = |kink: &Vector3<f64>| kink.cross(&normal).try_normalize(1e-6).unwrap_or_else(beside);
        let square = |kink: &&Vector3<f64>| kink.dot(&normal).abs();
        let nearest = kinks.iter().min_by(|a, b| square(a).total_cmp(&square(b)));
        let one = nearest.map_or_else(beside, ridge);
        let two = normal.cross(&one);
        let (up, down) = ((one + two) * FRAC_1_SQRT_2, (one - two) * FRAC_1_SQRT_2);
        let sides =
            [two, up, down].into_iter().chain(kinks.iter().map(ridge)).flat_map(|side| [side * step, -side * step]);
        let turns = sides.chain(kinks.iter().map(|kink| -kink * kink.dot(&normal)));
        let gaps = turns.filter_map(|turn| Unit::try_new(normal + turn, 1e-9)).map(&along);
        match gaps.max_by(|a, b| a.width.total_cmp(&b.width)) {
            Some(gap) if gap.width > best.width => best = gap,
            _ => step /= 4.0,
        }
    }
    best
}
