//! A copy of a LeRobot set with labels in words, in the forms that programs read: `language_persistent`, `subtask_index`, columns of SARM and of GR00T,
//! a file to be corrected by hand; and with `next.success`.
//!
//! The copy is made beside its place under another name, compared with the set, and then renamed: at any time it is there whole or not at all.

pub(super) mod files;
mod gr00t;
mod legacy;
mod persistent;
pub mod prelabels;
mod sarm;
pub mod success;
pub(super) mod timeline;

pub use timeline::Label;

use super::super::parquet::column::{Column, Values};
use super::super::parquet::language::{self, COLUMN, Episodes};
use super::super::parquet::rewrite;
use super::{Dataset, MAX_INFO, info, lists_in};
use crate::allowed_folders::AllowedFolders;
use crate::atomic_write::Folder;
use crate::read::file;
use crate::read::formats::parquet;
use crate::read::memory_table::Cells;
use files::{copy_error, copy_file, write_bytes};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;

/// The source of the labels.
const ROLE: &str = "assistant";
/// The key of the provenance of labels in `info.json`, and in the metadata of data files.
pub(super) const PROVENANCE: &str = "teachtree";

/// How labels are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LabelFormat {
    /// The column `language_persistent`.
    Language,
    /// The column `subtask_index`, and `meta/subtasks.parquet`.
    Legacy,
    /// Columns of SARM in `meta/episodes`, and `meta/temporal_proportions_*.json`.
    Sarm,
    /// Columns `annotation.teachtree.*`, `meta/tasks.jsonl` and `meta/modality.json`.
    Gr00t,
    /// `meta/lerobot_annotations.json`.
    Prelabels,
    /// The column `next.success`.
    Success,
}

impl LabelFormat {
    /// The table of forms.
    fn storage(self) -> &'static dyn Storage {
        match self {
            Self::Language => &persistent::Persistent,
            Self::Legacy => &legacy::Legacy,
            Self::Sarm => &sarm::Sarm,
            Self::Gr00t => &gr00t::Gr00t,
            Self::Prelabels => &prelabels::Prelabels,
            Self::Success => &success::Success,
        }
    }
}

/// A form of labels: the sets that can have it, its labels in a set, and what it adds to a copy.
trait Storage {
    /// Returns the version that a set needs for the form, unless the set has it.
    fn required_version(&self, _is_v2: bool) -> Option<RequiredVersion> {
        None
    }

    /// Refuses a set that has labels of these styles in this form.
    fn refuse_labeled(&self, set: &AnnotationTarget, styles: &[&str]) -> Result<(), InputError>;

    /// Adds the labels of a request to the changes.
    fn add(&self, changes: &mut Changes, set: &AnnotationTarget, request: &Request) -> Result<(), InputError>;
}

/// The version that a set needs for a form, the reason, and how to get such a set.
struct RequiredVersion {
    name: &'static str,
    why: &'static str,
    help: &'static str,
}

/// The data that are written into a copy.
pub struct Request<'a> {
    /// How labels are stored.
    pub forms: &'a [LabelFormat],
    /// The styles of the labels.
    pub styles: &'a [&'static str],
    /// The style that `subtask_index` is of.
    pub legacy: &'static str,
    /// The labels of each episode; those of episodes that are left out are not known.
    pub labels: &'a BTreeMap<usize, Vec<Label>>,
    /// Whether each episode has succeeded after each of its frames; for [`LabelFormat::Success`] of all episodes.
    pub successes: &'a BTreeMap<usize, Vec<bool>>,
    /// The provenance of the labels.
    pub provenance: &'a Value,
}

/// A set that labels can be written into.
pub struct AnnotationTarget {
    folder: PathBuf,
    /// The folders of the set's files.
    folders: AllowedFolders,
    set: Dataset,
    is_v2: bool,
    /// The paths of all files, relative to the set.
    all: Vec<PathBuf>,
    /// The data files.
    files: BTreeSet<PathBuf>,
    /// The stamps of each episode, s.
    stamps: BTreeMap<usize, Vec<f64>>,
    /// The rows of language that are there already.
    known: Episodes,
}

