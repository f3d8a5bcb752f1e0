//! The weight of a tool that a binding does not mention: the part of the force at a wrist that follows the orientation of the tool.
//!
//! A heavy tool that turns freely reads as much as a contact. Where the log has the orientation, and the readings of most of the log are those of a weight
//! that turns with it, that weight is subtracted. How the sensor is mounted is not known without `frame`, and is fitted too.

use super::body_poses::columns;
use super::sensor_vectors::{rotation, vectors, weigh};
use super::tool::{self, LearnedTool, Mounting};
use super::{BindingFile, Sensor};
use crate::clean::preprocess;
use nalgebra::UnitQuaternion;
use teachtree_base::error::InputError;
use teachtree_base::geometry::unit;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::recording::Recording;
use teachtree_logs::issue::{Issue, IssueKind};

/// The least variation of the weight that may pass for a contact, root mean square, N.
const LEAST: f64 = 1.0;
/// Minimum ratio of the explained variation to the residual.
const EXPLAINS: f64 = 4.0;

/// Subtracts the weights of tools at the wrists of a whole log, where the binding says nothing about them.
///
/// # Errors
/// A channel has another form than the correction needs.
pub fn take_off(recording: &mut Recording, file: &BindingFile) -> Result<Vec<Issue>, InputError> {
    let mut issues = vec![];
    // Forces with the names of channels are in the reference frame.
    if file.binding.channels.is_empty() {
        return Ok(issues);
    }
    for side in Side::BOTH {
        let channel = format!("{side}.{}.force", Finger::Palm);
        if columns(recording, &channel, ["x", "y", "z"]).is_none() {
            continue;
        }
        let sensor = file.binding.sensors.get(&channel).cloned().unwrap_or_default();
        let Some((turns, mountings)) = orientation(recording, side, &channel, &sensor, file)? else { continue };
        let (readings, gravity) = (vectors(recording, &channel, file)?, recording.scene.gravity());
        let weight = |mounting: &Mounting| tool::learned(&readings, &turns, gravity, *mounting).ok().filter(explains);
        let Some(found) = mountings.iter().find_map(weight) else { continue };
        weigh(recording, &channel, &found.tool, Some(&turns), file)?;
        let message = format!(
            "turns with the tool as a weight does: {found} are subtracted; if the sensor carries no tool, bind `tool: 0 g`"
        );
        issues.push(preprocess::over_all(&recording.time, IssueKind::LEARNED_WEIGHT, &channel, message));
    }
    Ok(issues)
}

/// Whether the readings are mostly those of a weight.
fn explains(found: &LearnedTool) -> bool {
    found.explained >= LEAST && found.explained >= EXPLAINS * found.residual
}

/// reference_from_tool of each row, and the mountings that the sensor may have.
type Orientations = (Vec<UnitQuaternion<f64>>, &'static [Mounting]);

/// Returns the orientation of the tool at a wrist in each row, and the possible mountings of its sensor, if the binding does not give its weight.
fn orientation(
    recording: &Recording,
    side: Side,
    channel: &str,
    sensor: &Sensor,
    file: &BindingFile,
) -> Result<Option<Orientations>, InputError> {
    if sensor.tool.is_some() || sensor.frame.is_none() && sensor.mounted.is_some() {
        return Ok(None);
    }
    if sensor.frame.is_some() {
        let turns = rotation(recording, channel, sensor, file)?;
        let mountings: &[Mounting] =
            if sensor.mounted.is_some() { &[Mounting::Known] } else { &[Mounting::Known, Mounting::Unknown] };
        return Ok(turns.map(|turns| (turns, mountings)));
    }
    let held =
        recording.scene.bodies.iter().filter(|(_, body)| body.fixed_to == Some(side)).map(|(name, _)| name.clone());
    let turned = std::iter::once(format!("{side}.{}", Finger::Palm)).chain(held);
    let turns = turned.into_iter().find_map(|owner| {
        let [w, x, y, z] = columns(recording, &format!("{owner}.rotation"), ["w", "x", "y", "z"])?;
        let rows = w.iter().zip(x).zip(y).zip(z);
        Some(rows.map(|(((w, x), y), z)| unit([*w, *x, *y, *z])).collect())
    });
    Ok(turns.map(|turns| (turns, &[Mounting::Unknown][..])))
}
