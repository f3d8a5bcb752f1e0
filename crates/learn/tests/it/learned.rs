//! Rule files that were learned, loaded and run by the engine.

use crate::synthetic::{RATE_HZ, Synthetic};
use proptest::prelude::*;
use rayon::ThreadPoolBuilder;
use teachtree_base::hands::{Side, TrackId};
use teachtree_engine::evaluator::evaluate;
use teachtree_engine::runs::{Run, settle};
use teachtree_language::graph::lower;
use teachtree_language::rules::{Rules, TreeScope};
use teachtree_language::{Request, load};
use teachtree_learn::{Demonstration, LearningResult, MOST_LINES, learn};

fn names() -> Vec<String> {
    ["Wait", "Hold", "PickUp"].map(String::from).to_vec()
}

fn learned(recordings: &[Synthetic]) -> LearningResult {
    let demonstrations: Vec<Demonstration> = recordings.iter().map(Synthetic::demonstration).collect();
    learn(&demonstrations, &names(), &|_| ()).unwrap()
}

fn refused(recordings: &[Synthetic], names: &[String]) -> String {
    let demonstrations: Vec<Demonstration> = recordings.iter().map(Synthetic::demonstration).collect();
    learn(&demonstrations, names, &|_| ()).unwrap_err().to_string()
}

fn loaded(text: &str) -> Rules {
    let request =
        Request { texts: vec![("learned.rules".into(), text.into())], needs_tree: true, ..Request::default() };
    let loaded = load(&request);
    assert!(loaded.diagnostics.is_empty(), "{text}\n{:?}", loaded.diagnostics);
    loaded.rules.unwrap()
}

/// The settled labels of each labeled stretch, as the engine has them by a rule file; frames count from the start of the stretch.
fn by_engine(text: &str, recordings: &[Synthetic]) -> Vec<Vec<Run>> {
    let rules = loaded(text);
    let graph = lower(&rules);
    let mut all = Vec::new();
    for recording in recordings {
        let scope = if recording.who == TrackId::Both { TreeScope::BothHands } else { TreeScope::EachHand };
        let settle_s = rules.tree(scope).unwrap().settle.as_ref().map_or(0.0, |settle| settle.value);
        let frames = recording.frames(&rules.channels);
        for leaves in evaluate(&graph, &frames).unwrap() {
            let start = leaves.frames.start;
            if recording.labels[leaves.frames.clone()].iter().all(Option::is_none) {
                continue;
            }
            let of_track = recording.who.side().map_or(&leaves.both, |side| &leaves.hands[&side]);
            let moved = |run: Run| Run { start: run.start - start, end: run.end - start, ..run };
            let settled = settle(of_track, (settle_s * RATE_HZ).round() as usize);
            all.push(settled.into_iter().map(moved).collect());
        }
    }
    all
}

fn cycles(make: impl Fn(u64, usize) -> Synthetic, groups: usize) -> Vec<Synthetic> {
    (0..2 * groups).map(|at| make(at as u64, at / 2)).collect()
}

#[test]
fn planted_rules_of_one_hand_are_found() {
    let recordings = cycles(Synthetic::cycles, 4);
    let learned = learned(&recordings);
    let chosen = &learned.candidates[learned.chosen];
    assert!(chosen.f1 > 0.99, "{learned:#?}");
    assert!(chosen.accuracy > 0.99, "{learned:#?}");
    assert_eq!(learned.boundaries.1, 3);
    assert!(learned.text.contains("closed"), "{}", learned.text);
    assert_eq!(by_engine(&learned.text, &recordings), learned.labels);
}

#[test]
fn planted_rules_of_either_hand_are_found() {
    let recordings = cycles(Synthetic::of_both, 4);
    let learned = learned(&recordings);
    assert!(learned.candidates[learned.chosen].f1 > 0.95, "{learned:#?}");
    assert!(learned.text.contains("either."), "{}", learned.text);
    assert_eq!(by_engine(&learned.text, &recordings), learned.labels);
}

#[test]
fn a_file_is_short_and_each_learned_line_has_its_evidence() {
    let recordings = cycles(Synthetic::cycles, 4);
    let text = learned(&recordings).text;
    assert!(text.lines().count() <= MOST_LINES, "{text}");
    let choices: Vec<&str> = text.lines().filter(|line| line.contains("_begins") && line.contains("=>")).collect();
    assert!(!choices.is_empty());
    for line in &choices {
        assert!(line.contains("// learned: "), "{line}");
    }
    // 48 cycles: each is begun by all but the first label, which the 8 recordings begin with.
    let pick_up = choices.iter().find(|line| line.contains("=> PickUp")).unwrap();
    assert!(pick_up.contains("48 boundaries of 4 groups, held out 48 of 48, median 0.0 s late"), "{text}");
}

