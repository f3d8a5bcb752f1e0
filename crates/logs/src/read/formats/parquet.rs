//! Parquet: columns as they are called in the file, list columns one a place (`state[0]`, `state[1]`, …); canonical logs with their scene.
//!
//! Columns that are nested deeper, that are bytes, and lists that are longer than [`MAX_LIST`] are left out. Stamps of dates count seconds.
//! A canonical log is written with `name [unit]` as in a CSV, the scene as YAML under the key `teachtree.scene` of the file's metadata and
//! the events as JSON under `teachtree.events`; what is written is read back to the same bits.

mod arrow_metadata;
mod blocks;
pub(super) mod column;
mod flat;
pub(super) mod language;
mod numbers;
mod page_head;
pub(super) mod pictures;
pub(super) mod rewrite;
mod write;

pub use write::{add, add_table};

use super::budget::Budget;
use crate::read::csv::check_scene;
use crate::read::memory_table::{Cells, InMemoryTable, titled};
use crate::read::table::{
    Blocks, ColumnRequest, MAX_COLUMNS, Rows, Source, Table, check_cells, check_rows, check_size,
};
use ::parquet::basic::{ConvertedType, LogicalType, Type as Physical};
use ::parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use ::parquet::data_type::{ByteArray, DataType};
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::RowGroupMetaData;
use ::parquet::file::reader::{ChunkReader, FileReader, Length, SerializedFileReader};
use ::parquet::schema::types::ColumnDescriptor;
use bytes::Bytes;
use numbers::NumberForm;
use std::fs::File;
use std::io::{BufRead as _, BufReader, Read, Seek, SeekFrom};
use std::ops::Range;
use teachtree_base::error::InputError;
use teachtree_base::guard::guarded;
use teachtree_base::{json, yaml};

/// The longest list that is spread into columns.
pub const MAX_LIST: usize = 256;
/// Number of rows that are read at once.
const BATCH: usize = 8192;
/// Maximum number of rows whose memory is allocated in advance: a damaged file may promise any number.
const MAX_RESERVED: usize = 1 << 24;
/// Length of the trailer of a file, bytes.
const END: u64 = 8;
/// Keys of the metadata.
const SCENE: &str = "teachtree.scene";
const EVENTS: &str = "teachtree.events";

/// Reads a file.
///
/// # Errors
/// The file is not Parquet, is damaged, or is too large.
pub fn source(file: File, name: String) -> Result<Source, InputError> {
    let opened = ParquetTable::new(file, &name, |_| true)?;
    let (scene, events) = (opened.key(SCENE), opened.key(EVENTS));
    let titles: Vec<String> = opened.leaves.iter().map(|(_, leaf)| leaf.title()).collect();
    // The number of columns of a list is known only after reading it.
    let mut source = if opened.leaves.iter().all(|(_, leaf)| leaf.max_rep == 0) {
        Source::one(&name, titles, Box::new(opened))
    } else {
        let memory = opened.memory()?;
        Source::one(&name, memory.header(), Box::new(memory))
    };
    if let Some(text) = scene {
        let place = format!("{name} metadata {SCENE}");
        let scene = yaml::read(&text, &place)?;
        check_scene(&scene).map_err(|error| yaml::located(error, &text, &place))?;
        source.scene = Some(scene);
    }
    if let Some(text) = events {
        source.events = json::read(&text, &format!("{name} metadata {EVENTS}"))?;
    }
    Ok(source)
}

/// A file that knows its end. Of a plain file the library takes the memory that a damaged length asks for, and goes on reading nothing
/// after its end.
struct SizedFile {
    file: File,
    length: u64,
}

impl Length for SizedFile {
    fn len(&self) -> u64 {
        self.length
    }
}

impl ChunkReader for SizedFile {
    type T = ExactReader<BufReader<File>>;

