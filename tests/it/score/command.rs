//! `teachtree score` as a user meets it.

use crate::program::{complained, demonstrate, program};
use serde_json::Value;
use std::path::Path;
use std::process::Output;

fn teachtree(args: &[&str], threads: &str) -> Output {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    program(folder, args).env("RAYON_NUM_THREADS", threads).output().unwrap()
}

fn said(output: &Output) -> String {
    assert!(output.status.success(), "{}", complained(output));
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn recorded(folder: &Path, seeds: &[&str]) {
    for seed in seeds {
        let log = folder.join(format!("{seed}.csv"));
        demonstrate("paper_box", &["--seed", seed], log);
    }
}

#[test]
fn a_folder_is_its_logs_one_by_one() {
    let folder = tempfile::tempdir().unwrap();
    recorded(folder.path(), &["1", "2"]);
    let name = folder.path().to_str().unwrap();
    let picture = folder.path().join("score.svg");
    let args = ["score", name, "--raw", "--format", "json", "--picture", picture.to_str().unwrap()];
    let together = said(&teachtree(&args, "2"));
    assert_eq!(together, said(&teachtree(&args, "1")), "threads change nothing");
    assert!(std::fs::read_to_string(&picture).unwrap().starts_with("<svg"));
    let together: Value = serde_json::from_str(&together).unwrap();
    assert_eq!(together["recordings"], 2);
    for (at, result) in [(0, "relabeled"), (1, "raw")] {
        assert_eq!(together["results"][at]["result"], result);
        for (row, seed) in [(0, "1"), (1, "2")] {
            let log = folder.path().join(format!("{seed}.csv"));
            let alone = said(&teachtree(&["score", log.to_str().unwrap(), "--raw", "--format", "json"], "2"));
            let alone: Value = serde_json::from_str(&alone).unwrap();
            assert_eq!(alone["results"][at]["rows"][0], together["results"][at]["rows"][row]);
        }
    }
    // The trees say what the world says, but for when some motions begin.
    let raw = &together["results"][1]["all"];
    assert!(raw["accuracy"].as_f64().unwrap() > 0.95, "{}", raw["accuracy"]);
}

#[test]
fn labels_of_another_time_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    recorded(folder.path(), &["1"]);
    let [log, labels] = ["1.csv", "labels.csv"].map(|name| folder.path().join(name));
    std::fs::write(&labels, "label,start_s,end_s,track\nMove,1700000000,1700000002,right\n").unwrap();
    let output = teachtree(&["score", log.to_str().unwrap(), "--labels", labels.to_str().unwrap()], "1");
    assert_eq!(output.status.code(), Some(2));
    let complained = complained(&output);
    let told = "has labels from 1700000000.000 s to 1700000002.000 s, and the recording is from 0.000 s to ";
    assert!(complained.contains(told), "{complained}");
    // Milliseconds in the columns of seconds.
    let text = "label,start_s,end_s,track\nMove,0,900,right\nApproach,900,4000,right\nGrasp,4000,5000,right\n";
    std::fs::write(&labels, text).unwrap();
    let output = teachtree(&["score", log.to_str().unwrap(), "--labels", labels.to_str().unwrap()], "1");
    assert_eq!(output.status.code(), Some(2));
    let complained = self::complained(&output);
    assert!(complained.contains("milliseconds need the columns `start_ms` and `end_ms`"), "{complained}");
}

