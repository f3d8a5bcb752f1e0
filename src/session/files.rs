//! Which files are logs: folders of logs, and the files that belong to a log and are none themselves.

use crate::base::error::InputError;
use crate::stream::names;
use crate::stream::read::csv::beside;
use crate::stream::read::formats;
use crate::stream::read::table::Source;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// How files of labels end.
pub const LABEL_ENDINGS: [&str; 2] = [".labels.csv", "_segments.csv"];

/// How logs in folders end.
const LOG_ENDINGS: [&str; 3] = ["csv", "tsv", "parquet"];

/// Whether a file may be a log by its name; other tables of text are logs where a scene stands beside them.
fn is_log(file: &Path) -> bool {
    let has_ending = |wanted: &&str| file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(wanted));
    // `a.scene.yaml` is that of `a.csv`.
    let [_, own_scene] = beside(file, "scene.yaml");
    let by_name = LOG_ENDINGS.iter().any(has_ending) || formats::text_ending(file) && own_scene.is_file();
    by_name && !is_beside(file) && file.is_file()
}

/// The same logs without those that are named twice.
fn each_once(logs: Vec<PathBuf>) -> Vec<PathBuf> {
    let mut seen = BTreeSet::new();
    // What a link leads to may have another scene beside it.
    let known = |log: &PathBuf| {
        let folder = log.parent().and_then(|folder| std::fs::canonicalize(folder.join(".")).ok());
        folder.zip(log.file_name()).map_or_else(|| log.clone(), |(folder, name)| folder.join(name))
    };
    logs.into_iter().filter(|log| seen.insert(known(log))).collect()
}

/// Whether a file belongs to a log that stands beside it: its events, its labels.
pub fn is_beside(file: &Path) -> bool {
    let name = file.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    LABEL_ENDINGS.iter().chain(&[".events.csv"]).any(|ending| name.ends_with(ending))
}

/// The logs of a list: with `people/*.csv` a shell also names what stands beside them. A file that is named alone is meant.
pub fn without_companions(paths: &[PathBuf]) -> impl Iterator<Item = &PathBuf> {
    paths.iter().filter(|path| paths.len() == 1 || !is_beside(path))
}

/// The logs of a list, a folder replaced by those in it, by name.
///
/// # Errors
/// A folder that cannot be read, or holds no log.
pub fn all_logs(paths: &[PathBuf]) -> Result<Vec<PathBuf>, InputError> {
    let mut logs = Vec::new();
    for path in without_companions(paths) {
        if !path.is_dir() {
            logs.push(path.clone());
            continue;
        }
        let mut found = logs_in(path)?;
        if found.is_empty() {
            return Err(InputError::new(
                path.display().to_string(),
                "the folder has no `.csv`, `.tsv` or `.parquet` log",
            ));
        }
        logs.append(&mut found);
    }
    Ok(each_once(logs))
}

/// The same where a folder may also be one log in parts, which a binding puts together: without one, a folder with logs of ours is meant.
///
/// # Errors
/// A folder that cannot be read.
pub fn recordings(paths: &[PathBuf], binding: Option<&Path>) -> Result<Vec<PathBuf>, InputError> {
    let mut logs = Vec::new();
    for path in without_companions(paths) {
        let found = if binding.is_none() && path.is_dir() { logs_in(path)? } else { Vec::new() };
        if found.iter().any(|log| is_canonical(log)) {
            logs.extend(found);
        } else {
            logs.push(path.clone());
        }
    }
    Ok(each_once(logs))
}

/// Whether the columns of a log are called as ours are.
fn is_canonical(log: &Path) -> bool {
    let named =
        |source: Source| source.header().iter().any(|title| names::meaning(names::split_unit(title).0).is_some());
    formats::open(log).is_ok_and(named)
}

/// The logs in a folder, by name.
fn logs_in(folder: &Path) -> Result<Vec<PathBuf>, InputError> {
    let fail = |error: std::io::Error| {
        InputError::new(folder.display().to_string(), format!("the folder cannot be read: {error}"))
    };
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(fail)? {
        let file = entry.map_err(fail)?.path();
        if is_log(&file) {
            found.push(file);
        }
    }
    found.sort();
    Ok(found)
}
