//! What falls off a table: the robot does not go on with it, and what else there is to do is done.

use crate::program::{all_said, demonstrate, teachtree};
use serde_json::Value;
use teachtree_base::recording::Recording;
use teachtree_frames as stream;
use teachtree_frames::OpenRequest;

/// What a robot made of the person's demonstration in a shipped scene when in its own scene `from` is `to`: the exit status, what was said, the recording.
fn performed(scene: &str, from: &str, to: &str) -> (Option<i32>, String, Recording) {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let (log, commands, own, out) = (path("log.csv"), path("commands.json"), path("own.yaml"), path("robot.csv"));
    demonstrate(scene, &[], &log);
    assert!(teachtree(&["command", &log, "-o", &commands]).status.success());
    let text = std::fs::read_to_string(format!("{}/scenes/{scene}.yaml", env!("CARGO_MANIFEST_DIR"))).unwrap();
    assert!(text.contains(from), "{text}");
    std::fs::write(&own, text.replace(from, to)).unwrap();
    let page = path("robot.html");
    let output = teachtree(&["simulate", &commands, "--scene", &own, "-o", &out, "--report", &page]);
    let printed = all_said(&output);
    assert!(std::fs::read_to_string(&page).unwrap().contains("<p>Fell off after "), "{printed}");
    let opened = stream::open(&OpenRequest { log: out.into(), ..OpenRequest::default() }).unwrap();
    (output.status.code(), printed, opened.recording)
}

const BASE: &str = "position: [0 mm, 0 mm, -10 mm], parts: [{box: [640 mm, 600 mm, 20 mm]}]";

/// The table ends in the middle of the push. What falls with it, and is in no task, ends nothing.
#[test]
fn what_is_pushed_off_the_table_ends_the_simulation() {
    let short = "position: [0 mm, -150 mm, -10 mm], parts: [{box: [640 mm, 300 mm, 20 mm]}]";
    let (status, printed, recording) = performed("push", BASE, short);
    assert_eq!(status, Some(4), "{printed}");
    let fell_s: f64 = printed
        .split("not done push: `box` fell off after ")
        .nth(1)
        .unwrap()
        .split(' ')
        .next()
        .unwrap()
        .parse()
        .unwrap();
    assert!(!printed.contains("from where the demonstration left it"), "{printed}");
    let last = |name: &str| *recording.columns[name].values.last().unwrap();
    let (end_s, [y, z]) =
        (*recording.time.last().unwrap(), ["y", "z"].map(|part| last(&format!("box.position.{part}"))));
    // It was pushed some way first; then a free fall of a meter below the base, and no more.
    assert!(fell_s > 1.0 && (0.3..0.8).contains(&(end_s - fell_s)), "{printed}: {end_s} s");
    assert!(y > 0.0 && (-1.1..-0.95).contains(&z), "{y} m, {z} m");
    assert!(last("block.position.z") < z, "the block fell from the beginning");
}

/// The left cube has no floor: it is gone before its turn, and the right one is brought to its place all the same.
#[test]
fn what_is_left_to_do_is_done() {
    let right = "position: [170 mm, 0 mm, -10 mm], parts: [{box: [420 mm, 600 mm, 20 mm]}]";
    let (status, printed, recording) = performed("paper_box", BASE, right);
    assert_eq!(status, Some(4), "{printed}");
    assert!(printed.starts_with("done     pick_and_follow: "), "{printed}");
    assert!(printed.contains("not done push_and_trace: `left_cube` fell off after 0.0 s"), "{printed}");
    // The second task, of eleven seconds, is not begun.
    assert!(recording.time.last().unwrap() < &13.0, "{printed}");
}

/// The left hand's first task is about a box without a floor, which is gone when its turn comes: the hand goes to its next task from where it is.
#[test]
fn a_hand_whose_first_task_is_gone_does_not_jump() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let (log, file, own) = (path("log.csv"), path("commands.json"), path("own.yaml"));
    demonstrate("independent", &["--noise", "0"], &log);
    assert!(teachtree(&["command", &log, "-o", &file]).status.success());
    let mut commands: Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    let task = |track: &str, begins_s: f64, object: Option<&str>| {
        let all = commands["tasks"].as_array().unwrap();
        let mut task = all.iter().find(|task| task["track"] == track).unwrap().clone();
        let later_s = begins_s - task["start_s"].as_f64().unwrap();
        let shift = |value: &mut Value| *value = (value.as_f64().unwrap() + later_s).into();
        shift(&mut task["start_s"]);
        shift(&mut task["end_s"]);
        let segments = task["segments"].as_array_mut().unwrap();
        segments.iter_mut().for_each(|segment| shift(&mut segment["demonstrated_start_s"]));
        task["left_out"] = Value::Array(vec![]);
        if let Some(object) = object {
            task["object"] = object.into();
        }
        task
    };
    let one_by_one = [task("right", 0.0, None), task("left", 30.0, Some("ghost")), task("left", 60.0, None)];
    commands["tasks"] = one_by_one.to_vec().into();
    std::fs::write(&file, commands.to_string()).unwrap();
    let scene = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/independent.yaml")).unwrap();
    let ghost = "bodies:\n  ghost: {role: object, mass: 40 g, position: [-450 mm, -40 mm, 35 mm], parts: [{box: [80 mm, 60 mm, 70 mm]}]}\n";
    std::fs::write(&own, scene.replace("bodies:\n", ghost)).unwrap();
    let printed = all_said(&teachtree(&["simulate", &file, "--scene", &own, "-o", &path("robot.csv")]));
    assert!(printed.contains("`ghost` fell off after 0.0 s"), "{printed}");
    let done = printed.split("`left_box`").nth(1).unwrap();
    let off_mm: f64 = done.split("palm within ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(printed.contains("done     left ") && off_mm < 10.0, "{printed}");
}
