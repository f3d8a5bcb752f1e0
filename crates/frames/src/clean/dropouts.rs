//! Values that were not measured: what cannot be meant becomes unmeasured, short drop-outs are bridged, rows of longer ones are left out.
//!
//! A drop-out of one sample, or of up to [`BRIDGED_SECS`], is bridged: poses and velocities on a straight line, forces and flags held.
//! Longer ones split the log. Each is an issue (docs/logs.md).

use crate::clean::preprocess::{Columns, channel_of, over_all};
use crate::clean::timebase::usual_step;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;
use teachtree_base::channels::Shape;
use teachtree_base::error::InputError;
use teachtree_base::short_number::ShortNumber;
use teachtree_base::units::Dimension;
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::names;

/// The longest drop-out that is bridged, s.
pub const BRIDGED_SECS: f64 = 0.020;
/// A value of a canonical channel beyond this, in SI, was not measured: no hand is so far away, so strong or so fast.
pub(crate) const LARGEST: f64 = 1e6;
/// A value of any other column beyond this: what is computed from it would overflow.
const LARGEST_OF_ANY: f64 = 1e12;
/// The share of impossible readings, and the number of different ones, from which on the unit is wrong.
const OF_ANOTHER_UNIT: f64 = 0.05;
const DISTINCT: usize = 3;
/// A quaternion shorter than this has no direction.
pub(crate) const NO_ROTATION: f64 = 1e-3;
/// Tolerance of the length of a quaternion.
const UNIT_WITHIN: f64 = 0.05;
/// Intervals listed one by one for a channel; more are summed up.
const TOLD: usize = 20;

/// Makes unmeasured what cannot have been measured: numbers out of all bounds, quaternions without direction.
///
/// # Errors
/// When a flag is neither 0 nor 1, or the readings of a channel are in another unit.
pub fn impossible(time: &[f64], columns: &mut Columns) -> Result<Vec<Issue>, InputError> {
    for (name, (_, values)) in columns.iter_mut() {
        let meaning = names::meaning(name);
        let largest = if meaning.is_some() { LARGEST } else { LARGEST_OF_ANY };
        if values.iter().any(|value| value.abs() > largest) {
            if meaning.is_some() {
                refuse_unit(name, values)?;
            }
            values.to_mut().iter_mut().filter(|value| value.abs() > largest).for_each(|value| *value = f64::NAN);
        }
        if meaning.is_some_and(|meaning| meaning.shape == Shape::Bool)
            && let Some(row) = values.iter().position(|value| !value.is_nan() && *value != 0.0 && *value != 1.0)
        {
            let [value, at_s] = [values.get(row), time.get(row)].map(|it| it.copied().unwrap_or_default());
            let message = format!("found {} at {} s, expected 0 or 1", ShortNumber(value), ShortNumber(at_s));
            return Err(InputError::new(format!("channel {name}"), message));
        }
    }
    let mut issues = vec![];
    for (channel, names) in channels(columns) {
        let [w, x, y, z] = names.as_slice() else { continue };
        let parts = [w, x, y, z].map(|name| columns.get(name.as_str()).map_or(&[][..], |(_, values)| values.as_ref()));
        let mut lengths: Vec<f64> = (0..time.len())
            .map(|row| parts.iter().map(|part| part.get(row).map_or(0.0, |value| value * value)).sum::<f64>().sqrt())
            .collect();
        let none: Vec<usize> =
            (0..time.len()).filter(|row| lengths.get(*row).is_some_and(|it| *it < NO_ROTATION)).collect();
        lengths.retain(|length| *length >= NO_ROTATION);
        let middle = lengths.len() / 2;
        if !lengths.is_empty() {
            let (_, length, _) = lengths.select_nth_unstable_by(middle, f64::total_cmp);
            if (*length - 1.0).abs() > UNIT_WITHIN {
                let message = format!(
                    "its quaternions are {} long, expected 1: check that these are its w, x, y and z; they are still read as rotations",
                    (*length * 1e3).round() / 1e3
                );
                issues.push(over_all(time, IssueKind::IMPLAUSIBLE_ROTATION, &channel, message));
            }
        }
        if !none.is_empty() {
            for name in &names {
                let Some((_, values)) = columns.get_mut(name.as_str()) else { continue };
                let values = values.to_mut();
                for row in &none {
                    if let Some(value) = values.get_mut(*row) {
                        *value = f64::NAN;
                    }
                }
            }
        }
    }
    Ok(issues)
}

