//! The formats of logs, one file each: a path in, tables of raw columns out. The content of a log decides its format before its name does.

#[cfg(any(feature = "hdf5", feature = "arrays"))]
mod array_attributes;
#[cfg(any(feature = "hdf5", feature = "arrays"))]
mod array_columns;
#[cfg(any(feature = "hdf5", feature = "arrays"))]
mod array_log;
pub mod bag;
#[cfg(any(feature = "parquet", feature = "hdf5", feature = "arrays"))]
#[cfg_attr(not(any(feature = "hdf5", feature = "arrays")), allow(dead_code, reason = "Parquet counts no arrays"))]
mod budget;
#[cfg(feature = "db3")]
mod db3;
pub mod delimited_text;
#[cfg(feature = "arrays")]
mod elements;
mod folder;
#[cfg(any(feature = "parquet", feature = "arrays"))]
mod half;
#[cfg(feature = "hdf5")]
pub mod hdf5;
mod json;
pub mod jsonl;
#[cfg(feature = "parquet")]
pub mod lerobot;
#[cfg(feature = "mcap")]
pub mod mcap;
#[cfg(feature = "parquet")]
mod mp4;
#[cfg(feature = "arrays")]
mod npy;
#[cfg(feature = "parquet")]
pub mod parquet;
pub mod picture;
#[cfg(all(feature = "mcap", feature = "arrays"))]
pub mod picture_file;
pub mod picture_spool;
#[cfg(feature = "protobuf")]
mod protobuf;
mod qualisys;
pub mod raw_topics;
mod recordings;
#[cfg(feature = "mcap")]
mod ros_types;
mod rosbag;
#[cfg(feature = "mcap")]
mod rosbag2;
pub mod rosmsg;
pub mod topics;
#[cfg(feature = "arrays")]
mod zarr;
#[cfg(feature = "arrays")]
mod zip_archive;

pub use folder::{is_bag, is_one_log};
pub use recordings::{
    all_of, all_of_within, chosen, chosen_within, files_of, is_hdf5, is_set, is_zarr, recording_of, stem,
};

use crate::allowed_folders::AllowedFolders;
use crate::atomic_write::{self, Files};
use crate::issue::{Issue, IssueKind};
use crate::read::csv::{add as add_csv, add_table as add_csv_table};
use crate::read::file;
use crate::read::progress::CountingReader;
use crate::read::table::Source;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_base::file_kind::FileKind;
use teachtree_base::recording::Recording;
use teachtree_base::yaml;

/// Endings of names of spreadsheets, which are not read.
const SPREADSHEET_ENDINGS: [&str; 5] = ["xlsx", "xlsm", "xls", "ods", "numbers"];
/// Endings of names that a table of text may have.
const TEXT_ENDINGS: [&str; 8] = ["csv", "tsv", "txt", "dat", "log", "tab", "asc", "prn"];

/// Opens a log of any format. `set#3` is episode 3 of a data set or a Zarr store, `file.hdf5#demo_3` a recording of a file, `-` are JSON lines on standard
/// input.
///
/// # Errors
/// When it cannot be opened, is of no format that is read here, or its head is wrong.
pub fn open(path: &Path) -> Result<Source, InputError> {
    open_within(path, &AllowedFolders::default())
}

