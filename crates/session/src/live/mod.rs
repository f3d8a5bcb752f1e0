//! Online analysis: takes rows one at a time and returns events.
//!
//! There are two kinds of results. The *label* of the newest frame is the one that the trees would return if the log ended there. *Segments* and *tasks* are
//! reported once no later row can change them; they equal those of the analysis of the whole log with the same calibration. Between two tasks all earlier
//! frames are dropped, so that memory does not grow.

mod calibration_buffer;
mod event;
mod feed;
mod finality;
mod history;
mod lacking;

use super::error::Error;
use super::log::Scene;
use super::rules::Rules;
use super::run::channels;
use crate::{ErrorInternals, LogInternals, RulesInternals, SceneInternals};
use event::Inner;
pub use event::LiveEvent;
pub use feed::{CalibrationSource, Feed, FeedOptions};
use finality::FinalityTracker;
use history::History;
use std::collections::BTreeMap;
use teachtree_analysis::{self as analysis, TrackId};
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_base::field_names::FieldNames;
use teachtree_base::hands::Side;
use teachtree_base::units::Dimension;
use teachtree_engine::evaluator::Evaluator;
use teachtree_engine::runs::Run;
use teachtree_frames::live::{self as stream, Calibration as Learned, Derivation, GateOutcome, RowGate, SpikeFilter};
use teachtree_language::graph::{Graph, lower};
use teachtree_language::rules::Label;
use teachtree_logs::issue::{Issue, IssueKind};
use teachtree_logs::read::first_stamp::{SINCE_1970_S, in_recording};
use teachtree_logs::read::table::ColumnRequest;

/// The period at which the newest frames are labeled, and at which segments and tasks are searched, s.
const LOOK_SECS: [f64; 2] = [0.02, 0.1];
/// These periods for a log in which no frame waits for later ones and none is derived twice.
const PROMPT_LOOK_SECS: [f64; 2] = [0.004, 0.02];
/// The maximum duration of the history while no hand rests, s.
const KEPT_SECS: f64 = 600.0;

/// The calibration of a log: the rate, and bias, noise and contact level of the force sensors. It needs some seconds in which the hands are far from the
/// objects at least once.
#[derive(Clone, Debug)]
pub struct Calibration(Learned, Vec<Issue>);

impl Calibration {
    /// Calibrates from the beginning of a log. Bodies without contact in it may have contacts later.
    ///
    /// # Errors
    /// As [`Rules::analyze`].
    pub fn of(log: &super::Log, rules: &Rules) -> Result<Self, Error> {
        Self::of_part(log, rules, false)
    }

    /// Calibrates from the whole log that will be pushed, as [`Rules::analyze`] does: bodies without contact in it never have contacts.
    ///
    /// # Errors
    /// As [`Rules::analyze`].
    pub fn of_whole(log: &super::Log, rules: &Rules) -> Result<Self, Error> {
        Self::of_part(log, rules, true)
    }

    fn of_part(log: &super::Log, rules: &Rules, is_whole: bool) -> Result<Self, Error> {
        let opened = log.opened()?;
        let learned = Learned::of(&opened.recording, &channels(rules.set()), is_whole);
        let (learned, mut issues) = learned.map_err(|error| Error::new(error, ErrorKind::Mismatch))?;
        issues.extend(opened.issues.iter().filter(|issue| issue.kind == IssueKind::LEARNED_CLOSING).cloned());
        Ok(Self(learned, issues))
    }

    /// Reads the text of a calibration file, as `inspect --calibrate` and [`text`](Self::text) write it; messages contain `name`.
    ///
    /// # Errors
    /// [`ErrorKind::Format`]: the text is not a calibration.
    pub fn parse(name: &str, text: &str) -> Result<Self, Error> {
        let learned = Learned::parse(text, name).map_err(|error| Error::new(error, ErrorKind::Format))?;
        Ok(Self(learned, vec![]))
    }

    /// Returns the text of a calibration file, schema `teachtree.calibration/1` (docs/formats.md).
    ///
    /// # Errors
    /// [`ErrorKind::Format`]: a number is not finite.
    pub fn text(&self) -> Result<String, Error> {
        self.0.text().map_err(|error| Error::new(error, ErrorKind::Format))
    }

