//! One block of lines, read on one core: text in, columns out, with what is wrong with the first row that cannot be read.

use super::super::csv_dialect::Dialect;
use super::super::delimited_text::{cell_shown, text_of, unreadable};
use super::BLOCK;
use crate::read::table::{ColumnRequest, MAX_CELL, column_place, see};
use ::csv::ByteRecord;
use memchr::{memchr, memchr_iter};
use teachtree_base::error::InputError;

/// What is to be read from each line.
pub(super) struct Plan {
    pub file: String,
    pub dialect: Dialect,
    pub header: Vec<String>,
    pub wants: Vec<ColumnRequest>,
    pub rate_hz: Option<f64>,
}

/// The rows of a block of lines.
#[derive(Default)]
pub(super) struct RowBlock {
    pub rows: usize,
    /// How many lines each row is behind the first one; empty where every line is a row.
    pub offsets: Vec<u32>,
    /// The line of the file with which it begins.
    pub line: u64,
    pub stamps: Vec<f64>,
    /// One entry a column of the header, as in a [`Table`].
    pub numbers: Vec<Vec<f64>>,
    pub texts: Vec<Vec<String>>,
    /// What is wrong with the row behind the last one.
    pub fault: Option<Fault>,
}

pub(super) struct Fault {
    pub error: Box<InputError>,
    /// The row, when it is the beginning of a whole one.
    pub cut: Option<TruncatedRow>,
    /// Whether the block has no row after it.
    pub last: bool,
}

impl Plan {
    /// Reads the rows of a block of whole lines.
    pub fn part(&self, text: &[u8], line: u64) -> RowBlock {
        let width = self.header.len();
        let mut part =
            RowBlock { line, numbers: vec![vec![]; width], texts: vec![vec![]; width], ..RowBlock::default() };
        // Rows are mostly as long as the first one.
        let rows = text.len() / (memchr(b'\n', text).unwrap_or(text.len()) + 1) + text.len() / BLOCK;
        for (column, want) in part.numbers.iter_mut().zip(&self.wants) {
            column.reserve(if matches!(want, ColumnRequest::Nothing | ColumnRequest::Text | ColumnRequest::Time(_)) {
                0
            } else {
                rows + rows / 8
            });
        }
        // A carriage return ends a record wherever it stands.
        let plain = memchr(b'"', text).is_none_or(|_| self.dialect.blanks)
            && memchr_iter(b'\r', text).all(|at| text.get(at + 1) == Some(&b'\n'));
        if plain {
            self.lines(text, &mut part)
        } else {
            self.records(text, &mut part)
        }
        part
    }

    /// Lines without quotes.
    fn lines(&self, text: &[u8], part: &mut RowBlock) {
        let mut begins = 0;
        let mut offset = 0;
        while begins < text.len() {
            let here = text.get(begins..).unwrap_or_default();
            let ends = memchr(b'\n', here).unwrap_or(here.len());
            let line = here.get(..ends).unwrap_or_default();
            let line = line.strip_suffix(b"\r").unwrap_or(line);
            begins += ends + 1;
            let is_row = !line.is_empty() && self.dialect.comment.is_none_or(|sign| line.first() != Some(&sign));
            if is_row {
                if !self.row(line, part) {
                    let record: ByteRecord = line.split(|byte| *byte == self.dialect.delimiter).collect();
                    let more = || self.any_row(text.get(begins..).unwrap_or_default());
                    if !self.record(&record, offset, part, more) {
                        return;
                    }
                }
                note(part, offset);
            }
            offset += 1;
        }
    }

    /// Whether a text without quotes has a row.
    fn any_row(&self, text: &[u8]) -> bool {
        text.split(|byte| matches!(byte, b'\n' | b'\r'))
            .any(|line| !line.is_empty() && self.dialect.comment.is_none_or(|sign| line.first() != Some(&sign)))
    }

