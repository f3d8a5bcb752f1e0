//! Which files are logs: folders of logs, and the files that belong to a log and are none themselves.

pub mod headers;

use super::error::Error;
use super::project_file::ProjectSettings;
use crate::ErrorInternals;
use std::collections::BTreeSet;
use std::fs::DirEntry;
use std::path::{Path, PathBuf};
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_base::hands::Side;
use teachtree_logs::allowed_folders::AllowedFolders;
use teachtree_logs::names;
use teachtree_logs::read::csv::beside;
use teachtree_logs::read::file;
use teachtree_logs::read::formats;
use teachtree_logs::read::table::Source;

/// Suffixes of label files.
const LABEL_ENDINGS: [&str; 2] = [".labels.csv", "_segments.csv"];

/// Suffixes of files with labels that `analyze --out-dir` writes.
const OUTPUT_ENDINGS: [&str; 2] = [".eaf", ".csv"];

/// Suffixes of logs in folders.
const LOG_ENDINGS: [&str; 14] =
    ["csv", "tsv", "parquet", "jsonl", "ndjson", "mcap", "bag", "db3", "hdf5", "h5", "hdf", "npz", "npy", "zarr.zip"];
/// Maximum depth of folders, and maximum number of recordings in them.
const DEEPEST: usize = 32;
const MAX_LOGS: usize = 1 << 20;

/// A recording that was named, alone or by a folder, data set or file that holds it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordingFile {
    /// The path for opening it.
    pub log: PathBuf,
    /// The name of files that are made of it, without an ending: the folders below the one that was named, and the log's own name.
    pub name: PathBuf,
}

impl RecordingFile {
    fn new(log: PathBuf, folder: &Path) -> Self {
        let name = if log == Path::new("-") { "standard_input".into() } else { formats::stem(&log) };
        let name = folder.join(name);
        Self { log, name }
    }
}

/// Whether a folder is a data set or a Zarr store.
fn is_store(path: &Path) -> bool {
    formats::is_set(path) || path.is_dir() && formats::is_zarr(path)
}

/// Whether a file may be a log by its name; other tables of text are logs where a scene stands beside them.
fn is_log(file: &Path) -> bool {
    let name = file.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let has_ending = |wanted: &&str| name.strip_suffix(*wanted).is_some_and(|name| name.ends_with('.'));
    // `a.scene.yaml` is that of `a.csv`.
    let [_, own_scene] = beside(file, "scene.yaml");
    let by_name = LOG_ENDINGS.iter().any(has_ending) || formats::text_ending(file) && own_scene.is_file();
    by_name && !is_companion(file) && file.is_file()
}

/// Returns the logs without duplicates.
fn deduplicate(logs: Vec<RecordingFile>) -> Vec<RecordingFile> {
    let mut seen = BTreeSet::new();
    // The target of a link may have another scene beside it.
    let known = |RecordingFile { log, .. }: &RecordingFile| {
        let folder = log.parent().and_then(|folder| std::fs::canonicalize(folder.join(".")).ok());
        folder.zip(log.file_name()).map_or_else(|| log.clone(), |(folder, name)| folder.join(name))
    };
    logs.into_iter().filter(|log| seen.insert(known(log))).collect()
}

/// Whether a file belongs to a log that stands beside it: its events, its labels.
pub fn is_companion(file: &Path) -> bool {
    let name = file.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    LABEL_ENDINGS.iter().chain(&[".events.csv"]).any(|ending| name.ends_with(ending))
}

/// Whether all files of a folder belong to logs, which are elsewhere.
fn holds_companions_only(folder: &Path) -> bool {
    let is_companion = |entry: std::io::Result<DirEntry>| entry.is_ok_and(|entry| is_companion(&entry.path()));
    std::fs::read_dir(folder).is_ok_and(|mut entries| entries.all(is_companion))
}

/// The logs of a list: with `people/*.csv` a shell also names what stands beside them. A file that is named alone is meant.
pub fn without_companions(paths: &[PathBuf]) -> impl Iterator<Item = &PathBuf> {
    paths.iter().filter(|path| paths.len() == 1 || !is_companion(path))
}

/// The logs of a list, each once: a folder is replaced by those in it and in its subfolders, a data set or an HDF5 file in it and a choice such as
/// `set#*` by its recordings.
///
/// # Errors
/// A folder that cannot be read, or holds no log.
pub fn all_logs(paths: &[PathBuf]) -> Result<Vec<PathBuf>, InputError> {
    let mut logs = Vec::new();
    for path in without_companions(paths) {
        let mut found = logs_of(path, &AllowedFolders::default())?;
        if found.is_empty() {
            return Err(nothing(path));
        }
        logs.append(&mut found);
    }
    Ok(deduplicate(logs).into_iter().map(|found| found.log).collect())
}

fn nothing(folder: &Path) -> InputError {
    file::no_log(folder, &format!(": no data set, and no file that ends in {}", LOG_ENDINGS.join(", ")))
}

