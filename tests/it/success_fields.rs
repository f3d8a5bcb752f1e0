//! Success fields in copies of data sets: `next.success` of LeRobot; the attribute `success`, `rewards`, `dones` and lists of recordings of HDF5 files.

use crate::annotate::{annotate, frames, info};
use crate::program::{all_said, complained, python_with, said, teachtree_in};
use crate::sets::with_set;
use crate::shared::folders::all_files;
use hdf5_pure::{AttrValue, File};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};

const COLUMN: &str = "next.success";
/// The nut of episode 1 comes to no peg.
const EXPECT: [&str; 2] = ["--expect", "peg_in_hole"];
/// Rules that show no failure.
const CONTACT: [&str; 2] = ["--rules", "contact.rules"];

/// The column of each episode of a set.
fn flags(set: &Path) -> BTreeMap<u64, Vec<bool>> {
    let mut all: BTreeMap<u64, Vec<bool>> = BTreeMap::new();
    for file in ["file-000", "file-001"] {
        for frame in frames(&set.join(format!("data/chunk-000/{file}.parquet"))) {
            let flag = frame[COLUMN].as_bool().unwrap();
            all.entry(frame["episode_index"].as_u64().unwrap()).or_default().push(flag);
        }
    }
    all
}

/// The number of rows of a recording, and the row behind its last task that is a success.
fn rows_and_end(folder: &Path, log: &str, more: &[&str]) -> (usize, usize) {
    let args = ["analyze", log, "--binding", "b.yaml", "--format", "json"];
    let document: Value = serde_json::from_str(&said(&teachtree_in(folder, &[&args[..], more].concat()))).unwrap();
    let tasks = document["tracks"][0]["tasks"].as_array().unwrap();
    let successes = tasks.iter().filter(|task| task["task"] != "unknown" && task["failure"] != true);
    let end = successes.map(|task| task["end_row"].as_u64().unwrap()).max().unwrap();
    (document["log"]["rows"].as_u64().unwrap() as usize, end as usize)
}

/// The values of rows: whether the state behind the action of a row is one in which the task has succeeded.
fn expected((rows, end): (usize, usize)) -> Vec<bool> {
    (0..rows).map(|row| row + 1 >= end).collect()
}

#[test]
fn next_success_is_true_from_the_end_of_the_last_task_that_succeeds() {
    let folder = with_set();
    let output = annotate(folder.path(), "set", "copy", &EXPECT);
    assert!(output.status.success(), "{}", all_said(&output));
    assert!(said(&output).contains("`next.success`: 2 successes, 1 failure\n"), "{}", said(&output));
    let found = flags(&folder.path().join("copy"));
    for episode in [0, 2] {
        let wanted = expected(rows_and_end(folder.path(), &format!("set#{episode}"), &[]));
        assert_eq!(found[&episode], wanted, "episode {episode}");
        assert!(wanted.contains(&true) && wanted.contains(&false), "episode {episode}");
    }
    // An episode that is left out fails all the same.
    assert_eq!(found[&1], vec![false; 100]);
    let feature = info(&folder.path().join("copy"))["features"][COLUMN].clone();
    assert_eq!(feature, json!({"dtype": "bool", "shape": [1], "names": null}));
    assert_eq!(info(&folder.path().join("copy"))["teachtree"]["expect"], "peg_in_hole");
    // The column does not depend on the form of the labels, nor on what becomes of failures.
    let more = [&EXPECT[..], &["--legacy", "--failures", "write"]].concat();
    assert!(annotate(folder.path(), "set", "legacy", &more).status.success());
    assert_eq!(flags(&folder.path().join("legacy")), found);
    // All else is as it was.
    let file = "data/chunk-000/file-000.parquet";
    let mut labeled = frames(&folder.path().join("copy").join(file));
    for frame in &mut labeled {
        let frame = frame.as_object_mut().unwrap();
        assert!(frame.remove(COLUMN).is_some() && frame.remove("language_persistent").is_some());
    }
    assert_eq!(labeled, frames(&folder.path().join("set").join(file)));
}

