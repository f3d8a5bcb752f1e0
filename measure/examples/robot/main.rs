//! `cargo example robot -- 1..20` prints a table of docs/measurements/robot.md: the robot with two arms executes the demonstrations of simulated
//! operators in their scenes. Further arguments:
//!
//! - `peg`: only scenes whose names contain `peg`, or the one with that name;
//! - `displaced`: every object is up to 20 mm and 10° elsewhere, known to the robot;
//! - `unknown`: the robot sees every object up to 2 mm to each side of its true position, in scenes that end in contact;
//! - `slow`: the operator takes three times as long;
//! - `noisy`: every position of the recording is off by 1 mm (standard deviation, each sample by itself), and every force by 0.1 N;
//! - the name of another shipped robot, such as `arm_with_gripper`.
//!
//! The least gaps are those over all operators: between the arms with their hands, between links and bodies, and between links and the object that their hand handles.
//! `retarget` is the longest time that mapping and planning take; give one seed at a time to have the processor to itself.
//!
//! Operators that lose what they hold, tasks that were not done, tasks that the rules find differently in the robot's recording, and arms that go through each other are listed.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program prints")]

#[path = "../recognition/ruleset.rs"]
#[allow(dead_code, reason = "the other example uses all of it")]
mod ruleset;

#[path = "../recognition/transforms.rs"]
#[allow(dead_code, reason = "the other example uses all of it")]
mod transforms;

use nalgebra::{UnitQuaternion, Vector3};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Normal};
use rayon::prelude::*;
use ruleset::RuleSet;
use std::process::ExitCode;
use std::time::Instant;
use teachtree_analysis::{Analysis, Track};
use teachtree_base::error::InputError;
use teachtree_base::geometry::unit;
use teachtree_base::quantity::Quantity;
use teachtree_base::recording::Recording;
use teachtree_base::scene::{Role, Scene};
use teachtree_base::units::Dimension;
use teachtree_command as command;
use teachtree_command::TouchForces;
use teachtree_frames as stream;
use teachtree_measure::seeds;
use teachtree_robot::simulation::arm_clearance::{ACCEPTED_M, Collision, MinDistances};
use teachtree_robot::simulation::trace::Trace;
use teachtree_robot::simulation::{CellVariation, Performance, TaskOutcome, simulate_varied};
use teachtree_robot::{self as robot, Robot};
use teachtree_world as world;
use transforms::slowed;

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

/// Scenes that end in contact with a fixed body.
const END_IN_CONTACT: [&str; 7] =
    ["pick_and_place", "pick_and_press", "stamp", "peg_in_hole", "peg_in_hole_tight", "turn_knob", "turn_screw"];

/// What is otherwise: displacements of objects, known or unknown to the robot; the recording.
#[derive(Clone, Copy, Default)]
struct Conditions {
    displaced: bool,
    unknown: bool,
    slow: bool,
    noisy: bool,
}

/// The words for them.
const WORDS: [&str; 4] = ["displaced", "unknown", "slow", "noisy"];
/// How many times as long a slow operator takes.
const SLOW: f64 = 3.0;
/// Standard deviations of noise, m and N.
const NOISE: [(Dimension, f64); 2] = [(Dimension::LENGTH, 0.001), (Dimension::FORCE, 0.1)];

/// The result of one demonstration.
struct DemonstrationResult {
    outcomes: Vec<TaskOutcome>,
    /// The commanded tasks, and those that the rules find in the robot's recording.
    tasks: [Vec<String>; 2],
    /// The least gaps, and what the hands did where the arms came nearest.
    nearest: MinDistances,
    at_nearest: String,
    /// What an arm went through.
    collisions: Vec<Collision>,
    /// How long the mapping to the robot took, s.
    mapped_s: f64,
}

impl DemonstrationResult {
    /// The least gaps between arms, from links to bodies, and from links to what the hand handles, m.
    fn gaps(&self) -> [f64; 3] {
        let MinDistances { arms, scene, handled } = &self.nearest;
        [arms, scene, handled].map(|nearest| nearest.as_ref().map_or(f64::INFINITY, |nearest| nearest.gap))
    }

