//! Data sets and folders of recordings: each episode is a recording, some may fail, and what is done need not be done again.

use crate::program::{all_said, complained, said, teachtree_in};
use crate::shared::folders::copy;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Output;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_path_buf()
}

/// A folder with the LeRobot set of three episodes, `set`, and its binding, `b.yaml`.
pub fn with_set() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let fixtures = root().join("tests/fixtures/formats");
    copy(&fixtures.join("lerobot_v30"), &folder.path().join("set"));
    std::fs::copy(fixtures.join("lerobot_v30.binding.yaml"), folder.path().join("b.yaml")).unwrap();
    folder
}

fn documents(output: &Output) -> Vec<Value> {
    said(output).lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn names(documents: &[Value]) -> Vec<&str> {
    documents.iter().map(|document| document["log"]["path"].as_str().unwrap()).collect()
}

#[test]
fn each_episode_of_a_set_is_a_recording() {
    let folder = with_set();
    let analyze = |logs: &[&str]| {
        let mut args = vec!["analyze", "--binding", "b.yaml", "--format", "json"];
        args.extend(logs);
        teachtree_in(folder.path(), &args)
    };
    let all = documents(&analyze(&["set#*"]));
    assert_eq!(names(&all), ["set#0", "set#1", "set#2"]);
    assert_eq!(all[1]["log"]["name"], "set_1");
    // On one line it is what it is alone, also of the episode that begins in the middle of a file and the one in a file of its own.
    for (episode, document) in all.iter().enumerate() {
        let alone = analyze(&[&format!("set#{episode}")]);
        assert_eq!(&serde_json::from_str::<Value>(&said(&alone)).unwrap(), document);
    }
    assert_eq!([344, 100, 194], [0, 1, 2].map(|at| all[at]["log"]["frames"].as_u64().unwrap()));
    assert_eq!(names(&documents(&analyze(&["set#1..2", "set#1"]))), ["set#1", "set#2"]);
    for (choice, message) in [
        ("set#2..1", "expected the smaller number first"),
        ("set#1..3", "found 3 recordings, with numbers up to 2; `#1..3` selects others"),
        ("b.yaml#*", "found one recording, expected a LeRobot data set"),
        ("none#*", "there is no such file"),
        ("set", "set#*"),
    ] {
        let output = analyze(&[choice]);
        assert_eq!(output.status.code(), Some(2), "{choice}");
        assert!(complained(&output).contains(message), "{choice}: {}", complained(&output));
    }
}

#[test]
fn each_recording_of_an_hdf5_file_is_one() {
    let demos = root().join("demos/robosuite");
    let output = teachtree_in(
        &demos,
        &["analyze", "lift.hdf5#*", "--binding", "lift_hdf5.binding.yaml", "--format", "json", "--jobs", "1"],
    );
    let all = documents(&output);
    assert_eq!(names(&all), ["lift.hdf5#demo_1", "lift.hdf5#demo_3"]);
    assert_eq!(all[1]["log"]["name"], "lift_demo_3");
    // A file that is one recording has no other behind it.
    let arrays = root().join("tests/fixtures/formats/arrays");
    let inspected = teachtree_in(&arrays, &["inspect", "robomimic.hdf5#0..10", "--format", "json"]);
    assert_eq!(said(&inspected).lines().count(), 3, "{}", all_said(&inspected));
}

#[test]
fn folders_in_folders_hold_recordings() {
    let folder = with_set();
    let path = |name: &str| folder.path().join(name);
    std::fs::create_dir_all(path("all/one/deep")).unwrap();
    std::fs::create_dir_all(path("all/.hidden")).unwrap();
    std::fs::rename(path("set"), path("all/one/set")).unwrap();
    std::fs::copy(root().join("demos/robosuite/lift.hdf5"), path("all/one/deep/lift.hdf5")).unwrap();
    std::fs::copy(root().join("demos/robosuite/lift.hdf5"), path("all/.hidden/lift.hdf5")).unwrap();
    let output = teachtree_in(folder.path(), &["analyze", "all", "--binding", "b.yaml", "--format", "json"]);
    // The binding does not fit the other recordings; the episodes are there all the same.
    assert_eq!(output.status.code(), Some(3), "{}", complained(&output));
    assert_eq!(names(&documents(&output)), ["all/one/set#0", "all/one/set#1", "all/one/set#2"]);
    assert_eq!(complained(&output).matches("deep/lift.hdf5#demo_").count(), 2, "{}", complained(&output));
    let nothing = teachtree_in(folder.path(), &["score", "all/.hidden/../.hidden/.."]);
    assert_eq!(nothing.status.code(), Some(2));
}

/// A folder with copies of a demonstration in `logs`.
fn with_logs(names: &[&str]) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let demos = root().join("demos/robosuite");
    std::fs::create_dir(folder.path().join("logs")).unwrap();
    for name in names {
        std::fs::copy(demos.join("lift_demo_1.csv"), folder.path().join("logs").join(name)).unwrap();
    }
    (folder, demos.join("panda_lift.binding.yaml").to_str().unwrap().to_string())
}