#[test]
fn unknown_outcomes_give_no_column() {
    let folder = with_set();
    // Nothing shows a failure.
    assert!(!said(&annotate(folder.path(), "set", "plain", &CONTACT)).contains(COLUMN));
    assert_eq!(info(&folder.path().join("plain"))["features"].get(COLUMN), None);
    // The file of episode 2 cannot be read.
    let file = folder.path().join("set/data/chunk-000/file-001.parquet");
    let mut bytes = std::fs::read(&file).unwrap();
    let (from, to) = (b"observation.state", b"observation.stote");
    while let Some(at) = bytes.windows(from.len()).position(|part| part == from) {
        bytes[at..at + from.len()].copy_from_slice(to);
    }
    std::fs::write(&file, bytes).unwrap();
    let output = annotate(folder.path(), "set", "copy", &EXPECT);
    assert_eq!(output.status.code(), Some(3), "{}", all_said(&output));
    let line = "`next.success` is not written, since outcomes are unknown: 1 recording: 2\n";
    assert!(said(&output).contains(line), "{}", said(&output));
    assert_eq!(info(&folder.path().join("copy"))["features"].get(COLUMN), None);
}

#[test]
fn a_column_of_the_set_is_kept_and_compared() {
    let folder = with_set();
    let path = |name: &str| folder.path().join(name);
    assert!(annotate(folder.path(), "set", "once", &[&EXPECT[..], &["--style", "motion"]].concat()).status.success());
    // What agrees is not worth a line.
    let agreeing = annotate(folder.path(), "once", "same", &[&EXPECT[..], &["--style", "subtask"]].concat());
    assert!(agreeing.status.success() && !said(&agreeing).contains(COLUMN), "{}", all_said(&agreeing));
    assert_eq!(flags(&path("same")), flags(&path("once")));
    let other = ["--expect", "peg_in_hole x 9", "--failures", "write", "--style", "subtask"];
    let kept = annotate(folder.path(), "once", "kept", &other);
    let line = "`next.success` contradicts the outcome of 2 recordings: 0 (failure), 2 (failure); it is ";
    assert!(said(&kept).contains(&format!("{line}kept, `--replace` replaces it\n")), "{}", all_said(&kept));
    assert_eq!(flags(&path("kept")), flags(&path("once")));
    let replaced = annotate(folder.path(), "once", "replaced", &[&other[..], &["--replace"]].concat());
    assert!(said(&replaced).contains(&format!("{line}replaced\n")), "{}", all_said(&replaced));
    assert!(said(&replaced).contains("`next.success`: 0 successes, 3 failures\n"), "{}", all_said(&replaced));
    assert!(flags(&path("replaced")).values().flatten().all(|flag| !flag));
    let line = "`next.success` contradicts the outcome of this recording (failure)";
    for (command, log, format, count) in [("analyze", "once#0", "json", 1), ("audit", "once", "csv", 2)] {
        let found = |expected: &str| {
            let args = [command, log, "--binding", "b.yaml", "--expect", expected, "--format", format];
            said(&teachtree_in(folder.path(), &args)).matches(line).count()
        };
        assert_eq!(found("peg_in_hole x 9"), count, "{command}");
        assert_eq!(found("peg_in_hole"), 0, "{command}");
    }
}

/// A folder with robosuite's recordings, `lift.hdf5`, their binding, `b.yaml`, rules by which the recordings succeed where they end, `lift.rules`, and rules by
/// which the one whose approach takes longer is a failure, `slow.rules`.
fn with_file() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let demos = Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite");
    std::fs::copy(demos.join("lift.hdf5"), folder.path().join("lift.hdf5")).unwrap();
    std::fs::copy(demos.join("lift_hdf5.binding.yaml"), folder.path().join("b.yaml")).unwrap();
    let lift = "use \"contact.rules\"\ntask lift = Move .. Translate with Translate  before pick_and_place\n";
    std::fs::write(folder.path().join("lift.rules"), lift).unwrap();
    let rules =
        "use \"lift.rules\"\ntask hesitated = Move .. Release with Approach lasting 4 s  is failure  before lift\n";
    std::fs::write(folder.path().join("slow.rules"), rules).unwrap();
    folder
}