    /// Whether anything penetrated something by more than is accepted.
    fn collides(&self) -> bool {
        self.gaps()[0] < -ACCEPTED_M || self.collisions.iter().any(|it| it.depth_m > ACCEPTED_M)
    }
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
    let seeds = seeds::parse(seeds)?;
    let rules = [RuleSet::load("contact.rules", vec![])?, RuleSet::load("bimanual.rules", vec![])?];
    let (robots, wanted): (Vec<&String>, Vec<&String>) =
        wanted.iter().partition(|word| robot::names().any(|name| name == word.as_str()));
    let robot = robots.first().map_or("both_hands", |name| name.as_str());
    let robot = robot::open(robot, &|file| Err(InputError::new(file, "is not a shipped robot")))
        .map_err(|error| error.to_string())?;
    println!(
        "| scene | operators | done | largest error of those done | forces kept | same tasks | least gaps: arms, bodies, handled object | deeper than 3 mm | `retarget` | not done |\n|---|---|---|---|---|---|---|---|---|---|"
    );
    let (mut operators, mut all_done, mut all_kept, mut all_same, mut all_collide) = (0, 0, 0, 0, 0);
    let says = |what: &str| wanted.iter().any(|word| *word == what);
    let [displaced, unknown, slow, noisy] = WORDS.map(says);
    let otherwise = Conditions { displaced, unknown, slow, noisy };
    let wanted: Vec<&String> = wanted.into_iter().filter(|word| !WORDS.contains(&word.as_str())).collect();
    let named = |word: &str, scene: &str| if SCENES.contains(&word) { word == scene } else { scene.contains(word) };
    let is_wanted = |scene: &&str| wanted.is_empty() || wanted.iter().any(|word| named(word, scene));
    // An object in a socket or a nest cannot be otherwise.
    let stands_free =
        |scene: &&str| !(otherwise.displaced && ["ball", "peg_pullout_from_hole", "turn_screw"].contains(scene));
    let ends_in_contact = |scene: &&str| !otherwise.unknown || END_IN_CONTACT.contains(scene);
    for scene in SCENES.into_iter().filter(is_wanted).filter(stands_free).filter(ends_in_contact) {
        let came: Vec<(u64, Result<DemonstrationResult, InputError>)> = seeds
            .clone()
            .into_par_iter()
            .map(|seed| {
                let recording = demonstrated(scene, seed, otherwise);
                // What an operator loses may be thrown about: no robot can do that again.
                let loses = |recording: &Recording| recording.events.iter().any(|event| event.kind == "object_lost");
                if recording.as_ref().is_ok_and(loses) {
                    eprintln!("{scene} {seed}: the operator loses what is held");
                }
                (seed, recording.and_then(|recording| carried_out(scene, seed, recording, otherwise, &rules, &robot)))
            })
            .collect();
        let (mut done, mut kept, mut same, mut off, mut turned) = (0, 0, 0, 0.0_f64, 0.0_f64);
        let mut failed = Vec::new();
        for (seed, came) in &came {
            if let Ok(DemonstrationResult { outcomes, .. }) = came {
                for it in outcomes.iter().filter(|it| !it.forces.kept()) {
                    let (forces, pressed) = (&it.forces, it.forces.largest);
                    let shares = [forces.fingers, forces.total].map(|share| share * 100.0);
                    eprintln!(
                        "{scene} {seed}: forces of {} {}: fingers {:.0} %, total {:.0} %, {pressed:.2} N of {:.2} N",
                        it.side, it.task, shares[0], shares[1], forces.allowed
                    );
                }
                kept += usize::from(!outcomes.is_empty() && outcomes.iter().all(|it| it.forces.kept()));
            }
            match came {
                Ok(came) if !came.outcomes.is_empty() && came.outcomes.iter().all(|outcome| outcome.done) => {
                    done += 1;
                    off = came.outcomes.iter().fold(off, |most, outcome| most.max(outcome.off));
                    turned = came.outcomes.iter().fold(turned, |most, outcome| most.max(outcome.turned));
                }
                Ok(came) => {
                    for it in &came.outcomes {
                        let (off, turned) = (it.off * 1e3, it.turned.to_degrees());
                        let searched = it.searched.map_or_else(String::new, |searched| format!(", {searched}"));
                        match it.fell_s {
                            Some(fell_s) => {
                                eprintln!("{scene} {seed}: {} {} fell off after {fell_s:.1} s", it.side, it.task)
                            }
                            None => eprintln!(
                                "{scene} {seed}: {} {} is {off:.1} mm, {turned:.1}° off{searched}",
                                it.side, it.task
                            ),
                        }
                    }
                    failed.push(seed.to_string());
                }
                Err(error) => {
                    eprintln!("{scene} {seed}: {error}");
                    failed.push(format!("{seed} (refused)"));
                }
            }
            if let Ok(DemonstrationResult { nearest: MinDistances { arms: Some(nearest), .. }, .. }) = came
                && nearest.passes_through()
            {
                let (by, [one, other]) = (-nearest.gap * 1e3, &nearest.links);
                eprintln!(
                    "{scene} {seed}: {one} and {other} are in each other by {by:.1} mm, after {:.1} s ({})",
                    nearest.time_s,
                    came.as_ref().map_or("", |came| came.at_nearest.as_str())
                );
            }
            for Collision { link, with, time_s, depth_m, lasts_s } in came.iter().flat_map(|came| &came.collisions) {
                let deep = depth_m * 1e3;
                eprintln!(
                    "{scene} {seed}: {link} goes through {with} by {deep:.1} mm for {lasts_s:.2} s, after {time_s:.1} s"
                );
            }
            if let Ok(DemonstrationResult { tasks: [commanded, performed], .. }) = came {
                same += usize::from(commanded == performed);
                if commanded != performed {
                    eprintln!("{scene} {seed}: commanded {}, performed {}", commanded.join(", "), performed.join(", "));
                }
            }
        }
        operators += came.len();
        all_done += done;
        all_kept += kept;
        all_same += same;
        let (off, turned, failed) = (off * 1e3, turned.to_degrees(), failed.join(", "));
        let results = || came.iter().filter_map(|(_, came)| came.as_ref().ok());
        let gaps = [0, 1, 2].map(|kind| {
            let least = results().map(|it| it.gaps()[kind]).fold(f64::INFINITY, f64::min);
            if least.is_finite() { format!("{:.1}", least * 1e3) } else { "–".into() }
        });
        let collide = results().filter(|it| it.collides()).count();
        let mapped_s = results().map(|it| it.mapped_s).fold(0.0, f64::max);
        println!(
            "| `{scene}` | {} | {done} | {off:.1} mm, {turned:.1}° | {kept} | {same} | {} mm | {collide} | {mapped_s:.1} s | {failed} |",
            came.len(),
            gaps.join(", ")
        );
        all_collide += collide;
    }
    println!("| all | {operators} | {all_done} | | {all_kept} | {all_same} | | {all_collide} | | |");
    Ok(())
}

