//! `learn`: a rule file from labeled recordings, as a user sees it.

use crate::program::{all_said, said, teachtree_in};
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
    assert!(table.contains("guards, searched") && table.contains("tree"), "{table}");
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
