//! `learn`: a rule file from labeled recordings, as a user sees it.

use crate::program::{all_said, said, teachtree_in};
use crate::schemas::{schemas, validated};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;
use std::process::Output;

/// A gripper that is open and low (Wait), closed and low (Hold), closed and high (Raise), in turns; `shift` varies how long each takes.
fn recording(shift: usize) -> String {
    let mut text = String::from(
        "time [s],right.thumb.position.x,right.thumb.position.y,right.thumb.position.z,right.gripper.closed,right.label\n",
    );
    let mut row = 0;
    for cycle in 0..6 {
        for (at, (label, height, closed)) in [("Wait", 0.0, 0), ("Hold", 0.0, 1), ("Raise", 0.08, 1)].iter().enumerate()
        {
            for _ in 0..30 + (7 * cycle + 5 * at + 11 * shift) % 23 {
                let height = height + 0.001 * ((row * 7 + shift) % 10) as f64;
                let _ = writeln!(text, "{:.2},0,0,{height:.4},{closed},{label}", row as f64 * 0.05);
                row += 1;
            }
        }
    }
    text
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("scene.yaml", "bodies: {cube: {role: object, radius: 60 mm}}\nhands: {right: {fingers: [thumb]}}\n");
    write("present.rules", &present(40));
    write("wrong.rules", &present(900));
    write("part.rules", "use \"stream.rules\"\n\nfor each hand { signal height = mean(fingers.position).z }\n");
    std::fs::create_dir(folder.path().join("logs")).unwrap();
    for (shift, name) in ["ann_1", "ann_2", "bob_1", "bob_2", "eve_1", "eve_2", "kim_1", "kim_2"].iter().enumerate() {
        write(&format!("logs/{name}.csv"), &recording(shift));
    }
    folder
}

/// Rules that are right where `height_mm` is between the two heights.
fn present(height_mm: u32) -> String {
    format!(
        "use \"stream.rules\"\n\nstream {{ for each hand {{ gripper.closed : bool }} }}\n\n\
         for each hand {{ signal height = mean(fingers.position).z }}\n\nprimitive Wait, Hold, Raise\n\n\
         tree skills for each hand {{\n  not gripper.closed      => Wait\n  height > {height_mm} mm => Raise\n  else                    => Hold\n}}\n"
    )
}

fn learn(folder: &Path, args: &[&str]) -> Output {
    teachtree_in(folder, &[&["learn", "logs", "--scene", "scene.yaml"], args].concat())
}

#[test]
fn a_file_is_learned_that_check_accepts_and_score_confirms() {
    let folder = folder();
    let output = learn(folder.path(), &["--group-by", "^([a-z]+)", "-o", "mine.rules"]);
    assert_eq!(output.status.code(), Some(0), "{}", all_said(&output));
    let table = said(&output);
    assert!(table.contains("8 recordings in 4 groups (by --group-by); 136 boundaries of 3 kinds"), "{table}");
    for candidate in ["guards, searched", "guards, medoid", "tree, searched"] {
        assert!(table.contains(candidate), "{candidate}: {table}");
    }
    assert!(table.contains("written to mine.rules"), "{table}");
    let checked = teachtree_in(folder.path(), &["check", "mine.rules"]);
    assert_eq!(checked.status.code(), Some(0), "{}", all_said(&checked));
    assert!(!all_said(&checked).contains("warning["), "{}", all_said(&checked));
    let formatted = teachtree_in(folder.path(), &["fmt", "--check", "mine.rules"]);
    assert_eq!(formatted.status.code(), Some(0), "{}", all_said(&formatted));
    let score = ["score", "logs", "--scene", "scene.yaml", "--rules", "mine.rules", "--min-f1", "99"];
    let score = teachtree_in(folder.path(), &score);
    assert_eq!(score.status.code(), Some(0), "{}", all_said(&score));
}

