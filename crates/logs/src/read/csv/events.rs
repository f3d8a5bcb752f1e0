//! The events of a recording, in a file beside its log.

use super::cells::{quoted, write_number};
use crate::allowed_folders::AllowedFolders;
use crate::read::formats::delimited_text::unreadable;
use std::io::Write;
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_base::recording::Event;

const COLUMNS: [&str; 3] = ["time [s]", "kind", "subjects"];

/// Reads a file of events in `folders`.
pub(super) fn read(path: &Path, folders: &AllowedFolders) -> Result<Vec<Event>, InputError> {
    let name = path.display().to_string();
    let unreadable = |error: ::csv::Error| unreadable(&name, &error);
    let mut reader = ::csv::Reader::from_reader(folders.open(path)?);
    if reader.headers().map_err(unreadable)?.iter().ne(COLUMNS) {
        return Err(InputError::new(format!("{name} row 1"), format!("expected the columns {}", COLUMNS.join(", "))));
    }
    let mut events = vec![];
    for record in reader.records() {
        let record = record.map_err(unreadable)?;
        let row = record.position().map_or(0, ::csv::Position::line);
        let [time, kind, subjects] = [0, 1, 2].map(|column| record.get(column).unwrap_or_default().trim());
        let time_s = time.parse::<f64>().ok().filter(|time| time.is_finite());
        let time_s = time_s.ok_or_else(|| {
            InputError::new(format!("{name} row {row} column time"), format!("found `{time}`, expected a time"))
        })?;
        events.push(Event {
            time_s,
            kind: kind.into(),
            subjects: subjects.split_whitespace().map(str::to_string).collect(),
        });
    }
    Ok(events)
}

/// Writes events as a table.
pub(super) fn write(out: &mut dyn Write, events: &[Event]) -> std::io::Result<()> {
    writeln!(out, "{}", COLUMNS.join(","))?;
    for event in events {
        write_number(out, event.time_s)?;
        writeln!(out, ",{},{}", quoted(&event.kind), quoted(&event.subjects.join(" ")))?;
    }
    Ok(())
}
