//! What is written as labels is read back as labels: a table, a file of ELAN, annotations of a LeRobot set.

use crate::program::{all_said, complained, said, teachtree_in};
use crate::sets::with_set;
use crate::shared::folders::copy;
use serde_json::Value;
use std::io::Write as _;
use std::path::Path;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Shipped recordings with their bindings: one and two hands, contacts and flags, with and without tasks, stamps that begin at 0 and later.
const RECORDINGS: [(&str, &str); 6] = [
    ("stack_panda_demo_1.csv", "panda_stack.binding.yaml"),
    ("nut_assembly_panda_demo_1.csv", "panda_nut_assembly.binding.yaml"),
    ("lift_demo_1.csv", "panda_lift.binding.yaml"),
    ("handover_panda_panda_demo_5.csv", "handover.binding.yaml"),
    ("BaxterLift_demo_1.csv", "baxter_lift.binding.yaml"),
    ("wipe_panda_demo_1.csv", "wipe.binding.yaml"),
];

fn run(folder: &Path, args: &[&str]) -> String {
    let output = teachtree_in(folder, args);
    assert!(output.status.success(), "{args:?}: {}", all_said(&output));
    said(&output)
}

/// The score of recordings against labels.
fn score(folder: &Path, logs: &[&str], more: &[&str]) -> Value {
    let args = [&["score", "--format", "json"], logs, more].concat();
    serde_json::from_str(&run(folder, &args)).unwrap()
}

/// The share of time with the right primitive, the share of tasks that were found, and the number of tasks that are not there.
fn shares(score: &Value) -> (f64, f64, u64) {
    let all = &score["results"][0]["all"];
    let found = &all["tasks"]["found"];
    let share = if found["of"] == 0 { 1.0 } else { found["right"].as_f64().unwrap() / found["of"].as_f64().unwrap() };
    (all["accuracy"].as_f64().unwrap(), share, all["tasks"]["false"].as_u64().unwrap())
}

const ALL: (f64, f64, u64) = (1.0, 1.0, 0);

fn demo(name: &str) -> String {
    root().join("demos/robosuite").join(name).display().to_string()
}

#[test]
fn the_table_of_an_analysis_is_a_label_file() {
    let folder = tempfile::tempdir().unwrap();
    for (log, binding) in RECORDINGS {
        let (log, binding) = (demo(log), demo(binding));
        run(folder.path(), &["analyze", &log, "--binding", &binding, "--format", "csv", "-o", "labels.csv"]);
        let scored = score(folder.path(), &[&log], &["--binding", &binding, "--labels", "labels.csv"]);
        assert_eq!(shares(&scored), ALL, "{log}: {scored:#}");
        assert!(scored["results"][0]["all"]["scored_s"].as_f64().unwrap() > 4.0, "{log}");
        // It is a truth that can be missed.
        if log.contains("stack_panda") {
            let text = std::fs::read_to_string(folder.path().join("labels.csv")).unwrap().replace("Grasp", "Move");
            std::fs::write(folder.path().join("other.csv"), text).unwrap();
            let scored = score(folder.path(), &[&log], &["--binding", &binding, "--labels", "other.csv"]);
            assert!(shares(&scored).0 < 1.0);
        }
    }
}

/// Two recordings of one name in two folders: each is scored against the labels beside it.
#[test]
fn a_recording_in_a_subfolder_has_its_labels_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let binding = demo("panda_stack.binding.yaml");
    for (group, moved) in [("a", false), ("b", true)] {
        let place = folder.path().join("set").join(group);
        std::fs::create_dir_all(&place).unwrap();
        let log = place.join("demo_1.csv");
        std::fs::copy(demo("stack_panda_demo_1.csv"), &log).unwrap();
        let table = run(folder.path(), &["analyze", log.to_str().unwrap(), "--binding", &binding, "--format", "csv"]);
        let labels = if moved { table.replace("Grasp", "Move") } else { table };
        std::fs::write(place.join("demo_1.labels.csv"), labels).unwrap();
    }
    let logs = ["set/a/demo_1.csv", "set/b/demo_1.csv"];
    let scored = score(folder.path(), &logs, &["--binding", &binding, "--labels", "set"]);
    let rows = scored["results"][0]["rows"].as_array().unwrap();
    let shares: Vec<f64> = rows.iter().map(|row| row["accuracy"].as_f64().unwrap()).collect();
    assert!(matches!(shares[..], [a, b] if a == 1.0 && b < 1.0), "{scored:#}");
}

