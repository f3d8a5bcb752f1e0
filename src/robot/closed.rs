//! The closed-form inverse of a finger whose first two joints meet at right angles and whose others bend in one plane (PAPER.md 9.3).
//!
//! ```text
//! base frame: x along the straight finger, z where it bends to, origin where the first two joints meet
//! φ  = atan2(y, x)                                   the first joint turns the plane of the others
//! in the plane, with r along x and z:  ρ² = r² + z²
//! coupled, θ4 = θ3, c = cos θ3:  4 L2 L4 c² + 2 L3 (L2+L4) c + (L2²+L3²+L4² - 2 L2 L4 - ρ²) = 0
//! free θ4:  a bar of length B² = L3²+L4²+2 L3 L4 cos θ4 at the angle β:  cos(θ3+β) = (ρ² - L2² - B²) / (2 L2 B)
//! θ2 = angle of (r, z) - angle of the tip at θ2 = 0
//! w  = |r| sqrt(Σ minors² of the planar Jacobian)
//! ```

use super::hand::{Angles, MAX_DOFS, REACHED_M, Reached};
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

/// How exactly axes must meet and be parallel.
const EXACT: f64 = 1e-6;
/// A free last joint is tried at this many angles over its range, and then this often between the best and its neighbours.
const SCANNED: usize = 9;
const REFINED: usize = 6;

/// A finger of this form.
#[derive(Clone, Debug)]
pub(super) struct Closed {
    palm_from_base: Isometry3<f64>,
    /// Whether the first joint turns about +z or -z of the base.
    sign: f64,
    /// L2, L3, L4.
    links: [f64; 3],
    /// Whether the last joint turns as far as the one before.
    coupled: bool,
}

