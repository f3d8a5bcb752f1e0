//! Collisions that a simulation reports.

use crate::program::{all_said, demonstrate, teachtree_in};
use std::path::Path;

/// A post stands where the elbow of the right arm is: nothing stops the arm, and `simulate` says so.
#[test]
fn an_arm_that_goes_through_the_scene_is_a_collision() {
    let folder = tempfile::tempdir().unwrap();
    let run = |status: i32, args: &[&str]| {
        let output = teachtree_in(folder.path(), args);
        let said = all_said(&output);
        assert_eq!(output.status.code(), Some(status), "{args:?}\n{said}");
        said
    };
    demonstrate("pick_and_place", &["--variation", "0"], folder.path().join("shown.csv"));
    run(0, &["retarget", "shown.csv", "--robot", "both_hands", "-o", "commands.json"]);
    let simulate = |status: i32, scene: &str| {
        run(status, &["simulate", "commands.json", "--robot", "both_hands", "--scene", scene, "-o", "robot.csv"])
    };
    assert!(!simulate(0, "pick_and_place").contains("warning"));
    let scene =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/pick_and_place.yaml")).unwrap();
    let post =
        "  post: {role: wall, position: [150 mm, -450 mm, 700 mm], parts: [{box: [300 mm, 300 mm, 20 mm]}]}\nhands:";
    std::fs::write(folder.path().join("post.yaml"), scene.replacen("hands:", post, 1)).unwrap();
    let said = simulate(5, "post.yaml");
    assert!(said.starts_with("done with collisions"), "{said}");
    assert!(
        said.contains("warning: collisions do not stop simulated links") && said.contains("through `post`"),
        "{said}"
    );
}
