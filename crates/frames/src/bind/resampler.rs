//! Resampling of a log that is being made: rows with uneven stamps in, rows on the even time base of [`resample`](super::resample) out, the same to the bit.
//!
//! A row is made as soon as no later one can change it: when the next measured values of every channel that is interpolated are there, or cannot come any
//! more within the bridge. The usual step, which [`resample`](super::resample) learns from the whole log, is that of the last rows here.

use super::resample::{AT, BRIDGED_STEPS, rotation_between};
use crate::clean::dropouts::moves;
use crate::clean::timebase::check_bursts;
use indexmap::IndexMap;
use std::collections::VecDeque;
use teachtree_base::channels::Shape;
use teachtree_base::error::InputError;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::units::Dimension;
use teachtree_logs::names;

/// Minimum number of rows from which the usual step is estimated.
const FIRST_ROWS: usize = 8;
/// Number of steps whose median is the usual step.
const STEPS: usize = 255;

/// Brings rows to an even rate.
pub struct Resampler {
    rate_hz: f64,
    /// The longest step that the binding bridges, s.
    bridge: f64,
    steps: UsualStep,
    /// The stamp of the first row, s.
    start: Option<f64>,
    /// The number of the next new row, from the first stamp on.
    tick: f64,
    /// The stamps of the rows that are needed still; the first is the one at or before the next new row.
    rows: VecDeque<f64>,
    /// The number of the first of them.
    first: u64,
    columns: IndexMap<String, Dimension>,
    groups: Vec<Group>,
}

/// Columns that are interpolated together, or one that is held.
struct Group {
    columns: Vec<usize>,
    interpolation: Interpolation,
    /// The measured samples: the last one at or before the next new row, and those after it.
    samples: VecDeque<Sample>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Interpolation {
    Hold,
    Linear,
    Rotation,
}

#[derive(Clone, Copy)]
struct Sample {
    row: u64,
    time: f64,
    values: [f64; 4],
}

/// A new row: its stamp, s, and the values of the columns.
pub type ResampledRow = (f64, Vec<f64>);

impl Resampler {
    /// Returns a resampler before the first row; `bridge` is the longest bridged step, s.
    pub fn new(rate_hz: f64, bridge: f64) -> Self {
        Self {
            rate_hz,
            bridge,
            steps: UsualStep::default(),
            start: None,
            tick: 0.0,
            rows: VecDeque::new(),
            first: 0,
            columns: IndexMap::new(),
            groups: vec![],
        }
    }

    /// The columns so far, in the order of the values of new rows.
    pub fn columns(&self) -> &IndexMap<String, Dimension> {
        &self.columns
    }

    /// Takes the only row of a recording, which comes after those before, and adds the new rows that no later one can change.
    ///
    /// # Errors
    /// The stamps are in another unit than the binding says.
    pub fn push(&mut self, recording: &Recording, made: &mut Vec<ResampledRow>) -> Result<(), InputError> {
        let Some(time) = recording.time.first().copied() else { return Ok(()) };
        self.start.get_or_insert(time);
        if let Some(before) = self.rows.back() {
            self.steps.push(time - before);
        }
        let row = self.first + self.rows.len() as u64;
        self.rows.push_back(time);
        self.add_columns(&recording.columns);
        for group in &mut self.groups {
            let value = |at: &usize| {
                let column = self.columns.get_index(*at).and_then(|(name, _)| recording.columns.get(name));
                column.and_then(|column| column.values.first()).copied().unwrap_or(f64::NAN)
            };
            let mut values = [0.0; 4];
            for (slot, at) in values.iter_mut().zip(&group.columns) {
                *slot = value(at);
            }
            if values.iter().all(|value| !value.is_nan()) {
                group.samples.push_back(Sample { row, time, values });
            }
        }
        if row + 1 < FIRST_ROWS as u64 {
            return Ok(());
        }
        if row + 1 == FIRST_ROWS as u64 {
            let stamps: Vec<f64> = self.rows.iter().copied().collect();
            check_bursts(&stamps)?;
        }
        self.make(false, made);
        Ok(())
    }

    /// Ends the log: adds the remaining rows.
    pub fn finish(&mut self, made: &mut Vec<ResampledRow>) {
        self.make(true, made);
    }

