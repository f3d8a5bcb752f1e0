//! What `teachtree check` verifies of a project file besides its form: files, names of tasks, names and values of params.

use super::{Entry, LogPattern, ProjectFile};
use std::cell::LazyCell;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use teachtree_analysis::outcome::ExpectedTasks;
use teachtree_base::error::InputError;
use teachtree_frames::bind::BindingFile;
use teachtree_frames::hand_file_of;
use teachtree_language::{self as language, Request, SHIPPED, codes, shipped};

/// Checks the entries of a file.
///
/// # Errors
/// The first file that does not exist, task that no rules of the file have, or param that does not fit them.
pub fn check(file: &ProjectFile) -> Result<(), InputError> {
    for (pattern, entry) in &file.entries {
        check_files(file, pattern, entry)?;
        check_tasks(file, pattern, entry)?;
        check_params(file, pattern, entry)?;
    }
    Ok(())
}

fn check_files(file: &ProjectFile, pattern: &LogPattern, entry: &Entry) -> Result<(), InputError> {
    let there = |path: &Path, keys: &[&str]| match file.folder().join(path).exists() {
        true => Ok(()),
        false => {
            let message = format!("there is no file `{}`", file.folder().join(path).display());
            Err(InputError::new(file.place(pattern, keys), message)
                .help("paths are relative to the folder of this file"))
        }
    };
    let paths = [("binding", &entry.binding), ("scene", &entry.scene), ("labels", &entry.labels)];
    for (key, path) in paths {
        path.iter().try_for_each(|path| there(path, &[key]))?;
    }
    let is_shipped = |path: &Path| path.to_str().is_some_and(|name| shipped(name).is_some());
    for (at, rules) in entry.rules.iter().enumerate().filter(|(_, rules)| !is_shipped(rules)) {
        there(rules, &["rules", &at.to_string()])?;
    }
    let hand_file = entry.hand_file.as_deref().map(Path::new);
    hand_file.filter(|file| !is_shipped(file)).map_or(Ok(()), |path| there(path, &["hand_file"]))
}

/// Checks the expected tasks of an entry by its rules; without them by those of other entries and by the default ones, which a log may have too.
fn check_tasks(file: &ProjectFile, pattern: &LogPattern, entry: &Entry) -> Result<(), InputError> {
    let Some(text) = &entry.expect else { return Ok(()) };
    let wrong = |message: String| InputError::new(file.place(pattern, &["expect"]), message);
    let tasks = ExpectedTasks::parse(text).map_err(wrong)?;
    let mut first = Ok(());
    for request in requests(file, entry) {
        // Mistakes of rules are those of their files.
        let Some(rules) = language::load(&request).rules else { continue };
        match tasks.check(&rules) {
            Ok(()) => return Ok(()),
            Err(message) if first.is_ok() => first = Err(wrong(message)),
            Err(_) => {}
        }
    }
    first
}

/// The rules that a log of an entry may have: its own, else those of other entries and the default ones.
fn requests(file: &ProjectFile, entry: &Entry) -> Vec<Request> {
    let files = |entry: &Entry| entry.rules.iter().map(|rules| file.rule_file(rules)).collect::<Vec<PathBuf>>();
    if !entry.rules.is_empty() {
        return vec![Request { files: files(entry), ..Request::default() }];
    }
    let others = file.entries.iter().map(|(_, other)| files(other)).filter(|files| !files.is_empty());
    let others: BTreeSet<Vec<PathBuf>> = others.collect();
    let others = others.into_iter().map(|files| Request { files, ..Request::default() });
    [false, true].map(|two_hands| Request { two_hands, ..Request::default() }).into_iter().chain(others).collect()
}

/// Checks the params of an entry by the first of its rules, with one of its hand models, that declares them.
fn check_params(file: &ProjectFile, pattern: &LogPattern, entry: &Entry) -> Result<(), InputError> {
    if entry.params.is_empty() {
        return Ok(());
    }
    let hand_files = hand_files(file, entry);
    let with_hand_file = |request: Request| {
        hand_files.iter().map(move |hand_file| Request { hand_file: Some(hand_file.clone()), ..request.clone() })
    };
    let requests: Vec<Request> = requests(file, entry).into_iter().flat_map(with_hand_file).collect();
    let rules: Vec<_> = requests.iter().map(|request| LazyCell::new(|| language::load(request).rules)).collect();
    for (param, value) in &entry.params {
        let declares = |rules: &language::Rules| rules.params.iter().any(|known| known.name == *param);
        let at = rules.iter().position(|rules| rules.as_ref().is_some_and(declares));
        // Mistakes of rules are those of their files.
        let Some(at) = at.or_else(|| rules.iter().position(|rules| rules.is_some())) else { continue };
        let place = file.place(pattern, &["params", param]);
        let (overrides, override_places) =
            (vec![(param.clone(), value.clone())], [(param.clone(), place.clone())].into());
        let found = language::load(&Request { overrides, override_places, ..requests[at].clone() }).diagnostics;
        if let Some(found) = found.into_iter().find(|found| found.code == codes::BAD_OVERRIDE) {
            let error = InputError::new(place, found.message);
            return Err(found.help.into_iter().fold(error, InputError::help));
        }
    }
    Ok(())
}

/// The hand models that a log of an entry may have: its own, else those of other entries, of bindings, and the shipped ones.
fn hand_files(file: &ProjectFile, entry: &Entry) -> Vec<String> {
    let named =
        |entry: &Entry| entry.hand_file.as_ref().map(|name| file.rule_file(Path::new(name)).display().to_string());
    if let Some(own) = named(entry) {
        return vec![own];
    }
    let of_binding = |entry: &Entry| {
        let path = file.folder().join(entry.binding.as_ref()?);
        let name = BindingFile::read(&path).ok()?.binding.hand_file?;
        Some(hand_file_of(&path, name))
    };
    let others = file.entries.iter().flat_map(|(_, entry)| [of_binding(entry), named(entry)]).flatten();
    let shipped = SHIPPED.iter().map(|(name, _)| (*name).to_string()).filter(|name| name.starts_with("hand_"));
    let mut named = BTreeSet::new();
    of_binding(entry).into_iter().chain(others).chain(shipped).filter(|name| named.insert(name.clone())).collect()
}