#[test]
fn tables_with_equal_columns_are_recordings_in_every_command() {
    let (folder, binding) = with_logs(&["a.csv", "b.csv"]);
    let run = |args: &[&str]| teachtree_in(folder.path(), &[args, &["--binding", &binding]].concat());
    for more in [&[][..], &["--each"]] {
        let analyzed = run(&[&["analyze", "logs", "--format", "json"], more].concat());
        assert_eq!(names(&documents(&analyzed)), ["logs/a.csv", "logs/b.csv"]);
    }
    assert_eq!(said(&run(&["inspect", "logs", "--format", "json"])).lines().count(), 2);
    let audited = all_said(&run(&["audit", "logs"]));
    assert!(audited.contains("logs/a.csv") && audited.contains("of 2 recordings"), "{audited}");
    // Commands that take one recording list the names.
    for args in [
        &["explain", "logs", "--at", "14s"][..],
        &["retarget", "logs", "-o", "commands.json"],
        &["live", "logs", "--no-labels"],
    ] {
        let output = run(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", all_said(&output));
        let message = complained(&output);
        assert!(message.contains("logs/a.csv, logs/b.csv"), "{args:?}: {message}");
    }
    // The only recording of a folder needs no name.
    std::fs::remove_file(folder.path().join("logs/b.csv")).unwrap();
    let [of_folder, of_file] = ["logs", "logs/a.csv"].map(|log| said(&run(&["explain", log, "--at", "14s"])));
    assert!(!of_folder.is_empty());
    assert_eq!(of_folder, of_file);
    assert_eq!(said(&run(&["analyze", "logs"])), said(&run(&["analyze", "logs/a.csv"])));
}

#[test]
fn a_binding_makes_tables_with_equal_columns_parts_of_one_recording() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("log")).unwrap();
    let rows = |x: f64| (0..300).map(|row| format!("{:.2},{x},0,0.1\n", f64::from(row) * 0.01)).collect::<String>();
    for (name, x) in [("hand.csv", 0.0), ("cube.csv", 0.2)] {
        std::fs::write(folder.path().join("log").join(name), format!("time,x,y,z\n{}", rows(x))).unwrap();
    }
    let binding = "channels:\n  right.tcp.position: hand.<xyz>\n  cube.position: cube.<xyz>\nresample: 100 Hz\nscene: {bodies: {cube: {role: object, \
                   radius: 30 mm}}}\n";
    std::fs::write(folder.path().join("b.yaml"), binding).unwrap();
    let output = teachtree_in(folder.path(), &["analyze", "log", "--binding", "b.yaml", "--format", "json"]);
    assert_eq!(names(&documents_of(&output)), ["log"], "{}", all_said(&output));
}

/// Recordings that are named after hands, with columns of the same names.
#[test]
fn a_table_with_the_whole_name_of_a_bound_column_is_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("log")).unwrap();
    let rows: String = (0..300).map(|row| format!("{:.2},0,0,0.1,0.2,0,0.1\n", f64::from(row) * 0.01)).collect();
    for name in ["left.csv", "right.csv"] {
        let text = format!("time,right.x [m],right.y [m],right.z [m],cube.x,cube.y,cube.z\n{rows}");
        std::fs::write(folder.path().join("log").join(name), text).unwrap();
    }
    let binding = "channels:\n  right.tcp.position: right.<xyz>\n  cube.position: cube.<xyz>\nscene: {bodies: {cube: {role: object, radius: 30 mm}}}\n";
    std::fs::write(folder.path().join("b.yaml"), binding).unwrap();
    let output = teachtree_in(folder.path(), &["analyze", "log", "--binding", "b.yaml", "--format", "json"]);
    assert_eq!(names(&documents(&output)), ["log/left.csv", "log/right.csv"], "{}", all_said(&output));
}

