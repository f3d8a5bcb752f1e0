//! The pads of a gripper: half the opening to each side of the tool point, where a log has these alone.

use super::BindingFile;
use super::body_poses::columns;
use nalgebra::Vector3;
use serde::Deserialize;
use teachtree_base::error::InputError;
use teachtree_base::geometry::unit;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::log_channel::{FingerPart, LogChannel};
use teachtree_base::recording::{Column, Recording};
use teachtree_base::units::Dimension;

/// Where the pads of a gripper are.
#[derive(Clone, Copy, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pads {
    /// The point in the middle between them.
    #[serde(default)]
    #[allow(dead_code, reason = "there is one such point")]
    of: Middle,
    /// How far they are apart.
    #[serde(default)]
    #[allow(dead_code, reason = "there is one such distance")]
    opening: Distance,
    /// The axis of the tool along which they move.
    axis: ToolAxis,
}

/// The point in the middle between the pads.
#[derive(Clone, Copy, Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Middle {
    /// The tool center point.
    #[default]
    Tcp,
}

/// How far the pads are apart.
#[derive(Clone, Copy, Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Distance {
    /// By the opening of the gripper.
    #[default]
    Gripper,
}

/// An axis of the tool.
#[derive(Clone, Copy, Debug, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
enum ToolAxis {
    /// Its x axis.
    X,
    /// Its y axis.
    Y,
    /// Its z axis.
    Z,
}

impl ToolAxis {
    fn direction(self) -> Vector3<f64> {
        match self {
            Self::X => Vector3::x(),
            Self::Y => Vector3::y(),
            Self::Z => Vector3::z(),
        }
    }
}

/// Puts the pads of each gripper in place of its tool point: they are thumb and index finger, and the palm is at the tool point.
///
/// # Errors
/// No hand has a tool point with a rotation and an opening; a pad is bound.
pub fn place(recording: &mut Recording, file: &BindingFile) -> Result<(), InputError> {
    let Some(pads) = file.binding.pads else { return Ok(()) };
    let mut is_placed = false;
    for side in Side::BOTH {
        let Some([thumb, index]) = positions(recording, side, pads.axis.direction()) else { continue };
        is_placed = true;
        let channel = |finger| LogChannel::Finger(side, finger, FingerPart::Position);
        let [of_thumb, of_index, of_palm] = [Finger::Thumb, Finger::Index, Finger::Palm].map(channel);
        if recording.columns.contains_key(&format!("{of_index}.x")) {
            return Err(file.error("pads", format!("`{of_index}` is bound, and is the position of a pad too")));
        }
        for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
            let column = |points: &[Vector3<f64>]| Column {
                dimension: Dimension::LENGTH,
                values: points.iter().map(|point| point.get(axis).copied().unwrap_or(f64::NAN)).collect(),
            };
            let tool_point = recording.columns.insert(format!("{of_thumb}.{letter}"), column(&thumb));
            recording.columns.insert(format!("{of_index}.{letter}"), column(&index));
            if let Some(tool_point) = tool_point {
                recording.columns.entry(format!("{of_palm}.{letter}")).or_insert(tool_point);
            }
        }
    }
    if is_placed {
        return Ok(());
    }
    let message = "no hand has a tool point with a rotation and an opening, expected `right.tcp.position`, `right.tcp.rotation` and `right.gripper.opening`";
    Err(file.error("pads", message.into()))
}

/// Where the pads of a hand are in each row, if the recording has what they follow from.
fn positions(recording: &Recording, side: Side, direction: Vector3<f64>) -> Option<[Vec<Vector3<f64>>; 2]> {
    let tool_point = LogChannel::Finger(side, Finger::Thumb, FingerPart::Position);
    let [x, y, z] = columns(recording, &tool_point, ["x", "y", "z"])?;
    let [w, i, j, k] = columns(recording, &LogChannel::PalmRotation(side), ["w", "x", "y", "z"])?;
    let opening = &recording.columns.get(&LogChannel::GripperOpening(side).to_string())?.values;
    let at = |column: &[f64], row: usize| column.get(row).copied().unwrap_or(f64::NAN);
    let pad = |row: usize, sign: f64| {
        let middle = Vector3::from([x, y, z].map(|column| at(column, row)));
        let rotation = [w, i, j, k].map(|column| at(column, row));
        // A rotation that was not measured says nothing of where the pads are.
        let is_known = rotation.iter().all(|part| part.is_finite());
        let aside = if is_known { unit(rotation) * direction } else { Vector3::from([f64::NAN; 3]) };
        middle + aside * (sign * at(opening, row) / 2.0)
    };
    Some([1.0, -1.0].map(|sign| (0..recording.time.len()).map(|row| pad(row, sign)).collect()))
}
