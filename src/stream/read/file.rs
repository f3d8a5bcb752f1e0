//! Opening files to be read. What is no file, such as a pipe, of which opening may wait for ever, is refused.

use crate::base::error::InputError;
use std::fs::{File, FileType, OpenOptions};
use std::io::{Error, ErrorKind};
use std::path::Path;

const PIPE: &str = "a pipe";

/// Opens a file. A pipe, a device or a socket in its place is refused, and not waited for.
///
/// # Errors
/// When it cannot be opened, or is no file.
pub fn open(path: &Path) -> Result<File, InputError> {
    let name = || path.display().to_string();
    let failed = |error: Error| InputError::unreadable(name(), &error);
    let checked = |kind: FileType| match what_else(kind) {
        Some(what) => {
            let error = InputError::new(name(), format!("found {what}, expected a file"));
            Err(if what == PIPE {
                error.help("write what comes through it into a file, and name that one")
            } else {
                error
            })
        }
        None => Ok(()),
    };
    // Some devices act when they are opened, and a socket cannot be.
    checked(std::fs::metadata(path).map_err(failed)?.file_type())?;
    let file = at_once(path).map_err(failed)?;
    // A pipe may have taken its place since then.
    checked(file.metadata().map_err(failed)?.file_type())?;
    Ok(file)
}

/// Opens a folder.
///
/// # Errors
/// When it cannot be opened, or is none.
pub fn open_folder(path: &Path) -> std::io::Result<File> {
    let folder = at_once(path)?;
    if folder.metadata()?.is_dir() { Ok(folder) } else { Err(ErrorKind::NotADirectory.into()) }
}

/// Opens what is there without waiting for the other end of a pipe.
fn at_once(path: &Path) -> std::io::Result<File> {
    let mut options = OpenOptions::new();
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, libc::O_NONBLOCK);
    options.read(true).open(path)
}

/// Whether an open file has this name.
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

/// What stands in the place of a file; `None` for a file.
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
