//! Labels written into copies of data sets: the right words on each frame, everything else as it was, whole or not at all.

use crate::program::{all_said, complained, program, said, teachtree_in};
use crate::sets::with_set;
use crate::shared::folders::{all_files, copy};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use teachtree_logs::read::formats::lerobot::annotate::{AnnotationTarget, Label, LabelFormat, Request};
use teachtree_session::RulesInternals;

/// The frames of a data file as JSON.
pub fn frames(file: &Path) -> Vec<Value> {
    let reader = SerializedFileReader::new(File::open(file).unwrap()).unwrap();
    reader.get_row_iter(None).unwrap().map(|row| value(&Field::Group(row.unwrap()))).collect()
}

fn value(field: &Field) -> Value {
    match field {
        Field::Null => Value::Null,
        Field::Bool(flag) => json!(flag),
        Field::Int(number) => json!(number),
        Field::Long(number) => json!(number),
        Field::Float(number) => json!(number),
        Field::Double(number) => json!(number),
        Field::Str(text) => json!(text),
        Field::ListInternal(list) => list.elements().iter().map(value).collect(),
        Field::Group(row) => row.get_column_iter().map(|(name, field)| (name.clone(), value(field))).collect(),
        other => panic!("{other:?}"),
    }
}

fn data_files(set: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(set.join("data/chunk-000")).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

/// The words of a style on each frame of each episode, as `active_at` of lerobot finds them: the last row that is not later than the frame.
pub fn words(set: &Path, style: &str) -> BTreeMap<u64, Vec<Option<String>>> {
    let mut all: BTreeMap<u64, Vec<Option<String>>> = BTreeMap::new();
    for frame in data_files(set).iter().flat_map(|file| frames(file)) {
        let time = frame["timestamp"].as_f64().unwrap();
        let rows = frame["language_persistent"].as_array().unwrap();
        let active: Vec<&Value> = rows
            .iter()
            .filter(|row| row["style"] == style && row["role"] == "assistant")
            .filter(|row| row["timestamp"].as_f64().unwrap() <= time)
            .collect();
        let latest = active.iter().map(|row| row["timestamp"].as_f64().unwrap()).fold(f64::MIN, f64::max);
        let found: Vec<&&Value> = active.iter().filter(|row| row["timestamp"].as_f64() == Some(latest)).collect();
        assert!(found.len() <= 1, "two rows of {style} at {latest} s");
        let content = found.first().map(|row| row["content"].as_str().unwrap().to_string());
        all.entry(frame["episode_index"].as_u64().unwrap()).or_default().push(content);
    }
    all
}

/// What `rules/words.yaml` makes of a name: what is in brackets is left out where it names nothing.
fn worded(name: &str, object: Option<&str>, partner: Option<&str>) -> String {
    let table = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/rules/words.yaml"));
    let table: BTreeMap<String, String> = serde_yaml::from_str(table).unwrap();
    let fill = |text: &str| {
        text.replace("{object}", object.unwrap_or_default()).replace("{partner}", partner.unwrap_or_default())
    };
    let is_known = |text: &str| {
        (object.is_some() || !text.contains("{object}")) && (partner.is_some() || !text.contains("{partner}"))
    };
    let parts = table[name].split(['[', ']']).enumerate();
    parts.filter(|(at, part)| at % 2 == 0 || is_known(part)).map(|(_, part)| fill(part)).collect()
}

/// The words that an analysis has on each frame: `part` of the first track.
pub fn expected(folder: &Path, log: &str, part: &str, name: &str) -> Vec<Option<String>> {
    let output = teachtree_in(folder, &["analyze", log, "--binding", "b.yaml", "--format", "json"]);
    let document: Value = serde_json::from_str(&said(&output)).unwrap();
    let mut words = vec![None; document["log"]["rows"].as_u64().unwrap() as usize];
    for span in document["tracks"][0][part].as_array().unwrap() {
        let text = worded(span[name].as_str().unwrap(), span["object"].as_str(), span["partner"].as_str());
        // Words hold until the next ones.
        words[span["start_row"].as_u64().unwrap() as usize..].fill(Some(text));
    }
    words
}

pub fn annotate(folder: &Path, set: &str, out: &str, more: &[&str]) -> std::process::Output {
    teachtree_in(folder, &[&["annotate", set, "-o", out, "--binding", "b.yaml"], more].concat())
}

pub fn info(set: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(set.join("meta/info.json")).unwrap()).unwrap()
}

