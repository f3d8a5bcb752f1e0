//! Resampling: a recording with uneven stamps in, the same on an even time base out.
//!
//! Poses and velocities are interpolated, rotations along the shortest arc; forces, flags and labels are held. A step longer than the bridge stays a
//! gap; a value that was not measured for longer than the bridge stays unmeasured.

use crate::clean::dropouts::moves;
use crate::clean::timebase::check_bursts;
use indexmap::IndexMap;
use teachtree_base::channels::Shape;
use teachtree_base::error::InputError;
use teachtree_base::geometry::unit;
use teachtree_base::recording::{Column, Recording};
use teachtree_logs::names::{self, ColumnMeaning};

/// The most frames that resampling makes.
pub const MAX_FRAMES: usize = 100_000_000;

/// Minimum length of a gap in usual steps of a log; it does not depend on the binding.
pub const BRIDGED_STEPS: f64 = 1.5;
/// Stamps are written with a few digits: a new sample this near before an old one, in steps, is at it.
pub const AT: f64 = 1e-6;

/// A new sample: its time, and the old row at or before it.
struct Sample {
    time: f64,
    row: usize,
}

/// Brings a recording to an even rate, Hz; steps and drop-outs up to `bridge`, s, and up to one and a half usual steps, are bridged.
///
/// # Errors
/// When that would make more frames than can be meant, or the stamps are in another unit than the binding says.
pub fn resample(recording: Recording, rate_hz: f64, bridge: f64) -> Result<Recording, InputError> {
    if recording.time.len() > 1 {
        check_bursts(&recording.time)?;
    }
    let bridge = bridge.max(BRIDGED_STEPS * usual_step(&recording.time));
    let samples = samples(&recording.time, rate_hz, bridge)?;
    let time = &recording.time;
    let mut columns: IndexMap<String, Column> = IndexMap::with_capacity(recording.columns.len());
    for (name, column) in &recording.columns {
        let Some(meaning) = names::meaning(name).filter(|meaning| moves(meaning.dimension, meaning.shape)) else {
            let values = held(&samples, time, &column.values, bridge);
            columns.insert(name.clone(), Column { dimension: column.dimension, values });
            continue;
        };
        if meaning.shape != Shape::Rotation {
            let values = interpolated(&samples, time, &[&column.values], bridge, |[from], [to], part| {
                [from + (to - from) * part]
            });
            columns.extend(
                values.into_iter().map(|values| (name.clone(), Column { dimension: column.dimension, values })),
            );
        } else if meaning.component == 0 {
            columns.extend(rotations(&samples, &recording, meaning, bridge));
        }
    }
    let hold =
        |texts: Vec<String>| samples.iter().map(|sample| texts.get(sample.row).cloned().unwrap_or_default()).collect();
    let labels = recording.labels.into_iter().map(|(name, texts)| (name, hold(texts))).collect();
    let time = samples.iter().map(|sample| sample.time).collect();
    Ok(Recording { time, columns, labels, ..recording })
}

/// The middle one of the steps between stamps, s; 0 without any.
fn usual_step(time: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time.iter().zip(time.iter().skip(1)).map(|(one, next)| next - one).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or_default()
}

/// The new samples: on the grid that begins with the first old one, none inside a gap.
fn samples(time: &[f64], rate_hz: f64, bridge: f64) -> Result<Vec<Sample>, InputError> {
    let Some(&start) = time.first() else { return Ok(vec![]) };
    let mut samples = vec![];
    let mut tick = 0.0_f64;
    for (row, stamp) in time.iter().enumerate() {
        let next = time.get(row + 1);
        // Up to the next old sample, or at this one only when a gap follows.
        let until = match next {
            Some(next) if next - stamp <= bridge => (next - start) * rate_hz - AT,
            _ => (stamp - start) * rate_hz + AT,
        };
        tick = tick.max(((stamp - start) * rate_hz - AT).ceil());
        while tick < until {
            if samples.len() >= MAX_FRAMES {
                return Err(InputError::new(
                    "the log",
                    format!("resampling to {rate_hz} Hz makes more than {MAX_FRAMES} frames"),
                ));
            }
            samples.push(Sample { time: start + tick / rate_hz, row });
            tick += 1.0;
        }
    }
    Ok(samples)
}

