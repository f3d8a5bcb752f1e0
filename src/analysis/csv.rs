//! The analysis as a table, one row for each raw segment, task and relabelled segment.
//!
//! Columns: `log`, `track`, `kind` (`raw`, `task`, `relabelled`), `name`, `start_s`, `end_s`, `task` (the number of the task in its track,
//! from 1; empty for what is in none), `was` (raw primitives, blanks between), `by` (rules, `; ` between), `secondary` (blanks between),
//! `open` (`start`, `end`, or both).

use super::json::{Meta, open};
use super::number::number;
use super::{Analysis, Segment, Track};
use crate::base::error::InputError;

/// The names of the columns.
pub const COLUMNS: [&str; 11] =
    ["log", "track", "kind", "name", "start_s", "end_s", "task", "was", "by", "secondary", "open"];

/// Writes the table with its header.
///
/// # Errors
/// When the writer of the `csv` crate fails, which it does not on memory.
pub fn csv(analysis: &Analysis, meta: &Meta) -> Result<String, InputError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let failed = |error: String| InputError::new("CSV", error);
    writer.write_record(COLUMNS).map_err(|error| failed(error.to_string()))?;
    for row in analysis.tracks.iter().flat_map(rows) {
        writer.write_record([meta.log.clone()].iter().chain(&row)).map_err(|error| failed(error.to_string()))?;
    }
    let bytes = writer.into_inner().map_err(|error| failed(error.to_string()))?;
    String::from_utf8(bytes).map_err(|error| failed(error.to_string()))
}

type Row = [String; COLUMNS.len() - 1];

fn rows(track: &Track) -> Vec<Row> {
    let segment = |kind: &str, task: Option<usize>, segment: &Segment| -> Row {
        [
            track.who.to_string(),
            kind.into(),
            segment.primitive.clone(),
            number(segment.start_s),
            number(segment.end_s),
            task.map(|task| task.to_string()).unwrap_or_default(),
            segment.was.join(" "),
            segment.by.join("; "),
            String::new(),
            String::new(),
        ]
    };
    let mut rows: Vec<Row> = track.segments.iter().map(|raw| segment("raw", None, raw)).collect();
    for (task, number_of_task) in track.tasks.iter().zip(1..) {
        rows.push([
            track.who.to_string(),
            "task".into(),
            task.task.clone(),
            number(task.start_s),
            number(task.end_s),
            number_of_task.to_string(),
            String::new(),
            String::new(),
            task.secondary.join(" "),
            open(task).join(" "),
        ]);
    }
    for relabelled in &track.relabelled {
        let task = track.tasks.iter().position(|task| task.frames.contains(&relabelled.frames.start));
        rows.push(segment("relabelled", task.map(|task| task + 1), relabelled));
    }
    rows
}
