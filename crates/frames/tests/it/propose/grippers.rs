//! Proposed grippers.

use super::{Column, along, binding, carried, channel, columns_of_peg, lift, placed, proposed, still, width};

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

/// A gripper that holds an object from 0.3 to 0.7 of the log is empty where it begins narrower, and where it ends so again.
#[test]
fn a_gripper_that_rests_narrower_than_it_holds_is_empty_there() {
    type Width = fn(f64) -> f64;
    let cases: [(Width, bool); 5] = [
        (|passed| if passed < 0.1 { 0.01 } else { held_width(passed) }, true),
        (|passed| if (0.1..0.9).contains(&passed) { held_width(passed) } else { 0.01 }, true),
        (held_width, false),
        // It may hold something thinner there.
        (|passed| if passed < 0.9 { held_width(passed) } else { 0.01 }, false),
        (|passed| if (0.1..0.16).contains(&passed) || passed < 0.05 { 0.01 } else { held_width(passed) }, false),
    ];
    for (width, is_written) in cases {
        let columns: [Column; 7] = [
            ("tcp_x", carried),
            ("tcp_y", still),
            ("tcp_z", lift),
            ("gripper_width", width),
            ("cube_x", carried),
            ("cube_y", still),
            ("cube_z", lift),
        ];
        let found = placed(&columns).binding;
        let shut = found.lines().find_map(|line| line.strip_prefix("params: {shut: ")?.split(' ').next());
        assert_eq!(shut.is_some(), is_written, "{found}");
        let is_between = |shut: &str| shut.parse::<f64>().is_ok_and(|shut_mm| (14.0..26.0).contains(&shut_mm));
        assert!(shut.is_none_or(is_between), "{found}");
    }
}

/// The left gripper brings a stick to the right one, which takes it at the other end, 90 mm away.
#[test]
fn the_distance_of_two_grippers_at_a_hand_over_is_a_param_of_the_project() {
    const GRIPPED: f64 = 0.02;
    const OPEN: f64 = 0.08;
    let of = |left: fn(f64) -> f64, apart: fn(f64) -> f64| {
        let columns: [Column; 8] = [
            ("left_tcp_x", along),
            ("left_tcp_y", still),
            ("left_tcp_z", lift),
            ("left_gripper_width", left),
            ("right_tcp_x", apart),
            ("right_tcp_y", still),
            ("right_tcp_z", lift),
            ("right_gripper_width", |passed| if (0.5..0.9).contains(&passed) { GRIPPED } else { OPEN }),
        ];
        let found = placed(&columns);
        found.params.values
    };
    let passed: fn(f64) -> f64 = |passed| if (0.2..0.6).contains(&passed) { GRIPPED } else { OPEN };
    let apart: fn(f64) -> f64 = |passed| along(passed) + 0.09 + (0.45 - passed).max(0.0) + (passed - 0.65).max(0.0);
    let wanted = [("meet_near", "110 mm"), ("meet_far", "130 mm")].map(|(name, value)| (name.into(), value.into()));
    assert_eq!(of(passed, apart), wanted);
    // A nearer hand-over shows that nothing is handed over at the farther meeting.
    let twice: fn(f64) -> f64 =
        |passed| if (0.2..0.6).contains(&passed) || (0.8..0.95).contains(&passed) { GRIPPED } else { OPEN };
    assert_eq!(of(twice, |passed| along(passed) + if passed < 0.7 { 0.02 } else { 0.09 }), []);
    // A hand-over without a position of one hand has no distance.
    let lost: fn(f64) -> f64 = |passed| if (0.75..0.95).contains(&passed) { f64::NAN } else { along(passed) + 0.09 };
    assert_eq!(of(twice, lost), wanted);
    // The default is enough, the distance changes, or both hold on: no hand-over, or no param.
    assert_eq!(of(passed, |passed| along(passed) + 0.02 + (0.45 - passed).max(0.0)), []);
    assert_eq!(of(passed, |passed| along(passed) + 0.09 + (0.6 - passed).max(0.0)), []);
    assert_eq!(of(|passed| if (0.2..0.95).contains(&passed) { GRIPPED } else { OPEN }, apart), []);
}

