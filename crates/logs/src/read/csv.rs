//! The canonical CSV: one column a channel component, `name [unit]` in the header, the scene and the events in files beside it.
//!
//! Written values are read back to the same bits. Files are written atomically.

mod beside;
mod cells;
mod columns;
mod events;
mod scene;
mod writer;

pub use beside::beside;
pub use columns::{LoadedRecording, StampSource, WantedColumn, columns, wanted};
pub use scene::{check_scene, parse_scene, read_scene, scene_beside, scene_file_beside};
pub use writer::{add, source, write};
pub(crate) use writer::{add_table, check_lengths};

use crate::allowed_folders::AllowedFolders;
use crate::names;
use crate::read::first_stamp::in_recording;
use crate::read::formats;
use crate::read::table::Source;
use std::path::Path;
use teachtree_base::error::{ErrorKind, InputError};

/// Reads a canonical log with the scene and the events beside it; `scene` replaces the scene file beside the log.
///
/// # Errors
/// The first thing that cannot be read as the policies of docs/logs.md want it, with file, row and column.
pub fn read(path: &Path, scene: Option<&Path>) -> Result<LoadedRecording, InputError> {
    read_source(formats::open(path)?, path, scene, &AllowedFolders::default())
}

/// Like the above, for an opened log. The files beside it must be in `folders`.
pub fn read_source(
    mut source: Source,
    path: &Path,
    scene: Option<&Path>,
    folders: &AllowedFolders,
) -> Result<LoadedRecording, InputError> {
    let is_untitled = |(at, title): (usize, &String)| *title == (at + 1).to_string();
    let header = source.header();
    if !header.is_empty() && header.iter().enumerate().all(is_untitled) {
        let message = "the columns have no names, expected a header such as `time [s],right.palm.position.x [m],…`";
        let error = InputError::new(&source.header_place, message);
        return Err(error.help("add a header, or name the columns by their numbers in a binding: `time: 1`"));
    }
    let (own, events) = (source.scene.take(), std::mem::take(&mut source.events));
    let scene = match (scene, own) {
        (Some(scene), _) => read_scene(scene)?,
        (None, Some(own)) => own,
        (None, None) => scene_beside(path, folders).map_err(|error| foreign(&source, path).unwrap_or(error))?,
    };
    let mut read = columns(source, &StampSource::canonical())?;
    read.recording.scene = scene;
    read.recording.events = match beside(path, "events.csv").into_iter().find(|file| folders.has(file)) {
        Some(file) if events.is_empty() => events::read(&file, folders)?,
        _ => events,
    };
    read.count_from_first();
    for event in &mut read.recording.events {
        event.time_s = in_recording(event.time_s, read.zero_stamp_s);
    }
    Ok(read)
}

/// Columns that a message about a foreign log lists.
const LISTED: usize = 4;

/// The error about a log without a binding in which no column has the name of a channel; `None` for other logs.
fn foreign(source: &Source, path: &Path) -> Option<InputError> {
    let header = source.header();
    if header.is_empty() || header.iter().any(|title| names::is_canonical(title)) {
        return None;
    }
    let listed: Vec<String> = header.iter().take(LISTED).map(|title| format!("`{title}`")).collect();
    let more = match header.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let message = format!(
        "no column has the name of a channel, expected names such as `right.tcp.position.x`; found {}{more}",
        listed.join(", ")
    );
    let log = path.display();
    let help =
        format!("describe the columns in a binding and name it with --binding; `teachtree init {log}` guesses one");
    Some(InputError::new(&source.header_place, message).help(help).or_kind(ErrorKind::Binding))
}
