//! Real recordings, made by other operators, as a user analyses them: through the binding of their kind (docs/bindings.md).

#[path = "recordings/both_hands.rs"]
mod both_hands;
#[path = "recordings/given.rs"]
mod given;

use crate::program::teachtree;
use serde_json::Value;
use std::fmt::Write as _;

/// What a command prints, as JSON.
fn json(args: &[&str]) -> Value {
    let output = teachtree(args);
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The analysis of a log.
fn analysis(log: &str, binding: &str) -> Value {
    json(&["analyze", log, "--binding", binding, "--format", "json"])
}

/// A stretch of time with its name, s.
type NamedInterval = (String, f64, f64);

/// The relabeled segments of all tasks of the right hand, one after the other.
fn segments(analysis: &Value) -> Vec<NamedInterval> {
    let tasks = analysis["tracks"][0]["tasks"].as_array().unwrap();
    tasks.iter().flat_map(|task| task["segments"].as_array().unwrap()).map(|it| named(it, "primitive")).collect()
}

/// The segments of the right hand before relabeling.
fn raw(analysis: &Value) -> Vec<NamedInterval> {
    analysis["tracks"][0]["segments"].as_array().unwrap().iter().map(|it| named(it, "primitive")).collect()
}

fn named(value: &Value, name: &str) -> NamedInterval {
    let time = |key: &str| value[key].as_f64().unwrap();
    (value[name].as_str().unwrap().to_string(), time("start_s"), time("end_s"))
}

fn tasks(analysis: &Value) -> Vec<String> {
    let tasks = analysis["tracks"][0]["tasks"].as_array().unwrap();
    tasks.iter().map(|task| task["task"].as_str().unwrap().to_string()).collect()
}

/// The segments with one of these names.
fn of<'a>(segments: &'a [NamedInterval], names: &[&str]) -> Vec<&'a NamedInterval> {
    segments.iter().filter(|(name, ..)| names.contains(&name.as_str())).collect()
}

fn near(found: f64, wanted: f64, tolerance: f64) {
    assert!((found - wanted).abs() <= tolerance, "found {found} s, expected {wanted} s within {tolerance} s");
}

/// Tasks and segments, for operators: to a tenth of a second, since samples of some of these logs are 50 ms apart. Of two hands, also the coordination.
fn printed(analysis: &Value) -> String {
    let mut text = String::new();
    let tracks = analysis["tracks"].as_array().unwrap();
    for track in tracks {
        if tracks.len() > 1 {
            let _ = writeln!(text, "{}:", track["track"].as_str().unwrap());
        }
        for task in track["tasks"].as_array().unwrap() {
            let _ = writeln!(text, "{}", task["task"].as_str().unwrap());
            say(&task["segments"], &mut text);
        }
        if track["track"] == "both" {
            say(&track["relabeled"], &mut text);
        }
    }
    for issue in analysis["issues"].as_array().unwrap() {
        let said = |key: &str| issue[key].as_str().unwrap();
        let message = if said("kind") == "undetectable" { said("message") } else { "" };
        let _ = writeln!(text, "{}", format!("{} {} {message}", said("kind"), said("channel")).trim_end());
    }
    text
}

fn say(segments: &Value, text: &mut String) {
    for (name, from, to) in segments.as_array().unwrap().iter().map(|it| named(it, "primitive")) {
        let _ = writeln!(text, "  {name:<10}{from:6.1} – {to:.1} s");
    }
}

