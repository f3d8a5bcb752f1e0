//! Normals of contacts where the log has none.

use super::body_poses::{BodyPoses, columns, vector};
use nalgebra::Vector3;
use teachtree_base::geometry::face_normal;
use teachtree_base::log_channel::{ContactPart, LogChannel};
use teachtree_base::recording::{Column, Recording};
use teachtree_base::scene::Role;
use teachtree_base::units::Dimension;
use teachtree_logs::names::{self, ColumnMeaning};

/// Least share of a support's force that points up.
const BEARS: f64 = 0.5;

/// Gives contacts a normal where none is logged, since the direction of a force with friction says too little: upwards from a support, level from a
/// wall, out of the face of a body whose shape is known, and along the force otherwise. Downward where the force of a support does not bear from below.
pub fn normals_by_role(recording: &mut Recording) {
    let mut normals: Vec<(Vec<String>, Vec<Vector3<f64>>)> = vec![];
    for name in recording.columns.keys() {
        let Some(ColumnMeaning { channel, component: 0, .. }) = names::meaning(name) else { continue };
        let Some(contact @ LogChannel::Contact(a, b, ContactPart::Force)) = LogChannel::parse(channel) else {
            continue;
        };
        let normal = LogChannel::Contact(a, b, ContactPart::Normal);
        let (Some(force), None) =
            (columns(recording, &contact, ["x", "y", "z"]), recording.columns.get(&format!("{normal}.x")))
        else {
            continue;
        };
        let (one, other) = (BodyPoses::new(recording, a), BodyPoses::new(recording, b));
        let normal_at = |row: usize| {
            let force_on_a = vector(&force, row);
            let touching = force_on_a.norm() > 0.0;
            let normal = || {
                other
                    .normal_towards(&one, row, force_on_a)
                    .or_else(|| Some(-one.normal_towards(&other, row, -force_on_a)?))
            };
            touching.then(normal).flatten().or_else(|| force_on_a.try_normalize(0.0)).unwrap_or_else(Vector3::zeros)
        };
        normals.push((normal.columns(), (0..recording.time.len()).map(normal_at).collect()));
    }
    for (columns, rows) in normals {
        for (axis, column) in columns.into_iter().enumerate() {
            let values = rows.iter().map(|normal| normal[axis]).collect();
            recording.columns.insert(column, Column { dimension: Dimension::NONE, values });
        }
    }
}

impl BodyPoses<'_> {
    /// The normal of a contact on this body, towards the other one, as far as role and shape show; `force` is what the other body feels.
    fn normal_towards(&self, other: &Self, row: usize, force: Vector3<f64>) -> Option<Vector3<f64>> {
        let body = self.body?;
        match body.role {
            // A support bears from below: what comes from its side, or from above, is not a part of it, such as the links of a robot that a log
            // names like the table. With a normal that points down it neither carries nor stands beside.
            Role::Support if force.z < BEARS * force.norm() => Some(-Vector3::z()),
            Role::Support => Some(Vector3::z()),
            Role::Wall => Vector3::new(force.x, force.y, 0.0).try_normalize(1e-9),
            Role::Object | Role::Socket => {
                let reference_from_body = self.pose(row)?;
                let point_in_body =
                    reference_from_body.inverse_transform_point(&other.pose(row)?.translation.vector.into());
                Some(reference_from_body.rotation * face_normal(body, &point_in_body)?)
            }
        }
    }
}