/// Opens a log like [`open`] whose files must be in `folders`.
///
/// # Errors
/// As [`open`], and a file that is outside of the folders.
pub fn open_within(path: &Path, folders: &AllowedFolders) -> Result<Source, InputError> {
    if path == Path::new("-") {
        return jsonl::read(std::io::stdin().lock(), "standard input".into());
    }
    let (path, recording) = split(path);
    let recording = recording.as_deref();
    let name = path.display().to_string();
    let failed = |error: std::io::Error| InputError::unreadable(&name, &error);
    if path.is_dir() {
        return folder::open(&path, recording, folders);
    }
    atomic_write::refuse_unfinished(&path)?;
    let mut bytes = folders.open(&path)?;
    let mut magic = vec![];
    bytes.by_ref().take(16).read_to_end(&mut magic).map_err(failed)?;
    bytes.seek(SeekFrom::Start(0)).map_err(failed)?;
    #[cfg(feature = "hdf5")]
    if hdf5::is_at_start_or_behind_block(&mut bytes).map_err(failed)? {
        return hdf5::open(&path, recording, folders);
    }
    if SPREADSHEET_ENDINGS.contains(&ending(&path).as_str()) && !is_text(&magic) {
        return Err(spreadsheet(name));
    }
    #[cfg(feature = "arrays")]
    if (magic.starts_with(&zip_archive::MAGIC) || magic.starts_with(&zip_archive::EMPTY))
        && !zip_archive::has(&path, is_array, folders)?
    {
        if zip_archive::has(&path, zarr::is_metadata, folders)? {
            return zarr::open(&path, recording, folders);
        }
        if zip_archive::has(&path, |name| ["xl/workbook.xml", "content.xml"].contains(&name), folders)? {
            return Err(spreadsheet(name));
        }
        let message = "the archive holds no arrays of NumPy (`.npy`) and no Zarr store";
        return Err(InputError::new(name, message).help("unpack it and name the log in it"));
    }
    if is_web_page(&magic) {
        let message = "found a web page (HTML), expected a log: the download has failed";
        return Err(
            InputError::new(name, message).help("download the file again, with the access that its server asks for")
        );
    }
    let is_table = text_ending(&path) || is_text(&magic) && is_untold_table(&path, &mut bytes).map_err(failed)?;
    if is_table {
        let sections = delimited_text::sections::find(&mut bytes, &name)?;
        bytes.seek(SeekFrom::Start(0)).map_err(failed)?;
        if !sections.is_empty() {
            return delimited_text::sections::open(bytes, name, &sections, recording);
        }
    }
    if let Some(recording) = recording {
        let message = format!("found a file, expected a data set: only data sets have an episode `{recording}`");
        return Err(InputError::new(name, message));
    }
    let length = bytes.metadata().map_or(0, |file| file.len());
    let counted = |bytes| CountingReader::new(bytes, length);
    match magic.as_slice() {
        [b'N', b'O', b'_', b'O', b'F', b'_', ..] => qualisys::source(BufReader::new(counted(bytes)), name),
        #[cfg(feature = "mcap")]
        [0x89, b'M', b'C', b'A', b'P', ..] => mcap::source(counted(bytes), name),
        #[cfg(feature = "mcap")]
        magic if magic.starts_with(&mcap::ZSTD) => mcap::source(counted(bytes), name),
        #[cfg(feature = "parquet")]
        [b'P', b'A', b'R', b'1', ..] => parquet::source(bytes, name),
        #[cfg(feature = "arrays")]
        magic if magic.starts_with(&npy::MAGIC) => npy::open(&path, folders),
        #[cfg(feature = "arrays")]
        magic if magic.starts_with(&zip_archive::MAGIC) => npy::open_archive(&path, folders),
        #[cfg(feature = "db3")]
        magic if magic.starts_with(db3::MAGIC) => db3::source(&path),
        [b'#', b'R', b'O', b'S', b'B', b'A', b'G', ..] => rosbag::source(BufReader::new(counted(bytes)), name),
        [b'{', ..] if matches!(ending(&path).as_str(), "jsonl" | "ndjson" | "json") => {
            jsonl::read(BufReader::new(counted(bytes)), name)
        }
        _ if is_table => delimited_text::source(Box::new(BufReader::new(counted(bytes))), name),
        _ => {
            let mut text = String::new();
            // The text of a binary file stays empty.
            let _ = bytes.take(yaml::MAX_BYTES as u64).read_to_string(&mut text);
            Err(FileKind::Log.misplaced(&path, &text).unwrap_or_else(|| unknown(&path)))
        }
    }
}

/// Refuses a name under which a recording could not be read again: its extension is the format.
///
/// # Errors
/// When it is one.
pub fn check_name(path: &Path) -> Result<(), InputError> {
    let ending = ending(path);
    // A pipe has none.
    if ending.is_empty() || text_ending(path) || cfg!(feature = "parquet") && ending == "parquet" {
        return Ok(());
    }
    let message = format!("ends in .{ending}, expected .csv or .parquet");
    let error = InputError::new(path.display().to_string(), message);
    Err(match ending.as_str() {
        "parquet" => error.help("this build cannot write Parquet, its feature `parquet` is off"),
        _ => error,
    })
}

/// Writes a recording as a log of the format that the name ends in: Parquet, or CSV with files beside it.
///
/// # Errors
/// When a file cannot be written, or a column is not as long as the time; then the log is not there.
pub fn write(recording: &Recording, path: &Path) -> Result<(), InputError> {
    let mut files = Files::default();
    add(&mut files, recording, path)?;
    files.commit()
}

/// Adds a recording, as [`write()`] writes it, to files that belong to it.
///
/// # Errors
/// As [`write()`].
pub fn add(files: &mut Files, recording: &Recording, path: &Path) -> Result<(), InputError> {
    match ending(path).as_str() {
        #[cfg(feature = "parquet")]
        "parquet" => parquet::add(files, recording, path),
        _ => add_csv(files, recording, path),
    }
}

/// Adds the columns and labels of a recording, without its scene and events, to a group of files as one table: Parquet or CSV, depending on the name.
///
/// # Errors
/// The file cannot be written, or the length of a column differs from that of the time.
pub fn add_table(files: &mut Files, recording: &Recording, path: &Path) -> Result<(), InputError> {
    match ending(path).as_str() {
        #[cfg(feature = "parquet")]
        "parquet" => parquet::add_table(files, recording, path),
        _ => add_csv_table(files, recording, path),
    }
}

/// Whether a name ends as that of a table of text.
pub fn text_ending(path: &Path) -> bool {
    TEXT_ENDINGS.contains(&ending(path).as_str())
}

/// Whether a file in an archive is an array of NumPy.
#[cfg(feature = "arrays")]
fn is_array(name: &str) -> bool {
    name.ends_with(".npy")
}

