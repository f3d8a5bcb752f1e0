//! Grippers that carry out what fingers showed.

use crate::program::{complained, demonstrate, teachtree};
use nalgebra::Vector3;
use teachtree_command::{Commands, Task};

const URDF: &str = include_str!("../../fixtures/gripper_of_urdf.urdf");

/// A gripper in URDF, which a short file names.
const OF_URDF: &str = include_str!("../../fixtures/gripper_of_urdf.yaml");

/// What a robot is reported to do after an operator's demonstration, and what came of it: exit status and all that was printed, and the tasks that rules find
/// in its recording.
fn carried_out(scene: &str, seed: &str, robot: &str) -> (Commands, [(Option<i32>, String); 2], String) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("gripper.yaml"), OF_URDF).unwrap();
    std::fs::write(folder.path().join("gripper.urdf"), URDF).unwrap();
    let file = folder.path().join(robot);
    let robot = if robot.ends_with(".yaml") { file.to_str().unwrap() } else { robot };
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let (log, commanded, out) = (path("log.csv"), path("commands.json"), path("robot.csv"));
    demonstrate(scene, &["--seed", seed], &log);
    let printed = |args: &[&str]| {
        let output = teachtree(args);
        (output.status.code(), String::from_utf8_lossy(&output.stdout).to_string() + &complained(&output))
    };
    let made = printed(&["command", &log, "--robot", robot, "-o", &commanded]);
    let page = path("robot.html");
    let done = printed(&["simulate", &commanded, "--robot", robot, "--scene", scene, "-o", &out, "--report", &page]);
    let commands = Commands::read(&std::fs::read_to_string(&commanded).unwrap(), "commands.json").unwrap();
    let tasks = if done.0 == Some(0) { printed(&["analyze", &out]).1 } else { String::new() };
    (commands, [made, done], tasks)
}

fn fingers(task: &Task) -> Vec<&str> {
    task.grasps[0].contacts.iter().map(|contact| contact.finger.name()).collect()
}

#[test]
fn a_gripper_on_an_arm_does_what_three_fingers_showed() {
    let (commands, [made, done], tasks) = carried_out("pick_and_place", "2", "arm_with_gripper");
    assert_eq!(made.0, Some(0), "{}", made.1);
    assert!(made.1.contains("thumb, index: measure 0.") && made.1.contains(", jaws open by 60."), "{}", made.1);
    assert_eq!(done.0, Some(0), "{}", done.1);
    assert!(done.1.contains("done     pick_and_place: `box` is") && !done.1.contains("outside"), "{}", done.1);
    assert!(tasks.contains("pick_and_place"), "{tasks}");
    let task = &commands.tasks[0];
    assert_eq!(fingers(task), ["thumb", "index"]);
    // Two fingers pressed against the thumb: the jaw that stands for them does it alone, in balance, within what it may.
    let [mut squeezed, mut balance] = [0.0_f64; 2];
    for segment in task.segments.iter().filter(|segment| segment.primitive == "Translate") {
        let [thumb, other] = &segment.tips[..] else { panic!("{:?}", segment.tips.len()) };
        for (thumb, other) in thumb.force.iter().zip(&other.force) {
            let [thumb, other] = [thumb, other].map(|force| Vector3::from(*force));
            assert!(thumb.norm() <= 5.0 + 1e-9 && other.norm() <= 5.0 + 1e-9);
            assert!(other.x.hypot(other.z) <= -other.y + 1e-9, "{other} is outside the cone");
            (squeezed, balance) = (squeezed.max(-other.y), balance.max((thumb + other).y.abs()));
        }
    }
    assert!(squeezed > 0.5 && balance < 0.4 * squeezed, "{squeezed} N, {balance} N off");
}

