//! Delimited text as a table of columns on one time base: bytes in, numbers and texts out. What the columns mean is not known here.
//!
//! Rows are counted as lines of the file, the header being row 1. A row that repeats the stamp before it is dropped, a last row
//! that was cut short is dropped, both are told; time that runs backwards and a cell that is no number end the reading with their place.

use super::frames::Issue;
use super::names;
use crate::base::error::InputError;
use ::csv::{ByteRecord, ReaderBuilder};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

/// The most columns that are read.
pub const MAX_COLUMNS: usize = 10_000;
/// The longest cell that is read, in bytes.
pub const MAX_CELL: usize = 64 * 1024;

/// A table whose header has been read.
pub struct Source {
    /// The name of the file in messages.
    pub file: String,
    /// The header as it stands there, trimmed.
    pub header: Vec<String>,
    reader: ::csv::Reader<Box<dyn Read>>,
}

/// What to make of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Want {
    /// Leave it out.
    Nothing,
    /// The time stamps; the factor makes them seconds.
    Time(f64),
    /// Numbers; the factor makes them SI. An empty cell is NaN, a text is an error.
    Number(f64),
    /// Numbers of a column that nobody may ask for: a text is NaN.
    Perhaps(f64),
    /// Text.
    Text,
}

/// The rows of a table.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Time stamps, s, strictly rising.
    pub time: Vec<f64>,
    /// The stamp of each row of the file, s, also of those that repeat one: what a row number in another file means.
    pub row_time: Vec<f64>,
    /// One entry a column of the header; empty unless a number was wanted.
    pub numbers: Vec<Vec<f64>>,
    /// One entry a column of the header; empty unless text was wanted.
    pub texts: Vec<Vec<String>>,
    /// What was dropped.
    pub issues: Vec<Issue>,
}

/// Opens a file of comma-separated values, or of tab-separated ones when its name ends in `.tsv`.
///
/// # Errors
/// When the file cannot be read, is empty, or has a header that is no text.
pub fn open(path: &Path) -> Result<Source, InputError> {
    let file = path.display().to_string();
    let bytes = File::open(path).map_err(|error| InputError::unreadable(&file, &error))?;
    let delimiter = if path.extension().is_some_and(|end| end.eq_ignore_ascii_case("tsv")) { b'\t' } else { b',' };
    Source::new(Box::new(BufReader::new(bytes)), file, delimiter)
}

impl Source {
    /// Reads the header.
    ///
    /// # Errors
    /// When there is none, or it is no text.
    pub fn new(bytes: Box<dyn Read>, file: impl Into<String>, delimiter: u8) -> Result<Self, InputError> {
        let file = file.into();
        let mut reader = ReaderBuilder::new().has_headers(false).flexible(true).delimiter(delimiter).from_reader(bytes);
        let mut record = ByteRecord::new();
        if !reader.read_byte_record(&mut record).map_err(|error| unreadable(&file, &error))? {
            return Err(InputError::new(&file, "the file is empty, wanted a header and rows"));
        }
        if record.len() > MAX_COLUMNS {
            let found = record.len();
            return Err(InputError::new(
                format!("{file} row 1"),
                format!("found {found} columns, at most {MAX_COLUMNS} are read"),
            ));
        }
        let mut header = Vec::with_capacity(record.len());
        for (column, cell) in record.iter().enumerate() {
            let cell =
                text_of(cell).map_err(|found| InputError::new(format!("{file} row 1 column {}", column + 1), found))?;
            header.push(cell.trim_start_matches('\u{feff}').trim().to_string());
        }
        Ok(Self { file, header, reader })
    }

    /// The place of a cell in messages.
    fn place(&self, row: u64, column: usize) -> String {
        let (name, _) = names::split_unit(self.header.get(column).map_or("", String::as_str));
        format!("{} row {row} column {name}", self.file)
    }

