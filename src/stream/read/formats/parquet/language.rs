//! The column `language_persistent` of LeRobot sets: a list of rows of language, the same on all frames of an episode.
//!
//! A file is written once more with another such column: all other columns are copied as they are stored, byte for byte, and compared
//! afterwards. Of the file's metadata the schema of Arrow is left out, which describes the columns of before; readers derive it from the file.

use super::{Whole, damaged};
use crate::base::error::InputError;
use crate::stream::read::formats::guard::guarded;
use ::parquet::basic::Compression;
use ::parquet::column::writer::{ColumnCloseResult, ColumnWriter};
use ::parquet::data_type::ByteArray;
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::{EnabledStatistics, WriterProperties};
use ::parquet::file::reader::{ChunkReader, FileReader, SerializedFileReader};
use ::parquet::file::writer::SerializedFileWriter;
use ::parquet::record::{Field, Row as Record};
use ::parquet::schema::parser::parse_message_type;
use ::parquet::schema::types::Type;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::sync::Arc;

/// The name of the column.
pub const COLUMN: &str = "language_persistent";
/// The column that says of which episode a frame is.
const EPISODE: &str = "episode_index";
/// How many frames are written at once.
const BATCH: usize = 1024;
/// Metadata that describes the columns of before.
const ARROW: &str = "ARROW:schema";
/// Metadata of the Python package `datasets`.
const DATASETS: &str = "huggingface";

/// The type of the column.
const SCHEMA: &str = "message schema {
  optional group language_persistent (LIST) { repeated group list { optional group element {
    required binary role (STRING); optional binary content (STRING); optional binary style (STRING);
    required float timestamp; optional binary camera (STRING);
    optional group tool_calls (LIST) { repeated group list { optional binary element (STRING); } }
  } } }
}";

/// A row of language: what holds from a time on.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Who says it: `assistant`, `user`.
    pub role: String,
    /// What is said.
    pub content: Option<String>,
    /// The kind: `motion`, `subtask`, `plan`, …
    pub style: Option<String>,
    /// From when on it holds, s of the episode.
    pub timestamp: f32,
    /// The camera that it is about.
    pub camera: Option<String>,
    /// Calls of tools, each JSON.
    pub tool_calls: Option<Vec<Option<String>>>,
}

/// Rows of language by the number of the episode.
pub type Episodes = BTreeMap<usize, Vec<Row>>;

fn open(file: File, name: &str) -> Result<(Whole, SerializedFileReader<Whole>), InputError> {
    let length = file.metadata().map_err(|error| InputError::unreadable(name, &error))?.len();
    let again = file.try_clone().map_err(|error| InputError::unreadable(name, &error))?;
    let reader = SerializedFileReader::new(Whole { file, length }).map_err(|error| damaged(name, &error))?;
    Ok((Whole { file: again, length }, reader))
}

/// Reads the rows of language of a file, those of the first frame of each episode; `None` where the file has no such column.
///
/// # Errors
/// When the file is damaged, or the column is not of its type.
pub fn read(file: File, name: &str) -> Result<Option<Episodes>, InputError> {
    guarded(name, || {
        let (_, reader) = open(file, name)?;
        let failed = |error: ParquetError| damaged(name, &error);
        let root = reader.metadata().file_metadata().schema();
        let wanted = |field: &&Arc<Type>| [COLUMN, EPISODE].contains(&field.name());
        let fields: Vec<Arc<Type>> = root.get_fields().iter().filter(wanted).cloned().collect();
        if !fields.iter().any(|field| field.name() == COLUMN) {
            return Ok(None);
        }
        let projection = Type::group_type_builder(root.name()).with_fields(fields).build().map_err(failed)?;
        let mut episodes = Episodes::new();
        for record in reader.get_row_iter(Some(projection)).map_err(failed)? {
            let record = record.map_err(failed)?;
            let (mut episode, mut language) = (None, None);
            for (field, value) in record.get_column_iter() {
                match value {
                    Field::Long(number) if field == EPISODE => episode = usize::try_from(*number).ok(),
                    Field::Int(number) if field == EPISODE => episode = usize::try_from(*number).ok(),
                    value if field == COLUMN => language = Some(value),
                    _ => {}
                }
            }
            let (Some(episode), Some(language)) = (episode, language) else {
                return Err(InputError::new(name, format!("a frame has no `{EPISODE}`, expected a whole number")));
            };
            if let std::collections::btree_map::Entry::Vacant(place) = episodes.entry(episode) {
                let rows = rows(language).ok_or_else(|| {
                    let message = format!("the column `{COLUMN}` has another type than LeRobot 3.0 gives it");
                    InputError::new(name, message).help("delete the column and its feature in meta/info.json first")
                })?;
                place.insert(rows);
            }
        }
        Ok(Some(episodes))
    })
}

