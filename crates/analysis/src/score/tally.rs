//! The counts of a score, and the measures that follow from them. The counts of recordings are added; measures of several recordings are computed from the sum.

use super::overlap::Matches;
use super::statistics::{Share, quantile, ratio};
use super::tasks::{NONE, TaskPair};
use crate::UNKNOWN;
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::meaning::Primitives;

/// The counts of one or more tracks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Scored time by true and resulting name, s.
    pub time_s: BTreeMap<(String, String), f64>,
    /// Segments by name.
    pub segments: BTreeMap<String, Matches>,
    /// The edit score of each track that has true segments, 0 to 1.
    pub edits: Vec<f64>,
    /// Every boundary of the truth.
    pub boundaries: Vec<Boundary>,
    /// Tracks whose sequence of primitives is the true one.
    pub sequences: Share,
    /// The tasks; `None` while nothing is known about tasks.
    pub tasks: Option<Vec<TaskPair>>,
    /// The primitives of the rules.
    pub primitives: Primitives,
}

/// A boundary of the truth: the start of a primitive after another one.
#[derive(Clone, Debug, PartialEq)]
pub struct Boundary {
    /// The primitive that ends.
    pub before: String,
    /// The primitive that begins.
    pub after: String,
    /// Whether a contact is made or lost there.
    pub by_contact: bool,
    /// The delay of the result, s; `None` if the result has no such segment.
    pub late_s: Option<f64>,
}

/// Errors of some boundaries.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BoundaryErrors {
    /// The number of found boundaries, and of all boundaries.
    pub found: Share,
    /// The delays of the result, s, sorted.
    pub late_s: Vec<f64>,
    /// The distances, s, sorted.
    pub off_s: Vec<f64>,
}

impl BoundaryErrors {
    fn new<'b>(boundaries: impl Iterator<Item = &'b Boundary>) -> Self {
        let mut errors = Self::default();
        for boundary in boundaries {
            errors.found.count(boundary.late_s.is_some());
            errors.late_s.extend(boundary.late_s);
        }
        errors.off_s = errors.late_s.iter().map(|late| late.abs()).collect();
        errors.late_s.sort_by(f64::total_cmp);
        errors.off_s.sort_by(f64::total_cmp);
        errors
    }

    /// The median of how far they are off, s.
    pub fn median_s(&self) -> Option<f64> {
        quantile(&self.off_s, 0.5)
    }

    /// The 95th percentile of it, s.
    pub fn p95_s(&self) -> Option<f64> {
        quantile(&self.off_s, 0.95)
    }
}

/// The results for the tasks of one true name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TaskMeasures {
    /// The number of found tasks, of all true ones: recall.
    pub found: Share,
    /// The number of correct tasks, of all found ones with this name: precision.
    pub named: Share,
    /// The number of true tasks with the true sequence of primitives.
    pub sequences: Share,
}

impl Tally {
    /// Adds the counts of others.
    pub fn add(&mut self, other: &Self) {
        for (names, time) in &other.time_s {
            *self.time_s.entry(names.clone()).or_default() += time;
        }
        for (name, matches) in &other.segments {
            self.segments.entry(name.clone()).or_default().add(*matches);
        }
        self.edits.extend(&other.edits);
        self.boundaries.extend(other.boundaries.iter().cloned());
        self.sequences.add(other.sequences);
        if let Some(tasks) = &other.tasks {
            self.tasks.get_or_insert_default().extend(tasks.iter().cloned());
        }
        self.primitives.known.extend(other.primitives.known.clone());
    }

    /// The scored time, s.
    pub fn scored_s(&self) -> f64 {
        self.time_s.values().sum()
    }

    /// The share of the scored time with the right name; at an even rate, of the frames.
    pub fn accuracy(&self) -> Option<f64> {
        ratio(self.time_where(|truth, result| truth == result), self.scored_s())
    }

    /// F1 of the segments at 10, 25 and 50 % overlap.
    pub fn f1(&self) -> [Option<f64>; 3] {
        let mut all = Matches::default();
        self.segments.values().for_each(|matches| all.add(*matches));
        all.f1()
    }

