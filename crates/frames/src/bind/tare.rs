//! Sensor bias: the readings at rest are learned in an interval that the binding names, and subtracted.

use super::body_poses::is_of;
use super::{BindingFile, Tare};
use indexmap::IndexMap;
use std::ops::Range;
use teachtree_base::error::InputError;
use teachtree_base::log_channel::{FingerPart, LogChannel};
use teachtree_base::recording::{Column, Recording};
use teachtree_base::short_number::ShortNumber;
use teachtree_base::units::Dimension;

/// The learned biases; empty for a binding without `tare`.
#[derive(Clone, Debug, Default)]
pub struct TareOffsets {
    /// The reading of each column at rest.
    means: IndexMap<String, f64>,
    /// The noise of a finger's force after the subtraction: the root mean square, N, as the channel `<hand>.<finger>.noise`.
    noises: IndexMap<String, f64>,
}

impl TareOffsets {
    /// Learns from a recording whose tools were weighed.
    ///
    /// # Errors
    /// A channel is not bound, or not measured in the interval.
    pub fn learn(recording: &Recording, file: &BindingFile) -> Result<Self, InputError> {
        let mut learned = Self::default();
        let Some(tare) = &file.binding.tare else { return Ok(learned) };
        let (rows, _) = counted(&recording.time, tare);
        check(recording, file)?;
        for channel in &tare.channels {
            let mut variance = 0.0;
            for (name, column) in recording.columns.iter().filter(|(name, _)| is_of(name, channel)) {
                let values = column.values.get(rows.clone()).unwrap_or_default().iter().copied();
                let rest: Vec<f64> = values.filter(|value| !value.is_nan()).collect();
                if rest.is_empty() {
                    return Err(file.error(
                        "tare",
                        format!(
                            "`{channel}` has no sample from {} s to {} s",
                            ShortNumber(tare.from.0),
                            ShortNumber(tare.to.0)
                        ),
                    ));
                }
                let mean = rest.iter().sum::<f64>() / rest.len() as f64;
                variance += rest.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / rest.len() as f64;
                learned.means.insert(name.clone(), mean);
            }
            if let Some(LogChannel::Finger(side, finger, FingerPart::Force)) = LogChannel::parse(channel) {
                let noise = LogChannel::Finger(side, finger, FingerPart::Noise).to_string();
                learned.noises.insert(noise, variance.sqrt());
            }
        }
        Ok(learned)
    }

    /// Takes off what was learned, and adds the noise that is left.
    pub fn take_off(&self, recording: &mut Recording) {
        for (name, mean) in &self.means {
            if let Some(column) = recording.columns.get_mut(name) {
                column.values.iter_mut().for_each(|value| *value -= mean);
            }
        }
        for (name, noise) in &self.noises {
            if !recording.columns.contains_key(name) {
                let values = vec![*noise; recording.time.len()];
                recording.columns.insert(name.clone(), Column { dimension: Dimension::FORCE, values });
            }
        }
    }
}

/// Checks that the channels are bound.
///
/// # Errors
/// When one is not.
pub fn check(recording: &Recording, file: &BindingFile) -> Result<(), InputError> {
    let is_bound = |channel: &String| recording.columns.keys().any(|name| is_of(name, channel));
    match file.binding.tare.iter().flat_map(|tare| &tare.channels).find(|channel| !is_bound(channel)) {
        Some(channel) => Err(file.error("tare", format!("no channel `{channel}` is bound"))),
        None => Ok(()),
    }
}

/// The rows of the interval, and from which stamp on it counts, s.
fn counted(time: &[f64], tare: &Tare) -> (Range<usize>, f64) {
    let rows = |start_s: f64| {
        let row = |at_s: f64| time.partition_point(|time| *time < start_s + at_s);
        row(tare.from.0)..row(tare.to.0)
    };
    // Stamps of some logs count from 1970, or from when the robot was switched on: then the interval counts from the first one.
    let first_s = time.first().copied().unwrap_or_default();
    let absolute = rows(0.0);
    if absolute.is_empty() { (rows(first_s), first_s) } else { (absolute, 0.0) }
}

/// The first rows of a log that is being made, which wait until the interval is over.
#[derive(Default)]
pub struct FirstRows(Recording);

impl FirstRows {
    /// Takes a recording of one row.
    pub fn push(&mut self, row: Recording) {
        let rows = self.0.time.len();
        self.0.time.extend(row.time);
        for (name, Column { dimension, values }) in row.columns {
            let column = self.0.columns.entry(name).or_insert_with(|| Column { dimension, values: vec![] });
            // Earlier rows lack the columns that have come since.
            column.values.resize(rows, f64::NAN);
            column.values.extend(values);
        }
        self.0.columns.values_mut().for_each(|column| column.values.resize(self.0.time.len(), f64::NAN));
    }

    /// Whether no later row belongs to the interval.
    pub fn is_over(&self, tare: &Tare) -> bool {
        let (_, start_s) = counted(&self.0.time, tare);
        // The stamps may still reach an interval that counts from 0.
        self.0.time.last().is_some_and(|last| *last >= tare.to.0 && *last >= start_s + tare.to.0)
    }

    /// All rows as one recording.
    pub const fn whole(&self) -> &Recording {
        &self.0
    }

    /// Each row as a recording.
    pub fn each(self) -> impl Iterator<Item = Recording> {
        let Recording { time, columns, .. } = self.0;
        time.into_iter().enumerate().map(move |(row, stamp)| {
            let at = |column: &Column| column.values.get(row).copied().unwrap_or(f64::NAN);
            let column = |column: &Column| Column { dimension: column.dimension, values: vec![at(column)] };
            let columns = columns.iter().map(|(name, values)| (name.clone(), column(values))).collect();
            Recording { time: vec![stamp], columns, ..Recording::default() }
        })
    }
}
