//! Scripted insertions by a gripper with a wrist force sensor: a plug is picked up from a table and inserted into a socket, or jams on its rim.
//! The log has the tool point, the opening, the force on the held object, and the position of the plug, at 100 Hz.

use crate::live_log::Rows;
use crate::program::{all_said, said, teachtree_in};
use Outcome::{Inserted, Jammed, Placed};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;
use teachtree::{Calibration, Live, Rules};
use teachtree_frames::{OpenRequest, open};

/// The outcome of an insertion.
#[derive(Clone, Copy, PartialEq)]
pub enum Outcome {
    Inserted,
    Jammed,
    /// The plug is set down on the rim without force.
    Placed,
}

/// Errors of a force sensor: its sign, its bias (N) and the amplitude of its noise (N).
#[derive(Clone, Copy)]
pub struct Sensor {
    sign: f64,
    bias: f64,
    noise: f64,
}

/// A sensor without errors except noise.
pub const GOOD: Sensor = Sensor { sign: 1.0, bias: 0.0, noise: 0.05 };

/// The binding and the scene. The plug has a clearance of 1.5 mm in its hole, so it touches no wall.
pub const BINDING: &str = "
hand_file: hand_gripper_wrist.rules
time: time
channels:
  right.thumb.position: tcp_<xyz>
  right.palm.force: f<xyz>
  right.gripper.opening: opening
  right.gripper.closed: opening < 45 mm
  plug.position: plug_<xyz>
scene:
  bodies:
    plug: {role: object, mass: 95 g, plug: [0 mm, 0 mm, -30 mm], parts: [{box: [25 mm, 25 mm, 60 mm]}]}
    table: {role: support, position: [100 mm, 0 mm, -10 mm], parts: [{box: [1 m, 1 m, 20 mm]}]}
    socket:
      role: socket
      position: [200 mm, 0 mm, 20 mm]
      sockets: {hole: {rim: [0 mm, 0 mm, 20 mm], axis: [0, 0, 1], radius: 5 mm, depth: 40 mm}}
      parts:
        - {box: [20 mm, 68 mm, 40 mm], at: [24 mm, 0 mm, 0 mm]}
        - {box: [20 mm, 68 mm, 40 mm], at: [-24 mm, 0 mm, 0 mm]}
        - {box: [28 mm, 20 mm, 40 mm], at: [0 mm, 24 mm, 0 mm]}
        - {box: [28 mm, 20 mm, 40 mm], at: [0 mm, -24 mm, 0 mm]}
  hands: {right: {fingers: [thumb, palm]}}
";

/// A phase of an attempt: its duration, the tool point and the opening at its end (mm), and the upward force on the plug (N).
struct Phase(f64, [f64; 3], f64, f64);

/// The weight of the plug, N.
const WEIGHT: f64 = 0.93;

fn phases(outcome: Outcome, pace: f64) -> Vec<Phase> {
    let (open, shut) = (70.0, 25.0);
    let beside = if outcome == Inserted { 0.0 } else { 7.0 };
    let over = 200.0 + beside;
    let mut phases = vec![
        Phase(1.0, [-100.0, -150.0, 250.0], open, 0.0),
        Phase(1.2 * pace, [0.0, 0.0, 200.0], open, 0.0),
        Phase(1.2 * pace, [0.0, 0.0, 40.0], open, 0.0),
        Phase(0.5, [0.0, 0.0, 40.0], shut, 0.0),
        Phase(0.3, [0.0, 0.0, 40.0], shut, 0.0),
        Phase(1.2 * pace, [0.0, 0.0, 190.0], shut, WEIGHT),
        Phase(1.6 * pace, [over, 0.0, 190.0], shut, WEIGHT),
        Phase(1.0 * pace, [over, 0.0, 81.0], shut, WEIGHT),
    ];
    let end = match outcome {
        Inserted => {
            phases.push(Phase(1.75 * pace, [over, 0.0, 46.0], shut, WEIGHT - 7.7));
            46.0
        }
        Jammed | Placed => {
            phases.push(Phase(2.0 * pace, [over, 0.0, 80.0], shut, if outcome == Jammed { -20.0 } else { 0.0 }));
            80.0
        }
    };
    phases.extend([
        Phase(0.4, [over, 0.0, end], shut, 0.0),
        Phase(0.5, [over, 0.0, end], open, 0.0),
        Phase(1.2 * pace, [over, 0.0, end + 170.0], open, 0.0),
        Phase(1.2 * pace, [-100.0, -150.0, 250.0], open, 0.0),
        Phase(1.0, [-100.0, -150.0, 250.0], open, 0.0),
    ]);
    phases
}

