//! Writing files whole or not at all, one or several that belong together, and folders.
//!
//! A file is written beside its place under a temporary name, synchronized with the disk, and then renamed. Files that belong together, such as a log and its
//! scene, are all written before the first one is renamed, so neither an error nor a full disk leaves some of them. Between two renames a kill of the program
//! or a loss of power can still do so: a *marker* beside the log says so from before the first rename until after the last one, and logs with a marker are
//! refused ([`refuse_unfinished`]).
//!
//! A temporary file is locked while its program lives. The next program that writes to a folder removes unlocked ones.

use crate::allowed_folders::AllowedFolders;
use crate::allowed_folders::PinnedPath;
use crate::read::file;
use std::collections::BTreeSet;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufWriter, Error, ErrorKind, Result, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use teachtree_base::error::InputError;
use tempfile::NamedTempFile;

/// The prefix of temporary files and markers.
const PREFIX: &str = ".teachtree-";
/// The suffix of markers.
const MARKER: &str = ".replacing";
/// Links that are followed, one to the next.
const LINKS: usize = 40;

/// Temporary files that exist, and the folders that were cleared. While it is held nothing is renamed.
static STATE: Mutex<State> = Mutex::new(State { temporary: BTreeSet::new(), cleared: BTreeSet::new() });

struct State {
    temporary: BTreeSet<PathBuf>,
    cleared: BTreeSet<PathBuf>,
}

fn state() -> MutexGuard<'static, State> {
    STATE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Fills a file, so that it is there whole or not at all. A link is followed; pipes and devices are written to directly.
///
/// # Errors
/// When the place cannot be written.
pub fn write(
    path: &Path,
    fill: impl FnOnce(&mut (dyn Write + Send)) -> Result<()>,
) -> std::result::Result<(), InputError> {
    let mut files = Files::default();
    files.add(path, fill)?;
    files.commit()
}

/// Refuses a log of which a program was replacing the files when it was killed: what is there may belong to two recordings.
///
/// # Errors
/// When its marker is there and no running program holds it.
pub fn refuse_unfinished(log: &Path) -> std::result::Result<(), InputError> {
    let Some(marker) = marker_of(&destination(log)) else { return Ok(()) };
    let Ok(file) = file::open(&marker) else { return Ok(()) };
    // A program that is at it needs a moment.
    let waited = file.lock_shared();
    drop(file);
    if waited.is_err() || !marker.exists() {
        return Ok(());
    }
    let message = "was being replaced when the program was killed: it and the files beside it may be of two recordings";
    let help = format!("record it again, or delete {} to read what is there", marker.display());
    Err(InputError::new(log.display().to_string(), message).help(help))
}

/// Removes all temporary files of this program, which is about to end; nothing can be written from then on.
pub fn abort_writes() -> impl Sized {
    let state = state();
    for file in &state.temporary {
        // The next run removes it if it cannot be removed now.
        let _ = std::fs::remove_dir_all(folder_at(file));
        let _ = std::fs::remove_file(file);
    }
    state
}

/// A folder that is filled under a temporary name beside its place, and then is there whole or not at all.
pub struct Folder {
    /// A file that is locked while the folder is filled.
    lock: TemporaryFile,
    target: PathBuf,
}

impl Folder {
    /// An empty folder for a place where there is nothing.
    ///
    /// # Errors
    /// When there is something, or the folder cannot be made.
    pub fn new(target: &Path) -> std::result::Result<Self, InputError> {
        if target.symlink_metadata().is_ok() {
            let message = "exists already, expected the name of a new folder";
            return Err(
                InputError::new(target.display().to_string(), message).help("name another one, or delete it first")
            );
        }
        let made = || {
            let lock = TemporaryFile::beside(target)?;
            std::fs::create_dir(folder_at(lock.0.path()))?;
            Ok(Self { lock, target: target.to_path_buf() })
        };
        made().map_err(|error: Error| write_error(target, &error))
    }

