//! A gripper on a wrist force sensor: the gripper decides what is held, the force what the held thing meets.

use crate::program::{all_said, said, teachtree_in};
use serde_json::Value;
use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::Path;

/// Primitive, start and end, s.
type TimedLabels = Vec<(String, f64, f64)>;

/// The tasks and the segments that are found in a log with a tool point, an opening, and a force at the wrist.
fn found(log: &str, closed_below: f64) -> (Vec<String>, TimedLabels) {
    found_in(log, closed_below, "", "{}")
}

/// The same with the lines of other channels, and with the bodies of a scene.
fn found_in(log: &str, closed_below: f64, channels: &str, bodies: &str) -> (Vec<String>, TimedLabels) {
    let binding = format!(
        "
hand_file: hand_gripper_wrist.rules
params: {{contact_on: 0.2 N, contact_off: 0.1 N}}
resample: 100 Hz
channels:
  right.thumb.position: p<xyz>
  right.palm.force: f<xyz>
  right.gripper.closed: opening < {closed_below}
  right.gripper.opening: opening
{channels}scene: {{bodies: {bodies}}}
"
    );
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("log.csv"), log).unwrap();
    std::fs::write(folder.path().join("b.yaml"), binding).unwrap();
    let output = teachtree_in(folder.path(), &["analyze", "log.csv", "--binding", "b.yaml", "--format", "json"]);
    assert!(output.status.success(), "{}", all_said(&output));
    let analysis: Value = serde_json::from_str(&said(&output)).unwrap();
    let time = |it: &Value, key: &str| it[key].as_f64().unwrap();
    let tasks = analysis["tracks"][0]["tasks"].as_array().unwrap().iter();
    let segments = analysis["tracks"][0]["relabeled"].as_array().unwrap().iter();
    (
        tasks.map(|it| it["task"].as_str().unwrap().to_string()).filter(|task| task != "unknown").collect(),
        segments
            .map(|it| (it["primitive"].as_str().unwrap().to_string(), time(it, "start_s"), time(it, "end_s")))
            .collect(),
    )
}

/// The recording as a sensor at the wrist would see it: the recorded forces of the surroundings on what both fingers hold, and its weight, N.
fn at_the_wrist(recording: &str, objects: &[&str], weight: f64) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("demos/robosuite").join(recording);
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names: HashMap<&str, usize> =
        lines.next().unwrap().split(',').enumerate().map(|(at, name)| (name, at)).collect();
    let mut out = String::from("time,px,py,pz,opening,fx,fy,fz\n");
    // The flags of a hold flicker, its weight does not.
    let mut held_s = f64::NEG_INFINITY;
    for line in lines {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let read = |name: &str| names.get(name).map_or(0.0, |at| cells[*at]);
        let mut force = [0.0; 3];
        for of in objects.iter().filter(|of| [1, 2].iter().all(|it| read(&format!("C_R_f{it}_{of}")) > 0.5)) {
            held_s = read("t");
            for (sum, axis) in force.iter_mut().zip(["x", "y", "z"]) {
                *sum += read(&format!("F_{of}_env_{axis}"));
                for other in objects {
                    *sum += read(&format!("F_{other}_{of}_{axis}")) - read(&format!("F_{of}_{other}_{axis}"));
                }
            }
        }
        if read("t") - held_s < 0.3 {
            force[2] -= weight;
            let touches = |of: &&str| [1, 2].iter().any(|it| read(&format!("C_R_f{it}_{of}")) > 0.5);
            held_s = if objects.iter().any(touches) { read("t") } else { held_s };
        }
        let [x, y, z] = ["R_hand_px", "R_hand_py", "R_hand_pz"].map(read);
        let [fx, fy, fz] = force;
        let _ = writeln!(out, "{},{x},{y},{z},{},{fx},{fy},{fz}", read("t"), read("R_opening"));
    }
    out
}

fn assert_begins(found: &TimedLabels, name: &str, at: f64) {
    assert!(
        found.iter().any(|(label, start, _)| label == name && (start - at).abs() <= 0.05),
        "{name} {at}: {found:?}"
    );
}

