//! The failures that the default rules find: in recordings of operators that fail on purpose, and none in successes.

use crate::program::{all_said, demonstrate, program, said, teachtree_in};
use serde_json::Value;
use std::path::Path;

fn run(folder: &Path, args: &[&str]) -> String {
    let output = teachtree_in(folder, args);
    assert!(output.status.success(), "{}", all_said(&output));
    said(&output)
}

fn analyzed(folder: &Path, log: &str, options: &[&str]) -> Value {
    serde_json::from_str(&run(folder, &[&["analyze", log, "--format", "json"], options].concat())).unwrap()
}

/// The primitives of all hands after relabeling that are failures.
fn failures(found: &Value) -> Vec<&str> {
    let segments = found["tracks"].as_array().unwrap().iter().flat_map(|track| track["relabeled"].as_array().unwrap());
    let names = segments.map(|segment| segment["primitive"].as_str().unwrap());
    names.filter(|name| ["Jam", "Slip", "Drop", "Topple", "Miss", "Collision", "Bump"].contains(name)).collect()
}

/// The tasks of a hand, with their attempts and whether they are failures.
fn tasks<'a>(found: &'a Value, track: &str) -> Vec<(&'a str, u64, bool)> {
    let track = found["tracks"].as_array().unwrap().iter().find(|it| it["track"] == track).unwrap();
    let task = |task: &'a Value| {
        (task["task"].as_str().unwrap(), task["attempt"].as_u64().unwrap(), task["failure"] == Value::Bool(true))
    };
    track["tasks"].as_array().unwrap().iter().map(task).collect()
}

/// Scene, operator, seed, the failure, and the tasks with their attempts and whether they are failures.
type Case = (&'static str, &'static str, &'static str, &'static str, &'static [(&'static str, u64, bool)]);

/// Each operator fails in one way; some try again. A slip that is caught and a jam before the insertion do not spoil the attempt.
#[test]
fn operators_that_fail_show_their_failure() {
    let folder = tempfile::tempdir().unwrap();
    let cases: [Case; 9] = [
        ("peg_in_hole", "peg_in_hole_jam", "1", "Jam", &[("failed_insertion", 1, true)]),
        ("pick_and_place", "pick_and_place_slip", "2", "Slip", &[("pick_and_place", 1, false)]),
        // It slips onto the table, and the fingers lose it for a moment.
        ("pick_and_place", "pick_and_place_slip", "355", "Slip", &[("pick_and_place", 1, false)]),
        ("pick_and_place", "pick_and_place_drop", "1", "Drop", &[("dropped", 1, true), ("pick_and_place", 2, false)]),
        ("pick_and_place", "pick_and_place_miss", "1", "Miss", &[("missed_grasp", 1, true)]),
        (
            "pick_and_place",
            "pick_and_place_miss",
            "4",
            "Miss",
            &[("missed_grasp", 1, true), ("pick_and_place", 2, false)],
        ),
        ("pick_over_wall", "pick_over_wall_collision", "3", "Collision", &[("collided", 1, true)]),
        ("pick_over_wall", "pick_over_wall_collision", "1", "Bump", &[("collided", 1, true)]),
        ("hold_and_insert", "hold_and_insert_jam", "1", "Jam", &[("failed_insertion", 1, true)]),
    ];
    for (scene, operator, seed, primitive, expected) in cases {
        run(folder.path(), &["teach", scene, operator, "--seed", seed, "-o", "log.csv"]);
        if primitive == "Bump" {
            // The hands of the scene have no palm: without them, the force at the wrist is read.
            let scene = std::fs::read_to_string(folder.path().join("log.scene.yaml")).unwrap();
            let bodies = scene.split("\nhands:").next().unwrap();
            std::fs::write(folder.path().join("log.scene.yaml"), bodies).unwrap();
        }
        // The fingertips of this hand are light.
        let light = if primitive == "Bump" { &["--set", "bump_force=1N"][..] } else { &[] };
        let found = analyzed(folder.path(), "log.csv", light);
        assert!(failures(&found).contains(&primitive), "{operator} {seed}: {:?}", failures(&found));
        assert_eq!(tasks(&found, "right"), expected, "{operator} {seed}");
        let mended = expected.last().is_some_and(|(.., failure)| !failure);
        assert_eq!(found["outcome"]["result"], if mended { "success" } else { "failure" }, "{operator} {seed}");
    }
}

