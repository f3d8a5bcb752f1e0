//! Label files: what is read, and what is said of a bad one.

use std::path::{Path, PathBuf};
use teachtree_base::hands::{Side, TrackId};
use teachtree_logs::read::labels::{LabelKind, Labels, read, table};

/// When the five rows of a log were, s; the third repeats the stamp of the second.
const ROW_TIME: [f64; 5] = [0.0, 0.1, 0.1, 0.2, 0.4];

fn reading(text: &str) -> Result<Labels, String> {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join("labels.csv");
    std::fs::write(&path, text).unwrap();
    let folder = format!("{}/", folder.path().display());
    read(&path, Path::new("a.csv"), &ROW_TIME).map_err(|error| error.to_string().replace(&folder, ""))
}

fn intervals(text: &str) -> Vec<(String, f64, f64)> {
    reading(text).unwrap().intervals.into_iter().map(|label| (label.name, label.start_s, label.end_s)).collect()
}

#[test]
fn times_are_seconds() {
    let labels = reading("track,label,start_s,end_s,who\nright,Grasp,0.5,1.25,me\nleft,Move,0,2,you\n").unwrap();
    let printed: Vec<_> = labels
        .intervals
        .iter()
        .map(|label| (label.track, label.name.as_str(), label.start_s, label.end_s, label.place.as_str()))
        .collect();
    assert_eq!(
        printed,
        [
            (Some(TrackId::Hand(Side::Left)), "Move", 0.0, 2.0, "row 3"),
            (Some(TrackId::Hand(Side::Right)), "Grasp", 0.5, 1.25, "row 2")
        ]
    );
}

#[test]
fn frames_are_rows_of_the_log_from_0_and_the_end_is_not_included() {
    let wanted = [("S1".to_string(), 0.0, 0.1), ("S2".to_string(), 0.1, 0.4)];
    assert_eq!(intervals("start_frame,end_frame,surgeme,success\n0,1,S1,1\n2,4,S2,0\n"), wanted);
    // One past the last row is when the last row ends: one step after it began.
    let rows = intervals("start_row,end_row_excl,t_start,t_last,label\n3,5,0.2,0.4,7\n");
    assert_eq!(rows, [("7".to_string(), 0.2, 0.6000000000000001)]);
}

/// Frames that include the last one, the same counted from 1, seconds of the first and the last frame, and a gap of four frames, which is one.
#[test]
fn gaps_of_a_frame_are_boundaries() {
    let boundaries = |text: &str| {
        let row_time: Vec<f64> = (0..100).map(|row| f64::from(row) / 10.0).collect();
        let labels = table(text.as_bytes(), Path::new("labels.csv"), Path::new("a.csv"), &row_time).unwrap();
        labels.intervals.iter().map(|label| (label.start_s, label.end_s)).collect::<Vec<_>>()
    };
    assert_eq!(
        boundaries("label,start_frame,end_frame\nA,0,9\nB,10,19\nC,20,29\n"),
        [(0.0, 1.0), (1.0, 2.0), (2.0, 2.9)]
    );
    assert_eq!(boundaries("label,start_frame,end_frame\nA,1,10\nB,11,20\n"), [(0.1, 1.1), (1.1, 2.0)]);
    assert_eq!(boundaries("label,start_s,end_s\nA,0,0.9\nB,1,1.9\n"), [(0.0, 1.0), (1.0, 1.9)]);
    assert_eq!(boundaries("label,start_s,end_s\nA,0,0.9\nB,1.3,1.9\n"), [(0.0, 0.9), (1.3, 1.9)]);
    // Labels of two tracks do not meet.
    let two = "track,label,start_s,end_s\nleft,A,0,0.9\nright,B,1,1.9\n";
    assert_eq!(boundaries(two), [(0.0, 0.9), (1.0, 1.9)]);
}

#[test]
fn spreadsheets_with_decimal_commas_and_milliseconds_are_read() {
    let wanted = [("Move".to_string(), 0.0, 0.25), ("Grasp".to_string(), 0.25, 2.0)];
    assert_eq!(intervals("label;start_s;end_s\nMove;0,00;0,25\nGrasp;0,25;2\n"), wanted);
    assert_eq!(intervals("label\tstart_s\tend_s\nMove\t0.00\t0.25\nGrasp\t0.25\t2\n"), wanted);
    assert_eq!(intervals("label,start_ms,end_ms\nMove,0,250\nGrasp,250,2000\n"), wanted);
}

