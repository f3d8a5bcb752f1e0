//! `retarget`: the commands of the chapter's experiment and of other demonstrations, and the page of a simulation.

use crate::browser::Browser;
use crate::program::{complained, demonstrate, said, teachtree, teachtree_in};
use crate::report::page::{no_complaints, picture};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_base::recording::Recording;
use teachtree_command::{Commands, FRICTION, Segment, Task};
use teachtree_frames as stream;
use teachtree_frames::OpenRequest;
use teachtree_robot as robot;
use teachtree_robot::planning::trajectory::trajectory;
use teachtree_world as world;

#[test]
fn the_experiment_becomes_commands_within_the_stated_deviations() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let (log, out, table) = (path("log.csv"), path("commands.json"), path("commands.csv"));
    demonstrate("paper_box", &[], &log);
    let output = teachtree(&["command", &log, "--robot", "both_hands", "-o", &out]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    let commands = Commands::read(&std::fs::read_to_string(&out).unwrap(), "commands.json").unwrap();
    let recording = trusted(&log);
    // The scene beside the log is an input as well.
    let lost = teachtree(&["command", &log, "-o", &path("log.scene.yaml")]);
    assert_eq!(lost.status.code(), Some(2), "{}", complained(&lost));
    // So are the parts of a robot.
    let shipped = |file: &str| {
        let robots = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("robots");
        std::fs::read_to_string(robots.join(file)).unwrap()
    };
    std::fs::write(path("my_arm.yaml"), shipped("arm_6dof.yaml")).unwrap();
    std::fs::write(path("mine.yaml"), shipped("both_hands.yaml").replace("robot: arm_6dof,", "robot: my_arm.yaml,"))
        .unwrap();
    let lost = teachtree(&["command", &log, "--robot", &path("mine.yaml"), "-o", &path("my_arm.yaml")]);
    assert_eq!(lost.status.code(), Some(2), "{}", complained(&lost));
    assert!(complained(&lost).contains("is an input of this command"), "{}", complained(&lost));
    within_the_limits_of_the_robot(&commands, "paper_box");
    let names: Vec<(&str, &str)> =
        commands.tasks.iter().map(|task| (task.task.as_str(), task.object.as_str())).collect();
    assert_eq!(names, [("pick_and_follow", "right_cube"), ("push_and_trace", "left_cube")]);
    let fingers = |task: usize| -> Vec<&str> {
        commands.tasks[task].grasps[0].contacts.iter().map(|contact| contact.finger.name()).collect()
    };
    assert_eq!((fingers(0), fingers(1)), (vec!["thumb", "index", "middle"], vec!["index", "middle"]));
    for task in &commands.tasks {
        for grasp in &task.grasps {
            let mapped = grasp.mapped.as_ref().unwrap_or_else(|| panic!("{:?}", grasp.infeasible));
            assert!(mapped.measure > 0.02, "{}", mapped.measure);
            assert!(mapped.friction_margin.is_some_and(|margin| (0.0..=1.0).contains(&margin)), "{mapped:?}");
        }
        for segment in &task.segments {
            let quality = &segment.quality;
            assert!(quality.position_deviation <= 0.002 + 1e-9, "{}: {quality:?}", segment.primitive);
            as_far_from_the_person_as_reported(&recording, task, segment);
            for tip in &segment.tips {
                let contact = task.grasps[0].contacts.iter().find(|contact| contact.finger == tip.finger);
                for force in &tip.force {
                    let force = Vector3::from(*force);
                    match contact.filter(|_| segment.touching) {
                        None => assert_eq!(force, Vector3::zeros(), "{} in {}", tip.finger, segment.primitive),
                        Some(contact) => {
                            let normal = Vector3::from(contact.normal);
                            let pressed = -force.dot(&normal);
                            let along = (force + normal * pressed).norm();
                            assert!(pressed >= 0.0 && along <= FRICTION * pressed + 1e-5, "{force} in the cone");
                        }
                    }
                }
            }
        }
        let worst = |of: &dyn Fn(&teachtree_command::Quality) -> f64| {
            task.segments.iter().map(|segment| of(&segment.quality)).fold(0.0, f64::max)
        };
        assert!(worst(&|quality| quality.jerk_after) < 0.7 * worst(&|quality| quality.jerk_before));
    }
    // The same as a table: a row a sample.
    assert!(teachtree(&["command", &log, "--format", "csv", "-o", &table]).status.success());
    let rows: usize = commands.tasks.iter().flat_map(|task| &task.segments).map(|segment| segment.object.len()).sum();
    assert_eq!(std::fs::read_to_string(&table).unwrap().lines().count(), rows + 1);
}