    /// The folder to be filled.
    pub fn path(&self) -> PathBuf {
        folder_at(self.lock.0.path())
    }

    /// Puts a file in the folder in the place that was named, instead of the folder, which is then gone.
    ///
    /// # Errors
    /// When it cannot be put there.
    pub fn commit_file(self, name: &Path) -> std::result::Result<(), InputError> {
        let state = state();
        let file = self.path().join(name);
        // Renaming would replace what another program has put there meanwhile; a link does not. Some file systems have no links.
        match std::fs::hard_link(&file, &self.target) {
            Err(error) if error.kind() != ErrorKind::AlreadyExists && self.target.symlink_metadata().is_err() => {
                std::fs::rename(&file, &self.target)
            }
            linked => linked,
        }
        .map_err(|error| write_error(&self.target, &error))?;
        sync(folder_of(&self.target));
        drop(state);
        Ok(())
    }

    /// Puts the folder in its place.
    ///
    /// # Errors
    /// When it cannot be put there; then it is gone.
    pub fn commit(self) -> std::result::Result<(), InputError> {
        // The lock delays the end of the program until the files are in place.
        let mut state = state();
        let folder = self.path();
        sync(&folder);
        // An empty folder would be replaced.
        let renamed = match self.target.symlink_metadata() {
            Ok(_) => Err(ErrorKind::AlreadyExists.into()),
            Err(_) => std::fs::rename(&folder, &self.target),
        };
        renamed.map_err(|error| write_error(&self.target, &error))?;
        sync(folder_of(&self.target));
        state.temporary.remove(self.lock.0.path());
        Ok(())
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // `commit` has already removed the folder.
        let _ = std::fs::remove_dir_all(self.path());
    }
}

/// The folder that belongs to a temporary file.
fn folder_at(file: &Path) -> PathBuf {
    let mut name = file.as_os_str().to_os_string();
    name.push(".folder");
    name.into()
}

/// Files that belong together: all are written, then all are put in their places.
#[derive(Default)]
pub struct Files {
    parts: Vec<PendingFile>,
}

struct PendingFile {
    /// The path as it was given.
    shown: PathBuf,
    content: Content,
    /// Dropped last: the path of a temporary file may lead through the folder that it holds open.
    target: PinnedPath,
}

enum Content {
    /// A file that is written and synchronized.
    New(TemporaryFile),
    /// As `New`, and what is beside it belongs to it.
    NewLog(TemporaryFile),
    /// The file is to be gone.
    Removal,
}

impl Files {
    /// Writes a file, which is put in its place by [`commit`](Self::commit). Pipes and devices are written to at once.
    ///
    /// # Errors
    /// When the place cannot be written.
    pub fn add(
        &mut self,
        path: &Path,
        fill: impl FnOnce(&mut (dyn Write + Send)) -> Result<()>,
    ) -> std::result::Result<(), InputError> {
        self.put(path, fill, Content::New).map_err(|error| write_error(path, &error))
    }

    /// Writes a log, to which files added before belong: it is put in its place after them.
    ///
    /// # Errors
    /// When the place cannot be written.
    pub fn add_log(
        &mut self,
        path: &Path,
        fill: impl FnOnce(&mut (dyn Write + Send)) -> Result<()>,
    ) -> std::result::Result<(), InputError> {
        self.put(path, fill, Content::NewLog).map_err(|error| write_error(path, &error))
    }

    /// A file that does not belong to the others any more: it is removed.
    pub fn remove(&mut self, path: &Path) {
        let target = destination(path);
        if target.is_file() {
            self.parts.push(PendingFile {
                shown: path.to_path_buf(),
                target: target.into(),
                content: Content::Removal,
            });
        }
    }

