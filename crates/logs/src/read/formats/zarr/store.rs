//! The storage of a store's parts: files of a folder, or of a zip archive.

use super::super::zip_archive::{self, Archive};
use super::metadata::is_array;
use crate::allowed_folders::AllowedFolders;
use crate::read::table::MAX_COLUMNS;
use std::cell::{OnceCell, RefCell};
use std::io::Read;
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;

/// The files that describe a store, a group or an array, of both versions.
const METADATA: [&str; 4] = ["zarr.json", ".zgroup", ".zarray", ".zmetadata"];
/// Maximum depth of groups, and maximum number of files and folders.
const DEEPEST: usize = 12;
const MAX_FILES: usize = 1 << 22;
/// The longest description that is read, in bytes.
const MAX_METADATA: u64 = 16 << 20;

/// Whether a folder is a store.
pub(in super::super) fn is_folder(path: &Path) -> bool {
    METADATA.iter().any(|name| path.join(name).is_file())
}

/// Whether a file in an archive describes a store or a part of one.
pub(in super::super) fn is_metadata(name: &str) -> bool {
    METADATA.contains(&name.rsplit('/').next().unwrap_or(name))
}

/// A store.
pub(super) struct Store {
    place: String,
    kind: Kind,
    /// The folders that its files must be in.
    folders: AllowedFolders,
    /// The bytes of all its files, once they are counted.
    size: OnceCell<u64>,
}

enum Kind {
    Folder(PathBuf),
    /// An archive, and the folder in it that is the store.
    Archive(RefCell<Archive>, String),
}

