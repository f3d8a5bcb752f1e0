//! How commands analyze recordings: the rules, and how logs are read.

use super::rules::RuleArgs;
use super::source::SourceArgs;
use super::{Failure, output};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use teachtree_analysis::outcome::ExpectedTasks;
use teachtree_base::error::InputError;
use teachtree_frames::bind::BindingFile;
use teachtree_frames::hand_file_of;
use teachtree_language::{self as language, Request};
use teachtree_session::files::{RecordingFile, label_file, recordings};
use teachtree_session::{Analysis, Error, ErrorInternals, Log, RulesInternals};

/// Options of commands that analyze recordings.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct AnalysisArgs {
    #[command(flatten)]
    pub rules: RuleArgs,
    #[command(flatten)]
    pub source: SourceArgs,
}

/// The tasks that recordings should contain.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct ExpectArg {
    /// The tasks that each recording should contain, in order, instead of `expect` of the binding: `peg_in_hole x 2, turn_screw`
    #[arg(long, value_name = "TASKS", value_parser = expected_tasks)]
    pub expect: Option<String>,
}

/// Checks the form of an expectation.
fn expected_tasks(text: &str) -> Result<String, String> {
    ExpectedTasks::parse(text).map(|_| text.to_string())
}

impl ExpectArg {
    /// Analyzes a log, which is expected to contain these tasks. Their names are checked before the rules run.
    ///
    /// # Errors
    /// A task that the rules do not have, or that is a failure; errors of the rules and of the log.
    pub fn analyze(&self, args: &AnalysisArgs, log: &Log) -> Result<Analysis, Failure> {
        let rules = args.rules.load(log)?;
        if let Some(tasks) = &self.expect {
            let checked = ExpectedTasks::parse(tasks).and_then(|expected| expected.check(rules.set()));
            checked.map_err(|message| InputError::new("--expect", message))?;
        }
        Ok(self.of(rules.analyze(log)?)?)
    }

    /// Expects these tasks of an analyzed recording.
    ///
    /// # Errors
    /// A task that the rules do not have, or that is a failure.
    pub fn of(&self, analysis: Analysis) -> Result<Analysis, InputError> {
        let Some(tasks) = &self.expect else { return Ok(analysis) };
        let in_option = |error: Error| InputError { place: "--expect".into(), ..error.into_input() };
        analysis.expecting(tasks).map_err(in_option)
    }
}

impl AnalysisArgs {
    /// The recordings that paths stand for.
    pub fn recordings(&self, paths: &[PathBuf]) -> Result<Vec<RecordingFile>, InputError> {
        recordings(paths, self.source.binding.as_deref())
    }

    /// The same as paths.
    pub fn logs(&self, paths: &[PathBuf]) -> Result<Vec<PathBuf>, InputError> {
        Ok(self.recordings(paths)?.into_iter().map(|found| found.log).collect())
    }

    /// Whether a binding or rules are named for a log, by these options or by `teachtree.yaml`.
    ///
    /// # Errors
    /// When that file cannot be read.
    pub fn has_rules(&self, log: &Path) -> Result<bool, InputError> {
        let settings = self.source.settings(log)?;
        let is_given = self.source.binding.is_some() || !self.rules.rules.is_empty();
        Ok(is_given || settings.binding.is_some() || settings.rules.is_some() || settings.expect.is_some())
    }

    /// Whether rules are named for a log, by these options or by `teachtree.yaml`.
    ///
    /// # Errors
    /// When that file cannot be read.
    pub fn has_present_rules(&self, log: &Path) -> Result<bool, InputError> {
        Ok(!self.rules.rules.is_empty() || self.source.settings(log)?.rules.is_some())
    }

    /// Opens a log and reads it into memory.
    pub fn read(&self, log: &Path) -> Result<Log, Error> {
        let log = self.source.open(log)?;
        log.read()?;
        Ok(log)
    }

    /// Analyzes a log.
    pub fn analyze(&self, log: &Log) -> Result<Analysis, Error> {
        self.rules.load(log)?.analyze(log)
    }

    /// The files that these options and `teachtree.yaml` have a command read for some logs, those that rules use too: nothing is written over them.
    pub fn files(&self, logs: &[PathBuf]) -> Vec<PathBuf> {
        let Self { rules, source } = self;
        let mut files: Vec<PathBuf> = source.binding.iter().chain(&source.scene).chain(&rules.rules).cloned().collect();
        let mut requests = vec![(rules.rules.clone(), self.hand_file(source.binding.as_deref()))];
        // Errors of the settings are reported where they are used.
        for (log, settings) in logs.iter().filter_map(|log| Some((log, source.settings(log).ok()?))) {
            files.extend(settings.files().filter(|file| file.is_file()).map(Path::to_path_buf));
            files.extend(settings.labels.as_ref().and_then(|labels| label_file(&labels.value, log).ok()));
            let rules = settings.rules.map_or_else(Vec::new, |rules| rules.value);
            let hand_file = settings.hand_file.map(|hand_file| hand_file.value);
            let binding = settings.binding.map(|binding| binding.value);
            let request = (rules, hand_file.or_else(|| self.hand_file(binding.as_deref())));
            if !requests.contains(&request) {
                requests.push(request);
            }
        }
        for (rules, hand_file) in requests.into_iter().filter(|(rules, hand)| !rules.is_empty() || hand.is_some()) {
            let loaded = language::load(&Request { files: rules, hand_file, ..Request::default() });
            files.extend(loaded.sources.files.iter().map(|file| PathBuf::from(&file.name)));
        }
        let mut seen = BTreeSet::new();
        files.retain(|file| seen.insert(file.clone()));
        files
    }

    /// The hand model that these options or a binding name.
    fn hand_file(&self, binding: Option<&Path>) -> Option<String> {
        let of_binding =
            |binding: &Path| Some(hand_file_of(binding, BindingFile::read(binding).ok()?.binding.hand_file?));
        self.rules.hand.file.clone().or_else(|| binding.and_then(of_binding))
    }

    /// Recordings and the files that these options have a command read.
    pub fn inputs(&self, logs: &[PathBuf]) -> Vec<PathBuf> {
        logs.iter().cloned().chain(self.files(logs)).collect()
    }

    /// Recordings and the files that these options have a command read. Refuses places that would replace one of them or each other, before the work is
    /// done.
    ///
    /// # Errors
    /// When there is such a place.
    pub fn checked_inputs(&self, logs: &[PathBuf], places: &[&Path]) -> Result<Vec<PathBuf>, InputError> {
        output::refuse_one_for_two(places)?;
        // Without a place, no rules are loaded.
        let inputs = if places.is_empty() { Vec::new() } else { self.inputs(logs) };
        places.iter().try_for_each(|place| output::refuse_inputs(place, &inputs))?;
        Ok(inputs)
    }
}