/// Keeps the poses of bodies and the positions of fingertips.
fn keep_poses(log: &Path) {
    let text = std::fs::read_to_string(log).unwrap();
    let is_pose = |title: &str| {
        let name = title.split(' ').next().unwrap_or_default();
        let is_position = name.contains(".position.") && !name.contains(".palm.");
        name == "time" || is_position || name.contains(".rotation.") && !name.starts_with("contact.")
    };
    let kept: Vec<bool> = text.lines().next().unwrap().split(',').map(is_pose).collect();
    let line = |line: &str| {
        let cells = line.split(',').zip(&kept).filter(|(_, kept)| **kept).map(|(cell, _)| cell);
        cells.collect::<Vec<&str>>().join(",") + "\n"
    };
    std::fs::write(log, text.lines().map(line).collect::<String>()).unwrap();
}

/// Without contacts, forces and openings: a hand that closes on nothing, or leaves its object, a carried object that hits a wall, and one that falls
/// in a hand-over.
#[test]
fn poses_alone_show_failures() {
    let folder = tempfile::tempdir().unwrap();
    for (scene, operator, seed, primitive) in [
        ("pick_and_place", "pick_and_place_miss", "154", "Miss"),
        ("pick_and_place", "pick_and_place_miss", "161", "Miss"),
        ("pick_over_wall", "pick_over_wall_collision", "162", "Collision"),
        // It slides down the wall by a few millimeters.
        ("pick_over_wall", "pick_over_wall_collision", "358", "Collision"),
        ("hand_over_left_to_right", "hand_over_drop", "152", "Drop"),
    ] {
        run(folder.path(), &["teach", scene, operator, "--seed", seed, "-o", "log.csv"]);
        keep_poses(&folder.path().join("log.csv"));
        let found = analyzed(folder.path(), "log.csv", &["--hand", "hand_vision.rules"]);
        assert_eq!(failures(&found), [primitive], "{operator} {seed}");
    }
}

#[test]
fn successes_show_no_failure() {
    let folder = tempfile::tempdir().unwrap();
    let scenes = [
        "pick_and_place",
        "pick_and_press",
        "pick_and_follow",
        "peg_in_hole",
        "hand_over_left_to_right",
        "hold_and_insert",
    ];
    for scene in scenes {
        demonstrate(scene, &[], folder.path().join("log.csv"));
        for hand in ["hand_force.rules", "hand_flags.rules", "hand_vision.rules"] {
            let found = analyzed(folder.path(), "log.csv", &["--hand", hand]);
            assert_eq!(failures(&found), [""; 0], "{scene} {hand}");
            assert_eq!(found["outcome"]["result"], "success", "{scene} {hand}");
        }
    }
}

/// A press on a wall, a motion along it and fingers on top of a block are neither collisions nor misses.
#[test]
fn failures_leave_the_segments_of_successes_as_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let segments = |options: &[&str]| -> Vec<(String, String)> {
        let found = analyzed(folder.path(), "log.csv", options);
        let of_right = found["tracks"][0]["relabeled"].as_array().unwrap().iter();
        of_right.map(|it| (it["primitive"].to_string(), it["start_s"].to_string())).collect()
    };
    for (scene, seed) in [("pick_and_follow", "1"), ("pick_and_press", "3"), ("pick_and_press", "7"), ("no_task", "3")]
    {
        run(folder.path(), &["teach", scene, scene, "--seed", seed, "-o", "log.csv"]);
        assert_eq!(segments(&[]), segments(&["--rules", "contact.rules"]), "{scene} {seed}");
    }
}

