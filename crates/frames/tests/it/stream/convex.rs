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

/// Parry's distance of shapes that are apart.
mod parry {
    use super::*;
    use parry3d::math::Pose;
    use parry3d::query;
    use parry3d::shape::{Cuboid, Cylinder, Shape};

    /// Parry's cylinder stands along y.
    fn upright(at: &Isometry3<f64>) -> Pose {
        (at * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2)).into()
    }

    proptest! {
        #[test]
        fn cylinders_are_as_far_apart_as_parry_says(at in place(), radius in mm(2.0..30.0), height in mm(2.0..60.0), x in mm(2.0..60.0)) {
            let cylinder = body(&format!("cylinder: [{radius} m, {height} m]"));
            let still = Isometry3::identity();
            let parry: [(String, Pose, Box<dyn Shape>); 2] = [
                (format!("box: [{x} m, 20 mm, 40 mm]"), still.into(), Box::new(Cuboid::new([x / 2.0, 0.01, 0.02].into()))),
                (format!("cylinder: [{x} m, 40 mm]"), upright(&still), Box::new(Cylinder::new(0.02, x))),
            ];
            for (part, pose, shape) in parry {
                let own = Cylinder::new(height / 2.0, radius);
                let wanted = query::distance(&upright(&at), &own, &pose, &*shape).unwrap().distance;
                if wanted > PROMISED && wanted < NEAR {
                    let found = the_gap(&cylinder, &at, &body(&part));
                    prop_assert!((found - wanted).abs() < PROMISED, "{part}: {found}, expected {wanted}");
                }
            }
        }
    }
}
