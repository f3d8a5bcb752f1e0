//! What `teachtree check` verifies of a project file besides its form: files and names of tasks.

use super::{Entry, LogPattern, ProjectFile};
use std::path::{Path, PathBuf};
use teachtree_analysis::outcome::ExpectedTasks;
use teachtree_base::error::InputError;
use teachtree_language::{self as language, Request, shipped};

/// Checks the entries of a file.
///
/// # Errors
/// The first file that does not exist, or task that no rules of the file have.
pub fn check(file: &ProjectFile) -> Result<(), InputError> {
    for (pattern, entry) in &file.entries {
        check_files(file, pattern, entry)?;
        check_tasks(file, pattern, entry)?;
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
    let files = |entry: &Entry| entry.rules.iter().map(|rules| file.rule_file(rules)).collect::<Vec<PathBuf>>();
    let mut requests = vec![];
    if entry.rules.is_empty() {
        requests.extend([false, true].map(|two_hands| Request { two_hands, ..Request::default() }));
        let others = file.entries.iter().map(|(_, other)| files(other)).filter(|files| !files.is_empty());
        requests.extend(others.map(|files| Request { files, ..Request::default() }));
    } else {
        requests.push(Request { files: files(entry), ..Request::default() });
    }
    let mut first = Ok(());
    for request in requests {
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