#[test]
fn own_labels_in_a_file_score_as_in_the_log() {
    let folder = tempfile::tempdir().unwrap();
    recorded(folder.path(), &["1"]);
    let log = folder.path().join("1.csv");
    let mut reader = csv::Reader::from_path(&log).unwrap();
    let columns = ["right.label", "right.task"]
        .map(|wanted| reader.headers().unwrap().iter().position(|name| name == wanted).unwrap());
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let mut text = "start_frame,end_frame,label,kind\n".to_string();
    for (column, kind) in columns.into_iter().zip(["primitive", "task"]) {
        let mut start = 0;
        for run in rows.chunk_by(|one, next| one[column] == next[column]) {
            text.push_str(&format!("{start},{},{},{kind}\n", start + run.len(), run[0][column].to_lowercase()));
            start += run.len();
        }
    }
    std::fs::write(folder.path().join("1_segments.csv"), text).unwrap();
    let map = "move=Move,approach=Approach,slide=Slide,grasp=Grasp,translate=Translate,follow=Follow,place=Place,release=Release,push=Push,trace=Trace";
    let (log, folder) = (log.to_str().unwrap(), folder.path().to_str().unwrap());
    let own = said(&teachtree(&["score", log], "1"));
    assert_eq!(own, said(&teachtree(&["score", log, "--labels", folder, "--map", map], "1")));
}

#[test]
fn frames_of_a_video_read_as_rows_are_warned_about() {
    let folder = tempfile::tempdir().unwrap();
    recorded(folder.path(), &["1"]);
    let log = folder.path().join("1.csv");
    let mut reader = csv::Reader::from_path(&log).unwrap();
    let column = reader.headers().unwrap().iter().position(|name| name == "right.label").unwrap();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let time = |row: usize| rows.get(row).unwrap_or(rows.last().unwrap())[0].parse::<f64>().unwrap();
    let labels = |rate_hz: Option<f64>| {
        let mut text = "start_frame,end_frame,label\n".to_string();
        let frame = |row: usize| rate_hz.map_or(row, |rate_hz| ((time(row) - time(0)) * rate_hz).round() as usize);
        let mut start = 0;
        for run in rows.chunk_by(|one, next| one[column] == next[column]) {
            text.push_str(&format!("{},{},{}\n", frame(start), frame(start + run.len()), &run[0][column]));
            start += run.len();
        }
        let file = folder.path().join("labels.csv");
        std::fs::write(&file, text).unwrap();
        complained(&teachtree(&["score", log.to_str().unwrap(), "--labels", file.to_str().unwrap()], "1"))
    };
    let warned = labels(Some(30.0));
    assert!(warned.contains("as frames of a video at 30 Hz"), "{warned}");
    let warned = labels(None);
    assert!(!warned.contains("frames of a video"), "{warned}");
}

#[test]
fn a_relabeled_truth_is_reported_as_the_result_is() {
    let folder = tempfile::tempdir().unwrap();
    recorded(folder.path(), &["1"]);
    let name = folder.path().to_str().unwrap();
    let sequences = |args: &[&str]| {
        let score: Value = serde_json::from_str(&said(&teachtree(args, "1"))).unwrap();
        score["results"][0]["all"]["sequences"]["right"].as_u64().unwrap()
    };
    // The true slide before the grasp, and the true push within the trace, are joined by the rules.
    assert_eq!(sequences(&["score", name, "--format", "json"]), 0);
    assert_eq!(sequences(&["score", name, "--format", "json", "--relabel-truth"]), 1);
}

#[test]
fn a_log_that_cannot_be_read_hides_no_others() {
    let folder = tempfile::tempdir().unwrap();
    recorded(folder.path(), &["1"]);
    std::fs::write(folder.path().join("0.csv"), "time [s]\n").unwrap();
    let output = teachtree(&["score", folder.path().to_str().unwrap()], "1");
    assert_eq!(output.status.code(), Some(3));
    assert!(String::from_utf8(output.stdout.clone()).unwrap().starts_with("1 recording, "));
    assert!(complained(&output).contains("0.csv"), "{}", complained(&output));
}

