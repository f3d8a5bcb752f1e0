//! The command line as a user meets it: what it prints, what it writes, how it exits.

use crate::program::{all_said, complained, demonstrate, said, teachtree, teachtree_in};
use serde_json::Value;
use std::path::{Path, PathBuf};

fn read(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// The primitives of a list of segments.
fn names(segments: &Value) -> String {
    let names: Vec<&str> =
        segments.as_array().unwrap().iter().map(|segment| segment["primitive"].as_str().unwrap()).collect();
    names.join(" ")
}

#[test]
fn the_demo_tells_the_experiment_of_the_chapter() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("demo");
    let output = teachtree(&["demo", "--out", out.to_str().unwrap()]);
    assert!(output.status.success(), "{}", complained(&output));
    assert!(!said(&output).contains('\u{1b}'), "no color when piped");
    assert_eq!(complained(&output), "", "no progress bar when piped");
    let analysis = read(&out.join("analysis.json"));
    assert_eq!(analysis["schema"], "teachtree.analysis/2");
    let track = &analysis["tracks"][0];
    assert_eq!(
        names(&track["segments"]),
        "Move Approach Slide Grasp Translate Follow Place Release Move Approach Push Trace Push Trace Release"
    );
    let tasks = track["tasks"].as_array().unwrap();
    let printed: Vec<(&str, String)> =
        tasks.iter().map(|task| (task["task"].as_str().unwrap(), names(&task["segments"]))).collect();
    assert_eq!(
        printed,
        [
            ("pick_and_follow", "Move Approach Grasp Translate Follow Place Release".to_string()),
            ("push_and_trace", "Move Approach Push Trace Release".to_string()),
        ]
    );
    for file in
        ["demonstration.csv", "demonstration.scene.yaml", "report.html", "commands.json", "robot.csv", "robot.html"]
    {
        assert!(out.join(file).metadata().unwrap().len() > 1000, "{file}");
    }
    // A robot does it: both cubes end where the person left them, and its recording is read as the same tasks.
    let said = said(&output);
    for line in [
        "\ndone     pick_and_follow: ",
        "\ndone     push_and_trace: ",
        "\nits recording has the same tasks by the same rules: ",
    ] {
        assert!(said.contains(line), "{said}");
    }
}

#[test]
fn files_in_the_working_directory_do_not_replace_the_default_rules() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("rules")).unwrap();
    for file in ["rules/contact.rules", "contact.rules", "rules/hand_force.rules", "bimanual.rules"] {
        std::fs::write(folder.path().join(file), "not rules at all\n").unwrap();
    }
    for scene in ["stamp", "hand_over_left_to_right"] {
        let log = format!("{scene}.csv");
        teachtree_in(folder.path(), &["teach", scene, scene, "-o", &log]);
        let output = teachtree_in(folder.path(), &["analyze", &log]);
        assert!(output.status.success(), "{log}: {}", complained(&output));
    }
    // A file that is named is the one on disk.
    let output = teachtree_in(folder.path(), &["analyze", "stamp.csv", "--rules", "contact.rules"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(complained(&output).contains("contact.rules:1:1"), "{}", complained(&output));
}

#[test]
fn the_readme_shows_what_the_demo_prints() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("demo");
    let printed = said(&teachtree(&["demo", "--out", out.to_str().unwrap()]));
    let timeline = &printed[printed.find("\nright ").unwrap()..printed.find("\n\nwritten").unwrap()];
    let readme = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).unwrap();
    assert!(readme.contains(timeline.trim()), "README.md shows something else than:\n{timeline}");
}

