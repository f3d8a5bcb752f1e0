//! Columns that are written into copies of Parquet files: a value a row, in the types that LeRobot sets have.

use super::language::{self, Row};
use ::parquet::basic::{LogicalType, Repetition, Type as Physical};
use ::parquet::column::writer::ColumnWriter;
use ::parquet::data_type::ByteArray;
use ::parquet::errors::ParquetError;
use ::parquet::file::writer::{SerializedColumnWriter, SerializedRowGroupWriter};
use ::parquet::record::Field as Stored;
use ::parquet::schema::types::Type;
use arrow_schema::{DataType, Field};
use serde_json::{Value, json};
use std::io::Write;
use std::ops::Range;
use std::sync::Arc;

/// A column with a value for each row of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Column<'a> {
    /// Its name.
    pub name: String,
    /// Its values.
    pub values: Values<'a>,
}

/// The values of a column, one a row; lists that are `None` are lacking.
#[derive(Clone, Debug, PartialEq)]
pub enum Values<'a> {
    /// Rows of language.
    Language(Vec<&'a [Row]>),
    /// Truths.
    Flags(Vec<bool>),
    /// Numbers of 32 bits.
    Floats(Vec<f32>),
    /// The length of vectors, and their numbers of 32 bits, one vector after the other.
    FloatVectors(usize, Vec<f32>),
    /// Files of pictures.
    Pictures(Vec<Vec<u8>>),
    /// Whole numbers.
    Integers(Vec<i64>),
    /// Texts.
    Texts(Vec<String>),
    /// Lists of texts.
    TextLists(Vec<Option<Vec<String>>>),
    /// Lists of whole numbers.
    IntegerLists(Vec<Option<Vec<i64>>>),
    /// Lists of numbers.
    NumberLists(Vec<Option<Vec<f64>>>),
}

/// The definition levels of a list: null, empty, and an element.
const NO_LIST: i16 = 0;
const EMPTY: i16 = 1;
const ELEMENT: i16 = 3;

