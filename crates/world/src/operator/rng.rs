//! Rng: what a seed draws for one operator, and the tremor that comes of it.

use super::variation::Tremor;
use nalgebra::{ComplexField, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Rng, from a seed. Each use has a stream of its own, so that one hand or sensor more does not change the others.
pub(crate) struct Rng(ChaCha8Rng);

impl Rng {
    /// The stream of this number under this seed.
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        Self(rng)
    }

    /// Evenly between -1 and 1.
    pub(crate) fn either_way(&mut self) -> f64 {
        self.0.random_range(-1.0..=1.0)
    }

    /// Evenly between 0 and 1.
    pub(super) fn share(&mut self) -> f64 {
        self.0.random_range(0.0..=1.0)
    }

    /// A factor between 1/(1 + spread) and 1 + spread, as likely above 1 as below.
    pub(super) fn factor(&mut self, spread: f64) -> f64 {
        let size = 1.0 + spread.max(0.0) * self.share();
        if self.0.random_bool(0.5) { size } else { 1.0 / size }
    }

    /// A factor between these two, evenly in proportion.
    pub(super) fn between(&mut self, [low, high]: [f64; 2]) -> f64 {
        low * ComplexField::powf(high / low, self.share())
    }

    /// A direction.
    pub(super) fn direction(&mut self) -> Vector3<f64> {
        let mut normal = || -> f64 { StandardNormal.sample(&mut self.0) };
        Vector3::new(normal(), normal(), normal()).try_normalize(1e-9).unwrap_or_else(Vector3::x)
    }

    /// A normally distributed vector of standard deviation 1 in each component.
    pub(crate) fn noise(&mut self) -> Vector3<f64> {
        let mut normal = || -> f64 { StandardNormal.sample(&mut self.0) };
        Vector3::new(normal(), normal(), normal())
    }
}

/// The tremor of one hand today.
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

    /// How far the hand is off at this time, m.
    pub(super) fn at(&self, time_s: f64) -> Vector3<f64> {
        // nalgebra's sine is the same on every machine.
        Vector3::from(self.waves.map(|(size, rate, phase)| size * ComplexField::sin(rate * time_s + phase)))
    }
}
