//! `analyze --out-dir`: a file for each recording, and `--resume`, which leaves out what is done and unchanged.
//!
//! A recording's file is put in its place as soon as it is made, and then a line is added to `manifest.jsonl` beside it; a program that is killed therefore
//! leaves whole files, and a list of those that it finished. A line has digests of all that the file was made of and of the file itself.
//! With `--shard` every part has a list of its own, `manifest-3-of-16.jsonl`, since several programs write at once; `--resume` reads all lists.

use super::analyze::{Args, Output, Shard, one};
use super::parallel::Issues;
use super::{Failure, output};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{Read, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use teachtree_analysis::json::VERSION;
use teachtree_base::digest::Digest;
use teachtree_base::error::InputError;
use teachtree_language::SHIPPED;
use teachtree_logs::atomic_write;
use teachtree_logs::issue::IssueKind;
use teachtree_logs::read::formats;
use teachtree_logs::read::{file, text};
use teachtree_session::files::RecordingFile;

/// How the lists of what is done are called.
const MANIFEST: (&str, &str) = ("manifest", ".jsonl");
/// The largest list that is read, bytes.
const MAX_MANIFEST: u64 = 1 << 30;

/// A line of the list.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct ManifestEntry {
    schema: String,
    /// The path of the recording.
    log: String,
    /// The file that was made of it, in the folder of the list.
    out: String,
    /// Digest of all that it was made of.
    made_of: String,
    /// Digest of the file.
    digest: String,
}

/// The schema of a line.
const SCHEMA: &str = "teachtree.manifest/1";

/// The result of a recording.
enum BatchResult {
    Written {
        /// The kinds of its issues, each with their number.
        kinds: BTreeMap<IssueKind, usize>,
        /// Whether it contains the tasks of `--expect`, and nothing that `--fail-on` names.
        is_accepted: bool,
    },
    Unchanged,
}

/// Analyzes recordings into a folder.
pub fn run(args: &Args, folder: &Path, logs: &[RecordingFile]) -> Result<(), Failure> {
    let logs_alone: Vec<PathBuf> = logs.iter().map(|found| found.log.clone()).collect();
    let files = args.analysis.files(&logs_alone);
    let outs = places(args, folder, logs, &files)?;
    args.analysis.source.check(logs.len())?;
    output::make_folder(folder)?;
    let list = Manifest::open(folder, args.shard)?;
    let mine = |place: &usize| args.shard.is_none_or(|shard| shard.has(*place));
    let known = digests(args, &files)?;
    let contents = FileDigests::default();
    let items: Vec<(&RecordingFile, &PathBuf)> =
        logs.iter().zip(&outs).enumerate().filter(|(place, _)| mine(place)).map(|(_, item)| item).collect();
    let results = args.many.each("analyzing", &items, |(found, out)| {
        let made_of = contents.made_of(&known, &found.log);
        let name = out.strip_prefix(folder).unwrap_or(out).to_string_lossy().replace('\\', "/");
        if let Some(made_of) = &made_of
            && args.resume
            && list.has(&name, made_of, out)
        {
            return Ok(BatchResult::Unchanged);
        }
        let Output { text, kinds, is_accepted, .. } = one(args, &found.log, true)?;
        out.parent().map_or(Ok(()), output::make_folder)?;
        atomic_write::write(out, |file| file.write_all(text.as_bytes()))?;
        if let Some(made_of) = made_of {
            let mut digest = Digest::default();
            digest.bytes(text.as_bytes());
            let log = found.log.display().to_string();
            list.add(ManifestEntry { schema: SCHEMA.into(), log, out: name, made_of, digest: digest.finish() })?;
        }
        Ok::<_, Failure>(BatchResult::Written { kinds, is_accepted })
    })?;
    list.finish()?;
    let (mut written, mut unchanged, mut issues, mut failures) = (0, 0, Issues::default(), Vec::new());
    let mut is_accepted = true;
    for ((found, _), result) in items.iter().zip(results) {
        match result {
            Ok(BatchResult::Unchanged) => unchanged += 1,
            Ok(BatchResult::Written { kinds, is_accepted: it }) => {
                written += 1;
                is_accepted &= it;
                issues.add(&found.log, &kinds);
            }
            Err(failure) => failures.push(failure.of_log(&found.log)),
        }
    }
    issues.summary().iter().for_each(|summary| output::note(summary));
    let of = |count: usize, what: &str| if count == 0 { String::new() } else { format!(", {count} {what}") };
    output::note(&format!(
        "{written} written to {}{}{}",
        folder.display(),
        of(unchanged, "unchanged"),
        of(failures.len(), "failed")
    ));
    Failure::some(failures, written + unchanged)?;
    if is_accepted { Ok(()) } else { Err(Failure::Negative) }
}

