//! `cargo run --release --example robot -- 1..20` prints the table of docs/robot.md: what comes of people's demonstrations when the robot of two arms
//! carries them out in the scene in which they were given; `-- 1..10 peg` of the scenes whose names contain `peg`. With
//! `displaced` among the names every object stands up to 20 mm and 10° elsewhere, and the robot is told so.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program says what it does")]

#[path = "../recognition/ruleset.rs"]
#[allow(dead_code, reason = "the other example needs more of it")]
mod ruleset;

use nalgebra::{UnitQuaternion, Vector3};
use rayon::prelude::*;
use ruleset::RuleSet;
use std::process::ExitCode;
use teachtree::base::error::InputError;
use teachtree::base::geometry::unit;
use teachtree::base::scene::{Role, Scene};
use teachtree::robot::simulate::{Outcome, simulate};
use teachtree::robot::{self, Robot};
use teachtree::{command, stream, world};

const SCENES: [&str; 13] = [
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
];

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
    let rules = RuleSet::load("contact.rules", vec![])?;
    let robot = robot::open("both_hands", &|file| Err(InputError::new(file, "is no shipped robot")))
        .map_err(|error| error.to_string())?;
    println!("| scene | people | done | farthest, of those done | not done |\n|---|---|---|---|---|");
    let (mut people, mut all_done) = (0, 0);
    let displaced = wanted.iter().any(|word| word == "displaced");
    let wanted: Vec<&String> = wanted.iter().filter(|word| *word != "displaced").collect();
    let is_wanted = |scene: &&str| wanted.is_empty() || wanted.iter().any(|part| scene.contains(part.as_str()));
    // What stands in a socket or a nest cannot stand elsewhere.
    let stands_free = |scene: &&str| !(displaced && ["ball", "peg_pullout_from_hole", "turn_screw"].contains(scene));
    for scene in SCENES.into_iter().filter(is_wanted).filter(stands_free) {
        let outcomes: Vec<(u64, Result<Vec<Outcome>, InputError>)> = (first..=last)
            .into_par_iter()
            .map(|seed| (seed, carried_out(scene, seed, displaced, &rules, &robot)))
            .collect();
        let (mut done, mut off, mut turned) = (0, 0.0_f64, 0.0_f64);
        let mut failed = Vec::new();
        for (seed, outcomes) in &outcomes {
            match outcomes {
                Ok(outcomes) if !outcomes.is_empty() && outcomes.iter().all(|outcome| outcome.done) => {
                    done += 1;
                    off = outcomes.iter().fold(off, |most, outcome| most.max(outcome.off));
                    turned = outcomes.iter().fold(turned, |most, outcome| most.max(outcome.turned));
                }
                Ok(_) => failed.push(seed.to_string()),
                Err(error) => {
                    eprintln!("{scene} {seed}: {error}");
                    failed.push(format!("{seed} (refused)"));
                }
            }
        }
        people += outcomes.len();
        all_done += done;
        let (off, turned) = (off * 1e3, turned.to_degrees());
        println!("| `{scene}` | {} | {done} | {off:.1} mm, {turned:.1}° | {} |", outcomes.len(), failed.join(", "));
    }
    println!("| all | {people} | {all_done} | | |");
    Ok(())
}

/// A person's demonstration, from the recording to what the robot made of it.
fn carried_out(
    scene: &str,
    seed: u64,
    displaced: bool,
    rules: &RuleSet,
    robot: &Robot,
) -> Result<Vec<Outcome>, InputError> {
    let stage = world::scene(scene)?;
    let recording = world::teach(&stage, &world::operator(scene)?, seed)?;
    let said = rules.over(&recording)?;
    let mut commands = command::commands(&stream::trusted(&recording, &[])?, &said.analysis, scene)?;
    robot::map(&mut commands, robot, &recording.scene)?;
    let stage = if displaced { with_objects_elsewhere(stage, seed) } else { stage };
    Ok(simulate(&commands, robot, &stage, &mut |_| {})?.outcomes)
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
