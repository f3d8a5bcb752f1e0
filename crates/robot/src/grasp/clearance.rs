//! Gaps between hand, object and obstacles on their exact shapes: the last check of a grasp, and one of two places here that name parry.

use super::grasp_request::{CLEAR_M, GraspRequest};
use crate::kinematics::finger::FingerModel;
use crate::kinematics::joint_positions::{JointPositions, MAX_DOFS};
use crate::model::hand::HandModel;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use parry3d::math::{Pose, Vector};
use parry3d::query;
use parry3d::shape::SharedShape;
use std::sync::Arc;
use teachtree_base::hands::Finger;
use teachtree_base::scene::{Body, Shape};
use teachtree_description::polytope::Polytope;
use teachtree_description::shape::CollisionShape;

/// Largest gap that is computed, m.
const NEAR_M: f64 = 0.05;

/// The smallest gaps, m, negative for an overlap; capped at 50 mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Clearance {
    /// Between links of the hand and the object; fingertips touch and are not counted.
    pub object: f64,
    /// Between the hand and the obstacles.
    pub obstacles: f64,
    /// Between fingers.
    pub fingers: f64,
}

impl Clearance {
    /// Returns the largest overlap, m, and the pair that overlaps.
    pub(super) fn worst_overlap(&self) -> Option<(f64, String)> {
        let all = [(self.object, "hand and object"), (self.obstacles, "hand and obstacle"), (self.fingers, "fingers")];
        let worst = all.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        worst.filter(|(gap, _)| *gap < -CLEAR_M).map(|(gap, who)| (-gap, who.to_string()))
    }
}

/// Shapes of the object and the obstacles, object frame, and of the palm.
pub(super) struct Shapes {
    object: Vec<(Pose, SharedShape)>,
    obstacles: Vec<(Pose, SharedShape)>,
    palm: Vec<CollisionShape>,
    /// The pieces of meshes of the hand, each with its shape for parry.
    pieces: Vec<(Arc<Polytope>, SharedShape)>,
}

impl Shapes {
    pub(super) fn new(hand: &HandModel, request: &GraspRequest<'_>) -> Self {
        let obstacles =
            request.obstacles.iter().flat_map(|obstacle| shapes(obstacle.body, &obstacle.object_from_obstacle));
        Self {
            object: shapes(request.object, &Isometry3::identity()),
            obstacles: obstacles.collect(),
            palm: hand.palm_solids.clone(),
            pieces: pieces(hand),
        }
    }

    /// The gaps at a pose of the palm.
    pub(super) fn clearance(
        &self,
        object_from_palm: &Isometry3<f64>,
        fingers: &[(&FingerModel, JointPositions)],
    ) -> Clearance {
        let mut clearance = Clearance { object: NEAR_M, obstacles: NEAR_M, fingers: NEAR_M };
        let mut links: Vec<(Finger, Pose, SharedShape)> = Vec::new();
        let mut touching = Vec::new();
        for solid in &self.palm {
            let (at, it) = self.shape(object_from_palm, solid);
            links.push((Finger::Palm, at, it));
        }
        for (finger, angles) in fingers {
            for (index, (_, solid)) in finger.solids(&finger.posture(angles)).enumerate() {
                let (at, it) = self.shape(object_from_palm, &solid);
                if finger.touches(index) {
                    touching.push(links.len());
                }
                links.push((finger.finger, at, it));
            }
        }
        for (index, (_, at, link)) in links.iter().enumerate() {
            for (other_at, other) in self.object.iter().filter(|_| !touching.contains(&index)) {
                clearance.object = clearance.object.min(gap(at, link, other_at, other));
            }
            for (other_at, other) in &self.obstacles {
                clearance.obstacles = clearance.obstacles.min(gap(at, link, other_at, other));
            }
        }
        for (index, (finger, at, link)) in links.iter().enumerate() {
            for (other, other_at, other_link) in links.iter().skip(index + 1) {
                // The knuckles are inside the palm.
                if finger != other && *finger != Finger::Palm && *other != Finger::Palm {
                    clearance.fingers = clearance.fingers.min(gap(at, link, other_at, other_link));
                }
            }
        }
        clearance
    }

