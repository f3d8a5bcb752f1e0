//! The folders that the links of a folder may lead to: the folder itself, and, of a snapshot in a cache of the Hugging Face hub, the `blobs` of that cache,
//! where its files are.
//!
//! ```text
//! hub/datasets--lerobot--pusht/blobs/4f1c…
//! hub/datasets--lerobot--pusht/snapshots/7628…/data/chunk-000/file-000.parquet -> ../../../../../blobs/4f1c…
//! ```
//!
//! A link that leads elsewhere or nowhere, a pipe, and a device are refused by name. What is opened is checked after it was opened, so that a link which takes
//! the place of a file meanwhile is refused too.

use super::read::file;
use crate::base::error::InputError;
use std::fs::File;
use std::io::ErrorKind;
use std::ops::Deref;
use std::path::{Path, PathBuf};

/// The folders in which files may be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AllowedFolders {
    /// The folder as it is called in messages.
    shown: PathBuf,
    /// The folders, without links.
    real: Vec<PathBuf>,
}

impl AllowedFolders {
    /// A folder, and the `blobs` of the cache that it is a snapshot of.
    ///
    /// # Errors
    /// When there is no such folder.
    pub fn of(folder: &Path) -> Result<Self, InputError> {
        let shown = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let unreadable = |error| InputError::unreadable(shown.display().to_string(), &error);
        let own = std::fs::canonicalize(shown).map_err(unreadable)?;
        let is_snapshot = |path: &&Path| path.parent().is_some_and(|above| above.ends_with("snapshots"));
        let cache = own.ancestors().find(is_snapshot).and_then(|snapshot| snapshot.parent()?.parent());
        let blobs = cache.map(|cache| cache.join("blobs"));
        // `blobs` that are elsewhere are none of this cache.
        let blobs = blobs.filter(|blobs| std::fs::canonicalize(blobs).is_ok_and(|real| real == *blobs));
        Ok(Self { shown: shown.into(), real: std::iter::once(own).chain(blobs).collect() })
    }

    /// Whether a folder, which may be a link, is among them.
    pub fn has(&self, folder: &Path) -> bool {
        std::fs::canonicalize(folder).is_ok_and(|real| self.contain(&real))
    }

    fn contain(&self, real: &Path) -> bool {
        self.real.iter().any(|folder| real.starts_with(folder))
    }

    /// Opens a file.
    ///
    /// # Errors
    /// When it is not there, is no file, or is in no folder of these.
    pub fn open(&self, path: &Path) -> Result<File, InputError> {
        let is_gone = |error: &InputError| error.cause.as_ref().is_some_and(|it| it.kind() == ErrorKind::NotFound);
        let file = file::open(path).map_err(|error| match is_gone(&error) && path.is_symlink() {
            true => leads_nowhere(path),
            false => error,
        })?;
        if self.has_opened(&file, path) { Ok(file) } else { Err(self.leads_elsewhere(path)) }
    }

    /// Refuses what [`open`](Self::open) refuses, and folders elsewhere; nothing is opened. Returns whether it is a folder.
    ///
    /// # Errors
    /// As said.
    pub fn check(&self, path: &Path) -> Result<bool, InputError> {
        let real = std::fs::canonicalize(path).map_err(|error| match error.kind() {
            ErrorKind::NotFound if path.is_symlink() => leads_nowhere(path),
            _ => InputError::unreadable(path.display().to_string(), &error),
        })?;
        if !self.contain(&real) {
            return Err(self.leads_elsewhere(path));
        }
        let unreadable = |error| InputError::unreadable(path.display().to_string(), &error);
        let kind = std::fs::metadata(&real).map_err(unreadable)?.file_type();
        match file::what_else(kind) {
            Some(_) if kind.is_dir() => Ok(true),
            Some(what) => Err(InputError::new(path.display().to_string(), format!("is {what}, expected a file"))
                .help("delete it, or put a file in its place")),
            None => Ok(false),
        }
    }

    /// Where a file of this path is to be written: in the place of the file that a link leads to, else of the path itself. What is there is replaced or
    /// removed by this place, not followed.
    ///
    /// # Errors
    /// When something is there that [`open`](Self::open) refuses, or a folder on the way leads elsewhere.
    pub fn place(&self, path: &Path) -> Result<Place, InputError> {
        let unwritable = |error| InputError::unwritable(path.display().to_string(), &error);
        let folder_of = |path: &Path| path.parent().map(Path::to_path_buf).unwrap_or_default();
        let real = if path.symlink_metadata().is_ok() {
            if self.check(path)? {
                return Err(InputError::new(path.display().to_string(), "found a folder, expected a file"));
            }
            std::fs::canonicalize(path).map_err(unwritable)?
        } else {
            let folder = std::fs::canonicalize(Path::new(".").join(folder_of(path))).map_err(unwritable)?;
            folder.join(path.file_name().unwrap_or_default())
        };
        let folder = file::open_folder(&folder_of(&real)).map_err(unwritable)?;
        if self.has_opened(&folder, &folder_of(&real)) {
            Ok(Place::new(folder, &real))
        } else {
            Err(self.leads_elsewhere(path))
        }
    }

    /// Whether what was opened by this path is in one of the folders, or is one.
    fn has_opened(&self, open: &File, path: &Path) -> bool {
        place_of(open, path).is_some_and(|place| self.contain(&place))
    }

    fn leads_elsewhere(&self, path: &Path) -> InputError {
        let message = format!("leads out of {}, expected a file in it", self.shown.display());
        InputError::new(path.display().to_string(), message).help("put a copy of the file in the place of the link")
    }
}

fn leads_nowhere(path: &Path) -> InputError {
    let to = std::fs::read_link(path).unwrap_or_default();
    let message = format!("is a link to {}, which is not there", to.display());
    InputError::new(path.display().to_string(), message).help("delete the link, or put the file in its place")
}

/// A place that a file is written into: a path, which leads to the same folder as long as this is held.
pub struct Place {
    path: PathBuf,
    _folder: Option<File>,
}

impl Place {
    /// A file in a folder.
    fn new(folder: File, real: &Path) -> Self {
        #[cfg(target_os = "linux")]
        {
            use std::os::fd::AsRawFd as _;
            let by_number = PathBuf::from(format!("/proc/self/fd/{}", folder.as_raw_fd()));
            if let (true, Some(name)) = (by_number.is_dir(), real.file_name()) {
                return Self { path: by_number.join(name), _folder: Some(folder) };
            }
        }
        Self { path: real.into(), _folder: Some(folder) }
    }
}

impl From<PathBuf> for Place {
    /// A path that nobody else changes.
    fn from(path: PathBuf) -> Self {
        Self { path, _folder: None }
    }
}

impl Deref for Place {
    type Target = Path;

    fn deref(&self) -> &Path {
        &self.path
    }
}

/// Where an open file is, without links; `None` where that cannot be found out.
fn place_of(open: &File, path: &Path) -> Option<PathBuf> {
    // The system knows by which folder it was opened, whatever the path leads to by now.
    #[cfg(target_os = "linux")]
    {
        use std::os::fd::AsRawFd as _;
        if let Ok(place) = std::fs::read_link(format!("/proc/self/fd/{}", open.as_raw_fd())) {
            return Some(place);
        }
    }
    let place = std::fs::canonicalize(path).ok()?;
    file::is_at(open, &place).then_some(place)
}
