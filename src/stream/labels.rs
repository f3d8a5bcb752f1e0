//! Label files: who did what from when to when, as somebody else says (docs/score.md). A table in, intervals on the time base of a log out.
//!
//! ```text
//! track,label,start_s,end_s          start_frame,end_frame,surgeme
//! right,Approach,1.2,1.9             57,141,S1
//! ```
//!
//! Invariants: every interval is longer than nothing and lies in order; those of one track and kind are apart. What no row covers is not labelled.

use super::names;
use crate::base::error::InputError;
use std::path::Path;

/// The most rows that are read.
pub const MAX_ROWS: usize = 100_000;
/// The longest name, in bytes.
const MAX_NAME: usize = 200;

/// Columns with the name of what was done.
const NAME: [&str; 3] = ["label", "primitive", "surgeme"];
/// Columns in seconds.
const SECONDS: [&str; 2] = ["start_s", "end_s"];
/// Columns in rows of the log, the first row being 0 and the end not included.
const ROWS: [&[&str]; 2] = [&["start_frame", "start_row"], &["end_frame", "end_row", "end_row_excl"]];

/// A label file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Labels {
    /// Its name in messages.
    pub file: String,
    /// The intervals, by start.
    pub intervals: Vec<Interval>,
}

/// One labelled interval.
#[derive(Clone, Debug, PartialEq)]
pub struct Interval {
    /// The row of the file, the header being row 1.
    pub row: u64,
    /// `left`, `right` or `both`; `None` where the file does not say.
    pub track: Option<String>,
    /// What is named.
    pub kind: Kind,
    /// The name, as it stands in the file.
    pub name: String,
    /// Start, s.
    pub start_s: f64,
    /// End, s.
    pub end_s: f64,
}

/// What a label names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A primitive motion.
    Primitive,
    /// A task.
    Task,
}

/// Reads a label file; `row_time` is when each row of the log was, s.
///
/// # Errors
/// The first thing that cannot be read, with file, row and column.
pub fn read(path: &Path, row_time: &[f64]) -> Result<Labels, InputError> {
    let file = path.display().to_string();
    let unreadable = |error: ::csv::Error| {
        let place = error.position().map_or(file.clone(), |at| format!("{file} row {}", at.line()));
        InputError::new(place, format!("cannot be read: {error}"))
    };
    let mut reader = ::csv::ReaderBuilder::new().trim(::csv::Trim::All).from_path(path).map_err(unreadable)?;
    let header: Vec<String> = reader.headers().map_err(unreadable)?.iter().map(plain).collect();
    let columns = Columns::find(&header).map_err(|message| {
        InputError::new(format!("{file} row 1"), message)
            .help("a label file has the columns `track,label,start_s,end_s` or `start_frame,end_frame,label`")
    })?;
    let mut intervals = Vec::new();
    for record in reader.records() {
        let record = record.map_err(unreadable)?;
        if intervals.len() == MAX_ROWS {
            return Err(InputError::new(&file, format!("the file has more than {MAX_ROWS} rows of labels")));
        }
        let row = record.position().map_or(0, ::csv::Position::line);
        let wrong = |column: usize, message: String| {
            let title = header.get(column).map_or("", String::as_str);
            InputError::new(format!("{file} row {row} column {title}"), message)
        };
        intervals.extend(columns.interval(&record, row, row_time).map_err(|(column, text)| wrong(column, text))?);
    }
    intervals.sort_by(|one, other| one.start_s.total_cmp(&other.start_s));
    apart(&file, &intervals)?;
    Ok(Labels { file, intervals })
}

fn plain(title: &str) -> String {
    title.trim_start_matches('\u{feff}').trim().to_string()
}

/// Where things stand in a row.
struct Columns {
    track: Option<usize>,
    kind: Option<usize>,
    name: usize,
    start: usize,
    end: usize,
    in_rows: bool,
}

