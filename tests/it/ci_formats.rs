//! Results for other programs: SARIF and JUnit of `check`, JUnit of `test`; and the options that all commands have.

use crate::program::{all_said, complained, said, teachtree, teachtree_in};
use serde_json::Value;
use std::path::Path;

const WRONG: &str = "use \"contact.rules\"\n\nprimitive Throw is Translate\n\nextend single_hand before carried {\n  grapsed => Throw\n}\n";

/// A folder with a rule file that has an error, and one without findings.
fn rules() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("my throw.rules"), WRONG).unwrap();
    let sound = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/hold.rules");
    std::fs::copy(sound, folder.path().join("sound.rules")).unwrap();
    folder
}

#[test]
fn findings_are_written_as_sarif() {
    let folder = rules();
    let output = teachtree_in(folder.path(), &["check", ".", "--format", "sarif"]);
    assert_eq!(output.status.code(), Some(1), "{}", complained(&output));
    let log: Value = serde_json::from_str(&said(&output)).unwrap();
    assert_eq!(log["version"], "2.1.0");
    let run = &log["runs"][0];
    assert_eq!(run["tool"]["driver"]["name"], "teachtree");
    let results = run["results"].as_array().unwrap();
    let error = results.iter().find(|result| result["level"] == "error").unwrap();
    assert_eq!(error["ruleId"], "E201");
    let rule = &run["tool"]["driver"]["rules"][usize::try_from(error["ruleIndex"].as_u64().unwrap()).unwrap()];
    assert_eq!(rule["id"], "E201");
    assert!(rule["help"]["text"].as_str().unwrap().len() > 20, "{rule}");
    let place = &error["locations"][0]["physicalLocation"];
    assert_eq!(place["artifactLocation"]["uri"], "./my%20throw.rules");
    let region = serde_json::json!({ "startLine": 6, "startColumn": 3, "endLine": 6, "endColumn": 10 });
    assert_eq!(place["region"], region);
    let replacement = &error["fixes"][0]["artifactChanges"][0]["replacements"][0];
    assert_eq!(replacement["deletedRegion"], region);
    assert_eq!(replacement["insertedContent"]["text"], "grasped");
    // Rules without findings are a run without results.
    let sound = teachtree_in(folder.path(), &["check", "sound.rules", "--format", "sarif"]);
    assert!(sound.status.success(), "{}", complained(&sound));
    let log: Value = serde_json::from_str(&said(&sound)).unwrap();
    assert_eq!(log["runs"][0]["results"], Value::Array(vec![]));
}