/// The contacts of the recordings: the square nut meets its peg at 17.91 s; the round one meets the rim at 35.16 s, the contact is lost while its hole is
/// looked for, and it is let go at 36.97 s. The nut of the other arm slips about its peg from 18.90 s on.
#[test]
fn nuts_are_put_down_from_when_they_meet_their_pegs_with_contact_from_a_fifth_of_a_newton() {
    for weight in [0.0, 1.0, 5.0] {
        let log = at_the_wrist("SawyerNutAssembly_demo_1.csv", &["RoundNut0", "SquareNut0"], weight);
        let (tasks, segments) = found(&log, 0.0618);
        assert_eq!(tasks, ["pick_and_place", "pick_and_place"], "{weight} N: {segments:?}");
        assert_begins(&segments, "Place", 17.91);
        // It touches the rim with 0.18 N at 34.62 s, which counts where the level of contact that is learned is lower. The recorded weight has no inertia: so
        // slight a force counts only when the inertia of 5 N is small.
        let meets_rim_s = if weight == 1.0 {
            34.62
        } else if weight == 5.0 {
            35.51
        } else {
            35.16
        };
        assert_begins(&segments, "Place", meets_rim_s);
        assert_eq!(segments.iter().filter(|it| it.0 == "Place").count(), 2, "{weight} N: {segments:?}");
        let log = at_the_wrist("nut_assembly_panda_demo_1.csv", &["RoundNut0", "SquareNut0"], weight);
        let (tasks, segments) = found(&log, 0.0717);
        assert_eq!(tasks, ["pick_and_place"], "{weight} N: {segments:?}");
        assert_begins(&segments, "Place", 18.90);
    }
}

#[test]
fn a_cube_is_put_down_where_it_meets_the_other_and_lifted_off_again() {
    for weight in [0.0, 1.0] {
        let log = at_the_wrist("stack_panda_demo_1.csv", &["cubeA", "cubeB"], weight);
        let (tasks, segments) = found(&log, 0.0762);
        assert_eq!(tasks, ["pick_and_place"], "{segments:?}");
        assert_begins(&segments, "Place", 21.70);
        assert_begins(&segments, "Translate", 23.85);
    }
}

#[test]
fn what_is_dropped_or_only_lifted_is_put_down_nowhere() {
    for (recording, objects, closed) in [
        ("SawyerStack_demo_1.csv", &["cubeA", "cubeB"][..], 0.0625),
        ("SawyerPickPlace_demo_1.csv", &["Milk0", "Bread0", "Cereal0", "Can0"], 0.069),
        ("SawyerLift_demo_1.csv", &["cube"], 0.0627),
        ("lift_demo_1.csv", &["cube"], 0.0778),
    ] {
        for weight in [0.0, 1.0] {
            let (tasks, segments) = found(&at_the_wrist(recording, objects, weight), closed);
            // This gripper closes at the cube at 8.2 s, opens again at 8.4 s, and takes it at 10.9 s.
            let missed = if recording == "SawyerLift_demo_1.csv" { &["missed_grasp"][..] } else { &[] };
            assert_eq!(tasks, [missed, &["pick_and_place"]].concat(), "{recording}: {segments:?}");
            assert!(segments.iter().all(|it| it.0 != "Place" && it.0 != "Follow"), "{recording}: {segments:?}");
        }
    }
}

/// A thing is held from 4 s to 12 s and carried from 5 s to 8 s; the sensor feels `empty` N from 1 s to 2 s, and 5 N more from `meets` s to 10 s.
fn carried(empty: f64, meets: f64) -> String {
    let mut log = String::from("time,px,py,pz,opening,fx,fy,fz\n");
    for row in 0..1600 {
        let time = f64::from(row) * 0.01;
        let x = 0.05 * (time - 5.0).clamp(0.0, 5.0);
        let opening = if (4.0..12.0).contains(&time) { 0.02 } else { 0.08 };
        let bump = if (1.0..2.0).contains(&time) { empty } else { 0.0 };
        let pressed = if (meets..10.0).contains(&time) { 5.0 } else { 0.0 };
        let _ = writeln!(log, "{time:.2},{x},0,0.3,{opening},{bump},0,{pressed}");
    }
    log
}

