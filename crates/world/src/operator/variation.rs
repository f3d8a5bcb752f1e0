//! Human variation: how operators differ from each other and from themselves (docs/scenes.md). Everything is drawn from the seed, in the order of
//! the script.
//!
//! Each number is the size of a difference; 0, the default of most, is a machine. [`Variation::human`] is the model of operators.

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Unexpected, Visitor};
use serde::{Deserialize, Deserializer};
use teachtree_base::quantity::{Force, Frequency, Length, Quantity, Time};

/// How much operators vary: `variation: human` in a script, or numbers of its own.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Variation {
    /// Speeds are multiplied by 1/(1 + pace) to 1 + pace.
    pub pace: f64,
    /// Forces are multiplied by 1/(1 + squeeze) to 1 + squeeze.
    pub squeeze: f64,
    /// An operator's squeeze over that of the script lies between these factors, evenly in proportion.
    pub strength: [f64; 2],
    /// How far a free way arches, at most; and never more than a sixth of its length.
    pub path: Length,
    /// How far beside a grip or a place the hand arrives, at most, horizontally.
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
    /// The share of operators for whom each perturbation occurs.
    #[serde(alias = "incidents")]
    pub perturbations: f64,
}

/// Tremor: in each direction a wave of its own frequency.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Tremor {
    /// Amplitude in each direction.
    pub amplitude: Length,
    /// In place of that, the least and the largest amplitude of the whole movement; how it is spread over the directions is drawn.
    pub person: Option<[Length; 2]>,
    /// Lowest and highest frequency.
    pub frequency: [Frequency; 2],
}

/// Noise of force sensors, per component.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ForceNoise {
    /// Standard deviation, independent from sample to sample.
    pub sigma: Force,
    /// A constant of each sensor, at most this, either way.
    pub bias: Force,
}

impl Variation {
    /// People. Every number is ours.
    pub const fn human() -> Self {
        Self {
            pace: 1.0,
            squeeze: 0.1,
            // The scripts squeeze with 1.2 N: 0.4 N to 4 N.
            strength: [1.0 / 3.0, 10.0 / 3.0],
            path: Quantity(0.020),
            aim: Quantity(0.003),
            arrival: Quantity(0.060),
            overrun: Quantity(0.003),
            overrun_time: Quantity(0.3),
            reaction: Quantity(0.15),
            tremor: Tremor {
                amplitude: Quantity(0.0),
                person: Some([Quantity(0.0002), Quantity(0.001)]),
                frequency: [Quantity(8.0), Quantity(12.0)],
            },
            force_noise: ForceNoise { sigma: Quantity(0.03), bias: Quantity(0.1) },
            perturbations: 0.12,
        }
    }

    /// The same operators, varying this many times as much: 0 is a machine.
    #[must_use]
    pub fn scaled(&self, by: f64) -> Self {
        let by = by.max(0.0);
        let length = |length: Length| Quantity(length.0 * by);
        Self {
            pace: self.pace * by,
            squeeze: self.squeeze * by,
            strength: self.strength.map(|factor| nalgebra::ComplexField::powf(factor, by)),
            path: length(self.path),
            aim: length(self.aim),
            arrival: Quantity(self.arrival.0 * by),
            overrun: length(self.overrun),
            tremor: Tremor {
                amplitude: length(self.tremor.amplitude),
                person: self.tremor.person.map(|ends| ends.map(length)),
                ..self.tremor.clone()
            },
            force_noise: ForceNoise {
                sigma: Quantity(self.force_noise.sigma.0 * by),
                bias: Quantity(self.force_noise.bias.0 * by),
            },
            perturbations: self.perturbations * by,
            ..self.clone()
        }
    }
}

impl Default for Variation {
    fn default() -> Self {
        let (length, time) = (Length::default(), Time::default());
        Self {
            pace: 0.0,
            squeeze: 0.0,
            strength: [1.0; 2],
            path: length,
            aim: length,
            arrival: time,
            overrun: length,
            overrun_time: Quantity(0.5),
            reaction: Quantity(0.15),
            tremor: Tremor::default(),
            force_noise: ForceNoise::default(),
            perturbations: 0.0,
        }
    }
}

impl Default for Tremor {
    fn default() -> Self {
        Self { amplitude: Quantity(0.0), person: None, frequency: [Quantity(8.0), Quantity(12.0)] }
    }
}

/// Reads `human`, or numbers of a script's own.
pub(super) fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Variation, D::Error> {
    struct VariationVisitor;
    impl<'de> Visitor<'de> for VariationVisitor {
        type Value = Variation;
        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str("`human`, or how much operators vary")
        }
        fn visit_str<E: Error>(self, name: &str) -> Result<Variation, E> {
            if name == "human" { Ok(Variation::human()) } else { Err(E::invalid_value(Unexpected::Str(name), &self)) }
        }
        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Variation, A::Error> {
            Variation::deserialize(MapAccessDeserializer::new(map))
        }
    }
    deserializer.deserialize_any(VariationVisitor)
}

/// `human`, or how much operators vary.
#[derive(schemars::JsonSchema)]
#[schemars(untagged)]
#[allow(dead_code, reason = "it is only described")]
pub(super) enum VariationText {
    Name(Human),
    Numbers(Variation),
}

/// The word `human`.
#[derive(schemars::JsonSchema)]
#[schemars(rename_all = "snake_case")]
#[allow(dead_code, reason = "it is only described")]
pub(super) enum Human {
    Human,
}
