//! Reads and writes YAML; no other file uses the YAML crate. Every error has file, line and column, and uses the terms of YAML (keys, lists)
//! instead of Rust types.

mod duplicate_keys;
mod syntax_errors;

use super::error::InputError;
use super::short_number::ShortNumber;
use super::spelling::nearest;
use serde::de::{DeserializeOwned, DeserializeSeed, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserializer, Serialize};
use std::fmt;
use std::path::Path;

/// Whether a file is YAML by its name.
pub fn is_yaml(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "yaml" || ending == "yml")
}

/// Size limit of a YAML text, bytes.
pub const MAX_BYTES: usize = 1 << 20;
/// Nesting limit of lists `[…]` and mappings `{…}`; the time of the YAML crate grows with the square of the depth.
pub const MAX_DEPTH: usize = 64;
/// A longer number is abbreviated in messages, with an exponent where that is shorter.
const LONG: usize = 17;

/// Parses a YAML text; `file` is its name in errors. The types refuse unknown keys (`deny_unknown_fields`).
///
/// # Errors
/// The first error, at `file:line:column`.
pub fn read<T: DeserializeOwned>(text: &str, file: &str) -> Result<T, InputError> {
    if text.len() > MAX_BYTES {
        return Err(InputError::new(file, format!("the file has {} bytes, at most {MAX_BYTES} are read", text.len())));
    }
    if let Some((line, column)) = too_deep(text) {
        let message = format!("brackets are nested more than {MAX_DEPTH} deep");
        return Err(InputError::new(format!("{file}:{line}:{column}"), message));
    }
    let mut documents = serde_yaml::Deserializer::from_str(text);
    if let Some(error) = documents.find_map(|document| duplicate_keys::search(document).err())
        && let (message, Some(at)) = (error.to_string(), error.location())
        && let Some(message) = duplicate_keys::message_of(&message)
    {
        return Err(InputError::new(format!("{file}:{}:{}", at.line(), at.column()), message));
    }
    serde_yaml::from_str(text).map_err(|error| plain(&error, text, file))
}

/// An error of the YAML crate in the terms of YAML, at its place.
fn plain(error: &serde_yaml::Error, text: &str, file: &str) -> InputError {
    let message = error.to_string();
    let Some(at) = error.location() else { return InputError::new(file, in_plain_words(&message)) };
    let at = (at.line(), at.column());
    if let Some((line, column)) = syntax_errors::unclosed_list(text, at) {
        let message = "found a list that is not closed in its line, expected `]` before the next key";
        return InputError::new(format!("{file}:{line}:{column}"), message);
    }
    if let Some(found) = syntax_errors::explain(text, &message, at) {
        let (line, column) = found.at;
        let error = InputError::new(format!("{file}:{line}:{column}"), found.message);
        return InputError { help: found.help, ..error };
    }
    // The crate appends the place, which the error already contains.
    let message = message.split(" at line ").next().unwrap_or(&message);
    let error = InputError::new(format!("{file}:{}:{}", at.0, at.1), in_plain_words(message));
    InputError { help: meant(message).map(|near| format!("did you mean `{near}`?")), ..error }
}

/// The known name nearest to the unknown key or name of a message of serde: ``unknown field `a`, expected `b` or `c` ``.
fn meant(message: &str) -> Option<&str> {
    let names = ["unknown field ", "unknown variant "].iter().find_map(|kind| message.split_once(kind))?.1;
    let mut quoted = names.split('`').skip(1).step_by(2);
    nearest(quoted.next()?, quoted)
}

/// Returns the place `file:line:column` of the value at a path of keys; list items are numbered from 0. If a key does not exist, the place of its
/// parent is returned.
pub fn place(text: &str, file: &str, keys: &[&str]) -> String {
    let found =
        serde_yaml::Deserializer::from_str(text).next().and_then(|value| KeyPath(keys).deserialize(value).err());
    match found.and_then(|stopped| stopped.location()) {
        Some(at) => format!("{file}:{}:{}", at.line(), at.column()),
        None => file.into(),
    }
}

/// Replaces the place of an error, a dotted path of keys such as `bodies.cube.mass`, by the place in the text.
pub fn located(error: InputError, text: &str, file: &str) -> InputError {
    let keys: Vec<&str> = error.place.split('.').collect();
    InputError { place: place(text, file, &keys), message: format!("{}: {}", error.place, error.message), ..error }
}

