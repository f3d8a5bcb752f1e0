//! Goals of controllers in the form that `ros2 action send_goal --stdin` reads: a joint trajectory in parts, each as a `control_msgs/action/FollowJointTrajectory`, and
//! the motions of grippers.

use super::trajectory::JointTrajectory;
use std::fmt::Write;

/// Returns the goals of a trajectory: for each controller its name and the YAML.
pub fn goals(made: &JointTrajectory) -> Vec<(String, String)> {
    made.groups.iter().map(|(name, joints)| (name.clone(), goal(made, joints))).collect()
}

/// Returns the goals of grippers, numbered in order of time: for each action its name and the YAML.
pub fn gripper_files(made: &JointTrajectory) -> Vec<(String, String)> {
    let numbered = made.grippers.iter().enumerate();
    let files = numbered.flat_map(|(at, goal)| {
        let name = |action: &str| format!("{}_{}_{}.{action}", goal.controller, at + 1, goal.verb());
        let one = goal.gripper_command().map(|text| (name("gripper_command"), text));
        one.into_iter().chain([(name("parallel_gripper_command"), goal.parallel_gripper_command())])
    });
    files.collect()
}

fn goal(made: &JointTrajectory, joints: &[usize]) -> String {
    let names: Vec<String> =
        joints.iter().filter_map(|joint| Some(format!("{:?}", made.joint_names.get(*joint)?))).collect();
    let mut text = format!(
        "trajectory:\n  header: {{frame_id: {:?}}}\n  joint_names: [{}]\n  points:\n",
        made.header.frame_id,
        names.join(", ")
    );
    // Always with a decimal point: a whole number in a list would not be read as a float.
    let list = |values: &[f64]| {
        let chosen = joints.iter().filter_map(|joint| values.get(*joint));
        chosen.map(|value| format!("{:.6}", value + 0.0)).collect::<Vec<String>>().join(", ")
    };
    for point in &made.points {
        let time = point.time_from_start;
        let _ = writeln!(
            text,
            "  - {{positions: [{}], velocities: [{}], accelerations: [{}], time_from_start: {{sec: {}, nanosec: {}}}}}",
            list(&point.positions),
            list(&point.velocities),
            list(&point.accelerations),
            time.sec,
            time.nanosec
        );
    }
    text
}
