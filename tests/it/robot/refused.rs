//! Commands that the robot cannot execute are rejected when they are created, not only when they are executed.

use crate::program::{all_said, said, teachtree};
use serde_json::Value;
use std::process::Output;
use teachtree_command::Commands;

/// Records a shipped operator and retargets the recording. Returns the output and the file names of the recording, the commands and the robot's
/// recording.
fn retargeted(scene: &str, seed: &str, grasps: &str, folder: &tempfile::TempDir) -> (Output, [String; 3]) {
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let files = ["log.csv", "commands.json", "robot.csv"].map(path);
    let taught = teachtree(&["teach", scene, scene, "--seed", seed, "-o", &files[0]]);
    assert!(taught.status.success(), "{}", all_said(&taught));
    (teachtree(&["retarget", &files[0], "--grasps", grasps, "-o", &files[1]]), files)
}

/// The arm stands 450 mm farther away, and does not reach the hole with any grasp.
#[test]
fn retarget_refuses_a_path_that_the_arm_cannot_follow() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let [log, commands, robot, recorded] = ["log.csv", "commands.json", "far.yaml", "robot.csv"].map(path);
    let taught = teachtree(&["teach", "peg_in_hole_tight", "peg_in_hole_tight", "--seed", "7003", "-o", &log]);
    assert!(taught.status.success(), "{}", all_said(&taught));
    let shipped = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/robots/both_hands.yaml"));
    let far = shipped.replace("at: [150 mm, -450 mm, 350 mm]", "at: [150 mm, -900 mm, 350 mm]");
    assert_ne!(far, shipped);
    std::fs::write(&robot, far).unwrap();
    let output = teachtree(&["retarget", &log, "--robot", &robot, "-o", &commands]);
    assert_eq!(output.status.code(), Some(1), "{}", all_said(&output));
    assert!(said(&output).contains("no grasp, the arm cannot bring the palm there"), "{}", said(&output));
    // `simulate` reports the same.
    let refused =
        teachtree(&["simulate", &commands, "--robot", &robot, "--scene", "peg_in_hole_tight", "-o", &recorded]);
    assert_eq!(refused.status.code(), Some(1), "{}", all_said(&refused));
    let reason = "refused  task 1 (right peg_in_hole): no grasp, the arm cannot bring the palm there";
    assert!(all_said(&refused).contains(reason), "{}", all_said(&refused));
    assert!(!std::path::Path::new(&recorded).exists());
}

/// This operator knocks the left box off the table, and it falls for half a minute.
#[test]
fn an_object_that_does_not_land_ends_its_task() {
    let folder = tempfile::tempdir().unwrap();
    let (output, [log, file, robot]) = retargeted("independent", "7002", "quality", &folder);
    let text = std::fs::read_to_string(&file).unwrap();
    let commands = Commands::read(&text, &file).unwrap();
    let task = commands.tasks.iter().find(|task| task.object == "left_box").unwrap();
    // Start of the fall in the recording: the last time at which the box has its height on the table.
    let recording = teachtree_frames::open(&teachtree_frames::OpenRequest { log: log.into(), ..Default::default() });
    let recording = recording.unwrap().recording;
    let heights = &recording.columns["left_box.position.z"].values;
    let fell_s = recording.time[heights.iter().rposition(|height| *height > 0.03).unwrap()];
    let ends_s = recording.time[recording.time.len() - 1];
    assert!(fell_s + 10.0 < ends_s && heights[heights.len() - 1] < -100.0, "{fell_s} s");
    assert!((task.end_s - fell_s).abs() < 0.1, "ends at {} s, fell at {fell_s} s", task.end_s);
    let fall = task.left_out.iter().find(|left| left.why == "falls").unwrap();
    assert!((fall.start_s - task.end_s).abs() < 1e-6 && (fall.end_s - ends_s).abs() < 0.1, "{fall:?}");
    for segment in &task.segments {
        assert!(segment.object.iter().all(|pose| pose[2] > 0.02), "{}", segment.primitive);
        assert!(segment.quality.jerk_after < 2e4, "{:?}", segment.quality);
    }
    // `simulate` accepts the commands of `retarget`.
    let simulated = teachtree(&["simulate", &file, "--scene", "independent", "-o", &robot, "--format", "json"]);
    assert_eq!(output.status.success(), simulated.status.code() != Some(2), "{}", all_said(&simulated));
    let document: Value = serde_json::from_str(&said(&simulated)).unwrap();
    assert_eq!(document["tasks"].as_array().unwrap().len(), commands.tasks.len());
}
