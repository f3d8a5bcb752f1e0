//! Files that people write: bindings, scenes, operators, robots; and commands and labels.

use crate::{file, repository, scratch};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::Path;
use std::sync::LazyLock;
use teachtree_base::scene::Scene;
use teachtree_command::Commands;
use teachtree_description::tree::KinematicTree;
use teachtree_description::urdf as description;
use teachtree_robot as robot;
use teachtree_frames::bind::RowBinder;
use teachtree_logs::read::csv::parse_scene;
use teachtree_logs::read::labels as read_labels;
use teachtree_logs::read::memory_table::InMemoryTable;
use teachtree_world::{Fingertips, Operator, World, shipped, teach_with_progress};
use teachtree::{Log, Rules};

/// How many steps a scene of an input is simulated.
const STEPS: usize = 5;

fn copied(fixture: &str) -> Vec<u8> {
    std::fs::read(repository().join("tests/fixtures").join(fixture)).expect("a fixture")
}

/// Runs the rules that a log asks for.
fn analyze(log: &Log) {
    if let Ok(rules) = Rules::for_log(log)
        && let Ok(analysis) = rules.analyze(log)
    {
        analysis.json();
    }
}

/// A binding: of a log as a whole, and of its rows one by one.
pub fn binding(data: &[u8]) {
    static ROWS: LazyLock<Vec<Vec<(String, f64)>>> = LazyLock::new(|| {
        let text = String::from_utf8(copied("bindings/foreign.csv")).expect("a text");
        file("foreign.csv", text.as_bytes());
        let mut lines = text.lines();
        let titles: Vec<&str> = lines.next().expect("titles").split(',').collect();
        let number = |cell: &str| cell.parse().unwrap_or(f64::NAN);
        let row =
            |line: &str| titles.iter().zip(line.split(',')).map(|(it, cell)| (it.to_string(), number(cell))).collect();
        lines.map(row).collect()
    });
    let rows = &*ROWS;
    let binding = file("fuzz.binding.yaml", data);
    if let Ok(log) = Log::options().binding(&binding).open(scratch().join("foreign.csv")) {
        analyze(&log);
    }
    let Ok(mut binder) = RowBinder::open(&binding, None, 1.0) else { return };
    let _ = binder.check_topics();
    for row in rows {
        let mut one = InMemoryTable::new("row");
        one.begin_row().expect("a row fits");
        row.iter().for_each(|(title, value)| _ = one.put(title, *value).expect("a cell fits"));
        if binder.bind(&one).is_err() {
            return;
        }
    }
    let _ = binder.finish();
}

/// A scene: of a log, and in the virtual environment.
pub fn scene(data: &[u8]) {
    static LOG: LazyLock<Vec<u8>> = LazyLock::new(|| copied("logs/steady_grip.csv"));
    let Ok(text) = std::str::from_utf8(data) else { return };
    let Ok(scene) = parse_scene(text, "fuzz.yaml") else { return };
    let log = file("steady_grip.csv", &LOG);
    if let Ok(log) = Log::options().scene(file("fuzz.scene.yaml", data)).open(log) {
        analyze(&log);
    }
    let Ok(mut world) = World::new(&scene, Fingertips::default()) else { return };
    (0..STEPS).for_each(|_| _ = world.step(&[]));
}

/// An operator: the first half second of the demonstration.
pub fn operator(data: &[u8]) {
    static SCENE: LazyLock<Scene> = LazyLock::new(|| shipped::scene("pick_and_place").expect("a scene"));
    struct StopSignal;
    let Ok(text) = std::str::from_utf8(data) else { return };
    let Ok(operator) = Operator::read(text, "fuzz.operator.yaml") else { return };
    // Unwinding without a panic is the only way out of the demonstration.
    let taught = catch_unwind(AssertUnwindSafe(|| {
        let _ = teach_with_progress(&SCENE, &operator, 1, &mut |_| resume_unwind(Box::new(StopSignal)));
    }));
    if let Err(why) = taught
        && !why.is::<StopSignal>()
    {
        resume_unwind(why);
    }
}

/// Computes what is known of a tree in one posture.
fn move_links(tree: &KinematicTree) {
    let middle: Vec<f64> = tree.middle().iter().copied().collect();
    let poses = tree.forward_kinematics(&middle);
    for (link, pose) in poses.iter().enumerate() {
        tree.jacobian(&poses, link, pose.translation.vector.into());
    }
}

/// A robot file.
pub fn robot(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let Ok(robot) = robot::read(text, "fuzz.yaml") else { return };
    robot.hands_scale();
    move_links(&robot.tree);
}

/// A description of a robot.
pub fn urdf(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    if let Ok(tree) = description::read(text, "fuzz.urdf") {
        move_links(&tree);
    }
}

/// Commands for a robot: what is read is written as it can be read again.
pub fn commands(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let Ok(read) = Commands::read(text, "fuzz.json") else { return };
    let written = read.json().expect("what was read can be written");
    Commands::read(&written, "written.json").expect("what was written can be read");
}

/// Labels: a table, or a file of ELAN.
pub fn labels(data: &[u8]) {
    let times: Vec<f64> = (0..100).map(|row| f64::from(row) / 10.0).collect();
    let name = if data.starts_with(b"<") { "fuzz.eaf" } else { "fuzz.csv" };
    let _ = read_labels::read(&file(name, data), Path::new("log.csv"), &times);
}
