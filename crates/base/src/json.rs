//! Reads JSON with errors at file, line and column, in the terms of JSON instead of Rust types.

use super::error::InputError;
use super::yaml::in_plain_words;
use serde::de::DeserializeOwned;

/// Parses a JSON text; `file` is its name in errors.
///
/// # Errors
/// The first error, at `file:line:column`, or at the file if the parser gives no place.
pub fn read<T: DeserializeOwned>(text: &str, file: &str) -> Result<T, InputError> {
    if text.trim().is_empty() {
        return Err(InputError::new(file, "the file is empty"));
    }
    serde_json::from_str(text).map_err(|error| {
        let message = message_of(&error);
        InputError::new(
            place(&error, file),
            if error.is_syntax() { format!("not valid JSON: {message}") } else { message },
        )
    })
}

/// Returns the message without the place.
pub fn message_of(error: &serde_json::Error) -> String {
    let message = error.to_string();
    let message = message.split(" at line ").next().unwrap_or(&message);
    if let Some(within) = message.strip_prefix("EOF while parsing ") {
        return match within {
            "a value" => "ends in the middle: a value is missing".into(),
            _ => format!("ends in the middle of {within}"),
        };
    }
    match message.strip_prefix("expected ") {
        Some("ident" | "value") => "expected a value".into(),
        Some(wanted) => format!("expected {wanted}"),
        None => in_plain_words(message),
    }
}

/// Returns the place: an unexpected end has a line without a column, an invalid value that was already parsed has neither.
fn place(error: &serde_json::Error, file: &str) -> String {
    match (error.line(), error.column()) {
        (0, _) => file.into(),
        (line, column) if column == 0 || error.is_eof() => format!("{file}:{line}"),
        (line, column) => format!("{file}:{line}:{column}"),
    }
}
