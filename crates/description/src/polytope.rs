//! Convex polyhedra with rounded edges: the pieces of meshes that are kept clear of other things.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

/// Triangles of a smaller area have no normal, m².
const LEAST_AREA_M2: f64 = 1e-13;
/// Corners may be this far outside the faces of a hull, of its size.
const ROUNDED: f64 = 1e-6;

/// A convex polyhedron and everything within a distance of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Polytope {
    /// Its corners, m.
    pub points: Vec<Point3<f64>>,
    /// Its faces as triangles: corners, counterclockwise seen from outside.
    pub triangles: Vec<[usize; 3]>,
    /// How far it reaches beyond its faces, m.
    pub radius: f64,
    /// The center of a box about the faces, and its half edges, m.
    pub bounding_box: (Isometry3<f64>, Vector3<f64>),
    /// Of each triangle, the unit normal and its distance from the origin along it.
    planes: Vec<(Vector3<f64>, f64)>,
    /// How far it reaches from the middle of that box, m.
    reach: f64,
}

impl Polytope {
    /// Makes a polyhedron of the triangles of a convex hull; `None` where they enclose nothing.
    pub fn new(points: Vec<Point3<f64>>, triangles: &[[usize; 3]], radius: f64) -> Option<Self> {
        let normal = |[a, b, c]: [usize; 3]| (points[b] - points[a]).cross(&(points[c] - points[a]));
        let triangles: Vec<_> =
            triangles.iter().copied().filter(|it| normal(*it).norm() > 2.0 * LEAST_AREA_M2).collect();
        let planes: Vec<_> = triangles
            .iter()
            .map(|triangle| {
                let normal = normal(*triangle).normalize();
                (normal, normal.dot(&points[triangle[0]].coords))
            })
            .collect();
        let size = points.iter().map(|point| (point - points[0]).norm()).fold(0.0, f64::max);
        let inside = |plane: &(Vector3<f64>, f64)| {
            points.iter().all(|point| plane.0.dot(&point.coords) - plane.1 <= ROUNDED * size)
        };
        if triangles.len() < 4 || !planes.iter().all(inside) {
            return None;
        }
        let bounding_box = bounding_box(&points, &triangles, &planes);
        let middle = Point3::from(bounding_box.0.translation.vector);
        let reach = points.iter().map(|point| (point - middle).norm()).fold(0.0, f64::max) + radius;
        let made = Self { points, triangles, radius, bounding_box, planes, reach };
        (made.mass_properties().0 > 0.0).then_some(made)
    }

    /// The unit normals of its faces.
    pub fn normals(&self) -> impl Iterator<Item = &Vector3<f64>> {
        self.planes.iter().map(|(normal, _)| normal)
    }

    /// The point of the polyhedron, without its rounding, that is nearest to a point.
    pub fn nearest(&self, to: &Point3<f64>) -> Point3<f64> {
        let mut nearest = (f64::INFINITY, *to);
        for (triangle, (normal, offset)) in self.triangles.iter().zip(&self.planes) {
            // The nearest point is on a face that is seen from there.
            let above = normal.dot(&to.coords) - offset;
            if above > 0.0 && above * above < nearest.0 {
                let point = nearest_of_triangle(to, triangle.map(|corner| self.points[corner]));
                let distance = (point - to).norm_squared();
                if distance < nearest.0 {
                    nearest = (distance, point);
                }
            }
        }
        nearest.1
    }

    /// The center and the radius of a ball that holds it, rounding included.
    pub fn bounding_ball(&self) -> (Point3<f64>, f64) {
        (self.bounding_box.0.translation.vector.into(), self.reach)
    }

    /// Volume, m^3, center, and inertia about the center for a density of 1 kg/m^3, without its rounding.
    pub fn mass_properties(&self) -> (f64, Point3<f64>, Matrix3<f64>) {
        // Sums over the tetrahedra between the faces and a corner: volume, first and second moments.
        let origin = self.points[0];
        let (mut volume, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|corner| self.points[corner] - origin);
            let part = a.dot(&b.cross(&c)) / 6.0;
            let sum = a + b + c;
            volume += part;
            first += sum * (part / 4.0);
            let squares = a * a.transpose() + b * b.transpose() + c * c.transpose();
            second += (squares + sum * sum.transpose()) * (part / 20.0);
        }
        let center = first / f64::max(volume, f64::MIN_POSITIVE);
        let about = second - center * center.transpose() * volume;
        (volume, origin + center, Matrix3::identity() * about.trace() - about)
    }
}

/// The smallest box about the points that has a side along a face and an edge along the face's longest one.
fn bounding_box(
    points: &[Point3<f64>],
    triangles: &[[usize; 3]],
    planes: &[(Vector3<f64>, f64)],
) -> (Isometry3<f64>, Vector3<f64>) {
    let mut smallest = (f64::INFINITY, Isometry3::identity(), Vector3::zeros());
    let mut take = |axes: Rotation3<f64>| {
        let along = points.iter().map(|point| axes.inverse_transform_point(point).coords);
        let ends = along
            .fold((Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)), |(low, high), at| {
                (low.inf(&at), high.sup(&at))
            });
        let half = (ends.1 - ends.0) / 2.0;
        if half.product() < smallest.0 {
            let turn = UnitQuaternion::from_rotation_matrix(&axes);
            smallest = (half.product(), Isometry3::from_parts((axes * ((ends.0 + ends.1) / 2.0)).into(), turn), half);
        }
    };
    take(Rotation3::identity());
    for (triangle, (normal, _)) in triangles.iter().zip(planes) {
        let edges = [[0, 1], [1, 2], [2, 0]].map(|[from, to]| points[triangle[to]] - points[triangle[from]]);
        let Some(edge) = edges.into_iter().max_by(|a, b| a.norm().total_cmp(&b.norm())) else { continue };
        let edge = (edge - normal * normal.dot(&edge)).normalize();
        take(Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[edge, normal.cross(&edge), *normal])));
    }
    (smallest.1, smallest.2)
}

/// The point of a triangle that is nearest to a point (C. Ericson, *Real-Time Collision Detection*, 5.1.5).
fn nearest_of_triangle(to: &Point3<f64>, [a, b, c]: [Point3<f64>; 3]) -> Point3<f64> {
    let (ab, ac) = (b - a, c - a);
    let from = |corner: Point3<f64>| (ab.dot(&(to - corner)), ac.dot(&(to - corner)));
    let ((d1, d2), (d3, d4), (d5, d6)) = (from(a), from(b), from(c));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let (bc_from, bc_to) = (d4 - d3, d5 - d6);
    if va <= 0.0 && bc_from >= 0.0 && bc_to >= 0.0 {
        return b + (c - b) * (bc_from / (bc_from + bc_to));
    }
    let whole = va + vb + vc;
    a + ab * (vb / whole) + ac * (vc / whole)
}
