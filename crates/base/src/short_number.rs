//! Formats numbers in messages in the shortest common notation, never with hundreds of digits.

use std::fmt;

/// Magnitudes in this range are written without an exponent.
pub const PLAIN: std::ops::Range<f64> = 1e-6..1e12;

/// Displays a number for a message: `0.4`, `1e300`, `-2.5e-9`; numbers with an exponent have at most six digits. A precision (`{:.1}`) works as for
/// numbers; only large numbers then have an exponent.
#[derive(Clone, Copy, Debug)]
pub struct ShortNumber(pub f64);

impl fmt::Display for ShortNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(number) = self;
        let size = number.abs();
        let large = size.is_finite() && size >= PLAIN.end;
        let small = size > 0.0 && size < PLAIN.start;
        match f.precision() {
            Some(places) if large => write!(f, "{number:.places$e}"),
            Some(places) => write!(f, "{number:.places$}"),
            None if large || small => {
                let digits = format!("{number:.5e}");
                let (mantissa, exponent) = digits.split_once('e').unwrap_or((&digits, "0"));
                write!(f, "{}e{exponent}", mantissa.trim_end_matches('0').trim_end_matches('.'))
            }
            None => write!(f, "{number}"),
        }
    }
}
