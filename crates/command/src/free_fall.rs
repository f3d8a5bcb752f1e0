//! Ends the task of an object that falls and does not land. Later motions of the hand do not concern the object.

use super::columns::vectors;
use super::schema::Omission;
use nalgebra::Vector3;
use teachtree_analysis::TaskSpan;
use teachtree_base::log_channel::{BodyPart, LogChannel};
use teachtree_base::recording::Recording;

/// Speed thresholds of a fall, m/s. An object falls if its downward speed exceeds the first threshold and then reaches the second one without dropping
/// below the first in between. The second one corresponds to a free fall of 115 mm.
const FALLS_M_S: f64 = 0.5;
const FALLEN_M_S: f64 = 1.5;
/// Time over which speeds are averaged, s.
const OVER_S: f64 = 0.05;
/// Minimum duration of the segment in which an object starts to fall, s. Shorter segments are left out.
const SHORTEST_S: f64 = 0.05;

/// Returns the time (s of the recording) at which an object starts to fall, if it is still falling at the end of the recording.
pub(super) fn falls_s(recording: &Recording, object: &str) -> Option<f64> {
    let gravity = recording.scene.gravity();
    let down = gravity.try_normalize(1e-9)?;
    let time = &recording.time;
    let rows: Vec<usize> = (0..time.len()).collect();
    let positions = vectors(recording, &LogChannel::Body(object, BodyPart::Position), &rows)?;
    let depth = |row: usize| positions.get(row).map_or(0.0, |place: &Vector3<f64>| place.dot(&down));
    let mut before = 0;
    let speeds: Vec<f64> = (0..time.len())
        .map(|row| {
            while before + 1 < row && time[row] - time[before + 1] >= OVER_S {
                before += 1;
            }
            let lasts_s = time[row] - time[before];
            if lasts_s > 0.0 { (depth(row) - depth(before)) / lasts_s } else { 0.0 }
        })
        .collect();
    let begins = speeds.iter().rposition(|speed| *speed < FALLS_M_S).map_or(0, |row| row + 1);
    let fastest = speeds.get(begins..)?.iter().copied().fold(0.0, f64::max);
    // A free fall takes this long to reach the threshold.
    let since_s = FALLS_M_S / gravity.norm() + OVER_S / 2.0;
    (fastest >= FALLEN_M_S).then(|| (time[begins] - since_s).max(time[0]))
}

/// Splits a task at `fell_s`, the time (s) at which its object starts to fall. Returns the part before, `None` if it is empty, and the part that is
/// left out.
pub(super) fn ended(span: &TaskSpan, fell_s: f64) -> (Option<TaskSpan>, Omission) {
    let mut ended = span.clone();
    let after = span.segments.iter().filter(|segment| segment.end_s > fell_s);
    let left_out = Omission {
        primitives: after.map(|segment| segment.primitive.clone()).collect(),
        start_s: fell_s.max(span.start_s),
        end_s: span.end_s,
        why: "falls".into(),
    };
    ended.segments.retain(|segment| segment.start_s + SHORTEST_S < fell_s);
    for segment in &mut ended.segments {
        segment.end_s = segment.end_s.min(fell_s);
    }
    ended.end_s = fell_s;
    ((!ended.segments.is_empty()).then_some(ended), left_out)
}