impl Columns {
    fn find(header: &[String]) -> Result<Self, String> {
        let any = |names: &[&str]| header.iter().position(|title| names.contains(&title.as_str()));
        let wanted = |names: &[&str]| {
            let near = names.iter().find_map(|name| names::nearest(name, header.iter().map(String::as_str)));
            let meant = near.map_or_else(String::new, |near| format!("; was `{near}` meant?"));
            format!("found the columns {}, wanted {}{meant}", header.join(", "), names.join(" or "))
        };
        let name = any(&NAME).ok_or_else(|| wanted(&NAME))?;
        let [start_s, end_s] = SECONDS.map(|name| any(&[name]));
        let [start_row, end_row] = ROWS.map(any);
        let (start, end, in_rows) = match (start_s.zip(end_s), start_row.zip(end_row)) {
            (Some((start, end)), _) => (start, end, false),
            (None, Some((start, end))) => (start, end, true),
            (None, None) if start_row.is_some() => return Err(wanted(ROWS[1])),
            (None, None) if start_s.is_some() => return Err(wanted(&["end_s"])),
            (None, None) => return Err(wanted(&["start_s and end_s", "start_frame and end_frame"])),
        };
        Ok(Self { track: any(&["track"]), kind: any(&["kind"]), name, start, end, in_rows })
    }

    /// The interval of a row; none for a row without a name or without length. The error is a column and what is wrong there.
    fn interval(
        &self,
        record: &::csv::StringRecord,
        row: u64,
        row_time: &[f64],
    ) -> Result<Option<Interval>, (usize, String)> {
        let cell = |column: usize| record.get(column).unwrap_or_default();
        let name = cell(self.name);
        if name.len() > MAX_NAME {
            return Err((self.name, format!("the name has {} bytes, at most {MAX_NAME} are read", name.len())));
        }
        let track = self.track.map(|column| match cell(column) {
            track @ ("left" | "right" | "both") => Ok(track.to_string()),
            other => Err((column, format!("found `{}`, wanted left, right or both", shown(other)))),
        });
        let kind = match self.kind.map(|column| (column, cell(column))) {
            None | Some((_, "primitive")) => Kind::Primitive,
            Some((_, "task")) => Kind::Task,
            Some((column, other)) => {
                return Err((column, format!("found `{}`, wanted primitive or task", shown(other))));
            }
        };
        let [start_s, end_s] = [self.start, self.end].map(|column| self.time(cell(column), column, row_time));
        let (start_s, end_s) = (start_s?, end_s?);
        if end_s < start_s {
            return Err((
                self.end,
                format!("the interval ends before it starts, at {} after {}", cell(self.end), cell(self.start)),
            ));
        }
        let track = track.transpose()?;
        let labelled = !name.is_empty() && end_s > start_s;
        Ok(labelled.then(|| Interval { row, track, kind, name: name.to_string(), start_s, end_s }))
    }

    fn time(&self, cell: &str, column: usize, row_time: &[f64]) -> Result<f64, (usize, String)> {
        if !self.in_rows {
            let time = cell.parse::<f64>().ok().filter(|time| time.is_finite());
            return time.ok_or_else(|| (column, format!("found `{}`, wanted a time in seconds", shown(cell))));
        }
        let row: usize = cell
            .parse()
            .map_err(|_| (column, format!("found `{}`, wanted a row of the log, counted from 0", shown(cell))))?;
        let beyond = || (column, format!("found row {row}, the log has {} rows", row_time.len()));
        row_time.get(row).copied().or_else(|| end_of(row_time).filter(|_| row == row_time.len())).ok_or_else(beyond)
    }
}

/// When the last row of a log ends, s: one step after it began.
fn end_of(row_time: &[f64]) -> Option<f64> {
    let last = *row_time.last()?;
    let before = row_time.iter().rev().find(|time| **time < last)?;
    Some(2.0 * last - before)
}

fn shown(cell: &str) -> String {
    cell.chars().take(40).collect()
}

/// Checks that intervals of one track and kind do not overlap.
fn apart(file: &str, intervals: &[Interval]) -> Result<(), InputError> {
    let mut last: std::collections::BTreeMap<(Option<&str>, Kind), &Interval> = std::collections::BTreeMap::new();
    for interval in intervals {
        if let Some(before) = last.insert((interval.track.as_deref(), interval.kind), interval)
            && before.end_s > interval.start_s
        {
            let message = format!(
                "`{}` begins at {} s, before `{}` of row {} ends at {} s",
                interval.name, interval.start_s, before.name, before.row, before.end_s
            );
            return Err(InputError::new(format!("{file} row {}", interval.row), message)
                .help("at any time a track has one label; give each hand its own with a column `track`"));
        }
    }
    Ok(())
}