/// Refuses a channel of which many readings are impossible and differ from each other: a value that marks lost samples is always the same.
fn refuse_unit(channel: &str, values: &[f64]) -> Result<(), InputError> {
    let mut found: Vec<f64> =
        values.iter().copied().filter(|value| value.is_finite() && value.abs() > LARGEST).collect();
    let share = found.len() as f64 / values.len().max(1) as f64;
    found.sort_by(f64::total_cmp);
    found.dedup();
    let largest = found.iter().copied().fold(0.0, |most: f64, value| most.max(value.abs()));
    if share < OF_ANOTHER_UNIT || found.len() < DISTINCT {
        return Ok(());
    }
    let message = format!(
        "{:.0} % of the readings are beyond {LARGEST:e} in SI units, up to {largest:.1e}: they are in another unit, or counts",
        share * 100.0
    );
    let help = "name the unit of the column in a binding, such as `fx [mN]`; counts need a scale, `fx * 1e-6 [N]`";
    Err(InputError::new(format!("channel {channel}"), message).help(help))
}

/// The largest value that a column can have, and whether it is a flag.
pub fn bound(column: &str) -> (f64, bool) {
    let meaning = names::meaning(column);
    let largest = if meaning.is_some() { LARGEST } else { LARGEST_OF_ANY };
    (largest, meaning.is_some_and(|meaning| meaning.shape == Shape::Bool))
}

/// Whether all of these are rotations, w x y z.
pub fn are_rotations([w, x, y, z]: [&[f64]; 4]) -> bool {
    let parts = w.iter().zip(x).zip(y).zip(z);
    let squares = |(((w, x), y), z): (((&f64, &f64), &f64), &f64)| w * w + x * x + y * y + z * z;
    // Well within what counts as one.
    let range = (1.0 - UNIT_WITHIN / 2.0).powi(2)..(1.0 + UNIT_WITHIN / 2.0).powi(2);
    parts.map(squares).all(|square| range.contains(&square))
}

/// Bridges short drop-outs, and returns where.
pub fn bridge(time: &[f64], columns: &mut Columns) -> Vec<Issue> {
    let Ok(step) = usual_step(time) else { return vec![] };
    let mut issues = vec![];
    for (channel, names) in channels(columns) {
        let moves = names::meaning(names.first().map_or("", String::as_str))
            .is_some_and(|meaning| moves(meaning.dimension, meaning.shape));
        let mut parts: Vec<Vec<f64>> = vec![];
        let short: Vec<Range<usize>> = {
            let read: Vec<&[f64]> = values_of(columns, &names).collect();
            let short = unmeasured(time.len(), &read).into_iter().filter(|rows| is_short(time, step, rows)).collect();
            parts.extend(read.into_iter().map(<[f64]>::to_vec));
            short
        };
        let (Some(first), Some(last)) = (short.first(), short.last()) else { continue };
        for rows in &short {
            fill(time, &mut parts, rows, moves);
        }
        let samples: usize = short.iter().map(Range::len).sum();
        let drop_outs = if short.len() == 1 { String::new() } else { format!(" in {} drop-outs", short.len()) };
        let was = if samples == 1 { "1 sample was".into() } else { format!("{samples} samples{drop_outs} were") };
        let message =
            format!("{was} not measured; drop-outs of one sample or up to {} ms are bridged", BRIDGED_SECS * 1e3);
        issues.push(Issue { message, ..interval(time, &channel, &(first.start..last.end)) });
        for (name, values) in names.iter().zip(parts) {
            if let Some((_, column)) = columns.get_mut(name.as_str()) {
                *column = Cow::Owned(values);
            }
        }
    }
    issues
}

/// Whether a quantity changes evenly between samples: poses and velocities do, forces and flags do not.
pub fn moves(dimension: Dimension, shape: Shape) -> bool {
    shape == Shape::Rotation
        || matches!(dimension, Dimension::LENGTH | Dimension::ANGLE | Dimension::SPEED | Dimension::ANGULAR_SPEED)
}

