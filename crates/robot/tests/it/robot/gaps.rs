//! Gaps between shapes of links, and bounds of shapes.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use parry3d::math::{Pose, Vector as Vec3};
use parry3d::query;
use parry3d::shape::SharedShape;
use proptest::prelude::*;
use teachtree_robot::CollisionShape;

fn pose() -> impl Strategy<Value = Isometry3<f64>> {
    (prop::array::uniform3(-0.2_f64..0.2), prop::array::uniform3(-3.0_f64..3.0)).prop_map(|(at, turn)| {
        Isometry3::from_parts(Translation3::from(Vector3::from(at)), UnitQuaternion::from_scaled_axis(turn.into()))
    })
}

/// Bars and boxes, as long and as thick as links and fingers.
fn shape() -> impl Strategy<Value = CollisionShape> {
    prop_oneof![
        (pose(), 0.0_f64..0.3, 0.005_f64..0.03).prop_map(|(at, length, radius)| CollisionShape::Capsule(
            at * Point3::origin(),
            at * Point3::new(length, 0.0, 0.0),
            radius
        )),
        (pose(), prop::array::uniform3(0.005_f64..0.2)).prop_map(|(at, half)| CollisionShape::Box(at, half.into())),
    ]
}

/// The same shape of parry, and its pose.
fn in_parry(shape: &CollisionShape) -> (SharedShape, Pose) {
    match shape {
        CollisionShape::Capsule(from, to, radius) => {
            let [from, to] = [from, to].map(|end| Vec3::new(end.x, end.y, end.z));
            (SharedShape::capsule(from, to, *radius), Isometry3::identity().into())
        }
        CollisionShape::Box(at, half) => (SharedShape::cuboid(half.x, half.y, half.z), (*at).into()),
        CollisionShape::Piece(..) => unreachable!("only bars and boxes are generated"),
    }
}

proptest! {
    /// An early end of the search for a gap does not change its result, and bars about shapes are no farther apart than the shapes.
    #[test]
    fn bounds_of_a_gap_hold(one in shape(), other in shape(), off in -0.05_f64..0.05) {
        let gap = one.gap(&other);
        for below in [gap + off, 0.005, 0.1] {
            prop_assert_eq!(one.gap_below(&other, below), Some(gap).filter(|gap| *gap < below), "below {}", below);
        }
        let bars = one.bounding_bar().gap(&other.bounding_bar());
        prop_assert!(bars <= gap.max(0.0) + 1e-9, "{bars} m between bars, {gap} m between shapes");
    }

    /// Shapes that are apart have the distance that parry computes for its own shapes.
    #[test]
    fn gaps_are_those_of_parry(one in shape(), other in shape()) {
        let [(ours, at), (theirs, there)] = [&one, &other].map(in_parry);
        let distance = query::distance(&at, &*ours, &there, &*theirs).expect("supported shapes").distance;
        let gap = one.gap(&other);
        prop_assert!((gap.max(0.0) - distance).abs() < 1e-5, "{gap} m, {distance} m by parry");
    }

    /// No point of a shape moves farther than the bound of its displacement.
    #[test]
    fn displacements_are_bounded(one in shape(), moves in prop::array::uniform3(-0.05_f64..0.05), turn in prop::array::uniform3(-1.0_f64..1.0)) {
        let motion = Isometry3::from_parts(Translation3::from(Vector3::from(moves)), UnitQuaternion::from_scaled_axis(turn.into()));
        let (at, half) = one.bounding_box();
        let bound = one.moved(&motion).displacement(&one);
        // Corners of a box, and ends of a bar.
        let reach = if matches!(one, CollisionShape::Box(..)) { half } else { Vector3::new(0.0, 0.0, half.z - half.x) };
        for corner in 0..8_u8 {
            let sign = |axis: u8| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
            let point = at * Point3::from(Vector3::new(sign(0), sign(1), sign(2)).component_mul(&reach));
            let moved = (motion * point - point).norm();
            prop_assert!(moved <= bound + 1e-9, "{moved} m, at most {bound} m");
        }
    }

    /// Bars in one plane that do not cross have the gap of their nearest ends: here 8 mm between the lines, less both radii.
    #[test]
    fn bars_in_one_plane_are_not_in_each_other(at in pose(), length in 0.05_f64..0.2, lean in 0.1_f64..1.4) {
        let point = |x: f64, y: f64| at * Point3::new(x, y, 0.0);
        let lying = CollisionShape::Capsule(point(-length, 0.0), point(length, 0.0), 0.003);
        let (along, up) = (length * lean.cos(), length * lean.sin());
        let leaning = CollisionShape::Capsule(point(0.0, 0.008), point(along, 0.008 + up), 0.003);
        let gap = lying.gap(&leaning);
        prop_assert!((gap - 0.002).abs() < 1e-9, "{gap}");
    }
}
