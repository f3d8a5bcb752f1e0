//! The poses of bodies in a bound log.

use nalgebra::{Isometry3, Vector3};
use std::fmt::Display;
use teachtree_base::geometry::pose;
use teachtree_base::log_channel::{BodyPart, LogChannel};
use teachtree_base::recording::Recording;
use teachtree_base::scene::Body;
use teachtree_logs::names;

/// A body with its poses.
pub struct BodyPoses<'a> {
    /// The body in the scene.
    pub body: Option<&'a Body>,
    position: Option<[&'a [f64]; 3]>,
    rotation: Option<[&'a [f64]; 4]>,
}

impl<'a> BodyPoses<'a> {
    /// A body by its name.
    pub fn new(recording: &'a Recording, name: &str) -> Self {
        Self {
            body: recording.scene.bodies.get(name),
            position: columns(recording, &LogChannel::Body(name, BodyPart::Position), ["x", "y", "z"]),
            rotation: columns(recording, &LogChannel::Body(name, BodyPart::Rotation), ["w", "x", "y", "z"]),
        }
    }

    /// The pose of the body; `None` if it was not measured or is unknown.
    pub fn pose(&self, row: usize) -> Option<Isometry3<f64>> {
        let body = self.body?;
        let at = |column: &[f64]| column.get(row).copied().unwrap_or(f64::NAN);
        let position = self.position.map_or(body.position.map(|length| length.0), |columns| columns.map(at));
        let rotation = self.rotation.map_or(body.rotation, |columns| columns.map(at));
        let measured = position.iter().chain(&rotation).all(|value| value.is_finite());
        measured.then(|| pose(position, rotation))
    }
}

/// The columns of a channel, if they are all there.
pub fn columns<'a, const N: usize>(
    recording: &'a Recording,
    channel: &impl Display,
    components: [&str; N],
) -> Option<[&'a [f64]; N]> {
    let columns = components.map(|component| {
        recording.columns.get(&format!("{channel}.{component}")).map(|column| column.values.as_slice())
    });
    columns.iter().all(Option::is_some).then(|| columns.map(Option::unwrap_or_default))
}

/// The vector in a row.
pub fn vector(columns: &[&[f64]; 3], row: usize) -> Vector3<f64> {
    Vector3::from(columns.map(|column| column.get(row).copied().unwrap_or_default()))
}

/// Whether a column is one of a channel: a component, or itself.
pub fn is_of(column: &str, channel: &str) -> bool {
    column == channel
        || names::meaning(column).map_or_else(
            || column.strip_prefix(channel).is_some_and(|rest| matches!(rest, ".x" | ".y" | ".z" | ".w")),
            |meaning| meaning.channel == channel,
        )
}