    fn get_read(&self, start: u64) -> Result<Self::T, ParquetError> {
        let mut file = self.file.try_clone()?;
        file.seek(SeekFrom::Start(start))?;
        let mut bytes = BufReader::new(file);
        // The trailer is not a page.
        if start + END < self.length {
            page_head::check(bytes.fill_buf()?, Budget::new(self.length).whole).map_err(ParquetError::General)?;
        }
        Ok(ExactReader(bytes))
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes, ParquetError> {
        if start.checked_add(length as u64).is_none_or(|end| end > self.length) {
            return Err(ParquetError::EOF(format!("{length} bytes from byte {start} on are missing")));
        }
        let mut bytes = vec![0; length];
        let mut file = self.file.try_clone()?;
        file.seek(SeekFrom::Start(start))?;
        file.read_exact(&mut bytes)?;
        Ok(bytes.into())
    }
}

/// A reader whose end is an error.
struct ExactReader<R>(R);

impl<R: Read> Read for ExactReader<R> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        match self.0.read(out)? {
            0 if !out.is_empty() => Err(std::io::ErrorKind::UnexpectedEof.into()),
            count => Ok(count),
        }
    }
}

/// Reads the columns of a file whose names are wanted.
pub(super) fn read(file: File, name: &str, wanted: impl Fn(&str) -> bool) -> Result<InMemoryTable, InputError> {
    ParquetTable::new(file, name, wanted)?.memory()
}

/// Reads some rows of a file, those in `rows`.
pub(super) fn read_rows(file: File, name: &str, rows: Range<usize>) -> Result<InMemoryTable, InputError> {
    ParquetTable { range: Some(rows), ..ParquetTable::new(file, name, |_| true)? }.memory()
}

/// A file whose columns are known and not read yet.
struct ParquetTable {
    name: String,
    reader: SerializedFileReader<SizedFile>,
    /// The columns that are wanted, by their place in the file.
    leaves: Vec<(usize, Leaf)>,
    rows: usize,
    /// The selected rows; by default all.
    range: Option<Range<usize>>,
}

impl ParquetTable {
    fn new(file: File, name: &str, wanted: impl Fn(&str) -> bool) -> Result<Self, InputError> {
        guarded(name, || Self::read_head(file, name, wanted))
    }

    fn read_head(file: File, name: &str, wanted: impl Fn(&str) -> bool) -> Result<Self, InputError> {
        let length = file.metadata().map_err(|error| InputError::unreadable(name, &error))?.len();
        let reader = SerializedFileReader::new(SizedFile { file, length }).map_err(|error| damaged(name, &error))?;
        let metadata = reader.metadata().file_metadata();
        let mut leaves: Vec<(usize, Leaf)> = vec![];
        for (index, column) in metadata.schema_descr().columns().iter().enumerate() {
            leaves.extend(Leaf::new(column).filter(|leaf| wanted(&leaf.name)).map(|leaf| (index, leaf)));
        }
        if leaves.len() > MAX_COLUMNS {
            let found = leaves.len();
            return Err(InputError::new(name, format!("found {found} columns, at most {MAX_COLUMNS} are read")));
        }
        let rows = usize::try_from(metadata.num_rows())
            .map_err(|_| InputError::new(name, "it declares a negative number of rows"))?;
        // The library panics on such an offset.
        let mut chunks = reader.metadata().row_groups().iter().flat_map(RowGroupMetaData::columns);
        if chunks.any(|chunk| {
            let begins = chunk.dictionary_page_offset().unwrap_or(chunk.data_page_offset());
            begins < 0 || chunk.compressed_size() < 0
        }) {
            let message = "is damaged: a column begins before the file, or is shorter than nothing";
            return Err(InputError::new(name, message));
        }
        Ok(Self { name: name.into(), reader, leaves, rows, range: None })
    }

    /// Returns the value of a key in the file's metadata.
    fn key(&self, wanted: &str) -> Option<String> {
        let pairs = self.reader.metadata().file_metadata().key_value_metadata()?;
        pairs.iter().find(|pair| pair.key == wanted)?.value.clone()
    }