/// The tool comes down from 200 mm between 0.2 and 0.3 of the log, and grasps at 0.35. The log is 10 s long, and the last 60 mm take 0.3 s.
#[test]
fn the_way_to_a_grasp_shows_how_long_the_gripper_approaches() {
    let with = |height: fn(f64) -> f64| {
        let columns: [Column; 4] = [
            ("tcp_x", still),
            ("tcp_y", still),
            ("tcp_z", height),
            ("gripper_width", |passed| if (0.35..0.8).contains(&passed) { 0.03 } else { 0.08 }),
        ];
        placed(&columns).binding
    };
    let time = |binding: &str| {
        let line = binding.lines().find_map(|line| line.strip_prefix("params: {approach_time: "))?;
        line.split(' ').next()?.parse::<f64>().ok()
    };
    let found =
        with(|passed| 0.2 * ((0.3 - passed) / 0.1).clamp(0.0, 1.0) + 0.1 * ((passed - 0.4) / 0.1).clamp(0.0, 1.0));
    assert!(time(&found).is_some_and(|time_s| (0.7..1.0).contains(&time_s)), "{found}");
    // A gripper that stays where it closes carries nothing.
    let found = with(|passed| 0.2 * ((0.3 - passed) / 0.1).clamp(0.0, 1.0));
    assert_eq!(time(&found), None, "{found}");
}

/// The tool rests at the place of the opening until 0.85 of a log of 10 s, which begins at 0.8, and leaves it by 200 mm in 1 s.
#[test]
fn the_way_from_a_release_shows_how_long_the_gripper_is_near() {
    let with = |height: fn(f64) -> f64| {
        let columns: [Column; 4] = [
            ("tcp_x", still),
            ("tcp_y", still),
            ("tcp_z", height),
            ("gripper_width", |passed| if (0.35..0.8).contains(&passed) { 0.03 } else { 0.08 }),
        ];
        let found = placed(&columns).binding;
        let line = found.lines().find(|line| line.starts_with("params: ")).unwrap_or(&found).to_string();
        line.split_once("retreat_time: ").and_then(|(_, time)| time.split(' ').next()?.parse::<f64>().ok())
    };
    let leaves: fn(f64) -> f64 = |passed| carried_height(passed) + 0.2 * ((passed - 0.85) / 0.1).clamp(0.0, 1.0);
    assert!(with(leaves).is_some_and(|time_s| (0.7..0.9).contains(&time_s)), "{:?}", with(leaves));
    assert_eq!(with(carried_height), None);
}

/// From 200 mm down to the grasp, and 100 mm up.
fn carried_height(passed: f64) -> f64 {
    0.2 * ((0.3 - passed) / 0.1).clamp(0.0, 1.0) + 0.1 * ((passed - 0.4) / 0.1).clamp(0.0, 1.0)
}

/// The joints of an SO-101 with its gripper; without one of them, no model gives the opening.
#[test]
fn the_opening_of_a_gripper_with_a_model_is_not_guessed() {
    let joint: fn(f64) -> f64 = |passed| 40.0 * (6.0 * passed).sin();
    let gripper: fn(f64) -> f64 = |passed| if lift(passed) > 0.1 { 27.4 } else { 90.0 };
    let of = |names: &[&str]| {
        let names: Vec<String> = names.iter().map(|name| format!("observation.state.{name}.pos")).collect();
        let mut columns: Vec<Column> = names.iter().map(|name| (name.as_str(), joint)).collect();
        columns.push(("observation.state.gripper.pos", gripper));
        binding(&columns)
    };
    let joints = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll"];
    let found = of(&joints);
    assert!(found.contains("model: so101"), "{found}");
    assert_eq!(channel(&found, "right.gripper.opening"), None, "{found}");
    assert!(channel(&found, "right.gripper.closed").is_some(), "{found}");
    let found = of(&joints[1..]);
    assert!(!found.contains("model: so101"), "{found}");
    assert!(channel(&found, "right.gripper.opening").is_some(), "{found}");
}

