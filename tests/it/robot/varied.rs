//! `simulate --variation`: a cell that differs from its scene.

use crate::program::{all_said, complained, demonstrate, said, teachtree, teachtree_in};
use serde_json::{Value, json};
use std::fs::write;

#[test]
fn a_variation_is_executed_and_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    demonstrate("pick_and_place", &[], path("log.csv"));
    let retargeted = teachtree(&["retarget", &path("log.csv"), "-o", &path("commands.json")]);
    assert!(retargeted.status.success(), "{}", all_said(&retargeted));
    let simulate = |variation: &str| {
        write(path("cell.yaml"), variation).unwrap();
        let args = ["simulate", "commands.json", "--scene", "pick_and_place", "--variation", "cell.yaml"];
        let args = [&args[..], &["-o", "robot.csv", "--format", "json"]].concat();
        teachtree_in(folder.path(), &args)
    };
    let elsewhere = simulate("object_offset: [20 mm, -10 mm]\nobject_turn: 10 deg\npose_error: [1 mm, 0 mm, 0 mm]\n");
    assert_eq!(elsewhere.status.code(), Some(0), "{}", all_said(&elsewhere));
    let document: Value = serde_json::from_str(&said(&elsewhere)).unwrap();
    let recorded = &document["variation"];
    assert_eq!(recorded["object_offset"], json!(["0.02 m", "-0.01 m"]));
    assert_eq!((&recorded["friction"], &recorded["pose_delay"]), (&json!(1.0), &json!("0 s")));
    let off = document["tasks"][0]["off_m"].as_f64().unwrap();
    assert!((off - 0.001).abs() < 5e-4, "{off}");
    // What was recorded is read again.
    assert_eq!(simulate(&recorded.to_string()).stdout, elsewhere.stdout);
    let heavy = simulate("mass: 8\n");
    assert_eq!(heavy.status.code(), Some(4), "{}", all_said(&heavy));
    for (variation, expected) in [
        ("pose_delay: 2 s\n", "cell.yaml:1:13: pose_delay: found 2 s, expected 0 to 1 s"),
        ("mass: 1\nfriction: -1\n", "cell.yaml:2:11: friction: found -1, expected 0 to 5"),
        ("frictio: 1\n", "did you mean `friction`?"),
        ("motor_delay: 5 mm\n", "cell.yaml:1:14: "),
        ("object_offset: [120 mm, 150 mm]\n", "task 1 (pick_and_place): the varied place of `box` is "),
    ] {
        let refused = simulate(variation);
        assert_eq!(refused.status.code(), Some(2), "{variation}");
        assert!(complained(&refused).contains(expected), "{}", complained(&refused));
    }
}
