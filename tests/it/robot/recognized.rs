//! `simulate --rules`: whether the commanded task is found in the robot's own recording, beside whether the object is where it was left.

use crate::program::{all_said, demonstrate, said, teachtree};
use serde_json::Value;
use std::fs::write;

#[test]
fn rules_find_the_commanded_task_in_the_recording_of_the_robot_or_the_answer_is_no() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let [log, commands, robot] = ["log.csv", "commands.json", "robot.csv"].map(path);
    demonstrate("pick_and_place", &[], &log);
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
    assert_eq!(output.status.code(), Some(6), "{}", all_said(&output));
    let line = "not recognized in the robot's recording: right pick_and_place; the rules find right carry";
    assert!(said(&output).contains(line), "{}", said(&output));
    assert!(said(&output).contains("done     pick_and_place"), "{}", said(&output));

    let output = simulate(&["--rules", &path("own.rules"), "--format", "json"]);
    let document: Value = serde_json::from_str(&said(&output)).unwrap();
    assert_eq!((&document["tasks"][0]["done"], &document["tasks"][0]["recognized"]), (&true.into(), &false.into()));

    // A mistake in the rules is reported before the robot moves.
    write(path("wrong.rules"), "use \"contact.rules\"\nprimitive Flip is Carry\n").unwrap();
    std::fs::remove_file(&robot).unwrap();
    let output = simulate(&["--rules", &path("wrong.rules")]);
    assert_eq!(output.status.code(), Some(2), "{}", all_said(&output));
    assert!(all_said(&output).contains("`primitive … does carry`"), "{}", all_said(&output));
    assert!(!std::path::Path::new(&robot).exists());
}

/// The rules take a stop between two slides for a Grasp: the robot holds on, and its recording has one task as well.
#[test]
fn a_stop_on_the_way_is_held_through() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let [operator, log, commands, robot] = ["slide.yaml", "log.csv", "commands.json", "robot.csv"].map(path);
    let shipped = include_str!("../../../scenes/slide.operator.yaml");
    let back = "{phase: back, carry: {along: [-1, -0.25, 0], distance: 100 mm, speed: 120 mm/s, press: {against: base, toward: [0, 0, -1], force: 0.3 N}}}";
    let stops = "      - {hold: 200 ms}\n      - {phase: let go,";
    let text = shipped.replace(stops, &format!("      - {{hold: 300 ms}}\n      - {back}\n{stops}"));
    assert_ne!(text, shipped);
    write(&operator, text).unwrap();
    let run = |args: &[&str]| {
        let output = teachtree(args);
        assert!(output.status.success(), "{}", all_said(&output));
        said(&output)
    };
    run(&["teach", "slide", &operator, "--variation", "0", "-o", &log]);
    run(&["retarget", &log, "-o", &commands]);
    let document: Value = serde_json::from_str(&std::fs::read_to_string(&commands).unwrap()).unwrap();
    let segments = document["tasks"][0]["segments"].as_array().unwrap().iter();
    let does: Vec<&str> = segments.map(|segment| segment["does"].as_str().unwrap()).collect();
    assert_eq!(does, ["free", "approach", "close", "slide", "close", "slide", "open"]);
    run(&["simulate", &commands, "--scene", "slide", "-o", &robot]);
    let found = run(&["analyze", &robot]);
    assert_eq!(found.lines().filter(|line| line.starts_with("  slide can")).count(), 1, "{found}");
}
