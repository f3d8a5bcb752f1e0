//! How an analysis is written: the table of `--format`. Each format has a file.

mod csv;
mod eaf;
mod json;
mod text;

use teachtree_base::error::InputError;
use teachtree_session::{Analysis, Error};

/// Formats of an analysis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// A timeline for the terminal
    Text,
    /// `teachtree.analysis/2` (docs/formats.md); a document per line when there are several recordings
    Json,
    /// A table of segments and tasks, which `score --labels` reads too
    Csv,
    /// A file of ELAN, which `score --labels` reads too (one recording only, or with `--out-dir`)
    Eaf,
}

impl Format {
    /// The table of writers.
    pub const fn writer(self) -> Writer {
        match self {
            Self::Text => text::WRITER,
            Self::Json => json::WRITER,
            Self::Csv => csv::WRITER,
            Self::Eaf => eaf::WRITER,
        }
    }
}

/// Writes analyses in one format.
pub struct Writer {
    /// The ending of its files.
    pub ending: &'static str,
    /// The text of an analysis.
    pub text: fn(&Analysis, Usage) -> Result<String, Error>,
    /// Adds the text of a recording to those of others.
    pub join: fn(&mut String, &str),
    /// Refuses a number of recordings in one output.
    pub check: fn(usize) -> Result<(), InputError>,
    /// Whether the format has no place for the issues of a log.
    pub omits_issues: bool,
    /// The width of lines, if texts depend on it.
    pub width: fn() -> Option<usize>,
}

/// How a text is used.
#[derive(Clone, Copy)]
pub struct Usage {
    /// Whether its recording is the only one of the output.
    pub alone: bool,
    /// Whether it is printed rather than written to a file.
    pub is_printed: bool,
}

impl Writer {
    /// A writer of files with this ending, whose texts follow each other.
    const fn new(ending: &'static str, text: fn(&Analysis, Usage) -> Result<String, Error>) -> Self {
        Self { ending, text, join: String::push_str, check: |_| Ok(()), omits_issues: false, width: || None }
    }
}
