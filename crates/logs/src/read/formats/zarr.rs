//! Zarr, versions 2 and 3, in a folder or a zip archive: arrays with a row a sample are columns by their path, as the data sets of HDF5.
//!
//! A replay buffer of Diffusion Policy (`data/*` and `meta/episode_ends`, as of UMI) has the episodes one after the other: `x.zarr#3` are the rows of one.
//! Groups with numbers (`data/demo_0`) are recordings, as in HDF5. Chunks are read when something of them is wanted; before, shapes are checked.

mod blosc;
mod chunks;
mod codecs;
mod metadata;
mod shards;
mod store;

use super::array_attributes::ArrayAttributes;
use super::array_columns::width;
use super::array_log::{self, Array, MissingRows, Recording, rate, rows};
use super::budget::Budget;
use super::recordings::{MAX_RECORDINGS, choose, number_of};
use crate::allowed_folders::AllowedFolders;
use crate::read::table::Source;
use chunks::ChunkedArray;
use metadata::{ArrayMetadata, attributes};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use store::Store;
use teachtree_base::error::InputError;
use teachtree_base::guard::guarded;

pub(super) use store::{is_folder, is_metadata};

/// The array that says where episodes end.
const EPISODE_ENDS: [&str; 2] = ["meta/episode_ends", "episode_ends"];
/// The group that recordings or their arrays are in.
const DATA: &str = "data/";

/// Opens a recording of a store whose files must be in `folders`.
///
/// # Errors
/// The store is damaged or outside of the folders, or no recording is chosen.
pub(super) fn open(path: &Path, recording: Option<&str>, folders: &AllowedFolders) -> Result<Source, InputError> {
    let place = path.display().to_string();
    guarded(&place, || {
        let container = Container::open(path, folders)?;
        container.source(container.choose(recording)?)
    })
}

/// The recordings of a store, by number; none for a store that is one.
///
/// # Errors
/// When it is damaged.
pub(super) fn names(path: &Path, folders: &AllowedFolders) -> Result<Vec<String>, InputError> {
    guarded(&path.display().to_string(), || Ok(Container::open(path, folders)?.names))
}

/// The files that a recording of a folder is read from.
///
/// # Errors
/// When the store is damaged, or it is not said which of its recordings is meant.
pub(super) fn files(path: &Path, recording: Option<&str>) -> Result<Vec<PathBuf>, InputError> {
    guarded(&path.display().to_string(), || {
        let container = Container::open(path, &AllowedFolders::default())?;
        let chosen = container.choose(recording)?;
        let mut keys: Vec<String> = container.groups(chosen).iter().flat_map(|group| metadata::keys(group)).collect();
        if let Some(array) = container.episode_ends()? {
            keys.extend(metadata::keys(array.path()));
            keys.extend(array.keys(0..array.rows())?);
        }
        for (_, path) in container.members(chosen) {
            keys.extend(metadata::keys(&path));
            if let ArrayMetadata::Array(array) = container.array(&path)? {
                keys.extend(array.keys(container.window(chosen, array.rows()))?);
            }
        }
        keys.sort();
        keys.dedup();
        Ok(keys.into_iter().map(|key| path.join(key)).filter(|file| file.is_file()).collect())
    })
}

/// A store, and what of it is a recording.
struct Container {
    place: String,
    store: Rc<Store>,
    /// The paths of its arrays.
    arrays: Vec<String>,
    names: Vec<String>,
    kind: Kind,
}