/// GitHub shows only results with a location.
#[test]
fn each_result_of_sarif_has_a_location() {
    let folder = rules();
    for (name, text) in [("b.yaml", "channel: {}\n"), ("c.scene.yaml", "bodies: 3\n")] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    for (args, uri) in [
        (&["missing.rules"][..], "missing.rules"),
        (&["sound.rules", "missing.rules"], "missing.rules"),
        (&["c.scene.yaml"], "c.scene.yaml"),
        (&["missing.scene.yaml"], "missing.scene.yaml"),
        (&["."], "./my%20throw.rules"),
    ] {
        let output = teachtree_in(folder.path(), &[&["check", "--format", "sarif"], args].concat());
        let log: Value = serde_json::from_str(&said(&output)).unwrap();
        let results = log["runs"][0]["results"].as_array().unwrap();
        let uris: Vec<&Value> = results
            .iter()
            .map(|result| &result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"])
            .collect();
        assert!(!uris.is_empty() && uris.iter().all(|found| *found == uri), "{args:?}: {log}");
    }
}

/// The tests of a JUnit document: name, class and the element in it.
fn tests(document: &str) -> Vec<(String, String, Option<String>)> {
    let parsed = roxmltree::Document::parse(document).unwrap();
    let count = |name: &str| parsed.descendants().filter(|node| node.has_tag_name(name)).count().to_string();
    let root = parsed.root_element();
    assert_eq!(root.tag_name().name(), "testsuites");
    for (attribute, element) in [("tests", "testcase"), ("failures", "failure"), ("errors", "error")] {
        assert_eq!(root.attribute(attribute).unwrap(), count(element), "{document}");
    }
    let cases = parsed.descendants().filter(|node| node.has_tag_name("testcase"));
    cases
        .map(|case| {
            let inside = case.children().find(|node| node.is_element()).map(|node| node.tag_name().name().to_string());
            (case.attribute("name").unwrap().into(), case.attribute("classname").unwrap().into(), inside)
        })
        .collect()
}

#[test]
fn findings_are_written_as_junit() {
    let folder = rules();
    let binding = folder.path().join("lab.binding.yaml");
    std::fs::write(&binding, "channel: {}\n").unwrap();
    let output = teachtree_in(folder.path(), &["check", ".", "lab.binding.yaml", "--format", "junit"]);
    assert_eq!(output.status.code(), Some(2), "{}", complained(&output));
    let text = said(&output);
    let found = tests(&text);
    let has = |name: &str, class: &str, inside: Option<&str>| {
        found.iter().any(|(n, c, i)| n == name && c == class && i.as_deref() == inside)
    };
    assert!(has("E201 6:3", "./my throw.rules", Some("failure")), "{found:?}");
    assert!(has("input 1:1", "lab.binding.yaml", Some("failure")), "{found:?}");
    assert!(has("check", "./sound.rules", None), "{found:?}");
    assert!(text.contains("there is no value `grapsed`") && text.contains("./my throw.rules:6:3: "), "{text}");
}

/// The exit status depends on what is found, not on the format.
#[test]
fn every_format_has_the_same_exit_status() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("lab.binding.yaml"), "channel: {}\n").unwrap();
    std::fs::write(folder.path().join("wrong.rules"), "signal a = x\nsignal b = x\n").unwrap();
    std::fs::write(folder.path().join("fine.rules"), "use \"contact.rules\"\n").unwrap();
    for (file, status) in [("lab.binding.yaml", 2), ("none.rules", 2), ("wrong.rules", 1), ("fine.rules", 0)] {
        for format in ["text", "json", "github", "sarif", "junit"] {
            let output = teachtree_in(folder.path(), &["check", file, "--format", format]);
            assert_eq!(output.status.code(), Some(status), "{file} {format}: {}", all_said(&output));
        }
    }
    let found = tests(&said(&teachtree_in(folder.path(), &["check", "wrong.rules", "--format", "junit"])));
    let names: Vec<&str> = found.iter().map(|(name, ..)| name.as_str()).collect();
    assert_eq!(names, ["E201 1:12", "E201 2:12"]);
}

/// An expectation that is met is a test that passes, one that is not met is a failure, and one without its log an error.
#[test]
fn expectations_are_tests_of_junit() {
    let folder = tempfile::tempdir().unwrap();
    let demos = Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite");
    for file in ["SawyerLift_demo_1.csv", "sawyer_lift.binding.yaml"] {
        std::fs::copy(demos.join(file), folder.path().join(file)).unwrap();
    }
    let run = |args: &[&str]| teachtree_in(folder.path(), &[&["test"][..], args].concat());
    let update = run(&["--update", "--binding", "sawyer_lift.binding.yaml"]);
    assert!(update.status.success(), "{}", all_said(&update));
    let expectation = std::fs::read_to_string(folder.path().join("SawyerLift_demo_1.expect")).unwrap();
    let unmet = expectation.replace("  Grasp ", "  Trace ");
    assert_ne!(unmet, expectation);
    std::fs::write(folder.path().join("unmet.expect"), unmet).unwrap();
    std::fs::write(folder.path().join("lost.expect"), "log: none.csv\n").unwrap();
    let output = run(&["--format", "junit", "--min-coverage", "1"]);
    assert_eq!(output.status.code(), Some(2));
    let found = tests(&said(&output));
    let expected = [
        ("SawyerLift_demo_1", ".", None),
        ("lost", ".", Some("error")),
        ("unmet", ".", Some("failure")),
        ("coverage", "teachtree test", Some("system-out")),
    ];
    let expected: Vec<_> = expected.map(|(n, c, i)| (n.to_string(), c.to_string(), i.map(str::to_string))).into();
    assert_eq!(found, expected);
}

