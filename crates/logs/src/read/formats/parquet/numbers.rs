//! The numbers of a column as Parquet stores them: decimal numbers, and floating point numbers of 16 bits, are bytes.

use crate::read::formats::half::half;
use ::parquet::basic::{ConvertedType, LogicalType, TimeUnit, Type as Physical};
use ::parquet::data_type::Int96;
use ::parquet::schema::types::ColumnDescriptor;

/// The conversion of stored numbers to values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NumberForm {
    /// The factor of whole numbers.
    pub factor: f64,
    is_half: bool,
}

impl NumberForm {
    /// Numbers as they are stored.
    pub const WHOLE: Self = Self { factor: 1.0, is_half: false };

    /// The form of a column of numbers and the unit of its values, if its type says one; `None` of other columns.
    pub fn of(column: &ColumnDescriptor) -> Option<(Self, &'static str)> {
        let logical = column.logical_type_ref();
        let is_decimal =
            matches!(logical, Some(LogicalType::Decimal(_))) || column.converted_type() == ConvertedType::DECIMAL;
        let is_half = matches!(logical, Some(LogicalType::Float16));
        let (factor, unit) = match (logical, column.converted_type()) {
            (Some(LogicalType::Timestamp(stamp)), _) => (step(&stamp.unit), "s"),
            (_, ConvertedType::TIMESTAMP_MILLIS) => (1e-3, "s"),
            (_, ConvertedType::TIMESTAMP_MICROS) => (1e-6, "s"),
            _ if is_decimal => (10_f64.powi(-column.type_scale()), ""),
            _ => (1.0, ""),
        };
        let is_read = match column.physical_type() {
            Physical::BYTE_ARRAY | Physical::FIXED_LEN_BYTE_ARRAY => is_decimal || is_half,
            Physical::INT96 => return Some((Self::WHOLE, "s")),
            _ => true,
        };
        is_read.then_some((Self { factor, is_half }, unit))
    }

    /// The number in some bytes: half precision with the least byte first, or a whole number with the greatest byte first.
    pub fn of_bytes(self, bytes: &[u8]) -> f64 {
        if self.is_half {
            return <[u8; 2]>::try_from(bytes).map_or(f64::NAN, |bytes| half(u16::from_le_bytes(bytes)));
        }
        let Some((first, rest)) = bytes.split_first() else { return f64::NAN };
        let first = f64::from(first.cast_signed());
        rest.iter().fold(first, |number, byte| number * 256.0 + f64::from(*byte)) * self.factor
    }
}

/// Seconds since 1970 of a stamp in 96 bits, as Spark and Impala write it.
pub(super) fn seconds_of(stamp: &Int96) -> f64 {
    let nanos = stamp.to_nanos();
    nanos.div_euclid(1_000_000_000) as f64 + nanos.rem_euclid(1_000_000_000) as f64 * 1e-9
}

/// Returns the length of a stamp's unit, s.
fn step(unit: &TimeUnit) -> f64 {
    match unit {
        TimeUnit::MILLIS => 1e-3,
        TimeUnit::MICROS => 1e-6,
        TimeUnit::NANOS => 1e-9,
    }
}