/// An audit of drops and successes names the recordings in which the box was not picked up again.
#[test]
fn an_audit_lists_the_recordings_that_failed() {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), &["teach", "pick_and_place", "pick_and_place_drop", "--seeds", "1..6", "-o", "set"]);
    let left = |seed: u64| {
        let found = analyzed(folder.path(), &format!("set/pick_and_place_drop_{seed:04}.csv"), &[]);
        tasks(&found, "right").last().is_some_and(|(task, ..)| *task == "dropped")
    };
    let expected = (1..=6).filter(|seed| left(*seed)).count();
    assert!((1..6).contains(&expected), "{expected}");
    let audit = ["audit", "set", "--format", "json"];
    let found: Value = serde_json::from_str(&run(folder.path(), &audit)).unwrap();
    assert_eq!(found["failures"], serde_json::json!({ "dropped": expected }), "{found}");
    let output = program(folder.path(), &[&audit[..], &["--fail-on", "failure"]].concat()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
}

/// Rules that are named are used as they are.
#[test]
fn rules_that_are_named_have_no_failures_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    demonstrate("pick_and_place", &[], folder.path().join("log.csv"));
    let text = run(folder.path(), &["analyze", "log.csv", "--rules", "contact.rules"]);
    assert!(!text.contains("outcome"), "{text}");
    // A file of one's own with names of the shipped one can be used beside the default rules of a recording.
    std::fs::write(
        folder.path().join("mine.rules"),
        "use \"contact.rules\"\nprimitive Drop is Release, Jam is Press\n",
    )
    .unwrap();
    run(folder.path(), &["analyze", "log.csv", "--rules", "mine.rules"]);
    std::fs::write(folder.path().join("both.rules"), "use \"contact.rules\"\nuse \"failures.rules\"\n").unwrap();
    let text = run(folder.path(), &["analyze", "log.csv", "--rules", "both.rules"]);
    assert!(text.contains("outcome success: right pick_and_place box "), "{text}");
}

#[test]
fn check_lists_the_channels_of_failures() {
    let folder = tempfile::tempdir().unwrap();
    let text = run(folder.path(), &["check"]);
    let line = |name: &str| text.lines().find(|line| line.trim_start().starts_with(name)).unwrap_or_default();
    assert!(line("failed_insertion, Jam: ").contains("target.over_socket"), "{text}");
    assert!(
        line("dropped, Drop: ").contains("gripper.opening") || line("dropped, Drop: ").contains("target.position"),
        "{text}"
    );
    assert!(line("collided, Bump: ").contains("fingers.force") || line("collided, Bump: ").contains("load"), "{text}");
    // Rules without failures list none.
    assert!(!run(folder.path(), &["check", "contact.rules"]).contains("failures are detected"));
}

/// A log without forces shows neither jams nor bumps, and one without poses of objects neither slips nor collisions.
#[test]
fn inspect_lists_the_failures_that_a_log_cannot_show() {
    let folder = tempfile::tempdir().unwrap();
    let rows = (0..300).map(|row| {
        let (closed, opening) = if (100..200).contains(&row) { (1, 0.03) } else { (0, 0.08) };
        let row = f64::from(row);
        format!("{},0,0,{},{closed},{opening},\n", row * 0.01, 0.1 + row * 1e-4)
    });
    let head = "time,right.thumb.position.x,right.thumb.position.y,right.thumb.position.z,right.gripper.closed,right.gripper.opening,right.label\n";
    std::fs::write(folder.path().join("log.csv"), head.to_string() + &rows.collect::<String>()).unwrap();
    std::fs::write(folder.path().join("log.scene.yaml"), "name: cell\nbodies: {}\n").unwrap();
    let text = run(folder.path(), &["inspect", "log.csv", "--hand", "hand_gripper.rules", "--format", "json"]);
    let found: Value = serde_json::from_str(&text).unwrap();
    let track = &found["recognition"]["tracks"][0];
    let cannot = track["cannot"].to_string();
    for primitive in ["Jam", "Slip", "Collision", "Bump"] {
        assert!(cannot.contains(&format!("\"{primitive}\"")), "{primitive}: {track}");
    }
    let can = track["can"].to_string();
    assert!(can.contains("\"Miss\"") && can.contains("\"Drop\""), "{track}");
}

