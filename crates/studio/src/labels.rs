//! Labels that a person corrects: a table beside each recording, `NAME.labels.csv`, which `score --labels` reads.
//!
//! ```text
//! track,kind,label,start_s,end_s,pinned,by,at
//! right,primitive,Grasp,1.25,1.5,pinned,mika,2026-05-04T09:30:00Z
//! ```
//!
//! A line that a person set is `pinned`: no program changes it. Lines that are not came from elsewhere, or are the tasks beside one that a person set,
//! since tasks are listed in full. The file has a version, its digest. A save names the version that it changes, and is refused if the file has another one.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use teachtree_analysis::UNKNOWN;
use teachtree_analysis::number::number;
use teachtree_analysis::score::KnownNames;
use teachtree_base::digest::Digest;
use teachtree_base::error::InputError;
use teachtree_base::hands::TrackId;
use teachtree_frames::OpenedLog;
use teachtree_language::is_primitive;
use teachtree_logs::allowed_folders::AllowedFolders;
use teachtree_logs::atomic_write::Files;
use teachtree_logs::read::formats;
use teachtree_logs::read::labels::{self, LabelKind, MAX_ROWS};
use teachtree_logs::read::text;

/// The columns of the table.
const COLUMNS: [&str; 8] = ["track", "kind", "label", "start_s", "end_s", "pinned", "by", "at"];
/// What stands in the column `pinned`.
const PINNED: &str = "pinned";
/// The largest file, bytes.
const MAX_BYTES: u64 = 32 << 20;
/// The longest name, person or date, bytes.
const MAX_TEXT: usize = 200;
/// How lines of one track may overlap, s: a boundary that was rounded.
const SAME_S: f64 = 1e-5;

/// A line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// `left`, `right`, `both`.
    pub track: String,
    /// `primitive` or `task`.
    pub kind: String,
    /// The name.
    pub label: String,
    /// Start, s.
    pub start_s: f64,
    /// End, s.
    pub end_s: f64,
    /// Whether a person set it.
    #[serde(default)]
    pub pinned: bool,
    /// The annotator.
    #[serde(default)]
    pub by: String,
    /// When, as the page says it.
    #[serde(default)]
    pub at: String,
}

/// Labels as a page sends them.
#[derive(Deserialize)]
pub struct SentLabels {
    /// The version that it changed.
    base: String,
    /// All lines.
    lines: Vec<Line>,
    /// The name of a primitive that the rules do not have yet.
    #[serde(default)]
    new: Option<String>,
}

/// The labels of a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Labels {
    /// The version of the file; empty without a file.
    pub version: String,
    /// The lines, by track, kind and time.
    pub lines: Vec<Line>,
}

/// Why labels were not saved.
pub enum SaveError {
    /// Another program or window has changed the file.
    Conflict(Labels),
    /// The lines are wrong, or the file cannot be written.
    Failed(InputError),
}

impl From<InputError> for SaveError {
    fn from(error: InputError) -> Self {
        Self::Failed(error)
    }
}

/// A file that is made of a recording, beside it: `recordings/a.labels.csv` of `recordings/a.csv`.
pub fn beside(log: &Path, ending: &str) -> PathBuf {
    let folder = formats::without_episode(log);
    folder.with_file_name(format!("{}.{ending}", formats::stem(log)))
}

/// The label file of a recording.
pub fn file(log: &Path) -> PathBuf {
    beside(log, "labels.csv")
}

/// Reads the label file of a recording and returns its text and its labels; `None` without such a file.
///
/// # Errors
/// The file does not contain labels of this recording, or is outside of the folders.
pub fn read_table(
    opened: &OpenedLog,
    folders: &AllowedFolders,
) -> Result<Option<(String, labels::Labels)>, InputError> {
    let path = file(&opened.log);
    if path.symlink_metadata().is_err() {
        return Ok(None);
    }
    let text = text::whole(&folders.open(&path)?, &path, MAX_BYTES)?;
    let mut found = labels::table(text.as_bytes(), &path, &opened.log, &opened.row_time)?;
    found.count_from(opened.zero_stamp_s);
    Ok(Some((text, found)))
}

/// Reads the labels of a recording; without a label file there are none. Lines without a track refer to `only`.
///
/// # Errors
/// Those of [`read_table`], and labels that contradict each other.
pub fn read(opened: &OpenedLog, only: Option<TrackId>, folders: &AllowedFolders) -> Result<Labels, InputError> {
    let Some((text, found)) = read_table(opened, folders)? else { return Ok(Labels::default()) };
    let provenance = provenance(&text);
    // What is read of such rows is not what stands there, and would be saved.
    if found.contradicted_s > 0.0 {
        let time = number(found.contradicted_s);
        let message = format!("{time} s have two labels that differ");
        return Err(InputError::new(&found.file, message).help("change the rows that overlap in an editor"));
    }
    let lines = found.intervals.into_iter().map(|interval| {
        let track = interval.track.or(only).ok_or_else(|| {
            let message = "the row names no track, and the recording has several";
            InputError::new(format!("{} {}", found.file, interval.place), message).help("add a column `track`")
        })?;
        let (pinned, by, at) = provenance.get(&interval.place).cloned().unwrap_or_default();
        let kind = if interval.kind == LabelKind::Task { "task" } else { "primitive" };
        let (start_s, end_s) = (interval.start_s, interval.end_s);
        Ok(Line { track: track.to_string(), kind: kind.into(), label: interval.name, start_s, end_s, pinned, by, at })
    });
    Ok(Labels { version: version(&text), lines: lines.collect::<Result<_, InputError>>()? })
}

