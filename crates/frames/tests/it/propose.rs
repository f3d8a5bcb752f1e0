//! Proposed bindings: what columns are taken for by their names, units and values.

mod grippers;
mod hold_points;
mod lacking;
mod levels;
mod markers;
mod names;
mod planar;
mod pushed;
mod relative;
mod rotations;
mod sockets;
mod supports;
mod transforms;
mod up;
mod wrist_forces;

use std::fs;
use teachtree_frames::inspect::inspect;
use teachtree_frames::propose::{Answers, Proposal, propose, with_places};
use teachtree_logs::read::formats;

/// Rows of a log.
const ROWS: u32 = 200;

/// A column: its name, and its value by the part of the log that has passed.
type Column<'a> = (&'a str, fn(f64) -> f64);

/// A table of 10 s.
fn table(columns: &[Column]) -> String {
    let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
    let mut text = format!("time,{}\n", names.join(","));
    for row in 0..ROWS {
        let passed = f64::from(row) / f64::from(ROWS - 1);
        let values: Vec<String> = columns.iter().map(|(_, value)| format!("{:.6}", value(passed))).collect();
        text.push_str(&format!("{:.3},{}\n", passed * 10.0, values.join(",")));
    }
    text
}

/// The binding and the scene that are proposed for a table of 10 s.
fn proposed(columns: &[Column]) -> (String, String) {
    proposed_of(&table(columns))
}

/// The same for a text.
fn proposed_of(table: &str) -> (String, String) {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.csv");
    fs::write(&log, table).unwrap();
    let log = inspect(formats::open(&log).unwrap(), None, None).unwrap();
    let proposal = propose(&log, &Answers::default());
    (proposal.binding, proposal.scene)
}

/// The scene that is proposed with the places of the bound log.
fn placed_scene(columns: &[Column]) -> String {
    placed(columns).scene
}

/// What is proposed with the places of the bound log.
fn placed(columns: &[Column]) -> Proposal {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    fs::write(&path, table(columns)).unwrap();
    let log = inspect(formats::open(&path).unwrap(), None, None).unwrap();
    with_places(propose(&log, &Answers::default()), &log, &Answers::default(), &|| formats::open(&path))
}

/// The binding that is proposed for a text.
fn binding_of(text: &str) -> String {
    binding_of_file("log.csv", text)
}

/// The binding that is proposed for a file of this name.
fn binding_of_file(name: &str, text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join(name);
    fs::write(&log, text).unwrap();
    propose(&inspect(formats::open(&log).unwrap(), None, None).unwrap(), &Answers::default()).binding
}

fn binding(columns: &[Column]) -> String {
    proposed(columns).0
}

/// The columns of a channel, without the comment.
fn channel<'a>(binding: &'a str, name: &str) -> Option<&'a str> {
    let value = binding.lines().find_map(|line| line.strip_prefix("  ")?.strip_prefix(name)?.strip_prefix(": "))?;
    // What is to be filled in is bound to nothing.
    value.split("    #").next().filter(|value| !value.contains("???"))
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
fn the_comment_of_bridge_states_the_longest_gap() {
    // Rows 50 ms apart; one position is missing, and the log ends without one.
    let height: fn(f64) -> f64 =
        |passed| if (0.499..0.504).contains(&passed) || passed > 0.9 { f64::NAN } else { lift(passed) };
    let found = binding(&[("tcp_x", along), ("tcp_y", still), ("tcp_z", height)]);
    let wanted = "bridge: 1000 ms    # gaps up to this are filled; the longest one in this log is about 101 ms";
    assert!(found.contains(wanted), "{found}");
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
fn vectors_beside_a_force_of_the_same_name_are_its_torques() {
    for torque in ["T{}_ext", "M{}_ext", "tau{}_ext"] {
        let names: Vec<String> =
            ["F{}_ext", torque].iter().flat_map(|name| ["x", "y", "z"].map(|axis| name.replace("{}", axis))).collect();
        let mut columns: Vec<Column> = vec![("tcp_x", along), ("tcp_y", along), ("tcp_z", lift)];
        columns.extend([("cube_x", along as fn(f64) -> f64), ("cube_y", along), ("cube_z", lift)]);
        columns.extend(names.iter().map(|name| (name.as_str(), along as fn(f64) -> f64)));
        let found = binding(&columns);
        let wanted = torque.replace("{}", "<xyz>");
        assert_eq!(channel(&found, "right.wrist.torque"), Some(wanted.as_str()), "{found}");
        assert!(!found.contains("ext.position"), "{found}");
    }
    // Without a force it may be a place.
    let columns: [Column; 6] =
        [("tcp_x", along), ("tcp_y", along), ("tcp_z", lift), ("m_x", along), ("m_y", along), ("m_z", lift)];
    assert_eq!(channel(&binding(&columns), "right.wrist.torque"), None);
}

#[test]
fn whole_numbers_that_are_too_far_apart_for_seconds_are_milliseconds() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let found = |step: u32| {
        let rows: String =
            (0..ROWS).map(|row| format!("{},0.1,0.2,{:.4}\n", row * step, lift(f64::from(row) / 200.0))).collect();
        fs::write(&path, format!("time,tcp_x,tcp_y,tcp_z\n{rows}")).unwrap();
        propose(&inspect(formats::open(&path).unwrap(), None, None).unwrap(), &Answers::default()).binding
    };
    for step in [1, 2, 10] {
        assert!(found(step).contains("time: time [ms]    # whole numbers"), "{}", found(step));
    }
    assert!(!found(60).contains("[ms]"), "{}", found(60));
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
    assert!(found.contains("if they are in m or cm, write `[m]` or `[cm]` after each"), "{found}");
    // A few bad samples do not count.
    let in_m: [Column; 3] =
        [("tcp_x", |passed| if passed > 0.97 { 900.0 } else { along(passed) }), ("tcp_y", along), ("tcp_z", lift)];
    let found = binding(&in_m);
    assert_eq!(channel(&found, "right.tcp.position"), Some("tcp_<xyz>"), "{found}");
    assert!(found.contains("if they are in cm or mm, write `[cm]` or `[mm]` after each"), "{found}");
}

