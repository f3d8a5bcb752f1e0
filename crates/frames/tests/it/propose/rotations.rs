//! Proposed rotations of three columns.

use super::{Column, along, binding, channel, lift, still};

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

#[test]
fn the_reason_why_a_rotation_is_not_used_is_named() {
    let found = with(["camera_roll", "camera_pitch", "camera_yaw"], [along, still, still]);
    assert!(
        found.contains("#   camera_<rpy=roll pitch yaw>    (the position of this name is not used, or not in the log)"),
        "{found}"
    );
}
