//! Proposed poses of bags whose tool is a transform that never changes, in the frame of a link that moves.

use super::channel;
use serde_json::{Value, json};
use std::fs;
use teachtree_frames::inspect::inspect;
use teachtree_frames::propose::{Answers, propose, with_places};
use teachtree_logs::read::formats;

fn transform(parent: &str, child: &str, [x, y, z]: [f64; 3], turn: f64) -> Value {
    let (w, k) = ((turn / 2.0).cos(), (turn / 2.0).sin());
    json!({ "header": { "frame_id": parent }, "child_frame_id": child, "transform": {
        "translation": { "x": x, "y": y, "z": z }, "rotation": { "w": w, "x": 0, "y": 0, "z": k } } })
}

/// The binding for a log of transforms with a gripper, and with a cube that the camera sees while the gripper holds it.
fn found(has_cube: bool) -> String {
    let line = |row: u32| {
        let passed = f64::from(row) / 200.0;
        let is_held = (0.3..0.7).contains(&passed);
        let way = (passed.clamp(0.3, 0.7) - 0.3) * 0.5;
        // The tracker scatters by half a millimeter.
        let noise = 5e-4 * (f64::from(row) * 2.4).sin();
        let mut transforms = vec![
            transform("world", "base_link", [0.0, -1.0, 0.3], 0.7),
            transform("/base_link", "wrist_3_link", [0.1, passed, 0.4], passed),
            transform("wrist_3_link", "flange", [0.0, 0.0, 0.0], 0.0),
            transform("flange", "gripper_tcp", [0.0, 0.0, 0.16], 0.0),
            transform("world", "camera", [0.5, 0.1, 0.8], 3.0),
        ];
        if has_cube {
            transforms.push(transform("camera", "cube", [way + noise, 0.1 - noise, 0.5 + noise], 0.0));
        }
        let knuckle = if is_held { 0.4 } else { 0.0 };
        let mut line = json!({ "time": passed * 10.0, "transforms": transforms });
        // The other lines are those of other joints.
        if row.is_multiple_of(20) {
            line["robotiq_85_left_knuckle_joint"] = json!(knuckle);
        }
        line
    };
    let text: String = (0..200).map(|row| format!("{}\n", line(row))).collect();
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.jsonl");
    fs::write(&log, text).unwrap();
    propose(&inspect(formats::open(&log).unwrap(), None, None).unwrap(), &Answers::default()).binding
}

#[test]
fn what_stays_in_the_frame_of_a_moving_link_is_its_tool() {
    let found = found(true);
    let tool = Some("transforms.gripper_tcp.transform.translation.<xyz>");
    assert_eq!(channel(&found, "right.tcp.position"), tool, "{found}");
    assert!(channel(&found, "right.tcp.rotation").is_some(), "{found}");
    assert!(channel(&found, "cube.position").is_some() && channel(&found, "cube.rotation").is_some(), "{found}");
    assert!(!found.contains("flange.position") && !found.contains("\nframe:"), "{found}");
    // The knuckle is one of the gripper, and the cube moves where it is closed.
    let closed = channel(&found, "right.gripper.closed");
    assert_eq!(closed, Some("robotiq_85_left_knuckle_joint > 0.36"), "{found}");
}

/// Poses that name one frame are not composed.
#[test]
fn a_tool_alone_needs_the_root_of_its_transforms() {
    let found = found(false);
    assert!(found.contains("\nframe: world    # "), "{found}");
}

/// A sensor behind a gripper that points down: its z is opposite to that of the world.
#[test]
fn the_sign_of_a_force_in_a_link_is_judged_in_the_frame_of_the_bound_log() {
    let binding_for = |force_n: f64| {
        let line = |row: u32| {
            let passed = f64::from(row) / 200.0;
            let height = 0.2 * ((passed - 0.35) / 0.1).clamp(0.0, 1.0) - 0.2 * ((passed - 0.6) / 0.1).clamp(0.0, 1.0);
            let is_held = (0.3..0.75).contains(&passed);
            let mut flange = transform("base_link", "wrist_3_link", [0.4, 0.1 + passed, 0.2 + height], 0.0);
            // Half a turn about x.
            flange["transform"]["rotation"] = json!({ "w": 0, "x": 1, "y": 0, "z": 0 });
            let transforms = [
                flange,
                transform("wrist_3_link", "gripper_tcp", [0.0, 0.0, 0.16], 0.0),
                transform("base_link", "cube", [0.4, 0.1 + passed.clamp(0.3, 0.75), 0.04 + height], 0.0),
            ];
            let force = if is_held && height > 0.0 { force_n } else { 0.0 };
            json!({ "time": passed * 10.0, "transforms": transforms, "gripper_width": if is_held { 0.04 } else { 0.08 },
                "ft": { "header": { "frame_id": "ft_link" }, "wrench": { "force": { "x": 0.01 * passed, "y": 0, "z": force } } } })
        };
        let text: String = (0..200).map(|row| format!("{}\n", line(row))).collect();
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("log.jsonl");
        fs::write(&log, text).unwrap();
        let inspected = inspect(formats::open(&log).unwrap(), None, None).unwrap();
        let first = propose(&inspected, &Answers::default());
        with_places(first, &inspected, &Answers::default(), &|| formats::open(&log)).binding
    };
    // The weight of the cube pulls the hand down, along z of the sensor.
    let on_hand = binding_for(2.0);
    assert_eq!(channel(&on_hand, "right.wrist.force"), Some("\"-ft.wrench.force.<xyz>\""), "{on_hand}");
    assert!(on_hand.contains("it points down while an object is lifted"), "{on_hand}");
    let on_object = binding_for(-2.0);
    assert_eq!(channel(&on_object, "right.wrist.force"), Some("ft.wrench.force.<xyz>"), "{on_object}");
}
