//! Samples that cannot be, in rows one at a time: out and back within one or two rows, as of a whole log ([`crate::clean::spikes`]), and quaternions
//! that are not rotations. They become unmeasured.
//!
//! A row waits only while one of its samples is far from the one before, until later rows show whether it was out: two rows at most, and four where a log
//! begins.

use crate::clean::dropouts::NO_ROTATION;
use crate::clean::preprocess::channel_of;
use crate::clean::spikes::{self, LASTS, Quantity, Spike, SpikeDetector, is_contradicted, is_other_length};
use std::collections::VecDeque;
use teachtree_base::log_channel::LogChannel;
use teachtree_base::recording::{Column, Recording};
use teachtree_base::units::Dimension;
use teachtree_logs::issue::Issue;

/// Maximum number of waiting rows.
const MOST_ROWS: usize = 2 * LASTS + 1;
/// Number of values per vector: the size of a quaternion.
pub const WIDTH: usize = 4;

/// A row: its stamp, s, and a value for each column, SI.
type Row = (f64, Vec<f64>);

/// An online spike filter. It returns each row once all of its samples are accepted or rejected.
pub struct SpikeFilter {
    columns: Vec<(String, Dimension)>,
    channels: Vec<Channel>,
    /// The rows that wait, and the number of the first one, counted from the beginning of the log.
    held: VecDeque<Row>,
    first: usize,
    /// The row before them.
    last: Option<Row>,
    /// The stamp of the newest row.
    newest_s: f64,
    /// The memory of rows that are no longer needed.
    spare: Vec<Vec<f64>>,
    /// Maximum number of waiting rows.
    most: usize,
}

/// A checked channel.
struct Channel {
    name: String,
    columns: Vec<usize>,
    detector: SpikeDetector,
    /// Of a rotation.
    lengths: Option<QuaternionLengths>,
}

/// The lengths of quaternions.
#[derive(Default)]
struct QuaternionLengths {
    usual: Option<f64>,
    /// The last rows, if they have another length, with it.
    other: Vec<(usize, f64)>,
}

impl QuaternionLengths {
    /// Looks at a length; the rows before that had another one, and the usual one, once it is known that they are out. A length that stays is usual.
    fn push(&mut self, row: usize, length: f64) -> Option<(Vec<(usize, f64)>, f64)> {
        let usual = *self.usual.get_or_insert(length);
        if is_other_length(length, usual) {
            self.other.push((row, length));
            if self.other.len() > LASTS {
                self.other.clear();
                self.usual = Some(length);
            }
            return None;
        }
        self.usual = Some(length);
        (!self.other.is_empty()).then(|| (std::mem::take(&mut self.other), usual))
    }
}

impl SpikeFilter {
    /// Rows with these columns.
    pub fn new(columns: &[(String, Dimension)]) -> Self {
        let mut channels: Vec<Channel> = Vec::new();
        for (column, _) in columns {
            let name = channel_of(column);
            if channels.iter().any(|channel| channel.name == name) {
                continue;
            }
            let (Some(detector), Some(channel)) = (SpikeDetector::of(name), LogChannel::parse(name)) else { continue };
            // A channel that lacks a component is none.
            let place = |part: &String| columns.iter().position(|(column, _)| column == part);
            if let Some(places) = channel.columns().iter().map(place).collect::<Option<Vec<usize>>>() {
                let lengths = (places.len() == 4).then(QuaternionLengths::default);
                channels.push(Channel { name: name.to_string(), columns: places, detector, lengths });
            }
        }
        // Poses come first: a velocity is compared with what is left of them.
        channels.sort_by_key(|channel| channel.detector.kind.is_rate());
        Self::with(columns.to_vec(), channels, MOST_ROWS)
    }

    /// Creates a filter for rows of vectors with `WIDTH` values each, given by name and quantity. A vector is sampled in one of `one_of` rows.
    pub(crate) fn of_vectors(vectors: Vec<(String, Quantity)>, one_of: usize) -> Self {
        let channel = |(at, (name, kind)): (usize, (String, Quantity))| {
            let columns = (WIDTH * at..WIDTH * (at + 1)).collect();
            let lengths = (kind == Quantity::Rotation).then(QuaternionLengths::default);
            Channel { name, columns, detector: SpikeDetector::new(kind), lengths }
        };
        Self::with(vec![], vectors.into_iter().enumerate().map(channel).collect(), MOST_ROWS.saturating_mul(one_of))
    }

    fn with(columns: Vec<(String, Dimension)>, channels: Vec<Channel>, most: usize) -> Self {
        let held = VecDeque::with_capacity(most + 1);
        Self { columns, channels, held, first: 0, last: None, newest_s: f64::NEG_INFINITY, spare: Vec::new(), most }
    }

