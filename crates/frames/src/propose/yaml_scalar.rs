//! Columns as texts of YAML.

use std::fmt::Write as _;

/// A text as YAML takes it.
pub fn scalar(text: &str) -> String {
    if text.starts_with('{') || text.starts_with('[') {
        return text.to_string();
    }
    let plain = text.chars().all(|c| c.is_alphanumeric() || " _-./<>=+[]*".contains(c))
        && text.starts_with(|c: char| c.is_alphanumeric() || c == '/' || c == '_')
        && !["true", "false", "null"].contains(&text.to_lowercase().as_str());
    if plain { text.to_string() } else { quoted(text) }
}

/// A text in quotes.
pub fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for letter in text.chars() {
        match letter {
            '\\' | '"' => quoted.extend(['\\', letter]),
            letter if letter.is_control() => {
                let _ = write!(quoted, "\\u{:04x}", u32::from(letter));
            }
            letter => quoted.push(letter),
        }
    }
    quoted + "\""
}

/// A text after `#`.
pub fn comment(text: &str) -> String {
    text.chars().map(|letter| if letter.is_control() { ' ' } else { letter }).collect()
}