    /// Writes a file like [`add`](Self::add), but only into certain folders, and replaces only regular files.
    ///
    /// # Errors
    /// The path is a link out of the folders or a broken link, is not a file, or cannot be written.
    pub fn add_in(
        &mut self,
        folders: &AllowedFolders,
        path: &Path,
        fill: impl FnOnce(&mut (dyn Write + Send)) -> Result<()>,
    ) -> std::result::Result<(), InputError> {
        let target = folders.place(path)?;
        let content = Content::New(TemporaryFile::filled(&target, fill).map_err(|error| write_error(path, &error))?);
        self.parts.push(PendingFile { shown: path.to_path_buf(), target, content });
        Ok(())
    }

    /// Removes a file like [`remove`](Self::remove), but only from certain folders.
    ///
    /// # Errors
    /// The path is a link out of the folders or a broken link, or is not a file.
    pub fn remove_in(&mut self, folders: &AllowedFolders, path: &Path) -> std::result::Result<(), InputError> {
        let target = folders.place(path)?;
        if target.is_file() {
            self.parts.push(PendingFile { shown: path.to_path_buf(), target, content: Content::Removal });
        }
        Ok(())
    }

    fn put(
        &mut self,
        path: &Path,
        fill: impl FnOnce(&mut (dyn Write + Send)) -> Result<()>,
        content: fn(TemporaryFile) -> Content,
    ) -> Result<()> {
        let target = destination(path);
        if target.is_dir() {
            return Err(Error::other("it is a folder"));
        }
        if target.exists() && !target.is_file() {
            let mut out = BufWriter::new(OpenOptions::new().write(true).open(&target)?);
            fill(&mut out)?;
            return out.flush();
        }
        let content = content(TemporaryFile::filled(&target, fill)?);
        self.parts.push(PendingFile { shown: path.to_path_buf(), target: target.into(), content });
        Ok(())
    }

    /// Puts all files in their places, in the order in which they were added.
    ///
    /// # Errors
    /// When one cannot be put there. Markers stay where some of the files of a log were replaced already.
    pub fn commit(self) -> std::result::Result<(), InputError> {
        self.replace(&[])
    }

    /// Moves the previous files away, then puts all new files in place. Old and new files never exist together; after a kill in between, some files are
    /// missing. Use it for files that can be generated again.
    ///
    /// # Errors
    /// A file cannot be put in place. The previous files are then restored.
    pub fn commit_anew(self) -> std::result::Result<(), InputError> {
        let there = self.parts.iter().filter(|part| self.parts.len() > 1 && part.target.is_file());
        let aside = there.map(|part| {
            let empty = TemporaryFile::beside(&part.target).map_err(|error| write_error(&part.shown, &error))?;
            Ok((part.target.to_path_buf(), empty))
        });
        let aside: Vec<_> = aside.collect::<std::result::Result<_, InputError>>()?;
        self.replace(&aside)
    }

    /// Puts all files in place after moving the previous ones to temporary paths.
    fn replace(self, aside: &[(PathBuf, TemporaryFile)]) -> std::result::Result<(), InputError> {
        // The lock delays the end of the program until the files are in place.
        let mut state = state();
        let mut moved = Vec::new();
        let moving = || {
            for (place, empty) in aside {
                std::fs::rename(place, empty.0.path()).map_err(|error| write_error(place, &error))?;
                moved.push((place, empty));
            }
            self.put_in_place(&mut state)
        };
        let replaced = moving();
        if replaced.is_err() {
            for (place, old) in moved {
                let _ = std::fs::rename(old.0.path(), place);
            }
        }
        replaced
    }

    fn put_in_place(self, state: &mut State) -> std::result::Result<(), InputError> {
        let mut markers = Vec::new();
        if self.parts.len() > 1 {
            for part in self.parts.iter().filter(|part| matches!(part.content, Content::NewLog(_))) {
                markers.extend(Marker::set(&part.target).map_err(|error| write_error(&part.shown, &error))?);
            }
        }
        let mut targets = Vec::new();
        for PendingFile { shown, target, content } in self.parts {
            match content {
                Content::New(file) | Content::NewLog(file) => file.persist(&target, state),
                Content::Removal => std::fs::remove_file(&*target),
            }
            .map_err(|error| write_error(&shown, &error))?;
            targets.push(target);
        }
        let folders: BTreeSet<&Path> = targets.iter().map(|target| folder_of(target)).collect();
        folders.into_iter().for_each(sync);
        markers.into_iter().for_each(Marker::clear);
        Ok(())
    }
}

