//! `explain`: what a user reads.

use crate::program::{self, complained, teachtree};
use serde_json::Value;
use std::path::Path;
use std::process::Output;

fn explain(args: &[&str]) -> Output {
    let log = "demos/robosuite/SawyerLift_demo_1.csv";
    teachtree(&[&["explain", log, "--binding", "demos/robosuite/sawyer_lift.binding.yaml"], args].concat())
}

fn said(args: &[&str]) -> String {
    let output = explain(args);
    assert!(output.status.success(), "{}", complained(&output));
    program::said(&output)
}

#[test]
fn a_frame_is_explained_from_the_root_to_the_task() {
    insta::assert_snapshot!(said(&["--at", "10.92s", "--rules", "contact.rules"]));
}

#[test]
fn full_also_prints_what_refused_choices_read() {
    let short = said(&["--at", "10.92s", "--rules", "contact.rules"]);
    let full = said(&["--at", "10.92s", "--rules", "contact.rules", "--full"]);
    for line in ["holds_now = fingers.contact[thumb]", "    leaving not set so far", "    no  slide: "] {
        assert!(full.contains(line) && !short.contains(line), "{line}\n{full}");
    }
}

#[test]
fn why_not_says_what_was_missing_where_it_was_nearest() {
    let text = said(&["--at", "10.9s..11.1s", "--why-not", "Place"]);
    let printed = &text[text.find("  not Place").unwrap()..];
    insta::assert_snapshot!(printed[..printed.find("\nright at").map_or(printed.len(), |end| end + 1)]);
}

/// A Pass is made by relabeling: no leaf of the tree gives it.
#[test]
fn why_not_names_the_labels_that_relabeling_rewrites() {
    let log = ["examples/hand_over/hand_over_1.csv", "--binding", "examples/hand_over/hand_over.binding.yaml"];
    let asked = |track: &str, primitive: &str| {
        let question = ["--at", "3s", "--track", track, "--why-not", primitive];
        teachtree(&[&["explain"], &log[..], &question[..]].concat())
    };
    let made = "relabeling makes it of `MainGrasp` or `EqualGrasp`: ask";
    for (track, primitive, help) in [
        ("both", "Pass", &*format!("{made} `--why-not MainGrasp`")),
        ("right", "Pass", &*format!("{made} `--track both --why-not MainGrasp`")),
        ("right", "EqualGrasp", "ask `--track both`"),
        ("both", "Follow", "ask `--track left` or `--track right`"),
    ] {
        let refused = asked(track, primitive);
        assert_eq!(refused.status.code(), Some(2));
        let help = format!("no leaf of the tree over `{track}` gives `{primitive}`\n  help: {help}");
        assert!(complained(&refused).contains(&help), "{}", complained(&refused));
    }
    let answered = asked("both", "MainGrasp");
    assert!(program::said(&answered).contains("  not MainGrasp"), "{}", complained(&answered));
    let inspected = program::said(&teachtree(&[&["inspect"], &log[..]].concat()));
    // The rules that make an EqualGrasp or a Follow need one.
    for track in ["left ", "right", "both "] {
        let line = inspected.lines().find(|line| line.contains(&format!("{track}  can be detected: "))).unwrap();
        let made: Vec<&str> = line.split(", ").filter(|name| name.ends_with(" (by relabeling)")).collect();
        assert_eq!(made, ["Pass (by relabeling)"], "{line}");
    }
}

/// What holds within a window is explained where it holds.
#[test]
fn a_slip_is_explained_by_its_way_and_its_limit() {
    let log = "examples/contact_flags/box.csv";
    let args = ["explain", log, "--binding", "examples/contact_flags/box.binding.yaml", "--at", "2.15s"];
    let text = program::said(&teachtree(&args));
    assert!(text.contains(": Slip box"), "{text}");
    assert!(text.contains("yes drift > slip_way: ") && text.contains(" mm > 3 mm"), "{text}");
}

#[test]
fn an_interval_is_explained_wherever_the_choices_change() {
    let text = said(&["--at", "10.9s..11.1s"]);
    let heads: Vec<&str> = text.lines().filter(|line| line.starts_with("right at")).collect();
    assert!(heads.len() >= 2, "{heads:?}");
    assert!(heads[0].contains(": Turn cube (from 10.874 s)"), "{heads:?}");
    assert!(heads.iter().any(|head| head.contains(": Translate cube (from ")), "{heads:?}");
}

#[test]
fn programs_read_values_and_margins() {
    let document: Value = serde_json::from_str(&said(&["--at", "10.92s", "--format", "json"])).unwrap();
    assert_eq!(document["schema"], "teachtree.explain/1");
    let one = &document["explanations"][0];
    assert_eq!((one["leaf"].as_str(), one["track"].as_str()), (Some("Turn"), Some("right")));
    let path = one["path"].as_array().unwrap();
    let taken = path.iter().find(|step| step["taken"] == true).unwrap();
    assert_eq!(taken["choice"], "turning and (supported or walled) => Turn");
    let turning = &taken["reason"]["because"][0]["because"][0]["fact"];
    let number = |key: &str| turning[key].as_f64().unwrap();
    assert!((number("margin") - (number("value") - number("off"))).abs() < 1e-6, "{turning}");
    assert_eq!(turning["unit"], "rad/s");
}

