//! How near the robot's two arms pass each other. Nothing keeps them apart in the simulation, so it is told when they go through each other.
//!
//! Shapes are convex: the nearest points of two are found by going to and fro between them, each time to the nearest point of the other one (Cheney and
//! Goldstein 1959). Pairs that cannot be nearer than the nearest so far are passed over, by balls about them.

use super::executor::Executor;
use super::tree::Solid;
use nalgebra::{Point3, Vector3};

/// So many times to and fro at most, until a step is shorter than this, m.
const STEPS: usize = 200;
const SHORT_M: f64 = 1e-6;

/// Where two arms with their hands came nearest to each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Nearest {
    /// The gap between them, m; negative, or zero for boxes, when they were in each other.
    pub gap: f64,
    /// When, s since the beginning.
    pub time_s: f64,
    /// The names of the links.
    pub links: [String; 2],
}

impl Nearest {
    /// Whether they went through each other.
    pub fn passes_through(&self) -> bool {
        self.gap <= SHORT_M
    }
}

/// Looks whether two limbs are nearer to each other now than they were before.
pub(super) fn look(executors: &[Executor], time_s: f64, nearest: &mut Option<Nearest>) {
    let [one, other] = executors else { return };
    let (ours, theirs) = (solids(one), solids(other));
    for (link, solid, (centre, radius)) in &ours {
        for (link_of_other, solid_of_other, (centre_of_other, radius_of_other)) in &theirs {
            let least = (centre - centre_of_other).norm() - radius - radius_of_other;
            if nearest.as_ref().is_some_and(|nearest| least >= nearest.gap) {
                continue;
            }
            let gap = gap(solid, solid_of_other);
            if nearest.as_ref().is_none_or(|nearest| gap < nearest.gap) {
                let links = [one.robot().links[*link].name.clone(), other.robot().links[*link_of_other].name.clone()];
                *nearest = Some(Nearest { gap, time_s, links });
            }
        }
    }
}

/// The shapes of a limb where they are, each with its link and a ball about it. The first link is that on which both limbs stand.
fn solids(limb: &Executor) -> Vec<(usize, Solid, (Point3<f64>, f64))> {
    let links = limb.robot().links.iter().zip(limb.poses()).enumerate().skip(1);
    let moved = links.flat_map(|(index, (link, pose))| link.solids.iter().map(move |solid| (index, solid.moved(pose))));
    let with_ball = |(index, solid): (usize, Solid)| {
        let ball = match solid {
            Solid::Capsule(from, to, radius) => (nalgebra::center(&from, &to), (to - from).norm() / 2.0 + radius),
            Solid::Box(at, half) => (at.translation.vector.into(), half.norm()),
        };
        (index, solid, ball)
    };
    moved.map(with_ball).collect()
}

/// The gap between two shapes, m; negative for bars that are in something by up to their radius.
pub fn gap(one: &Solid, other: &Solid) -> f64 {
    let mut at = begin(one, other);
    let mut there = nearest(other, &at);
    for _ in 0..STEPS {
        let next = nearest(one, &there);
        let step = (next - at).norm();
        (at, there) = (next, nearest(other, &next));
        if step < SHORT_M {
            break;
        }
    }
    (at - there).norm() - radius(one) - radius(other)
}

/// A point of a shape from which it is near to another one. Of bars it is the nearest to the other's line, so that nearly parallel ones, between which each step
/// is a short one, are there at once (Ericson, *Real-Time Collision Detection*, 5.1.9).
fn begin(one: &Solid, other: &Solid) -> Point3<f64> {
    if let (Solid::Capsule(from, to, _), Solid::Capsule(from_of_other, to_of_other, _)) = (one, other) {
        let (ours, theirs, between) = (to - from, to_of_other - from_of_other, from - from_of_other);
        let (a, b, e) = (ours.norm_squared(), ours.dot(&theirs), theirs.norm_squared());
        let (c, f) = (ours.dot(&between), theirs.dot(&between));
        let apart = a * e - b * b;
        if apart > f64::EPSILON * a * e {
            return from + ours * ((b * f - c * e) / apart).clamp(0.0, 1.0);
        }
    }
    nearest(one, &nearest(other, &middle(one)))
}

/// How far a point is from a shape, m; negative in bars, zero in boxes.
pub(super) fn distance(solid: &Solid, point: &Point3<f64>) -> f64 {
    (nearest(solid, point) - point).norm() - radius(solid)
}

fn middle(solid: &Solid) -> Point3<f64> {
    match solid {
        Solid::Capsule(from, to, _) => nalgebra::center(from, to),
        Solid::Box(at, _) => at.translation.vector.into(),
    }
}

/// How thick a shape is about its core.
fn radius(solid: &Solid) -> f64 {
    match solid {
        Solid::Capsule(_, _, radius) => *radius,
        Solid::Box(..) => 0.0,
    }
}

/// The point of a shape's core that is nearest to a point.
fn nearest(solid: &Solid, to: &Point3<f64>) -> Point3<f64> {
    match solid {
        Solid::Capsule(from, end, _) => {
            let way: Vector3<f64> = end - from;
            let share = (to - from).dot(&way) / way.norm_squared().max(f64::MIN_POSITIVE);
            from + way * share.clamp(0.0, 1.0)
        }
        Solid::Box(at, half) => {
            let own = at.inverse_transform_point(to).coords;
            at * Point3::from(own.zip_map(half, |value, half| value.clamp(-half, half)))
        }
    }
}