    /// Reads the rows, taking of each column what is wanted of it; exactly one `Want::Time` is needed.
    ///
    /// # Errors
    /// At the first row that cannot be read as it should: its place, what was found, what was wanted.
    pub fn read(mut self, wants: &[Want]) -> Result<Table, InputError> {
        let width = self.header.len();
        let mut rows = Rows {
            table: Table { numbers: vec![vec![]; width], texts: vec![vec![]; width], ..Table::default() },
            ..Rows::default()
        };
        let (mut record, mut next) = (ByteRecord::new(), ByteRecord::new());
        let mut more = self.advance(&mut record)?;
        if !more {
            return Err(InputError::new(&self.file, "the file has a header and no rows"));
        }
        while more {
            more = self.advance(&mut next)?;
            let row = record.position().map_or(0, ::csv::Position::line);
            match self.check(&record, row, wants) {
                Ok(time) => rows.push(&record, row, time, wants).map_err(|stamps| {
                    InputError::new(
                        self.place(row, time.column),
                        format!("time runs backwards: {} s after {} s", stamps.1, stamps.0),
                    )
                })?,
                // Only the last row can be the one that was being written when the recording stopped.
                Err(_) if !more && self.is_cut(&record) => rows.cut(row, record.len(), width),
                Err(error) => return Err(error),
            }
            std::mem::swap(&mut record, &mut next);
        }
        rows.finish(&self.file)
    }

    fn advance(&mut self, record: &mut ByteRecord) -> Result<bool, InputError> {
        self.reader.read_byte_record(record).map_err(|error| unreadable(&self.file, &error))
    }

    /// Whether a row may be the beginning of a whole one: too short, or as long and wrong in its last cell only.
    fn is_cut(&self, record: &ByteRecord) -> bool {
        // What swallowed the rows behind it is no row that was being written.
        if spans_lines(record) {
            return false;
        }
        record.len() < self.header.len()
            || (record.len() == self.header.len() && record.iter().next_back().and_then(number).is_none())
    }

    /// Checks every cell of a row before any is stored, so that a row is taken whole or not at all.
    fn check(&self, record: &ByteRecord, row: u64, wants: &[Want]) -> Result<Stamp, InputError> {
        if spans_lines(record) {
            let message = "a cell goes on over the end of its line: a quote is opened and not closed";
            return Err(InputError::new(format!("{} row {row}", self.file), message));
        }
        if record.len() != self.header.len() {
            let message = format!("found {} fields, wanted {} as in the header", record.len(), self.header.len());
            return Err(InputError::new(format!("{} row {row}", self.file), message));
        }
        let mut stamp = None;
        for (column, (cell, want)) in record.iter().zip(wants).enumerate() {
            if *want != Want::Nothing && cell.len() > MAX_CELL {
                return Err(InputError::new(
                    self.place(row, column),
                    format!("the field has {} bytes, at most {MAX_CELL} are read", cell.len()),
                ));
            }
            match want {
                Want::Nothing | Want::Perhaps(_) => {}
                Want::Text => {
                    text_of(cell).map_err(|found| InputError::new(self.place(row, column), found))?;
                }
                Want::Time(to_seconds) => match number(cell).map(|value| value * to_seconds) {
                    Some(seconds) if seconds.is_finite() => stamp = Some(Stamp { seconds, column }),
                    _ => {
                        return Err(InputError::new(
                            self.place(row, column),
                            format!("found `{}`, wanted a time", shown(cell)),
                        ));
                    }
                },
                Want::Number(_) => {
                    number(cell).ok_or_else(|| {
                        InputError::new(self.place(row, column), format!("found `{}`, wanted a number", shown(cell)))
                    })?;
                }
            }
        }
        stamp.ok_or_else(|| InputError::new(&self.file, "no column holds the time"))
    }
}

/// The time of a row and where it stands.
#[derive(Clone, Copy)]
struct Stamp {
    seconds: f64,
    column: usize,
}

/// The rows so far.
#[derive(Default)]
struct Rows {
    table: Table,
    /// How many rows repeat a stamp, the first of them, and the stamps of the first and the last.
    repeated: Option<(usize, u64, f64, f64)>,
}

