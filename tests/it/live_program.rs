//! `teachtree live` as a program: lines on standard input, and how it ends.

use crate::live_log::{Rows, demonstration};
use crate::program::{complained, program, said, teachtree_fed};
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
#[cfg(unix)]
use std::time::{Duration, Instant};
use teachtree_base::recording::Recording;

fn object(rows: &Rows, row: &[f64]) -> String {
    let values = row.iter().map(|value| serde_json::json!(value));
    let object: serde_json::Map<String, serde_json::Value> = rows.titles.iter().cloned().zip(values).collect();
    format!("{}\n", serde_json::Value::Object(object))
}

/// A demonstration as its scene and lines of JSON.
fn json(recording: &Recording) -> (String, Vec<String>) {
    let rows = Rows::of(recording);
    let scene = format!("{}\n", serde_json::json!({ "scene": recording.scene }));
    (scene, rows.rows.iter().map(|row| object(&rows, row)).collect())
}

fn live(args: &[&str], input: &str) -> String {
    let args: Vec<&str> = ["live", "-", "--no-labels"].iter().chain(args).copied().collect();
    let output = teachtree_fed(&args, input.as_bytes());
    assert!(output.status.success(), "{}", complained(&output));
    said(&output)
}

fn refused(args: &[&str], input: &str) -> String {
    let args: Vec<&str> = ["live", "-"].iter().chain(args).copied().collect();
    let output = teachtree_fed(&args, input.as_bytes());
    assert_eq!(output.status.code(), Some(2));
    complained(&output)
}

const TASK: &str = "task    right pick_and_place";

/// How long a program that was sent a signal may take to end on a busy machine.
#[cfg(unix)]
const PATIENCE: Duration = Duration::from_secs(120);

#[test]
fn lines_that_are_not_rows_are_left_out() {
    let (scene, lines) = json(&demonstration("pick_and_place"));
    let (early, rest) = lines.split_at(1000);
    let (middle, late) = rest.split_at(3000);
    // Within the calibration: no object, no stamp, a stamp that comes too late; after it: no object, a line that is too long.
    let calibrating = format!("nonsense\n{{\"right.thumb.force.x\": 1}}\n{}", early[10]);
    let long = format!("{{\"time\": \"{}\"}}\n", " ".repeat(2 << 20));
    let input = [&scene, &early.concat(), &calibrating, &middle.concat(), "nonsense\n", &long, &late.concat()].concat();
    let said = live(&[], &input);
    assert!(said.contains(TASK), "{said}");
    let issues: Vec<&str> = said.lines().filter(|line| line.starts_with("issue")).collect();
    insta::assert_snapshot!(issues.join("\n"));
}

/// A byte order mark, numbers as text.
#[test]
fn texts_that_are_numbers_are_read() {
    let recording = demonstration("pick_and_place");
    let (scene, lines) = json(&recording);
    let expected = live(&[], &[&scene, &lines.concat()[..]].concat());
    assert!(expected.contains(TASK));
    let quoted: String = lines
        .iter()
        .map(|line| {
            let mut object: serde_json::Value = serde_json::from_str(line).unwrap();
            object.as_object_mut().unwrap().values_mut().for_each(|value| *value = value.to_string().into());
            format!("{object}\n")
        })
        .collect();
    assert_eq!(live(&[], &format!("\u{feff}{scene}{quoted}")), expected);
    let rows = Rows::of(&recording);
    let csv: String = rows
        .rows
        .iter()
        .map(|row| format!("{}\n", row.iter().map(f64::to_string).collect::<Vec<_>>().join(",")))
        .collect();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("cell.scene.yaml");
    std::fs::write(&file, serde_json::to_string(&recording.scene).unwrap()).unwrap();
    let file = file.display().to_string();
    let titles = rows.titles.join(",");
    assert_eq!(live(&["--scene", &file], &format!("\u{feff}{titles}\n{csv}")), expected);
    // The scene that was named counts, not that of the first line.
    let other = serde_json::json!({ "scene": demonstration("several_tasks").scene });
    assert_eq!(live(&["--scene", &file], &format!("{other}\n{}", lines.concat())), expected);
}

