//! The gap between two shapes, against closed forms and another library.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use teachtree_base::geometry::surface_distance;
use teachtree_base::scene::Body;
use teachtree_base::yaml;
use teachtree_frames::convex_gap::{NEAR, gaps};

/// What the module promises of balls, and of cylinders, m.
const EXACT: f64 = 1e-12;
const PROMISED: f64 = 50e-6;

fn body(part: &str) -> Body {
    yaml::read(&format!("{{role: object, parts: [{{{part}}}]}}"), "body").unwrap()
}

fn the_gap(one: &Body, at: &Isometry3<f64>, other: &Body) -> f64 {
    let [gap] = gaps((one, at), (other, &Isometry3::identity()), 0.0).try_into().unwrap();
    gap.width
}

prop_compose! {
    fn mm(range: std::ops::Range<f64>)(size in range) -> f64 { size * 1e-3 }
}

fn direction() -> impl Strategy<Value = Vector3<f64>> {
    [-1.0..1.0, -1.0..1.0, -1.0..1.0].prop_map(Vector3::from).prop_filter("a direction", |it| it.norm() > 0.1)
}

prop_compose! {
    /// A place within the reach of the shapes below, turned anyhow or along the axes.
    fn place()(way in direction(), far in mm(0.0..80.0), turn in direction(), upright in any::<bool>()) -> Isometry3<f64> {
        let turn = if upright { UnitQuaternion::identity() } else { UnitQuaternion::from_scaled_axis(turn * 3.0) };
        Isometry3::from_parts(Translation3::from(way.normalize() * far), turn)
    }
}

proptest! {
    #[test]
    fn a_ball_is_as_far_as_its_centre_less_its_radius(at in place(), radius in mm(2.0..40.0), x in mm(2.0..60.0), z in mm(2.0..60.0)) {
        let ball = body(&format!("ball: {radius} m"));
        for part in [format!("box: [{x} m, 20 mm, {z} m]"), format!("cylinder: [{x} m, {z} m]")] {
            let other = body(&part);
            let wanted = surface_distance(&other, &at.translation.vector.into()) - radius;
            if wanted < NEAR {
                let found = the_gap(&ball, &at, &other);
                prop_assert!((found - wanted).abs() < EXACT, "{part}: {found}, expected {wanted}");
            }
        }
    }
}

/// Any two shapes, against parry.
mod parry {
    use super::*;
    use parry3d::math::{Pose, Vector};
    use parry3d::query;
    use parry3d::shape::{Ball, Cuboid, Cylinder, Shape};

    /// A part in the text of a scene, and as a shape of parry.
    struct Both {
        part: String,
        shape: Box<dyn Shape>,
        has_edges: bool,
    }

    fn shape() -> impl Strategy<Value = (usize, [f64; 3])> {
        (0..3_usize, prop::array::uniform3(mm(2.0..60.0)))
    }

    fn both((kind, [x, y, z]): (usize, [f64; 3])) -> Both {
        match kind {
            0 => {
                let shape = Box::new(Cuboid::new([x / 2.0, y / 2.0, z / 2.0].into()));
                Both { part: format!("box: [{x} m, {y} m, {z} m]"), shape, has_edges: true }
            }
            1 => {
                let shape = Box::new(Cylinder::new(z / 2.0, x / 2.0));
                Both { part: format!("cylinder: [{} m, {z} m]", x / 2.0), shape, has_edges: false }
            }
            _ => Both { part: format!("ball: {} m", x / 2.0), shape: Box::new(Ball::new(x / 2.0)), has_edges: false },
        }
    }

    impl Both {
        /// The pose of the shape; the axis of a cylinder is y in parry.
        fn at(&self, at: &Isometry3<f64>) -> Pose {
            let upright = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
            if self.shape.as_cylinder().is_some() { (at * upright).into() } else { (*at).into() }
        }

        /// How far the shape reaches along a direction.
        fn reach(&self, at: &Isometry3<f64>, toward: Vector) -> f64 {
            let at = self.at(at);
            self.shape.as_support_map().unwrap().support_point(&at, toward).dot(toward)
        }
    }

    proptest! {
        #[test]
        fn gaps_are_those_of_parry(at in place(), one in shape(), other in shape()) {
            let still = Isometry3::identity();
            let (one, other) = (both(one), both(other));
            let separation = |axis: Vector| -one.reach(&at, -axis) - other.reach(&still, axis);
            let [found] = gaps((&body(&one.part), &at), (&body(&other.part), &still), 0.0).try_into().unwrap();
            let (of_one, of_other) = (one.at(&at), other.at(&still));
            let wanted = query::distance(&of_one, &*one.shape, &of_other, &*other.shape).unwrap().distance;
            let name = format!("{} and {}: {}", one.part, other.part, found.width);
            if found.width < NEAR {
                // No gap is wider than the separation along its normal.
                let along = separation(found.normal.into());
                prop_assert!((along - found.width).abs() < 1e-9, "{name}, {along} along its normal");
            }
            prop_assert!(found.width < wanted + 1e-9, "{name}, expected {wanted}");
            if wanted > PROMISED {
                // Beside edges and corners, the gap of boxes is short by a factor of 1.8 at most.
                let least = if one.has_edges && other.has_edges { wanted / 1.8 } else { wanted - PROMISED };
                prop_assert!(found.width >= least.min(NEAR), "{name}, expected {wanted}");
            } else if let Ok(Some(contact)) = query::contact(&of_one, &*one.shape, &of_other, &*other.shape, 0.0) {
                // No direction separates them by more.
                let least = separation(-contact.normal1);
                prop_assert!(found.width > least - PROMISED, "{name}, parry {least}");
            }
        }
    }
}