    /// Reads the columns.
    fn memory(self) -> Result<InMemoryTable, InputError> {
        let name = self.name.clone();
        guarded(&name, || self.decoded())
    }

    fn decoded(self) -> Result<InMemoryTable, InputError> {
        let Self { name, reader, mut leaves, rows, range } = self;
        let all = rows;
        let range = range.unwrap_or(0..rows);
        let rows = range.len();
        let damaged = |error: ParquetError| damaged(&name, &error);
        let wanted = |(_, leaf): &(usize, Leaf)| if leaf.unread { 0 } else { leaf.weight() };
        check_size(&name, rows, leaves.iter().map(wanted).sum())?;
        let mut before = 0_usize;
        let mut cells = 0_usize;
        for group in 0..reader.num_row_groups() {
            let group = reader.get_row_group(group).map_err(damaged)?;
            let rows_here = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
            if before.saturating_add(rows_here) > all {
                let message = format!("its row groups have more rows than the declared {all}");
                return Err(InputError::new(&name, message));
            }
            let (first, last) = (range.start.max(before), range.end.min(before + rows_here));
            let (skipped, taken) = (first.saturating_sub(before), last.saturating_sub(first));
            for (index, leaf) in leaves.iter_mut().filter(|(_, leaf)| !leaf.unread && taken > 0) {
                let mut column = group.get_column_reader(*index).map_err(damaged)?;
                skip(&mut column, skipped).map_err(damaged)?;
                let used = leaf.read(column, first - range.start, taken, rows).map_err(damaged)?;
                cells += used * leaf.weight();
                check_cells(&name, rows, cells)?;
            }
            before += rows_here;
        }
        let mut memory = InMemoryTable::new(&name);
        for (_, leaf) in leaves {
            leaf.put_into(&mut memory);
        }
        Ok(memory)
    }
}

impl Rows for ParquetTable {
    fn read(
        mut self: Box<Self>,
        header: &[String],
        wants: &[ColumnRequest],
        rate_hz: Option<f64>,
    ) -> Result<Table, InputError> {
        let nothing = wants.iter().all(|want| *want == ColumnRequest::Nothing);
        for ((_, leaf), want) in self.leaves.iter_mut().zip(wants) {
            // Rows are counted by what is read of them.
            leaf.unread = *want == ColumnRequest::Nothing && !nothing;
        }
        Box::new(self.memory()?).read(header, wants, rate_hz)
    }

    fn comes_in_blocks(&self) -> bool {
        true
    }

    fn blocks(
        self: Box<Self>,
        _: &[String],
        wants: &[ColumnRequest],
        rate_hz: Option<f64>,
    ) -> Result<Option<Box<dyn Blocks>>, InputError> {
        let texts = self
            .leaves
            .iter()
            .zip(wants)
            .any(|((_, leaf), want)| leaf.texts.is_some() && *want != ColumnRequest::Nothing);
        if texts || rate_hz.is_some() {
            return Ok(None);
        }
        check_rows(&self.name, self.rows)?;
        Ok(Some(Box::new(blocks::ParquetBlocks::new(*self, wants.to_vec()))))
    }
}

/// Passes over rows of a column.
fn skip(column: &mut ColumnReader, rows: usize) -> Result<(), ParquetError> {
    let skipped = match column {
        _ if rows == 0 => 0,
        ColumnReader::BoolColumnReader(column) => column.skip_records(rows)?,
        ColumnReader::Int32ColumnReader(column) => column.skip_records(rows)?,
        ColumnReader::Int64ColumnReader(column) => column.skip_records(rows)?,
        ColumnReader::Int96ColumnReader(column) => column.skip_records(rows)?,
        ColumnReader::FloatColumnReader(column) => column.skip_records(rows)?,
        ColumnReader::DoubleColumnReader(column) => column.skip_records(rows)?,
        ColumnReader::ByteArrayColumnReader(column) => column.skip_records(rows)?,
        ColumnReader::FixedLenByteArrayColumnReader(column) => column.skip_records(rows)?,
    };
    if skipped == rows {
        Ok(())
    } else {
        Err(ParquetError::General(format!("a column ends after {skipped} of {rows} rows")))
    }
}

