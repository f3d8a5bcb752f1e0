//! Labels of LeRobot sets in the forms that older and other programs read: `subtask_index`, stages of SARM, annotations of GR00T, a file for people.

use crate::annotate::{annotate, expected, frames, info, words};
use crate::program::{all_said, complained, said};
use crate::sets::with_set;
use crate::shared::folders::{all_files, copy};
use parquet::file::reader::{FileReader, SerializedFileReader};
use serde_json::{Value, json};
use std::fs::File;
use std::io::Write as _;
use std::path::Path;

/// A folder with the set of version 2.1, `set`, and its binding, `b.yaml`.
fn with_v21() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/formats");
    copy(&fixtures.join("lerobot_v21_nuts"), &folder.path().join("set"));
    std::fs::copy(fixtures.join("lerobot_v30.binding.yaml"), folder.path().join("b.yaml")).unwrap();
    folder
}

fn done(folder: &Path, out: &str, more: &[&str]) {
    // These rules leave outcomes unknown, so that no success field is written.
    let output = annotate(folder, "set", out, &[more, &["--rules", "contact.rules"]].concat());
    assert!(output.status.success(), "{}", all_said(&output));
}

fn read_json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// The metadata of a Parquet file.
fn metadata(file: &Path, key: &str) -> Option<String> {
    let reader = SerializedFileReader::new(File::open(file).unwrap()).unwrap();
    let pairs = reader.metadata().file_metadata().key_value_metadata().unwrap();
    pairs.iter().find(|pair| pair.key == key).and_then(|pair| pair.value.clone())
}

#[test]
fn subtask_index_has_the_words_that_language_has() {
    let folder = with_set();
    done(folder.path(), "language", &[]);
    for (style, more) in [("motion", &["--legacy", "--style", "motion"][..]), ("subtask", &["--legacy"])] {
        done(folder.path(), style, more);
        let copy = folder.path().join(style);
        let rows = frames(&copy.join("meta/subtasks.parquet"));
        // lerobot takes the row at this place, and its name.
        assert!(rows.iter().zip(0..).all(|(row, at)| row["subtask_index"] == at));
        let pandas: Value =
            serde_json::from_str(&metadata(&copy.join("meta/subtasks.parquet"), "pandas").unwrap()).unwrap();
        assert_eq!(pandas["index_columns"], json!(["subtask"]));
        let wanted = words(&folder.path().join("language"), style);
        let mut seen = 0;
        for file in ["data/chunk-000/file-000.parquet", "data/chunk-000/file-001.parquet"] {
            let (mut labeled, set) = (frames(&copy.join(file)), frames(&folder.path().join("set").join(file)));
            for frame in &mut labeled {
                let index = frame.as_object_mut().unwrap().remove("subtask_index").unwrap().as_u64().unwrap();
                let (episode, at) = (frame["episode_index"].as_u64().unwrap(), frame["frame_index"].as_u64().unwrap());
                let word = rows[index as usize]["subtask"].as_str().unwrap().to_string();
                assert_eq!(wanted[&episode][at as usize].clone().unwrap_or_default(), word);
                seen += 1;
            }
            assert_eq!(labeled, set);
        }
        assert_eq!(seen, 638);
        let feature = info(&copy)["features"]["subtask_index"].clone();
        assert_eq!(feature, json!({"dtype": "int64", "shape": [1], "names": null}));
        assert_eq!(info(&copy)["features"].get("language_persistent"), None);
    }
}