/// A gripper at 96 of 255 on an object of 50 mm, which a percentage may be too.
#[test]
fn whole_gripper_positions_beside_columns_of_ur_are_counts() {
    let of = |beside: &str, gripper: fn(f64) -> f64| {
        let names: Vec<String> = (0..3).map(|axis| format!("{beside}_{axis}")).collect();
        let ways: [fn(f64) -> f64; 3] = [along, still, lift];
        let mut columns: Vec<Column> = names.iter().map(String::as_str).zip(ways).collect();
        columns.push(("gripper_position", gripper));
        let found = binding(&columns);
        channel(&found, "right.gripper.opening").unwrap_or(&found).to_string()
    };
    let whole: fn(f64) -> f64 = |passed| if lift(passed) > 0.1 { 96.0 } else { 3.0 };
    assert_eq!(of("actual_TCP_pose", whole), "gripper_position * -0.3333 + 85 [mm]");
    assert_ne!(of("tcp_pose", whole), "gripper_position * -0.3333 + 85 [mm]");
    let part: fn(f64) -> f64 = |passed| if lift(passed) > 0.1 { 95.5 } else { 3.0 };
    assert_ne!(of("actual_TCP_pose", part), "gripper_position * -0.3333 + 85 [mm]");
}

/// 30 mm while the object is carried, else 80 mm.
fn held_width(passed: f64) -> f64 {
    if lift(passed) > 0.1 { 0.03 } else { 0.08 }
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

/// A gripper misses, opens, and holds something wider than half of its stroke.
#[test]
fn a_gripper_is_closed_where_it_holds_after_a_miss() {
    // 1 is open, 0 is shut.
    fn share(passed: f64) -> f64 {
        match passed {
            passed if (0.03..0.1).contains(&passed) => 0.01,
            passed if (0.15..0.9).contains(&passed) => 0.64,
            _ => 1.0,
        }
    }
    let with = |name: &'static str, value: fn(f64) -> f64| {
        let mut columns = columns_of_peg(|_| 0.0);
        columns[3] = (name, value);
        binding(&columns)
    };
    let finger = with("finger_joint1", |passed| 0.04 * share(passed));
    let closed = "right.gripper.closed";
    assert_eq!(channel(&finger, closed), Some("finger_joint1 [m] < 0.0328 m"), "{finger}");
    assert!(finger.contains("closed about 0.0256, open about 0.04: an object moves with it there"), "{finger}");
    assert_eq!(channel(&finger, "right.gripper.opening"), Some("finger_joint1 * 2 [m]"), "{finger}");
    // Counts of a Robotiq rise as it closes.
    let counts = with("robotiq_pos", |passed| (250.0 - 247.0 * share(passed)).round());
    assert!(channel(&counts, closed).is_some_and(|it| it.starts_with("robotiq_pos > ")), "{counts}");
    // A width is closed at its lower values, also where the gripper opens on what it holds.
    let width = with("gripper_width", |passed| if passed < 0.15 { 0.01 } else { 0.04 * share(passed) });
    assert_eq!(channel(&width, closed), Some("gripper_width [m] < 0.0328 m"), "{width}");
}

/// A gripper that is closed all the time is listed, so that the reader knows that it was seen.
#[test]
fn a_gripper_that_does_not_move_is_listed() {
    let mut columns = columns_of_peg(|_| 0.0);
    columns[3] = ("robotiq_85_left_knuckle_joint", |_| 0.7929);
    columns.push(("elbow_joint", still));
    let found = binding(&columns);
    assert!(found.contains("#   robotiq_85_left_knuckle_joint    (a gripper that does not move)"), "{found}");
    assert!(!found.contains("elbow_joint"), "{found}");
    // An encoder scatters, and toggles between two counts.
    for scatters in [
        |passed: f64| 0.7929 + 0.0008 * (3e3 * passed).sin(),
        |passed: f64| if (1e3 * passed).sin() > 0.8 { 0.796 } else { 0.7929 },
    ] {
        columns[3].1 = scatters;
        let found = binding(&columns);
        assert!(found.contains("#   robotiq_85_left_knuckle_joint    (a gripper that does not move)"), "{found}");
    }
}

