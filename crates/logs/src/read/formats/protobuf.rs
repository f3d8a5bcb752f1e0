//! Messages in protobuf, as Foxglove's libraries write them: the descriptors of their types in, named numbers and texts out.
//!
//! A nested field is called by its path, an element of a list by its place, as of JSON. Fields without presence that a message leaves out have their default,
//! zero.

use super::rosmsg::{Failure, MAX_ARRAY};
use crate::read::memory_table::InMemoryTable;
use ::prost_reflect::{DescriptorPool, DynamicMessage, MessageDescriptor, ReflectMessage, Value};

/// The longest descriptors that are read, in bytes.
const MAX_DESCRIPTORS: usize = 1 << 20;
/// The deepest nesting that is spread into names.
const MAX_DEPTH: usize = 16;
/// The possible fields of a message's stamp; for a list, the first element counts.
const STAMPS: [&[&str]; 4] =
    [&["header", "stamp"], &["timestamp"], &["transforms", "header", "stamp"], &["transforms", "timestamp"]];

/// A message type.
pub struct MessageType(MessageDescriptor);

impl MessageType {
    /// A type by its full name, and the descriptors of the files that define it (`FileDescriptorSet`).
    ///
    /// # Errors
    /// They are damaged, or do not have the type.
    pub(super) fn new(name: &str, descriptors: &[u8]) -> Result<Self, String> {
        if descriptors.len() > MAX_DESCRIPTORS {
            return Err(format!(
                "its descriptors have {} bytes, at most {MAX_DESCRIPTORS} are read",
                descriptors.len()
            ));
        }
        let pool =
            DescriptorPool::decode(descriptors).map_err(|error| format!("its descriptors are damaged: {error}"))?;
        let kind = pool.get_message_by_name(name);
        kind.map(Self).ok_or_else(|| format!("its descriptors do not have the type {name}"))
    }

    /// Puts the fields of a message into the last row; its stamp in nanoseconds, if it has one.
    ///
    /// # Errors
    /// The bytes are not a message of this type.
    pub(super) fn decode(&self, bytes: &[u8], row: &mut InMemoryTable) -> Result<Option<i64>, Failure> {
        self.decode_with_bytes(bytes, row).map(|(stamp, _)| stamp)
    }

    /// The same, with the bytes in the field `data`.
    ///
    /// # Errors
    /// As [`decode`](Self::decode).
    pub(super) fn decode_with_bytes(
        &self,
        bytes: &[u8],
        row: &mut InMemoryTable,
    ) -> Result<(Option<i64>, Option<Vec<u8>>), Failure> {
        let message = DynamicMessage::decode(self.0.clone(), bytes)
            .map_err(|error| format!("is not a message of {}: {error}", self.0.full_name()))?;
        spread_message(&message, &mut String::new(), row, 0)?;
        let data = message.get_field_by_name("data").and_then(|value| value.as_bytes().map(|bytes| bytes.to_vec()));
        Ok((STAMPS.iter().find_map(|path| stamp(&message, path)), data))
    }
}

fn spread_message(
    message: &DynamicMessage,
    path: &mut String,
    row: &mut InMemoryTable,
    depth: usize,
) -> Result<(), Failure> {
    if depth > MAX_DEPTH {
        return Err(format!("`{path}` is nested more than {MAX_DEPTH} deep").into());
    }
    let length = path.len();
    for field in message.descriptor().fields() {
        if field.supports_presence() && !message.has_field(&field) {
            continue;
        }
        if length > 0 {
            path.push('.');
        }
        path.push_str(field.name());
        spread(&message.get_field(&field), path, row, depth)?;
        path.truncate(length);
    }
    Ok(())
}

fn spread(value: &Value, path: &mut String, row: &mut InMemoryTable, depth: usize) -> Result<(), Failure> {
    let is_new = match value {
        Value::Bool(flag) => row.put(path, f64::from(u8::from(*flag)))?,
        Value::I32(number) | Value::EnumNumber(number) => row.put(path, f64::from(*number))?,
        Value::U32(number) => row.put(path, f64::from(*number))?,
        Value::I64(number) => row.put(path, *number as f64)?,
        Value::U64(number) => row.put(path, *number as f64)?,
        Value::F32(number) => row.put(path, f64::from(*number))?,
        Value::F64(number) => row.put(path, *number)?,
        Value::String(text) => row.put_text(path, text)?,
        Value::Message(message) => {
            spread_message(message, path, row, depth + 1)?;
            true
        }
        Value::List(items) if items.len() <= MAX_ARRAY => {
            let length = path.len();
            for (place, item) in items.iter().enumerate() {
                path.push_str(&format!("[{place}]"));
                spread(item, path, row, depth + 1)?;
                path.truncate(length);
            }
            true
        }
        // Images and clouds of points; what a map has differs from message to message.
        Value::List(_) | Value::Bytes(_) | Value::Map(_) => true,
    };
    if is_new { Ok(()) } else { Err(format!("`{path}` occurs twice").into()) }
}

/// The stamp in the field at a path, ns: `seconds` and `nanos`, or `sec` and `nsec` or `nanosec`.
fn stamp(message: &DynamicMessage, path: &[&str]) -> Option<i64> {
    let Some((name, rest)) = path.split_first() else {
        let part = |names: &[&str]| names.iter().find_map(|name| integer(&*message.get_field_by_name(name)?));
        let (seconds, nanos) = (part(&["seconds", "sec"])?, part(&["nanos", "nsec", "nanosec"])?);
        return seconds.checked_mul(1_000_000_000)?.checked_add(nanos).filter(|stamp| *stamp != 0);
    };
    if !message.has_field_by_name(name) {
        return None;
    }
    match &*message.get_field_by_name(name)? {
        Value::Message(inner) => stamp(inner, rest),
        Value::List(items) => stamp(items.first()?.as_message()?, rest),
        _ => None,
    }
}

fn integer(value: &Value) -> Option<i64> {
    match value {
        Value::I32(number) => Some(i64::from(*number)),
        Value::U32(number) => Some(i64::from(*number)),
        Value::I64(number) => Some(*number),
        Value::U64(number) => i64::try_from(*number).ok(),
        _ => None,
    }
}
