//! Tasks that are made of tasks, in recordings of several tasks.

use crate::program::{all_said, demonstrate, said, teachtree_in};
use proptest::prelude::*;
use serde_json::{Value, json};
use std::path::Path;
use teachtree_analysis::TaskSpan;
use teachtree_analysis::composites::Composites;
use teachtree_language as language;

/// A recording of the shipped operator that pushes, carries and slides, beside rules that say what that is.
fn several(rules: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    demonstrate("several_tasks", &[], folder.path().join("several.csv"));
    std::fs::write(folder.path().join("tour.rules"), format!("use \"contact.rules\"\n{rules}")).unwrap();
    folder
}

fn run(folder: &Path, args: &[&str]) -> String {
    let output = teachtree_in(folder, args);
    assert!(output.status.success(), "{}", all_said(&output));
    said(&output)
}

#[test]
fn a_recording_of_several_tasks_is_one_task_of_tasks() {
    let folder = several("task clear_table = push, pick_and_place, slide\n");
    let analyze =
        |form: &str| run(folder.path(), &["analyze", "several.csv", "--rules", "tour.rules", "--format", form]);
    let found: Value = serde_json::from_str(&analyze("json")).unwrap();
    let track = &found["tracks"][0];
    let (composite, tasks) = (&track["composites"][0], &track["tasks"]);
    assert_eq!(composite["task"], "clear_table");
    assert_eq!(composite["tasks"], json!([1, 2, 3]));
    assert_eq!(composite["parts"], json!(["push", "pick_and_place", "slide"]));
    assert_eq!([&composite["start_s"], &composite["end_s"]], [&tasks[0]["start_s"], &tasks[2]["end_s"]]);
    assert_eq!([&composite["start_row"], &composite["end_row"]], [&tasks[0]["start_row"], &tasks[2]["end_row"]]);
    // A row of the table, which is read back as labels.
    let table = analyze("csv");
    let row = table.lines().find(|line| line.contains(",composite,")).unwrap();
    assert!(row.starts_with("several.csv,right,composite,clear_table,,,0,") && row.contains(",1 2 3,,,"), "{row}");
    std::fs::write(folder.path().join("labels.csv"), &table).unwrap();
    let scored = run(folder.path(), &["score", "several.csv", "--labels", "labels.csv", "--rules", "tour.rules"]);
    assert!(scored.contains("100"), "{scored}");
    // A lane of the timeline, and a line of the list.
    let text = analyze("text");
    assert!(text.contains("\ncomposite   ▏clear_table..."), "{text}");
    assert!(text.contains("made of push, pick_and_place, slide"), "{text}");
    let report = folder.path().join("report.html");
    run(folder.path(), &["analyze", "several.csv", "--rules", "tour.rules", "--report", "report.html"]);
    let page = std::fs::read_to_string(report).unwrap();
    assert!(page.contains("clear_table") && page.contains("made of push, pick_and_place, slide"));
    // Where a moment is explained.
    let explained = run(folder.path(), &["explain", "several.csv", "--rules", "tour.rules", "--at", "5s"]);
    assert!(explained.contains("part 2 of 3 of clear_table 0.000 – "), "{explained}");
    // Live, behind the last of its tasks, and the same.
    let live = run(folder.path(), &["live", "several.csv", "--rules", "tour.rules", "--no-labels", "--format", "json"]);
    let events: Vec<Value> = live.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let last = events.iter().rposition(|event| event["event"] == "task" && event["final"] == true).unwrap();
    let found = events.iter().position(|event| event["event"] == "composite").unwrap();
    assert!(found > last, "{live}");
    for key in ["task", "parts", "start_s", "end_s"] {
        assert_eq!(events[found][key], composite[key], "{key}");
    }
}

/// A person put two nuts on pegs.
#[test]
fn the_nut_assembly_of_a_person_is_one_task() {
    let folder = tempfile::tempdir().unwrap();
    let rules = "use \"contact.rules\"\ntask nut_assembly = peg_in_hole+\n";
    std::fs::write(folder.path().join("nuts.rules"), rules).unwrap();
    let demos = Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite");
    let [log, binding] =
        ["SawyerNutAssembly_demo_1.csv", "sawyer_nut_assembly.binding.yaml"].map(|name| demos.join(name));
    let (log, binding) = (log.to_str().unwrap(), binding.to_str().unwrap());
    let args = ["analyze", log, "--binding", binding, "--rules", "nuts.rules", "--format", "json"];
    let found: Value = serde_json::from_str(&run(folder.path(), &args)).unwrap();
    let composites = &found["tracks"][0]["composites"];
    assert_eq!(composites.as_array().unwrap().len(), 1, "{composites}");
    assert_eq!(composites[0]["parts"], json!(["peg_in_hole", "peg_in_hole"]));
}

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
