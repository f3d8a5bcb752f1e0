//! Objects that fall and do not land: what a hand does after that is not about them any more, and their task ends there.

use super::columns::vectors;
use super::form::LeftOut;
use crate::analysis::TaskSpan;
use crate::base::log_channel::{BodyPart, LogChannel};
use crate::base::recording::Recording;
use nalgebra::Vector3;

/// What goes down faster than the first, and later at least as fast as the second, without being slower in between, falls, m/s: a free fall of 115 mm.
const FALLS_M_S: f64 = 0.5;
const FALLEN_M_S: f64 = 1.5;
/// Speeds are taken over this time, s.
const OVER_S: f64 = 0.05;
/// Of a segment in which an object begins to fall, less than this is left out altogether, s.
const SHORTEST_S: f64 = 0.05;

/// Returns when an object begins to fall, s of the recording, if it still falls when the recording ends.
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
    // It had fallen for as long as it takes to be so fast.
    let since_s = FALLS_M_S / gravity.norm() + OVER_S / 2.0;
    (fastest >= FALLEN_M_S).then(|| (time[begins] - since_s).max(time[0]))
}

/// Returns the task up to a time at which its object begins to fall, s, and what comes after that; `None` for the task where nothing comes before.
pub(super) fn ended(span: &TaskSpan, fell_s: f64) -> (Option<TaskSpan>, LeftOut) {
    let mut ended = span.clone();
    let after = span.segments.iter().filter(|segment| segment.end_s > fell_s);
    let left_out = LeftOut {
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
