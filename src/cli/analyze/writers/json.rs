//! `--format json`: a document, or a line of a document for each of several recordings.

use super::Writer;

pub const WRITER: Writer =
    Writer::new("json", |analysis, usage| Ok(if usage.alone { analysis.json() } else { analysis.json_line() }));