/// The path of keys to a value. Descends along them and stops at the value with an error, since the crate reports a place only with an error.
struct KeyPath<'k>(&'k [&'k str]);

impl<'de> DeserializeSeed<'de> for KeyPath<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<(), D::Error> {
        from.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for KeyPath<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a key")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let (Some((key, below)), Some(found)) = (self.0.split_first(), map.next_key::<String>()?) {
            if found == *key {
                return map.next_value_seed(KeyPath(below));
            }
            map.next_value::<IgnoredAny>()?;
        }
        Err(Error::custom("here"))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<(), A::Error> {
        if let Some((wanted, below)) = self.0.split_first()
            && let Ok(wanted) = wanted.parse::<usize>()
        {
            for _ in 0..wanted {
                items.next_element::<IgnoredAny>()?;
            }
            items.next_element_seed(KeyPath(below))?;
        }
        Err(Error::custom("here"))
    }
}

/// Writes a value as YAML.
///
/// # Errors
/// A value that YAML cannot represent.
pub fn write<T: Serialize>(value: &T) -> Result<String, InputError> {
    serde_yaml::to_string(value).map_err(|error| InputError::new("YAML", error.to_string()))
}

/// Returns the line and column, from 1, at which brackets are nested deeper than [`MAX_DEPTH`]. Brackets in comments and quoted texts do not count.
fn too_deep(text: &str) -> Option<(usize, usize)> {
    let (mut depth, mut quote) = (0_usize, None);
    for (row, line) in text.lines().enumerate() {
        let mut before = ' ';
        for (column, sign) in line.chars().enumerate() {
            match (quote, sign) {
                (Some(open), _) if open == sign => quote = None,
                (Some(_), _) => {}
                (None, '#') if before.is_whitespace() => break,
                // A quote inside a word is an apostrophe.
                (None, '"' | '\'') if !before.is_alphanumeric() => quote = Some(sign),
                (None, '[' | '{') => depth += 1,
                (None, ']' | '}') => depth = depth.saturating_sub(1),
                (None, _) => {}
            }
            if depth > MAX_DEPTH {
                return Some((row + 1, column + 1));
            }
            before = sign;
        }
    }
    None
}

/// Rewrites a message of serde in the terms of YAML and JSON: `a.b: invalid type: sequence, expected a string` becomes
/// `a.b: found a list, expected a text`.
pub(crate) fn in_plain_words(message: &str) -> String {
    let mark = |mark: &str| message.find(mark).map(|at| message.split_at(at));
    let kinds = ["invalid type: ", "invalid value: ", "invalid length ", "unknown field ", "unknown variant "];
    for kind in kinds {
        let Some((path, rest)) = mark(kind) else { continue };
        let rest = rest.get(kind.len()..).unwrap_or_default();
        let (found, wanted) = rest.rsplit_once(", expected ").or_else(|| rest.split_once(", ")).unwrap_or((rest, ""));
        let found = match kind {
            "invalid length " => format!("a list of {found}"),
            "unknown field " => format!("the key {found}"),
            _ => found_words(found),
        };
        let wanted = wanted_words(wanted);
        return format!(
            "{path}found {found}{}",
            if wanted.is_empty() { wanted } else { format!(", expected {wanted}") }
        );
    }
    for (kind, says) in [("missing field ", "is missing"), ("duplicate field ", "occurs twice")] {
        if let Some((path, rest)) = mark(kind) {
            return format!("{path}the key {} {says}", rest.get(kind.len()..).unwrap_or_default());
        }
    }
    message.into()
}

/// Rewrites a value in serde's notation: `string "hello"`, ``integer `5` ``, `sequence`.
fn found_words(found: &str) -> String {
    match found {
        "sequence" => return "a list".into(),
        "map" => return "keys with values".into(),
        "unit value" => return "nothing".into(),
        _ => {}
    }
    let quoted =
        ["string ", "integer ", "floating point ", "boolean "].iter().find_map(|kind| found.strip_prefix(kind));
    quoted.map_or_else(|| found.to_string(), |value| format!("`{}`", short(value.trim_matches(['"', '`']))))
}

/// Abbreviates a number with many digits; returns any other text unchanged.
fn short(value: &str) -> String {
    match value.parse::<f64>() {
        Ok(number) if number.is_finite() && value.len() > LONG => ShortNumber(number).to_string(),
        _ => value.into(),
    }
}

/// Rewrites serde's expected type.
fn wanted_words(wanted: &str) -> String {
    let list_of = wanted.strip_prefix("an array of length ").or_else(|| wanted.strip_prefix("a tuple of size "));
    match wanted {
        "a string" => "a text".into(),
        "a sequence" => "a list".into(),
        "a map" => "keys with values".into(),
        "a boolean" => "`true` or `false`".into(),
        "f64" | "f32" => "a number".into(),
        "u8" | "u16" | "u32" | "u64" | "usize" | "i8" | "i16" | "i32" | "i64" => "a whole number".into(),
        _ if wanted.starts_with("struct ") => "keys with values".into(),
        _ if wanted.starts_with("variant ") || wanted.starts_with("enum ") => "a name".into(),
        _ => list_of.map_or_else(|| wanted.to_string(), |length| format!("a list of {length}")),
    }
}
