//! Operators that fail on purpose: the ground truth of each failure agrees with the physics of the recording.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::ops::Range;
use teachtree_base::recording::Recording;
use teachtree_world::{self as world, Failure, FailurePlan, Operator};

/// Height of the rim of the holder, and the plug point of the peg in its own frame, m.
const RIM_M: f64 = 0.040;
const PLUG_M: [f64; 3] = [0.0, 0.0, -0.040];
const GRAVITY: f64 = 9.81;

fn operator(name: &str) -> Operator {
    world::operator(name).unwrap()
}

fn taught(name: &str, seed: u64) -> Recording {
    let (_, scene) = world::shipped::failing().find(|(failing, _)| *failing == name).unwrap();
    world::teach(&world::scene(scene).unwrap(), &operator(name), seed).unwrap()
}

/// The intervals of a primitive of a hand.
fn intervals(recording: &Recording, hand: &str, primitive: &str) -> Vec<Range<usize>> {
    let labels = &recording.labels[&format!("{hand}.label")];
    let mut start = 0;
    let runs = labels.chunk_by(|one, next| one == next).map(|run| {
        start += run.len();
        (run[0] == primitive, start - run.len()..start)
    });
    runs.filter_map(|(found, run)| found.then_some(run)).collect()
}

fn tasks(recording: &Recording, hand: &str) -> Vec<String> {
    let mut tasks = recording.labels[&format!("{hand}.task")].clone();
    tasks.dedup();
    tasks.retain(|task| !task.is_empty());
    tasks
}

fn vector(recording: &Recording, name: &str, row: usize) -> Vector3<f64> {
    Vector3::from(["x", "y", "z"].map(|part| recording.columns[&format!("{name}.{part}")].values[row]))
}

