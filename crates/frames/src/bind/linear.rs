//! The linear form of a bound number, `column * scale + offset [unit]`: counts, volts or percent become the unit in brackets.

/// A scale and an offset, both in the unit of the pattern.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearForm {
    /// The factor of the column.
    pub scale: f64,
    /// The summand.
    pub offset: f64,
}

impl LinearForm {
    /// Splits the text of a column, `adc * 0.1 - 3`, into the name and the form. Blanks stand around the operators.
    ///
    /// # Errors
    /// The scale is 0.
    pub(super) fn split(text: &str) -> Result<(&str, Option<Self>), String> {
        let text = text.trim();
        let (name, offset) = match [(" + ", 1.0), (" - ", -1.0)].map(|(operator, sign)| (last(text, operator), sign)) {
            [(Some((name, value)), sign), _] | [_, (Some((name, value)), sign)] => (name, Some(sign * value)),
            _ => (text, None),
        };
        let (name, scale) = last(name, " * ").map_or((name, None), |(name, scale)| (name, Some(scale)));
        if scale == Some(0.0) {
            return Err(format!("`{text}`: a column times 0 is the same in every row, expected another scale"));
        }
        if scale.is_none() && offset.is_none() {
            return Ok((text, None));
        }
        Ok((name, Some(Self { scale: scale.unwrap_or(1.0), offset: offset.unwrap_or(0.0) })))
    }
}

/// Splits at the last of these operators, and returns the text before it and the number after it; `None` without a number.
fn last<'a>(text: &'a str, operator: &str) -> Option<(&'a str, f64)> {
    let (name, number) = text.rsplit_once(operator)?;
    let number: f64 = number.trim().parse().ok()?;
    (number.is_finite() && !name.trim().is_empty()).then_some((name.trim_end(), number))
}
