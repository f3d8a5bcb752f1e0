//! Tables in and out through the Arrow C interface, which every library of tables speaks; none of them has to be installed.

use crate::error::raised;
use arrow_array::cast::AsArray;
use arrow_array::ffi_stream::{FFI_ArrowArrayStream, RecordBatchStreamReader};
use arrow_array::types::{
    ArrowPrimitiveType, Decimal32Type, Decimal64Type, Decimal128Type, Decimal256Type, DurationMicrosecondType,
    DurationMillisecondType, DurationNanosecondType, DurationSecondType, Float16Type, Float32Type, Float64Type,
    Int8Type, Int16Type, Int32Type, Int64Type, TimestampMicrosecondType, TimestampMillisecondType,
    TimestampNanosecondType, TimestampSecondType, UInt8Type, UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef, Float64Array, RecordBatch, RecordBatchIterator, RecordBatchReader};
use arrow_schema::ffi::FFI_ArrowSchema;
use arrow_schema::{DataType, TimeUnit};
use pyo3::exceptions::{PyKeyError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCapsule, PyCapsuleMethods, PyList};
use std::collections::BTreeMap;
use std::ffi::CStr;
use std::sync::Arc;
use teachtree::Column;

const STREAM: &CStr = c"arrow_array_stream";
const SCHEMA: &CStr = c"arrow_schema";
/// The longest list in a cell that becomes columns, as of Parquet files.
const LONGEST: usize = 4096;

/// A table.
#[pyclass(frozen, module = "teachtree._teachtree")]
pub struct Table(pub RecordBatch);

#[pymethods]
impl Table {
    /// The table as a stream of the Arrow C interface.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        // The interface lets a producer ignore the request.
        drop(requested_schema);
        let batches = RecordBatchIterator::new([Ok(self.0.clone())], self.0.schema());
        PyCapsule::new_with_value(py, FFI_ArrowArrayStream::new(Box::new(batches)), STREAM)
    }

    /// The schema by the Arrow C interface.
    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let schema = FFI_ArrowSchema::try_from(self.0.schema().as_ref());
        let schema = schema.map_err(|error| raised(py, "internal", "teachtree", &error.to_string(), None))?;
        PyCapsule::new_with_value(py, schema, SCHEMA)
    }

    /// Number of rows.
    fn __len__(&self) -> usize {
        self.0.num_rows()
    }

    /// The names of the columns.
    #[getter]
    fn column_names(&self) -> Vec<String> {
        self.0.schema().fields().iter().map(|field| field.name().clone()).collect()
    }

    /// A column: `("d" or "q", bytes)` of doubles or 64-bit integers, else `("", list)`.
    fn column<'py>(&self, py: Python<'py>, name: &str) -> PyResult<(&'static str, Bound<'py, PyAny>)> {
        let array = self.0.column_by_name(name).ok_or_else(|| PyKeyError::new_err(name.to_string()))?;
        if let Some(values) = array.as_primitive_opt::<Float64Type>().filter(|array| array.null_count() == 0) {
            return Ok(("d", PyBytes::new(py, values.values().inner().as_slice()).into_any()));
        }
        if let Some(values) = array.as_primitive_opt::<Int64Type>().filter(|array| array.null_count() == 0) {
            return Ok(("q", PyBytes::new(py, values.values().inner().as_slice()).into_any()));
        }
        Ok(("", list(py, array)?.into_any()))
    }
}

/// The values of an array of a kind that [`tables`](crate::tables) has.
fn list<'py>(py: Python<'py>, array: &ArrayRef) -> PyResult<Bound<'py, PyList>> {
    match array.data_type() {
        DataType::Utf8 => PyList::new(py, array.as_string::<i32>().iter()),
        DataType::Boolean => PyList::new(py, array.as_boolean().iter()),
        DataType::Float64 => PyList::new(py, array.as_primitive::<Float64Type>().iter()),
        DataType::Int64 => PyList::new(py, array.as_primitive::<Int64Type>().iter()),
        DataType::List(_) => {
            let all = PyList::empty(py);
            for inner in array.as_list::<i32>().iter() {
                match inner {
                    Some(inner) => all.append(list(py, &inner)?)?,
                    None => all.append(py.None())?,
                }
            }
            Ok(all)
        }
        other => Err(PyTypeError::new_err(format!("{other} cannot be converted to a list"))),
    }
}

