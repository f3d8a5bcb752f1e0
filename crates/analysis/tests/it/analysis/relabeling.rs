//! Relabeling rules one by one: patterns, durations, trails, the bound.

use super::build::*;
use teachtree_analysis::{Analysis, MAX_ROUNDS, TrackId};
use teachtree_base::hands::Side;
use teachtree_base::units::Dimension;
use teachtree_language::rules::{RelabelKind, Rules};

/// The relabeled segments of the right hand.
fn after(rules: &Rules, text: &str) -> String {
    names(&one_hand(rules, text).tracks[0].relabeled)
}

fn trails(analysis: &Analysis) -> Vec<String> {
    let changed = analysis.tracks[0].relabeled.iter().filter(|segment| !segment.by.is_empty());
    changed
        .map(|segment| format!("{} was {} by {}", segment.primitive, segment.was.join(" "), segment.by.join("; ")))
        .collect()
}

#[test]
fn a_single_segment_between_two_others() {
    let mut rules = bare(0.0);
    between(&mut rules, "", "Slide", "Approach", "Grasp", "Grasp");
    assert_eq!(after(&rules, "Approach 5 Slide 5 Grasp 5"), "Approach Grasp");
    assert_eq!(after(&rules, "Approach 5 Slide 5 Turn 5 Grasp 5"), "Approach Slide Turn Grasp", "no run was asked for");
    assert_eq!(after(&rules, "Slide 5 Grasp 5"), "Slide Grasp", "there is nothing before it");
    assert_eq!(after(&rules, "Approach 5 Slide 5"), "Approach Slide", "there is nothing after it");
}

#[test]
fn a_run_is_as_long_as_it_can_be() {
    let mut rules = bare(0.0);
    between(&mut rules, "", "Slide Turn Grasp +", "Grasp Move", "Grasp Release", "Grasp");
    assert_eq!(after(&rules, "Move 5 Slide 5 Turn 5 Slide 5 Release 5"), "Move Grasp Release");
    // A neighbor that is one of the labels ends the run when nothing farther out does.
    assert_eq!(after(&rules, "Approach 5 Grasp 5 Slide 5 Turn 5 Release 5"), "Approach Grasp Release");
    assert_eq!(after(&rules, "Move 5 Turn 5 Grasp 5 Slide 5 Approach 5"), "Move Grasp Slide Approach");
}

#[test]
fn shorter_counts_the_run_as_a_whole() {
    let mut rules = bare(0.0);
    between(&mut rules, "", "Place Slide + < 0.25", "Translate", "Translate", "Translate");
    assert_eq!(after(&rules, "Translate 5 Place 12 Slide 12 Translate 5"), "Translate");
    assert_eq!(after(&rules, "Translate 5 Place 12 Slide 13 Translate 5"), "Translate Place Slide Translate");
}

#[test]
fn a_sequence_takes_the_longest_match() {
    let mut rules = bare(0.0);
    sequence(&mut rules, "MainGrasp(left), EqualGrasp MainGrasp *, MainGrasp(right)", "Pass");
    let text =
        "Translate 5 MainGrasp(left) 5 EqualGrasp 5 MainGrasp(right) 5 MainGrasp(left) 5 MainGrasp(right) 5 Release 5";
    assert_eq!(after(&rules, text), "Translate Pass Release");
    assert_eq!(after(&rules, "MainGrasp(left) 5 MainGrasp(right) 5"), "Pass");
    assert_eq!(
        after(&rules, "MainGrasp(right) 5 EqualGrasp 5 MainGrasp(left) 5"),
        "MainGrasp(right) EqualGrasp MainGrasp(left)"
    );
    assert_eq!(after(&rules, "MainGrasp(left) 5 EqualGrasp 5 Release 5"), "MainGrasp(left) EqualGrasp Release");

    let mut rules = bare(0.0);
    sequence(&mut rules, "Push +, Turn *", "Push");
    assert_eq!(after(&rules, "Turn 5 Push 5 Turn 5 Push 5 Slide 5"), "Turn Push Slide");
    // What may all be left out matches nothing rather than nothing everywhere.
    let mut rules = bare(0.0);
    sequence(&mut rules, "Push *, Turn *", "Slide");
    assert_eq!(after(&rules, "Move 5 Turn 5 Move 5"), "Move Slide Move");
}