#[test]
fn a_file_of_elan_is_a_label_file() {
    let folder = tempfile::tempdir().unwrap();
    for (log, binding) in RECORDINGS {
        let (log, binding) = (demo(log), demo(binding));
        run(folder.path(), &["analyze", &log, "--binding", &binding, "--format", "eaf", "-o", "labels.eaf"]);
        let scored = score(folder.path(), &[&log], &["--binding", &binding, "--labels", "labels.eaf"]);
        assert_eq!(shares(&scored), ALL, "{log}: {scored:#}");
    }
}

#[test]
fn one_table_of_several_recordings_and_a_folder_of_files_are_labels_of_each() {
    let folder = with_set();
    let analyze = ["analyze", "set#*", "--binding", "b.yaml", "--format"];
    run(folder.path(), &[&analyze[..], &["csv", "-o", "all.csv"]].concat());
    for (format, out) in [("csv", "tables"), ("eaf", "elan")] {
        run(folder.path(), &[&analyze[..], &[format, "--out-dir", out, "-q"]].concat());
    }
    for labels in ["all.csv", "tables", "elan"] {
        let scored = score(folder.path(), &["set#*"], &["--binding", "b.yaml", "--labels", labels]);
        assert_eq!((shares(&scored), &scored["recordings"]), (ALL, &Value::from(3)), "{labels}: {scored:#}");
    }
    let other = run(folder.path(), &["analyze", "set#0", "--binding", "b.yaml", "--format", "csv", "-o", "0.csv"]);
    assert_eq!(other, "");
    let args = ["score", "set#1", "--binding", "b.yaml", "--labels", "0.csv"];
    let refused = teachtree_in(folder.path(), &args);
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        complained(&refused).contains("no row is about the log set#1, the first is about `set#0`"),
        "{}",
        complained(&refused)
    );
    // Two recordings, and a table that does not say which one it is about.
    std::fs::write(folder.path().join("plain.csv"), "label,start_s,end_s\nMove,0,1\n").unwrap();
    let refused = teachtree_in(folder.path(), &["score", "set#*", "--binding", "b.yaml", "--labels", "plain.csv"]);
    assert!(complained(&refused).contains("one label file for 3 recordings"), "{}", complained(&refused));
}

