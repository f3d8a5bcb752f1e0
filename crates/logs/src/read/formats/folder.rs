//! A folder as a log: each table of text in it is a sheet of its own, named as its file without ending; without any, each array of NumPy has columns.

use super::{delimited_text, is_set, text_ending};
use crate::allowed_folders::AllowedFolders;
use crate::read::file;
use crate::read::table::{Sheet, Source};
use std::io::BufReader;
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;

/// The most files that a folder may have to be taken for a log.
const MAX_FILES: usize = 200;

/// Opens a folder whose files must be in `folders`; `episode` chooses one of a data set.
///
/// # Errors
/// When there is nothing in it that is a log.
pub fn open(path: &Path, episode: Option<&str>, folders: &AllowedFolders) -> Result<Source, InputError> {
    let name = path.display().to_string();
    if is_set(path) {
        return data_set(path, episode, folders);
    }
    #[cfg(feature = "arrays")]
    if super::is_zarr(path) {
        return super::zarr::open(path, episode, folders);
    }
    if let Some(episode) = episode {
        return Err(InputError::new(
            name,
            format!(
                "this folder is not a data set with an episode {episode}: there is no meta/info.json and no Zarr store"
            ),
        ));
    }
    if is_bag(path) {
        return bag(path, folders);
    }
    let mut files = files(path, folders)?;
    #[cfg(feature = "arrays")]
    if !files.iter().any(|file| text_ending(file)) && files.iter().any(|file| is_array(file)) {
        files.retain(|file| is_array(file));
        return super::npy::open_folder(path, &files, folders);
    }
    files.retain(|file| text_ending(file) && !is_beside(file));
    if files.is_empty() {
        return Err(file::no_log(path, ""));
    }
    let mut sheets = vec![];
    let mut refused = vec![];
    for path in files {
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let place = path.display().to_string();
        let bytes = folders.open(&path)?;
        // A file that is not a table does not keep the others from being read.
        match delimited_text::source(Box::new(BufReader::new(bytes)), place) {
            Ok(source) => sheets.extend(source.sheets.into_iter().map(|sheet| Sheet { name: stem.clone(), ..sheet })),
            Err(error) => refused.push((stem, error.message)),
        }
    }
    if sheets.is_empty() {
        let why = refused.first().map_or("", |(_, why)| why);
        return Err(InputError::new(name, format!("the folder holds no table that can be read: {why}")));
    }
    Ok(Source { refused, ..Source::many(name, sheets) })
}

/// Whether a folder is a bag.
pub fn is_bag(path: &Path) -> bool {
    path.join("metadata.yaml").is_file()
}

/// Whether a folder can be one log: a bag, or tables of text or arrays of NumPy that are parts of one.
pub fn is_one_log(path: &Path) -> bool {
    let is_part = |file: &PathBuf| is_array(file) || text_ending(file) && !is_beside(file);
    is_bag(path) || files(path, &AllowedFolders::default()).is_ok_and(|files| files.iter().any(is_part))
}

/// Whether a file is an array of NumPy, by its name.
fn is_array(file: &Path) -> bool {
    cfg!(feature = "arrays") && file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("npy"))
}

#[cfg(feature = "mcap")]
fn bag(path: &Path, folders: &AllowedFolders) -> Result<Source, InputError> {
    super::rosbag2::folder(path, folders)
}

#[cfg(not(feature = "mcap"))]
fn bag(path: &Path, _: &AllowedFolders) -> Result<Source, InputError> {
    Err(InputError::new(path.display().to_string(), "this build cannot read bags, its feature `mcap` is off"))
}

#[cfg(feature = "parquet")]
fn data_set(path: &Path, episode: Option<&str>, folders: &AllowedFolders) -> Result<Source, InputError> {
    super::lerobot::open(path, episode, folders)
}

#[cfg(not(feature = "parquet"))]
fn data_set(path: &Path, _: Option<&str>, _: &AllowedFolders) -> Result<Source, InputError> {
    let message = "this build cannot read data sets, its feature `parquet` is off";
    Err(InputError::new(path.display().to_string(), message))
}

/// Whether a file belongs to a log that stands beside it.
fn is_beside(file: &Path) -> bool {
    file.file_name().is_some_and(|name| name.to_string_lossy().ends_with(".events.csv"))
}

/// The files of a folder by name.
///
/// # Errors
/// When it cannot be read, or has too many.
pub(super) fn files(folder: &Path, folders: &AllowedFolders) -> Result<Vec<PathBuf>, InputError> {
    let name = folder.display().to_string();
    let mut files = vec![];
    for path in folders.list(folder)? {
        let path = path?;
        if folders.has(&path) {
            files.push(path);
        }
        if files.len() > MAX_FILES {
            return Err(InputError::new(
                name,
                format!("the folder holds more than {MAX_FILES} files; it is not a log"),
            ));
        }
    }
    files.sort();
    Ok(files)
}
