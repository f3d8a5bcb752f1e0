//! A gripper of which only the opening and one point are known, as a new user meets it: the binding that is proposed, and what can be found.

use crate::program::{all_said, complained, said, teachtree_in};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use teachtree::Log;

/// Takes a box from a table and puts it down elsewhere: opening in mm, the tool point in mm, the box in mm, at 30 Hz.
fn arm() -> String {
    let mut text = String::from("time,gripper_width_mm,tcp_x_mm,tcp_y_mm,tcp_z_mm,box_x_mm,box_y_mm,box_z_mm\n");
    for row in 0..300_u32 {
        let t = f64::from(row) / 30.0;
        let between = |from: f64, to: f64| ((t - from) / (to - from)).clamp(0.0, 1.0);
        let width = 80.0 - 40.0 * between(2.5, 2.8) + 40.0 * between(7.5, 7.8);
        let height = 20.0 + 180.0 * (1.0 - between(1.0, 2.2)) + 100.0 * (between(3.2, 4.2) - between(6.0, 7.0));
        let height = height + 180.0 * between(8.2, 9.2);
        let (x, lifted) = (200.0 + 150.0 * between(4.2, 6.0), 100.0 * (between(3.2, 4.2) - between(6.0, 7.0)));
        let _ = writeln!(text, "{t:.4},{width:.3},{x:.3},0,{height:.3},{x:.3},0,{:.3}", 20.0 + lifted);
    }
    text
}

/// A binding of it with the tool point as one finger.
fn binding(finger: &str) -> String {
    format!(
        "hand_file: hand_gripper.rules\nchannels:\n  right.{finger}.position: tcp_<xyz>_mm [mm]\n  right.gripper.opening: gripper_width_mm [mm]\n  \
         right.gripper.closed: gripper_width_mm [mm] < 60 mm\n  box.position: box_<xyz>_mm [mm]\nscene:\n  bodies:\n    \
         box: {{role: object, parts: [{{box: [40 mm, 40 mm, 40 mm]}}]}}\n    \
         table: {{role: support, position: [200 mm, 0 mm, -10 mm], parts: [{{box: [1 m, 1 m, 20 mm]}}]}}\n  \
         hands: {{right: {{fingers: [{finger}]}}}}\n"
    )
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("arm.csv"), arm()).unwrap();
    folder
}

/// The binding that `init` writes for a log, with its scene in `out/scene.yaml`.
fn proposed(folder: &Path, log: &str) -> Option<String> {
    let out = folder.join("out");
    let _ = std::fs::remove_dir_all(&out);
    teachtree_in(folder, &["init", log, "-o", "out", "--yes"]);
    let named = |ending: &str| {
        std::fs::read_dir(&out)
            .ok()?
            .flatten()
            .map(|entry| entry.path())
            .find(|path| path.to_string_lossy().ends_with(ending))
    };
    std::fs::rename(named(".scene.yaml")?, out.join("scene.yaml")).unwrap();
    Some(std::fs::read_to_string(named(".binding.yaml")?).unwrap())
}

/// All files and folders below that may be logs.
fn below(folder: &Path) -> Vec<PathBuf> {
    let mut found = vec![];
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(below(&path));
        }
        found.push(path);
    }
    found
}

/// A proposed binding is read as it stands, and each alternative too.
#[test]
fn each_line_of_a_proposed_binding_is_read() {
    let folder = folder();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut logs = vec![folder.path().join("arm.csv")];
    for part in ["demos", "tests/fixtures/formats"] {
        logs.extend(below(&root.join(part)));
    }
    let (mut tried, mut thresholds) = (0, 0);
    for log in logs {
        let Some(text) = proposed(folder.path(), log.to_str().unwrap()) else { continue };
        // A binding of the recordings in a folder has the name of one of them.
        let name = format!("{}.binding.yaml", log.file_stem().unwrap().display());
        let is_of_another = log.is_dir() && !folder.path().join("out").join(name).exists();
        // Columns without names suggest nothing; their places are to be filled in.
        if is_of_another || text.contains("\nchannels: {}") || text.contains("\"???\"") {
            continue;
        }
        tried += text.lines().filter(|line| line.starts_with("  ") && !line.trim_start().starts_with('#')).count();
        let alternatives: Vec<&str> =
            text.lines().filter(|line| line.contains("gripper.closed") && line.trim_start().starts_with('#')).collect();
        thresholds += alternatives.len();
        let mut bindings = vec![text.clone()];
        for line in alternatives {
            let channel = line.trim_start_matches([' ', '#']).split(": ").next().unwrap();
            let other: Vec<&str> = text.lines().filter(|own| !own.starts_with(&format!("  {channel}: "))).collect();
            bindings.push(other.join("\n").replacen(line, &line.replacen("# ", "", 1), 1));
        }
        let first = if log.join("meta").is_dir() { PathBuf::from(format!("{}#0", log.display())) } else { log.clone() };
        for bound in bindings {
            let path = folder.path().join("bound.yaml");
            std::fs::write(&path, &bound).unwrap();
            let open = |log: &Path| Log::options().binding(&path).scene(folder.path().join("out/scene.yaml")).open(log);
            let mut opened = open(&first);
            // Of a file with several recordings the message names one.
            if let Err(error) = &opened
                && let Some((_, rest)) = error.to_string().split_once("after `#`, such as `")
            {
                opened = open(Path::new(rest.split_once('`').unwrap().0));
            }
            // A fixture of a few rows, a second apart, is not a recording.
            let is_slow = opened.as_ref().is_err_and(|error| error.to_string().contains("one row every 1 s"));
            assert!(opened.is_ok() || is_slow, "{}: {}\n{bound}", log.display(), opened.unwrap_err());
        }
    }
    assert!(tried > 100 && thresholds > 5, "{tried} lines, {thresholds} with another end");
}