/// The logs that come with the project, and their bindings.
pub const SHIPPED: &[(&str, &str)] = &[
    ("robosuite/SawyerNutAssembly_demo_1.csv", "robosuite/sawyer_nut_assembly"),
    ("robosuite/nut_assembly_panda_demo_1.csv", "robosuite/panda_nut_assembly"),
    ("robosuite/SawyerStack_demo_1.csv", "robosuite/sawyer_stack"),
    ("robosuite/stack_panda_demo_1.csv", "robosuite/panda_stack"),
    ("robosuite/SawyerLift_demo_1.csv", "robosuite/sawyer_lift"),
    ("robosuite/lift_demo_1.csv", "robosuite/panda_lift"),
    ("robosuite/SawyerPickPlace_demo_1.csv", "robosuite/sawyer_pick_place"),
    ("robosuite/door_panda_demo_1.csv", "robosuite/door"),
    ("robosuite/wipe_panda_demo_1.csv", "robosuite/wipe"),
    ("robosuite/handover_panda_panda_demo_5.csv", "robosuite/handover"),
    ("robosuite/BaxterLift_demo_1.csv", "robosuite/baxter_lift"),
    ("robosuite/BaxterPegInHole_demo_1.csv", "robosuite/baxter_peg_in_hole"),
    ("dapg_door/door_00.csv", "bindings/dapg_door"),
    ("dapg_door/door_03.csv", "bindings/dapg_door"),
    ("dfki_hand/recording_excerpt.tsv", "bindings/dfki_hand"),
];

fn shipped(log: &str) -> Value {
    let (log, binding) = SHIPPED.iter().find(|(it, _)| it.ends_with(log)).unwrap();
    analysis(&format!("demos/{log}"), &format!("demos/{binding}.binding.yaml"))
}

#[test]
fn shipped_recordings_are_reported_as_they_were() {
    for (log, _) in SHIPPED {
        let name = log.split(['/', '.']).nth(1).unwrap();
        insta::with_settings!({snapshot_suffix => name, description => *log, omit_expression => true}, {
            insta::assert_snapshot!(printed(&shipped(log)));
        });
    }
}

