//! What is written of an analysis: JSON, CSV, timeline.

use super::build::*;
use teachtree_analysis::Analysis;
use teachtree_analysis::csv::csv;
use teachtree_analysis::json::{Meta, json};
use teachtree_analysis::number::number;
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_report::text::{Style, text};

fn meta() -> Meta {
    Meta {
        log: "demo.csv".into(),
        name: "demo".into(),
        zero_stamp_s: -0.5,
        binding: None,
        rules: vec!["rules/contact.rules".into()],
        hand_model: None,
        digest: "5a17".into(),
        params: vec![("touch_on".into(), "0.1 N".into())],
    }
}

/// The chapter's recording: pick-and-follow, then push-and-trace, which the recording cuts.
fn experiment() -> Analysis {
    let mut analysis = one_hand(
        &chapter(),
        "Move 120 Approach 80 Slide 12 Grasp 60 Translate 150 Follow 140 Place 40 Release 50 \
         Move 130 Approach 70 Push 90 Trace 80 Push 7 Trace 60",
    );
    analysis.issues.push(Issue {
        kind: IssueKind::from_name("stuck_sensor").unwrap(),
        start_s: 1.0,
        end_s: 2.5,
        channel: "right.ring.force".into(),
        message: "the sensor kept one value for 1.5 s; the interval is marked and the value is used".into(),
    });
    analysis
}

#[test]
fn numbers_have_six_decimals_at_most() {
    let printed = [0.0, -0.0, 1.0, 0.1 + 0.2, -1e-9, 1e-7, 2e-6, 1234567.25, 1e15, -3.5, f64::NAN].map(number);
    assert_eq!(printed, ["0", "0", "1", "0.3", "0", "0", "0.000002", "1234567.25", "1000000000000000", "-3.5", "null"]);
}

#[test]
fn json_of_the_experiment() {
    let text = json(&experiment(), &meta());
    serde_json::from_str::<serde_json::Value>(&text).unwrap();
    insta::assert_snapshot!(text);
}

#[test]
fn csv_of_the_experiment() {
    insta::assert_snapshot!(csv(&experiment(), &meta()).unwrap());
}

#[test]
fn timelines_of_the_experiment() {
    let of = |color, unicode, width| text(&experiment(), &meta(), Style { color, unicode, width });
    insta::assert_snapshot!("timeline_plain_120", of(false, true, 120));
    insta::assert_snapshot!("timeline_ascii_80", of(false, false, 80));
    insta::assert_snapshot!("timeline_color_80", of(true, true, 80).replace('\x1b', "^"));
    assert!(of(false, false, 80).is_ascii());
    for (width, unicode) in [(0, true), (57, false), (80, true), (200, true)] {
        let wide = of(false, unicode, width);
        let longest = wide.lines().map(|line| line.chars().count()).max().unwrap();
        assert!(longest <= width.max(80), "{longest} columns of {width}:\n{wide}");
    }
}

/// Stamps of a clock that was started hours ago.
#[test]
fn a_blank_separates_a_long_time_from_the_name_before_it() {
    let mut analysis = experiment();
    for task in analysis.tracks.iter_mut().flat_map(|track| &mut track.tasks) {
        task.task = "a_task_whose_name_is_the_longest_of_the_list".into();
        task.start_s += 1e4;
    }
    let listed = text(&analysis, &meta(), Style { color: false, unicode: true, width: 100 });
    let of_task = |line: &&str| line.contains("a_task_whose_name") && line.contains(" – ");
    let lines: Vec<&str> = listed.lines().filter(of_task).collect();
    let starts = |line: &str| line.split(" – ").next()?.split_whitespace().last()?.parse::<f64>().ok();
    assert!(lines.len() > 1 && lines.iter().all(|line| starts(line).is_some()), "{listed}");
}

/// A grasp after the task, whose recording ends before anything else comes of it. A hand that only moves has no entry.
#[test]
fn segments_outside_tasks_are_listed_between_them() {
    let task = "Move 120 Approach 80 Grasp 60 Translate 150 Place 40 Release 50";
    let listed = |after: &str| {
        let analysis = one_hand(&chapter(), &format!("{task} {after}"));
        assert_eq!(analysis.tracks[0].tasks.len(), 1);
        text(&analysis, &meta(), Style { color: false, unicode: true, width: 100 })
    };
    let grasp = listed("Move 50 Approach 70 Grasp 60");
    let (before, after) = grasp.split_once("\n  no task\n").unwrap();
    assert!(before.contains("pick_and_place "), "{grasp}");
    let names: Vec<&str> = after.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert_eq!(names, ["Move", "Approach", "Grasp"], "{grasp}");
    assert!(!listed("Move 50 Approach 70").contains("no task"));
}

#[test]
fn a_timeline_without_anything() {
    let rules = chapter();
    let nothing = one_hand(&rules, "Move 10");
    insta::assert_snapshot!(
        "timeline_nothing",
        text(&nothing, &meta(), Style { color: false, unicode: true, width: 80 })
    );
    let empty = teachtree_analysis::analyze(&rules, &frames(&[]), &[]);
    insta::assert_snapshot!("timeline_empty", text(&empty, &meta(), Style { color: false, unicode: true, width: 80 }));
}
