//! Rejects spikes in columns that other columns are computed from: the markers of a mean, the terms of a sum, the ends of a distance, a frame and its
//! points, the joints of a kinematic chain, and the numbers that a threshold turns into a flag.
//!
//! Spikes are rejected before the computation, which would spread one wrong cell over correct values. In the mean of two markers, a jump of one marker
//! is halved and may be small enough for a hand motion. A flag does not show how far its number has jumped.

use super::header::{BoundColumn, Header, Term};
use super::pattern::{Columns, Representation};
use super::rotations;
use super::{BindingFile, robots};
use crate::clean::spikes::{Quantity, SpikeDetector, find_other_lengths, find_out};
use crate::live::spike_filter::{SpikeFilter, WIDTH};
use std::collections::{BTreeSet, VecDeque};
use teachtree_base::recording::Recording;
use teachtree_base::units::Dimension;
use teachtree_logs::issue::Issue;
use teachtree_logs::read::table::Table;

/// Columns of a table that form one quantity: a position, a rotation, a force, an angle or a length.
#[derive(Clone)]
pub struct ColumnSource {
    /// The channel or joint that is computed from the columns.
    channel: String,
    /// The name of the first column in the log.
    title: String,
    kind: Quantity,
    representation: Representation,
    /// The term of each component.
    parts: Vec<Term>,
}

/// Returns the columns that other columns are computed from.
pub(super) fn of(bound: &[BoundColumn], header: &Header, file: &BindingFile) -> Vec<ColumnSource> {
    let used = used(file);
    let mut sources = vec![];
    for group in bound.chunk_by(|one, next| one.channel == next.channel) {
        let Some(first) = group.first() else { continue };
        let is_combined = first.terms.len() > 1 || used.contains(&first.channel);
        for (term, of_first) in first.terms.iter().enumerate() {
            let is_computed = is_combined || of_first.threshold.is_some();
            let Some(kind) = kind(first, of_first).filter(|_| is_computed) else { continue };
            let parts: Vec<Term> = group.iter().filter_map(|part| part.terms.get(term)).copied().collect();
            let Some(column) = parts.iter().find_map(|part| part.column) else { continue };
            // The number behind a flag may be bound to another channel too.
            let is_same = |source: &ColumnSource| {
                source.kind == kind
                    && source.parts.iter().map(|part| part.column).eq(parts.iter().map(|part| part.column))
            };
            if sources.iter().any(is_same) {
                continue;
            }
            let (channel, title) = (first.channel.clone(), header.title(column).to_string());
            sources.push(ColumnSource { channel, title, kind, representation: first.representation, parts });
        }
    }
    sources
}

/// Returns the channels and joints that channels of the binding are computed from.
fn used(file: &BindingFile) -> BTreeSet<String> {
    let mut used = BTreeSet::new();
    for columns in file.binding.channels.values() {
        match columns {
            Columns::OffsetPoint(offset) => {
                used.extend(["position", "rotation"].map(|of| format!("{}.{of}", offset.of)))
            }
            Columns::PointDistance(span) => used.extend(span.between.iter().map(|point| format!("{point}.position"))),
            _ => {}
        }
    }
    used.extend(file.joints().map(|(robot, joint, _)| robots::joint_column(robot, joint)));
    used
}

/// Returns the quantity of a term of a channel, if its physical limits are known. The number behind a flag has the dimension of its threshold.
fn kind(of: &BoundColumn, term: &Term) -> Option<Quantity> {
    match (of.representation, term.threshold.map_or(of.dimension, |threshold| threshold.dimension)) {
        (
            Representation::Quaternion
            | Representation::Angles
            | Representation::RotationVector
            | Representation::Matrix,
            _,
        ) => Some(Quantity::Rotation),
        (Representation::Vector, _) => SpikeDetector::of(&of.channel).map(|detector| detector.kind),
        (Representation::Scalar, Dimension::ANGLE) => Some(Quantity::Angle),
        (Representation::Scalar, Dimension::LENGTH) => Some(Quantity::Length),
        (Representation::Scalar, Dimension::FORCE) => Some(Quantity::Force),
        (Representation::Scalar, _) => None,
    }
}

impl ColumnSource {
    /// Returns the sample of a row: a quaternion, or a vector padded with zeros.
    fn sample(&self, numbers: &[Vec<f64>], row: usize) -> [f64; WIDTH] {
        let value = |part: &Term| match part.column {
            Some(column) => {
                numbers.get(column).and_then(|values| values.get(row)).map_or(f64::NAN, |number| part.measured(*number))
            }
            None => part.offset,
        };
        if rotations::OTHERS.contains(&self.representation) {
            return rotations::quaternion(self.representation, &self.parts.iter().map(value).collect::<Vec<_>>());
        }
        let mut sample = [0.0; WIDTH];
        sample.iter_mut().zip(&self.parts).for_each(|(slot, part)| *slot = value(part));
        sample
    }

