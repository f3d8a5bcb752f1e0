//! The vectors that sensors read, row by row, and how the sensors are turned.

use super::body_poses::columns;
use super::tool::Tool;
use super::{BindingFile, Sensor};
use nalgebra::{UnitQuaternion, Vector3};
use teachtree_base::error::InputError;
use teachtree_base::geometry::unit;
use teachtree_base::recording::{Column, Recording};

/// reference_from_sensor in each row; none when the sensor measures in the reference frame.
pub fn rotation(
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

/// Subtracts the weight of a tool between the sensor and its contacts, and the bias of the sensor.
///
/// The sensor bears the tool: while nothing is touched, a force on an object reads as the tool's weight turned upwards.
pub fn weigh(
    recording: &mut Recording,
    channel: &str,
    tool: &Tool,
    rotation: Option<&[UnitQuaternion<f64>]>,
    file: &BindingFile,
) -> Result<(), InputError> {
    let gravity = recording.scene.gravity();
    change(recording, channel, file, |row, force| {
        let reference_from_sensor = rotation.and_then(|rotation| rotation.get(row)).copied().unwrap_or_default();
        tool.taken_off(force, reference_from_sensor.inverse() * gravity)
    })
}

/// The vectors of a channel, row by row.
pub fn vectors(recording: &Recording, channel: &str, file: &BindingFile) -> Result<Vec<Vector3<f64>>, InputError> {
    let [x, y, z] = columns(recording, &channel, ["x", "y", "z"])
        .ok_or_else(|| file.error(channel, format!("`{channel}` is not a vector: it has no frame and no tool")))?;
    Ok(x.iter().zip(y).zip(z).map(|((x, y), z)| Vector3::new(*x, *y, *z)).collect())
}

/// Changes the vectors of a channel row by row.
pub fn change(
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
