//! Convex pieces of a mesh. Their union contains all triangles of the mesh: a shape that does not touch the pieces does not touch the mesh.
//!
//! The method is V-HACD (K. Mamou, *Volumetric Hierarchical Approximate Convex Decomposition*, 2016), as parry has it: the mesh becomes voxels, which are cut
//! by planes as long as a part is far from convex. The piece of a part is the convex hull of the mesh within it. Hulls of many corners are made of fewer, and
//! rounded by as much as they miss of the others.

use nalgebra::{Isometry3, Point3, Vector3};
use parry3d::math::Vector;
use parry3d::transformation::try_convex_hull;
use parry3d::transformation::vhacd::{VHACD, VHACDParameters};
use parry3d::transformation::voxelization::FillMode;
use std::sync::Arc;
use teachtree_base::error::InputError;
use teachtree_base::guard::guarded;
use teachtree_description::mesh::Mesh;
use teachtree_description::polytope::Polytope;
use teachtree_description::shape::CollisionShape;

/// Voxels along the longest edge.
const RESOLUTION: u32 = 32;
/// A part is cut if its hull exceeds its volume by this share of the hull of the whole mesh.
const CONCAVITY: f64 = 0.03;
/// The mesh is halved until it has at most twice this number of parts.
const HALVED_TO: u32 = 4;
/// Maximum number of comparisons of triangles with voxels; a mesh that needs more is one piece.
const MAX_COMPARED: f64 = 1.6e7;
/// Maximum number of corners of a hull, and the error below which fewer suffice, m.
const MAX_CORNERS: usize = 64;
const MISSES_M: f64 = 3e-4;
/// A piece with a larger error is replaced with a box, m.
const MAX_MISSED_M: f64 = 8e-3;
/// A flat mesh is a box of at least this half thickness, m.
const THIN_M: f64 = 5e-4;

/// The convex pieces of a mesh, in its frame.
pub(super) fn of(mesh: &Mesh) -> Vec<CollisionShape> {
    let whole = piece(&mesh.points);
    if volume(mesh) >= (1.0 - CONCAVITY) * whole.mass_properties().0 {
        return vec![whole];
    }
    let parts = decomposed(mesh).unwrap_or_default();
    if parts.len() < 2 { vec![whole] } else { parts.iter().map(|points| piece(points)).collect() }
}

/// The volume that a closed mesh encloses, m³.
fn volume(mesh: &Mesh) -> f64 {
    let origin = mesh.points.first().copied().unwrap_or_default();
    let part = |triangle: &[usize; 3]| {
        let [a, b, c] = triangle.map(|corner| mesh.points[corner] - origin);
        a.dot(&b.cross(&c)) / 6.0
    };
    mesh.triangles.iter().map(part).sum::<f64>().abs()
}

/// Returns the corners of the parts of a mesh; empty if it cannot be decomposed.
fn decomposed(mesh: &Mesh) -> Option<Vec<Vec<Point3<f64>>>> {
    let [low, high] = mesh.bounds();
    let voxel = (high - low).max() / f64::from(RESOLUTION - 1);
    let compared = |triangle: &[usize; 3]| {
        let corners = triangle.map(|corner| mesh.points[corner].coords);
        let [a, b, c] = corners;
        ((a.sup(&b).sup(&c) - a.inf(&b).inf(&c)) / voxel).iter().map(|edge| edge + 3.0).product::<f64>()
    };
    if voxel <= 0.0 || mesh.triangles.iter().map(compared).sum::<f64>() > MAX_COMPARED {
        return None;
    }
    let points: Vec<Vector> = mesh.points.iter().map(|point| point.coords.into()).collect();
    let triangles: Vec<[u32; 3]> = mesh.triangles.iter().map(|triangle| triangle.map(|corner| corner as u32)).collect();
    let parameters = VHACDParameters {
        concavity: CONCAVITY,
        resolution: RESOLUTION,
        max_convex_hulls: HALVED_TO,
        // Hulls of every fourth voxel are smaller than their parts, which would then count as concave.
        convex_hull_downsampling: 1,
        fill_mode: FillMode::FloodFill { detect_cavities: false },
        ..VHACDParameters::default()
    };
    // The library asserts conditions that rounding may break.
    let parts = guarded("", || {
        let made = VHACD::decompose(&parameters, &points, &triangles, true);
        let hulls = made.compute_exact_convex_hulls(&points, &triangles);
        Ok::<_, InputError>(hulls.into_iter().map(|(points, _)| points))
    });
    let parts = parts.ok()?.map(|points| points.into_iter().map(|point| Point3::from(Vector3::from(point))).collect());
    Some(parts.filter(|points: &Vec<_>| !points.is_empty()).collect())
}

