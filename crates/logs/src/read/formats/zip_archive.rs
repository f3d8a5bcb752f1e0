//! Archives: NumPy's `.npz`, and Zarr stores in one file.

use crate::allowed_folders::AllowedFolders;
use ::zip::ZipArchive;
use ::zip::result::ZipError;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use teachtree_base::error::InputError;

/// The first bytes of an archive, and of an empty one.
pub(super) const MAGIC: [u8; 4] = *b"PK\x03\x04";
pub(super) const EMPTY: [u8; 4] = *b"PK\x05\x06";

/// An archive that is open.
pub(super) type Archive = ZipArchive<BufReader<File>>;

/// Opens an archive, which must be in `folders`.
///
/// # Errors
/// When it is none, is damaged, or is outside of the folders.
pub(super) fn open(path: &Path, folders: &AllowedFolders) -> Result<Archive, InputError> {
    ZipArchive::new(BufReader::new(folders.open(path)?)).map_err(|error| damaged(&path.display().to_string(), &error))
}

/// The reason why a file in an archive cannot be read.
pub(super) fn damaged(place: &str, error: &ZipError) -> InputError {
    InputError::new(place, format!("cannot be read as a zip archive: {error}"))
}

/// Whether a file is an archive with a name in it that is like this.
///
/// # Errors
/// As [`open`].
pub(super) fn has(path: &Path, like: impl Fn(&str) -> bool, folders: &AllowedFolders) -> Result<bool, InputError> {
    let archive = open(path, folders)?;
    Ok(archive.file_names().any(|name| name.is_ok_and(|name| like(&name))))
}