impl Closed {
    /// The form of a finger, if it has one: origins and axes of its joints at rest (palm frame), what drives them, and the tip.
    pub(super) fn of(
        joints: &[(Point3<f64>, Vector3<f64>)],
        drives: &[(usize, f64)],
        tip: Point3<f64>,
        ranges: &[[f64; 2]],
    ) -> Option<Self> {
        let &[(o1, a1), (o2, a2), (o3, a3), (o4, a4)] = joints else { return None };
        let coupled = match drives {
            [(0, r0), (1, r1), (2, r2), (2, r3)] if [r0, r1, r2, r3].iter().all(|ratio| **ratio == 1.0) => true,
            [(0, r0), (1, r1), (2, r2), (3, r3)] if [r0, r1, r2, r3].iter().all(|ratio| **ratio == 1.0) => false,
            _ => return None,
        };
        let x = (o3 - o2).try_normalize(EXACT)?;
        let along = |vector: Vector3<f64>| (vector - x * vector.norm()).norm() < EXACT;
        let straight = along(o4 - o3) && along(tip - o4);
        let meets = (o2 - o1).cross(&a1).norm() < EXACT;
        let square = a1.dot(&a2).abs() < EXACT && a1.dot(&x).abs() < EXACT && a2.dot(&x).abs() < EXACT;
        let parallel = (a3 - a2).norm() < EXACT && (a4 - a2).norm() < EXACT;
        // Bending beyond straight has two solutions, which the branch below does not look for.
        let bends = ranges.iter().skip(2).all(|[low, high]| *low >= -EXACT && *high <= 3.0);
        if !(straight && meets && square && parallel && bends) {
            return None;
        }
        // A positive turn about the second axis bends x towards z.
        let z = a2.cross(&x);
        let y = z.cross(&x);
        let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, z]));
        let sign = a1.dot(&z).signum();
        Some(Self {
            palm_from_base: Isometry3::from_parts(o2.coords.into(), UnitQuaternion::from_rotation_matrix(&turn)),
            sign,
            links: [(o3 - o2).norm(), (o4 - o3).norm(), (tip - o4).norm()],
            coupled,
        })
    }

    /// The best angles by measure that reach the point, or angles that come near.
    pub(super) fn reach(&self, point: Point3<f64>, ranges: &[[f64; 2]]) -> Reached {
        let p = self.palm_from_base.inverse_transform_point(&point);
        let mut best = Candidate::NONE;
        // A finger that does not reach straight may bend back over its base.
        for (phi, r) in [(p.y.atan2(p.x), p.x.hypot(p.y)), ((-p.y).atan2(-p.x), -p.x.hypot(p.y))] {
            let first = (self.sign * phi).clamp(ranges[0][0], ranges[0][1]);
            // What turning the first joint less far leaves: the point's foot in the plane, and its height above it.
            let off = phi - self.sign * first;
            let (r_plane, beside) = (r * off.cos(), r * off.sin());
            if self.coupled {
                best.keep(self.bend_coupled(first, r_plane, p.z, beside, ranges));
            } else {
                self.scan(first, r_plane, p.z, beside, ranges, &mut best);
            }
            if best.miss < REACHED_M {
                break;
            }
        }
        Reached { angles: best.angles, miss: best.miss, measure: best.measure }
    }

    fn bend_coupled(&self, first: f64, r: f64, z: f64, beside: f64, ranges: &[[f64; 2]]) -> Candidate {
        let [l2, l3, l4] = self.links;
        let (a, b) = (4.0 * l2 * l4, 2.0 * l3 * (l2 + l4));
        let c = l2 * l2 + l3 * l3 + l4 * l4 - 2.0 * l2 * l4 - r * r - z * z;
        let root = ((b * b - 4.0 * a * c).max(0.0).sqrt() - b) / (2.0 * a);
        let third = root.clamp(-1.0, 1.0).acos().clamp(ranges[2][0], ranges[2][1]);
        self.candidate([first, third, third], r, z, beside, ranges)
    }

    fn bend_free(&self, first: f64, fourth: f64, r: f64, z: f64, beside: f64, ranges: &[[f64; 2]]) -> Candidate {
        let [l2, l3, l4] = self.links;
        let bar2 = l3 * l3 + l4 * l4 + 2.0 * l3 * l4 * fourth.cos();
        let bar = bar2.sqrt();
        let beta = (l4 * fourth.sin()).atan2(l3 + l4 * fourth.cos());
        let cosine = (r * r + z * z - l2 * l2 - bar2) / (2.0 * l2 * bar);
        let third = (cosine.clamp(-1.0, 1.0).acos() - beta).clamp(ranges[2][0], ranges[2][1]);
        self.candidate([first, third, fourth], r, z, beside, ranges)
    }

    fn scan(&self, first: f64, r: f64, z: f64, beside: f64, ranges: &[[f64; 2]], best: &mut Candidate) {
        let [low, high] = ranges[3];
        let step = (high - low) / (SCANNED - 1) as f64;
        let mut top = (Candidate::NONE, low);
        for index in 0..SCANNED {
            let fourth = low + step * index as f64;
            let candidate = self.bend_free(first, fourth, r, z, beside, ranges);
            if candidate.beats(&top.0) {
                top = (candidate, fourth);
            }
        }
        // Halving towards the better side: the measure is smooth between the samples.
        let mut width = step / 2.0;
        for _ in 0..REFINED {
            for fourth in [top.1 - width, top.1 + width] {
                let candidate = self.bend_free(first, fourth.clamp(low, high), r, z, beside, ranges);
                if candidate.beats(&top.0) {
                    top = (candidate, fourth.clamp(low, high));
                    break;
                }
            }
            width /= 2.0;
        }
        best.keep(top.0);
    }

    /// The bend `[first, third, fourth]` with the second joint turned to the point as far as it goes.
    fn candidate(
        &self,
        [first, third, fourth]: [f64; 3],
        r: f64,
        z: f64,
        beside: f64,
        ranges: &[[f64; 2]],
    ) -> Candidate {
        let [l2, l3, l4] = self.links;
        let (s3, c3) = third.sin_cos();
        let (s34, c34) = (third + fourth).sin_cos();
        let (tip_r, tip_z) = (l2 + l3 * c3 + l4 * c34, l3 * s3 + l4 * s34);
        let wanted = wrapped(z.atan2(r) - tip_z.atan2(tip_r));
        let second = wanted.clamp(ranges[1][0], ranges[1][1]);
        let (s2, c2) = second.sin_cos();
        let turned = |x: f64, y: f64| (c2 * x - s2 * y, s2 * x + c2 * y);
        let (at_r, at_z) = turned(tip_r, tip_z);
        let miss = ((r - at_r).powi(2) + (z - at_z).powi(2) + beside * beside).sqrt();
        // Columns of the planar Jacobian: quarter turns of the ways from the joints to the tip.
        let from3 = turned(l3 * c3 + l4 * c34, l3 * s3 + l4 * s34);
        let from4 = turned(l4 * c34, l4 * s34);
        let minor = |a: (f64, f64), b: (f64, f64)| a.0 * b.1 - a.1 * b.0;
        let tip = (at_r, at_z);
        let planar = if self.coupled {
            minor(tip, (from3.0 + from4.0, from3.1 + from4.1)).abs()
        } else {
            (minor(tip, from3).powi(2) + minor(tip, from4).powi(2) + minor(from3, from4).powi(2)).sqrt()
        };
        let mut angles = [0.0; MAX_DOFS];
        angles[..3].copy_from_slice(&[first, second, third]);
        let mut free = 1.0;
        if !self.coupled {
            angles[3] = fourth;
        }
        for ([low, high], angle) in ranges.iter().zip(&angles) {
            free *= (4.0 * (angle - low) * (high - angle) / ((high - low) * (high - low))).clamp(0.0, 1.0);
        }
        let length = l2 + l3 + l4;
        let measure = at_r.abs() * planar / length.powi(3) * free.powf(1.0 / ranges.len() as f64);
        Candidate { angles, miss, measure }
    }
}

/// One of several solutions.
#[derive(Clone, Copy)]
struct Candidate {
    angles: Angles,
    miss: f64,
    measure: f64,
}

impl Candidate {
    const NONE: Self = Self { angles: [0.0; MAX_DOFS], miss: f64::INFINITY, measure: 0.0 };

    fn beats(&self, other: &Self) -> bool {
        match (self.miss < REACHED_M, other.miss < REACHED_M) {
            (true, true) => self.measure > other.measure,
            (one, two) if one != two => one,
            _ => self.miss < other.miss,
        }
    }

    fn keep(&mut self, other: Self) {
        if other.beats(self) {
            *self = other;
        }
    }
}

/// The same angle between -π and π.
fn wrapped(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    (angle + PI).rem_euclid(TAU) - PI
}
