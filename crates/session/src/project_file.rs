//! `teachtree.yaml`: how the logs of a folder are read and analyzed, so that commands need no options for them. The nearest file above a log counts,
//! else the nearest one above the folder in which the program runs.

mod entry_checks;
mod patterns;

use super::error::Error;
use crate::ErrorInternals;
use indexmap::IndexMap;
use patterns::LogPattern;
use serde::Deserialize;
use std::path::{Component, Path, PathBuf};
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_base::yaml;
use teachtree_frames::bind::{Param, few_params};
use teachtree_language::shipped;
use teachtree_logs::read::{formats, text};

pub use patterns::escaped;
pub use teachtree_base::file_kind::PROJECT as NAME;

/// The most entries of a file.
const MAX_ENTRIES: usize = 256;

/// A project file: the settings of the logs in a folder.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct Project {
    /// The settings of logs, by a pattern of their paths from this file, such as `*.csv` or `jams/**`. A pattern without `/` is compared with the names
    /// of logs in all folders, one that begins with `/` with paths from this file only. Of several entries that fit a log, each key counts in the last
    /// one that has it.
    logs: IndexMap<String, Entry>,
}

/// The settings of some logs. Paths are relative to the folder of this file.
#[derive(Clone, Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct Entry {
    /// The binding, as `--binding`.
    binding: Option<PathBuf>,
    /// Scene file; replaces the scene of each log, as `--scene`.
    scene: Option<PathBuf>,
    /// Rule files, as `--rules`.
    #[serde(default)]
    rules: Vec<PathBuf>,
    /// The hand model, as `--hand`: the name of a shipped one, or a path.
    hand_file: Option<String>,
    /// Values of params, as `--set`.
    #[serde(default, deserialize_with = "few_params")]
    #[schemars(with = "IndexMap<String, Param>")]
    params: IndexMap<String, String>,
    /// The tasks that each recording should contain, as `--expect`.
    expect: Option<String>,
    /// A file of labels or a folder with one for each log, as `--labels`.
    labels: Option<PathBuf>,
}

/// Whether a project file stands above a log rather than above the folder in which the program runs.
pub fn is_above(file: &Path, log: &Path) -> bool {
    let folder = absolute(file.parent().unwrap_or(Path::new("")));
    absolute(&formats::without_episode(log)).starts_with(folder)
}

/// The schema of the file.
pub fn schema() -> schemars::Schema {
    schemars::schema_for!(Project)
}

/// A setting, and where it stands: `teachtree.yaml:3:14`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting<T> {
    /// The value; paths are those that the program opens.
    pub value: T,
    /// The place.
    pub place: String,
}

/// The settings of a log.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ProjectSettings {
    /// The file, if there is one.
    pub file: Option<PathBuf>,
    /// Whether an entry of it fits the log.
    pub has_entry: bool,
    /// The binding.
    pub binding: Option<Setting<PathBuf>>,
    /// The scene.
    pub scene: Option<Setting<PathBuf>>,
    /// The rule files.
    pub rules: Option<Setting<Vec<PathBuf>>>,
    /// The hand model.
    pub hand_file: Option<Setting<String>>,
    /// The values of params.
    pub params: IndexMap<String, Setting<String>>,
    /// The expected tasks.
    pub expect: Option<Setting<String>>,
    /// The labels.
    pub labels: Option<Setting<PathBuf>>,
}

/// A file that was read.
#[derive(Debug)]
pub struct ProjectFile {
    path: PathBuf,
    text: String,
    /// The entries with the patterns of their logs.
    entries: Vec<(LogPattern, Entry)>,
}

impl ProjectSettings {
    /// The settings of a log: none without a file.
    ///
    /// # Errors
    /// The nearest file cannot be read, at `file:line:column`.
    pub fn of(log: &Path) -> Result<Self, InputError> {
        Ok(ProjectFile::above(log)?.map_or_else(Self::default, |file| file.settings(log)))
    }