/// The same where a folder may also be one recording in several files, as [`formats::open`] reads it. Tables of text with equal columns are recordings,
/// unless the binding names their columns as those of parts, `arm.x` of `arm.csv`, or `teachtree.yaml` has a binding of the folder itself. Other tables are the
/// parts of one recording, unless a log in the folder has the names of our channels or a binding of its own in `teachtree.yaml`.
///
/// # Errors
/// A folder that cannot be read, or holds no log.
pub fn recordings(paths: &[PathBuf], binding: Option<&Path>) -> Result<Vec<RecordingFile>, InputError> {
    recordings_within(paths, binding, &AllowedFolders::default())
}

/// Returns the logs like [`recordings`]; files that are opened to find them must be in `folders`.
///
/// # Errors
/// As [`recordings`], and a data set that is named and has files outside of the folders.
pub fn recordings_within(
    paths: &[PathBuf],
    binding: Option<&Path>,
    folders: &AllowedFolders,
) -> Result<Vec<RecordingFile>, InputError> {
    let mut logs = Vec::new();
    for path in without_companions(paths) {
        let found = logs_of(path, folders)?;
        if found.is_empty() && path.is_dir() && holds_companions_only(path) {
            return Err(nothing(path));
        }
        if !path.is_dir() || is_store(path) || holds_recordings(path, &found, binding, folders)? {
            if found.is_empty() {
                return Err(nothing(path));
            }
            logs.extend(found);
        } else {
            logs.push(RecordingFile::new(path.clone(), Path::new("")));
        }
    }
    Ok(deduplicate(logs))
}

/// Whether a folder with these logs holds recordings; otherwise it is one.
fn holds_recordings(
    folder: &Path,
    found: &[RecordingFile],
    binding: Option<&Path>,
    folders: &AllowedFolders,
) -> Result<bool, InputError> {
    if formats::is_bag(folder) {
        return Ok(false);
    }
    if !formats::is_one_log(folder) {
        return Ok(true);
    }
    let of_folder = ProjectSettings::naming(folder)?.binding;
    if binding.is_none() && of_folder.is_some() {
        return Ok(false);
    }
    let is_table = |log: &&PathBuf| formats::text_ending(log) && log.parent() == Some(folder);
    let tables: Vec<PathBuf> = found.iter().map(|found| &found.log).filter(is_table).cloned().collect();
    if !tables.is_empty() && headers::are_equal(&tables, folders) {
        return Ok(!binding.map_or(Ok(false), |binding| headers::are_parts(&tables, binding, folders))?);
    }
    if binding.is_some() {
        return Ok(false);
    }
    for RecordingFile { log, .. } in found {
        if is_canonical(log, folders).is_ok_and(|is| is) || ProjectSettings::of(log)?.binding.is_some() {
            return Ok(true);
        }
    }
    Ok(false)
}

/// The recording that a path stands for where one is expected: the path itself, or the only recording of a folder.
///
/// # Errors
/// A folder or a choice such as `set#*` with several recordings, with their names; as [`recordings`].
pub fn single(path: &Path, binding: Option<&Path>, folders: &AllowedFolders) -> Result<PathBuf, InputError> {
    if !path.is_dir() && formats::recording_of(path).is_none() {
        return Ok(path.to_path_buf());
    }
    let found = recordings_within(&[path.to_path_buf()], binding, folders)?;
    if let [RecordingFile { log, .. }] = found.as_slice() {
        return Ok(log.clone());
    }
    let error = InputError::new(path.display().to_string(), format!("found {} recordings, expected one", found.len()));
    let found: Vec<PathBuf> = found.into_iter().map(|found| found.log).collect();
    Err(error.help(format!("name one of them: {}", listed(&found))))
}

/// The first paths of a list, and the number of the others: `a.csv, b.csv and 3 more`.
pub fn listed(paths: &[PathBuf]) -> String {
    const MOST: usize = 5;
    let names: Vec<String> = paths.iter().take(MOST).map(|path| path.display().to_string()).collect();
    match paths.len().saturating_sub(MOST) {
        0 => names.join(", "),
        more => format!("{} and {more} more", names.join(", ")),
    }
}

/// Lists the recordings that paths stand for, as [`Log::open`](crate::Log::open) takes them, each once: those in a folder and its subfolders, the
/// episodes of `set#*` and `set#0..9`, the path itself otherwise. Text tables of a folder that have different columns are one recording in parts.
///
/// # Errors
/// [`ErrorKind::Io`] and [`ErrorKind::Format`]: a folder that cannot be read or holds no log, a data set that lacks what is chosen, a binding that cannot be
/// read.
pub fn paths<P: AsRef<Path>>(paths: &[P], binding: Option<&Path>) -> Result<Vec<PathBuf>, Error> {
    let paths: Vec<PathBuf> = paths.iter().map(|path| path.as_ref().to_path_buf()).collect();
    let found = recordings(&paths, binding).map_err(|error| Error::new(error, ErrorKind::Format))?;
    Ok(found.into_iter().map(|found| found.log).collect())
}

/// Whether the columns of a log are called as ours are: one of them is of a hand. A name with a point and a component alone, such as
/// `bodies/cube.position.x`, is also that of other programs.
///
/// # Errors
/// The log cannot be opened.
pub fn is_canonical(log: &Path, folders: &AllowedFolders) -> Result<bool, InputError> {
    formats::open_within(log, folders).map(|source| has_hand(&source))
}