impl Rows {
    /// Stores a checked row; the error is the pair of stamps that run backwards.
    fn push(&mut self, record: &ByteRecord, row: u64, time: Stamp, wants: &[Want]) -> Result<(), (f64, f64)> {
        if let Some(&last) = self.table.time.last() {
            if time.seconds < last {
                return Err((last, time.seconds));
            }
            if time.seconds <= last {
                self.table.row_time.push(last);
                let (count, first_row, start, _) = self.repeated.unwrap_or((0, row, last, last));
                self.repeated = Some((count + 1, first_row, start, last));
                return Ok(());
            }
        }
        self.table.time.push(time.seconds);
        self.table.row_time.push(time.seconds);
        let columns = self.table.numbers.iter_mut().zip(&mut self.table.texts);
        for ((cell, want), (numbers, texts)) in record.iter().zip(wants).zip(columns) {
            match want {
                Want::Nothing | Want::Time(_) => {}
                Want::Number(to_si) | Want::Perhaps(to_si) => numbers.push(number(cell).unwrap_or(f64::NAN) * to_si),
                Want::Text => texts.push(text_of(cell).unwrap_or_default().trim().to_string()),
            }
        }
        Ok(())
    }

    fn cut(&mut self, row: u64, found: usize, wanted: usize) {
        let at = self.table.time.last().copied().unwrap_or_default();
        let message = format!("row {row}, the last one, is cut short ({found} of {wanted} fields); it is left out");
        self.table.issues.push(Issue {
            kind: "truncated".into(),
            start_s: at,
            end_s: at,
            channel: String::new(),
            message,
        });
    }

    fn finish(mut self, file: &str) -> Result<Table, InputError> {
        if self.table.time.is_empty() {
            return Err(InputError::new(file, "the file has no whole row"));
        }
        if let (1, Some((count, ..))) = (self.table.time.len(), self.repeated) {
            let message = format!("all {} rows have the same time stamp", count + 1);
            return Err(
                InputError::new(file, message).help("stamps need more digits than the step between rows is long")
            );
        }
        if let Some((count, row, start_s, end_s)) = self.repeated {
            let rows = if count == 1 { "row repeats" } else { "rows repeat" };
            let message = format!(
                "{count} {rows} the time stamp of the row before, first in row {row}; the first of equal stamps is kept"
            );
            self.table.issues.push(Issue {
                kind: "duplicate_stamp".into(),
                start_s,
                end_s,
                channel: String::new(),
                message,
            });
        }
        Ok(self.table)
    }
}

/// What keeps delimited text from being read.
pub(super) fn unreadable(file: &str, error: &::csv::Error) -> InputError {
    let place = error.position().map_or(file.to_string(), |at| format!("{file} row {}", at.line()));
    match error.kind() {
        ::csv::ErrorKind::Io(error) => InputError::unreadable(place, error),
        _ => InputError::new(place, format!("cannot be read: {error}")),
    }
}

fn text_of(cell: &[u8]) -> Result<&str, String> {
    std::str::from_utf8(cell).map_err(|_| format!("found `{}`, wanted text in UTF-8", shown(cell)))
}

/// The number in a cell: NaN for an empty one, for `nan` and for an infinity; true is 1 and false 0.
fn number(cell: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(cell).ok()?.trim();
    match text {
        "" => Some(f64::NAN),
        "true" | "True" | "TRUE" => Some(1.0),
        "false" | "False" | "FALSE" => Some(0.0),
        _ => text.parse::<f64>().ok().map(|value| if value.is_finite() { value } else { f64::NAN }),
    }
}

/// The beginning of a cell, for a message.
fn shown(cell: &[u8]) -> String {
    let text = String::from_utf8_lossy(cell);
    let mut head: String = text.chars().take(40).collect();
    if head.len() < text.len() {
        head.push('…');
    }
    head
}

/// Whether a cell holds the end of a line: no number or name of a log does.
fn spans_lines(record: &ByteRecord) -> bool {
    record.iter().any(|cell| cell.contains(&b'\n'))
}
