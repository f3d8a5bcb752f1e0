//! A recording in memory: by the rules of the files, and by the rules of now.
//!
//! Rules that have errors, or that need a channel which the recording lacks, do not run. The recording is shown nevertheless, without segments, with the
//! files of such rules and the names that they declare.

use super::labels::{self, Labels, Line};
use super::rule_comparison::OtherAnalysis;
use super::score;
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use teachtree_analysis::TrackId;
use teachtree_analysis::score::{KnownNames, Tally};
use teachtree_base::diagnostic::Sources;
use teachtree_base::error::ErrorKind;
use teachtree_language::{self as language, CheckedSource, Request};
use teachtree_logs::allowed_folders::LogFolders;
use teachtree_session::{Analysis, Error, Log};
use teachtree_session::{AnalysisInternals, ErrorInternals, LogInternals, RulesInternals};

/// What is analyzed by which rules.
pub struct RuleState<'a> {
    /// Of which generation and epoch the rules are.
    pub generation: u64,
    pub epoch: u64,
    /// Params and texts that differ from the files.
    pub params: &'a BTreeMap<String, String>,
    pub edits: &'a BTreeMap<String, String>,
}

/// A recording in memory.
pub struct LoadedRecording {
    /// Of which generation and epoch `now` is.
    pub generation: u64,
    pub epoch: u64,
    /// By the rules as they are in the files.
    pub base: RuleOutcome,
    /// By the rules with the texts and params that were changed.
    pub now: RuleOutcome,
    /// By the rules that these are held against, or why there is nothing.
    pub other: Option<OtherAnalysis>,
    /// The folders that the files of the recording must be in.
    pub folders: LogFolders,
}

/// What came of rules.
#[derive(Clone)]
pub struct RuleOutcome {
    /// What they found; no segments where they do not run.
    pub shown: Analysis,
    trouble: Option<Arc<RuleFailure>>,
}

/// Rules that do not run.
struct RuleFailure {
    error: Error,
    survey: CheckedSource,
}

impl RuleOutcome {
    /// What rules found in a log, which were loaded by `request`.
    pub fn of(found: Result<Analysis, Error>, log: &Log, request: &Request) -> Result<Self, Error> {
        let error = match found {
            Ok(shown) => return Ok(Self { shown, trouble: None }),
            Err(error) => error,
        };
        // Issues of the log do not depend on rules.
        let shown = Analysis::without_rules(log).map_err(|_| error.clone())?;
        Ok(Self { shown, trouble: Some(Arc::new(RuleFailure { error, survey: language::survey(request) })) })
    }

    /// What the rules found.
    ///
    /// # Errors
    /// Why they do not run.
    pub fn runs(&self) -> Result<&Analysis, Error> {
        self.trouble.as_ref().map_or(Ok(&self.shown), |trouble| Err(trouble.error.clone()))
    }

    /// The rules, as far as they could be read.
    pub fn set(&self) -> &language::Rules {
        self.trouble.as_ref().map_or(self.shown.rules().set(), |trouble| &trouble.survey.rules)
    }

    /// The files of the rules.
    pub fn sources(&self) -> &Sources {
        self.trouble.as_ref().map_or(&self.shown.rules().set().sources, |trouble| &trouble.survey.sources)
    }
}

impl LoadedRecording {
    /// The log.
    pub fn log(&self) -> &Log {
        self.now.shown.log()
    }

    /// How many values it has, about.
    pub fn values(&self) -> usize {
        let recording = self.log().opened().map(|opened| &opened.recording);
        recording.map_or(0, |recording| 2 * recording.columns.len() * recording.time.len())
    }

    /// The only track, which labels that name none are about.
    pub fn only(&self) -> Option<TrackId> {
        self.now.shown.found().only()
    }

    /// Returns the labels.
    ///
    /// # Errors
    /// The label file cannot be read.
    pub fn labels(&self) -> Result<Labels, Error> {
        let read = labels::read(self.log().opened()?, self.only(), &self.folders.beside);
        read.map_err(|error| Error::new(error, ErrorKind::Argument))
    }

    /// What is known of the label file.
    pub fn agreement(&self) -> Agreement {
        let read = || {
            let labels = self.labels()?;
            let tally = |rules: &RuleOutcome| {
                rules.runs().ok().map_or(Ok(None), |rules| score::tally(rules, &self.folders.beside))
            };
            let now = tally(&self.now)?;
            let is_same = self.base.shown.meta() == self.now.shown.meta();
            let base = if is_same { now.clone() } else { tally(&self.base)? };
            let pinned = labels.lines.iter().filter(|line| line.pinned).count();
            let known = KnownNames::new(self.now.set());
            let is_new = |line: &&Line| line.kind == "primitive" && score::is_new(&line.label, &known);
            let new: BTreeSet<String> = labels.lines.iter().filter(is_new).map(|line| line.label.clone()).collect();
            Ok::<_, Error>(Agreement { version: labels.version, pinned, new, now, base, error: None })
        };
        read().unwrap_or_else(|error| Agreement { error: Some(error.to_string()), ..Agreement::default() })
    }
}

/// What is known of the label file of a recording.
#[derive(Clone, Default)]
pub struct Agreement {
    /// The version of the file; empty without a file.
    pub version: String,
    /// How many of its lines a person set.
    pub pinned: usize,
    /// The primitives among its labels that the rules do not have yet.
    pub new: BTreeSet<String>,
    /// By the rules of now.
    pub now: Option<Tally>,
    /// By the rules as they are in the files.
    pub base: Option<Tally>,
    /// Why the labels cannot be scored.
    pub error: Option<String>,
}

impl Agreement {
    /// The keys of a row of the list.
    pub fn put(&self, fields: &mut Map<String, Value>) {
        fields.insert("label_version".into(), json!(self.version));
        fields.insert("labels".into(), json!(self.pinned));
        fields.insert("new".into(), json!(self.new));
        fields.insert("score".into(), json!(self.now.as_ref().map(score::brief)));
        fields.insert("base".into(), json!(self.base.as_ref().map(score::brief)));
        if let Some(error) = &self.error {
            fields.insert("score_error".into(), json!(error));
        }
    }

    /// By how much more of the time the rules agree with the labels now, 0 to 1.
    pub fn gain(&self) -> Option<f64> {
        Some(self.now.as_ref()?.accuracy()? - self.base.as_ref()?.accuracy()?)
    }
}
