//! Delimited text: comma, semicolon or tab separated values, and tables whose columns are set apart by blanks.
//!
//! The first line decides which. A first line of numbers only is no header: the columns are then called `1`, `2`, … A header may stand in
//! a comment line (`#` or `%`) above the numbers. Lines about the recording may stand before the header, and units below it. Rows are counted as lines of the file, the header being row 1. A row that repeats the
//! stamp before it is dropped, a last row that was cut short is dropped, both are reported; time that runs backwards and a cell that is no
//! number end the reading with their place.

use super::csv_dialect::{Dialect, Preamble, dialect, emptied, preamble, with_units};
use super::lines::Lines;
use crate::read::memory_table::titled;
use crate::read::table::{MAX_COLUMNS, Source, date_time, number, shown};
use ::csv::{ByteRecord, ReaderBuilder};
use std::borrow::Cow;
use std::io::{Cursor, Read};
use teachtree_base::error::InputError;

/// How much of a file is looked at to learn its form, in bytes.
const HEAD: u64 = 256 * 1024;

/// Reads the head of a delimited text.
///
/// # Errors
/// When the file cannot be read, is empty, or has a header that is no text.
pub fn source(mut bytes: Box<dyn Read + Send>, file: impl Into<String>) -> Result<Source, InputError> {
    let file = file.into();
    let mut head = vec![];
    bytes.by_ref().take(HEAD).read_to_end(&mut head).map_err(|error| InputError::unreadable(&file, &error))?;
    if head.starts_with(&[0xff, 0xfe]) || head.starts_with(&[0xfe, 0xff]) {
        return Err(InputError::new(&file, "found text in UTF-16, expected UTF-8").help("save it as UTF-8"));
    }
    let Preamble { lines, units } = preamble(&head);
    let unit_line = units.as_ref().map(|(line, _)| *line);
    if lines > 0 || unit_line.is_some() {
        head = emptied(&head, |line| line < lines || Some(line) == unit_line);
    }
    let (dialect, above) = dialect(&head);
    let bytes: Box<dyn Read + Send> = Box::new(Cursor::new(head).chain(bytes));
    let mut text: Box<dyn Read + Send> = if dialect.blanks { Box::new(TabbedReader::new(bytes)) } else { bytes };
    let (mut front, first, end) = first_record(dialect, &mut text, &file)?;
    let row = first.position().map_or(1, ::csv::Position::line);
    let header_place = format!("{file} row {row}");
    if first.len() > MAX_COLUMNS {
        let found = first.len();
        return Err(InputError::new(header_place, format!("found {found} columns, at most {MAX_COLUMNS} are read")));
    }
    let mut header = Vec::with_capacity(first.len());
    for (column, cell) in first.iter().enumerate() {
        let cell =
            text_of(cell).map_err(|found| InputError::new(format!("{header_place} column {}", column + 1), found))?;
        header.push(cell.trim_start_matches('\u{feff}').trim().to_string());
    }
    if dialect.titled {
        header = if dialect.blanks { with_units(header) } else { header };
        if let Some((_, units)) = units.filter(|(_, units)| units.len() == header.len()) {
            header = header.iter().zip(units).map(|(title, unit)| titled(title, &unit)).collect();
        }
    } else {
        header = match above {
            Some(above) if above.len() == header.len() => above,
            _ => (1..=header.len()).map(|column| column.to_string()).collect(),
        };
    }
    let before = if dialect.titled { front.drain(..end).filter(|byte| *byte == b'\n').count() } else { 0 };
    let rows = Lines::new(file.clone(), dialect, Box::new(Cursor::new(front).chain(text)), before as u64 + 1);
    Ok(Source { header_place, ..Source::one(file, header, Box::new(rows)) })
}

