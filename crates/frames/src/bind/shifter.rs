//! Stamps of sensors that report late, in a log that is being made: shifted as [`shift`](super::sensors::shift) does with the whole log.
//!
//! A row falls into parts, one for each offset. A part waits until no later row can have one before it.

use super::BindingFile;
use super::apply::unshared_stamps;
use super::sensors::{check_bound, offset};
use std::collections::VecDeque;
use teachtree_base::error::InputError;
use teachtree_base::recording::{Column, Recording};

/// The longest time that rows wait for those of other sensors, s.
const MAX_OFFSET_S: f64 = 60.0;

/// Shifts the stamps of sensors.
pub struct Shifter {
    /// The smallest offset there is, s.
    least: f64,
    /// Whether the sensors are bound: seen by the first row.
    is_checked: bool,
    /// Parts of rows, in the order of their stamps.
    waiting: VecDeque<Recording>,
    /// The stamp of the last row that was sent on, s.
    last: f64,
}

impl Shifter {
    /// Returns the shifter before the first row; `None` if no sensor has an offset.
    ///
    /// # Errors
    /// The log is not resampled, or rows would wait too long.
    pub fn new(file: &BindingFile) -> Result<Option<Self>, InputError> {
        let offsets = || file.binding.sensors.iter().map(|(channel, sensor)| (channel, sensor.time_offset.0));
        for (channel, offset) in offsets() {
            if offset.is_nan() || offset.abs() > MAX_OFFSET_S {
                let message =
                    format!("`time_offset`: found {offset} s, expected at most {MAX_OFFSET_S} s in a live log");
                return Err(file.error(channel, message));
            }
        }
        if offsets().all(|(_, offset)| offset == 0.0) {
            return Ok(None);
        }
        if file.binding.resample.is_none() {
            return Err(unshared_stamps(file));
        }
        let least = offsets().fold(0.0, |least: f64, (_, offset)| least.min(offset));
        Ok(Some(Self { least, is_checked: false, waiting: VecDeque::new(), last: f64::NEG_INFINITY }))
    }

    /// Takes a recording of one row; returns the rows that no later one can change.
    ///
    /// # Errors
    /// A sensor is not bound.
    pub fn push(&mut self, row: Recording, file: &BindingFile) -> Result<Vec<Recording>, InputError> {
        // A row that has its names from the log may lack columns that come later.
        if !self.is_checked && !file.binding.channels.is_empty() {
            check_bound(&row, file)?;
        }
        self.is_checked = true;
        let Some(stamp) = row.time.first().copied() else { return Ok(vec![]) };
        for (name, column) in row.columns {
            self.put(stamp + offset(&file.binding.sensors, &name), name, column);
        }
        let whole = self.waiting.iter().take_while(|row| row.time.first().is_some_and(|at| *at <= stamp + self.least));
        let whole = whole.count();
        Ok(self.send(whole))
    }

    /// Ends the rows, or a part of them: returns all waiting rows.
    pub fn finish(&mut self) -> Vec<Recording> {
        self.send(self.waiting.len())
    }

    fn put(&mut self, stamp: f64, name: String, column: Column) {
        let at = self.waiting.partition_point(|row| row.time.first().is_some_and(|time| *time < stamp));
        match self.waiting.get_mut(at) {
            Some(row) if row.time == [stamp] => {
                row.columns.insert(name, column);
            }
            _ => {
                let columns = [(name, column)].into_iter().collect();
                self.waiting.insert(at, Recording { time: vec![stamp], columns, ..Recording::default() });
            }
        }
    }

    fn send(&mut self, rows: usize) -> Vec<Recording> {
        // After an interruption there may be parts that come before what was sent then.
        let rows: Vec<Recording> =
            self.waiting.drain(..rows).filter(|row| row.time.first().is_some_and(|at| *at > self.last)).collect();
        self.last = rows.last().and_then(|row| row.time.first()).copied().unwrap_or(self.last);
        rows
    }
}
