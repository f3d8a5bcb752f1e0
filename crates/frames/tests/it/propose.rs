//! Proposed bindings: what columns are taken for by their names, units and values.

use std::fs;
use teachtree_frames::inspect::inspect;
use teachtree_frames::propose::{Answers, propose};
use teachtree_logs::read::formats;

/// Rows of a log.
const ROWS: u32 = 200;

/// A column: its name, and its value by the part of the log that has passed.
type Column<'a> = (&'a str, fn(f64) -> f64);

/// The binding and the scene that are proposed for a table of 10 s.
fn proposed(columns: &[Column]) -> (String, String) {
    let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
    let mut text = format!("time,{}\n", names.join(","));
    for row in 0..ROWS {
        let passed = f64::from(row) / f64::from(ROWS - 1);
        let values: Vec<String> = columns.iter().map(|(_, value)| format!("{:.6}", value(passed))).collect();
        text.push_str(&format!("{:.3},{}\n", passed * 10.0, values.join(",")));
    }
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.csv");
    fs::write(&log, text).unwrap();
    let log = inspect(formats::open(&log).unwrap(), None, None).unwrap();
    let proposal = propose(&log, &Answers::default());
    (proposal.binding, proposal.scene)
}

fn binding(columns: &[Column]) -> String {
    proposed(columns).0
}

/// The columns of a channel, without the comment.
fn channel<'a>(binding: &'a str, name: &str) -> Option<&'a str> {
    let value = binding.lines().find_map(|line| line.strip_prefix("  ")?.strip_prefix(name)?.strip_prefix(": "))?;
    value.split("    #").next()
}

/// Up in the middle of the log.
fn lift(passed: f64) -> f64 {
    if (0.3..0.7).contains(&passed) { 0.2 } else { 0.02 }
}

fn along(passed: f64) -> f64 {
    0.4 + 0.2 * passed
}

fn still(_: f64) -> f64 {
    0.1
}

#[test]
fn torques_are_not_positions() {
    let columns: [Column; 12] = [
        ("tcp_x", along),
        ("tcp_y", along),
        ("tcp_z", lift),
        ("cube_x", along),
        ("cube_y", along),
        ("cube_z", lift),
        ("ft_fx", along),
        ("ft_fy", along),
        ("ft_fz", along),
        ("ft_mx", along),
        ("ft_my", along),
        ("ft_mz", lift),
    ];
    let binding = binding(&columns);
    assert_eq!(channel(&binding, "right.wrist.force"), Some("ft_f<xyz>"), "{binding}");
    assert_eq!(channel(&binding, "right.wrist.torque"), Some("ft_m<xyz>"), "{binding}");
    assert!(!binding.contains("ft.position"), "{binding}");
}

#[test]
fn commands_are_not_measurements() {
    for command in ["desired_ee_pose", "target_pose", "goal_tcp", "cmd_pos", "desired_wrench_force"] {
        let names = ["x", "y", "z"].map(|axis| format!("{command}_{axis}"));
        let mut columns: Vec<Column> = vec![("tool_x", along), ("tool_y", along), ("tool_z", lift)];
        columns.extend(names.iter().map(|name| (name.as_str(), along as fn(f64) -> f64)));
        let found = binding(&columns);
        assert_eq!(channel(&found, "right.tcp.position"), Some("tool_<xyz>"), "{found}");
        let used = found.lines().filter(|line| !line.trim_start().starts_with('#') && line.contains(command));
        assert_eq!(used.count(), 0, "{found}");
        assert!(found.contains(&format!("#   {command}_<xyz>")), "{found}");
    }
    // A target without a quantity is an object.
    let columns: [Column; 3] = [("target_x", along), ("target_y", along), ("target_z", lift)];
    assert_eq!(channel(&binding(&columns), "target.position"), Some("target_<xyz>"));
}

#[test]
fn the_current_pose_is_not_an_electrical_current() {
    let pose: [Column; 3] = [("current_pose_x", along), ("current_pose_y", along), ("current_pose_z", lift)];
    assert_eq!(channel(&binding(&pose), "right.tcp.position"), Some("current_pose_<xyz>"));
    let motors: [Column; 3] = [("current_0", along), ("current_1", along), ("current_2", lift)];
    assert_eq!(channel(&binding(&motors), "right.tcp.position"), None);
}

