//! Reading YAML: the only place that names the YAML crate. Every error carries file, line and column.

use super::error::InputError;
use serde::de::{DeserializeOwned, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt;
use std::marker::PhantomData;

/// The largest YAML text that is read, in bytes.
pub const MAX_BYTES: usize = 1 << 20;

/// Reads a YAML text; `file` is its name in errors. Unknown keys are refused by the types (`deny_unknown_fields`).
///
/// # Errors
/// What the text lacks, at `file:line:column`.
pub fn read<T: DeserializeOwned>(text: &str, file: &str) -> Result<T, InputError> {
    if text.len() > MAX_BYTES {
        return Err(InputError::new(file, format!("the file has {} bytes, at most {MAX_BYTES} are read", text.len())));
    }
    serde_yaml::from_str(text).map_err(|error| {
        let place = match error.location() {
            Some(at) => format!("{file}:{}:{}", at.line(), at.column()),
            None => file.to_string(),
        };
        let message = error.to_string();
        // The crate appends the place that we already give.
        let message = message.split(" at line ").next().unwrap_or(&message).to_string();
        InputError::new(place, message)
    })
}

/// A map as a list: its entries in the order of the text, also those whose key stands there twice.
pub struct Entries<K, V>(pub Vec<(K, V)>);

impl<'de, K: Deserialize<'de>, V: Deserialize<'de>> Deserialize<'de> for Entries<K, V> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Collect<K, V>(PhantomData<(K, V)>);
        impl<'de, K: Deserialize<'de>, V: Deserialize<'de>> Visitor<'de> for Collect<K, V> {
            type Value = Entries<K, V>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a map")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut entries = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    entries.push(entry);
                }
                Ok(Entries(entries))
            }
        }
        deserializer.deserialize_map(Collect(PhantomData))
    }
}

/// Writes a value as YAML.
///
/// # Errors
/// When the value has a form that YAML cannot say.
pub fn write<T: Serialize>(value: &T) -> Result<String, InputError> {
    serde_yaml::to_string(value).map_err(|error| InputError::new("YAML", error.to_string()))
}
