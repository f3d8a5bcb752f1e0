//! Files and folders of many recordings: `set#*` are all of them, `set#0..9` those from number 0 to number 9.

use super::split;
use crate::allowed_folders::AllowedFolders;
use crate::read::csv::beside;
use crate::read::file;
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;

/// The most recordings that one file or folder may have.
pub(super) const MAX_RECORDINGS: usize = 1 << 20;

/// Which recordings are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum RecordingRange {
    All,
    /// From one number to another, both included.
    Numbers(u64, u64),
}

impl RecordingRange {
    /// `None` for the name of one recording.
    fn read(text: &str) -> Option<Self> {
        if text == "*" {
            return Some(Self::All);
        }
        let (first, last) = text.split_once("..")?;
        Some(Self::Numbers(first.parse().ok()?, last.parse().ok()?))
    }
}

/// The recordings that a path with a choice after it stands for, such as `set#*` or `file.hdf5#0..9`; `None` for any other path.
///
/// # Errors
/// When there is no data set, no store and no HDF5 file at the path, or it does not have what is chosen.
pub fn chosen(path: &Path) -> Result<Option<Vec<PathBuf>>, InputError> {
    chosen_within(path, &AllowedFolders::default())
}

/// Returns the recordings like [`chosen`]; the files of the data set, store or file must be in `folders`.
///
/// # Errors
/// As [`chosen`], and a file that is outside of the folders.
pub fn chosen_within(path: &Path, folders: &AllowedFolders) -> Result<Option<Vec<PathBuf>>, InputError> {
    let (log, Some(text)) = split(path) else { return Ok(None) };
    let Some(choice) = RecordingRange::read(&text) else { return Ok(None) };
    let place = log.display().to_string();
    let wrong = |message: String| InputError::new(&place, message);
    let Some(names) = recordings(&log, folders)? else {
        let message = format!(
            "found one recording, expected a LeRobot data set, a Zarr store or an HDF5 file with several for `#{text}`"
        );
        return Err(wrong(message).help("leave out the `#` and the text after it"));
    };
    let RecordingRange::Numbers(first, last) = choice else { return Ok(Some(all(&log, &names))) };
    if first > last {
        return Err(wrong(format!("found `#{text}`, expected the smaller number first")));
    }
    // Numbers may be left out, as those of demonstrations that were sorted out; the last one is to be there.
    let highest = names.iter().filter_map(|name| number_of(name)).max();
    let within = |name: &&String| number_of(name).is_some_and(|number| (first..=last).contains(&number));
    let found: Vec<PathBuf> = names.iter().filter(within).map(|name| one(&log, name)).collect();
    match highest {
        Some(highest) if last <= highest && !found.is_empty() => Ok(Some(found)),
        _ => {
            let up_to = highest.map_or(String::new(), |highest| format!(", with numbers up to {highest}"));
            let message = format!("found {} recordings{up_to}; `#{text}` selects others", names.len());
            Err(wrong(message).help(format!("`{place}#*` stands for all of them")))
        }
    }
}

/// All recordings of a data set, a store or an HDF5 file, as `set#3`; `None` for a path that is one recording, or none.
///
/// # Errors
/// When the data set or file cannot be read.
pub fn all_of(path: &Path) -> Result<Option<Vec<PathBuf>>, InputError> {
    all_of_within(path, &AllowedFolders::default())
}

/// Returns all recordings like [`all_of`]; the files of the data set, store or file must be in `folders`.
///
/// # Errors
/// As [`all_of`], and a file that is outside of the folders.
pub fn all_of_within(path: &Path, folders: &AllowedFolders) -> Result<Option<Vec<PathBuf>>, InputError> {
    Ok(recordings(path, folders)?.map(|names| all(path, &names)))
}