fn write_error(path: &Path, error: &Error) -> InputError {
    InputError::unwritable(path.display().to_string(), error)
}

/// The file that a path leads to, which need not be there: links are followed.
fn destination(path: &Path) -> PathBuf {
    let mut place = path.to_path_buf();
    for _ in 0..LINKS {
        if let Ok(place) = std::fs::canonicalize(&place) {
            return place;
        }
        // A link to nothing stays: the file is made where it leads.
        let Ok(next) = std::fs::read_link(&place) else { break };
        place = folder_of(&place).join(next);
    }
    place
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Makes renames in a folder last; where a system cannot, they last a little later.
fn sync(folder: &Path) {
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

/// A temporary file, which is locked.
struct TemporaryFile(NamedTempFile);

impl TemporaryFile {
    fn beside(target: &Path) -> Result<Self> {
        let folder = folder_of(target);
        let mut state = state();
        if state.cleared.insert(std::fs::canonicalize(folder).unwrap_or_else(|_| folder.to_path_buf())) {
            clear(folder);
        }
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX);
        // Temporary files are private; what is written is an ordinary file, as the umask has it.
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt as _;
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        loop {
            let file = builder.tempfile_in(folder)?;
            // Some file systems have no locks. On others, another program may have removed the file before it was locked.
            let taken = matches!(file.as_file().try_lock(), Err(TryLockError::WouldBlock));
            if !taken && file.path().exists() {
                state.temporary.insert(file.path().to_path_buf());
                return Ok(Self(file));
            }
        }
    }

    /// Writes and synchronizes a temporary file beside its target.
    fn filled(target: &Path, fill: impl FnOnce(&mut (dyn Write + Send)) -> Result<()>) -> Result<Self> {
        let mut file = Self::beside(target)?;
        let mut out = BufWriter::new(&mut file.0);
        fill(&mut out)?;
        out.flush()?;
        drop(out);
        if let Ok(old) = std::fs::metadata(target) {
            file.0.as_file().set_permissions(old.permissions())?;
        }
        file.0.as_file().sync_all()?;
        Ok(file)
    }

    fn persist(self, target: &Path, state: &mut State) -> Result<()> {
        state.temporary.remove(self.0.path());
        // The path in `state` belongs to the file of this name, which is gone from here on.
        self.0.persist(target).map(|_| ()).map_err(|error| error.error)
    }
}

/// Removes the temporary files of programs that are gone.
fn clear(folder: &Path) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        if is_file && name.starts_with(PREFIX) && !name.ends_with(MARKER) {
            let abandoned = File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok());
            if abandoned {
                let _ = std::fs::remove_dir_all(folder_at(&entry.path()));
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }
}

/// A file beside a log that is there while its files are being replaced.
struct Marker {
    path: PathBuf,
    _locked: File,
}

fn marker_of(log: &Path) -> Option<PathBuf> {
    let name = log.file_name()?.to_str()?;
    Some(folder_of(log).join(format!("{PREFIX}{name}{MARKER}")))
}

impl Marker {
    /// `None` for a name that no marker can have.
    fn set(log: &Path) -> Result<Option<Self>> {
        let Some(path) = marker_of(log) else { return Ok(None) };
        loop {
            let mut file = OpenOptions::new().create(true).truncate(false).write(true).open(&path)?;
            // Two programs that write the same log do so one after the other.
            let _ = file.lock();
            if !file::is_at(&file, &path) {
                // The one before has removed it in the meantime.
                continue;
            }
            file.write_all(b"The files of this log are being replaced.\n")?;
            file.sync_all()?;
            sync(folder_of(log));
            return Ok(Some(Self { path, _locked: file }));
        }
    }

    fn clear(self) {
        let _ = std::fs::remove_file(&self.path);
    }
}
