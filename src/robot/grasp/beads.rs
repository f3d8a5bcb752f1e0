//! The hand as balls on a string: quick to compare with shapes and with each other while a search runs.

use crate::robot::hand::{Angles, FingerModel, HandModel, MAX_DOFS, Posture};
use crate::robot::tree::Solid;
use nalgebra::{Isometry3, Point3, Vector3};

/// Balls along a bar are at most this far apart, m.
const APART_M: f64 = 0.012;
/// Points over the faces of a palm are at most this far apart, m.
const PALM_APART_M: f64 = 0.03;
/// Shares of the ranges at which a finger that does not touch may be held: stretched, half bent, curled.
const IDLE: [[f64; 2]; 3] = [[0.12, 0.05], [0.45, 0.4], [0.85, 0.9]];

/// A ball of a finger: the joint that it hangs at, its centre in that joint's frame, m, and its radius, m.
pub(super) type Bead = (usize, Point3<f64>, f64);

/// Balls in the frame of the palm: centre, m, radius, m.
pub(super) type Balls = Vec<(Point3<f64>, f64)>;

/// The balls of a hand.
#[derive(Clone, Debug)]
pub(super) struct HandBeads {
    /// Of each finger.
    pub(super) fingers: Vec<Vec<Bead>>,
    /// Points of the palm's surface, palm frame.
    pub(super) palm: Vec<Point3<f64>>,
    /// The boxes of the palm.
    pub(super) palm_boxes: Vec<(Isometry3<f64>, Vector3<f64>)>,
    /// For each finger, the postures that it may have when it does not touch: angles, and balls in the palm's frame.
    pub(super) idle: Vec<Vec<(Angles, Balls)>>,
}

impl HandBeads {
    pub(super) fn new(hand: &HandModel) -> Self {
        let fingers: Vec<Vec<Bead>> = hand.fingers.iter().map(beads).collect();
        let idle = hand.fingers.iter().zip(&fingers).map(|(finger, beads)| {
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
                (angles, placed(beads, &finger.posture(&angles)))
            };
            IDLE.map(posture).to_vec()
        });
        let idle = idle.collect();
        let mut palm = Vec::new();
        let mut palm_boxes = Vec::new();
        for solid in &hand.palm_solids {
            match *solid {
                Solid::Box(pose, half) => {
                    palm_boxes.push((pose, half));
                    palm.extend(shell(half).into_iter().map(|point| pose * point));
                }
                Solid::Capsule(from, to, _) => palm.extend([from, to]),
            }
        }
        Self { fingers, palm, palm_boxes, idle }
    }
}

/// The balls in a posture: centre in the palm's frame, radius.
pub(super) fn placed(beads: &[Bead], posture: &Posture) -> Vec<(Point3<f64>, f64)> {
    beads.iter().filter_map(|(joint, at, radius)| Some((posture.joints.get(*joint)? * at, *radius))).collect()
}

fn beads(finger: &FingerModel) -> Vec<Bead> {
    let mut beads = Vec::new();
    let at_rest = finger.posture(&[0.0; MAX_DOFS]);
    for (joint, solid) in finger.solids(&at_rest) {
        let Some(palm_from_joint) = at_rest.joints.get(joint) else { continue };
        match solid.moved(&palm_from_joint.inverse()) {
            Solid::Capsule(from, to, radius) => {
                let parts = ((to - from).norm() / APART_M).ceil().max(1.0) as usize;
                beads
                    .extend((0..=parts).map(|part| (joint, from + (to - from) * (part as f64 / parts as f64), radius)));
            }
            Solid::Box(pose, half) => {
                // A box is the bar along its longest edge, as thick as the mean of the others.
                let axis = half.imax();
                let radius = (half.sum() - half[axis]) / 2.0;
                let reach = Vector3::ith(axis, (half[axis] - radius).max(0.0));
                let parts = (2.0 * reach.norm() / APART_M).ceil().max(1.0) as usize;
                beads.extend((0..=parts).map(|part| {
                    (joint, pose * Point3::from(reach * (2.0 * part as f64 / parts as f64 - 1.0)), radius)
                }));
            }
        }
    }
    beads
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
