//! Opens files for reading. Rejects pipes, whose opening may block forever, and everything else that is not a regular file.

use std::fs::{File, FileType, OpenOptions};
use std::io::{Error, ErrorKind, Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;

const PIPE: &str = "a pipe";
const WITHOUT_PIPE: &str = "write its output to a file, and name that file";
/// Maximum depth of subfolders that are searched for pipes.
const DEEPEST: usize = 32;

/// Opens a file. Rejects a pipe, a device or a socket without waiting for it.
///
/// # Errors
/// The path cannot be opened or is not a file.
pub fn open(path: &Path) -> Result<File, InputError> {
    let name = || path.display().to_string();
    let failed = |error: Error| InputError::unreadable(name(), &error);
    let checked = |kind: FileType| match what_else(kind) {
        Some(what) => {
            let error = InputError::new(name(), format!("found {what}, expected a file"));
            Err(if what == PIPE { error.help(WITHOUT_PIPE) } else { error })
        }
        None => Ok(()),
    };
    // Opening a device may have side effects, and a socket cannot be opened.
    checked(std::fs::metadata(path).map_err(failed)?.file_type())?;
    let file = at_once(path).map_err(failed)?;
    // A pipe may have replaced the file in the meantime.
    let metadata = file.metadata().map_err(failed)?;
    checked(metadata.file_type())?;
    if metadata.len() <= MAX_POINTER && is_pointer(&file).map_err(failed)? {
        let message = "found a pointer of Git LFS, expected the file that it stands for";
        return Err(InputError::new(name(), message).help("`git lfs pull` fetches the files of a repository"));
    }
    Ok(file)
}

/// The largest pointer of Git LFS, bytes, and its beginning.
const MAX_POINTER: u64 = 1024;
const POINTER: &[u8] = b"version https://git-lfs.github.com/spec/";

/// Whether a file is a pointer of Git LFS. Its position is at the beginning again.
fn is_pointer(mut file: &File) -> std::io::Result<bool> {
    let mut begin = vec![];
    file.take(POINTER.len() as u64).read_to_end(&mut begin)?;
    file.seek(SeekFrom::Start(0))?;
    Ok(begin == POINTER)
}

/// Opens a folder.
///
/// # Errors
/// The path cannot be opened or is not a folder.
pub fn open_folder(path: &Path) -> std::io::Result<File> {
    let folder = at_once(path)?;
    if folder.metadata()?.is_dir() { Ok(folder) } else { Err(ErrorKind::NotADirectory.into()) }
}

/// Whether a path exists and is not a folder. [`open`] rejects anything but a regular file, by its type.
pub fn is_there(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|found| !found.is_dir())
}

/// The error for a folder without a log; it names a pipe that is in the place of one. `expected` continues the message otherwise.
pub fn no_log(folder: &Path, expected: &str) -> InputError {
    let name = folder.display().to_string();
    match pipe_in(folder, 0) {
        Some(pipe) => {
            let message = format!("the folder holds no log: `{}` is a pipe, expected a file", pipe.display());
            InputError::new(name, message).help(WITHOUT_PIPE)
        }
        None => InputError::new(name, format!("the folder holds no log{expected}")),
    }
}

/// Returns the first pipe in a folder or its subfolders. Hidden entries are left out.
fn pipe_in(folder: &Path, depth: usize) -> Option<PathBuf> {
    let entries = std::fs::read_dir(folder).ok()?.flatten();
    let mut paths: Vec<(PathBuf, bool)> = entries
        .filter(|entry| !entry.file_name().to_string_lossy().starts_with('.'))
        .map(|entry| (entry.path(), entry.file_type().is_ok_and(|kind| kind.is_dir())))
        .collect();
    paths.sort();
    paths.into_iter().find_map(|(path, is_folder)| {
        if is_folder {
            return if depth < DEEPEST { pipe_in(&path, depth + 1) } else { None };
        }
        let kind = std::fs::metadata(&path).ok()?.file_type();
        (what_else(kind) == Some(PIPE)).then_some(path)
    })
}

/// Opens a path without waiting for the other end of a pipe.
fn at_once(path: &Path) -> std::io::Result<File> {
    let mut options = OpenOptions::new();
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, libc::O_NONBLOCK);
    options.read(true).open(path)
}

/// Whether the path refers to the open file.
pub fn is_at(file: &File, path: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        let id = |of: std::fs::Metadata| (of.dev(), of.ino());
        let (Ok(open), Ok(named)) = (file.metadata(), std::fs::metadata(path)) else { return false };
        id(open) == id(named)
    }
    #[cfg(not(unix))]
    {
        let _ = file;
        path.exists()
    }
}

/// Returns the name of a file type that is not a regular file; `None` for a regular file.
pub fn what_else(kind: FileType) -> Option<&'static str> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt as _;
        if kind.is_fifo() {
            return Some(PIPE);
        }
        if kind.is_socket() {
            return Some("a socket");
        }
        if kind.is_char_device() || kind.is_block_device() {
            return Some("a device");
        }
    }
    (!kind.is_file()).then_some("a folder")
}