/// What each row says of who set it, by its place.
fn provenance(text: &str) -> BTreeMap<String, (bool, String, String)> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_reader(text.as_bytes());
    let Ok(header) = reader.headers().cloned() else { return BTreeMap::new() };
    let column = |name: &str| header.iter().position(|title| title == name);
    let columns = [column(PINNED), column("by"), column("at")];
    let rows = reader.records().flatten().map(|record| {
        let [pinned, by, at] = columns.map(|at| at.and_then(|at| record.get(at)).unwrap_or_default());
        let row = record.position().map_or(0, csv::Position::line);
        (format!("row {row}"), (pinned == PINNED, by.to_string(), at.to_string()))
    });
    rows.collect()
}

fn version(text: &str) -> String {
    let mut digest = Digest::default();
    digest.bytes(text.as_bytes());
    digest.finish()
}

/// Writes the labels of a recording in the place of the version that they change; without lines, removes the file. The caller prevents concurrent writes.
///
/// # Errors
/// The file has another version, a line is invalid, or the file cannot be written or is outside of the folders.
pub fn write(
    opened: &OpenedLog,
    only: Option<TrackId>,
    sent: SentLabels,
    known: &KnownNames,
    folders: &AllowedFolders,
) -> Result<Labels, SaveError> {
    let before = read(opened, only, folders)?;
    if before.version != sent.base {
        return Err(SaveError::Conflict(before));
    }
    let lines = checked(sent.lines, known, sent.new.as_deref(), &before)?;
    let path = file(&opened.log);
    let mut files = Files::default();
    if lines.is_empty() {
        files.remove_in(folders, &path)?;
        files.commit()?;
        return Ok(Labels::default());
    }
    let text = table(&lines)?;
    files.add_in(folders, &path, |out| out.write_all(text.as_bytes()))?;
    files.commit()?;
    Ok(Labels { version: version(&text), lines })
}

fn table(lines: &[Line]) -> Result<String, InputError> {
    let failed = |error: String| InputError::new("the labels", error);
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(COLUMNS).map_err(|error| failed(error.to_string()))?;
    for line in lines {
        let pinned = if line.pinned { PINNED } else { "" };
        let [start, end] = [line.start_s, line.end_s].map(number);
        let cells = [&line.track, &line.kind, &line.label, &start, &end, pinned, &line.by, &line.at];
        writer.write_record(cells).map_err(|error| failed(error.to_string()))?;
    }
    let bytes = writer.into_inner().map_err(|error| failed(error.to_string()))?;
    String::from_utf8(bytes).map_err(|error| failed(error.to_string()))
}

/// The lines in order, each a label that the rules know or that the file had, or a new primitive.
fn checked(
    mut lines: Vec<Line>,
    known: &KnownNames,
    new: Option<&str>,
    before: &Labels,
) -> Result<Vec<Line>, InputError> {
    if lines.len() > MAX_ROWS {
        return Err(InputError::new("the labels", format!("found {} lines, at most {MAX_ROWS} are read", lines.len())));
    }
    for (line, at) in lines.iter_mut().zip(1..) {
        let wrong = |message: String| InputError::new(format!("label {at}"), message);
        let names = match line.kind.as_str() {
            "primitive" => &known.primitives,
            "task" => &known.tasks,
            other => return Err(wrong(format!("found the kind `{other}`, expected primitive or task"))),
        };
        if TrackId::from_name(&line.track).is_none() {
            return Err(wrong(format!("found the track `{}`, expected left, right or both", line.track)));
        }
        for text in [&line.label, &line.by, &line.at] {
            if text.len() > MAX_TEXT || text.chars().any(char::is_control) || text.trim() != text {
                return Err(wrong(format!("a name has at most {MAX_TEXT} bytes and is printable")));
            }
        }
        let was_there = || before.lines.iter().any(|known| known.label == line.label);
        let is_unknown_task = line.kind == "task" && line.label == UNKNOWN;
        let is_new = line.kind == "primitive" && new == Some(&line.label) && is_primitive(&line.label);
        if !names.contains(&line.label) && !is_unknown_task && !is_new && !was_there() {
            return Err(known
                .advise(wrong(format!("found `{}`, expected a {} of the rules", line.label, line.kind)), &line.label));
        }
        let times = [line.start_s, line.end_s].map(|time| (time * 1e6).round() / 1e6);
        if !times.iter().all(|time| time.is_finite() && time.abs() < 1e9) || times[0] >= times[1] {
            return Err(wrong(format!("found {} – {} s, expected an end after the start", line.start_s, line.end_s)));
        }
        [line.start_s, line.end_s] = times;
    }
    lines.sort_by(|a, b| (&a.track, &a.kind).cmp(&(&b.track, &b.kind)).then_with(|| a.start_s.total_cmp(&b.start_s)));
    let overlap = lines.windows(2).find_map(|pair| match pair {
        [a, b] if (&a.track, &a.kind) == (&b.track, &b.kind) && b.start_s < a.end_s - SAME_S => Some((a, b)),
        _ => None,
    });
    match overlap {
        Some((a, b)) => {
            let message = format!("`{}` until {} s and `{}` from {} s overlap", a.label, a.end_s, b.label, b.start_s);
            Err(InputError::new("the labels", message))
        }
        None => Ok(lines),
    }
}