/// The recordings of a store.
enum Kind {
    /// The store is one.
    One,
    /// Each has a group, in `data/` or in the store.
    Groups(&'static str),
    /// Each has rows of all arrays in `data/`, or in the store.
    Episodes(&'static str, Vec<usize>),
}

impl Container {
    fn open(path: &Path, folders: &AllowedFolders) -> Result<Self, InputError> {
        let place = path.display().to_string();
        let store = Rc::new(Store::open(path, folders)?);
        let arrays = store.arrays()?;
        let mut container = Self { place, store, arrays, names: vec![], kind: Kind::One };
        let parent = if container.arrays.iter().any(|path| path.starts_with(DATA)) { DATA } else { "" };
        if let Some(ends) = container.episode_ends()? {
            let ends = container.ends(&ends)?;
            container.names = (0..ends.len()).map(|episode| episode.to_string()).collect();
            container.kind = Kind::Episodes(parent, ends);
            return Ok(container);
        }
        let first = |path: &String| Some(path.strip_prefix(parent)?.split_once('/')?.0.to_string());
        let mut groups: Vec<String> = container.arrays.iter().filter_map(first).collect();
        groups.retain(|name| number_of(name).is_some());
        groups.sort_by(|a, b| number_of(a).cmp(&number_of(b)).then_with(|| a.cmp(b)));
        groups.dedup();
        // Beside arrays, groups with numbers are parts of one recording, such as cameras.
        let is_beside = |path: &String| path.strip_prefix(parent).is_some_and(|name| !name.contains('/'));
        if !groups.is_empty() && !container.arrays.iter().any(is_beside) {
            container.check_count(groups.len())?;
            (container.names, container.kind) = (groups, Kind::Groups(parent));
        }
        Ok(container)
    }

    fn check_count(&self, count: usize) -> Result<(), InputError> {
        if count <= MAX_RECORDINGS {
            return Ok(());
        }
        let message = format!("found {count} recordings, at most {MAX_RECORDINGS} are read");
        Err(InputError::new(&self.place, message))
    }

    /// The array that says where episodes end.
    fn episode_ends(&self) -> Result<Option<ChunkedArray>, InputError> {
        let Some(path) = self.arrays.iter().find(|path| EPISODE_ENDS.contains(&path.as_str())) else { return Ok(None) };
        match self.array(path)? {
            ArrayMetadata::Array(array) => Ok(Some(*array)),
            ArrayMetadata::Refused { reason, .. } => {
                Err(InputError::new(format!("{} array {path}", self.place), reason))
            }
        }
    }

    /// The rows after the last one of each episode, which rise.
    fn ends(&self, array: &ChunkedArray) -> Result<Vec<usize>, InputError> {
        let wrong = |message: String| InputError::new(format!("{} array {}", self.place, array.path()), message);
        if !array.dimensions().is_empty() {
            return Err(wrong(format!("has {} dimensions, expected one", array.dimensions().len() + 1)));
        }
        self.check_count(array.rows())?;
        let mut budget = Budget::new(self.store.size()?);
        if !budget.take(Some(array.rows()), array.element().size, false) {
            return Err(wrong(Budget::REFUSED.into()));
        }
        if array.missing(&(0..array.rows())).is_some() {
            return Err(wrong("lacks chunks with the ends of the episodes".into()));
        }
        let values = array.numbers(0..array.rows())?;
        let mut ends: Vec<usize> = Vec::with_capacity(values.len());
        for value in values {
            let end = value as usize;
            if end as f64 != value || ends.last().is_some_and(|last| end < *last) {
                return Err(wrong(format!("found the end {value}, expected whole numbers that rise")));
            }
            ends.push(end);
        }
        Ok(ends)
    }

    fn choose(&self, asked: Option<&str>) -> Result<Option<usize>, InputError> {
        choose(&self.place, "store", &self.names, asked)
    }

    fn array(&self, path: &str) -> Result<ArrayMetadata, InputError> {
        metadata::read(&self.store, &self.place, path)
    }

    /// The groups that say something about a recording, its own first; the store itself is an empty path.
    fn groups(&self, chosen: Option<usize>) -> Vec<String> {
        let mut groups = match (&self.kind, chosen.and_then(|chosen| self.names.get(chosen))) {
            (Kind::Groups(parent), Some(name)) => vec![format!("{parent}{name}")],
            _ => vec![],
        };
        groups.extend([String::new(), DATA.trim_end_matches('/').to_string()]);
        groups
    }

    /// The arrays of a recording, by their names in it and their paths.
    fn members(&self, chosen: Option<usize>) -> Vec<(String, String)> {
        let prefix = match (&self.kind, chosen.and_then(|chosen| self.names.get(chosen))) {
            (Kind::Groups(parent), Some(name)) => format!("{parent}{name}/"),
            (Kind::Episodes(parent, _), _) => (*parent).to_string(),
            _ => String::new(),
        };
        let own = |path: &&String| !EPISODE_ENDS.contains(&path.as_str());
        let named = |path: &String| Some((path.strip_prefix(&prefix)?.to_string(), path.clone()));
        // An array that is the store itself has no name.
        let name = |(name, path): (String, String)| (if name.is_empty() { "arr_0".into() } else { name }, path);
        self.arrays.iter().filter(own).filter_map(named).map(name).collect()
    }

    /// Returns the rows of a recording in an array of `rows` rows.
    fn window(&self, chosen: Option<usize>, rows: usize) -> Range<usize> {
        match (&self.kind, chosen) {
            // An array that is shorter than the episodes has no row for each sample.
            (Kind::Episodes(_, ends), Some(chosen)) if ends.last().is_some_and(|last| rows >= *last) => {
                let start = chosen.checked_sub(1).and_then(|before| ends.get(before)).copied().unwrap_or(0);
                start..ends.get(chosen).copied().unwrap_or(0)
            }
            (Kind::Episodes(..), _) => 0..0,
            _ => 0..rows,
        }
    }

    /// A recording as a log.
    fn source(&self, chosen: Option<usize>) -> Result<Source, InputError> {
        let name = chosen.and_then(|chosen| self.names.get(chosen));
        let place = name.map_or_else(|| self.place.clone(), |name| format!("{}#{name}", self.place));
        if let (Kind::Episodes(_, ends), Some(chosen)) = (&self.kind, chosen)
            && self.window(Some(chosen), ends.last().copied().unwrap_or(0)).is_empty()
        {
            return Err(InputError::new(place, "the episode has no rows"));
        }
        let mut described = vec![];
        for group in self.groups(chosen) {
            described.push(attributes(&self.store, &self.place, &group)?);
        }
        let samples = described.first().and_then(|own| own.get("num_samples")?.as_u64());
        let samples = samples.and_then(|count| usize::try_from(count).ok());
        let rate_hz = described.iter().find_map(|attrs| rate(&|key| attrs.get(key).cloned().unwrap_or_default()));
        let mut budget = Budget::new(self.store.size()?);
        let mut arrays = vec![];
        for (name, path) in self.members(chosen) {
            match self.array(&path)? {
                ArrayMetadata::Refused { rows, dimensions, reason } => {
                    let rows = self.window(chosen, rows).len();
                    // Images are left out, whatever compresses them.
                    if rows > 0 && width(&dimensions).is_some() {
                        arrays.push(Array::refused(name, rows, &dimensions, reason));
                    }
                }
                ArrayMetadata::Array(array) => {
                    let rows = self.window(chosen, array.rows());
                    let (count, dimensions) = (rows.len(), array.dimensions().to_vec());
                    let element = array.element();
                    let Some(width) = width(&dimensions).filter(|width| !element.is_text() || *width == 1) else {
                        continue;
                    };
                    if count == 0 {
                        continue;
                    }
                    let fits = budget.take(count.checked_mul(width), element.size, element.is_text())
                        && budget.has(array.chunk_bytes());
                    arrays.push(if fits {
                        let values = Box::new(Values { array: *array, rows });
                        let said = attributes(&self.store, &self.place, &path)?;
                        let said = ArrayAttributes::of(&|key| said.get(key).cloned().unwrap_or_default());
                        Array::new(name, count, &dimensions, element.is_text(), &said, values)?
                    } else {
                        Array::refused(name, count, &dimensions, Budget::REFUSED)
                    });
                }
            }
        }
        let rows = rows(&arrays, samples);
        let most = budget.whole;
        Recording { place, arrays, rows, most, rate_hz, time: None, computed: None }.source()
    }
}

/// Rows of an array.
struct Values {
    array: ChunkedArray,
    rows: Range<usize>,
}

impl array_log::ArrayValues for Values {
    fn numbers(&self, first_row: bool) -> Result<Vec<f64>, InputError> {
        let Range { start, end } = self.rows;
        self.array.numbers(if first_row { start..end.min(start + 1) } else { start..end })
    }

    fn texts(&self) -> Result<Vec<String>, InputError> {
        self.array.texts(self.rows.clone())
    }

    fn missing(&self) -> Option<MissingRows> {
        self.array.missing(&self.rows)
    }
}
