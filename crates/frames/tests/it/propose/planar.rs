//! Proposed bindings of poses in a plane.

use super::{Column, binding_of, placed, proposed};
use std::fmt::Write as _;

/// Where a block is that a pusher pushes along x from 0.4 to 0.7 of the log, m.
fn block(passed: f64) -> f64 {
    0.3 + 0.12 * ((passed - 0.4) / 0.3).clamp(0.0, 1.0)
}

/// Where the pusher is: it comes, pushes from 60 mm behind the origin of the block, and goes back.
fn pusher(passed: f64) -> f64 {
    block(passed) - 0.06 - (0.4 - passed).max(0.0) * 0.4 - (passed - 0.7).max(0.0) * 0.4
}

const NAMED: [Column; 5] = [
    ("pusher_x", pusher),
    ("pusher_y", |_| 0.2),
    ("block_x", block),
    ("block_y", |_| 0.2),
    ("block_theta", |passed| 0.3 + 0.2 * block(passed)),
];

#[test]
fn named_poses_in_a_plane_are_bound_at_a_constant_height() {
    let found = placed(&NAMED);
    for line in [
        r#"  right.tcp.position: ["pusher_x", "pusher_y", "= 0 m"]"#,
        r#"  block.position: ["block_x", "block_y", "= 0 m"]"#,
        r#"  block.rotation: ["= 0 rad", "= 0 rad", "block_theta"]"#,
    ] {
        assert!(found.binding.contains(line), "{}", found.binding);
    }
    // The face that is pushed is in front of the pusher; nothing is held in a plane.
    assert!(found.scene.contains("only the distance of what pushes it is measured"), "{}", found.scene);
    assert_eq!(found.lacking, Vec::<String>::new());
}

#[test]
fn units_and_other_names_of_poses_in_a_plane() {
    let (found, _) = proposed(&[
        ("robot_x_mm", |passed| pusher(passed) * 1e3),
        ("robot_y_mm", |_| 200.0),
        ("tee_x_mm", |passed| block(passed) * 1e3),
        ("tee_y_mm", |_| 200.0),
        ("tee_yaw_deg", |passed| 20.0 + 30.0 * passed),
    ]);
    for line in [
        r#"right.tcp.position: ["robot_x_mm [mm]", "robot_y_mm [mm]", "= 0 m"]"#,
        r#"tee.position: ["tee_x_mm [mm]", "tee_y_mm [mm]", "= 0 m"]"#,
        r#"tee.rotation: ["= 0 rad", "= 0 rad", "tee_yaw_deg [deg]"]"#,
    ] {
        assert!(found.contains(line), "{found}");
    }
    let (found, _) = proposed(&[
        ("agent.pos.x", pusher),
        ("agent.pos.y", |_| 0.2),
        ("T.pos.x", block),
        ("T.pos.y", |_| 0.2),
        ("T.heading", |passed| passed),
    ]);
    assert!(found.contains(r#"block.rotation: ["= 0 rad", "= 0 rad", "T.heading"]"#), "{found}");
    let array: [Column; 5] = [
        ("ee_pos[0]", pusher),
        ("ee_pos[1]", |_| 0.2),
        ("object_pose[0]", block),
        ("object_pose[1]", |_| 0.2),
        ("object_pose[2]", |passed| 3.0 * passed),
    ];
    let (found, _) = proposed(&array);
    assert!(found.contains(r#"right.tcp.position: ["ee_pos[0]", "ee_pos[1]", "= 0 m"]"#), "{found}");
    assert!(found.contains(r#"object.rotation: ["= 0 rad", "= 0 rad", "object_pose[2]"]"#), "{found}");
}

#[test]
fn two_columns_without_an_angle_are_no_pose() {
    let (found, _) = proposed(&[("stick_x", pusher), ("stick_y", block), ("speed", |passed| passed)]);
    assert!(!found.contains("tcp.position: [\"stick_x"), "{found}");
    // With a height it is a place in space, whatever is called an angle.
    let (found, _) = proposed(&[NAMED[2], NAMED[3], ("block_z", |_| 0.1), NAMED[4]]);
    assert!(found.contains("block.position: block_<xyz>"), "{found}");
}

/// A table with the state of Push-T, and commands in front of the tool by `ahead`; `scale` is the number of units in a meter.
fn state(scale: f64, ahead: f64) -> String {
    let mut text = String::from("time,state[0],state[1],state[2],state[3],state[4],action[0],action[1]\n");
    for row in 0..200 {
        let passed = f64::from(row) / 199.0;
        let at = |value: f64| value * scale;
        let (x, y) = (at(pusher(passed)), at(0.2));
        let (to_x, to_y) = (x + at(ahead), y + at(ahead));
        let _ = writeln!(
            text,
            "{:.2},{x},{y},{},{},{},{to_x},{to_y}",
            passed * 10.0,
            at(block(passed)),
            at(0.2),
            6.0 - passed
        );
    }
    text
}

#[test]
fn the_state_of_push_t_has_a_tool_and_a_block() {
    let found = binding_of(&state(1e3, 0.01));
    for line in [
        r#"right.tcp.position: ["state[0] [mm]", "-state[1] [mm]", "= 0 m"]"#,
        r#"block.position: ["state[2] [mm]", "-state[3] [mm]", "= 0 m"]"#,
        r#"block.rotation: ["= 0 rad", "= 0 rad", "-state[4]"]"#,
        "1 mm each is a guess",
    ] {
        assert!(found.contains(line), "{found}");
    }
    // In meters the commands show what the first two numbers are.
    let found = binding_of(&state(1.0, 0.01));
    assert!(found.contains(r#"block.position: ["state[2]", "state[3]", "= 0 m"]"#), "{found}");
    let found = binding_of(&state(1.0, 5.0));
    assert!(!found.contains("block.position"), "{found}");
}