#[test]
fn what_cannot_be_scored_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let empty = folder.path().to_str().unwrap();
    let real = [
        "demos/robosuite/SawyerNutAssembly_demo_1.csv",
        "--binding",
        "demos/robosuite/sawyer_nut_assembly.binding.yaml",
    ];
    let with = |more: &[&'static str]| [&["score"][..], &real, more].concat();
    let labels = folder.path().join("1_segments.csv");
    std::fs::write(&labels, "label,start_s,end_s\nGrasp,0,1\n").unwrap();
    for (args, wanted) in [
        (vec!["score", empty], "the folder holds no log: no data set, and no file that ends in csv, tsv, parquet"),
        (with(&[]), "the log has no true labels"),
        (with(&["--labels", "nowhere.csv"]), "nowhere.csv: there is no such file"),
        (with(&["--labels", "docs"]), "the log has no label file"),
        (with(&["--labels", "nowhere.csv", "--map", "none.yaml"]), "none.yaml: there is no such file"),
        (with(&["--labels", "nowhere.csv", "--map", "S1"]), "expected FOREIGN=OURS"),
        (vec!["score", "a.csv", "b.csv", "--labels", labels.to_str().unwrap()], "one label file for 2 recordings"),
    ] {
        let output = teachtree(&args, "1");
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(complained(&output).contains(wanted), "{args:?}: {}", complained(&output));
    }
}

#[test]
fn a_score_below_the_least_one_is_a_negative_answer() {
    let folder = tempfile::tempdir().unwrap();
    recorded(folder.path(), &["1"]);
    let log = folder.path().join("1.csv");
    let score = |least: &[&str]| teachtree(&[&["score", log.to_str().unwrap()][..], least].concat(), "2");
    said(&score(&["--min-accuracy", "90", "--min-f1", "80", "--min-edit", "70"]));
    let wrong = folder.path().join("wrong.csv");
    std::fs::write(&wrong, "track,label,start_s,end_s\nright,Turn,0,2\n").unwrap();
    let below = score(&["--labels", wrong.to_str().unwrap(), "--min-accuracy", "0", "--min-f1", "100"]);
    assert_eq!(below.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&below.stdout).contains("edit score"), "the score is printed all the same");
    let complained = complained(&below);
    assert!(complained.contains("F1 at 50 % overlap is ") && complained.contains(" %, expected at least 100 %"));
    assert!(!complained.contains("frames right"), "{complained}");
}

/// Rules with only a tree over both hands label no single hand. Uncoordinated time is `separate` there, too.
#[test]
fn rules_with_only_a_tree_over_both_hands_are_scored() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: String| std::fs::write(folder.path().join(name), text).unwrap();
    let row = |at: usize| format!("{:.2},1,{}\n", at as f64 / 100.0, u8::from((100..200).contains(&at)));
    write("log.csv", format!("time,left.thumb.contact,right.thumb.contact\n{}", (0..300).map(row).collect::<String>()));
    let rules = "use \"stream.rules\"\nprimitive Share does share\n\
                 tree both for left, right { any(left.fingers.contact) and any(right.fingers.contact) => Share  else => separate }\n";
    write("both.rules", rules.into());
    write("log.scene.yaml", "bodies: {}\n".into());
    write("labels.csv", "label,start_s,end_s,track\nseparate,0,1.5,both\nShare,1.5,2,both\nseparate,2,3,both\n".into());
    let score = |more: &[&str]| {
        let args = ["score", "log.csv", "--rules", "both.rules", "--labels", "labels.csv", "--format", "json"];
        program(folder.path(), &[&args, more].concat()).output().unwrap()
    };
    let scored: Value = serde_json::from_str(&said(&score(&[]))).unwrap();
    let all = &scored["results"][0]["all"];
    let near = |name: &str, wanted: f64| (all[name].as_f64().unwrap() - wanted).abs() < 1e-5;
    assert!(near("scored_s", 3.0) && near("accuracy", 2.5 / 3.0), "{all}");
    // If nothing can be compared, `score` fails.
    let masked = score(&["--map", "Share=mask,separate=mask"]);
    assert_eq!(masked.status.code(), Some(2), "{}", complained(&masked));
    assert!(complained(&masked).contains("nothing can be scored"), "{}", complained(&masked));
}
