//! The folders that links in a folder may lead to: the folder itself and, for a snapshot in a Hugging Face hub cache, the `blobs` of that cache, which
//! contain the snapshot's files.
//!
//! ```text
//! hub/datasets--lerobot--pusht/blobs/4f1c…
//! hub/datasets--lerobot--pusht/snapshots/7628…/data/chunk-000/file-000.parquet -> ../../../../../blobs/4f1c…
//! ```
//!
//! Links to other places, broken links, pipes and devices are refused; the error names the path. A file is checked after it is opened, so that a link that
//! replaces the file in the meantime is refused too. Readers of logs open each file by [`AllowedFolders::open`] and list each folder by
//! [`AllowedFolders::list`]; by default these allow all folders.

use crate::read::file;
use std::fs::File;
use std::io::ErrorKind;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;

/// The folders in which files are allowed, by default all folders.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AllowedFolders {
    /// The folder's path for messages.
    shown: PathBuf,
    /// The folders as canonical paths; `None` allows all folders.
    real: Option<Vec<PathBuf>>,
    /// A file that is allowed wherever a link at its path leads.
    named: Option<PathBuf>,
}

/// The folders in which the files of a log are allowed, by default all folders.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LogFolders {
    /// The folders of the log itself.
    pub log: AllowedFolders,
    /// The folders of the files beside it: scene, events, labels, exports, videos.
    pub beside: AllowedFolders,
}

impl AllowedFolders {
    /// Allows a folder and, if the folder is a snapshot in a cache, the `blobs` of the cache.
    ///
    /// # Errors
    /// The folder does not exist.
    pub fn of(folder: &Path) -> Result<Self, InputError> {
        let shown = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let unreadable = |error| InputError::unreadable(shown.display().to_string(), &error);
        let own = std::fs::canonicalize(shown).map_err(unreadable)?;
        let is_snapshot = |path: &&Path| path.parent().is_some_and(|above| above.ends_with("snapshots"));
        let cache = own.ancestors().find(is_snapshot).and_then(|snapshot| snapshot.parent()?.parent());
        let blobs = cache.map(|cache| cache.join("blobs"));
        // A link to another place does not count as `blobs` of this cache.
        let blobs = blobs.filter(|blobs| std::fs::canonicalize(blobs).is_ok_and(|real| real == *blobs));
        let real = Some(std::iter::once(own).chain(blobs).collect());
        Ok(Self { shown: shown.into(), real, named: None })
    }

    /// Also allows a file that the command line names. If its path is a link, the link may lead to any folder.
    #[must_use]
    pub fn with_named(self, file: &Path) -> Self {
        Self { named: Some(file.into()), ..self }
    }

    fn contain(&self, real: &Path) -> bool {
        self.real.as_ref().is_none_or(|folders| folders.iter().any(|folder| real.starts_with(folder)))
    }

    /// Opens a file.
    ///
    /// # Errors
    /// The path does not exist, is not a file, or is outside of the allowed folders.
    pub fn open(&self, path: &Path) -> Result<File, InputError> {
        let is_gone = |error: &InputError| error.cause.as_ref().is_some_and(|it| it.kind() == ErrorKind::NotFound);
        let file = file::open(path).map_err(|error| match is_gone(&error) && path.is_symlink() {
            true => leads_nowhere(path),
            false => error,
        })?;
        let is_named = self.named.as_deref() == Some(path);
        if is_named || self.has_opened(&file, path) { Ok(file) } else { Err(self.leads_elsewhere(path)) }
    }

    /// Whether a path is to be opened: it is a file or, unless all folders are allowed, a broken link, pipe or device, which [`open`](Self::open) rejects
    /// by name.
    pub fn has(&self, path: &Path) -> bool {
        if self.real.is_none() { path.is_file() } else { path.symlink_metadata().is_ok() && !path.is_dir() }
    }

    /// Opens a file like [`open`](Self::open), or returns `None` if the folders do not [have](Self::has) it.
    ///
    /// # Errors
    /// [`open`](Self::open) rejects the path.
    pub fn open_if_there(&self, path: &Path) -> Result<Option<File>, InputError> {
        if self.has(path) { self.open(path).map(Some) } else { Ok(None) }
    }

