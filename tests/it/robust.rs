//! Recordings as other laboratories make them: noise of trackers, contacts that flicker, stamps that count from 1970.

use crate::program::{all_said, said, teachtree_in};
use serde_json::Value;
use std::fmt::Write as _;

/// A pseudo-random number from -1 to 1, always the same for a row and a column.
fn scatter(row: u32, column: u32) -> f64 {
    let mixed = (row.wrapping_mul(2_654_435_761) ^ column.wrapping_mul(40_503)).wrapping_mul(0x9E37_79B9);
    let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x85EB_CA6B);
    f64::from((mixed ^ (mixed >> 13)) & 0xFFFF) / 32_767.5 - 1.0
}

/// Two fingers at 50 Hz close on a box at 2.5 s, lift it at 4 s, and let it go at 8 s where it stood; `noise` of its position in mm, all flags of the
/// fingers lost in `lost`, the stamps counted from `first`.
fn log(noise: f64, lost: impl Fn(f64) -> bool, first: f64) -> String {
    let mut text = String::from("t,x,z,bx,by,bz,flag,table\n");
    for row in 0..500_u32 {
        let t = f64::from(row) / 50.0;
        let between = |from: f64, to: f64| ((t - from) / (to - from)).clamp(0.0, 1.0);
        let lifted = 100.0 * (between(4.0, 5.0) - between(6.0, 7.0));
        let height = 20.0 + 180.0 * (1.0 - between(1.0, 2.2) + between(8.2, 9.2)) + lifted;
        let [bx, by, bz] = [0, 1, 2].map(|column| noise * 1.73 * scatter(row, column));
        let (flag, table) = ((2.5..8.0).contains(&t) && !lost(t), lifted == 0.0);
        let stamp = first + t;
        let _ = writeln!(
            text,
            "{stamp:.3},200,{height:.3},{:.3},{by:.3},{:.3},{},{}",
            200.0 + bx,
            20.0 + lifted + bz,
            u8::from(flag),
            u8::from(table)
        );
    }
    text
}

const BINDING: &str = "
hand_file: hand_flags.rules
time: t [s]
channels:
  right.thumb.position: ['x [mm]', '= -20 mm', 'z [mm]']
  right.index.position: ['x [mm]', '= 20 mm', 'z [mm]']
  right.thumb.contact.box: flag
  right.index.contact.box: flag
  box.position: b<xyz> [mm]
  contact.box.table: table
normals: by_role
scene: {bodies: {box: {role: object, radius: 30 mm}, table: {role: support}}}
";

fn analysis(log: &str, binding: &str) -> Value {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("log.csv"), log).unwrap();
    std::fs::write(folder.path().join("lab.yaml"), binding).unwrap();
    let output = teachtree_in(folder.path(), &["analyze", "log.csv", "--binding", "lab.yaml", "--format", "json"]);
    assert!(output.status.success(), "{}", all_said(&output));
    serde_json::from_str(&said(&output)).unwrap()
}

fn names(analysis: &Value) -> Vec<&str> {
    let segments = analysis["tracks"][0]["relabeled"].as_array().unwrap();
    segments.iter().map(|it| it["primitive"].as_str().unwrap()).collect()
}

fn issues<'a>(analysis: &'a Value, kind: &str) -> Vec<&'a str> {
    let issues = analysis["issues"].as_array().unwrap().iter();
    issues.filter(|it| it["kind"] == kind).map(|it| it["message"].as_str().unwrap()).collect()
}

const PLACED: [&str; 7] = ["Move", "Approach", "Grasp", "Translate", "Place", "Release", "Move"];

#[test]
fn an_object_whose_tracker_is_noisy_does_not_slide_at_rest() {
    let clean = analysis(&log(0.0, |_| false, 0.0), BINDING);
    assert_eq!(names(&clean), PLACED);
    assert!(issues(&clean, "noisy_position").is_empty());
    let noisy = analysis(&log(2.0, |_| false, 0.0), BINDING);
    assert_eq!(names(&noisy), PLACED);
    let said = issues(&noisy, "noisy_position");
    let scatters = |by: &str| said[0].contains(&format!("scatter by {by}"));
    assert!(said.len() == 1 && (scatters("2") || scatters("1.9")), "{said:?}");
}

#[test]
fn a_hold_whose_flags_are_lost_for_a_tenth_of_a_second_goes_on() {
    let lost = |t: f64| t % 1.0 < 0.095;
    let found = analysis(&log(0.0, lost, 0.0), BINDING);
    assert_eq!(names(&found), PLACED);
    // A quarter of a second is a release.
    let found = analysis(&log(0.0, |t| (5.0..5.25).contains(&t), 0.0), BINDING);
    assert!(names(&found).windows(2).any(|pair| pair == ["Translate", "Release"]), "{:?}", names(&found));
}

