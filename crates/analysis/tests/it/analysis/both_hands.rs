//! Two hands: the experiments E2 and E3 of docs/sources.md, and coordination that is given back.

use super::build::*;
use teachtree_analysis::{Segment, TrackId};
use teachtree_base::hands::Side;
use teachtree_language::rules::{RelabelKind, TaskId};

fn both(
    analysis: &teachtree_analysis::Analysis,
    of: impl Fn(&teachtree_analysis::Track) -> &Vec<Segment>,
) -> Vec<String> {
    let show = |segment: &Segment| format!("{:.2}–{:.2} {}", segment.start_s, segment.end_s, segment.primitive);
    of(analysis.track(TrackId::Both).unwrap()).iter().map(show).collect()
}

/// The left hand picks up and passes to the right, which places. The trees of the hands run on under the coordination.
const HAND_OVER: [(&str, &str); 3] = [
    ("left", "Move 10 Approach 10 Grasp 10 Translate 60 Release 20 Move 50"),
    ("right", "Move 40 Approach 15 Grasp 5 Translate 50 Place 20 Release 20 Move 10"),
    ("both", "- 55 MainGrasp(left) 12 EqualGrasp 10 MainGrasp(right) 13 - 70"),
];

#[test]
fn e2_a_hand_over_is_a_pass_and_two_tasks() {
    let analysis = run(&chapter(), &HAND_OVER);
    let raw = |side| names(&analysis.track(TrackId::Hand(side)).unwrap().segments);
    assert_eq!(
        raw(Side::Left),
        "Move Approach Grasp Translate MainGrasp(left) EqualGrasp MainGrasp(right) Release Move"
    );
    assert_eq!(
        raw(Side::Right),
        "Move Approach MainGrasp(left) EqualGrasp MainGrasp(right) Translate Place Release Move"
    );
    assert_eq!(tasks(&analysis, Side::Left), ["0.00–1.10 pick_and_place: Move Approach Grasp Translate Pass Release"]);
    assert_eq!(tasks(&analysis, Side::Right), ["0.00–1.50 pick_and_place: Move Approach Pass Translate Place Release"]);
    assert_eq!(
        both(&analysis, |track| &track.segments),
        ["0.55–0.67 MainGrasp(left)", "0.67–0.77 EqualGrasp", "0.77–0.90 MainGrasp(right)"]
    );
    assert_eq!(both(&analysis, |track| &track.relabeled), ["0.55–0.90 Pass"]);
    let pass = &analysis.track(TrackId::Hand(Side::Left)).unwrap().tasks[0].segments[4];
    assert_eq!(pass.was, ["MainGrasp(left)", "EqualGrasp", "MainGrasp(right)"]);
    assert_eq!(pass.by, ["(MainGrasp or EqualGrasp)+ … becomes Pass"]);
}

#[test]
fn lifting_together_is_not_a_pass() {
    let analysis = run(
        &chapter(),
        &[
            ("left", "Move 10 Approach 20 Grasp 50 Release 10 Move 10"),
            ("right", "Move 15 Approach 15 Grasp 50 Release 10 Move 10"),
            ("both", "- 30 EqualGrasp 20 MainGrasp(right) 20 EqualGrasp 10 - 20"),
        ],
    );
    let carried = "carry_together: Move Approach EqualGrasp MainGrasp(right) EqualGrasp Release";
    assert_eq!(tasks(&analysis, Side::Left), [format!("0.00–0.90 {carried}")]);
    assert_eq!(tasks(&analysis, Side::Right), [format!("0.00–0.90 {carried}")]);
}

#[test]
fn e3_a_short_fit_is_a_fluctuation_and_the_insertion_stays() {
    let own = "Move 10 Approach 10 Grasp 10 Translate 120 Place 10 Release 10";
    let analysis = run(
        &chapter(),
        &[("left", own), ("right", own), ("both", "- 30 Translate 30 Fit 10 Translate 20 Fit 35 Insert 25 - 20")],
    );
    let inserted = "0.00–1.70 peg_in_hole (fit pick_and_place): Move Approach Grasp Translate Fit Insert Place Release";
    assert_eq!(tasks(&analysis, Side::Left), [inserted]);
    assert_eq!(tasks(&analysis, Side::Right), [inserted]);
    // The translation before the fit is coordination: it is not given back.
    assert_eq!(both(&analysis, |track| &track.relabeled), ["0.30–0.90 Translate", "0.90–1.25 Fit", "1.25–1.50 Insert"]);
}

