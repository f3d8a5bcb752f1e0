//! The rules that a new primitive extends: the named ones, those of `teachtree.yaml`, or the shipped ones for the number of hands.

use super::mismatch;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use teachtree_base::error::InputError;
use teachtree_language::{Rules, shipped};
use teachtree_session::{Error, ErrorInternals, Log, RulesInternals, RulesOptions, RulesOptionsInternals};

/// The rules that are extended where none are named: of one hand, of two.
const DEFAULT_RULES: [&str; 2] = ["contact.rules", "bimanual.rules"];

/// The rules that are extended, for logs that need the same hand model.
pub struct BaseRules {
    options: RulesOptions,
    /// The first recording: rules are loaded for it.
    log: Log,
    /// The files that are loaded for it.
    files: Vec<String>,
    uses: String,
}

impl BaseRules {
    /// Loads the rules for recordings. `out` is the file that will extend them; it must be beside rules that are not shipped.
    ///
    /// # Errors
    /// Rules with errors, rules in another folder than `out`, or no recordings.
    pub fn new<'a>(
        options: &RulesOptions,
        mut logs: impl Iterator<Item = &'a Log> + Clone,
        out: Option<&Path>,
    ) -> Result<Self, Error> {
        let two_hands = logs.clone().all(|log| log.hands().len() > 1);
        let log = logs.next().ok_or_else(|| Error::internal("there are no recordings"))?.clone();
        // Options with a text take no files of `teachtree.yaml`.
        let named = options.clone().text("the extension", "").request_for(&log).files;
        let of_project = options.clone().request_for(&log).files;
        let (options, names) = match (named.is_empty(), of_project.is_empty()) {
            (false, _) => (options.clone(), named),
            (true, false) => (with_files(options, &of_project), of_project),
            (true, true) => {
                let files = vec![PathBuf::from(DEFAULT_RULES[usize::from(two_hands)])];
                (with_files(options, &files), files)
            }
        };
        let uses = uses(&names, out).map_err(mismatch)?;
        let files = options.clone().for_log(&log)?.files().map(String::from).collect();
        Ok(Self { options, log, files, uses })
    }

    /// Loads them with a text behind them.
    ///
    /// # Errors
    /// The diagnostics of the text.
    pub fn load(&self, text: &str) -> Result<Rules, Error> {
        let options = self.options.clone();
        let options = if text.is_empty() { options } else { options.text("the extension", text) };
        Ok(options.for_log(&self.log)?.set().clone())
    }

    /// Refuses a recording that needs another hand model.
    pub(super) fn check(&self, log: &Log) -> Result<(), Error> {
        let rules = self.options.clone().for_log(log)?;
        let Some(other) = rules.files().find(|file| !self.files.iter().any(|known| known == file)) else {
            return Ok(());
        };
        let message =
            format!("needs {other}, expected the hand model of the other recordings; --hand names one for all");
        Err(mismatch(InputError::new(log.name(), message)))
    }

    /// The lines `use` of the extension.
    pub(super) fn uses(&self) -> &str {
        &self.uses
    }
}

fn with_files(options: &RulesOptions, files: &[PathBuf]) -> RulesOptions {
    files.iter().fold(options.clone(), |options, file| options.file(file))
}

/// The `use` lines of the extension.
///
/// # Errors
/// Rules that it could not use, as they are in another folder.
fn uses(files: &[PathBuf], out: Option<&Path>) -> Result<String, InputError> {
    let mut text = String::new();
    for file in files {
        let folder = |path: &Path| {
            path.parent().map(|folder| if folder.as_os_str().is_empty() { ".".into() } else { folder.to_path_buf() })
        };
        let is_shipped = shipped(&file.display().to_string()).is_some() && !file.exists();
        let beside = out.is_none_or(|out| {
            folder(out).and_then(|it| it.canonicalize().ok()) == folder(file).and_then(|it| it.canonicalize().ok())
        });
        if !is_shipped && !beside {
            let message = format!(
                "is not in the folder of {}, and a rule file uses only files beside it",
                out.map_or(String::new(), |out| out.display().to_string())
            );
            return Err(
                InputError::new(file.display().to_string(), message).help("write the extension beside the rules")
            );
        }
        let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
        let _ = writeln!(text, "use \"{name}\"");
    }
    Ok(text)
}
