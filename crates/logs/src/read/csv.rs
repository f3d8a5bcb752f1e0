//! The canonical CSV: one column a channel component, `name [unit]` in the header, the scene and the events in files beside it.
//!
//! What is written is read back to the same bits. A file appears whole or not at all.

use crate::allowed_folders::AllowedFolders;
use crate::atomic_write::Files;
use crate::issue::Issue;
use crate::names;
use crate::read::formats::{self, delimited_text::unreadable};
use crate::read::table::{ColumnRequest, Source};
use crate::read::text;
use indexmap::IndexMap;
use std::borrow::Cow;
use std::fs::File;
use std::path::{Path, PathBuf};
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_base::quantity::Frequency;
use teachtree_base::recording::{Column, Event, Recording};
use teachtree_base::scene::Scene;
use teachtree_base::short_number::ShortNumber;
use teachtree_base::spelling::nearest;
use teachtree_base::units::{Dimension, compound};
use teachtree_base::yaml;

/// A recording with what was dropped while it was read.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedRecording {
    /// The recording; columns with names that are not canonical are in it too.
    pub recording: Recording,
    /// Rows that were left out.
    pub issues: Vec<Issue>,
    /// When each row of the file was, s, on the time base of the recording; also of those that were left out.
    pub row_time: Vec<f64>,
}

/// Reads a canonical log with the scene and the events beside it; `scene` replaces the scene file beside the log.
///
/// # Errors
/// The first thing that cannot be read as the policies of docs/logs.md want it, with file, row and column.
pub fn read(path: &Path, scene: Option<&Path>) -> Result<LoadedRecording, InputError> {
    read_source(formats::open(path)?, path, scene, &AllowedFolders::default())
}

/// The same of a log that is opened already. The files beside it must be in `folders`.
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
        (None, None) => scene_beside(path, folders)?,
    };
    let mut read = columns(source, &StampSource::canonical())?;
    read.recording.scene = scene;
    read.recording.events = match beside(path, "events.csv").into_iter().find(|file| folders.has(file)) {
        Some(file) if events.is_empty() => read_events(&file, folders)?,
        _ => events,
    };
    Ok(read)
}

/// Reads the scene that a log carries, from a file in `folders`.
///
/// # Errors
/// When there is none beside the log, it is outside of the folders, or it is wrong.
pub fn scene_beside(log: &Path, folders: &AllowedFolders) -> Result<Scene, InputError> {
    if let Some(file) = scene_file_beside(log) {
        return scene_of(folders.open(&file), &file);
    }
    let help = "name the scene with --scene, or a binding with --binding";
    if log == Path::new("-") {
        return Err(InputError::new("standard input", "carries no scene").help(help).or_kind(ErrorKind::Scene));
    }
    let mut wanted = beside(log, "scene.yaml").map(|file| format!("`{}`", file.display())).to_vec();
    wanted.dedup();
    let message = format!("the log has no scene beside it, expected {}", wanted.join(" or "));
    Err(InputError::new(log.display().to_string(), message).help(help).or_kind(ErrorKind::Scene))
}

/// Returns the scene file beside a log, if there is one. It may be a pipe or a link that leads nowhere, which reading it refuses by name.
pub fn scene_file_beside(log: &Path) -> Option<PathBuf> {
    beside(log, "scene.yaml").into_iter().find(|file| file.symlink_metadata().is_ok())
}

/// Reads a scene file.
///
/// # Errors
/// When it cannot be read, or says something that a scene cannot mean, at `file:line:column`.
pub fn read_scene(path: &Path) -> Result<Scene, InputError> {
    scene_of(text::opened(path), path)
}

/// Reads the scene in an open file. `path` is its name in messages.
fn scene_of(file: Result<File, InputError>, path: &Path) -> Result<Scene, InputError> {
    let read = || parse_scene(&text::whole(&file?, path, yaml::MAX_BYTES as u64)?, &path.display().to_string());
    read().map_err(|error| error.or_kind(ErrorKind::Scene))
}

/// Reads the text of a scene file; `name` is its name in messages.
///
/// # Errors
/// What a scene cannot mean, at `name:line:column`.
pub fn parse_scene(text: &str, name: &str) -> Result<Scene, InputError> {
    let scene: Scene = yaml::read(text, name)?;
    check_scene(&scene).map_err(|error| yaml::located(error, text, name))?;
    Ok(scene)
}

/// No body begins farther away, m.
const FARTHEST_M: f64 = 1e3;
/// The most bodies: all pairs of them are looked at.
const MAX_BODIES: usize = 256;
/// The most parts of a body.
const MAX_PARTS: usize = 256;