    /// Returns the rate, frames per second.
    pub fn rate_hz(&self) -> f64 {
        self.0.rate_hz
    }

    /// Returns the issues of the log of the calibration.
    pub fn issues(&self) -> &[Issue] {
        &self.1
    }
}

/// The last reported label of a track's newest frame.
#[derive(Default)]
struct NewestLabel {
    primitive: Option<String>,
    /// The index of the frame in the log at which the label began.
    since: usize,
    confidence: Option<f64>,
}

/// The shares of labels that the final segments of real recordings confirmed, by docs/measurements/live.md: of all labels, of those that had stood for two
/// fifths of the time until the derived channels and the settling are complete, and of those that had stood for four fifths of it.
const CONFIRMED: [(usize, f64); 3] = [(0, 0.59), (2, 0.74), (4, 0.88)];

/// Returns the confidence of a label that has stood for `stood` frames; derived channels and settling are complete after `complete` frames.
fn confidence(stood: usize, complete: usize) -> f64 {
    let reached = CONFIRMED.iter().take_while(|(fifths, _)| 5 * stood >= fifths * complete).last();
    reached.map_or(0.0, |(_, share)| *share)
}

/// An online analysis of a growing log.
pub struct Live {
    rules: Rules,
    graph: Graph,
    /// The factor to SI of each column of the rows; `None` for a factor of 1.
    wants: Vec<Option<f64>>,
    time_at: usize,
    columns: Vec<usize>,
    spike_filter: SpikeFilter,
    row_gate: RowGate,
    derivation: Derivation,
    evaluator: Option<Evaluator>,
    history: History,
    rest: FinalityTracker,
    /// The index in the log of the first frame of the stretch.
    stretch: usize,
    rate_hz: f64,
    /// The frame at which the newest frames were last labeled, and the frame at which segments and tasks were last searched.
    looked: usize,
    found: usize,
    /// The channels that tasks read later.
    kept: Vec<bool>,
    labels: BTreeMap<TrackId, NewestLabel>,
    /// Whether the newest frames are labeled.
    labels_newest: bool,
    /// The number of frames after which the derived channels and the settling of a label are complete; `None` without confidences.
    complete: Option<usize>,
    /// A buffer for the values of a row.
    values: Vec<f64>,
    events: Vec<LiveEvent>,
    sequence: u64,
    newest_s: f64,
    /// What the stamps of the log show at 0 s; `None` before the first row.
    zero_stamp_s: Option<f64>,
    /// The spelling of the channels in the rows, for messages.
    spelling: FieldNames,
}

impl Live {
    /// Begins a log whose rows have these columns: `time [s]` and names of docs/logs.md, each with a unit in brackets where it is not the usual one.
    ///
    /// # Errors
    /// [`ErrorKind::Format`]: a column that cannot be read. [`ErrorKind::Mismatch`]: a channel that the rules need is missing, the rate cannot honor a
    /// duration of the rules, or contacts from shapes were calibrated with other bodies than those of the scene.
    pub fn new<S: AsRef<str>>(
        rules: &Rules,
        columns: &[S],
        scene: &Scene,
        calibration: &Calibration,
    ) -> Result<Self, Error> {
        let Calibration(learned, _) = calibration.clone();
        let (wanted, spelling) = stream::wanted(columns).map_err(|error| Error::new(error, ErrorKind::Format))?;
        // Channels of reports are not included: some of them are averages.
        let channels = analysis::channels(rules.set());
        let measured = |name: &str| learned.columns.iter().any(|column| column == name);
        let mut time_at = 0;
        let mut wants = Vec::with_capacity(wanted.len());
        let mut used: Vec<(String, Dimension)> = Vec::new();
        let mut places = Vec::new();
        for (at, (name, dimension, want)) in wanted.into_iter().enumerate() {
            match want {
                ColumnRequest::Time(factor) => {
                    time_at = at;
                    wants.push(Some(factor));
                }
                want if measured(&name) => {
                    wants.push(want.to_si());
                    places.push(at);
                    used.push((name, dimension));
                }
                _ => wants.push(None),
            }
        }
        let mismatch = |error| Error::new(error, ErrorKind::Mismatch);
        learned.check_bodies(scene.inner()).map_err(mismatch)?;
        let rate_hz = learned.rate_hz;
        analysis::check_rate(rules.set(), rate_hz).map_err(mismatch)?;
        let reads_later = |name: &str| analysis::reads_later(rules.set(), name);
        let kept = channels.iter().map(|channel| reads_later(&channel.name)).collect();
        let (spike_filter, row_gate) = (SpikeFilter::new(&used), RowGate::new(&used, rate_hz));
        let derivation = Derivation::new(scene.inner().clone(), channels, learned, used);
        Ok(Self {
            graph: lower(rules.set()),
            rest: FinalityTracker::new(rules.set()),
            rules: rules.clone(),
            wants,
            time_at,
            columns: places,
            spike_filter,
            row_gate,
            derivation,
            evaluator: None,
            history: History::default(),
            stretch: 0,
            rate_hz,
            looked: 0,
            found: 0,
            kept,
            labels: BTreeMap::new(),
            labels_newest: true,
            complete: None,
            values: vec![],
            events: vec![],
            sequence: 0,
            newest_s: 0.0,
            zero_stamp_s: None,
            spelling,
        })
    }