/// The reason why a file cannot be read.
fn damaged(name: &str, error: &ParquetError) -> InputError {
    let error = error.to_string();
    match error.split_once("Disabled feature at compile time: ") {
        Some((_, codec)) => InputError::new(
            name,
            format!("its columns are compressed as `{codec}`, expected snappy, gzip, zstd or lz4"),
        ),
        None => InputError::new(name, format!("cannot be read as Parquet: {error}")),
    }
}

/// A column while it is read.
struct Leaf {
    name: String,
    form: NumberForm,
    unit: &'static str,
    max_def: i16,
    max_rep: i16,
    /// One list of values a place of a list; one for a plain column.
    places: Vec<Vec<f64>>,
    texts: Option<Vec<String>>,
    /// Whether no reader wants it.
    unread: bool,
}

impl Leaf {
    /// A column, if it is of a kind that a log can have.
    fn new(column: &ColumnDescriptor) -> Option<Self> {
        let mut parts: Vec<&str> = column.path().parts().iter().map(String::as_str).collect();
        let max_rep = column.max_rep_level();
        if max_rep > 1 {
            return None;
        }
        // LeRobot's language columns are not channels.
        if parts.first().is_some_and(|name| name.starts_with("language_")) && parts.len() > 1 {
            return None;
        }
        // A list is a group that repeats a group of one element; neither is part of its name.
        if max_rep == 1 && parts.len() > 2 {
            parts.truncate(parts.len() - 2);
        }
        let text = matches!(column.logical_type_ref(), Some(LogicalType::String))
            || column.converted_type() == ConvertedType::UTF8;
        let name = parts.join(".");
        let is_text = text && max_rep == 0 && column.physical_type() == Physical::BYTE_ARRAY;
        let (form, unit) = if is_text { (NumberForm::WHOLE, "") } else { NumberForm::of(column)? };
        Some(Self {
            name,
            form,
            unit,
            max_def: column.max_def_level(),
            max_rep,
            places: vec![],
            texts: is_text.then(Vec::new),
            unread: false,
        })
    }

    /// The memory of a cell in numbers. A repeated text takes little space in the file, where it is stored once.
    fn weight(&self) -> usize {
        const OF_TEXT: usize = 8;
        if self.texts.is_some() { OF_TEXT } else { 1 }
    }

    /// The name of the column, with its unit.
    fn title(&self) -> String {
        titled(&self.name, self.unit)
    }

    /// Reads the part of a row group, whose first row is `before`, of a file of `all` rows; how many cells it has.
    fn read(
        &mut self,
        mut reader: ColumnReader,
        before: usize,
        rows: usize,
        all: usize,
    ) -> Result<usize, ParquetError> {
        if self.max_rep == 0 && self.texts.is_none() {
            if self.places.is_empty() {
                self.places.push(vec![]);
            }
            let (max_def, form) = (self.max_def, self.form);
            let Some(values) = self.places.first_mut() else { return Ok(0) };
            // A length that is not true is not taken for true at once.
            values.reserve(all.min(MAX_RESERVED).saturating_sub(values.len()));
            values.resize(before, f64::NAN);
            return flat::flat(&mut reader, max_def, form, rows, values);
        }
        let form = self.form;
        match reader {
            ColumnReader::BoolColumnReader(reader) => {
                self.numbers(reader, before, rows, |value| f64::from(u8::from(*value)))
            }
            ColumnReader::Int32ColumnReader(reader) => {
                self.numbers(reader, before, rows, |value| f64::from(*value) * form.factor)
            }
            ColumnReader::Int64ColumnReader(reader) => {
                self.numbers(reader, before, rows, |value| *value as f64 * form.factor)
            }
            ColumnReader::FloatColumnReader(reader) => self.numbers(reader, before, rows, |value| f64::from(*value)),
            ColumnReader::DoubleColumnReader(reader) => self.numbers(reader, before, rows, |value| *value),
            ColumnReader::Int96ColumnReader(reader) => self.numbers(reader, before, rows, numbers::seconds_of),
            ColumnReader::FixedLenByteArrayColumnReader(reader) => {
                self.numbers(reader, before, rows, |value| form.of_bytes(value.data()))
            }
            ColumnReader::ByteArrayColumnReader(reader) if self.texts.is_none() => {
                self.numbers(reader, before, rows, |value| form.of_bytes(value.data()))
            }
            ColumnReader::ByteArrayColumnReader(reader) => {
                let mut texts = self.texts.take().unwrap_or_default();
                let used =
                    levels(reader, self.max_def, self.max_rep, before, rows, |row, _, value: Option<&ByteArray>| {
                        texts.resize(row, String::new());
                        texts.push(
                            value.map_or_else(String::new, |value| String::from_utf8_lossy(value.data()).into_owned()),
                        );
                    })?;
                self.texts = Some(texts);
                Ok(used)
            }
        }
    }

