//! The columns of a block of lines: text in, numbers and texts out, up to the first row that cannot be read.

use super::dialect::Dialect;
use super::faults::{Fault, Places, RowFault, TIME};
use super::records::Records;
use crate::read::table::{ColumnRequest, MAX_CELL, see};
use std::ops::Range;
use teachtree_base::error::InputError;

/// Reads columns from blocks of lines.
pub(super) struct ColumnReader {
    pub places: Places,
    dialect: Dialect,
    /// The request for each column of the header.
    pub wants: Vec<ColumnRequest>,
    /// Number of columns up to the last requested one.
    wanted: usize,
    /// The rate of the rows, if no column has the time.
    pub rate_hz: Option<f64>,
}

/// The rows of a block of lines.
pub(super) struct RowBlock {
    /// The line of the file with which the block begins.
    pub line: u64,
    /// Number of rows.
    pub rows: usize,
    /// Number of lines before each row; empty if every line is a row.
    pub offsets: Vec<u32>,
    /// One for each column of the header.
    pub columns: Vec<Column>,
    /// The fault of the row after the last one.
    pub fault: Option<Fault>,
}

/// The values of a column.
#[derive(Default)]
pub(super) struct Column {
    /// One number for each row, times the factor that is wanted.
    pub numbers: Vec<f64>,
    /// One text for each row, or the first different ones of a [`ColumnRequest::Sniff`].
    pub texts: Vec<String>,
    /// The row with the last one of different texts.
    last_text: usize,
}

impl ColumnReader {
    /// # Errors
    /// The rows have neither a time nor a rate.
    pub fn new(
        places: Places,
        dialect: Dialect,
        wants: &[ColumnRequest],
        rate_hz: Option<f64>,
    ) -> Result<Self, InputError> {
        if rate_hz.is_none() && !wants.iter().any(|want| matches!(want, ColumnRequest::Time(_))) {
            return Err(InputError::new(places.file, "no column holds the time"));
        }
        let wanted = wants.iter().rposition(|want| *want != ColumnRequest::Nothing).map_or(0, |last| last + 1);
        Ok(Self { places, dialect, wants: wants.to_vec(), wanted, rate_hz })
    }

    /// Reads a block of whole lines with these numbers in the file.
    pub fn read(&self, text: &[u8], lines: Range<u64>) -> RowBlock {
        let columns = self.reserved(text.len(), (lines.end - lines.start) as usize);
        let mut block = RowBlock { line: lines.start, rows: 0, offsets: vec![], columns, fault: None };
        let mut records = Records::new(text, self.dialect);
        while records.advance() {
            let begin = records;
            if let Err(fault) = self.read_row(&mut records, &mut block) {
                self.forget_row(&mut block);
                let row = lines.start + records.line() as u64;
                block.fault = Some(Fault::new(begin, fault, row, &self.places));
                break;
            }
            block.end_row(records.line());
        }
        block
    }

    /// Returns columns without values, with memory for the rows of a text.
    fn reserved(&self, bytes: usize, lines: usize) -> Vec<Column> {
        // A row has a byte for each cell: its delimiter, or the end of the line.
        let rows = lines.min(bytes / self.wanted.max(1) + 1);
        let numbers = |want: &ColumnRequest| want.to_si().map_or(vec![], |_| Vec::with_capacity(rows));
        self.wants.iter().map(|want| Column { numbers: numbers(want), ..Column::default() }).collect()
    }

