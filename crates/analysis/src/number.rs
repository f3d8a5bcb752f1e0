//! The one printer of numbers in results: a number in, the shortest text to a millionth out.
//!
//! Invariants: at most six decimals, no trailing zeros, no exponent, no `-0`; what is not finite reads `null`.

/// Prints a number to six decimals without trailing zeros.
pub fn number(value: f64) -> String {
    decimals(value, 6)
}

/// Prints a number to `places` decimals without trailing zeros.
pub fn decimals(value: f64, places: usize) -> String {
    if !value.is_finite() {
        return "null".into();
    }
    let fixed = format!("{value:.places$}");
    let short = if fixed.contains('.') { fixed.trim_end_matches('0').trim_end_matches('.') } else { &fixed };
    if short == "-0" { "0".into() } else { short.to_string() }
}

/// Prints a number with exactly `places` decimals, for columns.
pub fn fixed(value: f64, places: usize) -> String {
    let text = format!("{value:.places$}");
    match text.strip_prefix('-') {
        _ if !value.is_finite() => "null".into(),
        Some(digits) if digits.chars().all(|digit| matches!(digit, '0' | '.')) => digits.into(),
        _ => text,
    }
}