#[test]
fn positions_in_cm_are_known_by_name_and_by_their_range() {
    let at = |far: f64, scale: f64| -> String {
        let value = |passed: f64, part: usize| scale * (far + [along(passed), along(passed), lift(passed)][part]);
        let mut text = String::from("time,tcp_x,tcp_y,tcp_z\n");
        for row in 0..ROWS {
            let passed = f64::from(row) / f64::from(ROWS - 1);
            let [x, y, z] = [0, 1, 2].map(|part| value(passed, part));
            text.push_str(&format!("{:.3},{x:.6},{y:.6},{z:.6}\n", passed * 10.0));
        }
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("log.csv");
        fs::write(&log, text).unwrap();
        let log = inspect(formats::open(&log).unwrap(), None, None).unwrap();
        propose(&log, &Answers::default()).binding
    };
    // Beside the origin and 0.9 m away from it.
    for far in [0.0, 0.5] {
        for (scale, wanted) in [(1.0, "tcp_<xyz>"), (100.0, "tcp_<xyz> [cm]"), (1e3, "tcp_<xyz> [mm]")] {
            let found = at(far, scale);
            assert_eq!(channel(&found, "right.tcp.position"), Some(wanted), "{far} m, {scale}: {found}");
        }
    }
    for (names, wanted) in [
        (["tcp_x_cm", "tcp_y_cm", "tcp_z_cm"], "tcp_<xyz>_cm [cm]"),
        (["tcp_cm_x", "tcp_cm_y", "tcp_cm_z"], "tcp_cm_<xyz> [cm]"),
        (["tcp_mm.x", "tcp_mm.y", "tcp_mm.z"], "tcp_mm.<xyz> [mm]"),
    ] {
        let found = binding(&[(names[0], along), (names[1], along), (names[2], lift)]);
        assert_eq!(channel(&found, "right.tcp.position"), Some(wanted), "{found}");
    }
    let cube = binding(&[("cube_cm_x", along), ("cube_cm_y", along), ("cube_cm_z", lift)]);
    assert_eq!(channel(&cube, "cube.position"), Some("cube_cm_<xyz> [cm]"), "{cube}");
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
fn flags_of_pads_are_contacts_of_fingers() {
    let held = |passed: f64| f64::from(u8::from((0.25..0.75).contains(&passed)));
    let columns: [Column; 11] = [
        ("pad_a_x", along),
        ("pad_a_y", |_| 0.03),
        ("pad_a_z", lift),
        ("pad_b_x", along),
        ("pad_b_y", |_| -0.03),
        ("pad_b_z", lift),
        ("touch_a", held),
        ("fsr_b", |passed| if (0.25..0.75).contains(&passed) { 812.0 + passed } else { 14.0 + passed }),
        ("box_x", along),
        ("box_y", |_| 0.0),
        ("box_z", lift),
    ];
    let (found, scene) = proposed(&columns);
    for (name, of) in [
        ("right.thumb.position", "pad_a_<xyz>"),
        ("right.index.position", "pad_b_<xyz>"),
        ("right.thumb.contact", "touch_a"),
        ("right.index.contact", "fsr_b > 414"),
    ] {
        assert_eq!(channel(&found, name), Some(of), "{found}");
    }
    // The pads are 60 mm apart on it, and nothing measures what carries it.
    assert!(scene.contains("box: {role: object, parts: [{box: [60 mm, 60 mm, 60 mm]}]}"), "{scene}");
    assert!(scene.contains("table: {role: support, position:"), "{scene}");
    // Flags of fingers that have no place are not bound.
    assert_eq!(channel(&binding(&columns[6..]), "right.thumb.contact"), None);
}

/// A peg that is carried from 2 s on and lowered from 6 to 8 s, to the middle of its way until 7 s.
fn lowered(passed: f64) -> f64 {
    match passed {
        passed if passed < 0.2 => 0.04,
        passed if passed < 0.3 => 0.04 + (passed - 0.2) * 0.8,
        passed if passed < 0.6 => 0.12,
        passed if passed < 0.8 => 0.12 - (passed - 0.6) * 0.4,
        _ => 0.04,
    }
}

fn carried(passed: f64) -> f64 {
    0.1 + 0.2 * ((passed - 0.3) / 0.2).clamp(0.0, 1.0)
}

fn width(passed: f64) -> f64 {
    if (0.15..0.9).contains(&passed) { 0.03 } else { 0.08 }
}

/// The force of an insertion: it begins in the middle of the way down.
fn rubs(passed: f64) -> f64 {
    if (0.7..0.8).contains(&passed) { -4.0 } else { 0.0 }
}

/// The force of a peg that is put down: it begins at the end of the way.
fn lands(passed: f64) -> f64 {
    if (0.8..0.85).contains(&passed) { -4.0 } else { 0.0 }
}

fn columns_of_peg(force: fn(f64) -> f64) -> Vec<Column<'static>> {
    vec![
        ("tcp_x", carried),
        ("tcp_y", still),
        ("tcp_z", lowered),
        ("gripper_width", width),
        ("fx", |_| 0.0),
        ("fy", |_| 0.0),
        ("fz", force),
        ("peg_x", carried),
        ("peg_y", still),
        ("peg_z", lowered),
    ]
}