#[test]
fn what_is_not_a_log_is_refused() {
    let (scene, lines) = json(&demonstration("pick_and_place"));
    let said = [
        refused(&[], "time,right.thumb.force.x,right.thumb.force.x\n"),
        refused(&[], "nonsense\n"),
        refused(&[], &lines[0]),
        refused(&[], &scene),
        refused(&["--calibrate", "0"], ""),
    ];
    insta::assert_snapshot!(said.join("\n"));
}

/// The first line has a scene that cannot be read: the program says why, not that there is none.
#[test]
fn a_wrong_scene_of_the_first_line_is_named() {
    let (scene, lines) = json(&demonstration("pick_and_place"));
    for (wrong, why) in [
        (scene.replace("\"block\"", "\"blo,ck\""), "standard input row 1: scene.bodies: `blo,ck` cannot name a body"),
        (format!("{}\n", scene.trim_end().trim_end_matches('}')), "standard input row 1: found no JSON object"),
    ] {
        assert_ne!(wrong, scene);
        let said = refused(&[], &format!("{wrong}{}", lines.concat()));
        assert!(said.contains(why), "{said}");
    }
    // The scene that is named counts.
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("cell.scene.yaml");
    std::fs::write(&file, serde_json::to_string(&demonstration("pick_and_place").scene).unwrap()).unwrap();
    let said = live(&["--scene", file.to_str().unwrap()], &format!("{{\"scene\": 1}}\n{}", lines.concat()));
    assert!(said.contains(TASK), "{said}");
}

/// Without the feature the program says how it is had.
#[cfg(not(feature = "zenoh"))]
#[test]
fn zenoh_needs_a_feature() {
    let output = crate::program::teachtree(&["live", "zenoh:cell/rows"]);
    assert_eq!(output.status.code(), Some(2));
    insta::assert_snapshot!(complained(&output));
}

/// What is wrong with the recording that sensors are calibrated with is not wrong with the log.
#[test]
fn issues_of_the_calibration_are_not_those_of_the_log() {
    let recording = demonstration("pick_and_place");
    let folder = tempfile::tempdir().unwrap();
    let (scene, lines) = json(&recording);
    let file = folder.path().join("before.jsonl");
    // Rows are missing.
    let before = [&lines[..1000], &lines[1400..]].concat().concat();
    std::fs::write(&file, format!("{scene}{before}")).unwrap();
    let said = live(&["--calibration", &file.display().to_string()], &format!("{scene}{}", lines.concat()));
    let issues: Vec<&str> = said.lines().filter(|line| line.starts_with("issue")).collect();
    assert!(said.contains(TASK), "{said}");
    assert!(issues.iter().all(|issue| issue.contains("the scene has no socket")), "{issues:?}");
}

fn started(args: &[&str]) -> Child {
    let mut command = program(Path::new(env!("CARGO_MANIFEST_DIR")), args);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// SIGINT, SIGTERM or SIGHUP while the program waits for a row: the remaining events are printed.
#[cfg(unix)]
#[test]
fn signals_end_the_log() {
    for (signal, number) in [("-INT", 2), ("-TERM", 15), ("-HUP", 1)] {
        if !is_ignored(number) {
            ends_by(signal);
        }
    }
}

/// Whether a signal set in a Linux process status contains a signal.
#[cfg(unix)]
fn has_signal(status: &str, set: &str, number: i32) -> bool {
    let status = std::fs::read_to_string(status).unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix(set)).unwrap_or("0");
    (u64::from_str_radix(mask.trim(), 16).unwrap() >> (number - 1)) & 1 == 1
}

/// Whether the tests ignore a signal, as under `nohup`. The programs that they start inherit this.
#[cfg(unix)]
fn is_ignored(number: i32) -> bool {
    has_signal("/proc/self/status", "SigIgn:", number)
}

#[cfg(unix)]
fn ends_by(signal: &str) {
    let (scene, lines) = json(&demonstration("pick_and_place"));
    let mut child = started(&["live", "-"]);
    let mut stdin = child.stdin.take().unwrap();
    let mut stdout = BufReader::new(child.stdout.take().unwrap());
    let lines = lines[..4000].concat();
    let writing = std::thread::spawn(move || {
        stdin.write_all(format!("{scene}{lines}").as_bytes()).unwrap();
        stdin
    });
    let mut first = String::new();
    stdout.read_line(&mut first).unwrap();
    let _open = writing.join().unwrap();
    assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
    let mut rest = String::new();
    stdout.read_to_string(&mut rest).unwrap();
    assert!(child.wait().unwrap().success(), "{signal}");
    assert!(rest.lines().any(|line| line.starts_with("segment right")), "{signal}: {rest}");
}