    /// The settings of a log, as [`of`](Self::of), for other programs.
    ///
    /// # Errors
    /// [`ErrorKind::Format`]: the nearest file cannot be read, at `file:line:column`.
    pub fn of_log(log: &Path) -> Result<Self, Error> {
        Self::of(log).map_err(|error| Error::new(error, ErrorKind::Format))
    }

    /// The settings of a folder, as [`of`](Self::of), that entries name: `*` alone and `**` at the end stand for logs in it.
    ///
    /// # Errors
    /// As [`of`](Self::of).
    pub fn naming(folder: &Path) -> Result<Self, InputError> {
        let of_file = |file: ProjectFile| file.settings_by(folder, &LogPattern::names_folders);
        Ok(ProjectFile::above(folder)?.map_or_else(Self::default, of_file))
    }

    /// The settings beside a binding of another origin: what was chosen for the binding of the file is left out.
    #[must_use]
    pub fn without_binding(self) -> Self {
        Self { binding: None, scene: None, hand_file: None, params: IndexMap::new(), ..self }
    }

    /// The files that the settings name, and the file itself.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        let single = [&self.binding, &self.scene, &self.labels].into_iter().flatten().map(|setting| &setting.value);
        let rules = self.rules.iter().flat_map(|setting| &setting.value);
        let hand_file = self.hand_file.iter().map(|setting| Path::new(&setting.value));
        self.file.iter().chain(single).chain(rules).map(PathBuf::as_path).chain(hand_file)
    }
}

impl ProjectFile {
    /// Reads the file that counts for a log.
    ///
    /// # Errors
    /// It cannot be read, at `file:line:column`.
    pub fn above(log: &Path) -> Result<Option<Self>, InputError> {
        let log = absolute(&formats::without_episode(log));
        let here = absolute(Path::new(""));
        // A folder that is a log may contain the file.
        let found = log.ancestors().chain(here.ancestors()).map(|folder| folder.join(NAME)).find(|file| file.is_file());
        found.map(|file| Self::read(&shown(&file, &here))).transpose()
    }

