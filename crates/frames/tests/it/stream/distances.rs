//! The distance of fingertips from a target of several parts, and the rotation of what a hand holds.

use super::{ask, column};
use crate::shared::recordings::recording;
use teachtree_frames::frames;
use teachtree_frames::frames::Frames;

/// A quarter turn about z: the components w and z.
const QUARTER: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The frames of a bar in the origin, with two fingertips, and of a lamp far away whose rotation the log lacks; `quarters` are the bodies that are turned by a
/// quarter about z.
fn seen(bar: &str, quarters: &[&str]) -> Frames {
    let scene = format!(
        "{{bodies: {{bar: {{role: object, {bar}}}, lamp: {{role: object, radius: 10 mm}}}}, hands: {{right: {{fingers: [thumb, index]}}}}}}"
    );
    let turns: Vec<String> =
        quarters.iter().flat_map(|body| ["w", "x", "y", "z"].map(|part| format!("{body}.rotation.{part}"))).collect();
    let turn = |name: &str| if name.ends_with('w') || name.ends_with('z') { QUARTER } else { 0.0 };
    let places = [
        ("right.thumb", [0.0, 0.13, 0.0]),
        ("right.index", [0.1, 0.0, 0.0]),
        ("bar", [0.0; 3]),
        ("lamp", [1.0, 1.0, 0.0]),
    ];
    let mut values: Vec<(String, f64)> = turns.into_iter().map(|name| (name.clone(), turn(&name))).collect();
    for (name, place) in places {
        values.extend(["x", "y", "z"].into_iter().zip(place).map(|(axis, at)| (format!("{name}.position.{axis}"), at)));
    }
    let constant: Vec<_> = values.into_iter().map(|(name, value)| (name, move |_: f64| value)).collect();
    let columns: Vec<(&str, &dyn Fn(f64) -> f64)> =
        constant.iter().map(|(name, value)| (name.as_str(), value as &dyn Fn(f64) -> f64)).collect();
    let asked = ["fingers.distance", "target.rotation", "target.hold_rotation", "rotation_known"];
    frames(&recording(&scene, 100.0, 50, &columns), &asked.map(ask)).unwrap()
}

#[test]
fn a_fingertip_is_as_far_from_a_target_as_from_the_surface_of_its_nearest_part() {
    const PARTS: &str = "parts: [{box: [20 mm, 20 mm, 20 mm], at: [100 mm, 0 mm, 0 mm]}, {box: [20 mm, 20 mm, 20 mm], at: [-100 mm, 0 mm, 0 mm]}]";
    let distances = |bar: &str, turned: &[&str]| {
        let found = seen(bar, turned);
        [0, 1].map(|finger| column(&found, "fingers.distance", finger, 0)[20])
    };
    let assert_near = |found: [f64; 2], wanted: [f64; 2]| {
        assert!(found.iter().zip(wanted).all(|(one, other)| (one - other).abs() < 1e-9), "{found:?} {wanted:?}");
    };
    // Turned by a quarter, the parts are at 0.1 m and -0.1 m along y.
    assert_near(distances(PARTS, &["bar"]), [0.02, 0.09 * 2.0_f64.sqrt()]);
    // Where its rotation is unknown, it stands as in the scene; and a given radius counts.
    assert_near(distances(PARTS, &[]), [0.12_f64.hypot(0.09), -0.01]);
    assert_near(distances("radius: 40 mm", &["bar"]), [0.09, 0.06]);
    assert_near(distances(&format!("radius: 40 mm, {PARTS}"), &["bar"]), [0.09, 0.06]);
    // A part in the origin, turned or not.
    let one = "parts: [{box: [20 mm, 20 mm, 20 mm]}]";
    assert_near(distances(one, &["bar"]), [0.12, 0.09]);
    assert_near(distances(one, &[]), [0.12, 0.09]);
    // Beside a long one, at its middle: its ends are far from the fingertips.
    assert_near(distances("parts: [{cylinder: [30 mm, 400 mm]}]", &[]), [0.1, 0.07]);
}

#[test]
fn what_is_held_turns_as_the_log_shows_or_else_with_the_hand() {
    let turned = |quarters: &[&str]| {
        let found = seen("radius: 40 mm", quarters);
        let angle = |channel: &str| column(&found, channel, 0, 3)[20];
        (angle("target.rotation"), angle("target.hold_rotation"), column(&found, "rotation_known", 0, 0)[20])
    };
    assert_eq!(turned(&[]), (0.0, 0.0, 0.0));
    assert_eq!(turned(&["bar"]), (QUARTER, QUARTER, 1.0));
    assert_eq!(turned(&["right.palm"]), (0.0, QUARTER, 1.0));
}
