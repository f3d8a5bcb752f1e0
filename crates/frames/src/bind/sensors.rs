//! What a binding says about sensors: stamps that are late, a tool that weighs, a rest that is not zero, axes of their own.

use super::body_poses::{columns, is_of};
use super::tare::TareOffsets;
use super::tool::{self, Tool};
use super::{BindingFile, Sensor, ToolMass};
use crate::clean::preprocess;
use indexmap::IndexMap;
use nalgebra::{UnitQuaternion, Vector3};
use teachtree_base::error::InputError;
use teachtree_base::geometry::unit;
use teachtree_base::recording::{Column, Recording};
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::read::table::{placed, union};

/// What is added to the stamps of a column, s.
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
    let (rotations, issues) = weigh_tools(recording, file)?;
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

/// What [`correct`] learns from a recording.
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
                let tool = Tool { mass: mass.0, bias: Vector3::zeros() };
                weigh(recording, channel, tool, rotation.as_deref(), file)?;
            }
            Some(ToolMass::Learned(_)) => {
                let turns = rotation.as_deref().ok_or_else(|| {
                    file.error(channel, "`tool: learned` needs `frame`, the rotation that the sensor turns with".into())
                })?;
                let gravity = recording.scene.gravity();
                match tool::learned(&vectors(recording, channel, file)?, turns, gravity) {
                    Some(tool) => {
                        issues.push(learned_weight(recording, channel, &tool));
                        weigh(recording, channel, tool, Some(turns), file)?;
                    }
                    None => issues.push(unknown_weight(recording, channel)),
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

fn unknown_weight(recording: &Recording, channel: &str) -> Issue {
    let message =
        "the log does not show what the tool weighs: it hardly turns, or it is hardly ever free; nothing is subtracted";
    preprocess::over_all(&recording.time, IssueKind::UNKNOWN_WEIGHT, channel, message.to_string())
}

/// A lighter tool has no sign: what is fitted to a sensor that bears nothing, kg.
const SIGNED_KG: f64 = 0.03;

/// What was learned, for the user to see.
fn learned_weight(recording: &Recording, channel: &str, tool: &Tool) -> Issue {
    let (mass, bias) = (tool.mass.abs() * 1e3, tool.bias.norm());
    let turn = if tool.mass < -SIGNED_KG {
        ", read with the opposite sign: bind it with a minus, since it is to be the force on the object"
    } else {
        ""
    };
    let message = format!("a tool of {mass:.0} g and a bias of {bias:.3} N are learned and subtracted{turn}");
    preprocess::over_all(&recording.time, IssueKind::LEARNED_WEIGHT, channel, message)
}

/// reference_from_sensor in each row; none when the sensor measures in the reference frame.
fn rotation(
    recording: &Recording,
    channel: &str,
    sensor: &Sensor,
    file: &BindingFile,
) -> Result<Option<Vec<UnitQuaternion<f64>>>, InputError> {
    let mounted = sensor.mounted.map(unit);
    let Some(frame) = &sensor.frame else {
        return Ok(mounted.map(|mounted| vec![mounted; recording.time.len()]));
    };
    let part = |component: &str| {
        let name = format!("{frame}.{component}");
        let column = recording.columns.get(&name).map(|column| column.values.as_slice());
        column.ok_or_else(|| file.error(channel, format!("its frame is `{frame}`, and no channel `{name}` is bound")))
    };
    let parts = [part("w")?, part("x")?, part("y")?, part("z")?];
    let at = |row: usize| {
        let values = parts.map(|column| column.get(row).copied().unwrap_or(f64::NAN));
        unit(values) * mounted.unwrap_or_default()
    };
    Ok(Some((0..recording.time.len()).map(at).collect()))
}

/// Takes off what a tool between the sensor and what is touched weighs, and the bias of the sensor.
///
/// The sensor bears the tool: while nothing is touched, a force on an object reads as the tool's weight turned upwards.
fn weigh(
    recording: &mut Recording,
    channel: &str,
    tool: Tool,
    rotation: Option<&[UnitQuaternion<f64>]>,
    file: &BindingFile,
) -> Result<(), InputError> {
    let weight_in_reference = recording.scene.gravity() * tool.mass;
    change(recording, channel, file, |row, force| {
        let reference_from_sensor = rotation.and_then(|rotation| rotation.get(row)).copied().unwrap_or_default();
        force - tool.bias + reference_from_sensor.inverse() * weight_in_reference
    })
}

/// The vectors of a channel, row by row.
fn vectors(recording: &Recording, channel: &str, file: &BindingFile) -> Result<Vec<Vector3<f64>>, InputError> {
    let [x, y, z] = columns(recording, &channel, ["x", "y", "z"])
        .ok_or_else(|| file.error(channel, format!("`{channel}` is no vector, it has no frame and bears no tool")))?;
    Ok(x.iter().zip(y).zip(z).map(|((x, y), z)| Vector3::new(*x, *y, *z)).collect())
}

/// Changes the vectors of a channel row by row.
fn change(
    recording: &mut Recording,
    channel: &str,
    file: &BindingFile,
    changed: impl Fn(usize, Vector3<f64>) -> Vector3<f64>,
) -> Result<(), InputError> {
    let rows = vectors(recording, channel, file)?;
    let rows: Vec<Vector3<f64>> = rows.into_iter().enumerate().map(|(row, force)| changed(row, force)).collect();
    for (axis, component) in ["x", "y", "z"].into_iter().enumerate() {
        if let Some(Column { values, .. }) = recording.columns.get_mut(&format!("{channel}.{component}")) {
            *values = rows.iter().map(|row| row.get(axis).copied().unwrap_or(f64::NAN)).collect();
        }
    }
    Ok(())
}