/// All pictures of a page of a robot have one framing, and every hand and object lies within each.
pub fn pictures_hold_hands_and_objects(page: &str) {
    let pictures: Vec<&str> = page.split("<figure><svg viewBox=\"0 0 ").skip(1).collect();
    assert!(pictures.len() > 3, "{} pictures", pictures.len());
    let size = |picture: &str| -> Vec<f64> {
        picture.split('"').next().unwrap().split(' ').map(|edge| edge.parse().unwrap()).collect()
    };
    let [wide, high] = size(pictures[0])[..] else { panic!("{}", &pictures[0][..40]) };
    for picture in pictures {
        assert_eq!(size(picture), [wide, high]);
        let drawn = picture.split("</svg>").next().unwrap();
        for class in ["object", "hand"] {
            let shapes: Vec<&str> = drawn.split(&format!("<path class=\"{class}\" d=\"")).skip(1).collect();
            assert!(shapes.len() > 2, "{class}");
            for shape in shapes {
                // A bar has a width, a face has a line around it.
                let stroke = shape.split("stroke-width=\"").nth(1).unwrap().split('"').next().unwrap();
                let half: f64 = stroke.parse::<f64>().unwrap() / 2.0;
                let numbers = shape.split('"').next().unwrap().replace(['M', 'L', 'Z'], " ");
                let numbers: Vec<f64> = numbers.split_whitespace().map(|number| number.parse().unwrap()).collect();
                for point in numbers.chunks(2) {
                    let within = |at: f64, edge: f64| at - half >= 0.0 && at + half <= edge;
                    assert!(within(point[0], wide) && within(point[1], high), "{class} at {point:?} of {wide} {high}");
                }
            }
        }
    }
}

/// The page is scrubbed and played as that of a demonstration.
fn plays(page: &Path) {
    let Some(mut browser) = Browser::start() else { return };
    browser.open(page);
    let (colors, begin) = picture(&mut browser);
    assert!(colors > 50, "{colors} colors");
    browser.click("[data-pick='cut 0 relabeled 3']");
    assert!(browser.text("#why").contains("Translate"), "{}", browser.text("#why"));
    let (_, carried) = picture(&mut browser);
    assert_ne!(begin, carried, "another time, another picture");
    let before = browser.text("#clock");
    browser.click("#play");
    browser.wait(&format!("document.querySelector('#clock').textContent > '{before}'"));
    browser.click("#play");
    browser.click("[data-pick='task 0 tasks 0']");
    assert!(browser.text("#why").contains("; done"), "{}", browser.text("#why"));
    assert!(browser.text("#panels").contains("force of the"), "{}", browser.text("#panels"));
    assert_eq!(browser.eval("document.querySelector('#drawings svg').checkVisibility()"), true);
    // The first view, which the scripts choose when they load the page once more: links hide less of hands and objects than in the usual one.
    let scripts = teachtree_report::page::SCRIPTS.concat();
    let load = "load(JSON.parse(byId('data').textContent)); const hidden = replay.hidden(); replay.fit(FIRST); return [hidden, replay.hidden()];";
    let shares = browser.eval(&format!("(() => {{ {scripts}\n{load} }})()"));
    let (hidden, usual) = (shares[0].as_f64().unwrap(), shares[1].as_f64().unwrap());
    assert!(hidden + 0.1 < usual, "{hidden} of hands and objects are hidden, {usual} in the usual view");
    no_complaints(&browser);
}

