//! Spikes: one or two samples far away from their neighbors, which agree.
//!
//! A column has spikes only if it changes nearly all the time, as measured ones do, so that commands and flags have none. Forces do have such peaks: an impact
//! lasts less than a sample.

use super::samples::{Samples, quantile};
use super::{Finding, FindingKind, short};
use std::f64::consts::TAU;
use teachtree_frames::raw_log::RawTable;

/// Minimum number of samples that show how a column changes.
const FEWEST: usize = 30;
/// The share of steps in which a column changes at least.
const CHANGING: f64 = 0.5;
/// A spike leaves its neighbors by this many times as much as nearly all samples do, and by this share of the range of nearly all samples.
const TIMES: f64 = 20.0;
const OF_RANGE: f64 = 0.2;
/// The neighbors of a spike differ by at most this share of it.
const RETURNS: f64 = 0.25;
/// The share of samples that counts as nearly all.
const NEARLY_ALL: f64 = 0.95;
/// The most samples of a spike.
const WIDEST: usize = 2;
/// Relative tolerance of a step of a whole turn, or of twice a number whose sign changes.
const NEAR: f64 = 0.05;
/// Words in the names of columns that measure forces and what follows from them.
const FORCES: [&str; 12] = [
    "force",
    "forces",
    "torque",
    "torques",
    "effort",
    "efforts",
    "wrench",
    "current",
    "currents",
    "acceleration",
    "load",
    "pressure",
];

/// The spikes of each column.
pub(super) fn findings(table: &RawTable) -> Vec<Finding> {
    Samples::of(table).filter(|samples| !is_force(&samples.title)).filter_map(|samples| finding(&samples)).collect()
}

fn is_force(title: &str) -> bool {
    let title = title.to_lowercase();
    title.split(|letter: char| !letter.is_alphanumeric()).any(|word| FORCES.contains(&word))
}

fn finding(samples: &Samples) -> Option<Finding> {
    if samples.time.len() < FEWEST || samples.changing() < CHANGING {
        return None;
    }
    let range = quantile(&samples.values, NEARLY_ALL) - quantile(&samples.values, 1.0 - NEARLY_ALL);
    let least = (TIMES * quantile(&samples.bends(), NEARLY_ALL)).max(OF_RANGE * range);
    if least <= 0.0 {
        return None;
    }
    let mut spikes: Vec<(usize, f64, f64)> = Vec::new();
    let mut at = 1;
    while at + 1 < samples.values.len() {
        match (1..=WIDEST).find_map(|width| spike(samples, at, width, least)) {
            Some((width, away, near)) => {
                spikes.push((at, away, near));
                at += width;
            }
            None => at += 1,
        }
    }
    let (row, away, near) = *spikes.iter().max_by(|(_, a, _), (_, b, _)| a.total_cmp(b))?;
    let (time, value) = (*samples.time.get(row)?, *samples.values.get(row)?);
    let count = if spikes.len() == 1 { "1 spike".into() } else { format!("{} spikes, the largest", spikes.len()) };
    let message = format!("{count} to {} at {} s, with {} around it", short(value), short(time), short(near));
    Some(Finding::of_column(FindingKind::Spike, samples.title.clone(), Some([time, time]), away, message))
}

/// The width of a spike that begins with a sample, how far away it is, and what its neighbors are.
fn spike(samples: &Samples, at: usize, width: usize, least: f64) -> Option<(usize, f64, f64)> {
    let value = |row: usize| samples.values.get(row).copied();
    let (before, after) = (value(at.checked_sub(1)?)?, value(at + width)?);
    let near = 0.5 * (before + after);
    let inner = samples.values.get(at..at + width)?;
    let away = inner.iter().map(|value| (value - near).abs()).fold(f64::INFINITY, f64::min);
    let is_turn = [TAU, 360.0].iter().any(|turn| (away / turn - 1.0).abs() < NEAR);
    // A quaternion and its negative are one rotation.
    let changes_sign = inner.iter().all(|value| (value + near).abs() < NEAR * away);
    let returns = (before - after).abs() <= RETURNS * away;
    (away >= least && returns && !is_turn && !changes_sign).then_some((width, away, near))
}
