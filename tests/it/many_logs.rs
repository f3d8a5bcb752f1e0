//! Logs that flow through, and many of them: the same bytes as of one that is in memory, and as one by one.

use crate::program::{complained, said, teachtree_in};
use std::path::Path;
use teachtree_base::recording::Recording;
use teachtree_frames::OpenRequest;
use teachtree_frames::streaming::StreamedLog;
use teachtree_logs::read::formats;
use teachtree_world::{shipped, teach};

fn taught(name: &str, seed: u64) -> Recording {
    teach(&shipped::scene(name).unwrap(), &shipped::operator(name).unwrap(), seed).unwrap()
}

/// A recording without some of its rows.
fn without(mut recording: Recording, rows: std::ops::Range<usize>) -> Recording {
    recording.time.drain(rows.clone());
    recording.columns.values_mut().for_each(|column| drop(column.values.drain(rows.clone())));
    recording.labels.values_mut().for_each(|texts| drop(texts.drain(rows.clone())));
    recording
}

/// Whether a log flows through, rather than being in memory.
fn flows(log: &Path) -> bool {
    let request = OpenRequest { log: log.into(), ..OpenRequest::default() };
    let known = StreamedLog::open(&request).and_then(|flow| flow.look_through(&[]));
    known.is_some_and(|known| known.parts(&mut |_| Ok(())).is_ok())
}

/// The analysis of a log in a folder: as it flows, and of the log in memory, which a report needs.
fn both_ways(folder: &Path, log: &str) -> [String; 2] {
    let json = ["analyze", log, "--format", "json"];
    [&json[..], &[&json[..], &["--report", "report.html"]].concat()].map(|args| {
        let output = teachtree_in(folder, args);
        assert!(output.status.success(), "{}", complained(&output));
        said(&output)
    })
}

#[test]
fn what_flows_is_reported_as_what_is_in_memory() {
    let folder = tempfile::tempdir().unwrap();
    for (name, seed) in [("hold_and_insert", 3), ("several_tasks", 1)] {
        let recording = taught(name, seed);
        let rows = recording.time.len();
        let cut = without(recording.clone(), rows / 2..rows / 2 + 40);
        let late = without(recording.clone(), 3..33);
        for (case, recording) in [("whole", recording), ("cut", cut), ("late", late)] {
            for ending in ["csv", "parquet"] {
                let log = format!("{name}_{case}.{ending}");
                formats::write(&recording, &folder.path().join(&log)).unwrap();
                assert!(flows(&folder.path().join(&log)), "{log} does not flow");
                let [flowing, in_memory] = both_ways(folder.path(), &log);
                assert!(flowing.contains("\"task\": "), "{log} has no task");
                assert_eq!(flowing, in_memory, "{log}");
            }
        }
    }
}

/// What is wrong with its last row a text tells behind all the others.
#[test]
fn a_last_row_that_is_cut_short_is_reported_of_a_log_that_flows() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.csv");
    formats::write(&taught("pick_and_place", 1), &log).unwrap();
    let text = std::fs::read_to_string(&log).unwrap();
    let last = text.trim_end().rfind('\n').unwrap();
    std::fs::write(&log, &text[..last + 30]).unwrap();
    assert!(flows(&log));
    let [flowing, in_memory] = both_ways(folder.path(), "log.csv");
    assert!(flowing.contains("is cut short"), "{flowing}");
    assert_eq!(flowing, in_memory);
}

#[test]
fn what_is_not_plain_is_in_memory() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.parquet");
    let plain = taught("pick_and_place", 1);
    let changes: [fn(&mut Recording); 6] = [
        |log| log.columns["right.thumb.position.x"].values[700] += 0.3,
        |log| {
            ["right.thumb.force.x", "box.position.z"]
                .iter()
                .for_each(|name| log.columns[*name].values[700..702].fill(800.0))
        },
        |log| log.columns["right.thumb.position.x"].values[700] = f64::NAN,
        |log| log.columns["right.thumb.force.x"].values[700] = 1e7,
        |log| {
            ["w", "x", "y", "z"]
                .iter()
                .for_each(|part| log.columns[&format!("right.palm.rotation.{part}")].values[700] = 0.0)
        },
        |log| {
            ["x", "y", "z"]
                .iter()
                .for_each(|part| log.columns[&format!("right.index.force.{part}")].values[500..1700].fill(0.7))
        },
    ];
    for (at, change) in changes.into_iter().enumerate() {
        let mut recording = plain.clone();
        change(&mut recording);
        formats::write(&recording, &log).unwrap();
        assert!(!flows(&log), "change {at}");
        let [one, other] = both_ways(folder.path(), "log.parquet");
        assert_eq!(one, other);
    }
    // Rows that a logger lost are put back, which takes the whole log.
    formats::write(&without(plain.clone(), 700..706), &log).unwrap();
    assert!(!flows(&log));
    formats::write(&plain, &log).unwrap();
    assert!(flows(&log));
}

