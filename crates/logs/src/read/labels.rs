//! Label files: who did what from when to when, as somebody else says (docs/score.md). A table or an ELAN file in, intervals on the time base of a log out.
//!
//! ```text
//! track,label,start_s,end_s          start_frame,end_frame,surgeme
//! right,Approach,1.2,1.9             57,141,S1
//! ```
//!
//! The table that `analyze --format csv` writes is one: its `relabeled` segments are primitives, and its rows may be about several logs.
//!
//! Invariants: every interval is longer than nothing; those of one track and kind are in order and apart. What no row covers, and what
//! two rows label differently, is not labeled.

mod eaf;
mod gaps;

use super::date_time::date_time;
use super::file;
use super::first_stamp::in_recording;
use super::formats::{delimited_text, stem};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_base::hands::TrackId;
use teachtree_base::short_number::ShortNumber;
use teachtree_base::spelling::nearest;

/// The most rows that are read.
pub const MAX_ROWS: usize = 100_000;
/// The most rows that may be about one time.
const MAX_AT_ONCE: usize = 100;
/// The longest name, in bytes.
const MAX_NAME: usize = 200;

/// Columns with the name of what was done, and those of BORIS and of ELAN.
const NAME: [&str; 4] = ["label", "primitive", "surgeme", "name"];
const NAME_ELSEWHERE: [&str; 2] = ["behavior", "annotation"];
/// The column with the log that a row is about.
const LOG: &str = "log";
/// The kind of rows that label nothing: segments before relabeling.
const RAW: &str = "raw";
/// The kind of rows of tasks that are made of tasks, which are listed themselves.
const COMPOSITE: &str = "composite";
/// Columns in seconds; the last ones are of BORIS and of ELAN.
const SECONDS: [&[&str]; 2] = [
    &["start_s", "start (s)", "begin time - ss.msec", "begin time - hh:mm:ss.ms"],
    &["end_s", "stop (s)", "end (s)", "end time - ss.msec", "end time - hh:mm:ss.ms"],
];
/// The column with the time from start to end, in seconds, instead of the end.
const DURATION: &str = "duration_s";
/// Columns in milliseconds; the last ones are of ELAN.
const MILLISECONDS: [&[&str]; 2] = [&["start_ms", "begin time - msec"], &["end_ms", "end time - msec"]];
/// Columns in rows of the log, the first row being 0 and the end not included.
const ROWS: [&[&str]; 2] = [&["start_frame", "start_row"], &["end_frame", "end_row", "end_row_excl"]];

/// A label file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Labels {
    /// Its name in messages.
    pub file: String,
    /// The intervals, by track and kind, each in order of time.
    pub intervals: Vec<Interval>,
    /// Time that two rows label differently, s; it counts as not labeled.
    pub contradicted_s: f64,
    /// Whether the file gives times as rows of the log.
    pub in_rows: bool,
}

/// One labeled interval.
#[derive(Clone, Debug, PartialEq)]
pub struct Interval {
    /// Where it stands in the file: `row 3`, the header being row 1, or `annotation a3`.
    pub place: String,
    /// Whose it is; `None` where the file does not say.
    pub track: Option<TrackId>,
    /// The kind of the label.
    pub kind: LabelKind,
    /// The name, as it stands in the file.
    pub name: String,
    /// Start, s.
    pub start_s: f64,
    /// End, s.
    pub end_s: f64,
}

impl Labels {
    /// Lets times since 1970 count as those of the recording do; `zero_stamp_s` is what the stamps of its log show at 0 s.
    pub fn count_from(&mut self, zero_stamp_s: f64) {
        for interval in &mut self.intervals {
            interval.start_s = in_recording(interval.start_s, zero_stamp_s);
            interval.end_s = in_recording(interval.end_s, zero_stamp_s);
        }
    }
}

/// The kinds of labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LabelKind {
    /// A primitive motion.
    Primitive,
    /// A task.
    Task,
}

/// Whether the rows of a table say which log they are about, so that it may be one of several logs.
pub fn names_logs(path: &Path) -> bool {
    let header = file::open(path).map(|file| table_reader(file).and_then(|(mut reader, _)| reader.headers().cloned()));
    !is_eaf(path) && matches!(header, Ok(Ok(header)) if header.iter().any(|title| plain(title) == LOG))
}