/// Returns the rounded hull of points; a box for points without a hull, such as flat ones.
fn piece(points: &[Point3<f64>]) -> CollisionShape {
    hull(points).map_or_else(
        || {
            let mesh = Mesh { points: points.to_vec(), triangles: Vec::new() };
            let [low, high] = mesh.bounds();
            let half = ((high - low) / 2.0).map(|half| half.max(THIN_M));
            CollisionShape::Box(
                Isometry3::translation((low.x + high.x) / 2.0, (low.y + high.y) / 2.0, (low.z + high.z) / 2.0),
                half,
            )
        },
        |polytope| CollisionShape::Piece(Isometry3::identity(), Arc::new(polytope)),
    )
}

fn hull(points: &[Point3<f64>]) -> Option<Polytope> {
    let (points, _) = hull_of(points)?;
    // First the farthest points in many directions, then the point farthest outside, until the error is small.
    let mut chosen: Vec<usize> = Vec::new();
    let choose = |chosen: &mut Vec<usize>, direction: Vector3<f64>| {
        let along = |at: &usize| direction.dot(&points[*at].coords);
        if let Some(farthest) = (0..points.len()).max_by(|one, other| along(one).total_cmp(&along(other)))
            && !chosen.contains(&farthest)
        {
            chosen.push(farthest);
        }
    };
    for x in -1..=1 {
        for y in -1..=1 {
            for z in -1..=1 {
                choose(&mut chosen, Vector3::new(f64::from(x), f64::from(y), f64::from(z)));
            }
        }
    }
    let mut best: Option<(f64, Polytope)> = None;
    while chosen.len() <= MAX_CORNERS {
        let corners: Vec<Point3<f64>> = chosen.iter().map(|at| points[*at]).collect();
        let (corners, triangles) = hull_of(&corners)?;
        let Some(made) = Polytope::new(corners, &triangles, 0.0) else { break };
        let missed: Vec<f64> = points.iter().map(|point| (made.nearest(point) - point).norm()).collect();
        let radius = missed.iter().copied().fold(0.0, f64::max);
        if best.as_ref().is_none_or(|(least, _)| radius < *least) {
            best = Some((radius, made));
        }
        // The library leaves corners of flat faces out now and then: what was chosen is not chosen again, and the best hull is taken.
        let rest = (0..points.len()).filter(|at| missed[*at] > MISSES_M && !chosen.contains(at));
        let Some(farthest) = rest.max_by(|one, other| missed[*one].total_cmp(&missed[*other])) else { break };
        chosen.push(farthest);
    }
    let (radius, made) = best.filter(|(radius, _)| *radius <= MAX_MISSED_M)?;
    Polytope::new(made.points, &made.triangles, radius)
}

/// Corners, and triangles of them.
type Hull = (Vec<Point3<f64>>, Vec<[usize; 3]>);

/// The convex hull of points.
fn hull_of(points: &[Point3<f64>]) -> Option<Hull> {
    let points: Vec<Vector> = points.iter().map(|point| point.coords.into()).collect();
    let hull = guarded("", || try_convex_hull(&points).map_err(|error| InputError::new("", error.to_string())));
    let (points, triangles) = hull.ok()?;
    let points = points.into_iter().map(|point| Point3::from(Vector3::from(point))).collect();
    Some((points, triangles.into_iter().map(|triangle| triangle.map(|corner| corner as usize)).collect()))
}
