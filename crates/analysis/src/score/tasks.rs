//! Tasks: true and named ones in, pairs out.

use super::truth::Span;
use crate::{TaskSpan, UNKNOWN};

/// The placeholder for a missing task: on the true side of a false alarm,
/// and on the other side of a true task that was not found.
pub const NONE: &str = "none";

/// A true task and the task found in its place, or a found task without a true one.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskPair {
    /// The true name, [`NONE`] where there is no task.
    pub truth: String,
    /// The found name, `unknown`, or [`NONE`].
    pub result: String,
    /// Start and end, s: of the true task, else of the found one.
    pub time_s: (f64, f64),
    /// The true primitives of the task; none where it is not known.
    pub true_sequence: Vec<String>,
    /// The primitives of the found task.
    pub sequence: Vec<String>,
}

impl TaskPair {
    /// Whether the true task was found.
    pub fn is_right(&self) -> bool {
        self.truth == self.result
    }

    /// Whether there is a true task.
    pub fn is_true(&self) -> bool {
        self.truth != NONE
    }

    /// Whether a task was named without a true task.
    pub fn is_false_alarm(&self) -> bool {
        !self.is_true() && self.result != UNKNOWN
    }
}

/// Pairs of a true and a found task, either of which may be missing, in order of time.
///
/// A true and a found task stand for each other when they share more time than either shares with one that is still free; each stands for one.
pub(super) fn pairs<'a>(truth: &'a [Span], found: &'a [TaskSpan]) -> Vec<(Option<&'a Span>, Option<&'a TaskSpan>)> {
    let mut shared: Vec<(f64, usize, usize)> = Vec::new();
    for (one, span) in truth.iter().enumerate() {
        for (other, task) in found.iter().enumerate() {
            let both_s = span.end_s.min(task.end_s) - span.start_s.max(task.start_s);
            if both_s > 0.0 {
                shared.push((both_s, one, other));
            }
        }
    }
    shared.sort_by(|one, other| other.0.total_cmp(&one.0).then((one.1, one.2).cmp(&(other.1, other.2))));
    let mut found_for: Vec<Option<usize>> = vec![None; truth.len()];
    let mut free = vec![true; found.len()];
    for (_, one, other) in shared {
        if let (Some(slot @ None), Some(free @ true)) = (found_for.get_mut(one), free.get_mut(other)) {
            *slot = Some(other);
            *free = false;
        }
    }
    let mut pairs: Vec<(Option<&Span>, Option<&TaskSpan>)> = truth
        .iter()
        .zip(&found_for)
        .map(|(span, found_at)| (Some(span), found_at.and_then(|at| found.get(at))))
        .chain(found.iter().zip(&free).filter(|(_, free)| **free).map(|(task, _)| (None, Some(task))))
        .collect();
    let start_s = |(span, task): &(Option<&Span>, Option<&TaskSpan>)| {
        span.map(|span| span.start_s).or(task.map(|task| task.start_s)).unwrap_or_default()
    };
    pairs.sort_by(|one, other| start_s(one).total_cmp(&start_s(other)));
    pairs
}
