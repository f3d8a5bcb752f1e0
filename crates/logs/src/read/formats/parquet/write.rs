//! Writing a canonical log as Parquet: one column a column, the scene and the events in the metadata.

use super::{EVENTS, SCENE};
use crate::atomic_write::Files;
use crate::read::csv::check_lengths;
use crate::read::memory_table::titled;
use ::parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use ::parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::SerializedFileWriter;
use ::parquet::schema::types::Type;
use std::path::Path;
use std::sync::Arc;
use teachtree_base::error::InputError;
use teachtree_base::recording::Recording;
use teachtree_base::yaml;

/// Adds a canonical log to files that belong together.
///
/// # Errors
/// When a column is not as long as the time, or the file cannot be written.
pub fn add(files: &mut Files, recording: &Recording, path: &Path) -> Result<(), InputError> {
    check_lengths(recording, path)?;
    let scene = yaml::write(&recording.scene)?;
    let events = serde_json::to_string(&recording.events)
        .map_err(|error| InputError::new(path.display().to_string(), error.to_string()))?;
    let metadata = vec![KeyValue::new(SCENE.into(), scene), KeyValue::new(EVENTS.into(), events)];
    files.add_log(path, |out| write_columns(out, recording, metadata).map_err(std::io::Error::other))
}

/// Adds the columns and labels of a recording only.
pub fn add_table(files: &mut Files, recording: &Recording, path: &Path) -> Result<(), InputError> {
    check_lengths(recording, path)?;
    files.add(path, |out| write_columns(out, recording, vec![]).map_err(std::io::Error::other))
}

fn write_columns(
    out: &mut (dyn std::io::Write + Send),
    recording: &Recording,
    metadata: Vec<KeyValue>,
) -> Result<(), ParquetError> {
    let number = |title: &str| {
        Type::primitive_type_builder(title, Physical::DOUBLE)
            .with_repetition(Repetition::REQUIRED)
            .build()
            .map(Arc::new)
    };
    let text = |title: &str| {
        Type::primitive_type_builder(title, Physical::BYTE_ARRAY)
            .with_repetition(Repetition::REQUIRED)
            .with_logical_type(Some(LogicalType::String))
            .build()
            .map(Arc::new)
    };
    let mut fields = vec![number("time [s]")?];
    for (name, column) in &recording.columns {
        fields.push(number(&titled(name, &column.dimension.si_unit()))?);
    }
    for name in recording.labels.keys() {
        fields.push(text(name)?);
    }
    let schema = Type::group_type_builder("log").with_fields(fields).build()?;
    let properties = WriterProperties::builder()
        .set_created_by("teachtree".into())
        .set_compression(Compression::SNAPPY)
        .set_key_value_metadata(Some(metadata))
        .build();
    let mut writer = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    let numbers = std::iter::once(&recording.time).chain(recording.columns.values().map(|column| &column.values));
    for values in numbers {
        if let Some(mut column) = group.next_column()? {
            column.typed::<DoubleType>().write_batch(values, None, None)?;
            column.close()?;
        }
    }
    for texts in recording.labels.values() {
        if let Some(mut column) = group.next_column()? {
            let texts: Vec<ByteArray> = texts.iter().map(|text| ByteArray::from(text.as_str())).collect();
            column.typed::<ByteArrayType>().write_batch(&texts, None, None)?;
            column.close()?;
        }
    }
    group.close()?;
    writer.close()?;
    Ok(())
}