/// The stream of a table of another library.
///
/// # Errors
/// When it has no `__arrow_c_stream__`, or returns something else.
pub fn stream_of(table: &Bound<'_, PyAny>) -> PyResult<RecordBatchStreamReader> {
    let capsule = table.call_method0("__arrow_c_stream__")?;
    let capsule = capsule.cast::<PyCapsule>()?;
    let pointer = capsule.pointer_checked(Some(STREAM))?.cast::<FFI_ArrowArrayStream>();
    #[allow(unsafe_code, reason = "the interface is one of C; there is no other way in")]
    // SAFETY: a capsule of this name holds such a struct (Arrow PyCapsule interface), which lives as long as the capsule. The stream is moved out and an empty
    // struct stays, as the interface requires. The interpreter is attached, so that no other thread reads the struct meanwhile.
    let stream = unsafe { FFI_ArrowArrayStream::from_raw(pointer.as_ptr()) };
    RecordBatchStreamReader::try_new(stream).map_err(|error| {
        let help = "pass a new table or reader; a reader can be read once";
        raised(table.py(), "format", "the table", &format!("the Arrow stream cannot be read: {error}"), Some(help))
    })
}

/// A column that cannot be taken.
pub struct ColumnError {
    pub column: String,
    pub message: String,
    pub help: Option<&'static str>,
}

impl ColumnError {
    fn new(column: &str, message: impl Into<String>, help: &'static str) -> Self {
        Self { column: column.into(), message: message.into(), help: Some(help) }
    }
}

/// What is collected of a field, batch by batch.
enum FieldBuffer {
    Numbers(Vec<f64>),
    /// The doubles of the only batch so far, where they are: none is null.
    Whole(Float64Array),
    Texts(Vec<String>),
    /// A column for each place of a list.
    Lists(Vec<Vec<f64>>),
    /// Of a kind that holds no signal: structs, bytes.
    Nothing,
}

/// The columns of a table: numbers, truth, times and texts as they are, a list of numbers as a column for each place, `state[0]`.
///
/// # Errors
/// The stream fails, a list changes its length, or `units` names a missing column.
pub fn columns(stream: RecordBatchStreamReader, units: &BTreeMap<String, String>) -> Result<Vec<Column>, ColumnError> {
    let schema = stream.schema();
    if let Some(unknown) = units.keys().find(|name| schema.field_with_name(name).is_err()) {
        return Err(ColumnError::new(unknown, "the table has no such column", "name columns of the table in `units`"));
    }
    let mut taken: Vec<FieldBuffer> = schema.fields().iter().map(|field| kind(field.data_type())).collect();
    let mut rows = 0;
    for batch in stream {
        let batch = batch.map_err(|error| {
            ColumnError::new("", format!("the Arrow stream cannot be read: {error}"), "read the table again")
        })?;
        for ((taken, array), field) in taken.iter_mut().zip(batch.columns()).zip(schema.fields()) {
            match taken {
                FieldBuffer::Numbers(all) if all.is_empty() && rows == 0 && is_whole(array) => {
                    *taken = FieldBuffer::Whole(array.as_primitive::<Float64Type>().clone());
                }
                FieldBuffer::Whole(first) => {
                    let mut all = first.values().to_vec();
                    numbers(array, &mut all);
                    *taken = FieldBuffer::Numbers(all);
                }
                FieldBuffer::Numbers(all) => numbers(array, all),
                FieldBuffer::Texts(all) => texts(array, all),
                FieldBuffer::Lists(all) => lists(array, all, rows).map_err(|(found, expected)| {
                    let message = format!("found a list of {found} numbers after lists of {expected}");
                    ColumnError::new(field.name(), message, "leave the column out, or make its lists equally long")
                })?,
                FieldBuffer::Nothing => {}
            }
        }
        rows += batch.num_rows();
    }
    let mut columns = Vec::new();
    for (taken, field) in taken.into_iter().zip(schema.fields()) {
        let name = field.name();
        // Times of Arrow are made seconds here.
        let is_time = matches!(field.data_type(), DataType::Timestamp(..) | DataType::Duration(_));
        let unit = units.get(name).map_or(if is_time { "s" } else { "" }, String::as_str);
        match taken {
            FieldBuffer::Numbers(values) => columns.push(Column::new(name, unit, values)),
            FieldBuffer::Whole(values) => columns.push(Column::shared(name, unit, Arc::new(Doubles(values)))),
            FieldBuffer::Texts(values) => columns.push(Column::texts(name, values)),
            FieldBuffer::Lists(places) => {
                let named = places.into_iter().enumerate();
                columns.extend(named.map(|(at, values)| Column::new(format!("{name}[{at}]"), unit, values)));
            }
            FieldBuffer::Nothing => {}
        }
    }
    Ok(columns)
}

