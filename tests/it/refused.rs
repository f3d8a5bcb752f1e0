//! Bad input on the command line: one message with the place, what was found, what was wanted and what to do; exit status 2, and nothing is written.

use crate::program::{complained, said, teachtree};
use std::path::Path;

const LOG: &str = "tests/fixtures/logs/whole.csv";

fn shipped(file: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap()
}

/// A file of this text in a folder.
fn file(folder: &tempfile::TempDir, name: &str, text: &str) -> String {
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_string()
}

/// What is said when it refuses.
fn refused(args: &[&str]) -> String {
    let output = teachtree(args);
    let told = complained(&output);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {}{told}", said(&output));
    assert!(told.starts_with("error: ") && told.lines().all(|line| line.len() < 250), "{args:?}: {told}");
    told
}

/// A JSON file that is empty or was cut has no column to look at.
#[test]
fn json_that_ends_too_early_is_told_without_a_column() {
    let folder = tempfile::tempdir().unwrap();
    for (text, wanted) in [
        ("", "commands.json: the file is empty"),
        (" \n", "commands.json: the file is empty"),
        ("{\"schema\": \"teachtree.commands/1\",\n \"tasks\": [", "commands.json:2: ends in the middle of a list"),
        ("{\"schema\":\n", "commands.json:2: ends in the middle: a value is missing"),
        ("{\"schema\": 5}", "commands.json:1:12: found `5`, wanted a text"),
        ("{\"schema\" 5}", "commands.json:1:11: no JSON here, wanted `:`"),
    ] {
        let commands = file(&folder, "commands.json", text);
        let told = refused(&["simulate", &commands, "--scene", "slide", "-o", "none.csv"]);
        assert!(told.contains(wanted), "{told}, wanted {wanted}");
        assert!(told.contains("help: commands are the JSON file that `teachtree command` writes"), "{told}");
    }
}

/// Numbers that only a slip of the finger makes are shown as they were meant, not with hundreds of digits.
#[test]
fn huge_and_tiny_numbers_are_told_in_short() {
    let folder = tempfile::tempdir().unwrap();
    let commands = r#"{"schema": "teachtree.commands/1", "log": "", "rate_hz": 1e300, "scene": "", "tasks": []}"#;
    let commands = file(&folder, "commands.json", commands);
    let robot = shipped("robots/gifu_hand_iii_right.yaml");
    let heavy = file(&folder, "heavy.yaml", &robot.replacen("mass: 550 g", "mass: 1e280 kg", 1));
    let binding = file(&folder, "rate.yaml", "resample: 1e300 Hz\n");
    let times = file(&folder, "times.csv", "time [s],cube.position.x [m]\n1e250,0\n-1e250,0\n");
    let (out, scene) = (folder.path().join("out.csv"), "tests/fixtures/logs/box.yaml");
    let out = out.to_str().unwrap();
    for (args, wanted) in [
        (&["simulate", &commands, "--scene", "slide", "-o", out][..], "has 1e300 samples a second"),
        (&["command", LOG, "--scene", scene, "--robot", &heavy, "-o", out], "has a mass of 1e2"),
        (&["analyze", LOG, "--scene", scene, "--binding", &binding], "found 1e300 Hz"),
        (&["analyze", &times, "--scene", scene], "-1e250 s after 1e250 s"),
    ] {
        let told = refused(args);
        assert!(told.contains(wanted), "{told}, wanted {wanted}");
    }
}