/// The primitives that begin, and when, s.
type Boundaries<'a> = &'a [(&'a str, f64)];

/// When both fingers are on, the object off what carries it, and the fingers off again, as the contact events of the recordings say, s.
#[test]
fn what_is_picked_up_and_placed_is_found_where_it_was() {
    let gold: &[(&str, &str, Boundaries)] = &[
        ("lift_demo_1.csv", "pick_and_place", &[("Grasp", 20.70), ("Translate", 22.60)]),
        ("SawyerLift_demo_1.csv", "pick_and_place", &[("Grasp", 10.87), ("Translate", 10.98)]),
        ("SawyerPickPlace_demo_1.csv", "pick_and_place", &[("Grasp", 7.57), ("Translate", 7.65), ("Release", 11.71)]),
        (
            "nut_assembly_panda_demo_1.csv",
            "peg_in_hole",
            &[("Grasp", 8.15), ("Translate", 8.35), ("Insert", 20.45), ("Release", 22.40)],
        ),
    ];
    for (log, task, boundaries) in gold {
        let analysis = shipped(log);
        assert_eq!(tasks(&analysis), [*task], "{log}");
        let segments = segments(&analysis);
        for (primitive, wanted) in *boundaries {
            let found = of(&segments, &[primitive]);
            let nearest = found.iter().map(|(_, from, _)| (from - wanted).abs()).fold(f64::INFINITY, f64::min);
            assert!(nearest <= 0.15, "{log}: no {primitive} at {wanted} s: {found:?}");
        }
    }
}

/// The palm presses the lever from 8.00 to 13.05 s; nothing is grasped.
#[test]
fn a_lever_is_turned_without_a_grasp() {
    let analysis = shipped("door_panda_demo_1.csv");
    assert_eq!(tasks(&analysis), ["turn_screw"]);
    let segments = segments(&analysis);
    let turned = of(&segments, &["Turn"]);
    let (_, from, to) = turned.iter().max_by(|a, b| (a.2 - a.1).total_cmp(&(b.2 - b.1))).unwrap();
    near(*from, 8.00, 0.30);
    near(*to, 13.05, 0.10);
    assert_eq!(of(&segments, &["Grasp", "Translate", "Follow", "Insert", "Pullout"]), [] as [&NamedInterval; 0]);
}

/// The tool is on the table from 3.95 s on.
#[test]
fn a_wiping_tool_is_traced_while_it_touches() {
    let analysis = shipped("wipe_panda_demo_1.csv");
    let segments = segments(&analysis);
    let [(first, ..), (second, from, to)] = segments.as_slice() else { panic!("{segments:?}") };
    assert_eq!((first.as_str(), second.as_str()), ("Approach", "Trace"));
    near(*from, 3.95, 0.05);
    near(*to, 8.70, 0.06);
}

/// A latch that is pressed down: Turn while its angle goes from below 0.1 to above 1.5 rad.
fn turns_with_the_latch(log: &str, binding: &str) {
    let text = std::fs::read_to_string(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(log)).unwrap();
    let column = text.lines().next().unwrap().split(',').position(|title| title == "latch_rad").unwrap();
    let rows = text.lines().skip(1).map(|row| row.split(',').map(|cell| cell.parse::<f64>().unwrap()));
    let angles: Vec<(f64, f64)> = rows.map(|row| row.collect()).map(|row: Vec<f64>| (row[0], row[column])).collect();
    let above = |angle: f64| angles.iter().find(|row| row.1 > angle).unwrap().0;
    let analysis = analysis(log, binding);
    assert_eq!(tasks(&analysis), ["turn_screw"], "{log}");
    let raw = raw(&analysis);
    let turns = of(&raw, &["Turn"]);
    let whole = turns.iter().filter(|(_, from, to)| *from <= above(0.1) && *to >= above(1.5));
    assert_eq!(whole.count(), 1, "{log}: {} to {} s, found {turns:?}", above(0.1), above(1.5));
    // Nothing else is claimed of a hand whose contact is not measured.
    let names: std::collections::BTreeSet<&str> = raw.iter().map(|(name, ..)| name.as_str()).collect();
    assert!(names.into_iter().all(|name| ["Move", "Approach", "Turn"].contains(&name)), "{log}: {raw:?}");
}

#[test]
fn a_latch_is_turned_by_a_hand_that_is_not_felt() {
    for log in ["demos/dapg_door/door_00.csv", "demos/dapg_door/door_03.csv"] {
        turns_with_the_latch(log, "demos/bindings/dapg_door.binding.yaml");
    }
}

#[test]
fn what_a_log_cannot_tell_is_said_by_name() {
    let inspect = |log: &str, binding: &str| {
        let binding = format!("demos/{binding}.binding.yaml");
        let inspection = json(&["inspect", &format!("demos/{log}"), "--binding", &binding, "--format", "json"]);
        inspection["recognition"]["tracks"][0].to_string()
    };
    insta::assert_snapshot!(inspect("dapg_door/door_00.csv", "bindings/dapg_door"));
    insta::assert_snapshot!(inspect("robosuite/wipe_panda_demo_1.csv", "robosuite/wipe"));
}

#[test]
fn a_hand_file_of_ones_own_lies_beside_the_binding() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    let binding = std::fs::read_to_string(root.join("demos/robosuite/panda_lift.binding.yaml")).unwrap();
    std::fs::write(folder.path().join("lab.yaml"), binding.replace("hand_flags.rules", "hands/lab.rules")).unwrap();
    std::fs::create_dir(folder.path().join("hands")).unwrap();
    let flags = std::fs::read_to_string(root.join("rules/hand_flags.rules")).unwrap();
    std::fs::write(folder.path().join("hands/lab.rules"), flags).unwrap();
    let found = analysis("demos/robosuite/lift_demo_1.csv", folder.path().join("lab.yaml").to_str().unwrap());
    let files: Vec<&str> = found["rules"]["files"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    assert!(files.iter().any(|file| file.ends_with("hands/lab.rules")), "{files:?}");
    assert_eq!(printed(&found), printed(&shipped("lift_demo_1.csv")));
}

/// The nut binding needs no parameter of its own, and those of the snap assembly are printed.
#[test]
fn what_a_binding_overrides_is_printed() {
    let found = shipped("SawyerNutAssembly_demo_1.csv");
    assert_eq!(found["rules"]["params"], serde_json::json!({}));
    let folder = tempfile::tempdir().unwrap();
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let binding = std::fs::read_to_string(root.join("demos/robosuite/panda_lift.binding.yaml")).unwrap();
    let own = folder.path().join("lab.yaml");
    std::fs::write(&own, binding.replace("time: t", "params: {near_on: 40 mm}\ntime: t")).unwrap();
    let own = own.to_str().unwrap();
    let output = teachtree(&["analyze", "demos/robosuite/lift_demo_1.csv", "--binding", own]);
    assert!(String::from_utf8_lossy(&output.stdout).contains("near_on = 40 mm"));
}
