//! What a binding adds to the columns themselves: zeroed sensors, normals of contacts.

use super::BindingFile;
use crate::base::error::InputError;
use crate::base::recording::{Column, Recording};
use crate::base::scene::Role;
use crate::base::units::Dimension;
use crate::stream::names;
use nalgebra::Vector3;

/// Subtracts from channels what they read while they should read zero.
pub fn tare(recording: &mut Recording, file: &BindingFile) -> Result<(), InputError> {
    let Some(tare) = &file.binding.tare else { return Ok(()) };
    let from = recording.time.partition_point(|time| *time < tare.from.0);
    let to = recording.time.partition_point(|time| *time < tare.to.0);
    for channel in &tare.channels {
        let mut found = false;
        for (_, column) in recording
            .columns
            .iter_mut()
            .filter(|(name, _)| names::meaning(name).map_or(name.as_str(), |meaning| meaning.channel) == channel)
        {
            found = true;
            let rest: Vec<f64> = column
                .values
                .get(from..to)
                .unwrap_or_default()
                .iter()
                .copied()
                .filter(|value| !value.is_nan())
                .collect();
            if rest.is_empty() {
                return Err(
                    file.error("tare", format!("`{channel}` has no sample from {} s to {} s", tare.from.0, tare.to.0))
                );
            }
            let mean = rest.iter().sum::<f64>() / rest.len() as f64;
            column.values.iter_mut().for_each(|value| *value -= mean);
        }
        if !found {
            return Err(file.error("tare", format!("no channel `{channel}` is bound")));
        }
    }
    Ok(())
}

/// Gives contacts with supports and walls a normal, where none is logged: the direction of a force with friction says too little.
pub fn normals_by_role(recording: &mut Recording) {
    let role = |name: &str| recording.scene.bodies.get(name).map(|body| body.role);
    let mut normals: Vec<(String, [Vec<f64>; 3])> = vec![];
    for name in recording.columns.keys() {
        let Some(meaning) =
            names::meaning(name).filter(|meaning| meaning.dimension == Dimension::FORCE && meaning.component == 0)
        else {
            continue;
        };
        let ([Some(a), Some(b)], Some(contact)) = (meaning.bodies, meaning.channel.strip_suffix(".force")) else {
            continue;
        };
        let normal = format!("{contact}.normal");
        let force = ["x", "y", "z"].map(|component| {
            recording.columns.get(&format!("{}.{component}", meaning.channel)).map(|column| column.values.as_slice())
        });
        let [Some(x), Some(y), Some(z)] = force else { continue };
        let of_force: fn(Vector3<f64>) -> Vector3<f64> = match (role(a), role(b)) {
            (_, Some(Role::Support)) => |_| Vector3::z(),
            (Some(Role::Support), _) => |_| -Vector3::z(),
            (_, Some(Role::Wall)) | (Some(Role::Wall), _) => {
                |force| Vector3::new(force.x, force.y, 0.0).try_normalize(1e-9).unwrap_or_else(Vector3::zeros)
            }
            _ => continue,
        };
        if !recording.columns.contains_key(&format!("{normal}.x")) {
            let forces = x.iter().zip(y).zip(z).map(|((x, y), z)| Vector3::new(*x, *y, *z));
            let rows: Vec<Vector3<f64>> =
                forces.map(|force| if force.norm() > 0.0 { of_force(force) } else { Vector3::zeros() }).collect();
            normals.push((normal, [0, 1, 2].map(|axis| rows.iter().map(|row| row[axis]).collect())));
        }
    }
    for (normal, columns) in normals {
        for (component, values) in ["x", "y", "z"].into_iter().zip(columns) {
            recording.columns.insert(format!("{normal}.{component}"), Column { dimension: Dimension::NONE, values });
        }
    }
}