/// The page draws every primitive of every task, and forces as commanded and as exerted.
#[test]
fn a_page_shows_what_the_robot_did() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let (log, commands, out, page) = (path("log.csv"), path("commands.json"), path("robot.csv"), path("robot.html"));
    demonstrate("pick_and_place", &[], &log);
    assert!(teachtree(&["command", &log, "-o", &commands]).status.success());
    let simulate =
        |page: &str| teachtree(&["simulate", &commands, "--scene", "pick_and_place", "-o", &out, "--report", page]);
    assert!(simulate(&page).status.success());
    let text = std::fs::read_to_string(&page).unwrap();
    for primitive in ["Move", "Approach", "Grasp", "Translate", "Place", "Release"] {
        assert_eq!(text.matches(&format!("<figcaption>{primitive}, ")).count(), 1, "{primitive}");
    }
    pictures_hold_hands_and_objects(&text);
    assert!(text.contains("<td rowspan=\"3\">99 %</td>"), "no grasp holds without friction");
    assert!(text.contains("joints of the thumb, rad\""), "one unit");
    assert!(text.contains("N at most, within their profile.</p>"));
    for title in ["force of the thumb, z, N", "total force on the object, z, N", "joints of the arm", "manipulability"]
    {
        assert!(text.contains(title), "{title}");
    }
    let (drawings, _) = text.split_once("<script").unwrap();
    assert!(!drawings.contains("NaN") && !text.contains("http"), "a page of its own");
    plays(Path::new(&page));
    // The first line of this color is in the legend. Carried, the object weighs on the fingers: the curve of the total force along z leaves zero.
    let drawn = text.split("aria-label=\"total force on the object, z, N\"").nth(1).unwrap();
    let curve = drawn.split("class=\"line c0\" d=\"M").nth(2).unwrap().split('"').next().unwrap();
    assert!(curve.contains('l') && curve.len() > 200, "{curve}");
    // Joints that the hand does not have are somebody's mistake.
    let made = Commands::read(&std::fs::read_to_string(&commands).unwrap(), "commands.json").unwrap();
    let mut foreign = made.clone();
    let joints = &mut foreign.tasks[0].grasps[0].mapped.as_mut().unwrap().joints;
    let value = joints.remove("right_hand/thumb_1").unwrap();
    joints.insert("right_hand/thump_1".into(), value);
    let misspelt = path("misspelt.json");
    std::fs::write(&misspelt, foreign.json().unwrap()).unwrap();
    let said = teachtree(&["simulate", &misspelt, "--scene", "pick_and_place", "-o", &path("none.csv")]);
    assert_eq!(said.status.code(), Some(2));
    let printed = complained(&said);
    assert!(
        printed.contains("the joint `right_hand/thump_1`, which the hand of `both hands` does not have"),
        "{printed}"
    );
    // A grasp that the hand cannot take is an answer, not a mistake.
    let mut without = made;
    without.tasks[0].grasps[0].mapped = None;
    without.tasks[0].grasps[0].infeasible = Some("thumb cannot reach its contact: 24.8 mm are missing".into());
    let refused = path("refused.json");
    std::fs::write(&refused, without.json().unwrap()).unwrap();
    let said = teachtree(&["simulate", &refused, "--scene", "pick_and_place", "-o", &path("none.csv")]);
    assert_eq!(said.status.code(), Some(1));
    let printed = String::from_utf8(said.stdout).unwrap();
    assert!(printed.starts_with("refused  task 1 (right pick_and_place): no grasp, thumb cannot reach"), "{printed}");
    assert!(!std::path::Path::new(&path("none.csv")).exists());
    assert_eq!(String::from_utf8(said.stderr).unwrap(), "");
    // Another scene is tried all the same, with a warning.
    let elsewhere = teachtree(&["simulate", &refused, "--scene", "push", "-o", &path("none.csv")]);
    let warning = "is of the scene `pick and place`, and this one is `push`";
    assert!(complained(&elsewhere).contains(warning), "{}", complained(&elsewhere));
    // What the command reads is not written over.
    let lost = simulate(&commands);
    assert_eq!(lost.status.code(), Some(2));
    assert!(complained(&lost).contains("would be lost"), "{}", complained(&lost));
}

/// A recording as the rules see it.
fn trusted(log: &str) -> Recording {
    let request = OpenRequest { log: log.into(), ..OpenRequest::default() };
    stream::open(&request).unwrap().trusted().unwrap()
}

