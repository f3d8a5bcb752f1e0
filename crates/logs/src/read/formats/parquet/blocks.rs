//! The rows of a file some at a time: every column that is wanted is decoded as far as the others.

use super::{BATCH, Leaf, ParquetTable, damaged, flat::flat, guarded};
use crate::read::stamp_order::Stamps;
use crate::read::table::{Blocks, ColumnRequest, Table};
use ::parquet::column::reader::ColumnReader;
use ::parquet::errors::ParquetError;
use ::parquet::file::reader::FileReader;
use teachtree_base::error::InputError;

/// A file that is read some rows at a time.
pub(super) struct ParquetBlocks {
    opened: ParquetTable,
    wants: Vec<ColumnRequest>,
    stamps: Stamps,
    /// The columns of the row group, how many of its rows are left, and the next group.
    columns: Vec<Option<ColumnReader>>,
    left: usize,
    group: usize,
}

impl ParquetBlocks {
    /// Returns a reader at the first row.
    pub fn new(opened: ParquetTable, wants: Vec<ColumnRequest>) -> Self {
        Self { opened, wants, stamps: Stamps::default(), columns: vec![], left: 0, group: 0 }
    }

    /// Advances to the next row group with rows, and returns whether it exists.
    fn open_group(&mut self) -> Result<bool, ParquetError> {
        while self.left == 0 {
            if self.group == self.opened.reader.num_row_groups() {
                return Ok(false);
            }
            let group = self.opened.reader.get_row_group(self.group)?;
            self.group += 1;
            self.left = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
            let column = |((index, _), want): (&(usize, Leaf), &ColumnRequest)| match want {
                ColumnRequest::Nothing => Ok(None),
                _ => group.get_column_reader(*index).map(Some),
            };
            self.columns = self.opened.leaves.iter().zip(&self.wants).map(column).collect::<Result<_, _>>()?;
        }
        Ok(true)
    }
}

impl Blocks for ParquetBlocks {
    fn next(&mut self) -> Result<Option<Table>, InputError> {
        let name = self.opened.name.clone();
        guarded(&name, || self.block())
    }
}

impl ParquetBlocks {
    /// The rows of the next block; nothing behind the last one.
    fn block(&mut self) -> Result<Option<Table>, InputError> {
        let name = self.opened.name.clone();
        if !self.open_group().map_err(|error| damaged(&name, &error))? {
            return Ok(None);
        }
        let rows = BATCH.min(self.left);
        self.left -= rows;
        let mut table = Table::empty(self.columns.len());
        let leaves = self.opened.leaves.iter().map(|(_, leaf)| leaf).zip(&self.wants);
        let mut stamps = vec![];
        for ((reader, (leaf, want)), values) in self.columns.iter_mut().zip(leaves).zip(&mut table.numbers) {
            let (Some(reader), Some(to_si)) = (reader, want.to_si()) else { continue };
            values.reserve(rows);
            flat(reader, leaf.max_def, leaf.form, rows, values).map_err(|error| damaged(&name, &error))?;
            values.iter_mut().for_each(|value| *value = if value.is_finite() { *value * to_si } else { f64::NAN });
            if let ColumnRequest::Time(_) = want {
                stamps = std::mem::take(values);
            }
        }
        for stamp in stamps {
            let wrong = |message: String| InputError::new(&name, message);
            let kept = stamp.is_finite() && self.stamps.push(stamp).map_err(wrong)?;
            if !kept {
                return Err(wrong(format!("found a row at {stamp} s, expected stamps that rise")));
            }
        }
        (table.time, table.row_time) = self.stamps.take();
        Ok(Some(table))
    }
}
