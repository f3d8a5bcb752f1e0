//! The result of an analysis: tracks with segments and tasks, and its forms as JSON, CSV, text and HTML.

use super::error::Error;
use super::explain::{Explanations, Question};
use super::log::Log;
use super::log_contents::LogContents;
use super::observability::{self, TrackObservability};
use super::rules::Rules;
use super::run::Run;
use super::score::{Labels, Score};
use super::streaming;
use super::success_fields;
use super::table::FrameTable;
use super::tracks::{Segment, Task, Track};
use crate::{ErrorInternals, LogInternals, RulesInternals};
use std::fmt;
use std::sync::OnceLock;
use teachtree_analysis::json::Meta;
use teachtree_analysis::outcome::Outcome;
use teachtree_analysis::{self as analysis, Analysis as AnalysisResult, Track as Lane, TrackId, explain};
use teachtree_base::error::ErrorKind;
use teachtree_base::meaning::Meaning;
use teachtree_language::graph::lower;
use teachtree_logs::issue::Issue;
use teachtree_report::{self as report, Style};

/// The analysis of a log.
#[derive(Clone)]
pub struct Analysis {
    found: AnalysisResult,
    meta: Meta,
    rules: Rules,
    log: Log,
    /// The data for explanations and the report; computed on demand if the log was read in windows.
    run: OnceLock<Run>,
}

impl Analysis {
    /// Finds the segments and tasks of a log, which is expected to contain the tasks that its binding names.
    pub(crate) fn new(rules: &Rules, log: &Log) -> Result<Self, Error> {
        Self::by(rules, log)?.with_binding_expectation()
    }

    fn by(rules: &Rules, log: &Log) -> Result<Self, Error> {
        let of = |found, run, zero_stamp_s| {
            let meta = meta_of(rules, log, zero_stamp_s);
            Self { found, meta, rules: rules.clone(), log: log.clone(), run }
        };
        if let Some(flow) = log.flow()
            && let Some((found, zero_stamp_s)) = streaming::analyze(rules.set(), flow)
        {
            return Ok(of(found, OnceLock::new(), zero_stamp_s));
        }
        let opened = log.opened()?;
        let (run, found) = Run::analyzed(rules.set(), opened, log.binding().is_some())?;
        let mut analysis = of(found, OnceLock::from(run), opened.zero_stamp_s);
        analysis.compare_success_fields()?;
        Ok(analysis)
    }

    /// Compares the outcome with the success fields of the log; one that is read in windows has none.
    fn compare_success_fields(&mut self) -> Result<(), Error> {
        if self.run.get().is_some() {
            success_fields::compare(&mut self.found, &self.log.opened()?.success_fields);
        }
        Ok(())
    }

    /// Returns the analysis with the expected tasks of the log's binding.
    fn with_binding_expectation(self) -> Result<Self, Error> {
        let Some((text, place)) = self.log.expected() else { return Ok(self) };
        self.expecting_at(&text, place, ErrorKind::Binding)
    }

    /// Expects these tasks of the recording, in order, instead of those that its binding names: `peg_in_hole x 2, turn_screw`.
    ///
    /// # Errors
    /// [`ErrorKind::Argument`]: a text that is not a list of tasks, or a task that the rules lack or that is a failure.
    pub fn expecting(self, tasks: &str) -> Result<Self, Error> {
        self.expecting_at(tasks, "expected tasks".into(), ErrorKind::Argument)
    }

    fn expecting_at(mut self, tasks: &str, place: String, kind: ErrorKind) -> Result<Self, Error> {
        self.found.expected = self.rules.expected_tasks(tasks, place, kind)?;
        self.compare_success_fields()?;
        Ok(self)
    }

    /// Whether the recording is a success, with the reasons.
    pub fn outcome(&self) -> Outcome {
        self.found.outcome()
    }