/// The largest distances to what was recorded, computed here from the recording, are those that the segment tells.
fn as_far_from_the_person_as_reported(recording: &Recording, task: &Task, segment: &Segment) {
    // Pauses of a free hand are left out, so its samples have other times; a hand that only pushes takes the points the other way round.
    if !segment.touching || task.task == "push_and_trace" {
        return;
    }
    let vector = |name: &str, row: usize| {
        Vector3::from(["x", "y", "z"].map(|part| recording.columns[&format!("{name}.{part}")].values[row]))
    };
    let (mut place, mut fingers, mut forces) = (0.0_f64, 0.0_f64, 0.0_f64);
    for at in 0..segment.object.len() {
        let row = ((segment.demonstrated_start_s + at as f64 / 100.0) * 1000.0).round() as usize;
        let object = vector(&format!("{}.position", task.object), row);
        let [w, x, y, z] =
            ["w", "x", "y", "z"].map(|part| recording.columns[&format!("{}.rotation.{part}", task.object)].values[row]);
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let commanded = segment.object[at];
        place = place.max((Vector3::new(commanded[0], commanded[1], commanded[2]) - object).norm());
        let grasp = &task.grasps[segment.grasp.unwrap()];
        for tip in segment.tips.iter().filter(|tip| grasp.contacts.iter().any(|it| it.finger == tip.finger)) {
            let own = |what: &str| vector(&format!("{}.{}.{what}", task.track, tip.finger), row);
            let tip_in_object = turn.inverse() * (own("position") - object);
            fingers = fingers.max((tip_in_object - Vector3::from(tip.position[at])).norm());
            if tip.force[at] != [0.0; 3] {
                forces = forces.max((turn.inverse() * own("force") - Vector3::from(tip.force[at])).norm());
            }
        }
    }
    let quality = &segment.quality;
    let name = &segment.primitive;
    assert!(place <= quality.position_deviation + 1e-6, "{name}: the object is {place} m off, {quality:?}");
    assert!((fingers - quality.contact_deviation).abs() < 1e-6, "{name}: a fingertip is {fingers} m off, {quality:?}");
    assert!((forces - quality.force_deviation).abs() < 1e-6, "{name}: a force is {forces} N off, {quality:?}");
}

#[test]
fn the_bias_of_a_sensor_is_not_commanded() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let (log, plain, biased) = (path("log.csv"), path("plain.json"), path("biased.json"));
    demonstrate("pick_and_place", &[], &log);
    teachtree(&["command", &log, "-o", &plain]);
    // The same, with sensors that are off by 0.15 N.
    let text = std::fs::read_to_string(&log).unwrap();
    let (header, _) = text.lines().enumerate().find(|(_, line)| line.contains("right.thumb.force.x")).unwrap();
    let names: Vec<&str> = text.lines().nth(header).unwrap().split(',').collect();
    let off: Vec<bool> = names.iter().map(|name| name.starts_with("right.") && name.contains(".force.z")).collect();
    let shifted = text.lines().enumerate().map(|(number, line)| {
        let shift = |(value, off): (&str, &bool)| match value.parse::<f64>() {
            Ok(number) if *off => format!("{:.6}", number + 0.15),
            _ => value.to_string(),
        };
        let cells = line.split(',').zip(&off).map(shift).collect::<Vec<_>>().join(",");
        if number <= header { line.to_string() } else { cells }
    });
    std::fs::write(&log, shifted.collect::<Vec<_>>().join("\n") + "\n").unwrap();
    teachtree(&["command", &log, "-o", &biased]);
    let read = |file: &str| Commands::read(&std::fs::read_to_string(file).unwrap(), file).unwrap();
    let (plain, biased) = (read(&plain), read(&biased));
    let mut compared = 0;
    for (one, other) in plain.tasks.iter().zip(&biased.tasks).flat_map(|(a, b)| a.segments.iter().zip(&b.segments)) {
        assert_eq!(one.primitive, other.primitive);
        for (one, other) in one.tips.iter().zip(&other.tips).flat_map(|(a, b)| a.force.iter().zip(&b.force)) {
            let off = (Vector3::from(*one) - Vector3::from(*other)).norm();
            assert!(off < 0.01, "{one:?} without, {other:?} with a bias");
            compared += 1;
        }
    }
    assert!(compared > 1000, "{compared}");
}

