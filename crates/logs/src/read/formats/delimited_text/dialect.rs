//! The dialect of a delimited text: what delimits its cells, what marks comments, and the decimal point of its numbers.

use crate::read::date_time::date_time;
use crate::read::table::number;
use std::borrow::Cow;

/// The dialect of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Dialect {
    pub delimiter: u8,
    /// A run of blanks is one delimiter, and quotes have no meaning. The text is read with one tab in the place of each run.
    pub blanks: bool,
    /// The first byte of comment lines.
    pub comment: Option<u8>,
}

impl Dialect {
    /// Comma separated values without comments.
    pub const COMMA: Self = Self { delimiter: b',', blanks: false, comment: None };

    /// Detects the dialect by the first line that is not a comment.
    pub fn detect(line: &str, comment: Option<u8>) -> Self {
        let of = |delimiter: u8| Self { delimiter, blanks: false, comment };
        let blanks = Self { delimiter: b'\t', blanks: true, comment };
        let count = |delimiter: &u8| unquoted(line).filter(|letter| *letter == char::from(*delimiter)).count();
        // Numbers with a decimal comma have more commas than delimiters.
        let decimal =
            [b';', b'\t'].into_iter().find(|delimiter| count(delimiter) > 0 && of(*delimiter).has_numbers(line));
        let most = [b',', b';', b'\t'].into_iter().rev().max_by_key(count).unwrap_or(b',');
        let delimiter = decimal.unwrap_or(most);
        // Numbers between blanks may have a surplus tab; a title may contain a blank.
        let is_blank = match count(&delimiter) {
            0 => line.trim().contains([' ', '\t']),
            _ => delimiter == b'\t' && blanks.has_numbers(line),
        };
        if is_blank { blanks } else { of(delimiter) }
    }

    /// Whether a line has numbers only.
    pub fn has_numbers(self, line: &str) -> bool {
        let line = self.with_points(line);
        let is_delimiter = |letter: char| match self.blanks {
            true => letter == ' ' || letter == '\t',
            false => letter == char::from(self.delimiter),
        };
        let mut cells = line.split(is_delimiter).filter(|cell| !cell.trim().is_empty()).peekable();
        cells.peek().is_some() && cells.all(|cell| number(cell).is_some())
    }

    /// Splits a line that is not read as a record: a comment, or a line above the header.
    pub fn split(self, line: &str) -> Vec<&str> {
        if self.blanks { line.split_whitespace().collect() } else { line.split(char::from(self.delimiter)).collect() }
    }

    /// Returns the number in a cell.
    pub fn number(self, cell: &[u8]) -> Option<f64> {
        if let Some(value) = fast_float2::parse(cell).ok().filter(|value: &f64| value.is_finite()) {
            return Some(value);
        }
        number(&self.with_points(std::str::from_utf8(cell).ok()?))
    }

    /// Returns the time in a cell, s: a number times a factor, or a date.
    pub fn time(self, cell: &[u8], to_seconds: f64) -> Option<f64> {
        let date = || date_time(std::str::from_utf8(cell).ok()?);
        self.number(cell).map(|value| value * to_seconds).or_else(date)
    }

    /// Replaces decimal commas. A comma that delimits cells is not one.
    fn with_points(self, text: &str) -> Cow<'_, str> {
        if self.delimiter != b',' && text.contains(',') { text.replace(',', ".").into() } else { text.into() }
    }
}

/// The letters of a line that are not between quotes.
fn unquoted(line: &str) -> impl Iterator<Item = char> {
    let mut quoted = false;
    line.chars().filter(move |letter| {
        quoted ^= *letter == '"';
        !quoted
    })
}
