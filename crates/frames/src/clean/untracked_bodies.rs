//! Bodies that a tracker has lost, written as the position 0 0 0: it is exactly there from one sample to the next, and leaves so.

use crate::clean::dropouts::interval;
use crate::clean::preprocess::{Columns, channel_of};
use std::collections::BTreeSet;
use std::ops::Range;
use teachtree_base::channels::Shape;
use teachtree_base::units::Dimension;
use teachtree_logs::issue::Issue;
use teachtree_logs::names;

/// A step to the origin or from it that is longer than this is none of a hand, m.
const JUMP_M: f64 = 0.05;

/// The channels of positions whose zeros mark lost bodies.
pub fn is_position(channel: &str) -> bool {
    names::meaning(&format!("{channel}.x"))
        .is_some_and(|meaning| meaning.shape == Shape::Vec3 && meaning.dimension == Dimension::LENGTH)
        && channel.ends_with(".position")
}

/// Whether a position is exactly the origin.
pub fn is_origin(position: [f64; 3]) -> bool {
    position == [0.0; 3]
}

/// Whether a position is so far from the origin that a step between the two is none.
pub fn is_away(position: [f64; 3]) -> bool {
    position.iter().map(|value| value * value).sum::<f64>() > JUMP_M * JUMP_M
}

/// Makes positions unmeasured where they are the origin between positions elsewhere, with the rotation of the body.
pub fn unmeasure(time: &[f64], columns: &mut Columns) -> Vec<Issue> {
    let positions = columns.keys().map(|name| channel_of(name)).filter(|channel| is_position(channel));
    let channels: BTreeSet<String> = positions.map(str::to_string).collect();
    let mut issues = vec![];
    for channel in &channels {
        let lost = lost(columns, channel);
        let (Some(first), Some(last)) = (lost.first(), lost.last()) else { continue };
        let samples: usize = lost.iter().map(Range::len).sum();
        let message = format!(
            "{samples} samples are exactly 0 0 0, a step from where the body is before or after: it was lost, and they count as not measured"
        );
        issues.push(Issue { message, ..interval(time, channel, &(first.start..last.end)) });
        let body = channel.strip_suffix("position").unwrap_or(channel);
        let parts = ["position.x", "position.y", "position.z", "rotation.w", "rotation.x", "rotation.y", "rotation.z"];
        for part in parts {
            let Some((_, values)) = columns.get_mut(format!("{body}{part}").as_str()) else { continue };
            let values = values.to_mut();
            for rows in &lost {
                values.get_mut(rows.clone()).unwrap_or_default().fill(f64::NAN);
            }
        }
    }
    issues
}

/// The rows in which a body was lost.
fn lost(columns: &Columns, channel: &str) -> Vec<Range<usize>> {
    let part = |letter: &str| columns.get(format!("{channel}.{letter}").as_str()).map(|(_, values)| values.as_ref());
    let (Some(x), Some(y), Some(z)) = (part("x"), part("y"), part("z")) else { return vec![] };
    let at = |row: usize| Some([*x.get(row)?, *y.get(row)?, *z.get(row)?]);
    let mut runs: Vec<Range<usize>> = vec![];
    for row in (0..x.len()).filter(|row| at(*row).is_some_and(is_origin)) {
        match runs.last_mut() {
            Some(last) if last.end == row => last.end = row + 1,
            _ => runs.push(row..row + 1),
        }
    }
    let is_away_or_none = |row: Option<usize>| row.and_then(at).is_none_or(is_away);
    runs.retain(|run| {
        let is_whole = run.len() == x.len();
        !is_whole && is_away_or_none(run.start.checked_sub(1)) && is_away_or_none(Some(run.end))
    });
    runs
}

/// Looks for steps to the origin or from it, block by block.
#[derive(Default)]
pub struct UntrackedBodyDetector {
    before: Option<[f64; 3]>,
}

impl UntrackedBodyDetector {
    /// Looks at the next block; whether it has no such step.
    pub fn look(&mut self, [x, y, z]: [&[f64]; 3]) -> bool {
        x.iter().zip(y).zip(z).all(|((x, y), z)| {
            let position = [*x, *y, *z];
            let before = self.before.replace(position).unwrap_or(position);
            !(is_origin(before) && is_away(position) || is_origin(position) && is_away(before))
        })
    }
}
