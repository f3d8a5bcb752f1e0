//! A Parquet file once more, with columns instead of those of the same names or after the others: all other columns are copied as they are stored, byte
//! for byte, and compared afterwards. The schemas of Arrow and of `datasets` in its metadata are brought up to date.

use super::arrow_metadata;
use super::column::Column;
use super::{SizedFile, damaged};
use ::parquet::basic::Compression;
use ::parquet::column::writer::ColumnCloseResult;
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::{ColumnChunkMetaData, KeyValue};
use ::parquet::file::properties::{EnabledStatistics, WriterProperties};
use ::parquet::file::reader::{ChunkReader, FileReader, SerializedFileReader};
use ::parquet::file::writer::SerializedFileWriter;
use ::parquet::schema::types::Type;
use serde_json::Value;
use std::fs::File;
use std::io::Write;
use std::sync::Arc;
use teachtree_base::error::InputError;
use teachtree_base::guard::guarded;

/// Metadata of the Python package `datasets`.
const DATASETS: &str = "huggingface";

pub(super) fn open(file: File, name: &str) -> Result<(SizedFile, SerializedFileReader<SizedFile>), InputError> {
    let length = file.metadata().map_err(|error| InputError::unreadable(name, &error))?.len();
    let again = file.try_clone().map_err(|error| InputError::unreadable(name, &error))?;
    let reader = SerializedFileReader::new(SizedFile { file, length }).map_err(|error| damaged(name, &error))?;
    Ok((SizedFile { file: again, length }, reader))
}

/// The names of the columns of a file, those of lists and groups once.
///
/// # Errors
/// When it is damaged.
pub fn names(file: File, name: &str) -> Result<Vec<String>, InputError> {
    guarded(name, || {
        let (_, reader) = open(file, name)?;
        let root = reader.metadata().file_metadata().schema();
        Ok(root.get_fields().iter().map(|field| field.name().to_string()).collect())
    })
}

/// Writes a file once more, with these columns and with more metadata.
///
/// # Errors
/// When the file is damaged, `out` cannot be written, or a column does not have a value for each row.
pub fn write(
    file: File,
    name: &str,
    columns: &[Column],
    keys: &[(&str, String)],
    out: &mut (dyn Write + Send),
) -> Result<(), InputError> {
    guarded(name, || {
        let (whole, reader) = open(file, name)?;
        let rows = usize::try_from(reader.metadata().file_metadata().num_rows()).unwrap_or(usize::MAX);
        if let Some(column) = columns.iter().find(|column| column.rows() != rows) {
            let message = format!("has {rows} rows, and {} values of `{}`", column.rows(), column.name);
            return Err(InputError::new(name, message));
        }
        copy(&whole, &reader, columns, keys, out).map_err(|error| damaged(name, &error))
    })
}

/// Writes a new file with these columns alone.
///
/// # Errors
/// When `out` cannot be written.
pub fn write_new(
    columns: &[Column],
    keys: Vec<(&str, String)>,
    out: &mut (dyn Write + Send),
) -> Result<(), ParquetError> {
    let mut file = NewFile::new(columns, keys, out)?;
    file.write(columns)?;
    file.close()
}

/// A file that is written in parts, each of which is a row group.
pub struct NewFile<W: Write + Send>(SerializedFileWriter<W>);

impl<W: Write + Send> NewFile<W> {
    /// A file with columns as these, and with metadata.
    ///
    /// # Errors
    /// When `out` cannot be written.
    pub fn new(columns: &[Column], keys: Vec<(&str, String)>, out: W) -> Result<Self, ParquetError> {
        let fields: Result<Vec<Arc<Type>>, ParquetError> = columns.iter().map(Column::schema).collect();
        let schema = Arc::new(Type::group_type_builder("schema").with_fields(fields?).build()?);
        let pairs = keys.into_iter().map(|(key, value)| KeyValue::new(key.to_string(), value)).collect();
        Ok(Self(SerializedFileWriter::new(out, schema, Arc::new(properties(pairs)))?))
    }

    /// Writes the next part.
    ///
    /// # Errors
    /// When it cannot be written, or the columns are not those of the file.
    pub fn write(&mut self, columns: &[Column]) -> Result<(), ParquetError> {
        let mut group = self.0.next_row_group()?;
        columns.iter().try_for_each(|column| column.write(0..column.rows(), &mut group))?;
        group.close().map(drop)
    }

    /// The number of bytes that were written so far.
    pub fn bytes(&self) -> usize {
        self.0.bytes_written()
    }

    /// Ends the file.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn close(self) -> Result<(), ParquetError> {
        self.0.close().map(drop)
    }
}

/// The metadata by which `datasets` knows the types of columns.
pub fn features(columns: &[Column]) -> (&'static str, String) {
    let features: serde_json::Map<String, Value> =
        columns.iter().map(|column| (column.name.clone(), column.feature(true))).collect();
    (DATASETS, serde_json::json!({ "info": { "features": features } }).to_string())
}

fn properties(pairs: Vec<KeyValue>) -> WriterProperties {
    WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_offset_index_disabled(true)
        .set_key_value_metadata(Some(pairs))
        .set_created_by(format!("teachtree version {}", env!("CARGO_PKG_VERSION")))
        .build()
}

