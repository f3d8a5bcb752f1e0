//! The sensor of the objects' poses, such as a camera: a constant error, a delay, and noise.
//!
//! Noise is a first-order Gauss–Markov process in each direction, x' = a x + √(1 − a²) σ ξ with a = exp(−dt/τ): its standard deviation is σ and its correlation
//! time τ, whatever the step.

use super::cell_variation::CellVariation;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::collections::VecDeque;
use teachtree_world::{Observation, STEP_S};

/// The correlation time τ of the noise, s: about that of a camera with 50 images a second whose errors are independent.
const CORRELATION_S: f64 = 0.02;

/// The sensor.
pub struct PoseSensor {
    error: Translation3<f64>,
    /// The delay, steps.
    delay: usize,
    /// The true poses of all bodies that have not been measured, oldest first.
    pending: VecDeque<Vec<Isometry3<f64>>>,
    noise: Option<PoseNoise>,
    measured: Vec<Isometry3<f64>>,
}

impl PoseSensor {
    /// Returns the sensor of bodies at rest, with their first measured poses.
    pub fn new(variation: &CellVariation, seen: &Observation) -> Self {
        let mut sensor = Self {
            error: Translation3::from(Vector3::from(variation.pose_error.map(|part| part.0))),
            delay: variation.pose_delay_steps(),
            pending: VecDeque::new(),
            noise: PoseNoise::new(variation, seen.bodies.len()),
            measured: Vec::new(),
        };
        sensor.measure(seen);
        sensor
    }

    /// Measures the poses after a step.
    pub fn measure(&mut self, seen: &Observation) {
        self.pending.push_back(seen.bodies.iter().map(|body| body.pose).collect());
        while self.pending.len() > self.delay + 1 {
            self.pending.pop_front();
        }
        let Some(poses) = self.pending.front() else { return };
        self.measured.clone_from(poses);
        if let Some(noise) = &mut self.noise {
            noise.add(&mut self.measured);
        }
        self.measured.iter_mut().for_each(|pose| *pose = self.error * *pose);
    }

    /// Returns the measured poses of the bodies of the scene, in its order, reference frame.
    pub fn poses(&self) -> &[Isometry3<f64>] {
        &self.measured
    }
}

/// The noise of all bodies.
struct PoseNoise {
    /// The standard deviations of position, m, and rotation vector, rad.
    deviations: [f64; 2],
    rng: ChaCha8Rng,
    /// The current noise of each body, in standard deviations: of its position and its rotation vector.
    now: Vec<[Vector3<f64>; 2]>,
}

impl PoseNoise {
    /// Returns the noise of a variation; `None` if it has none.
    fn new(variation: &CellVariation, bodies: usize) -> Option<Self> {
        let deviations = [variation.pose_noise.0, variation.rotation_noise.0];
        let mut rng = ChaCha8Rng::seed_from_u64(variation.seed);
        let now = (0..bodies).map(|_| [(); 2].map(|()| normal(&mut rng))).collect();
        deviations.iter().any(|deviation| *deviation > 0.0).then_some(Self { deviations, rng, now })
    }

    /// Adds the noise of the next step to the poses.
    fn add(&mut self, poses: &mut [Isometry3<f64>]) {
        let keeps = (-STEP_S / CORRELATION_S).exp();
        let gain = (1.0 - keeps * keeps).sqrt();
        let [position, rotation] = self.deviations;
        for (pose, now) in poses.iter_mut().zip(&mut self.now) {
            for part in now.iter_mut() {
                *part = *part * keeps + normal(&mut self.rng) * gain;
            }
            pose.translation.vector += now[0] * position;
            pose.rotation = UnitQuaternion::from_scaled_axis(now[1] * rotation) * pose.rotation;
        }
    }
}

fn normal(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    let mut part = || -> f64 { StandardNormal.sample(rng) };
    let (x, y, z) = (part(), part(), part());
    Vector3::new(x, y, z)
}
