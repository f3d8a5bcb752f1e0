//! Rule files and what they use: `use "x.rules"` is looked up beside the using file, else among the shipped files; a file beside the
//! user's first file stands for the shipped one of its name.
//!
//! INVARIANTS: each file is read once; no file outside the folder of the one that uses it is touched; size, count and depth are bounded.

mod shipped_rules;

pub use shipped_rules::{SHIPPED, shipped};

use super::syntax::{self, ItemKind};
use super::{codes, parse};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Read as _;
use std::path::{Component, Path, PathBuf};
use teachtree_base::diagnostic::{Diagnostic, Source, Sources, Span};
use teachtree_base::error::InputError;
use teachtree_base::file_kind::FileKind;

/// The largest file, in bytes.
pub const MAX_BYTES: u64 = 1 << 20;
/// The most files of a rule set.
pub const MAX_FILES: usize = 32;
/// How many files may use each other in a row.
pub const MAX_DEPTH: usize = 16;

/// Which file is meant.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Place {
    /// A file that comes with the program, by its name.
    Shipped(&'static str),
    /// A file on disk; a canonical path.
    Disk(PathBuf),
    /// A text that was handed over.
    Text,
}

/// What is known of a file that was asked for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Progress {
    /// It is being read: a `use` of it now closes a cycle.
    Open,
    /// It is read.
    Done,
}

/// Reads files.
#[derive(Default)]
pub struct Loader {
    /// The texts in order of reading.
    pub sources: Sources,
    /// The files in order of evaluation: a used file before the one that uses it.
    pub files: Vec<syntax::File>,
    /// What is wrong with them.
    pub findings: Vec<Diagnostic>,
    /// Whether a file is missing.
    pub incomplete: bool,
    /// The files that were named themselves, by their position in `sources`; all others are there for them.
    pub named: BTreeSet<u32>,
    /// Whether a file that was asked for, not one that another uses, could not be read at all.
    pub root_unreadable: bool,
    /// Texts that stand for files on disk, by canonical path.
    pub buffers: BTreeMap<PathBuf, String>,
    progress: BTreeMap<Place, Progress>,
    /// The folder of the user's first file on disk: canonical, and as the user wrote it.
    folder: Option<(PathBuf, PathBuf)>,
}

impl Loader {
    /// Reads a file that the user named: a path, else a shipped file such as `rules/contact.rules` or `contact.rules`.
    pub fn load_named(&mut self, name: &Path) {
        let on_disk = self.real(name);
        if self.folder.is_none() {
            let folder = on_disk.as_deref().and_then(Path::parent).map(Path::to_path_buf);
            self.folder = folder.zip(name.parent().map(Path::to_path_buf));
        }
        let on_disk = on_disk.map(|path| (Place::Disk(path), name.display().to_string()));
        let found = on_disk.or_else(|| self.by_name(name.to_str()?));
        self.load_found(name, found, 0);
    }

    /// Reads a file that comes with the program, whatever lies on disk.
    pub fn load_shipped(&mut self, name: &'static str) {
        self.load_found(Path::new(name), self.by_name(name), 0);
    }

    /// Reads the hand model: a shipped one (or the one of its name beside the user's first file), else a path.
    pub fn load_hand(&mut self, name: &str) {
        let path = Path::new(name);
        let on_disk = || self.real(path).map(|path| (Place::Disk(path), name.to_string()));
        let found = self.by_name(name).or_else(on_disk);
        // Not named by the user: it counts as used.
        self.load_found(path, found, 1);
    }

    /// The canonical path of a file on disk, or of one that exists only as a buffer so far.
    fn real(&self, path: &Path) -> Option<PathBuf> {
        let buffered = || self.buffers.contains_key(path).then(|| path.to_path_buf());
        std::fs::canonicalize(path).ok().or_else(buffered)
    }