#[test]
fn questions_that_nothing_answers_are_bad_input() {
    for (args, wanted) in [
        (&["--at", "3s"][..], "the recording goes from 7.904 s to 11.684 s"),
        (&["--at", "9s", "--why-not", "Dance"], "the rules have no primitive `Dance`\n  help: they have "),
        (&["--at", "9s", "--why-not", "Insrt"], "the rules have no primitive `Insrt`\n  help: did you mean `Insert`?"),
        (&["--at", "9s", "--track", "left"], "there is no tree that labels `left`"),
        (&["--at", "9 N"], "expected a time"),
        (&["--at", "9s..8s"], "ends before it begins"),
    ] {
        let output = explain(args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        let printed = String::from_utf8(output.stderr).unwrap();
        assert!(printed.contains(wanted), "{args:?}: {printed}");
    }
}

/// Nine bodies touch the cube: eight of them fail both conditions, the last one fails only one.
#[test]
fn the_slot_with_the_fewest_failing_conditions_is_the_evidence() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).display().to_string();
    let walls: Vec<String> = (1..=9).map(|at| format!("wall{at}")).collect();
    let mut header = "time,right.thumb.position.x,right.thumb.position.y,right.thumb.position.z,right.thumb.contact,cube.position.x,cube.position.y,cube.position.z".to_string();
    let mut forces = String::new();
    for wall in &walls {
        for axis in ["x", "y", "z"] {
            header += &format!(",contact.cube.{wall}.force.{axis}");
            forces += if wall == "wall9" && axis == "z" { ",2" } else { ",0.2" };
        }
    }
    let rows: Vec<String> = (0..40).map(|at| format!("{},0,0,0,1,0,0,0{forces}", f64::from(at) * 0.02)).collect();
    std::fs::write(file("log.csv"), format!("{header}\n{}\n", rows.join("\n"))).unwrap();
    let bodies: String =
        walls.iter().map(|wall| format!("  {wall}: {{role: support, position: [0 m, 0 m, 0 m]}}\n")).collect();
    let scene =
        format!("bodies:\n  cube: {{role: object, mass: 50 g}}\n{bodies}hands:\n  right: {{fingers: [thumb]}}\n");
    std::fs::write(file("scene.yaml"), scene).unwrap();
    let rules = "use \"stream.rules\"
primitive Pressed does press, Free does free
tree single for each hand {
  any(contacts.force.x > 1 N and contacts.force.z > 1 N) => Pressed
  else => Free
}
";
    std::fs::write(file("walls.rules"), rules).unwrap();
    let [log, scene, rules] = ["log.csv", "scene.yaml", "walls.rules"].map(file);
    let output = teachtree(&["explain", &log, "--scene", &scene, "--rules", &rules, "--at", "0.4s"]);
    assert!(output.status.success(), "{}", complained(&output));
    let text = program::said(&output);
    assert!(text.contains(" wall9: ") && !text.contains(" wall1: "), "{text}");
}

/// A gripper that comes within 135 mm of a cube at 4 s, and closes there.
fn far_gripper(folder: &std::path::Path) {
    let mut log = String::from("time,x,y,z,w,cx,cy,cz\n");
    for row in 0..400_u32 {
        let time = f64::from(row) * 0.02;
        let height = 0.17 + 0.05 * (time - 4.0).abs();
        log += &format!("{time},1,0,{height},{},1,0,0\n", u8::from((4.0..6.0).contains(&time)));
    }
    std::fs::write(folder.join("log.csv"), log).unwrap();
    let binding =
        "channels: {right.tcp.position: [x, y, z], right.gripper.closed: w > 0.5, cube.position: [cx, cy, cz]}
scene: {bodies: {cube: {role: object, radius: 35 mm}}}
";
    std::fs::write(folder.join("b.yaml"), binding).unwrap();
}

/// A condition that nearly held is nearer than one that no motion changes, such as whether the log has distances.
#[test]
fn why_not_prefers_what_nearly_held_to_what_never_changes() {
    let folder = tempfile::tempdir().unwrap();
    far_gripper(folder.path());
    let args = ["explain", "log.csv", "--binding", "b.yaml", "--at", "0s..3.98s", "--why-not", "Approach"];
    let output = program::teachtree_in(folder.path(), &args);
    assert!(output.status.success(), "{}", complained(&output));
    let text = program::said(&output);
    let nearest = &text[text.find("  not Approach").unwrap()..];
    // Of the frames on which it is too far, the last one is the nearest.
    assert!(nearest.starts_with("  not Approach; nearest at 3.960 s to "), "{nearest}");
    assert!(
        nearest.contains("near") && nearest.contains("13") && nearest.contains(" mm, expected below 50 mm, 8"),
        "{nearest}"
    );
    assert!(!nearest.contains("distance_known"), "{nearest}");
}