/// The files that a log is read from, with what belongs to it beside it.
///
/// # Errors
/// When there are none, as of standard input.
pub fn files_of(path: &Path) -> Result<Vec<PathBuf>, InputError> {
    let (log, recording) = split(path);
    if log.is_dir() {
        return match () {
            () if is_set(&log) => files_of_episode(&log, recording.as_deref()),
            () if is_zarr(&log) => files_of_store(&log, recording.as_deref()),
            () => super::folder::files(&log, &AllowedFolders::default()),
        };
    }
    if !log.is_file() {
        return Err(missing(&log));
    }
    let around = ["scene.yaml", "events.csv"].into_iter().flat_map(|ending| beside(&log, ending));
    let mut files: Vec<PathBuf> = around.filter(|file| file.is_file()).collect();
    files.push(log);
    Ok(files)
}

#[cfg(feature = "parquet")]
fn files_of_episode(log: &Path, episode: Option<&str>) -> Result<Vec<PathBuf>, InputError> {
    super::lerobot::files(log, episode)
}

#[cfg(not(feature = "parquet"))]
fn files_of_episode(log: &Path, _: Option<&str>) -> Result<Vec<PathBuf>, InputError> {
    Err(missing(log))
}

/// Whether a folder is a LeRobot data set.
pub fn is_set(path: &Path) -> bool {
    path.join("meta").join("info.json").is_file()
}

fn all(log: &Path, names: &[String]) -> Vec<PathBuf> {
    names.iter().map(|name| one(log, name)).collect()
}

fn one(log: &Path, name: &str) -> PathBuf {
    let mut whole = log.as_os_str().to_os_string();
    whole.push("#");
    whole.push(name);
    whole.into()
}

/// The number at the end of a name: 3 of `demo_3`.
pub(super) fn number_of(name: &str) -> Option<u64> {
    let head = name.trim_end_matches(|c: char| c.is_ascii_digit());
    name.get(head.len()..)?.parse().ok()
}

/// The place of the recording that is meant among those that a `file` or `store` has; `None` for one that is a recording itself.
///
/// # Errors
/// When it has no such recording, or several and it is not said which one is meant.
#[cfg(any(feature = "hdf5", feature = "arrays"))]
pub(super) fn choose(
    place: &str,
    what: &str,
    names: &[String],
    asked: Option<&str>,
) -> Result<Option<usize>, InputError> {
    let Some(first) = names.first() else {
        let Some(asked) = asked else { return Ok(None) };
        let message = format!("the {what} is one recording, found `#{asked}` after its name");
        return Err(InputError::new(place, message).help("leave it out"));
    };
    let like = format!("such as `{place}#{first}`");
    let Some(asked) = asked else {
        if names.len() == 1 {
            return Ok(Some(0));
        }
        let message = format!("the {what} has {} recordings, expected the name of one", names.len());
        return Err(
            InputError::new(place, message).help(format!("choose one after `#`, {like}, or all with `{place}#*`"))
        );
    };
    let number = asked.parse::<u64>().ok();
    let by_number = |name: &String| number.is_some() && number_of(name) == number;
    let found = names.iter().position(|name| name == asked).or_else(|| names.iter().position(by_number));
    found.map(Some).ok_or_else(|| {
        let message = format!("found {} recordings, none of them is called `{asked}`", names.len());
        InputError::new(place, message).help(format!("choose one of them, {like}"))
    })
}

/// The names of the recordings of a data set, a Zarr store or an HDF5 file.
fn recordings(path: &Path, folders: &AllowedFolders) -> Result<Option<Vec<String>>, InputError> {
    if path.is_dir() && is_set(path) {
        return episodes(path, folders).map(Some);
    }
    if is_zarr(path) {
        return in_store(path, folders);
    }
    if path.is_dir() {
        return Ok(None);
    }
    if path.is_file() { groups(path, folders) } else { Err(missing(path)) }
}

