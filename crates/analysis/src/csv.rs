//! The analysis as a table, one row for each raw segment, task, task that is made of tasks, and relabeled segment.
//!
//! Columns (docs/formats.md): `log`, `track`, `kind` (`raw`, `task`, `composite`, `relabeled`), `name`, `object`, `partner`, `start_s`, `end_s`,
//! `start_row`, `end_row`, `task` (the number of the task in its track, from 1; empty for what is in none; of a `composite` those of its tasks, blanks
//! between), `was` (raw primitives, blanks between), `by` (rules, `; ` between), `secondary` (blanks between), `open` (`start`, `end`, or both), `attempt` (of
//! a task, from 1), `failure` (1 of a task that the rules declare as one), `zero_stamp_s`, `digest`, `version`; where it was asked for also `confidence`,
//! `stability`, `earliest_s`, `latest_s`, `margin`.

use super::json::{Meta, VERSION, cut_ends, open};
use super::number::number;
use super::{Analysis, Confidence, Segment, Subject, Track};
use std::ops::Range;
use teachtree_base::error::InputError;

/// The names of the columns.
pub const COLUMNS: [&str; 20] = [
    "log",
    "track",
    "kind",
    "name",
    "object",
    "partner",
    "start_s",
    "end_s",
    "start_row",
    "end_row",
    "task",
    "was",
    "by",
    "secondary",
    "open",
    "attempt",
    "failure",
    "zero_stamp_s",
    "digest",
    "version",
];
/// The columns after them where it was asked how sure boundaries are: of the start of a segment after relabeling; of a task the stability only.
pub const CONFIDENCE: [&str; 5] = ["confidence", "stability", "earliest_s", "latest_s", "margin"];
/// Number of columns with the same value in each row: one before the others, the rest after them.
const CONSTANT: usize = 4;

/// Writes the table with its header.
///
/// # Errors
/// When the writer of the `csv` crate fails, which it does not on memory.
pub fn csv(analysis: &Analysis, meta: &Meta) -> Result<String, InputError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let failed = |error: String| InputError::new("CSV", error);
    let is_sure = analysis.tracks.iter().flat_map(|track| &track.relabeled).any(|it| it.confidence.is_some());
    let more = if is_sure { &CONFIDENCE[..] } else { &[] };
    let header = COLUMNS.iter().chain(more);
    writer.write_record(header).map_err(|error| failed(error.to_string()))?;
    let (zero, version) = (number(meta.zero_stamp_s), VERSION.to_string());
    for (row, sure) in analysis.tracks.iter().flat_map(rows) {
        let (head, tail) = ([&meta.log], [&zero, &meta.digest, &version]);
        let cells = head.into_iter().chain(&row).chain(tail).chain(sure.iter().take(more.len()));
        writer.write_record(cells).map_err(|error| failed(error.to_string()))?;
    }
    let bytes = writer.into_inner().map_err(|error| failed(error.to_string()))?;
    String::from_utf8(bytes).map_err(|error| failed(error.to_string()))
}

type Row = ([String; COLUMNS.len() - CONSTANT], [String; CONFIDENCE.len()]);

fn rows(track: &Track) -> Vec<Row> {
    let who = track.who.to_string();
    let segment = |kind: &str, task: Option<usize>, segment: &Segment| -> Row {
        let sure = segment.confidence.map_or_else(Default::default, |it: Confidence| {
            let margin = it.margin.map(number).unwrap_or_default();
            [number(it.share), number(it.stability), number(it.earliest_s), number(it.latest_s), margin]
        });
        let time_s = (segment.start_s, segment.end_s);
        let span = span(&segment.subject, time_s, &segment.rows);
        let task = task.map(|task| task.to_string()).unwrap_or_default();
        let behind = [task, segment.was.join(" "), segment.by.join("; ")];
        (row(&who, kind, &segment.primitive, span, behind), sure)
    };
    let mut rows: Vec<Row> = track.segments.iter().map(|raw| segment("raw", None, raw)).collect();
    for (task, number_of_task) in track.tasks.iter().zip(1..) {
        let span = span(&task.subject, (task.start_s, task.end_s), &task.rows);
        let none = String::new();
        let [was, by] = [none.clone(), none.clone()];
        let open = open(task).join(" ");
        let (attempt, failure) = (task.attempt.to_string(), failure(task.failure));
        let behind = [number_of_task.to_string(), was, by, task.secondary.join(" "), open, attempt, failure];
        let mut sure: [String; CONFIDENCE.len()] = Default::default();
        sure[1] = task.stability.map(number).unwrap_or_default();
        rows.push((row(&who, "task", &task.task, span, behind), sure));
    }
    for composite in &track.composites {
        let tasks: Vec<String> = composite.tasks.clone().map(|at| (at + 1).to_string()).collect();
        let span = span(&Subject::default(), (composite.start_s, composite.end_s), &composite.rows);
        let none = String::new();
        let open = cut_ends(composite.open_start, composite.open_end).join(" ");
        let [was, by, secondary, attempt] = std::array::from_fn(|_| none.clone());
        let behind = [tasks.join(" "), was, by, secondary, open, attempt, failure(composite.failure)];
        rows.push((row(&who, "composite", &composite.task, span, behind), Default::default()));
    }
    for relabeled in &track.relabeled {
        let task = track.tasks.iter().position(|task| task.frames.contains(&relabeled.frames.start));
        rows.push(segment("relabeled", task.map(|task| task + 1), relabeled));
    }
    rows
}

/// `1` of a failure.
fn failure(is_failure: bool) -> String {
    if is_failure { "1".into() } else { String::new() }
}

/// The cells of a row: track, kind and name, the span, and those from `task` to `failure`.
fn row<const N: usize>(
    who: &str,
    kind: &str,
    name: &str,
    span: [String; 6],
    behind: impl IntoIterator<Item = String>,
) -> [String; N] {
    let mut cells = [who, kind, name].map(str::to_string).into_iter().chain(span).chain(behind);
    std::array::from_fn(|_| cells.next().unwrap_or_default())
}

/// The common columns of segments and tasks.
fn span(subject: &Subject, time_s: (f64, f64), rows: &Range<usize>) -> [String; 6] {
    let Subject { object, partner } = subject.clone();
    let [object, partner] = [object, partner].map(Option::unwrap_or_default);
    [object, partner, number(time_s.0), number(time_s.1), rows.start.to_string(), rows.end.to_string()]
}
