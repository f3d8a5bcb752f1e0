//! The tasks of the shipped recordings, at the instants that are known from the contact events.

use std::path::Path;
use teachtree_analysis::{self as analysis, Analysis};
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;
use teachtree_engine as engine;
use teachtree_frames::OpenRequest;
use teachtree_frames::open;
use teachtree_language::{self as language, graph};

fn request(log: &str, binding: &str) -> OpenRequest {
    let [log, binding] = [format!("{log}.csv"), format!("{binding}.binding.yaml")]
        .map(|file| Path::new(crate::ROOT).join("demos/robosuite").join(file));
    OpenRequest { log, binding: Some(binding), ..OpenRequest::default() }
}

fn near(found: f64, wanted: f64, tolerance: f64) {
    assert!((found - wanted).abs() <= tolerance, "found {found} s, expected {wanted} s within {tolerance} s");
}

/// What is found in a recording that is changed before.
fn analyzed(log: &str, binding: &str, change: impl Fn(&mut Recording)) -> Analysis {
    let mut opened = open(&request(log, binding)).unwrap();
    change(&mut opened.recording);
    let request = language::Request {
        hand_file: Some(opened.hand_model().file),
        overrides: opened.params.clone(),
        two_hands: log.starts_with("Baxter"),
        ..language::Request::default()
    };
    let rules = language::load(&request).rules.unwrap();
    let frames = opened.frames(&analysis::channels(&rules)).unwrap();
    let leaves = engine::evaluator::evaluate(&graph::lower(&rules), &frames).unwrap();
    analysis::analyze(&rules, &frames, &leaves)
}

/// The tasks of the right hand with their segments, each with its start, s.
fn tasks(log: &str, binding: &str) -> Vec<(String, Vec<(String, f64)>)> {
    let found = analyzed(log, binding, |_| ());
    let tasks = &found.track(analysis::TrackId::Hand(Side::Right)).unwrap().tasks;
    tasks
        .iter()
        .map(|task| (task.task.clone(), task.segments.iter().map(|it| (it.primitive.clone(), it.start_s)).collect()))
        .collect()
}

#[test]
fn each_nut_is_a_peg_in_hole() {
    let tasks = tasks("SawyerNutAssembly_demo_1", "sawyer_nut_assembly");
    // Both fingers on, off the table, 2 mm below the rim, fingers off, from the contact events; the touch at 9.85 s is not a grasp.
    let gold = [[13.05, 13.37, 17.87, 18.93], [29.10, 29.22, 36.45, 36.97]];
    assert_eq!(tasks.len(), gold.len());
    for ((name, segments), gold) in tasks.iter().zip(gold) {
        assert_eq!(name, "peg_in_hole");
        let names: Vec<&str> = segments.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["Move", "Approach", "Grasp", "Translate", "Insert", "Release"]);
        for ((_, start), gold) in segments[2..].iter().zip(gold) {
            near(*start, gold, 0.15);
        }
    }
}

#[test]
fn each_stack_is_a_pick_and_place() {
    for (log, binding) in [("SawyerStack_demo_1", "sawyer_stack"), ("stack_panda_demo_1", "panda_stack")] {
        let tasks = tasks(log, binding);
        let named: Vec<&str> =
            tasks.iter().map(|(name, _)| name.as_str()).filter(|name| *name != analysis::UNKNOWN).collect();
        assert_eq!(named, ["pick_and_place"], "{log}");
    }
}

#[test]
fn two_arms_fit_peg_and_plate_although_the_wrist_touches_the_plate() {
    // The plate is pressed against the wrist that holds it: a link of the robot, which the log names like the table.
    let found = analyzed("BaxterPegInHole_demo_1", "baxter_peg_in_hole", |recording| {
        let flags = &mut recording.columns["contact.hole.env"].values;
        for (flag, time) in flags.iter_mut().zip(&recording.time) {
            *flag = f64::from(u8::from(*time >= 12.95));
        }
    });
    let last = found.track(analysis::TrackId::Both).unwrap().relabeled.last().unwrap();
    assert_eq!(last.primitive, "Fit");
    near(last.start_s, 13.0, 0.1);
    near(last.end_s, 14.08, 0.02);
}
