//! When a gripper holds something: from when its jaws stop closing until they open, and only what is in its reach.

use crate::program::{all_said, said, teachtree_in};
use serde_json::Value;
use std::fmt::Write as _;

/// Takes a box from a table and puts it down elsewhere.
const BINDING: &str = "hand_file: hand_gripper.rules
channels:
  right.thumb.position: tcp_<xyz> [mm]
  right.gripper.opening: opening [mm]
  right.gripper.closed: opening [mm] < 60 mm
  box.position: box_<xyz> [mm]
scene:
  bodies:
    box: {role: object, parts: [{box: [40 mm, 40 mm, 40 mm]}]}
    table: {role: support, position: [200 mm, 0 mm, -10 mm], parts: [{box: [1 m, 1 m, 20 mm]}]}
  hands: {right: {fingers: [thumb]}}
";

/// The opening, x and height of the tool point, and height of the box, mm. The box is at x = 200 mm.
struct Row {
    opening: f64,
    x: f64,
    height: f64,
    box_height: f64,
}

/// Rises from 0 at `from` to 1 at `to`, s.
fn ramp(t: f64, from: f64, to: f64) -> f64 {
    ((t - from) / (to - from)).clamp(0.0, 1.0)
}

/// The primitives with their start, s, and the tasks that are found in a motion, sampled at 30 Hz.
fn found(duration_s: u32, at: impl Fn(f64) -> Row) -> (Vec<(String, f64)>, Vec<String>) {
    let mut log = String::from("time,opening,tcp_x,tcp_y,tcp_z,box_x,box_y,box_z\n");
    for row in 0..30 * duration_s {
        let t = f64::from(row) / 30.0;
        let Row { opening, x, height, box_height } = at(t);
        let _ = writeln!(log, "{t:.4},{opening:.3},{x:.3},0,{height:.3},200,0,{box_height:.3}");
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("log.csv"), log).unwrap();
    std::fs::write(folder.path().join("b.yaml"), BINDING).unwrap();
    let output = teachtree_in(folder.path(), &["analyze", "log.csv", "--binding", "b.yaml", "--format", "json"]);
    assert!(output.status.success(), "{}", all_said(&output));
    let analysis: Value = serde_json::from_str(&said(&output)).unwrap();
    let track = &analysis["tracks"][0];
    let text = |of: &Value, key: &str| of[key].as_str().unwrap().to_string();
    let segments = track["relabeled"].as_array().unwrap().iter();
    let tasks = track["tasks"].as_array().unwrap().iter();
    (
        segments.map(|it| (text(it, "primitive"), it["start_s"].as_f64().unwrap())).collect(),
        tasks.map(|it| text(it, "task")).collect(),
    )
}

/// The gripper starts half closed, half a meter from the box, and opens on the way.
#[test]
fn a_gripper_holds_from_when_its_jaws_stop_until_they_open_and_nothing_out_of_reach() {
    let (segments, tasks) = found(10, |t| {
        let lifted = 100.0 * (ramp(t, 3.2, 4.2) - ramp(t, 6.0, 7.0));
        Row {
            opening: 40.0 + 40.0 * (ramp(t, 0.8, 1.4) - ramp(t, 2.5, 2.8) + ramp(t, 7.5, 7.8)),
            x: -300.0 + 500.0 * ramp(t, 1.0, 2.2),
            height: 20.0 + 180.0 * (1.0 - ramp(t, 1.0, 2.2)) + lifted + 180.0 * ramp(t, 8.2, 9.2),
            box_height: 20.0 + lifted,
        }
    });
    let names: Vec<&str> = segments.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["Move", "Approach", "Grasp", "Translate", "Place", "Release", "Move"], "{segments:?}");
    // The flag is set at 2.65 s and ends at 7.65 s.
    for (name, start_s) in [("Grasp", 2.8), ("Release", 7.5)] {
        let (_, found_s) = segments.iter().find(|(found, _)| found == name).unwrap();
        assert!((found_s - start_s).abs() < 0.07, "{name} {start_s}: {segments:?}");
    }
    assert_eq!(tasks, ["pick_and_place"]);
}

/// The jaws open in the air, and the hand goes up. Then it takes the box again: the drop and the second carry are two tasks.
#[test]
fn a_drop_ends_its_task() {
    let (segments, tasks) = found(12, |t| {
        let again = 100.0 * (ramp(t, 8.0, 8.5) - ramp(t, 9.0, 9.5));
        let falls_mm = 4905.0 * (t - 4.05).max(0.0).powi(2);
        Row {
            opening: 80.0 + 40.0 * (ramp(t, 4.0, 4.2) + ramp(t, 10.0, 10.2) - ramp(t, 1.5, 1.8) - ramp(t, 7.0, 7.3)),
            x: 200.0,
            height: 200.0 - 180.0 * ramp(t, 0.3, 1.2) + 100.0 * ramp(t, 2.2, 3.0) + 280.0 * ramp(t, 4.1, 4.6)
                - 380.0 * ramp(t, 5.5, 6.5)
                + again
                + 180.0 * ramp(t, 10.5, 11.0),
            box_height: 20.0 + (100.0 * ramp(t, 2.2, 3.0) - falls_mm).max(0.0) + again,
        }
    });
    assert!(segments.iter().any(|(name, _)| name == "Drop"), "{segments:?}");
    assert_eq!(tasks, ["dropped", "pick_and_place"], "{segments:?}");
}