/// Files and columns of a copy that the set does not have, or has otherwise.
#[derive(Default)]
struct Changes {
    /// Columns of data files; a value a row.
    frames: Vec<FrameColumn>,
    /// Columns of the lists of episodes.
    episodes: Vec<EpisodeColumn>,
    /// Files by their path in the set.
    files: BTreeMap<PathBuf, Vec<u8>>,
    /// Features that `info.json` has.
    features: Vec<(String, Value)>,
    /// The number of tasks, if it changes.
    tasks: Option<usize>,
}

/// A column of data files.
enum FrameColumn {
    Language(Episodes),
    /// An index for each row of each episode, and that of rows of other episodes.
    Index(String, BTreeMap<usize, Vec<i64>>, i64),
    /// A truth for each row of each episode; other rows have the last one of their episode, or none is true.
    Flags(String, BTreeMap<usize, Vec<bool>>),
}

/// A column of lists of episodes, by episode.
type EpisodeColumn = (String, Lists);

/// A list for each episode.
enum Lists {
    Texts(BTreeMap<usize, Vec<String>>),
    Integers(BTreeMap<usize, Vec<i64>>),
    Numbers(BTreeMap<usize, Vec<f64>>),
}

impl AnnotationTarget {
    /// Opens a set, and reads its stamps and the language that it has.
    ///
    /// # Errors
    /// The folder is not a set, is damaged, contains a pipe, a broken link or a link that leads out of it, or has a data file without stamps.
    pub fn open(folder: &Path) -> Result<Self, InputError> {
        Self::open_within(folder, AllowedFolders::of(folder)?)
    }

    /// Opens a set like [`open`](Self::open) whose files must be in `folders`.
    ///
    /// # Errors
    /// As [`open`](Self::open), for a link that leads out of the folders.
    pub fn open_within(folder: &Path, folders: AllowedFolders) -> Result<Self, InputError> {
        // Files that cannot be copied are detected before anything is read or written.
        let all = files::files_of(folder, &folders)?;
        let set = Dataset::read(folder, &folders)?;
        let is_v2 = set.text("codebase_version")?.starts_with("v2");
        let mut files = BTreeSet::new();
        if is_v2 {
            for episode in 0..super::count(folder, &folders)? {
                files.insert(set.data_file(episode)?);
            }
        } else {
            for place in set.all_listed()?.into_values() {
                let (chunk, file) = place?;
                files.insert(set.path(set.text("data_path")?, &[("chunk_index", chunk), ("file_index", file)])?);
            }
        }
        let (mut stamps, mut known) = (BTreeMap::<usize, Vec<f64>>::new(), Episodes::new());
        for path in &files {
            let name = path.display().to_string();
            read_stamps(folders.open(path)?, &name, &mut stamps)?;
            known.extend(language::read(folders.open(path)?, &name)?.unwrap_or_default());
        }
        Ok(Self { folder: folder.to_path_buf(), folders, set, is_v2, all, files, stamps, known })
    }

    /// Refuses forms that sets of this version do not have.
    ///
    /// # Errors
    /// When there is one among them.
    pub fn refuse_forms(&self, forms: &[LabelFormat]) -> Result<(), InputError> {
        let version = self.set.text("codebase_version")?;
        let required = forms.iter().find_map(|form| form.storage().required_version(self.is_v2));
        required.map_or(Ok(()), |RequiredVersion { name, why, help }| {
            let message = format!("found a data set of version `{version}`, expected {name}, {why}");
            Err(self.set.wrong(message).help(help))
        })
    }

