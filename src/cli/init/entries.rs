//! The entries of `teachtree.yaml` for logs that are alike: patterns of their paths, added to the text that is there.

use super::super::inputs;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_frames::propose::quoted;
use teachtree_logs::read::formats;
use teachtree_session::files::headers::{MOST_COMPARED, header, sampled};
use teachtree_session::files::is_companion;
use teachtree_session::project_file::{self, ProjectFile};

/// The logs with the columns of the first one.
pub struct Alike {
    /// Patterns of all logs of an ending in a folder.
    whole: Vec<String>,
    /// Patterns of single logs.
    single: Vec<String>,
    /// The first log, and the pattern of it alone.
    first: (PathBuf, String),
    /// Logs with other columns, or not below the folder.
    pub left_out: Vec<PathBuf>,
}

impl Alike {
    /// Compares logs with the first one. The patterns count from `folder`; logs elsewhere are known by their names, if they are meant.
    pub fn new(logs: &[PathBuf], folder: &Path, is_elsewhere: bool) -> Self {
        let files: BTreeSet<PathBuf> = logs.iter().map(|log| formats::without_episode(log)).collect();
        let first = logs.first().map(|log| formats::without_episode(log)).unwrap_or_default();
        let columns = logs.first().and_then(|log| header(log));
        let parent = |file: &Path| file.parent().unwrap_or(Path::new("")).to_path_buf();
        let below = |file: &Path| match file.strip_prefix(folder) {
            Ok(below) if !is_elsewhere => Some(below.to_path_buf()).filter(|below| is_below(below)),
            _ => is_elsewhere.then(|| file.file_name().unwrap_or_default().into()),
        };
        let named = |file: &Path| below(file).map(|below| anchored(&below, None));
        let mut groups: BTreeMap<(PathBuf, Option<String>), Vec<PathBuf>> = BTreeMap::new();
        for file in files {
            let ending = file.extension().filter(|_| file.is_file()).map(|it| it.to_string_lossy().into_owned());
            groups.entry((parent(&file), ending)).or_default().push(file);
        }
        let pattern = named(&first).unwrap_or_default();
        let mut found = Self { whole: vec![], single: vec![], first: (first, pattern), left_out: vec![] };
        for ((parent, ending), files) in groups {
            let one = files.first().and_then(|file| below(file));
            match (one, ending) {
                (Some(below), Some(ending)) if is_all_alike(&parent, &ending, columns.as_deref()) => {
                    found.whole.push(anchored(&below, Some(&ending)));
                }
                _ => found.add_each(files, columns.as_deref(), &named),
            }
        }
        // `a.csv` and `./b.csv` are in one folder.
        for patterns in [&mut found.whole, &mut found.single] {
            patterns.sort();
            patterns.dedup();
        }
        found
    }

    /// Adds the files of a folder one by one.
    fn add_each(&mut self, files: Vec<PathBuf>, columns: Option<&[String]>, named: &dyn Fn(&Path) -> Option<String>) {
        for (at, file) in files.into_iter().enumerate() {
            let has_columns = || columns.is_some() && at < MOST_COMPARED && header(&file).as_deref() == columns;
            match named(&file).filter(|pattern| *pattern == self.first.1 || has_columns()) {
                Some(pattern) => self.single.push(pattern),
                None => self.left_out.push(file),
            }
        }
    }
}

/// Whether a path leads down only.
fn is_below(path: &Path) -> bool {
    path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
}

/// The pattern of a path from the folder of the project file: of this file, or of all files of an ending beside it.
fn anchored(below: &Path, ending: Option<&str>) -> String {
    let names = below.components().filter(|part| matches!(part, Component::Normal(_)));
    let mut parts: Vec<String> = names.map(|part| project_file::escaped(&part.as_os_str().to_string_lossy())).collect();
    if let Some(ending) = ending {
        parts.pop();
        parts.push(format!("*.{}", project_file::escaped(ending)));
    }
    format!("/{}", parts.join("/"))
}

/// Whether all files of an ending in a folder have these columns.
fn is_all_alike(folder: &Path, ending: &str, columns: Option<&[String]>) -> bool {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let Ok(entries) = std::fs::read_dir(folder) else { return false };
    let is_it =
        |path: &PathBuf| path.extension().is_some_and(|it| it == ending) && path.is_file() && !is_companion(path);
    let mut beside: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(is_it).collect();
    beside.sort();
    columns.is_some() && sampled(&beside).all(|file| header(file).as_deref() == columns)
}