/// Reads as far as the first record goes: what was read, the record, and where it ends.
fn first_record(dialect: Dialect, text: &mut dyn Read, file: &str) -> Result<(Vec<u8>, ByteRecord, usize), InputError> {
    let mut front = vec![];
    let mut more = HEAD;
    loop {
        let read = text.take(more).read_to_end(&mut front).map_err(|error| InputError::unreadable(file, &error))?;
        let mut reader = dialect.reader(front.as_slice());
        let mut first = ByteRecord::new();
        let found = reader.read_byte_record(&mut first).map_err(|error| unreadable(file, &error))?;
        let end = usize::try_from(reader.position().byte()).unwrap_or(usize::MAX).min(front.len());
        let whole = (read as u64) < more;
        match found {
            true if whole || end < front.len() => return Ok((front, first, end)),
            false if whole => return Err(InputError::new(file, "the file is empty, expected a header and rows")),
            _ => more *= 2,
        }
    }
}

impl Dialect {
    /// A reader of records. Blanks are squeezed already.
    pub(super) fn reader(self, bytes: &[u8]) -> ::csv::Reader<&[u8]> {
        ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .delimiter(self.delimiter)
            .comment(self.comment)
            .quoting(!self.blanks)
            .from_reader(bytes)
    }

    /// The time in a cell, s: a number times a factor, or a date.
    pub(super) fn time(self, cell: &[u8], to_seconds: f64) -> Option<f64> {
        let date = || date_time(std::str::from_utf8(cell).ok()?);
        self.number(cell).map(|value| value * to_seconds).or_else(date)
    }

    /// The number in a cell; where commas do not delimit, they may be the decimal point.
    pub(super) fn number(self, cell: &[u8]) -> Option<f64> {
        let text = std::str::from_utf8(cell).ok()?;
        let text = if self.delimiter != b',' && text.contains(',') {
            Cow::Owned(text.replace(',', "."))
        } else {
            Cow::Borrowed(text)
        };
        number(&text)
    }
}

/// A text with every run of blanks as one tab, none at the ends of lines.
struct TabbedReader<R> {
    bytes: std::io::BufReader<R>,
    /// Blanks were passed over since the last letter of the line.
    gap: bool,
    /// The line has a letter already.
    begun: bool,
}

impl<R: Read> TabbedReader<R> {
    fn new(bytes: R) -> Self {
        Self { bytes: std::io::BufReader::new(bytes), gap: false, begun: false }
    }
}

impl<R: Read> Read for TabbedReader<R> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        use std::io::BufRead as _;
        let mut written = 0;
        // Nothing written is the end to whoever reads, so that even a single place is filled while there is text.
        while written == 0 && !out.is_empty() {
            let chunk = self.bytes.fill_buf()?;
            if chunk.is_empty() {
                break;
            }
            let mut used = 0;
            while let (Some(slot), Some(byte)) = (out.get_mut(written), chunk.get(used)) {
                let line_ends = matches!(byte, b'\n' | b'\r');
                match byte {
                    b' ' | b'\t' => (self.gap, used) = (true, used + 1),
                    // The tab before a letter; the letter itself comes next.
                    _ if self.gap && self.begun && !line_ends => {
                        (*slot, self.gap, written) = (b'\t', false, written + 1);
                    }
                    byte => {
                        (*slot, self.gap, self.begun) = (*byte, false, !line_ends);
                        (used, written) = (used + 1, written + 1);
                    }
                }
            }
            self.bytes.consume(used);
        }
        Ok(written)
    }
}

/// What keeps delimited text from being read.
pub fn unreadable(file: &str, error: &::csv::Error) -> InputError {
    let place = error.position().map_or(file.to_string(), |at| format!("{file} row {}", at.line()));
    match error.kind() {
        ::csv::ErrorKind::Io(error) => InputError::unreadable(place, error),
        _ => InputError::new(place, format!("cannot be read: {error}")),
    }
}

/// A cell as text.
///
/// # Errors
/// When it is no UTF-8, what is to be said about it.
pub(super) fn text_of(cell: &[u8]) -> Result<&str, String> {
    std::str::from_utf8(cell).map_err(|_| format!("found `{}`, expected text in UTF-8", cell_shown(cell)))
}

/// The beginning of a cell, for a message.
pub(super) fn cell_shown(cell: &[u8]) -> String {
    shown(&String::from_utf8_lossy(cell))
}