#[test]
fn annotations_of_a_set_are_labels_in_the_words_that_were_written() {
    let folder = with_set();
    for (out, words) in [
        ("plain", &[][..]),
        (
            "worded",
            &[
                "--words",
                "please {name}[ the {object}]",
                "--words",
                "Translate=carry {object} along",
                "--words",
                "RoundNut0=round nut",
            ],
        ),
    ] {
        let args = [&["annotate", "set", "-o", out, "--binding", "b.yaml", "--prelabels", "-q"], words].concat();
        run(folder.path(), &args);
        let file = format!("{out}/meta/lerobot_annotations.json");
        for labels in [out, &file] {
            let scored = score(folder.path(), &["set#*"], &["--binding", "b.yaml", "--labels", labels]);
            assert_eq!(shares(&scored), ALL, "{labels}: {scored:#}");
        }
    }
    // A person moves a boundary and words a label by a name of the rules.
    let file = folder.path().join("plain/meta/lerobot_annotations.json");
    let mut document: Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    let atoms = document["episodes"]["0"]["atoms"].as_array_mut().unwrap();
    let grasp = atoms.iter_mut().find(|atom| atom["content"] == "grasp the RoundNut0").unwrap();
    grasp["content"] = "Grasp".into();
    grasp["timestamp"] = (grasp["timestamp"].as_f64().unwrap() - 0.5).into();
    std::fs::write(&file, document.to_string()).unwrap();
    let scored = score(folder.path(), &["set#0"], &["--binding", "b.yaml", "--labels", "plain"]);
    let (accuracy, ..) = shares(&scored);
    // 10 of 344 frames at 20 Hz.
    assert!((accuracy - 334.0 / 344.0).abs() < 1e-6, "{accuracy}");
    // Two people, in words of their own.
    let agreed =
        teachtree_in(folder.path(), &["agree", "plain", "worded", "set#0", "--binding", "b.yaml", "--format", "json"]);
    let agreed: Value = serde_json::from_str(&said(&agreed)).unwrap_or_else(|_| panic!("{}", complained(&agreed)));
    assert_eq!(agreed["primitives"]["all"]["same_frames"], 334, "{agreed:#}");
    let labels = agreed["primitives"]["labels"].as_array().unwrap();
    let grasp = labels.iter().find(|label| label["label"] == "Grasp").unwrap();
    assert_eq!(grasp["boundaries"]["median_ms"], 500.0, "{agreed:#}");
    // A label holds until the next one, a task until the primitive that closes it: a Move behind the Release is none of it.
    let mut moved = document.clone();
    let mut after = moved["episodes"]["0"]["atoms"].as_array().unwrap().last().unwrap().clone();
    (after["content"], after["style"], after["timestamp"]) = ("move".into(), "motion".into(), 17.0.into());
    moved["episodes"]["0"]["atoms"].as_array_mut().unwrap().push(after);
    std::fs::write(&file, moved.to_string()).unwrap();
    let scored = score(folder.path(), &["set#0"], &["--binding", "b.yaml", "--labels", "plain"]);
    assert_eq!(scored["results"][0]["all"]["tasks"]["sequences"]["right"], 1, "{scored:#}");
    std::fs::write(&file, document.to_string()).unwrap();
    for (from, to, message) in [
        ("\"Grasp\"", "\"take it\"", "found `take it`, which are not the words for a name of the rules"),
        ("\"version\":2", "\"version\":7", "found version 7, expected 2"),
        ("\"atoms\"", "\"subtasks\"", "`episodes.0`: expected a list `atoms`"),
        ("\"timestamp\":0.0", "\"timestamp\":\"now\"", "`atoms[0]`"),
    ] {
        std::fs::write(&file, document.to_string().replacen(from, to, 1)).unwrap();
        let refused = teachtree_in(folder.path(), &["score", "set#0", "--binding", "b.yaml", "--labels", "plain"]);
        assert_eq!(refused.status.code(), Some(2));
        assert!(complained(&refused).contains(message), "{}", complained(&refused));
    }
    std::fs::write(&file, document.to_string().replacen("\"Grasp\"", "\"take it\"", 1)).unwrap();
    let mapped = ["--binding", "b.yaml", "--labels", "plain", "--map", "take it=Grasp"];
    assert!((shares(&score(folder.path(), &["set#0"], &mapped)).0 - 334.0 / 344.0).abs() < 1e-6);
}

#[test]
fn annotations_of_two_hands_are_labels_of_each() {
    let folder = tempfile::tempdir().unwrap();
    let fixtures = root().join("tests/fixtures/formats");
    copy(&fixtures.join("lerobot_v30_hands"), &folder.path().join("set"));
    std::fs::copy(fixtures.join("lerobot_v30_hands.binding.yaml"), folder.path().join("b.yaml")).unwrap();
    for (out, words) in [("plain", &[][..]), ("worded", &["--words", "{hand}, {name} the {object}"])] {
        run(
            folder.path(),
            &[&["annotate", "set", "-o", out, "--binding", "b.yaml", "--prelabels", "-q"], words].concat(),
        );
        let scored = score(folder.path(), &["set"], &["--binding", "b.yaml", "--labels", out]);
        assert_eq!(shares(&scored), ALL, "{out}: {scored:#}");
        assert_eq!(scored["results"][0]["all"]["tasks"]["sequences"]["right"], 2, "{out}: {scored:#}");
        let tracks = scored["results"][0]["rows"].as_array().unwrap();
        assert_eq!(tracks.iter().map(|row| row["track"].as_str().unwrap()).collect::<Vec<_>>(), ["left", "right"]);
    }
}

