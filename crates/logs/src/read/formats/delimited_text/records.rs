//! Records and cells of a delimited text, read where they stand in the text (RFC 4180).
//!
//! A record ends at a line feed or a carriage return. Empty lines and comments are not records. A cell in quotes may contain delimiters, ends of lines,
//! and quotes, which are doubled; text after its closing quote is part of the cell. Quotes within a cell that does not begin with one are text.

use super::dialect::Dialect;
use crate::read::table::MAX_CELL;
use memchr::{memchr, memchr_iter, memchr2, memchr3};
use std::borrow::Cow;

/// A position in a text whose records are read in order. A copy reads the same cells again.
#[derive(Clone, Copy)]
pub(super) struct Records<'a> {
    text: &'a [u8],
    dialect: Dialect,
    /// The beginning of the next cell, or the end of the record.
    at: usize,
    /// Whether the record has another cell.
    has_cell: bool,
    /// Number of lines before the record.
    line: usize,
    /// Number of line feeds in the cells of the record.
    line_feeds: usize,
}

impl<'a> Records<'a> {
    /// Begins before the first record.
    pub fn new(text: &'a [u8], dialect: Dialect) -> Self {
        Self { text, dialect, at: 0, has_cell: false, line: 0, line_feeds: 0 }
    }

    /// Moves to the next record. Returns whether there is one.
    pub fn advance(&mut self) -> bool {
        self.skip();
        self.line += std::mem::take(&mut self.line_feeds);
        while let Some(byte) = self.text.get(self.at) {
            match byte {
                b'\n' => (self.at, self.line) = (self.at + 1, self.line + 1),
                b'\r' => self.at += 1,
                sign if Some(*sign) == self.dialect.comment => {
                    self.at += memchr(b'\n', self.rest(self.at)).unwrap_or(self.text.len() - self.at);
                }
                _ => {
                    self.has_cell = true;
                    return true;
                }
            }
        }
        false
    }

    /// Reads the next cell if it is a plain number; an infinite one is NaN. Otherwise returns none, and the cell remains the next one.
    #[inline]
    pub fn number(&mut self) -> Option<f64> {
        // The end of a record does not begin a number.
        let mut begins = self.at;
        while self.text.get(begins) == Some(&b' ') {
            begins += 1;
        }
        let (value, length): (f64, usize) = fast_float2::parse_partial(self.text.get(begins..)?).ok()?;
        if length > MAX_CELL {
            return None;
        }
        let ends = begins + length;
        self.has_cell = match self.text.get(ends) {
            Some(byte) if *byte == self.dialect.delimiter => true,
            None | Some(b'\n' | b'\r') => false,
            Some(_) => return None,
        };
        self.at = ends + usize::from(self.has_cell);
        Some(if value.is_finite() { value } else { f64::NAN })
    }

    /// Reads the next cell; none at the end of the record.
    pub fn cell(&mut self) -> Option<Cow<'a, [u8]>> {
        if !self.has_cell {
            return None;
        }
        let is_quoted = self.text.get(self.at) == Some(&b'"') && !self.dialect.blanks;
        let (cell, ends) = if is_quoted {
            self.quoted()
        } else {
            let (cell, ends) = self.plain(self.at);
            (cell.into(), ends)
        };
        self.end(ends);
        Some(cell)
    }

    /// Returns the remaining cells of the record.
    pub fn cells(&mut self) -> impl Iterator<Item = Cow<'a, [u8]>> {
        std::iter::from_fn(|| self.cell())
    }

    /// Skips the remaining cells of the record. Returns their number, and whether the last one is empty.
    #[inline]
    pub fn skip(&mut self) -> (usize, bool) {
        if self.has_cell { self.skip_cells() } else { (0, false) }
    }

    fn skip_cells(&mut self) -> (usize, bool) {
        let rest = self.rest(self.at);
        let length = memchr2(b'\n', b'\r', rest).unwrap_or(rest.len());
        let line = rest.get(..length).unwrap_or_default();
        if !self.dialect.blanks && memchr(b'"', line).is_some() {
            return self.cells().fold((0, false), |(count, _), cell| (count + 1, cell.is_empty()));
        }
        (self.at, self.has_cell) = (self.at + length, false);
        let delimiter = self.dialect.delimiter;
        (memchr_iter(delimiter, line).count() + 1, line.last().is_none_or(|byte| *byte == delimiter))
    }

    /// Whether a cell that was read contains the end of a line.
    pub fn spans_lines(&self) -> bool {
        self.line_feeds > 0
    }

    /// Returns the number of lines before the record.
    pub fn line(&self) -> usize {
        self.line
    }

    /// Returns the position of the next cell, or of the end of the record, in bytes.
    pub fn position(&self) -> usize {
        self.at
    }

    fn rest(&self, at: usize) -> &'a [u8] {
        self.text.get(at..).unwrap_or_default()
    }

    /// Ends a cell before the delimiter or the end of a line at a position.
    fn end(&mut self, at: usize) {
        self.has_cell = self.text.get(at) == Some(&self.dialect.delimiter);
        self.at = at + usize::from(self.has_cell);
    }

    /// The text from a position to the end of the cell.
    fn plain(&self, begins: usize) -> (&'a [u8], usize) {
        let rest = self.rest(begins);
        let length = memchr3(self.dialect.delimiter, b'\n', b'\r', rest).unwrap_or(rest.len());
        (rest.get(..length).unwrap_or_default(), begins + length)
    }

    /// The cell in quotes that begins here. Without a closing quote it reaches to the end of the text.
    fn quoted(&mut self) -> (Cow<'a, [u8]>, usize) {
        let mut cell: Cow<'a, [u8]> = Cow::default();
        let mut at = self.at + 1;
        loop {
            let rest = self.rest(at);
            let length = memchr(b'"', rest).unwrap_or(rest.len());
            let part = rest.get(..length).unwrap_or_default();
            self.line_feeds += memchr_iter(b'\n', part).count();
            append(&mut cell, part);
            at += length + 1;
            match self.text.get(at) {
                Some(b'"') => append(&mut cell, b"\""),
                _ => break,
            }
            at += 1;
        }
        let (behind, ends) = self.plain(at);
        append(&mut cell, behind);
        (cell, ends.min(self.text.len()))
    }
}

/// Appends to a cell, which is copied only if it has several parts.
fn append<'a>(cell: &mut Cow<'a, [u8]>, part: &'a [u8]) {
    if cell.is_empty() {
        *cell = part.into();
    } else if !part.is_empty() {
        cell.to_mut().extend_from_slice(part);
    }
}
