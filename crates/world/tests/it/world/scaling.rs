//! Virtual hands as large as those of a robot (chapter, section 2.6): fingers are farther apart on the object, and stay on it.

use nalgebra::Vector3;
use teachtree_base::quantity::Quantity;
use teachtree_base::recording::Recording;
use teachtree_base::scene::Shape;
use teachtree_world::{self as world, Operator, Variation};

/// Tips sink in by the squeeze, and fingers come down one after the other, m.
const SUNK_M: f64 = 2e-3;

fn taught(name: &str, scale: f64) -> Recording {
    let operator = Operator { variation: Variation::default(), ..world::operator(name).unwrap() };
    world::teach(&world::scene(name).unwrap(), &operator.with_hands(scale), 1).unwrap()
}

fn vector(recording: &Recording, name: &str, row: usize) -> Vector3<f64> {
    Vector3::from(["x", "y", "z"].map(|part| recording.columns[&format!("{name}.{part}")].values[row]))
}

/// Where index and middle finger are about the object when it has just been taken up, and how far the palm is from it, m.
fn held(recording: &Recording, object: &str) -> ([Vector3<f64>; 2], f64) {
    let row = recording.labels["right.label"].iter().position(|label| label == "Translate").unwrap();
    let at = vector(recording, &format!("{object}.position"), row);
    let tips = ["index", "middle"].map(|finger| vector(recording, &format!("right.{finger}.position"), row) - at);
    (tips, (vector(recording, "right.palm.position", row) - at).norm())
}

fn labels(recording: &Recording) -> Vec<&str> {
    let mut labels: Vec<&str> = recording.labels["right.label"].iter().map(String::as_str).collect();
    labels.dedup();
    labels
}

#[test]
fn fingers_of_a_larger_hand_are_farther_apart() {
    let (own, large) = (taught("pick_and_place", 1.0), taught("pick_and_place", 1.3));
    let ([index, middle], palm) = held(&own, "box");
    assert!(((middle - index).norm() - 0.028).abs() < SUNK_M);
    let ([index, middle], farther) = held(&large, "box");
    assert!(((middle - index).norm() - 0.028 * 1.3).abs() < SUNK_M, "{index} {middle}");
    assert!(farther > palm * 1.15, "{farther} {palm}");
    assert_eq!(labels(&own), labels(&large));
}

#[test]
fn fingers_stay_on_the_face() {
    // Twice as far apart they would be 28 mm to either side of the middle; this box ends at 20 mm.
    let mut scene = world::scene("pick_and_place").unwrap();
    scene.bodies["box"].parts[0].shape = Shape::Box([0.040, 0.060, 0.070].map(Quantity));
    let operator = Operator { variation: Variation::default(), ..world::operator("pick_and_place").unwrap() };
    let recording = world::teach(&scene, &operator.with_hands(2.0), 1).unwrap();
    let ([index, middle], _) = held(&recording, "box");
    for tip in [index, middle] {
        assert!(tip.x.abs() < 0.020 + SUNK_M, "{tip}");
    }
    assert!((middle - index).norm() > 0.035, "{index} {middle}");
}

#[test]
fn round_sides_are_gone_around() {
    let apart = |scale| {
        let ([index, middle], _) = held(&taught("stamp", scale), "stamp");
        (middle - index).norm()
    };
    let (own, large) = (apart(1.0), apart(1.3));
    assert!((1.1..1.3).contains(&(large / own)), "{own} {large}");
}