    /// Gives labels a [confidence](LiveEvent::confidence), and reports a label again when its confidence changes.
    #[must_use]
    pub fn with_confidence(mut self) -> Self {
        let settling = self.rules.set().trees.iter().filter_map(|tree| tree.settle.as_ref());
        let settling_s = settling.map(|settle| settle.value).fold(0.0, f64::max);
        // A cast from f64 saturates.
        self.complete = Some(self.derivation.lag() + (settling_s * self.rate_hz).round() as usize);
        self
    }

    /// Returns the look-ahead of averages and rules, s. Segments and tasks lag behind the newest row by this time and the time that relabeling and tasks need.
    /// `None` before some frames were pushed.
    pub fn lag_s(&self) -> Option<f64> {
        let delay = self.evaluator.as_ref()?.plan().delay as usize;
        Some((self.derivation.lag() + delay) as f64 / self.rate_hz)
    }

    /// Takes a row: a value for each column, in the unit of the column; NaN for a missing value. Returns the new events.
    ///
    /// # Errors
    /// [`ErrorKind::Argument`]: the row has another number of values. [`ErrorKind::Mismatch`]: a channel that the rules need is missing.
    pub fn push(&mut self, row: &[f64]) -> Result<Vec<LiveEvent>, Error> {
        if row.len() != self.wants.len() {
            let message = format!("found {} values, expected one for each of {} columns", row.len(), self.wants.len());
            return Err(Error::new(InputError::new("the row", message), ErrorKind::Argument));
        }
        self.start(row);
        let value =
            |at: usize| row.get(at).copied().unwrap_or(f64::NAN) * self.wants.get(at).copied().flatten().unwrap_or(1.0);
        let time_s = value(self.time_at) - self.zero_stamp_s.unwrap_or_default();
        let mut values = std::mem::take(&mut self.values);
        values.clear();
        values.extend(self.columns.iter().map(|at| value(*at)));
        let taken = self.take(time_s, &values);
        self.values = values;
        taken?;
        Ok(std::mem::take(&mut self.events))
    }

    /// Lets times since 1970 count from those of the first row.
    pub(crate) fn start(&mut self, row: &[f64]) {
        if self.zero_stamp_s.is_some() {
            return;
        }
        let factor = self.wants.get(self.time_at).copied().flatten().unwrap_or(1.0);
        let Some(stamp_s) = row.get(self.time_at).map(|stamp| stamp * factor).filter(|stamp| stamp.is_finite()) else {
            return;
        };
        let since_1970 = stamp_s >= SINCE_1970_S;
        self.zero_stamp_s = Some(if since_1970 { stamp_s } else { 0.0 });
        if since_1970 {
            // A cast from f64 saturates.
            self.event(Inner::Clock { origin_ns: (stamp_s * 1e9).round() as i64 });
        }
    }

    /// Takes a row in SI.
    fn take(&mut self, time_s: f64, values: &[f64]) -> Result<(), Error> {
        for issue in self.spike_filter.push(time_s, values) {
            self.event(Inner::Issue(issue));
        }
        self.admit_rows()
    }

