//! Gaps between shapes of two arms, against closed forms.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use teachtree_robot::CollisionShape;
use teachtree_robot::simulation::arm_clearance::MinDistance;

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
            let got = one.gap(other);
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
        let gap = one.gap(&CollisionShape::Box(pose, Vector3::from(half)));
        prop_assume!(gap < -1e-3);
        let Some(to) = Vector3::from(to).try_normalize(1e-3) else { return Ok(()) };
        let moved = CollisionShape::Box(Isometry3::from(-to * gap * 0.98) * pose, Vector3::from(half));
        prop_assert!(one.gap(&moved) < 0.0, "{} m, then {} m", gap, one.gap(&moved));
    }

    /// A bound omits the gaps that are not below it, and does not change the others.
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
        let gap = one.gap(&other);
        prop_assert_eq!(one.gap_below(&other, below), Some(gap).filter(|gap| *gap < below));
    }

    /// A bar that is nearly parallel to a face of a box, against the least of the distances of many of its points: no point is nearer than the gap.
    #[test]
    fn a_bar_is_as_near_to_a_box_as_its_points(
        from in prop::array::uniform3(-0.4..0.4_f64), length in 0.05..0.5_f64, tilt in prop::array::uniform2(-0.02..0.02_f64),
    ) {
        let cube = CollisionShape::Box(Isometry3::identity(), Vector3::new(0.1, 0.05, 0.15));
        let (from, way) = (Point3::from(from), Vector3::new(length, tilt[0], tilt[1]));
        let got = CollisionShape::Capsule(from, from + way, 0.01).gap(&cube) + 0.01;
        prop_assume!(got > 1e-3);
        let points = (0..=1000).map(|at| cube.distance(&(from + way * (f64::from(at) / 1000.0))));
        let least = points.fold(f64::INFINITY, f64::min);
        // Points stand at most 0.51 mm apart.
        prop_assert!(got <= least + 1e-9 && got > least - 3e-4, "{} m, points {} m", got, least);
        let turned = cube.gap(&CollisionShape::Capsule(from, from + way, 0.01)) + 0.01;
        prop_assert!((got - turned).abs() < 1e-9, "{} m, from the box {} m", got, turned);
    }

    /// Two bars, against the least of the distances between many points on them.
    #[test]
    fn bars_are_as_near_as_their_points(ends in prop::array::uniform4(prop::array::uniform3(-0.5..0.5_f64)), radius in 0.0..0.05_f64) {
        let [a, b, c, d] = ends.map(Point3::from);
        let got = CollisionShape::Capsule(a, b, radius).gap(&CollisionShape::Capsule(c, d, 0.01)) + radius + 0.01;
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