/// Whether a drop-out can be bridged: measured before and after, and short.
fn is_short(time: &[f64], step: f64, rows: &Range<usize>) -> bool {
    let (Some(from), Some(to)) = (rows.start.checked_sub(1).and_then(|row| time.get(row)), time.get(rows.end)) else {
        return false;
    };
    let lasts = to - from - step;
    lasts <= BRIDGED_SECS * (1.0 + 1e-6) || (rows.len() == 1 && lasts <= 1.5 * step)
}

/// Fills rows from the ones before and after.
pub(crate) fn fill(time: &[f64], parts: &mut [Vec<f64>], rows: &Range<usize>, moves: bool) {
    let at = |values: &[f64], row: usize| values.get(row).copied().unwrap_or_default();
    let before = rows.start.saturating_sub(1);
    let same_way: f64 = parts.iter().map(|part| at(part, before) * at(part, rows.end)).sum();
    // A quaternion and its opposite are one rotation: the shorter way is meant.
    let sign = if parts.len() == 4 && same_way < 0.0 { -1.0 } else { 1.0 };
    let (from_s, to_s) = (at(time, before), at(time, rows.end));
    for part in parts {
        let (from, to) = (at(part, before), sign * at(part, rows.end));
        for row in rows.clone() {
            let way = if moves { (at(time, row) - from_s) / (to_s - from_s) } else { 0.0 };
            if let Some(value) = part.get_mut(row) {
                *value = from + (to - from) * way;
            }
        }
    }
}

/// Which rows have every value; the others become gaps, each with an issue that names the channel.
pub fn measured_rows(time: &[f64], columns: &Columns, issues: &mut Vec<Issue>) -> Vec<bool> {
    let mut keep = vec![true; time.len()];
    for (channel, names) in channels(columns) {
        let intervals = unmeasured(time.len(), &values_of(columns, &names).collect::<Vec<_>>());
        for rows in &intervals {
            keep.get_mut(rows.clone()).unwrap_or_default().fill(false);
        }
        let all: usize = intervals.iter().map(Range::len).sum();
        let cure = "`resample` with a longer `bridge` in a binding closes them";
        if let (true, Some(first), Some(last)) = (intervals.len() > TOLD, intervals.first(), intervals.last()) {
            let message = format!(
                "{all} samples in {} intervals were not measured; those frames are left out; {cure}",
                intervals.len()
            );
            issues.push(Issue { message, ..interval(time, &channel, &(first.start..last.end)) });
        } else {
            issues.extend(intervals.iter().map(|rows| {
                let was = if rows.len() == 1 { "1 sample was".into() } else { format!("{} samples were", rows.len()) };
                let message =
                    format!("{was} not measured; the frames are left out and everything restarts after them; {cure}");
                Issue { message, ..interval(time, &channel, rows) }
            }));
        }
    }
    keep
}

/// The columns of each channel, in order.
fn channels(columns: &Columns) -> BTreeMap<String, Vec<String>> {
    let mut channels: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for name in columns.keys() {
        channels.entry(channel_of(name).to_string()).or_default().push((*name).to_string());
    }
    channels
}

fn values_of<'a>(columns: &'a Columns, names: &'a [String]) -> impl Iterator<Item = &'a [f64]> {
    names.iter().filter_map(|name| columns.get(name.as_str())).map(|(_, values)| values.as_ref())
}

/// The intervals of rows in which a component was not measured.
pub fn unmeasured(rows: usize, parts: &[&[f64]]) -> Vec<Range<usize>> {
    let mut intervals: Vec<Range<usize>> = vec![];
    for row in 0..rows {
        if parts.iter().any(|part| part.get(row).is_none_or(|value| value.is_nan())) {
            match intervals.last_mut() {
                Some(last) if last.end == row => last.end = row + 1,
                _ => intervals.push(row..row + 1),
            }
        }
    }
    intervals
}

/// An issue without a message over some rows.
pub fn interval(time: &[f64], channel: &str, rows: &Range<usize>) -> Issue {
    let at = |row: usize| time.get(row).or(time.last()).copied().unwrap_or_default();
    Issue {
        kind: IssueKind::NOT_A_NUMBER,
        start_s: at(rows.start),
        end_s: at(rows.end),
        channel: channel.into(),
        message: String::new(),
    }
}
