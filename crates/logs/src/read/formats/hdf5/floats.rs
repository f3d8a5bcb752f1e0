//! Floating point numbers of other layouts than IEEE 754 of 32 and 64 bits: half precision, bfloat16, other biases. The library reads them as if they were
//! of these two, or not at all.

use ::hdf5_pure::{Datatype, DatatypeByteOrder, FloatingPointLayout};

/// The storage of a data set's floating point numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FloatForm {
    size: usize,
    order: DatatypeByteOrder,
    layout: FloatingPointLayout,
}

/// The reader of a data set's numbers.
pub(super) enum NumberReader {
    /// The library.
    Library,
    /// [`FloatForm::decode`].
    Own(FloatForm),
    /// Neither, and why.
    Refused(String),
}

impl NumberReader {
    /// Returns the reader for numbers of this type.
    pub fn of(datatype: &Datatype) -> Self {
        let (size, byte_order, layout) = match datatype {
            Datatype::FloatingPoint { size, byte_order, layout } => (size, byte_order, layout),
            Datatype::Opaque { .. } | Datatype::Time { .. } => {
                return Self::Refused("has values of a type that is not read (opaque, time), expected numbers".into());
            }
            Datatype::VariableLength { is_string: false, .. } => {
                return Self::Refused("has rows of different lengths, which are not read".into());
            }
            _ => return Self::Library,
        };
        let (size, order, layout) = (*size as usize, *byte_order, *layout);
        let is_known = match size {
            4 => layout == FloatingPointLayout::IEEE754_BINARY32,
            8 => layout == FloatingPointLayout::IEEE754_BINARY64,
            _ => false,
        };
        if is_known && order != DatatypeByteOrder::Vax {
            return Self::Library;
        }
        if let Some(form) = FloatForm::new(size, order, layout) {
            return Self::Own(form);
        }
        Self::Refused(format!(
            "has floating point numbers of {} bits, which are not read, expected 64 bits or fewer: write it as float64",
            8 * size
        ))
    }
}

impl FloatForm {
    /// The form of numbers of `size` bytes; `None` of numbers that are not read.
    pub fn new(size: usize, order: DatatypeByteOrder, layout: FloatingPointLayout) -> Option<Self> {
        let form = Self { size, order, layout };
        form.is_readable().then_some(form)
    }

    /// The bytes of a number.
    pub fn size(self) -> usize {
        self.size
    }

    /// Whether the fields are within 64 bits and have the order sign, exponent, mantissa.
    fn is_readable(self) -> bool {
        let FloatingPointLayout { bit_offset, bit_precision, exponent_location, .. } = self.layout;
        let [exponent, mantissa] = [self.layout.exponent_size, self.layout.mantissa_size].map(u32::from);
        let begin = u32::from(self.layout.mantissa_location);
        (1..=8).contains(&self.size)
            && self.order != DatatypeByteOrder::Vax
            && u32::from(bit_offset) + u32::from(bit_precision) <= 8 * self.size as u32
            && (1..=11).contains(&exponent)
            && (1..=52).contains(&mantissa)
            && begin + mantissa <= u32::from(exponent_location)
            && u32::from(exponent_location) + exponent < u32::from(bit_precision)
    }

    /// The numbers in the bytes of a data set.
    pub fn decode(self, bytes: &[u8]) -> Vec<f64> {
        bytes.chunks_exact(self.size.max(1)).map(|number| self.number(number)).collect()
    }

    /// The number in these bytes.
    pub fn number(self, bytes: &[u8]) -> f64 {
        let push = |bits: u64, byte: &u8| bits << 8 | u64::from(*byte);
        let bits = match self.order {
            DatatypeByteOrder::BigEndian => bytes.iter().fold(0, push),
            _ => bytes.iter().rev().fold(0, push),
        } >> self.layout.bit_offset;
        let field = |location: u32, size: u32| bits >> location & ((1 << size) - 1);
        let layout = self.layout;
        let [exponent_size, mantissa_size] = [layout.exponent_size, layout.mantissa_size].map(u32::from);
        let exponent = field(layout.exponent_location.into(), exponent_size);
        let mantissa = field(layout.mantissa_location.into(), mantissa_size) as f64 / (1_u64 << mantissa_size) as f64;
        let sign = if field(u32::from(layout.bit_precision) - 1, 1) == 1 { -1.0 } else { 1.0 };
        let bias = i64::from(layout.exponent_bias);
        let magnitude = match exponent {
            0 => mantissa * two_to_the(1 - bias),
            all if all == (1 << exponent_size) - 1 => {
                if mantissa == 0.0 {
                    f64::INFINITY
                } else {
                    f64::NAN
                }
            }
            other => (1.0 + mantissa) * two_to_the(other as i64 - bias),
        };
        sign * magnitude
    }
}

/// A power of two, exactly.
fn two_to_the(exponent: i64) -> f64 {
    match exponent {
        -1022..=1023 => f64::from_bits(((exponent + 1023) as u64) << 52),
        other => (other as f64).exp2(),
    }
}