/// The handles of the nuts end beside their rings, and lie 10 mm above the table: the pads go as near to the middle as both leave room.
#[test]
fn jaws_take_the_handles_of_both_nuts_of_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("commands.json");
    let demo = |name: &str| format!("demos/robosuite/{name}");
    let [log, binding] = ["SawyerNutAssembly_demo_1.csv", "sawyer_nut_assembly.binding.yaml"].map(demo);
    let scene = demo("sawyer_nut_assembly.scene.yaml");
    let files = ["--binding", &binding, "--scene", &scene, "-o", out.to_str().unwrap()];
    let made = teachtree(&[&["retarget", &log, "--robot", "parallel_jaw"], &files[..]].concat());
    assert!(made.status.success(), "{}{}", String::from_utf8_lossy(&made.stdout), complained(&made));
    let commands = Commands::read(&std::fs::read_to_string(&out).unwrap(), "commands.json").unwrap();
    assert_eq!(commands.tasks.len(), 2);
    for (task, ring_ends) in commands.tasks.iter().zip([0.0437, 0.0538]) {
        for contact in &task.grasps[0].contacts {
            // The ball of 8 mm touches the handle, and neither the ring nor the table.
            let [x, _, z] = contact.point;
            assert!(x >= ring_ends + 0.007 && z.abs() < 0.003, "{}: {contact:?}", task.object);
        }
    }
}

#[test]
fn a_cube_that_is_wider_than_the_jaws_open_is_refused_in_millimetres() {
    let (commands, [made, done], _) = carried_out("pick_and_follow", "2", "parallel_jaw");
    assert_eq!((made.0, done.0), (Some(1), Some(1)));
    for printed in [&made.1, &done.1] {
        assert!(printed.contains("the jaws open to 100.0 mm, and 12"), "{printed}");
        assert!(printed.contains(" mm are missing"), "{printed}");
    }
    assert!(commands.tasks[0].grasps[0].mapped.is_none());
}

#[test]
fn grippers_put_a_peg_into_its_hole_though_it_hangs_as_on_a_hinge() {
    for robot in ["parallel_jaw", "gripper.yaml"] {
        let (_, [made, done], tasks) = carried_out("peg_in_hole", "1", robot);
        assert_eq!((made.0, done.0), (Some(0), Some(0)), "{robot}: {}{}", made.1, done.1);
        assert!(tasks.contains("peg_in_hole"), "{robot}: {tasks}");
    }
}

#[test]
fn a_gripper_presses_with_its_palm_where_its_jaws_cannot() {
    let (_, [made, done], tasks) = carried_out("stamp", "4", "parallel_jaw");
    assert_eq!((made.0, done.0), (Some(0), Some(0)), "{}{}", made.1, done.1);
    // Forces are within their profile, and the same rules find that it was pressed.
    assert!(!done.1.contains("outside"), "{}", done.1);
    assert!(tasks.contains("pick_and_press"), "{tasks}");
}

#[test]
fn a_push_is_refused_since_jaws_only_hold() {
    let (_, [made, done], _) = carried_out("push", "1", "parallel_jaw");
    assert_eq!((made.0, done.0), (Some(1), Some(1)));
    let why = "no grasp, a gripper holds an object between thumb and fingers, and only one side touches it here: grippers do not push";
    assert!(made.1.contains(&format!("  index: {why}")) && done.1.contains(why), "{}{}", made.1, done.1);
}

/// A gripper of linkages as the Robotiq 2F-85, and one with a single turning jaw as the SO-101.
#[test]
fn jaws_that_turn_take_what_fingers_held() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let log = path("log.csv");
    demonstrate("pick_and_place", &["--seed", "2"], &log);
    for robot in ["tests/fixtures/turning_jaws.yaml", "tests/fixtures/one_jaw.yaml"] {
        let out = path("commands.json");
        let made = teachtree(&["retarget", &log, "--robot", robot, "-o", &out]);
        let said = String::from_utf8_lossy(&made.stdout).to_string() + &complained(&made);
        assert!(made.status.success(), "{robot}: {said}");
        assert!(said.contains("thumb, index: measure 0.") && said.contains(", jaws open by 60."), "{robot}: {said}");
        let commands = Commands::read(&std::fs::read_to_string(&out).unwrap(), "commands.json").unwrap();
        let mapped = commands.tasks[0].grasps[0].mapped.as_ref().unwrap();
        assert_eq!(mapped.joints.len(), 1, "{robot} has one motor");
    }
}