/// The rows in a list; `None` where it is none.
fn rows(list: &Field) -> Option<Vec<Row>> {
    match list {
        Field::Null => Some(vec![]),
        Field::ListInternal(list) => list
            .elements()
            .iter()
            .map(|element| match element {
                Field::Group(record) => row(record),
                _ => None,
            })
            .collect(),
        _ => None,
    }
}

fn row(record: &Record) -> Option<Row> {
    let mut row =
        Row { role: String::new(), content: None, style: None, timestamp: 0.0, camera: None, tool_calls: None };
    for (name, value) in record.get_column_iter() {
        let text = match value {
            Field::Str(text) => Some(text.clone()),
            _ => None,
        };
        match (name.as_str(), value) {
            ("role", _) => row.role = text?,
            ("content", Field::Str(_)) => row.content = text,
            ("style", Field::Str(_)) => row.style = text,
            ("camera", Field::Str(_)) => row.camera = text,
            ("timestamp", Field::Float(time)) => row.timestamp = *time,
            ("timestamp", Field::Double(time)) => row.timestamp = *time as f32,
            ("tool_calls", Field::ListInternal(calls)) => {
                let call = |call: &Field| match call {
                    Field::Null => Some(None),
                    Field::Str(text) => Some(Some(text.clone())),
                    _ => None,
                };
                row.tool_calls = Some(calls.elements().iter().map(call).collect::<Option<_>>()?);
            }
            (_, Field::Null) => {}
            _ => return None,
        }
    }
    Some(row)
}

/// Writes a file once more, with these rows of language instead of those that it has, and with more metadata. Episodes without rows have an empty
/// list.
///
/// # Errors
/// When the file is damaged, or `out` cannot be written.
pub fn write(
    file: File,
    name: &str,
    language: &Episodes,
    keys: &[(&str, String)],
    out: &mut (dyn Write + Send),
) -> Result<(), InputError> {
    let episodes = episodes(&file, name)?;
    guarded(name, || {
        let (whole, reader) = open(file, name)?;
        copy(&whole, &reader, language, &episodes, keys, out).map_err(|error| damaged(name, &error))
    })
}

/// The episode of each frame.
fn episodes(file: &File, name: &str) -> Result<Vec<usize>, InputError> {
    let file = file.try_clone().map_err(|error| InputError::unreadable(name, &error))?;
    let memory = super::read(file, name, |column| column == EPISODE)?;
    let numbers = match memory.columns().get(EPISODE) {
        Some(super::Cells::Numbers(numbers)) => numbers.as_slice(),
        _ => return Err(InputError::new(name, format!("the column `{EPISODE}` is not there"))),
    };
    let whole = |number: &f64| (0.0..1e9).contains(number).then_some(number.round() as usize);
    numbers
        .iter()
        .map(whole)
        .collect::<Option<_>>()
        .ok_or_else(|| InputError::new(name, format!("a frame has no `{EPISODE}`, expected a whole number from 0 on")))
}

