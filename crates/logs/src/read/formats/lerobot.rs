//! LeRobot data sets, versions 2.0 to 3.0: a folder with `meta/info.json`, of which one episode is a log.
//!
//! Version 2 has a file an episode; in version 3 a file holds many, and `meta/episodes` says which. Columns are called by the names that
//! the set gives them (`observation.state.gripper.pos`), by place where it gives none (`observation.state[5]`); `timestamp` is `time [s]`.

pub mod annotate;
pub mod episode_facts;
pub mod new_set;
pub mod video;

use super::parquet;
use super::recordings::MAX_RECORDINGS;
use crate::allowed_folders::AllowedFolders;
use crate::names;
use crate::read::memory_table::{Cells, InMemoryTable};
use crate::read::table::Source;
use crate::read::text;
use serde_json::Value;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Component, Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_base::json;

/// The largest `info.json` that is read, in bytes.
const MAX_INFO: u64 = 16 << 20;
/// The most files with lists of episodes that are looked through.
const MAX_LISTS: usize = 10_000;

/// The file with the description of a data set.
fn info(folder: &Path) -> PathBuf {
    folder.join("meta").join("info.json")
}

/// Opens an episode of a data set whose files must be in `folders`.
///
/// # Errors
/// The set is invalid, a file is outside of the folders, or no episode is chosen.
pub fn open(folder: &Path, episode: Option<&str>, folders: &AllowedFolders) -> Result<Source, InputError> {
    let set = Dataset::read(folder, folders)?;
    let episode = set.meant(episode)?;
    let path = set.data_file(episode)?;
    let name = path.display().to_string();
    let bytes = || folders.open(&path);
    // A file may have hundreds of episodes: only the rows of this one are read.
    let numbers = parquet::read(bytes()?, &name, |column| column == "episode_index")?;
    let rows = rows_of(&numbers, episode, &name)?;
    let read = match rows {
        Some(rows) => parquet::read_rows(bytes()?, &name, rows)?,
        None => parquet::read(bytes()?, &name, |_| true)?,
    };
    let mut memory = InMemoryTable::new(format!("{name} episode {episode}"));
    for (title, cells) in read.header().iter().zip(read.columns().values()) {
        memory.push_column(set.title(title), cells.clone());
    }
    let successes = read.columns().get(annotate::success::COLUMN).and_then(Cells::numbers);
    let is_success = |values: &[f64]| values.iter().any(|value| *value > 0.5);
    let success_fields = successes.map(|values| (annotate::success::COLUMN, is_success(values)));
    let source = Source::one(format!("{} episode {episode}", folder.display()), memory.header(), Box::new(memory));
    let lerobot_version = Some(set.text("codebase_version")?.to_string());
    Ok(Source { success_fields: success_fields.into_iter().collect(), lerobot_version, ..source })
}

/// The files that an episode is read from.
///
/// # Errors
/// As [`open`].
pub(super) fn files(folder: &Path, episode: Option<&str>) -> Result<Vec<PathBuf>, InputError> {
    let folders = AllowedFolders::default();
    let set = Dataset::read(folder, &folders)?;
    let lists = folder.join("meta").join("episodes");
    let mut files = if lists.is_dir() { lists_in(&lists, &folders)? } else { vec![] };
    files.extend([info(folder), set.data_file(set.meant(episode)?)?]);
    Ok(files)
}

/// Returns the number of episodes of a data set.
///
/// # Errors
/// When the set is not as it should be.
pub(super) fn count(folder: &Path, folders: &AllowedFolders) -> Result<usize, InputError> {
    let set = Dataset::read(folder, folders)?;
    let count = set.count("total_episodes")?;
    match count {
        0 => Err(set.wrong("the data set has no episode, expected at least one")),
        count if count <= MAX_RECORDINGS => set.nothing_beyond(count).map(|()| count),
        count => Err(set.wrong(format!("found {count} episodes, at most {MAX_RECORDINGS} are read"))),
    }
}

/// The chunk and the file of an episode, or why they are not known.
type EpisodeFile = Result<(usize, usize), InputError>;

/// A data set as it describes itself.
struct Dataset {
    folder: PathBuf,
    /// The folders that its files must be in.
    folders: AllowedFolders,
    place: String,
    info: Value,
}

impl Dataset {
    fn read(folder: &Path, folders: &AllowedFolders) -> Result<Self, InputError> {
        let path = info(folder);
        let place = path.display().to_string();
        let text = text::whole(&folders.open(&path)?, &path, MAX_INFO)?;
        let info: Value = json::read(&text, &place)?;
        let set = Self { folder: folder.to_path_buf(), folders: folders.clone(), place, info };
        let version = set.text("codebase_version")?;
        if !matches!(version.split('.').next(), Some("v2" | "v3")) {
            return Err(set.wrong(format!("found a data set of version `{version}`, expected v2.0, v2.1 or v3.0")));
        }
        Ok(set)
    }

