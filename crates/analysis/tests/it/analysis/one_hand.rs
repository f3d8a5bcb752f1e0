//! The chapter's experiments (docs/sources.md) and tasks, one hand: raw sequence, task, relabeled sequence.

use super::build::*;
use teachtree_analysis::{TrackId, analyze};
use teachtree_base::hands::Side;

/// Leaves of ten frames each, but for those with a length of their own: `Move Slide:4 Grasp`.
fn evenly(text: &str) -> String {
    let words = text.split_whitespace().map(|word| match word.split_once(':') {
        Some((name, length)) => format!("{name} {length}"),
        None => format!("{word} 10"),
    });
    words.collect::<Vec<_>>().join(" ")
}

fn case(raw: &str, wanted: &str) {
    let analysis = one_hand(&chapter(), &evenly(raw));
    let track = analysis.track(TrackId::Hand(Side::Right)).unwrap();
    let names_only = raw.split_whitespace().map(|word| word.split(':').next().unwrap()).collect::<Vec<_>>().join(" ");
    assert_eq!(names(&track.segments), names_only, "raw segments are what the trees gave");
    let found: Vec<String> =
        track.tasks.iter().map(|task| format!("{}: {}", task.task, names(&task.segments))).collect();
    assert_eq!(found.join("; "), wanted, "raw: {raw}");
}

#[test]
fn every_task_of_the_chapter() {
    for (raw, wanted) in [
        (
            "Move Approach Slide Grasp Translate Follow Place Release",
            "pick_and_follow: Move Approach Grasp Translate Follow Place Release",
        ),
        ("Move Approach Push Trace Push Trace Release", "push_and_trace: Move Approach Push Trace Release"),
        (
            "Move Approach Grasp Translate Place Slide Release",
            "pick_and_place: Move Approach Grasp Translate Place Release",
        ),
        ("Move Approach Grasp Translate Insert Release", "peg_in_hole: Move Approach Grasp Translate Insert Release"),
        (
            "Move Approach Grasp Pullout Translate Place Release",
            "peg_pullout_from_hole: Move Approach Grasp Pullout Translate Place Release",
        ),
        ("Move Approach Grasp Turn Insert Turn Pullout Turn Release", "turn_screw: Move Approach Grasp Turn Release"),
        ("Move Approach Grasp Slide:30 Grasp Release", "slide: Move Approach Grasp Slide Grasp Release"),
        (
            "Move Approach Grasp Translate Press:20 Translate Place Release",
            "pick_and_press: Move Approach Grasp Translate Press Translate Place Release",
        ),
        ("Move Approach Grasp Turn:30 Grasp Release", "turn_screw: Move Approach Grasp Turn Grasp Release"),
        (
            "Move Approach Grasp Slide Press Follow Release",
            "pick_and_follow: Move Approach Grasp Slide Press Follow Release",
        ),
        ("Move Approach Push:30 Release", "push: Move Approach Push Release"),
        (
            "Move Approach Move Approach Grasp Translate Place Release",
            "pick_and_place: Move Approach Move Approach Grasp Translate Place Release",
        ),
        // A Press that begins a Follow is part of it (X2).
        (
            "Move Approach Grasp Translate Press Follow Place Release",
            "pick_and_follow: Move Approach Grasp Translate Follow Place Release",
        ),
        // A bump on the way is carrying (X1); an object nudged before it is grasped is grasping.
        (
            "Move Approach Push Grasp Translate Place Slide Translate Place Release",
            "pick_and_place: Move Approach Grasp Translate Place Release",
        ),
    ] {
        case(raw, wanted);
    }
}

#[test]
fn a_key_with_a_condition_requires_it() {
    // 10 frames travel 10 mm and turn 0.1 rad, less than the keys ask for.
    case("Move Approach Push Release", "unknown: Move Approach Push Release");
    case("Move Approach Grasp Slide Grasp Release", "unknown: Move Approach Grasp Slide Grasp Release");
    case("Move Approach Grasp Turn Grasp Release", "unknown: Move Approach Grasp Turn Grasp Release");
    case("Move Approach Grasp Press:14 Grasp Release", "unknown: Move Approach Grasp Press Grasp Release");
    case("Move Approach Grasp Press:15 Grasp Release", "pick_and_press: Move Approach Grasp Press Grasp Release");
    // What turns a little in many segments turns far in all of them.
    case("Move Approach Grasp Turn Grasp Turn Release", "turn_screw: Move Approach Grasp Turn Grasp Turn Release");
}

#[test]
fn without_the_channel_a_key_does_not_hold_and_it_is_said() {
    let rules = chapter();
    let analysis = run(&rules, &[("right", "Move 10 Approach 10 Push 30 Release 10")]);
    assert_eq!(tasks(&analysis, Side::Right), ["0.00–0.60 unknown: Move Approach Push Release"]);
    let said: Vec<_> = analysis.issues.iter().map(|issue| (issue.kind.name(), issue.channel.as_str())).collect();
    assert_eq!(said, [("missing_channel", "right.target.position"), ("missing_channel", "right.target.spin")]);
    assert!(analysis.issues[0].message.contains("push, slide"), "{}", analysis.issues[0].message);
}

