//! Sphere approximation of the hand, for fast distances to shapes and between fingers in the search.

use crate::kinematics::finger::{FingerModel, FingerPose};
use crate::kinematics::joint_positions::{JointPositions, MAX_DOFS};
use crate::model::hand::HandModel;
use nalgebra::{Isometry3, Point3, Vector3};
use teachtree_description::polytope::Polytope;
use teachtree_description::shape::CollisionShape;

/// Largest distance of neighboring spheres along a capsule, m.
const APART_M: f64 = 0.012;
/// Largest distance of neighboring points on the faces of a palm, m.
const PALM_APART_M: f64 = 0.03;
/// Postures of an idle finger, as shares of the ranges: stretched, half bent, curled.
const IDLE: [[f64; 2]; 3] = [[0.12, 0.05], [0.45, 0.4], [0.85, 0.9]];

/// A capsule: spheres of one size in a straight row.
#[derive(Clone, Copy, Debug)]
pub(super) struct SphereRow {
    /// The joint that moves it.
    pub(super) joint: usize,
    /// Centers of the first and of the last ball, m.
    pub(super) from: Point3<f64>,
    pub(super) to: Point3<f64>,
    /// m.
    pub(super) radius: f64,
    /// Whether it belongs to the mesh that touches the object: see [`FingerModel::touches`].
    pub(super) touches: bool,
    /// The number of intervals between spheres.
    parts: usize,
}

/// The balls of a hand.
#[derive(Clone, Debug)]
pub(super) struct HandSpheres {
    /// The capsules of each finger, in the frames of their joints.
    pub(super) fingers: Vec<Vec<SphereRow>>,
    /// Points of the palm's surface, palm frame, with the center and the radius, m, of their bounding sphere.
    pub(super) palm: Vec<Point3<f64>>,
    pub(super) about_palm: (Point3<f64>, f64),
    /// The boxes of the palm.
    pub(super) palm_boxes: Vec<(Isometry3<f64>, Vector3<f64>)>,
    /// The postures of each finger when it is idle: angles, and capsules in the palm's frame.
    pub(super) idle: Vec<Vec<(JointPositions, Vec<SphereRow>)>>,
}

impl HandSpheres {
    pub(super) fn new(hand: &HandModel) -> Self {
        let fingers: Vec<Vec<SphereRow>> = hand.fingers.iter().map(bars).collect();
        let idle = hand.fingers.iter().zip(&fingers).map(|(finger, bars)| {
            let posture = |[second, others]: [f64; 2]| {
                let mut angles = [0.0; MAX_DOFS];
                for (index, ([low, high], angle)) in finger.ranges.iter().zip(&mut angles).enumerate() {
                    let share = match index {
                        0 => 0.5,
                        1 => second,
                        _ => others,
                    };
                    *angle = low + share * (high - low);
                }
                (angles, placed(bars, &finger.posture(&angles)).collect())
            };
            IDLE.map(posture).to_vec()
        });
        let idle = idle.collect();
        let mut palm = Vec::new();
        let mut palm_boxes = Vec::new();
        for solid in &hand.palm_solids {
            match *solid {
                CollisionShape::Box(pose, half) => {
                    palm_boxes.push((pose, half));
                    palm.extend(shell(half).into_iter().map(|point| pose * point));
                }
                CollisionShape::Capsule(from, to, _) => palm.extend([from, to]),
                CollisionShape::Piece(pose, ref polytope) => {
                    palm_boxes.push(solid.bounding_box());
                    palm.extend(surface(polytope).map(|point| pose * point));
                }
            }
        }
        let sum: Vector3<f64> = palm.iter().map(|point| point.coords).sum();
        let middle = Point3::from(sum / palm.len().max(1) as f64);
        let around = palm.iter().map(|point| (point - middle).norm()).fold(0.0, f64::max);
        Self { fingers, palm, about_palm: (middle, around), palm_boxes, idle }
    }
}

impl SphereRow {
    /// The centers of its balls.
    pub(super) fn balls(&self) -> impl Iterator<Item = Point3<f64>> {
        let (from, way, parts) = (self.from, self.to - self.from, self.parts);
        (0..=parts).map(move |part| from + way * (part as f64 / parts as f64))
    }

