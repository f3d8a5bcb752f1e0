//! Unknown columns, with the names that were probably meant.

use crate::clean::preprocess::over_all;
use teachtree_base::field_names;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::log_channel::{BodyPart, FingerPart, LogChannel};
use teachtree_base::recording::Recording;
use teachtree_base::scene::Scene;
use teachtree_base::spelling::nearest;
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::names::{self, ColumnMeaning};

/// Maximum number of channels that are listed one by one. A log with more of them is a foreign log, and they are summarized.
const LISTED: usize = 20;

/// Maximum number of bodies that a message lists.
const FEW: usize = 12;

/// The parts of a hand that are not fingers.
const DEVICES: [&str; 3] = ["tcp", "wrist", "gripper"];

/// Why a column is not known.
pub enum UnknownColumn<'a> {
    /// No channel has its name.
    Name,
    /// It names a body that the scene has not.
    Body(&'a str),
}

/// The same, kept without the name that it is of.
pub enum OwnedUnknownColumn {
    /// No channel has its name.
    Name,
    /// It names a body that the scene has not.
    Body(String),
}

impl OwnedUnknownColumn {
    /// Why a column is not known.
    pub fn borrowed(&self) -> UnknownColumn<'_> {
        match self {
            Self::Name => UnknownColumn::Name,
            Self::Body(body) => UnknownColumn::Body(body),
        }
    }
}

impl<'a> UnknownColumn<'a> {
    /// The same, kept without the name that it is of.
    pub fn owned(&self) -> OwnedUnknownColumn {
        match self {
            Self::Name => OwnedUnknownColumn::Name,
            Self::Body(body) => OwnedUnknownColumn::Body((*body).to_string()),
        }
    }

    /// Why a column is not known, if it is not.
    pub fn of(name: &'a str, scene: &Scene) -> Option<Self> {
        let Some(ColumnMeaning { bodies, .. }) = names::meaning(name) else { return Some(Self::Name) };
        bodies.into_iter().flatten().find(|body| !scene.bodies.contains_key(*body)).map(Self::Body)
    }

    /// Returns the fault of this name, with a similar name.
    pub fn message(&self, name: &str, scene: &Scene) -> String {
        let meant = |near: Option<&str>| near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
        match self {
            Self::Body(body) => {
                let bodies: Vec<&str> = scene.bodies.keys().map(String::as_str).collect();
                match nearest(body, bodies.iter().copied()) {
                    None if !bodies.is_empty() && bodies.len() <= FEW => {
                        format!("the scene has no body `{body}`, only {}", bodies.join(", "))
                    }
                    near => format!("the scene has no body `{body}`{}", meant(near)),
                }
            }
            Self::Name => match unknown_part(name) {
                Some("tcp") => format!(
                    "a tool point has a position and a rotation; the force that a tool feels is that of the wrist{}",
                    meant(name.contains(".force").then(|| name.replace(".tcp.", ".wrist.")).as_deref())
                ),
                Some("wrist") => format!(
                    "a wrist has a force and a torque; the position of a tool is that of its tool point{}",
                    meant(name.contains(".position").then(|| name.replace(".wrist.", ".tcp.")).as_deref())
                ),
                Some("gripper") => format!(
                    "a gripper has a flag, `closed`, and an `opening`; tool point and wrist have the position and the force{}",
                    meant(of_tool(name).as_deref())
                ),
                Some(part) => {
                    let parts: Vec<&str> = DEVICES.into_iter().chain(Finger::ALL.map(Finger::name)).collect();
                    format!(
                        "`{part}` is not a part of a hand, expected {}{}",
                        parts.join(", "),
                        meant(nearest(part, parts.iter().copied()))
                    )
                }
                None => {
                    let known = known(scene);
                    format!("`{name}` is not a channel{}", meant(nearest(name, known.iter().map(String::as_str))))
                }
            },
        }
    }
}

/// Returns an issue for each channel that is ignored, except joints: `simulate` records them for other programs.
pub fn ignored(recording: &Recording, unknown: &[(&str, UnknownColumn)]) -> Vec<Issue> {
    // One issue a channel: three components have one and the same mistake.
    let unknown = unknown.iter().filter(|(name, _)| !is_joint(name));
    let mut channels: Vec<(&str, &UnknownColumn)> = unknown.map(|(name, why)| (whole(name), why)).collect();
    channels.dedup_by_key(|(channel, _)| *channel);
    let listed = channels.iter().take(LISTED).map(|(channel, why)| {
        let message = format!("the channel is ignored: {}", why.message(channel, &recording.scene));
        over_all(&recording.time, IssueKind::UNKNOWN_CHANNEL, channel, message)
    });
    let more = channels.len().saturating_sub(LISTED);
    let rest = (more > 0).then(|| {
        over_all(&recording.time, IssueKind::UNKNOWN_CHANNEL, "", format!("{more} more channels are ignored"))
    });
    listed.chain(rest).collect()
}

/// Whether a column is of a joint: `<hand>.joint.<joint>.position`, `velocity` or `effort`.
fn is_joint(column: &str) -> bool {
    let joint = column.split_once(".joint.").filter(|(side, _)| Side::from_name(side).is_some());
    let part = joint.and_then(|(_, joint)| joint.rsplit_once('.')).map(|(_, part)| part);
    matches!(part, Some("position" | "velocity" | "effort"))
}

/// A name without the component that it ends in.
fn whole(name: &str) -> &str {
    match names::meaning(name) {
        Some(meaning) => meaning.channel,
        None => {
            name.rsplit_once('.').filter(|(_, last)| matches!(*last, "w" | "x" | "y" | "z")).map_or(name, |it| it.0)
        }
    }
}

/// The channel of the tool point or of the wrist with the quantity that a name gives a gripper.
fn of_tool(name: &str) -> Option<String> {
    let tools = [(".position", ".tcp."), (".force", ".wrist.")];
    tools.iter().find(|(quantity, _)| name.contains(quantity)).map(|(_, tool)| name.replace(".gripper.", tool))
}

/// The part of a name that stands where a finger should: `right.pointer.force`. No shipped rule reads such a channel.
pub fn unknown_part(name: &str) -> Option<&str> {
    let mut parts = name.split('.');
    let (side, finger, quantity) = (parts.next()?, parts.next()?, parts.next()?);
    let of_finger = matches!(quantity, "position" | "force" | "contact");
    (Side::from_name(side).is_some() && of_finger && Finger::from_name(finger).is_none()).then_some(finger)
}

/// The channels that may have been meant.
fn known(scene: &Scene) -> Vec<String> {
    const OF_FINGER: [FingerPart; 3] = [FingerPart::Position, FingerPart::Force, FingerPart::Contact];
    const OF_HAND: [fn(Side) -> LogChannel<'static>; 3] =
        [LogChannel::PalmRotation, LogChannel::GripperClosed, LogChannel::GripperOpening];
    let of_fingers = Side::BOTH.into_iter().flat_map(|side| {
        let parts = |finger| OF_FINGER.map(|part| LogChannel::Finger(side, finger, part));
        Finger::ALL.into_iter().flat_map(parts).collect::<Vec<_>>()
    });
    let of_hands = Side::BOTH.into_iter().flat_map(|side| OF_HAND.map(|channel| channel(side)));
    let of_bodies = scene.bodies.keys().flat_map(|body| BodyPart::ALL.map(|part| LogChannel::Body(body, part)));
    let of_field = Side::BOTH.into_iter().flat_map(|side| field_names::all().map(move |name| format!("{side}.{name}")));
    of_fingers.chain(of_hands).chain(of_bodies).map(|channel| channel.to_string()).chain(of_field).collect()
}