    fn wrong(&self, message: impl Into<String>) -> InputError {
        InputError::new(&self.place, message)
    }

    fn text(&self, key: &str) -> Result<&str, InputError> {
        self.info.get(key).and_then(Value::as_str).ok_or_else(|| self.wrong(format!("the text `{key}` is missing")))
    }

    fn count(&self, key: &str) -> Result<usize, InputError> {
        let number = self.info.get(key).and_then(Value::as_u64).and_then(|number| usize::try_from(number).ok());
        number.ok_or_else(|| self.wrong(format!("the number `{key}` is missing")))
    }

    /// The episode that a text after `#` names.
    fn meant(&self, text: Option<&str>) -> Result<usize, InputError> {
        let number = |text: &str| {
            let message = format!("found `#{text}`, expected the number of an episode");
            text.parse::<usize>().map_err(|_| InputError::new(self.folder.display().to_string(), message))
        };
        self.choose(text.map(number).transpose()?)
    }

    /// The episode of this number, or the only one.
    fn choose(&self, asked: Option<usize>) -> Result<usize, InputError> {
        let episodes = self.count("total_episodes")?;
        let folder = self.folder.display();
        match asked {
            Some(episode) if episode < episodes => Ok(episode),
            Some(episode) => {
                let message = format!("found {episodes} episodes, counted from 0; there is no episode {episode}");
                Err(InputError::new(folder.to_string(), message))
            }
            None if episodes == 1 => Ok(0),
            None => {
                Err(InputError::new(folder.to_string(), format!("the data set has {episodes} episodes, one is a log"))
                    .help(format!("choose one after `#`, such as `{folder}#0`, or all with `{folder}#*`")))
            }
        }
    }

    /// Refuses a set that has more episodes than it says, such as one whose recording was cut off.
    fn nothing_beyond(&self, count: usize) -> Result<(), InputError> {
        let more = if self.text("codebase_version")?.starts_with("v2") {
            self.data_file(count)?.is_file().then_some(count)
        } else {
            self.all_listed()?.keys().next_back().copied().filter(|last| *last >= count)
        };
        let Some(last) = more else { return Ok(()) };
        let message = format!("`total_episodes` is {count}, but there is an episode {last}, counted from 0");
        Err(self.wrong(message).help(format!("`\"total_episodes\": {}` takes all, where they are whole", last + 1)))
    }

    /// The file in which an episode is.
    fn data_file(&self, episode: usize) -> Result<PathBuf, InputError> {
        let template = self.text("data_path")?;
        if self.text("codebase_version")?.starts_with("v2") {
            let chunk = episode / self.count("chunks_size")?.max(1);
            return self.path(template, &[("episode_chunk", chunk), ("episode_index", episode)]);
        }
        let (chunk, file) = self.listed(episode)?;
        self.path(template, &[("chunk_index", chunk), ("file_index", file)])
    }

    /// Which chunk and file the lists of a set of version 3 say for an episode.
    fn listed(&self, episode: usize) -> Result<(usize, usize), InputError> {
        self.all_listed()?.remove(&episode).unwrap_or_else(|| {
            let lists = self.folder.join("meta").join("episodes");
            Err(InputError::new(lists.display().to_string(), format!("no list names episode {episode}")))
        })
    }

    /// Which chunk and file the lists of a set of version 3 say for each episode.
    fn all_listed(&self) -> Result<BTreeMap<usize, EpisodeFile>, InputError> {
        let wanted = ["episode_index", "data/chunk_index", "data/file_index"];
        let mut all = BTreeMap::new();
        for path in lists_in(&self.folder.join("meta").join("episodes"), &self.folders)? {
            let name = path.display().to_string();
            let list = parquet::read(self.folders.open(&path)?, &name, |column| wanted.contains(&column))?;
            let mut columns = vec![];
            for column in wanted {
                match list.columns().get(column) {
                    Some(Cells::Numbers(values)) => columns.push(values),
                    _ => return Err(InputError::new(name, format!("the column `{column}` is missing"))),
                }
            }
            let [episodes, chunks, files] = columns.as_slice() else { continue };
            let whole = |value: &f64| (0.0..1e9).contains(value).then_some(*value as usize);
            for ((episode, chunk), file) in episodes.iter().zip(*chunks).zip(*files) {
                let Some(episode) = whole(episode) else { continue };
                let unsaid = || InputError::new(&name, format!("it does not say in which file episode {episode} is"));
                all.entry(episode).or_insert_with(|| whole(chunk).zip(whole(file)).ok_or_else(unsaid));
            }
        }
        Ok(all)
    }

