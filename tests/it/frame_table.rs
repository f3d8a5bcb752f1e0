//! `analyze --frames`: labels and signals per frame, as the library gives them and as the program writes them.

use crate::program::{complained, demonstrate, said, teachtree_in};
use teachtree::{FrameValues, Log, Question, Rules, Side, TrackId};
use teachtree_logs::read::formats;
use teachtree_world::{shipped, teach};

fn numbers<'a>(values: Option<FrameValues<'a>>, name: &str) -> &'a [f64] {
    match values {
        Some(FrameValues::Numbers(numbers)) => numbers,
        other => panic!("{name}: {other:?}"),
    }
}

fn texts<'a>(values: Option<FrameValues<'a>>, name: &str) -> &'a [String] {
    match values {
        Some(FrameValues::Texts(texts)) => texts,
        other => panic!("{name}: {other:?}"),
    }
}

#[test]
fn labels_and_signals_are_given_for_each_frame() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let recording =
        teach(&shipped::scene("hold_and_insert").unwrap(), &shipped::operator("hold_and_insert").unwrap(), 3);
    formats::write(&recording.unwrap(), &path).unwrap();
    let log = Log::open(&path).unwrap();
    let analysis = Rules::for_log(&log).unwrap().analyze(&log).unwrap();
    let asked = ["near", "right.touches", "leaving", "target", "target.velocity", "closing", "same_target"];
    let table = analysis.frames(&asked).unwrap();
    assert!(table.columns().all(|(_, _, values)| match values {
        FrameValues::Numbers(numbers) => numbers.len() == analysis.frame_count(),
        FrameValues::Texts(texts) => texts.len() == analysis.frame_count(),
    }));
    let text = |name: &str| texts(table.column(name), name);
    let number = |name: &str| numbers(table.column(name), name);
    for segment in analysis.track(TrackId::Hand(Side::Right)).unwrap().segments() {
        for frame in segment.frames() {
            assert_eq!(text("right.label")[frame], segment.primitive());
            assert_eq!(text("right.object")[frame], segment.object().unwrap_or_default());
            assert_eq!(text("right.partner")[frame], segment.partner().unwrap_or_default());
        }
    }
    for task in analysis.track(TrackId::Hand(Side::Left)).unwrap().tasks() {
        assert!(task.frames().all(|frame| text("left.task")[frame] == task.name()));
    }
    // What the signals say is what `explain` says of them.
    let approach = text("right.raw").iter().position(|label| label == "Approach").unwrap();
    assert_eq!((number("right.near")[approach - 1], number("right.near")[approach]), (0.0, 1.0));
    let question = Question::at(number("time")[approach]).track(TrackId::Hand(Side::Right));
    assert!(analysis.explain(&question).unwrap().to_string().contains("Approach peg"));
    assert_eq!(number("row")[approach], approach as f64);
    assert_eq!(text("right.target")[approach], "peg");
    assert!(table.column("left.touches.thumb").is_none() && table.column("right.touches.thumb").is_some());
    let units: Vec<(String, String)> = table.columns().map(|(name, unit, _)| (name.into(), unit)).collect();
    for (name, unit) in [("time", "s"), ("left.target.velocity.x", "m/s"), ("closing", "m/s"), ("same_target", "")] {
        assert!(units.contains(&(name.into(), unit.into())), "{name} {unit}: {units:?}");
    }
    // A name that is not known is refused with the nearest one.
    let error = analysis.frames(&["nar"]).unwrap_err();
    assert!(error.to_string().contains("found `nar`") && error.to_string().contains("`near`"), "{error}");
}

#[test]
fn the_table_is_written_as_csv_and_as_parquet() {
    let folder = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| teachtree_in(folder.path(), args);
    demonstrate("push", &[], folder.path().join("log.csv"));
    for name in ["frames.csv", "frames.parquet"] {
        let output = run(&["analyze", "log.csv", "--frames", name, "--signals", "near,squeeze"]);
        assert!(output.status.success(), "{}", complained(&output));
        // The analysis is printed all the same.
        assert!(said(&output).contains("Push box"));
    }
    let table = std::fs::read_to_string(folder.path().join("frames.csv")).unwrap();
    let head = "time [s],row,right.near,right.squeeze [N],right.raw,right.label,right.task,right.object,right.partner";
    assert_eq!(table.lines().next().unwrap(), head);
    assert!(table.lines().nth(1).unwrap().starts_with("0,0,0,"), "{:?}", table.lines().nth(1));
    assert!(table.lines().any(|line| line.ends_with(",Push,Push,push,box,")), "no Push");
    assert_eq!(table.lines().count(), std::fs::read_to_string(folder.path().join("log.csv")).unwrap().lines().count());
    // Nothing is written beside a table, and the two forms hold the same.
    assert!(!folder.path().join("frames.scene.yaml").exists());
    let inspected = ["frames.csv", "frames.parquet"].map(|name| {
        let text = said(&run(&["inspect", name, "--format", "json"]));
        let document: serde_json::Value = serde_json::from_str(&text).unwrap();
        document["sheets"][0]["columns"].clone()
    });
    assert_eq!(inspected[0], inspected[1]);
    // It is of one recording, and never written over the log.
    let refused = |args: &[&str], wanted: &str| {
        let output = run(args);
        assert_eq!(output.status.code(), Some(2));
        assert!(complained(&output).contains(wanted), "{}", complained(&output));
    };
    refused(&["analyze", "log.csv", "--frames", "log.csv"], "is an input of this command");
    refused(&["analyze", "log.csv", "frames.csv", "--frames", "all.csv"], "written for one recording");
    refused(&["analyze", "log.csv", "--frames", "all.json"], "expected .csv or .parquet");
    refused(&["analyze", "log.csv", "--frames", "all.csv", "--signals", "nar"], "did you mean `near`?");
    assert!(!folder.path().join("all.csv").exists());
}
