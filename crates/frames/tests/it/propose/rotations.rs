//! Proposed rotations of three columns.

use super::{Column, along, binding, channel, lift, still};
use std::f64::consts::{PI, TAU};

fn with(names: [&'static str; 3], values: [fn(f64) -> f64; 3]) -> String {
    let mut columns: Vec<Column> = vec![("tcp_x_mm", along), ("tcp_y_mm", along), ("tcp_z_mm", lift)];
    columns.extend(names.into_iter().zip(values));
    binding(&columns)
}

#[test]
fn roll_pitch_and_yaw_are_components_of_a_rotation() {
    let values: [fn(f64) -> f64; 3] = [|passed| 180.0 - passed, still, |passed| 90.0 * passed];
    let found = with(["tcp_roll_deg", "tcp_pitch_deg", "tcp_yaw_deg"], values);
    let wanted = "tcp_<rpy=roll pitch yaw>_deg [deg]";
    assert_eq!(channel(&found, "right.tcp.rotation"), Some(wanted), "{found}");
    // Beyond a turn they are not in radians.
    let found = with(["tcp_roll", "tcp_pitch", "tcp_yaw"], values);
    assert_eq!(channel(&found, "right.tcp.rotation"), Some("tcp_<rpy=roll pitch yaw> [deg]"), "{found}");
    assert!(found.contains("in degrees, since the angles are beyond a turn in radians"), "{found}");
    let small = with(["tcp_roll", "tcp_pitch", "tcp_yaw"], [still, still, along]);
    assert_eq!(channel(&small, "right.tcp.rotation"), Some("tcp_<rpy=roll pitch yaw>"), "{small}");
    // Bodies have them too, and units are not part of their names.
    let columns: [Column; 9] = [
        ("tcp_x", along),
        ("tcp_y", along),
        ("tcp_z", lift),
        ("cube_x_mm", |passed| 1e3 * along(passed)),
        ("cube_y_mm", |passed| 1e3 * along(passed)),
        ("cube_z_mm", |passed| 1e3 * lift(passed)),
        ("cube_roll_rad", still),
        ("cube_pitch_rad", still),
        ("cube_yaw_rad", along),
    ];
    let found = binding(&columns);
    assert_eq!(channel(&found, "cube.position"), Some("cube_<xyz>_mm [mm]"), "{found}");
    assert_eq!(channel(&found, "cube.rotation"), Some("cube_<rpy=roll pitch yaw>_rad [rad]"), "{found}");
}

#[test]
fn three_angles_in_degrees_are_roll_pitch_and_yaw_unless_the_second_is_too_large() {
    let names = ["tcp_rx_deg", "tcp_ry_deg", "tcp_rz_deg"];
    let turned = with(names, [|_| 180.0, |passed| 20.0 * passed, still]);
    assert_eq!(channel(&turned, "right.tcp.rotation"), Some("tcp_r<rpy=x y z>_deg [deg]"), "{turned}");
    assert!(turned.contains("; else `tcp_r<rotvec=x y z>_deg [deg]`"), "{turned}");
    let vector = with(names, [|_| 10.0, |passed| 120.0 * passed, still]);
    assert_eq!(channel(&vector, "right.tcp.rotation"), Some("tcp_r<rotvec=x y z>_deg [deg]"), "{vector}");
    let of_ur = with(["tcp_rx", "tcp_ry", "tcp_rz"], [|_| 3.1, |passed| 0.1 * passed, still]);
    assert_eq!(channel(&of_ur, "right.tcp.rotation"), Some("tcp_r<rotvec=x y z>"), "{of_ur}");
}

/// Names that say nothing about the form.
const OPEN: [&str; 3] = ["tcp_rot_x", "tcp_rot_y", "tcp_rot_z"];
const AS_VECTOR: Option<&str> = Some("tcp_rot_<rotvec=x y z>");
const AS_ANGLES: Option<&str> = Some("tcp_rot_<rpy=x y z>");

/// The angle of a turn about a tilted axis, whose vector flips at half a turn.
const FLIPPED: fn(f64) -> f64 = |passed| {
    let angle = 2.0 + 2.5 * passed;
    if angle > PI { angle - TAU } else { angle }
};

#[test]
fn a_rotation_of_three_columns_does_not_jump() {
    let vector = with(OPEN, [|passed| 0.8 * FLIPPED(passed), |_| 0.0, |passed| 0.6 * FLIPPED(passed)]);
    assert_eq!(channel(&vector, "right.tcp.rotation"), AS_VECTOR, "{vector}");
    assert!(
        vector.contains(
            "a rotation vector: as roll, pitch and yaw, the values would jump at half a turn; else `tcp_rot_<rpy"
        ),
        "{vector}"
    );
    // A roll that jumps by a turn.
    let angles =
        with(OPEN, [|passed| if passed < 0.5 { 3.0 + 0.2 * passed } else { 0.2 * passed - 3.2 }, |_| 0.3, |_| 0.5]);
    assert_eq!(channel(&angles, "right.tcp.rotation"), AS_ANGLES, "{angles}");
    assert!(
        angles.contains("roll, pitch and yaw: as a rotation vector, the values would jump at half a turn"),
        "{angles}"
    );
}

#[test]
fn a_tool_that_points_down_turns_about_the_vertical() {
    let vector = with(OPEN, [|passed| 3.1 * (0.3 * passed).cos(), |passed| 3.1 * (0.3 * passed).sin(), |_| 0.01]);
    assert_eq!(channel(&vector, "right.tcp.rotation"), AS_VECTOR, "{vector}");
    assert!(
        vector.contains(": the rotation is about the vertical; as roll, pitch and yaw, it would tilt by "),
        "{vector}"
    );
    let angles = with(OPEN, [|_| 3.13, |_| 0.01, |passed| 0.6 * passed]);
    assert_eq!(channel(&angles, "right.tcp.rotation"), AS_ANGLES, "{angles}");
    // No rotation vector is so long.
    let long = with(OPEN, [|_| 3.13, |passed| 0.3 * passed, |passed| 1.4 - passed]);
    assert_eq!(channel(&long, "right.tcp.rotation"), AS_ANGLES, "{long}");
    assert!(long.contains("since a rotation vector is not longer than half a turn"), "{long}");
}

#[test]
fn a_rotation_vector_of_ur_may_be_longer_than_half_a_turn() {
    const AXIS: [fn(f64) -> f64; 3] =
        [|passed| 0.8 * (2.6 + passed), |passed| 0.36 * (2.6 + passed), |passed| 0.48 * (2.6 + passed)];
    let mut columns: Vec<Column> =
        vec![("actual_TCP_pose_0", along), ("actual_TCP_pose_1", still), ("actual_TCP_pose_2", lift)];
    columns.extend(["actual_TCP_pose_3", "actual_TCP_pose_4", "actual_TCP_pose_5"].into_iter().zip(AXIS));
    let found = binding(&columns);
    assert_eq!(channel(&found, "right.tcp.rotation"), Some("actual_TCP_pose_<rotvec=3 4 5>"), "{found}");
    let named = ["tcp_rx", "tcp_ry", "tcp_rz"];
    let found = with(named, AXIS);
    assert_eq!(channel(&found, "right.tcp.rotation"), Some("tcp_r<rotvec=x y z>"), "{found}");
    // A tool that points down turns about the vertical by these angles, whose norm also passes half a turn.
    let found = with(named, [|_| 3.13, |_| 0.01, |passed| 1.4 * passed]);
    assert_eq!(channel(&found, "right.tcp.rotation"), Some("tcp_r<rpy=x y z>"), "{found}");
}

#[test]
fn the_reason_why_a_rotation_is_not_used_is_named() {
    let found = with(["camera_roll", "camera_pitch", "camera_yaw"], [along, still, still]);
    assert!(
        found.contains("#   camera_<rpy=roll pitch yaw>    (the position of this name is not used, or not in the log)"),
        "{found}"
    );
}
