//! Sensor sets: convert a recording of the virtual environment to the log of a robot cell with fewer sensors, at 100 Hz.

use nalgebra::Vector3;
use std::path::PathBuf;
use teachtree::{Column, Log, Rules, Scene};
use teachtree_base::hands::{Finger, Side};
use teachtree_base::log_channel::{BodyPart, FingerPart, LogChannel};
use teachtree_base::recording::Recording;
use teachtree_base::scene::Role;
use teachtree_world::Operator;

/// Rows of the recording for each row of the log.
const EVERY: usize = 10;
/// A gripper is closed if its opening exceeds the width of its object by less than this distance, m.
const CLOSED_M: f64 = 0.008;

/// The signals that a cell logs, and the hand model and params for them.
pub struct SensorSet {
    pub name: &'static str,
    hand_file: &'static str,
    params: &'static [(&'static str, &'static str)],
    logs: fn(&LogChannel<'_>) -> bool,
    /// The hand is a gripper: the log has its tool point instead of fingertips.
    gripper: bool,
    pub object_poses: bool,
}

/// Contacts in these scenes have less than the 5 N of the rules, which allow for heavy tools. The objects weigh 0.4 N.
const LIGHT: &[(&str, &str)] = &[("contact_on", "0.5 N"), ("contact_off", "0.3 N"), ("bump_force", "1 N")];

pub const SETS: [SensorSet; 6] = [
    SensorSet {
        name: "contact flags, poses",
        hand_file: "hand_flags.rules",
        params: &[],
        logs: |channel| is_pose(channel) || matches!(channel, LogChannel::Finger(_, _, FingerPart::Contact)),
        gripper: false,
        object_poses: true,
    },
    SensorSet {
        name: "fingertip forces, poses",
        hand_file: "hand_force.rules",
        params: &[],
        logs: |channel| is_pose(channel) || is_tip_force(channel),
        gripper: false,
        object_poses: true,
    },
    SensorSet {
        name: "wrist force, opening, tool pose",
        hand_file: "hand_gripper_wrist.rules",
        params: LIGHT,
        logs: is_wrist,
        gripper: true,
        object_poses: false,
    },
    SensorSet {
        name: "wrist force, opening, tool and object poses",
        hand_file: "hand_gripper_wrist.rules",
        params: LIGHT,
        logs: |channel| is_wrist(channel) || is_body_pose(channel),
        gripper: true,
        object_poses: true,
    },
    SensorSet {
        name: "opening, tool and object poses",
        hand_file: "hand_gripper.rules",
        params: &[],
        logs: is_body_pose,
        gripper: true,
        object_poses: true,
    },
    SensorSet {
        name: "poses",
        hand_file: "hand_vision.rules",
        params: &[],
        logs: is_pose,
        gripper: false,
        object_poses: true,
    },
];

fn is_body_pose(channel: &LogChannel<'_>) -> bool {
    matches!(channel, LogChannel::Body(_, BodyPart::Position | BodyPart::Rotation))
}

fn is_pose(channel: &LogChannel<'_>) -> bool {
    is_body_pose(channel)
        || matches!(channel, LogChannel::PalmRotation(_))
        || matches!(channel, LogChannel::Finger(_, finger, FingerPart::Position) if *finger != Finger::Palm)
}

fn is_tip_force(channel: &LogChannel<'_>) -> bool {
    matches!(channel, LogChannel::Finger(_, finger, FingerPart::Force) if *finger != Finger::Palm)
}

fn is_wrist(channel: &LogChannel<'_>) -> bool {
    matches!(channel, LogChannel::Finger(_, Finger::Palm, FingerPart::Force | FingerPart::Position))
}

impl SensorSet {
    /// Converts a recording to the log of this cell.
    ///
    /// # Errors
    /// A log that the reader rejects.
    pub fn log(&self, recording: &Recording, operator: &Operator) -> Result<Log, String> {
        let rows = |values: &[f64]| values.iter().step_by(EVERY).copied().collect::<Vec<f64>>();
        let mut columns = vec![Column::new("time", "", rows(&recording.time))];
        for (name, column) in &recording.columns {
            let stem = name.rsplit_once('.').map_or(name.as_str(), |(stem, _)| stem);
            let channel = LogChannel::parse(name).or_else(|| LogChannel::parse(stem));
            if channel.is_some_and(|channel| (self.logs)(&channel)) {
                columns.push(Column::new(name, "", rows(&column.values)));
            }
        }
        let mut scene = recording.scene.clone();
        if self.gripper {
            for side in recording.scene.hands.keys() {
                columns.extend(tool_columns(recording, *side, closed_below(operator, *side)));
            }
            scene.hands.clear();
        }
        if !self.object_poses {
            scene.bodies.retain(|_, body| body.role != Role::Object);
            scene.bodies.values_mut().for_each(|body| body.sockets.clear());
        }
        let text = serde_json::to_string(&scene).map_err(|error| error.to_string())?;
        let scene = Scene::parse("scene", &text).map_err(|error| error.to_string())?;
        Log::from_columns("recording", columns, &scene).map_err(|error| error.to_string())
    }

