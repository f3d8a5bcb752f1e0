//! Bodies that a tracker has lost, written as the position 0 0 0: it is exactly there from one sample to the next, and leaves so.

use crate::clean::dropouts::interval;
use crate::clean::preprocess::{Columns, channel_of};
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::ops::Range;
use teachtree_base::channels::Shape;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::units::Dimension;
use teachtree_logs::issue::Issue;
use teachtree_logs::names;

/// A step to the origin or from it that is longer than this is none of a hand, m.
const JUMP_M: f64 = 0.05;

/// The columns of the pose of a body, after its name.
const PARTS: [&str; 7] =
    ["position.x", "position.y", "position.z", "rotation.w", "rotation.x", "rotation.y", "rotation.z"];

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
        let samples = zeros(columns, channel, &lost);
        let message = format!(
            "{samples} samples are exactly 0 0 0, far from the poses before and after: the body was lost, and they are treated as not measured"
        );
        issues.push(Issue { message, ..interval(time, channel, &(first.start..last.end)) });
        let body = channel.strip_suffix("position").unwrap_or(channel);
        for part in PARTS {
            let Some((_, values)) = columns.get_mut(format!("{body}{part}").as_str()) else { continue };
            let values = values.to_mut();
            for rows in &lost {
                values.get_mut(rows.clone()).unwrap_or_default().fill(f64::NAN);
            }
        }
    }
    issues
}

/// The number of samples at the origin in some rows: rows of other sensors have none.
fn zeros(columns: &Columns, channel: &str, rows: &[Range<usize>]) -> usize {
    let is_zero = |row: usize| {
        ["x", "y", "z"].iter().all(|letter| {
            let column = columns.get(format!("{channel}.{letter}").as_str());
            column.and_then(|(_, values)| values.get(row)).is_some_and(|value| *value == 0.0)
        })
    };
    rows.iter().flat_map(Clone::clone).filter(|row| is_zero(*row)).count()
}

/// Like the above, for a recording before its positions are interpolated.
pub fn unmeasure_recording(recording: &mut Recording) -> Vec<Issue> {
    let column = |(name, column): (&'_ String, &'_ Column)| (name.clone(), column.dimension, column.values.clone());
    let positions =
        recording.columns.iter().filter(|(name, _)| is_position(channel_of(name)) || name.contains(".rotation."));
    let taken: Vec<(String, Dimension, Vec<f64>)> = positions.map(column).collect();
    let mut columns: Columns = taken
        .iter()
        .map(|(name, dimension, values)| (name.as_str(), (*dimension, Cow::Borrowed(values.as_slice()))))
        .collect();
    let issues = unmeasure(&recording.time, &mut columns);
    for (name, (_, values)) in columns {
        if let (Cow::Owned(values), Some(column)) = (values, recording.columns.get_mut(name)) {
            column.values = values;
        }
    }
    issues
}

/// The rows in which a body was lost.
fn lost(columns: &Columns, channel: &str) -> Vec<Range<usize>> {
    let part = |letter: &str| columns.get(format!("{channel}.{letter}").as_str()).map(|(_, values)| values.as_ref());
    let (Some(x), Some(y), Some(z)) = (part("x"), part("y"), part("z")) else { return vec![] };
    let at = |row: usize| Some([*x.get(row)?, *y.get(row)?, *z.get(row)?]);
    let is_measured = |row: &usize| at(*row).is_some_and(|position| position.iter().all(|part| !part.is_nan()));
    // Rows of other sensors have no sample of this one.
    let rows: Vec<usize> = (0..x.len()).filter(is_measured).collect();
    let mut runs: Vec<Range<usize>> = vec![];
    for (place, row) in rows.iter().enumerate().filter(|(_, row)| at(**row).is_some_and(is_origin)) {
        match runs.last_mut() {
            Some(last) if place.checked_sub(1).is_some_and(|before| rows.get(before) == Some(&(last.end - 1))) => {
                last.end = row + 1;
            }
            _ => runs.push(*row..row + 1),
        }
    }
    let is_away_or_none = |row: Option<&usize>| row.and_then(|row| at(*row)).is_none_or(is_away);
    runs.retain(|run| {
        let [first, last] = [run.start, run.end - 1].map(|row| rows.partition_point(|it| *it < row));
        let is_whole = last + 1 - first == rows.len();
        let before = first.checked_sub(1).and_then(|before| rows.get(before));
        !is_whole && is_away_or_none(before) && is_away_or_none(rows.get(last + 1))
    });
    runs
}

/// Bodies that a live log has lost, from row to row.
#[derive(Default)]
pub struct LostBodies {
    /// The positions that were last measured away from the origin, by channel.
    away: BTreeSet<String>,
}

impl LostBodies {
    /// Makes the positions of the only row of a recording unmeasured that are the origin after one elsewhere, with the rotation of the body.
    pub fn unmeasure(&mut self, recording: &mut Recording) -> Vec<Issue> {
        let channels: Vec<String> = recording
            .columns
            .keys()
            .filter_map(|name| name.strip_suffix(".x"))
            .filter(|channel| is_position(channel))
            .map(str::to_string)
            .collect();
        let mut issues = vec![];
        for channel in channels {
            let value = |name: String| recording.columns.get(&name).and_then(|column| column.values.first()).copied();
            let position = ["x", "y", "z"].map(|letter| value(format!("{channel}.{letter}")).unwrap_or(f64::NAN));
            if position.iter().any(|part| part.is_nan()) {
                continue;
            }
            if !is_origin(position) || !self.away.contains(&channel) {
                if is_away(position) {
                    self.away.insert(channel)
                } else {
                    self.away.remove(&channel)
                };
                continue;
            }
            let body = channel.strip_suffix("position").unwrap_or(&channel);
            for part in PARTS {
                let column = recording.columns.get_mut(&format!("{body}{part}"));
                column.into_iter().for_each(|column| column.values.fill(f64::NAN));
            }
            let message = "a position that is exactly 0 0 0, far from the last one, is that of a lost body, and is treated as not measured";
            issues.push(Issue { message: message.into(), ..interval(&recording.time, &channel, &(0..1)) });
        }
        issues
    }
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