/// Whether a file is one of ELAN by its name.
fn is_eaf(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("eaf"))
}

/// Labels of these intervals, which need not be apart; `file` is their file in messages.
///
/// # Errors
/// More labels for one time than are read.
pub fn of_intervals(file: String, intervals: Vec<Interval>) -> Result<Labels, InputError> {
    let mut tracks: BTreeMap<(Option<TrackId>, LabelKind), Vec<Interval>> = BTreeMap::new();
    for interval in intervals {
        tracks.entry((interval.track, interval.kind)).or_default().push(interval);
    }
    let mut labels = Labels { file, ..Labels::default() };
    for mut of_track in tracks.into_values() {
        labels.contradicted_s += apart(&mut of_track)
            .map_err(|(place, message)| InputError::new(format!("{} {place}", labels.file), message))?;
        labels.intervals.append(&mut of_track);
    }
    Ok(labels)
}

/// Reads a label file about a log; `row_time` is when each row of the log was, s.
///
/// # Errors
/// The first thing that cannot be read, with file, row and column; a table about other logs.
pub fn read(path: &Path, log: &Path, row_time: &[f64]) -> Result<Labels, InputError> {
    if !is_eaf(path) {
        return table(file::open(path)?, path, log, row_time);
    }
    let mut labels = of_intervals(path.display().to_string(), eaf::read(path)?)?;
    gaps::close(&mut labels.intervals, row_time);
    Ok(labels)
}

/// A reader of a table, and the delimiter of its cells: the most frequent one in the first line, as spreadsheets also save semicolons and tabs.
fn table_reader<R: Read>(bytes: R) -> ::csv::Result<(::csv::Reader<BufReader<R>>, u8)> {
    let mut bytes = BufReader::new(bytes);
    let mut is_quoted = false;
    let mut counts = [(b',', 0), (b';', 0), (b'\t', 0)];
    for byte in bytes.fill_buf()?.iter().take_while(|byte| !matches!(byte, b'\n' | b'\r')) {
        is_quoted ^= *byte == b'"';
        counts.iter_mut().filter(|(delimiter, _)| delimiter == byte && !is_quoted).for_each(|(_, count)| *count += 1);
    }
    let delimiter = counts.into_iter().rev().max_by_key(|(_, count)| *count).map_or(b',', |(delimiter, _)| delimiter);
    let reader =
        ::csv::ReaderBuilder::new().delimiter(delimiter).trim(::csv::Trim::All).flexible(true).from_reader(bytes);
    Ok((reader, delimiter))
}

/// Reads the table of labels at `path`, like [`read`].
///
/// # Errors
/// As [`read`].
pub fn table(bytes: impl Read, path: &Path, log: &Path, row_time: &[f64]) -> Result<Labels, InputError> {
    let file = path.display().to_string();
    let unreadable = |error: ::csv::Error| delimited_text::unreadable(&file, &error);
    let (mut reader, delimiter) = table_reader(bytes).map_err(unreadable)?;
    let header: Vec<String> = reader.headers().map_err(unreadable)?.iter().map(plain).collect();
    let columns = Columns::find(&header, delimiter != b',').map_err(|message| {
        InputError::new(format!("{file} row 1"), message)
            .help("a label file has the columns `track,label,start_s,end_s` or `start_frame,end_frame,label`")
    })?;
    let mut intervals = Vec::new();
    let (mut others, mut is_about_log) = (BTreeSet::new(), false);
    let wanted = (log.display().to_string(), stem(log));
    let mut rows = 0;
    for record in reader.records() {
        let record = record.map_err(unreadable)?;
        rows += 1;
        if rows > MAX_ROWS {
            return Err(InputError::new(&file, format!("the file has more than {MAX_ROWS} rows of labels")));
        }
        // Spreadsheets save rows that are empty.
        if record.iter().all(str::is_empty) {
            continue;
        }
        let row = record.position().map_or(0, ::csv::Position::line);
        if record.len() != header.len() {
            let message = format!("found {} fields, expected {} as in the header", record.len(), header.len());
            return Err(InputError::new(format!("{file} row {row}"), message));
        }
        let wrong = |column: usize, message: String| {
            let title = header.get(column).map_or("", String::as_str);
            InputError::new(format!("{file} row {row} column {title}"), message)
        };
        if let Some(of) = columns.log.and_then(|column| record.get(column)) {
            if wanted.0 != of && wanted.1 != stem(Path::new(of)) {
                others.insert(of.to_string());
                continue;
            }
            is_about_log = true;
        }
        intervals.extend(columns.interval(&record, row, row_time).map_err(|(column, text)| wrong(column, text))?);
    }
    if let Some(other) = others.first().filter(|_| !is_about_log) {
        let message = format!("no row is about the log {}, the first is about `{}`", wanted.0, shown(other));
        return Err(InputError::new(file, message).help("delete the column `log` if all rows are about it"));
    }
    let mut labels = of_intervals(file, intervals)?;
    labels.in_rows = matches!(columns.times, Times::Rows);
    gaps::close(&mut labels.intervals, row_time);
    Ok(labels)
}