fn annotate_file(folder: &Path, copy: &str, more: &[&str]) -> Output {
    let args = ["annotate", "lift.hdf5", "-o", copy, "--binding", "b.yaml"];
    teachtree_in(folder, &[&args[..], more].concat())
}

const SLOW: [&str; 4] = ["--rules", "slow.rules", "--signal", "grasp=start of Grasp of cube"];

/// The attribute `success` of the two recordings.
fn attributes(file: &File) -> [Option<AttrValue>; 2] {
    ["demo_1", "demo_3"].map(|name| file.group(&format!("data/{name}")).unwrap().attrs().unwrap().remove("success"))
}

#[test]
fn recordings_of_a_file_have_the_success_fields_of_isaac_lab_and_robomimic() {
    let folder = with_file();
    for (copy, more) in [("skip.hdf5", &[][..]), ("write.hdf5", &["--failures", "write"])] {
        let output = annotate_file(folder.path(), copy, &[&SLOW[..], more].concat());
        assert!(output.status.success(), "{}", all_said(&output));
        let line = "outcomes: 1 success, 1 failure, listed in `mask/teachtree_success` and `mask/teachtree_failure`\n";
        assert!(said(&output).contains(line), "{}", said(&output));
        let file = File::open(folder.path().join(copy)).unwrap();
        let list = |name: &str| file.dataset(&format!("mask/teachtree_{name}")).unwrap().read_string().unwrap();
        assert_eq!((list("success"), list("failure")), (vec!["demo_3".to_string()], vec!["demo_1".to_string()]));
        assert_eq!(attributes(&file), [Some(AttrValue::I8(0)), Some(AttrValue::I8(1))]);
        for (name, wanted) in [
            ("demo_1", vec![false; 482]),
            ("demo_3", expected(rows_and_end(folder.path(), "lift.hdf5#demo_3", &SLOW[..2]))),
        ] {
            let dataset = |field: &str| file.dataset(&format!("data/{name}/{field}")).unwrap();
            let (rewards, dones) = (dataset("rewards").read_f64().unwrap(), dataset("dones").read_i64().unwrap());
            assert_eq!(rewards, wanted.iter().map(|flag| f64::from(u8::from(*flag))).collect::<Vec<_>>(), "{name}");
            assert_eq!(dones, wanted.iter().map(|flag| i64::from(*flag)).collect::<Vec<_>>(), "{name}");
        }
    }
}

#[test]
fn an_expectation_is_enough_for_success_fields_and_unknown_outcomes_give_none() {
    let folder = with_file();
    let expected = annotate_file(folder.path(), "expected.hdf5", &["--rules", "lift.rules", "--expect", "lift"]);
    assert!(expected.status.success(), "{}", all_said(&expected));
    assert!(said(&expected).starts_with("outcomes: "), "{}", said(&expected));
    let file = File::open(folder.path().join("expected.hdf5")).unwrap();
    assert!(attributes(&file).iter().all(Option::is_some));
    assert!(file.dataset("mask/teachtree_ok").is_err(), "there are no signals that a recording could have all of");
    // Without the shape of the table, nothing shows contacts of the cube, which a press is detected by.
    let path = folder.path().join("b.yaml");
    let binding = std::fs::read_to_string(&path).unwrap();
    let table = ", parts: [{box: [800 mm, 800 mm, 50 mm], at: [0 m, 0 m, 0.775 m]}]";
    std::fs::write(&path, binding.replace(table, "")).unwrap();
    let unseen = annotate_file(folder.path(), "unseen.hdf5", &["--expect", "pick_and_press"]);
    std::fs::write(&path, binding).unwrap();
    assert_eq!(unseen.status.code(), Some(2), "{}", all_said(&unseen));
    assert!(complained(&unseen).contains("all outcomes are unknown"), "{}", complained(&unseen));
    assert!(!folder.path().join("unseen.hdf5").exists());
    let plain = annotate_file(folder.path(), "plain.hdf5", &[&SLOW[2..], &CONTACT].concat());
    assert!(plain.status.success() && !said(&plain).contains("outcomes"), "{}", all_said(&plain));
    let file = File::open(folder.path().join("plain.hdf5")).unwrap();
    assert_eq!(attributes(&file), [None, None]);
    assert!(file.dataset("data/demo_3/rewards").is_err() && file.dataset("mask/teachtree_success").is_err());
}

