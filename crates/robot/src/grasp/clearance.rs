//! Gaps between hand, object and obstacles on their exact shapes: the last check of a grasp.

use super::problem::{CLEAR_M, GraspRequest};
use crate::kinematics::finger::FingerModel;
use crate::kinematics::gap::Convex;
use crate::kinematics::joint_positions::JointPositions;
use crate::model::hand::HandModel;
use nalgebra::Isometry3;
use teachtree_base::hands::Finger;
use teachtree_base::scene::Body;
use teachtree_description::shape::CollisionShape;

/// Overlaps are looked for up to this gap, m.
const NEAR_M: f64 = 0.05;

/// The smallest gaps, m, negative for an overlap; capped at 50 mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Clearance {
    /// Between links of the hand and the object; fingertips touch and are not counted.
    pub object: f64,
    /// Between the hand and whatever else is there.
    pub obstacles: f64,
    /// Between fingers.
    pub fingers: f64,
}

impl Clearance {
    /// The largest overlap, m, and between whom.
    pub(super) fn worst_overlap(&self) -> Option<(f64, String)> {
        let all = [(self.object, "hand and object"), (self.obstacles, "hand and obstacle"), (self.fingers, "fingers")];
        let worst = all.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        worst.filter(|(gap, _)| *gap < -CLEAR_M).map(|(gap, who)| (-gap, who.to_string()))
    }
}

/// Shapes of the object and the obstacles, object frame, and of the palm.
pub(super) struct Shapes {
    object: Vec<Convex<'static>>,
    obstacles: Vec<Convex<'static>>,
    palm: Vec<CollisionShape>,
}

impl Shapes {
    pub(super) fn new(hand: &HandModel, request: &GraspRequest<'_>) -> Self {
        let obstacles =
            request.obstacles.iter().flat_map(|obstacle| shapes(obstacle.body, &obstacle.object_from_obstacle));
        Self {
            object: shapes(request.object, &Isometry3::identity()).collect(),
            obstacles: obstacles.collect(),
            palm: hand.palm_solids.clone(),
        }
    }

    /// The gaps at a pose of the palm.
    pub(super) fn clearance(
        &self,
        object_from_palm: &Isometry3<f64>,
        fingers: &[(&FingerModel, JointPositions)],
    ) -> Clearance {
        let mut solids: Vec<(Finger, bool, CollisionShape)> = Vec::new();
        solids.extend(self.palm.iter().map(|solid| (Finger::Palm, false, solid.moved(object_from_palm))));
        for (finger, angles) in fingers {
            for (index, (_, solid)) in finger.solids(&finger.posture(angles)).enumerate() {
                solids.push((finger.finger, finger.touches(index), solid.moved(object_from_palm)));
            }
        }
        let links: Vec<(Finger, bool, Convex<'_>)> =
            solids.iter().map(|(finger, touches, solid)| (*finger, *touches, Convex::from(solid))).collect();
        let mut clearance = Clearance { object: NEAR_M, obstacles: NEAR_M, fingers: NEAR_M };
        for (index, (finger, touches, link)) in links.iter().enumerate() {
            for other in self.object.iter().filter(|_| !touches) {
                clearance.object = nearer(clearance.object, link, other);
            }
            for other in &self.obstacles {
                clearance.obstacles = nearer(clearance.obstacles, link, other);
            }
            for (other, _, other_link) in links.iter().skip(index + 1) {
                // The knuckles stand in the palm.
                if finger != other && *finger != Finger::Palm && *other != Finger::Palm {
                    clearance.fingers = nearer(clearance.fingers, link, other_link);
                }
            }
        }
        clearance
    }

    /// How far the palm is from the object and from the obstacles, m: zero when it is in them, infinite when there are none.
    pub(super) fn palm(&self, object_from_palm: &Isometry3<f64>) -> [f64; 2] {
        let palm: Vec<CollisionShape> = self.palm.iter().map(|solid| solid.moved(object_from_palm)).collect();
        let palm: Vec<Convex<'_>> = palm.iter().map(Convex::from).collect();
        [&self.object, &self.obstacles].map(|others| {
            let pairs = palm.iter().flat_map(|solid| others.iter().map(move |other| (solid, other)));
            pairs.fold(f64::INFINITY, |gap, (solid, other)| nearer(gap, solid, other)).max(0.0)
        })
    }
}

/// The gap between two shapes if it is less than the least one so far, m, else that one.
fn nearer(least: f64, one: &Convex<'_>, other: &Convex<'_>) -> f64 {
    one.gap_below(other, least).unwrap_or(least)
}

fn shapes(body: &Body, object_from_body: &Isometry3<f64>) -> impl Iterator<Item = Convex<'static>> {
    body.parts.iter().map(|part| Convex::of_part(part, object_from_body))
}
