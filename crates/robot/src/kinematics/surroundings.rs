//! Obstacles of an arm: the bodies of a scene, and its own links.
//!
//! The links of an arm are those that it moves, from its first joint to the palm, and on request the fingers. Two of its own links are checked against each
//! other if at least `JOINTS_BETWEEN` joints are between them: nearer links meet at their joints.

use super::arm_distance::PlacedShape;
use nalgebra::{Isometry3, Point3, Vector3};
use teachtree_base::scene::{Role, Scene};
use teachtree_description::shape::{CollisionShape, SHORT_M, solids};
use teachtree_description::tree::KinematicTree;

/// Links with fewer joints between them are not checked against each other.
const JOINTS_BETWEEN: usize = 3;

/// The distance by which fixed bodies are lowered for collision checks, m: demonstrated poses penetrate the support of an object a little.
pub(crate) const SUNK_M: f64 = 0.002;

/// The shapes of static bodies, reference frame.
#[derive(Clone, Debug, Default)]
pub struct Surroundings {
    shapes: Vec<CollisionShape>,
    /// Shapes that are nearer than this collide, m.
    room: f64,
}

impl Surroundings {
    /// Returns the shapes of the fixed bodies of a scene.
    pub fn fixed(scene: &Scene) -> Self {
        let fixed = scene.bodies.values().filter(|body| body.role != Role::Object);
        let shapes = fixed.flat_map(|body| solids(body).into_iter().map(|it| it.moved(&body.pose()))).collect();
        Self { shapes, room: 0.0 }
    }

    /// Returns the same shapes lowered by `by`, m: demonstrated poses penetrate the support of an object a little.
    pub(crate) fn sunk(scene: &Scene, by: f64) -> Self {
        Self::fixed(scene).moved(&Isometry3::from(-scene.up() * by))
    }

    /// Returns the same shapes moved by `pose`.
    pub(crate) fn moved(&self, pose: &Isometry3<f64>) -> Self {
        Self { shapes: self.shapes.iter().map(|shape| shape.moved(pose)).collect(), room: self.room }
    }

    /// Returns the surroundings with more shapes, reference frame.
    pub(crate) fn with(mut self, more: impl Iterator<Item = CollisionShape>) -> Self {
        self.shapes.extend(more);
        self
    }

    /// Returns the surroundings with a clearance, m.
    pub(crate) fn with_room(self, room: f64) -> Self {
        Self { room, ..self }
    }

    /// The shapes.
    pub(crate) fn shapes(&self) -> &[CollisionShape] {
        &self.shapes
    }

    /// Whether any link collides with a shape or another link.
    pub(crate) fn meet(&self, links: &ArmLinks, poses: &[Isometry3<f64>]) -> bool {
        let placed = links.placed(poses);
        self.meet_any(placed.iter().map(|(_, link)| link)) || own_meetings(&placed).next().is_some()
    }

    /// Whether any of `shapes` collides with the surroundings.
    pub(crate) fn meet_any<'s>(&self, shapes: impl IntoIterator<Item = &'s PlacedShape>) -> bool {
        shapes.into_iter().any(|shape| self.shapes.iter().any(|other| shape.is_nearer(other, self.room)))
    }
}

/// The links of an arm and its hand, each with the number of joints between it and the palm.
#[derive(Clone, Debug)]
pub(crate) struct ArmLinks {
    links: Vec<(usize, usize, Vec<CollisionShape>)>,
}

impl ArmLinks {
    /// Returns the links of an arm, from its base to the links that its last joint moves.
    pub(crate) fn new(tree: &KinematicTree, palm: usize) -> Self {
        let mut links = Self::up_to(tree, palm);
        links.retain(|(_, joints, _)| *joints > 0);
        Self { links }
    }

    /// Returns the links of an arm with the palm and the links of the fingers, which have no joints between them and the palm. A hand without an arm has only
    /// these. Fingertips may touch objects, so a link with a fingertip is represented by the center of its ball. `tips` are those links and centers, frames of
    /// the links.
    pub(crate) fn with_hand(tree: &KinematicTree, palm: usize, tips: &[(usize, Point3<f64>)]) -> Self {
        let mut links = Self::up_to(tree, palm);
        let hangs_on_palm = |link: usize| {
            let parent = |link: &usize| (*link != 0).then(|| tree.links[*link].parent);
            std::iter::successors(parent(&link), parent).any(|it| it == palm)
        };
        for link in (0..tree.links.len()).filter(|link| hangs_on_palm(*link)) {
            let centre = tips.iter().find(|(tip, _)| *tip == link).map(|(_, centre)| *centre);
            let ball = centre.map(|centre| vec![CollisionShape::Capsule(centre, centre, 0.0)]);
            links.push((link, 0, ball.unwrap_or_else(|| tree.links[link].solids.clone())));
        }
        if tree.joints_above(palm).next().is_none() {
            links.push((palm, 0, tree.links[palm].solids.clone()));
        }
        Self { links }
    }

    /// Returns the links from a palm up to the base of its arm.
    fn up_to(tree: &KinematicTree, palm: usize) -> Vec<(usize, usize, Vec<CollisionShape>)> {
        let (mut links, mut at, mut joints) = (Vec::new(), palm, 0);
        let moved = tree.joints_above(palm).count();
        while at != 0 && joints < moved {
            let link = &tree.links[at];
            links.push((at, joints, link.solids.clone()));
            joints += usize::from(link.joint.is_some());
            at = link.parent;
        }
        links
    }

    /// Returns the shapes of the links at these poses, each with the number of joints between its link and the palm.
    pub(crate) fn placed(&self, poses: &[Isometry3<f64>]) -> Vec<(usize, PlacedShape)> {
        let placed = self.links.iter().flat_map(|(link, joints, solids)| {
            solids.iter().map(move |solid| (*joints, PlacedShape::new(*link, solid.moved(&poses[*link]))))
        });
        placed.collect()
    }
}

/// Returns the pairs of links of an arm that collide.
pub(crate) fn own_meetings(placed: &[(usize, PlacedShape)]) -> impl Iterator<Item = [&PlacedShape; 2]> {
    placed.iter().enumerate().flat_map(|(index, (joints, link))| {
        let others = placed[index + 1..].iter().filter(|(other, _)| other.abs_diff(*joints) >= JOINTS_BETWEEN);
        others.filter(|(_, other)| link.meets(other.shape())).map(move |(_, other)| [link, other])
    })
}

impl PlacedShape {
    /// Whether it touches or penetrates a shape.
    pub(crate) fn meets(&self, other: &CollisionShape) -> bool {
        self.is_nearer(other, 0.0)
    }

    /// Whether the gap to a shape is at most `than`, m.
    pub(crate) fn is_nearer(&self, other: &CollisionShape, than: f64) -> bool {
        self.gap_below(other, than + SHORT_M).is_some()
    }

    /// Whether the gap to a shape is at most `than` after a shift by `by`, m.
    pub(crate) fn is_nearer_shifted(&self, by: &Vector3<f64>, other: &CollisionShape, than: f64) -> bool {
        let ((middle, radius), below) = (self.ball(), than + SHORT_M);
        let may_be = other.distance(&(middle + by)) < radius + below;
        may_be && self.shape().moved(&Isometry3::from(*by)).gap_below(other, below).is_some()
    }

    /// The gap to a shape, m; `None` where it is no less than `below`.
    pub(crate) fn gap_below(&self, other: &CollisionShape, below: f64) -> Option<f64> {
        let (middle, radius) = self.ball();
        (other.distance(&middle) < radius + below).then(|| self.shape().gap_below(other, below))?
    }
}
