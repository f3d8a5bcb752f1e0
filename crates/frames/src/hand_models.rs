//! The hand model of a log: the rule file that implements the abstract signals for the quantities of the log. `rules/hand_models.yaml` is the
//! table of the choices.

use crate::derive;
use serde::Deserialize;
use std::fmt;
use std::sync::LazyLock;
use teachtree_base::error::InputError;
use teachtree_base::field_names::FieldNames;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::log_channel::{FingerPart, LogChannel};
use teachtree_base::scene::Scene;
use teachtree_base::yaml;
use teachtree_logs::names;

/// Name and text of the shipped table.
pub const SHIPPED: (&str, &str) =
    ("hand_models.yaml", include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../rules/hand_models.yaml")));
/// The name of the table in messages.
const TABLE_NAME: &str = "rules/hand_models.yaml";
/// The hand model of a log that fits no row of the table.
const DEFAULT: &str = "hand_force.rules";

/// A hand model, and why it is loaded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HandModel {
    /// The hand model: the name of a shipped one, or a path.
    pub file: String,
    /// Why it is loaded, such as `since the log has right.gripper.closed and right.wrist.force`.
    pub reason: String,
}

impl fmt::Display for HandModel {
    /// `hand_gripper.rules, since the log has right.gripper.closed`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}", self.file, self.reason)
    }
}

/// A row of the table.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HandModelRow {
    /// What each hand has to measure.
    pub needs: Vec<Quantity>,
    /// The hand model.
    pub file: String,
}

/// A quantity that a hand may measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Quantity {
    /// The force of a fingertip.
    #[serde(rename = "fingertip.force")]
    FingertipForce,
    /// The contact flag of a fingertip.
    #[serde(rename = "fingertip.contact")]
    FingertipContact,
    /// The position of a fingertip or of the tool point.
    #[serde(rename = "fingertip.position")]
    FingertipPosition,
    /// The positions of the thumb and of another fingertip.
    #[serde(rename = "fingertips.position")]
    FingertipPositions,
    /// The flag or the opening of a gripper.
    #[serde(rename = "gripper")]
    Gripper,
    /// The force at the wrist.
    #[serde(rename = "wrist.force")]
    WristForce,
    /// The position of the tool point.
    #[serde(rename = "tcp.position")]
    ToolPoint,
    /// The angle of a mechanism.
    #[serde(rename = "mechanism.angle")]
    MechanismAngle,
}

/// Reads a table.
///
/// # Errors
/// A row is invalid; the error names `file:line:column`.
pub fn read(text: &str, name: &str) -> Result<Vec<HandModelRow>, InputError> {
    yaml::read(text, name)
}

/// The shipped table.
pub fn shipped() -> &'static [HandModelRow] {
    // A test reads it.
    static ROWS: LazyLock<Vec<HandModelRow>> = LazyLock::new(|| read(SHIPPED.1, TABLE_NAME).unwrap_or_default());
    &ROWS
}

/// Chooses the hand model of a log with these columns by the shipped table.
pub fn of_columns<'a>(
    scene: &Scene,
    columns: impl Iterator<Item = &'a str> + Clone,
    spelling: &FieldNames,
) -> HandModel {
    let sides = derive::sides(scene, columns.clone());
    let channels: Vec<LogChannel<'_>> =
        columns.filter_map(|column| LogChannel::parse(names::meaning(column)?.channel)).collect();
    let HandModel { file, reason } = choose(shipped(), &sides, &channels);
    HandModel { file, reason: spelling.shown(&reason).into_owned() }
}

/// Chooses the hand model for some hands by the channels of a log. The reason has the names inside the program.
pub fn choose(rows: &[HandModelRow], sides: &[Side], channels: &[LogChannel<'_>]) -> HandModel {
    let measured = |row: &HandModelRow, side: Side| {
        let of_each: Option<Vec<Vec<String>>> =
            row.needs.iter().map(|quantity| quantity.measured(side, channels)).collect();
        of_each.map(|names| names.concat())
    };
    let of_all = |row: &HandModelRow| sides.iter().map(|side| measured(row, *side)).collect::<Option<Vec<_>>>();
    let of_one = |row: &HandModelRow| sides.iter().find_map(|side| measured(row, *side));
    let by_all = rows.iter().find_map(|row| Some((row, of_all(row)?.concat())).filter(|_| !sides.is_empty()));
    let found = by_all.or_else(|| rows.iter().find_map(|row| Some((row, of_one(row)?))));
    let Some((row, mut names)) = found else {
        let reason = format!("since no row of {TABLE_NAME} fits the channels of the log");
        return HandModel { file: DEFAULT.into(), reason };
    };
    names.dedup();
    HandModel { file: row.file.clone(), reason: format!("since the log has {}", joined(&names)) }
}

/// Names in a sentence: `a, b and c`.
fn joined(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

impl Quantity {
    /// The channels in which a hand measures it, as few as show that.
    fn measured(self, side: Side, channels: &[LogChannel<'_>]) -> Option<Vec<String>> {
        let first = |is_it: &dyn Fn(&LogChannel<'_>) -> bool| {
            channels.iter().find(|channel| is_it(channel)).map(|channel| vec![channel.to_string()])
        };
        let of_tip = |part: FingerPart, may_be: &dyn Fn(Finger) -> bool| {
            first(&|channel| {
                matches!(channel, LogChannel::Finger(of, finger, it)
                    if *of == side && *finger != Finger::Palm && *it == part && may_be(*finger))
            })
        };
        let touch =
            || first(&|it| matches!(it, LogChannel::Touch(of, finger, _) if *of == side && *finger != Finger::Palm));
        let is_thumb = |finger: Finger| finger == Finger::Thumb;
        match self {
            Self::FingertipForce => of_tip(FingerPart::Force, &|_| true),
            Self::FingertipContact => of_tip(FingerPart::Contact, &|_| true).or_else(touch),
            Self::FingertipPosition => of_tip(FingerPart::Position, &|_| true),
            Self::FingertipPositions => {
                let thumb = of_tip(FingerPart::Position, &is_thumb)?;
                let other = of_tip(FingerPart::Position, &|finger| !is_thumb(finger))?;
                Some([thumb, other].concat())
            }
            Self::Gripper => first(&|channel| *channel == LogChannel::GripperOpening(side))
                .or_else(|| first(&|channel| *channel == LogChannel::GripperClosed(side))),
            Self::WristForce => first(&|channel| *channel == LogChannel::Finger(side, Finger::Palm, FingerPart::Force)),
            Self::ToolPoint => of_tip(FingerPart::Position, &is_thumb),
            Self::MechanismAngle => first(&|channel| matches!(channel, LogChannel::Angle(..))),
        }
    }
}