#[test]
fn the_page_of_both_hands_shows_what_the_demo_prints() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("demo");
    let printed = said(&teachtree(&["demo", "--both-hands", "--seed", "2", "--out", out.to_str().unwrap()]));
    let lanes = &printed[printed.find("\nleft ").unwrap()..printed.find("\nleft\n").unwrap()];
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/both_hands.md")).unwrap();
    assert!(page.contains(lanes.trim()), "docs/both_hands.md shows something else than:\n{lanes}");
    let robot = &printed[printed.find("\nthe robot\n").unwrap()..printed.find("\n\nwritten").unwrap()];
    assert!(page.contains(robot.trim()), "docs/both_hands.md shows something else than:\n{robot}");
    let analysis: Value = serde_json::from_str(&std::fs::read_to_string(out.join("analysis.json")).unwrap()).unwrap();
    let tracks: Vec<&str> =
        analysis["tracks"].as_array().unwrap().iter().map(|track| track["track"].as_str().unwrap()).collect();
    assert_eq!(tracks, ["left", "right", "both"]);
    // What the chapter's Figure 14 shows of both hands.
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    for panel in ["|F| of the hands", "F·up of the hands", "fingers that touch"] {
        assert!(page.contains(panel), "{panel}");
    }
}

#[test]
fn the_same_seed_records_the_same_bytes_and_another_seed_others() {
    let folder = tempfile::tempdir().unwrap();
    let record = |name: &str, seed: &str| {
        let log: PathBuf = folder.path().join(name);
        let output = teachtree(&["teach", "paper_box", "paper_box", "-o", log.to_str().unwrap(), "--seed", seed]);
        assert!(output.status.success(), "{}", complained(&output));
        std::fs::read(log).unwrap()
    };
    let first = record("first.csv", "7");
    assert!(first == record("again.csv", "7"));
    assert!(first != record("other.csv", "8"));
}

/// The name of a shipped scene is not a file: what is called like it may be taught again.
#[test]
fn a_recording_called_like_its_scene_is_taught_twice() {
    let folder = tempfile::tempdir().unwrap();
    for _ in 0..2 {
        let output = teachtree_in(folder.path(), &["teach", "stamp", "stamp", "-o", "stamp.csv"]);
        assert!(output.status.success(), "{}", complained(&output));
    }
}

/// When each primitive begins in a task, s.
fn begins(task: &Value, primitive: &str) -> f64 {
    let segment = task["segments"].as_array().unwrap().iter().find(|segment| segment["primitive"] == primitive);
    segment.unwrap_or_else(|| panic!("no {primitive} in {task}"))["start_s"].as_f64().unwrap()
}

#[test]
fn a_real_recording_has_its_two_insertions_where_they_were() {
    let output = teachtree(&[
        "analyze",
        "demos/robosuite/SawyerNutAssembly_demo_1.csv",
        "--binding",
        "demos/robosuite/sawyer_nut_assembly.binding.yaml",
        "--format",
        "json",
    ]);
    assert!(output.status.success(), "{}", complained(&output));
    let analysis: Value = serde_json::from_str(&said(&output)).unwrap();
    let tasks = analysis["tracks"][0]["tasks"].as_array().unwrap();
    assert_eq!(tasks.len(), 2);
    /// How far a boundary may be from the recording's contact events, s.
    const TOLERANCE: f64 = 0.15;
    // Both fingers on; off the table; 2 mm below the rim; fingers off. The round nut rocks on the table from 29.16 to 29.28.
    let gold = [[13.05, 13.37, 17.87, 18.93], [29.10, 29.22, 36.45, 36.97]];
    for (task, gold) in tasks.iter().zip(gold) {
        assert_eq!(task["task"], "peg_in_hole");
        for (primitive, gold) in ["Grasp", "Translate", "Insert", "Release"].into_iter().zip(gold) {
            let found = begins(task, primitive);
            assert!((found - gold).abs() <= TOLERANCE, "{primitive} at {found}, expected {gold}");
        }
    }
    // The aborted touch (9.85 to 10.92 s) is not a grasp.
    let raw = analysis["tracks"][0]["segments"].as_array().unwrap();
    let early = raw.iter().filter(|segment| segment["start_s"].as_f64().unwrap() < 12.0);
    assert!(early.clone().count() > 0);
    assert!(early.into_iter().all(|segment| segment["primitive"] == "Move" || segment["primitive"] == "Approach"));
}