/// Whether a file begins with these bytes.
#[cfg(feature = "arrays")]
fn begins_with(path: &Path, magic: &[u8]) -> bool {
    let mut begin = vec![];
    let read = file::open(path).map(|file| file.take(magic.len() as u64).read_to_end(&mut begin).is_ok());
    read.is_ok_and(|is_read| is_read) && begin == magic
}

/// Whether a file that begins like this is a web page.
fn is_web_page(magic: &[u8]) -> bool {
    let begin = magic.trim_ascii_start().to_ascii_lowercase();
    begin.starts_with(b"<!doctype html") || begin.starts_with(b"<html")
}

/// Whether a text is a table although its name does not say so: a name without ending, or one of another program (`.lvm`, `.sto`, `.trc`) above rows of numbers.
/// The position in the file is at the beginning again.
fn is_untold_table(path: &Path, bytes: &mut std::fs::File) -> std::io::Result<bool> {
    if ending(path).is_empty() {
        return Ok(true);
    }
    if FileKind::of(path, "").is_some() || yaml::is_yaml(path) {
        return Ok(false);
    }
    let mut head = vec![];
    bytes.by_ref().take(delimited_text::HEAD).read_to_end(&mut head)?;
    bytes.seek(SeekFrom::Start(0))?;
    // JSON and XML may have numbers in lines too.
    let is_structured = head.trim_ascii_start().first().is_some_and(|first| b"{[<".contains(first));
    Ok(!is_structured && delimited_text::has_rows(&String::from_utf8_lossy(&head)))
}

/// Whether a file that begins like this may be text.
fn is_text(magic: &[u8]) -> bool {
    !magic.is_empty() && magic.iter().all(|byte| !byte.is_ascii_control() || byte.is_ascii_whitespace())
}

fn ending(path: &Path) -> String {
    path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// A log without the recording after it.
pub fn without_episode(path: &Path) -> PathBuf {
    split(path).0
}

/// A path and the recording that stands after it: an episode by number, or a recording of a file that is there. A file that is really called so
/// has none after it.
fn split(path: &Path) -> (PathBuf, Option<String>) {
    let text = path.to_string_lossy();
    let is_name = |name: &str| !name.is_empty() && !name.contains(['/', '\\']);
    match text.rsplit_once('#') {
        Some((log, name)) if is_name(name) && !path.exists() => {
            let log = PathBuf::from(log);
            if log.exists() || name.parse::<usize>().is_ok() {
                return (log, Some(name.to_string()));
            }
            (path.to_path_buf(), None)
        }
        _ => (path.to_path_buf(), None),
    }
}

/// The error of a spreadsheet.
fn spreadsheet(name: String) -> InputError {
    let error = InputError::new(name, "found a spreadsheet, expected a log");
    error.help("save its sheet as CSV in the program that wrote it, and name that file")
}

/// Returns the error of a file in an unknown format.
fn unknown(path: &Path) -> InputError {
    let ending = ending(path);
    let name = path.display().to_string();
    let message = match ending.as_str() {
        "" => "the first bytes of the file are those of no known format".to_string(),
        ending => format!("found a file that ends in `.{ending}`; its first bytes are those of no known format"),
    };
    let error = InputError::new(name, message);
    match ending.as_str() {
        "db3" if cfg!(not(feature = "db3")) => {
            error.help("this build cannot read bags of SQLite, its feature `db3` is off")
        }
        "parquet" if cfg!(not(feature = "parquet")) => {
            error.help("this build cannot read Parquet, its feature `parquet` is off")
        }
        "hdf5" | "h5" | "mat" if cfg!(not(feature = "hdf5")) => {
            error.help("this build cannot read HDF5, its feature `hdf5` is off")
        }
        "npy" | "npz" | "zip" if cfg!(not(feature = "arrays")) => {
            error.help("this build cannot read NumPy's arrays and Zarr, its feature `arrays` is off")
        }
        "mat" => error.help(
            "save it as NPZ with SciPy: `numpy.savez(\"log.npz\", **scipy.io.loadmat(\"log.mat\", squeeze_me=True))`",
        ),
        "mcap" if cfg!(not(feature = "mcap")) => error.help("this build cannot read MCAP, its feature `mcap` is off"),
        _ => error.help(format!(
            "expected a table of text ({}), Parquet, MCAP, HDF5, NPZ, Zarr, a ROS bag, JSON lines or a LeRobot data set",
            TEXT_ENDINGS.join(", ")
        )),
    }
}

/// The topics of a bag as a log; `cut` describes the missing parts of the bag.
#[cfg(feature = "mcap")]
fn finish(topics: topics::Topics, cut: Option<String>) -> Result<Source, InputError> {
    let mut source = topics.finish()?;
    source.issues.extend(cut.map(|message| truncated(0.0, message)));
    Ok(source)
}

/// The message about a log that ends too early.
fn truncated(at: f64, message: String) -> Issue {
    Issue { kind: IssueKind::TRUNCATED, start_s: at, end_s: at, channel: String::new(), message }
}