/// `-q` and `--color` are options of every command, before or after its name.
#[test]
fn all_commands_have_the_options_of_printing() {
    let help = said(&teachtree(&["--help"]));
    let names: Vec<&str> = help
        .lines()
        .filter_map(|line| line.strip_prefix("  ").filter(|line| !line.starts_with(' '))?.split_whitespace().next())
        .filter(|word| word.chars().all(|letter| letter.is_ascii_lowercase()))
        .collect();
    assert!(names.len() > 20, "{names:?}");
    for name in names {
        let help = said(&teachtree(&[name, "--help"]));
        assert!(help.contains("-q, --quiet") && help.contains("--color <WHEN>"), "{name}: {help}");
    }
    let folder = rules();
    let check = |args: &[&str]| said(&teachtree_in(folder.path(), args));
    let colored = check(&["check", "my throw.rules", "--color", "always"]);
    assert!(colored.contains("\u{1b}["), "{colored}");
    assert_eq!(check(&["--color", "always", "check", "my throw.rules"]), colored);
    assert!(!check(&["check", "my throw.rules", "--color", "never"]).contains('\u{1b}'));
    assert_eq!(check(&["check", "sound.rules", "-q"]), "");
    assert!(check(&["check", "my throw.rules", "-q"]).contains("E201"));
}

/// Labels and headings are colored in one way by all commands, and colors change nothing else.
#[test]
fn every_command_colors_labels_and_headings() {
    let folder = rules();
    let demos = Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite");
    for file in ["SawyerLift_demo_1.csv", "sawyer_lift.binding.yaml"] {
        std::fs::copy(demos.join(file), folder.path().join(file)).unwrap();
    }
    let log = ["SawyerLift_demo_1.csv", "--binding", "sawyer_lift.binding.yaml"];
    let of_log = |command: &'static str| [&[command][..], &log].concat();
    let error = "\u{1b}[1;31merror:\u{1b}[0m none.csv: ";
    for (args, wanted) in [
        (of_log("inspect"), "\u{1b}[1mrecognition\u{1b}[0m\n"),
        (of_log("config"), "\u{1b}[1mSawyerLift_demo_1.csv\u{1b}[0m\n"),
        ([&of_log("explain")[..], &["--at", "9s"]].concat(), "\u{1b}[1mright at 9.00"),
        (vec!["list"], "\u{1b}[1mrules\u{1b}[0m\n"),
        (vec!["graph", "sound.rules"], "\u{1b}[1mtree single_hand"),
        (vec!["analyze", "none.csv"], error),
        (vec!["audit", "none.csv"], error),
        (vec!["live", "none.csv", "--scene", "none.yaml"], "\u{1b}[1;31merror:\u{1b}[0m "),
    ] {
        let run = |when: &str| all_said(&teachtree_in(folder.path(), &[&args[..], &["--color", when]].concat()));
        let (colored, plain) = (run("always"), run("never"));
        assert!(colored.contains(wanted), "{args:?}: {colored:?}");
        let mut parts = colored.split("\u{1b}[");
        let first = parts.next().unwrap_or_default();
        let without: String = parts.map(|part| part.split_once('m').map_or(part, |(_, text)| text)).collect();
        assert_eq!(format!("{first}{without}"), plain, "{args:?}");
    }
}

/// The cost of rules is of interest to few: it is printed with `--verbose`.
#[test]
fn the_cost_of_rules_is_printed_with_verbose() {
    let short = said(&teachtree(&["check", "examples/hold.rules"]));
    let long = said(&teachtree(&["check", "examples/hold.rules", "--verbose"]));
    for cost in ["bytes of state", "look-ahead", "shared values"] {
        assert!(!short.contains(cost) && long.contains(cost), "{short}{long}");
    }
    assert!(short.contains("0 errors in ") && short.contains("relabeling rules"), "{short}");
}