/// The document of the only recording, which takes several lines.
fn documents_of(output: &Output) -> Vec<Value> {
    vec![serde_json::from_str(&said(output)).unwrap_or_else(|_| panic!("{}", all_said(output)))]
}

#[test]
fn a_file_is_written_for_each_recording_and_not_again() {
    let folder = with_set();
    let run = |more: &[&str]| {
        let args = ["analyze", "set#*", "--binding", "b.yaml", "--format", "json", "--out-dir", "out/deep"];
        teachtree_in(folder.path(), &[&args[..], more].concat())
    };
    let out = |name: &str| folder.path().join("out/deep").join(name);
    let read = |name: &str| std::fs::read_to_string(out(name)).unwrap();
    let first = run(&[]);
    assert!(first.status.success() && said(&first).is_empty(), "{}", all_said(&first));
    assert!(complained(&first).contains("3 written to out/deep"), "{}", complained(&first));
    assert!(
        complained(&first).contains("undetectable      2 in 1 recording, the first is set#1"),
        "{}",
        complained(&first)
    );
    let alone = teachtree_in(folder.path(), &["analyze", "set#2", "--binding", "b.yaml", "--format", "json"]);
    assert_eq!(read("set_2.json"), said(&alone));
    let manifest = read("manifest.jsonl");
    assert_eq!(manifest.lines().count(), 3);
    // The second run does nothing; what changed, is gone or was touched is done again.
    let again = |more: &[&str], said: &str| {
        let output = run(&[&["--resume"], more].concat());
        assert!(output.status.success() && complained(&output).contains(said), "{}", complained(&output));
    };
    again(&[], "0 written to out/deep, 3 unchanged");
    assert_eq!(read("manifest.jsonl"), manifest);
    std::fs::remove_file(out("set_0.json")).unwrap();
    std::fs::write(out("set_1.json"), "{").unwrap();
    again(&[], "2 written to out/deep, 1 unchanged");
    again(&["--set", "touch_on=0.2N"], "3 written");
    again(&["--set", "touch_on=0.2N"], "3 unchanged");
    again(&[], "3 written");
    again(&["--confidence"], "3 written");
    again(&["--confidence"], "3 unchanged");
    again(&[], "3 written");
    let binding = std::fs::read_to_string(folder.path().join("b.yaml")).unwrap();
    std::fs::write(folder.path().join("b.yaml"), binding + "# another one\n").unwrap();
    again(&[], "3 written");
    // An episode is read from its own file, and from the lists of the set.
    let other = folder.path().join("set/data/chunk-000/file-001.parquet");
    std::fs::copy(folder.path().join("set/data/chunk-000/file-000.parquet"), &other).unwrap();
    let output = run(&["--resume"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(complained(&output).contains("0 written to out/deep, 2 unchanged, 1 failed"), "{}", complained(&output));
    let quiet = run(&["-q"]);
    assert_eq!(complained(&quiet).lines().filter(|line| !line.contains("error") && !line.contains("help")).count(), 0);
}

/// What a file is made of: every option that changes it, and every file that is read for it, also one that another file names.
#[test]
fn what_changes_a_file_has_it_written_again() {
    let folder = with_set();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("base.rules", "use \"contact.rules\"\n");
    write("own.rules", "use \"base.rules\"\n");
    let run = |more: &[&str], columns: &str| {
        let args = ["analyze", "set#0", "--binding", "b.yaml", "--out-dir", "out", "--resume"];
        let args = [&args[..], more].concat();
        let output = crate::program::program(folder.path(), &args).env("COLUMNS", columns).output().unwrap();
        assert!(output.status.success(), "{more:?}: {}", all_said(&output));
        complained(&output).contains("1 unchanged")
    };
    let unchanged = |more: &[&str]| run(more, "100");
    let own = ["--rules", "own.rules"];
    for options in [
        &[][..],
        &["--format", "json"],
        &["--format", "csv"],
        &["--format", "csv", "--confidence"],
        &["--format", "eaf"],
        &["--set", "touch_on=0.3N"],
        &["--set", "touch_on=0.4N"],
        &["--hand", "hand_force.rules"],
        &own,
    ] {
        assert!(!unchanged(options), "{options:?}");
        assert!(unchanged(options), "{options:?}");
    }
    write("base.rules", "use \"contact.rules\"\n// Another comment.\n");
    assert!(!unchanged(&own) && unchanged(&own));
    assert!(!run(&own, "60") && run(&own, "60"));
    // Options that change no file.
    assert!(run(&[&own[..], &["--jobs", "1", "--each"]].concat(), "60"));
}

/// The parts of an array of jobs are all recordings, each once, in one folder with a list each.
#[test]
fn parts_together_are_the_whole() {
    let folder = with_set();
    let run = |more: &[&str]| {
        let args = ["analyze", "set#*", "--binding", "b.yaml", "--format", "json"];
        teachtree_in(folder.path(), &[&args[..], more].concat())
    };
    let whole = run(&[]);
    let parts = ["1/2", "2/2"].map(|part| said(&run(&["--shard", part])));
    let mut lines: Vec<&str> = parts.iter().flat_map(|part| part.lines()).collect();
    let whole = said(&whole);
    let mut expected: Vec<&str> = whole.lines().collect();
    lines.sort_unstable();
    expected.sort_unstable();
    assert_eq!((lines, parts[0].lines().count()), (expected, 2));
    assert_eq!(said(&run(&["--shard", "4/4"])), "");

    let write = |part: &str, said: &str| {
        let output = run(&["--out-dir", "out", "--resume", "--shard", part]);
        assert!(output.status.success() && complained(&output).contains(said), "{}", complained(&output));
    };
    write("1/2", "2 written to out");
    write("2/2", "1 written to out");
    let list = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).unwrap().lines().count();
    assert_eq!((list("manifest-1-of-2.jsonl"), list("manifest-2-of-2.jsonl")), (2, 1));
    // What one part did, another division of the work and the whole need not do again.
    write("3/3", "0 written to out, 1 unchanged");
    let output = run(&["--out-dir", "out", "--resume"]);
    assert!(complained(&output).contains("0 written to out, 3 unchanged"), "{}", complained(&output));
    for wrong in ["0/2", "3/2", "1", "a/b", "1/0"] {
        let output = run(&["--shard", wrong]);
        assert_eq!(output.status.code(), Some(2), "{wrong}");
        assert!(complained(&output).contains("expected I/N with I from 1 to N"), "{}", complained(&output));
    }
}

/// A program that is killed keeps what it has written, and the next one goes on there.
#[cfg(unix)]
#[test]
fn a_killed_run_is_resumed() {
    let folder = with_set();
    let args = ["analyze", "set#*", "--binding", "b.yaml", "--out-dir", "out", "--resume"];
    let manifest = folder.path().join("out/manifest.jsonl");
    let mut child = crate::program::program(folder.path(), &[&args[..], &["--jobs", "1"]].concat()).spawn().unwrap();
    // Killed when the first one is done; where that is too late, all are.
    while child.try_wait().unwrap().is_none() && std::fs::read_to_string(&manifest).unwrap_or_default().is_empty() {}
    let _ = child.kill();
    child.wait().unwrap();
    let done = std::fs::read_to_string(&manifest).unwrap().lines().count();
    // The end of a line is lost, as by a loss of power.
    let text = std::fs::read_to_string(&manifest).unwrap();
    std::fs::write(&manifest, format!("{text}{{\"schema\": \"teachtree.mani")).unwrap();
    let output = teachtree_in(folder.path(), &args);
    assert!(output.status.success(), "{}", all_said(&output));
    assert!(complained(&output).contains(&format!("{done} unchanged")), "{done}: {}", complained(&output));
    let clean = teachtree_in(folder.path(), &["analyze", "set#*", "--binding", "b.yaml", "--out-dir", "clean"]);
    assert!(clean.status.success());
    for name in ["set_0.txt", "set_1.txt", "set_2.txt"] {
        let read = |of: &str| std::fs::read_to_string(folder.path().join(of).join(name)).unwrap();
        assert_eq!(read("out"), read("clean"));
    }
    assert_eq!(std::fs::read_to_string(&manifest).unwrap().lines().count(), 3);
}

#[test]
fn outputs_are_never_inputs() {
    let folder = with_set();
    let path = |name: &str| folder.path().join(name);
    std::fs::create_dir_all(path("a")).unwrap();
    std::fs::create_dir_all(path("b")).unwrap();
    copy(&path("set"), &path("a/set"));
    copy(&path("set"), &path("b/set"));
    let run = |args: &[&str]| {
        let output = teachtree_in(folder.path(), &[&["analyze", "--binding", "b.yaml"], args].concat());
        (output.status.code(), complained(&output))
    };
    let (code, said) = run(&["a", "--out-dir", "a/out"]);
    assert!(code == Some(2) && said.contains("a/out: is in a, which is read"), "{said}");
    let (code, said) = run(&["set#0", "--out-dir", "set/out"]);
    assert!(code == Some(2) && said.contains("is in set, which is read"), "{said}");
    let (code, said) = run(&["a/set#0", "b/set#0", "--out-dir", "out"]);
    assert!(code == Some(2) && said.contains("`a/set#0` and `b/set#0` would both be written there"), "{said}");
    assert!(!path("out").exists());
    let (code, said) = run(&["a", "b", "--out-dir", "out", "-q"]);
    assert!(code == Some(2), "{said}");
    let (code, said) = run(&["set#0", "--out-dir", "b.yaml"]);
    assert!(code == Some(2) && said.contains("b.yaml"), "{said}");
    let (code, _) = run(&["set#0", "--resume"]);
    assert_eq!(code, Some(2));
}

/// Of many recordings with the same failure some are named and the others counted.
#[test]
fn the_same_failure_is_reported_a_few_times() {
    let folder = with_set();
    for name in 0..9 {
        std::fs::write(folder.path().join(format!("{name}.csv")), "t,a\n").unwrap();
    }
    let args: Vec<String> = (0..9).map(|name| format!("{name}.csv")).collect();
    let mut all = vec!["analyze", "--binding", "b.yaml", "set#1"];
    all.extend(args.iter().map(String::as_str));
    let output = teachtree_in(folder.path(), &all);
    assert_eq!(output.status.code(), Some(3));
    let said = complained(&output);
    assert_eq!(said.matches(".csv").count(), 3, "{said}");
    assert!(said.contains("6 more recordings"), "{said}");
}

/// Scores and differences of episodes are those of the recordings that they were made from.
#[test]
fn episodes_are_scored_and_compared() {
    let folder = with_set();
    let run = |args: &[&str]| teachtree_in(folder.path(), args);
    let labels = folder.path().join("labels");
    std::fs::create_dir(&labels).unwrap();
    for episode in 0..3 {
        let log = format!("set#{episode}");
        let csv = said(&run(&["analyze", &log, "--binding", "b.yaml", "--format", "json"]));
        let document: Value = serde_json::from_str(&csv).unwrap();
        let segments = document["tracks"][0]["relabeled"].as_array().unwrap();
        let mut text = String::from("start_s,end_s,label\n");
        for segment in segments {
            let cell = |key: &str| segment[key].to_string();
            text += &format!("{},{},{}\n", cell("start_s"), cell("end_s"), segment["primitive"].as_str().unwrap());
        }
        std::fs::write(labels.join(format!("set_{episode}.labels.csv")), text).unwrap();
    }
    let output =
        run(&["score", "set#*", "--binding", "b.yaml", "--labels", "labels", "--track", "right", "--format", "json"]);
    let score: Value = serde_json::from_str(&said(&output)).unwrap_or_else(|_| panic!("{}", all_said(&output)));
    assert!(output.status.success(), "{}", complained(&output));
    assert!(said(&output).contains("set#2"), "{score}");
    let difference = run(&["diff", "single_hand.rules", "contact.rules", "set#0..1", "--binding", "b.yaml"]);
    assert!(
        said(&difference).contains("\nset#0\n") && said(&difference).contains("\nset#1\n"),
        "{}",
        all_said(&difference)
    );
}

/// Every file that is in the program is listed, and printed as it is; a file that is missing in the program is one that was forgotten.
#[test]
fn the_files_in_the_program_are_printed() {
    let listed = said(&teachtree_in(&root(), &["list"]));
    let mut folders = vec![root().join("rules"), root().join("scenes"), root().join("robots")];
    folders.extend(std::fs::read_dir(root().join("demos")).unwrap().map(|entry| entry.unwrap().path()));
    let mut found = 0;
    for folder in folders {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap().to_string();
            let is_binding = name.ends_with(".binding.yaml");
            if folder.starts_with(root().join("demos")) && !is_binding {
                continue;
            }
            found += 1;
            assert!(listed.lines().any(|line| line.split_whitespace().next() == Some(&name)), "{name} is not listed");
            let output = teachtree_in(&root(), &["show", &name]);
            assert!(output.status.success(), "{name}: {}", complained(&output));
            // Outside the repository the schema of a YAML file, which is printed too, stands beside it.
            let text = std::fs::read_to_string(&path).unwrap();
            let [here, there] = ["../schemas/", "../../schemas/"].map(|folder| text.replacen(folder, "", 1));
            assert!([&text, &here, &there].contains(&&said(&output)), "{name}");
            assert!(!said(&output).contains("$schema=.."), "{name}");
        }
    }
    assert!(found > 80, "{found}");
    // The ending may be left out where that is clear.
    let show = |name: &str| teachtree_in(&root(), &["show", name]);
    assert_eq!(said(&show("contact")), said(&show("contact.rules")));
    let two = show("push");
    assert!(
        two.status.code() == Some(2) && complained(&two).contains("`push.yaml`, `push.operator.yaml`"),
        "{}",
        complained(&two)
    );
    assert!(complained(&show("contcat.rules")).contains("did you mean `contact.rules`?"));
    assert_eq!(said(&teachtree_in(&root(), &["list", "robots"])).lines().count(), 7);
    let rules = said(&teachtree_in(&root(), &["list", "rules"]));
    let described = |line: &str| line.split_once(".rules ").is_some_and(|(_, about)| about.trim().ends_with('.'));
    assert!(rules.lines().all(described) && !rules.contains("  /"), "{rules}");
    // Files are found by their former names.
    assert_eq!(said(&show("hand_felt.rules")), said(&show("wrist_force.rules")));
    let checked = teachtree_in(&root(), &["check", "rules/contact.rules", "--hand", "hand_seen.rules"]);
    assert!(checked.status.success() && said(&checked).contains("hand_vision.rules"), "{}", complained(&checked));
}