#[test]
fn the_same_recordings_give_the_same_bytes() {
    let folder = folder();
    for (jobs, file) in [("1", "one.rules"), ("2", "two.rules"), ("2", "three.rules")] {
        let output = learn(folder.path(), &["--jobs", jobs, "-o", file]);
        assert_eq!(output.status.code(), Some(0), "{}", all_said(&output));
    }
    let read = |file: &str| std::fs::read_to_string(folder.path().join(file)).unwrap();
    assert_eq!(read("one.rules"), read("two.rules"));
    assert_eq!(read("two.rules"), read("three.rules"));
}

#[test]
fn present_rules_are_replaced_only_by_better_ones() {
    let folder = folder();
    let output = learn(folder.path(), &["--rules", "present.rules", "-o", "mine.rules"]);
    assert_eq!(output.status.code(), Some(1), "{}", all_said(&output));
    assert!(said(&output).contains("nothing is written"), "{}", said(&output));
    assert!(!folder.path().join("mine.rules").exists());
    let output = learn(folder.path(), &["--rules", "present.rules", "--anyway", "-o", "mine.rules"]);
    assert_eq!(output.status.code(), Some(0), "{}", all_said(&output));
    assert!(said(&output).contains("it is not better than the present rules"), "{}", said(&output));
    let output = learn(folder.path(), &["--rules", "wrong.rules"]);
    assert_eq!(output.status.code(), Some(0), "{}", all_said(&output));
    assert!(said(&output).contains("\ntree skills for each hand"), "{}", said(&output));
}

/// The rules lack nothing but the right number: then the fitted ones are the better candidate.
#[test]
fn present_rules_are_also_measured_with_fitted_params() {
    let folder = folder();
    let rules = present(900).replace("primitive", "param high = 900 mm in 10 mm .. 1 m\n\nprimitive");
    std::fs::write(folder.path().join("wrong.rules"), rules.replace("> 900 mm", "> high")).unwrap();
    let args = ["--rules", "wrong.rules", "--group-by", "^([a-z]+)", "-o", "mine.rules"];
    let output = learn(folder.path(), &args);
    assert_eq!(output.status.code(), Some(1), "{}", all_said(&output));
    let table = said(&output);
    let f1: f64 = percent_behind(&table, "the present rules").parse().unwrap();
    assert!(f1 < 90.0, "{table}");
    assert_eq!(percent_behind(&table, "the same, fitted"), "100.0", "{table}");
    assert!(table.contains("than the present rules with fitted params, whose patch `fit` prints"), "{table}");
    assert!(!folder.path().join("mine.rules").exists());
}

/// The number before the first ` %` behind a text.
fn percent_behind(output: &str, text: &str) -> String {
    let rest = output.split_once(text).unwrap_or_else(|| panic!("no `{text}` in {output}")).1;
    rest.split_once(" %").unwrap().0.trim().to_string()
}

#[test]
fn present_rules_are_measured_as_score_does() {
    let folder = folder();
    // Heights of the last label are on both sides of this one.
    std::fs::write(folder.path().join("flicker.rules"), present(84)).unwrap();
    let learned = said(&learn(folder.path(), &["--rules", "flicker.rules", "-o", "mine.rules"]));
    let score = ["score", "logs", "--scene", "scene.yaml", "--rules", "flicker.rules"];
    let score = said(&teachtree_in(folder.path(), &score));
    let f1 = percent_behind(&learned, "the present rules");
    assert_eq!(f1, percent_behind(&score, "at 25 %,"), "{learned}{score}");
    let behind = learned.split_once("the present rules").unwrap().1.split_once(" %").unwrap().1;
    let frames = percent_behind(behind, "");
    assert_eq!(frames, percent_behind(&score, "frame accuracy"), "{learned}{score}");
    let share: f64 = f1.parse().unwrap();
    assert!((5.0..95.0).contains(&share), "{f1}");
}