/// Doubles in the memory of the library that made them.
struct Doubles(Float64Array);

impl AsRef<[f64]> for Doubles {
    fn as_ref(&self) -> &[f64] {
        self.0.values()
    }
}

/// Whether an array is doubles without a null, which can be used where they are.
fn is_whole(array: &ArrayRef) -> bool {
    *array.data_type() == DataType::Float64 && array.null_count() == 0
}

fn kind(of: &DataType) -> FieldBuffer {
    match of {
        DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => FieldBuffer::Texts(Vec::new()),
        DataType::Dictionary(_, values) => kind(values),
        DataType::List(field) | DataType::LargeList(field) | DataType::FixedSizeList(field, _) => {
            if matches!(kind(field.data_type()), FieldBuffer::Numbers(_)) {
                FieldBuffer::Lists(Vec::new())
            } else {
                FieldBuffer::Nothing
            }
        }
        // A column of nulls was never measured.
        DataType::Boolean | DataType::Timestamp(..) | DataType::Duration(_) | DataType::Null => {
            FieldBuffer::Numbers(Vec::new())
        }
        numeric if numeric.is_numeric() => FieldBuffer::Numbers(Vec::new()),
        _ => FieldBuffer::Nothing,
    }
}

/// Appends numbers; what is null is NaN.
fn numbers(array: &ArrayRef, all: &mut Vec<f64>) {
    fn of<T: ArrowPrimitiveType>(array: &ArrayRef, all: &mut Vec<f64>, number: impl Fn(T::Native) -> f64) {
        let array = array.as_primitive::<T>();
        if array.null_count() == 0 {
            all.extend(array.values().iter().map(|value| number(*value)));
        } else {
            all.extend(array.iter().map(|value| value.map_or(f64::NAN, &number)));
        }
    }
    let power = |scale: i8| 10_f64.powi(scale.into());
    match array.data_type() {
        DataType::Float64 => of::<Float64Type>(array, all, |value| value),
        DataType::Float32 => of::<Float32Type>(array, all, f64::from),
        DataType::Float16 => of::<Float16Type>(array, all, f64::from),
        DataType::Int8 => of::<Int8Type>(array, all, f64::from),
        DataType::Int16 => of::<Int16Type>(array, all, f64::from),
        DataType::Int32 => of::<Int32Type>(array, all, f64::from),
        DataType::Int64 => of::<Int64Type>(array, all, |value| value as f64),
        DataType::UInt8 => of::<UInt8Type>(array, all, f64::from),
        DataType::UInt16 => of::<UInt16Type>(array, all, f64::from),
        DataType::UInt32 => of::<UInt32Type>(array, all, f64::from),
        DataType::UInt64 => of::<UInt64Type>(array, all, |value| value as f64),
        DataType::Timestamp(TimeUnit::Second, _) => of::<TimestampSecondType>(array, all, |value| value as f64),
        DataType::Timestamp(TimeUnit::Millisecond, _) => {
            of::<TimestampMillisecondType>(array, all, |value| value as f64 / 1e3)
        }
        DataType::Timestamp(TimeUnit::Microsecond, _) => {
            of::<TimestampMicrosecondType>(array, all, |value| value as f64 / 1e6)
        }
        DataType::Timestamp(TimeUnit::Nanosecond, _) => {
            of::<TimestampNanosecondType>(array, all, |value| value as f64 / 1e9)
        }
        DataType::Duration(TimeUnit::Second) => of::<DurationSecondType>(array, all, |value| value as f64),
        DataType::Duration(TimeUnit::Millisecond) => {
            of::<DurationMillisecondType>(array, all, |value| value as f64 / 1e3)
        }
        DataType::Duration(TimeUnit::Microsecond) => {
            of::<DurationMicrosecondType>(array, all, |value| value as f64 / 1e6)
        }
        DataType::Duration(TimeUnit::Nanosecond) => {
            of::<DurationNanosecondType>(array, all, |value| value as f64 / 1e9)
        }
        DataType::Decimal32(_, scale) => of::<Decimal32Type>(array, all, |value| f64::from(value) / power(*scale)),
        DataType::Decimal64(_, scale) => of::<Decimal64Type>(array, all, |value| value as f64 / power(*scale)),
        DataType::Decimal128(_, scale) => of::<Decimal128Type>(array, all, |value| value as f64 / power(*scale)),
        DataType::Decimal256(_, scale) => {
            of::<Decimal256Type>(array, all, |value| value.to_string().parse().unwrap_or(f64::NAN) / power(*scale));
        }
        DataType::Boolean => {
            all.extend(
                array.as_boolean().iter().map(|value| value.map_or(f64::NAN, |value| f64::from(u8::from(value)))),
            );
        }
        DataType::Dictionary(..) => {
            let dictionary = array.as_any_dictionary();
            if dictionary.values().is_empty() {
                return all.resize(all.len() + array.len(), f64::NAN);
            }
            let mut values = Vec::new();
            numbers(dictionary.values(), &mut values);
            let keys = dictionary.normalized_keys();
            all.extend(keys.iter().enumerate().map(|(row, key)| match array.is_null(row) {
                true => f64::NAN,
                false => values.get(*key).copied().unwrap_or(f64::NAN),
            }));
        }
        _ => all.resize(all.len() + array.len(), f64::NAN),
    }
}