    /// Reads a file.
    ///
    /// # Errors
    /// The first thing that is wrong, at `file:line:column`.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let text = text::read(path, yaml::MAX_BYTES as u64)?;
        Self::parse(path, text)
    }

    /// Reads the text of a file.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(path: &Path, text: String) -> Result<Self, InputError> {
        let name = path.display().to_string();
        let in_format = |error: InputError| InputError { kind: Some(ErrorKind::Format), ..error };
        let Project { logs } = yaml::read(&text, &name).map_err(in_format)?;
        if logs.len() > MAX_ENTRIES {
            let message = format!("found {} entries, at most {MAX_ENTRIES} are read", logs.len());
            return Err(in_format(InputError::new(yaml::place(&text, &name, &["logs"]), message)));
        }
        let mut entries = Vec::with_capacity(logs.len());
        for (pattern, entry) in logs {
            let folder = path.parent().unwrap_or(Path::new(""));
            let read = LogPattern::read(&pattern, folder).map_err(|error| {
                in_format(InputError { place: yaml::place(&text, &name, &["logs", &pattern]), ..error })
            })?;
            entries.push((read, entry));
        }
        Ok(Self { path: path.to_path_buf(), text, entries })
    }

    /// The patterns with the bindings of their entries.
    pub fn entries(&self) -> impl Iterator<Item = (&str, Option<&Path>)> {
        self.entries.iter().map(|(pattern, entry)| (pattern.text.as_str(), entry.binding.as_deref()))
    }

    /// Checks that the files of all entries exist, and that their expected tasks are tasks of rules.
    ///
    /// # Errors
    /// The first one that is not, at `file:line:column`.
    pub fn check(&self) -> Result<(), InputError> {
        entry_checks::check(self)
    }

    /// The path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// The place of a key of an entry.
    fn place(&self, pattern: &LogPattern, keys: &[&str]) -> String {
        let mut all = vec!["logs", pattern.text.as_str()];
        all.extend(keys);
        yaml::place(&self.text, &self.path.display().to_string(), &all)
    }

    /// A rule file or a hand model: one of the folder of this file, else a shipped one. It is never looked up in the folder in which the program runs.
    fn rule_file(&self, name: &Path) -> PathBuf {
        let own = self.folder().join(name);
        let of_program = name.to_str().and_then(shipped).filter(|_| !own.is_file());
        of_program.map_or(own, |(name, _)| name.into())
    }

    /// The settings of a log.
    pub fn settings(&self, log: &Path) -> ProjectSettings {
        self.settings_by(log, &|_| true)
    }

    /// The settings of a log by entries whose patterns count.
    fn settings_by(&self, log: &Path, counts: &dyn Fn(&LogPattern) -> bool) -> ProjectSettings {
        let folder = self.folder();
        let log = absolute(&formats::without_episode(log));
        let below = log.strip_prefix(absolute(folder)).ok().filter(|below| !below.as_os_str().is_empty());
        let below = below.unwrap_or(Path::new(log.file_name().unwrap_or_default()));
        let mut settings = ProjectSettings { file: Some(self.path.clone()), ..ProjectSettings::default() };
        for (pattern, entry) in self.entries.iter().filter(|(pattern, _)| counts(pattern) && pattern.fits(below)) {
            self.add(pattern, entry, &mut settings);
        }
        settings
    }

    /// The pattern, its place and the settings of each entry alone.
    pub fn settings_of_entries(&self) -> impl Iterator<Item = (&str, String, ProjectSettings)> {
        self.entries.iter().map(|(pattern, entry)| {
            let mut settings = ProjectSettings::default();
            self.add(pattern, entry, &mut settings);
            (pattern.text.as_str(), self.place(pattern, &[]), settings)
        })
    }

    /// Adds the settings of an entry, which replace earlier ones.
    fn add(&self, pattern: &LogPattern, entry: &Entry, settings: &mut ProjectSettings) {
        settings.has_entry = true;
        let place = |key: &str| self.place(pattern, &[key]);
        let path = |path: &Option<PathBuf>, key: &str| {
            path.as_ref().map(|path| Setting { value: self.folder().join(path), place: place(key) })
        };
        settings.binding = path(&entry.binding, "binding").or(settings.binding.take());
        settings.scene = path(&entry.scene, "scene").or(settings.scene.take());
        settings.labels = path(&entry.labels, "labels").or(settings.labels.take());
        if !entry.rules.is_empty() {
            let value = entry.rules.iter().map(|rules| self.rule_file(rules)).collect();
            settings.rules = Some(Setting { value, place: place("rules") });
        }
        if let Some(hand_file) = &entry.hand_file {
            let value = self.rule_file(Path::new(hand_file)).display().to_string();
            settings.hand_file = Some(Setting { value, place: place("hand_file") });
        }
        if let Some(expect) = &entry.expect {
            settings.expect = Some(Setting { value: expect.clone(), place: place("expect") });
        }
        for (param, value) in &entry.params {
            let place = self.place(pattern, &["params", param]);
            settings.params.insert(param.clone(), Setting { value: value.clone(), place });
        }
    }
}

/// A path from the root, without `.` and `..`.
fn absolute(path: &Path) -> PathBuf {
    // An empty path is the folder in which the program runs.
    let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => drop(plain.pop()),
            Component::CurDir => {}
            part => plain.push(part),
        }
    }
    plain
}

/// A path as messages show it: from the folder in which the program runs where it is in there.
fn shown(path: &Path, here: &Path) -> PathBuf {
    path.strip_prefix(here).map_or_else(|_| path.to_path_buf(), Path::to_path_buf)
}