/// Whether a log needs no binding: its columns are called as ours are, and a scene is in it or beside it.
///
/// # Errors
/// The log cannot be opened.
pub fn needs_no_binding(log: &Path, folders: &AllowedFolders) -> Result<bool, InputError> {
    let is_beside = || beside(log, "scene.yaml").iter().any(|file| file.is_file());
    formats::open_within(log, folders).map(|source| has_hand(&source) && (source.scene.is_some() || is_beside()))
}

fn has_hand(source: &Source) -> bool {
    let is_of_hand = |title: &String| {
        let meaning = names::meaning(names::split_unit(title).0);
        let first = meaning.and_then(|meaning| meaning.channel.split('.').next());
        first.is_some_and(|first| Side::from_name(first).is_some())
    };
    source.header().iter().any(is_of_hand)
}

/// The recordings of a path: those in a folder, those that a choice stands for, or the path itself.
fn logs_of(path: &Path, folders: &AllowedFolders) -> Result<Vec<RecordingFile>, InputError> {
    if let Some(logs) = formats::chosen_within(path, folders)? {
        return Ok(logs.into_iter().map(|log| RecordingFile::new(log, Path::new(""))).collect());
    }
    // A data set by itself is one recording if it has one; which one of several is meant has to be said.
    if !path.is_dir() || is_store(path) {
        return Ok(vec![RecordingFile::new(path.to_path_buf(), Path::new(""))]);
    }
    let mut found = Vec::new();
    logs_in(path, Path::new(""), 0, folders, &mut found)?;
    Ok(found)
}

/// Finds the logs in a folder and its subfolders, by name. Hidden ones are left out, and links to folders are not followed.
fn logs_in(
    folder: &Path,
    below: &Path,
    depth: usize,
    folders: &AllowedFolders,
    found: &mut Vec<RecordingFile>,
) -> Result<(), InputError> {
    let place = || folder.display().to_string();
    let fail = |error: std::io::Error| InputError::new(place(), format!("the folder cannot be read: {error}"));
    if depth > DEEPEST {
        let message = format!("found folders nested deeper than {DEEPEST}, the most that are searched");
        return Err(InputError::new(place(), message));
    }
    let mut entries = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(fail)? {
        let entry = entry.map_err(fail)?;
        if !entry.file_name().to_string_lossy().starts_with('.') {
            entries.push((entry.path(), entry.file_type().map_err(fail)?.is_dir()));
        }
    }
    entries.sort();
    for (path, is_folder) in entries {
        if found.len() > MAX_LOGS {
            return Err(InputError::new(
                place(),
                format!("holds more than {MAX_LOGS} recordings, the most that are read"),
            ));
        }
        if is_folder && !is_store(&path) && !formats::is_bag(&path) {
            let name = path.file_name().unwrap_or_default();
            logs_in(&path, &below.join(name), depth + 1, folders, found)?;
        } else if is_folder || is_log(&path) {
            // An unreadable file is reported when it is opened.
            let several = formats::all_of_within(&path, folders).ok().flatten();
            let logs = several.unwrap_or_else(|| vec![path]);
            found.extend(logs.into_iter().map(|log| RecordingFile::new(log, below)));
        }
    }
    Ok(())
}

/// The annotations of a LeRobot set.
const OF_SET: &str = "meta/lerobot_annotations.json";

/// The label file of a log: the one that is named, or the log's own in the folder that is named. A log in a subfolder of it has its labels beside it.
///
/// # Errors
/// When the folder has none.
pub fn label_file(path: &Path, log: &Path) -> Result<PathBuf, InputError> {
    if !path.is_dir() {
        return Ok(path.into());
    }
    if formats::is_set(path) {
        let of_set = path.join(OF_SET);
        let message = format!("the data set has no labels: found no {}", of_set.display());
        let error = || InputError::new(log.display().to_string(), message).help("`annotate --prelabels` writes it");
        return Some(of_set.clone()).filter(|file| file.is_file()).ok_or_else(error);
    }
    let stem = formats::stem(log);
    let of_log = std::fs::canonicalize(log).ok();
    let beside = log.parent().filter(|beside| beside.starts_with(path) && *beside != path);
    let endings = || LABEL_ENDINGS.iter().chain(&OUTPUT_ENDINGS);
    let mut places = beside
        .into_iter()
        .chain([path])
        .flat_map(|folder| endings().map(|ending| folder.join(format!("{stem}{ending}"))).collect::<Vec<_>>());
    // A log is not its own label file.
    let found =
        places.find(|place| place.is_file() && (of_log.is_none() || std::fs::canonicalize(place).ok() != of_log));
    found.ok_or_else(|| {
        let names = endings().map(|ending| format!("{stem}{ending}"));
        let names: Vec<String> = names.filter(|name| !path.join(name).is_file()).collect();
        let message = format!("the log has no label file: found none of {} in {}", names.join(", "), path.display());
        InputError::new(log.display().to_string(), message)
    })
}