/// A recorder wrote that the slow recording succeeded, and rewards: sparse ones into it, dense ones into the other one.
#[test]
fn fields_of_a_file_are_kept_and_compared() {
    let folder = with_file();
    let file = File::open_rw(folder.path().join("lift.hdf5")).unwrap();
    let of = |name: &str| file.group(&format!("data/{name}")).unwrap();
    of("demo_1").set_attr("success", AttrValue::U8(1)).unwrap();
    let sparse: Vec<f64> = (0..482).map(|row| f64::from(u8::from(row > 400))).collect();
    of("demo_1")
        .create_dataset("rewards", |data| {
            data.with_f64_data(&sparse);
        })
        .unwrap();
    let dense: Vec<f64> = (0..392).map(|row| f64::from(row) / 1000.0).collect();
    of("demo_3")
        .create_dataset("rewards", |data| {
            data.with_f64_data(&dense);
        })
        .unwrap();
    file.commit().unwrap();
    file.close().unwrap();
    let fields = |name: &str| {
        let file = File::open(folder.path().join(name)).unwrap();
        let rewards = |name: &str| file.dataset(&format!("data/{name}/rewards")).unwrap().read_f64().unwrap();
        (attributes(&file), [rewards("demo_1"), rewards("demo_3")])
    };
    // The outcome follows the fields that are kept.
    let kept = annotate_file(folder.path(), "kept.hdf5", &SLOW);
    assert!(kept.status.success(), "{}", all_said(&kept));
    assert!(said(&kept).contains("outcomes: 2 successes, 0 failures"), "{}", said(&kept));
    assert!(!said(&kept).contains("contradicts"), "{}", said(&kept));
    let analyzed = |more: &[&str]| {
        let args = ["analyze", "lift.hdf5#demo_1", "--binding", "b.yaml", "--rules", "slow.rules", "--format", "json"];
        said(&teachtree_in(folder.path(), &[&args[..], more].concat()))
    };
    let text = analyzed(&[]);
    let outcome = serde_json::from_str::<Value>(&text).unwrap()["outcome"].clone();
    assert_eq!((&outcome["result"], &outcome["reasons"][0]["kind"]), (&"success".into(), &"declared".into()));
    let message = outcome["reasons"][0]["message"].as_str().unwrap();
    assert!(message.ends_with(" failed, but `success` says that the recording succeeded"), "{message}");
    assert!(!text.contains("contradicts"), "{text}");
    // An expectation is of the user.
    let lines =
        ["`success`", "`rewards`"].map(|it| format!("{it} contradicts the outcome of this recording (failure)"));
    let text = analyzed(&["--expect", "lift x 5"]);
    assert_eq!(lines.map(|line| text.matches(line.as_str()).count()), [1, 1], "{text}");
    let rewards = [sparse, dense];
    assert_eq!(fields("kept.hdf5"), ([Some(AttrValue::U8(1)), Some(AttrValue::I8(1))], rewards.clone()));
    // What is to be replaced does not decide.
    let replaced = annotate_file(folder.path(), "replaced.hdf5", &[&SLOW[..], &["--replace"]].concat());
    for (field, what) in [("success", "replaced"), ("rewards", "kept")] {
        let line = format!("`{field}` contradicts the outcome of 1 recording: demo_1 (failure); it is {what}\n");
        assert!(said(&replaced).contains(&line), "{}", said(&replaced));
    }
    assert_eq!(fields("replaced.hdf5"), ([Some(AttrValue::I8(0)), Some(AttrValue::I8(1))], rewards));
}

