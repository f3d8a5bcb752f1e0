//! Proposed grippers, and the signs of forces at the wrist.

use super::{Column, along, binding, channel, lift, still};

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
    assert!(on_hand.contains("else, or if the sensor turns with a hand that points down, `ft_f<xyz>`"), "{on_hand}");
    let unknown = with(|passed| 0.01 * passed);
    assert!(unknown.contains("with `-` before it if the log has the force on the hand"), "{unknown}");
}

#[test]
fn noise_of_a_gripper_at_rest_is_not_its_opening() {
    let noise: fn(f64) -> f64 = |passed| 5e-4 + 6e-5 * (passed * 700.0).sin();
    let mut columns: [Column; 5] = [
        ("arm/tool_pose.x", along),
        ("arm/tool_pose.y", along),
        ("arm/tool_pose.z", lift),
        ("finger_joint1", noise),
        ("finger_joint2", still),
    ];
    let found = binding(&columns);
    assert_eq!(channel(&found, "right.gripper.closed"), None, "{found}");
    assert_eq!(channel(&found, "right.gripper.opening"), None, "{found}");
    // The namespace of an arm does not hide its tool.
    assert!(found.contains(": arm/tool_pose.<xyz>"), "{found}");
    columns[3].1 = |passed| if lift(passed) > 0.1 { 0.02 } else { 0.04 };
    let found = binding(&columns);
    assert!(channel(&found, "right.gripper.closed").is_some(), "{found}");
}

#[test]
fn two_fingertips_are_a_gripper_where_their_distance_has_two_values() {
    let width = |passed: f64| if lift(passed) > 0.1 { 0.04 } else { 0.09 };
    let columns: [Column; 6] = [
        ("thumb_tip_x", along),
        ("thumb_tip_y", |_| 0.0),
        ("thumb_tip_z", lift),
        ("index_tip_x", along),
        ("index_tip_y", width),
        ("index_tip_z", lift),
    ];
    let found = binding(&columns);
    let between = "between: [right.thumb, right.index]";
    let opening = format!("{{{between}}}");
    assert_eq!(channel(&found, "right.gripper.opening"), Some(opening.as_str()), "{found}");
    let closed = format!("{{{between}, below: 65 mm}}");
    assert_eq!(channel(&found, "right.gripper.closed"), Some(closed.as_str()), "{found}");
    // A hand that does not open has none, and a hand of three fingers is that of a person.
    let still: Vec<Column> = columns
        .iter()
        .map(|(name, value)| if *name == "index_tip_y" { (*name, still as fn(f64) -> f64) } else { (*name, *value) })
        .collect();
    assert_eq!(channel(&binding(&still), "right.gripper.opening"), None);
    let third: [Column; 3] = [("middle_tip_x", along), ("middle_tip_y", width), ("middle_tip_z", lift)];
    assert_eq!(channel(&binding(&[&columns[..], &third].concat()), "right.gripper.opening"), None);
}

/// Flags of both fingers show what a gripper holds, and when.
#[test]
fn the_limit_of_an_opening_is_left_out_beside_flags_of_both_fingers() {
    let flag = |passed: f64| f64::from(u8::from((0.35..0.65).contains(&passed)));
    let mut columns: Vec<Column> = vec![
        ("R_f1_px", along),
        ("R_f1_py", along),
        ("R_f1_pz", lift),
        ("R_f2_px", along),
        ("R_f2_py", along),
        ("R_f2_pz", lift),
        ("R_opening", |passed| if lift(passed) > 0.1 { 0.04 } else { 0.08 }),
        ("cube_px", along),
        ("cube_py", along),
        ("cube_pz", lift),
        ("C_R_f1_cube", flag),
    ];
    assert!(channel(&binding(&columns), "right.gripper.closed").is_some());
    columns.push(("C_R_f2_cube", flag));
    let found = binding(&columns);
    assert_eq!(channel(&found, "right.gripper.closed"), None, "{found}");
    assert_eq!(channel(&found, "right.gripper.opening"), Some("R_opening [m]"), "{found}");
    assert!(found.contains("  # right.gripper.closed: R_opening [m] < 0.06 m    # left out: flags show"), "{found}");
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
    assert!(unknown.contains("with `-` before it if the log has the force on the hand"), "{unknown}");
}