fn plain(title: &str) -> String {
    title.trim_start_matches('\u{feff}').trim().to_string()
}

/// The columns of a row.
struct Columns {
    log: Option<usize>,
    track: Option<usize>,
    kind: Option<usize>,
    name: usize,
    start: usize,
    end: usize,
    /// Whether the end is given as the time from the start.
    is_duration: bool,
    times: Times,
}

/// The time columns of a table.
#[derive(Clone, Copy)]
enum Times {
    /// Rows of the log.
    Rows,
    /// Numbers of a unit with this many seconds, with a decimal comma if the cells are not separated by commas.
    Numbers { to_seconds: f64, has_commas: bool },
}

impl Columns {
    fn find(header: &[String], has_commas: bool) -> Result<Self, String> {
        /// Columns that a message lists.
        const TOLD: usize = 8;
        let any = |names: &[&str]| {
            let is_any = |title: &String| names.iter().any(|name| title.eq_ignore_ascii_case(name));
            header.iter().position(is_any)
        };
        let wanted = |names: &[&str]| {
            let near = names.iter().find_map(|name| nearest(name, header.iter().map(String::as_str)));
            let meant = near.map_or_else(String::new, |near| format!("; was `{near}` meant?"));
            let more = if header.len() > TOLD { ", …" } else { "" };
            let found: Vec<&str> = header.iter().take(TOLD).map(String::as_str).collect();
            format!("found the columns {}{more}, expected {}{meant}", found.join(", "), names.join(" or "))
        };
        let name = any(&NAME).or_else(|| any(&NAME_ELSEWHERE)).ok_or_else(|| wanted(&NAME))?;
        let both = |[start, end]: [&[&str]; 2]| any(start).zip(any(end));
        let [start_row, end_row] = ROWS.map(any);
        let duration = any(&[DURATION]);
        let numbers = |to_seconds: f64| Times::Numbers { to_seconds, has_commas };
        let ((start, end), times) = match (both(SECONDS), both(MILLISECONDS), start_row.zip(end_row)) {
            (Some(columns), ..) => (columns, numbers(1.0)),
            (_, Some(columns), _) => (columns, numbers(1e-3)),
            (.., Some(columns)) => (columns, Times::Rows),
            _ if start_row.is_some() => return Err(wanted(ROWS[1])),
            _ if any(SECONDS[0]).is_some() && duration.is_some() => {
                (any(SECONDS[0]).zip(duration).unwrap_or_default(), numbers(1.0))
            }
            _ if any(SECONDS[0]).is_some() => return Err(wanted(&["end_s"])),
            _ if any(MILLISECONDS[0]).is_some() => return Err(wanted(&["end_ms"])),
            _ => return Err(wanted(&["start_s and end_s", "start_ms and end_ms", "start_frame and end_frame"])),
        };
        let is_duration = duration == Some(end);
        Ok(Self {
            log: any(&[LOG]),
            track: any(&["track"]),
            kind: any(&["kind"]),
            name,
            start,
            end,
            is_duration,
            times,
        })
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
        let track = self.track.map(|column| {
            let wrong = || (column, format!("found `{}`, expected left, right or both", shown(cell(column))));
            TrackId::from_name(cell(column)).ok_or_else(wrong)
        });
        let kind = match self.kind.map(|column| (column, cell(column))) {
            None | Some((_, "primitive" | "relabeled")) => LabelKind::Primitive,
            Some((_, RAW | COMPOSITE)) => return Ok(None),
            Some((_, "task")) => LabelKind::Task,
            Some((column, other)) => {
                return Err((
                    column,
                    format!("found `{}`, expected primitive, relabeled, raw, task or composite", shown(other)),
                ));
            }
        };
        let [start_s, end_s] = [self.start, self.end].map(|column| self.time(cell(column), column, row_time));
        let (start_s, end_s) = (start_s?, end_s?);
        let end_s = if self.is_duration { start_s + end_s } else { end_s };
        if end_s < start_s {
            return Err((
                self.end,
                format!("the interval ends before it starts, at {} after {}", cell(self.end), cell(self.start)),
            ));
        }
        let track = track.transpose()?;
        let labeled = !name.is_empty() && end_s > start_s;
        Ok(labeled.then(|| Interval {
            place: format!("row {row}"),
            track,
            kind,
            name: name.to_string(),
            start_s,
            end_s,
        }))
    }

