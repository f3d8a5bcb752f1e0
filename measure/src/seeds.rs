//! Ranges of seeds on the command line.

use std::ops::RangeInclusive;

/// Parses a range of seeds such as `1..50`, the last one included.
///
/// # Errors
/// Other text, and a first seed after the last one.
pub fn parse(text: &str) -> Result<RangeInclusive<u64>, String> {
    let ends = text.split_once("..").and_then(|(first, last)| Some((first.parse().ok()?, last.parse().ok()?)));
    ends.filter(|(first, last)| first <= last)
        .map(|(first, last)| first..=last)
        .ok_or_else(|| format!("expected seeds such as `1..50`, found `{text}`"))
}
