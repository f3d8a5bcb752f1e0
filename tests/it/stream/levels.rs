//! Contact levels that are learned from the log, and hands of which the log says little.

use crate::program::{all_said, said, teachtree_in};
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

const WRIST: &str = "
hand_file: hand_wrist.rules
channels:
  right.palm.position: p<xyz>
  right.palm.force: f<xyz>
  tool.position: p<xyz>
scene:
  bodies:
    tool: {role: object, radius: 50 mm, fixed_to: right}
";

/// Noise that is the same in every run, from -1 to 1.
fn noise(row: usize, axis: usize) -> f64 {
    let hash = (row * 3 + axis).wrapping_mul(2_654_435_761) % 10_007;
    hash as f64 / 5003.5 - 1.0
}

/// A tool that rubs from 3 s to 7 s and from 9 s to 11 s with `force` N, on a sensor that rests at (1.5, -1.2, 0.8) times `rest` N and is moved.
fn rubbing(force: f64, rest: f64) -> String {
    let mut text = String::from("time,px,py,pz,fx,fy,fz\n");
    for row in 0..1400 {
        let time = f64::from(row) * 0.01;
        let rubs = (3.0..7.0).contains(&time) || (9.0..11.0).contains(&time);
        let place = 0.1 * (TAU * time / 4.0).sin();
        let sway = 0.1 * rest * (TAU * time / 5.0).sin();
        let pressed = if rubs { force * (1.0 + 0.1 * (TAU * time * 1.3).sin()) } else { 0.0 };
        let [x, y, z] = [1.5 * rest + sway, -1.2 * rest, 0.8 * rest + pressed];
        let scatter = |axis| 0.02 * force * noise(row as usize, axis);
        let _ = writeln!(text, "{time},{place},0,0.3,{},{},{}", x + scatter(0), y + scatter(1), z + scatter(2));
    }
    text
}

fn analysis(folder: &Path, log: &str, binding: &str) -> Value {
    std::fs::write(folder.join("log.csv"), log).unwrap();
    std::fs::write(folder.join("b.yaml"), binding).unwrap();
    let output = teachtree_in(folder, &["analyze", "log.csv", "--binding", "b.yaml", "--format", "json"]);
    assert!(output.status.success(), "{}", all_said(&output));
    serde_json::from_str(&said(&output)).unwrap()
}

fn issues<'a>(analysis: &'a Value, kind: &str) -> Vec<&'a str> {
    let all = analysis["issues"].as_array().unwrap().iter();
    all.filter(|issue| issue["kind"] == kind).map(|issue| issue["message"].as_str().unwrap()).collect()
}

/// The times in which the tool rubs, s.
fn traced(analysis: &Value) -> Vec<(f64, f64)> {
    let segments = analysis["tracks"][0]["relabeled"].as_array().unwrap().iter();
    let traces = segments.filter(|it| it["primitive"] == "Trace");
    traces.map(|it| (it["start_s"].as_f64().unwrap(), it["end_s"].as_f64().unwrap())).collect()
}

#[test]
fn a_contact_is_found_whatever_the_sensor_reads_at_rest_and_however_strong_it_is() {
    let folder = tempfile::tempdir().unwrap();
    for (force, rest) in [(8.0, 0.0), (8.0, 1.0), (30.0, 5.0), (120.0, 10.0)] {
        let analysis = analysis(folder.path(), &rubbing(force, rest), WRIST);
        let found = traced(&analysis);
        let right = |(found, wanted): (&(f64, f64), &(f64, f64))| {
            (found.0 - wanted.0).abs() <= 0.05 && (found.1 - wanted.1).abs() <= 0.05
        };
        let wanted = [(3.0, 7.0), (9.0, 11.0)];
        assert!(found.len() == 2 && found.iter().zip(&wanted).all(right), "{force} N, rest {rest}: {found:?}");
        assert_eq!(issues(&analysis, "biased").len(), usize::from(rest > 0.0), "{analysis:#}");
        assert!(issues(&analysis, "no_contact_level").is_empty());
    }
}

