//! The distance between two limbs. Bounding spheres exclude pairs of shapes that cannot be nearer than the nearest pair so far.

use nalgebra::{Isometry3, Point3, Vector3};
use teachtree_description::shape::CollisionShape;
use teachtree_description::tree::KinematicTree;

/// A placed shape of a limb, with its link and its bounding sphere.
#[derive(Clone, Debug)]
pub(crate) struct PlacedShape {
    link: usize,
    shape: CollisionShape,
    ball: (Point3<f64>, f64),
}

/// The nearest shapes of two limbs.
pub(crate) struct ArmDistance {
    /// The signed distance, m; negative for a penetration.
    pub(crate) gap: f64,
    /// Their links.
    pub(crate) links: [usize; 2],
}

impl PlacedShape {
    /// Returns a placed shape of a link.
    pub(crate) fn new(link: usize, shape: CollisionShape) -> Self {
        Self { link, ball: shape.bounding_ball(), shape }
    }

    /// Returns the index of its link.
    pub(crate) const fn link(&self) -> usize {
        self.link
    }

    /// Returns the shape.
    pub(crate) const fn shape(&self) -> &CollisionShape {
        &self.shape
    }

    /// Returns center and radius of its bounding sphere, m.
    pub(crate) const fn ball(&self) -> (Point3<f64>, f64) {
        self.ball
    }

    /// Returns the shape shifted by a vector, m.
    pub(crate) fn shifted(&self, by: &Vector3<f64>) -> Self {
        Self { shape: self.shape.moved(&Isometry3::from(*by)), ball: (self.ball.0 + by, self.ball.1), link: self.link }
    }

    /// Returns the gap between two bounding spheres, m: a lower bound of the distance of the shapes.
    fn least(&self, other: &Self) -> f64 {
        (self.ball.0 - other.ball.0).norm() - self.ball.1 - other.ball.1
    }
}

/// Returns the shapes of a limb whose links have these poses, without the first link, which both limbs share.
pub(crate) fn placed(tree: &KinematicTree, poses: &[Isometry3<f64>]) -> Vec<PlacedShape> {
    let links = tree.links.iter().zip(poses).enumerate().skip(1);
    let moved = links.flat_map(|(index, (link, pose))| link.solids.iter().map(move |solid| (index, solid.moved(pose))));
    moved.map(|(link, shape)| PlacedShape::new(link, shape)).collect()
}

/// Whether the distance of two limbs is less than `below`, m.
pub(crate) fn nearer(ours: &[PlacedShape], theirs: &[PlacedShape], below: f64) -> bool {
    let near = |one: &PlacedShape, other: &PlacedShape| {
        one.least(other) < below && one.shape.gap_below(&other.shape, below).is_some()
    };
    ours.iter().any(|one| theirs.iter().any(|other| near(one, other)))
}

/// Returns the distance between two limbs if it is less than `below`, m.
pub(crate) fn arm_distance(ours: &[PlacedShape], theirs: &[PlacedShape], below: f64) -> Option<ArmDistance> {
    let mut nearest: Option<ArmDistance> = None;
    for one in ours {
        for other in theirs {
            let so_far = nearest.as_ref().map_or(below, |nearest| nearest.gap);
            if one.least(other) >= so_far {
                continue;
            }
            if let Some(gap) = one.shape.gap_below(&other.shape, so_far) {
                nearest = Some(ArmDistance { gap, links: [one.link, other.link] });
            }
        }
    }
    nearest
}
