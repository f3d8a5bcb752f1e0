//! Proposed grippers, and the signs of forces at the wrist.

use super::{Column, along, binding, channel, columns_of_peg, lift, proposed, still, width};

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

#[test]
fn a_percentage_is_an_opening_by_a_stroke() {
    let with = |name: &'static str, value: fn(f64) -> f64| {
        let mut columns = columns_of_peg(|_| 0.0);
        columns[3] = (name, value);
        proposed(&columns)
    };
    let opening = "right.gripper.opening";
    let (found, scene) = with("gripper_pct", |passed| 1e3 * width(passed));
    assert_eq!(channel(&found, opening), Some("gripper_pct * 0.8 [mm]"), "{found}");
    assert!(
        found.contains("percent of the stroke, which is not in the log: 80 mm is a usual one; for 100 mm, another one, `gripper_pct * 1 [mm]`"),
        "{found}"
    );
    assert!(scene.contains("peg: {role: object, parts: [{box: [24 mm, 24 mm, 24 mm]}]}"), "{scene}");
    let (share, _) = with("gripper", |passed| 12.5 * width(passed));
    assert_eq!(channel(&share, opening), Some("gripper * 80 [mm]"), "{share}");
    // A Robotiq counts up as it closes.
    let (counts, _) = with("robotiq_pos", |passed| if width(passed) < 0.05 { 180.0 } else { 3.0 });
    assert_eq!(channel(&counts, opening), Some("robotiq_pos * -0.3333 + 85 [mm]"), "{counts}");
    // Shut on what it holds, it shows no opening; then the flag begins near the end of the closing.
    let (shut, _) = with("gripper_pct", |passed| if width(passed) < 0.05 { 1.0 } else { 100.0 });
    assert_eq!(channel(&shut, opening), None, "{shut}");
    assert_eq!(channel(&shut, "right.gripper.closed"), Some("gripper_pct < 10.9"), "{shut}");
}

/// A relaxed hand is as narrow as one that holds something.
#[test]
fn fingertips_reach_as_far_as_they_hold() {
    let mut columns: Vec<Column> = vec![
        ("thumb_tip_x", super::carried),
        ("thumb_tip_y", |_| 0.1),
        ("thumb_tip_z", super::lowered),
        ("index_tip_x", super::carried),
        ("index_tip_y", |_| 0.1),
        ("index_tip_z", super::lowered),
        ("peg_x", super::carried),
        ("peg_y", |_| 0.12),
        ("peg_z", super::lowered),
    ];
    columns[4].1 = |passed| 0.1 + if passed < 0.1 { 0.03 } else { width(passed) + 0.01 };
    let found = binding(&columns);
    assert!(
        found.contains("\nparams: {grip_reach: 50 mm}    # fingers farther from an object hold nothing"),
        "{found}"
    );
    // An object that is held off its middle needs a wider reach; without an object, no reach is set.
    columns[7].1 = |_| 0.22;
    let found = binding(&columns);
    assert!(found.contains("\nparams: {grip_reach: 110 mm}"), "{found}");
    // So it is at 500 Hz, at which the object moves by less than a millimeter in each step.
    let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
    let mut text = format!("time,{}\n", names.join(","));
    for row in 0..5000 {
        let passed = f64::from(row) / 4999.0;
        let values: Vec<String> = columns.iter().map(|(_, value)| format!("{:.6}", value(passed))).collect();
        text.push_str(&format!("{:.3},{}\n", passed * 10.0, values.join(",")));
    }
    let found = super::proposed_of(&text).0;
    assert!(found.contains("\nparams: {grip_reach: 110 mm}"), "{found}");
    assert!(!binding(&columns[..6]).contains("grip_reach"));
}
