//! Scores an analysis against true labels. Returns counts from which all measures follow; docs/score.md defines them.
//!
//! Invariants: nothing is read or printed here; counts of recordings add up in any grouping; a result that is the truth has every rate at 1 and every
//! error at 0; rates lie between 0 and 1.

mod alignment;
mod comparison;
mod contact;
mod json;
mod layout;
pub mod name_map;
mod overlap;
mod relabeled_truth;
mod sequences;
pub mod statistics;
mod tally;
mod tasks;
mod truth;
mod video_frames;

pub use alignment::MAX_PAIRS;
pub use comparison::{ComparedResult, Comparison, compare};
pub use json::{SCHEMA, json};
pub use name_map::{KnownNames, NameMap, TaskParts};
pub use overlap::{Matches, OVERLAPS};
pub use sequences::Sequences;
pub use statistics::Share;
pub use tally::{Boundary, BoundaryErrors, Tally, TaskMeasures};
pub use tasks::{NONE, TaskPair};
pub use truth::{Span, TrackTruth, Truth};
pub use video_frames::{VideoFrames, video_frames};

use super::json::Meta;
use super::{Analysis, Track, TrackId};
use alignment::align;
use layout::{LabeledSpan, Layout};
use name_map::SEPARATE;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use teachtree_base::error::InputError;
use teachtree_base::meaning::Primitives;

/// Segments that share no time stand for each other only when their starts are this near, s.
const SAME_BOUNDARY_S: f64 = 1.0;

/// Which result is scored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The segments after relabeling.
    Relabeled,
    /// The segments as the trees gave them.
    Raw,
}

impl fmt::Display for Stage {
    /// `relabeled`, `raw`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Relabeled => "relabeled",
            Self::Raw => "raw",
        })
    }
}

/// The score of some recordings.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// Which result was scored.
    pub stage: Stage,
    /// The scores, in order of the recordings.
    pub rows: Vec<Row>,
    /// All together.
    pub all: Tally,
}

/// The score of a track.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The recording, as the user named it.
    pub log: String,
    /// Whose track it is.
    pub who: TrackId,
    /// The counts.
    pub tally: Tally,
}

impl Score {
    /// The score of all rows.
    pub fn new(stage: Stage, rows: Vec<Row>) -> Self {
        let mut all = Tally::default();
        rows.iter().for_each(|row| all.add(&row.tally));
        Self { stage, rows, all }
    }

    /// Rejects a score with nothing to compare: no time has both a true label and a result, and no recording has a task.
    ///
    /// # Errors
    /// No recording can be compared. The error names the first one.
    pub fn or_nothing(self) -> Result<Self, InputError> {
        let has_tasks = self.all.tasks.as_ref().is_some_and(|tasks| !tasks.is_empty());
        let log = self.rows.first().map_or("the log", |row| &row.log);
        if self.all.scored_s() > 0.0 || has_tasks {
            return Ok(self);
        }
        let message = "nothing can be scored: no time has both a true label that is not masked and a result";
        Err(InputError::new(log, message).help(
            "`teachtree analyze` prints the times and tracks of its results; compare them with those of the labels",
        ))
    }

    /// Returns the number of scored recordings.
    pub fn recordings(&self) -> usize {
        self.rows.chunk_by(|one, next| one.log == next.log).count()
    }
}

/// Scores a recording: a row for each track of the truth.
///
/// # Errors
/// A true track that was not analyzed, or more segments than can be compared.
pub fn score(truth: &Truth, analysis: &Analysis, stage: Stage, meta: &Meta) -> Result<Vec<Row>, InputError> {
    let spans = truth.tracks.iter().flat_map(|track| &track.primitives);
    let named: BTreeSet<&str> = spans.flat_map(|span| span.names.iter().map(String::as_str)).collect();
    let rows = truth.tracks.iter().map(|truth| {
        let track = analysis.track(truth.who).ok_or_else(|| {
            let found: Vec<String> = analysis.tracks.iter().map(|track| track.who.to_string()).collect();
            let found = if found.is_empty() { "no track".into() } else { found.join(", ") };
            let message = format!("the true labels are of the track `{}`, the analysis has {found}", truth.who);
            InputError::new(&meta.log, message).help(
                "use rules with a tree for this track; a tree `for left, right` analyzes recordings of both hands only",
            )
        })?;
        let tally = tally(truth, track, analysis, stage, &named).ok_or_else(|| {
            let message = format!(
                "the track `{}` has too many segments to be compared: their number in the truth times that in the result is over {MAX_PAIRS}",
                truth.who
            );
            InputError::new(&meta.log, message)
        })?;
        Ok(Row { log: meta.log.clone(), who: truth.who, tally })
    });
    rows.collect()
}

