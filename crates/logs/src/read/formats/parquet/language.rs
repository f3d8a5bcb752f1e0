//! The column `language_persistent` of LeRobot sets: a list of rows of language, the same on all frames of an episode.

use super::column::next;
use super::damaged;
use super::rewrite::open;
use ::parquet::column::writer::ColumnWriter;
use ::parquet::data_type::ByteArray;
use ::parquet::errors::ParquetError;
use ::parquet::file::reader::FileReader;
use ::parquet::file::writer::SerializedRowGroupWriter;
use ::parquet::record::{Field, Row as Record};
use ::parquet::schema::parser::parse_message_type;
use ::parquet::schema::types::Type;
use arrow_schema::{DataType, Field as Of};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::sync::Arc;
use teachtree_base::error::InputError;
use teachtree_base::guard::guarded;

/// The name of the column.
pub const COLUMN: &str = "language_persistent";
/// The column that says of which episode a frame is.
const EPISODE: &str = "episode_index";
/// Number of frames that are written at once.
const BATCH: usize = 1024;
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
    /// The role of the speaker: `assistant`, `user`.
    pub role: String,
    /// The text.
    pub content: Option<String>,
    /// The kind: `motion`, `subtask`, `plan`, …
    pub style: Option<String>,
    /// The time from which it holds, s of the episode.
    pub timestamp: f32,
    /// The camera that it is about.
    pub camera: Option<String>,
    /// Calls of tools, each JSON.
    pub tool_calls: Option<Vec<Option<String>>>,
}

/// Rows of language by the number of the episode.
pub type Episodes = BTreeMap<usize, Vec<Row>>;

/// Its type in Parquet.
pub(super) fn schema() -> Result<Arc<Type>, ParquetError> {
    let fields = parse_message_type(SCHEMA)?.get_fields().to_vec();
    fields.into_iter().next().ok_or_else(|| ParquetError::General("the schema of language has no field".into()))
}

/// Its type in Arrow.
pub(super) fn arrow_type() -> DataType {
    let list = |of: DataType| DataType::List(Arc::new(Of::new("element", of, true)));
    let text = |name: &str| Of::new(name, DataType::Utf8, true);
    let role = Of::new("role", DataType::Utf8, false);
    let timestamp = Of::new("timestamp", DataType::Float32, false);
    let calls = Of::new("tool_calls", list(DataType::Utf8), true);
    list(DataType::Struct(vec![role, text("content"), text("style"), timestamp, text("camera"), calls].into()))
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
pub(super) fn rows(list: &Field) -> Option<Vec<Row>> {
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

/// The columns of a row of language.
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
/// The definition levels: an empty list, a row of it, the list of calls in it, and a call.
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

/// Writes the rows of language of these frames, the next ones of a group.
pub(super) fn write<W: Write + Send>(
    frames: &[&[Row]],
    group: &mut SerializedRowGroupWriter<'_, W>,
) -> Result<(), ParquetError> {
    for leaf in LEAVES {
        let mut column = next(group)?;
        for frames in frames.chunks(BATCH) {
            let mut levels = Levels::default();
            frames.iter().for_each(|rows| levels.frame(leaf, rows));
            levels.write(column.untyped())?;
        }
        column.close()?;
    }
    Ok(())
}