    fn load_found(&mut self, name: &Path, found: Option<(Place, String)>, depth: usize) {
        if let Some((place, shown)) = found {
            self.load(place, &shown, None, depth);
            return;
        }
        self.incomplete = true;
        self.root_unreadable = true;
        let known: Vec<&str> = SHIPPED.iter().map(|(name, _)| *name).collect();
        let mut file = name.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if !file.ends_with(".rules") {
            file.push_str(".rules");
        }
        // The ending alone may be what is missing.
        let near = known.iter().copied().find(|known| *known == file);
        let help = match near.or_else(|| super::resolve::nearest(&file, known.iter().copied())) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("these come with the program: {}", known.join(", ")),
        };
        let name = name.display().to_string();
        let finding = Diagnostic::error(codes::UNREADABLE, format!("there is no rule file `{name}`"));
        self.findings.push(finding.in_file(name).help(help));
    }

    /// The shipped file of this name, or the one that stands for it: a file of the same name that was read already, or that lies beside
    /// the user's first file. Also the name to show.
    fn by_name(&self, name: &str) -> Option<(Place, String)> {
        let (name, _) = shipped(name)?;
        let is_it = |path: &Path| path.file_name().is_some_and(|file| file == name);
        if let Some(place) = self.progress.keys().find(|place| matches!(place, Place::Disk(path) if is_it(path))) {
            return Some((place.clone(), name.to_string()));
        }
        if let Some((folder, shown)) = &self.folder {
            let beside = self.real(&folder.join(name)).filter(|beside| beside.starts_with(folder));
            if let Some(beside) = beside {
                return Some((Place::Disk(beside), shown.join(name).display().to_string()));
            }
        }
        Some((Place::Shipped(name), format!("rules/{name}")))
    }

    /// Reads a text under a name.
    pub fn load_text(&mut self, name: &str, text: &str) {
        if text.len() as u64 > MAX_BYTES {
            let (code, reason) = too_large();
            self.incomplete = true;
            self.findings.push(Diagnostic::error(code, format!("cannot read `{name}`: {reason}")));
            return;
        }
        self.progress.insert(Place::Text, Progress::Open);
        self.parse(Place::Text, name.to_string(), text.to_string(), 0);
    }

    /// The abstract signals that no file implements.
    pub fn unimplemented(&self) -> BTreeSet<&str> {
        let mut declared = BTreeSet::new();
        let mut implemented = BTreeSet::new();
        let items = self.files.iter().flat_map(|file| &file.items).flat_map(|item| match &item.kind {
            ItemKind::ForEachHand(items) => items.as_slice(),
            _ => std::slice::from_ref(item),
        });
        for item in items {
            if let ItemKind::Signal(signal) = &item.kind {
                if signal.value.is_some() { &mut implemented } else { &mut declared }.insert(signal.name.text.as_str());
            }
        }
        &declared - &implemented
    }

    fn load(&mut self, place: Place, shown: &str, user: Option<Span>, depth: usize) {
        match self.progress.get(&place) {
            Some(Progress::Done) => return,
            Some(Progress::Open) => {
                let finding = Diagnostic::error(
                    codes::CIRCULAR_USE,
                    format!("`{shown}` uses itself, directly or through others"),
                );
                self.findings.push(match user {
                    Some(user) => {
                        finding.at(user, "this closes the cycle").help("move what both need into a third file")
                    }
                    None => finding.in_file(shown),
                });
                return;
            }
            None => {}
        }
        if self.sources.files.len() >= MAX_FILES || depth > MAX_DEPTH {
            self.incomplete = true;
            let message = if depth > MAX_DEPTH {
                format!("more than {MAX_DEPTH} files use each other in a row")
            } else {
                format!("a rule set has at most {MAX_FILES} files")
            };
            let finding = Diagnostic::error(codes::TOO_MANY_FILES, message);
            self.findings.push(match user {
                Some(user) => finding.at(user, "this one is too much"),
                None => finding,
            });
            return;
        }
        let read = match &place {
            Place::Shipped(name) => Ok(shipped(name).map_or("", |(_, text)| text).to_string()),
            Place::Disk(path) => match self.buffers.get(path) {
                Some(text) if text.len() as u64 > MAX_BYTES => Err(too_large()),
                Some(text) => Ok(text.clone()),
                None => read(path),
            },
            Place::Text => return,
        };
        match read {
            Ok(text) => {
                // A copy of a shipped file is that file.
                let copied =
                    SHIPPED.iter().find(|(file, shipped)| Path::new(shown).ends_with(file) && *shipped == text);
                if let Some((file, _)) = copied {
                    let known = self.progress.insert(Place::Shipped(file), Progress::Done).is_some();
                    if known {
                        self.progress.insert(place, Progress::Done);
                        return;
                    }
                }
                if user.is_none()
                    && let Some(error) = FileKind::Rules.misplaced(Path::new(shown), &text)
                {
                    return self.refuse(place, &error);
                }
                self.progress.insert(place.clone(), Progress::Open);
                self.parse(place, shown.to_string(), text, depth);
            }
            Err((code, reason)) => {
                if user.is_none()
                    && let Some(error) = FileKind::Rules.misplaced(Path::new(shown), "")
                {
                    return self.refuse(place, &error);
                }
                self.incomplete = true;
                self.root_unreadable |= user.is_none();
                self.progress.insert(place, Progress::Done);
                let finding = Diagnostic::error(code, format!("cannot read `{shown}`: {reason}"));
                self.findings.push(match user {
                    Some(user) => finding.at(user, "used here"),
                    None => finding,
                });
            }
        }
    }

    /// Reports a file of another kind that was named as rules.
    fn refuse(&mut self, place: Place, error: &InputError) {
        self.incomplete = true;
        self.root_unreadable = true;
        self.progress.insert(place, Progress::Done);
        let finding = Diagnostic::error(codes::UNREADABLE, format!("`{}`: {}", error.place, error.message));
        let finding = finding.in_file(&error.place);
        self.findings.push(error.help.iter().fold(finding, |finding, help| finding.help(help)));
    }

    /// Parses a text, loads what it uses, and puts it after that.
    fn parse(&mut self, place: Place, name: String, text: String, depth: usize) {
        let Ok(id) = u32::try_from(self.sources.files.len()) else { return };
        let (file, findings) = parse::parse(&text, id);
        self.sources.files.push(Source { name: name.clone(), text });
        self.incomplete |= file.is_cut;
        if depth == 0 {
            self.named.insert(id);
        }
        self.findings.extend(findings);
        for used in file.items.iter().filter_map(|item| match &item.kind {
            ItemKind::Use(used) => Some(&used.file),
            _ => None,
        }) {
            self.use_file(&place, &name, used, depth + 1);
        }
        self.progress.insert(place, Progress::Done);
        self.files.push(file);
    }

    fn use_file(&mut self, user: &Place, user_name: &str, used: &syntax::Name, depth: usize) {
        let path = Path::new(&used.text);
        let inside = !used.text.contains('\\') && path.components().all(|part| matches!(part, Component::Normal(_)));
        if !inside || used.text.is_empty() {
            self.incomplete = true;
            self.findings.push(
                Diagnostic::error(codes::OUTSIDE_FOLDER, "a file uses only files in its own folder")
                    .at(used.span, "this leads elsewhere")
                    .help("copy the file beside this one, and use it by its name"),
            );
            return;
        }
        if let Place::Disk(user_path) = user {
            let folder = user_path.parent().unwrap_or(Path::new(""));
            let beside = folder.join(path);
            if beside.exists() || self.buffers.contains_key(&beside) {
                let shown = Path::new(user_name).parent().unwrap_or(Path::new("")).join(path);
                match self.real(&beside) {
                    Some(real) if real.starts_with(folder) => {
                        self.load(Place::Disk(real), &shown.display().to_string(), Some(used.span), depth);
                    }
                    _ => {
                        self.incomplete = true;
                        self.findings.push(
                            Diagnostic::error(codes::OUTSIDE_FOLDER, "a file uses only files in its own folder")
                                .at(used.span, "this is a link that leads elsewhere"),
                        );
                    }
                }
                return;
            }
        }
        match self.by_name(&used.text) {
            Some((place, shown)) => self.load(place, &shown, Some(used.span), depth),
            None => {
                self.incomplete = true;
                let finding = Diagnostic::error(codes::UNREADABLE, format!("there is no rule file `{}`", used.text))
                    .at(used.span, "neither beside this file nor among those that come with the program");
                let known = SHIPPED.iter().map(|(name, _)| *name);
                self.findings.push(match super::resolve::nearest(&used.text, known.clone()) {
                    Some(near) => finding.fix(format!("did you mean `{near}`?"), used.span, format!("\"{near}\"")),
                    None => {
                        finding.help(format!("these come with the program: {}", known.collect::<Vec<_>>().join(", ")))
                    }
                });
            }
        }
    }
}

