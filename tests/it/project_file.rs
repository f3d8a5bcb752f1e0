//! `teachtree.yaml`: commands need no options for the logs that it describes.

use crate::plugs::Outcome::{Inserted, Jammed};
use crate::plugs::{BINDING, GOOD, log};
use crate::program::{all_said, complained, said, teachtree_in};
use serde_json::Value;
use std::fs;
use std::path::Path;

const PROJECT: &str = "logs:
  '*.csv':
    binding: lab/plug.binding.yaml
    expect: peg_in_hole
  jams/*.csv:
    expect: peg_in_hole x 2
    hand_file: hand_gripper.rules
";

/// A folder with a log, a jam in a subfolder, their binding and the file.
fn project() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    };
    write("teachtree.yaml", PROJECT);
    write("lab/plug.binding.yaml", BINDING);
    write("a.csv", &log(Inserted, 1, GOOD));
    write("jams/b.csv", &log(Jammed, 1, GOOD));
    folder
}

fn analyzed(folder: &Path, args: &[&str]) -> Value {
    let output = teachtree_in(folder, &[&["analyze", "--format", "json"], args].concat());
    assert_ne!(output.status.code(), Some(2), "{}", all_said(&output));
    serde_json::from_str(&said(&output)).unwrap()
}

#[test]
fn a_log_needs_no_options() {
    let folder = project();
    let found = analyzed(folder.path(), &["a.csv"]);
    assert_eq!(found["outcome"]["result"], "success", "{}", found["outcome"]);
    assert_eq!(found["outcome"]["expected"], "peg_in_hole");
    let with = analyzed(folder.path(), &["a.csv", "--binding", "lab/plug.binding.yaml", "--expect", "peg_in_hole"]);
    assert_eq!(found["tracks"], with["tracks"]);
    // From a folder below and from another one.
    assert_eq!(analyzed(&folder.path().join("jams"), &["../a.csv"])["tracks"], with["tracks"]);
    let other = tempfile::tempdir().unwrap();
    let whole = folder.path().join("a.csv");
    assert_eq!(analyzed(other.path(), &[whole.to_str().unwrap()])["tracks"], with["tracks"]);
    // A log elsewhere has the file of the folder in which the program runs.
    fs::copy(&whole, other.path().join("c.csv")).unwrap();
    let elsewhere = other.path().join("c.csv");
    assert_eq!(analyzed(folder.path(), &[elsewhere.to_str().unwrap()])["tracks"], with["tracks"]);
}

#[test]
fn later_entries_and_options_win() {
    let folder = project();
    let model = |args: &[&str]| analyzed(folder.path(), args)["rules"]["hand_model"].as_str().unwrap().to_string();
    let named = model(&["jams/b.csv"]);
    assert_eq!(named, "hand_gripper.rules, as `hand_file` in teachtree.yaml:7:16 says");
    assert_eq!(model(&["a.csv"]), "hand_gripper_wrist.rules, as `hand_file` in the binding says");
    let given = model(&["jams/b.csv", "--hand", "hand_gripper_wrist.rules"]);
    assert_eq!(given, "hand_gripper_wrist.rules, as it is named with the rules");
    let expected = |args: &[&str]| analyzed(folder.path(), args)["outcome"]["expected"].clone();
    assert_eq!(expected(&["a.csv"]), "peg_in_hole");
    assert_eq!(expected(&["jams/b.csv"]), "peg_in_hole x 2");
    assert_eq!(expected(&["jams/b.csv", "--expect", "peg_in_hole"]), "peg_in_hole");
    // A failure cannot be expected.
    fs::write(folder.path().join("teachtree.yaml"), PROJECT.replace("peg_in_hole x 2", "failed_insertion")).unwrap();
    let refused = teachtree_in(folder.path(), &["analyze", "jams/b.csv"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(complained(&refused).contains("teachtree.yaml:6:13: "), "{}", complained(&refused));
}

#[test]
fn a_folder_of_described_logs_is_one_of_recordings() {
    let folder = project();
    let output = teachtree_in(folder.path(), &["audit", "."]);
    assert!(said(&output).contains("2 recordings"), "{}", all_said(&output));
    let inspected = teachtree_in(folder.path(), &["inspect", "a.csv"]);
    assert!(said(&inspected).contains("right  can be detected: "), "{}", all_said(&inspected));
}

#[test]
fn rules_and_params_are_those_of_the_file() {
    let folder = project();
    fs::write(
        folder.path().join("own.rules"),
        "use \"contact.rules\"\nprimitive Tap\nparam tap = 1 N in 0.1 N .. 9 N\n",
    )
    .unwrap();
    let text = "logs: {'*.csv': {binding: lab/plug.binding.yaml, rules: [own.rules], params: {tap: 2 N}}}";
    fs::write(folder.path().join("teachtree.yaml"), text).unwrap();
    let rules = &analyzed(folder.path(), &["a.csv"])["rules"];
    assert_eq!(rules["files"][0], "own.rules", "{rules}");
    assert_eq!(rules["params"]["tap"], "2 N", "{rules}");
    assert_eq!(analyzed(folder.path(), &["a.csv", "--set", "tap=3 N"])["rules"]["params"]["tap"], "3 N");
    // An output must not replace a file of it.
    let lost = teachtree_in(folder.path(), &["analyze", "a.csv", "-o", "own.rules"]);
    assert!(complained(&lost).contains("is an input of this command"), "{}", complained(&lost));
    let lost = teachtree_in(folder.path(), &["analyze", "a.csv", "-o", "teachtree.yaml"]);
    assert!(complained(&lost).contains("is an input of this command"), "{}", complained(&lost));
}

#[test]
fn config_prints_where_settings_are_from() {
    let folder = project();
    let has_lines = |args: &[&str], lines: &[&str]| {
        let printed = said(&teachtree_in(folder.path(), &[&["config", "a.csv"], args].concat()));
        for line in lines {
            assert!(printed.lines().any(|printed| printed == *line), "`{line}` is not in\n{printed}");
        }
    };
    let of_file = [
        "  project file  teachtree.yaml  (the nearest one above the log)",
        "  binding       lab/plug.binding.yaml  (teachtree.yaml:3:14)",
        "  scene         lab/plug.binding.yaml  (`scene` of the binding)",
        "  hand model    hand_gripper_wrist.rules  (as `hand_file` in the binding says)",
        "  expect        peg_in_hole  (teachtree.yaml:4:13)",
    ];
    has_lines(&[], &of_file);
    let given = [
        "  hand model    hand_gripper.rules  (as it is named with the rules)",
        "  param         touch_on = 0.3 N  (--set)",
        "  expect        peg_in_hole x 2  (--expect)",
    ];
    let options = ["--hand", "hand_gripper.rules", "--expect", "peg_in_hole x 2", "--set", "touch_on=0.3 N"];
    has_lines(&options, &given);
    let json = |args: &[&str]| -> Value {
        let output = teachtree_in(folder.path(), &[&["config", "--format", "json"], args].concat());
        serde_json::from_str(&said(&output)).unwrap_or_else(|_| panic!("{}", all_said(&output)))
    };
    let of_log = json(&["a.csv"]);
    let expect = serde_json::json!({"name": "expect", "value": "peg_in_hole", "from": "teachtree.yaml:4:13"});
    assert!(of_log["settings"].as_array().unwrap().contains(&expect), "{of_log:#}");
    let of_file = json(&[]);
    assert_eq!(of_file["project_file"], "teachtree.yaml");
    assert_eq!(of_file["entries"][1]["logs"], "jams/*.csv");
    assert_eq!(of_file["entries"][0]["settings"].as_array().unwrap().len(), 2, "{of_file:#}");
    let text = said(&teachtree_in(folder.path(), &["config"]));
    assert!(text.contains("jams/*.csv  (teachtree.yaml:"), "{text}");
    let without_log = teachtree_in(folder.path(), &["config", "--expect", "peg_in_hole"]);
    assert!(complained(&without_log).contains("expected a LOG"), "{}", all_said(&without_log));
}

/// Nothing is claimed of a log that is not read.
#[test]
fn config_does_not_guess_what_a_log_contains() {
    let folder = project();
    fs::write(folder.path().join("teachtree.yaml"), "logs: {'*.tsv': {expect: peg_in_hole}}").unwrap();
    let printed = said(&teachtree_in(folder.path(), &["config", "a.csv"]));
    assert!(printed.contains("  binding       none  (neither an option nor an entry names one)\n"), "{printed}");
    assert!(!printed.contains("canonical") && !printed.contains("in the log"), "{printed}");
}

#[test]
fn mistakes_have_their_place() {
    let folder = project();
    let mistakes = [
        ("logs: {'*.csv': {bindng: a.yaml}}", "teachtree.yaml:1:18: "),
        ("logs: {'***': {expect: a}}", "teachtree.yaml:1:15: `***` is not a pattern of paths: "),
        ("logs: {'*.csv': {binding: none.yaml}}", "none.yaml: there is no such file"),
        ("logs: [a]", "teachtree.yaml:1:7: "),
        ("log: {}", "teachtree.yaml:1:1: "),
    ];
    for (text, wanted) in mistakes {
        fs::write(folder.path().join("teachtree.yaml"), text).unwrap();
        let output = teachtree_in(folder.path(), &["analyze", "a.csv"]);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(complained(&output).contains(wanted), "{text}: {}", complained(&output));
    }
    let checked = teachtree_in(folder.path(), &["check", "teachtree.yaml"]);
    assert_eq!(checked.status.code(), Some(2));
}

/// An error about a param of a file names its line; one of the command line does not.
#[test]
fn params_that_do_not_fit_the_rules_have_their_place() {
    let folder = project();
    let mistakes = [
        ("jam_of: 3 N", "there is no param `jam_of` to override"),
        ("touch_on: 3 m", "the override `touch_on=3 m` is a length (m), but `touch_on` is a force (N)"),
    ];
    for (param, message) in mistakes {
        let name = param.split(':').next().unwrap();
        let text = format!("logs: {{'*.csv': {{binding: lab/plug.binding.yaml, params: {{{param}}}}}}}");
        let place = format!("teachtree.yaml:1:{}", text.find(param).unwrap() + name.len() + 3);
        fs::write(folder.path().join("teachtree.yaml"), text).unwrap();
        let analyzed = complained(&teachtree_in(folder.path(), &["analyze", "a.csv"]));
        assert!(analyzed.contains(message) && analyzed.contains(&format!("`{name}` is set in {place}")), "{analyzed}");
        let checked = complained(&teachtree_in(folder.path(), &["check", "teachtree.yaml"]));
        assert!(checked.contains(&format!("{place}: {message}")), "{checked}");
        let given = teachtree_in(folder.path(), &["analyze", "a.csv", "--set", &param.replacen(": ", "=", 1)]);
        assert!(!complained(&given).contains("is set in"), "{}", complained(&given));
        let own = BINDING.replacen("channels:", &format!("params: {{{param}}}\nchannels:"), 1);
        fs::write(folder.path().join("own.yaml"), own).unwrap();
        let bound = complained(&teachtree_in(folder.path(), &["analyze", "a.csv", "--binding", "own.yaml"]));
        assert!(bound.contains(&format!("`{name}` is set in own.yaml:")), "{bound}");
    }
    let fine = "logs: {'*.csv': {binding: lab/plug.binding.yaml, params: {touch_on: 0.3 N, jam_off: 3 N}}}";
    fs::write(folder.path().join("teachtree.yaml"), fine).unwrap();
    let checked = teachtree_in(folder.path(), &["check", "teachtree.yaml"]);
    assert!(checked.status.success(), "{}", all_said(&checked));
}

/// A binding is shared by all rules for its logs, also by learned ones, which have no params.
#[test]
fn rules_that_lack_a_shipped_param_ignore_its_value_in_a_file() {
    let folder = project();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    let with = |param: &str| BINDING.replacen("channels:", &format!("params: {{{param}}}\nchannels:"), 1);
    write("own.yaml", &with("near_on: 40 mm"));
    write(
        "mine.rules",
        "use \"stream.rules\"\n\nparam up = 100 mm\n\nfor each hand { signal height = mean(fingers.position).z }\n\n\
         primitive Low, High\n\ntree skills for each hand {\n  height > up => High\n  else        => Low\n}\n",
    );
    let entry = "{binding: own.yaml, rules: [mine.rules], params: {jam_off: 3 N, up: 90 mm}}";
    write("teachtree.yaml", &format!("logs: {{'*.csv': {entry}}}"));
    assert_eq!(analyzed(folder.path(), &["a.csv"])["rules"]["params"], serde_json::json!({"up": "90 mm"}));
    let checked = teachtree_in(folder.path(), &["check", "teachtree.yaml"]);
    assert!(checked.status.success(), "{}", all_said(&checked));
    // A param of no rules is a mistake, and so is one of the command line without effect.
    let unknown = "there is no param";
    let given = teachtree_in(folder.path(), &["analyze", "a.csv", "--set", "near_on=40mm"]);
    assert!(complained(&given).contains(unknown), "{}", all_said(&given));
    write("own.yaml", &with("neer_on: 40 mm"));
    let mistyped = teachtree_in(folder.path(), &["analyze", "a.csv"]);
    assert!(complained(&mistyped).contains(unknown), "{}", all_said(&mistyped));
}

#[test]
fn patterns_that_never_fit_are_refused() {
    let folder = project();
    let whole = folder.path().join("*.csv").display().to_string();
    let mistakes = [
        ("./*.csv", "write `/*.csv`"),
        ("../*.csv", "write a `teachtree.yaml` in the folder above"),
        ("jams/", "write `jams/**`"),
        ("jams//*.csv", "write `jams/*.csv`"),
        (whole.as_str(), "write `*.csv`"),
        ("~/logs/*.csv", "write `*.csv`"),
    ];
    for (pattern, help) in mistakes {
        let text = format!("logs: {{'{pattern}': {{expect: peg_in_hole}}}}");
        fs::write(folder.path().join("teachtree.yaml"), text).unwrap();
        let output = teachtree_in(folder.path(), &["config", "a.csv"]);
        assert_eq!(output.status.code(), Some(2), "{pattern}");
        let complained = complained(&output);
        assert!(complained.contains(&format!("`{pattern}` never matches a log")), "{complained}");
        assert!(complained.contains(help), "{complained}");
    }
}

#[test]
fn a_pattern_with_the_folder_of_the_file_leaves_out_those_below() {
    let folder = project();
    let text = "logs: {'/*.csv': {binding: lab/plug.binding.yaml}, '/jams/*.csv': {labels: jams}}";
    fs::write(folder.path().join("teachtree.yaml"), text).unwrap();
    let config = |log: &str| all_said(&teachtree_in(folder.path(), &["config", log]));
    assert!(config("a.csv").contains("lab/plug.binding.yaml  (teachtree.yaml:1:28)"), "{}", config("a.csv"));
    let below = config("jams/b.csv");
    assert!(below.contains("binding       none") && below.contains("labels        jams  ("), "{below}");
    fs::write(folder.path().join("teachtree.yaml"), "logs: {'*.tsv': {binding: lab/plug.binding.yaml}}").unwrap();
    assert!(config("a.csv").contains("above the log; no entry matches the log"), "{}", config("a.csv"));
}

#[test]
fn check_verifies_files_and_tasks() {
    let folder = project();
    let check = |text: &str| {
        fs::write(folder.path().join("teachtree.yaml"), text).unwrap();
        teachtree_in(folder.path(), &["check", "teachtree.yaml"])
    };
    let fine = check(PROJECT);
    assert!(fine.status.success(), "{}", all_said(&fine));
    let mistakes = [
        ("logs: {'*.csv': {binding: none.yaml}}", "teachtree.yaml:1:27: there is no file `none.yaml`"),
        ("logs: {'*.csv': {rules: [contact.rules, none.rules]}}", "teachtree.yaml:1:41: there is no file `none.rules`"),
        ("logs: {'*.csv': {labels: none}}", "teachtree.yaml:1:26: there is no file `none`"),
        ("logs: {'*.csv': {expect: peg_in_hol}}", "teachtree.yaml:1:26: "),
    ];
    for (text, wanted) in mistakes {
        let output = check(text);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(complained(&output).contains(wanted), "{text}: {}", complained(&output));
    }
}

#[test]
fn a_binding_replaces_what_was_chosen_for_that_of_the_file() {
    let folder = project();
    let text = "logs: {'*.csv': {binding: none.yaml, hand_file: hand_gripper.rules, params: {touch_on: 2 N}, expect: peg_in_hole}}";
    fs::write(folder.path().join("teachtree.yaml"), text).unwrap();
    let found = analyzed(folder.path(), &["a.csv", "--binding", "lab/plug.binding.yaml"]);
    assert_eq!(found["rules"]["hand_model"], "hand_gripper_wrist.rules, as `hand_file` in the binding says");
    assert!(found["rules"]["params"].get("touch_on").is_none_or(|value| value != "2 N"), "{}", found["rules"]);
    assert_eq!(found["outcome"]["expected"], "peg_in_hole");
}

#[test]
fn own_rules_are_not_those_of_the_folder_in_which_the_program_runs() {
    let folder = project();
    let elsewhere = tempfile::tempdir().unwrap();
    fs::write(elsewhere.path().join("own.rules"), "use \"contact.rules\"\nprimitive Tap\n").unwrap();
    let text = "logs: {'*.csv': {binding: lab/plug.binding.yaml, rules: [own.rules]}}";
    fs::write(folder.path().join("teachtree.yaml"), text).unwrap();
    let log = folder.path().join("a.csv");
    let refused = teachtree_in(elsewhere.path(), &["analyze", log.to_str().unwrap()]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(complained(&refused).contains("there is no rule file"), "{}", complained(&refused));
    // What leads to it is printed first.
    let config = teachtree_in(elsewhere.path(), &["config", log.to_str().unwrap()]);
    assert!(said(&config).contains("own.rules  ("), "{}", all_said(&config));
}

#[test]
fn all_logs_of_a_folder_do_not_name_the_folder() {
    let folder = project();
    fs::write(folder.path().join("teachtree.yaml"), "logs: {'*': {binding: lab/plug.binding.yaml}}").unwrap();
    let output = teachtree_in(folder.path(), &["audit", "jams", "."]);
    assert!(said(&output).contains("2 recordings"), "{}", all_said(&output));
}

#[test]
fn files_of_the_project_are_not_overwritten() {
    let folder = project();
    for command in [["fit", "a.csv", "-o"], ["score", "a.csv", "-o"]] {
        let refused = teachtree_in(folder.path(), &[&command[..], &["lab/plug.binding.yaml"]].concat());
        assert_eq!(refused.status.code(), Some(2));
        assert!(complained(&refused).contains("is an input of this command"), "{}", complained(&refused));
    }
}
