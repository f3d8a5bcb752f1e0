//! Numbers with a unit in YAML files: `120 mm`, `50 g`, `0.4`.

use super::short_number::{PLAIN, ShortNumber};
use super::units::{Dimension, compound};
use serde::{Deserialize, Deserializer};

/// A number in SI, written in the file with a unit of the dimension `M K S R` (exponents of meter, kilogram, second, radian).
///
/// Deserializing refuses a missing unit and a unit of another dimension.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub struct Quantity<const M: i8, const K: i8, const S: i8, const R: i8>(pub f64);

/// A length, m.
pub type Length = Quantity<1, 0, 0, 0>;
/// A mass, kg.
pub type Mass = Quantity<0, 1, 0, 0>;
/// A time, s.
pub type Time = Quantity<0, 0, 1, 0>;
/// An angle, rad.
pub type Angle = Quantity<0, 0, 0, 1>;
/// A speed, m/s.
pub type Speed = Quantity<1, 0, -1, 0>;
/// An angular speed, rad/s.
pub type AngularSpeed = Quantity<0, 0, -1, 1>;
/// An acceleration, m/s^2.
pub type Acceleration = Quantity<1, 0, -2, 0>;
/// A force, N.
pub type Force = Quantity<1, 1, -2, 0>;
/// A frequency, Hz.
pub type Frequency = Quantity<0, 0, -1, 0>;

impl<const M: i8, const K: i8, const S: i8, const R: i8> Quantity<M, K, S, R> {
    const DIMENSION: Dimension = Dimension::new(M, K, S, R);
}

/// Converts a text such as `12.5 mm` to SI and checks its dimension.
///
/// # Errors
/// Returns a sentence with the found and the expected text.
pub fn parse(text: &str, wanted: Dimension) -> Result<f64, String> {
    let text = text.trim();
    let end = (0..=text.len())
        .rev()
        .find(|&end| text.get(..end).is_some_and(|head| head.trim_end().parse::<f64>().is_ok()))
        .ok_or_else(|| format!("found `{text}`, expected a number with a unit for {wanted}"))?;
    let (head, tail) = (text.get(..end).unwrap_or(""), text.get(end..).unwrap_or(""));
    let number: f64 = head.trim().parse().map_err(|_| format!("found `{text}`, expected a number"))?;
    if !number.is_finite() {
        return Err(format!("found `{text}`, expected a finite number"));
    }
    let (in_si, dimension) = compound(tail).map_err(|part| format!("`{part}` in `{text}` is not a known unit"))?;
    if dimension != wanted {
        return Err(format!("`{text}` is {dimension}, expected {wanted}"));
    }
    Ok(number * in_si)
}

/// A value whose numbers can be checked against a range.
pub trait Numbers {
    /// The dimension of the numbers.
    const DIMENSION: Dimension;
    /// Returns the numbers, SI.
    fn numbers(&self) -> impl Iterator<Item = f64>;
}

impl<const M: i8, const K: i8, const S: i8, const R: i8> Numbers for Quantity<M, K, S, R> {
    const DIMENSION: Dimension = Self::DIMENSION;

    fn numbers(&self) -> impl Iterator<Item = f64> {
        std::iter::once(self.0)
    }
}

impl Numbers for f64 {
    const DIMENSION: Dimension = Dimension::NONE;

    fn numbers(&self) -> impl Iterator<Item = f64> {
        std::iter::once(*self)
    }
}

impl<T: Numbers, const N: usize> Numbers for [T; N] {
    const DIMENSION: Dimension = T::DIMENSION;

    fn numbers(&self) -> impl Iterator<Item = f64> {
        self.iter().flat_map(T::numbers)
    }
}

impl<T: Numbers> Numbers for Vec<T> {
    const DIMENSION: Dimension = T::DIMENSION;

    fn numbers(&self) -> impl Iterator<Item = f64> {
        self.iter().flat_map(T::numbers)
    }
}

impl<T: Numbers> Numbers for Option<T> {
    const DIMENSION: Dimension = T::DIMENSION;

    fn numbers(&self) -> impl Iterator<Item = f64> {
        self.iter().flat_map(T::numbers)
    }
}

