//! `cargo bench -p teachtree-measure --bench world`: steps per second of the virtual environment with ten fingertips in contact, compared with
//! MuJoCo on the same scene in the same run (if `python3` has the package `mujoco`), and the forces compared with their closed forms.
#![allow(missing_docs, reason = "a program")]
#![allow(clippy::print_stdout, clippy::expect_used, reason = "a program that stops when something is wrong")]

use nalgebra::{Isometry3, Point3};
use std::process::Command;
use std::time::Instant;
use teachtree_base::scene::Scene;
use teachtree_base::yaml;
use teachtree_world::{Coupling, Fingertips, HandTarget, Observation, TouchLaw, World};

/// The cube of Kawasaki et al. (2014) in its box; a hand presses on each of two sides.
const SCENE: &str = include_str!("scene.yaml");
/// Commanded penetration of the fingertips into the faces, m.
const PRESS: f64 = 0.010;
/// Height of the lift, m.
const LIFT: f64 = 0.050;
const STEPS: usize = 20_000;
const ROUNDS: usize = 5;

fn main() {
    // Paths of rules, logs and robots are those of the repository.
    std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).expect("the folder of the repository");
    let scene: Scene = yaml::read(SCENE, "scene.yaml").expect("the scene is right");
    let mut ours = Vec::new();
    let mut theirs = Vec::new();
    let mut forces = (0.0, 0.0);
    for _ in 0..ROUNDS {
        let (world, speed) = held(&scene);
        forces = felt(world.observation());
        ours.push(speed);
        theirs.extend(mujoco());
    }
    let coupling = Coupling::default().stiffness;
    let law = TouchLaw::default().stiffness;
    let (press, weight) = (PRESS * coupling * law / (coupling + law), 0.05 * 9.81);
    let off = |found: f64, wanted: f64| 100.0 * (found / wanted - 1.0);
    println!("forces of ten fingertips that hold the cube in the air, beside their closed forms (expected within 2 %)");
    println!("  press of a fingertip  {:.4} N, closed form {press:.4} N: {:+.2} %", forces.0, off(forces.0, press));
    println!("  lift of all of them   {:.4} N, weight      {weight:.4} N: {:+.2} %", forces.1, off(forces.1, weight));
    let ours = median(&mut ours);
    println!("steps of 1 ms a second, one core, median of {ROUNDS}: {:.1} k", ours / 1e3);
    if theirs.is_empty() {
        println!("MuJoCo was not measured: python3 has no package `mujoco`");
    } else {
        let theirs = median(&mut theirs);
        println!("MuJoCo on the same scene: {:.1} k; ratio {:.2} (expected 2.00)", theirs / 1e3, ours / theirs);
    }
}

/// Presses the cube from both sides, lifts and holds it; returns the steps per second while it is held.
fn held(scene: &Scene) -> (World, f64) {
    let mut world = World::new(scene, Fingertips::default()).expect("the scene can be simulated");
    for step in 0..1500 {
        let lift = LIFT * (f64::from(step) / 1000.0 - 0.3).clamp(0.0, 1.0);
        world.step(&targets(lift));
    }
    let targets = targets(LIFT);
    let start = Instant::now();
    for _ in 0..STEPS {
        world.step(&targets);
    }
    (world, STEPS as f64 / start.elapsed().as_secs_f64())
}

/// Returns five fingertip positions on each of the faces across x.
fn targets(lift: f64) -> [HandTarget; 2] {
    const SPOTS: [[f64; 2]; 5] = [[0.0, 0.060], [0.03, 0.075], [-0.03, 0.075], [0.03, 0.045], [-0.03, 0.045]];
    [-1.0, 1.0].map(|side| HandTarget {
        palm: Isometry3::translation(side * 0.2, 0.0, 0.2),
        // The faces are at 60 mm, and a fingertip has a radius of 10 mm.
        tips: SPOTS.iter().map(|[y, z]| Point3::new(side * (0.070 - PRESS), *y, z + lift)).collect(),
    })
}

/// Returns the mean pressing force of a fingertip along x and the total lifting force, N.
fn felt(seen: &Observation) -> (f64, f64) {
    let tips = || seen.hands.iter().flat_map(|hand| &hand.tips);
    let press = tips().map(|tip| tip.force_on(0).x.abs()).sum::<f64>() / tips().count() as f64;
    (press, tips().map(|tip| tip.force_on(0).z).sum())
}

/// Returns the steps per second of MuJoCo, if it is installed.
fn mujoco() -> Option<f64> {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/world/mujoco_scene.py");
    let run = Command::new("python3").args([script, &STEPS.to_string()]).output().ok()?;
    String::from_utf8(run.stdout).ok()?.trim().parse().ok().filter(|_| run.status.success())
}

fn median(speeds: &mut [f64]) -> f64 {
    speeds.sort_by(f64::total_cmp);
    speeds[speeds.len() / 2]
}