#[test]
fn many_logs_are_reported_as_one_by_one() {
    let folder = tempfile::tempdir().unwrap();
    let logs: Vec<String> = (1..=4).map(|seed| format!("{seed}.parquet")).collect();
    for (log, seed) in logs.iter().zip(1..) {
        formats::write(&taught("pick_and_place", seed), &folder.path().join(log)).unwrap();
    }
    std::fs::write(folder.path().join("3.parquet"), "no log").unwrap();
    let analyze = |logs: &[String]| {
        let mut args = vec!["analyze", "--format", "json"];
        args.extend(logs.iter().map(String::as_str));
        let output = teachtree_in(folder.path(), &args);
        (said(&output), complained(&output))
    };
    let alone: Vec<(String, String)> = logs.iter().map(|log| analyze(std::slice::from_ref(log))).collect();
    let (found, wrong): (Vec<String>, Vec<String>) = alone.into_iter().unzip();
    let document = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
    let (lines, complaints) = analyze(&logs);
    assert_eq!(complaints, wrong.concat());
    let found: Vec<_> = found.iter().filter(|text| !text.is_empty()).map(|text| document(text)).collect();
    assert_eq!(lines.lines().map(document).collect::<Vec<_>>(), found);
}

#[test]
fn a_folder_of_recordings_is_reported_as_its_recordings() {
    let folder = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| {
        let output = teachtree_in(folder.path(), args);
        (said(&output), complained(&output))
    };
    run(&["teach", "stamp", "stamp", "--seeds", "1..2", "-o", "people"]);
    formats::write(&taught("pick_and_place", 3), &folder.path().join("people/other.parquet")).unwrap();
    let logs = ["people/other.parquet", "people/stamp_0001.csv", "people/stamp_0002.csv"];
    let all = run(&["analyze", "people", "--format", "json"]);
    assert_eq!(all, run(&[&["analyze", "--format", "json"], &logs[..]].concat()));
    // Each line is a document.
    let documents: Vec<serde_json::Value> = all.0.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let names: Vec<&str> = documents.iter().map(|document| document["log"]["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["other", "stamp_0001", "stamp_0002"]);
    // On one line it is what it is on several.
    let alone: serde_json::Value = serde_json::from_str(&run(&["analyze", logs[1], "--format", "json"]).0).unwrap();
    assert_eq!(documents[1], alone);
    // What is named twice is reported once, and by its columns a log is one, also where no scene stands beside it.
    assert_eq!(all, run(&["analyze", "people", "people/stamp_0002.csv", "--format", "json"]));
    std::fs::create_dir(folder.path().join("bare")).unwrap();
    std::fs::copy(folder.path().join("people/stamp_0001.csv"), folder.path().join("bare/A.CSV")).unwrap();
    std::fs::copy(folder.path().join("people/stamp_0002.csv"), folder.path().join("bare/b.tsv")).unwrap();
    std::fs::write(folder.path().join("bare/notes.txt"), "who, when\n").unwrap();
    std::fs::write(folder.path().join("bare/A.EVENTS.CSV"), "time [s],kind,subjects\n").unwrap();
    let bare = run(&["analyze", "bare", "--scene", "people/stamp_0001.scene.yaml", "--format", "json"]);
    assert_eq!((bare.0.matches("teachtree.analysis/2").count(), bare.1.as_str()), (2, ""));
    // A report is of one recording.
    assert!(run(&["analyze", "people", "--report", "page.html"]).1.contains("found several"));
}
