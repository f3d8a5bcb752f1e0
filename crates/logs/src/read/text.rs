//! Reading the text or the bytes of a file, whole and up to a limit: a device that never ends is not a file.

use super::file;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use teachtree_base::error::InputError;
use teachtree_base::file_kind::FileKind;

/// Reads a text of at most `most` bytes.
///
/// # Errors
/// A file that cannot be read, is longer, or is not UTF-8.
pub fn read(path: &Path, most: u64) -> Result<String, InputError> {
    whole(&opened(path)?, path, most)
}

/// Reads a text of at most `most` bytes and parses it as a file of a kind. An error about a file of another kind names both kinds instead.
///
/// # Errors
/// As [`read`], and as `parse`.
pub fn parsed<T>(
    path: &Path,
    most: u64,
    kind: FileKind,
    parse: impl FnOnce(String) -> Result<T, InputError>,
) -> Result<T, InputError> {
    let misplaced = |text: &str, error| kind.misplaced(path, text).unwrap_or(error);
    let file = opened(path)?;
    let text = whole(&file, path, most).map_err(|error| misplaced("", error))?;
    let found = text.clone();
    parse(text).map_err(|error| misplaced(&found, error))
}

/// Reads the text of an open file of at most `most` bytes. `path` is its name in messages.
///
/// # Errors
/// As [`read`].
pub fn whole(file: &File, path: &Path, most: u64) -> Result<String, InputError> {
    let name = path.display().to_string();
    let failed = |error: std::io::Error| InputError::unreadable(&name, &error);
    let mut text = String::new();
    let read = file.take(most + 1).read_to_string(&mut text);
    // A limit may cut a character in two.
    if text.len() as u64 > most || read.as_ref().is_err_and(|_| file.metadata().is_ok_and(|it| it.len() > most)) {
        return Err(InputError::new(
            &name,
            format!("the file has more than {most} bytes, which are the most that are read"),
        ));
    }
    read.map_err(failed)?;
    Ok(text)
}

/// Opens a file, or a pipe that the shell passes as a file descriptor (`<(…)`).
///
/// # Errors
/// The path cannot be opened, or is neither.
pub(super) fn opened(path: &Path) -> Result<File, InputError> {
    if !["/dev/fd", "/dev/stdin", "/proc/self/fd"].iter().any(|place| path.starts_with(place)) {
        return file::open(path);
    }
    File::open(path).map_err(|error| InputError::unreadable(path.display().to_string(), &error))
}

/// Reads the bytes of a regular file of at most `most`; `None` where there is no such file.
///
/// # Errors
/// What cannot be read, or is longer.
pub fn bytes(path: &Path, most: u64) -> Result<Option<Vec<u8>>, InputError> {
    let name = path.display().to_string();
    let failed = |error: std::io::Error| InputError::unreadable(&name, &error);
    if !std::fs::metadata(path).is_ok_and(|found| found.is_file()) {
        return Ok(None);
    }
    let mut bytes = Vec::new();
    file::open(path)?.take(most + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > most {
        let message = format!("the file has more than {most} bytes, which are the most that are read");
        return Err(InputError::new(&name, message));
    }
    Ok(Some(bytes))
}