#[test]
fn what_goes_on_straight_from_a_contact_enters_a_socket() {
    let scene = placed_scene(&columns_of_peg(rubs));
    let rim = scene.lines().find_map(|line| line.trim().strip_prefix("position: [300 mm, 100 mm, ")).unwrap_or(&scene);
    let height: f64 = rim.trim_end_matches(" mm]").parse().unwrap_or_else(|_| panic!("{scene}"));
    assert!((height - 80.0).abs() < 6.0, "{scene}");
    assert!(scene.contains("hole: {rim: [0 mm, 0 mm, 0 mm], axis: [0, 0, 1], radius: 15 mm, depth: 45 mm}"), "{scene}");
    // What is put down stops where it meets the table.
    let put_down = placed_scene(&columns_of_peg(lands));
    assert!(!put_down.contains("socket"), "{put_down}");
}

#[test]
fn a_body_that_stands_still_is_the_socket_of_what_enters_it() {
    let mut columns = columns_of_peg(rubs);
    // It is turned by a quarter about z.
    columns.extend([
        ("fixture_x", (|_| 0.31) as fn(f64) -> f64),
        ("fixture_y", still),
        ("fixture_z", |_| 0.06),
        ("fixture_qw", |_| 0.5_f64.sqrt()),
        ("fixture_qx", |_| 0.0),
        ("fixture_qy", |_| 0.0),
        ("fixture_qz", |_| 0.5_f64.sqrt()),
    ]);
    let scene = placed_scene(&columns);
    let line = scene.lines().find(|line| line.starts_with("  fixture: ")).unwrap_or(&scene);
    assert!(line.contains("{role: socket, sockets: {hole: {rim: [0 mm, 10 mm, "), "{line}");
    assert!(line.contains("axis: [0, 0, 1]"), "{line}");
    // A tracker that is off by 0.5° about x does not tilt the hole.
    let tilted: Vec<Column> = columns
        .iter()
        .map(|(name, value)| match *name {
            "fixture_qw" | "fixture_qz" => (*name, (|_| 0.5_f64.sqrt()) as fn(f64) -> f64),
            "fixture_qx" | "fixture_qy" => (*name, (|_| 0.003_1) as fn(f64) -> f64),
            _ => (*name, *value),
        })
        .collect();
    let scene = placed_scene(&tilted);
    let line = scene.lines().find(|line| line.starts_with("  fixture: ")).unwrap_or(&scene);
    assert!(line.contains("axis: [0, 0, 1]"), "{line}");
    // Without a force the name of the body shows it.
    let mut named: Vec<Column> = columns.iter().filter(|(name, _)| !name.starts_with('f')).copied().collect();
    named.extend([("socket_x", carried_end as fn(f64) -> f64), ("socket_y", still), ("socket_z", |_| 0.07)]);
    let scene = placed_scene(&named);
    assert!(
        scene.contains("socket: {role: socket, sockets: {hole: {rim: [0 mm, 0 mm, 0 mm], axis: [0, 0, 1]"),
        "{scene}"
    );
}

