//! The distance between two limbs. Bounding spheres and bars exclude pairs of shapes that cannot be nearer than the nearest pair so far.

use nalgebra::{Isometry3, Point3, Vector3};
use std::ops::Deref;
use teachtree_description::shape::CollisionShape;
use teachtree_description::tree::KinematicTree;

/// Bounds of shapes exclude a pair only with this margin for rounding, m.
const ROUNDING_M: f64 = 1e-9;

/// A placed shape of a limb, with its link, its bounding sphere, and its bounding bar unless it is a bar.
#[derive(Clone, Debug)]
pub(crate) struct PlacedShape {
    link: usize,
    shape: CollisionShape,
    ball: (Point3<f64>, f64),
    bar: Option<CollisionShape>,
}

/// The placed shapes of a limb or an object.
#[derive(Clone, Debug)]
pub(crate) struct PlacedShapes {
    shapes: Vec<PlacedShape>,
    /// Center and radius of a ball that holds the bounding spheres of all shapes, m.
    ball: (Point3<f64>, f64),
}

impl FromIterator<PlacedShape> for PlacedShapes {
    fn from_iter<I: IntoIterator<Item = PlacedShape>>(shapes: I) -> Self {
        let shapes: Vec<PlacedShape> = shapes.into_iter().collect();
        let sum: Vector3<f64> = shapes.iter().map(|shape| shape.ball.0.coords).sum();
        let middle = Point3::from(sum / shapes.len().max(1) as f64);
        let reach = |shape: &PlacedShape| (shape.ball.0 - middle).norm() + shape.ball.1 + ROUNDING_M;
        let radius = shapes.iter().map(reach).fold(0.0, f64::max);
        Self { shapes, ball: (middle, radius) }
    }
}

impl PlacedShapes {
    /// Returns a bound of the displacement of any point since the same shapes were placed as `before`, m.
    pub(crate) fn displacement(&self, before: &Self) -> f64 {
        let shapes = self.shapes.iter().zip(&before.shapes);
        shapes.map(|(now, before)| now.shape.displacement(&before.shape)).fold(0.0, f64::max)
    }
}

impl Deref for PlacedShapes {
    type Target = [PlacedShape];

    fn deref(&self) -> &[PlacedShape] {
        &self.shapes
    }
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
        let bar = (!matches!(shape, CollisionShape::Capsule(..))).then(|| shape.bounding_bar());
        Self { link, ball: shape.bounding_ball(), bar, shape }
    }

    /// Returns the index of its link.
    pub(crate) const fn link(&self) -> usize {
        self.link
    }

    /// Returns the shape.
    pub(crate) const fn shape(&self) -> &CollisionShape {
        &self.shape
    }

    /// Whether it is a piece of a mesh.
    pub(crate) const fn is_piece(&self) -> bool {
        matches!(self.shape, CollisionShape::Piece(..))
    }

    /// Returns center and radius of its bounding sphere, m.
    pub(crate) const fn ball(&self) -> (Point3<f64>, f64) {
        self.ball
    }

    /// Returns the shape shifted by a vector, m.
    pub(crate) fn shifted(&self, by: &Vector3<f64>) -> Self {
        let by_pose = Isometry3::from(*by);
        let bar = self.bar.as_ref().map(|bar| bar.moved(&by_pose));
        Self { shape: self.shape.moved(&by_pose), ball: (self.ball.0 + by, self.ball.1), bar, link: self.link }
    }

    /// Returns the signed distance to another shape if it is less than `below`, m.
    fn gap_to(&self, other: &Self, below: f64) -> Option<f64> {
        let reach = self.ball.1 + other.ball.1 + below;
        if reach <= 0.0 || (self.ball.0 - other.ball.0).norm_squared() >= reach * reach {
            return None;
        }
        // Pieces of meshes that are in each other may be given deeper than they are, and than their bars.
        if below > 0.0 && (self.bar.is_some() || other.bar.is_some()) {
            let [ours, theirs] = [self, other].map(|it| it.bar.as_ref().unwrap_or(&it.shape));
            ours.gap_below(theirs, below + ROUNDING_M)?;
        }
        self.shape.gap_below(&other.shape, below)
    }
}

/// Returns the shapes of a limb whose links have these poses, without the first link, which both limbs share.
pub(crate) fn placed(tree: &KinematicTree, poses: &[Isometry3<f64>]) -> PlacedShapes {
    let links = tree.links.iter().zip(poses).enumerate().skip(1);
    let moved = links.flat_map(|(index, (link, pose))| link.solids.iter().map(move |solid| (index, solid.moved(pose))));
    moved.map(|(link, shape)| PlacedShape::new(link, shape)).collect()
}

/// Whether the distance of two limbs is less than `below`, m.
pub(crate) fn nearer(ours: &[PlacedShape], theirs: &[PlacedShape], below: f64) -> bool {
    ours.iter().any(|one| theirs.iter().any(|other| one.gap_to(other, below).is_some()))
}

/// Returns the distance between two limbs if it is less than `below`, m.
pub(crate) fn arm_distance(ours: &PlacedShapes, theirs: &PlacedShapes, below: f64) -> Option<ArmDistance> {
    arm_distance_until(ours, theirs, below, f64::NEG_INFINITY)
}

/// The same; as soon as it is less than `enough`, m, that is the answer.
pub(crate) fn arm_distance_until(
    ours: &PlacedShapes,
    theirs: &PlacedShapes,
    below: f64,
    enough: f64,
) -> Option<ArmDistance> {
    let mut nearest: Option<ArmDistance> = None;
    let is_far = |(one, one_m): (Point3<f64>, f64), (other, other_m): (Point3<f64>, f64)| {
        (one - other).norm() - one_m - other_m >= below
    };
    if is_far(ours.ball, theirs.ball) {
        return None;
    }
    for one in ours.iter().filter(|one| !is_far(one.ball, theirs.ball)) {
        for other in theirs.iter() {
            let so_far = nearest.as_ref().map_or(below, |nearest| nearest.gap);
            if let Some(gap) = one.gap_to(other, so_far) {
                nearest = Some(ArmDistance { gap, links: [one.link, other.link] });
                if gap < enough {
                    return nearest;
                }
            }
        }
    }
    nearest
}
