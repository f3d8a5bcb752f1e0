//! The gap between two limbs: pairs of shapes that cannot be nearer than the nearest so far are passed over, by balls about them.

use nalgebra::{Isometry3, Point3, Vector3};
use teachtree_description::shape::CollisionShape;
use teachtree_description::tree::KinematicTree;

/// A shape of a limb where it is, with its link and a ball about it.
#[derive(Clone, Debug)]
pub(crate) struct PlacedShape {
    link: usize,
    shape: CollisionShape,
    ball: (Point3<f64>, f64),
}

/// The nearest shapes of two limbs.
pub(crate) struct ArmDistance {
    /// The gap between them, m; negative when they are in each other.
    pub(crate) gap: f64,
    /// Their links.
    pub(crate) links: [usize; 2],
}

impl PlacedShape {
    /// A shape of a link where it is.
    pub(crate) fn new(link: usize, shape: CollisionShape) -> Self {
        Self { link, ball: shape.bounding_ball(), shape }
    }

    /// Its link.
    pub(crate) const fn link(&self) -> usize {
        self.link
    }

    /// The shape itself.
    pub(crate) const fn shape(&self) -> &CollisionShape {
        &self.shape
    }

    /// Middle and radius of the ball about it, m.
    pub(crate) const fn ball(&self) -> (Point3<f64>, f64) {
        self.ball
    }

    /// The same, shifted.
    pub(crate) fn shifted(&self, by: &Vector3<f64>) -> Self {
        Self { shape: self.shape.moved(&Isometry3::from(*by)), ball: (self.ball.0 + by, self.ball.1), link: self.link }
    }

    /// The gap between the balls about two shapes, m: theirs is no smaller.
    fn least(&self, other: &Self) -> f64 {
        (self.ball.0 - other.ball.0).norm() - self.ball.1 - other.ball.1
    }
}

/// The shapes of a limb whose links have these poses. The first link is that on which both limbs stand.
pub(crate) fn placed(tree: &KinematicTree, poses: &[Isometry3<f64>]) -> Vec<PlacedShape> {
    let links = tree.links.iter().zip(poses).enumerate().skip(1);
    let moved = links.flat_map(|(index, (link, pose))| link.solids.iter().map(move |solid| (index, solid.moved(pose))));
    moved.map(|(link, shape)| PlacedShape::new(link, shape)).collect()
}

/// Whether two limbs are nearer to each other than `below`, m.
pub(crate) fn nearer(ours: &[PlacedShape], theirs: &[PlacedShape], below: f64) -> bool {
    let near = |one: &PlacedShape, other: &PlacedShape| {
        one.least(other) < below && one.shape.gap_below(&other.shape, below).is_some()
    };
    ours.iter().any(|one| theirs.iter().any(|other| near(one, other)))
}

/// The gap between two limbs, where it is less than `below`, m.
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
