//! Tasks that the rules declare as failures: `is failure`.

use crate::program::{all_said, demonstrate, said, teachtree_in};
use serde_json::{Value, json};
use std::path::Path;
use teachtree::{Log, Rules};
use teachtree_language as language;

/// A recording with a push, a carry and a slide. The carry and the three of them together are failures.
const RULES: &str = "use \"contact.rules\"
task dropped = Move .. Release with Translate without Push  is failure  before pick_and_place
task clear_table = push, dropped, slide is failure
task push_off = push
";

fn recorded() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    demonstrate("several_tasks", &[], folder.path().join("several.csv"));
    std::fs::write(folder.path().join("mine.rules"), RULES).unwrap();
    folder
}

fn run(folder: &Path, args: &[&str]) -> String {
    let output = teachtree_in(folder, args);
    assert!(output.status.success(), "{}", all_said(&output));
    said(&output)
}

#[test]
fn tasks_and_composites_state_that_they_are_failures() {
    let folder = recorded();
    let run = |args: &[&str]| run(folder.path(), args);
    let found: Value =
        serde_json::from_str(&run(&["analyze", "several.csv", "--rules", "mine.rules", "--format", "json"])).unwrap();
    let track = &found["tracks"][0];
    let outcomes = |spans: &Value| -> Vec<(String, Value)> {
        let spans = spans.as_array().unwrap().iter();
        spans.map(|span| (span["task"].as_str().unwrap().to_string(), span["failure"].clone())).collect()
    };
    let expected = [("push", Value::Null), ("dropped", json!(true)), ("slide", Value::Null)];
    assert_eq!(outcomes(&track["tasks"]), expected.map(|(task, failure)| (task.to_string(), failure)));
    assert_eq!(outcomes(&track["composites"]), [("clear_table".to_string(), json!(true))]);

    let text = run(&["analyze", "several.csv", "--rules", "mine.rules"]);
    let line = |name: &str| text.lines().find(|line| line.trim_start().starts_with(name)).unwrap();
    assert!(line("dropped").contains("   a failure; also pick_and_place"), "{text}");
    assert!(line("clear_table").ends_with("made of push, dropped, slide; a failure"), "{text}");
    assert!(!line("push").contains("failure") && !line("slide").contains("failure"), "{text}");

    let explained =
        |form: &str| run(&["explain", "several.csv", "--rules", "mine.rules", "--at", "5s", "--format", form]);
    assert!(explained("text").contains(" s, a failure\n    part 2 of 3 of clear_table"), "{}", explained("text"));
    let explained: Value = serde_json::from_str(&explained("json")).unwrap();
    assert!(explained.to_string().contains("\"task\":\"dropped\",\"failure\":true"), "{explained}");

    let live = run(&["live", "several.csv", "--rules", "mine.rules", "--no-labels", "--format", "json"]);
    let events: Vec<Value> = live.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let of =
        |kind: &str, task: &str| events.iter().rfind(|event| event["event"] == kind && event["task"] == task).unwrap();
    assert_eq!(of("task", "dropped")["failure"], true);
    assert_eq!(of("task", "push")["failure"], Value::Null);
    assert_eq!(of("composite", "clear_table")["failure"], true);

    let checked = run(&["check", "mine.rules"]);
    assert!(checked.contains("10 tasks and 2 made of tasks (2 are failures)"), "{checked}");
}

#[test]
fn the_library_returns_which_tasks_are_failures() {
    let folder = recorded();
    let log = Log::open(folder.path().join("several.csv")).unwrap();
    let rules = Rules::options().file(folder.path().join("mine.rules")).for_log(&log).unwrap();
    assert_eq!(rules.failures().collect::<Vec<_>>(), ["dropped", "clear_table"]);
    let analysis = rules.analyze(&log).unwrap();
    let outcomes: Vec<_> = analysis.tasks().into_iter().map(|task| (task.name(), task.is_failure())).collect();
    assert_eq!(outcomes, [("push", false), ("dropped", true), ("slide", false)]);
    let failed: Vec<_> =
        analysis.tracks().flat_map(|track| track.composites()).map(|it| (it.name(), it.is_failure())).collect();
    assert_eq!(failed, [("clear_table", true)]);
    assert!(analysis.tasks()[1].to_string().contains("; a failure"), "{}", analysis.tasks()[1]);
}

/// What was handled without the keys of a task is neither a success nor a failure.
#[test]
fn an_unknown_task_is_neither() {
    let folder = recorded();
    let rules = "use \"contact.rules\"\nprimitive Never is Translate\n\
                 relabel { Push, Translate, Place, Slide become Grasp }\n";
    std::fs::write(folder.path().join("blind.rules"), rules).unwrap();
    let found = run(folder.path(), &["analyze", "several.csv", "--rules", "blind.rules", "--format", "json"]);
    let found: Value = serde_json::from_str(&found).unwrap();
    let tasks = found["tracks"][0]["tasks"].as_array().unwrap();
    assert!(
        !tasks.is_empty() && tasks.iter().all(|task| task["task"] == "unknown" && task.get("failure").is_none()),
        "{found}"
    );
}

/// The mark is after everything except `before`.
#[test]
fn the_mark_is_read_and_kept_by_the_formatter() {
    let text = "\
use \"contact.rules\"
task lost   = Move .. Release with Push without Grasp, joined  is failure  before push
task jammed = Move .. Release with Press is failure before pick_and_press
task row    = lost+, jammed is failure
task plain  = Move .. Release with Turn before turn_screw
";
    assert_eq!(language::format::format(text).unwrap(), text);
    let untidy = text.replace("is failure", "is   failure").replace("\ntask", "\n   task");
    assert_eq!(language::format::format(&untidy).unwrap(), text);
    let rules = language::load_text("mine.rules", text).rules.unwrap();
    let failure = |name: &str| rules.tasks.iter().find(|task| task.name == name).unwrap().failure;
    assert!(failure("lost") && failure("jammed") && !failure("plain") && !failure("push"));
    assert!(rules.composites[0].failure);
    // The order is that of the same tasks without the mark.
    let unmarked = language::load_text("mine.rules", &text.replace("is failure", "")).rules.unwrap();
    let names = |rules: &language::Rules| rules.tasks.iter().map(|task| task.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&rules), names(&unmarked));
    assert!(unmarked.tasks.iter().all(|task| !task.failure) && !unmarked.composites[0].failure);
}
