//! Signals written into copies of HDF5 files: steps where the analysis says, everything else as it was.

use crate::program::{all_said, complained, said, teachtree_in};
use serde_json::Value;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn demos() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite")
}

/// A folder with robosuite's recordings, `lift.hdf5`, and their binding, `b.yaml`.
fn with_file() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(demos().join("lift.hdf5"), folder.path().join("lift.hdf5")).unwrap();
    std::fs::copy(demos().join("lift_hdf5.binding.yaml"), folder.path().join("b.yaml")).unwrap();
    folder
}

fn annotate(folder: &Path, out: &str, more: &[&str]) -> Output {
    teachtree_in(folder, &[&["annotate", "lift.hdf5", "-o", out, "--binding", "b.yaml"], more].concat())
}

/// The columns of a recording of an HDF5 file that contain a text, as `inspect` lists them with their ranges.
fn columns(folder: &Path, log: &str) -> Vec<(String, Value)> {
    let output = teachtree_in(folder, &["inspect", log, "--format", "json"]);
    let document: Value = serde_json::from_str(&said(&output)).unwrap_or_else(|_| panic!("{}", all_said(&output)));
    let sheets = document["sheets"].as_array().unwrap();
    let columns = sheets.iter().flat_map(|sheet| sheet["columns"].as_array().unwrap());
    columns.map(|column| (column["name"].as_str().unwrap().to_string(), column.clone())).collect()
}

/// The row on which a signal rises, by a binding that takes it for the flag of a gripper.
fn rises(folder: &Path, log: &str, column: &str) -> Option<usize> {
    let text = std::fs::read_to_string(folder.join("b.yaml")).unwrap();
    let bound = text.replace("joints/gripper0_finger_joint1 [m] < 25 mm", &format!("{column} > 0.5"));
    assert_ne!(text, bound);
    std::fs::write(folder.join("signal.yaml"), bound).unwrap();
    let args =
        ["analyze", log, "--binding", "signal.yaml", "--frames", "frames.csv", "--signals", "right.gripper.closed"];
    let output = teachtree_in(folder, &args);
    assert!(output.status.success(), "{}", all_said(&output));
    let table = std::fs::read_to_string(folder.join("frames.csv")).unwrap();
    let mut lines = table.lines();
    let at = lines.next().unwrap().split(',').position(|title| title == "right.gripper.closed").unwrap();
    let values: Vec<bool> = lines.map(|line| line.split(',').nth(at).unwrap() == "1").collect();
    let first = values.iter().position(|value| *value)?;
    assert!(values[first..].iter().all(|value| *value), "{column} falls");
    Some(first)
}

/// Start and end row of the first segment of a primitive.
fn segment(folder: &Path, log: &str, primitive: &str) -> (usize, usize) {
    let output = teachtree_in(folder, &["analyze", log, "--binding", "b.yaml", "--format", "json"]);
    let document: Value = serde_json::from_str(&said(&output)).unwrap();
    let segments = document["tracks"][0]["relabeled"].as_array().unwrap();
    // One that goes on when the recording begins does not begin.
    let of = |segment: &&Value| segment["primitive"] == primitive && segment["start_row"] != 0;
    let found = segments.iter().find(of).unwrap_or_else(|| panic!("{segments:?}"));
    let row = |key: &str| found[key].as_u64().unwrap() as usize;
    (row("start_row"), row("end_row"))
}

#[test]
fn signals_rise_where_segments_begin_and_end() {
    let folder = with_file();
    let steps = ["--signal", "grasp=start of Grasp of cube", "--signal", "held=last end of Grasp of cube by right"];
    let output = annotate(folder.path(), "new.hdf5", &steps);
    assert!(output.status.success(), "{}", all_said(&output));
    assert!(said(&output).contains("new.hdf5: 2 of 2 recordings have all signals"), "{}", said(&output));
    for demo in ["demo_1", "demo_3"] {
        let (start, end) = segment(folder.path(), &format!("lift.hdf5#{demo}"), "Grasp");
        assert!(start > 0 && end > start);
        let log = format!("new.hdf5#{demo}");
        let column = |name: &str| format!("datagen_info/subtask_term_signals/{name}");
        assert_eq!(rises(folder.path(), &log, &column("grasp")), Some(start), "{demo}");
        assert_eq!(rises(folder.path(), &log, &column("held")), Some(end), "{demo}");
        assert!(said(&output).lines().any(|line| {
            let cells: Vec<&str> = line.split_whitespace().collect();
            cells == [demo, &start.to_string(), &end.to_string()]
        }));
        // All other columns are as they were, and the outcome is known.
        let old = columns(folder.path(), &format!("lift.hdf5#{demo}"));
        let mut new = columns(folder.path(), &log);
        new.retain(|(name, _)| {
            !name.contains("subtask_term_signals") && !["dones", "rewards"].contains(&name.as_str())
        });
        assert_eq!(old, new);
    }
}

