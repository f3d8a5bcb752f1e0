//! Rows whose rate the file states beside them: a last column has their stamps, which count the rows.

use crate::names;
use crate::read::table::{Blocks, ColumnRequest, Rows, Sheet, Table};
use teachtree_base::error::InputError;

/// The title of the column.
const TIME: &str = "time [s]";

/// Gives a sheet without stamps a column of them by the rate of its rows, Hz.
pub(super) fn stamped(sheet: Sheet, rate_hz: f64) -> Sheet {
    let is_time = |title: &String| names::split_known_unit(title).0.eq_ignore_ascii_case("time");
    let is_rate = rate_hz.is_finite() && rate_hz > 0.0;
    if !is_rate || sheet.header.iter().any(is_time) {
        return sheet;
    }
    let header = sheet.header.into_iter().chain([TIME.to_string()]).collect();
    Sheet { header, rows: Box::new(RatedRows { rows: sheet.rows, rate_hz }), ..sheet }
}

/// Rows and their rate, Hz.
struct RatedRows {
    rows: Box<dyn Rows>,
    rate_hz: f64,
}

/// The requests for the columns of the file.
struct Requests<'a> {
    header: &'a [String],
    wants: &'a [ColumnRequest],
    /// The rate at which stamps count the rows, Hz; none if another column has them.
    rate_hz: Option<f64>,
    /// The column of stamps, if it is read as any other column.
    column: StampColumn,
}

impl RatedRows {
    /// The requests without the last one, which is for the stamps.
    fn requests<'a>(&self, header: &'a [String], wants: &'a [ColumnRequest], rate_hz: Option<f64>) -> Requests<'a> {
        let (time, wants) = wants.split_last().map_or((ColumnRequest::Nothing, wants), |(time, wants)| (*time, wants));
        let header = header.split_last().map_or(header, |(_, header)| header);
        let rate_hz = match time {
            ColumnRequest::Time(factor) => rate_hz.or(Some(self.rate_hz / factor)),
            _ => rate_hz,
        };
        let step = time.to_si().filter(|_| time.is_column()).map(|factor| factor / self.rate_hz);
        Requests { header, wants, rate_hz, column: StampColumn { step, rows: 0 } }
    }
}

impl Rows for RatedRows {
    fn read(
        self: Box<Self>,
        header: &[String],
        wants: &[ColumnRequest],
        rate_hz: Option<f64>,
    ) -> Result<Table, InputError> {
        let Requests { header, wants, rate_hz, mut column } = self.requests(header, wants, rate_hz);
        Ok(column.added(self.rows.read(header, wants, rate_hz)?))
    }

    fn comes_in_blocks(&self) -> bool {
        self.rows.comes_in_blocks()
    }

    fn blocks(
        self: Box<Self>,
        header: &[String],
        wants: &[ColumnRequest],
        rate_hz: Option<f64>,
    ) -> Result<Option<Box<dyn Blocks>>, InputError> {
        let Requests { header, wants, rate_hz, column } = self.requests(header, wants, rate_hz);
        let blocks = self.rows.blocks(header, wants, rate_hz)?;
        Ok(blocks.map(|blocks| -> Box<dyn Blocks> { Box::new(RatedBlocks { blocks, column }) }))
    }
}

/// Blocks of rows, with the stamps as a column.
struct RatedBlocks {
    blocks: Box<dyn Blocks>,
    column: StampColumn,
}

impl Blocks for RatedBlocks {
    fn next(&mut self) -> Result<Option<Table>, InputError> {
        Ok(self.blocks.next()?.map(|table| self.column.added(table)))
    }
}

/// The stamps of rows as a column.
struct StampColumn {
    /// From one row to the next, in the unit that is requested; none if the column is not requested.
    step: Option<f64>,
    /// Number of rows so far.
    rows: usize,
}

impl StampColumn {
    /// The table with this column behind the others.
    fn added(&mut self, mut table: Table) -> Table {
        let end = self.rows + table.time.len();
        let stamps = self.step.map(|step| (self.rows..end).map(|row| row as f64 * step).collect());
        self.rows = end;
        table.numbers.push(stamps.unwrap_or_default());
        table.texts.push(vec![]);
        table
    }
}