/// A gripper that takes a box at 2 s and lifts it at 3 s; its log has a flag and no opening. Its first stamp is `from_s`.
fn gripper_log(folder: &Path, from_s: f64) -> Vec<String> {
    let mut text = String::from("time,x,z,closed\n");
    for row in 0..400 {
        let time_s = f64::from(row) * 0.02;
        let height = 0.02 + 0.1 * (time_s - 3.0).clamp(0.0, 1.0);
        text.push_str(&format!("{:.2},0.3,{height:.4},{}\n", from_s + time_s, u8::from(time_s >= 2.0)));
    }
    let channels = "channels:\n  right.tcp.position: [\"x [m]\", \"= 0 m\", \"z [m]\"]\n  right.gripper.closed: closed\n  box.position: [\"x [m]\", \"= 0 m\", \"z [m]\"]\n";
    let (log, binding) = (folder.join("log.csv"), folder.join("b.yaml"));
    std::fs::write(&log, text).unwrap();
    std::fs::write(&binding, format!("{channels}scene: {{bodies: {{box: {{role: object, radius: 30 mm}}}}}}\n"))
        .unwrap();
    [log, "--binding".into(), binding].map(|path| path.display().to_string()).into()
}

#[test]
fn a_value_that_the_log_does_not_contain_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let log = gripper_log(folder.path(), 0.0);
    let log: Vec<&str> = log.iter().map(String::as_str).collect();
    let printed = program::said(&teachtree(&[&["explain"], &log[..], &["--at", "2.5s", "--full"]].concat()));
    let wanted = "gripper.opening > shut: 1 m > 0.002 m, 0.998 m to spare; `gripper.opening` has its default in the whole log, as if not logged";
    assert!(printed.contains(wanted), "{printed}");
    let of_flag = printed.lines().filter(|line| line.contains("gripper.closed") && line.contains("default"));
    assert_eq!(of_flag.count(), 0, "{printed}");
}

#[test]
fn times_count_from_the_first_row_of_a_log_with_a_date() {
    let folder = tempfile::tempdir().unwrap();
    let log = gripper_log(folder.path(), 1.7e9);
    let log: Vec<&str> = log.iter().map(String::as_str).collect();
    let [since_start, since_1970] = ["2.5s", "1700000002.5s"].map(|at| {
        let output = teachtree(&[&["explain"], &log[..], &["--at", at]].concat());
        assert!(output.status.success(), "{}", complained(&output));
        program::said(&output)
    });
    assert!(since_start.starts_with("right at 2.500 s, frame 125: Grasp box"), "{since_start}");
    assert_eq!(since_start, since_1970);
    let analyzed = program::said(&teachtree(&[&["analyze"], &log[..]].concat()));
    assert!(analyzed.contains("400 frames at 50 Hz, from 2023-11-14 22:13:20\n"), "{analyzed}");
    assert!(!analyzed.contains("1700000"), "{analyzed}");
    let document = program::said(&teachtree(&[&["analyze", "--format", "json"], &log[..]].concat()));
    let document: Value = serde_json::from_str(&document).unwrap();
    let of_log = |key: &str| document["log"][key].as_f64().unwrap();
    assert_eq!((of_log("zero_stamp_s"), of_log("start_s")), (1.7e9, 0.0));
}

/// A gripper that holds 10 mm, but 30 mm at 0.5 s and at 0.72 s. No finger touches.
#[test]
fn what_interrupts_a_condition_is_named_with_its_value() {
    let folder = tempfile::tempdir().unwrap();
    let mut log = String::from(
        "time,right.thumb.position.x,right.thumb.position.y,right.thumb.position.z,right.gripper.opening,right.thumb.contact,\
         box.position.x,box.position.y,box.position.z\n",
    );
    for row in 0..100 {
        let opening = if [25, 36].contains(&row) { 0.03 } else { 0.01 };
        log += &format!("{:.2},0,0,0,{opening},0,0,0,0\n", f64::from(row) * 0.02);
    }
    let rules = "use \"stream.rules\"
stream { for each hand { gripper.opening : scalar m } }
primitive Hold does close, Rest does free
for each hand { signal narrow = gripper.opening < 20 mm }
tree single for each hand {
  (narrow and gripper.opening > 5 mm) lasting 300 ms and count(fingers.contact) >= 1  => Hold
  else                                                                               => Rest
}
";
    let scene = "bodies: {box: {role: object, radius: 30 mm}}\nhands: {right: {fingers: [thumb]}}\n";
    for (name, text) in [("log.csv", log.as_str()), ("grip.rules", rules), ("log.scene.yaml", scene)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let args = ["explain", "log.csv", "--rules", "grip.rules", "--at", "0.56s", "--why-not", "Hold"];
    let output = program::teachtree_in(folder.path(), &args);
    assert!(output.status.success(), "{}", complained(&output));
    let text = program::said(&output);
    let not_hold = &text[text.find("  not Hold").unwrap()..];
    assert!(not_hold.contains("no  narrow and gripper.opening > 5 mm at 0.500 s"), "{text}");
    assert!(not_hold.contains("gripper.opening < 20 mm: 30 mm, expected < 20 mm, 10 mm short"), "{text}");
    // A count that is too small shows what is counted.
    assert!(not_hold.contains("thumb: fingers.contact"), "{text}");
}
