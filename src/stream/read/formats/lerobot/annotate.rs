//! A copy of a LeRobot set of version 3.0 with labels in words: `language_persistent` in its data files, its feature in `meta/info.json`.
//!
//! The copy is made beside its place under another name, compared with the set, and then renamed: at any time it is there whole or not at all.

use super::super::parquet::language::{self, COLUMN, Episodes, Row};
use super::{MAX_INFO, Set, info};
use crate::base::error::InputError;
use crate::stream::atomic_write::Folder;
use crate::stream::read::formats::parquet;
use crate::stream::read::sheet::Cells;
use crate::stream::read::text;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{BufWriter, Read, Write as _};
use std::path::{Path, PathBuf};

/// Who gives the labels.
const ROLE: &str = "assistant";
/// The key of what is provenance_json about the labels in `info.json`, and in the metadata of data files.
const PROVENANCE: &str = "teachtree";
/// How deep the folders of a set may be nested, and how many files it may have.
const DEEPEST: usize = 16;
const MAX_FILES: usize = 1 << 20;

/// A label: words that hold from a row of an episode on, until the next label of its style.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// The style that LeRobot knows it by: `motion`, `subtask`.
    pub style: &'static str,
    /// The row of the episode, counted from 0.
    pub row: usize,
    /// The words.
    pub content: String,
}

/// A set that labels can be written into.
pub struct Annotated {
    folder: PathBuf,
    set: Set,
    /// The data files, in order.
    files: Vec<PathBuf>,
    /// The stamps of each episode, s.
    stamps: BTreeMap<usize, Vec<f32>>,
    /// The rows of language that are there already.
    known: Episodes,
}

impl Annotated {
    /// Opens a set, and reads its stamps and the language that it has.
    ///
    /// # Errors
    /// When it is no set of version 3.0, is damaged, or a data file has no stamps.
    pub fn open(folder: &Path) -> Result<Self, InputError> {
        let set = Set::read(folder)?;
        let version = set.text("codebase_version")?;
        if !version.starts_with("v3.") {
            let message =
                format!("found a data set of version `{version}`, expected v3.0, the first with language columns");
            return Err(set.wrong(message).help("lerobot's `convert_dataset_v21_to_v30` makes one of it"));
        }
        let mut files: Vec<PathBuf> = vec![];
        for place in set.all_listed()?.into_values() {
            let (chunk, file) = place?;
            let path = set.path(set.text("data_path")?, &[("chunk_index", chunk), ("file_index", file)])?;
            if !files.contains(&path) {
                files.push(path);
            }
        }
        files.sort();
        let (mut stamps, mut known) = (BTreeMap::<usize, Vec<f32>>::new(), Episodes::new());
        for path in &files {
            let name = path.display().to_string();
            read_stamps(path, &name, &mut stamps)?;
            known.extend(language::read(opened(path)?, &name)?.unwrap_or_default());
        }
        Ok(Self { folder: folder.to_path_buf(), set, files, stamps, known })
    }

    /// Refuses labels where there are some of their styles.
    ///
    /// # Errors
    /// When there are, at the first episode that has some.
    pub fn refuse_labeled(&self, styles: &[&str]) -> Result<(), InputError> {
        let ours = |row: &&Row| is_ours(row, styles);
        match self.known.iter().find_map(|(episode, rows)| Some((episode, rows.iter().find(ours)?))) {
            None => Ok(()),
            Some((episode, row)) => {
                let style = row.style.as_deref().unwrap_or_default();
                let message = format!("episode {episode} has labels of style `{style}` already");
                let place = self.folder.display().to_string();
                Err(InputError::new(place, message)
                    .help("--replace leaves them out of the copy; --style chooses others"))
            }
        }
    }

    /// Writes a copy of the set with labels of these styles by episode; those of these styles that were there are left out. `provenance` says what
    /// the labels were made by. `progress` is called with a part of the whole, 0 to 1.
    ///
    /// # Errors
    /// When something is at the place of the copy, the copy cannot be written, or differs from the set in more than the labels.
    pub fn write(
        &self,
        copy: &Path,
        labels: &BTreeMap<usize, Vec<Label>>,
        styles: &[&str],
        provenance: &Value,
        progress: &mut dyn FnMut(f64),
    ) -> Result<(), InputError> {
        let mut all = Episodes::new();
        for (episode, stamps) in &self.stamps {
            let known = self.known.get(episode).into_iter().flatten().filter(|row| !is_ours(row, styles)).cloned();
            let mut rows: Vec<Row> = known.collect();
            rows.extend(new_rows(labels.get(episode).map_or(&[], Vec::as_slice), stamps));
            let key = |row: &Row| (row.style.clone(), row.role.clone());
            rows.sort_by(|a, b| a.timestamp.total_cmp(&b.timestamp).then_with(|| key(a).cmp(&key(b))));
            all.insert(*episode, rows);
        }
        let folder = Folder::new(copy)?;
        let mut others = vec![];
        files_in(&self.folder, Path::new(""), 0, &mut others)?;
        let described = info(Path::new(""));
        let total = others.len().max(1) as f64;
        for (at, file) in others.iter().enumerate() {
            let (from, to) = (self.folder.join(file), folder.path().join(file));
            if let Some(parent) = to.parent() {
                std::fs::create_dir_all(parent).map_err(|error| cannot(copy, &error))?;
            }
            if self.files.contains(&from) {
                self.write_data(&from, &to, copy, &all, provenance)?;
            } else if *file == described {
                self.write_info(&to, copy, provenance)?;
            } else {
                copy_file(&from, &to, copy)?;
            }
            progress((at + 1) as f64 / total);
        }
        folder.commit()
    }