/// Returns the log of an attempt with this sensor.
pub fn log(outcome: Outcome, seed: u32, sensor: Sensor) -> String {
    let mut text = String::from(
        "time [s],tcp_x [mm],tcp_y [mm],tcp_z [mm],opening [mm],fx [N],fy [N],fz [N],plug_x [mm],plug_y [mm],plug_z [mm]\n",
    );
    let mut state = u64::from(seed) + 1;
    // Uniform between -1 and 1.
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / f64::from(1_u32 << 23) - 1.0
    };
    let pace = 1.0 + 0.04 * f64::from(seed % 5);
    let (mut tcp, mut opening, mut plug) = ([-100.0, -150.0, 250.0], 70.0, [0.0, 0.0, 30.0]);
    let mut row = 0_u32;
    for Phase(seconds, to, opens, force) in phases(outcome, pace) {
        let (from, from_opening) = (tcp, opening);
        let rows = (seconds * 100.0).round() as u32;
        for at in 1..=rows {
            let part = f64::from(at) / f64::from(rows);
            let eased = part * part * (3.0 - 2.0 * part);
            let before = tcp;
            tcp = [0, 1, 2].map(|axis| from[axis] + (to[axis] - from[axis]) * eased);
            opening = from_opening + (opens - from_opening) * part;
            if opening < 25.5 {
                plug = [0, 1, 2].map(|axis| plug[axis] + tcp[axis] - before[axis]);
            }
            let [fx, fy] = [sensor.noise * noise(), sensor.noise * noise()];
            let fz = sensor.sign * force + sensor.bias + sensor.noise * noise();
            let [x, y, z] = tcp;
            let [px, py, pz] = plug.map(|value| value + 0.05 * noise());
            let _ = writeln!(
                text,
                "{:.2},{x:.3},{y:.3},{z:.3},{opening:.3},{fx:.4},{fy:.4},{fz:.4},{px:.3},{py:.3},{pz:.3}",
                f64::from(row) / 100.0
            );
            row += 1;
        }
    }
    text
}

/// Returns a folder with the binding and recordings with these outcomes, `set/00.csv`, …
fn set(outcomes: &[Outcome]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("set")).unwrap();
    std::fs::write(folder.path().join("b.yaml"), BINDING).unwrap();
    for (outcome, seed) in outcomes.iter().zip(0_u32..) {
        std::fs::write(folder.path().join(format!("set/{seed:02}.csv")), log(*outcome, seed, GOOD)).unwrap();
    }
    folder
}

fn run(folder: &Path, args: &[&str]) -> String {
    let output = teachtree_in(folder, args);
    assert!(output.status.success(), "{args:?}: {}", all_said(&output));
    said(&output)
}

fn parsed(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

/// Returns the force issues in the analysis of a log with this binding.
fn of_forces(log: &str, binding: &str) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("log.csv"), log).unwrap();
    std::fs::write(folder.path().join("b.yaml"), binding).unwrap();
    let analysis = parsed(&run(folder.path(), &["analyze", "log.csv", "--binding", "b.yaml", "--format", "json"]));
    let issues = analysis["issues"].as_array().unwrap().iter();
    let of_kind = issues.filter(|issue| issue["kind"] == "implausible_force");
    of_kind.map(|issue| issue["message"].as_str().unwrap().to_string()).collect()
}

/// A hand that pushes a plug into a socket with clearance, or onto its rim, does not carry it in the air.
#[test]
fn insertions_do_not_count_as_carries() {
    let walls = BINDING.lines().filter(|line| !line.contains("24 mm")).map(|line| format!("{line}\n"));
    let without_walls = walls.collect::<String>().replace("      parts:\n", "");
    for binding in [BINDING, &without_walls] {
        for outcome in [Inserted, Jammed] {
            assert_eq!(of_forces(&log(outcome, 1, GOOD), binding), [""; 0]);
        }
        let turned = of_forces(&log(Inserted, 1, Sensor { sign: -1.0, ..GOOD }), binding);
        assert!(turned.len() == 1 && turned[0].contains(": turn the sign, the force is"), "{turned:?}");
    }
}