impl Store {
    /// Opens a store.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn open(path: &Path, folders: &AllowedFolders) -> Result<Self, InputError> {
        let (place, folders) = (path.display().to_string(), folders.clone());
        if path.is_dir() {
            return Ok(Self { place, kind: Kind::Folder(path.into()), folders, size: OnceCell::new() });
        }
        let archive = zip_archive::open(path, &folders)?;
        let described = archive.file_names().filter_map(Result::ok).filter(|name| is_metadata(name));
        let folder =
            described.map(|name| name.rsplit_once('/').map_or(String::new(), |(folder, _)| format!("{folder}/")));
        let Some(folder) = folder.min_by_key(|folder| folder.len()) else {
            return Err(InputError::new(place, "the archive holds no Zarr store"));
        };
        Ok(Self { place, kind: Kind::Archive(RefCell::new(archive), folder), folders, size: OnceCell::new() })
    }

    /// The bytes of a file, if it is there.
    ///
    /// # Errors
    /// When it cannot be read, or has more than `most` bytes.
    pub fn get(&self, key: &str, most: u64) -> Result<Option<Vec<u8>>, InputError> {
        let place = format!("{} file {key}", self.place);
        let failed = |error: std::io::Error| InputError::unreadable(&place, &error);
        let mut bytes = vec![];
        match &self.kind {
            Kind::Folder(folder) => {
                let Some(file) = self.folders.open_if_there(&folder.join(key))? else { return Ok(None) };
                file.take(most.saturating_add(1)).read_to_end(&mut bytes).map_err(failed)?;
            }
            Kind::Archive(archive, folder) => {
                let mut archive = archive.borrow_mut();
                let Some(at) = archive.index_for_name(&format!("{folder}{key}")) else { return Ok(None) };
                let file = archive.by_index(at).map_err(|error| zip_archive::damaged(&place, &error))?;
                file.take(most.saturating_add(1)).read_to_end(&mut bytes).map_err(failed)?;
            }
        }
        if bytes.len() as u64 > most {
            return Err(InputError::new(place, format!("has more than {most} bytes, the most that are read")));
        }
        Ok(Some(bytes))
    }

    /// Whether a file exists.
    pub fn has(&self, key: &str) -> bool {
        match &self.kind {
            Kind::Folder(folder) => folder.join(key).is_file(),
            Kind::Archive(archive, folder) => archive.borrow().index_for_name(&format!("{folder}{key}")).is_some(),
        }
    }

    /// A description, if it is there.
    ///
    /// # Errors
    /// As [`get`](Self::get).
    pub fn description(&self, key: &str) -> Result<Option<Vec<u8>>, InputError> {
        self.get(key, MAX_METADATA)
    }

    /// The bytes of all files.
    ///
    /// # Errors
    /// When a folder cannot be read.
    pub fn size(&self) -> Result<u64, InputError> {
        if let Some(size) = self.size.get() {
            return Ok(*size);
        }
        let size = match &self.kind {
            Kind::Folder(folder) => {
                let mut size = 0_u64;
                self.walk(folder, &mut 0, 2 * DEEPEST, &mut |path| {
                    size = size.saturating_add(std::fs::metadata(path).map_or(0, |file| file.len()));
                })?;
                size
            }
            Kind::Archive(..) => std::fs::metadata(&self.place).map_or(0, |file| file.len()),
        };
        Ok(*self.size.get_or_init(|| size))
    }

    /// The paths of all arrays, in order; empty for a store that is an array itself.
    ///
    /// # Errors
    /// When there are too many, or a folder cannot be read.
    pub fn arrays(&self) -> Result<Vec<String>, InputError> {
        let mut found: Vec<String> = vec![];
        match &self.kind {
            Kind::Folder(folder) => self.arrays_in(folder, "", 0, &mut 0, &mut found)?,
            Kind::Archive(archive, folder) => {
                let names: Vec<String> = archive
                    .borrow()
                    .file_names()
                    .filter_map(|name| Some(name.ok()?.strip_prefix(folder.as_str())?.to_string()))
                    .filter(|name| is_metadata(name))
                    .collect();
                for name in names {
                    let (path, file) = name.rsplit_once('/').unwrap_or(("", &name));
                    let is_array = file == ".zarray" || file == "zarr.json" && is_array(self, path)?;
                    if is_array && !found.iter().any(|known| known == path) {
                        found.push(path.to_string());
                    }
                    self.check(found.len())?;
                }
            }
        }
        found.sort();
        Ok(found)
    }

    fn check(&self, arrays: usize) -> Result<(), InputError> {
        if arrays <= MAX_COLUMNS {
            return Ok(());
        }
        Err(InputError::new(&self.place, format!("found more than {MAX_COLUMNS} arrays, the most that are read")))
    }

    /// Finds the arrays in a group, without reading their contents.
    fn arrays_in(
        &self,
        folder: &Path,
        path: &str,
        depth: usize,
        seen: &mut usize,
        found: &mut Vec<String>,
    ) -> Result<(), InputError> {
        if depth > DEEPEST {
            let message = format!("found groups nested deeper than {DEEPEST}, the most that are read");
            return Err(InputError::new(&self.place, message));
        }
        if folder.join(".zarray").is_file() || folder.join("zarr.json").is_file() && is_array(self, path)? {
            found.push(path.to_string());
            return self.check(found.len());
        }
        for (name, inner) in self.entries(folder, seen)? {
            if inner.is_dir() {
                let path = if path.is_empty() { name } else { format!("{path}/{name}") };
                self.arrays_in(&inner, &path, depth + 1, seen, found)?;
            }
        }
        Ok(())
    }

    /// Returns the entries of a folder, by name, without hidden files.
    fn entries(&self, folder: &Path, seen: &mut usize) -> Result<Vec<(String, PathBuf)>, InputError> {
        let mut entries = vec![];
        for path in self.folders.list(folder)? {
            let path = path?;
            *seen += 1;
            if *seen > MAX_FILES {
                let message = format!("has more than {MAX_FILES} files, the most that are read");
                return Err(InputError::new(&self.place, message));
            }
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if !name.starts_with('.') {
                entries.push((name, path));
            }
        }
        entries.sort();
        Ok(entries)
    }

    /// Visits all files below a folder.
    fn walk(
        &self,
        folder: &Path,
        seen: &mut usize,
        depth: usize,
        visit: &mut dyn FnMut(&Path),
    ) -> Result<(), InputError> {
        for (_, path) in self.entries(folder, seen)? {
            if path.is_dir() && depth > 0 {
                self.walk(&path, seen, depth - 1, visit)?;
            } else {
                visit(&path);
            }
        }
        Ok(())
    }
}