/// A file as ELAN writes it: tiers of a person's own names, one that depends on another, one that is empty.
fn foreign(tier: &str, value: &str, slot: &str) -> String {
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<ANNOTATION_DOCUMENT AUTHOR="" DATE="2024-05-02T10:00:00+01:00" FORMAT="3.0" VERSION="3.0">
  <HEADER MEDIA_FILE="" TIME_UNITS="milliseconds"/>
  <TIME_ORDER>
    <TIME_SLOT TIME_SLOT_ID="ts1" TIME_VALUE="0"/>
    <TIME_SLOT TIME_SLOT_ID="ts2" TIME_VALUE="2100"/>
    {slot}
  </TIME_ORDER>
  <TIER LINGUISTIC_TYPE_REF="default-lt" TIER_ID="{tier}">
    <ANNOTATION><ALIGNABLE_ANNOTATION ANNOTATION_ID="a1" TIME_SLOT_REF1="ts1" TIME_SLOT_REF2="ts2"><ANNOTATION_VALUE>Approach</ANNOTATION_VALUE></ALIGNABLE_ANNOTATION></ANNOTATION>
    <ANNOTATION><ALIGNABLE_ANNOTATION ANNOTATION_ID="a2" TIME_SLOT_REF1="ts2" TIME_SLOT_REF2="ts3"><ANNOTATION_VALUE>{value}</ANNOTATION_VALUE></ALIGNABLE_ANNOTATION></ANNOTATION>
  </TIER>
  <TIER LINGUISTIC_TYPE_REF="default-lt" TIER_ID="notes"/>
  <TIER LINGUISTIC_TYPE_REF="task" TIER_ID="Tasks_Right" PARENT_REF="{tier}">
    <ANNOTATION><REF_ANNOTATION ANNOTATION_ID="a3" ANNOTATION_REF="a1"><ANNOTATION_VALUE>peg_in_hole</ANNOTATION_VALUE></REF_ANNOTATION></ANNOTATION>
  </TIER>
</ANNOTATION_DOCUMENT>"#
    )
}

#[test]
fn files_of_elan_by_others_are_read_and_bad_ones_refused() {
    let folder = with_set();
    let slot = r#"<TIME_SLOT TIME_SLOT_ID="ts3" TIME_VALUE="2350"/>"#;
    let write = |text: String| std::fs::write(folder.path().join("l.eaf"), text).unwrap();
    let args = ["--binding", "b.yaml", "--labels", "l.eaf"];
    for tier in ["gesture", "Right-hand", "RIGHT primitive"] {
        write(foreign(tier, "Grasp", slot));
        let scored = score(folder.path(), &["set#0"], &args);
        assert_eq!(shares(&scored), ALL, "{tier}: {scored:#}");
        assert_eq!(scored["results"][0]["all"]["scored_s"], 2.35);
    }
    let good = foreign("gesture", "Grasp", slot);
    for (text, message) in [
        ("<a>".into(), "l.eaf: is not a file of ELAN"),
        ("<a/>".into(), "found the element `a`, expected `ANNOTATION_DOCUMENT`"),
        (good.replace("milliseconds", "PAL-frames"), "found times in `PAL-frames`, expected milliseconds"),
        (good.replace("\"2100\"", "\"soon\""), "found `soon` as the time of `ts2`"),
        (foreign("gesture", "Grasp", ""), "l.eaf annotation a2: has no time"),
        (foreign("gesture", "Grab", slot), "l.eaf annotation a2: found `Grab`, expected a primitive of the rules"),
        (good.replace("ANNOTATION_REF=\"a1\"", "ANNOTATION_REF=\"a3\""), "refers to others more than 16 deep"),
        (good.replace("ANNOTATION_REF=\"a1\"", "ANNOTATION_REF=\"a9\""), "refers to `a9`, which does not exist"),
        (good.replace("Tasks_Right", "what"), "the tiers `gesture` and `what` name no track"),
        (good.replace("\"2350\"", "\"1000\""), "ends before it starts, at 1000 ms after 2100 ms"),
    ] {
        write(text);
        let refused = teachtree_in(folder.path(), &[&["score", "set#0"], &args[..]].concat());
        assert_eq!(refused.status.code(), Some(2), "{message}");
        assert!(complained(&refused).contains(message), "{}", complained(&refused));
    }
}

