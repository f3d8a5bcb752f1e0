//! Names that would steer a terminal, in everything that every command reads: none of them is printed raw.

use crate::program::{complained, program, said, teachtree_in};
use std::path::Path;

/// Clears the screen, rings, reorders, sets a color by a C1 control, sets the title of the window, and ends a word of JSON.
const HOSTILE: &str = "a\u{1b}[2J\u{7}\u{202e}\u{9b}31m\u{1b}]0;title\u{7}\u{7f}";

/// The letters of a text that steer a terminal.
fn steering(text: &str) -> Vec<char> {
    let steers = |it: &char| it.is_control() && !matches!(it, '\n' | '\t') || ('\u{202a}'..='\u{202e}').contains(it);
    text.chars().filter(steers).collect()
}

/// A folder in which every name is hostile that can be.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/logs");
    let log = std::fs::read_to_string(fixtures.join("whole.csv")).unwrap();
    let mut lines = log.lines();
    // A column, its cells and the file are named so.
    let head = format!("{},\"{HOSTILE}\"\n", lines.next().unwrap());
    let rows: String = lines.map(|line| format!("{line},{HOSTILE}\n")).collect();
    std::fs::write(path(&format!("{HOSTILE}.csv")), head + &rows).unwrap();
    let scene = std::fs::read_to_string(fixtures.join("box.yaml")).unwrap();
    std::fs::write(path(&format!("{HOSTILE}.scene.yaml")), &scene).unwrap();
    std::fs::write(path("scene.yaml"), &scene).unwrap();
    std::fs::write(path("bad.scene.yaml"), scene.replace("cube:", &format!("{HOSTILE:?}:"))).unwrap();
    std::fs::write(path("bad.binding.yaml"), format!("time: {HOSTILE:?}\n{HOSTILE:?}: 1\n")).unwrap();
    std::fs::write(path("bad.rules"), format!("signal {HOSTILE} = 1\nuse \"{HOSTILE}\"\n// {HOSTILE}\n")).unwrap();
    std::fs::write(path("good.rules"), format!("// {HOSTILE}\nuse \"single_hand.rules\"\n")).unwrap();
    std::fs::write(path("labels.csv"), format!("start,end,label\n0,1,{HOSTILE}\n")).unwrap();
    std::fs::write(path("lines.jsonl"), format!("{{{HOSTILE:?}: 1}}\n")).unwrap();
    std::fs::write(path("commands.json"), format!("{{\"schema\": {HOSTILE:?}}}")).unwrap();
    std::fs::write(path("robot.yaml"), format!("{HOSTILE:?}: 1\n")).unwrap();
    let set = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/formats/lerobot_v30");
    crate::shared::folders::copy(&set, &path(&format!("{HOSTILE}set")));
    std::fs::copy(set.with_file_name("lerobot_v30.binding.yaml"), path("set.yaml")).unwrap();
    std::fs::copy(set.with_file_name("arrays/robomimic.hdf5"), path(&format!("{HOSTILE}.hdf5"))).unwrap();
    std::fs::write(path("a.expect"), format!("log: {HOSTILE}.csv\n{HOSTILE}: 1\n")).unwrap();
    folder
}

