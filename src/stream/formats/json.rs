//! JSON objects as rows: nested keys become dotted names, lists numbered ones.
//!
//! A list that is the value of a canonical vector or rotation gives its components: `"right.thumb.force": [0, 0, 1]`.

use super::super::names;
use super::super::sheet::Memory;
use super::rosmsg::{Failure, MAX_ARRAY};
#[cfg(feature = "mcap")]
use crate::base::json::told;
use serde_json::Value;

/// The deepest nesting that is spread into names.
const MAX_DEPTH: usize = 16;

/// Puts a message into the last row; its stamp in nanoseconds, if it has a header with one.
///
/// # Errors
/// When it is no JSON object.
#[cfg(feature = "mcap")]
pub fn message(text: &[u8], row: &mut Memory) -> Result<Option<i64>, Failure> {
    let value: Value =
        serde_json::from_slice(text).map_err(|error| format!("found no JSON object: {}", told(&error)))?;
    let Value::Object(_) = value else {
        return Err("found no JSON object".to_string().into());
    };
    put(&value, row)?;
    let stamp = value.pointer("/header/stamp");
    let part = |key: &str| stamp.and_then(|stamp| stamp.get(key)).and_then(Value::as_i64);
    let (seconds, nanos) = (part("sec"), part("nanosec").or_else(|| part("nsec")));
    Ok(seconds
        .zip(nanos)
        .and_then(|(seconds, nanos)| seconds.checked_mul(1_000_000_000)?.checked_add(nanos))
        .filter(|stamp| *stamp != 0))
}

/// Puts the values of an object into the last row.
///
/// # Errors
/// When there are too many columns.
pub fn put(object: &Value, row: &mut Memory) -> Result<(), Failure> {
    spread(object, &mut String::new(), row, 0)
}

fn spread(value: &Value, path: &mut String, row: &mut Memory, depth: usize) -> Result<(), Failure> {
    if depth > MAX_DEPTH {
        return Err(format!("`{path}` is nested more than {MAX_DEPTH} deep").into());
    }
    let length = path.len();
    match value {
        // Nothing is said about what it would be.
        Value::Null => {}
        Value::Bool(flag) => row.put(path, f64::from(u8::from(*flag)))?,
        Value::Number(number) => row.put(path, number.as_f64().unwrap_or(f64::NAN))?,
        Value::String(text) => row.put_text(path, text)?,
        Value::Array(items) if items.len() > MAX_ARRAY => {}
        Value::Array(items) => {
            let letters = names::channel(path)
                .map(|(shape, ..)| shape.components())
                .filter(|parts| parts.len() == items.len() && parts.len() > 1);
            for (place, item) in items.iter().enumerate() {
                match letters.and_then(|letters| letters.get(place)) {
                    Some(letter) => path.push_str(&format!(".{letter}")),
                    None => path.push_str(&format!("[{place}]")),
                }
                spread(item, path, row, depth + 1)?;
                path.truncate(length);
            }
        }
        Value::Object(entries) => {
            for (key, item) in entries {
                if length > 0 {
                    path.push('.');
                }
                path.push_str(key);
                spread(item, path, row, depth + 1)?;
                path.truncate(length);
            }
        }
    }
    Ok(())
}
