//! JSON lines: an object a line, each a row; the first line may be `{"scene": {…}}`, the scene of the log, and no other line may.

use super::json::{self, UniqueKeys, fault};
use super::rosmsg::Failure;
use super::truncated;
use crate::read::csv::check_scene;
use crate::read::element_names::ElementNames;
use crate::read::memory_table::InMemoryTable;
use crate::read::table::Source;
use serde_json::Value;
use std::io::{BufRead, Read};
use teachtree_base::error::InputError;
use teachtree_base::json::message_of;
use teachtree_base::scene::Scene;

/// The longest line that is read, in bytes.
const MAX_LINE: u64 = 4 << 20;

/// Reads a log to its end.
///
/// # Errors
/// At the first line that is not a JSON object.
pub fn read(bytes: impl BufRead, file: String) -> Result<Source, InputError> {
    let mut lines = Lines::new(bytes, file.clone());
    let (mut rows, mut names) = (InMemoryTable::new(&file), ElementNames::default());
    let mut scene = None;
    let mut cut = None;
    while let Some(line) = lines.line()? {
        match line {
            Line::Scene(found) => scene = Some(*found),
            Line::Row(row) => {
                push(&row, &mut rows).map_err(|message| lines.error(message))?;
                names.put(&mut rows, |_| true)?;
            }
            Line::Truncated(message) if rows.rows() > 0 => cut = Some(message),
            Line::Truncated(_) => return Err(lines.error("found no JSON object: the log ends within its first row")),
        }
    }
    Ok(source(rows, scene, cut))
}

/// A log of these rows; `cut` is the message when the last one was cut short.
pub fn source(rows: InMemoryTable, scene: Option<Scene>, cut: Option<String>) -> Source {
    let issues = cut.into_iter().map(|message| truncated(0.0, message)).collect();
    Source { scene, issues, ..Source::one(rows.place.clone(), rows.header(), Box::new(rows)) }
}

/// Puts an object as a row after the others.
pub fn push(row: &Row, rows: &mut InMemoryTable) -> Result<(), String> {
    rows.begin_row_at(row.line).map_err(|error| error.message)?;
    json::put(&row.object, rows).map_err(|failure| match failure {
        Failure::Message(message) => message,
        Failure::Log(error) => error.message,
    })
}

/// A sample and the line that it stands in.
pub struct Row {
    object: Value,
    line: u64,
}

/// The content of a line.
pub enum Line {
    /// The scene of the log.
    Scene(Box<Scene>),
    /// A sample.
    Row(Row),
    /// The beginning of one, at the end of the log.
    Truncated(String),
}

/// The lines of a log.
pub struct Lines<R> {
    bytes: R,
    file: String,
    row: u64,
    /// Whether a line was read that says something.
    begun: bool,
}

impl<R: BufRead> Lines<R> {
    /// Lines of these bytes; `file` is their name in messages.
    pub fn new(bytes: R, file: String) -> Self {
        Self { bytes, file, row: 0, begun: false }
    }

    /// An error at the line that was read last.
    pub fn error(&self, message: impl Into<String>) -> InputError {
        InputError::new(format!("{} row {}", self.file, self.row), message)
    }

    /// The next line that is not blank, waiting for it.
    ///
    /// # Errors
    /// The line is not a JSON object.
    pub fn line(&mut self) -> Result<Option<Line>, InputError> {
        loop {
            self.row += 1;
            let mut line = vec![];
            let read = self.bytes.by_ref().take(MAX_LINE).read_until(b'\n', &mut line);
            let read = read.map_err(|error| self.error(format!("cannot be read: {error}")))?;
            if read == 0 {
                return Ok(None);
            }
            if read as u64 == MAX_LINE {
                return Err(self.error(format!("the line is longer than {MAX_LINE} bytes")));
            }
            if line.iter().all(u8::is_ascii_whitespace) {
                continue;
            }
            let is_first = !std::mem::replace(&mut self.begun, true);
            return match serde_json::from_slice(&line) {
                Ok(UniqueKeys(Value::Object(mut object))) => match object.remove("scene") {
                    Some(_) if !is_first => Err(self.error("found a `scene`, expected it in the first line only")),
                    Some(_) if !object.is_empty() => {
                        Err(self.error("found a `scene` beside other keys, expected it in a line of its own"))
                    }
                    Some(scene) => self.scene(scene).map(Some),
                    None => Ok(Some(Line::Row(Row { object: Value::Object(object), line: self.row }))),
                },
                // Only the last line can be the one that was being written when the recording stopped.
                Err(error) if !line.ends_with(b"\n") && !error.is_data() => {
                    Ok(Some(Line::Truncated(format!("row {}, the last one, is cut short; it is left out", self.row))))
                }
                Ok(_) => Err(self
                    .error("found no object, expected one such as `{\"time\": 0.001, \"right.thumb.force.x\": 0.5}`")),
                Err(error) => {
                    let letter = if error.is_eof() { String::new() } else { format!(" letter {}", error.column()) };
                    let place = format!("{} row {}{letter}", self.file, self.row);
                    Err(InputError::new(place, fault(&error)))
                }
            };
        }
    }

    fn scene(&self, scene: Value) -> Result<Line, InputError> {
        let scene: Scene =
            serde_json::from_value(scene).map_err(|error| self.error(format!("scene: {}", message_of(&error))))?;
        check_scene(&scene).map_err(|error| self.error(format!("scene.{}: {}", error.place, error.message)))?;
        Ok(Line::Scene(Box::new(scene)))
    }
}