/// The counts of a track; `None` when there are too many segments. Kinds of what the truth has `named` count for that.
fn tally(
    truth: &TrackTruth,
    track: &Track,
    analysis: &Analysis,
    stage: Stage,
    named: &BTreeSet<&str>,
) -> Option<Tally> {
    let segments = match stage {
        Stage::Relabeled => &track.relabeled,
        Stage::Raw => &track.segments,
    };
    let primitives = &analysis.primitives;
    let mut found = layout::segments(track, segments, &analysis.stretches);
    found.iter_mut().for_each(|(name, ..)| *name = primitives.counts_for(name, |name| named.contains(name)));
    let layout = Layout::new(&truth.primitives, &found);
    let mut tally = Tally { primitives: primitives.clone(), ..Tally::default() };
    for cell in &layout.cells {
        let (Some(truth), Some(result)) = (layout.truth.get(cell.truth), layout.result.get(cell.result)) else {
            continue;
        };
        let result = if cell.right { &truth.name } else { &result.name };
        *tally.time_s.entry((truth.name.clone(), result.clone())).or_default() += cell.length_s;
    }
    // A time without coordination has no segment.
    let [trues, results] = [&layout.truth, &layout.result].map(|row| segments_of(row));
    tally.segments = overlap::matches(&trues, &results);
    let pair = |one: usize, other: usize| trues.get(one).zip(results.get(other));
    let late_s = |one, other| pair(one, other).map(|(truth, result)| result.start_s - truth.start_s);
    let alignment = align(
        (trues.len(), results.len()),
        |one, other| pair(one, other).is_some_and(|(truth, result)| truth.name == result.name),
        |one, other| late_s(one, other).map_or(0.0, f64::abs),
    )?;
    let longest = trues.len().max(results.len());
    if longest > 0 {
        tally.edits.push(1.0 - alignment.edits as f64 / longest as f64);
        tally.sequences.count(alignment.edits == 0);
    }
    let late = alignment.pairs.iter().filter_map(|&(one, other)| {
        let (truth, result) = pair(one, other)?;
        let late_s = late_s(one, other)?;
        let meet = truth.start_s < result.end_s && result.start_s < truth.end_s;
        (meet || late_s.abs() <= SAME_BOUNDARY_S).then_some((one, late_s))
    });
    let late: BTreeMap<usize, f64> = late.collect();
    tally.boundaries = boundaries(&layout.truth, &late, primitives);
    tally.tasks = truth.tasks.as_ref().map(|tasks| task_pairs(tasks, track, &trues, &results));
    Some(tally)
}

fn segments_of(row: &[LabeledSpan]) -> Vec<&LabeledSpan> {
    row.iter().filter(|piece| piece.name != SEPARATE).collect()
}

/// The boundaries of the truth: the starts of its segments, except where the scored time begins or something was cut out.
/// `late_s` says how late the segments are that the result has, by their number.
fn boundaries(truth: &[LabeledSpan], late_s: &BTreeMap<usize, f64>, primitives: &Primitives) -> Vec<Boundary> {
    let before = std::iter::once(None).chain(truth.iter().map(Some));
    let segments = before.zip(truth).filter(|(_, piece)| piece.name != SEPARATE).enumerate();
    let boundaries = segments.filter_map(|(number, (before, piece))| {
        let before = before.filter(|_| !piece.cut)?;
        Some(Boundary {
            before: before.name.clone(),
            after: piece.name.clone(),
            by_contact: contact::by_contact(primitives, &before.name, &piece.name),
            late_s: late_s.get(&number).copied(),
        })
    });
    boundaries.collect()
}

/// The tasks of a hand with their primitives: those whose middle lies in the task.
fn task_pairs(tasks: &[Span], track: &Track, trues: &[&LabeledSpan], results: &[&LabeledSpan]) -> Vec<TaskPair> {
    let within = |row: &[&LabeledSpan], (start_s, end_s): (f64, f64)| -> Vec<String> {
        let middle = |piece: &LabeledSpan| (piece.clock_s.0 + piece.clock_s.1) / 2.0;
        let inside = row.iter().filter(|piece| (start_s..end_s).contains(&middle(piece)));
        inside.map(|piece| piece.name.clone()).collect()
    };
    let pairs = tasks::pairs(tasks, &track.tasks).into_iter().map(|(truth, found)| {
        let true_s = truth.map(|truth| (truth.start_s, truth.end_s));
        let found_s = found.map(|found| (found.start_s, found.end_s));
        let result = found.map_or(NONE, |found| &found.task).to_string();
        TaskPair {
            // Among several true names, the found one counts.
            truth: truth.map_or(NONE.to_string(), |truth| {
                if truth.names.contains(&result) { result.clone() } else { truth.name() }
            }),
            result,
            time_s: true_s.or(found_s).unwrap_or_default(),
            true_sequence: true_s.map(|time| within(trues, time)).unwrap_or_default(),
            sequence: found_s.map(|time| within(results, time)).unwrap_or_default(),
        }
    });
    pairs.collect()
}
