//! Repairs the text of a URDF that is not well-formed XML but that other programs load. Lines and columns stay the same.

use roxmltree::{Document, Error, ParsingOptions};
use std::borrow::Cow;

/// How many nodes a text may have.
const MAX_NODES: u32 = 200_000;
/// Maximum number of undeclared prefixes that are accepted.
const MAX_PREFIXES: usize = 8;

/// Parses a text.
///
/// # Errors
/// The text is not XML.
pub(super) fn document(text: &str) -> Result<Document<'_>, Error> {
    Document::parse_with_options(
        text,
        ParsingOptions { nodes_limit: MAX_NODES, allow_dtd: false, entity_resolver: None },
    )
}

/// A text with comments and a document type blanked if it cannot be parsed with them, and with declarations of the prefixes that it uses without them: files have
/// elements for simulators, such as `drake:`, which are passed over.
pub(super) fn parsable(text: &str) -> Cow<'_, str> {
    let mut text = Cow::Borrowed(text);
    if document(&text).is_err_and(|error| !matches!(error, Error::UnknownNamespace(..))) {
        text = Cow::Owned(blanked(&blanked(&text, "<!--", "-->"), "<!DOCTYPE", ">"));
    }
    for _ in 0..MAX_PREFIXES {
        let Err(Error::UnknownNamespace(prefix, _)) = document(&text) else { break };
        let Some(at) = text.find("<robot").map(|at| at + "<robot".len()) else { break };
        text.to_mut().insert_str(at, &format!(" xmlns:{prefix}=\"{prefix}\""));
    }
    text
}

/// Replaces the text between these marks by blanks. A document type with definitions of its own is left.
fn blanked(text: &str, begin: &str, end: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((head, tail)) = rest.split_once(begin) {
        let Some((inner, after)) = tail.split_once(end).filter(|(inner, _)| begin == "<!--" || !inner.contains('['))
        else {
            break;
        };
        out.push_str(head);
        let marks = begin.chars().chain(inner.chars()).chain(end.chars());
        out.extend(marks.map(|letter| if letter == '\n' { '\n' } else { ' ' }));
        rest = after;
    }
    out + rest
}