    /// A path of the set: `{name}` and `{name:03d}` stand for numbers.
    fn path(&self, template: &str, numbers: &[(&str, usize)]) -> Result<PathBuf, InputError> {
        let wrong = || self.wrong(format!("`{template}` cannot be filled in as a path"));
        let mut path = String::new();
        let mut rest = template;
        while let Some((head, tail)) = rest.split_once('{') {
            let (field, after) = tail.split_once('}').ok_or_else(wrong)?;
            let (name, form) = field.split_once(':').unwrap_or((field, "d"));
            let number =
                numbers.iter().find(|(known, _)| *known == name).map(|(_, number)| *number).ok_or_else(wrong)?;
            let width: usize = match form.trim_end_matches('d') {
                "" => 0,
                digits => digits.parse().ok().filter(|width| *width <= 20).ok_or_else(wrong)?,
            };
            path.push_str(head);
            path.push_str(&format!("{number:0width$}"));
            rest = after;
        }
        path.push_str(rest);
        let path = PathBuf::from(path);
        if !path.components().all(|part| matches!(part, Component::Normal(_))) {
            return Err(self.wrong(format!("`{template}` leads out of the data set")));
        }
        Ok(self.folder.join(path))
    }

    /// The name of a column.
    fn title(&self, column: &str) -> String {
        if column == "timestamp" {
            return "time [s]".into();
        }
        // The time comes from the set's stamps; a column named `time` is a different quantity.
        if names::split_known_unit(column).0 == "time" {
            return format!("table.{column}");
        }
        let named = || {
            let (feature, place) = column.strip_suffix(']')?.rsplit_once('[')?;
            let place: usize = place.parse().ok()?;
            let mut names = vec![];
            texts(self.info.get("features")?.get(feature)?.get("names")?, &mut names, 0);
            let name = names.get(place)?;
            // A name that stands twice says nothing.
            (names.iter().filter(|other| other == &name).count() == 1).then(|| format!("{feature}.{name}"))
        };
        named().unwrap_or_else(|| column.to_string())
    }
}

/// The texts in lists, nested or under keys, in order. Keys of numbers are the texts, in the order of the numbers.
fn texts(value: &Value, found: &mut Vec<String>, depth: usize) {
    const DEEPEST: usize = 4;
    match value {
        Value::String(text) => found.push(text.clone()),
        Value::Array(items) if depth < DEEPEST => items.iter().for_each(|item| texts(item, found, depth + 1)),
        Value::Object(items) if !items.is_empty() && items.values().all(Value::is_u64) => {
            let mut places: Vec<(Option<u64>, &String)> = items.iter().map(|(name, at)| (at.as_u64(), name)).collect();
            places.sort_unstable();
            found.extend(places.into_iter().map(|(_, name)| name.clone()));
        }
        Value::Object(items) if depth < DEEPEST => items.values().for_each(|item| texts(item, found, depth + 1)),
        _ => {}
    }
}

/// The rows that are of an episode; `None` for a file that does not say.
fn rows_of(memory: &InMemoryTable, episode: usize, name: &str) -> Result<Option<Range<usize>>, InputError> {
    let Some(Cells::Numbers(episodes)) = memory.columns().get("episode_index") else { return Ok(None) };
    let first = episodes.iter().position(|at| is(*at, episode));
    let last = episodes.iter().rposition(|at| is(*at, episode));
    let (Some(first), Some(last)) = (first, last) else {
        return Err(InputError::new(name, format!("no row is of episode {episode}")));
    };
    if !episodes.iter().skip(first).take(last - first).all(|at| is(*at, episode)) {
        let message = format!("the rows of episode {episode} are not one after the other");
        return Err(InputError::new(name, message));
    }
    Ok(Some(first..last + 1))
}

/// Whether a number is this episode; indices are far below where a float rounds.
fn is(number: f64, episode: usize) -> bool {
    (number - episode as f64).abs() < 0.5
}

/// The files with lists of episodes, in order.
fn lists_in(folder: &Path, folders: &AllowedFolders) -> Result<Vec<PathBuf>, InputError> {
    let mut files = vec![];
    for chunk in folders.list(folder)? {
        let chunk = chunk?;
        if !chunk.is_dir() {
            continue;
        }
        for file in folders.list(&chunk)? {
            let file = file?;
            if file.extension().is_some_and(|ending| ending == "parquet") && files.len() < MAX_LISTS {
                files.push(file);
            }
        }
    }
    files.sort();
    Ok(files)
}
