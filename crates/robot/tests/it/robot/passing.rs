//! Gaps between shapes of two arms, against closed forms.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use parry3d::math::Vector;
use parry3d::transformation::try_convex_hull;
use proptest::prelude::*;
use std::sync::Arc;
use teachtree_robot::kinematics::gap::{gap, gap_below};
use teachtree_robot::simulation::arm_clearance::MinDistance;
use teachtree_robot::{CollisionShape, Polytope};

/// The convex hull of points, as the piece of a mesh.
fn piece(points: &[Point3<f64>]) -> Option<CollisionShape> {
    let points: Vec<Vector> = points.iter().map(|point| point.coords.into()).collect();
    let (points, triangles) = try_convex_hull(&points).ok()?;
    let points = points.into_iter().map(|point| Point3::from(Vector3::from(point))).collect();
    let triangles: Vec<_> = triangles.iter().map(|triangle| triangle.map(|corner| corner as usize)).collect();
    let polytope = Polytope::new(points, &triangles, 0.0)?;
    Some(CollisionShape::Piece(Isometry3::identity(), Arc::new(polytope)))
}

/// The largest separation of two tetrahedra along the normals of their faces and the products of their edges.
fn separation(one: &[Point3<f64>; 4], other: &[Point3<f64>; 4]) -> f64 {
    let edges = |corners: &[Point3<f64>; 4]| -> Vec<Vector3<f64>> {
        [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)].map(|(from, to)| corners[to] - corners[from]).into()
    };
    let (ours, theirs) = (edges(one), edges(other));
    let pairs = [&ours, &theirs, &ours].into_iter().zip([&ours, &theirs, &theirs]);
    let axes = pairs.flat_map(|(one, other)| one.iter().flat_map(|edge| other.iter().map(|other| edge.cross(other))));
    let separations = axes.filter_map(|axis| axis.try_normalize(1e-9)).flat_map(|axis| {
        let along = |corners: &[Point3<f64>; 4]| corners.map(|corner| axis.dot(&corner.coords));
        let ends = |along: [f64; 4]| {
            [along.into_iter().fold(f64::INFINITY, f64::min), along.into_iter().fold(f64::NEG_INFINITY, f64::max)]
        };
        let ([low, high], [from, to]) = (ends(along(one)), ends(along(other)));
        [from - high, low - to]
    });
    separations.fold(f64::NEG_INFINITY, f64::max)
}

fn bar(from: [f64; 3], to: [f64; 3], radius: f64) -> CollisionShape {
    CollisionShape::Capsule(Point3::from(from), Point3::from(to), radius)
}

#[test]
fn gaps_of_bars_and_boxes_are_those_of_the_closed_forms() {
    let turned = |angle: f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
    let cube = |x: f64, angle: f64| {
        CollisionShape::Box(Isometry3::from_parts([x, 0.0, 0.0].into(), turned(angle)), Vector3::repeat(0.1))
    };
    let lying = bar([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], 0.02);
    let cases = [
        ("crossing bars", lying.clone(), bar([0.3, -1.0, 0.2], [0.3, 1.0, 0.2], 0.03), 0.2 - 0.05),
        ("bars one behind the other", lying.clone(), bar([1.5, 0.0, 0.0], [2.0, 0.0, 0.0], 0.03), 0.5 - 0.05),
        ("bars in each other", lying, bar([0.3, -1.0, 0.01], [0.3, 1.0, 0.01], 0.03), 0.01 - 0.05),
        ("a bar beside a cube", bar([0.3, -1.0, 0.0], [0.3, 1.0, 0.0], 0.05), cube(0.0, 0.0), 0.2 - 0.05),
        ("cubes face to face", cube(0.0, 0.0), cube(0.5, 0.0), 0.3),
        // The other one looks at it with an edge.
        ("face to edge", cube(0.0, 0.0), cube(0.5, std::f64::consts::FRAC_PI_4), 0.4 - 0.1 * 2.0_f64.sqrt()),
        ("cubes in each other", cube(0.0, 0.0), cube(0.15, 0.3), 0.15 - 0.1 - 0.1 * (0.3_f64.cos() + 0.3_f64.sin())),
        ("a bar in a cube", bar([0.06, -1.0, 0.0], [0.06, 1.0, 0.0], 0.05), cube(0.0, 0.0), 0.06 - 0.1 - 0.05),
    ];
    for (name, one, other, wanted) in cases {
        for (one, other) in [(&one, &other), (&other, &one)] {
            let got = gap(one, other);
            assert!((got - wanted).abs() < 2e-5, "{name}: {got} m, expected {wanted} m");
        }
    }
}

#[test]
fn what_touches_passes_through() {
    let nearest = |gap: f64| MinDistance { gap, time_s: 1.0, links: ["a".into(), "b".into()] };
    assert!(nearest(0.0).passes_through() && nearest(-0.01).passes_through() && !nearest(0.001).passes_through());
}