#[test]
fn a_force_without_two_groups_has_no_level_and_that_is_an_issue() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from("time,px,py,pz,fx,fy,fz\n");
    for row in 0..1400 {
        // Every force up to 20 N is as frequent as every other one.
        let force = 20.0 * ((f64::from(row) * 0.005).fract() * 2.0 - 1.0).abs();
        let _ = writeln!(text, "{},0,0,0.3,0,0,{}", f64::from(row) * 0.01, force);
    }
    let found = analysis(folder.path(), &text, WRIST);
    let told = issues(&found, "no_contact_level");
    assert!(told.len() == 1 && told[0].contains("above 5 N, the threshold of the rules"), "{told:?}");
    // A level that the binding fixes is not learned.
    let fixed = WRIST.replace("  tool.position", "  right.palm.level: = 12 N\n  tool.position");
    assert!(issues(&analysis(folder.path(), &text, &fixed), "no_contact_level").is_empty());
}

#[test]
fn a_sensor_that_never_reads_less_than_a_contact_wants_a_tare() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from("time,px,py,pz,fx,fy,fz\n");
    for row in 0..1400 {
        // A tool of 60 N, and forces of up to 10 N at random.
        let _ = writeln!(text, "{},0,0,0.3,0,0,{}", f64::from(row) * 0.01, 60.0 + 10.0 * noise(row as usize, 0));
    }
    let found = analysis(folder.path(), &text, WRIST);
    let told = issues(&found, "no_contact_level");
    assert!(
        told.len() == 1 && told[0].contains("99 % of the readings are above 50.") && told[0].ends_with("`tare`"),
        "{told:?}"
    );
    let tared = format!("tare: {{channels: [right.palm.force], from: 0 s, to: 1 s}}{WRIST}");
    let found = analysis(folder.path(), &text, &tared);
    assert!(issues(&found, "no_contact_level").iter().all(|told| !told.contains("`tare`")), "{found:#}");
}

#[test]
fn the_weight_of_an_object_is_not_contact_whose_level_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    // A second group of 3 N.
    let told = |binding: &str| issues(&analysis(folder.path(), &rubbing(3.0, 0.1), binding), "no_contact_level").len();
    let with_cube = |mass: &str| format!("{WRIST}    cube: {{role: object, radius: 20 mm, mass: {mass}}}\n");
    assert_eq!([told(WRIST), told(&with_cube("500 g")), told(&with_cube("300 g"))], [1, 1, 0]);
    // A gripper that closes for 3 N up holds an object of this weight; a force down is that of a press.
    let log = rubbing(3.0, 0.1);
    let closes = |line: &str| {
        let time: f64 = line.split(',').next().unwrap().parse().unwrap_or(f64::NAN);
        let closed = (2.9..7.1).contains(&time) || (8.9..11.1).contains(&time);
        format!("{line},{}\n", if time.is_nan() { "closed".into() } else { u8::from(closed).to_string() })
    };
    let log: String = log.lines().map(closes).collect();
    let told = |force: &str| {
        let binding =
            WRIST.replace("f<xyz>", force).replace("  tool.pos", "  right.gripper.closed: closed\n  tool.pos");
        issues(&analysis(folder.path(), &log, &binding), "no_contact_level").len()
    };
    assert_eq!([told("f<xyz>"), told("[fx, fy, -fz]")], [0, 1]);
}

#[test]
fn a_log_that_only_moves_is_not_in_contact() {
    let folder = tempfile::tempdir().unwrap();
    // Rest at 0.1 N, motion at 3 N: two groups, but no force that the rules take for contact.
    assert_eq!(traced(&analysis(folder.path(), &rubbing(3.0, 0.1), WRIST)), []);
}