    /// The tracks that the log has: left, right, both.
    pub fn tracks(&self) -> impl Iterator<Item = Track<'_>> {
        self.found.tracks.iter().map(|inner| Track { inner })
    }

    /// The track of a hand or of both.
    pub fn track(&self, who: TrackId) -> Option<Track<'_>> {
        self.found.track(who).map(|inner| Track { inner })
    }

    /// The tasks of all tracks, by the time when they start.
    pub fn tasks(&self) -> Vec<Task<'_>> {
        let mut tasks: Vec<Task> = self.tracks().flat_map(Track::tasks).collect();
        tasks.sort_by(|a, b| a.start_s().total_cmp(&b.start_s()));
        tasks
    }

    /// The segments of all tracks after relabeling, by the time when they start.
    pub fn segments(&self) -> Vec<Segment<'_>> {
        let mut segments: Vec<Segment> = self.tracks().flat_map(Track::segments).collect();
        segments.sort_by(|a, b| a.start_s().total_cmp(&b.start_s()));
        segments
    }

    /// Returns the issues of the log with their treatment, and, for a log with a binding, the primitives that cannot be detected in it.
    pub fn issues(&self) -> &[Issue] {
        &self.found.issues
    }

    /// Number of frames.
    pub fn frame_count(&self) -> usize {
        self.found.frames
    }

    /// Frames per second.
    pub fn rate_hz(&self) -> f64 {
        self.found.rate_hz
    }

    /// When the log starts, s.
    pub fn start_s(&self) -> f64 {
        self.found.start_s
    }

    /// When the log ends, s.
    pub fn end_s(&self) -> f64 {
        self.found.end_s
    }

    /// The rules that were run.
    pub fn rules(&self) -> &Rules {
        &self.rules
    }

    /// The log that was analyzed.
    pub fn log(&self) -> &Log {
        &self.log
    }

    /// Explains why tracks have their labels at a time, and why not others. Reads the log into memory.
    ///
    /// # Errors
    /// [`ErrorKind::Argument`]: a time outside the log, a track without a tree, a primitive that no tree returns.
    pub fn explain(&self, question: &Question) -> Result<Explanations, Error> {
        Explanations::new(self, question)
    }

    /// Labels, tasks and objects as a table with a row per frame, with the values of signals, latches and channels of the rules: `near` for each
    /// hand, `left.near` for one. Reads the log into memory.
    ///
    /// # Errors
    /// [`ErrorKind::Argument`]: a name that the rules do not have.
    pub fn frames(&self, signals: &[&str]) -> Result<FrameTable, Error> {
        let signals: Vec<String> = signals.iter().map(|name| (*name).to_string()).collect();
        FrameTable::new(self, &signals)
    }

    /// Compares the segments after relabeling, and the tasks, with labels. Reads the log into memory.
    ///
    /// # Errors
    /// Labels that are missing or cannot be read, or that name what the rules do not have.
    pub fn score(&self, labels: &Labels) -> Result<Score, Error> {
        Score::new(self, labels)
    }

    /// Adds the confidence of each boundary and the stability of each task, from variations of params and log (docs/formats.md). Takes about ten times as long as the
    /// analysis, and reads the log into memory.
    ///
    /// # Errors
    /// What is wrong with the log, as for [`Rules::analyze`].
    pub fn with_confidence(mut self) -> Result<Self, Error> {
        let mut found = self.found.clone();
        super::confidence::add(&mut found, &self.rules, self.run()?, self.log.opened()?)?;
        self.found = found;
        Ok(self)
    }

    /// The analysis as JSON, schema `teachtree.analysis/2` (docs/formats.md).
    pub fn json(&self) -> String {
        analysis::json::json(&self.found, &self.meta)
    }

    /// Returns the JSON on one line, for files with an analysis per line.
    pub fn json_line(&self) -> String {
        analysis::json::line(&self.found, &self.meta)
    }

    /// The segments and tasks as a CSV table.
    ///
    /// # Errors
    /// [`ErrorKind::Internal`], when the table cannot be written.
    pub fn csv(&self) -> Result<String, Error> {
        analysis::csv::csv(&self.found, &self.meta).map_err(|error| Error::new(error, ErrorKind::Internal))
    }

    /// The segments and tasks as a file of ELAN, `.eaf`: for each track a tier of primitives, one of their objects, and one of tasks.
    pub fn eaf(&self) -> String {
        analysis::eaf::eaf(&self.found, &self.meta)
    }

    /// The timeline and lists for a terminal.
    pub fn text(&self, style: Style) -> String {
        report::text(&self.found, &self.meta, style)
    }

    /// The report: a page for browsers that needs no network. Reads the log into memory.
    ///
    /// # Errors
    /// What is wrong with the log, as for [`Rules::analyze`].
    pub fn html(&self) -> Result<String, Error> {
        let recording = &self.log.opened()?.recording;
        report::html(&self.explained()?, recording, &self.meta).map_err(|error| Error::new(error, ErrorKind::Mismatch))
    }
}

