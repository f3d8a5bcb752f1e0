//! Faults of rows: the first fault of a row with its place, and whether the row is the last one and cut short.

use super::records::Records;
use crate::read::date_time;
use crate::read::table::{MAX_CELL, column_place, shown};
use std::borrow::Cow;
use teachtree_base::error::InputError;

/// What is expected in a column of stamps.
pub(super) const TIME: &str = "a time";

/// The names of a file and its columns, for places in messages.
pub(super) struct Places {
    pub file: String,
    pub header: Vec<String>,
}

impl Places {
    /// Returns the place of a row. Rows are counted as lines of the file, from 1.
    pub fn row(&self, row: u64) -> String {
        format!("{} row {row}", self.file)
    }

    /// Returns the place of a cell.
    pub fn cell(&self, row: u64, column: usize) -> String {
        column_place(&self.row(row), self.header.get(column).map_or("", String::as_str))
    }
}

/// The first fault that is found in a row.
#[derive(Clone, Copy)]
pub(super) enum RowFault {
    /// The row has too few or too many cells, or a cell that contains the end of a line.
    Form,
    /// A cell is longer than [`MAX_CELL`].
    Long { column: usize },
    /// A cell has another value than expected.
    Unexpected { column: usize, expected: &'static str },
}

/// A row that cannot be read.
pub(super) struct Fault {
    pub error: Box<InputError>,
    /// Set if no row follows and the row may be the beginning of a whole one.
    pub cut: Option<TruncatedRow>,
}

/// A row that is cut short.
pub(super) struct TruncatedRow {
    /// The row.
    pub row: u64,
    /// Number of its cells.
    pub cells: usize,
}

impl Fault {
    /// Returns the fault of a row; `records` is at its first cell. A fault of the form is reported before those of cells.
    pub fn new(mut records: Records, fault: RowFault, row: u64, places: &Places) -> Self {
        let cells: Vec<Cow<[u8]>> = records.cells().collect();
        let width = places.header.len();
        let last = cells.last();
        // A surplus delimiter at the end of each row is not a column.
        let is_surplus = cells.len() == width + 1 && last.is_some_and(|cell| cell.is_empty());
        let has_all = cells.len() == width || is_surplus;
        let cell = |column: usize| cells.get(column).map_or(&[][..], |cell| cell);
        let error = match fault {
            _ if records.spans_lines() => {
                let message = "a cell goes on over the end of its line: a quote is opened and not closed";
                InputError::new(places.row(row), message)
            }
            RowFault::Long { column } if has_all => {
                let message = format!("the field has {} bytes, at most {MAX_CELL} are read", cell(column).len());
                InputError::new(places.cell(row, column), message)
            }
            RowFault::Unexpected { column, expected } if has_all => {
                let error = InputError::new(places.cell(row, column), unexpected(cell(column), expected));
                if expected == TIME {
                    date_time::explained(error, &String::from_utf8_lossy(cell(column)))
                } else {
                    error
                }
            }
            _ => {
                let message = format!("found {} fields, expected {width} as in the header", cells.len());
                InputError::new(places.row(row), message)
            }
        };
        let is_in_last = matches!(fault, RowFault::Unexpected { column, .. } if column + 1 == width);
        let is_short = cells.len() < width || cells.len() == width && is_in_last;
        let is_cut = is_short && !records.spans_lines() && !records.advance();
        Self { error: Box::new(error), cut: is_cut.then_some(TruncatedRow { row, cells: cells.len() }) }
    }
}

/// Converts the error of the crate `csv`.
pub fn unreadable(file: &str, error: &::csv::Error) -> InputError {
    let place = error.position().map_or(file.to_string(), |at| format!("{file} row {}", at.line()));
    match error.kind() {
        ::csv::ErrorKind::Io(error) => InputError::unreadable(place, error),
        _ => InputError::new(place, format!("cannot be read: {error}")),
    }
}

/// Returns a cell as text.
///
/// # Errors
/// The cell is not UTF-8.
pub(super) fn text_of(cell: &[u8]) -> Result<&str, String> {
    std::str::from_utf8(cell).map_err(|_| unexpected(cell, "text in UTF-8"))
}

/// Formats the message about a cell that is not what was expected.
fn unexpected(cell: &[u8], expected: &str) -> String {
    format!("found `{}`, expected {expected}", shown(&String::from_utf8_lossy(cell)))
}