#[test]
fn one_unit_for_all_positions_of_a_log() {
    // The cube stays near the origin, the tool does not.
    let in_mm: [Column; 6] = [
        ("tcp_x", |passed| 1e3 * along(passed)),
        ("tcp_y", |passed| 1e3 * along(passed)),
        ("tcp_z", |passed| 1e3 * lift(passed)),
        ("cube_x", |passed| 9.0 + passed),
        ("cube_y", still),
        ("cube_z", still),
    ];
    let found = binding(&in_mm);
    assert_eq!(channel(&found, "right.tcp.position"), Some("tcp_<xyz> [mm]"), "{found}");
    assert_eq!(channel(&found, "cube.position"), Some("cube_<xyz> [mm]"), "{found}");
    assert!(found.contains("if they are in m, write `[m]` behind each"), "{found}");
    // A few bad samples do not count.
    let in_m: [Column; 3] =
        [("tcp_x", |passed| if passed > 0.97 { 900.0 } else { along(passed) }), ("tcp_y", along), ("tcp_z", lift)];
    let found = binding(&in_m);
    assert_eq!(channel(&found, "right.tcp.position"), Some("tcp_<xyz>"), "{found}");
    assert!(found.contains("if they are in mm, write `[mm]` behind each"), "{found}");
}

#[test]
fn numbered_bodies_are_several() {
    let columns: [Column; 9] = [
        ("tcp_x", along),
        ("tcp_y", along),
        ("tcp_z", lift),
        ("cube_1_x", along),
        ("cube_1_y", along),
        ("cube_1_z", lift),
        ("cube_2_x", still),
        ("cube_2_y", still),
        ("cube_2_z", still),
    ];
    let (found, scene) = proposed(&columns);
    for name in ["cube_1", "cube_2"] {
        assert_eq!(channel(&found, &format!("{name}.position")), Some(format!("{name}_<xyz>").as_str()), "{found}");
        assert!(scene.contains(&format!("  {name}: ")), "{scene}");
    }
    // One of them needs no number.
    assert_eq!(channel(&binding(&columns[..6]), "cube.position"), Some("cube_1_<xyz>"));
    // Numbers without a name are not a tool.
    let unnamed: [Column; 3] = [("pos_1_x", along), ("pos_1_y", along), ("pos_1_z", lift)];
    assert_eq!(channel(&binding(&unnamed), "right.tcp.position"), None);
}

#[test]
fn a_log_with_y_up_is_turned_or_left_out() {
    let columns: [Column; 15] = [
        ("tcp_x", along),
        ("tcp_y", lift),
        ("tcp_z", along),
        ("tcp_rx", |passed| 0.3 * passed),
        ("tcp_ry", |passed| 0.2 * passed),
        ("tcp_rz", |passed| 0.1 * passed),
        ("cube_x", along),
        ("cube_y", lift),
        ("cube_z", along),
        ("ft_fx", still),
        // The weight of the cube on the hand, on a sensor with an offset.
        ("ft_fy", |passed| if lift(passed) > 0.1 { 2.0 } else { 5.0 }),
        ("ft_fz", still),
        ("ft_mx", still),
        ("ft_my", still),
        ("ft_mz", along),
    ];
    let found = binding(&columns);
    assert_eq!(channel(&found, "cube.position"), Some(r#"["cube_x", "-cube_z", "cube_y"]"#), "{found}");
    assert_eq!(channel(&found, "right.wrist.force"), Some(r#"["-ft_fx", "ft_fz", "-ft_fy"]"#), "{found}");
    assert!(found.contains("turned, since y points up in the log; else `cube_<xyz>`"), "{found}");
    assert_eq!(channel(&found, "right.tcp.rotation"), None);
    assert!(found.contains("# left out: tcp_r<rotvec=x y z>: y points up"), "{found}");
    // What is pushed to and fro along y is not lifted.
    let pushed: [Column; 6] =
        [("tcp_x", still), ("tcp_y", lift), ("tcp_z", still), ("cube_x", still), ("cube_y", lift), ("cube_z", still)];
    assert_eq!(channel(&binding(&pushed), "cube.position"), Some("cube_<xyz>"));
}

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