/// The bias of a sensor is visible while the hand is empty.
#[test]
fn an_untared_sensor_is_tared_before_its_sign_is_turned() {
    let noisy = Sensor { noise: 0.5, ..GOOD };
    assert_eq!(of_forces(&log(Placed, 1, noisy), BINDING), [""; 0]);
    let turned = of_forces(&log(Placed, 1, Sensor { sign: -1.0, ..noisy }), BINDING);
    assert!(turned.len() == 1 && turned[0].contains(": turn the sign, the force is"), "{turned:?}");
    let untared = of_forces(&log(Placed, 1, Sensor { bias: -1.5, ..noisy }), BINDING);
    assert!(
        untared.len() == 1 && untared[0].contains(" N downwards while the hand holds nothing: `tare`"),
        "{untared:?}"
    );
}

/// Returns the recordings that lack a usual task, and the number of good recordings.
fn lacking(folder: &Path) -> (Vec<String>, i64) {
    let args = ["audit", "set", "--each", "--binding", "b.yaml", "--rules", "contact.rules", "--format", "json"];
    let document = parsed(&run(folder, &args));
    let lacks = |it: &&Value| it["findings"].as_array().unwrap().iter().any(|it| it["kind"] == "lacks_task");
    let lacking = document["recordings"].as_array().unwrap().iter().filter(lacks);
    (lacking.map(|it| it["log"].as_str().unwrap().to_string()).collect(), document["good"].as_i64().unwrap())
}

#[test]
fn an_audit_reports_any_number_of_jammed_insertions() {
    let three = [Inserted, Jammed, Inserted, Inserted, Jammed, Inserted, Inserted, Jammed, Inserted, Inserted];
    let folder = set(&three);
    assert_eq!(lacking(folder.path()), (["set/01.csv", "set/04.csv", "set/07.csv"].map(String::from).to_vec(), 7));
    let text = run(folder.path(), &["audit", "set", "--each", "--binding", "b.yaml", "--rules", "contact.rules"]);
    // Lines wrap at the width of the terminal.
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("tasks: peg_in_hole in 7 of 10, pick_and_place in 3 of 10"), "{text}");
    assert!(text.contains("lacks peg_in_hole, which 7 of 10 recordings have; has pick_and_place instead"), "{text}");
    assert!(text.contains("7 of 10 recordings are good, 3 lacking a task"), "{text}");
    let status = |fail_on| {
        let rules = ["--rules", "contact.rules", "--fail-on", fail_on];
        let args = [&["audit", "set", "--each", "--binding", "b.yaml"][..], &rules].concat();
        teachtree_in(folder.path(), &args).status.code()
    };
    assert_eq!((status("lacks_task"), status("unlike")), (Some(1), Some(0)));
    // By the default rules, they are failures.
    let found = parsed(&run(folder.path(), &["audit", "set", "--each", "--binding", "b.yaml", "--format", "json"]));
    assert_eq!(found["failures"], serde_json::json!({ "failed_insertion": 3 }));
    // Small sets are reported too. If two tasks are equally frequent, neither is the usual one.
    assert_eq!(lacking(set(&[Inserted, Jammed, Inserted]).path()), (vec!["set/01.csv".into()], 2));
    assert_eq!(lacking(set(&[Inserted, Jammed, Inserted, Jammed]).path()), (vec![], 4));
}

/// Returns the binding with a hand model, with or without the position of the plug.
fn bound(hand_file: &str, has_pose: bool) -> String {
    let binding = BINDING.replace("hand_gripper_wrist.rules", hand_file);
    if has_pose { binding } else { binding.replace("  plug.position: plug_<xyz>\n", "") }
}

/// Returns the first time (s) at which the tool point is within 50 mm of the plug's bounding sphere.
fn comes_near(log: &str) -> f64 {
    let radius = (12.5_f64.powi(2) * 2.0 + 30.0_f64.powi(2)).sqrt();
    let near = |line: &&str| {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let distance: f64 = (0..3).map(|axis| (cells[1 + axis] - cells[8 + axis]).powi(2)).sum();
        distance.sqrt() - radius < 50.0
    };
    log.lines().skip(1).find(near).unwrap().split(',').next().unwrap().parse().unwrap()
}

