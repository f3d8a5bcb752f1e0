//! Goals of controllers: parts of one trajectory, in the form that `ros2 action send_goal --stdin` reads, from the present posture on.

use crate::program::{all_said, demonstrate, teachtree};
use serde_json::Value;
use teachtree_base::error::InputError;
use teachtree_command::Commands;
use teachtree_robot as robot;
use teachtree_robot::planning::goal::{goals, gripper_files};
use teachtree_robot::planning::posture::Posture;
use teachtree_robot::planning::trajectory::{JointTrajectory, trajectory};
use teachtree_world as world;

/// What the joints of the arm with a gripper do to place a box, from a posture of all joints or as planned.
fn made(posture: Option<&str>) -> Result<JointTrajectory, InputError> {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let (log, commands) = (path("log.csv"), path("commands.json"));
    let scene = "pick_and_place";
    demonstrate(scene, &[], &log);
    let output = teachtree(&["retarget", &log, "--robot", "arm_with_gripper", "-o", &commands]);
    assert!(output.status.success(), "{}", all_said(&output));
    let commands = Commands::read(&std::fs::read_to_string(&commands).unwrap(), "commands.json").unwrap();
    let robot = robot::open("arm_with_gripper", &|file| Err(InputError::new(file, "is not a shipped robot"))).unwrap();
    let posture = posture.map(|text| Posture::read(text, "posture.yaml").unwrap());
    trajectory(&commands, &robot, &world::scene(scene).unwrap(), posture.as_ref())
}

const JOINTS: [&str; 6] = ["arm/joint_1", "arm/joint_2", "arm/joint_3", "arm/joint_4", "arm/joint_5", "arm/joint_6"];
/// As a state publisher prints it: joints in an order of its own, other fields, and the beginning of the next message.
const POSTURE: &str = "header:\n  stamp: {sec: 1, nanosec: 2}\n  frame_id: ''\nname: [gripper/opening, arm/joint_6, arm/joint_5, \
     arm/joint_4, arm/joint_3, arm/joint_2, arm/joint_1]\nposition: [0.02, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1]\nvelocity: []\neffort: []\n---\n";

#[test]
fn arm_and_gripper_have_goals_that_begin_at_the_present_posture() {
    let (planned, made) = (made(None).unwrap(), made(Some(POSTURE)).unwrap());
    let written = goals(&made);
    let names: Vec<&str> = written.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["arm", "hand"]);
    let goal = |at: usize| -> Value { serde_yaml::from_str(&written[at].1).unwrap() };
    let (arm, hand) = (goal(0), goal(1));
    assert_eq!(arm["trajectory"]["joint_names"], Value::from(JOINTS.to_vec()));
    assert_eq!(hand["trajectory"]["joint_names"], Value::from(vec!["gripper/opening"]));
    let points = |goal: &Value| goal["trajectory"]["points"].as_array().unwrap().clone();
    let (first, fingers) = (&points(&arm)[0], &points(&hand)[0]);
    assert_eq!(first["positions"], Value::from(vec![0.1, 0.2, 0.3, 0.4, 0.5, 0.6]));
    assert_eq!(fingers["positions"], Value::from(vec![0.02]));
    assert!(first["velocities"].as_array().unwrap().iter().all(|velocity| velocity == 0.0));
    // Both have all points at the same times, each list is of floats, and time goes on.
    let nanoseconds = |point: &Value| {
        let of = |key: &str| point["time_from_start"][key].as_i64().unwrap();
        of("sec") * 1_000_000_000 + of("nanosec")
    };
    let times = |goal: &Value| points(goal).iter().map(nanoseconds).collect::<Vec<i64>>();
    assert_eq!(times(&arm), times(&hand));
    assert!(times(&arm).windows(2).all(|pair| pair[0] < pair[1]));
    assert!(points(&arm).iter().all(|point| point["accelerations"].as_array().unwrap().iter().all(Value::is_f64)));
    // It leads to where the plan begins, and what follows is the plan.
    let led = made.points.len() - planned.points.len();
    assert!(led > 50, "{led} points lead to the first one");
    for (own, other) in made.points[led..].iter().zip(&planned.points) {
        assert_eq!(own.positions, other.positions);
    }
    let reached = &made.points[led - 1];
    assert_eq!(reached.positions, planned.points[0].positions);
    assert!(reached.velocities.iter().all(|velocity| *velocity == 0.0));
}

#[test]
fn a_posture_without_a_joint_is_refused() {
    let error = made(Some("name: [arm/joint_1]\nposition: [0.1]\n")).unwrap_err().to_string();
    assert!(error.contains("has no position of the joint `arm/joint_2`"), "{error}");
    let wrong = |text: &str| Posture::read(text, "posture.yaml").unwrap_err().to_string();
    assert!(wrong("name: [a, b]\nposition: [0.1]\n").contains("2 names and 1 positions"));
    assert!(wrong("name: [a]\nposition: [.nan]\n").contains("no finite position of `a`"));
    assert!(wrong("position: [1.0]\n").starts_with("posture.yaml"), "{}", wrong("position: [1.0]\n"));
}

/// The jaws open, close on the box of 60 mm, and open again. One motor makes both press with the largest commanded force: it gives twice that.
#[test]
fn a_gripper_has_goals_with_its_effort() {
    let made = made(None).unwrap();
    let closes: Vec<bool> = made.grippers.iter().map(|goal| goal.closes).collect();
    assert_eq!(closes.iter().filter(|closes| **closes).count(), 1, "{:#?}", made.grippers);
    assert_eq!(closes.last(), Some(&false), "{:#?}", made.grippers);
    let close = made.grippers.iter().find(|goal| goal.closes).unwrap();
    let [joint] = &close.joints[..] else { panic!("{close:?}") };
    assert_eq!(joint.name, "gripper/opening");
    assert!((joint.position - 0.030).abs() < 1e-4, "each jaw is 30 mm from the middle: {close:?}");
    assert!((1.0..=10.0).contains(&joint.effort), "{close:?}");
    let files = gripper_files(&made);
    assert_eq!(files.len(), 2 * made.grippers.len());
    let text = |action: &str| {
        let found = files.iter().find(|(name, _)| name.ends_with(&format!("_close.{action}")));
        serde_yaml::from_str::<Value>(&found.unwrap().1).unwrap()
    };
    let one = text("gripper_command");
    assert_eq!(one["command"]["position"].as_f64(), Some(joint.position));
    assert!((one["command"]["max_effort"].as_f64().unwrap() - joint.effort).abs() < 1e-5);
    let parallel = text("parallel_gripper_command");
    assert_eq!(parallel["command"]["name"], Value::from(vec!["gripper/opening"]));
    assert!((parallel["command"]["effort"][0].as_f64().unwrap() - joint.effort).abs() < 1e-5);
}