/// Starts the program on a pipe that no writer has opened; returns when it handles signals. It serves labels, because it reports that in a line.
#[cfg(unix)]
fn awaiting(pipe: &str, args: &[&str]) -> Child {
    let mut child = started(&[&["live", pipe, "--serve", "0"], args].concat());
    let mut line = String::new();
    BufReader::new(child.stderr.as_mut().unwrap()).read_line(&mut line).unwrap();
    assert!(line.starts_with("serving labels on "), "{line}");
    child
}

/// SIGINT, SIGTERM or SIGHUP while no writer has opened the pipe.
#[cfg(unix)]
#[test]
fn signals_end_the_wait_for_a_writer() {
    let folder = tempfile::tempdir().unwrap();
    let binding = crate::live_topics::binding("panda_lift.binding.yaml", folder.path());
    for (name, args) in [("pipe", &[][..]), ("pipe.mcap", &["--binding", &binding])] {
        let pipe = folder.path().join(name).to_str().unwrap().to_string();
        assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        for (signal, number) in [("-INT", 2), ("-TERM", 15), ("-HUP", 1)] {
            if is_ignored(number) {
                continue;
            }
            let mut child = awaiting(&pipe, args);
            assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
            let until = Instant::now() + PATIENCE;
            let status = loop {
                match child.try_wait().unwrap() {
                    Some(status) => break status,
                    None if Instant::now() > until => {
                        child.kill().unwrap();
                        panic!("{signal} does not end the wait for a writer of {name}");
                    }
                    None => std::thread::sleep(Duration::from_millis(5)),
                }
            };
            // The log ended without a row.
            assert_eq!(status.code(), Some(2), "{name} {signal}");
        }
    }
}

/// A pipe is a log from its first writer to the end of that one.
#[cfg(unix)]
#[test]
fn a_pipe_is_read_from_its_writer_to_the_end() {
    let (scene, lines) = json(&demonstration("pick_and_place"));
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe").to_str().unwrap().to_string();
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let mut child = awaiting(&pipe, &["--no-labels"]);
    let writing = std::thread::spawn(move || std::fs::write(pipe, format!("{scene}{}", lines.concat())));
    let mut said = String::new();
    child.stdout.take().unwrap().read_to_string(&mut said).unwrap();
    assert!(child.wait().unwrap().success(), "{said}");
    writing.join().unwrap().unwrap();
    assert!(said.contains(TASK), "{said}");
}

/// A program that `nohup` started continues when its terminal is closed.
#[cfg(target_os = "linux")]
#[test]
fn an_ignored_signal_stays_ignored() {
    let (scene, lines) = json(&demonstration("pick_and_place"));
    let mut command = Command::new("nohup");
    command.args([env!("CARGO_BIN_EXE_teachtree"), "live", "-"]);
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let mut stdout = BufReader::new(child.stdout.take().unwrap());
    let (early, late) = lines.split_at(4000);
    let (early, late) = (early.concat(), late.concat());
    let writing = std::thread::spawn(move || {
        stdin.write_all(format!("{scene}{early}").as_bytes()).unwrap();
        stdin
    });
    let mut said = String::new();
    stdout.read_line(&mut said).unwrap();
    let mut stdin = writing.join().unwrap();
    assert!(Command::new("kill").args(["-HUP", &child.id().to_string()]).status().unwrap().success());
    stdin.write_all(late.as_bytes()).unwrap();
    drop(stdin);
    stdout.read_to_string(&mut said).unwrap();
    assert!(child.wait().unwrap().success());
    assert!(said.contains(TASK), "{said}");
}