fn rotation(recording: &Recording, name: &str, row: usize) -> UnitQuaternion<f64> {
    let [w, x, y, z] =
        ["w", "x", "y", "z"].map(|part| recording.columns[&format!("{name}.rotation.{part}")].values[row]);
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

fn has_failed(recording: &Recording, failure: &str) -> bool {
    recording.events.iter().any(|event| event.kind == "failure_started" && event.subjects[1] == failure)
}

/// The speed increases by g t, less the share that the fingers still bear, and the object touches no body.
#[test]
fn a_dropped_object_is_in_free_fall() {
    for (name, seeds) in [("pick_and_place_drop", 1..9), ("hand_over_drop", 1..5), ("independent_drop", 1..4)] {
        for seed in seeds {
            let recording = taught(name, seed);
            let mut falls = 0;
            for (hand, object) in [("right", "box"), ("left", "box"), ("right", "right_box"), ("left", "left_box")] {
                let labels = recording.labels.contains_key(&format!("{hand}.label"));
                if !labels || !recording.columns.contains_key(&format!("{object}.velocity.z")) {
                    continue;
                }
                for drop in intervals(&recording, hand, "Drop") {
                    let speed = |row: usize| vector(&recording, &format!("{object}.velocity"), row).z;
                    let seconds = (drop.end - 1 - drop.start) as f64 / 1000.0;
                    let acceleration = (speed(drop.start) - speed(drop.end - 1)) / seconds;
                    assert!(
                        (0.8 * GRAVITY..=1.01 * GRAVITY).contains(&acceleration),
                        "{name} {seed}: {acceleration} m/s² in {drop:?}"
                    );
                    let base = &recording.columns[&format!("contact.{object}.base.force.z")].values;
                    assert!(base[drop].iter().all(|force| *force == 0.0), "{name} {seed}");
                    assert!(tasks(&recording, hand).contains(&"dropped".into()), "{name} {seed}");
                    falls += 1;
                }
            }
            assert!(falls > 0, "{name} {seed}");
        }
    }
}

/// The plug point stays above the rim, or less than a millimeter below it, while the rim bears the force.
#[test]
fn a_jam_presses_on_the_rim_and_inserts_nothing() {
    let mut forces = Vec::new();
    for seed in 1..9 {
        let recording = taught("peg_in_hole_jam", seed);
        let jams = intervals(&recording, "right", "Jam");
        assert!(!jams.is_empty(), "{seed}");
        let inserted = !intervals(&recording, "right", "Insert").is_empty();
        let expected = if inserted { "peg_in_hole" } else { "failed_insertion" };
        assert_eq!(tasks(&recording, "right").last().map(String::as_str), Some(expected), "{seed}");
        for jam in jams {
            let force = &recording.columns["contact.peg.holder.force.z"].values;
            let mean = force[jam.clone()].iter().sum::<f64>() / jam.len() as f64;
            assert!(mean > 4.0, "{seed}: {mean} N in {jam:?}");
            for row in jam {
                let plug =
                    vector(&recording, "peg.position", row) + rotation(&recording, "peg", row) * Vector3::from(PLUG_M);
                assert!(plug.z - RIM_M > -0.001, "{seed}: {} m deep at {row}", RIM_M - plug.z);
            }
            forces.push(mean);
        }
    }
    let (least, most) =
        (forces.iter().copied().fold(f64::INFINITY, f64::min), forces.iter().copied().fold(0.0, f64::max));
    assert!(least < 10.0 && most > 15.0, "forces are drawn: {least} to {most} N");
}

/// A peg that is put back after a jam, then grasped again, is two tasks.
#[test]
fn a_second_attempt_is_a_task_of_its_own() {
    let attempts: Vec<Vec<String>> = (1..20).map(|seed| tasks(&taught("peg_in_hole_jam", seed), "right")).collect();
    for expected in [&["failed_insertion"][..], &["peg_in_hole"], &["failed_insertion", "peg_in_hole"]] {
        assert!(attempts.iter().any(|tasks| tasks == expected), "{expected:?} in {attempts:?}");
    }
}

/// The object moves against the fingers that hold it, and does not touch the base.
#[test]
fn an_object_that_slips_is_still_held() {
    for seed in 1..9 {
        let recording = taught("pick_and_place_slip", seed);
        let slips = intervals(&recording, "right", "Slip");
        assert!(has_failed(&recording, "slip") && !slips.is_empty(), "{seed}");
        assert_eq!(tasks(&recording, "right"), ["pick_and_place"], "{seed}");
        for slip in slips {
            let tips = ["thumb", "index", "middle"].map(|finger| format!("right.{finger}.position"));
            let offset = |row: usize| {
                let middle = tips.iter().map(|tip| vector(&recording, tip, row)).sum::<Vector3<f64>>() / 3.0;
                vector(&recording, "box.position", row) - middle
            };
            let (from, to) = (slip.start, slip.end - 1);
            let turned = rotation(&recording, "box", from).angle_to(&rotation(&recording, "box", to));
            let way = (offset(to) - offset(from)).norm();
            assert!(way > 0.002 || turned > 0.1, "{seed}: {way} m, {turned} rad");
            let base = &recording.columns["contact.box.base.force.z"].values;
            assert!(base[slip].iter().all(|force| *force == 0.0), "{seed}");
        }
    }
}

/// What slips out of the fingers is dropped.
#[test]
fn an_object_that_is_not_caught_is_dropped() {
    let recording = taught("pick_and_place_slip", 160);
    assert!(has_failed(&recording, "slip") && !intervals(&recording, "right", "Drop").is_empty());
    assert!(intervals(&recording, "right", "Slip").is_empty());
    assert_eq!(tasks(&recording, "right"), ["dropped"]);
}

/// The hand closes and opens again while the object stays in place.
#[test]
fn a_missed_object_stays() {
    for (name, object) in [("pick_and_place_miss", "box"), ("peg_in_hole_miss", "peg")] {
        for seed in 1..9 {
            let recording = taught(name, seed);
            let misses = intervals(&recording, "right", "Miss");
            assert!(!misses.is_empty(), "{name} {seed}");
            assert_eq!(tasks(&recording, "right")[0], "missed_grasp", "{name} {seed}");
            for miss in misses {
                let place = |row: usize| vector(&recording, &format!("{object}.position"), row);
                let moved = (place(miss.end - 1) - place(miss.start)).norm();
                assert!(moved < 0.010, "{name} {seed}: {moved} m");
                let opening = &recording.columns["right.gripper.opening"].values;
                let after = opening.get(miss.end + 300).or(opening.last()).unwrap();
                assert!(*after > opening[miss.start] + 0.004, "{name} {seed}: opened to {after} m");
            }
        }
    }
}

/// The force at the wrist changes, and the task continues.
#[test]
fn a_collision_has_a_force_peak() {
    for (name, task) in [("pick_over_wall_collision", "Place"), ("peg_in_hole_collision", "Insert")] {
        for seed in 1..10 {
            let recording = taught(name, seed);
            let mut collisions = intervals(&recording, "right", "Collision");
            collisions.extend(intervals(&recording, "right", "Bump"));
            collisions.sort_by_key(|collision| collision.start);
            assert!(!collisions.is_empty(), "{name} {seed}");
            let last = collisions.last().map_or(0, |collision| collision.end);
            for collision in collisions {
                let before = vector(&recording, "right.palm.force", collision.start.saturating_sub(200));
                let change = |row: usize| (vector(&recording, "right.palm.force", row) - before).norm();
                let peak = collision.clone().map(change).fold(0.0, f64::max);
                assert!(peak > 0.5, "{name} {seed}: {peak} N");
            }
            assert!(intervals(&recording, "right", task).iter().any(|it| it.start > last), "{name} {seed}");
            assert!(tasks(&recording, "right").contains(&"collided".into()), "{name} {seed}");
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_failure() {
    assert!(taught("pick_and_place_miss", 4) == taught("pick_and_place_miss", 4));
    assert!(taught("pick_and_place_miss", 4).labels != taught("pick_and_place_miss", 5).labels);
}

/// A plan without failing seeds does not change a recording. Its ground truth contains only the slips and drops of perturbations.
#[test]
fn recordings_without_failures_do_not_change() {
    for name in world::shipped::names() {
        let scene = world::scene(name).unwrap();
        let plan = FailurePlan { kinds: vec![Failure::Miss, Failure::Slip], share: 0.0, obstacle: None };
        let never = Operator { failures: Some(plan), ..operator(name) };
        let (plain, never) =
            (world::teach(&scene, &operator(name), 1).unwrap(), world::teach(&scene, &never, 1).unwrap());
        assert!(plain.columns == never.columns, "{name}");
        let slips = plain.events.iter().any(|event| {
            let perturbation = event.subjects.get(1).filter(|_| event.kind == "perturbation_started");
            event.kind == "object_lost" || perturbation.is_some_and(|name| ["slip", "drop"].contains(&name.as_str()))
        });
        assert!(slips || plain == never, "{name}");
    }
}

#[test]
fn a_share_of_the_seeds_fails() {
    let scene = world::scene("pick_and_place").unwrap();
    let mut operator = operator("pick_and_place_slip");
    operator.failures.as_mut().unwrap().share = 0.25;
    let failed = (1..=24).filter(|seed| has_failed(&world::teach(&scene, &operator, *seed).unwrap(), "slip")).count();
    assert!((5..=7).contains(&failed), "{failed} of 24");
}

/// Hands of scale 4 squeeze with four times the force.
#[test]
fn the_force_scale_multiplies_forces() {
    let machine = |scale: f64| {
        let plain = operator("pick_and_place");
        let operator = Operator { variation: world::Variation::default(), force_scale: scale, ..plain };
        world::teach(&world::scene("pick_and_place").unwrap(), &operator, 1).unwrap()
    };
    let (weak, strong) = (machine(1.0), machine(4.0));
    let carried = |recording: &Recording| {
        let row = intervals(recording, "right", "Translate")[0].start + 1500;
        vector(recording, "right.thumb.force", row).y
    };
    let ratio = carried(&strong) / carried(&weak);
    assert!((ratio - 4.0).abs() < 0.1, "{ratio}");
    assert_eq!(tasks(&strong, "right"), ["pick_and_place"]);
}

#[test]
fn invalid_failure_plans_are_rejected() {
    let (_, text) = world::shipped::operators().find(|(name, _)| *name == "pick_and_place_slip").unwrap();
    let refused = |to: &str| {
        let text = text.replace("failures: {kinds: [slip]}", to);
        let scene = world::scene("pick_and_place").unwrap();
        let read = Operator::read(&text, "own.operator.yaml");
        read.and_then(|operator| world::teach(&scene, &operator, 1)).err().map(|error| error.to_string()).unwrap()
    };
    let wrong = [
        "failures: {kinds: [jam]}",
        "failures: {kinds: []}",
        "failures: {kinds: [fall]}",
        "failures: {kinds: [slip], share: 2}",
        "failures: {kinds: [collision]}",
        "failures: {kinds: [collision], obstacle: blok}",
        "force_scale: 0",
    ];
    insta::assert_snapshot!(wrong.map(|to| format!("{to}\n  {}", refused(to))).join("\n"));
}