/// Whether a folder or file is a Zarr store, and is read by this build.
#[cfg(feature = "arrays")]
pub fn is_zarr(path: &Path) -> bool {
    if path.is_dir() {
        return super::zarr::is_folder(path);
    }
    let has_metadata = || super::zip_archive::has(path, super::zarr::is_metadata, &AllowedFolders::default());
    super::begins_with(path, &super::zip_archive::MAGIC) && has_metadata().unwrap_or(false)
}

/// Whether a folder or file is a Zarr store, and is read by this build.
#[cfg(not(feature = "arrays"))]
pub fn is_zarr(_: &Path) -> bool {
    false
}

#[cfg(feature = "arrays")]
fn in_store(path: &Path, folders: &AllowedFolders) -> Result<Option<Vec<String>>, InputError> {
    Ok(Some(super::zarr::names(path, folders)?).filter(|names| !names.is_empty()))
}

#[cfg(not(feature = "arrays"))]
fn in_store(_: &Path, _: &AllowedFolders) -> Result<Option<Vec<String>>, InputError> {
    Ok(None)
}

#[cfg(feature = "arrays")]
fn files_of_store(log: &Path, recording: Option<&str>) -> Result<Vec<PathBuf>, InputError> {
    super::zarr::files(log, recording)
}

#[cfg(not(feature = "arrays"))]
fn files_of_store(log: &Path, _: Option<&str>) -> Result<Vec<PathBuf>, InputError> {
    Err(missing(log))
}

fn missing(path: &Path) -> InputError {
    let gone = || InputError::unreadable(path.display().to_string(), &std::io::ErrorKind::NotFound.into());
    file::open(path).err().unwrap_or_else(gone)
}

#[cfg(feature = "parquet")]
fn episodes(path: &Path, folders: &AllowedFolders) -> Result<Vec<String>, InputError> {
    let count = super::lerobot::count(path, folders)?;
    Ok((0..count).map(|episode| episode.to_string()).collect())
}

#[cfg(not(feature = "parquet"))]
fn episodes(path: &Path, _: &AllowedFolders) -> Result<Vec<String>, InputError> {
    let message = "this build cannot read data sets, its feature `parquet` is off";
    Err(InputError::new(path.display().to_string(), message))
}

/// Whether a file is HDF5, and is read by this build.
///
/// # Errors
/// When it cannot be read.
#[cfg(feature = "hdf5")]
pub fn is_hdf5(path: &Path) -> Result<bool, InputError> {
    super::hdf5::is_hdf5(path)
}

/// Whether a file is HDF5, and is read by this build.
///
/// # Errors
/// None.
#[cfg(not(feature = "hdf5"))]
pub fn is_hdf5(_: &Path) -> Result<bool, InputError> {
    Ok(false)
}

/// The recordings of an HDF5 file; `None` for another file, and for one that is a recording by itself.
#[cfg(feature = "hdf5")]
fn groups(path: &Path, folders: &AllowedFolders) -> Result<Option<Vec<String>>, InputError> {
    let names = if super::hdf5::is_hdf5(path)? { super::hdf5::names(path, folders)? } else { vec![] };
    Ok((!names.is_empty()).then_some(names))
}

#[cfg(not(feature = "hdf5"))]
fn groups(_: &Path, _: &AllowedFolders) -> Result<Option<Vec<String>>, InputError> {
    Ok(None)
}

/// The name of the recording after a `#`: `demo_3` of `lift.hdf5#demo_3`.
pub fn recording_of(path: &Path) -> Option<String> {
    split(path).1
}

/// The name of a log for files that are made of it: that of its file or folder without ending, and the recording in it. `lift_demo_3` of
/// `sets/lift.hdf5#demo_3`.
pub fn stem(path: &Path) -> String {
    let (log, recording) = split(path);
    // The ending of a folder is part of its name.
    let name = if log.is_dir() { log.file_name() } else { log.file_stem() };
    let name = name.map(|name| name.to_string_lossy().into_owned()).unwrap_or_else(|| "log".into());
    match recording {
        Some(recording) => format!("{name}_{recording}"),
        None => name,
    }
}
