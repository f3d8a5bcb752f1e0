//! Outcomes of recordings, by rules with a failure.

use crate::program::{all_said, demonstrate, said, teachtree_in};
use serde_json::Value;
use std::path::Path;

/// A recording of the shipped operator that pushes, carries and slides, beside rules by which sliding is a failure.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    demonstrate("several_tasks", &[], folder.path().join("several.csv"));
    let rules = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/outcomes/failures.rules");
    std::fs::copy(rules, folder.path().join("failures.rules")).unwrap();
    folder
}

/// The exit status, and what was printed.
fn run(folder: &Path, args: &[&str]) -> (i32, String) {
    let output = teachtree_in(folder, args);
    (output.status.code().unwrap(), all_said(&output))
}

fn outcome(folder: &Path, args: &[&str]) -> Value {
    let output = teachtree_in(folder, &[&["analyze", "several.csv", "--format", "json"], args].concat());
    serde_json::from_str::<Value>(&said(&output)).unwrap()["outcome"].clone()
}

#[test]
fn analyze_says_whether_a_recording_is_a_success() {
    let folder = folder();
    // These rules cannot show a failure.
    let unknown = outcome(folder.path(), &["--rules", "contact.rules"]);
    assert_eq!((&unknown["result"], &unknown["reasons"][0]["kind"]), (&"unknown".into(), &"no_criterion".into()));
    let (_, text) = run(folder.path(), &["analyze", "several.csv", "--rules", "contact.rules"]);
    assert!(!text.contains("outcome"), "{text}");
    assert_eq!(outcome(folder.path(), &[])["result"], "success");
    let success = outcome(folder.path(), &["--expect", "push, slide"]);
    assert_eq!((&success["result"], &success["attempts"]), (&"success".into(), &1.into()));
    let tasks: Vec<&Value> = success["reasons"].as_array().unwrap().iter().map(|reason| &reason["task"]).collect();
    assert_eq!(tasks, ["push", "pick_and_place", "slide"]);
    let failure = outcome(folder.path(), &["--rules", "failures.rules"]);
    assert_eq!(failure["result"], "failure");
    let reason = &failure["reasons"][0];
    assert_eq!([&reason["kind"], &reason["track"], &reason["task"]], ["failed", "right", "dragged"]);
    assert!(reason["start_s"].as_f64().unwrap() < reason["end_s"].as_f64().unwrap());
    // A failure alone does not change the exit status.
    let (status, text) = run(folder.path(), &["analyze", "several.csv", "--rules", "failures.rules"]);
    assert_eq!(status, 0);
    let line = text.lines().find(|line| line.starts_with("outcome ")).unwrap();
    assert!(line.starts_with("outcome failure: right dragged "), "{line}");
}

#[test]
fn expected_tasks_decide_the_exit_status() {
    let folder = folder();
    let analyze = |expect: &str| run(folder.path(), &["analyze", "several.csv", "--expect", expect]);
    assert_eq!(analyze("push, pick_and_place, slide").0, 0);
    let (status, text) = analyze("push x 2, slide");
    assert_eq!(status, 1);
    assert!(text.contains("outcome failure: expected push x 2, found 1\n"), "{text}");
    let batch = ["analyze", "several.csv", "--out-dir", "out", "--format", "json", "--expect", "slide, push"];
    assert_eq!(run(folder.path(), &batch).0, 1);
    let written = std::fs::read_to_string(folder.path().join("out/several.json")).unwrap();
    let written: Value = serde_json::from_str(&written).unwrap();
    assert_eq!(written["outcome"]["as_expected"], false);
    assert_eq!(written["outcome"]["expected"], "slide, push");
    // Names that the rules do not have.
    let (status, text) = analyze("puhs");
    assert_eq!(status, 2);
    assert!(text.contains("--expect") && text.contains("did you mean `push`?"), "{text}");
    let (status, text) =
        run(folder.path(), &["analyze", "several.csv", "--rules", "failures.rules", "--expect", "dragged"]);
    assert_eq!(status, 2);
    assert!(text.contains("`dragged` is a failure"), "{text}");
}