#[test]
fn real_stacking_is_pick_and_place() {
    for (log, binding) in [("SawyerStack_demo_1", "sawyer_stack"), ("stack_panda_demo_1", "panda_stack")] {
        let log = format!("demos/robosuite/{log}.csv");
        let binding = format!("demos/robosuite/{binding}.binding.yaml");
        let output = teachtree(&["analyze", &log, "--binding", &binding, "--format", "json"]);
        let analysis: Value = serde_json::from_str(&said(&output)).unwrap();
        let tasks = analysis["tracks"][0]["tasks"].as_array().unwrap();
        assert_eq!(tasks.len(), 1, "{log}");
        assert_eq!(tasks[0]["task"], "pick_and_place", "{log}");
    }
}

#[test]
fn a_new_primitive_needs_one_file_and_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.csv");
    demonstrate("paper_box", &[], &log);
    // Outside the repository: `use` finds the shipped rules in the program.
    let rules = folder.path().join("hold.rules");
    std::fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/hold.rules"), &rules).unwrap();
    let rules = rules.to_str().unwrap();
    let check = teachtree(&["check", rules]);
    assert!(check.status.success(), "{}", said(&check));
    let with = teachtree(&["analyze", log.to_str().unwrap(), "--rules", rules, "--format", "json"]);
    let without = teachtree(&["analyze", log.to_str().unwrap(), "--format", "json"]);
    assert!(said(&with).contains("\"Hold\""), "{}", said(&with));
    assert!(!said(&without).contains("\"Hold\""));
}

