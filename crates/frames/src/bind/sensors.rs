//! The corrections of sensors in a binding: delayed stamps, the weight of a tool, a bias, and the axes of the sensor.

use super::body_poses::is_of;
use super::sensor_vectors::{change, rotation, vectors, weigh};
use super::tare::TareOffsets;
use super::tool::{self, LearnedTool, Mounting, Tool, UnknownTool};
use super::turning_weight;
use super::{BindingFile, Sensor, ToolMass};
use crate::clean::preprocess;
use indexmap::IndexMap;
use nalgebra::UnitQuaternion;
use teachtree_base::error::InputError;
use teachtree_base::recording::Recording;
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::read::table::{placed, union};

/// The offset of the stamps of a column, s.
pub fn offset(sensors: &IndexMap<String, Sensor>, column: &str) -> f64 {
    sensors.iter().find(|(channel, _)| is_of(column, channel)).map_or(0.0, |(_, sensor)| sensor.time_offset.0)
}

/// Checks that all sensors are bound.
///
/// # Errors
/// When one is not.
pub fn check_bound(recording: &Recording, file: &BindingFile) -> Result<(), InputError> {
    let is_bound = |channel: &String| recording.columns.keys().any(|name| is_of(name, channel));
    match file.binding.sensors.keys().find(|channel| !is_bound(channel)) {
        Some(channel) => Err(file.error(channel, format!("no channel `{channel}` is bound"))),
        None => Ok(()),
    }
}

/// Checks that the corrections have the channels that they need.
///
/// # Errors
/// When a channel is not bound, or has another form than the correction needs.
pub fn check(recording: &Recording, file: &BindingFile) -> Result<(), InputError> {
    for (channel, sensor) in &file.binding.sensors {
        let rotation = rotation(recording, channel, sensor, file)?;
        if matches!(sensor.tool, Some(ToolMass::Learned(_))) && rotation.is_none() {
            return Err(needs_frame(file, channel));
        }
        if rotation.is_some() || sensor.tool.is_some() {
            vectors(recording, channel, file)?;
        }
    }
    Ok(())
}

fn needs_frame(file: &BindingFile, channel: &str) -> InputError {
    file.error(channel, "`tool: learned` needs `frame`, the rotation that the sensor turns with".into())
}

/// Shifts the stamps of the sensors that have an offset; the log is then on the union of all stamps, to be resampled.
///
/// # Errors
/// When a sensor is not bound.
pub fn shift(recording: &mut Recording, file: &BindingFile) -> Result<bool, InputError> {
    let offset = |column: &str| offset(&file.binding.sensors, column);
    check_bound(recording, file)?;
    for (channel, sensor) in &file.binding.sensors {
        if !sensor.time_offset.0.is_finite() {
            return Err(file.error(channel, "the time offset is not finite".into()));
        }
    }
    let shifted = |offset: f64| -> Vec<f64> { recording.time.iter().map(|stamp| stamp + offset).collect() };
    let mut offsets: Vec<f64> = recording.columns.keys().map(|name| offset(name)).collect();
    offsets.sort_by(f64::total_cmp);
    offsets.dedup();
    if offsets.iter().all(|offset| *offset == 0.0) {
        return Ok(false);
    }
    let stamps: Vec<Vec<f64>> = offsets.iter().map(|offset| shifted(*offset)).collect();
    let time = union(&stamps.iter().map(Vec::as_slice).collect::<Vec<_>>());
    for (name, column) in &mut recording.columns {
        let own: Vec<f64> = recording.time.iter().map(|stamp| stamp + offset(name)).collect();
        column.values = placed(&time, &own, &column.values);
    }
    for texts in recording.labels.values_mut() {
        let row = |stamp: &f64| recording.time.partition_point(|own| own <= stamp).saturating_sub(1);
        *texts = time.iter().map(|stamp| texts.get(row(stamp)).cloned().unwrap_or_default()).collect();
    }
    recording.time = time;
    Ok(true)
}

/// Takes the weight of tools off, then what should read zero, then turns forces into the reference frame. Learns what reads zero from the recording.
///
/// # Errors
/// When a channel is not bound, or has another form than the correction needs.
pub fn correct(recording: &mut Recording, file: &BindingFile) -> Result<Vec<Issue>, InputError> {
    let (rotations, mut issues) = weigh_tools(recording, file)?;
    issues.extend(turning_weight::take_off(recording, file)?);
    TareOffsets::learn(recording, file)?.take_off(recording);
    turn(recording, &rotations, file)?;
    Ok(issues)
}

