//! The closed-form inverse of a finger whose first two joints meet at right angles and whose others bend in one plane (docs/sources.md, Hand).
//!
//! ```text
//! base frame: x along the straight finger, z where it bends to, origin where the first two joints meet
//! φ  = atan2(y, x)                                   the first joint turns the plane of the others
//! in the plane, with r along x and z:  ρ² = r² + z²
//! coupled, θ4 = θ3, c = cos θ3:  4 L2 L4 c² + 2 L3 (L2+L4) c + (L2²+L3²+L4² - 2 L2 L4 - ρ²) = 0
//! free θ4:  a bar of length B² = L3²+L4²+2 L3 L4 cos θ4 at the angle β:  cos(θ3+β) = (ρ² - L2² - B²) / (2 L2 B)
//! θ2 = angle from the tip at θ2 = 0 to (r, z)
//! w  = |r| sqrt(Σ minors² of the planar Jacobian)
//! ```

use super::joint_positions::{IkSolution, JointPositions, MAX_DOFS, REACHED_M};
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

/// The tolerance for axes that meet (m) and are parallel.
const EXACT: f64 = 1e-6;
/// Number of angles over its range at which a free last joint is tried, and number of refinements by a parabola through the best three.
const SCANNED: usize = 7;
const REFINED: usize = 4;
/// The minimum distance of a parabola's maximum from the known angles, as a share of the bracket.
const INSIDE: f64 = 0.02;
/// Residuals of unreachable points that differ by less are equal, m. The first angle is then chosen, so that rounding does not affect the result.
const ALIKE_M: f64 = 1e-9;
/// A free last joint is at the maximum of a parabola through the best angle and the angles at this distance on both sides, rad. If these do not reach the
/// point, the distance is halved, at most `HALVED` times.
const BESIDE: f64 = 0.02;
const HALVED: usize = 4;

/// A finger of this form.
#[derive(Clone, Debug)]
pub(crate) struct ClosedFormFinger {
    palm_from_base: Isometry3<f64>,
    /// Whether the first joint turns about +z or -z of the base.
    sign: f64,
    /// L2, L3, L4.
    links: [f64; 3],
    /// Whether the last joint is coupled to the joint before it, with equal angles.
    coupled: bool,
    /// The angles at which a free last joint is tried.
    scanned: [AngleWithTrig; SCANNED],
}

/// An angle with its sine and cosine.
#[derive(Clone, Copy, Debug, Default)]
struct AngleWithTrig {
    angle: f64,
    sin: f64,
    cos: f64,
}

impl AngleWithTrig {
    fn by(angle: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        Self { angle, sin, cos }
    }

    /// Returns the angle of this cosine, or the nearest one within the range.
    fn of_cosine(cos: f64, [low, high]: [f64; 2]) -> Self {
        let cos = cos.clamp(-1.0, 1.0);
        Self { angle: cos.acos(), sin: (1.0 - cos * cos).sqrt(), cos }.within([low, high])
    }

    fn within(self, [low, high]: [f64; 2]) -> Self {
        if (low..=high).contains(&self.angle) { self } else { Self::by(self.angle.clamp(low, high)) }
    }
}

