//! How far apart the fingers of two grippers are while one takes over what the other holds, in a bound log without poses of objects.

use super::empty_grippers::Widths;
use super::motion::lasts_s;
use super::recorded::vector;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;

/// Both hold the object for at least this time, s, …
const LEAST_S: f64 = 0.1;
/// … and their distance varies by at most this meanwhile, m: the object is rigid.
const VARIES_M: f64 = 0.02;

/// The largest distance of the fingers during the nearest hand-over, m: a gripper closes while the other one is closed, their distance stays, and the other one opens first.
pub fn distance_m(recording: &Recording, widths: &BTreeMap<Side, Widths>) -> Option<f64> {
    let [one, other] = Side::BOTH.map(|side| holds(recording, side, widths.get(&side)));
    let (one, other) = (one?, other?);
    let [from, to] = Side::BOTH.map(|side| fingers(recording, side));
    let distances: Vec<Option<f64>> =
        from?.iter().zip(&to?).map(|(from, to)| Some((from.as_ref()? - to.as_ref()?).norm())).collect();
    let mut found: Option<f64> = None;
    let mut row = 1;
    while let Some(begin) = (row..one.len()).find(|row| one[*row] && other[*row]) {
        let end = (begin..one.len()).find(|row| !one[*row] || !other[*row]).unwrap_or(one.len());
        let is_passed = end < one.len()
            && (one[begin - 1] && !other[begin - 1] && !one[end] && other[end]
                || other[begin - 1] && !one[begin - 1] && !other[end] && one[end]);
        let [least, most] = distances[begin..end]
            .iter()
            .flatten()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(*at), high.max(*at)]);
        // Without a position meanwhile, the distance is unknown.
        let is_rigid = most.is_finite() && most - least < VARIES_M;
        if is_passed && is_rigid && lasts_s(end - begin, &recording.time) > LEAST_S {
            found = Some(found.map_or(most, |known| known.min(most)));
        }
        row = end.max(begin + 1);
    }
    found
}

/// When a gripper is closed, and not as narrow as an empty one.
fn holds(recording: &Recording, side: Side, widths: Option<&Widths>) -> Option<Vec<bool>> {
    let closed = &recording.columns.get(&format!("{side}.gripper.closed"))?.values;
    let opening = recording.columns.get(&format!("{side}.gripper.opening")).map(|column| &column.values);
    let shut_m = widths.and_then(Widths::shut_m);
    let is_empty = |row: usize| opening.zip(shut_m).is_some_and(|(opening, shut_m)| opening[row] < shut_m);
    Some((0..closed.len()).map(|row| closed[row] > 0.5 && !is_empty(row)).collect())
}

/// The middle of the fingers, m.
fn fingers(recording: &Recording, side: Side) -> Option<Vec<Option<Vector3<f64>>>> {
    let [thumb, index] = ["thumb", "index"].map(|finger| vector(recording, &format!("{side}.{finger}.position")));
    let thumb = thumb?;
    Some(match index {
        Some(index) => thumb.iter().zip(&index).map(|(one, two)| Some((one.as_ref()? + two.as_ref()?) / 2.0)).collect(),
        None => thumb,
    })
}
