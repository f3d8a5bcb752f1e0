//! Recordings of teleoperated grippers become programs of a simulated one: objects end where they were left.

use crate::program::{all_said, teachtree_in};
use std::io::Write as _;
use std::path::Path;
use std::process::Command;
use teachtree_base::meaning::Meaning;
use teachtree_command::{Commands, RATE_HZ};

/// Recordings, the names of their bindings and scenes, and the objects.
const TABLE: &[(&str, [&str; 2], &[&str])] = &[
    ("SawyerLift_demo_1.csv", ["sawyer_lift", "sawyer_lift"], &["cube"]),
    ("SawyerStack_demo_1.csv", ["sawyer_stack", "sawyer_stack"], &["cubeA"]),
    ("lift_demo_1.csv", ["panda_lift", "panda_lift"], &["cube"]),
    ("stack_panda_demo_1.csv", ["panda_stack", "panda_stack"], &["cubeA"]),
    // A nut hangs on its handle, between flat pads; the operator nudges the square one on the way to it.
    ("SawyerNutAssembly_demo_1.csv", ["sawyer_nut_assembly", "sawyer_nut_assembly"], &["SquareNut0", "RoundNut0"]),
    ("nut_assembly_panda_demo_1.csv", ["panda_nut_assembly", "panda_nut_assembly"], &["RoundNut0"]),
    // The operator lets the can fall from a height of 100 mm.
    ("SawyerPickPlace_demo_1.csv", ["sawyer_pick_place", "sawyer_pick_place"], &["Can0"]),
];

/// Recordings at 20 Hz of hands that start and stop; taken row by row, their commands would speed an object up by 13 to 34 m/s².
const SLOW: [&str; 3] = ["lift_demo_1.csv", "stack_panda_demo_1.csv", "nut_assembly_panda_demo_1.csv"];
/// Between two rows the object goes straight, and smoothing does the rest, m/s².
const GENTLE_M_S2: f64 = 2.0;

/// How much a commanded object is sped up at most while it is carried, m/s².
fn speeds_up(commands: &Commands) -> f64 {
    let carried = commands.tasks.iter().flat_map(|task| &task.segments).filter(|it| it.does == Meaning::Carry);
    let by = |poses: &[[f64; 7]]| {
        let part = |part: usize| poses[2][part] - 2.0 * poses[1][part] + poses[0][part];
        (0..3).map(|at| part(at).powi(2)).sum::<f64>().sqrt() * RATE_HZ * RATE_HZ
    };
    carried.flat_map(|segment| segment.object.windows(3)).map(by).fold(0.0, f64::max)
}

/// Retargets a shipped recording to the shipped gripper and carries it out in its scene; returns the commands and what `simulate` says.
fn carried_out(log: &str, names: [&str; 2]) -> (Commands, String) {
    let folder = tempfile::tempdir().unwrap();
    let demos = Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite");
    let [log, binding, scene] =
        [log.to_string(), format!("{}.binding.yaml", names[0]), format!("{}.scene.yaml", names[1])]
            .map(|name| demos.join(name).display().to_string());
    let retarget =
        ["retarget", &log, "--binding", &binding, "--scene", &scene, "--robot", "parallel_jaw", "-o", "commands.json"];
    let retargeted = teachtree_in(folder.path(), &retarget);
    assert!(retargeted.status.success(), "{}", all_said(&retargeted));
    let commands = std::fs::read_to_string(folder.path().join("commands.json")).unwrap();
    let simulate = ["simulate", "commands.json", "--robot", "parallel_jaw", "--scene", &scene, "-o", "robot.csv"];
    (Commands::read(&commands, "commands.json").unwrap(), all_said(&teachtree_in(folder.path(), &simulate)))
}

#[test]
fn objects_of_teleoperated_recordings_end_where_they_were_left() {
    for (log, names, objects) in TABLE {
        let (commands, said) = carried_out(log, *names);
        let most = speeds_up(&commands);
        assert!(!SLOW.contains(log) || (most > 0.0 && most < GENTLE_M_S2), "{log}: {most:.1} m/s²");
        let done: Vec<&str> = said.lines().filter(|line| line.starts_with("done")).collect();
        assert!(done.len() == objects.len() && !said.contains("not done"), "{log}: {said}");
        assert!(done.iter().zip(*objects).all(|(line, object)| line.contains(&format!("`{object}`"))), "{log}: {said}");
    }
}

/// The hand, its pads, the gripper, a wrench at the wrist and the object are topics of a bag that a library of others has written.
#[test]
fn a_bag_of_ros_2_becomes_a_program() {
    let python = std::env::var("TEACHTREE_PYTHON").unwrap_or_else(|_| "python3".into());
    let run = |args: &[&str]| Command::new(&python).args(args).output();
    if !run(&["-c", "import mcap_ros2"]).is_ok_and(|output| output.status.success()) {
        let _ = writeln!(std::io::stderr(), "skipped: Python with `mcap-ros2-support` is not installed");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let bag = folder.path().join("lift.mcap").display().to_string();
    let [script, log] = ["tests/fixtures/ros2/bag.py", "demos/robosuite/lift_demo_1.csv"]
        .map(|name| root.join(name).display().to_string());
    let written = run(&[&script, &log, "cube", &bag]).unwrap();
    assert!(written.status.success(), "{}", String::from_utf8_lossy(&written.stderr));
    let (_, said) = carried_out(&bag, ["../../tests/fixtures/ros2/gripper", "panda_lift"]);
    assert!(said.starts_with("done") && said.contains("`cube` is 0.0 mm"), "{said}");
}