impl Column<'_> {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        match &self.values {
            Values::Language(values) => values.len(),
            Values::Flags(values) => values.len(),
            Values::Floats(values) => values.len(),
            Values::FloatVectors(width, values) => values.len() / (*width).max(1),
            Values::Pictures(values) => values.len(),
            Values::Integers(values) => values.len(),
            Values::Texts(values) => values.len(),
            Values::TextLists(values) => values.len(),
            Values::IntegerLists(values) => values.len(),
            Values::NumberLists(values) => values.len(),
        }
    }

    /// Its type in Parquet.
    pub(super) fn schema(&self) -> Result<Arc<Type>, ParquetError> {
        let primitive = |name: &str, physical, logical| {
            let built = Type::primitive_type_builder(name, physical).with_repetition(Repetition::OPTIONAL);
            built.with_logical_type(logical).build().map(Arc::new)
        };
        let list = |physical, logical| {
            let element = primitive("element", physical, logical)?;
            let inner = Type::group_type_builder("list").with_repetition(Repetition::REPEATED);
            let inner = Arc::new(inner.with_fields(vec![element]).build()?);
            let outer = Type::group_type_builder(&self.name).with_repetition(Repetition::OPTIONAL);
            outer.with_logical_type(Some(LogicalType::List)).with_fields(vec![inner]).build().map(Arc::new)
        };
        let text = Some(LogicalType::String);
        match &self.values {
            Values::Language(_) => language::schema(),
            Values::Flags(_) => primitive(&self.name, Physical::BOOLEAN, None),
            Values::Floats(_) => primitive(&self.name, Physical::FLOAT, None),
            Values::FloatVectors(..) => list(Physical::FLOAT, None),
            Values::Pictures(_) => {
                let parts = vec![
                    primitive("bytes", Physical::BYTE_ARRAY, None)?,
                    primitive("path", Physical::BYTE_ARRAY, text)?,
                ];
                let group = Type::group_type_builder(&self.name).with_repetition(Repetition::OPTIONAL);
                group.with_fields(parts).build().map(Arc::new)
            }
            Values::Integers(_) => primitive(&self.name, Physical::INT64, None),
            Values::Texts(_) => primitive(&self.name, Physical::BYTE_ARRAY, text),
            Values::TextLists(_) => list(Physical::BYTE_ARRAY, text),
            Values::IntegerLists(_) => list(Physical::INT64, None),
            Values::NumberLists(_) => list(Physical::DOUBLE, None),
        }
    }

    /// Its type in Arrow.
    pub(super) fn field(&self) -> Field {
        let list = |of| DataType::List(Arc::new(Field::new("element", of, true)));
        let of = match &self.values {
            Values::Language(_) => language::arrow_type(),
            Values::Flags(_) => DataType::Boolean,
            Values::Floats(_) => DataType::Float32,
            Values::FloatVectors(..) => list(DataType::Float32),
            Values::Pictures(_) => {
                let (bytes, path) = (DataType::Binary, DataType::Utf8);
                DataType::Struct(vec![Field::new("bytes", bytes, true), Field::new("path", path, true)].into())
            }
            Values::Integers(_) => DataType::Int64,
            Values::Texts(_) => DataType::Utf8,
            Values::TextLists(_) => list(DataType::Utf8),
            Values::IntegerLists(_) => list(DataType::Int64),
            Values::NumberLists(_) => list(DataType::Float64),
        };
        Field::new(&self.name, of, true)
    }

    /// Its feature for the Python package `datasets`; before version 4 a list was written as a list.
    pub(super) fn feature(&self, has_lists: bool) -> Value {
        let plain = |dtype: &str| json!({ "dtype": dtype, "_type": "Value" });
        let list = |of: Value| if has_lists { json!({ "feature": of, "_type": "List" }) } else { json!([of]) };
        match &self.values {
            Values::Language(_) => {
                let calls = list(plain("string"));
                list(json!({
                    "role": plain("string"), "content": plain("string"), "style": plain("string"),
                    "timestamp": plain("float32"), "camera": plain("string"), "tool_calls": calls,
                }))
            }
            Values::Flags(_) => plain("bool"),
            Values::Floats(_) => plain("float32"),
            Values::FloatVectors(width, _) => {
                json!({ "feature": plain("float32"), "length": width, "_type": "List" })
            }
            Values::Pictures(_) => json!({ "_type": "Image" }),
            Values::Integers(_) => plain("int64"),
            Values::Texts(_) => plain("string"),
            Values::TextLists(_) => list(plain("string")),
            Values::IntegerLists(_) => list(plain("int64")),
            Values::NumberLists(_) => list(plain("float64")),
        }
    }

    /// Writes the values of these rows, the next ones of a group.
    pub(super) fn write<W: Write + Send>(
        &self,
        rows: Range<usize>,
        group: &mut SerializedRowGroupWriter<'_, W>,
    ) -> Result<(), ParquetError> {
        let short = || ParquetError::General(format!("the column `{}` ends too early", self.name));
        match &self.values {
            Values::Language(values) => language::write(values.get(rows).ok_or_else(short)?, group),
            Values::Flags(values) => flat(next(group)?, values.get(rows).ok_or_else(short)?, flags),
            Values::Floats(values) => flat(next(group)?, values.get(rows).ok_or_else(short)?, floats),
            Values::FloatVectors(width, values) => {
                let values = values.get(rows.start * width..rows.end * width).ok_or_else(short)?;
                vectors(next(group)?, *width, values)
            }
            Values::Pictures(values) => pictures(group, values.get(rows).ok_or_else(short)?),
            Values::Integers(values) => flat(next(group)?, values.get(rows).ok_or_else(short)?, wholes),
            Values::Texts(values) => flat(next(group)?, values.get(rows).ok_or_else(short)?, texts),
            Values::TextLists(values) => lists(next(group)?, values.get(rows).ok_or_else(short)?, texts),
            Values::IntegerLists(values) => lists(next(group)?, values.get(rows).ok_or_else(short)?, wholes),
            Values::NumberLists(values) => lists(next(group)?, values.get(rows).ok_or_else(short)?, numbers),
        }
    }

    /// Whether a row is stored as it was to be written.
    pub(super) fn is_stored(&self, row: usize, stored: &Stored) -> bool {
        fn same<T>(values: Option<&Option<Vec<T>>>, stored: &Stored, equal: impl Fn(&T, &Stored) -> bool) -> bool {
            match (values, stored) {
                (Some(None), Stored::Null) => true,
                (Some(Some(values)), Stored::ListInternal(list)) => {
                    let elements = list.elements();
                    elements.len() == values.len() && values.iter().zip(elements).all(|(one, other)| equal(one, other))
                }
                _ => false,
            }
        }
        let is_text = |text: &String, stored: &Stored| matches!(stored, Stored::Str(other) if other == text);
        let is_float = |number: &f32, stored: &Stored| matches!(stored, Stored::Float(other) if other.to_bits() == number.to_bits());
        let is_whole = |number: &i64, stored: &Stored| matches!(stored, Stored::Long(other) if other == number);
        let is_number = |number: &f64, stored: &Stored| matches!(stored, Stored::Double(other) if other.to_bits() == number.to_bits());
        match &self.values {
            Values::Language(values) => {
                values.get(row).is_some_and(|rows| language::rows(stored).as_deref() == Some(*rows))
            }
            Values::Flags(values) => {
                matches!((values.get(row), stored), (Some(one), Stored::Bool(other)) if one == other)
            }
            Values::Floats(values) => values.get(row).is_some_and(|value| is_float(value, stored)),
            Values::FloatVectors(width, values) => {
                let vector = values.get(row * width..(row + 1) * width).map(|vector| Some(vector.to_vec()));
                same(vector.as_ref(), stored, is_float)
            }
            Values::Pictures(values) => match stored {
                Stored::Group(record) => {
                    let bytes = record.get_column_iter().find(|(name, _)| *name == "bytes").map(|(_, value)| value);
                    matches!((values.get(row), bytes), (Some(one), Some(Stored::Bytes(other))) if other.data() == one)
                }
                _ => false,
            },
            Values::Integers(values) => values.get(row).is_some_and(|value| is_whole(value, stored)),
            Values::Texts(values) => values.get(row).is_some_and(|value| is_text(value, stored)),
            Values::TextLists(values) => same(values.get(row), stored, is_text),
            Values::IntegerLists(values) => same(values.get(row), stored, is_whole),
            Values::NumberLists(values) => same(values.get(row), stored, is_number),
        }
    }
}

