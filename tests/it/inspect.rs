//! `teachtree inspect` as a user meets it.

use crate::program::{complained, said, teachtree};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A copy of the fixture log with these columns left out.
fn log_without(folder: &Path, left_out: &str) -> PathBuf {
    let text = std::fs::read_to_string("demos/robosuite/SawyerNutAssembly_demo_1.csv").unwrap();
    let keep: Vec<bool> = text.lines().next().unwrap().split(',').map(|title| !title.contains(left_out)).collect();
    let line = |line: &str| {
        let cells: Vec<&str> = line.split(',').zip(&keep).filter(|(_, keep)| **keep).map(|(cell, _)| cell).collect();
        cells.join(",") + "\n"
    };
    let path = folder.join("log.csv");
    std::fs::write(&path, text.lines().map(line).collect::<String>()).unwrap();
    path
}

const NUTS: &str = "demos/robosuite/sawyer_nut_assembly.binding.yaml";

#[test]
fn inspect_tells_what_cannot_be_recognised_and_why() {
    let folder = tempfile::tempdir().unwrap();
    // A binding without contacts of the nuts.
    let binding = folder.path().join("binding.yaml");
    let text = std::fs::read_to_string(NUTS).unwrap();
    let kept: Vec<&str> = text.lines().filter(|line| !line.trim_start().starts_with("contact.")).collect();
    std::fs::write(&binding, kept.join("\n")).unwrap();
    let log = log_without(folder.path(), "_env");
    let output =
        teachtree(&["inspect", log.to_str().unwrap(), "--binding", binding.to_str().unwrap(), "--format", "json"]);
    assert!(output.status.success(), "{}", complained(&output));
    let document: Value = serde_json::from_str(&said(&output)).unwrap();
    assert_eq!(document["schema"], "teachtree.inspection/1");
    let track = &document["recognition"]["tracks"][0];
    let can: Vec<&str> = track["can"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
    assert!(can.contains(&"Translate") && can.contains(&"Insert") && !can.contains(&"Place"), "{can:?}");
    let lack = &track["cannot"][0];
    let advice =
        "the log has no contacts (computed if the scene has `parts` of `SquareNut0` and of the bodies that it touches)";
    assert_eq!(lack["of"], advice);
    let lost: Vec<&str> = lack["primitives"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
    for primitive in ["Place", "Slide", "Press", "Follow", "Push", "Trace"] {
        assert!(lost.contains(&primitive), "{primitive} is not in {lost:?}");
    }
}

/// A primitive for logs without a sensor of touch is impossible in a log that has one: nothing is lacking.
#[test]
fn what_a_log_has_is_not_called_lacking() {
    let folder = tempfile::tempdir().unwrap();
    let rules = folder.path().join("own.rules");
    std::fs::write(&rules, "primitive A, B\ntree own for each hand {\n  not grasp_known => A\n  else => B\n}\n")
        .unwrap();
    let log = "demos/robosuite/SawyerNutAssembly_demo_1.csv";
    let output =
        teachtree(&["inspect", log, "--binding", NUTS, "--rules", rules.to_str().unwrap(), "--format", "json"]);
    assert!(output.status.success(), "{}", complained(&output));
    let document: Value = serde_json::from_str(&said(&output)).unwrap();
    let cannot = &document["recognition"]["tracks"][0]["cannot"];
    assert_eq!(
        *cannot,
        serde_json::json!([{ "of": "`grasp_known` is constant in the whole log", "primitives": ["A"] }])
    );
}

#[test]
fn inspect_shows_the_columns_of_a_foreign_log() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.csv");
    let row = |row: u32| {
        let t = f64::from(row) * 0.01 + if row > 150 { 0.05 } else { 0.0 };
        let x = 0.2 * t + if row.is_multiple_of(2) { 0.0005 } else { -0.0005 };
        format!(
            "{t:.3},{x:.5},0,1,{},{},7.25,{},{}\n",
            x * 2.0,
            row % 3 / 2,
            if row < 20 { "" } else { "3" },
            if row < 99 { "pick" } else { "place" }
        )
    };
    let rows: String = (0..200).map(row).collect();
    std::fs::write(&log, format!("stamp,tip_x [m],tip_y [m],tip_z [m],state[0],grip,force,late,what\n{rows}")).unwrap();
    let output = teachtree(&["inspect", log.to_str().unwrap()]);
    assert!(output.status.success(), "{}", complained(&output));
    let place = format!("{}/", folder.path().display());
    insta::assert_snapshot!(said(&output).replace(&place, ""));
    let binding = folder.path().join("lab.binding.yaml");
    let text = "time: stamp\nresample: 100 Hz\nchannels: {right.thumb.position: \"tip_<xyz> [m]\"}\nscene: {bodies: {object: {role: object, radius: 50 mm}}}\n";
    std::fs::write(&binding, text).unwrap();
    let bound = ["inspect", log.to_str().unwrap(), "--binding", binding.to_str().unwrap()];
    let output = teachtree(&bound);
    let model = "  hand model: hand_vision.rules, since the log has right.thumb.position\n";
    assert!(said(&output).contains(model), "{}", said(&output));
    // A hand model whose channels the log lacks.
    let output = teachtree(&[&bound[..], &["--hand", "hand_force.rules"]].concat());
    assert!(said(&output).contains("nothing can be detected"), "{}", said(&output));
    assert!(said(&output).contains("the rules need `fingers.force` of the right hand"), "{}", said(&output));
}

/// The palm touches and never grasps: no rule of a hand with fingers can find what it carries.
#[test]
fn a_hand_of_a_palm_alone_is_promised_no_grasp() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string("demos/robosuite/panda_lift.binding.yaml").unwrap();
    let kept: Vec<&str> = text.lines().filter(|line| !line.contains("thumb") && !line.contains("index")).collect();
    // The touches of a finger, called those of the palm.
    let palm = kept.join("\n").replace("R_palm_<object>", "R_f1_<object>");
    let binding = folder.path().join("binding.yaml");
    std::fs::write(&binding, palm).unwrap();
    let args = ["demos/robosuite/lift_demo_1.csv", "--binding", binding.to_str().unwrap(), "--format", "json"];
    let output = teachtree(&[&["inspect"], &args[..]].concat());
    let document: Value = serde_json::from_str(&said(&output)).unwrap();
    let track = &document["recognition"]["tracks"][0];
    let can: Vec<&str> = track["can"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
    assert!(can.contains(&"Approach") && !can.contains(&"Grasp") && !can.contains(&"Translate"), "{can:?}");
    let output = teachtree(&[&["analyze"], &args[..]].concat());
    let document: Value = serde_json::from_str(&said(&output)).unwrap();
    let issues = document["issues"].as_array().unwrap();
    let printed = issues
        .iter()
        .find(|issue| issue["kind"] == "undetectable" && issue["message"].to_string().contains("Translate"));
    assert!(printed.unwrap()["message"].to_string().contains("the hand has a palm and no fingertips"), "{issues:?}");
}