    /// Refuses labels where there are some of the same styles in the same form.
    ///
    /// # Errors
    /// When there are; for language at the first episode that has some.
    pub fn refuse_labeled(&self, forms: &[LabelFormat], styles: &[&str]) -> Result<(), InputError> {
        forms.iter().try_for_each(|form| form.storage().refuse_labeled(self, styles))
    }

    /// The error that the set has labels of a style.
    fn has_labels(&self, message: String) -> InputError {
        self.refused(message, "--replace leaves them out of the copy; --style chooses others")
    }

    /// The error that the set has a column or a file already.
    fn has_already(&self, what: &str) -> InputError {
        self.refused(format!("has {what} already"), "--replace writes others in their place into the copy")
    }

    fn refused(&self, message: String, help: &str) -> InputError {
        InputError::new(self.folder.display().to_string(), message).help(help)
    }

    /// The first of these columns and files that is there, in words.
    fn has(&self, columns: &[String], files: &[&Path]) -> Result<Option<String>, InputError> {
        let declared = |name: &String| self.set.info.get("features").is_some_and(|all| all.get(name).is_some());
        if let Some(name) = columns.iter().find(|name| declared(name)) {
            return Ok(Some(format!("the column `{name}`")));
        }
        if let Some(file) = files.iter().find(|file| self.folder.join(file).exists()) {
            return Ok(Some(format!("`{}`", file.display())));
        }
        for file in self.files.iter().filter(|_| !columns.is_empty()) {
            let known = rewrite::names(self.opened(file)?, &file.display().to_string())?;
            if let Some(name) = known.iter().find(|name| columns.contains(name)) {
                return Ok(Some(format!("the column `{name}`")));
            }
        }
        Ok(None)
    }

    /// The lists of episodes.
    fn lists(&self) -> Result<Vec<PathBuf>, InputError> {
        if self.is_v2 { Ok(vec![]) } else { lists_in(&self.folder.join("meta").join("episodes"), &self.folders) }
    }

    /// Writes a copy of the set with labels; those of the same styles that were there in the same form are left out. `progress` is called with a part of
    /// the whole, 0 to 1.
    ///
    /// # Errors
    /// When something is at the place of the copy, the copy cannot be written, or differs from the set in more than the labels.
    pub fn write(&self, copy: &Path, request: &Request, progress: &mut dyn FnMut(f64)) -> Result<(), InputError> {
        let mut changes = Changes::default();
        for form in request.forms {
            form.storage().add(&mut changes, self, request)?;
        }
        let described = info(Path::new(""));
        changes.files.insert(described, self.new_info(&changes, request.provenance)?);
        let folder = Folder::new(copy)?;
        let lists: BTreeSet<PathBuf> =
            if changes.episodes.is_empty() { vec![] } else { self.lists()? }.into_iter().collect();
        let total = self.all.len().max(1) as f64;
        let mut counts = BTreeMap::new();
        let keys = [(PROVENANCE, request.provenance.to_string())];
        for (at, file) in self.all.iter().enumerate() {
            let (from, to) = (self.folder.join(file), folder.path().join(file));
            files::make_parent(&to, copy)?;
            if self.files.contains(&from) && !changes.frames.is_empty() {
                let columns = frame_columns(self.opened(&from)?, &from, &changes.frames, &mut counts)?;
                self.rewritten(&from, &to, copy, &columns, &keys)?;
            } else if lists.contains(&from) {
                let columns = episode_columns(self.opened(&from)?, &from, &changes.episodes)?;
                self.rewritten(&from, &to, copy, &columns, &keys)?;
            } else if let Some(bytes) = changes.files.remove(file) {
                write_bytes(&to, copy, &bytes)?;
            } else {
                copy_file(&from, &to, copy, &self.folders)?;
            }
            progress((at + 1) as f64 / total);
        }
        for (file, bytes) in &changes.files {
            let to = folder.path().join(file);
            files::make_parent(&to, copy)?;
            write_bytes(&to, copy, bytes)?;
        }
        folder.commit()
    }

