//! Operators: people who demonstrate. A YAML script says in terms of the task what a hand does (`reach`, `close`, `carry`, `open`, `hold`), and a
//! seed says which person does it today. The script becomes targets of the fingertips, and nothing else reaches the world.
//!
//! Everything is relative to *grips*: points of an object's surface where fingertips go. Directions are those of the reference frame.

mod grips;
mod guided;
mod hand;
mod motion;
mod senses;
mod variation;

pub(super) use hand::Performer;
pub(super) use variation::Chance;
pub use variation::{ForceNoise, Tremor, Variation};

use crate::base::error::InputError;
use crate::base::hands::{Finger, Side};
use crate::base::quantity::{Force, Length, Speed, Time};
use crate::base::yaml;
use indexmap::IndexMap;
use serde::Deserialize;

/// An operator script.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Operator {
    /// A name for people.
    pub name: String,
    /// How people differ, and how one person differs from run to run; a machine when left out.
    #[serde(default)]
    pub variation: Variation,
    /// The grips by name.
    pub grips: IndexMap<String, Grip>,
    /// What each hand does. Hands run side by side.
    pub hands: IndexMap<Side, Script>,
}

/// Points of an object where fingertips go.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grip {
    /// The object.
    pub object: String,
    /// Contact points on its surface, object frame. Fingers that are not named stay tucked under the palm.
    pub contacts: IndexMap<Finger, [Length; 3]>,
    /// Where the palm is, object frame; 100 mm above the middle of the contact points when left out.
    #[serde(default)]
    pub palm: Option<[Length; 3]>,
}

/// What one hand does.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Script {
    /// Where it is at the beginning.
    pub start: Reach,
    /// The steps, one after the other.
    pub steps: Vec<Step>,
}

/// One step: a goal, and the phase of the demonstration that begins with it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "StepText")]
pub struct Step {
    /// Logged as the event `phase_started`.
    pub phase: Option<String>,
    /// What to do.
    pub goal: Goal,
}

/// What a hand can be told to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Goal {
    /// Bring the opened fingers to a grip, or somewhere beside it.
    Reach(Reach),
    /// Close the fingers of the grip until they feel a force.
    Close(Close),
    /// Move the hand as it is, with what it holds or pushes.
    Carry(Carry),
    /// Take the fingers off the object.
    Open(Open),
    /// Stay.
    Hold(Time),
}

/// Brings the opened fingers to a grip by a minimum-jerk motion.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reach {
    /// The grip.
    pub grip: String,
    /// How far the fingertips stay off the surface.
    #[serde(default = "opened")]
    pub opened: Length,
    /// How far from the grip the hand stops: a keyframe of the way.
    #[serde(default)]
    pub offset: [Length; 3],
    /// Largest speed of the hand.
    #[serde(default = "reaching")]
    pub speed: Speed,
}

/// Closes the fingers of the grip until each feels its share of a force, and keeps the squeeze from then on.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Close {
    /// Force of the thumb; the fingers on the other side share as much. Without a thumb, the force of each finger.
    pub force: Force,
    /// Speed of the fingertips against the palm.
    #[serde(default = "closing")]
    pub speed: Speed,
}

/// Moves the hand along a straight line.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Carry {
    /// The direction; its length does not matter.
    pub along: [f64; 3],
    /// How far, at most.
    pub distance: Length,
    /// Speed under way. The hand slows down before what it sees itself touching.
    #[serde(default = "carrying")]
    pub speed: Speed,
    /// What ends it before the distance is used up.
    #[serde(default)]
    pub until: Option<Until>,
    /// What the object is held against under way.
    #[serde(default)]
    pub press: Option<Press>,
}

/// What ends a [`Carry`].
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Until {
    /// The object of the grip touches this body.
    pub contact: String,
    /// Or is seen to be within this distance of it.
    #[serde(default)]
    pub within: Length,
}

/// Holds the object against a body while it moves along it: by the force that the fingers feel while it touches, by seeking it again when not.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Press {
    /// The body.
    pub against: String,
    /// The direction towards it.
    pub toward: [f64; 3],
    /// The force of the fingers on the object in that direction.
    pub force: Force,
    /// How far the hand wavers from its line, towards the body or away from it.
    #[serde(default)]
    pub waver: Length,
}

/// Takes the fingers off the object.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Open {
    /// How far off the surface.
    #[serde(default = "opened")]
    pub by: Length,
    /// Largest speed of the fingertips.
    #[serde(default = "closing")]
    pub speed: Speed,
}

/// A step as it is written: `{phase: lift, carry: {…}}`, exactly one goal.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StepText {
    phase: Option<String>,
    reach: Option<Reach>,
    close: Option<Close>,
    carry: Option<Carry>,
    open: Option<Open>,
    hold: Option<Time>,
}

impl TryFrom<StepText> for Step {
    type Error = String;

    fn try_from(text: StepText) -> Result<Self, String> {
        let goals = [
            text.reach.map(Goal::Reach),
            text.close.map(Goal::Close),
            text.carry.map(Goal::Carry),
            text.open.map(Goal::Open),
            text.hold.map(Goal::Hold),
        ];
        let mut goals = goals.into_iter().flatten();
        match (goals.next(), goals.next()) {
            (Some(goal), None) => Ok(Self { phase: text.phase, goal }),
            (None, _) => Err("a step without a goal, wanted one of reach, close, carry, open, hold".into()),
            (Some(_), Some(_)) => Err("a step with two goals, wanted one of reach, close, carry, open, hold".into()),
        }
    }
}

impl Operator {
    /// Reads an operator script; `file` is its name in errors.
    ///
    /// # Errors
    /// What the text lacks, at `file:line:column`.
    pub fn read(text: &str, file: &str) -> Result<Self, InputError> {
        yaml::read(text, file)
    }
}

const fn opened() -> Length {
    crate::base::quantity::Quantity(0.030)
}

const fn reaching() -> Speed {
    crate::base::quantity::Quantity(0.300)
}

const fn closing() -> Speed {
    crate::base::quantity::Quantity(0.080)
}

const fn carrying() -> Speed {
    crate::base::quantity::Quantity(0.100)
}