/// A heavy tool that a person leads by the hand to three buttons, and turns on the way: each press lasts 0.4 s and reads 25 N.
fn buttons() -> String {
    let mut text = String::from("time,px,py,pz,qw,qx,qy,qz,fx,fy,fz\n");
    for row in 0..1500 {
        let time = f64::from(row) * 0.01;
        // Up and down once in 5 s, down from 2.5 s to 2.9 s.
        let (button, phase) = ((time / 5.0).floor(), time % 5.0);
        let down = if phase < 2.5 { phase / 2.5 } else { (1.0 - (phase - 2.9).max(0.0) / 2.1).max(0.0) };
        let height = 0.2 * (1.0 - down * down * (3.0 - 2.0 * down));
        let (roll, half) = (0.7 * (TAU * time / 5.0).sin(), 0.5 * 0.7 * (TAU * time / 5.0).sin());
        let presses = (2.5..2.9).contains(&phase);
        // It weighs 25 N, upward in the reading, in the frame of the tool.
        let [weight_y, weight_z] = [25.0 * roll.sin(), 25.0 * roll.cos()];
        let pressed = if presses { 25.0 } else { 0.0 };
        let read = [0.0, weight_y - pressed * roll.sin(), weight_z - pressed * roll.cos()];
        let _ = write!(text, "{time},{},0,{height},{},{},0,0", 0.3 + 0.1 * button, half.cos(), half.sin());
        let noisy = read.iter().enumerate().map(|(axis, force)| force + 0.3 * noise(row as usize, axis));
        noisy.for_each(|force| text.push_str(&format!(",{force}")));
        text.push('\n');
    }
    text
}

#[test]
fn buttons_that_a_heavy_tool_presses_are_presses_and_turning_it_is_not_contact() {
    let folder = tempfile::tempdir().unwrap();
    let binding = WRIST.replace("  tool.position", "  tool.rotation: q<wxyz>\n  tool.position");
    let analysis = analysis(folder.path(), &buttons(), &binding);
    let segments = analysis["tracks"][0]["relabeled"].as_array().unwrap().iter();
    let contacts: Vec<(&str, f64)> = segments
        .map(|it| (it["primitive"].as_str().unwrap(), it["start_s"].as_f64().unwrap()))
        .filter(|(name, _)| !["Move", "Approach", "Release"].contains(name))
        .collect();
    let right = |((name, start_s), wanted_s): (&(&str, f64), f64)| *name == "Press" && (start_s - wanted_s).abs() < 0.1;
    assert!(contacts.len() == 3, "{contacts:?} {:#}", analysis["issues"]);
    assert!(contacts.iter().zip([2.5, 7.5, 12.5]).all(right), "{contacts:?}");
}

const FINGERS: &str = "
hand_file: hand_force.rules
channels:
  right.thumb.position: t<xyz>
  right.thumb.force: ft<xyz>
  right.index.position: i<xyz>
  right.index.force: fi<xyz>
  cube.position: c<xyz>
scene:
  bodies:
    cube: {role: object, radius: 30 mm, mass: 100 g}
";

#[test]
fn fingertips_that_drift_by_newtons_still_let_go() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from("time,tx,ty,tz,ftx,fty,ftz,ix,iy,iz,fix,fiy,fiz,cx,cy,cz\n");
    for row in 0..1000 {
        let time = f64::from(row) * 0.01;
        // The hand comes from 300 mm away, holds the cube from 4 s to 7 s and leaves.
        let away = if time < 4.0 { (4.0 - time) * 0.08 } else { (time - 7.0).max(0.0) * 0.1 };
        let squeeze = if (4.0..7.0).contains(&time) { 6.0 } else { 0.0 };
        let drift = 2.3 + 0.3 * (TAU * time / 8.0).sin();
        let _ = writeln!(
            text,
            "{time},-0.03,0,{away},{},0.1,{drift},0.03,0,{away},{},-0.2,{drift},0,0,0",
            squeeze + 0.02 * noise(row as usize, 0),
            -squeeze + 0.02 * noise(row as usize, 1),
        );
    }
    let analysis = analysis(folder.path(), &text, FINGERS);
    let segments = analysis["tracks"][0]["segments"].as_array().unwrap();
    let begins = |name: &str| {
        let found = segments.iter().find(|it| it["primitive"] == name);
        found.unwrap_or_else(|| panic!("no {name}: {segments:#?}"))["start_s"].as_f64().unwrap()
    };
    assert!((begins("Release") - 7.0).abs() <= 0.05, "{segments:#?}");
    let held = segments.iter().find(|it| it["end_s"].as_f64().unwrap() > 5.5).unwrap();
    assert!((held["start_s"].as_f64().unwrap() - 4.0).abs() <= 0.05, "{segments:#?}");
    assert_eq!(issues(&analysis, "biased").len(), 2, "{analysis:#}");
}