#[test]
fn stages_of_sarm_are_segments_and_tasks() {
    let folder = with_set();
    done(folder.path(), "copy", &["--sarm"]);
    let copy = folder.path().join("copy");
    let lists = frames(&copy.join("meta/episodes/chunk-000/file-000.parquet"));
    for (prefix, part, name) in [("dense", "relabeled", "primitive"), ("sparse", "tasks", "task")] {
        for list in &lists {
            let log = format!("set#{}", list["episode_index"]);
            let names: Vec<Option<String>> = expected(folder.path(), &log, part, name);
            let key = |key: &str| list[format!("{prefix}_subtask_{key}")].as_array().unwrap().clone();
            let (first, last) = (key("start_frames"), key("end_frames"));
            for (at, stage) in key("names").iter().enumerate() {
                // The last frame is part of it, and the next one is not.
                for frame in [&first[at], &last[at]] {
                    assert_eq!(names[frame.as_u64().unwrap() as usize].as_deref(), stage.as_str(), "{log}");
                }
                let next = last[at].as_u64().unwrap() as usize + 1;
                assert!(names.get(next).is_none_or(|next| next.as_deref() != stage.as_str()), "{log}");
                let time = list[format!("{prefix}_subtask_start_times")][at].as_f64().unwrap();
                assert!((time - first[at].as_f64().unwrap() / 20.0).abs() < 1e-6);
            }
        }
        let shares = read_json(&copy.join(format!("meta/temporal_proportions_{prefix}.json")));
        let total: f64 = shares.as_object().unwrap().values().map(|share| share.as_f64().unwrap()).sum();
        assert!((total - 1.0).abs() < 1e-12, "{shares}");
    }
    // In the order in which they begin.
    let dense = read_json(&copy.join("meta/temporal_proportions_dense.json"));
    assert_eq!(dense.as_object().unwrap().keys().next().unwrap(), "approach the RoundNut0");
    // The frames are those of the set.
    let files = |set: &str| all_files(&folder.path().join(set).join("data"));
    assert_eq!(files("copy"), files("set"));
}

#[test]
fn annotations_of_gr00t_name_rows_of_tasks() {
    let folder = with_v21();
    done(folder.path(), "copy", &["--gr00t", "--legacy"]);
    let copy = folder.path().join("copy");
    let tasks: Vec<Value> = std::fs::read_to_string(copy.join("meta/tasks.jsonl"))
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert!(tasks.iter().zip(0..).all(|(task, at)| task["task_index"] == at), "{tasks:?}");
    assert_eq!(tasks[0]["task"], "put the nuts on the pegs");
    assert_eq!(info(&copy)["total_tasks"], tasks.len());
    for (style, part, name) in [("motion", "relabeled", "primitive"), ("subtask", "tasks", "task")] {
        let column = format!("annotation.teachtree.{style}");
        for episode in 0..2 {
            let wanted = expected(folder.path(), &format!("set#{episode}"), part, name);
            let rows = frames(&copy.join(format!("data/chunk-000/episode_{episode:06}.parquet")));
            assert_eq!(rows.len(), wanted.len());
            for (row, wanted) in rows.iter().zip(&wanted) {
                let task = &tasks[row[&column].as_u64().unwrap() as usize];
                assert_eq!(task["task"], wanted.clone().unwrap_or_default());
            }
        }
        assert_eq!(info(&copy)["features"][&column]["dtype"], "int64");
    }
    let modality = read_json(&copy.join("meta/modality.json"));
    let mut old = read_json(&folder.path().join("set/meta/modality.json"));
    old["annotation"]["teachtree.motion"] = json!({});
    old["annotation"]["teachtree.subtask"] = json!({});
    assert_eq!(modality, old);
    // A labeled set of version 2 is read as it was before.
    assert_eq!(expected(folder.path(), "copy#1", "tasks", "task"), expected(folder.path(), "set#1", "tasks", "task"));
}

#[test]
fn the_schema_of_arrow_has_the_new_columns() {
    let folder = with_set();
    done(folder.path(), "copy", &[]);
    let file = "data/chunk-000/file-000.parquet";
    let of = |set: &str, key: &str| metadata(&folder.path().join(set).join(file), key).unwrap();
    assert!(of("copy", "ARROW:schema").len() > of("set", "ARROW:schema").len() + 400);
    let features: Value = serde_json::from_str(&of("copy", "huggingface")).unwrap();
    let features = features["info"]["features"].as_object().unwrap();
    assert_eq!(features.keys().next_back().unwrap(), "language_persistent");
    assert_eq!(features["observation.state"]["length"], 68);
}

