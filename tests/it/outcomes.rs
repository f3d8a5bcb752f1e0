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

/// A gripper at a heavy tool takes a cube 60 mm below its tool point, carries it, puts it down, and is pushed aside with `pushed` N before it opens. `closed` is
/// the flag of the gripper while it holds the cube; without it the log lacks the flag.
fn cell(folder: &Path, closed: Option<bool>, pushed: f64) {
    let ease = |t: f64, from: f64, to: f64| {
        let share = ((t - from) / (to - from)).clamp(0.0, 1.0);
        share * share * (3.0 - 2.0 * share)
    };
    let mut log = String::from("time,");
    for name in ["right.tcp.position", "right.wrist.force", "cube.position"] {
        ["x", "y", "z"].iter().for_each(|axis| log += &format!("{name}.{axis},"));
    }
    log += if closed.is_some() { "right.gripper.closed\n" } else { "right.label\n" };
    for row in 0..1000 {
        let t = f64::from(row) * 0.01;
        let (along, up) = (0.4 * ease(t, 3.5, 5.0), 0.2 * (ease(t, 2.8, 3.4) - ease(t, 5.2, 6.0)));
        let x = -0.3 * (1.0 - ease(t, 0.5, 1.5)) + along - 0.3 * ease(t, 7.0, 8.0);
        let z = 0.16 - 0.1 * ease(t, 1.5, 2.0) + up + 0.2 * ease(t, 6.6, 7.0);
        let weight = if (2.9..6.0).contains(&t) { 4.9 } else { 0.0 };
        let aside = if (6.2..6.45).contains(&t) { pushed } else { 0.0 };
        let noise = 0.05 * (f64::from(row) * 12.9).sin();
        let is_held = (2.4..6.5).contains(&t);
        let flag = closed.map_or(String::new(), |closed| u8::from(is_held && closed).to_string());
        log += &format!(
            "{t:.2},{x:.5},0,{z:.5},{:.4},{noise:.4},{},{along:.5},0,{up:.5},{flag}\n",
            aside + noise,
            -weight
        );
    }
    std::fs::write(folder.join("cell.csv"), log).unwrap();
    let cube = "cube: {role: object, mass: 500 g, parts: [{box: [50 mm, 50 mm, 50 mm]}]}";
    let table = "table: {role: support, position: [0 mm, 0 mm, -50 mm], parts: [{box: [2 m, 2 m, 50 mm]}]}";
    std::fs::write(folder.join("cell.scene.yaml"), format!("bodies:\n  {cube}\n  {table}\n")).unwrap();
}

#[test]
fn a_gripper_whose_flag_is_wrong_or_absent_does_not_collide() {
    let folder = tempfile::tempdir().unwrap();
    let analyze = |options: &[&str]| {
        let output = teachtree_in(folder.path(), &[&["analyze", "cell.csv", "--format", "json"], options].concat());
        let found: Value = serde_json::from_str(&said(&output)).unwrap();
        let tasks = found["tracks"][0]["tasks"].as_array().unwrap().iter();
        let tasks: Vec<String> = tasks.map(|task| task["task"].as_str().unwrap().to_string()).collect();
        (output.status.code(), tasks, found["outcome"].clone())
    };
    // A tool that moves in the air, or holds an object, reads this much.
    cell(folder.path(), Some(true), 3.0);
    let (_, tasks, outcome) = analyze(&[]);
    assert_eq!((tasks.as_slice(), &outcome["result"]), (&["pick_and_place".to_string()][..], &"success".into()));
    cell(folder.path(), Some(false), 3.0);
    assert!(!analyze(&[]).1.contains(&"collided".to_string()));
    // A hand that counts as empty, since its flag is wrong, is hit: whether that is a failure is unknown.
    cell(folder.path(), Some(false), 8.0);
    let (status, tasks, outcome) = analyze(&[]);
    assert!(tasks.contains(&"collided".to_string()), "{tasks:?}");
    assert_eq!(
        (status, &outcome["result"], &outcome["reasons"][0]["kind"]),
        (Some(0), &"unknown".into(), &"misread".into())
    );
    let message = outcome["reasons"][0]["message"].as_str().unwrap();
    assert!(message.starts_with("constant_flag right.gripper.closed: the gripper is never closed"), "{message}");
    // Nothing shows whether this hand holds something.
    cell(folder.path(), None, 8.0);
    assert!(!analyze(&[]).1.contains(&"collided".to_string()));
}

#[test]
fn fail_on_names_outcomes_and_issues() {
    let folder = tempfile::tempdir().unwrap();
    let analyze = |more: &[&str]| run(folder.path(), &[&["analyze", "cell.csv", "--fail-on"], more].concat());
    cell(folder.path(), Some(true), 0.0);
    assert_eq!(analyze(&["failure,unknown,constant_flag"]).0, 0);
    cell(folder.path(), Some(false), 0.0);
    assert_eq!(analyze(&["failure"]).0, 0);
    for kinds in ["unknown", "constant_flag", "failure,constant_flag"] {
        assert_eq!(analyze(&[kinds]).0, 1, "{kinds}");
        assert_eq!(analyze(&[kinds, "--out-dir", "out", "--format", "json"]).0, 1, "{kinds}");
    }
    let (status, text) = analyze(&["constant_flags"]);
    assert_eq!(status, 2);
    assert!(text.contains("did you mean `constant_flag`?"), "{text}");
}