#[test]
fn no_command_prints_what_steers_a_terminal() {
    let folder = folder();
    let (log, out) = (format!("{HOSTILE}.csv"), format!("{HOSTILE}.out"));
    let (log, out) = (log.as_str(), out.as_str());
    let (set, both) = (format!("{HOSTILE}set"), format!("{HOSTILE}set#0..1"));
    let (set, both, worded) = (set.as_str(), both.as_str(), format!("RoundNut0={HOSTILE}"));
    let hdf5 = format!("{HOSTILE}.hdf5");
    let hdf5 = hdf5.as_str();
    let (new, bound) = (format!("{HOSTILE}new"), ["--binding", "set.yaml"]);
    let commands: &[&[&str]] = &[
        &["analyze", log],
        &["analyze", log, "--format", "json"],
        &["analyze", log, "-o", out],
        &["analyze", log, "--report", "page.html"],
        &["analyze", log, "--binding", "bad.binding.yaml"],
        &["analyze", log, "--scene", "bad.scene.yaml"],
        &["analyze", log, "--rules", "bad.rules"],
        &["analyze", "lines.jsonl"],
        &["analyze", HOSTILE],
        &["analyze", log, HOSTILE],
        &["live", log],
        &["live", log, "--format", "json"],
        &["inspect", log],
        &["inspect", log, "--format", "json"],
        &["init", log, "-o", "new"],
        &["config", log],
        &["inspect", "lines.jsonl"],
        &["explain", log, "--at", "0.2s"],
        &["explain", log, "--at", "0.2s", "--format", "json"],
        &["explain", log, "--at", HOSTILE],
        &["explain", log, "--at", "0.2s", "--why-not", HOSTILE],
        &["score", log, "--labels", "labels.csv", "--track", "right"],
        &["score", log, "--labels", "labels.csv", "--track", "right", "--format", "json"],
        &["score", log, "--map", HOSTILE],
        &["fit", log, "--labels", "labels.csv", "--track", "right"],
        &["fit", log, "--params", HOSTILE],
        &["test", "a.expect"],
        &["test", "."],
        &["check", "bad.rules"],
        &["check", "bad.rules", "--format", "json"],
        &["check", "bad.rules", "--format", "github"],
        &["check", HOSTILE],
        &["check", "--explain", HOSTILE],
        &["fmt", "--check", "bad.rules"],
        &["fmt", "--check", "good.rules"],
        &["graph", "bad.rules"],
        &["graph", "--log", log, "--at", "0.2s"],
        &["prove", "additive", "bad.rules"],
        &["diff", "bad.rules", "good.rules"],
        &["diff", HOSTILE, "good.rules"],
        &["teach", "bad.scene.yaml", "push", "-o", "t.csv"],
        &["teach", HOSTILE, "push", "-o", "t.csv"],
        &["teach", "push", HOSTILE, "-o", "t.csv"],
        &["teach", "push", "push", "-o", log],
        &["retarget", log, "-o", "c.json"],
        &["retarget", log, "--robot", "robot.yaml", "-o", "c.json"],
        &["simulate", "commands.json", "--scene", "push", "-o", "s.csv"],
        &["simulate", HOSTILE, "--scene", HOSTILE, "-o", "s.csv"],
        &["man", HOSTILE],
        &["show", HOSTILE],
        &["list", HOSTILE],
        &["completions", HOSTILE],
        &[HOSTILE],
        &["analyze", log, HOSTILE, "--nothing-is-called-so"],
        &["analyze", both, bound[0], bound[1], "--format", "json"],
        &["analyze", both, bound[0], bound[1], "--format", "csv", "-o", out],
        &["analyze", both, bound[0], bound[1], "--out-dir", HOSTILE],
        &["analyze", both, bound[0], bound[1], "--out-dir", HOSTILE, "--resume"],
        &["analyze", set, bound[0], bound[1], "--out-dir", set],
        &["analyze", &format!("{HOSTILE}set#7..9")],
        &["analyze", &format!("{HOSTILE}set#9..{HOSTILE}")],
        &["analyze", &format!("{HOSTILE}.hdf5#*")],
        &["inspect", both],
        &["inspect", set],
        &["diff", "contact.rules", "single_hand.rules", both, bound[0], bound[1]],
        &["score", both, bound[0], bound[1], "--labels", "."],
        &["annotate", set, "-o", &new, bound[0], bound[1], "--words", &worded],
        &["annotate", set, "-o", &new, bound[0], bound[1]],
        &["annotate", &new, "-o", HOSTILE, bound[0], bound[1]],
        &["annotate", &new, "-o", "other", bound[0], bound[1]],
        &["annotate", set, "-o", "other", "--binding", "bad.binding.yaml"],
        &["annotate", set, "-o", "other", bound[0], bound[1], "--words", HOSTILE],
        &["annotate", set, "-o", "other", bound[0], bound[1], "--words", "a=b"],
        &["annotate", log, "-o", "other"],
        &["annotate", HOSTILE, "-o", "other"],
        &["annotate", hdf5, "-o", "other", "--signal", HOSTILE],
        &["annotate", hdf5, "-o", "other", "--signal", &format!("a={HOSTILE}")],
        &["annotate", hdf5, "-o", "other", "--signal", &format!("a=start of {HOSTILE} {HOSTILE}")],
        &["annotate", hdf5, "-o", "other", "--signal", &format!("a=start of Grasp of {HOSTILE}")],
        &["annotate", hdf5, "-o", HOSTILE, "--signal", "a=start of Grasp"],
        &["analyze", log, "--mcap", &format!("{HOSTILE}.mcap")],
        &["analyze", log, "--mcap", HOSTILE],
        &["analyze", log, "--mcap", "a.mcap", "--signals", HOSTILE],
        &["analyze", log, "--mcap", "a.mcap", "--into"],
        &["analyze", log, "--trace", &format!("{HOSTILE}.json"), "--signals", HOSTILE],
        &["audit", HOSTILE],
        &["audit", both, bound[0], bound[1], "--page", "audit.html", "--keep", HOSTILE],
        &["audit", set, bound[0], bound[1], "--format", "csv", "--rest", HOSTILE],
        &["audit", hdf5, bound[0], bound[1], "--mask", HOSTILE, "--allow", HOSTILE],
    ];
    for args in commands {
        let output = teachtree_in(folder.path(), args);
        assert!(matches!(output.status.code(), Some(0..=3)), "{args:?}: {:?} {}", output.status, complained(&output));
        for text in [said(&output), complained(&output)] {
            assert_eq!(steering(&text), [], "{args:?}: {text:?}");
        }
        if args.contains(&"json") {
            // Of several recordings each line is a document.
            let text = said(&output);
            let documents = serde_json::Deserializer::from_str(&text).into_iter::<serde_json::Value>();
            assert!(documents.into_iter().all(|document| document.is_ok()), "{args:?}: {text}");
        }
    }
}

