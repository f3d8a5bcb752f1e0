//! The rows of a delimited text: the columns of its blocks joined to a table, with stamps in order.

use super::super::truncated;
use super::blocks::{RowBlocks, TextBlocks};
use super::columns::{ColumnReader, RowBlock};
use super::dialect::Dialect;
use super::faults::{Fault, Places, TruncatedRow};
use crate::read::stamp_order::{RowMerge, Stamps};
use crate::read::table::{Blocks, ColumnRequest, Rows, Table, check_rows, check_size, see};
use std::io::Read;
use std::sync::Arc;
use teachtree_base::error::InputError;

/// Rows that are not read yet.
pub(super) struct DelimitedRows {
    /// The name of the file in messages.
    pub file: String,
    pub dialect: Dialect,
    /// The text, without its titles.
    pub text: Box<dyn Read + Send>,
    /// The line of the file with which the text begins.
    pub line: u64,
}

impl DelimitedRows {
    fn stream(self, header: &[String], wants: &[ColumnRequest], rate_hz: Option<f64>) -> Result<RowStream, InputError> {
        let places = Places { file: self.file.clone(), header: header.to_vec() };
        let reader = Arc::new(ColumnReader::new(places, self.dialect, wants, rate_hz)?);
        let blocks = RowBlocks::start(TextBlocks::new(self.text, self.line, self.file), &reader);
        Ok(RowStream {
            reader,
            blocks,
            stamps: Stamps::default(),
            rows: 0,
            cut: None,
            has_ended: false,
            in_memory: false,
        })
    }
}

impl Rows for DelimitedRows {
    fn read(
        self: Box<Self>,
        header: &[String],
        wants: &[ColumnRequest],
        rate_hz: Option<f64>,
    ) -> Result<Table, InputError> {
        let mut stream = RowStream { in_memory: true, ..self.stream(header, wants, rate_hz)? };
        let mut table = Table::empty(header.len());
        while stream.read_into(&mut table)? {}
        Ok(table)
    }

    fn comes_in_blocks(&self) -> bool {
        true
    }

    fn blocks(
        self: Box<Self>,
        header: &[String],
        wants: &[ColumnRequest],
        rate_hz: Option<f64>,
    ) -> Result<Option<Box<dyn Blocks>>, InputError> {
        Ok(Some(Box::new(self.stream(header, wants, rate_hz)?)))
    }
}

/// Rows that are being read, block by block.
struct RowStream {
    reader: Arc<ColumnReader>,
    blocks: RowBlocks,
    stamps: Stamps,
    /// Number of rows so far, including those that are left out.
    rows: usize,
    /// The last row, if it is cut short, with the error that it is if another row follows.
    cut: Option<(TruncatedRow, InputError)>,
    has_ended: bool,
    /// Whether all rows must fit in memory.
    in_memory: bool,
}

impl RowStream {
    /// Appends the rows of the next block to a table. Returns whether there may be more.
    fn read_into(&mut self, table: &mut Table) -> Result<bool, InputError> {
        if self.has_ended {
            return Ok(false);
        }
        match self.blocks.next() {
            Some(block) => self.take(block?, table)?,
            None => {
                self.has_ended = true;
                self.finish(table)?;
            }
        }
        Ok(!self.has_ended)
    }

    /// Appends the rows of a block.
    fn take(&mut self, mut block: RowBlock, table: &mut Table) -> Result<(), InputError> {
        if let Some((_, error)) = self.cut.take_if(|_| block.rows > 0 || block.fault.is_some()) {
            return Err(error);
        }
        self.check_size(block.rows + usize::from(block.fault.is_some()))?;
        let kept = self.take_stamps(&mut block, table)?;
        self.rows += block.rows;
        let wants = &self.reader.wants;
        if kept.contains(&false) {
            block.columns.iter_mut().zip(wants).for_each(|(column, want)| column.retain(&kept, *want));
        }
        let columns = block.columns.into_iter().zip(wants);
        let whole = table.numbers.iter_mut().zip(&mut table.texts);
        for ((mut column, want), (numbers, texts)) in columns.zip(whole) {
            match want {
                ColumnRequest::Time(_) => continue,
                ColumnRequest::Sniff => column.texts.iter().for_each(|text| see(texts, text)),
                _ => texts.append(&mut column.texts),
            }
            numbers.append(&mut column.numbers);
        }
        table.time.append(&mut self.stamps.time);
        table.row_time.append(&mut self.stamps.row_time);
        match block.fault {
            None => {}
            Some(Fault { cut: Some(cut), error }) => {
                self.cut = Some((cut, *error));
                self.rows += 1;
            }
            Some(Fault { cut: None, error }) => return Err(*error),
        }
        Ok(())
    }

