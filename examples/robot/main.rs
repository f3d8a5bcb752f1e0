//! `cargo run --release --example robot -- 1..20` prints the table of docs/robot.md: what comes of people's demonstrations when the robot of two arms
//! carries them out in the scene in which they were given; `-- 1..10 peg` of the scenes whose names contain `peg`, or of the one with that name. With
//! `displaced` among the names every object stands up to 20 mm and 10° elsewhere, and the robot is told so. What was not done, and tasks that the same
//! rules find otherwise in the robot's recording, are told beside it.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program says what it does")]

#[path = "../recognition/ruleset.rs"]
#[allow(dead_code, reason = "the other example needs more of it")]
mod ruleset;

use nalgebra::{UnitQuaternion, Vector3};
use rayon::prelude::*;
use ruleset::RuleSet;
use std::process::ExitCode;
use teachtree::analysis::{Analysis, Track};
use teachtree::base::error::InputError;
use teachtree::base::geometry::unit;
use teachtree::base::scene::{Role, Scene};
use teachtree::robot::simulate::{Outcome, simulate};
use teachtree::robot::{self, Robot};
use teachtree::{command, stream, world};

const SCENES: [&str; 22] = [
    "pick_and_place",
    "pick_and_follow",
    "pick_and_press",
    "stamp",
    "push",
    "push_and_trace",
    "slide",
    "ball",
    "peg_in_hole",
    "peg_in_hole_tight",
    "peg_pullout_from_hole",
    "turn_knob",
    "turn_screw",
    "hand_over_left_to_right",
    "hand_over_right_to_left",
    "equal_carry",
    "follow_together",
    "main_grasp",
    "push_together",
    "hold_and_insert",
    "ring_and_pole",
    "independent",
];

/// What came of a demonstration.
struct Came {
    outcomes: Vec<Outcome>,
    /// The tasks that were commanded, and those that rules find in the robot's recording.
    tasks: [Vec<String>; 2],
}

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let (seeds, wanted) = args.split_first().map_or(("1..10", &[][..]), |(seeds, wanted)| (seeds.as_str(), wanted));
    match run(seeds, wanted) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn run(seeds: &str, wanted: &[String]) -> Result<(), String> {
    let parsed = seeds.split_once("..").and_then(|(first, last)| Some((first.parse().ok()?, last.parse().ok()?)));
    let (first, last): (u64, u64) = parsed.ok_or_else(|| format!("`{seeds}`: wanted seeds such as 1..10"))?;
    let rules = [RuleSet::load("contact.rules", vec![])?, RuleSet::load("bimanual.rules", vec![])?];
    let robot = robot::open("both_hands", &|file| Err(InputError::new(file, "is no shipped robot")))
        .map_err(|error| error.to_string())?;
    println!("| scene | people | done | farthest, of those done | same tasks | not done |\n|---|---|---|---|---|---|");
    let (mut people, mut all_done, mut all_same) = (0, 0, 0);
    let displaced = wanted.iter().any(|word| word == "displaced");
    let wanted: Vec<&String> = wanted.iter().filter(|word| *word != "displaced").collect();
    let named = |word: &str, scene: &str| if SCENES.contains(&word) { word == scene } else { scene.contains(word) };
    let is_wanted = |scene: &&str| wanted.is_empty() || wanted.iter().any(|word| named(word, scene));
    // What stands in a socket or a nest cannot stand elsewhere.
    let stands_free = |scene: &&str| !(displaced && ["ball", "peg_pullout_from_hole", "turn_screw"].contains(scene));
    for scene in SCENES.into_iter().filter(is_wanted).filter(stands_free) {
        let came: Vec<(u64, Result<Came, InputError>)> = (first..=last)
            .into_par_iter()
            .map(|seed| (seed, carried_out(scene, seed, displaced, &rules, &robot)))
            .collect();
        let (mut done, mut same, mut off, mut turned) = (0, 0, 0.0_f64, 0.0_f64);
        let mut failed = Vec::new();
        for (seed, came) in &came {
            match came {
                Ok(came) if !came.outcomes.is_empty() && came.outcomes.iter().all(|outcome| outcome.done) => {
                    done += 1;
                    off = came.outcomes.iter().fold(off, |most, outcome| most.max(outcome.off));
                    turned = came.outcomes.iter().fold(turned, |most, outcome| most.max(outcome.turned));
                }
                Ok(came) => {
                    for it in &came.outcomes {
                        let (off, turned) = (it.off * 1e3, it.turned.to_degrees());
                        eprintln!("{scene} {seed}: {} {} is {off:.1} mm, {turned:.1}° off", it.side, it.task);
                    }
                    failed.push(seed.to_string());
                }
                Err(error) => {
                    eprintln!("{scene} {seed}: {error}");
                    failed.push(format!("{seed} (refused)"));
                }
            }
            if let Ok(Came { tasks: [commanded, performed], .. }) = came {
                same += usize::from(commanded == performed);
                if commanded != performed {
                    eprintln!("{scene} {seed}: commanded {}, performed {}", commanded.join(", "), performed.join(", "));
                }
            }
        }
        people += came.len();
        all_done += done;
        all_same += same;
        let (off, turned, failed) = (off * 1e3, turned.to_degrees(), failed.join(", "));
        println!("| `{scene}` | {} | {done} | {off:.1} mm, {turned:.1}° | {same} | {failed} |", came.len());
    }
    println!("| all | {people} | {all_done} | | {all_same} | |");
    Ok(())
}

