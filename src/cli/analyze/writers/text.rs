//! `--format text`: a timeline. Its lines are as long as the terminal, or `COLUMNS`, allows.

use super::super::timeline;
use super::Writer;
use crate::cli::output;

pub const WRITER: Writer = Writer {
    width: || Some(output::width()),
    ..Writer::new("txt", |analysis, usage| Ok(timeline(analysis, usage.is_printed)))
};