#[test]
fn a_finger_without_a_position_is_named_with_the_fix() {
    let folder = folder();
    std::fs::write(folder.path().join("b.yaml"), binding("thumb").replace("[thumb]", "[thumb, index]")).unwrap();
    let refused = teachtree_in(folder.path(), &["analyze", "arm.csv", "--binding", "b.yaml"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(complained(&refused).contains("`fingers: [thumb]`"), "{}", complained(&refused));
}

/// No rule finds the carry of a hand without fingertips, unless the box is known to leave its table; as a thumb the point shows it.
#[test]
fn a_tool_point_as_palm_is_promised_no_carry_and_the_lack_is_reported() {
    let folder = folder();
    let without_table = |finger: &str| {
        binding(finger)
            .lines()
            .filter(|line| !line.contains("table:"))
            .map(|line| format!("{line}\n"))
            .collect::<String>()
    };
    for (finger, binding, has_carry) in [
        ("palm", without_table("palm"), false),
        ("palm", binding("palm"), true),
        ("thumb", without_table("thumb"), true),
        ("thumb", binding("thumb"), true),
    ] {
        std::fs::write(folder.path().join("b.yaml"), binding).unwrap();
        let json = |command: &str| -> Value {
            let args = [command, "arm.csv", "--binding", "b.yaml", "--format", "json"];
            let output = teachtree_in(folder.path(), &args);
            assert!(output.status.success(), "{}", all_said(&output));
            serde_json::from_str(&said(&output)).unwrap()
        };
        let promised = json("inspect")["recognition"]["tracks"][0]["can"].to_string();
        let analysis = json("analyze");
        let found = analysis["tracks"].to_string().contains("\"Translate\"");
        assert_eq!([promised.contains("\"Translate\""), found], [has_carry; 2], "{finger}: {promised}");
        let lacks = analysis["issues"].as_array().unwrap().iter().any(|issue| {
            let message = issue["message"].as_str().unwrap();
            message.starts_with("Translate")
                && message.contains("cannot be detected")
                && message.contains("the hand has a palm and no fingertips")
        });
        assert_eq!(lacks, !has_carry, "{finger}: {}", analysis["issues"]);
    }
}

/// The scene has shapes, the log no pose of the box: it moves with the gripper, and the table does not bear it for ever.
#[test]
fn a_carry_is_found_without_a_pose_of_the_object() {
    let folder = folder();
    let without_pose: String = binding("thumb")
        .lines()
        .filter(|line| !line.contains("box.position"))
        .map(|line| format!("{line}\n"))
        .collect();
    std::fs::write(folder.path().join("b.yaml"), without_pose).unwrap();
    let args = ["analyze", "arm.csv", "--binding", "b.yaml", "--format", "json"];
    let analysis: Value = serde_json::from_str(&said(&teachtree_in(folder.path(), &args))).unwrap();
    let track = &analysis["tracks"][0];
    let primitives: Vec<&str> =
        track["relabeled"].as_array().unwrap().iter().map(|it| it["primitive"].as_str().unwrap()).collect();
    assert_eq!(primitives, ["Approach", "Grasp", "Translate", "Release", "Move"]);
    assert_eq!(track["tasks"][0]["task"], "pick_and_place", "{track}");
    let issues = analysis["issues"].to_string();
    assert!(!issues.contains("implausible"), "{issues}");
    // The rotations count after the positions.
    assert!(issues.contains("Slip, Topple cannot be detected: no position of `box` is bound"), "{issues}");
}

/// Without poses of the object and without a position of the hand nothing shows whether a grasp failed.
#[test]
fn an_audit_leaves_out_failed_grasps_where_no_carry_can_be_detected() {
    let folder = folder();
    std::fs::copy(folder.path().join("arm.csv"), folder.path().join("again.csv")).unwrap();
    let opening_only = "hand_file: hand_gripper.rules\nchannels: {right.gripper.closed: 'gripper_width_mm [mm] < 60 mm'}\nscene:\n  \
                        bodies: {box: {role: object, radius: 20 mm}}\n  hands: {right: {fingers: [thumb]}}\n";
    std::fs::write(folder.path().join("b.yaml"), opening_only).unwrap();
    let audit = ["audit", "arm.csv", "again.csv", "--binding", "b.yaml"];
    let output = teachtree_in(folder.path(), &audit);
    assert_eq!(
        said(&output).matches("not checked: failed grasps in 2 of 2 recordings").count(),
        1,
        "{}",
        all_said(&output)
    );
    assert!(!said(&output).contains("failed grasp:"), "{}", said(&output));
    let output = teachtree_in(folder.path(), &[&audit[..], &["--format", "json"]].concat());
    let document: Value = serde_json::from_str(&said(&output)).unwrap();
    assert_eq!(document["counts"]["failed_grasp"], 0);
    assert_eq!(document["unchecked"].as_array().unwrap().len(), 1);
    // With poses of the box a grasp that moved it is judged.
    std::fs::write(folder.path().join("b.yaml"), binding("thumb")).unwrap();
    let output = teachtree_in(folder.path(), &audit);
    assert!(!said(&output).contains("not checked"), "{}", said(&output));
}

/// Segments of a log that `analyze` finds, and those that `live` reports as final.
fn segments(folder: &Path, log: &str, more: &[&str]) -> [Vec<String>; 2] {
    let run = |command: &[&str]| {
        let output = teachtree_in(folder, &[command, more, &["--format", "json"]].concat());
        assert!(output.status.success(), "{}", complained(&output));
        said(&output)
    };
    let span = |of: &Value| {
        let time = |key: &str| of[key].as_f64().unwrap();
        format!("{} {:.3} – {:.3} s", of["primitive"].as_str().unwrap(), time("start_s"), time("end_s"))
    };
    let analysis: Value = serde_json::from_str(&run(&["analyze", log])).unwrap();
    let whole = analysis["tracks"][0]["relabeled"].as_array().unwrap().iter().map(span).collect();
    let events = run(&["live", log, "--no-labels"]);
    let events = events.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let is_final = |event: &Value| event["event"] == "segment" && event["final"] == true;
    [whole, events.filter(is_final).map(|event| span(&event)).collect()]
}

/// One cell of the opening is 5 m off while the box is carried. The opening is bound twice, as a number and as a flag by a threshold.
#[test]
fn one_wrong_cell_of_the_opening_changes_no_segment() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    let spoil = |(row, line): (usize, &str)| match line.split_once(",40.000,") {
        Some((time, rest)) if row == 151 => format!("{time},5040.000,{rest}\n"),
        _ => format!("{line}\n"),
    };
    let spoiled: String = arm().lines().enumerate().map(spoil).collect();
    assert_ne!(spoiled, arm());
    std::fs::write(path("spoiled.csv"), spoiled).unwrap();
    for resample in ["", "resample: 60 Hz\n"] {
        std::fs::write(path("arm.yaml"), format!("{resample}{}", binding("thumb"))).unwrap();
        let bound = ["--binding", "arm.yaml"];
        let wanted = segments(folder.path(), "arm.csv", &bound);
        assert!(wanted.iter().all(|segments| segments.len() == 7), "{wanted:?}");
        assert_eq!(segments(folder.path(), "spoiled.csv", &bound), wanted, "{resample}");
        for command in ["analyze", "live"] {
            let output = all_said(&teachtree_in(folder.path(), &[command, "spoiled.csv", "--binding", "arm.yaml"]));
            let named = "impossible_jump right.gripper.closed";
            assert_eq!(output.matches(named).count(), 1, "{command}: {output}");
        }
    }
}

/// The gripper sends a line of its own for each stamp. The two lines of a stamp form one row, also where lines are taken one by one.
#[test]
fn lines_with_one_stamp_about_different_columns_form_one_row() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("arm.yaml"), binding("thumb")).unwrap();
    let text = arm();
    let (titles, rows) = text.split_once('\n').unwrap();
    let (mut cells, mut objects) = (format!("{titles}\n"), String::new());
    let scene = json!({"scene": {
        "bodies": {
            "box": {"role": "object", "parts": [{"box": ["40 mm", "40 mm", "40 mm"]}]},
            "table": {"role": "support", "position": ["200 mm", "0 mm", "-10 mm"], "parts": [{"box": ["1 m", "1 m", "20 mm"]}]}
        },
        "hands": {"right": {"fingers": ["thumb"]}}
    }});
    let (mut whole, mut split) = (format!("{scene}\n"), format!("{scene}\n"));
    for row in rows.lines() {
        let fields: Vec<&str> = row.split(',').collect();
        let [time, width, point @ ..] = &fields[..] else { panic!("{row}") };
        let _ = writeln!(cells, "{time},{width},,,,,,\n{time},,{}", point.join(","));
        // The numbers of the lines differ; they are not bound.
        let columns = titles.split(',').skip(2);
        let named: Vec<String> = columns.zip(point).map(|(title, cell)| format!("\"{title}\":{cell}")).collect();
        let _ = writeln!(objects, "{{\"time\":{time},\"gripper_width_mm\":{width},\"line\":1}}");
        let _ = writeln!(objects, "{{\"time\":{time},\"line\":2,{}}}", named.join(","));
        let meters = |cell: &&str| cell.parse::<f64>().unwrap() / 1e3;
        let (opening, point) = (meters(width), point.iter().map(meters).collect::<Vec<_>>());
        let of_gripper = format!("\"right.gripper.opening\":{opening},\"right.gripper.closed\":{}", opening < 0.06);
        let of_arm = format!("\"right.thumb.position\":{:?},\"box.position\":{:?}", &point[..3], &point[3..]);
        let _ = writeln!(whole, "{{\"time\":{time},{of_gripper},{of_arm}}}");
        let _ = writeln!(split, "{{\"time\":{time},{of_arm}}}\n{{\"time\":{time},{of_gripper}}}");
    }
    for (name, text) in
        [("cells.csv", cells), ("objects.jsonl", objects), ("whole.jsonl", whole), ("split.jsonl", split)]
    {
        std::fs::write(path(name), text).unwrap();
    }
    let (bound, own) = (["--binding", "arm.yaml"], ["--hand", "hand_gripper.rules"]);
    for (log, of, more) in
        [("cells.csv", "arm.csv", &bound), ("objects.jsonl", "arm.csv", &bound), ("split.jsonl", "whole.jsonl", &own)]
    {
        let wanted = segments(folder.path(), of, more);
        assert!(wanted.iter().all(|segments| segments.len() == 7), "{wanted:?}");
        assert_eq!(segments(folder.path(), log, more), wanted, "{log}");
        for command in ["analyze", "live"] {
            let output = all_said(&teachtree_in(folder.path(), &[&[command, log], &more[..]].concat()));
            assert!(!output.contains("duplicate_stamp") && !output.contains("not_a_number"), "{command}: {output}");
        }
    }
}

