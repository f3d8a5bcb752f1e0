//! JSON objects as rows: nested keys become dotted names, lists numbered ones.
//!
//! A list that is the value of a canonical vector or rotation gives its components: `"right.thumb.force": [0, 0, 1]`.

use super::rosmsg::{Failure, MAX_ARRAY};
#[cfg(feature = "mcap")]
use crate::read::date_time::date_time;
use crate::read::memory_table::InMemoryTable;
use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};
use std::fmt;
use teachtree_base::json::message_of;
use teachtree_base::log_channel::LogChannel;

/// A value in which no object has a key twice: of two values with one name, the intended one is unknown.
pub struct UniqueKeys(pub Value);

impl<'de> Deserialize<'de> for UniqueKeys {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(UniqueVisitor).map(Self)
    }
}

struct UniqueVisitor;

impl<'de> Visitor<'de> for UniqueVisitor {
    type Value = Value;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("a value")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, flag: bool) -> Result<Value, E> {
        Ok(Value::Bool(flag))
    }

    fn visit_i64<E>(self, number: i64) -> Result<Value, E> {
        Ok(number.into())
    }

    fn visit_u64<E>(self, number: u64) -> Result<Value, E> {
        Ok(number.into())
    }

    fn visit_f64<E>(self, number: f64) -> Result<Value, E> {
        Ok(Number::from_f64(number).map_or(Value::Null, Value::Number))
    }

    fn visit_str<E>(self, text: &str) -> Result<Value, E> {
        Ok(Value::String(text.into()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Value, A::Error> {
        let mut list = vec![];
        while let Some(UniqueKeys(item)) = items.next_element()? {
            list.push(item);
        }
        Ok(Value::Array(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        let mut object = Map::new();
        while let Some(key) = entries.next_key::<String>()? {
            if object.contains_key(&key) {
                return Err(A::Error::custom(format!("the key `{key}` occurs twice")));
            }
            let UniqueKeys(value) = entries.next_value()?;
            object.insert(key, value);
        }
        Ok(Value::Object(object))
    }
}

/// The fault of a text that is not such a value.
pub fn fault(error: &serde_json::Error) -> String {
    if error.is_data() { message_of(error) } else { format!("found no JSON object: {}", message_of(error)) }
}

/// The deepest nesting that is spread into names.
const MAX_DEPTH: usize = 16;

/// The fields of a message's stamp: in a header as in ROS, or beside the values as in Foxglove's schemas; for a list, that of the first element.
#[cfg(feature = "mcap")]
const STAMPS: [&str; 5] =
    ["/header/stamp", "/timestamp", "/stamp", "/transforms/0/header/stamp", "/transforms/0/timestamp"];

/// The units of a stamp that is one number, ns, by the least number that is taken for each: 1973 in s, ms, us and ns. A smaller number is not a time since 1970.
#[cfg(feature = "mcap")]
const EPOCH_UNITS: [(f64, f64); 4] = [(1e17, 1.0), (1e14, 1e3), (1e11, 1e6), (1e8, 1e9)];

/// Puts a message into the last row; its stamp in nanoseconds, if it has one.
///
/// # Errors
/// The text is not a JSON object.
#[cfg(feature = "mcap")]
pub fn message(text: &[u8], row: &mut InMemoryTable) -> Result<Option<i64>, Failure> {
    let UniqueKeys(value) = serde_json::from_slice(text).map_err(|error| fault(&error))?;
    let Value::Object(_) = value else {
        return Err("found no JSON object".to_string().into());
    };
    put(&value, row)?;
    let stamp = |place: &&str| nanoseconds(value.pointer(place)?).filter(|stamp| *stamp != 0);
    Ok(STAMPS.iter().find_map(stamp))
}

/// The time since 1970 of a stamp, ns: seconds and nanoseconds as fields, a date and a time of day, or a number in s, ms, us or ns.
#[cfg(feature = "mcap")]
fn nanoseconds(stamp: &Value) -> Option<i64> {
    match stamp {
        Value::Object(fields) => {
            let part = |keys: &[&str]| keys.iter().find_map(|key| fields.get(*key)?.as_i64());
            let nanos = part(&["nanosec", "nsec", "nsecs", "nanos"])?;
            part(&["sec", "secs", "seconds"])?.checked_mul(1_000_000_000)?.checked_add(nanos)
        }
        Value::String(text) => {
            // A time of day alone is none since 1970, and without a zone it is unknown which hour is meant.
            let zone = text.get("2026-11-21T19:07:00".len()..).unwrap_or_default();
            let is_of_zone = zone.contains(['Z', 'z', '+', '-']) || zone.ends_with("UTC");
            let seconds = date_time(text).filter(|seconds| is_of_zone && *seconds >= 86_400.0)?;
            Some((seconds * 1e9).round() as i64)
        }
        Value::Number(number) => {
            let found = number.as_f64()?;
            let (_, unit) = EPOCH_UNITS.into_iter().find(|(least, _)| found >= *least)?;
            // Digits beyond those of a floating point number count.
            let whole = number.as_i64().filter(|_| unit == 1.0);
            whole.or_else(|| Some((found * unit).round() as i64))
        }
        _ => None,
    }
}

/// Puts the values of an object into the last row.
///
/// # Errors
/// When there are too many columns, or two values have one name, such as `a.b` and `b` within `a`.
pub fn put(object: &Value, row: &mut InMemoryTable) -> Result<(), Failure> {
    spread(object, &mut String::new(), row, 0)
}

fn spread(value: &Value, path: &mut String, row: &mut InMemoryTable, depth: usize) -> Result<(), Failure> {
    if depth > MAX_DEPTH {
        return Err(format!("`{path}` is nested more than {MAX_DEPTH} deep").into());
    }
    let length = path.len();
    let is_new = match value {
        // Nothing is said about what it would be.
        Value::Null => true,
        Value::Bool(flag) => row.put(path, f64::from(u8::from(*flag)))?,
        Value::Number(number) => row.put(path, number.as_f64().unwrap_or(f64::NAN))?,
        Value::String(text) => row.put_text(path, text)?,
        Value::Array(items) if items.len() > MAX_ARRAY => true,
        Value::Array(items) => {
            let letters = LogChannel::parse(path)
                .map(|channel| channel.shape().components())
                .filter(|parts| parts.len() == items.len() && parts.len() > 1);
            for (place, item) in items.iter().enumerate() {
                match letters.and_then(|letters| letters.get(place)) {
                    Some(letter) => path.push_str(&format!(".{letter}")),
                    None => path.push_str(&format!("[{place}]")),
                }
                spread(item, path, row, depth + 1)?;
                path.truncate(length);
            }
            true
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
            true
        }
    };
    if is_new { Ok(()) } else { Err(format!("`{path}` occurs twice, as one key and as nested ones").into()) }
}
