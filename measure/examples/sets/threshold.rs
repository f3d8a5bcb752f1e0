//! The plainest method: a channel is within limits, or it is not.

use super::intervals::LabeledInterval;
use super::manifest::TrackName;
use serde::Deserialize;
use std::collections::BTreeMap;
use teachtree_base::recording::Recording;

/// Limits of a channel, in SI units.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Threshold {
    /// The channel of each track. A vector counts by its norm, a scalar by its value.
    channels: BTreeMap<TrackName, String>,
    /// Subtracts from the channel its mean over this time from the start, s.
    change_from: Option<f64>,
    /// Its change per second counts.
    #[serde(default)]
    speed: bool,
    above: Option<f64>,
    below: Option<f64>,
    /// The label within the limits, and elsewhere.
    label: String,
    otherwise: String,
    /// A state that lasts less, s, is left out.
    #[serde(default)]
    shortest: f64,
}

impl Threshold {
    pub fn intervals(&self, recording: &Recording) -> Result<Vec<LabeledInterval>, String> {
        let mut intervals = Vec::new();
        for (track, channel) in &self.channels {
            let within: Vec<bool> =
                self.values(recording, channel)?.into_iter().map(|value| self.is_within(value)).collect();
            for (is_within, start_s, end_s) in without_short(&runs(&within, &recording.time), self.shortest) {
                let label = if is_within { &self.label } else { &self.otherwise };
                intervals.push(LabeledInterval { who: (*track).into(), label: label.clone(), start_s, end_s });
            }
        }
        Ok(intervals)
    }

    fn is_within(&self, value: f64) -> bool {
        value > self.above.unwrap_or(f64::NEG_INFINITY) && value < self.below.unwrap_or(f64::INFINITY)
    }

    fn values(&self, recording: &Recording, channel: &str) -> Result<Vec<f64>, String> {
        let column = |name: String| recording.columns.get(&name).map(|column| column.values.clone());
        let vector: Option<Vec<Vec<f64>>> =
            ["x", "y", "z"].map(|axis| column(format!("{channel}.{axis}"))).into_iter().collect();
        let is_vector = vector.is_some();
        let Some(mut columns) = vector.or_else(|| Some(vec![column(channel.into())?])) else {
            return Err(format!("the recording has no channel `{channel}`"));
        };
        for values in &mut columns {
            if let Some(rest_s) = self.change_from {
                let first: Vec<f64> = resting(&recording.time, values, rest_s);
                let mean = first.iter().sum::<f64>() / first.len().max(1) as f64;
                values.iter_mut().for_each(|value| *value -= mean);
            }
            if self.speed {
                *values = rates(&recording.time, values);
            }
        }
        let rows = 0..recording.time.len();
        let squares = |row: usize| columns.iter().map(|values| values[row] * values[row]).sum::<f64>();
        Ok(if is_vector { rows.map(|row| squares(row).sqrt()).collect() } else { columns.concat() })
    }
}

/// The measured values in the first seconds.
fn resting(time: &[f64], values: &[f64], rest_s: f64) -> Vec<f64> {
    let until_s = time.first().copied().unwrap_or_default() + rest_s;
    let first = time.iter().zip(values).take_while(|(at_s, _)| **at_s <= until_s);
    first.map(|(_, value)| *value).filter(|value| value.is_finite()).collect()
}

/// Central differences per second.
fn rates(time: &[f64], values: &[f64]) -> Vec<f64> {
    let last = time.len().saturating_sub(1);
    let rate = |row: usize| {
        let (before, after) = (row.saturating_sub(1), (row + 1).min(last));
        (values[after] - values[before]) / (time[after] - time[before])
    };
    (0..time.len()).map(rate).collect()
}

/// Stretches of one state: the state, start and end, s.
fn runs(states: &[bool], time: &[f64]) -> Vec<(bool, f64, f64)> {
    let mut runs: Vec<(bool, f64, f64)> = Vec::new();
    for (row, (state, start_s)) in states.iter().zip(time).enumerate() {
        // The last row lasts as long as the one before it.
        let step = || time.get(row.wrapping_sub(1)).map_or(0.0, |before| start_s - before);
        let end_s = time.get(row + 1).copied().unwrap_or_else(|| start_s + step());
        match runs.last_mut().filter(|last| last.0 == *state) {
            Some(last) => last.2 = end_s,
            None => runs.push((*state, *start_s, end_s)),
        }
    }
    runs
}

/// Gives stretches that are too short to the one before them.
fn without_short(runs: &[(bool, f64, f64)], shortest: f64) -> Vec<(bool, f64, f64)> {
    let mut kept: Vec<(bool, f64, f64)> = Vec::new();
    for (state, start_s, end_s) in runs.iter().copied() {
        match kept.last_mut().filter(|last| last.0 == state || end_s - start_s < shortest) {
            Some(last) => last.2 = end_s,
            None => kept.push((state, start_s, end_s)),
        }
    }
    kept
}