fn copy(
    whole: &SizedFile,
    reader: &SerializedFileReader<SizedFile>,
    columns: &[Column],
    keys: &[(&str, String)],
    out: &mut (dyn Write + Send),
) -> Result<(), ParquetError> {
    let metadata = reader.metadata();
    let root = metadata.file_metadata().schema();
    let is_new = |name: &str| columns.iter().any(|column| column.name == name);
    let mut fields: Vec<Arc<Type>> = root.get_fields().iter().filter(|field| !is_new(field.name())).cloned().collect();
    for column in columns {
        fields.push(column.schema()?);
    }
    let schema = Arc::new(Type::group_type_builder(root.name()).with_fields(fields).build()?);
    let known = metadata.file_metadata().key_value_metadata().cloned().unwrap_or_default();
    let mut writer = SerializedFileWriter::new(out, schema, Arc::new(properties(pairs(known, columns, keys))))?;
    let mut before = 0;
    for group in metadata.row_groups() {
        let count = usize::try_from(group.num_rows()).unwrap_or(0);
        let mut part = writer.next_row_group()?;
        for column in group.columns().iter().filter(|column| !is_new(root_of(column))) {
            let close = ColumnCloseResult {
                bytes_written: column.compressed_size().try_into().unwrap_or(0),
                rows_written: count as u64,
                metadata: column.clone(),
                bloom_filter: None,
                column_index: None,
                offset_index: None,
            };
            part.append_column(whole, close)?;
        }
        columns.iter().try_for_each(|column| column.write(before..before + count, &mut part))?;
        before += count;
        part.close()?;
    }
    writer.close()?;
    Ok(())
}

/// The column of the file that a stored column is part of.
fn root_of(column: &ColumnChunkMetaData) -> &str {
    column.column_path().parts().first().map_or("", String::as_str)
}

/// The metadata of the copy. A schema of Arrow that cannot be read is left out: readers derive one from the columns.
fn pairs(known: Vec<KeyValue>, columns: &[Column], keys: &[(&str, String)]) -> Vec<KeyValue> {
    let mut pairs: Vec<KeyValue> = known;
    pairs.retain(|pair| !keys.iter().any(|(key, _)| *key == pair.key));
    let mut changed: Vec<(String, String)> = keys.iter().map(|(key, value)| ((*key).into(), value.clone())).collect();
    for pair in pairs.iter_mut().filter(|pair| pair.key == DATASETS) {
        pair.value = pair.value.take().map(|text| with_features(&text, columns).unwrap_or(text));
        changed.extend(pair.value.clone().map(|value| (pair.key.clone(), value)));
    }
    let fields: Vec<_> = columns.iter().map(Column::field).collect();
    for pair in pairs.iter_mut().filter(|pair| pair.key == arrow_metadata::KEY) {
        pair.value = pair.value.take().and_then(|encoded| arrow_metadata::updated(&encoded, &fields, &changed));
    }
    pairs.retain(|pair| pair.key != arrow_metadata::KEY || pair.value.is_some());
    pairs.extend(keys.iter().map(|(key, value)| KeyValue::new((*key).to_string(), value.clone())));
    pairs
}

/// The feature list of `datasets` with the columns; `None` for other text.
fn with_features(text: &str, columns: &[Column]) -> Option<String> {
    let mut whole: Value = serde_json::from_str(text).ok()?;
    let features = whole.get_mut("info")?.get_mut("features")?.as_object_mut()?;
    for column in columns {
        features.shift_remove(&column.name);
        features.insert(column.name.clone(), column.feature(text.contains("\"List\"")));
    }
    serde_json::to_string(&whole).ok()
}

/// Compares a copy with the file that it was made from: all other columns are stored in it byte for byte, and it has these columns.
///
/// # Errors
/// The first difference.
pub fn compare(file: File, copy: File, name: &str, columns: &[Column]) -> Result<(), InputError> {
    guarded(name, || {
        let ((one, ours), (other, reader)) = (open(file, name)?, open(copy, name)?);
        let failed = |error: ParquetError| damaged(name, &error);
        let wrong = |what: &str| InputError::new(name, format!("the copy differs from the data set in {what}"));
        let (ours, theirs) = (ours.metadata(), reader.metadata());
        if ours.num_row_groups() != theirs.num_row_groups() {
            return Err(wrong("its parts"));
        }
        let is_new = |name: &str| columns.iter().any(|column| column.name == name);
        for (mine, yours) in ours.row_groups().iter().zip(theirs.row_groups()) {
            let others = |column: &&ColumnChunkMetaData| -> bool { !is_new(root_of(column)) };
            let (mut mine, mut yours) = (mine.columns().iter().filter(others), yours.columns().iter().filter(others));
            loop {
                let (column, copied) = match (mine.next(), yours.next()) {
                    (None, None) => break,
                    (Some(column), Some(copied)) => (column, copied),
                    _ => return Err(wrong("its columns")),
                };
                let bytes = |of: &SizedFile, column: &ColumnChunkMetaData| {
                    let (start, length) = column.byte_range();
                    of.get_bytes(start, usize::try_from(length).unwrap_or(usize::MAX)).map_err(failed)
                };
                if column.column_descr() != copied.column_descr()
                    || column.num_values() != copied.num_values()
                    || column.compression() != copied.compression()
                    || bytes(&one, column)? != bytes(&other, copied)?
                {
                    return Err(wrong(&format!("the column `{}`", column.column_path().string())));
                }
            }
        }
        for column in columns {
            let root = theirs.file_metadata().schema();
            let fields = root.get_fields().iter().filter(|field| field.name() == column.name).cloned().collect();
            let projection = Type::group_type_builder(root.name()).with_fields(fields).build().map_err(failed)?;
            let mut rows = 0;
            for record in reader.get_row_iter(Some(projection)).map_err(failed)? {
                let record = record.map_err(failed)?;
                let same = record.get_column_iter().all(|(_, stored)| column.is_stored(rows, stored));
                if !same || record.len() != 1 {
                    return Err(InputError::new(name, format!("the copy has another `{}` in row {rows}", column.name)));
                }
                rows += 1;
            }
            if rows != column.rows() {
                return Err(wrong("its length"));
            }
        }
        Ok(())
    })
}
