//! Maps of names, and truths made of columns and label files.

use super::build::RIGHT;
use teachtree_analysis::TrackId;
use teachtree_analysis::score::{KnownNames, NameMap, Span, Truth};
use teachtree_base::hands::Side;
use teachtree_base::recording::{Event, Recording};
use teachtree_logs::read::labels::{Interval, LabelKind, Labels};

fn known() -> KnownNames {
    let names = |names: &[&str]| names.iter().map(|name| (*name).to_string()).collect();
    KnownNames {
        primitives: names(&["Move", "Approach", "Grasp", "separate"]),
        tasks: names(&["pick"]),
        ..KnownNames::default()
    }
}

fn recording(columns: &[(&str, &str)]) -> Recording {
    let rows = columns[0].1.split(' ').count();
    let mut recording =
        Recording { time: (0..rows).map(|row| row as f64).collect::<Vec<f64>>(), ..Recording::default() };
    for (name, texts) in columns {
        let texts = texts.split(' ').map(|text| if text == "-" { String::new() } else { text.to_string() }).collect();
        recording.labels.insert((*name).to_string(), texts);
    }
    recording
}

fn printed(spans: &[Span]) -> String {
    spans.iter().map(|span| format!("{} {}–{} ", span.name(), span.start_s, span.end_s)).collect()
}

#[test]
fn a_column_is_runs_of_names_and_an_empty_cell_is_not_known() {
    let truth = Truth::of_recording(&recording(&[("right.label", "Move Move - Grasp Grasp")]), &NameMap::default());
    let tracks = truth.unwrap().tracks;
    assert_eq!(tracks.len(), 1);
    assert_eq!((tracks[0].who, printed(&tracks[0].primitives)), (RIGHT, "Move 0–2 Grasp 3–5 ".into()));
    assert_eq!(tracks[0].tasks, None);
}

#[test]
fn an_empty_cell_of_both_hands_is_not_coordination() {
    let truth = Truth::of_recording(&recording(&[("both.label", "- - Pass -")]), &NameMap::default()).unwrap();
    assert_eq!(
        (truth.tracks[0].who, printed(&truth.tracks[0].primitives)),
        (TrackId::Both, "separate 0–2 Pass 2–3 separate 3–4 ".into())
    );
}

#[test]
fn no_label_is_not_truth() {
    assert_eq!(Truth::of_recording(&recording(&[("right.label", "- - -")]), &NameMap::default()), None);
    assert_eq!(Truth::of_recording(&Recording::default(), &NameMap::default()), None);
}

#[test]
fn tasks_are_runs_too_and_their_events_part_equal_ones() {
    let mut recording =
        recording(&[("right.label", "Move Move Move Move Move"), ("right.task", "pick pick pick - push")]);
    let tasks = |recording: &Recording| {
        printed(Truth::of_recording(recording, &NameMap::default()).unwrap().tracks[0].tasks.as_ref().unwrap())
    };
    assert_eq!(tasks(&recording), "pick 0–3 push 4–5 ");
    let event = |time_s, kind: &str, hand: &str| Event {
        time_s,
        kind: kind.into(),
        subjects: vec![hand.into(), "pick".into()],
    };
    recording.events = vec![
        event(0.0, "task_started", "right"),
        event(1.0, "task_started", "left"),
        event(1.0, "phase_started", "right"),
        event(1.5, "task_started", "right"),
    ];
    assert_eq!(tasks(&recording), "pick 0–2 pick 2–3 push 4–5 ");
    // A recording in which nothing was done says so.
    recording.labels["right.task"].iter_mut().for_each(String::clear);
    assert_eq!(tasks(&recording), "");
}

#[test]
fn maps_are_yaml_or_pairs() {
    let yaml = NameMap::read("S1: [Move, Approach]\n2: Grasp\nS9: mask\n", "map.yaml").unwrap();
    assert_eq!(yaml, NameMap::of_pairs("S1=Move|Approach, 2=Grasp,S9=mask").unwrap());
    yaml.check(&known(), "map.yaml").unwrap();
    assert_eq!(yaml.get("2"), Some(&["Grasp".to_string()][..]));
    assert_eq!(yaml.get("S9"), Some(&[][..]));
    assert_eq!(yaml.get("S3"), None);
    let truth = Truth::of_recording(&recording(&[("right.label", "S1 2 2 S9 S9 Grasp")]), &yaml).unwrap();
    assert_eq!(printed(&truth.tracks[0].primitives), "Move|Approach 0–1 Grasp 1–3 Grasp 5–6 ");
}

#[test]
fn maps_that_cannot_be_meant_are_refused() {
    let pairs = ["S1", "S1=", "=Move", "S1=Move|mask", "S1=Move,S1=Grasp", "S1=Grap", "S1=Wave"];
    let refused = |text: &str| {
        let map = NameMap::of_pairs(text).and_then(|map| map.check(&known(), "--map"));
        format!("{text}\n  {}\n", map.unwrap_err())
    };
    let yaml = ["S1: 3", "- S1", "S1: []", "S1: Move\nS1: Grasp"];
    let refused_yaml =
        |text: &str| format!("{}\n  {}\n", text.replace('\n', "; "), NameMap::read(text, "map.yaml").unwrap_err());
    let printed: Vec<String> = pairs.map(refused).into_iter().chain(yaml.map(refused_yaml)).collect();
    insta::assert_snapshot!(printed.concat());
}

#[test]
fn unknown_names_are_refused() {
    let labels = |name: &str, kind, track: Option<TrackId>| Labels {
        file: "labels.csv".into(),
        intervals: vec![Interval { place: "row 7".into(), track, kind, name: name.into(), start_s: 0.0, end_s: 1.0 }],
        ..Labels::default()
    };
    let truth =
        |name: &str, kind, track| Truth::of_labels(&labels(name, kind, track), None, &NameMap::default(), &known());
    let printed = [
        truth("Grasq", LabelKind::Primitive, Some(RIGHT)),
        truth("S1", LabelKind::Primitive, Some(RIGHT)),
        truth("Move", LabelKind::Task, Some(RIGHT)),
        truth("Move", LabelKind::Primitive, None),
    ];
    insta::assert_snapshot!(printed.map(|truth| format!("{}\n", truth.unwrap_err())).concat());
    assert_eq!(truth("pick", LabelKind::Task, Some(TrackId::Hand(Side::Left))).unwrap().tracks.len(), 1);
}
