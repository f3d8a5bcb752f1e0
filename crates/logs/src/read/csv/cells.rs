//! Cells as they are written: numbers and texts.

use std::borrow::Cow;
use std::io::{Result, Write};

/// The shortest text that reads back to the same bits; nothing for a value that was not measured.
pub(super) fn write_number(out: &mut dyn Write, value: f64) -> Result<()> {
    if value.is_nan() {
        Ok(())
    } else if value != 0.0 && !(1e-5..1e15).contains(&value.abs()) {
        write!(out, "{value:e}")
    } else {
        write!(out, "{value}")
    }
}

/// A text as a cell.
pub(super) fn quoted(text: &str) -> Cow<'_, str> {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\"")).into()
    } else {
        text.into()
    }
}