    fn shape(&self, object_from_palm: &Isometry3<f64>, solid: &CollisionShape) -> (Pose, SharedShape) {
        let at = |point: &Point3<f64>| vector(point.coords);
        match solid {
            CollisionShape::Capsule(from, to, radius) => {
                (parry_pose(object_from_palm), SharedShape::capsule(at(from), at(to), *radius))
            }
            CollisionShape::Box(pose, half) => {
                (parry_pose(&(object_from_palm * pose)), SharedShape::cuboid(half.x, half.y, half.z))
            }
            CollisionShape::Piece(pose, polytope) => {
                match self.pieces.iter().find(|(known, _)| Arc::ptr_eq(known, polytope)) {
                    Some((_, shape)) => (parry_pose(&(object_from_palm * pose)), shape.clone()),
                    // A piece that parry cannot represent is replaced by its bounding box.
                    None => {
                        let (middle, half) = solid.bounding_box();
                        (parry_pose(&(object_from_palm * middle)), SharedShape::cuboid(half.x, half.y, half.z))
                    }
                }
            }
        }
    }

    /// Returns the distances of the palm from the object and from the obstacles, m: 0 for a penetration, infinite without obstacles.
    pub(super) fn palm(&self, object_from_palm: &Isometry3<f64>) -> [f64; 2] {
        [&self.object, &self.obstacles].map(|others| {
            let to_all = |(at, palm): (Pose, SharedShape)| {
                let to = |(other_at, other): &(Pose, SharedShape)| query::distance(&at, &*palm, other_at, &**other);
                others.iter().filter_map(|other| Some(to(other).ok()?.distance)).fold(f64::INFINITY, f64::min)
            };
            self.palm.iter().map(|solid| self.shape(object_from_palm, solid)).map(to_all).fold(f64::INFINITY, f64::min)
        })
    }
}

/// The gap between two shapes, negative when they overlap.
fn gap(at: &Pose, one: &SharedShape, other_at: &Pose, other: &SharedShape) -> f64 {
    match query::contact(at, &**one, other_at, &**other, NEAR_M) {
        Ok(Some(contact)) => contact.dist,
        _ => NEAR_M,
    }
}

fn vector(vector: Vector3<f64>) -> Vector {
    vector.into()
}

fn parry_pose(pose: &Isometry3<f64>) -> Pose {
    Pose::from_parts(vector(pose.translation.vector), pose.rotation.into())
}

/// The pieces of meshes of a hand for parry.
fn pieces(hand: &HandModel) -> Vec<(Arc<Polytope>, SharedShape)> {
    let mut all = hand.palm_solids.clone();
    for finger in &hand.fingers {
        all.extend(finger.solids(&finger.posture(&[0.0; MAX_DOFS])).map(|(_, solid)| solid));
    }
    let piece = |solid: CollisionShape| {
        let CollisionShape::Piece(_, polytope) = solid else { return None };
        let points = polytope.points.iter().map(|point| vector(point.coords)).collect();
        let triangles: Vec<_> = polytope.triangles.iter().map(|triangle| triangle.map(|at| at as u32)).collect();
        let shape = SharedShape::round_convex_mesh(points, &triangles, polytope.radius);
        Some((polytope, shape?))
    };
    all.into_iter().filter_map(piece).collect()
}

fn shapes(body: &Body, object_from_body: &Isometry3<f64>) -> Vec<(Pose, SharedShape)> {
    let part = |part: &teachtree_base::scene::Part| {
        let at = object_from_body * part.pose();
        match part.shape {
            Shape::Box([x, y, z]) => (parry_pose(&at), SharedShape::cuboid(x.0 / 2.0, y.0 / 2.0, z.0 / 2.0)),
            // The axis of parry's cylinder is y.
            Shape::Cylinder([radius, height]) => {
                let upright = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
                (parry_pose(&(at * upright)), SharedShape::cylinder(height.0 / 2.0, radius.0))
            }
            Shape::Ball(radius) => (parry_pose(&at), SharedShape::ball(radius.0)),
        }
    };
    body.parts.iter().map(part).collect()
}
