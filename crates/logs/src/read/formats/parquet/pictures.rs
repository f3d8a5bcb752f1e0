//! Pictures in Parquet, as `datasets` stores them: a group of the bytes of a file and its path.

use super::{BATCH, ParquetError, SizedFile, damaged, skip};
use crate::read::formats::picture::digest;
use ::parquet::basic::Type as Physical;
use ::parquet::column::reader::ColumnReader;
use ::parquet::file::reader::{FileReader, SerializedFileReader};
use std::fs::File;
use std::ops::Range;
use teachtree_base::error::InputError;
use teachtree_base::guard::guarded;

/// The field of the group with the bytes.
const BYTES: &str = "bytes";

/// The [`digest`]s of the pictures in some rows, by column; 0 for a row without a picture.
///
/// # Errors
/// When the file is damaged.
pub fn digests(file: File, name: &str, rows: Range<usize>) -> Result<Vec<(String, Vec<u64>)>, InputError> {
    guarded(name, || {
        let length = file.metadata().map_err(|error| InputError::unreadable(name, &error))?.len();
        let reader = SerializedFileReader::new(SizedFile { file, length }).map_err(|error| damaged(name, &error))?;
        read(&reader, rows).map_err(|error| damaged(name, &error))
    })
}

fn read(reader: &SerializedFileReader<SizedFile>, rows: Range<usize>) -> Result<Vec<(String, Vec<u64>)>, ParquetError> {
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let mut found = Vec::new();
    for (index, column) in schema.columns().iter().enumerate() {
        let parts = column.path().parts();
        let is_picture = column.physical_type() == Physical::BYTE_ARRAY && column.max_rep_level() == 0;
        let [camera, field] = parts else { continue };
        if field != BYTES || !is_picture {
            continue;
        }
        let mut digests = Vec::new();
        let mut before = 0;
        for group in 0..reader.num_row_groups() {
            let group = reader.get_row_group(group)?;
            let count = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
            let (first, last) = (rows.start.max(before), rows.end.min(before + count));
            if first < last {
                let mut column_reader = group.get_column_reader(index)?;
                skip(&mut column_reader, first - before)?;
                read_group(column_reader, column.max_def_level(), last - first, &mut digests)?;
            }
            before += count;
        }
        found.push((camera.clone(), digests));
    }
    Ok(found)
}

fn read_group(reader: ColumnReader, max_def: i16, rows: usize, digests: &mut Vec<u64>) -> Result<(), ParquetError> {
    let ColumnReader::ByteArrayColumnReader(mut reader) = reader else { return Ok(()) };
    let (mut read, mut levels, mut values) = (0, Vec::new(), Vec::new());
    // Pictures are large: a few at a time.
    const AT_ONCE: usize = BATCH / 512;
    while read < rows {
        levels.clear();
        values.clear();
        let (records, ..) = reader.read_records(AT_ONCE.min(rows - read), Some(&mut levels), None, &mut values)?;
        if records == 0 {
            return Err(ParquetError::General(format!("a column ends after {read} of {rows} rows")));
        }
        let mut next = values.iter();
        for at in 0..records {
            let is_there = levels.get(at).is_none_or(|level| *level == max_def);
            let picture = if is_there { next.next() } else { None };
            digests.push(picture.map_or(0, |bytes| digest(bytes.data())));
        }
        read += records;
    }
    Ok(())
}