#[test]
fn a_gripper_needs_no_position() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from("time,opening\n");
    for row in 0..600 {
        let opening = if (200..400).contains(&row) { 20 } else { 80 };
        let _ = writeln!(text, "{},{opening}", f64::from(row) * 0.02);
    }
    let binding = "
hand_file: hand_gripper.rules
channels: {right.gripper.closed: 'opening [mm] < 50 mm'}
scene: {bodies: {}}
";
    let analysis = analysis(folder.path(), &text, binding);
    let segments = analysis["tracks"][0]["relabeled"].as_array().unwrap();
    let grasp = segments.iter().find(|it| it["primitive"] == "Grasp").unwrap();
    assert!(
        (grasp["start_s"].as_f64().unwrap() - 4.0).abs() < 0.05
            && (grasp["end_s"].as_f64().unwrap() - 8.0).abs() < 0.05
    );
    let lacking = issues(&analysis, "missing_channel");
    assert!(
        lacking.iter().any(|message| message.contains("no distance and no motion of the hand is known")),
        "{lacking:?}"
    );
    // A hand model that asks for the distance refuses the log.
    std::fs::write(folder.path().join("b.yaml"), binding.replace("hand_gripper", "hand_flags")).unwrap();
    let output = teachtree_in(folder.path(), &["analyze", "log.csv", "--binding", "b.yaml"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(all_said(&output).contains("fingers.position"), "{}", all_said(&output));
}

#[test]
fn a_gripper_that_shuts_holds_nothing() {
    let folder = tempfile::tempdir().unwrap();
    // It closes upon nothing from 4 s to 8 s, and upon something from 12 s to 16 s.
    let mut text = String::from("time,opening\n");
    for row in 0..1000 {
        let target = if (200..400).contains(&row) {
            0.0
        } else if (600..800).contains(&row) {
            20.0
        } else {
            80.0
        };
        let _ = writeln!(text, "{},{target}", f64::from(row) * 0.02);
    }
    let binding = "
hand_file: hand_gripper.rules
channels:
  right.gripper.closed: opening [mm] < 50 mm
  right.gripper.opening: opening [mm]
scene: {bodies: {}}
";
    let grasps = |binding: &str| -> Vec<f64> {
        let found = analysis(folder.path(), &text, binding);
        let segments = found["tracks"][0]["relabeled"].as_array().unwrap().iter();
        segments.filter(|it| it["primitive"] == "Grasp").map(|it| it["start_s"].as_f64().unwrap()).collect()
    };
    // Jaws that jump come to rest with the next row.
    assert_eq!(grasps(binding), [12.02]);
    // Without the opening a closed gripper holds something.
    assert_eq!(grasps(&binding.replace("  right.gripper.opening: opening [mm]\n", "")), [4.0, 12.0]);
}

#[test]
fn a_gripper_that_never_closes_and_a_contact_that_never_ends_are_issues() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from("time,opening,tx,ty,tz,touch\n");
    for row in 0..300 {
        let _ = writeln!(text, "{},{},0,0,{},1", f64::from(row) * 0.02, 70 + row % 10, f64::from(row) * 0.001);
    }
    let binding = "
hand_file: hand_flags.rules
channels:
  right.thumb.position: t<xyz>
  right.thumb.contact: touch
  right.gripper.closed: opening [mm] < 50 mm
scene: {bodies: {cube: {role: object, radius: 30 mm}}}
";
    let told = |binding: &str| {
        let found = analysis(folder.path(), &text, binding);
        issues(&found, "constant_flag").into_iter().map(str::to_string).collect::<Vec<String>>()
    };
    let found = told(binding);
    assert!(
        found.len() == 2 && found[0].contains("never closed") && found[1].contains("lasts as long as the log"),
        "{found:?}"
    );
    // A flag that changes is none.
    let changing = binding.replace("50 mm", "75 mm").replace("contact: touch", "contact: opening [mm] > 74 mm");
    assert_eq!(told(&changing), Vec::<String>::new());
    // A constant that the binding writes is a statement; one in a column is an issue with the line that says so.
    let stated = binding.replace("contact: touch", "contact: \"= 1\"").replace("opening [mm] < 50 mm", "\"= 1\"");
    assert_eq!(told(&stated), Vec::<String>::new());
    let measured = told(&binding.replace("closed: opening [mm] < 50 mm", "closed: touch"));
    assert!(measured.iter().any(|it| it.contains("closed throughout") && it.ends_with("bind `= 1`")), "{measured:?}");
    let never = binding.replace("hand_flags", "hand_gripper").replace("opening [mm] < 50 mm", "\"= 0\"");
    let found = analysis(folder.path(), &text, &never);
    let undetectable = issues(&found, "undetectable");
    let stated = undetectable.iter().find(|it| it.contains("Grasp")).unwrap();
    assert!(stated.ends_with("cannot be detected: the binding sets `right.gripper.closed` to 0"), "{undetectable:?}");
}