/// The file of each recording.
fn places(args: &Args, folder: &Path, logs: &[RecordingFile], files: &[PathBuf]) -> Result<Vec<PathBuf>, InputError> {
    let ending = args.form.format.writer().ending;
    // What is in a folder of recordings would be taken for one the next time.
    let whole_place = |path: &Path| {
        let parent = path.ancestors().find_map(|above| Some((above, std::fs::canonicalize(nonempty(above)).ok()?)));
        parent.map_or_else(|| path.to_path_buf(), |(above, place)| place.join(path.strip_prefix(above).unwrap_or(path)))
    };
    let out = whole_place(folder);
    for input in args.logs.iter().map(|input| formats::without_episode(input)).filter(|input| input.is_dir()) {
        if std::fs::canonicalize(&input).is_ok_and(|input| out.starts_with(input)) {
            let message = format!("is in {}, which is read by this command", input.display());
            return Err(InputError::new(folder.display().to_string(), message).help("name a folder beside it"));
        }
    }
    let mut taken: BTreeMap<PathBuf, &Path> = BTreeMap::new();
    let mut places = Vec::new();
    let inputs: Vec<PathBuf> = logs.iter().map(|found| &found.log).chain(files).cloned().collect();
    for RecordingFile { log, name } in logs {
        let mut place = folder.join(name).into_os_string();
        place.push(format!(".{ending}"));
        let place = PathBuf::from(place);
        if let Some(other) = taken.insert(place.clone(), log) {
            let message = format!("`{}` and `{}` would both be written there", other.display(), log.display());
            return Err(InputError::new(place.display().to_string(), message)
                .help("name the folder above both, so that their files are written into folders of the same names"));
        }
        places.push(place);
    }
    // Only what is there already can be an input.
    for place in places.iter().filter(|place| place.exists()) {
        output::refuse_inputs(place, &inputs)?;
    }
    Ok(places)
}

fn nonempty(path: &Path) -> &Path {
    if path.as_os_str().is_empty() { Path::new(".") } else { path }
}

/// The digest of all that is the same for all recordings: program, rules, params, binding, scene, format, and whether confidence is computed.
fn digests(args: &Args, files: &[PathBuf]) -> Result<Digest, InputError> {
    let mut digest = Digest::default();
    digest.field(VERSION);
    digest.field(&format!("{:?}", args.form.format));
    digest.field(if args.confidence { "confidence" } else { "" });
    digest.field(args.expect.expect.as_deref().unwrap_or_default());
    (args.form.format.writer().width)().iter().for_each(|width| digest.field(&width.to_string()));
    for (_, text) in SHIPPED {
        digest.field(text);
    }
    digest.count(files.len());
    for file in files {
        digest.field(&file.display().to_string());
        // The texts of shipped files are above.
        digest.field(&if file.is_file() { of_file(file)? } else { String::new() });
    }
    let rules = &args.analysis.rules;
    digest.field(rules.hand.file.as_deref().unwrap_or_default());
    digest.count(rules.set.values.len());
    for (name, value) in &rules.set.values {
        digest.field(name);
        digest.field(value);
    }
    Ok(digest)
}

fn of_file(path: &Path) -> Result<String, InputError> {
    let failed = |error: std::io::Error| InputError::unreadable(path.display().to_string(), &error);
    let mut file = file::open(path)?;
    let (mut digest, mut bytes) = (Digest::default(), vec![0; 1 << 16]);
    loop {
        match file.read(&mut bytes).map_err(failed)? {
            0 => return Ok(digest.finish()),
            count => digest.bytes(bytes.get(..count).unwrap_or_default()),
        }
    }
}

/// Digests of files, each computed once: many recordings may be in one.
#[derive(Default)]
struct FileDigests(Mutex<BTreeMap<PathBuf, Option<String>>>);