    /// The mean edit score of the tracks, 0 to 1.
    pub fn edit(&self) -> Option<f64> {
        ratio(self.edits.iter().sum(), self.edits.len() as f64)
    }

    /// The errors of all boundaries.
    pub fn boundary_errors(&self) -> BoundaryErrors {
        BoundaryErrors::new(self.boundaries.iter())
    }

    /// The errors of the boundaries that a contact makes.
    pub fn contact_errors(&self) -> BoundaryErrors {
        BoundaryErrors::new(self.boundaries.iter().filter(|boundary| boundary.by_contact))
    }

    /// The errors of the starts of a primitive.
    pub fn errors_of(&self, primitive: &str) -> BoundaryErrors {
        BoundaryErrors::new(self.boundaries.iter().filter(|boundary| boundary.after == primitive))
    }

    /// The names of all primitives, true and resulting.
    pub fn primitives(&self) -> BTreeSet<&str> {
        self.time_s.keys().flat_map(|(truth, result)| [truth.as_str(), result.as_str()]).collect()
    }

    /// Returns the time of a primitive in the truth, s.
    pub fn true_s(&self, primitive: &str) -> f64 {
        self.time_where(|truth, _| truth == primitive)
    }

    /// Returns the time of a primitive in the result, s.
    pub fn result_s(&self, primitive: &str) -> f64 {
        self.time_where(|_, result| result == primitive)
    }

    /// The share of its resulting time that is true.
    pub fn precision(&self, primitive: &str) -> Option<f64> {
        ratio(self.right_s(primitive), self.result_s(primitive))
    }

    /// The share of its true time that was found.
    pub fn recall(&self, primitive: &str) -> Option<f64> {
        ratio(self.right_s(primitive), self.true_s(primitive))
    }

    fn right_s(&self, primitive: &str) -> f64 {
        self.time_where(|truth, result| truth == primitive && result == primitive)
    }

    fn time_where(&self, names: impl Fn(&str, &str) -> bool) -> f64 {
        self.time_s.iter().filter(|((truth, result), _)| names(truth, result)).map(|(_, time)| time).sum()
    }

    /// All pairs of tasks.
    pub fn task_pairs(&self) -> &[TaskPair] {
        self.tasks.as_deref().unwrap_or(&[])
    }

    /// Returns the number of found true tasks, and of all true tasks.
    pub fn tasks_found(&self) -> Share {
        let mut found = Share::default();
        self.task_pairs().iter().filter(|pair| pair.is_true()).for_each(|pair| found.count(pair.is_right()));
        found
    }

    /// Returns the number of true tasks with the true sequence of primitives, of those with a known sequence.
    pub fn task_sequences(&self) -> Share {
        let mut equal = Share::default();
        let known = self.task_pairs().iter().filter(|pair| pair.is_true() && !pair.true_sequence.is_empty());
        known.for_each(|pair| equal.count(pair.sequence == pair.true_sequence));
        equal
    }

    /// Returns the number of false alarms: named tasks without a true task.
    pub fn false_tasks(&self) -> usize {
        self.task_pairs().iter().filter(|pair| pair.is_false_alarm()).count()
    }

    /// Returns the confusion counts of true and found names.
    pub fn task_confusion(&self) -> BTreeMap<(&str, &str), usize> {
        let mut confusion = BTreeMap::new();
        for pair in self.task_pairs() {
            *confusion.entry((pair.truth.as_str(), pair.result.as_str())).or_default() += 1;
        }
        confusion
    }

    /// Returns the results for each true name and each found name.
    pub fn task_measures(&self) -> BTreeMap<&str, TaskMeasures> {
        let mut measures: BTreeMap<&str, TaskMeasures> = BTreeMap::new();
        for pair in self.task_pairs() {
            if pair.is_true() {
                let of = measures.entry(&pair.truth).or_default();
                of.found.count(pair.is_right());
                if !pair.true_sequence.is_empty() {
                    of.sequences.count(pair.sequence == pair.true_sequence);
                }
            }
            if pair.result != NONE && pair.result != UNKNOWN {
                measures.entry(&pair.result).or_default().named.count(pair.is_right());
            }
        }
        measures
    }
}