#[test]
fn fit_learns_from_a_file_of_elan_and_from_annotations() {
    let folder = with_set();
    run(folder.path(), &["annotate", "set", "-o", "copy", "--binding", "b.yaml", "--prelabels", "-q"]);
    run(folder.path(), &["analyze", "set#*", "--binding", "b.yaml", "--format", "eaf", "--out-dir", "elan", "-q"]);
    for labels in ["copy", "elan"] {
        let args = ["fit", "set#*", "--binding", "b.yaml", "--labels", labels, "--format", "json", "-q"];
        let output = teachtree_in(folder.path(), &args);
        // The rules as they are give these labels: there is nothing to gain.
        assert_eq!(output.status.code(), Some(1), "{}", all_said(&output));
        let document: Value = serde_json::from_str(&String::from_utf8_lossy(&output.stdout)).unwrap();
        assert_eq!(document["before"]["accuracy"], 1.0, "{document:#}");
    }
}

/// The reader of others, where it is installed: the same annotations with the same times.
#[test]
fn pympi_reads_the_file_of_elan() {
    let folder = tempfile::tempdir().unwrap();
    let python = std::env::var("TEACHTREE_PYTHON").unwrap_or_else(|_| "python3".into());
    let pympi = |args: &[&str]| std::process::Command::new(&python).args(args).current_dir(folder.path()).output();
    if !pympi(&["-c", "import pympi"]).is_ok_and(|output| output.status.success()) {
        let _ = writeln!(std::io::stderr(), "skipped: Python with `pympi-ling` is not installed");
        return;
    }
    let (log, binding) = (demo("handover_panda_panda_demo_5.csv"), demo("handover.binding.yaml"));
    let analyze = ["analyze", &log, "--binding", &binding, "--format"];
    run(folder.path(), &[&analyze[..], &["eaf", "-o", "a.eaf"]].concat());
    let document: Value = serde_json::from_str(&run(folder.path(), &[&analyze[..], &["json"]].concat())).unwrap();
    let script = "import json, pympi
file = pympi.Elan.Eaf('a.eaf')
print(json.dumps({tier: sorted(annotation[:3] for annotation in file.get_annotation_data_for_tier(tier)) for tier in file.get_tier_names()}))
file.to_file('b.eaf')";
    let output = pympi(&["-c", script]).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let tiers: Value = serde_json::from_slice(&output.stdout).unwrap();
    let start = document["log"]["start_s"].as_f64().unwrap();
    for track in document["tracks"].as_array().unwrap() {
        for (kind, part, name) in [("primitive", "relabeled", "primitive"), ("task", "tasks", "task")] {
            let tier = tiers[format!("{} {kind}", track["track"].as_str().unwrap())].as_array().unwrap();
            let spans = track[part].as_array().unwrap();
            assert_eq!(tier.len(), spans.len());
            for (annotation, span) in tier.iter().zip(spans) {
                assert_eq!(annotation[2], span[name]);
                for (at, key) in [(0, "start_s"), (1, "end_s")] {
                    let late_ms = (span[key].as_f64().unwrap() - start) * 1000.0 - annotation[at].as_f64().unwrap();
                    assert!(late_ms.abs() < 0.501, "{annotation} {span}");
                }
            }
        }
    }
    assert_eq!(tiers["left primitive object"][0][2], "hammer");
    // And what pympi writes is read back.
    let scored = score(folder.path(), &[&log], &["--binding", &binding, "--labels", "b.eaf"]);
    assert_eq!(shares(&scored).0, 1.0);
}