/// Other commands remove their temporary files and end with the signal's status.
#[cfg(unix)]
#[test]
fn other_commands_end_by_the_signal() {
    use std::os::unix::process::ExitStatusExt as _;
    for (name, number) in [("-TERM", 15), ("-HUP", 1)] {
        if is_ignored(number) {
            continue;
        }
        let mut child = started(&["analyze", "-"]);
        // The program waits for its log.
        let _open = child.stdin.take();
        let status = format!("/proc/{}/status", child.id());
        let caught = || has_signal(&status, "SigCgt:", number);
        while Path::new(&status).exists() && !caught() {
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        assert!(Command::new("kill").args([name, &child.id().to_string()]).status().unwrap().success());
        assert_eq!(child.wait().unwrap().signal(), Some(number));
    }
}

/// A reader that has gone ends the program, although the log goes on.
#[test]
fn a_reader_that_has_gone_ends_the_program() {
    let (scene, lines) = json(&demonstration("pick_and_place"));
    let mut child = started(&["live", "-"]);
    let mut stdin = child.stdin.take().unwrap();
    drop(child.stdout.take());
    // The program ends before it has read everything, or at once after it; the pipe is kept open.
    let _ = stdin.write_all(format!("{scene}{}", lines.concat()).as_bytes());
    assert!(child.wait().unwrap().success());
    let mut said = String::new();
    child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert_eq!(said, "");
}

/// What `analyze` finds in a recording with a binding, and what `live` finds in its rows one by one.
#[test]
fn a_binding_applies_to_each_row() {
    let demos = Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite");
    let name = |file: &str| demos.join(file).display().to_string();
    for (log, binding) in [
        ("lift_demo_1.csv", "panda_lift.binding.yaml"),
        ("stack_panda_demo_1.csv", "panda_stack.binding.yaml"),
        ("nut_assembly_panda_demo_1.csv", "panda_nut_assembly.binding.yaml"),
        // Brought to an even rate.
        ("SawyerLift_demo_1.csv", "sawyer_lift.binding.yaml"),
        ("SawyerStack_demo_1.csv", "sawyer_stack.binding.yaml"),
        ("SawyerNutAssembly_demo_1.csv", "sawyer_nut_assembly.binding.yaml"),
        ("SawyerPickPlace_demo_1.csv", "sawyer_pick_place.binding.yaml"),
        ("BaxterLift_demo_1.csv", "baxter_lift.binding.yaml"),
        ("BaxterPegInHole_demo_1.csv", "baxter_peg_in_hole.binding.yaml"),
    ] {
        let (log, binding) = (name(log), name(binding));
        let analyzed = said(&teachtree_fed(&["analyze", &log, "--binding", &binding, "--format", "json"], b""));
        let analyzed: serde_json::Value = serde_json::from_str(&analyzed).unwrap();
        let span = |track: &serde_json::Value, of: &serde_json::Value| {
            let time = |key: &str| format!("{:.3}", of[key].as_f64().unwrap());
            format!("{} {} {} {}", track, of["task"], time("start_s"), time("end_s"))
        };
        let tracks = analyzed["tracks"].as_array().unwrap().iter();
        let mut expected: Vec<String> = tracks
            .flat_map(|track| track["tasks"].as_array().unwrap().iter().map(|of| span(&track["track"], of)))
            .collect();
        expected.sort();
        assert!(!expected.is_empty(), "{analyzed}");
        let rows = std::fs::read(&log).unwrap();
        let args = ["live", "-", "--binding", &binding, "--calibration", &log, "--no-labels", "--format", "json"];
        let events = said(&teachtree_fed(&args, &rows));
        let events = events.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
        let mut found: Vec<String> = events
            .filter(|event| event["event"] == "task" && event["final"] == true)
            .map(|event| span(&event["track"], &event))
            .collect();
        found.sort();
        assert_eq!(found, expected, "{log}");
    }
}

#[test]
fn a_binding_that_needs_the_whole_log_is_refused() {
    let binding = Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/bindings/hiro_snap.binding.yaml");
    insta::assert_snapshot!(
        refused(&["--binding", binding.to_str().unwrap()], "t\n0\n").replace(binding.to_str().unwrap(), "BINDING")
    );
    let binding = Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite/panda_lift.binding.yaml");
    insta::assert_snapshot!(
        refused(&["--binding", binding.to_str().unwrap()], "t,cube_p\n0,1\n")
            .replace(binding.to_str().unwrap(), "BINDING")
    );
}