impl ClosedFormFinger {
    /// Returns the closed form of a finger, if it has one. Arguments are the origins and axes of its joints at rest (palm frame), their drives, and the tip.
    pub(crate) fn of(
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
        // A finger that bends beyond straight has two solutions, which the branch below does not search.
        let bends = ranges.iter().skip(2).all(|[low, high]| *low >= -EXACT && *high <= 3.0);
        if !(straight && meets && square && parallel && bends) {
            return None;
        }
        // A positive turn about the second axis bends x towards z.
        let z = a2.cross(&x);
        let y = z.cross(&x);
        let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, z]));
        let sign = a1.dot(&z).signum();
        let mut scanned = [AngleWithTrig::default(); SCANNED];
        if let Some([low, high]) = ranges.get(3) {
            for (index, tried) in scanned.iter_mut().enumerate() {
                *tried = AngleWithTrig::by(low + (high - low) * index as f64 / (SCANNED - 1) as f64);
            }
        }
        Some(Self {
            palm_from_base: Isometry3::from_parts(o2.coords.into(), UnitQuaternion::from_rotation_matrix(&turn)),
            sign,
            links: [(o3 - o2).norm(), (o4 - o3).norm(), (tip - o4).norm()],
            coupled,
            scanned,
        })
    }

    /// Returns the angles of the best quality that reach the point, or angles near it.
    pub(crate) fn ik(&self, point: Point3<f64>, ranges: &[[f64; 2]]) -> IkSolution {
        self.solve(point, ranges, &|bend| self.scan(bend))
    }

    /// Like `ik`, for a point near one with a known solution: a free last joint is searched only near that solution.
    pub(crate) fn reach_near(&self, point: Point3<f64>, ranges: &[[f64; 2]], known: &IkSolution) -> IkSolution {
        self.solve(point, ranges, &|bend| self.top(bend, self.bend_free(bend, AngleWithTrig::by(known.angles[3]))))
    }

    fn solve(&self, point: Point3<f64>, ranges: &[[f64; 2]], scan: &dyn Fn(&BendPlane<'_>) -> Candidate) -> IkSolution {
        let p = self.palm_from_base.inverse_transform_point(&point);
        let mut best = Candidate::NONE;
        let across = (p.x * p.x + p.y * p.y).sqrt();
        // A finger that does not reach straight may bend back over its base.
        for (phi, r) in [(p.y.atan2(p.x), across), ((-p.y).atan2(-p.x), -across)] {
            let first = (self.sign * phi).clamp(ranges[0][0], ranges[0][1]);
            // If the first joint is at its limit: the projection of the point onto the plane, and its height above the plane.
            let off = phi - self.sign * first;
            let (beside, foot) = if off == 0.0 { (0.0, r) } else { (r * off.sin(), r * off.cos()) };
            let bend = BendPlane { first, r: foot, z: p.z, beside, ranges };
            let found = if self.coupled { self.bend_coupled(&bend) } else { scan(&bend) };
            best.keep(found);
            if best.miss < REACHED_M {
                break;
            }
        }
        IkSolution { angles: best.angles, miss: best.miss, measure: best.measure }
    }

    fn bend_coupled(&self, bend: &BendPlane<'_>) -> Candidate {
        let [l2, l3, l4] = self.links;
        let (a, b) = (4.0 * l2 * l4, 2.0 * l3 * (l2 + l4));
        let c = l2 * l2 + l3 * l3 + l4 * l4 - 2.0 * l2 * l4 - bend.r * bend.r - bend.z * bend.z;
        let root = ((b * b - 4.0 * a * c).max(0.0).sqrt() - b) / (2.0 * a);
        let third = AngleWithTrig::of_cosine(root, bend.ranges[2]);
        self.candidate(bend, third, third)
    }

    fn bend_free(&self, bend: &BendPlane<'_>, fourth: AngleWithTrig) -> Candidate {
        let [l2, l3, l4] = self.links;
        // The bar from the third joint to the tip, and the sine and cosine of its angle β to the third link, times its length.
        let (along, aside) = (l3 + l4 * fourth.cos, l4 * fourth.sin);
        let bar2 = along * along + aside * aside;
        let bar = bar2.sqrt();
        let cos = ((bend.r * bend.r + bend.z * bend.z - l2 * l2 - bar2) / (2.0 * l2 * bar)).clamp(-1.0, 1.0);
        let sin = (1.0 - cos * cos).sqrt();
        let third = ((sin * along - cos * aside) / bar, (cos * along + sin * aside) / bar);
        let third = AngleWithTrig { angle: third.0.atan2(third.1), sin: third.0, cos: third.1 };
        self.candidate(bend, third.within(bend.ranges[2]), fourth)
    }

    /// Returns the best angle of a free last joint.
    fn scan(&self, bend: &BendPlane<'_>) -> Candidate {
        let tried = self.scanned.map(|fourth| self.bend_free(bend, fourth));
        let top = (1..SCANNED).fold(0, |top, index| if tried[index].beats(&tried[top]) { index } else { top });
        let at = |index: usize| (self.scanned[index].angle, tried[index]);
        let best = self.refine(bend, at(top.saturating_sub(1)), at(top), at((top + 1).min(SCANNED - 1)), REFINED);
        self.top(bend, best)
    }

    /// Returns the maximum of the quality near an angle of a free last joint. The maximum is continuous in the point, unlike the better of two sampled angles;
    /// gradients need that.
    fn top(&self, bend: &BendPlane<'_>, best: Candidate) -> Candidate {
        if best.miss >= REACHED_M {
            return best;
        }
        let fourth = best.angles[3];
        let [low, high] = bend.ranges[3];
        let mut beside = BESIDE;
        for _ in 0..=HALVED {
            let [below, above] = [-beside, beside].map(|by| self.bend_free(bend, AngleWithTrig::by(fourth + by)));
            let inside = low < fourth - beside && fourth + beside < high;
            if inside && [below, best, above].iter().all(|it| it.miss < REACHED_M) {
                let bent = below.measure + above.measure - 2.0 * best.measure;
                let shift = 0.5 * beside * (below.measure - above.measure) / bent;
                let top = (bent < 0.0 && shift.abs() < beside)
                    .then(|| self.bend_free(bend, AngleWithTrig::by(fourth + shift)));
                return top.filter(|it| it.miss < REACHED_M).unwrap_or(best);
            }
            beside /= 2.0;
        }
        best
    }

    /// Returns the best angle between three angles of a free last joint, of which the middle one is the best so far.
    fn refine(
        &self,
        bend: &BendPlane<'_>,
        mut low: Trial,
        mut best: Trial,
        mut high: Trial,
        times: usize,
    ) -> Candidate {
        for _ in 0..times {
            let (below, above) = (best.0 - low.0, high.0 - best.0);
            let reached = [&low, &best, &high].iter().all(|(_, it)| it.miss < REACHED_M);
            let bent = below * (high.1.measure - best.1.measure) + above * (low.1.measure - best.1.measure);
            let next = if reached && below > 0.0 && above > 0.0 && bent < 0.0 {
                let slope = below * below * (high.1.measure - best.1.measure)
                    - above * above * (low.1.measure - best.1.measure);
                let edge = INSIDE * (high.0 - low.0);
                let next = best.0 - 0.5 * slope / bent;
                // A known angle gives no new information.
                let next = next.clamp(low.0 + edge, high.0 - edge);
                if (next - best.0).abs() < 1e-9 {
                    break;
                }
                next
            } else if above > below - 1e-9 {
                best.0 + above / 2.0
            } else {
                best.0 - below / 2.0
            };
            let found = (next, self.bend_free(bend, AngleWithTrig::by(next)));
            let (side, other) = if next > best.0 { (&mut high, &mut low) } else { (&mut low, &mut high) };
            if found.1.beats(&best.1) {
                *other = best;
                best = found;
            } else {
                *side = found;
            }
        }
        best.1
    }

    /// Returns the candidate for angles of the third and fourth joint; the second joint turns to the point as far as its range allows.
    fn candidate(&self, bend: &BendPlane<'_>, third: AngleWithTrig, fourth: AngleWithTrig) -> Candidate {
        let [l2, l3, l4] = self.links;
        let &BendPlane { first, r, z, beside, ranges } = bend;
        let (s34, c34) =
            (third.sin * fourth.cos + third.cos * fourth.sin, third.cos * fourth.cos - third.sin * fourth.sin);
        let (tip_r, tip_z) = (l2 + l3 * third.cos + l4 * c34, l3 * third.sin + l4 * s34);
        // The rotation from the tip at θ2 = 0 to the point.
        let (across, along) = (z * tip_r - r * tip_z, r * tip_r + z * tip_z);
        let wanted = across.atan2(along);
        let second = wanted.clamp(ranges[1][0], ranges[1][1]);
        let (s2, c2) = if second == wanted {
            let length = (across * across + along * along).sqrt().max(1e-300);
            (across / length, along / length)
        } else {
            second.sin_cos()
        };
        let (at_r, at_z) = (c2 * tip_r - s2 * tip_z, s2 * tip_r + c2 * tip_z);
        let miss = ((r - at_r).powi(2) + (z - at_z).powi(2) + beside * beside).sqrt();
        // Minors of the planar Jacobian. Its columns are the vectors from the joints to the tip, rotated by 90°.
        let by_23 = l2 * tip_z;
        let by_24 = l4 * (l2 * s34 + l3 * fourth.sin);
        let by_34 = l3 * l4 * fourth.sin;
        let planar =
            if self.coupled { (by_23 + by_24).abs() } else { (by_23 * by_23 + by_24 * by_24 + by_34 * by_34).sqrt() };
        let mut angles = [0.0; MAX_DOFS];
        angles[..3].copy_from_slice(&[first, second, third.angle]);
        if !self.coupled {
            angles[3] = fourth.angle;
        }
        let mut free = 1.0;
        for ([low, high], angle) in ranges.iter().zip(&angles) {
            free *= (4.0 * (angle - low) * (high - angle) / ((high - low) * (high - low))).clamp(0.0, 1.0);
        }
        let free = if self.coupled { free.cbrt() } else { free.sqrt().sqrt() };
        let length = l2 + l3 + l4;
        Candidate { angles, miss, measure: at_r.abs() * planar / (length * length * length) * free }
    }
}

/// A point relative to a finger: the angle of its first joint, the point in the plane that this joint turns, its height above that plane, and the ranges.
struct BendPlane<'a> {
    first: f64,
    r: f64,
    z: f64,
    beside: f64,
    ranges: &'a [[f64; 2]],
}

/// An angle of the last joint, and its candidate.
type Trial = (f64, Candidate);

/// One of several solutions.
#[derive(Clone, Copy)]
struct Candidate {
    angles: JointPositions,
    miss: f64,
    measure: f64,
}

impl Candidate {
    const NONE: Self = Self { angles: [0.0; MAX_DOFS], miss: f64::INFINITY, measure: 0.0 };

    fn beats(&self, other: &Self) -> bool {
        match (self.miss < REACHED_M, other.miss < REACHED_M) {
            (true, true) => self.measure > other.measure,
            (one, two) if one != two => one,
            _ => self.miss < other.miss - ALIKE_M,
        }
    }

    fn keep(&mut self, other: Self) {
        if other.beats(self) {
            *self = other;
        }
    }
}