    /// `meta/lerobot_annotations.json` with the labels of all episodes, and what it has of other styles.
    ///
    /// # Errors
    /// A file of this name that cannot be read.
    pub fn prelabels(&self, request: &Request) -> Result<Vec<u8>, InputError> {
        let mut changes = Changes::default();
        LabelFormat::Prelabels.storage().add(&mut changes, self, request)?;
        Ok(changes.files.remove(Path::new(prelabels::FILE)).unwrap_or_default())
    }

    /// Opens a file of the set.
    fn opened(&self, path: &Path) -> Result<File, InputError> {
        self.folders.open(path)
    }

    /// Writes a file of the copy with changed columns and compares it with the original.
    fn rewritten(
        &self,
        from: &Path,
        to: &Path,
        copy: &Path,
        columns: &[Column],
        keys: &[(&str, String)],
    ) -> Result<(), InputError> {
        let name = from.display().to_string();
        let new = File::create_new(to).map_err(|error| copy_error(copy, &error))?;
        let mut out = files::FirstErrorWriter { out: BufWriter::new(new), failed: None };
        let written = rewrite::write(self.opened(from)?, &name, columns, keys, &mut out);
        // The library's writer reports a full disk as a damaged file.
        if let Some(error) = &out.failed {
            return Err(copy_error(copy, error));
        }
        written?;
        let mut out = out.out;
        out.flush().and_then(|()| out.get_ref().sync_all()).map_err(|error| copy_error(copy, &error))?;
        drop(out);
        rewrite::compare(self.opened(from)?, file::open(to)?, &name, columns)
    }

    /// `info.json` with the features of new columns, as lerobot writes it, compared with that of the set.
    fn new_info(&self, changes: &Changes, provenance: &Value) -> Result<Vec<u8>, InputError> {
        let mut new = self.set.info.clone();
        let place = self.set.place.clone();
        let features = new.get_mut("features").and_then(Value::as_object_mut);
        let features = features.ok_or_else(|| InputError::new(&place, "the object `features` is missing"))?;
        for (name, feature) in &changes.features {
            features.insert(name.clone(), feature.clone());
        }
        if let Some(whole) = new.as_object_mut() {
            whole.insert(PROVENANCE.into(), provenance.clone());
            if let Some(tasks) = changes.tasks {
                whole.insert(gr00t::TASKS_COUNT.into(), tasks.into());
            }
        }
        let bytes = files::printed(&new, &place)?;
        if bytes.len() as u64 > MAX_INFO {
            return Err(InputError::new(
                place,
                format!("would have {} bytes, at most {MAX_INFO} are read", bytes.len()),
            ));
        }
        let mut read: Value =
            serde_json::from_slice(&bytes).map_err(|error| InputError::new(&place, error.to_string()))?;
        let mut old = self.set.info.clone();
        for info in [&mut read, &mut old] {
            if let Some(info) = info.as_object_mut() {
                info.shift_remove(PROVENANCE);
                changes.tasks.and_then(|_| info.shift_remove(gr00t::TASKS_COUNT));
            }
            let features = info.get_mut("features").and_then(Value::as_object_mut);
            features.into_iter().for_each(|features| {
                changes.features.iter().for_each(|(name, _)| {
                    features.shift_remove(name);
                });
            });
        }
        if read == old {
            Ok(bytes)
        } else {
            Err(InputError::new(place, "the copy differs from it in more than the labels"))
        }
    }
}