    fn add_columns(&mut self, columns: &IndexMap<String, Column>) {
        if columns.keys().all(|name| self.columns.contains_key(name)) {
            return;
        }
        for (name, column) in columns {
            if self.columns.contains_key(name) {
                continue;
            }
            let meaning = names::meaning(name);
            let whole: Vec<String> = match meaning.filter(|meaning| meaning.shape == Shape::Rotation) {
                Some(meaning) => {
                    let components = meaning.shape.components().iter();
                    components.map(|component| format!("{}.{component}", meaning.channel)).collect()
                }
                None => vec![name.clone()],
            };
            let is_whole = whole.iter().all(|name| columns.contains_key(name));
            let interpolation = match meaning {
                Some(meaning) if meaning.shape == Shape::Rotation && is_whole => Interpolation::Rotation,
                // A rotation that lacks a component is refused when its frames are made.
                Some(meaning) if meaning.shape != Shape::Rotation && moves(meaning.dimension, meaning.shape) => {
                    Interpolation::Linear
                }
                _ => Interpolation::Hold,
            };
            let members = if interpolation == Interpolation::Rotation { whole } else { vec![name.clone()] };
            let columns = members.into_iter().map(|name| self.columns.insert_full(name, column.dimension).0).collect();
            self.groups.push(Group { columns, interpolation, samples: VecDeque::new() });
        }
    }

    /// Makes the rows that no later one can change, or with `ends` all rows.
    fn make(&mut self, ends: bool, made: &mut Vec<ResampledRow>) {
        let (Some(start), Some(newest)) = (self.start, self.rows.back().copied()) else { return };
        let bridge = self.bridge.max(BRIDGED_STEPS * self.steps.usual());
        while let Some(stamp) = self.rows.front().copied() {
            let next = self.rows.get(1).copied();
            if next.is_none() && !ends {
                return;
            }
            let until = match next {
                Some(next) if next - stamp <= bridge => (next - start) * self.rate_hz - AT,
                _ => (stamp - start) * self.rate_hz + AT,
            };
            self.tick = self.tick.max(((stamp - start) * self.rate_hz - AT).ceil());
            while self.tick < until {
                let row = self.first;
                if !ends && self.groups.iter().any(|group| !group.is_known(row, newest, bridge)) {
                    return;
                }
                let time = start + self.tick / self.rate_hz;
                let mut values = vec![f64::NAN; self.columns.len()];
                for group in &self.groups {
                    for (at, value) in group.columns.iter().zip(group.at(row, time, bridge)) {
                        if let Some(slot) = values.get_mut(*at) {
                            *slot = value;
                        }
                    }
                }
                made.push((time, values));
                self.tick += 1.0;
            }
            self.rows.pop_front();
            self.first += 1;
            for group in &mut self.groups {
                // The sample before the next row counts, those before it do not.
                while group.samples.get(1).is_some_and(|next| next.row <= self.first) {
                    group.samples.pop_front();
                }
            }
        }
    }
}

impl Group {
    /// The sample at or before a row, and the one after it.
    fn about(&self, row: u64) -> (Option<&Sample>, Option<&Sample>) {
        match self.samples.front() {
            Some(front) if front.row <= row => (Some(front), self.samples.get(1)),
            front => (None, front),
        }
    }

    /// Whether later rows change nothing about a new row after this one.
    fn is_known(&self, row: u64, newest: f64, bridge: f64) -> bool {
        match self.about(row) {
            (Some(from), None) => self.interpolation == Interpolation::Hold || newest - from.time > bridge,
            _ => true,
        }
    }

    fn at(&self, row: u64, time: f64, bridge: f64) -> [f64; 4] {
        const UNMEASURED: [f64; 4] = [f64::NAN; 4];
        let (Some(from), to) = self.about(row) else { return UNMEASURED };
        if self.interpolation == Interpolation::Hold {
            return if time - from.time <= bridge { from.values } else { UNMEASURED };
        }
        match to {
            Some(to) if to.time - from.time <= bridge => {
                let part = ((time - from.time) / (to.time - from.time)).clamp(0.0, 1.0);
                match self.interpolation {
                    Interpolation::Rotation => rotation_between(from.values, to.values, part),
                    _ => {
                        let mut values = from.values;
                        for (value, to) in values.iter_mut().zip(to.values) {
                            *value += (to - *value) * part;
                        }
                        values
                    }
                }
            }
            // No next sample: the sample counts only at its own time.
            _ if from.row == row => from.values,
            _ => UNMEASURED,
        }
    }
}

/// The median of the last steps.
#[derive(Default)]
pub(super) struct UsualStep {
    steps: VecDeque<f64>,
    sorted: Vec<f64>,
}

impl UsualStep {
    /// Takes a step, s.
    pub fn push(&mut self, step: f64) {
        if self.steps.len() >= STEPS
            && let Some(old) = self.steps.pop_front()
        {
            let at = self.sorted.partition_point(|known| *known < old);
            self.sorted.remove(at.min(self.sorted.len() - 1));
        }
        self.steps.push_back(step);
        self.sorted.insert(self.sorted.partition_point(|known| *known < step), step);
    }

    /// The median, s; 0 without any.
    pub fn usual(&self) -> f64 {
        self.sorted.get(self.sorted.len() / 2).copied().unwrap_or_default()
    }
}