/// A line that repeats the stamp and the values of another one is left out and reported, in order.
#[test]
fn a_line_that_repeats_another_one_is_reported() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("arm.yaml"), binding("thumb")).unwrap();
    let text = arm();
    let lines: Vec<&str> = text.lines().collect();
    // After the calibration, which takes 3 s.
    let again = [&lines[..=200], &lines[200..]].concat().join("\n");
    std::fs::write(path("again.csv"), again).unwrap();
    let bound = ["--binding", "arm.yaml"];
    assert_eq!(segments(folder.path(), "again.csv", &bound), segments(folder.path(), "arm.csv", &bound));
    for command in ["analyze", "live"] {
        let output = all_said(&teachtree_in(folder.path(), &[&[command, "again.csv"], &bound[..]].concat()));
        assert_eq!(output.matches("duplicate_stamp").count(), 1, "{command}: {output}");
    }
}

/// A gripper with contacts at its tool point only cannot be mapped to jaws; with the advised pads it can.
#[test]
fn jaws_need_pads() {
    let folder = tempfile::tempdir().unwrap();
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/plug_into_socket");
    std::fs::copy(example.join("plug_1.csv"), folder.path().join("plug.csv")).unwrap();
    let binding = std::fs::read_to_string(example.join("plug.binding.yaml")).unwrap();
    let retarget = |binding: &str| {
        std::fs::write(folder.path().join("b.yaml"), binding).unwrap();
        let robot = ["--robot", "two_grippers", "-o", "commands.json"];
        teachtree_in(folder.path(), &[&["retarget", "plug.csv", "--binding", "b.yaml"], &robot[..]].concat())
    };
    let without = retarget(&binding);
    let printed = said(&without);
    assert!(printed.contains("only one side touches it here"), "{}", all_said(&without));
    let pads = "pads: {of: tcp, opening: gripper, axis: y}";
    assert!(printed.contains(&format!("help: only the tool point touches the object; bind `{pads}`")), "{printed}");
    let with = retarget(&binding.replacen("scene:", &format!("{pads}\nscene:"), 1));
    assert!(with.status.success() && !said(&with).contains("help: "), "{}", all_said(&with));
}