    /// Refuses rows that are too many with this number of further ones.
    fn check_size(&self, rows: usize) -> Result<(), InputError> {
        let file = &self.reader.places.file;
        let rows = self.rows + rows;
        if !self.in_memory {
            return check_rows(file, rows);
        }
        check_size(file, rows, self.reader.wants.iter().filter(|want| **want != ColumnRequest::Nothing).count())
    }

    /// Takes the stamps of a block. Returns for each row whether it is kept; a row that repeats a stamp is merged into the row before it.
    fn take_stamps(&mut self, block: &mut RowBlock, table: &mut Table) -> Result<Vec<bool>, InputError> {
        let ColumnReader { places, wants, rate_hz, .. } = &*self.reader;
        let is_timed = |want: &ColumnRequest| rate_hz.is_none() && matches!(want, ColumnRequest::Time(_));
        let timed = wants.iter().position(is_timed);
        // Seconds and nanoseconds may be in columns of their own.
        let parts: Vec<usize> = (0..).zip(wants).filter(|(_, want)| is_timed(want)).map(|(column, _)| column).collect();
        let mut kept = Vec::with_capacity(block.rows);
        for row in 0..block.rows {
            let line = block.line_of(row);
            let part = |column: &usize| block.columns.get(*column)?.numbers.get(row).copied();
            let stamp = match rate_hz {
                Some(rate) => (self.rows + row) as f64 / rate,
                None => parts.iter().map(|column| part(column).unwrap_or(f64::NAN)).sum(),
            };
            let place = || timed.map_or_else(|| places.row(line), |column| places.cell(line, column));
            let is_kept = self.stamps.push(stamp).map_err(|message| InputError::new(place(), message))?;
            if !is_kept {
                let before = kept.iter().rposition(|kept| *kept);
                if merge(row, before, block, table, wants).is_repeat() {
                    self.stamps.repeats(line, stamp);
                }
            }
            kept.push(is_kept);
        }
        Ok(kept)
    }

    /// Checks that there are rows, and adds the issues.
    fn finish(&mut self, table: &mut Table) -> Result<(), InputError> {
        let Places { file, header } = &self.reader.places;
        if self.rows == 0 {
            return Err(InputError::new(file, "the file has a header and no rows"));
        }
        if let Some((TruncatedRow { row, cells }, _)) = self.cut.take() {
            let at = self.stamps.last().unwrap_or_default();
            let width = header.len();
            let message = format!("row {row}, the last one, is cut short ({cells} of {width} fields); it is left out");
            table.issues.push(truncated(at, message));
        }
        if self.stamps.last().is_none() {
            return Err(InputError::new(file, "the file has no whole row"));
        }
        table.issues.extend(self.stamps.issue(file)?);
        Ok(())
    }
}

impl Blocks for RowStream {
    fn next(&mut self) -> Result<Option<Table>, InputError> {
        if self.has_ended {
            return Ok(None);
        }
        let mut table = Table::empty(self.reader.places.header.len());
        self.read_into(&mut table)?;
        Ok(Some(table))
    }
}

/// Merges a row into the row with the same stamp: row `before` of the same block, or the last row of the table so far.
fn merge(
    row: usize,
    before: Option<usize>,
    block: &mut RowBlock,
    table: &mut Table,
    wants: &[ColumnRequest],
) -> RowMerge {
    let mut addition = RowMerge::default();
    let whole = table.numbers.iter_mut().zip(&mut table.texts);
    for ((column, want), (numbers, texts)) in block.columns.iter_mut().zip(wants).zip(whole) {
        if !want.is_column() {
            continue;
        }
        if let (Some(value), Some(kept)) = pair(&mut column.numbers, row, before, numbers) {
            addition.number(kept, value);
        }
        // Columns that are only sniffed have no texts per row.
        if *want == ColumnRequest::Text
            && let (Some(value), Some(kept)) = pair(&mut column.texts, row, before, texts)
        {
            addition.text(kept, &value);
        }
    }
    addition
}

/// Returns a value, and the value of the row into which it is merged: of the same block, or the last one before the block.
fn pair<'a, T: Clone>(
    values: &'a mut [T],
    row: usize,
    before: Option<usize>,
    whole: &'a mut [T],
) -> (Option<T>, Option<&'a mut T>) {
    let value = values.get(row).cloned();
    (value, before.map_or(whole.last_mut(), |before| values.get_mut(before)))
}