#[test]
fn every_frame_has_the_words_of_its_segment_and_task() {
    let folder = with_set();
    let output = annotate(folder.path(), "set", "labeled", &[]);
    assert!(output.status.success(), "{}", all_said(&output));
    assert!(said(&output).contains("labeled: 3 of 3 episodes with labels"), "{}", said(&output));
    let labeled = folder.path().join("labeled");
    for (style, part, name) in [("motion", "relabeled", "primitive"), ("subtask", "tasks", "task")] {
        let words = words(&labeled, style);
        for episode in 0..3_u64 {
            let expected = expected(folder.path(), &format!("set#{episode}"), part, name);
            assert!(
                expected.iter().flatten().collect::<std::collections::BTreeSet<_>>().len()
                    > usize::from(style == "motion")
            );
            assert_eq!(words[&episode], expected, "{style} of episode {episode}");
        }
    }
    // A labeled set is read as it was before.
    assert_eq!(
        expected(folder.path(), "labeled#1", "tasks", "task"),
        expected(folder.path(), "set#1", "tasks", "task")
    );
}

#[test]
fn the_summary_counts_the_labels_that_are_written() {
    let folder = with_set();
    let output = annotate(folder.path(), "set", "labeled", &["--format", "json"]);
    let summary: Value = serde_json::from_str(&said(&output)).unwrap();
    assert_eq!((&summary["recordings"], &summary["labeled"]), (&3.into(), &serde_json::json!(["0", "1", "2"])));
    let mut counts: BTreeMap<(&str, String), u64> = BTreeMap::new();
    for style in ["motion", "subtask"] {
        for words in words(&folder.path().join("labeled"), style).values() {
            let mut last = None;
            for text in words.iter().flatten().filter(|text| last.replace((*text).clone()).as_ref() != Some(*text)) {
                *counts.entry((style, text.clone())).or_default() += 1;
            }
        }
    }
    let listed = summary["labels"].as_array().unwrap().iter();
    let listed = listed.map(|label| {
        (
            (label["style"].as_str().unwrap(), label["text"].as_str().unwrap().to_string()),
            label["count"].as_u64().unwrap(),
        )
    });
    assert_eq!(listed.collect::<BTreeMap<_, _>>(), counts);
}

