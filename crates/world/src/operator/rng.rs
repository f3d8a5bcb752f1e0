//! The random numbers of an operator, and the tremor.

use super::variation::Tremor;
use nalgebra::{ComplexField, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A seeded random number generator. Each use has its own stream, so that an additional hand or sensor does not change the others.
pub(crate) struct Rng(ChaCha8Rng);

impl Rng {
    /// Returns the stream of this number for a seed.
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        Self(rng)
    }

    /// Returns a uniform number between -1 and 1.
    pub(crate) fn either_way(&mut self) -> f64 {
        self.0.random_range(-1.0..=1.0)
    }

    /// Returns a uniform number between 0 and 1.
    pub(super) fn share(&mut self) -> f64 {
        self.0.random_range(0.0..=1.0)
    }

    /// Returns a factor between 1/(1 + spread) and 1 + spread, with the median 1.
    pub(super) fn factor(&mut self, spread: f64) -> f64 {
        let size = 1.0 + spread.max(0.0) * self.share();
        if self.0.random_bool(0.5) { size } else { 1.0 / size }
    }

    /// Returns a log-uniform factor between these two.
    pub(super) fn between(&mut self, [low, high]: [f64; 2]) -> f64 {
        low * ComplexField::powf(high / low, self.share())
    }

    /// Returns a random direction, unit.
    pub(super) fn direction(&mut self) -> Vector3<f64> {
        let mut normal = || -> f64 { StandardNormal.sample(&mut self.0) };
        Vector3::new(normal(), normal(), normal()).try_normalize(1e-9).unwrap_or_else(Vector3::x)
    }

    /// Returns a normally distributed vector with standard deviation 1 in each component.
    pub(crate) fn noise(&mut self) -> Vector3<f64> {
        let mut normal = || -> f64 { StandardNormal.sample(&mut self.0) };
        Vector3::new(normal(), normal(), normal())
    }
}

/// The tremor of one hand in one run.
pub(super) struct HandTremor {
    /// Amplitude, m, angular frequency, rad/s, and phase, rad, in each direction.
    waves: [(f64, f64, f64); 3],
}

impl HandTremor {
    pub(super) fn new(tremor: &Tremor, chance: &mut Rng) -> Self {
        let [low, high] = tremor.frequency.map(|frequency| frequency.0);
        let waves = [(); 3].map(|()| {
            let frequency = low + (high - low) * chance.share();
            (tremor.amplitude.0, std::f64::consts::TAU * frequency, std::f64::consts::TAU * chance.share())
        });
        let Some([least, most]) = tremor.person.map(|ends| ends.map(|length| length.0)) else { return Self { waves } };
        let size = least + (most - least) * chance.share();
        let spread = chance.direction() * size;
        Self { waves: [0, 1, 2].map(|part| (spread[part], waves[part].1, waves[part].2)) }
    }

    /// Returns the displacement of the hand at this time, m.
    pub(super) fn at(&self, time_s: f64) -> Vector3<f64> {
        // nalgebra's sine is the same on every machine.
        Vector3::from(self.waves.map(|(size, rate, phase)| size * ComplexField::sin(rate * time_s + phase)))
    }
}