/// A recording that ends while its box is carried does not show where the box goes.
#[test]
fn a_recording_that_ends_within_a_task_has_an_unknown_outcome() {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/contact_flags");
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(example.join("box.binding.yaml"), folder.path().join("box.binding.yaml")).unwrap();
    let text = std::fs::read_to_string(example.join("box.csv")).unwrap();
    let outcome_until = |end_ms: f64| {
        let is_before = |line: &&str| line.split(',').next().unwrap().parse().map_or(true, |time: f64| time < end_ms);
        let lines: Vec<&str> = text.lines().take_while(is_before).collect();
        std::fs::write(folder.path().join("several.csv"), lines.join("\n") + "\n").unwrap();
        outcome(folder.path(), &["--binding", "box.binding.yaml"])
    };
    assert_eq!(outcome_until(f64::INFINITY)["result"], "success");
    let cut = outcome_until(5500.0);
    assert_eq!((&cut["result"], &cut["reasons"][0]["kind"]), (&"unknown".into(), &"cut_off".into()), "{cut}");
    let message = cut["reasons"][0]["message"].as_str().unwrap();
    assert!(message.ends_with("is cut off by the end of the recording"), "{message}");
}

/// An analysis of a position in mm that is read as m finds tasks, but they are not those of the recording.
#[test]
fn a_recording_in_a_wrong_unit_is_not_a_success() {
    let folder = folder();
    assert_eq!(outcome(folder.path(), &[])["result"], "success");
    let path = folder.path().join("several.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    let wrong: Vec<bool> = text.lines().next().unwrap().split(',').map(|name| name.contains(".position.")).collect();
    let line = |(row, line): (usize, &str)| {
        let cells = line.split(',').zip(&wrong).map(|(cell, wrong)| match cell.parse::<f64>() {
            Ok(value) if *wrong && row > 0 => (value * 1e3).to_string(),
            _ => cell.to_string(),
        });
        cells.collect::<Vec<String>>().join(",") + "\n"
    };
    std::fs::write(&path, text.lines().enumerate().map(line).collect::<String>()).unwrap();
    let outcome = outcome(folder.path(), &[]);
    assert_eq!(outcome["result"], "unknown", "{outcome}");
    let message = outcome["reasons"].as_array().unwrap().last().unwrap()["message"].as_str().unwrap();
    assert!(message.starts_with("implausible_unit "), "{outcome}");
}

/// Copies an example, and returns the outcome of its log by its own binding.
fn outcome_of_example(name: &str, log: &str, binding: &str) -> Value {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(name);
    let output = teachtree_in(&folder, &["analyze", log, "--binding", binding, "--format", "json"]);
    serde_json::from_str::<Value>(&said(&output)).unwrap()["outcome"].clone()
}

/// The reasons of a kind, in words.
fn reasons<'a>(outcome: &'a Value, kind: &str) -> Vec<&'a str> {
    let all = outcome["reasons"].as_array().unwrap().iter().filter(|reason| reason["kind"] == kind);
    all.map(|reason| reason["message"].as_str().unwrap()).collect()
}

/// The scene that `init` guesses has no socket, so the press on the rim is one on nothing.
#[test]
fn a_press_on_a_body_that_the_scene_lacks_is_not_a_success() {
    let log = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/plug_into_socket/plug_2.csv");
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(log, folder.path().join("plug_2.csv")).unwrap();
    let (_, text) = run(folder.path(), &["init", "plug_2.csv", "--yes"]);
    assert!(text.contains("outcome unknown: missing_body right.fingers.force: `plug` stops at ["), "{text}");
    assert!(text.contains("such as a socket") && !text.contains("implausible_force"), "{text}");
    let output = teachtree_in(folder.path(), &["analyze", "plug_2.csv", "--format", "json"]);
    let outcome = serde_json::from_str::<Value>(&said(&output)).unwrap()["outcome"].clone();
    assert_eq!((&outcome["result"], reasons(&outcome, "misread").len()), (&"unknown".into(), 1), "{outcome}");
    // With the socket of the example it is a jam.
    assert_eq!(outcome_of_example("plug_into_socket", "plug_2.csv", "plug.binding.yaml")["result"], "failure");
    assert_eq!(outcome_of_example("plug_into_socket", "plug_1.csv", "plug.binding.yaml")["result"], "success");
}

/// A success names the failures that its log or its scene cannot show, with the lack.
#[test]
fn failures_that_a_log_cannot_show_are_named_with_what_lacks() {
    let flags = outcome_of_example("contact_flags", "box.csv", "box.binding.yaml");
    assert_eq!(flags["result"], "success");
    let lack = "the log cannot show failed_insertion (Jam: no force of the fingers is bound)";
    assert_eq!(reasons(&flags, "unseen_failure"), [lack]);
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let args = ["analyze", "stack_panda_demo_1.csv", "--binding", "panda_stack.binding.yaml", "--format", "json"];
    let stack: Value = serde_json::from_str(&said(&teachtree_in(&root.join("demos/robosuite"), &args))).unwrap();
    assert_eq!(stack["outcome"]["result"], "success");
    let lack = "the log cannot show failed_insertion (Jam: the scene has no socket)";
    assert_eq!(reasons(&stack["outcome"], "unseen_failure"), [lack]);
    // A scene with a socket lacks nothing.
    let plug = outcome_of_example("plug_into_socket", "plug_1.csv", "plug.binding.yaml");
    assert_eq!(reasons(&plug, "unseen_failure"), [""; 0]);
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
    assert!(text.contains("\n3 of 6 recordings are good, 3 failed\n"), "{text}");
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
fn a_failure_that_most_recordings_mended_is_not_a_usual_task() {
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