/// Lines of a table of one's own replace those of the shipped one, templates replace both, and the words that counted are in `info.json`.
#[test]
fn words_are_a_table_that_users_edit() {
    let folder = with_set();
    let table = folder.path().join("mine.yaml");
    std::fs::write(
        &table,
        "Grasp: take hold of the {object}\npeg_in_hole: put {object} on {partner}\nRoundNut0: round nut\n",
    )
    .unwrap();
    let with = ["--words", "mine.yaml", "--words", "Release=leave the {object}"];
    let output = annotate(folder.path(), "set", "labeled", &with);
    assert!(output.status.success(), "{}", all_said(&output));
    let labeled = folder.path().join("labeled");
    let has = |style: &str, text: &str| words(&labeled, style).values().flatten().flatten().any(|words| words == text);
    for (style, text) in [
        ("motion", "take hold of the round nut"),
        ("motion", "carry the round nut"),
        ("motion", "leave the round nut"),
        ("subtask", "put round nut on peg2"),
    ] {
        assert!(has(style, text), "{text}: {:?}", words(&labeled, style));
    }
    let written = info(&labeled)["teachtree"]["words"].clone();
    for template in ["Grasp=take hold of the {object}", "Release=leave the {object}", "Translate=carry[ the {object}]"]
    {
        assert!(written.as_array().unwrap().contains(&json!(template)), "{written}");
    }
    for (text, message) in [
        (
            "Grasp: take {what}\n",
            "mine.yaml:1:8: Grasp: found `{what}`, expected `{name}`, `{object}`, `{partner}` or `{hand}`",
        ),
        ("Grasp: [take]\n", "mine.yaml:1:8: Grasp: found a list, expected a text"),
        ("Jam: get stuck\nTranslte: carry\n", "mine.yaml:2:11: there is no primitive, task or body `Translte`"),
    ] {
        std::fs::write(&table, text).unwrap();
        let refused = annotate(folder.path(), "set", "new", &with);
        assert_eq!(refused.status.code(), Some(2));
        assert!(complained(&refused).contains(message), "{}", complained(&refused));
    }
    let shown = said(&teachtree_in(folder.path(), &["show", "words.yaml"]));
    assert_eq!(shown, include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/rules/words.yaml")));
}

/// Each primitive and task of the shipped rules has words, and different ones.
#[test]
fn the_shipped_rules_have_words() {
    let table = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/rules/words.yaml"));
    let table: BTreeMap<String, String> = serde_yaml::from_str(table).unwrap();
    let rules = teachtree::Rules::options().file("bimanual.rules").file("failures.rules").load().unwrap();
    let names = rules.set().label_names();
    for (style, names) in
        [("motion", names.into_iter().collect::<Vec<_>>()), ("subtask", rules.tasks().map(str::to_string).collect())]
    {
        let mut seen = BTreeMap::new();
        for name in names {
            let words = table.get(&name).unwrap_or_else(|| panic!("{name} has no words"));
            if let Some(other) = seen.insert(words.clone(), name.clone()) {
                panic!("{style}: {name} and {other} have the words {words}");
            }
        }
    }
}

#[test]
fn episodes_that_are_failures_are_left_out_unless_they_are_asked_for() {
    let folder = with_set();
    // The nut of episode 1 comes to no peg.
    let output = annotate(folder.path(), "set", "good", &["--expect", "peg_in_hole"]);
    assert!(output.status.success(), "{}", all_said(&output));
    assert!(said(&output).contains("good: 2 of 3 episodes with labels"), "{}", said(&output));
    assert!(
        said(&output).ends_with("failed recordings are not labeled: episode 1; `--failures write` labels them\n"),
        "{}",
        said(&output)
    );
    let labels = words(&folder.path().join("good"), "subtask");
    assert_eq!([0, 1, 2].map(|at| labels[&at].iter().any(Option::is_some)), [true, false, true]);
    assert_eq!(info(&folder.path().join("good"))["teachtree"]["failed_episodes"], json!([1]));
    let output = annotate(folder.path(), "set", "all", &["--expect", "peg_in_hole", "--failures", "write"]);
    assert!(said(&output).contains("all: 3 of 3 episodes with labels"), "{}", all_said(&output));
    assert!(!said(&output).contains("left out"));
    assert!(words(&folder.path().join("all"), "subtask")[&1].iter().any(Option::is_some));
    // Nothing is left.
    let output = annotate(folder.path(), "set", "none", &["--expect", "peg_in_hole x 9"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(complained(&output).contains("all 3 analyzed recordings are failures"), "{}", complained(&output));
    assert!(!folder.path().join("none").exists());
}

#[test]
fn everything_else_is_as_it_was() {
    let folder = with_set();
    let (set, labeled) = (folder.path().join("set"), folder.path().join("labeled"));
    std::fs::create_dir_all(set.join("videos/front/chunk-000")).unwrap();
    std::fs::write(set.join("videos/front/chunk-000/file-000.mp4"), vec![7; 200_000]).unwrap();
    std::fs::write(set.join("empty"), "").unwrap();
    let before = all_files(&set);
    assert!(annotate(folder.path(), "set", "labeled", &["-q", "--rules", "contact.rules"]).status.success());
    assert_eq!(all_files(&set), before);
    let after = all_files(&labeled);
    assert_eq!(before.keys().collect::<Vec<_>>(), after.keys().collect::<Vec<_>>());
    for (name, bytes) in &before {
        if !name.starts_with("data") && name != Path::new("meta/info.json") {
            assert_eq!(&after[name], bytes, "{}", name.display());
        }
    }
    for (old, new) in data_files(&set).iter().zip(&data_files(&labeled)) {
        let mut new = frames(new);
        for frame in &mut new {
            frame.as_object_mut().unwrap().remove("language_persistent").unwrap();
        }
        assert_eq!(frames(old), new);
    }
    let mut new = info(&labeled);
    let said = new.as_object_mut().unwrap().remove("teachtree").unwrap();
    let feature = new["features"].as_object_mut().unwrap().remove("language_persistent").unwrap();
    assert_eq!(feature, json!({"dtype": "language", "shape": [1], "names": null}));
    assert_eq!(new, info(&set));
    assert_eq!(said["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(said["styles"], json!(["motion", "subtask"]));
    assert_eq!(said["rules"][0]["digest"].as_str().unwrap().len(), 32);
    // The same set gives the same bytes.
    let again = annotate(folder.path(), "set", "again", &["--jobs", "1", "--rules", "contact.rules"]);
    assert!(again.status.success());
    assert_eq!(all_files(&folder.path().join("again")), after);
}

#[test]
fn labels_that_are_there_are_kept_unless_they_are_to_be_replaced() {
    let folder = with_set();
    let path = |name: &str| folder.path().join(name);
    // Another tool has written a plan, and told the user something.
    let plan = |row| Label { style: "plan", row, end: row + 1, content: format!("plan from {row}") };
    let plans = BTreeMap::from([(0, vec![plan(0), plan(50)]), (2, vec![plan(7)])]);
    let request = Request {
        forms: &[LabelFormat::Language],
        styles: &["plan"],
        legacy: "subtask",
        labels: &plans,
        successes: &BTreeMap::new(),
        provenance: &json!({}),
    };
    AnnotationTarget::open(&path("set")).unwrap().write(&path("planned"), &request, &mut |_| {}).unwrap();
    assert!(annotate(folder.path(), "planned", "motion", &["--style", "motion"]).status.success());
    assert!(annotate(folder.path(), "motion", "both", &["--style", "subtask"]).status.success());
    let refused = annotate(folder.path(), "both", "other", &[]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        complained(&refused).contains("episode 0 has labels of style `motion` already"),
        "{}",
        complained(&refused)
    );
    assert!(complained(&refused).contains("--replace") && !path("other").exists());
    assert!(annotate(folder.path(), "both", "other", &["--replace", "--words", "do {name}"]).status.success());
    assert!(annotate(folder.path(), "set", "at_once", &[]).status.success());
    for set in ["both", "other"] {
        assert_eq!(
            words(&path(set), "plan")[&0][49..51],
            [Some("plan from 0".into()), Some("plan from 50".to_string())]
        );
        assert_eq!(words(&path(set), "plan")[&1], vec![None; 100]);
        for style in ["motion", "subtask"] {
            let (found, at_once) = (words(&path(set), style), words(&path("at_once"), style));
            match set {
                "both" => assert_eq!(found, at_once),
                _ => assert!(found.values().flatten().all(|words| words.as_ref().unwrap().starts_with("do "))),
            }
        }
    }
}

#[test]
fn both_hands_are_in_one_row() {
    let folder = tempfile::tempdir().unwrap();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/formats");
    copy(&fixtures.join("lerobot_v30_hands"), &folder.path().join("set"));
    std::fs::copy(fixtures.join("lerobot_v30_hands.binding.yaml"), folder.path().join("b.yaml")).unwrap();
    let output = annotate(folder.path(), "set", "labeled", &[]);
    assert!(output.status.success(), "{}", all_said(&output));
    let mut motion = words(&folder.path().join("labeled"), "motion")[&0].clone();
    motion.dedup();
    let motion: Vec<String> = motion.into_iter().flatten().collect();
    insta::assert_snapshot!(motion.join("\n"));
    let output = annotate(
        folder.path(),
        "set",
        "worded",
        &[
            "--words",
            "{hand}, {name} the {object}",
            "--words",
            "Pass=hand the {object} over",
            "--words",
            "hammer=small hammer",
        ],
    );
    assert!(output.status.success(), "{}", all_said(&output));
    let motion = words(&folder.path().join("worded"), "motion")[&0].clone();
    assert_eq!(motion[0].as_deref(), Some("both hands, move the small hammer"), "{motion:?}");
    assert!(motion.contains(&Some("both hands: hand the small hammer over".into())), "{motion:?}");
}

#[test]
fn what_cannot_be_annotated_is_refused_and_nothing_is_written() {
    let folder = with_set();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("file.txt"), "a").unwrap();
    std::fs::create_dir(path("there")).unwrap();
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/formats/lerobot_v21"), &path("old"));
    let before = all_files(folder.path());
    for (set, out, more, message) in [
        ("none", "new", &[][..], "none: there is no such file"),
        ("file.txt", "new", &[], "is not a data set"),
        ("there", "new", &[], "is not a data set"),
        ("old", "new", &["--legacy"], "episode_000000.parquet"),
        ("set", "there", &[], "there: exists already"),
        ("set", "b.yaml", &[], "b.yaml: exists already"),
        ("set", "set/copy", &[], "set/copy: is in set, which is copied"),
        ("set", "no/new", &[], "no: there is no such folder"),
        ("set", "new", &["--words", "grasp"], "expected `{name}`"),
        ("set", "new", &["--words", "{what}"], "found `{what}`"),
        ("set", "new", &["--words", "{name"], "expected `}`"),
        ("set", "new", &["--words", "{name}]"], "closes nothing"),
        ("set", "new", &["--words", "{name}", "--words", "a {name}"], "second template"),
        ("set", "new", &["--words", "Grsp=grasp it"], "did you mean `Grasp`?"),
        ("set", "new", &["--rules", "none.rules"], "none.rules"),
        ("set", "new", &["--scene", "file.txt"], "file.txt"),
    ] {
        let output = annotate(folder.path(), set, out, more);
        assert_eq!(output.status.code(), Some(2), "{set} {out} {more:?}: {}", all_said(&output));
        assert!(complained(&output).contains(message), "{set} {out} {more:?}: {}", complained(&output));
        assert_eq!(all_files(folder.path()), before, "{set} {out} {more:?}");
    }
}

#[test]
fn episodes_that_fail_have_no_labels() {
    let folder = with_set();
    let lists = folder.path().join("set/meta/episodes/chunk-000");
    // The file of episode 2 lacks a column that the binding names.
    copy(&lists, &folder.path().join("kept"));
    let file = folder.path().join("set/data/chunk-000/file-001.parquet");
    let mut bytes = std::fs::read(&file).unwrap();
    let (from, to) = (b"observation.state", b"observation.stote");
    let mut at = 0;
    while let Some(found) = bytes[at..].windows(from.len()).position(|part| part == from) {
        bytes[at + found..at + found + from.len()].copy_from_slice(to);
        at += found;
    }
    std::fs::write(&file, bytes).unwrap();
    let output = annotate(folder.path(), "set", "labeled", &[]);
    assert_eq!(output.status.code(), Some(3), "{}", all_said(&output));
    assert!(
        complained(&output).contains("set#2") || complained(&output).contains("episode 2"),
        "{}",
        complained(&output)
    );
    let words = words(&folder.path().join("labeled"), "motion");
    assert!(words[&0].iter().all(Option::is_some) && words[&2].iter().all(Option::is_none));
    assert_eq!(info(&folder.path().join("labeled"))["teachtree"]["episodes_without_labels"], json!([2]));
}

/// Killed at any time, the program leaves no copy or a whole one; what it left beside is gone after the next run.
#[cfg(unix)]
#[test]
fn a_killed_program_leaves_a_whole_copy_or_none() {
    let folder = with_set();
    std::fs::create_dir_all(folder.path().join("set/videos")).unwrap();
    std::fs::write(folder.path().join("set/videos/a.mp4"), vec![3; 30_000_000]).unwrap();
    assert!(annotate(folder.path(), "set", "whole", &[]).status.success());
    let whole = all_files(&folder.path().join("whole"));
    std::fs::remove_dir_all(folder.path().join("whole")).unwrap();
    let temporary = || {
        let entries = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name());
        entries.filter(|name| name.to_string_lossy().starts_with(".teachtree-")).count()
    };
    let mut left = 0;
    for _ in 0..12 {
        let args = ["annotate", "set", "-o", "copy", "--binding", "b.yaml"];
        let mut child = program(folder.path(), &args).stdout(std::process::Stdio::null()).spawn().unwrap();
        // Killed while it writes, at a time that is another one each time.
        while child.try_wait().unwrap().is_none() && temporary() < 2 {}
        for _ in 0..left {
            std::thread::yield_now();
        }
        let _ = child.kill();
        child.wait().unwrap();
        left += usize::from(temporary() > 0) * 40;
        let copied = folder.path().join("copy");
        if copied.exists() {
            assert!(all_files(&copied) == whole);
            std::fs::remove_dir_all(&copied).unwrap();
        }
    }
    assert!(left > 0, "the program was never killed while it wrote");
    assert!(annotate(folder.path(), "set", "whole", &[]).status.success());
    assert_eq!(temporary(), 0);
    assert!(all_files(&folder.path().join("whole")) == whole);
}

/// The libraries of others read it, where they are installed: the same values in all other columns, and the words at each boundary.
#[test]
fn datasets_loads_the_copy() {
    let folder = with_set();
    assert!(annotate(folder.path(), "set", "labeled", &[]).status.success());
    let python = std::env::var("TEACHTREE_PYTHON").unwrap_or_else(|_| "python3".into());
    let run = |args: &[&str]| std::process::Command::new(&python).args(args).current_dir(folder.path()).output();
    if !run(&["-c", "import datasets"]).is_ok_and(|output| output.status.success()) {
        let _ = writeln!(std::io::stderr(), "skipped: Python with `datasets` is not installed");
        return;
    }
    let tool = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/check_lerobot.py");
    let output = run(&[tool.to_str().unwrap(), "set", "labeled"]).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(
        String::from_utf8_lossy(&output.stdout).contains("638 frames"),
        "{}",
        String::from_utf8_lossy(&output.stdout)
    );
}

/// Writes the data files of a set anew, with stamps of 64 bits.
fn write_stamps(set: &Path, stamps: &[f64]) {
    use parquet::data_type::{DoubleType, Int64Type};
    let schema = "message schema { required int64 episode_index; required double timestamp; }";
    let schema = std::sync::Arc::new(parquet::schema::parser::parse_message_type(schema).unwrap());
    for (file, episodes) in data_files(set).iter().zip([&[0_i64, 1][..], &[2]]) {
        let out = File::create(file).unwrap();
        let mut writer =
            parquet::file::writer::SerializedFileWriter::new(out, schema.clone(), Default::default()).unwrap();
        let mut group = writer.next_row_group().unwrap();
        let rows: Vec<i64> = episodes.iter().flat_map(|episode| vec![*episode; stamps.len()]).collect();
        let mut column = group.next_column().unwrap().unwrap();
        column.typed::<Int64Type>().write_batch(&rows, None, None).unwrap();
        column.close().unwrap();
        let mut column = group.next_column().unwrap().unwrap();
        column.typed::<DoubleType>().write_batch(&stamps.repeat(episodes.len()), None, None).unwrap();
        column.close().unwrap();
        group.close().unwrap();
        writer.close().unwrap();
    }
}

/// Labels are held with 32 bits: one that is rounded up would begin a frame late, one that is rounded far would be of many frames.
#[test]
fn labels_begin_with_their_frame_where_stamps_have_64_bits() {
    let folder = with_set();
    let set = folder.path().join("set");
    let copied = |name: &str, stamps: &[f64]| {
        write_stamps(&set, stamps);
        let label = |row| Label { style: "plan", row, end: row + 1, content: format!("plan {row}") };
        let labels: Vec<Label> = (0..stamps.len()).map(label).collect();
        let labels = (0..3).map(|episode| (episode, labels.clone())).collect();
        let request = Request {
            forms: &[LabelFormat::Language],
            styles: &["plan"],
            legacy: "subtask",
            labels: &labels,
            successes: &BTreeMap::new(),
            provenance: &json!({}),
        };
        let copy = folder.path().join(name);
        AnnotationTarget::open(&set).unwrap().write(&copy, &request, &mut |_| {}).map(|()| words(&copy, "plan"))
    };
    let stamps: Vec<f64> = (0..200).map(|row| f64::from(row) / 20.0).collect();
    let expected: Vec<Option<String>> = (0..200).map(|row| Some(format!("plan {row}"))).collect();
    let found = copied("fine", &stamps).unwrap();
    assert_eq!(found.len(), 3);
    for words in found.values() {
        assert_eq!(words, &expected);
    }
    // A stamp that occurs twice cannot be told from itself; LeRobot refuses two labels at it.
    let found = copied("twice", &[0.0, 0.05, 0.05, 0.1]).unwrap();
    let expected = ["plan 0", "plan 2", "plan 2", "plan 3"].map(|words| Some(words.to_string()));
    assert_eq!(found[&0], expected);
    let since_1970: Vec<f64> = stamps.iter().map(|stamp| 1.7e9 + stamp).collect();
    let error = copied("late", &since_1970).unwrap_err();
    assert!(error.message.contains("the stamps of episode 0 are too large: at 1700000000.05 s"), "{error}");
    assert!(!folder.path().join("late").exists());
}

/// A file that grows beyond what may be written, as on a full disk, is not damage of the set: the destination is named.
#[cfg(unix)]
#[test]
fn a_full_destination_is_named_with_the_cause() {
    let folder = with_set();
    let demos = Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite");
    std::fs::copy(demos.join("lift.hdf5"), folder.path().join("lift.hdf5")).unwrap();
    std::fs::copy(demos.join("lift_hdf5.binding.yaml"), folder.path().join("lift.yaml")).unwrap();
    for (set, copy, binding, more) in [
        ("set", "small", "b.yaml", ""),
        ("lift.hdf5", "small.hdf5", "lift.yaml", "--signal 'grasp=start of Grasp of cube'"),
    ] {
        // A write beyond the limit fails where its signal is ignored.
        let line = format!(
            "trap '' XFSZ; ulimit -f 4; exec {} annotate {set} -o {copy} --binding {binding} -q {more}",
            env!("CARGO_BIN_EXE_teachtree")
        );
        let output = std::process::Command::new("sh").args(["-c", &line]).current_dir(folder.path()).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{}", all_said(&output));
        let place = format!("error: {copy}: cannot be written: ");
        assert!(complained(&output).starts_with(&place), "{}", complained(&output));
        assert_eq!(complained(&output).lines().count(), 1, "{}", complained(&output));
        assert!(!folder.path().join(copy).exists());
    }
}

#[test]
fn what_is_not_a_whole_set_and_a_folder_that_is_not_there_are_named() {
    let folder = with_set();
    for (args, message) in [
        (["set#0", "-o", "copy"], "set#0: is one recording, expected a whole set"),
        (["set", "-o", "nodir/copy"], "nodir: there is no such folder"),
    ] {
        let refused = teachtree_in(folder.path(), &[&["annotate"], &args[..]].concat());
        assert_eq!(refused.status.code(), Some(2));
        assert!(complained(&refused).contains(message), "{}", complained(&refused));
    }
}