#[test]
fn an_approach_begins_near_the_target_where_distances_are_known() {
    let log = log(Inserted, 2, GOOD);
    for hand_file in ["hand_gripper.rules", "hand_gripper_wrist.rules"] {
        let found = |has_pose: bool| {
            let folder = tempfile::tempdir().unwrap();
            std::fs::write(folder.path().join("log.csv"), &log).unwrap();
            std::fs::write(folder.path().join("b.yaml"), bound(hand_file, has_pose)).unwrap();
            let args = ["analyze", "log.csv", "--binding", "b.yaml", "--format", "json"];
            let track = parsed(&run(folder.path(), &args))["tracks"][0].clone();
            let segments = track["relabeled"].as_array().unwrap();
            let start = |primitive: &str| {
                let of = segments.iter().find(|it| it["primitive"] == primitive);
                of.map(|it| it["start_s"].as_f64().unwrap())
            };
            (start("Move"), start("Approach"), start("Grasp").unwrap(), track["tasks"][0].clone())
        };
        let (moves, approaches, _, task) = found(true);
        let whole = task["task"] == "peg_in_hole" && task.get("open").is_none();
        assert!(moves == Some(0.0) && whole, "{moves:?} {task}");
        assert!((approaches.unwrap() - comes_near(&log)).abs() <= 0.02, "{approaches:?}");
        let (_, approaches, grasps, _) = found(false);
        assert!((grasps - approaches.unwrap() - 4.0_f64.min(grasps)).abs() <= 0.02, "{approaches:?} {grasps}");
    }
}

#[test]
fn a_live_log_with_distances_does_not_wait_for_a_contact() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("log.csv"), log(Inserted, 2, GOOD)).unwrap();
    for hand_file in ["hand_gripper.rules", "hand_gripper_wrist.rules"] {
        let lag = |has_pose: bool| {
            std::fs::write(path("b.yaml"), bound(hand_file, has_pose)).unwrap();
            let request = OpenRequest { log: path("log.csv"), binding: Some(path("b.yaml")), ..OpenRequest::default() };
            let rows = Rows::of(&open(&request).unwrap().recording);
            let rules = Rules::options().file("contact.rules").hand_file(hand_file).load().unwrap();
            let calibration = Calibration::of_whole(&rows.log(), &rules).unwrap();
            let mut live = Live::new(&rules, &rows.titles, &rows.scene, &calibration).unwrap();
            let mut late: f64 = 0.0;
            let mut names = vec![];
            for row in &rows.rows {
                for event in live.push(row).unwrap() {
                    if let Some(segment) = event.segment().filter(|_| !event.is_final()) {
                        late = late.max(row[0] - segment.end_s());
                    }
                    names.extend(event.label().and_then(|(_, name, _)| Some(name?.to_string())));
                }
            }
            (live.lag_s().unwrap(), late, names)
        };
        let (lag_s, late_s, names) = lag(true);
        assert!(lag_s < 0.8 && late_s < 1.0, "{lag_s} {late_s}");
        let at = |name: &str| names.iter().position(|it| it == name);
        assert!(at("Approach").is_some() && at("Approach") < at("Grasp"), "{names:?}");
        assert!(lag(false).0 > 4.0);
    }
}

/// The opening alone shows when the gripper is closed.
#[test]
fn an_opening_without_a_flag_makes_the_same_tasks() {
    for outcome in [Inserted, Jammed, Placed] {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("log.csv"), log(outcome, 1, GOOD)).unwrap();
        let without = of_the_field().replace("  right.gripper.closed: opening < 45 mm\n", "");
        std::fs::write(folder.path().join("flag.yaml"), of_the_field()).unwrap();
        std::fs::write(folder.path().join("opening.yaml"), without).unwrap();
        let analyzed = |binding: &str| {
            parsed(&run(folder.path(), &["analyze", "log.csv", "--binding", binding, "--format", "json"]))
        };
        let (flag, opening) = (analyzed("flag.yaml"), analyzed("opening.yaml"));
        let tasks = |analysis: &Value| {
            let tasks = analysis["tracks"][0]["tasks"].as_array().unwrap();
            tasks.iter().map(|task| task["task"].as_str().unwrap().to_string()).collect::<Vec<_>>()
        };
        assert!(!tasks(&flag).is_empty());
        assert_eq!(tasks(&flag), tasks(&opening));
        assert_eq!(opening["rules"]["hand_model"], flag["rules"]["hand_model"]);
        let issues = opening["issues"].as_array().unwrap();
        assert!(issues.iter().any(|issue| issue["kind"] == "learned_closing"), "{issues:?}");
        // A live log learns the limit from its beginning, or from a recording in which the gripper opens and closes.
        let live = |more: &[&str]| {
            let args = ["live", "log.csv", "--binding", "opening.yaml", "--no-labels"];
            all_said(&teachtree_in(folder.path(), &[&args, more].concat()))
        };
        for calibration in [&["--calibration", "log.csv"][..], &["--calibrate", "8"]] {
            let text = live(calibration);
            assert!(tasks(&flag).iter().all(|task| text.contains(&format!("task    right {task}"))), "{text}");
        }
        let text = live(&["--calibrate", "0.5"]);
        assert!(text.contains("help: bind it by a limit of the opening"), "{text}");
    }
}

