//! Delimited text: comma, semicolon or tab separated values, and tables whose columns are set apart by blanks.
//!
//! The first line decides which. If the first line has only numbers, the columns are called `1`, `2`, … A header may stand in
//! a comment line (`#` or `%`) above the numbers. Lines about the recording may stand before the header, and units below it.
//! If several columns have one title, lines above the titles are parts of their names. Rows are counted as
//! lines of the file, from 1. A row that repeats the stamp before it is dropped, a last row that was cut short is dropped, both are reported;
//! time that runs backwards and a cell that is not a number are errors with a place.

mod blanks;
mod blocks;
mod columns;
mod dialect;
mod faults;
mod groups;
mod heading;
mod rated;
mod records;
mod rows;
pub mod sections;

pub use faults::unreadable;

use crate::read::table::{MAX_COLUMNS, Source};
use blanks::BlanksAsTabs;
use dialect::Dialect;
use faults::text_of;
use heading::Heading;
pub(super) use heading::has_rows;
use records::Records;
use rows::DelimitedRows;
use std::borrow::Cow;
use std::io::{Cursor, Read};
use teachtree_base::error::InputError;

/// Number of bytes of a file that are read to detect its dialect and heading.
pub(super) const HEAD: u64 = 256 * 1024;
const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();

/// Reads the head of a delimited text.
///
/// # Errors
/// When the file cannot be read, is empty, or has a header that is not text.
pub fn source(bytes: Box<dyn Read + Send>, file: impl Into<String>) -> Result<Source, InputError> {
    source_from(bytes, file.into(), 0)
}

/// Reads the head of a part of a file that begins after this number of lines.
fn source_from(mut bytes: Box<dyn Read + Send>, file: String, lines: u64) -> Result<Source, InputError> {
    let mut head = vec![];
    bytes.by_ref().take(HEAD).read_to_end(&mut head).map_err(|error| InputError::unreadable(&file, &error))?;
    if head.starts_with(&[0xff, 0xfe]) || head.starts_with(&[0xfe, 0xff]) {
        return Err(InputError::new(&file, "found text in UTF-16, expected UTF-8").help("save it as UTF-8"));
    }
    if head.starts_with(BYTE_ORDER_MARK) {
        head.drain(..BYTE_ORDER_MARK.len());
    }
    let heading = Heading::read(&mut head);
    let bytes = Cursor::new(head).chain(bytes);
    let mut text: Box<dyn Read + Send> =
        if heading.dialect.blanks { Box::new(BlanksAsTabs::new(bytes)) } else { Box::new(bytes) };
    let mut first = FirstRecord::read(heading.dialect, &mut text, &file)?;
    let header_place = format!("{file} row {}", first.row as u64 + lines);
    let header = heading.titles(first.titles(&header_place)?);
    // Without titles, the first record is a row.
    let line = lines + if heading.is_titled { first.skip() } else { 1 };
    let text = Box::new(Cursor::new(first.text).chain(text));
    let rows = DelimitedRows { file: file.clone(), dialect: heading.dialect, text, line };
    Ok(Source { header_place, ..Source::one(file, header, Box::new(rows)) })
}

/// The first record of a text.
struct FirstRecord {
    dialect: Dialect,
    /// The beginning of the text, with the whole record.
    text: Vec<u8>,
    /// The line of the file with which the record begins.
    row: usize,
}

impl FirstRecord {
    /// Reads a text up to the end of the first record or further.
    fn read(dialect: Dialect, rest: &mut dyn Read, file: &str) -> Result<Self, InputError> {
        let mut text = vec![];
        let mut size = HEAD;
        loop {
            let read = rest.take(size).read_to_end(&mut text).map_err(|error| InputError::unreadable(file, &error))?;
            let has_ended = (read as u64) < size;
            let mut records = Records::new(&text, dialect);
            let is_found = records.advance();
            let row = records.line() + 1;
            records.skip();
            if is_found && (has_ended || records.position() < text.len()) {
                return Ok(Self { dialect, text, row });
            }
            if has_ended {
                return Err(InputError::new(file, "the file is empty, expected a header and rows"));
            }
            size *= 2;
        }
    }

    /// The record.
    fn records(&self) -> Records<'_> {
        let mut records = Records::new(&self.text, self.dialect);
        records.advance();
        records
    }

    /// Returns the cells as titles of columns.
    fn titles(&self, place: &str) -> Result<Vec<String>, InputError> {
        let (found, _) = self.records().skip();
        if found > MAX_COLUMNS {
            return Err(InputError::new(place, format!("found {found} columns, at most {MAX_COLUMNS} are read")));
        }
        let title = |(cell, column): (Cow<[u8]>, usize)| match text_of(&cell) {
            Ok(title) => Ok(title.trim().to_string()),
            Err(message) => Err(InputError::new(format!("{place} column {column}"), message)),
        };
        self.records().cells().zip(1..).map(title).collect()
    }

    /// Removes the record from the text. Returns the line of the file with which the rest begins.
    fn skip(&mut self) -> u64 {
        let mut records = self.records();
        records.skip();
        let end = records.position();
        self.text.drain(..end).filter(|byte| *byte == b'\n').count() as u64 + 1
    }
}

/// Returns the cells of a line of comma separated values.
///
/// # Errors
/// A cell is not UTF-8, or a carriage return ends the line early.
pub fn cells(line: &[u8]) -> Result<Vec<String>, String> {
    let mut records = Records::new(line.trim_ascii(), Dialect::COMMA);
    records.advance();
    let cells = records.cells().map(|cell| Ok(text_of(&cell)?.trim().to_string())).collect();
    if records.advance() { Err("found a carriage return within the line".into()) } else { cells }
}