    fn unmeasure(&self, numbers: &mut [Vec<f64>], row: usize) {
        for column in self.parts.iter().filter_map(|part| part.column) {
            if let Some(value) = numbers.get_mut(column).and_then(|values| values.get_mut(row)) {
                *value = f64::NAN;
            }
        }
    }

    /// Adds the name of the source to an issue of its samples.
    fn named(&self, issue: Issue) -> Issue {
        Issue { channel: self.channel.clone(), message: format!("`{}`: {}", self.title, issue.message), ..issue }
    }
}

/// The rows of spikes and the issue that reports them.
type SpikeReport = Option<(Vec<usize>, Issue)>;

/// Marks the spikes of a table as not measured. Returns an issue for each source with spikes.
pub fn reject(sources: &[ColumnSource], table: &mut Table) -> Vec<Issue> {
    let mut issues = vec![];
    let recording = Recording { time: table.time.clone(), ..Recording::default() };
    for source in sources {
        let columns = |table: &Table| -> [Vec<f64>; WIDTH] {
            let mut columns = [(); WIDTH].map(|()| Vec::with_capacity(table.time.len()));
            for row in 0..table.time.len() {
                let sample = source.sample(&table.numbers, row);
                columns.iter_mut().zip(sample).for_each(|(column, value)| column.push(value));
            }
            columns
        };
        let mut find = |what: &dyn Fn(&[&[f64]]) -> SpikeReport| {
            let columns = columns(&*table);
            let parts = columns.each_ref().map(Vec::as_slice);
            // A vector has fewer components than a quaternion.
            let width = if source.kind == Quantity::Rotation { WIDTH } else { source.parts.len() };
            let Some((rows, issue)) = what(parts.get(..width).unwrap_or_default()) else { return };
            rows.iter().for_each(|row| source.unmeasure(&mut table.numbers, *row));
            issues.push(source.named(issue));
        };
        if source.kind == Quantity::Rotation {
            find(&|parts| find_other_lengths(&recording.time, &source.channel, parts));
        }
        find(&|parts| find_out(&recording, &source.channel, source.kind, parts));
    }
    issues
}

/// The online spike filter: takes rows of a live log, each as a table. A row waits only while one of its samples may be a spike.
pub struct SourceSpikeFilter {
    sources: Vec<ColumnSource>,
    spike_filter: SpikeFilter,
    rows: VecDeque<Table>,
}

impl SourceSpikeFilter {
    /// Creates an empty filter for sources that are sampled in one of `one_of` rows. `None` without sources.
    pub fn new(sources: &[ColumnSource], one_of: usize) -> Option<Self> {
        let vectors = (0..).zip(sources).map(|(at, source): (usize, _)| (at.to_string(), source.kind)).collect();
        let spike_filter = SpikeFilter::of_vectors(vectors, one_of);
        (!sources.is_empty()).then(|| Self { sources: sources.to_vec(), spike_filter, rows: VecDeque::new() })
    }

    /// Takes a row. Returns the rows that are decided, and their issues.
    pub fn push(&mut self, row: Table) -> (Vec<Table>, Vec<Issue>) {
        let values: Vec<f64> = self.sources.iter().flat_map(|source| source.sample(&row.numbers, 0)).collect();
        let issues = self.spike_filter.push(row.time.first().copied().unwrap_or(f64::NAN), &values);
        self.rows.push_back(row);
        self.released(issues)
    }

    /// Ends the log or restarts it. Returns all waiting rows.
    pub fn finish(&mut self) -> (Vec<Table>, Vec<Issue>) {
        let issues = self.spike_filter.finish();
        self.released(issues)
    }

    fn released(&mut self, issues: Vec<Issue>) -> (Vec<Table>, Vec<Issue>) {
        let mut rows = vec![];
        while let Some(released) = self.spike_filter.release() {
            let Some(mut row) = self.rows.pop_front() else { break };
            for (source, sample) in self.sources.iter().zip(released.1.chunks(WIDTH)) {
                let was_measured = source.sample(&row.numbers, 0).iter().all(|value| !value.is_nan());
                if was_measured && sample.iter().any(|value| value.is_nan()) {
                    source.unmeasure(&mut row.numbers, 0);
                }
            }
            self.spike_filter.reuse(released);
            rows.push(row);
        }
        let source = |issue: &Issue| issue.channel.parse().ok().and_then(|at: usize| self.sources.get(at));
        let named = |issue: Issue| source(&issue).map_or_else(|| issue.clone(), |source| source.named(issue.clone()));
        (rows, issues.into_iter().map(named).collect())
    }
}