/// What a scene says that it cannot mean, at its keys, `bodies.cube.position`: [`yaml::located`] makes a place in a file of them.
pub fn check_scene(scene: &Scene) -> Result<(), InputError> {
    if let Some(name) = scene.bodies.keys().find(|name| !names::is_body_name(name)) {
        return Err(InputError::new(
            "bodies",
            format!(
                "`{name}` cannot name a body: names have no blanks, commas or dots, and are not `left`, `right`, `both`, `contact`, `time`"
            ),
        ));
    }
    if scene.bodies.len() > MAX_BODIES {
        let message = format!("found {} bodies, expected at most {MAX_BODIES}", scene.bodies.len());
        return Err(InputError::new("bodies", message));
    }
    for (name, body) in &scene.bodies {
        if body.parts.len() > MAX_PARTS {
            let message = format!("found {} parts, expected at most {MAX_PARTS}", body.parts.len());
            return Err(InputError::new(format!("bodies.{name}.parts"), message));
        }
        for (index, part) in body.parts.iter().enumerate() {
            part.check().map_err(|message| InputError::new(format!("bodies.{name}.parts.{index}"), message))?;
        }
        if let Some(far) = body.position.iter().find(|length| length.0.abs() > FARTHEST_M) {
            let message = format!("found {} m, expected at most {FARTHEST_M} m", ShortNumber(far.0));
            return Err(InputError::new(format!("bodies.{name}.position"), message));
        }
        for (socket, spec) in &body.sockets {
            let unknown = spec.accepts.iter().flatten().find(|object| !scene.bodies.contains_key(*object));
            if let Some(unknown) = unknown {
                let message = format!("found `{unknown}`, expected the names of bodies of the scene");
                return Err(InputError::new(format!("bodies.{name}.sockets.{socket}.accepts"), message));
            }
        }
    }
    for (side, hand) in &scene.hands {
        let twice = hand.fingers.iter().enumerate().find(|(at, finger)| hand.fingers[..*at].contains(finger));
        if let Some((_, finger)) = twice {
            let message = format!("found {finger} twice, expected each finger once");
            return Err(InputError::new(format!("hands.{side}.fingers"), message));
        }
    }
    Ok(())
}

/// Where the stamps of a table are.
pub enum StampSource {
    /// In the column of this name; in this unit, where the header says none.
    Column(String, Option<String>),
    /// Nowhere: the rows come at this rate.
    Rate(Frequency),
}

impl StampSource {
    /// As a canonical log has it.
    pub fn canonical() -> Self {
        Self::Column("time".into(), None)
    }
}

/// The columns of a canonical table: name, dimension, what to read of it.
pub fn wanted(source: &Source, clock: &StampSource) -> Result<Vec<(String, Dimension, ColumnRequest)>, InputError> {
    let header = source.header();
    let header_place = source.header_place.clone();
    let place = |name: &str| format!("{header_place} column {name}");
    let unnamed = source.sheets.iter().flat_map(|sheet| &sheet.header).position(String::is_empty);
    if let Some(column) = unnamed {
        return Err(InputError::new(place(&(column + 1).to_string()), "the column has no name"));
    }
    let mut seen: IndexMap<&str, Dimension> = IndexMap::new();
    let mut wants = Vec::with_capacity(header.len());
    for title in &header {
        let (name, unit) = names::split_unit(title);
        if name.is_empty() {
            return Err(InputError::new(place(&(wants.len() + 1).to_string()), "the column has no name"));
        }
        let (want, dimension) = match clock {
            StampSource::Column(time, said) if time == name => want("time", unit.or(said.as_deref())),
            StampSource::Rate(_) if name == "time" => Ok((ColumnRequest::Nothing, Dimension::TIME)),
            _ => want(name, unit),
        }
        .map_err(|message| InputError::new(place(name), message))?;
        if let Some(first) = seen.get_index_of(name) {
            let message = format!("the column is there twice, as columns {} and {}", first + 1, wants.len() + 1);
            return Err(InputError::new(place(name), message).help("keep one of them, or rename the other"));
        }
        seen.insert(name, dimension);
        wants.push(want);
    }
    if let StampSource::Column(time, _) = clock
        && !seen.contains_key(time.as_str())
    {
        let near = nearest("time", seen.keys().copied())
            .or_else(|| seen.keys().copied().find(|name| matches!(*name, "t" | "timestamp" | "stamp")));
        let error = InputError::new(&header_place, format!("the log has no column `{time}`"));
        return Err(match near {
            Some(name) => error.help(format!(
                "rename `{name}` to `time [s]`, or describe the log in a binding and name it with --binding"
            )),
            None => error.help("add `time [s]`, or describe the log in a binding and name it with --binding"),
        });
    }
    let named = seen.into_iter().zip(wants);
    Ok(named.map(|((name, dimension), want)| (name.to_string(), dimension, want)).collect())
}