/// The same binding with the field's names, and without hands and hand model.
fn of_the_field() -> String {
    let kept = BINDING.lines().filter(|line| !line.starts_with("hand_file") && !line.contains("hands:"));
    let binding: String = kept.map(|line| format!("{line}\n")).collect();
    binding.replace("right.thumb.position", "right.tcp.position").replace("right.palm.force", "right.wrist.force")
}

#[test]
fn names_of_the_field_need_neither_hands_nor_a_hand_file() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("log.csv"), log(Inserted, 1, GOOD)).unwrap();
    std::fs::write(folder.path().join("own.yaml"), BINDING).unwrap();
    std::fs::write(folder.path().join("field.yaml"), of_the_field()).unwrap();
    let analyzed =
        |binding: &str| parsed(&run(folder.path(), &["analyze", "log.csv", "--binding", binding, "--format", "json"]));
    let (own, field) = (analyzed("own.yaml"), analyzed("field.yaml"));
    assert_eq!(own["tracks"], field["tracks"]);
    assert_eq!(own["outcome"], field["outcome"]);
    let issues = |analysis: &Value| analysis["issues"].to_string();
    let renamed = issues(&own)
        .replace("right.thumb.position", "right.tcp.position")
        .replace("right.palm.force", "right.wrist.force")
        .replace("right.palm.rotation", "right.tcp.rotation");
    assert_eq!(renamed, issues(&field));
    assert!(!issues(&field).contains("missing_channel right.palm.position"), "{field}");
    let model = "hand_gripper_wrist.rules, since the log has right.gripper.opening and right.wrist.force";
    assert_eq!(field["rules"]["hand_model"], model);
    assert_eq!(own["rules"]["hand_model"], "hand_gripper_wrist.rules, as `hand_file` in the binding says");
    // On a terminal the line may be wrapped.
    let text = run(folder.path(), &["analyze", "log.csv", "--binding", "field.yaml"]);
    let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains(&format!("hand model {model};")), "{text}");
    let inspected = run(folder.path(), &["inspect", "log.csv", "--binding", "field.yaml"]);
    assert!(inspected.contains(&format!("  hand model: {model}\n")), "{inspected}");
    let with_hand = ["inspect", "log.csv", "--binding", "field.yaml", "--hand", "hand_gripper.rules"];
    let inspected = run(folder.path(), &with_hand);
    assert!(inspected.contains("  hand model: hand_gripper.rules, as it is named with the rules\n"), "{inspected}");
}

/// A log of a tool point, an opening and the pose of an object is enough to command a gripper.
#[test]
fn pads_that_follow_from_the_opening_can_be_commanded() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("log.csv"), log(Placed, 1, GOOD)).unwrap();
    let turned =
        "  right.tcp.rotation: ['= 0 rad', '= 0 rad', '= 0 rad']\n  plug.rotation: ['= 0 rad', '= 0 rad', '= 0 rad']\n";
    let without = of_the_field().replace("channels:\n", &format!("channels:\n{turned}"));
    std::fs::write(folder.path().join("without.yaml"), &without).unwrap();
    let pads = format!("pads: {{of: tcp, opening: gripper, axis: y}}\n{without}");
    std::fs::write(folder.path().join("pads.yaml"), pads).unwrap();
    let retarget = |binding: &str| {
        let args = ["retarget", "log.csv", "--binding", binding, "--robot", "parallel_jaw", "-o", "c.json"];
        teachtree_in(folder.path(), &args)
    };
    let output = retarget("pads.yaml");
    assert!(output.status.success(), "{}", all_said(&output));
    let commands = parsed(&std::fs::read_to_string(folder.path().join("c.json")).unwrap());
    let contacts = commands["tasks"][0]["grasps"][0]["contacts"].as_array().unwrap();
    // The plug is 25 mm wide.
    for (contact, (finger, side)) in contacts.iter().zip([("thumb", 1.0), ("index", -1.0)]) {
        let [x, y, z] = [0, 1, 2].map(|axis| contact["point"][axis].as_f64().unwrap());
        assert!(contact["finger"] == finger && (y - side * 0.0125).abs() < 1e-4, "{contact}");
        assert!(x.abs() < 0.002 && z.abs() < 0.015, "{contact}");
    }
    assert_eq!(contacts.len(), 2);
    // The tool point alone is one side.
    assert_eq!(retarget("without.yaml").status.code(), Some(1));
}