fn copy(
    whole: &Whole,
    reader: &SerializedFileReader<Whole>,
    language: &Episodes,
    episodes: &[usize],
    keys: &[(&str, String)],
    out: &mut (dyn Write + Send),
) -> Result<(), ParquetError> {
    let metadata = reader.metadata();
    let root = metadata.file_metadata().schema();
    let mut fields: Vec<Arc<Type>> = root.get_fields().iter().filter(|field| field.name() != COLUMN).cloned().collect();
    fields.extend(parse_message_type(SCHEMA)?.get_fields().iter().cloned());
    let schema = Arc::new(Type::group_type_builder(root.name()).with_fields(fields).build()?);
    let mut pairs: Vec<KeyValue> = metadata.file_metadata().key_value_metadata().cloned().unwrap_or_default();
    pairs.retain(|pair| pair.key != ARROW && !keys.iter().any(|(key, _)| *key == pair.key));
    for pair in pairs.iter_mut().filter(|pair| pair.key == DATASETS) {
        pair.value = pair.value.take().map(|text| with_feature(&text).unwrap_or(text));
    }
    pairs.extend(keys.iter().map(|(key, value)| KeyValue::new((*key).to_string(), value.clone())));
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_offset_index_disabled(true)
        .set_key_value_metadata(Some(pairs))
        .set_created_by(format!("teachtree version {}", env!("CARGO_PKG_VERSION")))
        .build();
    let mut writer = SerializedFileWriter::new(out, schema, Arc::new(properties))?;
    let mut before = 0;
    for group in metadata.row_groups() {
        let count = usize::try_from(group.num_rows()).unwrap_or(0);
        let mut part = writer.next_row_group()?;
        for column in group.columns().iter().filter(|column| !is_language(column.column_path().parts())) {
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
        let frames = episodes.get(before..before + count).ok_or_else(|| {
            ParquetError::General(format!("a part has {count} rows where the file ends after {}", episodes.len()))
        })?;
        before += count;
        for leaf in LEAVES {
            let Some(mut column) = part.next_column()? else { break };
            for frames in frames.chunks(BATCH) {
                let mut levels = Levels::default();
                for frame in frames {
                    levels.frame(leaf, language.get(frame).map_or(&[], Vec::as_slice));
                }
                levels.write(column.untyped())?;
            }
            column.close()?;
        }
        part.close()?;
    }
    writer.close()?;
    Ok(())
}

fn is_language(path: &[String]) -> bool {
    path.first().is_some_and(|name| name == COLUMN)
}

/// The feature list of `datasets` with the column; `None` for what is no such list.
fn with_feature(text: &str) -> Option<String> {
    let mut whole: Value = serde_json::from_str(text).ok()?;
    let features = whole.get_mut("info")?.get_mut("features")?.as_object_mut()?;
    let plain = |dtype: &str| json!({ "dtype": dtype, "_type": "Value" });
    // Before version 4 a list was written as a list.
    let list =
        |of: Value| if text.contains("\"List\"") { json!({ "feature": of, "_type": "List" }) } else { json!([of]) };
    let row = json!({
        "role": plain("string"), "content": plain("string"), "style": plain("string"), "timestamp": plain("float32"),
        "camera": plain("string"), "tool_calls": list(plain("string")),
    });
    features.shift_remove(COLUMN);
    features.insert(COLUMN.into(), list(row));
    serde_json::to_string(&whole).ok()
}

/// What is stored apart of a row of language.
#[derive(Clone, Copy)]
enum Leaf {
    Text(fn(&Row) -> Option<&str>, /** What is defined where there is one. */ i16),
    Time,
    Calls,
}

/// The order of the schema.
const LEAVES: [Leaf; 6] = [
    Leaf::Text(|row| Some(&row.role), 3),
    Leaf::Text(|row| row.content.as_deref(), 4),
    Leaf::Text(|row| row.style.as_deref(), 4),
    Leaf::Time,
    Leaf::Text(|row| row.camera.as_deref(), 4),
    Leaf::Calls,
];
/// What is defined: an empty list, a row of it, the list of calls in it, and a call.
const EMPTY: i16 = 1;
const ROW: i16 = 3;
const CALLS: i16 = 4;
const NO_CALL: i16 = 5;
const CALL: i16 = 6;

/// Values with their levels, as Parquet nests them.
#[derive(Default)]
struct Levels {
    texts: Vec<ByteArray>,
    times: Vec<f32>,
    defined: Vec<i16>,
    repeated: Vec<i16>,
}

impl Levels {
    fn level(&mut self, defined: i16, repeated: i16) {
        self.defined.push(defined);
        self.repeated.push(repeated);
    }

    fn frame(&mut self, leaf: Leaf, rows: &[Row]) {
        if rows.is_empty() {
            self.level(EMPTY, 0);
        }
        for (at, row) in rows.iter().enumerate() {
            let repeated = i16::from(at > 0);
            match leaf {
                Leaf::Text(of, whole) => {
                    let text = of(row);
                    self.level(if text.is_some() { whole } else { ROW }, repeated);
                    self.texts.extend(text.map(|text| ByteArray::from(text.as_bytes().to_vec())));
                }
                Leaf::Time => {
                    self.level(ROW, repeated);
                    self.times.push(row.timestamp);
                }
                Leaf::Calls => match row.tool_calls.as_deref() {
                    None => self.level(ROW, repeated),
                    Some([]) => self.level(CALLS, repeated),
                    Some(calls) => {
                        for (place, call) in calls.iter().enumerate() {
                            let repeated = if place > 0 { 2 } else { repeated };
                            self.level(if call.is_some() { CALL } else { NO_CALL }, repeated);
                            self.texts.extend(call.iter().map(|call| ByteArray::from(call.as_bytes().to_vec())));
                        }
                    }
                },
            }
        }
    }

    fn write(&self, column: &mut ColumnWriter<'_>) -> Result<(), ParquetError> {
        let (defined, repeated) = (Some(self.defined.as_slice()), Some(self.repeated.as_slice()));
        match column {
            ColumnWriter::ByteArrayColumnWriter(writer) => writer.write_batch(&self.texts, defined, repeated),
            ColumnWriter::FloatColumnWriter(writer) => writer.write_batch(&self.times, defined, repeated),
            _ => return Err(ParquetError::General("a column of language has another type".into())),
        }
        .map(|_| ())
    }
}

/// Compares a copy with the file that it was made from: all columns but that of language are stored in it byte for byte, and it has these rows.
///
/// # Errors
/// The first difference.
pub fn compare(file: File, copy: File, name: &str, language: &Episodes) -> Result<(), InputError> {
    let episodes = episodes(&file, name)?;
    let written = copy.try_clone().map_err(|error| InputError::unreadable(name, &error))?;
    guarded(name, || {
        let ((one, ours), (other, theirs)) = (open(file, name)?, open(copy, name)?);
        let failed = |error: ParquetError| damaged(name, &error);
        let wrong = |what: &str| InputError::new(name, format!("the copy differs from the data set in {what}"));
        let (ours, theirs) = (ours.metadata(), theirs.metadata());
        if ours.num_row_groups() != theirs.num_row_groups() {
            return Err(wrong("its parts"));
        }
        for (mine, yours) in ours.row_groups().iter().zip(theirs.row_groups()) {
            let others = |column: &&_| -> bool { !is_language(path_of(column)) };
            let (mut mine, mut yours) = (mine.columns().iter().filter(others), yours.columns().iter().filter(others));
            loop {
                let (column, copied) = match (mine.next(), yours.next()) {
                    (None, None) => break,
                    (Some(column), Some(copied)) => (column, copied),
                    _ => return Err(wrong("its columns")),
                };
                let bytes = |of: &Whole, column: &::parquet::file::metadata::ColumnChunkMetaData| {
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
        Ok(())
    })?;
    let mut known: Vec<usize> = episodes;
    known.dedup();
    let read = read(written, name)?.unwrap_or_default();
    match known.iter().find(|episode| read.get(*episode) != Some(language.get(*episode).unwrap_or(&vec![]))) {
        None => Ok(()),
        Some(episode) => {
            Err(InputError::new(name, format!("the copy has other language than was written in episode {episode}")))
        }
    }
}

fn path_of(column: &::parquet::file::metadata::ColumnChunkMetaData) -> &[String] {
    column.column_path().parts()
}