    /// Loads the rules for such a log: `files`, or the default ones if there are none.
    ///
    /// # Errors
    /// A hand model or param that does not fit the rules.
    pub fn rules(&self, log: &Log, files: &[PathBuf]) -> Result<Rules, String> {
        let options = files.iter().fold(Rules::options().hand_file(self.hand_file), |options, file| options.file(file));
        let options = self.params.iter().fold(options, |options, (name, value)| options.param(*name, *value));
        options.for_log(log).map_err(|error| error.to_string())
    }
}

/// The pads of the thumb and of the opposing fingers, m.
type JawPads = (Vector3<f64>, Vector3<f64>);

/// The tool point, between the pads of the thumb and of the opposing fingers, the distance of these pads, and whether the gripper is closed.
fn tool_columns(recording: &Recording, side: Side, closed_m: f64) -> Vec<Column> {
    let tip = |finger: &str, row: usize| {
        let part = |axis: &str| Some(recording.columns.get(&format!("{side}.{finger}.position.{axis}"))?.values[row]);
        Some(Vector3::new(part("x")?, part("y")?, part("z")?))
    };
    let jaws = |row: usize| Some((tip("thumb", row)?, (tip("index", row)? + tip("middle", row)?) / 2.0));
    let jaws: Option<Vec<_>> = (0..recording.time.len()).step_by(EVERY).map(jaws).collect();
    let (Some(jaws), Some(hand)) = (jaws, recording.scene.hands.get(&side)) else { return Vec::new() };
    let column = |name: &str, value: &dyn Fn(&JawPads) -> f64| {
        Column::new(format!("{side}.{name}"), "", jaws.iter().map(value).collect::<Vec<f64>>())
    };
    let opening = |(thumb, others): &JawPads| ((thumb - others).norm() - 2.0 * hand.tip_radius.0).max(0.0);
    vec![
        column("thumb.position.x", &|(thumb, others)| (thumb.x + others.x) / 2.0),
        column("thumb.position.y", &|(thumb, others)| (thumb.y + others.y) / 2.0),
        column("thumb.position.z", &|(thumb, others)| (thumb.z + others.z) / 2.0),
        column("gripper.opening", &opening),
        column("gripper.closed", &|jaws| f64::from(u8::from(opening(jaws) < closed_m))),
    ]
}

/// The opening below which the gripper of a hand is closed, m: the width of its first grip and `CLOSED_M`.
fn closed_below(operator: &Operator, side: Side) -> f64 {
    let start = operator.hands.get(&side).and_then(|script| operator.grips.get(&script.start.grip));
    let width = start.and_then(|grip| {
        let thumb = grip.contacts.get(&Finger::Thumb)?;
        let others = grip.contacts.iter().filter(|(finger, _)| **finger != Finger::Thumb);
        let distances = others.map(|(_, point)| {
            let squares = point.iter().zip(thumb).map(|(one, other)| (one.0 - other.0).powi(2));
            squares.sum::<f64>().sqrt()
        });
        distances.reduce(f64::min)
    });
    width.unwrap_or_default() + CLOSED_M
}
