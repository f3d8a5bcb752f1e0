//! Rules: files and texts, a hand model, params; loaded for a log, with its defaults.

use super::analysis::Analysis;
use super::error::{Diagnostic, Error};
use super::log::Log;
use super::log_contents::LogContents;
use super::observability::{self, Observability};
use super::project_file::ProjectSettings;
use super::run;
use super::signals;
use crate::{ErrorInternals, LogInternals};
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use teachtree_analysis::outcome::ExpectedTasks;
use teachtree_base::diagnostic::Severity;
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_frames::hand_models::HandModel;
use teachtree_language::graph::lower;
use teachtree_language::{self as language, Request, SHIPPED};
use teachtree_report::diagram::{self, DiagramFormat};

/// Checked rules: what the primitives and tasks are that are looked for in a log. Clones share them.
#[derive(Clone)]
pub struct Rules(Arc<Inner>);

struct Inner {
    rules: language::Rules,
    request: Request,
    warnings: Vec<Diagnostic>,
    /// The hand model for the log, where it is among the files, and why it is loaded.
    hand_model: Option<HandModel>,
}

impl Rules {
    /// The rules that the command line uses for a log when none are named: the shipped `contact.rules`, for logs of two hands
    /// `bimanual.rules`, and `failures.rules`, with the hand model for what the log measures, and the hand model and the params that the binding of
    /// the log names instead.
    ///
    /// # Errors
    /// [`ErrorKind::Rules`](teachtree_base::error::ErrorKind::Rules), when a param or the hand model of the binding does not fit the rules.
    pub fn for_log(log: &Log) -> Result<Self, Error> {
        Self::options().for_log(log)
    }

    /// Options to load rules with: files, texts, a hand model, params.
    pub fn options() -> RulesOptions {
        RulesOptions::default()
    }

    /// Finds segments and tasks in a log. Constant memory is needed for a log that is read in windows ([`Log`]).
    ///
    /// # Errors
    /// [`ErrorKind::Mismatch`](teachtree_base::error::ErrorKind::Mismatch), when the log lacks a channel that the rules read, or is sampled too
    /// slowly for a duration of the rules; what is wrong with the rows of the log.
    pub fn analyze(&self, log: &Log) -> Result<Analysis, Error> {
        Analysis::new(self, log)
    }

    /// Lists which primitives these rules can detect in a log, by track, and which they cannot, with the reason. Reads the log into memory.
    ///
    /// # Errors
    /// [`ErrorKind::Mismatch`](teachtree_base::error::ErrorKind::Mismatch), when the log lacks a channel that the rules require; what is wrong with
    /// the rows of the log.
    pub fn observability(&self, log: &Log) -> Result<Observability, Error> {
        let opened = log.opened()?;
        let frames = run::frames(&self.0.rules, opened)?;
        let contents = LogContents::new(opened, log.binding().is_some());
        let mut tracks = observability::tracks(&lower(&self.0.rules), &frames, &contents);
        observability::add_relabeled(&self.0.rules, &mut tracks);
        Ok(Observability { tracks, issues: frames.issues })
    }

    /// The warnings about the rules: likely mistakes in rules that can run.
    pub fn warnings(&self) -> &[Diagnostic] {
        &self.0.warnings
    }

