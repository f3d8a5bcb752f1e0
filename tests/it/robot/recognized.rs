//! `simulate --rules`: whether the commanded task is found in the robot's own recording, beside whether the object is where it was left.

use crate::program::{all_said, said, teachtree};
use serde_json::Value;
use std::fs::write;

#[test]
fn rules_find_the_commanded_task_in_the_recording_of_the_robot_or_the_answer_is_no() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let [log, commands, robot] = ["log.csv", "commands.json", "robot.csv"].map(path);
    let taught = teachtree(&["teach", "pick_and_place", "pick_and_place", "-o", &log]);
    assert!(taught.status.success(), "{}", all_said(&taught));
    let retargeted = teachtree(&["retarget", &log, "-o", &commands]);
    assert!(retargeted.status.success(), "{}", all_said(&retargeted));
    let simulate = |more: &[&str]| {
        teachtree(&[&["simulate", &commands, "--scene", "pick_and_place", "-o", &robot], more].concat())
    };

    let output = simulate(&["--rules", "contact.rules"]);
    assert!(output.status.success(), "{}", all_said(&output));
    assert!(
        said(&output).contains("\nrecognized in the robot's recording: right pick_and_place\n"),
        "{}",
        said(&output)
    );

    // The object ends where it was left, and yet this is not what the rules call the task.
    write(
        path("own.rules"),
        "use \"contact.rules\"\ntask carry = Move .. Release with Translate before pick_and_place\n",
    )
    .unwrap();
    let output = simulate(&["--rules", &path("own.rules")]);
    assert_eq!(output.status.code(), Some(1), "{}", all_said(&output));
    let line = "not recognized in the robot's recording: right pick_and_place; the rules find right carry";
    assert!(said(&output).contains(line), "{}", said(&output));
    assert!(said(&output).contains("done     pick_and_place"), "{}", said(&output));

    let output = simulate(&["--rules", &path("own.rules"), "--format", "json"]);
    let document: Value = serde_json::from_str(&said(&output)).unwrap();
    assert_eq!((&document["tasks"][0]["done"], &document["tasks"][0]["recognized"]), (&true.into(), &false.into()));

    // A mistake in the rules is told before the robot moves.
    write(path("wrong.rules"), "use \"contact.rules\"\nprimitive Flip is Carry\n").unwrap();
    std::fs::remove_file(&robot).unwrap();
    let output = simulate(&["--rules", &path("wrong.rules")]);
    assert_eq!(output.status.code(), Some(2), "{}", all_said(&output));
    assert!(all_said(&output).contains("`primitive … does carry`"), "{}", all_said(&output));
    assert!(!std::path::Path::new(&robot).exists());
}
