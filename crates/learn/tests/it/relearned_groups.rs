//! Which groups count for a change of a written file. The labels do not come from the engine: each test says how right the guards are.

use crate::relearned::{NAME, cycles, loaded, names, written};
use crate::synthetic::Synthetic;
use teachtree_learn::{Demonstration, LabeledSpan, MOST_RUNS, RelearnedRules, relearn};

/// The guard of the first choice of a label, behind any label before it.
fn guard<'a>(text: &'a str, label: &str) -> &'a str {
    let end = format!("=> {label}");
    let head = text.lines().find_map(|line| line.split_once(&end)).map_or("", |(head, _)| head);
    head.rsplit("=>").next().unwrap_or("").trim()
}

/// Learns `text` again. `share` is the share of a true interval that rules with a text give its label: of that text, the group of the recording, the label
/// and the number of the interval; `None` if they cannot run.
fn relearned(
    text: &str,
    recordings: &[Synthetic],
    share: &(dyn Fn(&str, usize, usize, usize) -> Option<f64> + Sync),
    most_runs: usize,
) -> RelearnedRules {
    let rules = loaded(text).unwrap_or_else(|| panic!("{text}"));
    let file = rules.sources.files.iter().position(|file| file.name == NAME).unwrap() as u32;
    let demonstrations: Vec<Demonstration> = recordings.iter().map(Synthetic::demonstration).collect();
    let truths: Vec<Vec<LabeledSpan>> = demonstrations.iter().map(|it| it.tracks[0].spans.clone()).collect();
    let run = |text: &str| {
        loaded(text)?;
        let of_recording = |(recording, spans): (&Synthetic, &Vec<LabeledSpan>)| {
            let shorter = |(at, span): (usize, &LabeledSpan)| {
                let share = share(text, recording.group, span.label, at)?;
                Some(LabeledSpan { end_s: span.start_s + share * (span.end_s - span.start_s), ..*span })
            };
            Some(vec![spans.iter().enumerate().map(shorter).collect::<Option<_>>()?])
        };
        recordings.iter().zip(&truths).map(of_recording).collect()
    };
    relearn(&demonstrations, &names(), (&rules, file), (&run, most_runs), &|_| ()).unwrap()
}

const THREE_GUARDS: &str = "  not closed => Wait\n  taken => PickUp\n  closed => Hold\n  else => Wait\n";

/// The interval of a label is right if its guard reads `high`.
fn reads_high(text: &str, label: usize) -> f64 {
    if guard(text, &names()[label]).contains("high") { 1.0 } else { 0.3 }
}

#[test]
fn a_search_that_stops_early_says_so_and_its_figures_are_of_all_groups() {
    let (text, recordings) = (written(THREE_GUARDS), cycles(3));
    let share = |text: &str, _: usize, label: usize, _: usize| Some(reads_high(text, label));
    let all = relearned(&text, &recordings, &share, MOST_RUNS);
    assert_eq!((all.changes.len(), all.is_cut, all.obstacle()), (3, false, None), "{all:#?}");
    assert_eq!(all.extent("a.rules"), format!("tried {} versions of a.rules", all.runs));
    let few = relearned(&text, &recordings, &share, 5);
    assert!(few.is_cut && few.changes.is_empty() && few.text == text, "{few:#?}");
    assert_eq!(few.candidates[1].f1.to_bits(), few.candidates[0].f1.to_bits());
    assert_eq!(few.obstacle(), Some("the search stopped early"));
    let extent = few.extent("a.rules");
    assert!(
        extent.starts_with("the search stopped after ") && extent.ends_with("some changes were not tried"),
        "{extent}"
    );
}

/// Only the last guard is to be changed, and by one of its first candidates. The versions suffice for some candidates of each guard and number.
#[test]
fn a_search_that_stops_early_tries_all_guards_and_uses_the_best_version() {
    let guards = "  not closed => Wait\n  taken => PickUp\n  closed and high => Hold\n  else => Wait\n";
    let (text, recordings) = (written(guards), cycles(3));
    let share = |text: &str, _: usize, label: usize, _: usize| {
        Some(if label == 1 && guard(text, "Hold") != "high" { 0.3 } else { 1.0 })
    };
    let found = relearned(&text, &recordings, &share, 60);
    assert!(found.is_cut && found.obstacle().is_none(), "{found:#?}");
    let texts: Vec<&[String; 2]> = found.changes.iter().map(|change| &change.texts).collect();
    assert_eq!(texts, [&["closed and high".to_string(), "high".to_string()]], "{found:#?}");
    assert!(found.extent("a.rules").starts_with("the search stopped after "), "{found:#?}");
}