#[test]
fn a_tare_counts_from_the_first_stamp_where_stamps_count_from_1970() {
    let binding = BINDING.replace(
        "normals:",
        "  right.thumb.force: ['bx [N]', '= 0 N', '= 0 N']\ntare: {channels: [right.thumb.force], from: 0.5 s, to: 1 s}\nnormals:",
    );
    let from_zero =
        analysis(&log(0.0, |_| false, 0.0), &binding.replace("b<xyz> [mm]", "['= 200 mm', 'by [mm]', 'bz [mm]']"));
    let from_1970 =
        analysis(&log(0.0, |_| false, 1.7e9), &binding.replace("b<xyz> [mm]", "['= 200 mm', 'by [mm]', 'bz [mm]']"));
    assert_eq!(names(&from_zero), names(&from_1970));
}

/// A gripper whose box leaves the table carries it from then on, before the gripper has moved for half a second.
#[test]
fn a_gripper_carries_from_when_nothing_bears_the_object() {
    let binding = BINDING.replace("hand_flags", "hand_gripper").replace(
        "  right.thumb.contact.box: flag\n  right.index.contact.box: flag\n",
        "  right.gripper.closed: flag\n",
    );
    let found = analysis(&log(0.0, |_| false, 0.0), &binding);
    let segments = found["tracks"][0]["relabeled"].as_array().unwrap();
    let carried = segments.iter().find(|it| it["primitive"] == "Translate").unwrap();
    let start = carried["start_s"].as_f64().unwrap();
    assert!((start - 4.02).abs() <= 0.05, "{start}");
}

/// One finger pushes a box from 3 s to 5 s, rests beside it until 6 s, and leaves: nothing but poses is known.
#[test]
fn a_push_is_found_by_poses_alone_and_ends_when_the_object_rests() {
    let mut text = String::from("t,x,z,bx\n");
    for row in 0..500_u32 {
        let t = f64::from(row) / 50.0;
        let between = |from: f64, to: f64| ((t - from) / (to - from)).clamp(0.0, 1.0);
        let pushed = 200.0 * between(3.0, 5.0);
        let (x, z) = (50.0 * between(2.0, 3.0) + pushed, 20.0 + 200.0 * (1.0 - between(0.5, 1.5) + between(6.0, 7.0)));
        let _ = writeln!(text, "{t:.2},{x:.3},{z:.3},{:.3}", 90.0 + pushed);
    }
    let found = analysis(
        &text,
        "
hand_file: hand_vision.rules
time: t [s]
channels:
  right.index.position: ['x [mm]', '= 0 mm', 'z [mm]']
  box.position: ['bx [mm]', '= 0 mm', '= 20 mm']
scene:
  bodies: {box: {role: object, parts: [{box: [60 mm, 60 mm, 40 mm]}]}}
  hands: {right: {fingers: [index]}}
",
    );
    assert_eq!(names(&found), ["Move", "Approach", "Push", "Release", "Move"]);
    let push = &found["tracks"][0]["relabeled"][2];
    let [start, end] = ["start_s", "end_s"].map(|key| push[key].as_f64().unwrap());
    assert!((start - 3.0).abs() <= 0.15 && (end - 5.0).abs() <= 0.35, "{start} to {end}");
    assert_eq!(found["tracks"][0]["tasks"][0]["task"], "push");
}

/// A tool touches with 2 N, which is less than the 5 N from which on the rules see a contact.
#[test]
fn a_contact_that_is_weaker_than_the_rules_ask_for_is_proposed_as_a_level() {
    let mut text = String::from("t,x,f\n");
    for row in 0..1000_u32 {
        let t = f64::from(row) / 100.0;
        let force = if (3.0..7.0).contains(&t) { 2.0 } else { 0.0 } + 0.1 * scatter(row, 1);
        let _ = writeln!(text, "{t:.2},{:.4},{force:.4}", 0.02 * t);
    }
    let binding = "
hand_file: hand_wrist.rules
time: t [s]
channels:
  right.palm.position: [x, '= 0 m', '= 0 m']
  right.palm.force: ['= 0 N', '= 0 N', f]
  tool.position: [x, '= 0 m', '= 0 m']
scene: {bodies: {tool: {role: object, radius: 50 mm, fixed_to: right}}}
";
    let found = analysis(&text, binding);
    assert_eq!(names(&found), ["Move"]);
    let said = issues(&found, "no_contact_level");
    let (_, proposed) = said[0].split_once("bind `").unwrap();
    let line = proposed.trim_end_matches('`');
    let found = analysis(&text, &binding.replace("  tool.position", &format!("  {line}\n  tool.position")));
    assert!(names(&found).contains(&"Trace"), "{line}: {:?}", names(&found));
}