    fn time(&self, cell: &str, column: usize, row_time: &[f64]) -> Result<f64, (usize, String)> {
        if let Times::Numbers { to_seconds, has_commas } = self.times {
            let number = if has_commas { cell.replace(',', ".") } else { cell.to_string() };
            let time = number.parse::<f64>().ok().filter(|time| time.is_finite()).map(|time| time * to_seconds);
            let unit = if to_seconds < 1.0 { "milliseconds" } else { "seconds" };
            return time
                .or_else(|| date_time(cell))
                .ok_or_else(|| (column, format!("found `{}`, expected a time in {unit}", shown(cell))));
        }
        let row: usize = cell
            .parse()
            .map_err(|_| (column, format!("found `{}`, expected a row of the log, counted from 0", shown(cell))))?;
        let beyond = || (column, format!("found row {row}, the log has {} rows", row_time.len()));
        row_time.get(row).copied().or_else(|| end_of(row_time).filter(|_| row == row_time.len())).ok_or_else(beyond)
    }
}

/// Returns the end of the last row of a log, s: one step after its stamp.
pub fn end_of(row_time: &[f64]) -> Option<f64> {
    let last = *row_time.last()?;
    let before = row_time.iter().rev().find(|time| **time < last)?;
    Some(2.0 * last - before)
}

fn shown(cell: &str) -> String {
    cell.chars().take(40).collect()
}

/// Sorts intervals of one track and kind by start and takes them apart. Returns the time with contradicting labels, s, which belongs to no label.
fn apart(intervals: &mut Vec<Interval>) -> Result<f64, (String, String)> {
    let mut cuts: Vec<f64> = intervals.iter().flat_map(|interval| [interval.start_s, interval.end_s]).collect();
    cuts.sort_by(f64::total_cmp);
    cuts.dedup();
    intervals.sort_by(|one, other| one.start_s.total_cmp(&other.start_s));
    let mut coming = intervals.drain(..).peekable();
    let mut present: Vec<Interval> = Vec::new();
    let mut apart: Vec<Interval> = Vec::new();
    let mut contradicted_s = 0.0;
    for (start_s, end_s) in cuts.iter().copied().zip(cuts.iter().copied().skip(1)) {
        present.retain(|interval| interval.end_s > start_s);
        while let Some(next) = coming.next_if(|next| next.start_s <= start_s) {
            if present.len() == MAX_AT_ONCE {
                return Err((
                    next.place,
                    format!("more than {MAX_AT_ONCE} labels for one time, at {} s", ShortNumber(start_s)),
                ));
            }
            present.push(next);
        }
        let Some(first) = present.first() else { continue };
        if present.iter().any(|other| other.name != first.name) {
            contradicted_s += end_s - start_s;
            continue;
        }
        match apart.last_mut() {
            Some(last) if last.place == first.place && last.end_s >= start_s => last.end_s = end_s,
            _ => apart.push(Interval { start_s, end_s, ..first.clone() }),
        }
    }
    drop(coming);
    *intervals = apart;
    Ok(contradicted_s)
}