    /// Returns the center and the radius of its bounding sphere, m.
    pub(super) fn around(&self) -> (Point3<f64>, f64) {
        (nalgebra::center(&self.from, &self.to), (self.to - self.from).norm() / 2.0 + self.radius)
    }

    /// Returns a lower bound of the squared distance between the center lines of two capsules, m².
    pub(super) fn gap2(&self, other: &Self) -> f64 {
        let (way, other_way, between) = (self.to - self.from, other.to - other.from, self.from - other.from);
        let (a, e, f) = (way.norm_squared(), other_way.norm_squared(), other_way.dot(&between));
        let (b, c) = (way.dot(&other_way), way.dot(&between));
        let share = |over: f64, under: f64| if under > 1e-18 { (over / under).clamp(0.0, 1.0) } else { 0.0 };
        let mut s = share(b * f - c * e, a * e - b * b);
        let mut t = (b * s + f) / e.max(1e-18);
        if t < 0.0 {
            (s, t) = (share(-c, a), 0.0);
        } else if t > 1.0 {
            (s, t) = (share(b - c, a), 1.0);
        }
        (between + way * s - other_way * t).norm_squared()
    }
}

/// Returns the capsules in a posture, palm frame.
pub(super) fn placed(bars: &[SphereRow], posture: &FingerPose) -> impl Iterator<Item = SphereRow> {
    bars.iter().filter_map(|bar| {
        let pose = posture.joints.get(bar.joint)?;
        Some(SphereRow { from: pose * bar.from, to: pose * bar.to, ..*bar })
    })
}

fn bars(finger: &FingerModel) -> Vec<SphereRow> {
    let at_rest = finger.posture(&[0.0; MAX_DOFS]);
    let bars = finger.solids(&at_rest).enumerate().filter_map(|(index, (joint, solid))| {
        let bar = |joint: usize, from: Point3<f64>, to: Point3<f64>, radius: f64| {
            let parts = ((to - from).norm() / APART_M).ceil().max(1.0) as usize;
            SphereRow { joint, from, to, radius, touches: finger.touches(index), parts }
        };
        Some(match solid.moved(&at_rest.joints.get(joint)?.inverse()) {
            CollisionShape::Capsule(from, to, radius) => bar(joint, from, to, radius),
            solid @ (CollisionShape::Box(..) | CollisionShape::Piece(..)) => {
                let (pose, half) = solid.bounding_box();
                // A box becomes a capsule along its longest edge, with the mean of the other edges as its thickness.
                let axis = half.imax();
                let radius = (half.sum() - half[axis]) / 2.0;
                let reach = Vector3::ith(axis, (half[axis] - radius).max(0.0));
                bar(joint, pose * Point3::from(-reach), pose * Point3::from(reach), radius)
            }
        })
    });
    bars.collect()
}

/// Points over the faces of a piece of a mesh: its corners, and points between them.
fn surface(polytope: &Polytope) -> impl Iterator<Item = Point3<f64>> {
    let between = polytope.triangles.iter().flat_map(|triangle| {
        let [a, b, c] = triangle.map(|corner| polytope.points[corner].coords);
        let longest = (a - b).norm().max((b - c).norm()).max((c - a).norm());
        let count = (longest / PALM_APART_M).ceil().max(1.0) as usize;
        let point = move |i: usize, j: usize| {
            let share = |part: usize| part as f64 / count as f64;
            Point3::from(a + (b - a) * share(i) + (c - a) * share(j))
        };
        (0..count).flat_map(move |i| (0..count - i).map(move |j| point(i, j)))
    });
    polytope.points.iter().copied().chain(between)
}

/// Points over the faces of a box.
fn shell(half: Vector3<f64>) -> Vec<Point3<f64>> {
    let count = half.map(|half| (2.0 * half / PALM_APART_M).ceil().max(1.0) as usize);
    let mut points = Vec::new();
    for i in 0..=count.x {
        for j in 0..=count.y {
            for k in 0..=count.z {
                let inner = (1..count.x).contains(&i) && (1..count.y).contains(&j) && (1..count.z).contains(&k);
                if !inner {
                    let share = |index: usize, count: usize| 2.0 * index as f64 / count as f64 - 1.0;
                    points.push(Point3::new(
                        half.x * share(i, count.x),
                        half.y * share(j, count.y),
                        half.z * share(k, count.z),
                    ));
                }
            }
        }
    }
    points
}
