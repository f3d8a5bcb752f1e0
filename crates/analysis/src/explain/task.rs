//! Why a task has its name: each task that was tried, with its keys.

use super::AnalyzedRecording;
use super::fact::{quantities, time};
use crate::interval_labels::{IntervalLabels, Settling};
use crate::measures::Measures;
use crate::{Subject, TrackId, UNKNOWN, relabeling_rounds, tasks};
use serde::Serialize;
use std::collections::BTreeMap;
use teachtree_base::hands::Side;
use teachtree_engine::runs::Leaves;
use teachtree_language::rules::folded;
use teachtree_language::rules::{Rules, Task};

/// The task at a time, and how it came to its name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TaskReason {
    /// Its name.
    pub task: String,
    /// Whether the rules declare it as a failure.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub failure: bool,
    /// The object that it is about.
    pub object: Option<String>,
    /// The body that the object is in or against.
    pub partner: Option<String>,
    /// When it starts, s.
    pub start_s: f64,
    /// When it ends, s.
    pub end_s: f64,
    /// The task of tasks that it is a part of.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub part_of: Option<CompositePart>,
    /// The tasks by priority, down to the one that names it and those that match besides.
    pub tried: Vec<TaskCandidate>,
}

/// The position of a task in a composite task.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CompositePart {
    /// The name of that task.
    pub task: String,
    /// Which of its tasks it is, from 1.
    pub part: usize,
    /// The names of its tasks, in order.
    pub parts: Vec<String>,
    /// When that task starts, s.
    pub start_s: f64,
    /// When it ends, s.
    pub end_s: f64,
}

/// A task of the rules, held against the span.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TaskCandidate {
    /// Its name.
    pub task: String,
    /// Where it is declared.
    pub place: String,
    /// Whether all that it asks is there.
    pub matches: bool,
    /// Its demands, each with the measured value.
    pub asked: Vec<Requirement>,
}

/// A key, or what must not occur.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Requirement {
    /// As its author wrote it: `Follow lasting 150 ms`, `without Grasp`.
    pub what: String,
    /// Whether it is so.
    pub holds: bool,
    /// The measured value.
    pub found: String,
}

/// The task of a hand around a frame; `None` when the frame is in none.
pub(super) fn of(analyzed: &AnalyzedRecording, leaves: &Leaves, side: Side, frame: usize) -> Option<TaskReason> {
    let AnalyzedRecording { rules, frames, analysis, .. } = *analyzed;
    let rate_hz = frames.layout.rate_hz;
    let mut stretch = IntervalLabels::new(leaves, &frames.unseen, Settling::new(rules, rate_hz));
    let measures: BTreeMap<Side, Measures> =
        stretch.hands.keys().map(|side| (*side, Measures::new(frames, frames, *side))).collect();
    relabeling_rounds::relabel_stretch(rules, &mut stretch, &measures);
    let (lane, measures) = stretch.hands.get(&side).zip(measures.get(&side))?;
    let named = tasks::recognize(rules, lane, measures);
    let named = named.into_iter().find(|named| {
        let (first, last) = (named.pieces.first(), named.pieces.last());
        first.zip(last).is_some_and(|(first, last)| (first.frames.start..last.frames.end).contains(&frame))
    })?;
    let pieces = named.pieces.as_slice();
    let tried = rules.tasks.iter().map(|task| tried(rules, task, measures, pieces));
    let start = pieces.first().map_or(0, |piece| piece.frames.start);
    let end = pieces.last().map_or(0, |piece| piece.frames.end);
    let declared = named.task.and_then(|id| rules.tasks.get(id.index()));
    let name = declared.map_or(UNKNOWN, |task| task.name.as_str());
    let track = analysis.track(TrackId::Hand(side));
    let spans = track.map_or(&[][..], |track| &track.tasks);
    let at = spans.iter().position(|span| span.frames.contains(&frame));
    let span = at.and_then(|at| spans.get(at));
    let part_of = at.zip(track).and_then(|(at, track)| {
        let found = track.composites.iter().find(|found| found.tasks.contains(&at))?;
        Some(CompositePart {
            task: found.task.clone(),
            part: at + 1 - found.tasks.start,
            parts: found.parts.clone(),
            start_s: found.start_s,
            end_s: found.end_s,
        })
    });
    let Subject { object, partner } = span.map(|span| span.subject.clone()).unwrap_or_default();
    Some(TaskReason {
        task: name.to_string(),
        failure: declared.is_some_and(|task| task.failure),
        object,
        partner,
        start_s: frames.time.get(start).copied().unwrap_or_default(),
        end_s: end.checked_sub(1).map_or(0.0, |last| frames.end_of(last)),
        part_of,
        tried: tried.collect(),
    })
}

fn tried(
    rules: &Rules,
    task: &Task,
    measures: &Measures,
    pieces: &[crate::labeled_span::LabeledSpan],
) -> TaskCandidate {
    let keys = task.keys.iter().map(|key| {
        let own: Vec<_> = pieces.iter().filter(|piece| key.label.covers(piece.label)).collect();
        let holds = measures.found(key, pieces);
        let found = if own.is_empty() {
            "no segment of it".to_string()
        } else {
            let mut words = Vec::new();
            if key.lasting.is_some() {
                let longest = own.iter().map(|piece| piece.frames.len()).max().unwrap_or(0);
                #[allow(clippy::cast_precision_loss, reason = "frames of a log")]
                words.push(format!("the longest lasts {}", time(longest as f64 / measures.rate_hz())));
            }
            if key.travelling.is_some() {
                let farthest = own.iter().map(|piece| measures.travelled(&piece.frames)).fold(0.0, f64::max);
                let [distance] = quantities([farthest], "m");
                words.push(format!("the farthest travels {distance}"));
            }
            if key.turning.is_some() {
                let [angle] = quantities([measures.turned(&own).to_degrees()], "deg");
                words.push(format!("together they turn {angle}"));
            }
            let count = if own.len() == 1 { "one segment".to_string() } else { format!("{} segments", own.len()) };
            std::iter::once(count).chain(words).collect::<Vec<_>>().join(", ")
        };
        Requirement { what: folded(rules.sources.text(key.span)), holds, found }
    });
    let keys: Vec<Requirement> = keys.collect();
    let any = |asked: &Requirement| asked.holds;
    let keyed = if task.all_keys { keys.iter().all(any) } else { keys.iter().any(any) };
    let without = task.without.iter().map(|label| {
        let count = pieces.iter().filter(|piece| label.covers(piece.label)).count();
        let found = if count == 0 { "none".to_string() } else { format!("{count} found") };
        Requirement { what: format!("without {}", rules.label_name(*label)), holds: count == 0, found }
    });
    let without: Vec<Requirement> = without.collect();
    let matches = keyed && without.iter().all(any);
    let asked = keys.into_iter().chain(without).collect();
    TaskCandidate { task: task.name.clone(), place: rules.sources.place(task.span), matches, asked }
}