    fn numbers<T: DataType>(
        &mut self,
        reader: ColumnReaderImpl<T>,
        before: usize,
        rows: usize,
        number: impl Fn(&T::T) -> f64,
    ) -> Result<usize, ParquetError> {
        let places = &mut self.places;
        levels(reader, self.max_def, self.max_rep, before, rows, |row, place, value: Option<&T::T>| {
            // One place more than is read shows that the list is too long.
            if place > MAX_LIST {
                return;
            }
            if places.len() <= place {
                places.resize(place + 1, vec![]);
            }
            if let Some(column) = places.get_mut(place) {
                column.resize(row, f64::NAN);
                column.push(value.map_or(f64::NAN, &number));
            }
        })
    }

    fn put_into(self, memory: &mut InMemoryTable) {
        let name = self.title();
        if let Some(texts) = self.texts {
            memory.push_column(name, Cells::Texts(texts));
        } else if self.max_rep == 0 {
            memory.push_column(name, Cells::Numbers(self.places.into_iter().next().unwrap_or_default()));
        } else if self.places.len() <= MAX_LIST {
            for (place, values) in self.places.into_iter().enumerate() {
                memory.push_column(format!("{}[{place}]", self.name), Cells::Numbers(values));
            }
        }
    }
}

/// Walks over the values of a column: row, place in its list, value. How many there were.
fn levels<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    max_def: i16,
    max_rep: i16,
    before: usize,
    rows: usize,
    mut each: impl FnMut(usize, usize, Option<&T::T>),
) -> Result<usize, ParquetError> {
    let mut row = before;
    let mut used = 0;
    let (mut defs, mut reps, mut values) = (vec![], vec![], vec![]);
    while row < before + rows {
        defs.clear();
        reps.clear();
        values.clear();
        let batch = BATCH.min(before + rows - row);
        let (records, _, count) = reader.read_records(batch, Some(&mut defs), Some(&mut reps), &mut values)?;
        if records == 0 {
            return Err(ParquetError::General(format!("a column ends after {} of {rows} rows", row - before)));
        }
        let count = if max_def == 0 { values.len() } else { count };
        let mut next = values.iter();
        let (mut at, mut place) = (row, 0);
        for level in 0..count {
            let repeats = max_rep > 0 && reps.get(level).is_some_and(|rep| *rep > 0);
            if repeats {
                place += 1;
            } else {
                at = if level == 0 { row } else { at + 1 };
                place = 0;
            }
            let def = defs.get(level).copied().unwrap_or(max_def);
            if def == max_def {
                each(at, place, next.next());
            } else if max_rep == 0 {
                each(at, place, None);
            }
        }
        used += count;
        row += records;
    }
    Ok(used)
}