/// Deserializes a value whose numbers are all above zero.
///
/// # Errors
/// The errors of the type itself; the first number that is not above zero.
pub fn above_zero<'de, D: Deserializer<'de>, T: Deserialize<'de> + Numbers>(from: D) -> Result<T, D::Error> {
    in_range(T::deserialize(from)?, |number| number > 0.0, "above 0").map_err(serde::de::Error::custom)
}

/// Deserializes a value whose numbers are all zero or above.
///
/// # Errors
/// The errors of the type itself; the first number below zero.
pub fn not_below_zero<'de, D: Deserializer<'de>, T: Deserialize<'de> + Numbers>(from: D) -> Result<T, D::Error> {
    in_range(T::deserialize(from)?, |number| number >= 0.0, "of 0 or more").map_err(serde::de::Error::custom)
}

fn in_range<T: Numbers>(read: T, fits: impl Fn(f64) -> bool, wanted: &str) -> Result<T, String> {
    let outside = read.numbers().find(|number| !(fits(*number) && number.is_finite()));
    // The number is in SI here, independent of the unit in the file.
    let unit = T::DIMENSION.si_unit();
    let blank = if unit.is_empty() { "" } else { " " };
    outside.map_or(Ok(read), |number| {
        Err(format!("found {}{blank}{unit}, expected {} {wanted}", ShortNumber(number), T::DIMENSION))
    })
}

/// Deserializes a direction or a rotation: finite numbers that are not all zero.
///
/// # Errors
/// The errors of the type itself; numbers that are not finite, or all zero.
pub fn with_direction<'de, D: Deserializer<'de>, const N: usize>(from: D) -> Result<[f64; N], D::Error>
where
    [f64; N]: Deserialize<'de>,
{
    let read = <[f64; N]>::deserialize(from)?;
    let length = read.iter().map(|number| number * number).sum::<f64>().sqrt();
    if length.is_finite() && length > 1e-6 {
        return Ok(read);
    }
    Err(serde::de::Error::custom(format!(
        "found {read:?}, expected a {} that is not zero",
        if N == 4 { "rotation w x y z" } else { "direction" }
    )))
}

impl<'de, const M: i8, const K: i8, const S: i8, const R: i8> Deserialize<'de> for Quantity<M, K, S, R> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor<const M: i8, const K: i8, const S: i8, const R: i8>;
        impl<const M: i8, const K: i8, const S: i8, const R: i8> serde::de::Visitor<'_> for Visitor<M, K, S, R> {
            type Value = Quantity<M, K, S, R>;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                write!(f, "{}", Quantity::<M, K, S, R>::DIMENSION)
            }
            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Self::Value, E> {
                parse(text, Quantity::<M, K, S, R>::DIMENSION).map(Quantity).map_err(E::custom)
            }
            fn visit_f64<E: serde::de::Error>(self, number: f64) -> Result<Self::Value, E> {
                // The full text may have hundreds of digits, which an error would quote.
                let plain = number == 0.0 || PLAIN.contains(&number.abs());
                self.visit_str(&if plain { number.to_string() } else { format!("{number:e}") })
            }
            fn visit_i64<E: serde::de::Error>(self, number: i64) -> Result<Self::Value, E> {
                self.visit_str(&number.to_string())
            }
            fn visit_u64<E: serde::de::Error>(self, number: u64) -> Result<Self::Value, E> {
                self.visit_str(&number.to_string())
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

impl<const M: i8, const K: i8, const S: i8, const R: i8> serde::Serialize for Quantity<M, K, S, R> {
    /// Writes the number in SI with its unit, `0.12 m`, so that it is read back with the same bits.
    fn serialize<Z: serde::Serializer>(&self, serializer: Z) -> Result<Z::Ok, Z::Error> {
        let unit = Self::DIMENSION.si_unit();
        if unit.is_empty() {
            serializer.serialize_f64(self.0)
        } else {
            serializer.serialize_str(&format!("{} {unit}", self.0))
        }
    }
}

impl<const M: i8, const K: i8, const S: i8, const R: i8> schemars::JsonSchema for Quantity<M, K, S, R> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        Self::DIMENSION.to_string().into()
    }

    /// A text with a unit.
    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", "pattern": "^ *[-+]?[0-9.]", "title": Self::DIMENSION.to_string() })
    }
}