/// The recording of an operator.
fn demonstrated(scene: &str, seed: u64, otherwise: Conditions) -> Result<Recording, InputError> {
    let mut recording = world::teach(&world::scene(scene)?, &world::operator(scene)?, seed)?;
    if otherwise.slow {
        recording = slowed(recording, SLOW);
    }
    if otherwise.noisy {
        add_noise(&mut recording, seed);
    }
    Ok(recording)
}

/// Runs one demonstration from the recording to the robot's result; the rules are those for one hand and for both.
fn carried_out(
    scene: &str,
    seed: u64,
    recording: Recording,
    otherwise: Conditions,
    rules: &[RuleSet; 2],
    robot: &Robot,
) -> Result<DemonstrationResult, InputError> {
    let stage = world::scene(scene)?;
    let rules = &rules[usize::from(stage.hands.len() > 1)];
    let said = rules.over(&recording)?.analysis;
    let mut commands = command::commands(&stream::trusted(&recording, &[])?, &said, TouchForces::default(), scene)?;
    let begun = Instant::now();
    robot::map(&mut commands, robot, &recording.scene)?;
    let mapped_s = begun.elapsed().as_secs_f64();
    let stage = if otherwise.displaced { with_objects_elsewhere(stage, seed) } else { stage };
    let off = if otherwise.unknown { [3, 4, 5].map(|step| 0.002 * share(seed, step)) } else { [0.0; 3] };
    let variation = CellVariation { pose_error: off.map(Quantity), ..CellVariation::default() };
    let performance = simulate_varied(&commands, robot, &stage, &variation, &mut |_| {})?;
    let again = rules.over(&performance.recording)?.analysis;
    let commanded = commands.tasks.iter().map(|task| format!("{} {}", task.track, task.task)).collect();
    let tasks = [commanded, names(&again)].map(sorted);
    let at_nearest =
        performance.nearest.arms.as_ref().map_or(String::new(), |it| doing_at(&performance.trace, it.time_s));
    let Performance { outcomes, nearest, collisions, .. } = performance;
    Ok(DemonstrationResult { outcomes, tasks, nearest, at_nearest, collisions, mapped_s })
}

/// What the hands did at a time, s.
fn doing_at(trace: &Trace, time_s: f64) -> String {
    let then = trace.moments.iter().filter(|moment| (moment.time_s - time_s).abs() < 1e-9);
    then.map(|moment| format!("{} {}", trace.limbs[moment.limb].side, moment.primitive)).collect::<Vec<_>>().join(", ")
}

/// Adds noise to positions and forces.
fn add_noise(recording: &mut Recording, seed: u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for column in recording.columns.values_mut() {
        let Some((_, sigma)) = NOISE.iter().find(|(dimension, _)| *dimension == column.dimension) else { continue };
        let Ok(normal) = Normal::new(0.0, *sigma) else { continue };
        column.values.iter_mut().for_each(|value| *value += normal.sample(&mut rng));
    }
}

/// Compares tasks by hand, since the hands may begin in another order.
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

/// Returns a number from -1 to 1 for a seed; the golden ratio distributes seeds evenly.
fn share(seed: u64, step: u64) -> f64 {
    2.0 * (((3 * seed + step) as f64 * 0.618_033_988_749_895).fract()) - 1.0
}

/// Displaces every free object by up to 20 mm to either side and rotates it by up to 10°, determined by the seed.
fn with_objects_elsewhere(mut scene: Scene, seed: u64) -> Scene {
    for body in scene.bodies.values_mut().filter(|body| body.role == Role::Object) {
        body.position[0].0 += 0.020 * share(seed, 0);
        body.position[1].0 += 0.020 * share(seed, 1);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 10.0_f64.to_radians() * share(seed, 2));
        let turned = turn * unit(body.rotation);
        body.rotation = [turned.w, turned.i, turned.j, turned.k];
    }
    scene
}
