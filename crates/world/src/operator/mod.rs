//! Operators: operators who demonstrate. A YAML script says in terms of the task what a hand does (`reach`, `close`, `carry`, `insert`, …), and a
//! seed says which person does it today. The script becomes targets of the fingertips, and nothing else reaches the world.
//!
//! Everything is relative to *grips*: points of an object's surface where fingertips go. Directions are those of the reference frame.

mod collide;
mod cooperation;
mod failures;
mod goal_start;
mod goals;
mod grips;
mod guarded_motion;
mod hand;
mod insertion;
mod jam;
mod motion;
mod perturbations;
mod press;
mod rng;
mod sensor_history;
mod slip;
mod variation;

pub(super) use cooperation::PartnerHand;
pub(super) use failures::obstacles;
pub use failures::{Failure, FailurePlan};
pub use goals::{
    Bring, Carry, Close, Collide, Cooperation, Goal, Insert, Jam, Open, Press, Reach, Slip, Step, StopContact, Turn,
    WallPress, Withdraw,
};
pub(super) use hand::Performer;
pub(super) use perturbations::cuts;
pub use perturbations::{Occasions, Perturbation};
pub(super) use rng::Rng;
pub use variation::{ForceNoise, Tremor, Variation};

use indexmap::IndexMap;
use serde::Deserialize;
use std::ops::RangeInclusive;
use teachtree_base::error::InputError;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::quantity::Length;
use teachtree_base::short_number::ShortNumber;
use teachtree_base::yaml;

/// Limits of `force_scale`.
const FORCE_SCALES: RangeInclusive<f64> = 0.1..=20.0;

/// An operator script.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Operator {
    /// A name to show.
    pub name: String,
    /// How operators differ, and how one operator differs from run to run; by default no variation.
    #[serde(default, deserialize_with = "variation::read")]
    #[schemars(with = "variation::VariationText")]
    pub variation: Variation,
    /// What this script offers to the perturbations of its variation.
    #[serde(default)]
    pub occasions: Occasions,
    /// Failures on purpose. With this key, the ground truth of the recordings contains primitives and tasks of failures.
    #[serde(default)]
    pub failures: Option<FailurePlan>,
    /// Strength and stiffness of the hands, over those of the haptic device. All forces of the script are multiplied by it.
    #[serde(default = "as_large")]
    pub force_scale: f64,
    /// What is recorded, and how exactly.
    #[serde(default)]
    pub measured: MeasurementSpec,
    /// How large the virtual hands are over the person's: see [`Self::with_hands`].
    #[serde(skip, default = "as_large")]
    pub hands_scale: f64,
    /// The grips by name.
    pub grips: IndexMap<String, Grip>,
    /// What each hand does. Hands run side by side.
    pub hands: IndexMap<Side, Script>,
}

/// What is recorded, and how exactly.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MeasurementSpec {
    /// Number of decimals to which values are rounded, in SI; by default values are not rounded.
    pub decimals: Option<u8>,
    /// Whether each fingertip's contact with an object is recorded as a flag, as a virtual environment knows it.
    pub contact_flags: bool,
    /// Whether the force at each wrist is recorded, as `palm.force`: the sum of the fingertips' forces on all bodies.
    pub wrist_forces: bool,
    /// Whether the distance between the thumb's pad and that of the nearest other finger is recorded, as `gripper.opening`.
    pub gripper_openings: bool,
}

/// Points of an object where fingertips go.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Grip {
    /// The object.
    pub object: String,
    /// Contact points on its surface, object frame. Fingers that are not named stay tucked under the palm.
    pub contacts: IndexMap<Finger, [Length; 3]>,
    /// The position of the palm, object frame; by default 100 mm above the middle of the contact points.
    #[serde(default)]
    pub palm: Option<[Length; 3]>,
    /// The object is round about its upright axis there: the fingers come from where they always come from, however it is turned.
    #[serde(default)]
    pub round: bool,
}

/// What one hand does.
#[derive(Clone, Debug, PartialEq, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Script {
    /// Where it is at the beginning.
    pub start: Reach,
    /// The steps, one after the other.
    #[serde(deserialize_with = "goals::steps")]
    #[schemars(with = "Vec<goals::StepText>")]
    pub steps: Vec<Step>,
}

/// The schema of operator scripts.
pub fn schema() -> schemars::Schema {
    schemars::schema_for!(Operator)
}

impl Operator {
    /// Reads an operator script; `file` is its name in errors.
    ///
    /// # Errors
    /// What the text lacks, at `file:line:column`.
    pub fn read(text: &str, file: &str) -> Result<Self, InputError> {
        let operator: Self = yaml::read(text, file)?;
        operator
            .check_grips()
            .and_then(|()| operator.check_failures())
            .map_err(|error| yaml::located(error, text, file))?;
        Ok(operator)
    }

    /// Rejects a failure that no step of the scripts allows, and numbers out of range.
    fn check_failures(&self) -> Result<(), InputError> {
        if !FORCE_SCALES.contains(&self.force_scale) {
            let message = format!("found {}, expected 0.1 to 20", ShortNumber(self.force_scale));
            return Err(InputError::new("force_scale", message));
        }
        self.failures.as_ref().map_or(Ok(()), |plan| plan.check(self))
    }

    /// Refuses the name of a grip that it does not have.
    fn check_grips(&self) -> Result<(), InputError> {
        for (side, script) in &self.hands {
            let reaches = script.steps.iter().filter_map(|step| match &step.goal {
                Goal::Reach(reach) => Some((format!("steps.{}", step.written), reach)),
                _ => None,
            });
            for (key, reach) in std::iter::once(("start".to_string(), &script.start)).chain(reaches) {
                let at = |error: InputError| InputError { place: format!("hands.{side}.{key}"), ..error };
                grips::named(self, &reach.grip).map_err(at)?;
            }
        }
        Ok(())
    }

    /// The same operator with virtual hands that are `scale` times as large as their own, 0.5 to 2: what a robot with other hands is demonstrated with
    /// (the paper, section 2.6). Fingertips stand farther from the palm, and farther apart where they are on one face of an object; they stay on it.
    #[must_use]
    pub fn with_hands(self, scale: f64) -> Self {
        Self { hands_scale: scale.clamp(0.5, 2.0), ..self }
    }
}

fn as_large() -> f64 {
    1.0
}