#[test]
fn an_empty_gripper_that_bumps_into_something_meets_nothing() {
    let (_, segments) = found(&carried(8.0, 20.0), 0.05);
    assert!(
        segments.iter().filter(|it| it.2 < 3.9).all(|it| ["Move", "Approach"].contains(&it.0.as_str())),
        "{segments:?}"
    );
}

#[test]
fn a_held_thing_that_meets_a_surface_while_the_hand_travels_follows_it() {
    let (tasks, segments) = found(&carried(0.0, 7.0), 0.05);
    // Without the position of the object, its distance along the surface is unknown.
    assert_eq!(tasks, ["pick_and_place"], "{segments:?}");
    assert_begins(&segments, "Follow", 7.0);
}

#[test]
fn a_held_thing_that_comes_down_on_a_surface_is_put_down_there_however_fast() {
    for speed in [0.005, 0.020, 0.060] {
        // It is carried from 5 s to 8 s, goes down from 9 s on by 60 mm, meets a surface, presses on it for 2 s, and is carried for 3 s more.
        let meets = 9.0 + 0.06 / speed;
        let mut log = String::from("time,px,py,pz,opening,fx,fy,fz\n");
        for row in 0..2800 {
            let time = f64::from(row) * 0.01;
            let x = 0.05 * ((time - 5.0).clamp(0.0, 3.0) + (time - meets - 2.0).clamp(0.0, 3.0));
            let z = 0.3 - speed * (time - 9.0).clamp(0.0, meets - 9.0);
            let opening = if (4.0..meets + 5.0).contains(&time) { 0.02 } else { 0.08 };
            let pressed = if (meets..meets + 2.0).contains(&time) { 5.0 } else { 0.0 };
            let _ = writeln!(log, "{time:.2},{x},0,{z},{opening},0.1,0,{pressed}");
        }
        let (_, segments) = found(&log, 0.05);
        assert_begins(&segments, "Place", meets);
        assert!(segments.iter().all(|it| it.0 != "Follow"), "{speed} m/s: {segments:?}");
    }
}

/// A peg is drawn out of a hole of 40 mm from 5 s to 7 s against 6 N, carried, and put down with 12 N at 11 s.
#[test]
fn a_peg_hangs_freely_when_it_has_left_its_hole() {
    let mut log = String::from("time,px,py,pz,opening,fx,fy,fz\n");
    for row in 0..1600 {
        let time = f64::from(row) * 0.01;
        let between = |from: f64, to: f64| ((time - from) / (to - from)).clamp(0.0, 1.0);
        let x = 0.2 * between(8.0, 9.5);
        let z = 0.07 + 0.045 * between(5.0, 7.0) + 0.085 * between(7.0, 8.0) - 0.15 * between(9.5, 11.0);
        let opening = if (4.0..12.0).contains(&time) { 0.02 } else { 0.08 };
        let force = match time {
            5.0..6.8 => -7.5,
            6.8..11.0 => -1.5,
            11.0..12.0 => 10.5,
            _ => 0.0,
        };
        let _ = writeln!(log, "{time:.2},{x},0,{z},{opening},0,0,{force}");
    }
    let bodies = "{peg: {role: object, radius: 20 mm}, block: {role: socket, position: [0 m, 0 m, 110 mm], \
                  sockets: {hole: {rim: [0 m, 0 m, 0 m], axis: [0, 0, 1], radius: 15 mm, depth: 45 mm}}}}";
    let (tasks, segments) = found_in(&log, 0.05, "  peg.position: p<xyz>\n", bodies);
    assert_eq!(tasks, ["peg_pullout_from_hole"], "{segments:?}");
    assert_begins(&segments, "Place", 11.0);
    assert_eq!(segments.iter().filter(|it| it.0 == "Place").count(), 1, "{segments:?}");
}