/// A recording that was cut off leaves a set that says less than it has; lerobot reads all of it.
#[test]
fn a_set_with_more_episodes_than_it_says_is_an_error() {
    let folder = with_set();
    let info = folder.path().join("set/meta/info.json");
    let text = std::fs::read_to_string(&info).unwrap().replace("\"total_episodes\": 3", "\"total_episodes\": 2");
    std::fs::write(&info, text).unwrap();
    let output = teachtree_in(folder.path(), &["analyze", "set#*", "--binding", "b.yaml"]);
    assert_eq!(output.status.code(), Some(2), "{}", all_said(&output));
    let wanted = "info.json: `total_episodes` is 2, but there is an episode 2, counted from 0";
    assert!(complained(&output).contains(wanted), "{}", complained(&output));
}

#[test]
fn a_set_without_episodes_is_an_error() {
    let folder = with_set();
    let info = folder.path().join("set/meta/info.json");
    let text = std::fs::read_to_string(&info).unwrap().replace("\"total_episodes\": 3", "\"total_episodes\": 0");
    std::fs::write(&info, text).unwrap();
    for args in [
        &["audit", "set", "--binding", "b.yaml"][..],
        &["inspect", "set#*"],
        &["analyze", "set#*", "--binding", "b.yaml"],
        &["annotate", "set", "-o", "new", "--binding", "b.yaml"],
    ] {
        let output = teachtree_in(folder.path(), args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", all_said(&output));
        assert!(
            complained(&output).contains("info.json: the data set has no episode"),
            "{args:?}: {}",
            all_said(&output)
        );
    }
}

#[test]
fn a_binding_that_is_missing_is_reported_once() {
    let folder = with_set();
    for command in [
        &["analyze", "set#*"][..],
        &["analyze", "set#*", "--out-dir", "out"],
        &["audit", "set"],
        &["annotate", "set", "-o", "copy"],
        &["score", "set#*"],
        &["fit", "set#*"],
    ] {
        let output = teachtree_in(folder.path(), &[command, &["--binding", "none.yaml", "-q"]].concat());
        assert_eq!(output.status.code(), Some(2), "{command:?}");
        assert_eq!(complained(&output).trim_end(), "error: none.yaml: there is no such file", "{command:?}");
    }
}