    fn write_data(
        &self,
        from: &Path,
        to: &Path,
        copy: &Path,
        all: &Episodes,
        provenance_json: &Value,
    ) -> Result<(), InputError> {
        let name = from.display().to_string();
        let file = File::create_new(to).map_err(|error| cannot(copy, &error))?;
        let mut out = BufWriter::new(file);
        language::write(opened(from)?, &name, all, &[(PROVENANCE, provenance_json.to_string())], &mut out)?;
        out.flush().and_then(|()| out.get_ref().sync_all()).map_err(|error| cannot(copy, &error))?;
        drop(out);
        language::compare(opened(from)?, opened(to)?, &name, all)
    }

    /// Writes `info.json` with the feature of the column, and compares it with that of the set.
    fn write_info(&self, to: &Path, copy: &Path, provenance: &Value) -> Result<(), InputError> {
        let mut new = self.set.info.clone();
        let place = self.set.place.clone();
        let features = new.get_mut("features").and_then(Value::as_object_mut);
        let features = features.ok_or_else(|| InputError::new(&place, "the object `features` is not there"))?;
        features.insert(COLUMN.into(), json!({ "dtype": "language", "shape": [1], "names": null }));
        if let Some(whole) = new.as_object_mut() {
            whole.insert(PROVENANCE.into(), provenance.clone());
        }
        // As lerobot writes it.
        let mut bytes = vec![];
        let form = serde_json::ser::PrettyFormatter::with_indent(b"    ");
        let mut out = serde_json::Serializer::with_formatter(&mut bytes, form);
        serde::Serialize::serialize(&new, &mut out).map_err(|error| InputError::new(&place, error.to_string()))?;
        let mut file = File::create_new(to).map_err(|error| cannot(copy, &error))?;
        file.write_all(&bytes).and_then(|()| file.sync_all()).map_err(|error| cannot(copy, &error))?;
        let mut read: Value = serde_json::from_str(&text::read(to, MAX_INFO + bytes.len() as u64)?)
            .map_err(|error| InputError::new(&place, error.to_string()))?;
        let mut old = self.set.info.clone();
        for info in [&mut read, &mut old] {
            info.as_object_mut().and_then(|info| info.shift_remove(PROVENANCE));
            info.get_mut("features").and_then(Value::as_object_mut).and_then(|features| features.shift_remove(COLUMN));
        }
        if read == old {
            Ok(())
        } else {
            Err(InputError::new(place, "the copy differs from it in more than the labels"))
        }
    }
}

fn is_ours(row: &Row, styles: &[&str]) -> bool {
    row.role == ROLE && row.style.as_deref().is_some_and(|style| styles.contains(&style))
}

/// Labels as rows of language. Of two labels of a style that begin with the same frame the later one holds, as no frame has the other one.
fn new_rows(labels: &[Label], stamps: &[f32]) -> Vec<Row> {
    let mut rows: BTreeMap<(&str, usize), Row> = BTreeMap::new();
    for Label { style, row, content } in labels {
        let Some(timestamp) = stamps.get(*row).copied() else { continue };
        let (content, style_name) = (Some(content.clone()), Some((*style).to_string()));
        let new = Row { role: ROLE.into(), content, style: style_name, timestamp, camera: None, tool_calls: None };
        rows.insert((*style, *row), new);
    }
    rows.into_values().collect()
}

/// Reads which stamps the episodes of a file have.
fn read_stamps(path: &Path, name: &str, stamps: &mut BTreeMap<usize, Vec<f32>>) -> Result<(), InputError> {
    let memory = parquet::read(opened(path)?, name, |column| ["episode_index", "timestamp"].contains(&column))?;
    let column = |wanted: &str| match memory.columns().get(wanted) {
        Some(Cells::Numbers(numbers)) => Ok(numbers),
        _ => Err(InputError::new(name, format!("the column `{wanted}` is not there"))),
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
        // They are stored so; other readers of the set see these.
        stamps.entry(episode).or_default().push(*stamp as f32);
    }
    Ok(())
}

fn opened(path: &Path) -> Result<File, InputError> {
    File::open(path).map_err(|error| InputError::unreadable(path.display().to_string(), &error))
}

fn cannot(copy: &Path, error: &std::io::Error) -> InputError {
    InputError::new(copy.display().to_string(), format!("cannot be written: {error}"))
}

/// The files of a folder and its subfolders, by path. Links are followed, as those of a cache.
fn files_in(root: &Path, below: &Path, depth: usize, found: &mut Vec<PathBuf>) -> Result<(), InputError> {
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
        if root.join(&file).is_dir() {
            files_in(root, &file, depth + 1, found)?;
        } else {
            found.push(file);
        }
    }
    Ok(())
}

/// Copies a file and compares the copy with it.
fn copy_file(from: &Path, to: &Path, copy: &Path) -> Result<(), InputError> {
    std::fs::copy(from, to).map_err(|error| cannot(copy, &error))?;
    let (mut one, mut other) = (opened(from)?, opened(to)?);
    other.sync_all().map_err(|error| cannot(copy, &error))?;
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
