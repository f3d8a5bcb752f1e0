//! Numbers of columns that are not lists, decoded directly into the output.

use super::BATCH;
use super::numbers::{NumberForm, seconds_of};
use ::parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use ::parquet::data_type::DataType;
use ::parquet::errors::ParquetError;

/// Appends numbers of a column that is not a list; returns their count.
pub(super) fn flat(
    reader: &mut ColumnReader,
    max_def: i16,
    form: NumberForm,
    rows: usize,
    values: &mut Vec<f64>,
) -> Result<usize, ParquetError> {
    match reader {
        ColumnReader::BoolColumnReader(reader) => {
            widened(reader, max_def, rows, values, |value| f64::from(u8::from(*value)))
        }
        ColumnReader::Int32ColumnReader(reader) => {
            widened(reader, max_def, rows, values, |value| f64::from(*value) * form.factor)
        }
        ColumnReader::Int64ColumnReader(reader) => {
            widened(reader, max_def, rows, values, |value| *value as f64 * form.factor)
        }
        ColumnReader::FloatColumnReader(reader) => widened(reader, max_def, rows, values, |value| f64::from(*value)),
        ColumnReader::DoubleColumnReader(reader) if max_def == 0 => {
            // Numbers that are stored in the requested type are decoded in place.
            let mut read = 0;
            while read < rows {
                let (records, ..) = reader.read_records(rows - read, None, None, values)?;
                read += some(records, read, rows)?;
            }
            Ok(read)
        }
        ColumnReader::DoubleColumnReader(reader) => widened(reader, max_def, rows, values, |value| *value),
        ColumnReader::Int96ColumnReader(reader) => widened(reader, max_def, rows, values, seconds_of),
        ColumnReader::ByteArrayColumnReader(reader) => {
            widened(reader, max_def, rows, values, |value| form.of_bytes(value.data()))
        }
        ColumnReader::FixedLenByteArrayColumnReader(reader) => {
            widened(reader, max_def, rows, values, |value| form.of_bytes(value.data()))
        }
    }
}

/// Like the above, for numbers of another stored type, or with missing values.
fn widened<T: DataType>(
    reader: &mut ColumnReaderImpl<T>,
    max_def: i16,
    rows: usize,
    values: &mut Vec<f64>,
    number: impl Fn(&T::T) -> f64,
) -> Result<usize, ParquetError> {
    let (mut defs, mut stored) = (vec![], vec![]);
    let mut read = 0;
    while read < rows {
        defs.clear();
        stored.clear();
        let batch = BATCH.min(rows - read);
        let (records, ..) = reader.read_records(batch, Some(&mut defs), None, &mut stored)?;
        read += some(records, read, rows)?;
        if stored.len() == records {
            values.extend(stored.iter().map(&number));
        } else {
            let mut next = stored.iter();
            let measured = |def: &i16| if *def == max_def { next.next().map(&number) } else { None };
            values.extend(defs.iter().map(measured).map(|value| value.unwrap_or(f64::NAN)));
        }
    }
    Ok(read)
}

/// Returns the number of records that were read, if any.
fn some(records: usize, read: usize, rows: usize) -> Result<usize, ParquetError> {
    match records {
        0 => Err(ParquetError::General(format!("a column ends after {read} of {rows} rows"))),
        records => Ok(records),
    }
}
