//! Tasks that are made of tasks.

use proptest::prelude::*;
use teachtree_analysis::TaskSpan;
use teachtree_analysis::composites::Composites;
use teachtree_language as language;

/// What is found in tasks of these names, each with the tasks that it is made of.
fn found(rules: &str, tasks: &[&str]) -> Vec<(String, std::ops::Range<usize>)> {
    let text = format!("use \"contact.rules\"\n{rules}");
    let loaded = language::load_text("tour.rules", &text);
    let mut composites = Composites::new(&loaded.rules.unwrap());
    let task = |name: &&str| TaskSpan { task: (*name).to_string(), ..TaskSpan::default() };
    let mut all: Vec<_> = tasks.iter().flat_map(|name| composites.push(&task(name))).collect();
    all.extend(composites.finish());
    all.into_iter().map(|found| (found.task, found.tasks)).collect()
}

#[test]
fn tasks_make_the_first_task_that_fits() {
    let rules = "task a = push, slide+, pick_and_press
        task b = push, slide
        task c = slide+\n";
    let (push, slide, press, other) = ("push", "slide", "pick_and_press", "pick_and_place");
    for (tasks, wanted) in [
        (vec![push, slide, slide, press], vec![("a", 0..4)]),
        // The run is not followed by its end: the next one fits.
        (vec![push, slide, slide, other], vec![("b", 0..2), ("c", 2..3)]),
        (vec![push, slide], vec![("b", 0..2)]),
        (vec![push, push, slide, press], vec![("a", 1..4)]),
        (vec![slide, slide, push], vec![("c", 0..2)]),
        (vec![press, push], vec![]),
        // A touch that came to nothing belongs to it between two of its tasks, not at its ends.
        (vec!["unknown", push, "unknown", slide, "unknown", press, "unknown"], vec![("a", 1..6)]),
        (vec![slide, "unknown", slide, "unknown", push], vec![("c", 0..3)]),
    ] {
        let wanted: Vec<_> = wanted.into_iter().map(|(name, tasks)| (name.to_string(), tasks)).collect();
        assert_eq!(found(rules, &tasks), wanted, "{tasks:?}");
    }
    // A run has an end, so that a log without one has too.
    let many = vec![slide; 2500];
    let runs: Vec<usize> = found("task c = slide+\n", &many).iter().map(|(_, tasks)| tasks.len()).collect();
    assert_eq!(runs, [1000, 1000, 500]);
    // What never ends is given up, and so are touches that came to nothing.
    let touches: Vec<&str> = [slide].into_iter().chain(std::iter::repeat_n("unknown", 20_000)).chain([push]).collect();
    assert_eq!(found("task d = slide, push\n", &touches), []);
    assert_eq!(found("task d = slide+, push\n", &vec![slide; 20_000]), []);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// What is found lies apart, and is one of the rules; what was decided before more came stays.
    #[test]
    fn what_is_found_lies_apart_and_is_what_the_rules_say(names in prop::collection::vec(0_usize..4, 0..24)) {
        let words = ["push", "slide", "pick_and_place", "unknown"];
        let tasks: Vec<&str> = names.iter().map(|at| words[*at]).collect();
        let rules = "task a = push, slide\ntask b = pick_and_place+\ntask c = slide+, push\n";
        let all = found(rules, &tasks);
        let mut end = 0;
        for (name, span) in &all {
            prop_assert!(span.start >= end && span.end <= tasks.len() && !span.is_empty());
            end = span.end;
            let own: Vec<&str> = tasks[span.clone()].iter().copied().filter(|name| *name != "unknown").collect();
            prop_assert!(own.first() == Some(&tasks[span.start]) && own.last() == Some(&tasks[span.end - 1]));
            let fits = match name.as_str() {
                "a" => own == ["push", "slide"],
                "b" => own.iter().all(|name| *name == "pick_and_place"),
                _ => own.last() == Some(&"push") && own[..own.len() - 1].iter().all(|name| *name == "slide"),
            };
            prop_assert!(fits, "{name} {own:?}");
        }
        let shorter = found(rules, &tasks[..tasks.len().saturating_sub(1)]);
        // The last one may have gone on.
        let kept = shorter.len().saturating_sub(1);
        prop_assert_eq!(&all[..kept.min(all.len())], &shorter[..kept]);
    }
}