    /// Lines of any kind.
    fn records(&self, text: &[u8], part: &mut RowBlock) {
        let mut reader = self.dialect.reader(text);
        let mut record = ByteRecord::new();
        let (mut counted, mut offset) = (0, 0);
        loop {
            match reader.read_byte_record(&mut record) {
                Ok(true) => {}
                Ok(false) => return,
                Err(error) => {
                    part.fault =
                        Some(Fault { error: Box::new(unreadable(&self.file, &error)), cut: None, last: false });
                    return;
                }
            }
            // A record begins where the one before ends, behind what is left of its line and lines that are empty.
            let from = record.position().map_or(0, ::csv::Position::byte) as usize;
            let mut begins = from;
            while let Some(byte) = text.get(begins) {
                match byte {
                    b'\n' | b'\r' => begins += 1,
                    byte if Some(*byte) == self.dialect.comment => {
                        begins += memchr(b'\n', text.get(begins..).unwrap_or_default()).map_or(1, |at| at + 1);
                    }
                    _ => break,
                }
            }
            offset += memchr_iter(b'\n', text.get(counted..begins).unwrap_or_default()).count() as u32;
            counted = begins;
            let end = reader.position().byte() as usize;
            let more = || self.any_row(text.get(end..).unwrap_or_default());
            if !self.record(&record, offset, part, more) {
                return;
            }
            note(part, offset);
        }
    }

    /// Reads a row of plain cells; whether it is one. Otherwise nothing of it is kept.
    fn row(&self, line: &[u8], part: &mut RowBlock) -> bool {
        let taken = self.cells(line, part);
        if taken.is_none() {
            part.forget(part.rows);
        }
        taken.is_some()
    }

    fn cells(&self, line: &[u8], part: &mut RowBlock) -> Option<()> {
        let delimiter = self.dialect.delimiter;
        // Where the next cell begins; behind the end of the line when there is none.
        let mut begins = 0;
        let columns = part.numbers.iter_mut().zip(&mut part.texts);
        for (want, (numbers, texts)) in self.wants.iter().zip(columns) {
            let mut here = line.get(begins..)?;
            let to_si = match want {
                ColumnRequest::Number(to_si) | ColumnRequest::Optional(to_si) | ColumnRequest::Time(to_si) => *to_si,
                ColumnRequest::Sniff => 1.0,
                ColumnRequest::Nothing | ColumnRequest::Text => {
                    let length = memchr(delimiter, here).unwrap_or(here.len());
                    if *want == ColumnRequest::Text {
                        let cell = here.get(..length).filter(|cell| cell.len() <= MAX_CELL)?;
                        texts.push(std::str::from_utf8(cell).ok()?.trim().to_string());
                    }
                    begins += length + 1;
                    continue;
                }
            };
            while let Some((b' ', behind)) = here.split_first() {
                (here, begins) = (behind, begins + 1);
            }
            let (value, length) = match fast_float2::parse_partial::<f64, _>(here) {
                Ok((value, length)) if here.get(length).is_none_or(|byte| *byte == delimiter) => (value, length),
                _ => {
                    let length = memchr(delimiter, here).unwrap_or(here.len());
                    let cell = here.get(..length)?;
                    if let ColumnRequest::Sniff = want
                        && self.dialect.number(cell).is_none()
                    {
                        see(texts, &String::from_utf8_lossy(cell));
                    }
                    match (self.dialect.number(cell), want) {
                        (Some(value), _) => (value, length),
                        (None, ColumnRequest::Optional(_) | ColumnRequest::Sniff) => (f64::NAN, length),
                        (None, _) => return None,
                    }
                }
            };
            if length > MAX_CELL {
                return None;
            }
            let value = if value.is_finite() { value * to_si } else { f64::NAN };
            match want {
                ColumnRequest::Time(_) if value.is_finite() => part.stamps.push(value),
                ColumnRequest::Time(_) => return None,
                _ => numbers.push(value),
            }
            begins += length + 1;
        }
        let timed = part.stamps.len() > part.rows || self.rate_hz.is_some();
        // A delimiter too many at the end of each row is no column.
        (timed && (begins == line.len() + 1 || begins == line.len())).then_some(())
    }

    /// Reads any row; whether it is one, else the fault is noted. Every cell is checked before any is kept, so that a row is taken whole or
    /// not at all.
    fn record(&self, record: &ByteRecord, offset: u32, part: &mut RowBlock, more: impl Fn() -> bool) -> bool {
        let row = part.line + u64::from(offset);
        match self.check(record, row) {
            Ok(stamp) => {
                self.keep(record, stamp, part);
                true
            }
            Err(error) => {
                let cut = self.is_cut(record).then(|| TruncatedRow { line: row, cells: record.len() });
                part.fault = Some(Fault { error: Box::new(error), cut, last: !more() });
                false
            }
        }
    }

