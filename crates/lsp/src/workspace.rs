//! The open files and their diagnostics. An open file that another open file uses is compiled with that one; all
//! others are compiled alone, each with the files that it uses. Unsaved text replaces the text on disk.

use super::library::Library;
use super::lines::Lines;
use super::uri;
use lsp_types::{Location, Position, Range, Uri};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use teachtree_base::diagnostic::Span;
use teachtree_language::{self as language, CheckedSource, Request};

/// Files of a folder that a search looks at.
const MAX_FILES: usize = 500;

/// An open file.
#[derive(Clone, Debug)]
pub struct Document {
    /// As its editor calls it.
    pub uri: Uri,
    /// As its editor counts.
    pub version: i32,
    /// Its text.
    pub text: String,
}

/// A rule file and all files that it uses, compiled together.
#[derive(Debug)]
pub struct RuleSet {
    /// The file that was asked for.
    pub root: PathBuf,
    /// What is known.
    pub survey: CheckedSource,
    /// Where each source lies; a file that comes with the program in the cache, or nowhere.
    pub paths: Vec<Option<PathBuf>>,
    /// The lines of each source.
    pub lines: Vec<Lines>,
}

/// A place in a rule set.
#[derive(Clone, Debug)]
pub struct Spot {
    /// The rule set.
    pub rule_set: Rc<RuleSet>,
    /// The file.
    pub file: u32,
    /// The byte.
    pub offset: u32,
}

/// All that is open.
#[derive(Debug, Default)]
pub struct Workspace {
    /// The open files, by path.
    pub open: BTreeMap<PathBuf, Document>,
    /// The open files that are not rules, by path.
    pub others: BTreeMap<PathBuf, Document>,
    /// The folders that the editor shows.
    pub folders: Vec<PathBuf>,
    /// What comes with the program.
    pub library: Library,
    /// The hand model and params with which rules are loaded.
    pub hand_file: Option<String>,
    /// Params that are overridden.
    pub overrides: Vec<(String, String)>,
    /// The rule sets compiled since the last change.
    rule_sets: Option<Vec<Rc<RuleSet>>>,
}

impl RuleSet {
    /// The text of a file.
    pub fn text(&self, file: u32) -> &str {
        self.survey.sources.files.get(file as usize).map_or("", |source| source.text.as_str())
    }

    /// The file at a path.
    pub fn file(&self, path: &Path) -> Option<u32> {
        let at = self.paths.iter().position(|known| known.as_deref() == Some(path))?;
        u32::try_from(at).ok()
    }

    /// Where a file lies.
    pub fn path(&self, file: u32) -> Option<&Path> {
        self.paths.get(file as usize)?.as_deref()
    }

    /// The range of a span in its file.
    pub fn range(&self, span: Span) -> Range {
        self.lines.get(span.file as usize).map_or(Range::default(), |lines| lines.range(self.text(span.file), span))
    }

    /// The byte at a position of a file.
    pub fn offset(&self, file: u32, position: Position) -> u32 {
        let lines = self.lines.get(file as usize);
        let offset = lines.map_or(0, |lines| lines.offset(self.text(file), position));
        u32::try_from(offset).unwrap_or(u32::MAX)
    }

    fn covers(&self, path: &Path) -> bool {
        self.root == path || self.paths.iter().flatten().any(|known| known == path)
    }
}

impl Workspace {
    /// Discards the compiled rule sets after a change.
    pub fn change(&mut self) {
        self.rule_sets = None;
    }

    /// The open files that no other open file uses, each with all that it uses.
    pub fn rule_sets(&mut self) -> Vec<Rc<RuleSet>> {
        if let Some(rule_sets) = &self.rule_sets {
            return rule_sets.clone();
        }
        let mut rule_sets: Vec<Rc<RuleSet>> = Vec::new();
        for path in self.open.keys() {
            // Of files that use each other, which is a mistake, the first one stands for all.
            if !rule_sets.iter().any(|rule_set| rule_set.covers(path)) {
                let rule_set = self.compile(path, &BTreeMap::new());
                rule_sets.retain(|known| !rule_set.covers(&known.root));
                rule_sets.push(Rc::new(rule_set));
            }
        }
        self.rule_sets = Some(rule_sets.clone());
        rule_sets
    }

    /// A file with all that it uses; `texts` are laid over what is open.
    pub fn compile(&self, path: &Path, texts: &BTreeMap<PathBuf, String>) -> RuleSet {
        let open = self.open.iter().map(|(path, document)| (path.clone(), document.text.clone()));
        let request = Request {
            files: vec![path.to_path_buf()],
            hand_file: self.hand_file.clone(),
            overrides: self.overrides.clone(),
            buffers: open.chain(texts.iter().map(|(path, text)| (path.clone(), text.clone()))).collect(),
            ..Request::default()
        };
        let survey = language::survey(&request);
        let place = |name: &str| {
            let path = Path::new(name);
            // The user's files were asked for by whole paths.
            if path.is_relative() && !self.open.contains_key(path) {
                self.library.file(name)
            } else {
                Some(uri::real(path))
            }
        };
        let paths = survey.sources.files.iter().map(|source| place(&source.name)).collect();
        let lines = survey.sources.files.iter().map(|source| Lines::new(&source.text)).collect();
        RuleSet { root: path.to_path_buf(), survey, paths, lines }
    }

    /// The place that a position in an open file means.
    pub fn spot(&mut self, uri: &Uri, position: Position) -> Option<Spot> {
        let path = uri::path_of(uri.as_ref());
        self.open.get(&path)?;
        let (rule_set, file) =
            self.rule_sets().into_iter().find_map(|rule_set| rule_set.file(&path).map(|file| (rule_set, file)))?;
        let offset = rule_set.offset(file, position);
        Some(Spot { rule_set, file, offset })
    }

    /// A place as the editor wants it; `None` for a file that lies nowhere.
    pub fn location(&self, rule_set: &RuleSet, span: Span) -> Option<Location> {
        let path = rule_set.path(span.file)?;
        Some(Location { uri: self.uri(path), range: rule_set.range(span) })
    }

    /// The URI of a file: as its editor calls it, when it is open.
    pub fn uri(&self, path: &Path) -> Uri {
        let open = self.open.get(path).or_else(|| self.others.get(path));
        open.map_or_else(|| Uri::from(uri::uri_of(path)), |document| document.uri.clone())
    }

    /// The rule sets to search for what stands in a file: those that are open, and those of closed files that use it. A file is used only from
    /// its own folder and those above, so these are looked through, as far as the editor's folders reach.
    pub fn dependents(&mut self, path: &Path) -> Vec<Rc<RuleSet>> {
        let mut found = self.rule_sets();
        if self.library.holds(path) {
            return found;
        }
        let shown = |folder: &&Path| self.folders.iter().any(|shown| folder.starts_with(shown));
        let above = path.ancestors().skip(2).take_while(shown);
        for file in path.parent().into_iter().chain(above).flat_map(rule_files) {
            if !found.iter().any(|rule_set| rule_set.covers(&file)) {
                let rule_set = self.compile(&file, &BTreeMap::new());
                if rule_set.covers(path) {
                    found.push(Rc::new(rule_set));
                }
            }
        }
        found
    }
}

/// The rule files that lie in a folder itself.
pub fn rule_files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let files = entries
        .map(|entry| entry.path())
        .filter(|file| file.extension().is_some_and(|ending| ending == "rules") && file.is_file());
    let mut files: Vec<PathBuf> = files.take(MAX_FILES).map(|file| uri::real(&file)).collect();
    files.sort();
    files
}