#[test]
fn the_time_belongs_to_the_surviving_label_and_the_trail_is_kept() {
    let mut rules = bare(0.0);
    between(&mut rules, "", "Slide", "Approach", "Grasp", "Grasp");
    become_(&mut rules, "", "Turn Slide", "Press");
    let analysis = one_hand(&rules, "Approach 5 Slide 5 Grasp 5 Turn 5 Slide 5");
    let track = &analysis.tracks[0];
    let times: Vec<_> = track.relabeled.iter().map(|s| (s.primitive.as_str(), s.start_s, s.end_s)).collect();
    assert_eq!(times, [("Approach", 0.0, 0.05), ("Grasp", 0.05, 0.15), ("Press", 0.15, 0.25)]);
    assert_eq!(
        trails(&analysis),
        [
            "Grasp was Slide Grasp by Slide between Approach and Grasp becomes Grasp",
            "Press was Turn Slide by Turn Slide become Press",
        ]
    );
    assert_eq!(names(&track.segments), "Approach Slide Grasp Turn Slide", "the raw segments are kept");
}

#[test]
fn several_rules_leave_their_names_in_order() {
    let mut rules = bare(0.0);
    // The second rule makes the first one possible: they go round until nothing changes.
    between(&mut rules, "", "Press", "Grasp", "Translate", "Grasp");
    become_(&mut rules, "", "Turn", "Press");
    let analysis = one_hand(&rules, "Grasp 5 Turn 5 Translate 5");
    assert_eq!(
        trails(&analysis),
        ["Grasp was Grasp Turn by Turn become Press; Press between Grasp and Translate becomes Grasp"]
    );
}

#[test]
fn rules_for_a_task_leave_other_tasks_alone() {
    let text = "Move 5 Approach 5 Trace 5 Push 5 Trace 5 Release 5 Move 5 Approach 5 Trace 5 Push 5 Trace 5 Insert 5 Release 5";
    assert_eq!(
        after(&chapter(), &text.replace(" 5", " 10")),
        "Move Approach Trace Release Move Approach Trace Push Trace Insert Release"
    );
}

#[test]
fn rules_that_undo_each_other_are_stopped_and_reported() {
    let mut rules = bare(0.0);
    become_(&mut rules, "", "Slide", "Turn");
    become_(&mut rules, "", "Turn", "Slide");
    become_(&mut rules, "", "Press", "Push");
    let analysis = one_hand(&rules, "Move 5 Slide 5 Press 10");
    assert_eq!(names(&analysis.tracks[0].relabeled), "Move Slide Push");
    let [issue] = &analysis.issues[..] else { panic!("{:?}", analysis.issues) };
    assert_eq!((issue.kind.name(), issue.start_s, issue.end_s), ("relabeling_stopped", 0.0, 0.2));
    assert_eq!(
        issue.message,
        format!(
            "relabeling was stopped after {MAX_ROUNDS} rounds, when these rules still changed labels: \
             `Slide become Turn`, `Turn become Slide`"
        )
    );
}

#[test]
fn a_bound_on_the_way_asks_how_far_the_target_goes() {
    let mut rules = bare(0.0);
    between(&mut rules, "", "Push < 0.02", "Approach", "Release", "Approach");
    let RelabelKind::Between { shorter: Some(limit), .. } = &mut rules.relabels[0].kind else { panic!("no bound") };
    limit.dimension = Dimension::LENGTH;
    // The target goes 1 mm in each frame.
    let relabeled = |text: &str| {
        let analysis = one_hand(&rules, text);
        names(&analysis.track(TrackId::Hand(Side::Right)).unwrap().relabeled)
    };
    assert_eq!(relabeled("Move 5 Approach 5 Push 20 Release 5"), "Move Approach Release");
    assert_eq!(relabeled("Move 5 Approach 5 Push 22 Release 5"), "Move Approach Push Release");
    // A log that does not say where the target is fulfills no such bound.
    let unknown = run(&rules, &[("right", "Move 5 Approach 5 Push 20 Release 5")]);
    assert_eq!(names(&unknown.track(TrackId::Hand(Side::Right)).unwrap().relabeled), "Move Approach Push Release");
}
