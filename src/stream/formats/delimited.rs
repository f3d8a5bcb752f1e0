//! Delimited text: comma, semicolon or tab separated values, and tables whose columns are set apart by blanks.
//!
//! The first line tells which. A first line of numbers only is no header: the columns are then called `1`, `2`, … A header may stand in
//! a comment line (`#` or `%`) above the numbers. Lines about the recording may stand before the header, and units below it. Rows are counted as lines of the file, the header being row 1. A row that repeats the
//! stamp before it is dropped, a last row that was cut short is dropped, both are told; time that runs backwards and a cell that is no
//! number end the reading with their place.

use super::super::sheet::titled;
use super::super::table::{
    MAX_CELL, MAX_COLUMNS, Rows, Source, Stamps, Table, Want, check_size, column_place, date_time, number, see, shown,
};
use super::heading::{Form, Preamble, emptied, form, preamble, with_units};
use crate::base::error::InputError;
use crate::stream::frames::Issue;
use ::csv::{ByteRecord, ReaderBuilder};
use std::borrow::Cow;
use std::io::{Cursor, Read};

/// How much of a file is looked at to learn its form, in bytes.
const HEAD: u64 = 256 * 1024;

/// Reads the head of a delimited text.
///
/// # Errors
/// When the file cannot be read, is empty, or has a header that is no text.
pub fn source(mut bytes: Box<dyn Read>, file: impl Into<String>) -> Result<Source, InputError> {
    let file = file.into();
    let mut head = vec![];
    bytes.by_ref().take(HEAD).read_to_end(&mut head).map_err(|error| InputError::unreadable(&file, &error))?;
    if head.starts_with(&[0xff, 0xfe]) || head.starts_with(&[0xfe, 0xff]) {
        return Err(InputError::new(&file, "found text in UTF-16, wanted UTF-8").help("save it as UTF-8"));
    }
    let Preamble { lines, units } = preamble(&head);
    let unit_line = units.as_ref().map(|(line, _)| *line);
    if lines > 0 || unit_line.is_some() {
        head = emptied(&head, |line| line < lines || Some(line) == unit_line);
    }
    let (form, above) = form(&head);
    let mut reader = form.reader(Box::new(Cursor::new(head).chain(bytes)));
    let mut first = ByteRecord::new();
    if !reader.read_byte_record(&mut first).map_err(|error| unreadable(&file, &error))? {
        return Err(InputError::new(&file, "the file is empty, wanted a header and rows"));
    }
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
    let mut rows = Delimited { file: file.clone(), reader, form, first: None };
    if form.titled {
        header = if form.blanks { with_units(header) } else { header };
        if let Some((_, units)) = units.filter(|(_, units)| units.len() == header.len()) {
            header = header.iter().zip(units).map(|(title, unit)| titled(title, &unit)).collect();
        }
    } else {
        header = match above {
            Some(above) if above.len() == header.len() => above,
            _ => (1..=header.len()).map(|column| column.to_string()).collect(),
        };
        rows.first = Some(first);
    }
    Ok(Source { header_place, ..Source::one(file, header, Box::new(rows)) })
}

impl Form {
    fn reader(self, bytes: Box<dyn Read>) -> ::csv::Reader<Box<dyn Read>> {
        let bytes: Box<dyn Read> = if self.blanks { Box::new(Squeezed::new(bytes)) } else { bytes };
        ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .delimiter(self.delimiter)
            .comment(self.comment)
            .quoting(!self.blanks)
            .from_reader(bytes)
    }

    /// The time in a cell, s: a number times a factor, or a date.
    fn time(self, cell: &[u8], to_seconds: f64) -> Option<f64> {
        let date = || date_time(std::str::from_utf8(cell).ok()?);
        self.number(cell).map(|value| value * to_seconds).or_else(date)
    }

    /// The number in a cell; where commas do not delimit, they may be the decimal point.
    fn number(self, cell: &[u8]) -> Option<f64> {
        let text = std::str::from_utf8(cell).ok()?;
        let text = if self.delimiter != b',' && text.contains(',') {
            Cow::Owned(text.replace(',', "."))
        } else {
            Cow::Borrowed(text)
        };
        number(&text)
    }
}