/// BORIS, ELAN as text, durations, clocks, and a spreadsheet with empty rows.
#[test]
fn tables_of_other_programs_are_read() {
    let wanted = [("Move".to_string(), 0.0, 3.5), ("Grasp".to_string(), 3.5, 65.25)];
    let boris = "Observation id,Media duration (s),Subject,Behavior,Behavior type,Start (s),Stop (s),Duration (s)\n\
        o1,70,right,Move,STATE,0.0,3.5,3.5\no1,70,right,Grasp,STATE,3.5,65.25,61.75\n";
    assert_eq!(intervals(boris), wanted);
    let elan =
        "Tier\tBegin Time - ss.msec\tEnd Time - ss.msec\tAnnotation\nright\t0.0\t3.5\tMove\nright\t3.5\t65.25\tGrasp\n";
    assert_eq!(intervals(elan), wanted);
    assert_eq!(intervals("label,start_s,duration_s\nMove,0,3.5\nGrasp,3.5,61.75\n"), wanted);
    assert_eq!(intervals("Label,Start_s,End_s\nMove,00:00.0,00:03.5\n,,\nGrasp,0:00:03.5,00:01:05.25\n,,\n"), wanted);
    let error = reading("label,start_s\nMove,0\n").unwrap_err();
    assert!(error.contains("expected end_s"), "{error}");
}

#[test]
fn rows_without_name_or_length_label_nothing() {
    assert_eq!(intervals("label,start_s,end_s\n,0,1\nGrasp,1,1\n"), []);
}

#[test]
fn tasks_are_labels_too() {
    let labels = reading("kind,label,start_s,end_s\ntask,pick,0,4\nprimitive,Move,0,1\ntask,pick,4,8\n").unwrap();
    let kinds: Vec<_> = labels.intervals.iter().map(|label| (label.kind, label.start_s)).collect();
    // Two tasks of one name that meet are two.
    assert_eq!(kinds, [(LabelKind::Primitive, 0.0), (LabelKind::Task, 0.0), (LabelKind::Task, 4.0)]);
}

#[test]
fn time_with_two_names_is_not_labeled() {
    let labels = reading("label,start_s,end_s\nA,0,2\nA,1,3\nB,2.5,5\nC,3.5,4\n").unwrap();
    let printed: Vec<_> =
        labels.intervals.iter().map(|label| (label.name.as_str(), label.start_s, label.end_s)).collect();
    assert_eq!(printed, [("A", 0.0, 2.0), ("A", 2.0, 2.5), ("B", 3.0, 3.5), ("B", 4.0, 5.0)]);
    assert!((labels.contradicted_s - 1.0).abs() < 1e-9);
}

#[test]
fn what_is_wrong_is_said_with_its_place() {
    let crowd = format!("label,start_s,end_s\n{}", "A,0,1\n".repeat(101));
    let long = format!("label,start_s,end_s\n{},0,1\n", "A".repeat(201));
    let cases = [
        ("no label", "who,start_s,end_s\nA,0,1\n"),
        ("no end", "label,start_s\nA,0\n"),
        ("no frames", "label,start_frame,last_frame\nA,0,1\n"),
        ("misspelt", "lable,start_s,end_s\nA,0,1\n"),
        ("no time", "label,start_s,end_s\nA,0,soon\n"),
        ("not finite", "label,start_s,end_s\nA,0,inf\n"),
        ("no row", "label,start_frame,end_frame\nA,0,1.5\n"),
        ("beyond the log", "label,start_frame,end_frame\nA,2,9\n"),
        ("backwards", "label,start_s,end_s\nA,2,1\n"),
        ("strange track", "track,label,start_s,end_s\nmiddle,A,0,1\n"),
        ("strange kind", "kind,label,start_s,end_s\nguess,A,0,1\n"),
        ("too few cells", "label,start_s,end_s\nA,0\n"),
        ("too many at once", &crowd),
        ("too long", &long),
    ];
    let printed: String =
        cases.iter().map(|(name, text)| format!("{name}\n  {}\n", reading(text).unwrap_err())).collect();
    insta::assert_snapshot!(printed);
}