    /// The files that were read, in order, as they were named; shipped ones as `rules/contact.rules`.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        self.0.rules.sources.files.iter().map(|file| file.name.as_str())
    }

    /// Why the hand model of these rules was loaded for a log: `hand_gripper.rules, since the log has right.gripper.closed`. `None` of rules that
    /// were loaded without a log, or that need no hand model.
    pub fn hand_model(&self) -> Option<String> {
        self.0.hand_model.as_ref().map(ToString::to_string)
    }

    /// Those of the [`files`](Self::files) that are neither shipped nor unchanged copies of shipped ones.
    pub fn own_files(&self) -> impl Iterator<Item = &str> {
        let is_shipped = |name: &str, text: &str| {
            SHIPPED.iter().any(|(file, shipped)| Path::new(name).ends_with(file) && *shipped == text)
        };
        let own = self.0.rules.sources.files.iter().filter(move |file| !is_shipped(&file.name, &file.text));
        own.map(|file| file.name.as_str())
    }

    /// The names of the primitives, in order of declaration.
    pub fn primitives(&self) -> impl Iterator<Item = &str> {
        self.0.rules.primitives.iter().map(|primitive| primitive.name.as_str())
    }

    /// The names of the tasks, by priority: the first that matches names a task. Those that are made of tasks are not among them.
    pub fn tasks(&self) -> impl Iterator<Item = &str> {
        self.0.rules.tasks.iter().map(|task| task.name.as_str())
    }

    /// The names of the tasks that are failures (`is failure`), those that are made of tasks after the others. Every other task is a success.
    pub fn failures(&self) -> impl Iterator<Item = &str> {
        let rules = &self.0.rules;
        let tasks = rules.tasks.iter().filter(|task| task.failure).map(|task| task.name.as_str());
        tasks.chain(rules.composites.iter().filter(|task| task.failure).map(|task| task.name.as_str()))
    }

    /// Returns the SHA-256 of all texts and of the values of all params, its first 32 hexadecimal digits. It does not depend on the paths of the files.
    pub fn digest(&self) -> String {
        self.0.rules.digest()
    }

    /// The decision trees as a picture, SVG.
    pub fn svg(&self) -> String {
        let rules = &self.0.rules;
        let trees: Vec<_> = rules.trees.iter().map(|tree| diagram::outline(rules, tree, None)).collect();
        diagram::trees(&trees, DiagramFormat::Svg)
    }

    /// Returns the rules with other values of params, as `(name, value with unit)`; `None` for invalid values.
    pub(crate) fn with_params(&self, params: &[(String, String)]) -> Option<Self> {
        let mut request = self.0.request.clone();
        request.overrides.extend_from_slice(params);
        Self::load_for(&request, self.0.hand_model.clone()).ok()
    }

    /// The channels of a log without a tree: rules by which a log is shown when its own rules do not run.
    pub(crate) fn of_channels() -> Result<Self, Error> {
        let texts = vec![("channels".into(), "use \"stream.rules\"\n".into())];
        Self::load(&Request { texts, ..Request::default() })
    }

    /// Reads tasks that a recording should contain: `peg_in_hole x 2, turn_screw`.
    pub(crate) fn expected_tasks(&self, tasks: &str, place: String, kind: ErrorKind) -> Result<ExpectedTasks, Error> {
        let wrong = |message: String| Error::new(InputError::new(place.as_str(), message), kind);
        let expected = ExpectedTasks::parse(tasks).map_err(wrong)?;
        expected.check(&self.0.rules).map_err(wrong)?;
        Ok(expected)
    }

    pub(crate) fn load(request: &Request) -> Result<Self, Error> {
        Self::load_for(request, None)
    }

    /// Loads rules for a log, with the reason for its hand model.
    fn load_for(request: &Request, hand_model: Option<HandModel>) -> Result<Self, Error> {
        let loaded = language::load(request);
        let sources = Arc::new(loaded.sources);
        let errors = Diagnostic::all(&loaded.diagnostics, &sources, Severity::Error);
        match loaded.rules {
            Some(rules) if errors.is_empty() => {
                let warnings = Diagnostic::all(&loaded.diagnostics, &sources, Severity::Warning);
                let hand_model = hand_model.filter(|model| is_loaded(&rules, &model.file));
                let mut request = request.clone();
                request.overrides.retain(|(name, _)| rules.params.iter().any(|param| param.name == *name));
                Ok(Self(Arc::new(Inner { rules, request, warnings, hand_model })))
            }
            _ => Err(Error::rules(errors)),
        }
    }
}

/// Whether a hand model is among the files of rules: they need none where their signals are implemented.
fn is_loaded(rules: &language::Rules, hand_file: &str) -> bool {
    let name = language::shipped(hand_file).map_or(hand_file, |(name, _)| name);
    rules.sources.files.iter().any(|file| Path::new(&file.name).ends_with(name))
}