/// The events of a log are escaped in a pipe too, since a program such as `tee` may write them to a terminal.
#[test]
fn events_of_a_live_log_are_escaped_in_pipes() {
    let folder = tempfile::tempdir().unwrap();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/logs");
    let log = std::fs::read_to_string(fixtures.join("whole.csv")).unwrap();
    let mut lines = log.lines();
    let head = format!("{},x\u{1b}]0;title\u{7}\u{9b}\u{202e}\n", lines.next().unwrap());
    let rows: String = lines.map(|line| format!("{line},0\n")).collect();
    std::fs::write(folder.path().join("log.csv"), head + &rows).unwrap();
    std::fs::copy(fixtures.join("box.yaml"), folder.path().join("log.scene.yaml")).unwrap();
    for format in ["text", "json"] {
        let text = said(&teachtree_in(folder.path(), &["live", "log.csv", "--format", format]));
        assert!(text.contains("title"), "{text:?}");
        assert_eq!(steering(&text), [], "{text:?}");
    }
}

/// JSON says the same as before: what steers is written by its number.
#[test]
fn json_keeps_names_as_they_are() {
    let folder = folder();
    let text = said(&teachtree_in(folder.path(), &["inspect", &format!("{HOSTILE}.csv"), "--format", "json"]));
    let printed: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!(printed["log"].as_str().unwrap_or_else(|| panic!("{printed}")).starts_with(HOSTILE), "{printed}");
}

/// A line may have a name of half a megabyte in it: its beginning and its end are printed.
#[test]
fn long_names_are_shortened() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("log.csv"), format!("t,{}\n0,1\n1,2\n", "x".repeat(500_000))).unwrap();
    let output = teachtree_in(folder.path(), &["inspect", "log.csv"]);
    let longest = said(&output).lines().map(|line| line.chars().count()).max().unwrap();
    assert!(longest < 2100, "{longest}");
    assert!(said(&output).contains("characters"), "{}", said(&output));
}

/// Tables are written byte for byte into a pipe, and escaped on a terminal, which `script` makes.
#[cfg(unix)]
#[test]
fn a_terminal_gets_no_raw_table() {
    let folder = folder();
    let run = program(folder.path(), &[]).get_program().to_string_lossy().into_owned();
    let command = format!("'{run}' analyze ./a*.csv --format csv 2>/dev/null");
    let script = std::process::Command::new("script")
        .args(["-qec", &command, "/dev/null"])
        .current_dir(folder.path())
        .env("TERM", "dumb")
        .output();
    let Ok(output) = script else { return };
    let text = String::from_utf8_lossy(&output.stdout).replace('\r', "");
    assert_eq!(steering(&text), [], "{text:?}");
}
