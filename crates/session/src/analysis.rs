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
use crate::{ErrorInternals, LogInternals, RulesInternals};
use std::fmt;
use std::ops::Range;
use std::sync::OnceLock;
use teachtree_analysis::json::Meta;
use teachtree_analysis::outcome::Outcome;
use teachtree_analysis::{
    self as analysis, Analysis as AnalysisResult, CompositeSpan, Confidence, Segment as Stretch, TaskSpan,
    Track as Lane, TrackId, explain,
};
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

/// The segments and tasks of one hand, or the coordination of both.
#[derive(Clone, Copy, Debug)]
pub struct Track<'a> {
    inner: &'a Lane,
}

impl<'a> Track<'a> {
    /// Whose it is.
    pub fn who(self) -> TrackId {
        self.inner.who
    }

    /// The tasks, in order of time; none for both hands, whose coordination is part of each hand's tasks.
    pub fn tasks(self) -> impl Iterator<Item = Task<'a>> {
        let who = self.who();
        self.inner.tasks.iter().map(move |span| Task { who, span })
    }

    /// The tasks that are made of tasks, in order of time.
    pub fn composites(self) -> impl Iterator<Item = Composite<'a>> {
        let who = self.who();
        self.inner.composites.iter().map(move |span| Composite { who, span })
    }

    /// The segments after relabeling, in order of time. Those of a hand leave out no frame, except in gaps of the log.
    pub fn segments(self) -> impl Iterator<Item = Segment<'a>> {
        let who = self.who();
        self.inner.relabeled.iter().map(move |inner| Segment { who, inner })
    }

    /// The segments as the trees returned them, settled, before relabeling.
    pub fn raw_segments(self) -> impl Iterator<Item = Segment<'a>> {
        let who = self.who();
        self.inner.segments.iter().map(move |inner| Segment { who, inner })
    }
}

/// A task that is made of tasks: some tasks of a hand, one after the other.
#[derive(Clone, Copy, Debug)]
pub struct Composite<'a> {
    who: TrackId,
    span: &'a CompositeSpan,
}

impl<'a> Composite<'a> {
    pub(crate) const fn of(who: TrackId, span: &'a CompositeSpan) -> Self {
        Self { who, span }
    }

    /// Its name in the rules.
    pub fn name(self) -> &'a str {
        &self.span.task
    }

    /// Whether the rules declare it as a failure (`is failure`). Every other one is a success.
    pub fn is_failure(self) -> bool {
        self.span.failure
    }

    /// Whose it is.
    pub fn track(self) -> TrackId {
        self.who
    }

    /// The names of its tasks, in order of time; `unknown` ones between them are among them.
    pub fn parts(self) -> &'a [String] {
        &self.span.parts
    }

    /// Its tasks, by their positions in [`Track::tasks`].
    pub fn tasks(self) -> Range<usize> {
        self.span.tasks.clone()
    }

    /// When it starts, s.
    pub fn start_s(self) -> f64 {
        self.span.start_s
    }

    /// When it ends, s.
    pub fn end_s(self) -> f64 {
        self.span.end_s
    }
}

/// A named task: some segments of a hand, one after the other.
///
/// `Display` writes one line: `right pick_and_place right_cube, 0.310 – 4.820 s`.
#[derive(Clone, Copy, Debug)]
pub struct Task<'a> {
    who: TrackId,
    span: &'a TaskSpan,
}

impl<'a> Task<'a> {
    pub(crate) const fn of(who: TrackId, span: &'a TaskSpan) -> Self {
        Self { who, span }
    }