impl fmt::Debug for Rules {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let files: Vec<&str> = self.files().collect();
        f.debug_struct("Rules").field("files", &files).field("params", &self.params()).finish_non_exhaustive()
    }
}

/// The options for loading rules. Made by [`Rules::options`].
#[derive(Clone, Debug, Default)]
pub struct RulesOptions {
    files: Vec<PathBuf>,
    texts: Vec<(String, String)>,
    hand_file: Option<String>,
    params: Vec<(String, String)>,
    /// The places in files of params that are not named by the caller.
    param_places: BTreeMap<String, String>,
    buffers: BTreeMap<PathBuf, String>,
    without_failures: bool,
}

impl RulesOptions {
    /// Leaves `failures.rules` out of the default rules, as `teachtree retarget` does: a robot program contains the intended motion, without slips. The
    /// binding may set its params and name its primitives in signals; they have no effect.
    #[must_use]
    pub fn without_failures(mut self) -> Self {
        self.without_failures = true;
        self
    }

    /// Adds a rule file: a path, or the name of a shipped file such as `bimanual.rules`.
    #[must_use]
    pub fn file(mut self, path: impl Into<PathBuf>) -> Self {
        self.files.push(path.into());
        self
    }

    /// Adds a text of rules, read after the files; `name` stands in messages. What the text uses is looked up among the shipped files:
    /// `use "contact.rules"`.
    #[must_use]
    pub fn text(mut self, name: impl Into<String>, text: impl Into<String>) -> Self {
        self.texts.push((name.into(), text.into()));
        self
    }

    /// The hand model, which implements the abstract signals of the rules for a hardware: a path, or the name of a shipped file such as
    /// `hand_flags.rules`. It wins over the one that the binding of a log names, and over the one that is chosen by the quantities of the log.
    #[must_use]
    pub fn hand_file(mut self, name: impl AsRef<Path>) -> Self {
        self.hand_file = Some(name.as_ref().display().to_string());
        self
    }

    /// Overrides a param; the value has its unit: `.param("touch_on", "0.1 N")`. It wins over the value that the binding of a log names.
    #[must_use]
    pub fn param(mut self, name: impl Into<String>, value: impl Into<String>) -> Self {
        self.params.push((name.into(), value.into()));
        self
    }

    /// Loads the rules for a log: where nothing else is said, with the files for its number of hands, the hand model and params of its
    /// binding, and otherwise the hand model for what it measures.
    ///
    /// # Errors
    /// [`ErrorKind::Rules`](teachtree_base::error::ErrorKind::Rules), with the diagnostics.
    pub fn for_log(self, log: &Log) -> Result<Rules, Error> {
        let without_failures = self.without_failures;
        let hand_model = self.hand_model_for(log);
        let rules = Rules::load_for(&self.request_for(log), hand_model)?;
        if !without_failures {
            signals::check_binding(log, &rules)?;
        }
        Ok(rules)
    }

    /// Loads the rules without a log; `contact.rules` and `failures.rules` where none are named.
    ///
    /// # Errors
    /// [`ErrorKind::Rules`](teachtree_base::error::ErrorKind::Rules), with the diagnostics.
    pub fn load(self) -> Result<Rules, Error> {
        Rules::load(&self.request(Vec::new()))
    }

    /// Lists all errors and warnings of the rules, in the order of files and lines, as `teachtree check` does. Rules without a tree, a part for
    /// other files, are only worth a warning here.
    pub fn check(self) -> Vec<Diagnostic> {
        let request = Request { needs_tree: false, ..self.request(Vec::new()) };
        let loaded = language::load(&request);
        let sources = Arc::new(loaded.sources);
        let of = |severity| Diagnostic::all(&loaded.diagnostics, &sources, severity);
        [of(Severity::Error), of(Severity::Warning)].concat()
    }