    fn keep(&self, record: &ByteRecord, stamp: Option<f64>, part: &mut RowBlock) {
        part.stamps.extend(stamp);
        let columns = part.numbers.iter_mut().zip(&mut part.texts);
        for ((cell, want), (numbers, texts)) in record.iter().zip(&self.wants).zip(columns) {
            match want {
                ColumnRequest::Nothing | ColumnRequest::Time(_) => {}
                ColumnRequest::Number(to_si) | ColumnRequest::Optional(to_si) => {
                    numbers.push(self.dialect.number(cell).unwrap_or(f64::NAN) * to_si);
                }
                ColumnRequest::Sniff => {
                    let value = self.dialect.number(cell);
                    numbers.push(value.unwrap_or(f64::NAN));
                    if value.is_none() {
                        see(texts, &String::from_utf8_lossy(cell));
                    }
                }
                ColumnRequest::Text => texts.push(text_of(cell).unwrap_or_default().trim().to_string()),
            }
        }
    }

    /// The place of a cell in messages.
    fn place(&self, row: u64, column: usize) -> String {
        column_place(&format!("{} row {row}", self.file), self.header.get(column).map_or("", String::as_str))
    }

    /// Whether a row may be the beginning of a whole one: too short, or as long and wrong in its last cell only.
    fn is_cut(&self, record: &ByteRecord) -> bool {
        let width = self.header.len();
        // What swallowed the rows behind it is no row that was being written.
        if spans_lines(record) {
            return false;
        }
        record.len() < width
            || (record.len() == width && record.iter().next_back().and_then(|cell| self.dialect.number(cell)).is_none())
    }

    /// Checks every cell of a row; its time, where that stands in a column.
    fn check(&self, record: &ByteRecord, row: u64) -> Result<Option<f64>, InputError> {
        if spans_lines(record) {
            let message = "a cell goes on over the end of its line: a quote is opened and not closed";
            return Err(InputError::new(format!("{} row {row}", self.file), message));
        }
        // A delimiter too many at the end of each row is no column.
        let width = self.header.len();
        let surplus = record.len() == width + 1 && record.iter().next_back().is_some_and(<[u8]>::is_empty);
        if record.len() != width && !surplus {
            let message = format!("found {} fields, expected {width} as in the header", record.len());
            return Err(InputError::new(format!("{} row {row}", self.file), message));
        }
        let mut stamp = None;
        for (column, (cell, want)) in record.iter().zip(&self.wants).enumerate() {
            let wrong = |message: String| InputError::new(self.place(row, column), message);
            if *want != ColumnRequest::Nothing && cell.len() > MAX_CELL {
                return Err(wrong(format!("the field has {} bytes, at most {MAX_CELL} are read", cell.len())));
            }
            match want {
                ColumnRequest::Nothing | ColumnRequest::Optional(_) | ColumnRequest::Sniff => {}
                ColumnRequest::Text => {
                    text_of(cell).map_err(wrong)?;
                }
                ColumnRequest::Time(to_seconds) => match self.dialect.time(cell, *to_seconds) {
                    Some(seconds) if seconds.is_finite() => stamp = Some(seconds),
                    _ => return Err(wrong(format!("found `{}`, expected a time", cell_shown(cell)))),
                },
                ColumnRequest::Number(_) => {
                    self.dialect
                        .number(cell)
                        .ok_or_else(|| wrong(format!("found `{}`, expected a number", cell_shown(cell))))?;
                }
            }
        }
        if stamp.is_none() && self.rate_hz.is_none() {
            return Err(InputError::new(&self.file, "no column holds the time"));
        }
        Ok(stamp)
    }
}

impl RowBlock {
    /// Forgets what was kept of the row behind these.
    fn forget(&mut self, rows: usize) {
        self.stamps.truncate(rows);
        self.numbers.iter_mut().for_each(|column| column.truncate(rows));
        self.texts.iter_mut().for_each(|column| column.truncate(rows));
    }
}

/// Notes that a row was kept that is this many lines behind the first one.
fn note(part: &mut RowBlock, offset: u32) {
    if part.offsets.is_empty() && offset as usize != part.rows {
        part.offsets = (0..part.rows as u32).collect();
    }
    part.rows += 1;
    if !part.offsets.is_empty() || offset as usize != part.rows - 1 {
        part.offsets.push(offset);
    }
}

/// Whether a cell holds the end of a line: no number or name of a log does.
fn spans_lines(record: &ByteRecord) -> bool {
    record.iter().any(|cell| cell.contains(&b'\n'))
}

/// A row that is cut short: its line, how many cells it has.
pub(super) struct TruncatedRow {
    pub line: u64,
    pub cells: usize,
}