/// Reads the columns of a canonical table.
pub fn columns(source: Source, clock: &StampSource) -> Result<LoadedRecording, InputError> {
    let wanted = wanted(&source, clock)?;
    let wants: Vec<ColumnRequest> = wanted.iter().map(|(.., want)| *want).collect();
    let rate_hz = match clock {
        StampSource::Column(..) => None,
        StampSource::Rate(rate) => Some(rate.0),
    };
    let table = source.read(&wants, rate_hz)?;
    let mut recording = Recording { time: table.time, ..Recording::default() };
    for (((name, dimension, want), numbers), texts) in wanted.into_iter().zip(table.numbers).zip(table.texts) {
        match want {
            ColumnRequest::Nothing | ColumnRequest::Time(_) => {}
            ColumnRequest::Number(_) | ColumnRequest::Optional(_) | ColumnRequest::Sniff => {
                recording.columns.insert(name, Column { dimension, values: numbers });
            }
            ColumnRequest::Text => {
                recording.labels.insert(name, texts);
            }
        }
    }
    Ok(LoadedRecording { recording, issues: table.issues, row_time: table.row_time })
}

/// What to read from a column with this name and unit, and its dimension.
fn want(name: &str, unit: Option<&str>) -> Result<(ColumnRequest, Dimension), String> {
    if names::is_label(name) {
        return Ok((ColumnRequest::Text, Dimension::NONE));
    }
    let meant =
        if name == "time" { Some(Dimension::TIME) } else { names::meaning(name).map(|meaning| meaning.dimension) };
    let read = unit.map(compound);
    match (meant, read) {
        (Some(meant), Some(Err(part))) => Err(format!("`{part}` is not a known unit, expected one of {meant}")),
        (Some(meant), Some(Ok((_, found)))) if found != meant => {
            Err(format!("`{name}` is given in `{}`, which is {found}, expected {meant}", unit.unwrap_or_default()))
        }
        (Some(meant), read) => {
            let to_si = read.and_then(Result::ok).map_or(1.0, |(to_si, _)| to_si);
            Ok((if name == "time" { ColumnRequest::Time(to_si) } else { ColumnRequest::Number(to_si) }, meant))
        }
        (None, read) => {
            let (to_si, dimension) = read.and_then(Result::ok).unwrap_or((1.0, Dimension::NONE));
            Ok((ColumnRequest::Optional(to_si), dimension))
        }
    }
}

/// The files that may stand beside a log: `demonstration.scene.yaml`, `demonstration.csv.scene.yaml`.
pub fn beside(log: &Path, ending: &str) -> [PathBuf; 2] {
    let mut whole = log.as_os_str().to_owned();
    whole.push(format!(".{ending}"));
    [log.with_extension(ending), PathBuf::from(whole)]
}

fn read_events(path: &Path, folders: &AllowedFolders) -> Result<Vec<Event>, InputError> {
    let name = path.display().to_string();
    let unreadable = |error: ::csv::Error| unreadable(&name, &error);
    let mut reader = ::csv::Reader::from_reader(folders.open(path)?);
    if reader.headers().map_err(unreadable)?.iter().ne(EVENT_COLUMNS) {
        return Err(InputError::new(
            format!("{name} row 1"),
            format!("expected the columns {}", EVENT_COLUMNS.join(", ")),
        ));
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

const EVENT_COLUMNS: [&str; 3] = ["time [s]", "kind", "subjects"];

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
    let [events, _] = beside(path, "events.csv");
    let text = yaml::write(&recording.scene)?;
    files.add(&scene, |out| out.write_all(text.as_bytes()))?;
    if recording.events.is_empty() {
        // Events of an earlier recording of the same name would be taken for this one's.
        files.remove(&events);
    } else {
        files.add(&events, |out| write_events(out, &recording.events))?;
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
    let source = formats::delimited_text::source(Box::new(std::io::Cursor::new(bytes)), &shown)?;
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

fn write_log(out: &mut dyn std::io::Write, recording: &Recording) -> std::io::Result<()> {
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

fn write_events(out: &mut dyn std::io::Write, events: &[Event]) -> std::io::Result<()> {
    writeln!(out, "{}", EVENT_COLUMNS.join(","))?;
    for event in events {
        write_number(out, event.time_s)?;
        writeln!(out, ",{},{}", quoted(&event.kind), quoted(&event.subjects.join(" ")))?;
    }
    Ok(())
}

/// The shortest text that reads back to the same bits; nothing for a value that was not measured.
fn write_number(out: &mut dyn std::io::Write, value: f64) -> std::io::Result<()> {
    if value.is_nan() {
        Ok(())
    } else if value != 0.0 && !(1e-5..1e15).contains(&value.abs()) {
        write!(out, "{value:e}")
    } else {
        write!(out, "{value}")
    }
}

/// A text as a cell.
fn quoted(text: &str) -> Cow<'_, str> {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\"")).into()
    } else {
        text.into()
    }
}
