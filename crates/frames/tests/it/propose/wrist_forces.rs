//! The sign and the frame of a force at the wrist.

use super::{Column, along, binding, channel, columns_of_peg, lift, still};

#[test]
fn the_sign_of_a_wrist_force_is_judged_from_its_level_at_rest() {
    let with = |force: fn(f64) -> f64| {
        let columns: [Column; 9] = [
            ("tcp_x", along),
            ("tcp_y", along),
            ("tcp_z", lift),
            ("cube_x", along),
            ("cube_y", along),
            ("cube_z", lift),
            ("ft_fx", still),
            ("ft_fy", still),
            ("ft_fz", force),
        ];
        binding(&columns)
    };
    let on_object = with(|passed| if lift(passed) > 0.1 { -3.0 } else { -5.0 });
    assert_eq!(channel(&on_object, "right.wrist.force"), Some("ft_f<xyz>"), "{on_object}");
    assert!(on_object.contains("`\"-ft_f<xyz>\"`"), "{on_object}");
    let on_hand = with(|passed| if lift(passed) > 0.1 { 3.0 } else { 5.0 });
    assert_eq!(channel(&on_hand, "right.wrist.force"), Some("\"-ft_f<xyz>\""), "{on_hand}");
    assert!(on_hand.contains("the sensor turns with a hand that points down, bind `ft_f<xyz>`"), "{on_hand}");
    let unknown = with(|passed| 0.01 * passed);
    assert!(unknown.contains("if it is the force on the hand, write `-` before it"), "{unknown}");
}

/// Nothing but the hand and its force is in the log: the weight appears when the gripper has closed and the hand goes up.
#[test]
fn the_sign_of_a_wrist_force_is_judged_from_the_weight_in_a_gripper() {
    let closes = |passed: f64| if (0.25..0.75).contains(&passed) { 0.04 } else { 0.08 };
    let with = |force: fn(f64) -> f64| {
        let up_and_down = |passed: f64| 0.3 * (10.0 * passed).cos().abs();
        binding(&[
            ("tcp_x", along),
            ("tcp_y", along),
            ("tcp_z", up_and_down),
            ("width", closes),
            ("ft_fx", still),
            ("ft_fy", still),
            ("ft_fz", force),
        ])
    };
    let on_hand = with(|passed| if (0.25..0.75).contains(&passed) { -2.0 } else { 1.0 });
    assert_eq!(channel(&on_hand, "right.wrist.force"), Some("\"-ft_f<xyz>\""), "{on_hand}");
    let on_object = with(|passed| if (0.25..0.75).contains(&passed) { 2.0 } else { 1.0 });
    assert_eq!(channel(&on_object, "right.wrist.force"), Some("ft_f<xyz>"), "{on_object}");
    assert!(on_object.contains("on the object: it points up"), "{on_object}");
    let unknown = with(|passed| if (0.3..0.31).contains(&passed) { 20.0 } else { 0.1 });
    assert!(unknown.contains("if it is the force on the hand, write `-` before it"), "{unknown}");
}

/// A socket is above the place where the peg began, so that what rests in it counts as lifted.
#[test]
fn the_sign_of_a_wrist_force_is_judged_before_an_insertion() {
    // The weight is on the hand from 2 to 6 s; then the peg is pressed in and left there.
    let pressed: fn(f64) -> f64 = |passed| match passed {
        passed if (0.25..0.6).contains(&passed) => -0.8,
        passed if passed >= 0.6 => 11.0,
        _ => 0.0,
    };
    let mut columns = columns_of_peg(pressed);
    let into_socket: fn(f64) -> f64 = |passed| match passed {
        passed if passed < 0.2 => 0.04,
        passed if passed < 0.3 => 0.04 + (passed - 0.2) * 1.5,
        passed if passed < 0.6 => 0.19,
        passed => 0.19 - (passed - 0.6).min(0.3) * 0.1,
    };
    for (name, value) in &mut columns {
        if name.ends_with("_z") {
            *value = into_socket;
        }
    }
    let found = binding(&columns);
    assert_eq!(channel(&found, "right.wrist.force"), Some("\"-f<xyz>\""), "{found}");
}

/// A tool without a gripper that is pressed onto something twice.
#[test]
fn the_sign_of_a_force_without_a_load_is_judged_at_a_contact() {
    let height: fn(f64) -> f64 = |passed| 0.05 + 0.1 * (passed * 12.6).cos().max(-0.5);
    let with = |force: fn(f64) -> f64| {
        binding(&[
            ("tool_x", still),
            ("tool_y", still),
            ("tool_z", height),
            ("fx", |_| 0.0),
            ("fy", |_| 0.0),
            ("fz", force),
        ])
    };
    let on_hand = with(|passed| if (passed * 12.6).cos() < -0.5 { 6.0 } else { 0.0 });
    assert_eq!(channel(&on_hand, "right.palm.force"), Some("\"-f<xyz>\""), "{on_hand}");
    assert!(on_hand.contains("it points against the motion that ends in a contact. If yours"), "{on_hand}");
    let on_object = with(|passed| if (passed * 12.6).cos() < -0.5 { -6.0 } else { 0.0 });
    assert_eq!(channel(&on_object, "right.palm.force"), Some("f<xyz>"), "{on_object}");
    let aside = with(|passed| 0.1 * passed);
    assert!(aside.contains("write `-` before it"), "{aside}");
}

/// The wrench of a bag has the frame of the tool, its poses that of the base. The hand points down, so that the sensor has z down.
#[test]
fn a_sensor_whose_frame_is_not_that_of_the_poses_turns_with_the_hand() {
    let with = |frame: &str| {
        let line = |row: u32| {
            let passed = f64::from(row) / 200.0;
            let vector = |[x, y, z]: [f64; 3]| serde_json::json!({ "x": x, "y": y, "z": z });
            let at = [along(passed), still(passed), lift(passed)];
            // The weight of the cube pulls the hand down, along z of the sensor.
            let force = if lift(passed) > 0.1 { 5.0 } else { 0.0 };
            serde_json::json!({
                "time": passed * 10.0,
                "ft": { "header": { "frame_id": frame }, "wrench": { "force": vector([0.1, 0.0, force]) } },
                "tool": { "header": { "frame_id": "/base" }, "pose": { "position": vector(at),
                    "orientation": { "w": 0.0, "x": 1.0, "y": 0.0, "z": 0.0 } } },
                "cube": { "header": { "frame_id": "base" }, "pose": { "position": vector(at) } },
            })
        };
        let text: String = (0..200).map(|row| format!("{}\n", line(row))).collect();
        super::binding_of_file("log.jsonl", &text)
    };
    let turning = with("tool0");
    assert!(turning.contains("\nsensors:\n  right.wrist.force: {frame: right.tcp.rotation}"), "{turning}");
    assert_eq!(channel(&turning, "right.wrist.force"), Some("\"-ft.wrench.force.<xyz>\""), "{turning}");
    assert!(!turning.contains("or the sensor turns"), "{turning}");
    let fixed = with("base");
    assert!(fixed.contains("\n# sensors:\n#   right.wrist.force: {frame: right.tcp.rotation}\n"), "{fixed}");
    assert_eq!(channel(&fixed, "right.wrist.force"), Some("ft.wrench.force.<xyz>"), "{fixed}");
}