    /// Takes a row; what is wrong with it or with those before.
    pub fn push(&mut self, time_s: f64, values: &[f64]) -> Vec<Issue> {
        let mut row = self.spare.pop().unwrap_or_default();
        row.clear();
        row.extend_from_slice(values);
        let number = self.first + self.held.len();
        self.held.push_back((time_s, row));
        if !time_s.is_finite() {
            return Vec::new();
        }
        // Rows out of order are not compared.
        if time_s <= self.newest_s {
            for channel in &mut self.channels {
                channel.detector.restart();
                channel.lengths.iter_mut().for_each(|lengths| lengths.other.clear());
            }
        }
        self.newest_s = time_s;
        let mut issues = Vec::new();
        for at in 0..self.channels.len() {
            let Some(Channel { name, columns, detector, lengths }) = self.channels.get_mut(at) else { continue };
            let mut value = [0.0; 4];
            value.iter_mut().zip(&*columns).for_each(|(part, at)| *part = values.get(*at).copied().unwrap_or(f64::NAN));
            let mut rows = Vec::new();
            let length = || value.iter().map(|part| part * part).sum::<f64>().sqrt();
            if let Some((lengths, length)) = lengths.as_mut().map(|lengths| (lengths, length()))
                && length > NO_ROTATION
            {
                if let Some((other, usual)) = lengths.push(number, length)
                    && let (Some((from, first)), Some((to, _))) = (other.first(), other.last())
                {
                    let span = [from, to].map(|row| stamp(&self.held, self.first, *row));
                    issues.push(spikes::of_other_length(name, other.len(), span, [*first, usual]));
                    rows.extend(other.iter().map(|(row, _)| *row));
                }
                if !lengths.other.is_empty() {
                    continue;
                }
            }
            let out = detector.push(number, time_s, value);
            self.unmeasure(at, rows);
            issues.extend(out.and_then(|out| self.take_out(at, &out)));
        }
        issues
    }

    /// No row comes any more: what is wrong with the last ones.
    pub fn finish(&mut self) -> Vec<Issue> {
        let ends: Vec<(usize, Spike)> =
            self.channels.iter().enumerate().filter_map(|(at, it)| Some((at, it.detector.at_the_end()?))).collect();
        for channel in &mut self.channels {
            channel.detector.restart();
            channel.lengths.iter_mut().for_each(|lengths| lengths.other.clear());
        }
        ends.iter().filter_map(|(at, out)| self.take_out(*at, out)).collect()
    }

    /// The next row of which everything is known.
    pub fn release(&mut self) -> Option<Row> {
        let undecided = |channel: &Channel| {
            let other = channel.lengths.as_ref().and_then(|lengths| lengths.other.first()).map(|(row, _)| *row);
            channel.detector.undecided().into_iter().chain(other).min()
        };
        let waits_for = self.channels.iter().filter_map(undecided).min();
        if self.held.len() < self.most && waits_for.is_some_and(|row| row <= self.first) {
            return None;
        }
        let row = self.held.pop_front()?;
        self.first += 1;
        let (time_s, last) = self.last.get_or_insert_default();
        *time_s = row.0;
        last.clone_from(&row.1);
        Some(row)
    }

    /// Takes back the memory of a row.
    pub fn reuse(&mut self, (_, values): Row) {
        self.spare.push(values);
    }

    /// Makes samples of a channel unmeasured, unless the pose bears them out.
    fn take_out(&mut self, at: usize, out: &Spike) -> Option<Issue> {
        let Channel { name, detector, .. } = self.channels.get(at)?;
        let kind = detector.kind;
        if kind.is_rate() {
            let before = usize::from(self.last.is_some());
            let samples = out.samples.iter().map(|sample| sample.counted_from(self.first.saturating_sub(before)));
            if !is_contradicted(&self.rows(), name, kind, &out.with(samples.collect())) {
                return None;
            }
        }
        let issue = spikes::issue(name, kind, &out.samples, out);
        self.unmeasure(at, out.samples.iter().map(|sample| sample.row).collect());
        issue
    }

    fn unmeasure(&mut self, at: usize, rows: Vec<usize>) {
        let Some(Channel { columns, .. }) = self.channels.get(at) else { return };
        for row in rows {
            // A row that was returned does not change.
            let held = row.checked_sub(self.first).and_then(|row| self.held.get_mut(row));
            let Some((_, values)) = held else { continue };
            for at in columns {
                if let Some(value) = values.get_mut(*at) {
                    *value = f64::NAN;
                }
            }
        }
    }

    /// The row before those that wait, and these.
    fn rows(&self) -> Recording {
        let rows = || self.last.iter().chain(&self.held);
        let values = |at: usize| rows().map(|(_, values)| values.get(at).copied().unwrap_or(f64::NAN)).collect();
        let columns = self.columns.iter().enumerate();
        let columns =
            columns.map(|(at, (name, dimension))| (name.clone(), Column { dimension: *dimension, values: values(at) }));
        Recording { time: rows().map(|row| row.0).collect(), columns: columns.collect(), ..Recording::default() }
    }
}

/// The stamp of a row that waits.
fn stamp(held: &VecDeque<Row>, first: usize, row: usize) -> f64 {
    row.checked_sub(first).and_then(|row| held.get(row)).map_or(f64::NAN, |row| row.0)
}