    /// Admits the rows that the spike filter has decided.
    fn admit_rows(&mut self) -> Result<(), Error> {
        while let Some((time_s, values)) = self.spike_filter.release() {
            let admitted = self.admit(time_s, &values);
            self.spike_filter.reuse((time_s, values));
            admitted?;
        }
        Ok(())
    }

    /// Flushes the filter: no row follows for now.
    fn end_rows(&mut self) -> Result<(), Error> {
        for issue in self.spike_filter.finish() {
            self.event(Inner::Issue(issue));
        }
        self.admit_rows()?;
        self.end_stretch()
    }

    fn admit(&mut self, time_s: f64, values: &[f64]) -> Result<(), Error> {
        let GateOutcome { issues, ends, bridged, is_frame } = self.row_gate.take(time_s, values);
        for issue in issues {
            self.event(Inner::Issue(issue));
        }
        if ends {
            self.end_stretch()?;
        }
        for (time_s, values) in &bridged {
            self.derivation.push(*time_s, values);
        }
        if is_frame {
            self.derivation.push(time_s, values);
            self.newest_s = time_s;
            self.look()?;
        }
        Ok(())
    }

    /// Handles an interruption of the source: all segments and tasks end, and the analysis restarts with the next row.
    pub(crate) fn interrupt(&mut self) -> Result<Vec<LiveEvent>, Error> {
        self.end_rows()?;
        self.row_gate.restart();
        Ok(std::mem::take(&mut self.events))
    }

    /// Reports the time of 0 s, ns since 1970.
    pub(crate) fn begin(&mut self, origin_ns: i64) -> Vec<LiveEvent> {
        self.event(Inner::Clock { origin_ns });
        std::mem::take(&mut self.events)
    }

    /// Ends the log and returns the remaining segments and tasks.
    ///
    /// # Errors
    /// As [`push`](Self::push).
    pub fn finish(mut self) -> Result<Vec<LiveEvent>, Error> {
        self.end_rows()?;
        Ok(self.events)
    }

    /// Returns the rules.
    pub fn rules(&self) -> &Rules {
        &self.rules
    }

    /// Switches the labels of the newest frames on or off; without them the analysis takes much less time.
    pub(crate) const fn label_newest(&mut self, is_on: bool) {
        self.labels_newest = is_on;
    }

    /// Returns the stamp of the newest frame, s.
    pub(crate) fn newest_s(&self) -> f64 {
        self.newest_s
    }

    /// Reports an issue of the source, whose times may count from 1970.
    pub(crate) fn report(&mut self, mut issue: Issue) -> Vec<LiveEvent> {
        let zero_s = self.zero_stamp_s.unwrap_or_default();
        issue.start_s = in_recording(issue.start_s, zero_s);
        issue.end_s = in_recording(issue.end_s, zero_s);
        self.event(Inner::Issue(issue));
        std::mem::take(&mut self.events)
    }

    fn event(&mut self, inner: Inner) {
        let inner = match inner {
            Inner::Issue(issue) => Inner::Issue(issue.spelled(&self.spelling)),
            other => other,
        };
        self.events.push(LiveEvent::new(self.sequence, inner));
        self.sequence += 1;
    }

    /// Derives and evaluates the frames that no later one can change, and labels the newest one.
    fn evaluate(&mut self, ends: bool) -> Result<(), Error> {
        let labels_newest = self.labels_newest && !ends;
        let Self { derivation, evaluator: known, graph, history, kept, stretch, .. } = self;
        let mut newest = BTreeMap::new();
        let each = &mut |chunk: stream::LiveChunk| {
            let evaluator = match &mut *known {
                Some(evaluator) => evaluator,
                none => none.insert(Evaluator::new(graph, &chunk.frames.layout)?),
            };
            history.take(&chunk, |channel| kept.get(channel as usize).copied().unwrap_or(false));
            let sides = history::sides(evaluator);
            history::push(evaluator, chunk.frames, &chunk.core, &mut |tree: usize, run: Run| {
                history.leaf(sides.get(tree).copied().flatten(), run, *stretch);
            });
            if labels_newest {
                newest = history::last_leaves(evaluator, &chunk);
            }
            Ok(())
        };
        derivation
            .settle(ends, labels_newest, each)
            .map_err(|error| Error::new(self.spelling.of_error(error), ErrorKind::Mismatch))?;
        self.label(&newest);
        Ok(())
    }