/// Entries that a project file lacks.
pub struct NewEntries<'a> {
    file: &'a Path,
    /// The text of the file that is there.
    old: Option<String>,
    /// Patterns that stand before others, which so count more.
    before: Vec<String>,
    /// Patterns that stand after others.
    behind: Vec<String>,
}

impl<'a> NewEntries<'a> {
    /// The entries that a file lacks for logs with this binding.
    ///
    /// # Errors
    /// A file that cannot be read, or has the entry of the log with another binding.
    pub fn new(file: &'a Path, alike: &Alike, binding: Option<&Path>) -> Result<Self, InputError> {
        let (mut before, mut behind) = (alike.whole.clone(), alike.single.clone());
        if file.symlink_metadata().is_err() {
            return Ok(Self { file, old: None, before, behind });
        }
        let (log, alone) = &alike.first;
        let old = inputs::text(file)?;
        let known = ProjectFile::parse(file, old.clone())?;
        let name = binding.and_then(Path::file_name).map(Path::new);
        if let (Some((pattern, _)), Some(name)) =
            (known.entries().find(|(known, of)| known == alone && *of != name), name)
        {
            let message = format!("the entry `{pattern}` has another binding or none");
            return Err(InputError::new(file.display().to_string(), message)
                .help(format!("write `binding: {}` there, or name another folder with `-o DIR`", name.display())));
        }
        // Patterns that fit the log already keep their binding.
        let of_log = known.settings(log).binding;
        if of_log.is_some_and(|binding| binding.value.file_name().map(Path::new) != name) {
            before.clear();
            behind.push(alone.clone());
            behind.dedup();
        }
        let is_new = |pattern: &String| known.entries().all(|(known, _)| known != pattern);
        before.retain(is_new);
        behind.retain(is_new);
        Ok(Self { file, old: Some(old), before, behind })
    }

    /// The text of the file with these keys for each new pattern; none where it has all of them.
    ///
    /// # Errors
    /// A file whose text cannot take them; the help has their lines.
    pub fn text(&self, keys: &[String]) -> Result<Option<String>, InputError> {
        const HEAD: &str = "# Written by `teachtree init`. Options override it; `teachtree config LOG` prints the settings of a log (docs/project.md).\nlogs:\n";
        let all = |indent: usize| lines(&self.before, keys, indent) + &lines(&self.behind, keys, indent);
        let Some(old) = &self.old else { return Ok(Some(format!("{HEAD}{}", all(2)))) };
        if self.before.is_empty() && self.behind.is_empty() {
            return Ok(None);
        }
        let added = self.added(old, keys).filter(|text| self.has_all(text));
        added.map(Some).ok_or_else(|| {
            let message = "entries cannot be added to a text of this form";
            let error = InputError::new(self.file.display().to_string(), message);
            error.help(format!("write these lines below `logs:`\n{}", all(2).trim_end()))
        })
    }

    /// The text with lines after `logs:` and at its end.
    fn added(&self, old: &str, keys: &[String]) -> Option<String> {
        let is_blank = |line: &str| line.trim().is_empty() || line.trim_start().starts_with('#');
        let mut at = 0;
        for line in old.split_inclusive('\n') {
            at += line.len();
            if line.strip_prefix("logs:").is_some_and(is_blank) {
                let (head, rest) = (old.get(..at)?, old.get(at..)?);
                let first = rest.lines().find(|line| !is_blank(line))?;
                let indent = first.len() - first.trim_start_matches(' ').len();
                let end = |text: &str| if text.ends_with('\n') { "" } else { "\n" };
                let before = lines(&self.before, keys, indent);
                let behind = lines(&self.behind, keys, indent);
                return Some(format!("{head}{}{before}{rest}{}{behind}", end(head), end(rest)));
            }
        }
        None
    }

    /// Whether a text has all entries.
    fn has_all(&self, text: &str) -> bool {
        let Ok(file) = ProjectFile::parse(self.file, text.into()) else { return false };
        let has = |pattern: &String| file.entries().any(|(known, _)| known == pattern);
        self.before.iter().chain(&self.behind).all(has)
    }
}

/// The lines of entries.
fn lines(patterns: &[String], keys: &[String], indent: usize) -> String {
    let space = " ".repeat(indent);
    let of_keys: String = keys.iter().map(|key| format!("{space}{space}{key}\n")).collect();
    patterns.iter().map(|pattern| format!("{space}{}:\n{of_keys}", quoted(pattern))).collect()
}
