//! What an arm is to keep clear of: the bodies of a scene, and its own links.
//!
//! Of an arm count the links that it moves, from its first joint to the palm. Of its own links two are looked at where at least `JOINTS_BETWEEN` joints are
//! between them: nearer ones meet at their joints.

use super::limb_gap::PlacedShape;
use crate::base::scene::{Role, Scene};
use crate::description::shape::{CollisionShape, SHORT_M, solids};
use crate::description::tree::KinematicTree;
use nalgebra::Isometry3;

/// Links with fewer joints between them are not held against each other.
const JOINTS_BETWEEN: usize = 3;

/// The shapes of bodies that stand still, reference frame.
#[derive(Clone, Debug, Default)]
pub struct Surroundings {
    shapes: Vec<CollisionShape>,
}

impl Surroundings {
    /// Returns those of the fixed bodies of a scene.
    pub fn fixed(scene: &Scene) -> Self {
        let fixed = scene.bodies.values().filter(|body| body.role != Role::Object);
        Self { shapes: fixed.flat_map(|body| solids(body).into_iter().map(|it| it.moved(&body.pose()))).collect() }
    }

    /// Returns the same in the frame in which the reference frame is `pose`, or moved by it.
    pub(crate) fn moved(&self, pose: &Isometry3<f64>) -> Self {
        Self { shapes: self.shapes.iter().map(|shape| shape.moved(pose)).collect() }
    }

    /// The shapes.
    pub(crate) fn shapes(&self) -> &[CollisionShape] {
        &self.shapes
    }

    /// Whether any link meets one of them, or another link.
    pub(crate) fn meet(&self, links: &ArmLinks, poses: &[Isometry3<f64>]) -> bool {
        let placed = links.placed(poses);
        let bodies = |link: &PlacedShape| self.shapes.iter().any(|shape| link.meets(shape));
        placed.iter().any(|(_, link)| bodies(link)) || meets_itself(&placed).is_some()
    }
}

/// The links that an arm moves, nearest to the palm first, and how many joints are between each and the palm.
#[derive(Clone, Debug)]
pub(crate) struct ArmLinks {
    links: Vec<(usize, usize, Vec<CollisionShape>)>,
}

impl ArmLinks {
    /// The links of an arm up to the palm; the palm too where `with_palm`.
    pub(crate) fn new(tree: &KinematicTree, palm: usize, with_palm: bool) -> Self {
        let (mut links, mut at, mut joints) = (Vec::new(), palm, 0);
        let moved = tree.joints_above(palm).count();
        while at != 0 && joints < moved {
            let link = &tree.links[at];
            if with_palm || joints > 0 {
                links.push((at, joints, link.solids.clone()));
            }
            joints += usize::from(link.joint.is_some());
            at = link.parent;
        }
        Self { links }
    }

    /// Their shapes where links have these poses, each with the joints between its link and the palm.
    pub(crate) fn placed(&self, poses: &[Isometry3<f64>]) -> Vec<(usize, PlacedShape)> {
        let placed = self.links.iter().flat_map(|(link, joints, solids)| {
            solids.iter().map(move |solid| (*joints, PlacedShape::new(*link, solid.moved(&poses[*link]))))
        });
        placed.collect()
    }
}

/// Two links of an arm that meet.
pub(crate) fn meets_itself(placed: &[(usize, PlacedShape)]) -> Option<[usize; 2]> {
    placed.iter().enumerate().find_map(|(index, (joints, link))| {
        let others = placed[index + 1..].iter().filter(|(other, _)| other.abs_diff(*joints) >= JOINTS_BETWEEN);
        let met = { others }.find(|(_, other)| link.meets(other.shape()))?;
        Some([link.link(), met.1.link()])
    })
}

impl PlacedShape {
    /// Whether it touches a shape or is in it.
    pub(crate) fn meets(&self, other: &CollisionShape) -> bool {
        self.is_nearer(other, 0.0)
    }

    /// Whether the gap to a shape is no more than this, m.
    pub(crate) fn is_nearer(&self, other: &CollisionShape, than: f64) -> bool {
        let (middle, radius) = self.ball();
        other.distance(&middle) < radius + than + SHORT_M && self.shape().gap(other) <= than + SHORT_M
    }
}