#[test]
fn a_smooth_force_that_freezes_while_the_hand_moves_is_stuck() {
    let folder = tempfile::tempdir().unwrap();
    let frozen = |from: u32, to: u32| {
        let mut text = String::from("time,px,py,pz,fx,fy,fz\n");
        for row in 0..1400 {
            let time = f64::from(row) * 0.01;
            // Smooth, as of a filtered sensor: it has no noise that turns round.
            let measured = if (from..to).contains(&row) { f64::from(from) * 0.01 } else { time };
            let force = 12.0 + 6.0 * (TAU * measured / 7.0).sin();
            let _ = writeln!(
                text,
                "{time},{},0,0.3,{},{},{force}",
                0.05 * time,
                1.5 + 1e-4 * measured,
                0.7 + 1e-4 * measured
            );
        }
        text
    };
    let stuck = |log: &str| issues(&analysis(folder.path(), log, WRIST), "stuck_sensor").len();
    assert_eq!(stuck(&frozen(500, 890)), 1);
    assert_eq!(stuck(&frozen(0, 0)), 0);
}

#[test]
fn init_guesses_where_a_gripper_is_closed() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from("time,opening [mm],pz [mm]\n");
    for row in 0..600 {
        let opening = f64::from(if (200..400).contains(&row) { 20 } else { 80 }) + noise(row as usize, 0);
        let _ = writeln!(text, "{},{opening},{}", f64::from(row) * 0.02, f64::from(row));
    }
    std::fs::write(folder.path().join("log.csv"), text).unwrap();
    let output = teachtree_in(folder.path(), &["init", "log.csv", "--yes"]);
    assert_ne!(output.status.code(), Some(2), "{}", all_said(&output));
    let binding = std::fs::read_to_string(folder.path().join("log.binding.yaml")).unwrap();
    let line = binding.lines().find(|line| {
        line.contains("right.gripper.closed: opening <") && line.contains("# closed about 20, open about 80: ")
    });
    let limit =
        line.unwrap_or_else(|| panic!("{binding}")).split('<').nth(1).unwrap().split_whitespace().next().unwrap();
    assert!((45.0..55.0).contains(&limit.parse::<f64>().unwrap()), "{binding}");
    assert!(!binding.contains("closed: pz"), "{binding}");
}