proptest! {
    /// Boxes that are in each other stay so when one is moved by less than the way out, wherever to.
    #[test]
    fn no_way_out_is_shorter(
        at in prop::array::uniform3(-0.1..0.1_f64), turn in prop::array::uniform3(-2.0..2.0_f64),
        half in prop::array::uniform3(0.02..0.2_f64), to in prop::array::uniform3(-1.0..1.0_f64),
    ) {
        let one = CollisionShape::Box(Isometry3::identity(), Vector3::new(0.1, 0.05, 0.15));
        let pose = Isometry3::new(Vector3::from(at), Vector3::from(turn));
        let depth = -gap(&one, &CollisionShape::Box(pose, Vector3::from(half)));
        prop_assume!(depth > 1e-3);
        let Some(to) = Vector3::from(to).try_normalize(1e-3) else { return Ok(()) };
        let moved = CollisionShape::Box(Isometry3::from(to * depth * 0.98) * pose, Vector3::from(half));
        prop_assert!(gap(&one, &moved) < 0.0, "{} m, then {} m", -depth, gap(&one, &moved));
    }

    /// A bound leaves out the gaps that are no less, and changes none of the others.
    #[test]
    fn a_bound_changes_no_gap_below_it(
        at in prop::array::uniform3(-0.4..0.4_f64), turn in prop::array::uniform3(-2.0..2.0_f64),
        half in prop::array::uniform3(0.02..0.2_f64), below in -0.1..0.3_f64, is_bar in any::<bool>(),
    ) {
        let one = CollisionShape::Box(Isometry3::identity(), Vector3::new(0.1, 0.05, 0.15));
        let other = match is_bar {
            true => bar(at, turn, half[0]),
            false => CollisionShape::Box(Isometry3::new(Vector3::from(at), Vector3::from(turn)), Vector3::from(half)),
        };
        prop_assert_eq!(gap_below(&one, &other, below), Some(gap(&one, &other)).filter(|gap| *gap < below));
    }

    /// Pieces of meshes that overlap, against all axes that can separate them.
    #[test]
    fn the_way_out_of_a_piece_is_the_shortest(corners in prop::array::uniform8(prop::array::uniform3(-0.1..0.1_f64)), off in prop::array::uniform3(-0.1..0.1_f64)) {
        let [a, b, c, d, e, f, g, h] = corners.map(Point3::from);
        let (one, other) = ([a, b, c, d], [e, f, g, h].map(|corner| corner + Vector3::from(off)));
        let (Some(ours), Some(theirs)) = (piece(&one), piece(&other)) else { return Ok(()) };
        let (wanted, found) = (separation(&one, &other), gap(&ours, &theirs));
        if wanted < 0.0 {
            prop_assert!((found - wanted).abs() < 1e-6, "{} m, expected {} m", found, wanted);
        } else {
            prop_assert!(found > wanted - 1e-6, "{} m apart, found {} m", wanted, found);
        }
    }

    /// A box as the piece of a mesh, with faces parallel to those of another box or not.
    #[test]
    fn a_piece_that_is_a_box_has_the_gaps_of_the_box(
        half in prop::array::uniform3(1..10), of_other in prop::array::uniform3(1..10), at in prop::array::uniform3(-15..15), turn in prop::array::uniform3(-2.0..2.0_f64), is_turned in any::<bool>(),
    ) {
        let m = |cm: [i32; 3]| Vector3::from(cm.map(|cm| f64::from(cm) * 0.01));
        let corners: Vec<Point3<f64>> = (0..8).map(|corner| {
            let sign = |bit: u32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
            Point3::from(m(half).component_mul(&Vector3::new(sign(0), sign(1), sign(2))))
        }).collect();
        let turn = if is_turned { Vector3::from(turn) } else { Vector3::zeros() };
        let other = CollisionShape::Box(Isometry3::new(m(at), turn), m(of_other));
        let wanted = gap(&CollisionShape::Box(Isometry3::identity(), m(half)), &other);
        let found = gap(&piece(&corners).unwrap(), &other);
        prop_assert!((found - wanted).abs() < 1e-6, "{} m, expected {} m", found, wanted);
    }

    /// Two bars, against the least of the distances between many points on them.
    #[test]
    fn bars_are_as_near_as_their_points(ends in prop::array::uniform4(prop::array::uniform3(-0.5..0.5_f64)), radius in 0.0..0.05_f64) {
        let [a, b, c, d] = ends.map(Point3::from);
        let got = gap(&CollisionShape::Capsule(a, b, radius), &CollisionShape::Capsule(c, d, 0.01)) + radius + 0.01;
        let mut least = f64::INFINITY;
        for one in 0..=200 {
            let at = a + (b - a) * (f64::from(one) / 200.0);
            for other in 0..=200 {
                least = least.min((at - (c + (d - c) * (f64::from(other) / 200.0))).norm());
            }
        }
        // Points stand at most 9 mm apart on each bar.
        prop_assert!(got <= least + 1e-4 && got > least - 0.009, "{} m, points {} m", got, least);
    }
}