#[test]
fn a_binding_names_expected_tasks() {
    let demos = Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite");
    let log = demos.join("SawyerNutAssembly_demo_1.csv");
    let binding = std::fs::read_to_string(demos.join("sawyer_nut_assembly.binding.yaml")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let analyze = |expect: &str, more: &[&str]| {
        std::fs::write(folder.path().join("nuts.binding.yaml"), format!("expect: {expect}\n{binding}")).unwrap();
        let args = ["analyze", log.to_str().unwrap(), "--binding", "nuts.binding.yaml", "--format", "json"];
        run(folder.path(), &[&args, more].concat())
    };
    let (status, text) = analyze("peg_in_hole x 2", &[]);
    assert_eq!(status, 0);
    assert!(text.contains("\"result\": \"success\"") && text.contains("\"as_expected\": true"), "{text}");
    // The binding alone does not change the exit status, the option does.
    let (status, text) = analyze("peg_in_hole x 3", &[]);
    assert_eq!(status, 0);
    assert!(text.contains("expected peg_in_hole x 3, found 2"), "{text}");
    assert_eq!(analyze("peg_in_hole x 2", &["--expect", "turn_screw"]).0, 1);
    let (status, text) = analyze("peg_in_hol", &[]);
    assert_eq!(status, 2);
    assert!(text.contains("nuts.binding.yaml:1:9") && text.contains("did you mean `peg_in_hole`?"), "{text}");
}

#[test]
fn the_page_shows_what_the_program_prints() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = std::fs::read_to_string(root.join("docs/outcomes.md")).unwrap();
    let block = |language: &str| {
        let begin = format!("\n```{language}\n");
        page.split_once(begin.as_str()).unwrap().1.split_once("```").unwrap().0.to_string()
    };
    let command = block("sh");
    let (arguments, expected) = command.trim().split_once(" --expect ").unwrap();
    let mut args: Vec<&str> = arguments.split(' ').skip(1).collect();
    args.extend(["--expect", expected.trim_matches('\'')]);
    let (status, text) = run(root, &args);
    assert_eq!(status, 1);
    assert!(text.contains(&format!("\n{}", block("text"))), "{text}");
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("my_failures.rules"), block("rules")).unwrap();
    let (status, text) = run(folder.path(), &["check", "my_failures.rules"]);
    assert_eq!(status, 0, "{text}");
}

/// Three recordings in which the box is carried, and three in which a cube is pushed, which these rules call a failure.
#[test]
fn an_audit_of_as_many_failures_as_successes_says_which_are_good() {
    let folder = tempfile::tempdir().unwrap();
    let rules = "use \"contact.rules\"\n
        task knocked_over = Move .. Release with Trace travelling 20 mm or Push travelling 20 mm without Grasp, Translate  is failure  before push_and_trace\n";
    std::fs::write(folder.path().join("knocked.rules"), rules).unwrap();
    for scene in ["pick_and_place", "push_and_trace"] {
        let (status, text) = run(folder.path(), &["teach", scene, scene, "--seeds", "1..3", "-o", "set"]);
        assert_eq!(status, 0, "{text}");
    }
    let audit = |args: &[&str]| run(folder.path(), &[&["audit", "set", "--rules", "knocked.rules"], args].concat());
    let (status, text) = audit(&[]);
    assert_eq!(status, 0);
    assert!(text.ends_with("3 of 6 recordings are good, 3 failed\n"), "{text}");
    assert!(text.contains("\nfailures: knocked_over in 3 of 6\n"), "{text}");
    assert!(text.contains("usual: 3 of 6 recordings have no failure; the others are not compared\n"), "{text}");
    assert_eq!(audit(&["--fail-on", "failure"]).0, 1);
    assert_eq!(audit(&["--fail-on", "idle"]).0, 0);
    // What is expected is asked of each recording, also of the one that fails otherwise.
    let output = teachtree_in(
        folder.path(),
        &["audit", "set", "--rules", "knocked.rules", "--expect", "pick_and_place x 2", "--format", "json"],
    );
    let found: Value = serde_json::from_str(&said(&output)).unwrap();
    assert_eq!([&found["good"], &found["counts"]["failure"], &found["counts"]["lacks_task"]], [0, 3, 6]);
    assert_eq!(found["failures"], serde_json::json!({ "knocked_over": 3 }));
}

/// In three recordings a block is carried, which these rules call a failure, and then slid, which mends it; in two, a can is only slid.
#[test]
fn a_failure_that_most_recordings_mended_is_no_usual_task() {
    let folder = tempfile::tempdir().unwrap();
    let rules = "use \"contact.rules\"\ntask carried = Move .. Release with Translate or Place  is failure  before pick_and_place\n";
    std::fs::write(folder.path().join("carried.rules"), rules).unwrap();
    for (scene, seeds) in [("several_tasks", "1..3"), ("slide", "1..2")] {
        let (status, text) = run(folder.path(), &["teach", scene, scene, "--seeds", seeds, "-o", "set"]);
        assert_eq!(status, 0, "{text}");
    }
    let (_, text) = run(folder.path(), &["audit", "set", "--rules", "carried.rules"]);
    assert!(text.contains("carried in 3 of 5") && !text.contains("failures:"), "{text}");
    assert!(text.contains("lacks push") && !text.contains("lacks carried"), "{text}");
}

/// This log has no contacts, which the rules need for a press.
#[test]
fn a_task_of_tasks_that_cannot_be_shown_is_unknown() {
    let demos = Path::new(env!("CARGO_MANIFEST_DIR")).join("demos");
    let folder = tempfile::tempdir().unwrap();
    let rules = "use \"contact.rules\"\ntask pressed_twice = pick_and_press, pick_and_press\n";
    std::fs::write(folder.path().join("twice.rules"), rules).unwrap();
    let log = demos.join("dfki_hand/recording_excerpt.tsv");
    let binding = demos.join("bindings/dfki_hand.binding.yaml");
    for expect in ["pick_and_press", "pressed_twice"] {
        let args = ["analyze", log.to_str().unwrap(), "--binding", binding.to_str().unwrap(), "--rules", "twice.rules"];
        let (status, text) = run(folder.path(), &[&args[..], &["--expect", expect]].concat());
        assert_eq!(status, 1);
        assert!(text.contains(&format!("outcome unknown: expected {expect}, found none, which the log")), "{text}");
    }
}