#[test]
fn each_form_is_refused_where_it_is_and_replaced_on_demand() {
    let folder = with_set();
    done(folder.path(), "once", &["--legacy", "--sarm", "--prelabels"]);
    for (form, message) in [
        ("--legacy", "has the column `subtask_index` already"),
        ("--sarm", "has `meta/temporal_proportions_dense.json` already"),
        ("--prelabels", "episode 0 has labels of style `motion` in meta/lerobot_annotations.json"),
    ] {
        let refused = annotate(folder.path(), "once", "twice", &[form]);
        assert_eq!(refused.status.code(), Some(2), "{form}");
        assert!(complained(&refused).contains(message), "{form}: {}", complained(&refused));
        assert!(complained(&refused).contains("--replace"), "{form}: {}", complained(&refused));
        assert!(!folder.path().join("twice").exists());
    }
    let replace = ["--legacy", "--sarm", "--prelabels", "--replace", "--rules", "contact.rules"];
    let again = annotate(folder.path(), "once", "twice", &replace);
    assert!(again.status.success(), "{}", all_said(&again));
    assert_eq!(all_files(&folder.path().join("once")), all_files(&folder.path().join("twice")));
    let v21 = with_v21();
    let both = annotate(folder.path(), "set", "new", &["--legacy", "--language"]);
    for (output, message) in [
        (annotate(folder.path(), "set", "new", &["--gr00t"]), "expected v2.0 or v2.1, which GR00T reads"),
        (annotate(v21.path(), "set", "new", &["--sarm"]), "expected v3.0, which SARM reads"),
        (annotate(v21.path(), "set", "new", &[]), "expected v3.0, the first with language columns"),
        (both, "load no set with language columns"),
    ] {
        assert_eq!(output.status.code(), Some(2));
        assert!(complained(&output).contains(message), "{}", complained(&output));
    }
    // Words of GR00T are numbered behind those that there are; what does not name any is refused with its line.
    std::fs::write(v21.path().join("set/meta/tasks.jsonl"), "{\"task_index\": 0, \"task\": \"a\"}\n{\"task\": 1}\n")
        .unwrap();
    let output = annotate(v21.path(), "set", "new", &["--gr00t"]);
    assert!(complained(&output).contains("tasks.jsonl:2: expected a `task_index`"), "{}", complained(&output));
    assert!(!v21.path().join("new").exists());
}

/// The libraries of others read all forms, where they are installed.
#[test]
fn pandas_and_datasets_read_all_forms() {
    let python = std::env::var("TEACHTREE_PYTHON").unwrap_or_else(|_| "python3".into());
    let run =
        |folder: &Path, args: &[&str]| std::process::Command::new(&python).args(args).current_dir(folder).output();
    if !run(Path::new("."), &["-c", "import datasets, pandas"]).is_ok_and(|output| output.status.success()) {
        let _ = writeln!(std::io::stderr(), "skipped: Python with `datasets` is not installed");
        return;
    }
    let tool = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/check_lerobot.py");
    for (folder, forms, messages) in [
        (with_set(), &["--legacy", "--sarm", "--style", "motion"][..], &["words for 638 frames, 13 changes"][..]),
        (with_set(), &["--legacy", "--sarm"], &["words for 638 frames", "SARM: 18 stages"]),
        (with_v21(), &["--legacy", "--gr00t"], &["words for 294 frames"]),
    ] {
        done(folder.path(), "copy", forms);
        let output = run(folder.path(), &[tool.to_str().unwrap(), "set", "copy"]).unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let printed = String::from_utf8_lossy(&output.stdout);
        assert!(messages.iter().all(|message| printed.contains(message)), "{printed}");
    }
}

/// `subtask_index` has one style: labels of the other one are in no file, so that neither the summary nor `info.json` counts them.
#[test]
fn a_copy_with_subtask_index_alone_counts_the_labels_of_its_style() {
    let folder = with_set();
    for (more, styles) in
        [(&["--legacy"][..], json!(["subtask"])), (&["--legacy", "--style", "motion"], json!(["motion"]))]
    {
        let style = styles[0].as_str().unwrap();
        let output = annotate(folder.path(), "set", style, &[more, &["--rules", "contact.rules"]].concat());
        let summary = said(&output);
        let counted = summary.lines().skip(1).map(|line| line.split_whitespace().next().unwrap());
        assert!(counted.clone().count() > 0 && counted.clone().all(|of| of == style), "{summary}");
        assert_eq!(info(&folder.path().join(style))["teachtree"]["styles"], styles);
    }
    done(folder.path(), "both", &["--legacy", "--prelabels"]);
    assert_eq!(info(&folder.path().join("both"))["teachtree"]["styles"], json!(["motion", "subtask"]));
}