#[test]
fn several_tasks_follow_each_other_and_keep_other_keys() {
    let analysis = one_hand(
        &chapter(),
        &evenly("Move Approach Grasp Translate Follow Place Release Move Approach Push:30 Trace Release Move"),
    );
    assert_eq!(
        tasks(&analysis, Side::Right),
        [
            "0.00–0.70 pick_and_follow (pick_and_place): Move Approach Grasp Translate Follow Place Release",
            "0.70–1.40 push_and_trace (push): Move Approach Push Trace Release",
        ]
    );
}

#[test]
fn moving_about_is_not_a_task_and_an_aborted_touch_has_no_name() {
    case("Move", "");
    case("Move Approach Move Approach Move", "");
    case("Move Approach Release Move", "unknown: Move Approach Release");
    case(
        "Move Approach Grasp Release Move Approach Grasp Translate Place Release",
        "unknown: Move Approach Grasp Release; pick_and_place: Move Approach Grasp Translate Place Release",
    );
}

#[test]
fn a_second_touch_without_moving_away_is_a_second_task() {
    case(
        "Move Approach Grasp Translate Place Release Grasp Translate Place Release Move",
        "pick_and_place: Move Approach Grasp Translate Place Release; pick_and_place: Grasp Translate Place Release",
    );
}

#[test]
fn strokes_of_turn_are_one_task_on_one_target_only() {
    let rules = chapter();
    let text = "Move 10 Approach 10 Grasp 10 Turn 30 Insert 5 Release 10 Grasp 10 Turn 30 Release 10 Grasp 10 Release 10 \
                Grasp 10 Turn 30 Release 10 Move 10 Approach 10 Grasp 10 Turn 30 Release 10";
    let analysis = one_hand(&rules, text);
    assert_eq!(
        tasks(&analysis, Side::Right),
        [
            "0.00–1.95 turn_screw (peg_in_hole): Move Approach Grasp Turn Release Grasp Turn Release Grasp Release Grasp Turn Release",
            "1.95–2.65 turn_screw: Move Approach Grasp Turn Release",
        ]
    );

    // From frame 80 on another target.
    let leaves = leaves(&rules, 0, &[("right", text)]);
    let mut frames = moving(std::slice::from_ref(&leaves.frames));
    frames.channels.clear();
    frames.columns.clear();
    column(&mut frames, "target", |frame, _| if frame < 80 { 0.0 } else { 1.0 });
    column(&mut frames, "target.spin", |_, _| 0.01 * RATE_HZ);
    let analysis = analyze(&rules, &frames, &[leaves]);
    let found: Vec<String> = tasks(&analysis, Side::Right);
    assert_eq!(found.len(), 3, "{found:?}");
    assert_eq!(found[0], "0.00–0.75 turn_screw (peg_in_hole): Move Approach Grasp Turn Release");
}

#[test]
fn a_stroke_does_not_swallow_another_task() {
    case(
        "Move Approach Grasp Turn:30 Release Grasp Translate Place Release",
        "turn_screw: Move Approach Grasp Turn Release; pick_and_place: Grasp Translate Place Release",
    );
}

#[test]
fn tasks_cut_by_the_ends_are_kept_and_marked() {
    let rules = chapter();
    let cut = |text: &str| tasks(&one_hand(&rules, &evenly(text)), Side::Right);
    assert_eq!(cut("Translate Place Release Move"), ["0.00–0.30 [start] pick_and_place: Translate Place Release"]);
    assert_eq!(cut("Move Approach Grasp Translate"), ["0.00–0.40 pick_and_place [end]: Move Approach Grasp Translate"]);
    assert_eq!(cut("Translate"), ["0.00–0.10 [start] pick_and_place [end]: Translate"]);
    assert_eq!(cut("Grasp Release Move"), ["0.00–0.20 [start] unknown: Grasp Release"]);
    // Nothing can be said about what was cut off before it showed a key.
    assert!(cut("Move Approach Grasp").is_empty());
}

#[test]
fn a_gap_cuts_a_task_in_two() {
    let rules = chapter();
    let stretches = [0..40, 60..100];
    let parts = [
        leaves(&rules, 0, &[("right", "Move 10 Approach 10 Grasp 10 Translate 10")]),
        leaves(&rules, 60, &[("right", "Translate 20 Place 10 Release 10")]),
    ];
    let analysis = analyze(&rules, &moving(&stretches), &parts);
    assert_eq!(
        tasks(&analysis, Side::Right),
        [
            "0.00–0.40 pick_and_place [end]: Move Approach Grasp Translate",
            "0.60–1.00 [start] pick_and_place: Translate Place Release",
        ]
    );
}

#[test]
fn settling_counts_samples_at_the_rate() {
    // 50 ms at 100 Hz are 5 frames: a Slide of 4 is not a segment, one of 5 is, and a short one at the end is dropped.
    let rules = chapter();
    let raw = |text: &str| names(&one_hand(&rules, text).tracks[0].segments);
    assert_eq!(raw("Move 10 Slide 4 Move 10"), "Move");
    assert_eq!(raw("Move 10 Slide 5 Move 10"), "Move Slide Move");
    assert_eq!(raw("Move 10 Slide 4"), "Move");
}

#[test]
fn an_empty_recording_has_no_tracks() {
    let analysis = analyze(&chapter(), &frames(&[]), &[]);
    assert!(analysis.tracks.is_empty());
    assert_eq!(analysis.end_s, 0.0);
}