/// The file that a `use` names, by its position in `sources`: the one beside the using file, else the one of that name.
pub fn used_file(name: &syntax::Name, sources: &Sources) -> Option<u32> {
    let user = Path::new(&sources.files.get(name.span.file as usize)?.name);
    let beside = user.parent().unwrap_or(Path::new("")).join(&name.text);
    let files = || sources.files.iter().map(|source| Path::new(&source.name));
    let at = files().position(|file| file == beside).or_else(|| files().position(|file| file.ends_with(&name.text)))?;
    u32::try_from(at).ok()
}

fn too_large() -> (&'static str, String) {
    (codes::TOO_LARGE, format!("it has more than {MAX_BYTES} bytes"))
}

/// Returns the text of a file on disk, or the code and reason of the error.
fn read(path: &Path) -> Result<String, (&'static str, String)> {
    let unreadable = |error: std::io::Error| (codes::UNREADABLE, error.kind().to_string());
    if path.exists() && !path.is_file() {
        // A pipe would be waited for.
        return Err((codes::UNREADABLE, if path.is_dir() { "it is a folder" } else { "it is not a file" }.to_string()));
    }
    let mut bytes = Vec::new();
    let file = std::fs::File::open(path).map_err(unreadable)?;
    file.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(too_large());
    }
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        (codes::UNREADABLE, format!("byte {at} is not valid UTF-8"))
    })
}