#[test]
fn what_cannot_be_learned_from_is_one_error() {
    let folder = folder();
    for (args, expected) in [
        (&["--group-by", "("][..], "--group-by: found `(`, expected a regular expression"),
        (&["--group-by", "z"], "--group-by: `z` does not match `ann_1`"),
        (&["--group-by", "_"], "expected at least 2, so that one can be held out"),
        (&["--map", "Wait=mask,Hold=mask"], "the number of names is 1, expected 2 to 32"),
        (&["--map", "Wait=Move|Rest"], "found `Move|Rest`, expected one name for each label"),
        (&["--map", "Wait=wait"], "found the label `wait`, expected the name of a primitive"),
        (&["--rules", "none.rules"], "none.rules"),
        (&["--from", "none.rules"], "none.rules"),
        (&["--from", "contact.rules"], "contact.rules: is a file of the program, expected a file of your own"),
        (&["--from", "part.rules"], "there is no tree: nothing will be labeled"),
        (
            &["--from", "present.rules", "--map", "Wait=wait"],
            "found the label `wait`, expected the name of a primitive",
        ),
        (&["--from", "present.rules", "-o", "present.rules"], "present.rules"),
        (&["-o", "logs/ann_1.csv"], "logs/ann_1.csv"),
    ] {
        let output = learn(folder.path(), args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", all_said(&output));
        let text = all_said(&output);
        assert!(text.contains(expected), "{args:?}: {text}");
        assert_eq!(text.matches("error:").count() + text.matches("error[").count(), 1, "{args:?}: {text}");
    }
}

#[test]
fn one_guard_of_a_written_file_is_learned_again() {
    let folder = folder();
    let args = ["--from", "wrong.rules", "--group-by", "^([a-z]+)", "-o", "better.rules"];
    let output = learn(folder.path(), &args);
    assert_eq!(output.status.code(), Some(0), "{}", all_said(&output));
    let table = said(&output);
    assert_eq!(percent_behind(&table, "with the changes"), "100.0", "{table}");
    assert!(table.contains("wrong.rules:11: `height > 900 mm` becomes `height > "), "{table}");
    assert!(table.contains("-  height > 900 mm => Raise\n+  height > "), "{table}");
    let read = |file: &str| std::fs::read_to_string(folder.path().join(file)).unwrap();
    let changed: Vec<(usize, String)> = read("wrong.rules")
        .lines()
        .zip(read("better.rules").lines())
        .enumerate()
        .filter(|(_, (old, new))| old != new)
        .map(|(at, (_, new))| (at + 1, new.to_string()))
        .collect();
    let [(11, line)] = changed.as_slice() else { panic!("{changed:?}") };
    assert!(line.contains("=> Raise    // learned: held out in 4 groups: F1@50 "), "{line}");
    let score = ["score", "logs", "--scene", "scene.yaml", "--rules", "better.rules", "--min-f1", "99"];
    let score = teachtree_in(folder.path(), &score);
    assert_eq!(score.status.code(), Some(0), "{}", all_said(&score));
    let explain = ["explain", "logs/ann_1.csv", "--scene", "scene.yaml", "--rules", "better.rules", "--at", "4 s"];
    let explained = said(&teachtree_in(folder.path(), &explain));
    assert!(explained.contains("learned: held out in 4 groups: F1@50 "), "{explained}");
    let output = learn(folder.path(), &["--from", "present.rules", "-o", "none.rules"]);
    assert_eq!(output.status.code(), Some(1), "{}", all_said(&output));
    assert!(said(&output).contains("nothing changes: on held-out groups, no change gains"), "{}", said(&output));
    assert!(!folder.path().join("none.rules").exists());
}

#[test]
fn few_groups_are_a_warning() {
    let folder = folder();
    for name in ["eve_1", "eve_2", "kim_1", "kim_2"] {
        std::fs::remove_file(folder.path().join(format!("logs/{name}.csv"))).unwrap();
    }
    let output = learn(folder.path(), &[]);
    assert_eq!(output.status.code(), Some(0), "{}", all_said(&output));
    assert!(
        all_said(&output).contains("2 groups: learned rules may not hold for other people"),
        "{}",
        all_said(&output)
    );
    assert!(said(&output).contains("by the beginnings of names"), "{}", said(&output));
}

/// Writes a recording as some robots do: a folder of tables of the same times; its labels are a file of another folder.
fn write_tables(folder: &Path, name: &str) {
    let text = std::fs::read_to_string(folder.join(format!("logs/{name}.csv"))).unwrap();
    let (mut hand, mut gripper) = (String::from("time,x,y,z\n"), String::from("time,closed\n"));
    let mut labels: Vec<(&str, f64)> = Vec::new();
    let mut end_s = 0.0;
    for row in text.lines().skip(1) {
        let [time, x, y, z, closed, label] = row.split(',').collect::<Vec<_>>()[..] else { panic!("{row}") };
        let _ = writeln!(hand, "{time},{x},{y},{z}");
        let _ = writeln!(gripper, "{time},{closed}");
        end_s = time.parse::<f64>().unwrap();
        if labels.last().is_none_or(|last| last.0 != label) {
            labels.push((label, end_s));
        }
    }
    let ends = labels.iter().skip(1).map(|(_, start_s)| *start_s).chain([end_s]);
    let rows = labels.iter().zip(ends).map(|((label, start_s), end_s)| format!("{label},{start_s},{end_s}\n"));
    std::fs::create_dir_all(folder.join(name)).unwrap();
    std::fs::create_dir_all(folder.join("labels")).unwrap();
    std::fs::write(folder.join(name).join("hand.csv"), hand).unwrap();
    std::fs::write(folder.join(name).join("gripper.csv"), gripper).unwrap();
    let table = format!("label,start_s,end_s\n{}", rows.collect::<String>());
    std::fs::write(folder.join(format!("labels/{name}.labels.csv")), table).unwrap();
}

/// What `analyze` reads as one recording is one for all commands that compare recordings with labels.
#[test]
fn recordings_may_be_folders_of_tables() {
    let folder = folder();
    let names = ["ann_1", "bob_1", "eve_1", "kim_1"];
    names.iter().for_each(|name| write_tables(folder.path(), name));
    let binding = "time: time [s]\nresample: 20 Hz\nchannels:\n  right.thumb.position: hand.<xyz>\n  \
                   right.gripper.closed: gripper.closed\nscene: {bodies: {cube: {role: object, radius: 60 mm}}}\n";
    std::fs::write(folder.path().join("arm.yaml"), binding).unwrap();
    let run = |command: &str, more: &[&str]| {
        let inputs = [&["--binding", "arm.yaml", "--labels", "labels"], &names[..]].concat();
        teachtree_in(folder.path(), &[&[command], &inputs[..], more].concat())
    };
    let learned = run("learn", &["-o", "mine.rules"]);
    assert_eq!(learned.status.code(), Some(0), "{}", all_said(&learned));
    assert!(said(&learned).contains("4 recordings in 4 groups"), "{}", said(&learned));
    let scored = run("score", &["--rules", "mine.rules", "--min-f1", "99"]);
    assert_eq!(scored.status.code(), Some(0), "{}", all_said(&scored));
    let relearned = run("learn", &["--from", "wrong.rules"]);
    assert_eq!(relearned.status.code(), Some(0), "{}", all_said(&relearned));
    let compared =
        teachtree_in(folder.path(), &[&["agree", "labels", "labels", "--binding", "arm.yaml"], &names[..]].concat());
    assert_eq!(compared.status.code(), Some(0), "{}", all_said(&compared));
}

/// The rules of [`present`] without one of their primitives.
const TWO: &str = "use \"stream.rules\"

stream { for each hand { gripper.closed : bool } }

for each hand {
  signal closed = gripper.closed
  signal height = mean(fingers.position).z
}

primitive Wait does free, Hold does carry

tree skills for each hand {
  not closed => Wait
  else       => Hold
}

task hold = Wait .. Wait with Hold
";

#[test]
fn a_new_primitive_extends_the_rules_and_is_proved_additive() {
    let folder = folder();
    std::fs::write(folder.path().join("two.rules"), TWO).unwrap();
    let output = learn(folder.path(), &["--rules", "two.rules", "--new", "Raise", "-o", "mine.rules"]);
    assert_eq!(output.status.code(), Some(0), "{}", all_said(&output));
    let table = said(&output);
    assert!(table.contains("8 recordings, 8 of them with 48 labeled intervals of Raise"), "{table}");
    assert!(table.contains("held out      48 of 48 intervals found, 0 others"), "{table}");
    assert!(table.contains("proved: it only adds to the rules"), "{table}");
    let text = std::fs::read_to_string(folder.path().join("mine.rules")).unwrap();
    assert!(text.contains("use \"two.rules\"") && text.contains("primitive Raise is Hold"), "{text}");
    for args in [&["prove", "additive", "two.rules", "mine.rules"][..], &["fmt", "--check", "mine.rules"]] {
        let output = teachtree_in(folder.path(), args);
        assert_eq!(output.status.code(), Some(0), "{args:?}: {}\n{text}", all_said(&output));
    }
    let checked = teachtree_in(folder.path(), &["check", "mine.rules"]);
    assert!(all_said(&checked).starts_with("0 errors") && !all_said(&checked).contains("warning["), "{text}");
    let score = ["score", "logs", "--scene", "scene.yaml", "--rules", "mine.rules", "--min-f1", "99"];
    let score = teachtree_in(folder.path(), &score);
    assert_eq!(score.status.code(), Some(0), "{}", all_said(&score));
}

/// Three recordings have a label file, and it names the primitive only.
#[test]
fn recordings_without_labels_show_where_a_new_primitive_takes_place() {
    let folder = folder();
    std::fs::write(folder.path().join("two.rules"), TWO).unwrap();
    std::fs::create_dir(folder.path().join("labels")).unwrap();
    for name in ["ann_1", "bob_1", "eve_1"] {
        let log = std::fs::read_to_string(folder.path().join(format!("logs/{name}.csv"))).unwrap();
        let mut labels = String::from("track,label,start_s,end_s\n");
        let time_s = |row: &str| row.split(',').next().unwrap().parse::<f64>().unwrap();
        let rows: Vec<(f64, bool)> = log.lines().skip(1).map(|row| (time_s(row), row.ends_with(",Raise"))).collect();
        for run in rows.chunk_by(|one, other| one.1 == other.1).filter(|run| run[0].1) {
            writeln!(labels, "right,Raise,{:.2},{:.2}", run[0].0, run[run.len() - 1].0 + 0.05).unwrap();
        }
        std::fs::write(folder.path().join(format!("labels/{name}.labels.csv")), labels).unwrap();
    }
    let args = ["--rules", "two.rules", "--labels", "labels", "--new", "Raise", "-o", "mine.rules"];
    let output = learn(folder.path(), &args);
    assert_eq!(output.status.code(), Some(0), "{}", all_said(&output));
    let table = said(&output);
    assert!(table.contains("8 recordings, 3 of them with 18 labeled intervals of Raise"), "{table}");
    assert!(table.contains("5 recordings without labels: found 30 times"), "{table}");
    // Their hands measure no `gripper.closed`.
    assert!(table.contains("the shipped demonstrations lack channels that the rules read"), "{table}");
    assert!(table.contains("least certain first") && table.contains("s  found, "), "{table}");
    let output = learn(folder.path(), &["--new", "raise", "--labels", "labels"]);
    assert_eq!(output.status.code(), Some(2), "{}", all_said(&output));
    assert!(all_said(&output).contains("expected the name of a primitive, such as `Shake`"), "{}", all_said(&output));
}

/// The demonstrations carry objects too, and the primitive is learned nevertheless. Another person shows each of them.
#[test]
fn the_shipped_demonstrations_are_recordings_of_other_tasks() {
    let folder = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| {
        let output = teachtree_in(folder.path(), args);
        assert_eq!(output.status.code(), Some(0), "{args:?}: {}", all_said(&output));
        said(&output)
    };
    run(&["teach", "pick_and_place", "pick_and_place", "--seeds", "1..3", "-o", "logs"]);
    run(&["analyze", "logs", "--format", "csv", "--out-dir", "labels"]);
    let args = ["learn", "logs", "--labels", "labels", "--map", "Translate=Haul", "--new", "Haul", "-o", "haul.rules"];
    let table = run(&args);
    assert!(
        table.contains("learned from  3 of 3 intervals found, 0 others") && table.contains("proved: it only adds"),
        "{table}"
    );
    let found = table.split_once("25 shipped demonstrations of other tasks: found ").unwrap().1;
    let found: usize = found.split_once(" times").unwrap().0.parse().unwrap();
    assert!(found > 0, "{table}");
    assert!(!table.contains("(shipped"), "a person labels no shipped demonstration: {table}");
    let document: Value = serde_json::from_str(&run(&[&args[..], &["--format", "json"]].concat())).unwrap();
    let intervals = document["primitive"]["intervals"].as_array().unwrap().iter();
    let logs: BTreeSet<&str> = intervals.map(|it| it["log"].as_str().unwrap()).collect();
    let shown: Vec<(&str, &str)> = logs.iter().filter_map(|log| log.split_once(" (shipped, seed ")).collect();
    let seeds: BTreeSet<&str> = shown.iter().map(|(_, seed)| *seed).collect();
    assert!(shown.len() > 3 && seeds.len() == shown.len(), "{logs:?}");
}

/// A result of the program, `teachtree.learning/1`.
pub fn learning_document() -> String {
    said(&learn(folder().path(), &["--group-by", "^([a-z]+)", "--format", "json"]))
}

#[test]
fn both_forms_keep_to_their_schema() {
    let folder = folder();
    std::fs::write(folder.path().join("two.rules"), TWO).unwrap();
    let schema = schemas().into_iter().find(|(file, _)| file == "learning-1.schema.json").unwrap().1;
    let document = |args: &[&str]| -> Value {
        let output = learn(folder.path(), &[args, &["--format", "json"]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", all_said(&output));
        serde_json::from_str(&said(&output)).unwrap()
    };
    let whole = document(&["--group-by", "^([a-z]+)", "-o", "mine.rules"]);
    assert_eq!((&whole["boundaries"], &whole["file"]), (&136.into(), &"mine.rules".into()), "{whole}");
    assert_eq!(whole["groups"].as_array().map(Vec::len), Some(4), "{whole}");
    let new = document(&["--rules", "two.rules", "--new", "Raise"]);
    assert_eq!((&new["primitive"]["proved"], &new["file"]), (&true.into(), &Value::Null), "{new}");
    assert_eq!(new["primitive"]["held_out"]["matched"], 48, "{new}");
    assert!(new["rules"].as_str().unwrap().contains("primitive Raise is Hold"), "{new}");
    let kinds = ["candidates", "primitive"].map(|field| (whole[field].is_null(), new[field].is_null()));
    assert_eq!(kinds, [(false, true), (true, false)]);
    let changed = document(&["--from", "wrong.rules", "--group-by", "^([a-z]+)"]);
    for found in [&whole, &changed] {
        assert!(found["versions"].as_u64() > Some(20) && found["complete"] == true, "{found}");
    }
    assert_eq!(
        (&changed["changes"][0]["line"], &changed["changes"][0]["before"]),
        (&11.into(), &"height > 900 mm".into())
    );
    assert!(changed["patch"].as_str().unwrap().starts_with("--- wrong.rules\n+++ wrong.rules\n"), "{changed}");
    validated(&[(schema.clone(), whole), (schema.clone(), new), (schema, changed)]);
}
