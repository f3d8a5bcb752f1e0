//! Points that are known in a frame: where a log has the pose of a hand only, its fingertips are where the hand's geometry puts them.

use super::{BindingFile, OffsetPoint};
use nalgebra::Vector3;
use teachtree_base::channels::Shape;
use teachtree_base::error::InputError;
use teachtree_base::field_names::inside;
use teachtree_base::geometry::unit;
use teachtree_base::log_channel::LogChannel;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::units::Dimension;

/// Adds the position of a point that moves with a frame, to be bound under `key`.
///
/// # Errors
/// When the key is not a position, or the pose of the frame is not bound.
pub fn place(recording: &mut Recording, file: &BindingFile, key: &str, offset: &OffsetPoint) -> Result<(), InputError> {
    if !LogChannel::parse(key).is_some_and(|it| it.shape() == Shape::Vec3 && it.dimension() == Dimension::LENGTH) {
        let message = format!("`{key}` is not a position, expected a channel such as `right.thumb.position`");
        return Err(file.error(key, message));
    }
    let part = |quantity: &str, letter: &str| {
        let name = format!("{}.{quantity}.{letter}", offset.of);
        let column = recording.columns.get(&*inside(&name)).map(|column| column.values.as_slice());
        column.ok_or_else(|| {
            let message = format!("is a point of `{0}`, and no channel `{0}.{quantity}` is bound", offset.of);
            file.error(key, message)
        })
    };
    let position = [part("position", "x")?, part("position", "y")?, part("position", "z")?];
    let rotation = [part("rotation", "w")?, part("rotation", "x")?, part("rotation", "y")?, part("rotation", "z")?];
    let at = Vector3::from(offset.at);
    let value = |columns: &[&[f64]], row: usize, axis: usize| {
        columns.get(axis).and_then(|column| column.get(row)).copied().unwrap_or(f64::NAN)
    };
    let point = |row: usize| {
        let parts = [0, 1, 2, 3].map(|axis| value(&rotation, row, axis));
        let frame = Vector3::from([0, 1, 2].map(|axis| value(&position, row, axis)));
        // A rotation that was not measured says nothing of where the point is.
        if parts.iter().any(|part| part.is_nan()) { Vector3::from([f64::NAN; 3]) } else { frame + unit(parts) * at }
    };
    let points: Vec<Vector3<f64>> = (0..recording.time.len()).map(point).collect();
    for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
        let values = points.iter().map(|point| point.get(axis).copied().unwrap_or(f64::NAN)).collect();
        let column = Column { dimension: Dimension::LENGTH, values };
        if recording.columns.insert(format!("{key}.{letter}"), column).is_some() {
            return Err(file.error("channels", format!("`{key}.{letter}` is bound twice")));
        }
    }
    Ok(())
}