    fn look(&mut self) -> Result<(), Error> {
        let taken = self.derivation.taken();
        let [look_s, find_s] = if self.derivation.lag() == 0 { PROMPT_LOOK_SECS } else { LOOK_SECS };
        if taken - self.looked < frames(look_s, self.rate_hz) {
            return Ok(());
        }
        self.looked = taken;
        self.evaluate(false)?;
        if taken - self.found >= frames(find_s, self.rate_hz) {
            self.found = taken;
            self.find(false);
        }
        Ok(())
    }

    /// Reports the labels of the newest frame whose primitive or confidence has changed.
    fn label(&mut self, newest: &BTreeMap<Option<Side>, Option<Label>>) {
        let (time_s, frame) = (self.newest_s, self.derivation.taken());
        let name = |label| self.rules.set().label_name(label);
        let both = newest.get(&None).copied().flatten();
        let labels: Vec<(TrackId, Option<String>)> = newest
            .iter()
            .map(|(side, label)| match side {
                Some(side) => (TrackId::Hand(*side), both.or(*label).map(name)),
                None => (TrackId::Both, label.map(name)),
            })
            .collect();
        for (who, primitive) in labels {
            // Both hands begin without coordination.
            let was = self.labels.entry(who).or_default();
            let since = if was.primitive == primitive { was.since } else { frame };
            let confidence = self.complete.map(|complete| confidence(frame - since, complete));
            if was.primitive != primitive || was.confidence != confidence {
                *was = NewestLabel { primitive: primitive.clone(), since, confidence };
                self.event(Inner::Label { who, primitive, time_s, confidence });
            }
        }
    }

    /// Searches segments and tasks.
    fn find(&mut self, ends: bool) {
        let Some(evaluator) = &mut self.evaluator else { return };
        let delay = if ends { 0 } else { evaluator.plan().delay as usize };
        let len = self.history.len().saturating_sub(delay);
        if len == 0 {
            return;
        }
        let first = self.history.first;
        let found = self.history.analysis(self.rules.set(), evaluator, self.stretch, len);
        let news = self.rest.news(&found, &mut self.history, ends);
        for inner in news {
            self.event(inner);
        }
        let most = frames(KEPT_SECS, self.rate_hz);
        // A cut of the history shifts the indices of frames.
        if !ends && self.history.first == first && self.history.len() > most {
            let before = self.history.len() - most / 2;
            let [start_s, end_s] = [0, before].map(|frame| self.history.time_s(frame).unwrap_or_default());
            let message = format!(
                "for {KEPT_SECS} s no task has ended with every hand at rest; data before {end_s:.3} s are discarded, and a task that began earlier begins there"
            );
            let issue = Issue { kind: IssueKind::RELABELING_STOPPED, start_s, end_s, channel: String::new(), message };
            self.event(Inner::Issue(issue));
            for inner in self.rest.forget(&found, &mut self.history, before) {
                self.event(inner);
            }
        }
    }

    fn end_stretch(&mut self) -> Result<(), Error> {
        self.evaluate(true)?;
        if let Some(evaluator) = &mut self.evaluator {
            let sides = history::sides(evaluator);
            let (history, stretch) = (&mut self.history, self.stretch);
            evaluator.finish(&mut |tree: usize, run: Run| {
                history.leaf(sides.get(tree).copied().flatten(), run, stretch);
            });
        }
        self.find(true);
        let taken = self.derivation.taken();
        (self.stretch, self.looked, self.found) = (taken, taken, taken);
        self.history.restart(taken);
        self.rest.restart();
        // The time before a gap does not count.
        self.labels.values_mut().for_each(|label| label.since = taken);
        Ok(())
    }
}

/// Returns a duration in frames, at least one.
fn frames(secs: f64, rate_hz: f64) -> usize {
    // A cast from f64 saturates.
    ((secs * rate_hz).round() as usize).max(1)
}
