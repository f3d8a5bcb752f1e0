//! Elements of arrays as NumPy and Zarr store them: integers, floats, truth values, dates and texts of either byte order.

use super::half::half;
use npyz::{Endianness, TimeUnits, TypeChar, TypeStr};
use std::str::FromStr as _;

/// The type of an element.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Signed,
    /// Also truth values.
    Unsigned,
    Float,
    /// Dates and durations, as integers in units of this many seconds.
    Time(f64),
    Bytes,
    Unicode,
}

/// The storage of an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Element {
    kind: Kind,
    /// Its bytes, at least one.
    pub size: usize,
    big_endian: bool,
}

impl Element {
    /// An element of NumPy.
    ///
    /// # Errors
    /// Returns its type, if that is neither a number nor a text.
    pub fn of_numpy(of: &TypeStr) -> Result<Self, String> {
        let other = || format!("has elements of the type `{of}`, expected numbers or texts");
        let size = of.num_bytes().filter(|size| *size > 0).ok_or_else(|| match of.type_char() {
            TypeChar::Object => "holds pickled Python objects, which are not read: save an array of numbers".into(),
            _ => other(),
        })?;
        let kind = match (of.type_char(), size) {
            (TypeChar::Bool, 1) | (TypeChar::Uint, 1 | 2 | 4 | 8) => Kind::Unsigned,
            (TypeChar::Int, 1 | 2 | 4 | 8) => Kind::Signed,
            (TypeChar::Float, 2 | 4 | 8) => Kind::Float,
            (TypeChar::DateTime | TypeChar::TimeDelta, 8) => {
                Kind::Time(of.time_units().and_then(seconds).ok_or_else(other)?)
            }
            (TypeChar::ByteStr, _) => Kind::Bytes,
            (TypeChar::UnicodeStr, _) => Kind::Unicode,
            _ => return Err(other()),
        };
        Ok(Self { kind, size, big_endian: of.endianness() == Endianness::Big })
    }

    /// An element by the name that version 2 of Zarr gives it, which is NumPy's: `<f8`.
    ///
    /// # Errors
    /// As [`of_numpy`](Self::of_numpy).
    pub fn of_zarr_2(name: &str) -> Result<Self, String> {
        let of = TypeStr::from_str(name).map_err(|_| format!("has elements of the unknown type `{name}`"))?;
        Self::of_numpy(&of)
    }

    /// An element by the name that version 3 of Zarr gives it: `float64`.
    ///
    /// # Errors
    /// Returns its type, if that is not a number.
    pub fn of_zarr_3(name: &str, big_endian: bool) -> Result<Self, String> {
        let (kind, size) = match name {
            "bool" | "uint8" => (Kind::Unsigned, 1),
            "uint16" => (Kind::Unsigned, 2),
            "uint32" => (Kind::Unsigned, 4),
            "uint64" => (Kind::Unsigned, 8),
            "int8" => (Kind::Signed, 1),
            "int16" => (Kind::Signed, 2),
            "int32" => (Kind::Signed, 4),
            "int64" => (Kind::Signed, 8),
            "float16" => (Kind::Float, 2),
            "float32" => (Kind::Float, 4),
            "float64" => (Kind::Float, 8),
            other => return Err(format!("has elements of the type `{other}`, expected numbers")),
        };
        Ok(Self { kind, size, big_endian })
    }

    /// Whether it is a text.
    pub fn is_text(self) -> bool {
        matches!(self.kind, Kind::Bytes | Kind::Unicode)
    }

    /// The number in these bytes, of which there are [`size`](Self::size); a date that is not one is NaN.
    pub fn number(self, bytes: &[u8]) -> f64 {
        let mut little = [0_u8; 8];
        for (at, slot) in little.iter_mut().take(self.size).enumerate() {
            let at = if self.big_endian { self.size - 1 - at } else { at };
            *slot = bytes.get(at).copied().unwrap_or(0);
        }
        let bits = u64::from_le_bytes(little);
        // The sign of shorter integers is in their highest bit.
        let unused = 64 - 8 * self.size.min(8) as u32;
        let signed = ((bits << unused) as i64) >> unused;
        match (self.kind, self.size) {
            (Kind::Float, 2) => half(bits as u16),
            (Kind::Float, 4) => f64::from(f32::from_bits(bits as u32)),
            (Kind::Float, _) => f64::from_bits(bits),
            (Kind::Signed, _) => signed as f64,
            (Kind::Time(_), _) if signed == i64::MIN => f64::NAN,
            (Kind::Time(seconds), _) => signed as f64 * seconds,
            _ => bits as f64,
        }
    }

    /// The text in these bytes, without the zeros after it.
    pub fn text(self, bytes: &[u8]) -> String {
        let text = match self.kind {
            Kind::Unicode => {
                let character = |code: &[u8]| {
                    let number = Self { kind: Kind::Unsigned, size: 4, ..self }.number(code);
                    char::from_u32(number as u32).unwrap_or(char::REPLACEMENT_CHARACTER)
                };
                bytes.chunks_exact(4).map(character).collect()
            }
            _ => String::from_utf8_lossy(bytes).into_owned(),
        };
        text.trim_end_matches('\0').to_string()
    }
}

/// Returns the length of a unit of time, s; `None` for months and years.
fn seconds(unit: TimeUnits) -> Option<f64> {
    Some(match unit {
        TimeUnits::Week => 604_800.0,
        TimeUnits::Day => 86_400.0,
        TimeUnits::Hour => 3600.0,
        TimeUnits::Minute => 60.0,
        TimeUnits::Second => 1.0,
        TimeUnits::Millisecond => 1e-3,
        TimeUnits::Microsecond => 1e-6,
        TimeUnits::Nanosecond => 1e-9,
        TimeUnits::Picosecond => 1e-12,
        TimeUnits::Femtosecond => 1e-15,
        TimeUnits::Attosecond => 1e-18,
        _ => return None,
    })
}
