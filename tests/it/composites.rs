//! Tasks that are made of tasks, in recordings of several tasks.

use crate::program::{all_said, demonstrate, said, teachtree_in};
use serde_json::{Value, json};
use std::path::Path;

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