    /// Returns the paths in a folder, in no particular order.
    ///
    /// # Errors
    /// The folder cannot be read or is outside of the allowed folders.
    pub fn list(&self, folder: &Path) -> Result<impl Iterator<Item = Result<PathBuf, InputError>>, InputError> {
        let folder = folder.to_path_buf();
        let failed = |error| InputError::unreadable(folder.display().to_string(), &error);
        let entries = if self.real.is_none() {
            std::fs::read_dir(&folder)
        } else {
            let opened = file::open_folder(&folder).map_err(failed)?;
            if !self.has_opened(&opened, &folder) {
                return Err(self.leads_elsewhere(&folder));
            }
            std::fs::read_dir(by_number(&opened).unwrap_or_else(|| folder.clone()))
        };
        let entries = entries.map_err(failed)?;
        Ok(entries.map(move |entry| {
            let failed = |error| InputError::unreadable(folder.display().to_string(), &error);
            Ok(folder.join(entry.map_err(failed)?.file_name()))
        }))
    }

    /// Rejects paths that [`open`](Self::open) rejects, and folders outside of the allowed ones, without opening them. Returns whether the path is a
    /// folder.
    ///
    /// # Errors
    /// The path is rejected.
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

    /// Returns the place to write a file to: the target of a link, otherwise the path itself. Writing or removing by this place follows no further
    /// link.
    ///
    /// # Errors
    /// The path exists and [`open`](Self::open) rejects it, or a parent folder is a link out of the allowed folders.
    pub fn place(&self, path: &Path) -> Result<PinnedPath, InputError> {
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
            Ok(PinnedPath::new(folder, &real))
        } else {
            Err(self.leads_elsewhere(path))
        }
    }

    /// Whether the file or folder that was opened is in an allowed folder or is one.
    fn has_opened(&self, open: &File, path: &Path) -> bool {
        self.real.is_none() || place_of(open, path).is_some_and(|place| self.contain(&place))
    }

    fn leads_elsewhere(&self, path: &Path) -> InputError {
        let message = format!("leads out of {}, expected a file in it", self.shown.display());
        InputError::new(path.display().to_string(), message).help("put a copy of the file in the place of the link")
    }
}

fn leads_nowhere(path: &Path) -> InputError {
    let to = std::fs::read_link(path).unwrap_or_default();
    let message = format!("is a link to {}, which does not exist", to.display());
    InputError::new(path.display().to_string(), message).help("delete the link, or put the file in its place")
}

/// The place of a file to be written: a path that refers to the same folder as long as the value lives.
pub struct PinnedPath {
    path: PathBuf,
    _folder: Option<File>,
}

impl PinnedPath {
    /// A file in a folder.
    fn new(folder: File, real: &Path) -> Self {
        let path = by_number(&folder).zip(real.file_name()).map(|(folder, name)| folder.join(name));
        Self { path: path.unwrap_or_else(|| real.into()), _folder: Some(folder) }
    }
}

impl From<PathBuf> for PinnedPath {
    /// A path in a folder that no other program changes.
    fn from(path: PathBuf) -> Self {
        Self { path, _folder: None }
    }
}

impl Deref for PinnedPath {
    type Target = Path;

    fn deref(&self) -> &Path {
        &self.path
    }
}

/// Returns a path that refers to an open folder as long as it is open, `None` if the system has no such path.
fn by_number(folder: &File) -> Option<PathBuf> {
    #[cfg(target_os = "linux")]
    {
        use std::os::fd::AsRawFd as _;
        Some(PathBuf::from(format!("/proc/self/fd/{}", folder.as_raw_fd()))).filter(|path| path.is_dir())
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = folder;
        None
    }
}

/// Returns the canonical path of an open file, `None` if it cannot be determined.
fn place_of(open: &File, path: &Path) -> Option<PathBuf> {
    // The kernel has the path of the open file, even if the original path has changed since.
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