#[test]
fn two_independent_carries_are_given_back_to_the_hands() {
    let rules = chapter();
    let tracks = [
        ("left", "Move 10 Approach 10 Grasp 10 Translate 60 Slide 10 Place 10 Release 10"),
        ("right", "Move 20 Approach 10 Grasp 20 Translate 40 Place 20 Release 10"),
        // The carries touch for a moment: the Fit is smoothed away first, then all of it is given back.
        ("both", "- 50 Translate 10 Fit 10 Translate 25 - 25"),
    ];
    let analysis = run(&rules, &tracks);
    let left = analysis.track(TrackId::Hand(Side::Left)).unwrap();
    assert_eq!(names(&left.segments), "Move Approach Grasp Translate Fit Translate Slide Place Release");
    assert_eq!(
        tasks(&analysis, Side::Left),
        ["0.00–1.20 pick_and_place: Move Approach Grasp Translate Slide Place Release"]
    );
    assert_eq!(
        tasks(&analysis, Side::Right),
        ["0.00–1.20 pick_and_place: Move Approach Grasp Translate Place Release"]
    );
    assert_eq!(both(&analysis, |track| &track.segments).len(), 3);
    assert!(both(&analysis, |track| &track.relabeled).is_empty());
    // The left hand's Slide begins when its own tree says so, not when the coordination ended.
    let slide = &left.relabeled[4];
    assert_eq!((slide.primitive.as_str(), slide.start_s, slide.end_s), ("Slide", 0.9, 1.0));
    let translate = &left.relabeled[3];
    assert_eq!(translate.was, ["Translate", "Fit", "Translate"]);
    assert_eq!(translate.by, ["Translate in both without Fit Insert Pullout Turn becomes separate"]);
}

#[test]
fn a_mirrored_recording_gives_the_mirrored_analysis() {
    let mirror = |text: &str| match text {
        "left" => "right".to_string(),
        "right" => "left".to_string(),
        text => text.replace("(left)", "(?)").replace("(right)", "(left)").replace("(?)", "(right)"),
    };
    let mirrored: Vec<(String, String)> = HAND_OVER.iter().map(|(track, text)| (mirror(track), mirror(text))).collect();
    let mirrored: Vec<(&str, &str)> = mirrored.iter().map(|(track, text)| (track.as_str(), text.as_str())).collect();
    let rules = chapter();
    let (one, other) = (run(&rules, &HAND_OVER), run(&rules, &mirrored));
    for side in Side::BOTH {
        assert_eq!(tasks(&one, side), tasks(&other, side.other()));
    }
    assert_eq!(both(&one, |track| &track.relabeled), both(&other, |track| &track.relabeled));
}

#[test]
fn a_flicker_of_coordination_is_settled_away() {
    let own = "Move 10 Approach 10 Grasp 10 Translate 60 Release 20";
    let analysis = run(&chapter(), &[("left", own), ("right", own), ("both", "- 40 Fit 4 - 66")]);
    assert!(both(&analysis, |track| &track.segments).is_empty());
    assert_eq!(names(&analysis.tracks[0].segments), "Move Approach Grasp Translate Release");
}

#[test]
fn a_rule_over_both_hands_may_be_for_one_task() {
    let mut rules = chapter();
    let at = |name: &str| rules.tasks.iter().position(|task| task.name == name).unwrap();
    let (carry, place) = (at("carry_together"), at("pick_and_place"));
    let pass = rules.relabels.iter().position(|rule| matches!(rule.kind, RelabelKind::BetweenInHands { .. })).unwrap();
    rules.relabels[pass].task = Some(TaskId(u32::try_from(place).unwrap()));
    // Without the Pass, both hands have carried together; so it is looked for in no task of the right name.
    let found = Side::BOTH.map(|side| tasks(&run(&rules, &HAND_OVER), side)[0].clone());
    assert!(found.iter().all(|task| task.contains("carry_together") && !task.contains("Pass")), "{found:?}");
    rules.tasks[carry].without = labels(&rules, "Translate");
    let found = Side::BOTH.map(|side| tasks(&run(&rules, &HAND_OVER), side)[0].clone());
    assert_eq!(found[0], "0.00–1.10 pick_and_place: Move Approach Grasp Translate Pass Release");
    assert_eq!(found[1], "0.00–1.50 pick_and_place: Move Approach Pass Translate Place Release");
}

/// A hand that carries, and one that comes near and touches; what the trees say of both.
const BRUSH: [(&str, &str); 3] = [
    ("left", "Move 20 Approach 60 Move 40"),
    ("right", "Move 5 Approach 5 Grasp 10 Translate 80 Place 10 Release 10"),
    ("both", "- 40 MainGrasp(right) 20 - 60"),
];

#[test]
fn a_rule_over_both_hands_gives_a_brush_back_to_them() {
    let mut rules = chapter();
    in_hands(&mut rules, "MainGrasp EqualGrasp", ["Translate", "Translate"], ["Approach", "Approach"], None);
    let analysis = run(&rules, &BRUSH);
    let of = |side| names(&analysis.track(TrackId::Hand(side)).unwrap().relabeled);
    assert_eq!(of(Side::Left), "Move Approach Move");
    assert_eq!(of(Side::Right), "Move Approach Grasp Translate Place Release");
    assert!(both(&analysis, |track| &track.relabeled).is_empty());
    assert_eq!(both(&analysis, |track| &track.segments), ["0.40–0.60 MainGrasp(right)"]);

    // A hand that takes hold of it does help.
    let helped = [("left", "Move 20 Approach 20 Grasp 20 Release 20 Move 40"), BRUSH[1], BRUSH[2]];
    assert_eq!(both(&run(&rules, &helped), |track| &track.relabeled), ["0.40–0.60 MainGrasp(right)"]);
}
