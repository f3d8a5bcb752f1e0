//! Bearings of a bound log: bodies that turn and stay where they are in another body or in the room, such as the lever of a door or a valve.

use super::recorded::vector;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use teachtree_base::recording::Recording;

/// What moves less than this stays in its place, m.
const STAYS_M: f64 = 0.005;
/// The least turn, rad.
const TURNS_RAD: f64 = 0.2;
/// How deep the origin of a body is in its bearing, m: half of the depth that the scene gets.
const INSIDE_M: f64 = 0.02;
/// The most rows that are compared.
const MAX_ROWS: usize = 2000;

/// A bearing.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundBearing {
    /// The body that turns.
    pub object: String,
    /// The body in which it turns; none for the room.
    pub of: Option<String>,
    /// Its rim, [`INSIDE_M`] beyond the origin of the body that turns, in the frame of the other one or in that of the log, m.
    pub rim: [f64; 3],
    /// The axis there, unit.
    pub axis: [f64; 3],
}

/// A body with its poses.
struct Body<'a> {
    name: &'a str,
    poses: Vec<Option<(Vector3<f64>, UnitQuaternion<f64>)>>,
}

/// The bearings: each body turns in another one, else in the room.
pub fn bearings(recording: &Recording) -> Vec<FoundBearing> {
    let bodies: Vec<Body> = recording.scene.bodies.keys().filter_map(|name| Body::new(recording, name)).collect();
    let bearing = |body: &Body| {
        let others = bodies.iter().filter(|other| other.name != body.name);
        others.map(Some).chain([None]).find_map(|holder| body.turns_in(holder))
    };
    bodies.iter().filter_map(bearing).collect()
}

impl<'a> Body<'a> {
    fn new(recording: &Recording, name: &'a str) -> Option<Self> {
        let positions = vector(recording, &format!("{name}.position"))?;
        let column =
            |part: &str| recording.columns.get(&format!("{name}.rotation.{part}")).map(|column| &column.values);
        let [w, x, y, z] = [column("w")?, column("x")?, column("y")?, column("z")?];
        let step = positions.len().div_ceil(MAX_ROWS).max(1);
        let pose = |row: usize| {
            let turn = Quaternion::new(*w.get(row)?, *x.get(row)?, *y.get(row)?, *z.get(row)?);
            Some((positions[row]?, UnitQuaternion::try_new(turn, 1e-9)?))
        };
        Some(Self { name, poses: (0..positions.len()).step_by(step).map(pose).collect() })
    }

    /// The bearing in a holder, if this body turns there and stays.
    fn turns_in(&self, holder: Option<&Self>) -> Option<FoundBearing> {
        let poses: Vec<(Vector3<f64>, UnitQuaternion<f64>)> = match holder {
            None => self.poses.iter().flatten().copied().collect(),
            Some(holder) => {
                let both = self.poses.iter().zip(&holder.poses).filter_map(|(own, other)| Some(((*own)?, (*other)?)));
                both.map(|((at, turn), (origin, of))| (of.inverse() * (at - origin), of.inverse() * turn)).collect()
            }
        };
        let (start, first) = *poses.first()?;
        if poses.iter().any(|(at, _)| (at - start).norm() > STAYS_M) {
            return None;
        }
        let turned = poses.iter().map(|(_, turn)| turn * first.inverse());
        let farthest = turned.max_by(|one, other| one.angle().total_cmp(&other.angle()))?;
        let axis = farthest.axis().filter(|_| farthest.angle() > TURNS_RAD)?;
        Some(FoundBearing {
            object: self.name.to_string(),
            of: holder.map(|holder| holder.name.to_string()),
            rim: (start + axis.into_inner() * INSIDE_M).into(),
            axis: axis.into_inner().into(),
        })
    }
}