impl FileDigests {
    /// The digest of all that the analysis of a log is made of; `None` where a file cannot be read, as standard input.
    fn made_of(&self, known: &Digest, log: &Path) -> Option<String> {
        let mut digest = known.clone();
        digest.field(&log.display().to_string());
        for file in formats::files_of(log).ok()? {
            digest.field(&file.display().to_string());
            let known = self.0.lock().unwrap_or_else(PoisonError::into_inner).get(&file).cloned();
            let content = known.unwrap_or_else(|| {
                let content = of_file(&file).ok();
                self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(file, content.clone());
                content
            });
            digest.field(&content?);
        }
        Some(digest.finish())
    }
}

/// The list of what is done.
struct Manifest {
    path: PathBuf,
    /// Of all lists in the folder.
    known: BTreeMap<String, ManifestEntry>,
    /// Those of this list.
    own: BTreeMap<String, ManifestEntry>,
    new: Mutex<(File, BTreeMap<String, ManifestEntry>)>,
}

impl Manifest {
    fn open(folder: &Path, shard: Option<Shard>) -> Result<Self, InputError> {
        let (name, ending) = MANIFEST;
        let part = shard.map_or(String::new(), |Shard { at, of }| format!("-{at}-of-{of}"));
        let path = folder.join(format!("{name}{part}{ending}"));
        let place = path.display().to_string();
        let mut known = BTreeMap::new();
        for other in lists(folder)?.iter().filter(|other| **other != path) {
            known.extend(done(&text::read(other, MAX_MANIFEST)?));
        }
        let old = if path.is_file() { text::read(&path, MAX_MANIFEST)? } else { String::new() };
        let own: BTreeMap<String, ManifestEntry> = done(&old).collect();
        known.extend(own.clone());
        let failed = |error: std::io::Error| InputError::new(&place, format!("cannot be written: {error}"));
        let mut file = OpenOptions::new().create(true).append(true).open(&path).map_err(failed)?;
        if !old.is_empty() && !old.ends_with('\n') {
            file.write_all(b"\n").map_err(failed)?;
        }
        Ok(Self { path, known, own, new: Mutex::new((file, BTreeMap::new())) })
    }

    /// Whether a file was made of the same things, and is still what it was then.
    fn has(&self, out: &str, made_of: &str, path: &Path) -> bool {
        let same =
            |done: &&ManifestEntry| done.made_of == made_of && of_file(path).is_ok_and(|digest| digest == done.digest);
        self.known.get(out).filter(same).is_some()
    }

    fn add(&self, done: ManifestEntry) -> Result<(), InputError> {
        let failed = |error: String| InputError::new(self.path.display().to_string(), error);
        let line = line(&done).map_err(failed)?;
        let mut new = self.new.lock().unwrap_or_else(PoisonError::into_inner);
        new.0.write_all(line.as_bytes()).map_err(|error| failed(format!("cannot be written: {error}")))?;
        new.1.insert(done.out.clone(), done);
        Ok(())
    }

    /// Writes the list once more, in order and without lines that were replaced.
    fn finish(self) -> Result<(), InputError> {
        let (_, new) = self.new.into_inner().unwrap_or_else(PoisonError::into_inner);
        let mut all = self.own;
        all.extend(new);
        let lines: Result<String, String> = all.values().map(line).collect();
        let lines = lines.map_err(|error| InputError::new(self.path.display().to_string(), error))?;
        atomic_write::write(&self.path, |file| file.write_all(lines.as_bytes()))
    }
}

/// The lines of a list. One that a killed program did not finish is as good as none.
fn done(text: &str) -> impl Iterator<Item = (String, ManifestEntry)> {
    let lines = text.lines().filter_map(|line| serde_json::from_str::<ManifestEntry>(line).ok());
    lines.filter(|done| done.schema == SCHEMA).map(|done| (done.out.clone(), done))
}

/// The lists in a folder: that of a run over all recordings, and those of parts.
fn lists(folder: &Path) -> Result<Vec<PathBuf>, InputError> {
    let failed = |error: std::io::Error| InputError::unreadable(folder.display().to_string(), &error);
    let is_list = |name: &str| {
        let part = name.strip_prefix(MANIFEST.0).and_then(|rest| rest.strip_suffix(MANIFEST.1));
        part.is_some_and(|part| part.is_empty() || part.starts_with('-') && part.contains("-of-"))
    };
    let mut lists = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.is_file() && path.file_name().and_then(|name| name.to_str()).is_some_and(is_list) {
            lists.push(path);
        }
    }
    lists.sort();
    Ok(lists)
}

fn line(done: &ManifestEntry) -> Result<String, String> {
    serde_json::to_string(done).map(|line| line + "\n").map_err(|error| error.to_string())
}
