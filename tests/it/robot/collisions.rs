//! A link penetrates something too deeply: the task is done with collisions, and the exit status is 5.

use crate::program::{all_said, said, teachtree};
use serde_json::Value;

/// The table of this recording is above the base of the arm, and the forearm penetrates it while the cube is placed.
#[test]
fn a_link_deep_in_the_table_is_done_with_collisions() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let [commands, robot] = ["commands.json", "robot.csv"].map(path);
    let [binding, scene] = ["binding", "scene"].map(|what| format!("demos/robosuite/panda_lift.{what}.yaml"));
    let log = "demos/robosuite/lift_demo_1.csv";
    let arm = ["--robot", "arm_with_gripper"];
    let retarget = ["retarget", log, "--binding", &binding, "--scene", &scene, "-o", &commands];
    let retargeted = teachtree(&[&retarget[..], &arm].concat());
    assert!(retargeted.status.success(), "{}", all_said(&retargeted));
    let simulate = |more: &[&str]| {
        teachtree(&[&["simulate", &commands, "--scene", &scene, "-o", &robot], &arm[..], more].concat())
    };

    let output = simulate(&[]);
    assert_eq!(output.status.code(), Some(5), "{}", all_said(&output));
    assert!(said(&output).starts_with("done with collisions pick_and_place: `cube` is "), "{}", said(&output));
    assert!(said(&output).contains(" mm, at most 3 mm are accepted\n"), "{}", said(&output));

    // Findings that `--fail-on` does not select are still reported.
    let output = simulate(&["--fail-on", "not_done,not_recognized", "--format", "json"]);
    assert!(output.status.success(), "{}", all_said(&output));
    let document: Value = serde_json::from_str(&said(&output)).unwrap();
    let task = &document["tasks"][0];
    assert_eq!((&task["done"], &task["verdict"]), (&true.into(), &"done with collisions".into()), "{document:#}");
    let depths = document["collisions"].as_array().unwrap().iter().map(|it| it["depth_m"].as_f64().unwrap());
    let deepest = depths.fold(0.0, f64::max);
    assert!(deepest > 0.05 && task["collision_m"].as_f64() == Some(deepest), "{document:#}");
}