/// The height since the beginning would tell the labels apart: a default of `gripper.closed` must not stand for it.
#[test]
fn a_file_needs_only_channels_that_the_recordings_have() {
    let mut recordings = cycles(Synthetic::cycles, 4);
    for (at, recording) in recordings.iter_mut().enumerate() {
        recording.has_gripper = false;
        for height in &mut recording.hands.get_mut(&Side::Right).unwrap().height {
            *height += 0.3 * at as f64;
        }
        for label in recording.labels.iter_mut().filter(|label| **label == Some(1)) {
            *label = Some(0);
        }
    }
    let text = learned(&recordings).text;
    assert!(!text.contains("closed"), "{text}");
}

/// With few groups the standard error is large; a rule or condition counts 0.2 points.
#[test]
fn a_simple_candidate_that_is_far_worse_is_not_chosen() {
    for seed in 0..4 {
        let make = |at: u64, group: usize| Synthetic::of_noise_of_one_hand(100 * seed + at, group);
        let learned = learned(&cycles(make, 2));
        let best = learned.candidates.iter().map(|candidate| candidate.f1).fold(0.0, f64::max);
        let chosen = &learned.candidates[learned.chosen];
        assert!(chosen.f1 >= best - 0.05, "{seed}: {:#?}", learned.candidates);
    }
}

/// The last person lifts less. The heights of all others say exactly where a label begins, with one threshold; the gripper says it in most cycles.
#[test]
fn a_guard_depends_on_no_single_threshold() {
    let make = |at: u64, group: usize| Synthetic::stairs(at, group, if group == 3 { 0.35 } else { 1.0 });
    let learned = learned(&cycles(make, 4));
    let searched = learned.candidates.iter().find(|candidate| candidate.name == "guards, searched").unwrap();
    assert!(searched.f1 > 0.95, "{} {:#?}", learned.text, learned.candidates);
}

/// The end of a segment is up to other rules.
#[test]
fn the_evidence_for_a_rule_is_about_its_own_boundaries() {
    let learned = learned(&cycles(Synthetic::of_chance_ends, 4));
    let line = learned.text.lines().find(|line| line.contains("=> Hold")).unwrap();
    assert!(line.contains("48 boundaries of 4 groups, held out 48 of 48, median 0.0 s late"), "{}", learned.text);
    assert!(learned.candidates[learned.chosen].f1 < 0.95, "{learned:#?}");
    // An open hand waits, also where it was not seen to pick up.
    assert!(learned.text.contains("not from(Wait) and wait_begins"), "{}", learned.text);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let recordings = cycles(Synthetic::of_both, 3);
    let with = |threads: usize| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| learned(&recordings))
    };
    let one = with(1);
    assert_eq!(one, with(4));
    assert_eq!(one, with(4));
}

/// Rules that are right already are not replaced.
#[test]
fn present_rules_that_are_better_stay() {
    let mut recordings = cycles(Synthetic::of_noise_of_one_hand, 4);
    for recording in &mut recordings {
        recording.present = Some(recording.labels.iter().map(|label| label.unwrap_or(0)).collect());
    }
    let good = learned(&recordings);
    assert!(!good.is_better(), "{good:#?}");
    assert!((good.candidates[0].f1 - 1.0).abs() < 1e-9, "{good:#?}");
    for recording in &mut recordings {
        recording.present = Some(vec![7; recording.labels.len()]);
    }
    let bad = learned(&recordings);
    assert!(bad.is_better(), "{bad:#?}");
    assert!(bad.candidates[0].f1 < 1e-9, "{bad:#?}");
}

#[test]
fn what_nothing_can_be_learned_from_is_refused() {
    let one_group: Vec<Synthetic> = (0..3).map(|seed| Synthetic::cycles(seed, 0)).collect();
    assert!(refused(&one_group, &names()).contains("are of 1 group, expected at least 2"));
    let two_groups = cycles(Synthetic::cycles, 2);
    assert!(refused(&two_groups, &names()[..1]).contains("the number of names is 1, expected 2 to 32"));
    let mut mixed = two_groups.clone();
    mixed[0] = Synthetic::of_both(0, 0);
    assert!(refused(&mixed, &names()).contains("of single hands and of both hands together"));
    let of_one = |made: Synthetic| Synthetic { who: TrackId::Both, ..made };
    let lacks: Vec<Synthetic> = two_groups.iter().cloned().map(of_one).collect();
    assert!(refused(&lacks, &names()).contains("measures one hand"));
    let constant = |made: Synthetic| Synthetic { labels: vec![Some(0); made.labels.len()], ..made };
    let constant: Vec<Synthetic> = two_groups.into_iter().map(constant).collect();
    assert!(refused(&constant, &names()).contains("no label follows another one"));
}

proptest! {
    // A case learns from six recordings.
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    /// Also of labels that no rule explains.
    #[test]
    fn a_file_gives_the_labels_that_the_learner_computed(seed in any::<u32>(), both in any::<bool>()) {
        let make = if both { Synthetic::of_noise_of_both } else { Synthetic::of_noise_of_one_hand };
        let recordings: Vec<Synthetic> = (0..6).map(|at| make(u64::from(seed) + at as u64, at / 2)).collect();
        let learned = learned(&recordings);
        prop_assert_eq!(by_engine(&learned.text, &recordings), learned.labels);
    }
}
