//! Human variation: how people differ from each other and from themselves. Everything is drawn from the seed, in the order of the script.
//!
//! Each number is the size of a difference; 0, the default of most, is a machine.

use crate::base::quantity::{Force, Frequency, Length, Time};
use nalgebra::{ComplexField, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::Deserialize;

/// How much people vary.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Variation {
    /// Speeds are multiplied by 1/(1 + pace) to 1 + pace.
    pub pace: f64,
    /// Forces are multiplied by 1/(1 + squeeze) to 1 + squeeze.
    pub squeeze: f64,
    /// How far a free way arches, at most; and never more than a sixth of its length.
    pub path: Length,
    /// How far beside a grip the hand arrives, at most, horizontally.
    pub aim: Length,
    /// How much later than the first the last finger starts to close or open, at most.
    pub arrival: Time,
    /// How far the hand goes on in the direction in which it came, horizontally, while the fingers already close.
    pub overrun: Length,
    /// How long the overrun takes.
    pub overrun_time: Time,
    /// Time from what is felt or seen to what is done about it.
    pub reaction: Time,
    /// Tremor of the hand.
    pub tremor: Tremor,
    /// Noise of the force sensors, in the recording only: the world does not feel it.
    pub force_noise: ForceNoise,
}

/// Tremor: in each direction a wave of its own frequency.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Tremor {
    /// Amplitude.
    pub amplitude: Length,
    /// Lowest and highest frequency.
    pub frequency: [Frequency; 2],
}

/// Noise of force sensors, per component.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ForceNoise {
    /// Standard deviation, independent from sample to sample.
    pub sigma: Force,
    /// A constant of each sensor, at most this, either way.
    pub bias: Force,
}

impl Default for Variation {
    fn default() -> Self {
        let (length, time) = (Length::default(), Time::default());
        Self {
            pace: 0.0,
            squeeze: 0.0,
            path: length,
            aim: length,
            arrival: time,
            overrun: length,
            overrun_time: crate::base::quantity::Quantity(0.5),
            reaction: crate::base::quantity::Quantity(0.15),
            tremor: Tremor::default(),
            force_noise: ForceNoise::default(),
        }
    }
}

impl Default for Tremor {
    fn default() -> Self {
        use crate::base::quantity::Quantity;
        Self { amplitude: Quantity(0.0), frequency: [Quantity(8.0), Quantity(12.0)] }
    }
}

/// Chance, from a seed. Each use has a stream of its own, so that one hand or sensor more does not change the others.
pub(in crate::world) struct Chance(ChaCha8Rng);

impl Chance {
    /// The stream of this number under this seed.
    pub(in crate::world) fn new(seed: u64, stream: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        Self(rng)
    }

    /// Evenly between -1 and 1.
    pub(in crate::world) fn either_way(&mut self) -> f64 {
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

    /// A direction.
    pub(super) fn direction(&mut self) -> Vector3<f64> {
        let mut normal = || -> f64 { StandardNormal.sample(&mut self.0) };
        Vector3::new(normal(), normal(), normal()).try_normalize(1e-9).unwrap_or_else(Vector3::x)
    }

    /// A normally distributed vector of standard deviation 1 in each component.
    pub(in crate::world) fn noise(&mut self) -> Vector3<f64> {
        let mut normal = || -> f64 { StandardNormal.sample(&mut self.0) };
        Vector3::new(normal(), normal(), normal())
    }
}

/// The tremor of one hand today.
pub(super) struct Shaking {
    amplitude: f64,
    /// Angular frequency, rad/s, and phase, rad, in each direction.
    waves: [(f64, f64); 3],
}

impl Shaking {
    pub(super) fn new(tremor: &Tremor, chance: &mut Chance) -> Self {
        let [low, high] = tremor.frequency.map(|frequency| frequency.0);
        let waves = [(); 3].map(|()| {
            let frequency = low + (high - low) * chance.share();
            (std::f64::consts::TAU * frequency, std::f64::consts::TAU * chance.share())
        });
        Self { amplitude: tremor.amplitude.0, waves }
    }

    /// How far the hand is off at this time, m.
    pub(super) fn at(&self, time_s: f64) -> Vector3<f64> {
        // nalgebra's sine is the same on every machine.
        Vector3::from(self.waves.map(|(rate, phase)| self.amplitude * ComplexField::sin(rate * time_s + phase)))
    }
}