/// A person's demonstration, from the recording to what the robot made of it; rules are those for one hand and for both.
fn carried_out(
    scene: &str,
    seed: u64,
    displaced: bool,
    rules: &[RuleSet; 2],
    robot: &Robot,
) -> Result<Came, InputError> {
    let stage = world::scene(scene)?;
    let recording = world::teach(&stage, &world::operator(scene)?, seed)?;
    let rules = &rules[usize::from(stage.hands.len() > 1)];
    let said = rules.over(&recording)?.analysis;
    let mut commands = command::commands(&stream::trusted(&recording, &[])?, &said, scene)?;
    robot::map(&mut commands, robot, &recording.scene)?;
    let stage = if displaced { with_objects_elsewhere(stage, seed) } else { stage };
    let performance = simulate(&commands, robot, &stage, &mut |_| {})?;
    let again = rules.over(&performance.recording)?.analysis;
    let commanded = commands.tasks.iter().map(|task| format!("{} {}", task.track, task.task)).collect();
    Ok(Came { outcomes: performance.outcomes, tasks: [commanded, names(&again)].map(sorted) })
}

/// Hands may begin in another order.
fn sorted(mut names: Vec<String>) -> Vec<String> {
    names.sort();
    names
}

/// The tasks of each hand, in order.
fn names(said: &Analysis) -> Vec<String> {
    let named =
        |track: &Track| track.tasks.iter().map(|span| format!("{} {}", track.who, span.task)).collect::<Vec<_>>();
    said.tracks.iter().flat_map(named).collect()
}

/// Every object that stands by itself up to 20 mm to either side and up to 10° turned, the same way for the same seed.
fn with_objects_elsewhere(mut scene: Scene, seed: u64) -> Scene {
    // The golden ratio spreads seeds evenly.
    let share = |step: u64| 2.0 * (((3 * seed + step) as f64 * 0.618_033_988_749_895).fract()) - 1.0;
    for body in scene.bodies.values_mut().filter(|body| body.role == Role::Object) {
        body.position[0].0 += 0.020 * share(0);
        body.position[1].0 += 0.020 * share(1);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 10.0_f64.to_radians() * share(2));
        let turned = turn * unit(body.rotation);
        body.rotation = [turned.w, turned.i, turned.j, turned.k];
    }
    scene
}