fn held(samples: &[Sample], time: &[f64], values: &[f64], bridge: f64) -> Vec<f64> {
    let last = last_rows(time.len(), |row| values.get(row).is_some_and(|value| !value.is_nan()));
    let value = |sample: &Sample| {
        let row = last.get(sample.row).copied().flatten()?;
        (sample.time - time.get(row)? <= bridge).then(|| values.get(row).copied())?
    };
    samples.iter().map(|sample| value(sample).unwrap_or(f64::NAN)).collect()
}

/// The components of a rotation, interpolated together.
fn rotations(samples: &[Sample], recording: &Recording, meaning: ColumnMeaning, bridge: f64) -> Vec<(String, Column)> {
    let names = meaning.shape.components().iter().map(|component| format!("{}.{component}", meaning.channel));
    let parts: Vec<(String, &Column)> =
        names.filter_map(|name| recording.columns.get(&name).map(|column| (name, column))).collect();
    let [(_, w), (_, x), (_, y), (_, z)] = parts.as_slice() else {
        // A rotation that lacks a component is refused when its frames are made.
        return parts
            .into_iter()
            .map(|(name, column)| {
                (
                    name,
                    Column {
                        dimension: column.dimension,
                        values: held(samples, &recording.time, &column.values, bridge),
                    },
                )
            })
            .collect();
    };
    let values =
        interpolated(samples, &recording.time, &[&w.values, &x.values, &y.values, &z.values], bridge, rotation_between);
    parts
        .iter()
        .zip(values)
        .map(|((name, column), values)| (name.clone(), Column { dimension: column.dimension, values }))
        .collect()
}

/// The rotation a part of the way from one to another, along the shortest arc.
pub fn rotation_between(from: [f64; 4], to: [f64; 4], part: f64) -> [f64; 4] {
    let (from, to) = (unit(from), unit(to));
    let between = from.try_slerp(&to, part, 1e-9).unwrap_or(from);
    [between.w, between.i, between.j, between.k]
}

/// Columns that are interpolated together, between the rows in which all of them were measured.
fn interpolated<const N: usize>(
    samples: &[Sample],
    time: &[f64],
    columns: &[&[f64]; N],
    bridge: f64,
    between: impl Fn([f64; N], [f64; N], f64) -> [f64; N],
) -> [Vec<f64>; N] {
    let row_values = |row: usize| columns.map(|column| column.get(row).copied().unwrap_or(f64::NAN));
    let measured = |row: usize| row_values(row).iter().all(|value| !value.is_nan());
    let last = last_rows(time.len(), measured);
    let mut next = last_rows(time.len(), |row| measured(time.len() - 1 - row));
    next.reverse();
    let value = |sample: &Sample| -> Option<[f64; N]> {
        let from = last.get(sample.row).copied().flatten()?;
        let at = *time.get(from)?;
        let to = next.get(sample.row + 1).copied().flatten().map(|row| time.len() - 1 - row);
        match to.and_then(|to| time.get(to).map(|then| (to, *then))) {
            Some((to, then)) if then - at <= bridge => {
                Some(between(row_values(from), row_values(to), ((sample.time - at) / (then - at)).clamp(0.0, 1.0)))
            }
            // No next sample: the sample counts only at its own time.
            _ if from == sample.row => Some(row_values(from)),
            _ => None,
        }
    };
    let mut result = [(); N].map(|()| Vec::with_capacity(samples.len()));
    for sample in samples {
        for (column, value) in result.iter_mut().zip(value(sample).unwrap_or([f64::NAN; N])) {
            column.push(value);
        }
    }
    result
}

/// For each row the last row at or before it that counts.
fn last_rows(rows: usize, counts: impl Fn(usize) -> bool) -> Vec<Option<usize>> {
    let mut last = None;
    (0..rows)
        .map(|row| {
            if counts(row) {
                last = Some(row);
            }
            last
        })
        .collect()
}
