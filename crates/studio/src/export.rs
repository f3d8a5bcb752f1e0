//! Corrected labels for other programs, by the writers of `analyze` and `annotate`: a file of ELAN beside a recording, and
//! `meta/lerobot_annotations.json` of a LeRobot set.

use super::labels::beside;
use super::loaded_recording::LoadedRecording;
use super::merged_labels::merged_labels;
use super::project::Studio;
use std::path::{Path, PathBuf};
use teachtree_analysis::Analysis as AnalysisResult;
use teachtree_analysis::eaf::eaf;
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_logs::allowed_folders::AllowedFolders;
use teachtree_logs::atomic_write::Files;
use teachtree_session::Error;
use teachtree_session::{AnalysisInternals, ErrorInternals, LogInternals};

/// Why an export was not written.
pub enum ExportError {
    /// The file is there, and the user was not asked whether to replace it.
    FileExists(PathBuf),
    /// Something is wrong.
    Failed(Error),
}

impl From<Error> for ExportError {
    fn from(error: Error) -> Self {
        Self::Failed(error)
    }
}

/// Rejects an export over an existing file, which a person may have corrected in another program, unless `replace` is set. Also rejects a link out of
/// the folders.
fn keep(path: &Path, replace: bool, folders: &AllowedFolders) -> Result<(), ExportError> {
    let is_there = folders.place(path).map_err(argument)?.exists();
    if is_there && !replace { Err(ExportError::FileExists(path.to_path_buf())) } else { Ok(()) }
}

/// Writes a file into one of the folders.
fn write(path: &Path, bytes: &[u8], folders: &AllowedFolders) -> Result<(), ExportError> {
    let mut files = Files::default();
    let added = files.add_in(folders, path, |out| out.write_all(bytes));
    added.and_then(|()| files.commit()).map_err(|error| argument(error).into())
}

/// What was found in a recording, with its labels in its place.
fn found(loaded: &LoadedRecording) -> Result<AnalysisResult, Error> {
    let opened = loaded.log().opened()?;
    let labels = loaded.labels()?;
    Ok(merged_labels(loaded.now.runs()?.found(), &labels.lines, &opened.row_time))
}

fn argument(error: InputError) -> Error {
    Error::new(error, ErrorKind::Argument)
}

/// Writes the file of ELAN of a recording; returns it.
///
/// # Errors
/// A file that is there without `replace`, labels that cannot be read, a place that cannot be written.
pub fn elan(loaded: &LoadedRecording, replace: bool) -> Result<PathBuf, ExportError> {
    let path = beside(loaded.log().path(), "eaf");
    keep(&path, replace, &loaded.folders.beside)?;
    let text = eaf(&found(loaded)?, loaded.now.shown.meta());
    write(&path, text.as_bytes(), &loaded.folders.beside)?;
    Ok(path)
}

/// Writes `meta/lerobot_annotations.json` of the set that a recording is an episode of, with the labels of all its episodes that the studio is opened on and
/// what the file has of other styles; returns it.
///
/// # Errors
/// A recording of no set, a file that is there without `replace`, an episode that cannot be analyzed, a place that cannot be written.
pub fn lerobot(studio: &Studio, at: usize, replace: bool) -> Result<PathBuf, ExportError> {
    use std::collections::BTreeMap;
    use teachtree_logs::read::formats::lerobot::annotate::prelabels::FILE;
    use teachtree_logs::read::formats::lerobot::annotate::{AnnotationTarget, Label, LabelFormat, Request};
    use teachtree_logs::read::formats::{is_set, recording_of, without_episode};
    use teachtree_report::words::Style;
    use teachtree_session::score::atoms::phrasing;

    let recording = studio.recordings.get(at).ok_or_else(|| Error::internal("there is no such recording"))?;
    let folder = without_episode(&recording.log);
    if !is_set(&folder) {
        let error = InputError::new(recording.log.display().to_string(), "is not an episode of a LeRobot set");
        return Err(argument(error.help("the other recordings are exported for ELAN")).into());
    }
    let file = folder.join(FILE);
    let folders = &recording.folders.log;
    keep(&file, replace, folders)?;
    let phrasing = phrasing(&file, folders).map_err(argument)?;
    let mut all: BTreeMap<usize, Vec<Label>> = BTreeMap::new();
    for (number, one) in studio.recordings.iter().enumerate().filter(|(_, one)| without_episode(&one.log) == folder) {
        let episode = recording_of(&one.log).map_or(Some(0), |text| text.parse().ok());
        let Some(episode) = episode else { continue };
        let loaded = studio.loaded(number)?;
        let found = found(&loaded)?;
        let words = Style::ALL.iter().flat_map(|style| {
            let words = phrasing.of(&found, *style).into_iter();
            words.map(|words| Label { style: style.name(), row: words.row, end: words.end, content: words.content })
        });
        all.insert(episode, words.collect());
    }
    let styles = Style::ALL.map(Style::name);
    let request = Request {
        forms: &[LabelFormat::Prelabels],
        styles: &styles,
        legacy: Style::Subtask.name(),
        labels: &all,
        successes: &BTreeMap::new(),
        provenance: &serde_json::Value::Null,
    };
    let bytes = AnnotationTarget::open_within(&folder, folders.clone())
        .and_then(|set| set.prelabels(&request))
        .map_err(argument)?;
    write(&file, &bytes, folders)?;
    Ok(file)
}
