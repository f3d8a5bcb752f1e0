//! Small worlds for the closed forms.

use nalgebra::{Isometry3, Point3, Vector3};
use teachtree_base::scene::Scene;
use teachtree_base::yaml;
use teachtree_world::{Fingertips, HandTarget, Observation, STEP_S, World};

/// Mass of the cubes, kg, and their weight, N.
pub const MASS: f64 = 0.05;
pub const WEIGHT: f64 = MASS * 9.81;

/// A 120 mm cube of 50 g and friction 0.4, resting on a base whose upper face is z = 0; with more bodies and hands as YAML.
pub fn cube_on_base(more_bodies: &str, hands: &str) -> Scene {
    scene(&format!(
        "bodies:
  cube: {{role: object, mass: 50 g, friction: 0.4, position: [0 mm, 0 mm, 60 mm], parts: [{{box: [120 mm, 120 mm, 120 mm]}}]}}
  base: {{role: support, friction: 0.4, position: [0 mm, 0 mm, -50 mm], parts: [{{box: [2 m, 2 m, 100 mm]}}]}}
{more_bodies}
hands: {hands}
"
    ))
}

pub fn scene(text: &str) -> Scene {
    yaml::read(text, "scene.yaml").unwrap()
}

pub fn world(scene: &Scene) -> World {
    World::new(scene, Fingertips::default()).unwrap()
}

/// Lets the world run without hands and hands every step to `look`.
pub fn run(world: &mut World, seconds: f64, mut look: impl FnMut(&Observation)) {
    for _ in 0..steps(seconds) {
        look(world.step(&[]));
    }
}

pub fn steps(seconds: f64) -> usize {
    (seconds / STEP_S).round() as usize
}

/// A hand whose fingertips are reported to be at these points.
pub fn hand(tips: &[[f64; 3]]) -> HandTarget {
    HandTarget {
        palm: Isometry3::translation(0.0, 0.0, 0.3),
        tips: tips.iter().map(|&tip| Point3::from(tip)).collect(),
    }
}

/// The mean of a quantity over the next `seconds`, with the targets held.
pub fn mean(
    world: &mut World,
    targets: &[HandTarget],
    seconds: f64,
    value: impl Fn(&Observation) -> Vector3<f64>,
) -> Vector3<f64> {
    let steps = steps(seconds);
    (0..steps).map(|_| value(world.step(targets))).sum::<Vector3<f64>>() / steps as f64
}
