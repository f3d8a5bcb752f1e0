//! The factors of the quality of a grasp, against closed forms.

use super::kinematics::shipped;
use nalgebra::{Point3, Rotation3, Vector3};
use teachtree_base::hands::{Finger, Side};
use teachtree_base::yaml;
use teachtree_command::GraspCriterion;
use teachtree_robot::grasp::{
    Contact, GraspPlanner, GraspRequest, LARGEST_PAD_ANGLE, LARGEST_PUSHING_ANGLE, friction_margin, friction_needed,
    pad_alignment,
};

fn contact(point: Vector3<f64>, normal: Vector3<f64>) -> Contact {
    Contact { finger: Finger::Thumb, point: Point3::from(point), normal: normal.normalize() }
}

fn about_z(degrees: f64) -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Vector3::z_axis(), degrees.to_radians())
}

/// The line between two contacts leans by 20 and 35 degrees from the normals.
#[test]
fn two_contacts_need_the_larger_tangent() {
    let at = |side: f64, lean: f64| contact(Vector3::y() * 0.03 * side, about_z(lean) * Vector3::y() * side);
    let contacts = [at(-1.0, 20.0), at(1.0, 35.0)];
    let needed = friction_needed(&contacts).unwrap();
    assert!((needed - 35.0_f64.to_radians().tan()).abs() < 0.01, "{needed}");
    assert!((friction_margin(&contacts) - 0.3).abs() < 0.01, "1 - tan 35 degrees");
}

/// Three contacts about a circle, with normals that are all turned by the same angle about its axis: without friction their moments add up, so that at least one
/// force has to point to the center, and a force does so with the friction of that angle.
#[test]
fn three_contacts_about_a_circle_need_the_tangent_of_their_turn() {
    for turn in [0.0_f64, 15.0, 30.0] {
        let at = |around: f64| {
            let out = about_z(around) * Vector3::x();
            contact(out * 0.04, about_z(turn) * out)
        };
        let needed = friction_needed(&[0.0, 120.0, 240.0].map(at)).unwrap();
        assert!((needed - turn.to_radians().tan()).abs() < 0.01, "{turn} degrees: {needed}");
    }
}

/// The thumb is 30 mm above the fingers, 120 mm away, and friction has to bridge that.
#[test]
fn a_thumb_above_the_fingers_needs_the_slope() {
    let side = |x: f64, y: f64, z: f64| contact(Vector3::new(x, y, z), Vector3::y() * y.signum());
    let contacts = [side(0.0, -0.06, 0.03), side(-0.02, 0.06, 0.0), side(0.02, 0.06, 0.0)];
    let needed = friction_needed(&contacts).unwrap();
    assert!((needed - 0.25).abs() < 0.01, "{needed}");
}

#[test]
fn contacts_on_one_side_do_not_hold() {
    let side = |x: f64| contact(Vector3::new(x, 0.03, 0.0), Vector3::y());
    assert_eq!(friction_needed(&[side(-0.02), side(0.0), side(0.02)]), None);
    assert_eq!(friction_margin(&[side(0.0)]), 0.0);
    assert_eq!(friction_needed(&[]), None);
}

#[test]
fn alignment_is_a_cosine_and_has_its_slope() {
    for (largest, angles) in [(LARGEST_PAD_ANGLE, [1.0, 45.0, 79.0]), (LARGEST_PUSHING_ANGLE, [1.0, 50.0, 94.0])] {
        for angle in angles.map(f64::to_radians) {
            let (alignment, slope) = pad_alignment(angle.cos(), largest);
            assert!((alignment - (angle * LARGEST_PAD_ANGLE / largest).cos()).abs() < 1e-9);
            let [below, above] = [-1e-7, 1e-7].map(|by| pad_alignment(angle.cos() + by, largest).0);
            assert!(((above - below) / 2e-7 - slope).abs() < 1e-4, "{slope} at {angle} rad");
        }
    }
    let [limit, pushing] = [LARGEST_PAD_ANGLE, LARGEST_PUSHING_ANGLE].map(|angle| pad_alignment(angle.cos(), angle).0);
    assert!((limit - pushing).abs() < 1e-9, "both limits count alike");
    assert_eq!(pad_alignment(-1.0, LARGEST_PAD_ANGLE).1, 0.0);
}

/// By manipulability alone, the thumb touches a box of 60 mm with the edge of its tip.
#[test]
fn quality_turns_pads_to_the_surface() {
    let robot = shipped("gifu_hand_iii_right");
    let hand = &robot.hands[&Side::Right];
    let object = yaml::read("{role: object, mass: 50 g, parts: [{box: [120 mm, 60 mm, 120 mm]}]}", "shape").unwrap();
    let at = |finger, x: f64, side: f64| Contact {
        finger,
        point: Point3::new(x, side * 0.03, 0.03),
        normal: Vector3::y() * side,
    };
    let contacts = vec![at(Finger::Thumb, 0.0, -1.0), at(Finger::Index, -0.011, 1.0), at(Finger::Middle, 0.011, 1.0)];
    let wanted = GraspRequest { contacts, object: &object, obstacles: Vec::new() };
    let by = |criterion| GraspPlanner::with_criterion(hand, criterion).map(&wanted).unwrap();
    let (alone, quality) = (by(GraspCriterion::Manipulability), by(GraspCriterion::Quality));
    let thumb = |grasp: &teachtree_robot::GraspCandidate| grasp.fingers[0].pad_angle.to_degrees();
    assert!(thumb(&alone) > 75.0 && thumb(&quality) < 65.0, "{} and {}", thumb(&alone), thumb(&quality));
    let edge = GraspPlanner::new(hand).measure(&wanted, &alone.object_from_palm).unwrap();
    assert!(quality.measure > 1.1 * edge, "{} and {edge}", quality.measure);
    // What the alignment costs of the rest.
    let rest = |grasp: &teachtree_robot::GraspCandidate| {
        let each = grasp.fingers.iter().map(|held| held.measure(GraspCriterion::Manipulability));
        each.product::<f64>().powf(1.0 / 3.0)
    };
    assert!(
        rest(&quality) < rest(&alone) && rest(&quality) > 0.7 * rest(&alone),
        "{} and {}",
        rest(&quality),
        rest(&alone)
    );
    assert!((quality.friction_margin - 1.0).abs() < 0.01, "opposite faces need no friction");
    assert_eq!(quality.measure, GraspPlanner::new(hand).map(&wanted).unwrap().measure, "it is the default");
}
