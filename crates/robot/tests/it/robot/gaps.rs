//! Gaps between shapes of links, and bounds of shapes.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
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