/// The rows of a delimited text.
struct Delimited {
    file: String,
    reader: ::csv::Reader<Box<dyn Read>>,
    form: Form,
    /// The first row, when it was read to learn that there is no header.
    first: Option<ByteRecord>,
}

impl Rows for Delimited {
    fn read(mut self: Box<Self>, header: &[String], wants: &[Want], rate_hz: Option<f64>) -> Result<Table, InputError> {
        let width = header.len();
        let mut taken = Taken {
            table: Table { numbers: vec![vec![]; width], texts: vec![vec![]; width], ..Table::default() },
            stamps: Stamps::default(),
        };
        let columns = wants.iter().filter(|want| **want != Want::Nothing).count();
        let (mut record, mut next) = (ByteRecord::new(), ByteRecord::new());
        let mut more = self.advance(&mut record)?;
        if !more {
            return Err(InputError::new(&self.file, "the file has a header and no rows"));
        }
        let mut count = 0_usize;
        while more {
            more = self.advance(&mut next)?;
            let row = record.position().map_or(0, ::csv::Position::line);
            let even = rate_hz.map(|rate| count as f64 / rate);
            count += 1;
            check_size(&self.file, count, columns)?;
            match self.check(&record, row, header, wants, even) {
                Ok(stamp) => {
                    let place = stamp
                        .column
                        .map_or_else(|| format!("{} row {row}", self.file), |column| self.place(row, header, column));
                    taken
                        .push(self.form, &record, row, stamp.seconds, wants)
                        .map_err(|message| InputError::new(place, message))?;
                }
                // Only the last row can be the one that was being written when the recording stopped.
                Err(_) if !more && self.is_cut(&record, width) => taken.cut(row, record.len(), width),
                Err(error) => return Err(error),
            }
            std::mem::swap(&mut record, &mut next);
        }
        taken.finish(&self.file)
    }
}

/// The time of a row and the column where it stands.
#[derive(Clone, Copy)]
struct Stamp {
    seconds: f64,
    column: Option<usize>,
}

impl Delimited {
    /// The place of a cell in messages.
    fn place(&self, row: u64, header: &[String], column: usize) -> String {
        column_place(&format!("{} row {row}", self.file), header.get(column).map_or("", String::as_str))
    }

    fn advance(&mut self, record: &mut ByteRecord) -> Result<bool, InputError> {
        if let Some(first) = self.first.take() {
            *record = first;
            return Ok(true);
        }
        self.reader.read_byte_record(record).map_err(|error| unreadable(&self.file, &error))
    }

    /// Whether a row may be the beginning of a whole one: too short, or as long and wrong in its last cell only.
    fn is_cut(&self, record: &ByteRecord, width: usize) -> bool {
        // What swallowed the rows behind it is no row that was being written.
        if spans_lines(record) {
            return false;
        }
        record.len() < width
            || (record.len() == width && record.iter().next_back().and_then(|cell| self.form.number(cell)).is_none())
    }

    /// Checks every cell of a row before any is stored, so that a row is taken whole or not at all.
    fn check(
        &self,
        record: &ByteRecord,
        row: u64,
        header: &[String],
        wants: &[Want],
        even: Option<f64>,
    ) -> Result<Stamp, InputError> {
        if spans_lines(record) {
            let message = "a cell goes on over the end of its line: a quote is opened and not closed";
            return Err(InputError::new(format!("{} row {row}", self.file), message));
        }
        // A delimiter too many at the end of each row is no column.
        let surplus = record.len() == header.len() + 1 && record.iter().next_back().is_some_and(<[u8]>::is_empty);
        if record.len() != header.len() && !surplus {
            let message = format!("found {} fields, wanted {} as in the header", record.len(), header.len());
            return Err(InputError::new(format!("{} row {row}", self.file), message));
        }
        let mut stamp = even.map(|seconds| Stamp { seconds, column: None });
        for (column, (cell, want)) in record.iter().zip(wants).enumerate() {
            let wrong = |message: String| InputError::new(self.place(row, header, column), message);
            if *want != Want::Nothing && cell.len() > MAX_CELL {
                return Err(wrong(format!("the field has {} bytes, at most {MAX_CELL} are read", cell.len())));
            }
            match want {
                Want::Nothing | Want::Perhaps(_) | Want::Look => {}
                Want::Text => {
                    text_of(cell).map_err(wrong)?;
                }
                Want::Time(to_seconds) => match self.form.time(cell, *to_seconds) {
                    Some(seconds) if seconds.is_finite() => stamp = Some(Stamp { seconds, column: Some(column) }),
                    _ => return Err(wrong(format!("found `{}`, wanted a time", cell_shown(cell)))),
                },
                Want::Number(_) => {
                    self.form
                        .number(cell)
                        .ok_or_else(|| wrong(format!("found `{}`, wanted a number", cell_shown(cell))))?;
                }
            }
        }
        stamp.ok_or_else(|| InputError::new(&self.file, "no column holds the time"))
    }
}