/// A recorder without rewards writes zeros; a success whose rewards are 0 contradicts only where another recording has a 1.
#[test]
fn rewards_that_are_zero_in_all_recordings_say_nothing() {
    for (has_reward, count) in [(false, 0), (true, 1)] {
        let folder = with_file();
        let file = File::open_rw(folder.path().join("lift.hdf5")).unwrap();
        for (name, rows) in [("demo_1", 482), ("demo_3", 392)] {
            let is_one = |row: i32| has_reward && name == "demo_1" && row > 400;
            let rewards: Vec<f64> = (0..rows).map(|row| f64::from(u8::from(is_one(row)))).collect();
            let recording = file.group(&format!("data/{name}")).unwrap();
            recording
                .create_dataset("rewards", |data| {
                    data.with_f64_data(&rewards);
                })
                .unwrap();
        }
        file.commit().unwrap();
        file.close().unwrap();
        let args = ["analyze", "lift.hdf5#demo_3", "--binding", "b.yaml", "--rules", "slow.rules", "--format", "json"];
        let line = "`rewards` contradicts the outcome of this recording (success)";
        assert_eq!(said(&teachtree_in(folder.path(), &args)).matches(line).count(), count, "{has_reward}");
    }
}

/// `datasets` loads the column as truths, where it is installed, and all other values as they are in the set.
#[test]
fn datasets_reads_next_success() {
    let Some(python) = python_with("datasets", "`datasets`") else { return };
    let folder = with_set();
    assert!(annotate(folder.path(), "set", "copy", &EXPECT).status.success());
    let output = check(&python, "check_lerobot.py", folder.path(), ["set", "copy"]);
    assert!(output.contains("next.success: 2 of 3 episodes succeed"), "{output}");
}

/// h5py reads the fields, where it is installed, and all else as it was, also a truth that h5py wrote.
#[test]
fn h5py_reads_success_fields() {
    let Some(python) = python_with("h5py", "`h5py`") else { return };
    let folder = with_file();
    let done = annotate_file(folder.path(), "new.hdf5", &[&SLOW[..], &["--failures", "write"]].concat());
    assert!(done.status.success(), "{}", all_said(&done));
    let output = check(&python, "check_hdf5.py", folder.path(), ["lift.hdf5", "new.hdf5"]);
    assert!(output.contains("successes ['demo_3'] failures ['demo_1']"), "{output}");
    let recorded = "import h5py; file = h5py.File('lift.hdf5', 'r+'); file['data/demo_1'].attrs['success'] = True";
    let run = |line: &str| {
        let output = Command::new(&python).args(["-c", line]).current_dir(folder.path()).output().unwrap();
        assert!(output.status.success(), "{}", all_said(&output));
        said(&output)
    };
    run(recorded);
    let done = annotate_file(folder.path(), "kept.hdf5", &SLOW);
    assert!(said(&done).contains("outcomes: 2 successes, 0 failures"), "{}", all_said(&done));
    let read = "import h5py; data = h5py.File('kept.hdf5')['data']; print([repr(data[name].attrs['success']) for name in data])";
    assert_eq!(run(read).trim(), "['np.True_', 'np.int8(1)']");
}

fn check(python: &str, tool: &str, folder: &Path, files: [&str; 2]) -> String {
    let tool = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools").join(tool);
    let output = Command::new(python).arg(tool).args(files).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{}", all_said(&output));
    said(&output)
}

#[test]
fn a_copy_with_success_fields_is_read_as_the_set() {
    let folder = with_set();
    assert!(annotate(folder.path(), "set", "copy", &EXPECT).status.success());
    assert_eq!(rows_and_end(folder.path(), "copy#0", &[]), rows_and_end(folder.path(), "set#0", &[]));
    // The same set gives the same bytes.
    assert!(annotate(folder.path(), "set", "again", &[&EXPECT[..], &["--jobs", "1"]].concat()).status.success());
    assert!(all_files(&folder.path().join("again")) == all_files(&folder.path().join("copy")));
}
