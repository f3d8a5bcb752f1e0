//! The even time base: rows in, gap-free stretches of frames out.
//!
//! Durations in rules become numbers of samples, so the step must be even. A step longer than [`GAP_STEPS`] ends a stretch. A few odd
//! steps are told; more than [`ODD_SHARE`] of them, and the log is refused with the advice to resample.

use super::frames::Issue;
use crate::base::error::InputError;
use std::ops::Range;

/// A step this many times the usual one is a gap: at least one sample is missing.
pub const GAP_STEPS: f64 = 1.5;
/// How far a step may be from the usual one and still count as even, as a share of it.
pub const EVEN_WITHIN: f64 = 0.10;
/// The share of steps that may be odd without being gaps.
pub const ODD_SHARE: f64 = 0.01;

/// Which rows become frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Timebase {
    /// Frames per second.
    pub rate_hz: f64,
    /// The row of each frame.
    pub rows: Vec<usize>,
    /// Gap-free stretches of frames.
    pub stretches: Vec<Range<usize>>,
}

/// Finds the rate and the stretches; `keep` tells the rows that may become frames.
///
/// # Errors
/// When time does not rise, when fewer than two rows are kept, or when the steps are too uneven.
pub fn timebase(time: &[f64], keep: &[bool], issues: &mut Vec<Issue>) -> Result<Timebase, InputError> {
    rising(time)?;
    let step = usual_step(time)?;
    let rows: Vec<usize> = keep.iter().enumerate().filter_map(|(row, keep)| keep.then_some(row)).collect();
    if rows.is_empty() {
        return Err(InputError::new("the log", "in no row is every channel measured"));
    }
    let mut stretches = vec![];
    let mut start = 0;
    let (mut odd, mut even_steps, mut even_time) = (vec![], 0_usize, 0.0);
    for (frame, (row, next)) in rows.iter().zip(rows.iter().skip(1)).enumerate() {
        let (from, to) = (at(time, *row), at(time, *next));
        let steps = (to - from) / step;
        if steps > GAP_STEPS {
            stretches.push(start..frame + 1);
            start = frame + 1;
            // Rows that were left out for another reason have an issue of their own.
            if next - row == 1 {
                let message = format!(
                    "no samples for {} ms, the usual step is {} ms; everything restarts after the gap",
                    ms(to - from),
                    ms(step)
                );
                issues.push(Issue { kind: "gap".into(), start_s: from, end_s: to, channel: String::new(), message });
            }
        } else if (steps - 1.0).abs() > EVEN_WITHIN {
            odd.push((from, to));
        } else {
            even_steps += 1;
            even_time += to - from;
        }
    }
    stretches.push(start..rows.len());
    if let (Some((start_s, _)), Some((_, end_s))) = (odd.first(), odd.last()) {
        let share = odd.len() as f64 / (odd.len() + even_steps) as f64;
        let found = format!(
            "{} of {} steps differ from the usual {} ms by more than {} %",
            odd.len(),
            odd.len() + even_steps,
            ms(step),
            EVEN_WITHIN * 100.0
        );
        if share > ODD_SHARE {
            let steps = odd.iter().map(|(from, to)| to - from).sum::<f64>() + even_time;
            let mean_hz = ((odd.len() + even_steps) as f64 / steps).round().max(1.0);
            return Err(InputError::new("the log", format!("the sampling is uneven: {found}, first at {start_s} s"))
                .help(format!("give a binding with `resample: {mean_hz} Hz`")));
        }
        issues.push(Issue {
            kind: "uneven_step".into(),
            start_s: *start_s,
            end_s: *end_s,
            channel: String::new(),
            message: format!("{found}; they are taken as even"),
        });
    }
    let mean = if even_steps == 0 { step } else { even_time / even_steps as f64 };
    // Stamps are rounded when they are written: 0.0333, 0.0667. A millihertz more or less is not measured.
    let rate_hz = if mean < 1.0 { (1000.0 / mean).round() / 1000.0 } else { 1.0 / mean };
    Ok(Timebase { rate_hz, rows, stretches })
}

/// The median step, s.
///
/// # Errors
/// When there are fewer than two rows.
pub fn usual_step(time: &[f64]) -> Result<f64, InputError> {
    let mut steps: Vec<f64> = time.iter().zip(time.iter().skip(1)).map(|(from, to)| to - from).collect();
    let middle = steps.len() / 2;
    if steps.is_empty() {
        return Err(InputError::new(
            "the log",
            format!("the log has {} row, at least 2 are needed to know its rate", time.len()),
        ));
    }
    Ok(*steps.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Checks that time is finite and rises from row to row.
fn rising(time: &[f64]) -> Result<(), InputError> {
    if let Some(row) = time.iter().position(|stamp| !stamp.is_finite()) {
        return Err(InputError::new("the log", format!("sample {} has no time", row + 1)));
    }
    match time.iter().zip(time.iter().skip(1)).position(|(from, to)| to <= from) {
        Some(row) => Err(InputError::new(
            "the log",
            format!("time does not rise from sample {} to the next, at {} s", row + 1, at(time, row)),
        )),
        None => Ok(()),
    }
}

fn at(time: &[f64], row: usize) -> f64 {
    time.get(row).copied().unwrap_or(f64::NAN)
}

/// Milliseconds for a message.
fn ms(seconds: f64) -> f64 {
    (seconds * 1e6).round() / 1e3
}