/// An object that the other hand moves past a tool at rest shows nothing of the gripper at rest.
#[test]
fn what_moves_past_a_tool_at_rest_is_not_held_there() {
    fn noise(passed: f64) -> f64 {
        2e-4 * (900.0 * passed).sin()
    }
    let mut columns = columns_of_peg(|_| 0.0);
    // The tool leaves the peg in the middle of its way, and its position scatters.
    columns[0].1 = |passed| super::carried(passed.min(0.35)) + noise(passed);
    columns[2].1 = |passed| super::lowered(passed.min(0.35)) + noise(passed);
    columns[3].1 = |passed| if (0.15..0.35).contains(&passed) { 0.03 } else { 0.08 };
    let found = binding(&columns);
    assert_eq!(channel(&found, "right.gripper.closed"), Some("gripper_width [m] < 0.055 m"), "{found}");
    assert!(found.contains("an object moves with it there"), "{found}");
}

#[test]
fn counts_of_robotiq_and_outputs_close_at_their_upper_end() {
    let with = |name: &'static str, value: fn(f64) -> f64| {
        let columns: [Column; 4] = [("tcp_x", along), ("tcp_y", along), ("tcp_z", lift), (name, value)];
        binding(&columns)
    };
    let of_robotiq = with("gripper_position", |passed| if lift(passed) > 0.1 { 228.0 } else { 3.0 });
    assert_eq!(channel(&of_robotiq, "right.gripper.closed"), Some("gripper_position > 116"), "{of_robotiq}");
    let output = with("actual_digital_output_bits", |passed| if lift(passed) > 0.1 { 65536.0 } else { 0.0 });
    assert_eq!(channel(&output, "right.gripper.closed"), Some("actual_digital_output_bits > 32800"), "{output}");
    let several = with("actual_digital_output_bits", |passed| (passed * 5.0).floor());
    assert_eq!(channel(&several, "right.gripper.closed"), None, "{several}");
}

#[test]
fn a_weight_that_is_carried_is_a_hold() {
    let with = |height: fn(f64) -> f64, force: fn(f64) -> f64| {
        let columns: [Column; 7] = [
            ("actual_TCP_pose_0", along),
            ("actual_TCP_pose_1", along),
            ("actual_TCP_pose_2", height),
            ("fx", still),
            ("fy", still),
            ("fz", force),
            ("target_q_0", along),
        ];
        binding(&columns)
    };
    let tool: fn(f64) -> f64 = |passed| 0.1 + 0.1 * (passed * 12.0).sin();
    let carries: fn(f64) -> f64 = |passed| if lift(passed) > 0.1 { -3.0 } else { 0.02 * (passed * 90.0).sin() };
    let carried = with(tool, carries);
    assert_eq!(channel(&carried, "right.gripper.closed"), Some("fz < -1.5"), "{carried}");
    assert!(channel(&carried, "right.tcp.position").is_some(), "{carried}");
    // What is pressed stays where the surface is: the tool is fixed.
    let pressed = with(|passed| if lift(passed) > 0.1 { 0.1 } else { 0.2 }, carries);
    assert_eq!(channel(&pressed, "right.gripper.closed"), None, "{pressed}");
    assert!(channel(&pressed, "tool.position").is_some(), "{pressed}");
}