/// Without contact flags a fingertip touches by the params of the rules, as in the analysis.
#[test]
fn a_finger_touches_by_the_params_of_the_rules() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let (log, out) = (path("log.csv"), path("commands.json"));
    demonstrate("pick_and_place", &[], &log);
    let text = std::fs::read_to_string(&log).unwrap();
    let header = text.lines().position(|line| line.contains("right.thumb.force.x")).unwrap();
    let names: Vec<&str> = text.lines().nth(header).unwrap().split(',').collect();
    let is_kept = |at: usize| !(names[at].starts_with("right.") && names[at].ends_with(".contact"));
    assert!((0..names.len()).any(|at| !is_kept(at)), "the log has contact flags");
    let without = text.lines().enumerate().map(|(number, line)| match line.split(',').collect::<Vec<_>>() {
        cells if number < header || cells.len() != names.len() => line.to_string(),
        cells => (0..cells.len()).filter(|at| is_kept(*at)).map(|at| cells[at]).collect::<Vec<_>>().join(","),
    });
    std::fs::write(&log, without.collect::<Vec<_>>().join("\n") + "\n").unwrap();

    let pressing = |set: &[&str]| {
        let all = [&["retarget", &log, "-o", &out], set].concat();
        assert!(teachtree(&all).status.success(), "{set:?}");
        let commands = Commands::read(&std::fs::read_to_string(&out).unwrap(), "commands.json").unwrap();
        let tips = commands.tasks.iter().flat_map(|task| &task.segments).flat_map(|segment| &segment.tips);
        tips.flat_map(|tip| &tip.force).filter(|force| Vector3::from(**force).norm() > 0.0).count()
    };
    let shipped = pressing(&[]);
    assert_eq!(shipped, pressing(&["--set", "touch_on=0.05N", "--set", "touch_off=0.02N"]));
    let later = pressing(&["--set", "touch_on=0.5N", "--set", "touch_off=0.4N"]);
    assert!(0 < later && later < shipped, "{later} samples with a force, {shipped} with the shipped params");
}

/// A robot program contains the intended motion: `retarget` loads the default rules without failures, whose names a binding may use.
#[test]
fn a_binding_may_name_failures() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let (binding, out) = (path("b.yaml"), path("commands.json"));
    let demos = concat!(env!("CARGO_MANIFEST_DIR"), "/demos/robosuite");
    let [log, shipped, scene] =
        ["lift_demo_1.csv", "panda_lift.binding.yaml", "panda_lift.scene.yaml"].map(|name| format!("{demos}/{name}"));
    let text = std::fs::read_to_string(&shipped).unwrap();
    std::fs::write(&binding, text + "\nparams: {miss_meet: 40 mm}\nsignals: {fell: start of Drop of cube}\n").unwrap();
    let inputs = [&log, "--binding", &binding, "--scene", &scene].map(ToString::to_string);
    let run = |command: &str, more: &[&str]| {
        let inputs: Vec<&str> = inputs.iter().map(String::as_str).collect();
        teachtree(&[&[command], &inputs[..], more].concat())
    };
    let analyzed = run("analyze", &[]);
    assert!(said(&analyzed).contains("miss_meet = 40 mm"), "{}{}", said(&analyzed), complained(&analyzed));
    let to = ["--robot", "parallel_jaw", "-o", &out];
    let retargeted = run("retarget", &to);
    assert!(retargeted.status.success(), "{}", complained(&retargeted));
    // On the command line, a param without effect is an error.
    let refused = run("retarget", &[&to[..], &["--set", "miss_meet=40mm"]].concat());
    assert_eq!(refused.status.code(), Some(2));
    assert!(complained(&refused).contains("there is no param `miss_meet` to override"), "{}", complained(&refused));
}

/// The joint trajectory of commands, checked by differences of its own.
pub fn within_the_limits_of_the_robot(commands: &Commands, scene: &str) {
    let robot = robot::open("both_hands", &|file| Err(InputError::new(file, "is not a shipped robot"))).unwrap();
    let made = trajectory(commands, &robot, &world::scene(scene).unwrap(), None).unwrap();
    assert_eq!(made.slowed.iter().flat_map(|slowed| &slowed.tasks).count(), commands.tasks.len());
    // What a controller makes of it that joins positions and velocities by cubic polynomials; numbers are written with six decimals.
    for pair in made.points.windows(2) {
        let step = pair[1].time_from_start.seconds() - pair[0].time_from_start.seconds();
        let rounding = 6.0 * 1e-6 / step.powi(2) + 6.0 * 1e-6 / step;
        for (joint, name) in made.joint_names.iter().enumerate() {
            let dof = &robot.tree.dofs[robot.tree.dof(name).unwrap()];
            let [(p0, v0), (p1, v1)] = [0, 1].map(|at: usize| (pair[at].positions[joint], pair[at].velocities[joint]));
            let mean = (p1 - p0) / step;
            let speed = (1.5 * mean - 0.25 * (v0 + v1)).abs().max(v0.abs()).max(v1.abs());
            let [first, last] = [6.0 * mean - 4.0 * v0 - 2.0 * v1, 4.0 * v1 + 2.0 * v0 - 6.0 * mean];
            let acceleration = first.abs().max(last.abs()) / step;
            let at = pair[0].time_from_start;
            assert!(acceleration <= dof.acceleration + rounding, "{name}: {acceleration} rad/s^2 at {at:?}");
            assert!(speed <= dof.speed * 1.02, "{name}: {speed} rad/s at {at:?}");
            let [low, high] = dof.range;
            assert!((low - 1e-6..=high + 1e-6).contains(&p1), "{name}: {p1} rad at {at:?}");
        }
    }
    // It is hardly slower than the person, and begins and ends at rest.
    assert!(made.slowed.iter().all(|slowed| slowed.times < 1.5), "{:?}", made.slowed);
    let rests = [made.points.first(), made.points.last()].map(|point| point.unwrap().velocities.clone());
    assert!(rests.iter().flatten().all(|velocity| *velocity == 0.0));
}