/// The new columns of a data file. `counts` has how many rows of each episode were in files before.
fn frame_columns<'a>(
    file: File,
    path: &Path,
    new: &'a [FrameColumn],
    counts: &mut BTreeMap<usize, usize>,
) -> Result<Vec<Column<'a>>, InputError> {
    let name = path.display().to_string();
    let memory = parquet::read(file, &name, |column| column == "episode_index")?;
    let episodes = episodes_of(memory.columns().get("episode_index"), &name)?;
    let mut places = Vec::with_capacity(episodes.len());
    for episode in episodes {
        let row = counts.entry(episode).or_default();
        places.push((episode, *row));
        *row += 1;
    }
    let column = |new: &'a FrameColumn| match new {
        FrameColumn::Language(all) => {
            let of = |(episode, _): &(usize, usize)| all.get(episode).map_or(&[][..], Vec::as_slice);
            Column { name: COLUMN.into(), values: Values::Language(places.iter().map(of).collect()) }
        }
        FrameColumn::Index(name, all, other) => {
            let of =
                |(episode, row): &(usize, usize)| all.get(episode).and_then(|rows| rows.get(*row)).unwrap_or(other);
            Column { name: name.clone(), values: Values::Integers(places.iter().map(of).copied().collect()) }
        }
        FrameColumn::Flags(name, all) => {
            let of = |(episode, row): &(usize, usize)| {
                all.get(episode).and_then(|rows| rows.get(*row).or(rows.last())).is_some_and(|flag| *flag)
            };
            Column { name: name.clone(), values: Values::Flags(places.iter().map(of).collect()) }
        }
    };
    Ok(new.iter().map(column).collect())
}

/// The new columns of a list of episodes.
fn episode_columns(file: File, path: &Path, new: &[EpisodeColumn]) -> Result<Vec<Column<'static>>, InputError> {
    let name = path.display().to_string();
    let memory = parquet::read(file, &name, |column| column == "episode_index")?;
    let episodes = episodes_of(memory.columns().get("episode_index"), &name)?;
    fn of<T: Clone>(episodes: &[usize], lists: &BTreeMap<usize, Vec<T>>) -> Vec<Option<Vec<T>>> {
        episodes.iter().map(|episode| lists.get(episode).cloned()).collect()
    }
    let column = |(name, lists): &EpisodeColumn| {
        let values = match lists {
            Lists::Texts(lists) => Values::TextLists(of(&episodes, lists)),
            Lists::Integers(lists) => Values::IntegerLists(of(&episodes, lists)),
            Lists::Numbers(lists) => Values::NumberLists(of(&episodes, lists)),
        };
        Column { name: name.clone(), values }
    };
    Ok(new.iter().map(column).collect())
}

/// The episode of each row.
fn episodes_of(column: Option<&Cells>, name: &str) -> Result<Vec<usize>, InputError> {
    let Some(Cells::Numbers(numbers)) = column else {
        return Err(InputError::new(name, "the column `episode_index` is missing"));
    };
    let whole = |number: &f64| (0.0..1e9).contains(number).then_some(number.round() as usize);
    let all = numbers.iter().map(whole).collect::<Option<_>>();
    all.ok_or_else(|| InputError::new(name, "a row has no `episode_index`, expected a whole number from 0 on"))
}

/// Reads which stamps the episodes of a file have.
fn read_stamps(file: File, name: &str, stamps: &mut BTreeMap<usize, Vec<f64>>) -> Result<(), InputError> {
    let memory = parquet::read(file, name, |column| ["episode_index", "timestamp"].contains(&column))?;
    let column = |wanted: &str| match memory.columns().get(wanted) {
        Some(Cells::Numbers(numbers)) => Ok(numbers),
        _ => Err(InputError::new(name, format!("the column `{wanted}` is missing"))),
    };
    let mut new = BTreeSet::new();
    for (episode, stamp) in column("episode_index")?.iter().zip(column("timestamp")?) {
        if !(0.0..1e9).contains(episode) {
            return Err(InputError::new(name, "a frame has no `episode_index`, expected a whole number from 0 on"));
        }
        let episode = episode.round() as usize;
        if new.insert(episode) && stamps.contains_key(&episode) {
            let message = format!("episode {episode} is in two data files, expected one");
            return Err(InputError::new(name, message));
        }
        stamps.entry(episode).or_default().push(*stamp);
    }
    Ok(())
}