#[test]
fn a_flange_is_bound_as_the_palm_behind_the_point_where_the_gripper_holds() {
    let up: fn(f64) -> f64 =
        |passed| 0.02 + 0.1 * (((passed - 0.3) / 0.1).clamp(0.0, 1.0) - ((passed - 0.7) / 0.1).clamp(0.0, 1.0));
    let binding_of = |name: &str| {
        let names: Vec<String> = ["x", "y", "z", "qw", "qx", "qy", "qz"].map(|part| format!("{name}_{part}")).into();
        let pose: [fn(f64) -> f64; 7] = [
            carried,
            |_| 0.1,
            |passed| 0.17 + 0.1 * (((passed - 0.3) / 0.1).clamp(0.0, 1.0) - ((passed - 0.7) / 0.1).clamp(0.0, 1.0)),
            |_| 0.0,
            |_| 1.0,
            |_| 0.0,
            |_| 0.0,
        ];
        let mut columns: Vec<Column> = names.iter().map(String::as_str).zip(pose).collect();
        columns.extend([
            ("gripper_width", width as fn(f64) -> f64),
            ("cube_x", carried),
            ("cube_y", |_| 0.1),
            ("cube_z", up),
        ]);
        placed(&columns).binding
    };
    // Links of arms have numbers, and no word for a tool.
    let links = ["panda_link8", "wrist_3_link", "lbr_link_7", "robot_link7", "link6", "tool0", "ee_link"];
    // The topic of a controller in which no tool point is set.
    for name in [&["flange", "iiwa_flange", "tcp_pose_broadcaster_pose"][..], &links].concat() {
        let found = binding_of(name);
        let position = format!("{name}_<xyz>");
        assert_eq!(channel(&found, "right.palm.position"), Some(position.as_str()), "{found}");
        assert_eq!(channel(&found, "right.palm.rotation"), Some(format!("{name}_q<wxyz>").as_str()), "{found}");
        let point = Some("{at: [0 mm, 0 mm, 150 mm], of: right.palm}");
        assert_eq!(channel(&found, "right.tcp.position"), point, "{found}");
        assert!(found.contains("bind them as `right.tcp.position` and `right.tcp.rotation` instead"), "{found}");
    }
    // What is 150 mm from a tool point may be a long object.
    for name in ["tcp", "flange_tcp", "link6_tcp", "panda_link8_ee", "tool0_tcp", "ee_link_tcp"] {
        let found = binding_of(name);
        assert_eq!(channel(&found, "right.tcp.position"), Some(format!("{name}_<xyz>").as_str()), "{found}");
    }
}

#[test]
fn poses_that_are_repeated_between_frames_of_a_camera_show_the_hold() {
    // Every fourth row has a new pose.
    const SEEN: fn(f64) -> f64 = |passed| carried((passed * 199.0 / 4.0).floor() * 4.0 / 199.0);
    let columns: [Column; 7] = [
        ("tcp_x", carried),
        ("tcp_y", still),
        ("tcp_z", still),
        ("gripper", |passed| if (0.15..0.9).contains(&passed) { 0.9 } else { 0.1 }),
        ("cube_x", SEEN),
        ("cube_y", still),
        ("cube_z", still),
    ];
    let found = binding(&columns);
    let line = found.lines().find(|line| line.contains("  right.gripper.closed: gripper > ")).unwrap_or(&found);
    assert!(line.contains("an object moves with it there"), "{line}");
}

/// The tool comes down, rises with the object, comes down again and rises.
fn two_dips(passed: f64) -> f64 {
    let dip = |at: f64| (1.0 - ((passed - at) / 0.15).abs()).max(0.0);
    0.3 - 0.25 * (dip(0.3) + dip(0.7))
}

#[test]
fn a_gripper_closes_where_the_tool_is_low_for_the_first_time() {
    const BETWEEN: fn(f64) -> f64 = |passed| if (0.3..0.7).contains(&passed) { 0.52 } else { 0.01 };
    let of = |gripper: fn(f64) -> f64, height: fn(f64) -> f64| {
        let columns: [Column; 4] =
            [("tcp_x", along), ("tcp_y", still), ("tcp_z", height), ("gripper_position", gripper)];
        let found = placed(&columns).binding;
        channel(&found, "right.gripper.closed").unwrap_or_default().to_string()
    };
    assert_eq!(of(BETWEEN, two_dips), "gripper_position > 0.265");
    assert_eq!(of(|passed| 0.53 - BETWEEN(passed), two_dips), "gripper_position < 0.265");
    // A share of a usual stroke, from the open end.
    let columns: [Column; 4] = [("tcp_x", along), ("tcp_y", still), ("tcp_z", two_dips), ("gripper_position", BETWEEN)];
    let found = placed(&columns).binding;
    assert_eq!(channel(&found, "right.gripper.opening"), Some("gripper_position * -80 + 80 [mm]"), "{found}");
    // Nothing shows where it closes: it is low only once, or changes once.
    assert_eq!(of(BETWEEN, |passed| two_dips(passed.min(0.5))), "gripper_position < 0.265");
    assert_eq!(of(|passed| if passed < 0.3 { 0.01 } else { 0.52 }, two_dips), "gripper_position < 0.265");
}
