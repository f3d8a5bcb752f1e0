//! The files of a copy.

use crate::allowed_folders::AllowedFolders;
use crate::read::file;
use serde_json::Value;
use std::fs::File;
use std::io::{Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;

/// Maximum nesting depth of a set's folders, and maximum number of its files.
const DEEPEST: usize = 16;
const MAX_FILES: usize = 1 << 20;

pub(in super::super) fn copy_error(copy: &Path, error: &std::io::Error) -> InputError {
    InputError::unwritable(copy.display().to_string(), error)
}

/// A destination that keeps the first error of writing into it.
pub(in super::super) struct FirstErrorWriter<W> {
    pub out: W,
    pub failed: Option<std::io::Error>,
}

impl<W> FirstErrorWriter<W> {
    fn keep_error<T>(&mut self, result: std::io::Result<T>) -> std::io::Result<T> {
        if let (Err(error), None) = (&result, &self.failed) {
            self.failed = Some(error.raw_os_error().map_or_else(
                || std::io::Error::new(error.kind(), error.to_string()),
                std::io::Error::from_raw_os_error,
            ));
        }
        result
    }
}

impl<W: std::io::Write> std::io::Write for FirstErrorWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let result = self.out.write(bytes);
        self.keep_error(result)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        let result = self.out.flush();
        self.keep_error(result)
    }
}

/// Returns the paths of a set's files, relative to the set. Links to files of the set, or of the cache that contains it, are followed.
///
/// # Errors
/// A pipe, a broken link or a link that leads elsewhere, by name.
pub(super) fn files_of(root: &Path, folders: &AllowedFolders) -> Result<Vec<PathBuf>, InputError> {
    let mut found = vec![];
    files_in(root, Path::new(""), folders, 0, &mut found)?;
    Ok(found)
}

fn files_in(
    root: &Path,
    below: &Path,
    folders: &AllowedFolders,
    depth: usize,
    found: &mut Vec<PathBuf>,
) -> Result<(), InputError> {
    let folder = root.join(below);
    let failed = |error: std::io::Error| InputError::unreadable(folder.display().to_string(), &error);
    if depth > DEEPEST || found.len() > MAX_FILES {
        let message = format!("found more than {MAX_FILES} files, or folders nested deeper than {DEEPEST}");
        return Err(InputError::new(root.display().to_string(), message));
    }
    let mut names = vec![];
    for entry in std::fs::read_dir(&folder).map_err(failed)? {
        names.push(entry.map_err(failed)?.file_name());
    }
    names.sort();
    for name in names {
        let file = below.join(name);
        let path = root.join(&file);
        if folders.check(&path)? {
            let real = |path: &Path| std::fs::canonicalize(path).unwrap_or_default();
            if path.is_symlink() && real(&folder).starts_with(real(&path)) {
                let message = "is a link to a folder that it is in, which a copy cannot have";
                return Err(InputError::new(path.display().to_string(), message).help("delete the link"));
            }
            files_in(root, &file, folders, depth + 1, found)?;
        } else {
            found.push(file);
        }
    }
    Ok(())
}

/// Copies a file and compares the copy with it.
pub(super) fn copy_file(from: &Path, to: &Path, copy: &Path, folders: &AllowedFolders) -> Result<(), InputError> {
    let mut one = folders.open(from)?;
    let mut copied = || {
        let mut other = File::create_new(to)?;
        std::io::copy(&mut one, &mut other)?;
        other.set_permissions(one.metadata()?.permissions())?;
        other.sync_all()?;
        one.rewind()
    };
    copied().map_err(|error| copy_error(copy, &error))?;
    let mut other = file::open(to)?;
    let failed = |error: std::io::Error| InputError::unreadable(from.display().to_string(), &error);
    let (mut ours, mut theirs) = (vec![0; 1 << 16], vec![0; 1 << 16]);
    loop {
        let count = one.read(&mut ours).map_err(failed)?;
        let Some((read, copied)) = ours.get(..count).zip(theirs.get_mut(..count)) else { return Ok(()) };
        let same = other.read_exact(copied).is_ok() && read == &*copied;
        if count == 0 && other.read(&mut theirs).map_err(failed)? == 0 {
            return Ok(());
        }
        if count == 0 || !same {
            return Err(InputError::new(from.display().to_string(), "the copy differs from the file"));
        }
    }
}

/// Makes the folder that a file of the copy is in.
pub(in super::super) fn make_parent(to: &Path, copy: &Path) -> Result<(), InputError> {
    to.parent().map_or(Ok(()), |parent| std::fs::create_dir_all(parent).map_err(|error| copy_error(copy, &error)))
}

/// Writes a file of the copy.
pub(in super::super) fn write_bytes(to: &Path, copy: &Path, bytes: &[u8]) -> Result<(), InputError> {
    let mut file = File::create_new(to).map_err(|error| copy_error(copy, &error))?;
    file.write_all(bytes).and_then(|()| file.sync_all()).map_err(|error| copy_error(copy, &error))
}

/// JSON as lerobot writes it.
pub(in super::super) fn printed(value: &Value, place: &str) -> Result<Vec<u8>, InputError> {
    let mut bytes = vec![];
    let form = serde_json::ser::PrettyFormatter::with_indent(b"    ");
    let mut out = serde_json::Serializer::with_formatter(&mut bytes, form);
    serde::Serialize::serialize(value, &mut out).map_err(|error| InputError::new(place, error.to_string()))?;
    Ok(bytes)
}
