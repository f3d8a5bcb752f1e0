//! Meshes: triangles, and where a robot description names a file of them.

use nalgebra::{Isometry3, Point3, Vector3};

/// Triangles with their corners.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Corners, m.
    pub points: Vec<Point3<f64>>,
    /// Three corners each.
    pub triangles: Vec<[usize; 3]>,
}

/// What a mesh is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshUse {
    /// `collision`: it is kept clear of other things.
    Clearance,
    /// `visual`: it is drawn.
    Picture,
}

/// A mesh that a link of a description has.
#[derive(Clone, Debug)]
pub struct MeshName {
    /// Index of the link.
    pub link: usize,
    /// What it is for.
    pub usage: MeshUse,
    /// The file, as the description writes it: a path, `file://…` or `package://NAME/…`.
    pub file: String,
    /// Factors along x, y and z.
    pub scale: Vector3<f64>,
    /// Where it is, frame of the link.
    pub at: Isometry3<f64>,
    /// Where the description names it: `arm.urdf:12:7`.
    pub place: String,
}

impl Mesh {
    /// The least and the greatest coordinates of its corners, m.
    pub fn bounds(&self) -> [Vector3<f64>; 2] {
        let none = [Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)];
        self.points.iter().fold(none, |[low, high], point| [low.inf(&point.coords), high.sup(&point.coords)])
    }

    /// The same mesh with its corners moved.
    pub fn map(&self, to: impl Fn(&Point3<f64>) -> Point3<f64>) -> Self {
        Self { points: self.points.iter().map(to).collect(), triangles: self.triangles.clone() }
    }

    /// Adds another mesh.
    pub fn extend(&mut self, other: Self) {
        let from = self.points.len();
        self.points.extend(other.points);
        self.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|corner| from + corner)));
    }

    /// The same mesh with about as many triangles at most: corners in one cell of a grid become their mean (J. Rossignac and P. Borrel,
    /// *Multi-resolution 3D approximations for rendering complex scenes*, 1993). The finest grid of up to 1023 cells that gives no more is searched by halves.
    pub fn simplified(&self, most: usize) -> Self {
        let mut best = Self::default();
        // A finer grid mostly gives more triangles; where it does not, a coarser one than possible may be found.
        let (mut fits, mut exceeds) = (1, 1024);
        while exceeds - fits > 1 {
            let cells = (fits + exceeds) / 2;
            let made = self.clustered(cells);
            if made.triangles.len() <= most {
                (fits, best) = (cells, made);
            } else {
                exceeds = cells;
            }
        }
        best
    }

    /// The mesh with one corner in each cell of a grid, which has `cells` cells along the longest edge.
    fn clustered(&self, cells: u32) -> Self {
        let [low, high] = self.bounds();
        let edge = ((high - low).max() / f64::from(cells)).max(f64::MIN_POSITIVE);
        let mut found: std::collections::BTreeMap<[u32; 3], usize> = std::collections::BTreeMap::new();
        let mut sums: Vec<(Vector3<f64>, f64)> = Vec::new();
        let mut of_point = Vec::with_capacity(self.points.len());
        for point in &self.points {
            let cell = ((point.coords - low) / edge).map(|at| at as u32);
            let at = *found.entry(cell.into()).or_insert_with(|| {
                sums.push((Vector3::zeros(), 0.0));
                sums.len() - 1
            });
            sums[at].0 += point.coords;
            sums[at].1 += 1.0;
            of_point.push(at);
        }
        let merged = self.triangles.iter().map(|triangle| triangle.map(|corner| of_point[corner]));
        let mut triangles: Vec<[usize; 3]> = merged.filter(|[a, b, c]| a != b && b != c && c != a).collect();
        // Each once, whichever corner it begins with.
        for triangle in &mut triangles {
            let least = (0..3).min_by_key(|at| triangle[*at]).unwrap_or(0);
            triangle.rotate_left(least);
        }
        triangles.sort_unstable();
        triangles.dedup();
        Self { points: sums.iter().map(|(sum, count)| Point3::from(sum / *count)).collect(), triangles }
    }
}
