//! Writes a recording as a canonical CSV with its scene and events beside it.

use super::cells::{quoted, write_number};
use super::{beside, events, scene::parse_scene};
use crate::atomic_write::Files;
use crate::read::formats::delimited_text;
use crate::read::table::Source;
use std::io::Write;
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_base::recording::Recording;
use teachtree_base::yaml;

/// Writes a recording: the log at `path`, `<stem>.scene.yaml` and, when there are events, `<stem>.events.csv` beside it.
///
/// # Errors
/// When a file cannot be written, or a column is not as long as the time; then the log is not there.
pub fn write(recording: &Recording, path: &Path) -> Result<(), InputError> {
    let mut files = Files::default();
    add(&mut files, recording, path)?;
    files.commit()
}

/// Adds the files of a recording to others: the log at `path`, `<stem>.scene.yaml` and, when there are events, `<stem>.events.csv` beside it.
///
/// # Errors
/// When a file cannot be written, or a column is not as long as the time; then none is there.
pub fn add(files: &mut Files, recording: &Recording, path: &Path) -> Result<(), InputError> {
    check_lengths(recording, path)?;
    let [scene, _] = beside(path, "scene.yaml");
    let [events_path, _] = beside(path, "events.csv");
    let text = yaml::write(&recording.scene)?;
    files.add(&scene, |out| out.write_all(text.as_bytes()))?;
    if recording.events.is_empty() {
        // Events of an earlier recording of the same name would be taken for this one's.
        files.remove(&events_path);
    } else {
        files.add(&events_path, |out| events::write(out, &recording.events))?;
    }
    files.add_log(path, |out| write_log(out, recording))
}

/// A recording as its log is read, without any file; `name` is what the log is called in messages.
///
/// # Errors
/// When a column is not as long as the time, or the log could not be read.
pub fn source(recording: &Recording, name: &Path) -> Result<Source, InputError> {
    check_lengths(recording, name)?;
    let shown = name.display().to_string();
    let mut bytes = Vec::new();
    write_log(&mut bytes, recording).map_err(|error| InputError::new(&shown, error.to_string()))?;
    let source = delimited_text::source(Box::new(std::io::Cursor::new(bytes)), &shown)?;
    let scene = parse_scene(&yaml::write(&recording.scene)?, &shown)?;
    Ok(Source { scene: Some(scene), events: recording.events.clone(), ..source })
}

/// Adds the columns and labels of a recording, without further files beside the table.
pub(crate) fn add_table(files: &mut Files, recording: &Recording, path: &Path) -> Result<(), InputError> {
    check_lengths(recording, path)?;
    files.add(path, |out| write_log(out, recording))
}

/// Refuses a recording with a column that is not as long as the time.
pub(crate) fn check_lengths(recording: &Recording, path: &Path) -> Result<(), InputError> {
    let name = path.display().to_string();
    let rows = recording.time.len();
    let odd = recording.columns.iter().find(|(_, column)| column.values.len() != rows).map(|(name, _)| name);
    if let Some(column) =
        odd.or_else(|| recording.labels.iter().find(|(_, texts)| texts.len() != rows).map(|(name, _)| name))
    {
        return Err(InputError::new(format!("{name} column {column}"), "the column is not as long as the time"));
    }
    Ok(())
}

fn write_log(out: &mut dyn Write, recording: &Recording) -> std::io::Result<()> {
    out.write_all(b"time [s]")?;
    for (name, column) in &recording.columns {
        let unit = column.dimension.si_unit();
        let title = if unit.is_empty() { name.clone() } else { format!("{name} [{unit}]") };
        write!(out, ",{}", quoted(&title))?;
    }
    for name in recording.labels.keys() {
        write!(out, ",{}", quoted(name))?;
    }
    writeln!(out)?;
    for (row, time) in recording.time.iter().enumerate() {
        write_number(out, *time)?;
        for column in recording.columns.values() {
            out.write_all(b",")?;
            write_number(out, column.values.get(row).copied().unwrap_or(f64::NAN))?;
        }
        for texts in recording.labels.values() {
            write!(out, ",{}", quoted(texts.get(row).map_or("", String::as_str)))?;
        }
        writeln!(out)?;
    }
    Ok(())
}