    /// The name of the task in the rules, or `unknown` where something was handled in a way that no task of the rules describes.
    pub fn name(self) -> &'a str {
        &self.span.task
    }

    /// Whether the rules declare it as a failure (`is failure`). Every other named task is a success; `unknown` is neither.
    pub fn is_failure(self) -> bool {
        self.span.failure
    }

    /// Whose it is.
    pub fn track(self) -> TrackId {
        self.who
    }

    /// The frames `[start, end)`, counted from the first frame of the log.
    pub fn frames(self) -> Range<usize> {
        self.span.frames.clone()
    }

    /// When it starts, s.
    pub fn start_s(self) -> f64 {
        self.span.start_s
    }

    /// When it ends, s.
    pub fn end_s(self) -> f64 {
        self.span.end_s
    }

    /// Which attempt at its object and target it belongs to, from 1: one begins when the hand regains the object after a failed task.
    pub fn attempt(self) -> usize {
        self.span.attempt
    }

    /// The object that it is about: that of its key segments, `None` where the log has no object, or does not say which.
    pub fn object(self) -> Option<&'a str> {
        self.span.subject.object.as_deref()
    }

    /// The body that the object is in or against in its key segments.
    pub fn partner(self) -> Option<&'a str> {
        self.span.subject.partner.as_deref()
    }

    /// The rows of the log `[start, end)`, counted from 0: those of the file, also where rows were left out or frames were resampled.
    pub fn rows(self) -> Range<usize> {
        self.span.rows.clone()
    }

    /// The other tasks of the rules that match here too, by priority.
    pub fn also(self) -> &'a [String] {
        &self.span.secondary
    }

    /// Whether its beginning is cut off, by the start of the log or by a gap.
    pub fn is_cut_at_start(self) -> bool {
        self.span.open_start
    }

    /// Whether its end is cut off, by the end of the log or by a gap.
    pub fn is_cut_at_end(self) -> bool {
        self.span.open_end
    }

    /// The share of the variations with a task of this name, if [`Analysis::with_confidence`] was called. It is not a probability that the task is right.
    pub fn stability(self) -> Option<f64> {
        self.span.stability
    }

    /// Its segments after relabeling.
    pub fn segments(self) -> impl Iterator<Item = Segment<'a>> {
        let who = self.who;
        self.span.segments.iter().map(move |inner| Segment { who, inner })
    }
}

impl fmt::Display for Task<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let TaskSpan { task, subject, start_s, end_s, .. } = self.span;
        write!(f, "{} {task}{}, {start_s:.3} – {end_s:.3} s", self.who, subject.suffix())?;
        match report::remarks(self.span).as_str() {
            "" => Ok(()),
            remarks => write!(f, "; {remarks}"),
        }
    }
}

/// A stretch of time with one primitive.
///
/// `Display` writes one line: `right Grasp right_cube, 1.250 – 1.500 s`, with the partner in parentheses: `right Insert peg (holder), …`.
#[derive(Clone, Copy, Debug)]
pub struct Segment<'a> {
    who: TrackId,
    inner: &'a Stretch,
}

impl<'a> Segment<'a> {
    pub(crate) const fn of(who: TrackId, inner: &'a Stretch) -> Self {
        Self { who, inner }
    }

    /// The primitive: `Grasp`, `MainGrasp(left)`.
    pub fn primitive(self) -> &'a str {
        &self.inner.primitive
    }

    /// Whose it is.
    pub fn track(self) -> TrackId {
        self.who
    }

    /// The frames `[start, end)`, counted from the first frame of the log.
    pub fn frames(self) -> Range<usize> {
        self.inner.frames.clone()
    }

    /// When it starts, s.
    pub fn start_s(self) -> f64 {
        self.inner.start_s
    }

    /// When it ends, s: when the next one starts.
    pub fn end_s(self) -> f64 {
        self.inner.end_s
    }

    /// The object that it is about: the one that the hand touches on most of its frames. Where the hand touches none, the one that it touches
    /// next, else the one nearest to its fingertips at the end. `None` where the log has no object, or does not say which.
    pub fn object(self) -> Option<&'a str> {
        self.inner.subject.object.as_deref()
    }

    /// The body that the object is in or against for most of the time: the one whose socket it is in, the object of the other hand, a wall
    /// that it touches, an object that carries it.
    pub fn partner(self) -> Option<&'a str> {
        self.inner.subject.partner.as_deref()
    }

    /// The rows of the log `[start, end)`, counted from 0: those of the file, also where rows were left out or frames were resampled.
    pub fn rows(self) -> Range<usize> {
        self.inner.rows.clone()
    }

    /// Returns the confidence of its start, if [`Analysis::with_confidence`] was called.
    pub fn confidence(self) -> Option<Confidence> {
        self.inner.confidence
    }

    /// The primitives of this time before relabeling, in order; empty where no rule changed anything.
    pub fn was(self) -> &'a [String] {
        &self.inner.was
    }

    /// The relabeling rules that changed it, as their authors wrote them, in the order in which they did.
    pub fn changed_by(self) -> &'a [String] {
        &self.inner.by
    }
}

impl fmt::Display for Segment<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Stretch { primitive, subject, start_s, end_s, .. } = self.inner;
        write!(f, "{} {primitive}{}, {start_s:.3} – {end_s:.3} s", self.who, subject.suffix())
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
