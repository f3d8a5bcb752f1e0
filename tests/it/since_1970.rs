//! Stamps that count from 1970: all commands count from the first row, and accept labels and expectations in both clocks.

use crate::live_log::{Rows, demonstration};
use crate::program::{all_said, said, teachtree_fed, teachtree_in};
use crate::studio::Studio;
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use teachtree::{Log, Rules};
use teachtree_base::recording::Recording;
use teachtree_logs::read::formats;

/// The first stamp, s: in 2023.
const ZERO_S: f64 = 1.7e9;

fn recording(zero_s: f64) -> Recording {
    let mut recording = demonstration("pick_and_place");
    recording.time.iter_mut().for_each(|time| *time += zero_s);
    recording.labels.clear();
    recording
}

/// Writes the recording, as `log.csv` of a folder.
fn written(folder: &Path) {
    formats::write(&recording(ZERO_S), &folder.join("log.csv")).unwrap();
}

#[test]
fn a_log_in_windows_has_the_times_of_the_log_in_memory() {
    let folder = tempfile::tempdir().unwrap();
    written(folder.path());
    let path = folder.path().join("log.csv");
    let (in_windows, in_memory) = (Log::open(&path).unwrap(), Log::open(&path).unwrap());
    in_memory.read().unwrap();
    let rules = Rules::for_log(&in_windows).unwrap();
    let document = rules.analyze(&in_windows).unwrap().json();
    assert_eq!(document, rules.analyze(&in_memory).unwrap().json());
    let document: Value = serde_json::from_str(&document).unwrap();
    let of_log = |key: &str| document["log"][key].as_f64();
    assert_eq!((of_log("zero_stamp_s"), of_log("start_s")), (Some(ZERO_S), Some(0.0)));
}

#[test]
fn live_counts_from_the_first_row() {
    let live = |zero_s: f64| {
        let rows = Rows::of(&recording(zero_s));
        let mut lines = format!("{}\n", json!({ "scene": recording(zero_s).scene }));
        for row in &rows.rows {
            let object: serde_json::Map<String, Value> =
                rows.titles.iter().cloned().zip(row.iter().map(|value| json!(value))).collect();
            lines.push_str(&format!("{}\n", Value::Object(object)));
        }
        let output = teachtree_fed(&["live", "-", "--no-labels", "--format", "json"], lines.as_bytes());
        assert!(output.status.success(), "{}", all_said(&output));
        let events: Vec<Value> = said(&output).lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        events
    };
    let (since_start, since_1970) = (live(0.0), live(ZERO_S));
    let clock: Vec<&Value> = since_1970.iter().filter(|event| event["event"] == "clock").collect();
    assert_eq!(clock.len(), 1);
    assert_eq!(clock[0]["origin_ns"], json!(1_700_000_000_000_000_000_i64));
    let ends = |events: &[Value]| -> Vec<(String, i64, i64)> {
        let ms = |time: &Value| (time.as_f64().unwrap() * 1e3).round() as i64;
        let timed = events.iter().filter(|event| event["event"] == "segment" || event["event"] == "issue");
        let named = |event: &Value| [&event["primitive"], &event["kind"]].map(ToString::to_string).concat();
        timed.map(|event| (named(event), ms(&event["start_s"]), ms(&event["end_s"]))).collect()
    };
    assert!(ends(&since_1970).len() > 5);
    assert_eq!(ends(&since_1970), ends(&since_start));
}

#[test]
fn labels_and_expectations_are_accepted_in_both_clocks() {
    let folder = tempfile::tempdir().unwrap();
    written(folder.path());
    let run = |args: &[&str]| {
        let output = teachtree_in(folder.path(), args);
        assert_eq!(output.status.code(), Some(0), "{args:?}: {}", all_said(&output));
        said(&output)
    };
    let updated = run(&["test", "--update", "."]);
    let path = folder.path().join("log.expect");
    let relative = fs::read_to_string(&path).unwrap_or_else(|_| panic!("{updated}"));
    assert!(relative.contains(" 0.000 .. "), "{relative}");
    let time = |word: &str| word.parse::<f64>().ok();
    let shifted = |line: &str| -> String {
        let words = line.split(' ').map(|word| time(word).map_or(word.into(), |time| format!("{:.3}", time + ZERO_S)));
        words.collect::<Vec<String>>().join(" ")
    };
    let (head, lines) = relative.split_once("track ").unwrap();
    let lines: Vec<String> = lines.lines().map(shifted).collect();
    fs::write(&path, format!("{head}track {}\n", lines.join("\n"))).unwrap();
    assert!(run(&["test", "."]).contains("1 as expected, 0 not"));

    let labels = format!("track,label,start_s,end_s\nright,Move,{:.3},{:.3}\n", ZERO_S, ZERO_S + 0.5);
    fs::write(folder.path().join("log.labels.csv"), labels).unwrap();
    let scored: Value = serde_json::from_str(&run(&["score", "log.csv", "--labels", ".", "--format", "json"])).unwrap();
    assert_eq!(scored["results"][0]["all"]["accuracy"].as_f64(), Some(1.0));
    let studio = Studio::start(folder.path(), &["log.csv"]);
    let line = studio.get("api/recording/0/labels")["lines"][0].clone();
    assert_eq!((line["start_s"].as_f64(), line["end_s"].as_f64()), (Some(0.0), Some(0.5)), "{line}");
}