/// What was analyzed, by which rules.
fn meta_of(rules: &Rules, log: &Log, zero_stamp_s: f64) -> Meta {
    Meta {
        log: log.name(),
        name: log.short_name(),
        zero_stamp_s,
        binding: log.binding().map(|path| path.display().to_string()),
        rules: rules.files().map(str::to_string).collect(),
        hand_model: rules.hand_model(),
        digest: rules.digest(),
        params: rules.params().to_vec(),
    }
}

impl fmt::Debug for Analysis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Analysis").field("found", &self.found).field("meta", &self.meta).finish_non_exhaustive()
    }
}

/// The methods of [`Analysis`] for the other crates of the workspace; not a part of the public interface.
#[doc(hidden)]
pub trait AnalysisInternals: Sized {
    /// Analyzes the same log by other rules. Frames that both rules read are not derived again.
    ///
    /// # Errors
    /// As [`Rules::analyze`].
    fn by_rules(&self, rules: &Rules) -> Result<Self, Error>;
    /// The analysis as if the log had no fields that say whether it succeeded.
    fn without_success_fields(self) -> Self;
    /// A log without rules: a track for each hand and for both, without segments.
    ///
    /// # Errors
    /// What is wrong with the log.
    fn without_rules(log: &Log) -> Result<Self, Error>;
    /// Returns the analysis as plain data.
    fn found(&self) -> &AnalysisResult;
    /// What was analyzed, by which rules.
    fn meta(&self) -> &Meta;
    /// Returns the frames of the rules and the leaves of their trees.
    fn run(&self) -> Result<&Run, Error>;
    /// The tracks in which the rules can detect that an object is carried; all of them where no primitive says `does carry`. Reads the log into memory.
    ///
    /// # Errors
    /// What is wrong with the rows of the log.
    fn carries(&self) -> Result<Vec<TrackId>, Error>;
    /// Everything that explanations are made of.
    fn explained(&self) -> Result<explain::AnalyzedRecording<'_>, Error>;
}

impl AnalysisInternals for Analysis {
    fn by_rules(&self, rules: &Rules) -> Result<Self, Error> {
        let log = &self.log;
        let (run, found) = self.run()?.again(rules.set(), log.opened()?, log.binding().is_some())?;
        let (meta, run) = (meta_of(rules, log, self.meta.zero_stamp_s), OnceLock::from(run));
        let mut analysis = Self { found, meta, rules: rules.clone(), log: log.clone(), run };
        analysis.compare_success_fields()?;
        analysis.with_binding_expectation()
    }

    fn without_success_fields(mut self) -> Self {
        success_fields::compare(&mut self.found, &[]);
        self
    }

    fn without_rules(log: &Log) -> Result<Self, Error> {
        let rules = Rules::of_channels()?;
        let mut analysis = Self::by(&rules, log)?;
        let hands = log.hands();
        let both = (hands.len() > 1).then_some(TrackId::Both);
        analysis.found.tracks = hands.into_iter().map(TrackId::Hand).chain(both).map(Lane::new).collect();
        Ok(analysis)
    }

    fn found(&self) -> &AnalysisResult {
        &self.found
    }

    fn meta(&self) -> &Meta {
        &self.meta
    }

    fn run(&self) -> Result<&Run, Error> {
        if self.run.get().is_none() {
            let run = Run::new(self.rules.set(), self.log.opened()?)?;
            // Another thread may have been faster; both made the same.
            let _ = self.run.set(run);
        }
        self.run.get().ok_or_else(|| Error::internal("a run of rules is lost"))
    }

    fn carries(&self) -> Result<Vec<TrackId>, Error> {
        let primitives = &self.found.primitives;
        let is_carry = |name: &String| primitives.does(name) == Some(Meaning::Carry);
        let contents = LogContents::new(self.log.opened()?, self.log.binding().is_some());
        let tracks = observability::tracks(&lower(self.rules.set()), &self.run()?.frames, &contents);
        let of = |track: &TrackObservability| {
            let lost = track.undetectable.iter().flat_map(|lack| &lack.primitives).any(is_carry);
            !lost || track.detectable.iter().any(is_carry)
        };
        Ok(tracks.iter().filter(|track| of(track)).map(|track| track.track).collect())
    }

    fn explained(&self) -> Result<explain::AnalyzedRecording<'_>, Error> {
        let Run { frames, leaves } = self.run()?;
        Ok(explain::AnalyzedRecording { rules: self.rules.set(), frames, leaves, analysis: &self.found })
    }
}