    /// Returns the options with a default hand model and default params.
    pub(crate) fn or_of_binding<'a>(
        mut self,
        hand_file: Option<&str>,
        params: impl Iterator<Item = (&'a str, &'a str, String)>,
    ) -> Self {
        self.hand_file = self.hand_file.or_else(|| hand_file.map(str::to_string));
        let (params, places): (Vec<_>, Vec<_>) = params
            .map(|(name, value, place)| ((name.to_string(), value.to_string()), (name.to_string(), place)))
            .unzip();
        self.add_places(places.into_iter().collect());
        // A later value of a param wins over an earlier one.
        self.params.splice(0..0, params);
        self
    }

    /// The hand model that is loaded for a log, and why.
    fn hand_model_for(&self, log: &Log) -> Option<HandModel> {
        let named = |file: &String| HandModel { file: file.clone(), reason: "as it is named with the rules".into() };
        self.hand_file.as_ref().map(named).or_else(|| log.chosen_hand_model())
    }

    /// Its rule files; those of `teachtree.yaml` if it names none.
    fn files_of(&self, settings: &ProjectSettings) -> Vec<PathBuf> {
        let is_empty = self.files.is_empty() && self.texts.is_empty();
        let of_project = settings.rules.as_ref().filter(|_| is_empty).map(|rules| rules.value.clone());
        of_project.unwrap_or_else(|| self.files.clone())
    }

    /// Adds the places of params, except those of params that have a value already, which wins.
    fn add_places(&mut self, places: BTreeMap<String, String>) {
        let is_new = |name: &str| self.params.iter().all(|(own, _)| own != name);
        let places: Vec<_> = places.into_iter().filter(|(name, _)| is_new(name)).collect();
        self.param_places.extend(places);
    }

    fn request(self, params: Vec<(String, String)>) -> Request {
        let Self { files, texts, hand_file, params: own, param_places: override_places, buffers, without_failures } =
            self;
        // A later value of a param wins over an earlier one.
        let overrides = params.into_iter().chain(own).collect();
        Request {
            files,
            texts,
            hand_file,
            overrides,
            override_places,
            buffers,
            two_hands: false,
            without_failures,
            needs_tree: true,
        }
    }
}

/// The methods of [`Rules`] for the other crates of the workspace; not a part of the public interface.
#[doc(hidden)]
pub trait RulesInternals {
    /// The rule set of the language.
    fn set(&self) -> &language::Rules;
    /// The params that were set, with their values as they were written.
    fn params(&self) -> &[(String, String)];
}

impl RulesInternals for Rules {
    fn set(&self) -> &language::Rules {
        &self.0.rules
    }

    fn params(&self) -> &[(String, String)] {
        &self.0.request.overrides
    }
}

/// The methods of [`RulesOptions`] for the other crates of the workspace; not a part of the public interface.
#[doc(hidden)]
pub trait RulesOptionsInternals: Sized {
    /// Unsaved texts that replace files on disk, by canonical path.
    #[must_use]
    fn buffers(self, buffers: BTreeMap<PathBuf, String>) -> Self;
    /// What is loaded for a log.
    fn request_for(self, log: &Log) -> Request;
    /// The same with what they do not name from `teachtree.yaml`, for logs that are not opened as a whole.
    fn of_project(self, settings: &ProjectSettings) -> Self;
}

impl RulesOptionsInternals for RulesOptions {
    fn buffers(mut self, buffers: BTreeMap<PathBuf, String>) -> Self {
        self.buffers = buffers;
        self
    }

    fn of_project(mut self, settings: &ProjectSettings) -> Self {
        self.files = self.files_of(settings);
        self.hand_file = self.hand_file.or_else(|| settings.hand_file.as_ref().map(|setting| setting.value.clone()));
        self.add_places(settings.params.iter().map(|(param, it)| (param.clone(), it.place.clone())).collect());
        let params = settings.params.iter().map(|(param, setting)| (param.clone(), setting.value.clone()));
        self.params = params.chain(self.params).collect();
        self
    }

    fn request_for(mut self, log: &Log) -> Request {
        self.hand_file = self.hand_model_for(log).map(|model| model.file);
        self.files = self.files_of(log.project_settings());
        self.add_places(log.param_places());
        Request { two_hands: log.hands().len() > 1, ..self.request(log.params()) }
    }
}