fn carried_end(_: f64) -> f64 {
    0.3
}

#[test]
fn a_gripper_that_also_shut_on_nothing_is_open_at_its_largest_width() {
    let mut columns = columns_of_peg(rubs);
    // Shut before the grasp, then open, then 46 mm of 80 mm while it carries.
    columns[3].1 = |passed| match passed {
        passed if passed < 0.1 => 0.001,
        passed if (0.15..0.9).contains(&passed) => 0.046,
        _ => 0.08,
    };
    let of_width = binding(&columns);
    assert_eq!(channel(&of_width, "right.gripper.closed"), Some("gripper_width [m] < 0.063 m"), "{of_width}");
    // A body at rest whose tracker is noisy has no vote.
    columns[3] = ("gripper_position", |passed| if width(passed) < 0.05 { 90.0 } else { 2.0 });
    columns.push(("cone_x", |passed| 0.5 + 5e-4 * (passed * 700.0).sin()));
    columns.extend([("cone_y", still as fn(f64) -> f64), ("cone_z", still)]);
    let of_counts = binding(&columns);
    assert_eq!(channel(&of_counts, "right.gripper.closed"), Some("gripper_position > 46"), "{of_counts}");
}

#[test]
fn names_of_robotiq_of_two_fingers_and_of_rotations_are_known() {
    let counts: fn(f64) -> f64 = |passed| if lift(passed) > 0.1 { 95.0 } else { 3.0 };
    let hand = [("tcp_x", along as fn(f64) -> f64), ("tcp_y", along), ("tcp_z", lift)];
    let fingers = [("FingerL_x", along as fn(f64) -> f64), ("FingerL_y", along), ("FingerL_z", lift)];
    // The register `gPO` is the measured position.
    for name in ["robotiq_pos", "2F85_position", "hande_pos", "gPO"] {
        let columns: Vec<Column> = hand.into_iter().chain([(name, counts)]).chain(fingers).collect();
        let found = binding(&columns);
        let closed = format!("{name} > 49");
        assert_eq!(channel(&found, "right.gripper.closed"), Some(closed.as_str()), "{found}");
        assert!(channel(&found, "right.thumb.position").is_some(), "{found}");
    }
}

#[test]
fn an_even_column_is_the_time_of_a_log_without_stamps() {
    let folder = tempfile::tempdir().unwrap();
    let proposed = |text: &str| {
        let log = folder.path().join("log.csv");
        fs::write(&log, text).unwrap();
        propose(&inspect(formats::open(&log).unwrap(), None, None).unwrap(), &Answers::default()).binding
    };
    let with_names =
        |from: &str, to: &str| table(&[("tcp_x", swings), ("tcp_y", still), ("tcp_z", lift)]).replacen(from, to, 1);
    for name in ["ts", "uptime"] {
        let binding = proposed(&with_names("time", name));
        assert!(binding.lines().any(|line| line.starts_with(&format!("time: {name}"))), "{binding}");
    }
    // Row numbers are not stamps.
    let numbered: String = table(&[("tcp_x", swings), ("tcp_y", still), ("tcp_z", lift)])
        .lines()
        .enumerate()
        .map(|(row, line)| {
            let first = if row == 0 { "frame".to_string() } else { row.to_string() };
            format!("{first},{}\n", line.split_once(',').unwrap().1)
        })
        .collect();
    let binding = proposed(&numbered);
    assert!(binding.contains("rate: 100 Hz"), "{binding}");
}

fn swings(passed: f64) -> f64 {
    0.4 + 0.1 * (passed * 9.0).sin()
}