/// As [`correct`], with what was learned before.
///
/// # Errors
/// As [`correct`].
pub fn correct_by(rest: &TareOffsets, recording: &mut Recording, file: &BindingFile) -> Result<Vec<Issue>, InputError> {
    let (rotations, issues) = weigh_tools(recording, file)?;
    rest.take_off(recording);
    turn(recording, &rotations, file)?;
    Ok(issues)
}

/// The values that [`correct`] learns from a recording.
///
/// # Errors
/// As [`correct`].
pub fn at_rest(mut recording: Recording, file: &BindingFile) -> Result<TareOffsets, InputError> {
    weigh_tools(&mut recording, file)?;
    TareOffsets::learn(&recording, file)
}

/// reference_from_sensor in each row, by channel.
type Rotations<'a> = Vec<(&'a String, Vec<UnitQuaternion<f64>>)>;

/// Takes the weight of tools off. Returns how sensors are turned.
fn weigh_tools<'a>(
    recording: &mut Recording,
    file: &'a BindingFile,
) -> Result<(Rotations<'a>, Vec<Issue>), InputError> {
    let (mut turned, mut issues) = (vec![], vec![]);
    for (channel, sensor) in &file.binding.sensors {
        let rotation = rotation(recording, channel, sensor, file)?;
        match sensor.tool {
            Some(ToolMass::Known(mass)) => {
                weigh(recording, channel, &Tool::of_mass(mass.0), rotation.as_deref(), file)?;
            }
            Some(ToolMass::Learned(_)) => {
                let turns = rotation.as_deref().ok_or_else(|| needs_frame(file, channel))?;
                let gravity = recording.scene.gravity();
                match tool::learned(&vectors(recording, channel, file)?, turns, gravity, Mounting::Known) {
                    Ok(found) => {
                        issues.push(learned_weight(recording, channel, &found));
                        weigh(recording, channel, &found.tool, Some(turns), file)?;
                    }
                    Err(why) => issues.push(unknown_weight(recording, channel, why)),
                }
            }
            None => {}
        }
        turned.extend(rotation.map(|rotation| (channel, rotation)));
    }
    Ok((turned, issues))
}

/// Turns forces into the reference frame.
fn turn(recording: &mut Recording, rotations: &Rotations, file: &BindingFile) -> Result<(), InputError> {
    for (channel, rotation) in rotations {
        change(recording, channel, file, |row, force| rotation.get(row).copied().unwrap_or_default() * force)?;
    }
    Ok(())
}

fn unknown_weight(recording: &Recording, channel: &str, why: UnknownTool) -> Issue {
    let why = match why {
        UnknownTool::NoReadings => "the log has no readings to learn from".to_string(),
        UnknownTool::HardlyTurns(scatter) => {
            format!("it hardly turns: the direction of gravity in the frame of the sensor scatters by {scatter:.2} rad")
        }
        UnknownTool::HardlyFree(share) => {
            format!("it is rarely free of contact: one mass fits only {:.0} % of its orientations", share * 100.0)
        }
        UnknownTool::EndsDiffer(off) => format!(
            "the fit of most of the log is {off:.1} N off at its beginning and at its end, where the tool should be free"
        ),
        UnknownTool::Uncertain { mass_sd, .. } if mass_sd.is_infinite() => {
            "it turns in one part of the log only".to_string()
        }
        UnknownTool::Uncertain { mass, mass_sd } => format!(
            "the best fit is {:.0} ± {:.0} g, so the readings contain contact, or other forces than the weight, wherever it turns",
            mass.abs() * 1e3,
            tool::DEVIATIONS * mass_sd * 1e3
        ),
    };
    let message = format!(
        "the log does not show the weight of the tool: {why}; nothing is subtracted; name the mass, such as `tool: 430 g`, or turn the free tool"
    );
    preprocess::over_all(&recording.time, IssueKind::UNKNOWN_WEIGHT, channel, message)
}

/// A lighter tool has no sign: what is fitted to a sensor that bears nothing, kg.
const SIGNED_KG: f64 = 0.03;

/// Returns the learned values as text.
fn learned_weight(recording: &Recording, channel: &str, found: &LearnedTool) -> Issue {
    let turn = if found.tool.mass() < -SIGNED_KG {
        ", read with the opposite sign: bind it with a minus, since it is to be the force on the object"
    } else {
        ""
    };
    let message = format!("{found} are learned and subtracted{turn}");
    preprocess::over_all(&recording.time, IssueKind::LEARNED_WEIGHT, channel, message)
}
