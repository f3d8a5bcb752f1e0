//! Tasks: which found task stands for which true one.

use super::build::*;
use teachtree_analysis::UNKNOWN;
use teachtree_analysis::score::{KnownNames, NONE, Sequences, Share, Tally, TrackTruth, Truth};

const WORK: &str = "Move 1 Grasp 1 Place 1 Release 1 Move 1 Push 1 Trace 1 Release 1";

fn tally(true_tasks: &str, tasks: &str) -> Tally {
    let truth = TrackTruth { who: RIGHT, primitives: spans(WORK), tasks: Some(spans(true_tasks)) };
    rows(&Truth { tracks: vec![truth] }, &with_tasks(WORK, tasks)).remove(0).tally
}

fn pairs(tally: &Tally) -> Vec<(&str, &str)> {
    tally.task_pairs().iter().map(|pair| (pair.truth.as_str(), pair.result.as_str())).collect()
}

#[test]
fn tasks_that_overlap_stand_for_each_other() {
    let tally = tally("pick 4 push 4", "pick 4.5 slide 3.5");
    assert_eq!(pairs(&tally), [("pick", "pick"), ("push", "slide")]);
    assert_eq!(tally.tasks_found(), Share { right: 1, of: 2 });
    assert_eq!(tally.false_tasks(), 0);
    let measures = tally.task_measures();
    assert_eq!(measures["pick"].found, Share { right: 1, of: 1 });
    assert_eq!(measures["pick"].named, Share { right: 1, of: 1 });
    assert_eq!(measures["push"].found, Share { right: 0, of: 1 });
    assert_eq!(measures["slide"].named, Share { right: 0, of: 1 });
}

#[test]
fn a_task_stands_for_one_only() {
    // Each of two halves overlaps the true task; the longer one stands for it.
    assert_eq!(pairs(&tally("pick 8", "pick 3 pick 5")), [("pick", "pick"), (NONE, "pick")]);
    assert_eq!(pairs(&tally("pick 3 pick 5", "pick 8")), [("pick", NONE), ("pick", "pick")]);
}

#[test]
fn what_is_named_where_nothing_is_counts_as_false() {
    let named = tally("", "pick 4 - 1 push 3");
    assert_eq!(pairs(&named), [(NONE, "pick"), (NONE, "push")]);
    assert_eq!(named.false_tasks(), 2);
    assert_eq!(named.tasks_found(), Share { right: 0, of: 0 });
    // Something was handled, and no task was named: that is not a false task.
    let unknown = tally("", "unknown 4");
    assert_eq!(pairs(&unknown), [(NONE, UNKNOWN)]);
    assert_eq!(unknown.false_tasks(), 0);
    assert!(unknown.task_measures().is_empty());
}

#[test]
fn nothing_is_said_of_tasks_that_are_not_in_the_truth() {
    let tally = rows(&truth(WORK), &with_tasks(WORK, "pick 4")).remove(0).tally;
    assert_eq!(tally.tasks, None);
}

#[test]
fn each_of_several_task_names_is_right() {
    assert_eq!(pairs(&tally("pick|push 4 pick|push 4", "push 4 slide 4")), [("push", "push"), ("pick|push", "slide")]);
}

#[test]
fn the_sequence_of_a_task_is_that_of_its_time() {
    let mut tally = tally("pick 4 push 4", "pick 4 push 4");
    assert_eq!(tally.task_pairs()[1].true_sequence.join(" "), "Move Push Trace Release");
    assert_eq!(tally.task_sequences(), Share { right: 2, of: 2 });
    let names = |names: &[&str]| names.iter().map(|name| (*name).to_string()).collect();
    let known = KnownNames {
        primitives: names(&["Move", "Approach", "Grasp", "Place", "Push", "Trace", "Release"]),
        tasks: names(&["pick", "push"]),
        ..KnownNames::default()
    };
    let expected = "pick: [Move Approach Grasp Place Release, Move Grasp Place Release]\npush: Move Push Release";
    Sequences::read(expected, "s.yaml", &known).unwrap().expect(&mut tally);
    assert_eq!(tally.task_sequences(), Share { right: 1, of: 2 });
    assert_eq!(tally.task_pairs()[1].true_sequence.join(" "), "Move Push Release");
    let refused = |text: &str| Sequences::read(text, "s.yaml", &known).unwrap_err().to_string();
    assert_eq!(refused("pik: Move"), "s.yaml: `pik` is not a task of the rules\n  help: did you mean `pick`?");
    assert_eq!(
        refused("pick: Move Gras"),
        "s.yaml: `Gras` in the sequence of `pick` is not a primitive of the rules\n  help: did you mean `Grasp`?"
    );
    assert!(refused("pick: Move\npick: Grasp").contains("the key `pick` occurs twice"));
    assert_eq!(refused("pick: []"), "s.yaml: the sequence of `pick` is empty");
    assert!(refused("pick: 3").contains("expected lines such as"), "{}", refused("pick: 3"));
}
