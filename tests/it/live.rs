//! `teachtree analyze -`: a log that is still being written.

use serde_json::{Map, Value, json};
use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};
use teachtree_frames::OpenRequest;
use teachtree_frames::open;

const LOG: &str = "demos/robosuite/SawyerNutAssembly_demo_1.csv";
const BINDING: &str = "demos/robosuite/sawyer_nut_assembly.binding.yaml";

/// The log as JSON lines: its scene first.
fn lines() -> Vec<String> {
    let opened =
        open(&OpenRequest { log: LOG.into(), binding: Some(BINDING.into()), ..OpenRequest::default() }).unwrap();
    let recording = opened.recording;
    let mut lines = vec![json!({"scene": recording.scene}).to_string()];
    for (row, time) in recording.time.iter().enumerate() {
        let mut object = Map::new();
        object.insert("clock".into(), json!({"ms": time * 1000.0}));
        for (name, column) in &recording.columns {
            let value = column.values[row];
            object.insert(name.clone(), if value.is_nan() { Value::Null } else { json!(value) });
        }
        lines.push(Value::Object(object).to_string());
    }
    lines
}

#[test]
fn segments_are_printed_while_the_log_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let binding = "time: clock.ms [ms]\nhand_file: hand_flags.rules\nparams: {turns: 2 rad/s}\n";
    std::fs::write(folder.path().join("lab.binding.yaml"), binding).unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_teachtree"))
        .args(["analyze", "-", "--binding"])
        .arg(folder.path().join("lab.binding.yaml"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let stdout = BufReader::new(child.stdout.take().unwrap());
    let (sender, printed) = std::sync::mpsc::channel();
    std::thread::spawn(move || stdout.lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));
    let lines = lines();
    let half = lines.len() / 2;
    for line in &lines[..half] {
        writeln!(stdin, "{line}").unwrap();
    }
    stdin.flush().unwrap();
    // The rest is not written before this is said.
    let patience = std::time::Duration::from_secs(120);
    let early: Vec<String> = (0..4).map_while(|_| printed.recv_timeout(patience).ok()).collect();
    insta::assert_snapshot!(early.join("\n"));
    for line in &lines[half..] {
        writeln!(stdin, "{line}").unwrap();
    }
    drop(stdin);
    let rest: Vec<String> = printed.iter().collect();
    let rest = rest.join("\n");
    assert!(child.wait().unwrap().success());
    assert_eq!(rest.matches("  peg_in_hole ").count(), 2, "{rest}");
}

#[test]
fn lines_that_are_not_objects_end_it() {
    let folder = tempfile::tempdir().unwrap();
    let binding = "time: clock.ms [ms]\nhand_file: hand_flags.rules\nparams: {turns: 2 rad/s}\n";
    std::fs::write(folder.path().join("lab.binding.yaml"), binding).unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_teachtree"))
        .args(["analyze", "-"])
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(b"{\"time\": 0}\nnonsense\n{\"time\": 1}\n").unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    insta::assert_snapshot!(String::from_utf8(output.stderr).unwrap(), @"error: standard input row 2 letter 2: found no JSON object: expected a value");
}