/// The next stored column of a group.
pub(super) fn next<'a, W: Write + Send>(
    group: &'a mut SerializedRowGroupWriter<'_, W>,
) -> Result<SerializedColumnWriter<'a>, ParquetError> {
    group.next_column()?.ok_or_else(|| ParquetError::General("a column is missing".into()))
}

/// Writes values with their levels into a column.
type WriterFn<T> = fn(&mut ColumnWriter<'_>, &[T], &[i16], Option<&[i16]>) -> Result<usize, ParquetError>;

fn flags(
    column: &mut ColumnWriter<'_>,
    values: &[bool],
    defined: &[i16],
    repeated: Option<&[i16]>,
) -> Result<usize, ParquetError> {
    match column {
        ColumnWriter::BoolColumnWriter(writer) => writer.write_batch(values, Some(defined), repeated),
        _ => Err(other_type()),
    }
}

fn floats(
    column: &mut ColumnWriter<'_>,
    values: &[f32],
    defined: &[i16],
    repeated: Option<&[i16]>,
) -> Result<usize, ParquetError> {
    match column {
        ColumnWriter::FloatColumnWriter(writer) => writer.write_batch(values, Some(defined), repeated),
        _ => Err(other_type()),
    }
}

fn wholes(
    column: &mut ColumnWriter<'_>,
    values: &[i64],
    defined: &[i16],
    repeated: Option<&[i16]>,
) -> Result<usize, ParquetError> {
    match column {
        ColumnWriter::Int64ColumnWriter(writer) => writer.write_batch(values, Some(defined), repeated),
        _ => Err(other_type()),
    }
}

fn numbers(
    column: &mut ColumnWriter<'_>,
    values: &[f64],
    defined: &[i16],
    repeated: Option<&[i16]>,
) -> Result<usize, ParquetError> {
    match column {
        ColumnWriter::DoubleColumnWriter(writer) => writer.write_batch(values, Some(defined), repeated),
        _ => Err(other_type()),
    }
}

fn texts(
    column: &mut ColumnWriter<'_>,
    values: &[String],
    defined: &[i16],
    repeated: Option<&[i16]>,
) -> Result<usize, ParquetError> {
    let values: Vec<ByteArray> = values.iter().map(|text| ByteArray::from(text.as_bytes().to_vec())).collect();
    match column {
        ColumnWriter::ByteArrayColumnWriter(writer) => writer.write_batch(&values, Some(defined), repeated),
        _ => Err(other_type()),
    }
}

fn other_type() -> ParquetError {
    ParquetError::General("a column has another type".into())
}

fn flat<T>(mut column: SerializedColumnWriter<'_>, values: &[T], put: WriterFn<T>) -> Result<(), ParquetError> {
    put(column.untyped(), values, &vec![1; values.len()], None)?;
    column.close()
}

/// Vectors of one length.
fn vectors(mut column: SerializedColumnWriter<'_>, width: usize, values: &[f32]) -> Result<(), ParquetError> {
    let repeated: Vec<i16> = (0..values.len()).map(|at| i16::from(at % width.max(1) > 0)).collect();
    floats(column.untyped(), values, &vec![ELEMENT; values.len()], Some(&repeated))?;
    column.close()
}

/// Pictures without paths.
fn pictures<W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    values: &[Vec<u8>],
) -> Result<(), ParquetError> {
    // The definition levels: the group and its bytes, and the group without a path.
    const BYTES: i16 = 2;
    const GROUP: i16 = 1;
    let mut column = next(group)?;
    for value in values {
        match column.untyped() {
            ColumnWriter::ByteArrayColumnWriter(writer) => {
                writer.write_batch(&[ByteArray::from(value.clone())], Some(&[BYTES]), None)?
            }
            _ => return Err(other_type()),
        };
    }
    column.close()?;
    let mut column = next(group)?;
    match column.untyped() {
        ColumnWriter::ByteArrayColumnWriter(writer) => {
            writer.write_batch(&[], Some(&vec![GROUP; values.len()]), None)?
        }
        _ => return Err(other_type()),
    };
    column.close()
}

fn lists<T: Clone>(
    mut column: SerializedColumnWriter<'_>,
    values: &[Option<Vec<T>>],
    put: WriterFn<T>,
) -> Result<(), ParquetError> {
    let (mut all, mut defined, mut repeated) = (vec![], vec![], vec![]);
    for list in values {
        match list.as_deref() {
            None | Some([]) => {
                defined.push(if list.is_some() { EMPTY } else { NO_LIST });
                repeated.push(0);
            }
            Some(list) => {
                defined.resize(defined.len() + list.len(), ELEMENT);
                repeated.extend((0..list.len()).map(|at| i16::from(at > 0)));
                all.extend_from_slice(list);
            }
        }
    }
    put(column.untyped(), &all, &defined, Some(&repeated))?;
    column.close()
}
