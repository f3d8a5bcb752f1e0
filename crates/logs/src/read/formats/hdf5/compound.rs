//! Data sets with several fields in each element, such as structured arrays of NumPy and tables of pandas: each field is an array, `frames/stamp`.

use super::floats::FloatForm;
use super::{check_chunks, located};
use crate::read::formats::array_log;
use ::hdf5_pure::{Dataset, Datatype, DatatypeByteOrder};
use std::rc::Rc;
use teachtree_base::error::InputError;

/// Maximum nesting depth of fields.
const DEEPEST: usize = 8;

/// A field of an element.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field {
    /// Its name, with those of the fields that it is in: `pose/x`.
    pub name: String,
    /// Its dimensions.
    pub dimensions: Vec<usize>,
    /// The bytes before it.
    offset: usize,
    form: FieldForm,
}

/// The storage of a field's values.
#[derive(Clone, Copy, Debug, PartialEq)]
enum FieldForm {
    Integer { size: usize, is_signed: bool, is_big_endian: bool },
    Float(FloatForm),
    Text(usize),
}

impl Field {
    /// Whether its values are texts.
    pub fn is_text(&self) -> bool {
        matches!(self.form, FieldForm::Text(_))
    }
}

impl FieldForm {
    /// The storage of values of this type; `None` of a type that is not read.
    fn of(datatype: &Datatype) -> Option<Self> {
        match datatype {
            Datatype::FixedPoint { size, byte_order, layout } if matches!(size, 1..=8) => Some(Self::Integer {
                size: *size as usize,
                is_signed: layout.signed,
                is_big_endian: *byte_order == DatatypeByteOrder::BigEndian,
            }),
            Datatype::Enumeration { base_type, .. } => Self::of(base_type),
            Datatype::FloatingPoint { size, byte_order, layout } => {
                FloatForm::new(*size as usize, *byte_order, *layout).map(Self::Float)
            }
            Datatype::String { size, .. } => Some(Self::Text(*size as usize)),
            _ => None,
        }
    }

    fn size(self) -> usize {
        match self {
            Self::Integer { size, .. } | Self::Text(size) => size,
            Self::Float(form) => form.size(),
        }
    }

    /// The number in these bytes, of which there are [`size`](Self::size).
    fn number(self, bytes: &[u8]) -> f64 {
        let (size, is_signed, is_big_endian) = match self {
            Self::Integer { size, is_signed, is_big_endian } => (size, is_signed, is_big_endian),
            Self::Float(form) => return form.number(bytes),
            Self::Text(_) => return f64::NAN,
        };
        let push = |bits: u64, byte: &u8| bits << 8 | u64::from(*byte);
        let bits = if is_big_endian { bytes.iter().fold(0, push) } else { bytes.iter().rev().fold(0, push) };
        let unused = 64 - 8 * size.clamp(1, 8) as u32;
        if is_signed { ((bits << unused).cast_signed() >> unused) as f64 } else { bits as f64 }
    }
}

/// The fields of elements of this type that are numbers or texts of a fixed length.
pub(super) fn fields(datatype: &Datatype) -> Vec<Field> {
    let mut fields = vec![];
    spread(datatype, String::new(), 0, 0, &mut fields);
    fields
}

fn spread(datatype: &Datatype, name: String, offset: usize, depth: usize, fields: &mut Vec<Field>) {
    if depth > DEEPEST {
        return;
    }
    match datatype {
        Datatype::Compound { members, .. } => {
            for member in members {
                let name = if name.is_empty() { member.name.clone() } else { format!("{name}/{}", member.name) };
                let inner = usize::try_from(member.byte_offset).unwrap_or(usize::MAX);
                spread(&member.datatype, name, offset.saturating_add(inner), depth + 1, fields);
            }
        }
        Datatype::Array { base_type, dimensions } => {
            let dimensions = dimensions.iter().map(|size| *size as usize).collect();
            fields.extend(FieldForm::of(base_type).map(|form| Field { name, dimensions, offset, form }));
        }
        other => fields.extend(FieldForm::of(other).map(|form| Field { name, dimensions: vec![], offset, form })),
    }
}

/// The values of a field, row by row.
pub(super) struct FieldValues {
    pub place: String,
    pub name: String,
    pub dataset: Rc<Dataset>,
    /// The size of an element, bytes.
    pub element_size: usize,
    pub field: Field,
    pub file_size: u64,
}

impl FieldValues {
    /// The bytes of each value.
    fn each<T>(&self, first_row: bool, value: impl Fn(&[u8]) -> T) -> Result<Vec<T>, InputError> {
        check_chunks(&self.dataset, self.file_size).map_err(|error| located(&self.place, &self.name, error))?;
        let read = if first_row { self.dataset.read_raw_rows(0, 1) } else { self.dataset.read_raw() };
        let bytes = read.map_err(|error| located(&self.place, &self.name, error))?;
        let (size, count) = (self.field.form.size().max(1), self.field.dimensions.iter().product::<usize>());
        let values = bytes.chunks_exact(self.element_size.max(1)).flat_map(|element| {
            let field = element.get(self.field.offset..).unwrap_or_default();
            field.chunks_exact(size).take(count).map(&value)
        });
        Ok(values.collect())
    }
}

impl array_log::ArrayValues for FieldValues {
    fn numbers(&self, first_row: bool) -> Result<Vec<f64>, InputError> {
        self.each(first_row, |bytes| self.field.form.number(bytes))
    }

    fn texts(&self) -> Result<Vec<String>, InputError> {
        self.each(false, |bytes| String::from_utf8_lossy(bytes).trim_end_matches(['\0', ' ']).to_string())
    }
}
