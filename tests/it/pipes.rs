//! Pipes in place of files are rejected by name and not waited for.

use crate::program::{all_said, complained, teachtree_in};
use crate::sets::with_set;
use std::path::Path;
use std::process::Command;

/// Creates a pipe. A thread opens the other end for writing, so that a program that waits for it makes the test fail instead of hang.
pub fn pipe(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
    let path = path.to_path_buf();
    std::thread::spawn(move || drop(std::fs::OpenOptions::new().write(true).open(path)));
}

/// Returns a folder with a log, its binding, and pipes named `pipe.csv`, `pipe.yaml` and so on.
fn folder() -> tempfile::TempDir {
    let folder = with_set();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/logs");
    for (from, to) in [("whole.csv", "log.csv"), ("box.yaml", "log.scene.yaml")] {
        std::fs::copy(fixtures.join(from), folder.path().join(to)).unwrap();
    }
    for name in ["pipe", "pipe.csv", "pipe.yaml", "pipe.json", "pipe.rules", "pipe.hdf5", "pipe.eaf"] {
        pipe(&folder.path().join(name));
    }
    folder
}

#[test]
fn a_pipe_in_the_place_of_a_file_is_refused_by_its_name() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    std::fs::create_dir(path("tests")).unwrap();
    pipe(&path("tests/a.expect"));
    std::fs::copy(path("log.csv"), path("side.csv")).unwrap();
    pipe(&path("side.scene.yaml"));
    std::fs::write(path("of_pipe.expect"), "log: pipe.csv\n").unwrap();
    std::fs::write(path("by_pipe.expect"), "log: log.csv\nbinding: pipe.yaml\n").unwrap();
    let commands: &[(&[&str], &str)] = &[
        (&["analyze", "pipe.csv"], "pipe.csv"),
        (&["analyze", "pipe"], "pipe"),
        (&["analyze", "pipe.hdf5#demo_0"], "pipe.hdf5"),
        (&["analyze", "log.csv", "--scene", "pipe.yaml"], "pipe.yaml"),
        (&["analyze", "log.csv", "--binding", "pipe.yaml"], "pipe.yaml"),
        (&["inspect", "pipe.csv"], "pipe.csv"),
        (&["explain", "pipe.csv", "--at", "0.2s"], "pipe.csv"),
        (&["test", "pipe.csv"], "pipe.csv"),
        (&["test", "tests"], "tests/a.expect"),
        (&["test", "of_pipe.expect"], "pipe.csv"),
        (&["test", "by_pipe.expect"], "pipe.yaml"),
        (&["score", "log.csv", "--labels", "pipe.csv"], "pipe.csv"),
        (&["score", "log.csv", "--labels", "pipe.eaf"], "pipe.eaf"),
        (&["agree", "pipe.csv", "pipe.csv", "log.csv"], "pipe.csv"),
        (&["fmt", "pipe.rules"], "pipe.rules"),
        (&["live", "log.csv", "--calibration", "pipe.json"], "pipe.json"),
        (&["analyze", "side.csv"], "side.scene.yaml"),
        (&["live", "side.csv"], "side.scene.yaml"),
        (&["retarget", "pipe.csv", "-o", "c.json"], "pipe.csv"),
        (&["simulate", "pipe.json", "--scene", "push", "-o", "s.csv"], "pipe.json"),
        (&["studio", "pipe.csv", "--no-open"], "pipe.csv"),
        (&["annotate", "pipe.hdf5", "-o", "copy"], "pipe.hdf5"),
    ];
    for (args, name) in commands {
        let output = teachtree_in(folder.path(), args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", all_said(&output));
        let said = complained(&output);
        assert!(said.contains(&format!("{name}: found a pipe, expected a file")), "{args:?}: {said}");
    }
    let output = teachtree_in(folder.path(), &["check", "pipe.rules"]);
    assert!(matches!(output.status.code(), Some(1 | 2)), "{}", all_said(&output));
    assert!(all_said(&output).contains("it is not a file"), "{}", all_said(&output));
}

#[test]
fn a_pipe_in_the_place_of_a_scene_is_found() {
    let folder = folder();
    std::fs::remove_file(folder.path().join("log.scene.yaml")).unwrap();
    pipe(&folder.path().join("log.scene.yaml"));
    for command in ["analyze", "live", "audit", "score"] {
        let output = teachtree_in(folder.path(), &[command, "log.csv"]);
        let said = complained(&output);
        assert_eq!(output.status.code(), Some(2), "{command}: {said}");
        assert!(said.contains("log.scene.yaml: found a pipe, expected a file"), "{command}: {said}");
    }
}

#[test]
fn a_pipe_in_the_place_of_the_only_log_of_a_folder_is_found() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(folder.path().join("set/below")).unwrap();
    for name in ["set/log.csv", "set/below/log.csv"] {
        pipe(&folder.path().join(name));
        for command in ["analyze", "audit", "score"] {
            let output = teachtree_in(folder.path(), &[command, "set"]);
            let said = complained(&output);
            assert_eq!(output.status.code(), Some(2), "{command}: {said}");
            assert!(said.contains(&format!("set: the folder holds no log: `{name}` is a pipe")), "{command}: {said}");
        }
        std::fs::remove_file(folder.path().join(name)).unwrap();
    }
}

#[test]
fn a_pipe_among_the_files_of_a_log_is_not_waited_for() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    // The marker of a log whose replacement was interrupted.
    pipe(&path(".teachtree-log.csv.replacing"));
    pipe(&path("log.events.csv"));
    let output = teachtree_in(folder.path(), &["analyze", "log.csv"]);
    assert!(output.status.success(), "{}", all_said(&output));
    // A data file, and a list of episodes.
    for name in ["set/data/chunk-000/file-000.parquet", "set/meta/episodes/chunk-000/file-000.parquet"] {
        let kept = std::fs::read(path(name)).unwrap();
        std::fs::remove_file(path(name)).unwrap();
        pipe(&path(name));
        for args in [
            &["analyze", "set#0", "--binding", "b.yaml"][..],
            &["analyze", "set#*", "--binding", "b.yaml", "--out-dir", "out"],
        ] {
            let output = teachtree_in(folder.path(), args);
            assert_ne!(output.status.code(), Some(0), "{name}: {}", all_said(&output));
            let said = complained(&output);
            assert!(said.contains(&format!("{name}: found a pipe, expected a file")), "{args:?}: {said}");
        }
        std::fs::remove_file(path(name)).unwrap();
        std::fs::write(path(name), kept).unwrap();
    }
}

/// A pipe that the shell passes as a file descriptor is still read.
#[test]
fn a_binding_may_come_through_a_pipe_of_the_shell() {
    let folder = folder();
    let command = format!("'{}' analyze 'set#0' --binding <(cat b.yaml)", env!("CARGO_BIN_EXE_teachtree"));
    let Ok(output) = Command::new("bash").args(["-c", &command]).current_dir(folder.path()).output() else {
        return;
    };
    assert!(output.status.success(), "{}", all_said(&output));
}