/// Appends texts; what is null is empty.
fn texts(array: &ArrayRef, all: &mut Vec<String>) {
    let text = |value: Option<&str>| value.unwrap_or_default().to_string();
    match array.data_type() {
        DataType::Utf8 => all.extend(array.as_string::<i32>().iter().map(text)),
        DataType::LargeUtf8 => all.extend(array.as_string::<i64>().iter().map(text)),
        DataType::Utf8View => all.extend(array.as_string_view().iter().map(text)),
        DataType::Dictionary(..) => {
            let dictionary = array.as_any_dictionary();
            if dictionary.values().is_empty() {
                return all.resize(all.len() + array.len(), String::new());
            }
            let mut values = Vec::new();
            texts(dictionary.values(), &mut values);
            let keys = dictionary.normalized_keys();
            all.extend(keys.iter().enumerate().map(|(row, key)| match array.is_null(row) {
                true => String::new(),
                false => values.get(*key).cloned().unwrap_or_default(),
            }));
        }
        _ => all.resize(all.len() + array.len(), String::new()),
    }
}

/// Appends lists of numbers, place by place; `rows` were there before. A null list is NaN at every place.
fn lists(array: &ArrayRef, all: &mut Vec<Vec<f64>>, rows: usize) -> Result<(), (usize, usize)> {
    let list = |row: usize| -> Option<ArrayRef> {
        if array.is_null(row) {
            return None;
        }
        match array.data_type() {
            DataType::List(_) => Some(array.as_list::<i32>().value(row)),
            DataType::LargeList(_) => Some(array.as_list::<i64>().value(row)),
            DataType::FixedSizeList(..) => Some(array.as_fixed_size_list().value(row)),
            _ => None,
        }
    };
    let mut values = Vec::new();
    for row in 0..array.len() {
        values.clear();
        if let Some(list) = list(row) {
            numbers(&list, &mut values);
            if all.is_empty() && values.len() <= LONGEST {
                *all = vec![vec![f64::NAN; rows + row]; values.len()];
            }
            if all.len() != values.len() {
                return Err((values.len(), all.len()));
            }
        }
        for (at, column) in all.iter_mut().enumerate() {
            column.push(values.get(at).copied().unwrap_or(f64::NAN));
        }
    }
    Ok(())
}