    /// Reads the cells of a row.
    fn read_row(&self, records: &mut Records, block: &mut RowBlock) -> Result<(), RowFault> {
        let row = block.rows;
        let wanted = self.wants.get(..self.wanted).unwrap_or_default();
        for (at, (want, column)) in wanted.iter().zip(&mut block.columns).enumerate() {
            let plain = want.to_si().and_then(|to_si| Some(records.number()? * to_si));
            let pushed = match plain {
                Some(value) => column.push_number(value, *want),
                None => {
                    let cell = records.cell().ok_or(RowFault::Form)?;
                    if cell.len() > MAX_CELL && *want != ColumnRequest::Nothing {
                        return Err(RowFault::Long { column: at });
                    }
                    column.push_cell(&cell, *want, self.dialect, row)
                }
            };
            pushed.map_err(|expected| RowFault::Unexpected { column: at, expected })?;
        }
        let (rest, is_last_empty) = records.skip();
        let expected = self.wants.len() - self.wanted;
        // A surplus delimiter at the end of each row is not a column.
        let is_whole = rest == expected || rest == expected + 1 && is_last_empty;
        if is_whole && !records.spans_lines() { Ok(()) } else { Err(RowFault::Form) }
    }

    /// Removes the values of a row that was not read to its end.
    fn forget_row(&self, block: &mut RowBlock) {
        for (column, want) in block.columns.iter_mut().zip(&self.wants) {
            column.numbers.truncate(block.rows);
            if *want == ColumnRequest::Text {
                column.texts.truncate(block.rows);
            } else if column.last_text == block.rows {
                column.texts.pop();
            }
        }
    }
}

impl RowBlock {
    /// Counts a row that follows this number of lines of the block.
    fn end_row(&mut self, lines: usize) {
        if self.offsets.is_empty() && lines != self.rows {
            self.offsets = (0..self.rows as u32).collect();
        }
        self.rows += 1;
        if !self.offsets.is_empty() || lines != self.rows - 1 {
            self.offsets.push(lines as u32);
        }
    }

    /// Returns the line of the file with which a row begins.
    pub fn line_of(&self, row: usize) -> u64 {
        self.line + self.offsets.get(row).map_or(row as u64, |offset| u64::from(*offset))
    }
}

impl Column {
    /// Appends a number. The error is the expected value.
    fn push_number(&mut self, value: f64, want: ColumnRequest) -> Result<(), &'static str> {
        if matches!(want, ColumnRequest::Time(_)) && !value.is_finite() {
            return Err(TIME);
        }
        self.numbers.push(value);
        Ok(())
    }

    /// Appends the value of a cell. The error is the expected value.
    fn push_cell(
        &mut self,
        cell: &[u8],
        want: ColumnRequest,
        dialect: Dialect,
        row: usize,
    ) -> Result<(), &'static str> {
        let value = match want {
            ColumnRequest::Nothing => return Ok(()),
            ColumnRequest::Text => {
                let text = std::str::from_utf8(cell).map_err(|_| "text in UTF-8")?;
                self.texts.push(text.trim().to_string());
                return Ok(());
            }
            ColumnRequest::Time(to_seconds) => dialect.time(cell, to_seconds).ok_or(TIME)?,
            ColumnRequest::Number(to_si) => dialect.number(cell).ok_or("a number")? * to_si,
            ColumnRequest::Optional(to_si) => dialect.number(cell).map_or(f64::NAN, |value| value * to_si),
            ColumnRequest::Sniff => {
                dialect.number(cell).unwrap_or_else(|| self.see(&String::from_utf8_lossy(cell), row))
            }
        };
        self.push_number(value, want)
    }

    /// Adds a text to the different ones. Its number is NaN.
    fn see(&mut self, text: &str, row: usize) -> f64 {
        let before = self.texts.len();
        see(&mut self.texts, text);
        if self.texts.len() > before {
            self.last_text = row;
        }
        f64::NAN
    }

    /// Keeps the values of the rows that are kept.
    pub fn retain(&mut self, kept: &[bool], want: ColumnRequest) {
        fn retain<T>(values: &mut Vec<T>, kept: &[bool]) {
            let mut kept = kept.iter();
            values.retain(|_| kept.next() != Some(&false));
        }
        retain(&mut self.numbers, kept);
        if want == ColumnRequest::Text {
            retain(&mut self.texts, kept);
        }
    }
}
