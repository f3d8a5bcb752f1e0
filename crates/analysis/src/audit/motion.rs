//! Motion in a recording: rests, and whether an object moved with a hand.

use teachtree_base::hands::Side;
use teachtree_base::recording::Recording;

/// Maximum change of a position at rest, m.
const STILL_M: f64 = 0.005;
/// Maximum difference between 1 and the product of two quaternions at rest: 2.3°.
const STILL_TURN: f64 = 2e-4;
/// Maximum change of a gripper's opening at rest, m.
const STILL_OPENING_M: f64 = 0.002;
/// Minimum distance that an object moves with a hand that holds it, m.
const MOVED_M: f64 = 0.01;

/// A quantity that may move.
enum Series<'a> {
    Position([&'a [f64]; 3]),
    Rotation([&'a [f64]; 4]),
    Opening(&'a [f64]),
}

impl Series<'_> {
    /// Whether it is elsewhere on one row than on another. What was not measured does not move.
    fn moved(&self, from: usize, to: usize) -> bool {
        match self {
            Self::Position(parts) => {
                change(parts, from, to).map(|part| part * part).iter().sum::<f64>() > STILL_M * STILL_M
            }
            Self::Rotation(parts) => {
                let product: f64 = parts.iter().map(|part| at(part, from) * at(part, to)).sum();
                1.0 - product.abs() > STILL_TURN
            }
            Self::Opening(values) => (at(values, to) - at(values, from)).abs() > STILL_OPENING_M,
        }
    }
}

fn at(values: &[f64], row: usize) -> f64 {
    values.get(row).copied().unwrap_or(f64::NAN)
}

fn change(parts: &[&[f64]; 3], from: usize, to: usize) -> [f64; 3] {
    parts.map(|part| at(part, to) - at(part, from))
}

fn length(vector: [f64; 3]) -> f64 {
    vector.iter().map(|part| part * part).sum::<f64>().sqrt()
}

/// The motion of a recording.
pub(super) struct Motion<'a> {
    recording: &'a Recording,
    series: Vec<Series<'a>>,
}

impl<'a> Motion<'a> {
    pub fn new(recording: &'a Recording) -> Self {
        let mut series = Vec::new();
        for name in recording.columns.keys() {
            if let Some(of) = name.strip_suffix(".position.x") {
                series.extend(position(recording, of).map(Series::Position));
            } else if let Some(of) = name.strip_suffix(".rotation.w") {
                series.extend(
                    columns(recording, of, ["rotation.w", "rotation.x", "rotation.y", "rotation.z"])
                        .map(Series::Rotation),
                );
            } else if name.ends_with(".gripper.opening") {
                series.extend(columns(recording, name, [""]).map(|[opening]| Series::Opening(opening)));
            }
        }
        Self { recording, series }
    }

    /// The times in which nothing moves, each of at least this length, s.
    pub fn rests(&self, least_s: f64) -> Vec<[f64; 2]> {
        let time = &self.recording.time;
        let mut rests = Vec::new();
        if self.series.is_empty() {
            return rests;
        }
        let mut add = |from: usize, to: usize| {
            let span = [at(time, from), at(time, to)];
            if span[1] - span[0] >= least_s {
                rests.push(span);
            }
        };
        let mut from = 0;
        for row in 1..time.len() {
            if self.series.iter().any(|series| series.moved(from, row)) {
                add(from, row - 1);
                from = row;
            }
        }
        add(from, time.len().saturating_sub(1));
        rests
    }

    /// Whether an object went somewhere together with a hand between two times; `None` where the log does not show it.
    pub fn moved_with(&self, side: Side, object: &str, start_s: f64, end_s: f64) -> Option<bool> {
        let time = &self.recording.time;
        let row = |time_s: f64| time.partition_point(|stamp| *stamp < time_s);
        let (start, end) = (row(start_s), row(end_s).min(time.len()));
        let object = position(self.recording, object)?;
        let prefix = format!("{}.", side.name());
        let points: Vec<[&[f64]; 3]> = self
            .recording
            .columns
            .keys()
            .filter_map(|name| name.strip_suffix(".position.x").filter(|of| of.starts_with(&prefix)))
            .filter_map(|of| position(self.recording, of))
            .collect();
        let moved = |row: usize| {
            let of_object = change(&object, start, row);
            let way = length(of_object);
            // Its distance from some point of the hand is nearly the same at the beginning and at the end.
            let with = |point: &[&[f64]; 3]| {
                let of_hand = change(point, start, row);
                let apart = [0, 1, 2].map(|axis: usize| {
                    of_object.get(axis).copied().unwrap_or_default() - of_hand.get(axis).copied().unwrap_or_default()
                });
                length(apart) <= way / 2.0
            };
            way >= MOVED_M && (points.is_empty() || points.iter().any(with))
        };
        Some((start..end).any(moved))
    }
}

fn position<'a>(recording: &'a Recording, of: &str) -> Option<[&'a [f64]; 3]> {
    columns(recording, of, ["position.x", "position.y", "position.z"])
}

/// Columns of a body or a point.
fn columns<'a, const N: usize>(recording: &'a Recording, of: &str, parts: [&str; N]) -> Option<[&'a [f64]; N]> {
    let column = |part: &str| {
        let name = if part.is_empty() { of.to_string() } else { format!("{of}.{part}") };
        recording.columns.get(&name).map(|column| column.values.as_slice())
    };
    let found: Vec<&[f64]> = parts.iter().filter_map(|part| column(part)).collect();
    found.try_into().ok()
}
