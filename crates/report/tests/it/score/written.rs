//! What is written of a score: tables, JSON, the picture.

use super::build::*;
use teachtree_analysis::score::{Row, Score, Stage, TrackTruth, Truth, json};
use teachtree_report::score::{picture, text};

/// Two recordings: one with a confused task and a late grasp, and a correct one with a false alarm.
fn example() -> Score {
    let recording = |log: &str, (primitives, tasks): (&str, &str), (result, found): (&str, &str)| {
        let truth = TrackTruth { who: RIGHT, primitives: spans(primitives), tasks: Some(spans(tasks)) };
        let mut row = rows(&Truth { tracks: vec![truth] }, &with_tasks(result, found)).remove(0);
        row.log = log.into();
        row
    };
    let first = recording(
        "seeds/pick_and_follow/0001.csv",
        ("Move 1 Approach 1 Grasp 1 Translate 2 Follow 1 Place 0.5 Release 0.5 Move 1", "pick_and_follow 7"),
        ("Move 1.02 Approach 1 Slide 0.1 Grasp 0.9 Translate 2.98 Place 0.5 Release 0.5 Move 1", "pick_and_place 7"),
    );
    let second = recording(
        "seeds/pick_and_place/a_rather_long_name_of_a_recording_0002.csv",
        ("Move 1 Approach 1 Grasp 1 Translate 2 Place 0.5 Release 0.5 Move 2", "pick_and_place 6"),
        ("Move 1 Approach 1 Grasp 1.004 Translate 1.996 Place 0.5 Release 0.5 Move 2", "pick_and_place 6 slide 2"),
    );
    Score::new(Stage::Relabeled, vec![first, second])
}

#[test]
fn tables_of_an_example() {
    let text = text(&[example()], &meta(""));
    assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
    insta::assert_snapshot!(text);
}

#[test]
fn json_of_an_example() {
    let text = json(&[example()], &meta(""));
    let parsed: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(parsed["schema"], "teachtree.score/1");
    insta::assert_snapshot!(text);
}

#[test]
fn nothing_known_is_written_as_nothing() {
    let nothing = Score::new(Stage::Raw, vec![Row { log: "log.csv".into(), who: RIGHT, tally: tally("", "Move 1") }]);
    insta::assert_snapshot!(text(std::slice::from_ref(&nothing), &meta("")));
    let written = json(std::slice::from_ref(&nothing), &meta(""));
    let parsed: serde_json::Value = serde_json::from_str(&written).unwrap();
    assert!(parsed["results"][0]["all"]["accuracy"].is_null() && parsed["results"][0]["all"]["tasks"].is_null());
    assert!(picture(&nothing, &meta("")).ends_with("</svg>\n"));
}

#[test]
fn the_picture_stands_alone_and_is_well_formed() {
    let drawn = picture(&example(), &meta(""));
    assert_eq!(drawn, picture(&example(), &meta("")), "same input, same bytes");
    for outside in ["href", "src=", "@import", "url("] {
        assert!(!drawn.contains(outside), "the picture reaches for {outside}");
    }
    assert!(drawn.contains("Follow found as Translate: 1 s, 100.0 %"));
    assert!(drawn.contains("pick_and_follow found as pick_and_place: 1, 100.0 %"));
    assert!(drawn.contains("Grasp: 2 of 2 found, median 60.0 ms"), "{drawn}");
    let mut open: Vec<&str> = Vec::new();
    for tag in drawn.split('<').skip(1) {
        let (tag, _) = tag.split_once('>').unwrap();
        let name = tag.split([' ', '/']).find(|part| !part.is_empty()).unwrap();
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
}