/// The rows so far.
struct Taken {
    table: Table,
    stamps: Stamps,
}

impl Taken {
    /// Stores a checked row; the error says that time runs backwards.
    fn push(&mut self, form: Form, record: &ByteRecord, row: u64, seconds: f64, wants: &[Want]) -> Result<(), String> {
        if !self.stamps.push(seconds, row)? {
            return Ok(());
        }
        let columns = self.table.numbers.iter_mut().zip(&mut self.table.texts);
        for ((cell, want), (numbers, texts)) in record.iter().zip(wants).zip(columns) {
            match want {
                Want::Nothing | Want::Time(_) => {}
                Want::Number(to_si) | Want::Perhaps(to_si) => {
                    numbers.push(form.number(cell).unwrap_or(f64::NAN) * to_si);
                }
                Want::Look => {
                    let value = form.number(cell);
                    numbers.push(value.unwrap_or(f64::NAN));
                    if value.is_none() {
                        see(texts, &String::from_utf8_lossy(cell));
                    }
                }
                Want::Text => texts.push(text_of(cell).unwrap_or_default().trim().to_string()),
            }
        }
        Ok(())
    }

    fn cut(&mut self, row: u64, found: usize, wanted: usize) {
        let at = self.stamps.time.last().copied().unwrap_or_default();
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
        if self.stamps.time.is_empty() {
            return Err(InputError::new(file, "the file has no whole row"));
        }
        self.table.issues.extend(self.stamps.issue(file)?);
        Ok(Table { time: self.stamps.time, row_time: self.stamps.row_time, ..self.table })
    }
}

/// A text with every run of blanks as one tab, none at the ends of lines.
struct Squeezed<R> {
    bytes: std::io::BufReader<R>,
    /// Blanks were passed over since the last letter of the line.
    gap: bool,
    /// The line has a letter already.
    begun: bool,
}

impl<R: Read> Squeezed<R> {
    fn new(bytes: R) -> Self {
        Self { bytes: std::io::BufReader::new(bytes), gap: false, begun: false }
    }
}

impl<R: Read> Read for Squeezed<R> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        use std::io::BufRead as _;
        let mut written = 0;
        // A letter may need two places: the tab before it, and itself.
        while written + 2 <= out.len() {
            let chunk = self.bytes.fill_buf()?;
            if chunk.is_empty() {
                break;
            }
            let mut used = 0;
            for byte in chunk {
                if written + 2 > out.len() {
                    break;
                }
                used += 1;
                match byte {
                    b' ' | b'\t' => self.gap = true,
                    byte => {
                        let line_ends = matches!(byte, b'\n' | b'\r');
                        let tab = (self.gap && self.begun && !line_ends).then_some(b'\t');
                        for letter in tab.into_iter().chain([*byte]) {
                            if let Some(slot) = out.get_mut(written) {
                                *slot = letter;
                                written += 1;
                            }
                        }
                        self.gap = false;
                        self.begun = !line_ends;
                    }
                }
            }
            self.bytes.consume(used);
            if written > 0 {
                break;
            }
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

/// Whether a cell holds the end of a line: no number or name of a log does.
fn spans_lines(record: &ByteRecord) -> bool {
    record.iter().any(|cell| cell.contains(&b'\n'))
}

fn text_of(cell: &[u8]) -> Result<&str, String> {
    std::str::from_utf8(cell).map_err(|_| format!("found `{}`, wanted text in UTF-8", cell_shown(cell)))
}

/// The beginning of a cell, for a message.
fn cell_shown(cell: &[u8]) -> String {
    shown(&String::from_utf8_lossy(cell))
}