#[test]
fn a_change_whose_groups_cannot_be_measured_does_not_stay() {
    let (text, recordings) = (written(THREE_GUARDS), cycles(3));
    // Versions with two of the changes run, but not those of Hold and PickUp.
    let share = |text: &str, _: usize, label: usize, _: usize| {
        let changed = [0, 1, 2].map(|label| reads_high(text, label) > 0.5);
        (changed != [false, true, true]).then(|| reads_high(text, label))
    };
    let found = relearned(&text, &recordings, &share, MOST_RUNS);
    assert!(found.changes.is_empty() && found.text == text, "{found:#?}");
    assert_eq!(found.obstacle(), Some("on held-out groups, no change gains more than one standard error"));
}

/// `not closed` suits two groups, and is a bit worse for the third one: without one of the two, it is worse for too many. `closed` suits half of the intervals
/// of all groups, so both of the two gain by it while they are held out.
#[test]
fn another_change_at_the_place_is_no_evidence() {
    let text = written("  not closed => Wait\n  high => PickUp\n  closed => Hold\n  else => Wait\n");
    let share = |text: &str, group: usize, label: usize, at: usize| {
        let guard = guard(text, "PickUp");
        Some(match (label, guard.contains("not closed"), guard.contains("closed"), group) {
            (0 | 1, ..) | (2, true, _, 0 | 1) => 1.0,
            (_, true, _, _) => 0.32,
            (_, _, true, _) if at.is_multiple_of(2) => 1.0,
            _ => 0.4,
        })
    };
    let found = relearned(&text, &cycles(3), &share, MOST_RUNS);
    assert!(found.changes.is_empty() && found.text == text, "{found:#?}");
}

/// A tree over both hands reads new conditions of one hand as signals; their names are free, each of its own.
#[test]
fn conditions_of_a_tree_over_both_hands_have_names_of_their_own() {
    let text = written("  both.closed => Wait\n  either.closed => PickUp\n  both.high => Hold\n  else => Wait\n")
        .replace(
            "signal closed = gripper.closed",
            "signal closed = gripper.closed\n  signal pick_up_if_1 = gripper.closed",
        )
        .replace("for each hand, settle", "for left, right, settle");
    let recordings: Vec<Synthetic> = (0..6).map(|at| Synthetic::of_both(at, at as usize / 2)).collect();
    let share = |text: &str, _: usize, label: usize, _: usize| {
        let is_new = |name: &&str| {
            guard(text, "PickUp").contains(&format!("either.{name}")) && text.contains(&format!("signal {name} = "))
        };
        let new = ["pick_up_if_2", "pick_up_if_3"].into_iter().filter(is_new).count();
        Some(if label == 2 { [0.1, 0.6, 1.0][new] } else { 1.0 })
    };
    let found = relearned(&text, &recordings, &share, MOST_RUNS);
    assert_eq!(found.changes.len(), 1, "{found:#?}");
    for name in ["pick_up_if_2", "pick_up_if_3"] {
        assert!(found.changes[0].texts[1].contains(&format!("either.{name}")), "{found:#?}");
        assert_eq!(found.text.matches(&format!("signal {name} = ")).count(), 1, "{}", found.text);
    }
    assert!(loaded(&found.text).is_some(), "{}", found.text);
}

#[test]
fn two_changes_on_a_line_share_a_comment() {
    let text = written("  not closed => Wait    taken => PickUp\n  closed => Hold\n  else => Wait\n");
    let share = |text: &str, _: usize, label: usize, _: usize| Some(reads_high(text, label));
    let found = relearned(&text, &cycles(3), &share, MOST_RUNS);
    assert_eq!(found.changes.len(), 3, "{found:#?}");
    let line = found.text.lines().find(|line| line.contains("=> PickUp")).unwrap();
    assert_eq!(
        (line.matches("// learned: ").count(), line.matches("held out in 3 groups: ").count()),
        (1, 2),
        "{line}"
    );
}