#[test]
fn what_a_recording_lacks_is_listed_and_it_is_not_in_the_mask() {
    let folder = with_file();
    let steps = ["--signal", "grasp=start of Grasp of cube", "--signal", "put=end of Place of cube on table"];
    let output = annotate(folder.path(), "new.hdf5", &[&steps[..], &["--layout", "isaac"]].concat());
    assert!(output.status.success(), "{}", all_said(&output));
    assert!(said(&output).contains("-  no Place of cube into table"), "{}", said(&output));
    assert!(said(&output).contains("0 of 2 recordings have all signals"), "{}", said(&output));
    let found = columns(folder.path(), "new.hdf5#1");
    let put = found.iter().find(|(name, _)| name == "obs/datagen_info/subtask_term_signals/put").unwrap();
    assert_eq!(put.1["max"], 0.0);
    // The layout that is there is kept, and what is there is not replaced unless that is wanted.
    let again = |out: &str, more: &[&str]| {
        let args = ["annotate", "new.hdf5", "-o", out, "--binding", "b.yaml", "--signal", "grasp=last end of Grasp"];
        teachtree_in(folder.path(), &[&args[..], more].concat())
    };
    let refused = again("other.hdf5", &[]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        complained(&refused)
            .contains("has the signal `data/demo_1/obs/datagen_info/subtask_term_signals/grasp` already")
    );
    let replaced = again("other.hdf5", &["--replace", "--start-signal", "begin=start of Approach"]);
    assert!(replaced.status.success(), "{}", all_said(&replaced));
    let (_, end) = segment(folder.path(), "lift.hdf5#demo_1", "Grasp");
    assert_eq!(rises(folder.path(), "other.hdf5#1", "obs/datagen_info/subtask_term_signals/grasp"), Some(end));
    let names: Vec<String> = columns(folder.path(), "other.hdf5#1").into_iter().map(|(name, _)| name).collect();
    assert!(names.contains(&"obs/datagen_info/subtask_start_signals/begin".to_string()), "{names:?}");
}

#[test]
fn what_cannot_be_a_signal_is_refused_and_nothing_is_written() {
    let folder = with_file();
    std::fs::write(
        folder.path().join("damaged.hdf5"),
        &std::fs::read(folder.path().join("lift.hdf5")).unwrap()[..5000],
    )
    .unwrap();
    std::fs::copy(demos().join("../../tests/fixtures/formats/arrays/aloha.hdf5"), folder.path().join("one.hdf5"))
        .unwrap();
    let before = crate::shared::folders::all_files(folder.path());
    for (file, more, message) in [
        ("lift.hdf5", &[][..], "found none to write"),
        ("lift.hdf5", &["--signal", "grasp"], "expected NAME=STEP"),
        ("lift.hdf5", &["--signal", "a/b=start of Grasp"], "expected the name of a signal"),
        ("lift.hdf5", &["--signal", "a=begin of Grasp"], "expected `start` or `end`, found `begin`"),
        ("lift.hdf5", &["--signal", "a=start Grasp"], "expected `of`, found `Grasp`"),
        ("lift.hdf5", &["--signal", "a=start of"], "expected a primitive or a task, found nothing"),
        ("lift.hdf5", &["--signal", "a=start of Grasp of"], "expected a body, found nothing"),
        ("lift.hdf5", &["--signal", "a=start of Grasp with cube"], "found `with`"),
        ("lift.hdf5", &["--signal", "a=start of Grasp by both"], "expected `left` or `right`, found `both`"),
        ("lift.hdf5", &["--signal", "a=start of Grsp"], "did you mean `Grasp`?"),
        ("lift.hdf5", &["--signal", "a=start of Grasp of cub"], "did you mean `cube`?"),
        ("lift.hdf5", &["--signal", "a=start of Grasp", "--signal", "a=end of Grasp"], "occurs twice"),
        (
            "lift.hdf5",
            &["--signal", "a=start of Grasp", "--words", "{name}"],
            "--words, --style and the forms of labels are of LeRobot sets",
        ),
        ("damaged.hdf5", &["--signal", "a=start of Grasp"], "damaged.hdf5"),
        ("one.hdf5", &["--signal", "a=start of Grasp"], "is one recording"),
    ] {
        let args = ["annotate", file, "-o", "new.hdf5", "--binding", "b.yaml"];
        let output = teachtree_in(folder.path(), &[&args[..], more].concat());
        assert_eq!(output.status.code(), Some(2), "{file} {more:?}: {}", all_said(&output));
        assert!(complained(&output).contains(message), "{file} {more:?}: {}", complained(&output));
        assert!(crate::shared::folders::all_files(folder.path()) == before, "{file} {more:?}");
    }
}

/// h5py finds the same, where it is installed: types, values and attributes of everything else, and MimicGen's rule of ends.
#[test]
fn h5py_finds_no_other_difference() {
    let folder = with_file();
    let steps = ["--signal", "grasp=start of Grasp of cube", "--signal", "held=last end of Grasp of cube"];
    assert!(annotate(folder.path(), "new.hdf5", &steps).status.success());
    let tool = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/check_hdf5.py");
    let python = std::env::var("TEACHTREE_PYTHON").unwrap_or_else(|_| "python3".into());
    let run = |args: &[&str]| Command::new(&python).args(args).current_dir(folder.path()).output();
    if !run(&["-c", "import h5py"]).is_ok_and(|output| output.status.success()) {
        let _ = writeln!(std::io::stderr(), "skipped: Python with `h5py` is not installed");
        return;
    }
    let output = run(&[tool.to_str().unwrap(), "lift.hdf5", "new.hdf5"]).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let (start, end) = segment(folder.path(), "lift.hdf5#demo_1", "Grasp");
    let found = String::from_utf8_lossy(&output.stdout).into_owned();
    // The row at which a signal rises is the last one of its part.
    assert!(found.contains(&format!("{{'grasp': {}, 'held': {}}}", start + 1, end + 1)), "{found}");
    // The group `obs` is made where the file has none.
    assert!(annotate(folder.path(), "isaac.hdf5", &[&steps[..], &["--layout", "isaac"]].concat()).status.success());
    let output = run(&[tool.to_str().unwrap(), "lift.hdf5", "isaac.hdf5"]).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