#[test]
fn exit_status_tells_a_no_from_bad_input() {
    let folder = tempfile::tempdir().unwrap();
    let rules = folder.path().join("broken.rules");
    std::fs::write(&rules, "use \"contact.rules\"\nprimitive Wave\nsignal waving = speed > 3 N\n").unwrap();
    let check = teachtree(&["check", rules.to_str().unwrap()]);
    assert_eq!(check.status.code(), Some(1));
    assert!(said(&check).contains("broken.rules:3"), "{}", said(&check));
    for args in [
        &["analyze", "no_such.csv"][..],
        &["analyze", "README.md"],
        &["teach", "nowhere", "no_operator", "-o", "x.csv"],
        &["walk"],
    ] {
        let output = teachtree(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", said(&output));
        assert!(complained(&output).contains("error: "), "{args:?}: {}", complained(&output));
    }
}

#[test]
fn a_rule_file_that_is_not_there_is_bad_input() {
    for args in [
        &["check", "no_such.rules"][..],
        &["check", "--hand", "no_such.rules"],
        &["graph", "no_such.rules"],
        &["graph", "rules/stream.rules"],
    ] {
        let output = teachtree(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", said(&output));
        assert_eq!(said(&output), "", "{args:?}");
        assert!(complained(&output).starts_with("error[E"), "{args:?}: {}", complained(&output));
    }
}

#[test]
fn nothing_is_half_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("analysis.json");
    std::fs::write(&out, "what was there").unwrap();
    let output = teachtree(&["analyze", "tests/fixtures/logs/empty.csv", "--out", out.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(std::fs::read_to_string(&out).unwrap(), "what was there");
}

#[test]
fn an_input_is_never_written_over() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.csv");
    std::fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/logs/whole.csv"), &log).unwrap();
    let before = std::fs::read(&log).unwrap();
    let output = teachtree(&[
        "analyze",
        log.to_str().unwrap(),
        "--scene",
        "tests/fixtures/logs/box.yaml",
        "--out",
        log.to_str().unwrap(),
    ]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(complained(&output).contains("would be lost"), "{}", complained(&output));
    assert!(std::fs::read(&log).unwrap() == before);
}

/// Neither what rules use, nor a scene that many operators are taught in, nor a log among others; and a report that cannot be kept leaves nothing behind.
#[test]
fn what_is_read_on_the_way_is_not_written_over_either() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let run = |args: &[&str]| teachtree_in(folder.path(), args);
    let taught = run(&["teach", "stamp", "stamp", "--seeds", "1..1", "-o", "people"]);
    assert!(taught.status.success(), "{}", complained(&taught));
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("rules");
    for name in ["contact.rules", "single_hand.rules", "hand_force.rules", "stream.rules"] {
        std::fs::copy(shipped.join(name), path(name)).unwrap();
    }
    std::fs::write(path("top.rules"), "use \"contact.rules\"\n").unwrap();
    let log = "people/stamp_0001.csv";
    for args in [
        &["analyze", log, "--rules", "top.rules", "--report", "page.html", "-o", "contact.rules"][..],
        &["command", log, "--robot", "both_hands", "--rules", "top.rules", "-o", "contact.rules"],
        &["score", log, "--rules", "top.rules", "-o", "contact.rules"],
        &["graph", "top.rules", "-o", "contact.rules"],
        &["teach", "people/stamp_0001.scene.yaml", "stamp", "--seeds", "1..1", "-o", "people"],
        &["analyze", "people", "--format", "csv", "-o", log],
    ] {
        let output = run(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", said(&output));
        assert!(
            complained(&output).contains("is an input of this command and would be lost"),
            "{args:?}: {}",
            complained(&output)
        );
    }
    // A folder may be a log in parts.
    std::fs::create_dir(path("parts")).unwrap();
    std::fs::write(path("parts/a.csv"), "t,x\n0,1\n1,2\n").unwrap();
    let replaced = run(&["inspect", "parts", "--skeleton", "parts/a.csv"]);
    assert!(complained(&replaced).contains("is replaced by `teachtree init`"), "{}", complained(&replaced));
    assert_eq!(std::fs::read_to_string(path("parts/a.csv")).unwrap(), "t,x\n0,1\n1,2\n");
    assert!(!path("page.html").exists());
    assert_eq!(std::fs::read(path("contact.rules")).unwrap(), std::fs::read(shipped.join("contact.rules")).unwrap());
}

/// Two things in one file would leave one of them; a recording under a name that cannot be read again would be lost.
#[test]
fn one_file_is_not_written_twice() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let log = "demos/robosuite/stack_panda_demo_1.csv";
    let binding = ["--binding", "demos/robosuite/panda_stack.binding.yaml"];
    let (one, other) = (place("a.txt"), format!("{}/./a.txt", folder.path().display()));
    let twice = teachtree(&[&["analyze", log, "-o", &one, "--report", &other][..], &binding].concat());
    assert_eq!(twice.status.code(), Some(2));
    assert!(complained(&twice).contains("is the file of two outputs"), "{}", complained(&twice));
    assert!(!Path::new(&one).exists());
    let scored = teachtree(&["score", log, "-o", &one, "--picture", &one]);
    assert!(complained(&scored).contains("is the file of two outputs"), "{}", complained(&scored));
    let (commands, recording, beside) = (place("commands.json"), place("robot.csv"), place("robot.scene.yaml"));
    let none = r#"{"schema": "teachtree.commands/1", "log": "", "rate_hz": 100, "scene": "", "tasks": []}"#;
    std::fs::write(&commands, none).unwrap();
    let simulated = teachtree(&["simulate", &commands, "--scene", "slide", "-o", &recording, "--report", &beside]);
    assert!(complained(&simulated).contains("is the file of two outputs"), "{}", complained(&simulated));
    for name in ["taught.html", "log.scene.yaml"] {
        let taught = teachtree(&["teach", "slide", "slide", "-o", &place(name)]);
        assert_eq!(taught.status.code(), Some(2), "{name}");
        assert!(complained(&taught).contains("expected .csv or .parquet"), "{}", complained(&taught));
    }
    // What a log quotes does not steer the terminal.
    let steering = place("steering.csv");
    std::fs::write(&steering, "a\u{1b}[31mRED,b\n1,2\n").unwrap();
    let output = teachtree(&["analyze", &steering]);
    assert_eq!(output.status.code(), Some(2));
    assert!(!complained(&output).contains('\u{1b}'), "{:?}", complained(&output));
}

#[test]
fn a_bad_recording_does_not_hide_the_good_ones() {
    let good = "demos/robosuite/stack_panda_demo_1.csv";
    let binding = "demos/robosuite/panda_stack.binding.yaml";
    let output = teachtree(&["analyze", "no_such.csv", good, "--binding", binding]);
    assert_eq!(output.status.code(), Some(3));
    assert!(said(&output).contains("pick_and_place"));
    assert!(complained(&output).contains("no_such.csv"));
}

#[cfg(unix)]
#[test]
fn links_are_followed_and_devices_stay_devices() {
    let folder = tempfile::tempdir().unwrap();
    let (target, link) = (folder.path().join("target.json"), folder.path().join("link.json"));
    std::fs::write(&target, "").unwrap();
    std::os::unix::fs::symlink(&target, &link).unwrap();
    let analyze = |out: &str| {
        let binding = "demos/robosuite/panda_stack.binding.yaml";
        teachtree(&["analyze", "demos/robosuite/stack_panda_demo_1.csv", "--binding", binding, "--out", out])
    };
    assert!(analyze(link.to_str().unwrap()).status.success());
    assert!(link.symlink_metadata().unwrap().is_symlink());
    assert!(std::fs::read_to_string(&target).unwrap().contains("pick_and_place"));
    assert!(analyze("/dev/null").status.success());
    use std::os::unix::fs::FileTypeExt;
    assert!(std::fs::metadata("/dev/null").unwrap().file_type().is_char_device());
}

/// A quote that is never closed makes one cell of the rest of the log; that must not pass for a cut last row.
#[test]
fn an_unclosed_quote_does_not_swallow_a_log() {
    let folder = tempfile::tempdir().unwrap();
    let whole =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/logs/whole.csv")).unwrap();
    let mut lines: Vec<String> = whole.lines().map(str::to_string).collect();
    lines[3].insert(0, '"');
    let log = folder.path().join("quote.csv");
    std::fs::write(&log, lines.join("\n") + "\n").unwrap();
    let output = teachtree(&["analyze", log.to_str().unwrap(), "--scene", "tests/fixtures/logs/box.yaml"]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(complained(&output).contains("row 4: a cell goes on"), "{}", complained(&output));
}

/// What is recorded can be analyzed: a scene with a name that no log can carry is refused before anything is taught.
#[test]
fn a_scene_that_no_log_can_carry_is_not_taught_in() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/paper_box.yaml")).unwrap();
    let (scene, log) = (folder.path().join("dotted.yaml"), folder.path().join("log.csv"));
    std::fs::write(&scene, text.replace("right_cube", "right.cube")).unwrap();
    let output = teachtree(&["teach", scene.to_str().unwrap(), "paper_box", "-o", log.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2));
    assert!(complained(&output).contains("right.cube"), "{}", complained(&output));
    assert!(!log.exists());
}

/// A logger that loses a row now and then, or ten of them, cuts no task, whatever the log is read by; a longer gap does. The table says that there is more to say.
#[test]
fn a_lost_row_cuts_no_task() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let (whole, holed) = (path("whole.csv"), path("holed.csv"));
    let taught = teachtree(&["teach", "pick_and_place", "pick_and_place", "--seed", "3", "-o", &whole]);
    let said = String::from_utf8(taught.stdout).unwrap();
    assert!(said.contains("the right hand completed pick_and_place\n"), "{said}");
    let text = std::fs::read_to_string(&whole).unwrap();
    let without = |rows: &[std::ops::Range<usize>]| {
        let kept = text.lines().enumerate().filter(|(row, _)| !rows.iter().any(|lost| lost.contains(row)));
        kept.map(|(_, line)| line.to_string() + "\n").collect::<String>()
    };
    let analyzed = |log: &str| {
        let output = teachtree(&["analyze", log, "--format", "json", "--scene", &path("whole.scene.yaml")]);
        let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
        let tasks = printed["tracks"][0]["tasks"].as_array().unwrap().clone();
        let kinds = printed["issues"].as_array().unwrap().iter().map(|issue| issue["kind"].as_str().unwrap().into());
        // Sensors have a bias.
        (tasks, kinds.filter(|kind: &String| kind != "biased").collect::<Vec<_>>())
    };
    std::fs::write(&holed, without(&[2500..2501, 3200..3210, 4000..4001])).unwrap();
    let ((tasks, _), (same, kinds)) = (analyzed(&whole), analyzed(&holed));
    assert_eq!(kinds, ["missing_row"]);
    assert_eq!(same.len(), tasks.len());
    for (one, other) in tasks.iter().zip(&same) {
        assert_eq!((&one["task"], names(&one["segments"])), (&other["task"], names(&other["segments"])));
    }
    let table = teachtree(&["analyze", &holed, "--format", "csv", "--scene", &path("whole.scene.yaml")]);
    let warned = complained(&table);
    assert!(warned.contains("holed.csv: the table omits issues") && warned.contains("missing_row 1"), "{warned}");
    std::fs::write(&holed, without(std::slice::from_ref(&(3200..3260)))).unwrap();
    assert_eq!(analyzed(&holed).1, ["gap"]);
}

/// The commands by group, with every one of them; `help NAME` and the manual know the same.
#[test]
fn each_command_is_listed_once() {
    let help = said(&teachtree(&["--help"]));
    let listed: Vec<&str> = help
        .lines()
        .take_while(|line| *line != "Options:")
        .filter_map(|line| line.strip_prefix("  ")?.split_whitespace().next())
        .collect();
    let bash = said(&teachtree(&["completions", "bash"]));
    let known = bash.split("teachtree,").skip(1).filter_map(|rest| rest.split(')').next());
    let mut known: Vec<&str> = known.filter(|name| *name != "help").collect();
    let mut sorted = listed.clone();
    sorted.sort_unstable();
    known.sort_unstable();
    // The former name is completed no more, and works.
    assert_eq!(sorted, known);
    assert!(listed.contains(&"retarget") && !listed.contains(&"command"));
    assert!(teachtree(&["command", "--help"]).status.success());
    for heading in ["Recognize:", "Write rules:", "Robot:", "Tools:"] {
        assert!(help.lines().any(|line| line == heading), "{help}");
    }
    let manual = said(&teachtree(&["man", "analyze"]));
    assert!(manual.contains(".SH NAME") && manual.contains("Segment recordings"), "{manual}");
    assert!(complained(&teachtree(&["man", "dance"])).contains("no command `dance`"));
}

#[test]
fn the_rule_files_of_a_folder_are_checked_one_by_one() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("a.rules", "use \"contact.rules\"\nuse \"shared.rules\"\nprimitive Grasp\n");
    write("b.rules", "use \"contact.rules\"\nuse \"shared.rules\"\n");
    write("shared.rules", "param idle = 1 s\n");
    let output = teachtree_in(folder.path(), &["check", "."]);
    assert_eq!(output.status.code(), Some(1));
    let printed = said(&output);
    assert_eq!(printed.matches("errors in").count() + printed.matches("error in").count(), 3, "{printed}");
    let output = teachtree_in(folder.path(), &["check", "--format", "json", "."]);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let findings = found["findings"].as_array().unwrap();
    assert!(
        findings.iter().any(|it| it["severity"] == "error" && it["labels"][0]["at"]["file"] == "./a.rules"),
        "{found}"
    );
    // What two of them use is reported once.
    let texts: Vec<String> = findings.iter().map(ToString::to_string).collect();
    assert!(texts.iter().enumerate().all(|(at, text)| !texts[..at].contains(text)), "{found}");
    std::fs::create_dir(folder.path().join("empty")).unwrap();
    let output = teachtree_in(folder.path(), &["check", "empty"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(complained(&output).contains("no `.rules` file"), "{}", complained(&output));
}

/// What would move the cursor, color or reorder a terminal's text is shown as escapes; JSON keeps it.
#[test]
fn a_name_cannot_steer_the_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let name = "a\u{1b}[2J\u{7}\u{202e}\u{9b}31m.csv";
    let log = std::fs::read_to_string("tests/fixtures/logs/whole.csv").unwrap();
    std::fs::write(folder.path().join(name), log).unwrap();
    std::fs::copy("tests/fixtures/logs/box.yaml", folder.path().join("box.yaml")).unwrap();
    let steers = |text: &str| text.chars().any(|it| it.is_control() && it != '\n' || it == '\u{202e}');
    for args in
        [&["analyze", name][..], &["inspect", name], &["explain", name, "--at", "0.2s"], &["analyze", "b\u{1b}[2J.csv"]]
    {
        let output = teachtree_in(folder.path(), &[args, &["--scene", "box.yaml"]].concat());
        for text in [said(&output), complained(&output)] {
            assert!(!steers(&text), "{args:?}: {text:?}");
        }
        let all = said(&output) + &complained(&output);
        assert!(args[0] == "explain" || all.contains("\\u{1b}[2J"), "{args:?}: {all}");
    }
}

#[test]
fn options_and_names_that_are_nearly_right_are_refused_with_what_is_expected() {
    let folder = tempfile::tempdir().unwrap();
    let demos = Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite");
    let log = demos.join("SawyerLift_demo_1.csv");
    let log = log.to_str().unwrap();
    for (args, message) in [
        (&["score", log, "--min-f1", "200"][..], "expected a number from 0 to 100"),
        (&["score", log, "--min-edit", "nan"], "expected a number from 0 to 100"),
        (&["analyze", log, "--trace", "t.csv"], "t.csv: expected a name that ends in .json"),
        (&["check", "contct.rules"], "did you mean `contact.rules`?"),
        (&["check", "contact.rules", "--hand", "hand_griper"], "did you mean `hand_gripper.rules`?"),
        (&["check", "contact.rules", "--hand", "hand_gripper"], "did you mean `hand_gripper.rules`?"),
        (&["live", "udp://x"], "expected `ADDRESS:PORT`"),
    ] {
        let output = teachtree_in(folder.path(), args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(all_said(&output).contains(message), "{args:?}: {}", all_said(&output));
    }
    assert!(std::fs::read_dir(folder.path()).unwrap().next().is_none());
    // The error stands alone where no expectation could be read.
    let output = teachtree_in(folder.path(), &["test", "nope"]);
    assert_eq!(all_said(&output).trim_end(), "error: nope: there is no such file");
}

/// `live` reads one source and no folder; `lsp` takes its files from an editor.
#[test]
fn every_command_that_takes_recordings_takes_the_same_options_of_input() {
    let help = said(&teachtree(&["-h"]));
    let commands = help.lines().filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    let commands =
        commands.filter(|name| !name.is_empty() && !name.starts_with('-') && !["live", "lsp"].contains(name));
    let mut taken = vec![];
    for command in commands.map(|name| if name == "export" { vec![name, "lerobot"] } else { vec![name] }) {
        let of_command = said(&teachtree(&[&command[..], &["-h"]].concat()));
        if of_command.contains("--binding <FILE>") || command == ["init"] {
            assert!(command == ["init"] || of_command.contains("--scene <FILE>"), "{command:?}");
            // An option that is not known is refused before `-h` is obeyed.
            let output = teachtree(&[&command[..], &["--each", "-h"]].concat());
            assert!(output.status.success(), "{command:?}: {}", complained(&output));
            taken.push(command[0].to_string());
        }
    }
    for expected in ["analyze", "annotate", "audit", "config", "diff", "explain", "inspect", "studio"] {
        assert!(taken.iter().any(|name| name == expected), "{expected} is not among {taken:?}");
    }
}
