//! The channels of a bound log as positions and rotations.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;

/// The rows of a vector; none where a component is missing.
pub fn vector(recording: &Recording, channel: &str) -> Option<Vec<Option<Vector3<f64>>>> {
    let column = |axis: &str| recording.columns.get(&format!("{channel}.{axis}")).map(|column| &column.values);
    let (x, y, z) = (column("x")?, column("y")?, column("z")?);
    let rows = x.iter().zip(y).zip(z).map(|((x, y), z)| Vector3::new(*x, *y, *z));
    Some(rows.map(|at| at.iter().all(|part| part.is_finite()).then_some(at)).collect())
}

/// The rows of the rotation of a body; none is turned where the log lacks it.
pub fn turns(recording: &Recording, body: &str, rows: usize) -> Vec<UnitQuaternion<f64>> {
    let parts = ["w", "x", "y", "z"].map(|part| recording.columns.get(&format!("{body}.rotation.{part}")));
    let turn = |row: usize| {
        let [w, x, y, z] = parts.map(|part| part.and_then(|part| part.values.get(row).copied()).unwrap_or(f64::NAN));
        UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-9).unwrap_or_default()
    };
    (0..rows).map(turn).collect()
}

/// Where a body is first, m.
pub fn start(recording: &Recording, body: &str) -> Option<[f64; 3]> {
    vector(recording, &format!("{body}.position"))?.into_iter().flatten().next().map(Into::into)
}

/// The paths of all bodies with a position, m.
pub fn paths(recording: &Recording) -> impl Iterator<Item = (&str, Vec<Option<Vector3<f64>>>)> {
    let names = recording.scene.bodies.keys();
    names.filter_map(|name| Some((name.as_str(), vector(recording, &format!("{name}.position"))?)))
}

/// The tool point of a hand, else its palm, m.
pub fn tool(recording: &Recording, side: Side) -> Option<Vec<Option<Vector3<f64>>>> {
    ["thumb", "palm"].iter().find_map(|part| vector(recording, &format!("{side}.{part}.position")))
}

/// Whether a log has a channel of this part of a hand, such as `gripper`.
pub fn has_part(recording: &Recording, side: Side, part: &str) -> bool {
    let begin = format!("{side}.{part}.");
    recording.columns.keys().any(|name| name.starts_with(&begin))
}
