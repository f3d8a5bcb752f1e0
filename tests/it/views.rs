//! `analyze --mcap`: what other libraries read of the file, and the stamps of what it says.

use crate::program::{all_said, complained, said, teachtree_in};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write as _;
use std::path::Path;
use std::process::Command;

const LOG: &str = "nut_assembly_panda_demo_1.csv";
const BINDING: &str = "panda_nut_assembly.binding.yaml";

fn demos() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite")
}

fn analyze(out: &Path, more: &[&str]) -> std::process::Output {
    let args = ["analyze", LOG, "--binding", BINDING, "--format", "json", "--mcap", out.to_str().unwrap()];
    teachtree_in(&demos(), &[&args[..], more].concat())
}

/// A text in CDR.
fn text(data: &[u8]) -> String {
    assert_eq!(data[..4], [0, 1, 0, 0]);
    let length = u32::from_le_bytes(data[4..8].try_into().unwrap()) as usize;
    assert_eq!((data.len(), data[data.len() - 1]), (8 + length, 0));
    String::from_utf8(data[8..8 + length - 1].to_vec()).unwrap()
}

#[test]
fn the_messages_are_the_analysis() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("view.mcap");
    let output = analyze(&out, &["--signals", "near"]);
    assert!(output.status.success(), "{}", all_said(&output));
    let document: Value = serde_json::from_str(&said(&output)).unwrap();
    let bytes = std::fs::read(&out).unwrap();
    let mut topics: BTreeMap<String, Vec<(u64, Vec<u8>)>> = BTreeMap::new();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        assert_eq!(message.channel.message_encoding, "cdr");
        assert_eq!(message.channel.schema.as_ref().unwrap().encoding, "ros2msg");
        topics.entry(message.channel.topic.clone()).or_default().push((message.log_time, message.data.to_vec()));
    }
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let statistics = summary.stats.unwrap();
    assert_eq!(statistics.message_count as usize, topics.values().map(Vec::len).sum::<usize>());
    let all: BTreeSet<&str> = topics.keys().map(String::as_str).collect();
    let lanes = ["object", "primitive", "raw", "task"].map(|lane| format!("/teachtree/right/{lane}"));
    assert!(lanes.iter().all(|lane| all.contains(lane.as_str())), "{all:?}");
    // Each segment begins at its time, and after the last one there is nothing.
    let nanoseconds = |value: &Value| (value.as_f64().unwrap() * 1e9).round() as u64;
    let track = &document["tracks"][0];
    for (lane, list, name) in
        [("primitive", "relabeled", "primitive"), ("raw", "segments", "primitive"), ("task", "tasks", "task")]
    {
        let spans = track[list].as_array().unwrap();
        let mut expected: Vec<(u64, String)> = spans
            .iter()
            .map(|span| (nanoseconds(&span["start_s"]), span[name].as_str().unwrap().to_string()))
            .collect();
        expected.push((nanoseconds(&spans.last().unwrap()["end_s"]), String::new()));
        let found: Vec<(u64, String)> =
            topics[&format!("/teachtree/right/{lane}")].iter().map(|(time, data)| (*time, text(data))).collect();
        assert_eq!(found, expected, "{lane}");
    }
    let frames = document["log"]["frames"].as_u64().unwrap() as usize;
    assert_eq!(topics["/teachtree/signal/right/near"].len(), frames);
    assert_eq!(topics["/tf"].len(), document["log"]["rows"].as_u64().unwrap() as usize);
    // The layout names topics that there are.
    let layout: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("view.foxglove.json")).unwrap()).unwrap();
    let paths = ["StateTransitions!teachtree", "Plot!teachtree"]
        .map(|panel| layout["configById"][panel]["paths"].as_array().unwrap().clone());
    for path in paths.iter().flatten() {
        assert!(all.contains(path["value"].as_str().unwrap().strip_suffix(".data").unwrap()), "{path}");
    }
    // It is a log that this program reads: the poses of the nut are those of the recording.
    let inspected = teachtree_in(folder.path(), &["inspect", "view.mcap", "--format", "json"]);
    let inspected: Value = serde_json::from_str(&said(&inspected)).unwrap();
    let z = |document: &Value, name: &str| {
        let sheets = document["sheets"].as_array().unwrap();
        let mut columns = sheets.iter().flat_map(|sheet| sheet["columns"].as_array().unwrap());
        let column = columns
            .find(|column| column["name"].as_str().unwrap().contains(name))
            .unwrap_or_else(|| panic!("{document}"));
        (column["min"].as_f64().unwrap(), column["max"].as_f64().unwrap())
    };
    let of_log = teachtree_in(&demos(), &["inspect", LOG, "--format", "json"]);
    let of_log: Value = serde_json::from_str(&said(&of_log)).unwrap();
    assert_eq!(z(&inspected, "RoundNut0.transform.translation.z"), z(&of_log, "RoundNut0_pz"));
}

#[test]
fn what_cannot_be_written_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("view.bag");
    let output = analyze(&out, &[]);
    assert!(
        output.status.code() == Some(2) && complained(&output).contains("ends in .mcap"),
        "{}",
        complained(&output)
    );
    let out = folder.path().join("view.mcap");
    let output = analyze(&out, &["lift_demo_1.csv"]);
    assert!(
        output.status.code() == Some(2) && complained(&output).contains("found several"),
        "{}",
        complained(&output)
    );
    let layout = folder.path().join("view.foxglove.json");
    let output = analyze(&out, &["-o", layout.to_str().unwrap()]);
    assert!(
        output.status.code() == Some(2) && complained(&output).contains("the file of two outputs"),
        "{}",
        complained(&output)
    );
    let output = analyze(&out, &["--signals", "no_such"]);
    assert_eq!(output.status.code(), Some(2));
    let output = teachtree_in(&demos(), &["analyze", LOG, "--binding", BINDING, "--signals", "near"]);
    assert!(output.status.code() == Some(2) && complained(&output).contains("--mcap"), "{}", complained(&output));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// The libraries of others read it, where they are installed: all texts, numbers and poses by their definitions.
#[test]
fn python_reads_all_messages() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("view.mcap");
    assert!(analyze(&out, &["--signals", "near"]).status.success());
    let python = std::env::var("TEACHTREE_PYTHON").unwrap_or_else(|_| "python3".into());
    let run = |args: &[&str]| Command::new(&python).args(args).output();
    if !run(&["-c", "import mcap_ros2"]).is_ok_and(|output| output.status.success()) {
        let _ = writeln!(std::io::stderr(), "skipped: Python with `mcap-ros2-support` is not installed");
        return;
    }
    let tool = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/check_mcap.py");
    let output = run(&[tool.to_str().unwrap(), out.to_str().unwrap()]).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(
        String::from_utf8_lossy(&output.stdout).contains("/teachtree/right/task: peg_in_hole"),
        "{}",
        String::from_utf8_lossy(&output.stdout)
    );
}