/// A recording may be taught again in its place, also when its scene and operator are called like it; and mistakes of a script are reported at their line.
#[test]
fn a_recording_is_taught_again_in_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let scenes = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let script = std::fs::read_to_string(scenes.join("stamp.operator.yaml")).unwrap();
    std::fs::copy(scenes.join("stamp.yaml"), path("mine.yaml")).unwrap();
    std::fs::write(path("mine.operator.yaml"), &script).unwrap();
    let (scene, operator, log) = (path("mine.yaml"), path("mine.operator.yaml"), path("mine.csv"));
    for _ in 0..2 {
        let taught = teachtree(&["teach", &scene, &operator, "-o", &log]);
        assert!(taught.status.success(), "{}", complained(&taught));
    }
    // What it is simulated from, and the scene that it reads, are not to be lost.
    let lost = teachtree(&["teach", &path("mine.scene.yaml"), &operator, "-o", &log]);
    assert!(complained(&lost).contains("mine.scene.yaml: is an input of this command"), "{}", complained(&lost));

    // A folder or a file that is called like something shipped is not it.
    let there = |args: &[&str]| teachtree_in(folder.path(), args);
    for _ in 0..2 {
        let taught = there(&["teach", "stamp", "stamp", "-o", "stamp"]);
        assert!(taught.status.success(), "{}", complained(&taught));
    }

    let line = script.lines().position(|line| line.contains("close: {")).unwrap();
    let wrong = script.lines().enumerate().map(|(at, text)| match at == line {
        true => "      - {close: {force: 30 N}}\n".into(),
        false => format!("{text}\n"),
    });
    std::fs::write(&operator, wrong.collect::<String>()).unwrap();
    let printed = complained(&teachtree(&["teach", &scene, &operator, "-o", &log]));
    let place = format!("mine.operator.yaml:{}:", line + 1);
    assert!(
        printed.contains(&place) && printed.contains("has force 30 N, expected more than 0 and at most 5 N"),
        "{printed}"
    );
}

/// What a hand cannot give is reported before it is tried; where there is nothing to command, what was commanded before is left.
#[test]
fn commands_that_ask_too_much_or_nothing_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let robots = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("robots");
    let hand = std::fs::read_to_string(robots.join("gifu_hand_iii_right.yaml")).unwrap();
    let weak = hand.replace("force: 4 N", "force: 0.5 N");
    assert_ne!(hand, weak);
    std::fs::write(path("weak.yaml"), weak).unwrap();
    let (log, out) = (path("log.csv"), path("commands.json"));
    demonstrate("pick_and_place", &[], &log);
    let commanded = |robot: &str| {
        let done = teachtree(&["command", &log, "--robot", robot, "-o", &out]);
        (done.status.code(), String::from_utf8(done.stdout).unwrap())
    };
    let (code, printed) = commanded(&path("weak.yaml"));
    assert!(
        printed.contains(
            "warning: task 1 (right pick_and_place) requires 1.15 N of the thumb, which gives 0.50 N at most"
        ),
        "{printed}"
    );
    assert_eq!(code, Some(0));
    assert!(!commanded("gifu_hand_iii_right").1.contains("warning"));

    let kept = std::fs::read_to_string(&out).unwrap();
    demonstrate("no_task", &[], &log);
    let (code, printed) = commanded("gifu_hand_iii_right");
    assert!(printed.contains("no commands are written"), "{printed}");
    assert_eq!((code, std::fs::read_to_string(&out).unwrap()), (Some(1), kept));
}