/// A hand rests after a kind of `Release` as well: what was before is final then.
#[test]
fn a_live_log_is_final_after_a_kind_of_release() {
    let folder = tempfile::tempdir().unwrap();
    demonstrate("several_tasks", &[], folder.path().join("log.csv"));
    let rules = "use \"contact.rules\"\nprimitive LetGo is Release\n
        extend single_hand.apart first {
          near and not from(none, Move, Approach) => LetGo
          from(LetGo) and not near                => Move
        }\n";
    std::fs::write(folder.path().join("mine.rules"), rules).unwrap();
    let text = run(folder.path(), &["live", "log.csv", "--rules", "mine.rules", "--no-labels"]);
    let lines: Vec<&str> = text.lines().collect();
    let task = lines.iter().position(|line| line.starts_with("task    right push")).unwrap();
    let last = lines.iter().rposition(|line| line.starts_with("closed  right ")).unwrap();
    assert!(text.contains("LetGo") && task < last, "{text}");
}

/// A box falls off its support 0.2 s after its release, and the hand rests for 2 s. `live` finds the tasks that `analyze` finds, before the log ends.
#[test]
fn a_box_that_topples_after_its_release_is_a_failure_in_live_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    demonstrate("pick_and_place", &[], path.clone());
    let log = analyzed(folder.path(), "log.csv", &[]);
    let mut segments = log["tracks"][0]["relabeled"].as_array().unwrap().iter();
    let release_s = segments.rfind(|it| it["primitive"] == "Release").unwrap()["start_s"].as_f64().unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    let column = |title: &str| header.split(',').position(|found| found.starts_with(title)).unwrap();
    let (z, speed) = (column("box.position.z"), column("box.velocity.z"));
    let mut rows: Vec<Vec<String>> = rows.lines().map(|row| row.split(',').map(str::to_string).collect()).collect();
    let time_s = |row: &[String]| row[0].parse::<f64>().unwrap();
    let last = rows.last().unwrap().clone();
    for after in 1..2000 {
        let mut row = last.clone();
        row[0] = format!("{:.3}", time_s(&last) + f64::from(after) / 1000.0);
        rows.push(row);
    }
    for row in &mut rows {
        let falls_s = (time_s(row) - release_s - 0.2).max(0.0);
        let fallen_m = (4.9 * falls_s.powi(2)).min(0.1);
        row[z] = format!("{:.6}", row[z].parse::<f64>().unwrap() - fallen_m);
        if falls_s > 0.0 {
            row[speed] = format!("{:.6}", if fallen_m < 0.1 { -9.8 * falls_s } else { 0.0 });
        }
    }
    let rows: String = rows.iter().map(|row| row.join(",") + "\n").collect();
    std::fs::write(&path, format!("{header}\n{rows}")).unwrap();
    let found = analyzed(folder.path(), "log.csv", &[]);
    assert_eq!(found["outcome"]["result"], "failure", "{}", found["outcome"]);
    let whole = tasks(&found, "right");
    assert_eq!(whole.iter().map(|(task, ..)| *task).collect::<Vec<_>>(), ["pick_and_place", "toppled"]);
    let text = run(folder.path(), &["live", "log.csv", "--calibration", "log.csv", "--no-labels"]);
    let lines: Vec<&str> = text.lines().collect();
    let last = lines.iter().rposition(|line| line.starts_with("closed  right Move")).unwrap();
    for task in found["tracks"][0]["tasks"].as_array().unwrap() {
        let [name, object] = ["task", "object"].map(|key| task[key].as_str().unwrap());
        let [start_s, end_s] = ["start_s", "end_s"].map(|key| task[key].as_f64().unwrap());
        let line = format!("task    right {name} {object}, {start_s:.3} – {end_s:.3} s");
        assert!(lines[..last].iter().any(|found| found.starts_with(&line)), "{line}: {text}");
    }
}
