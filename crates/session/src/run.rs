//! The rules evaluated over a log in memory: frames with every channel that rules, tasks and reports read, then leaves, then the analysis.

use super::error::Error;
use super::log_contents::LogContents;
use super::observability;
use crate::ErrorInternals;
use std::sync::Arc;
use teachtree_analysis::{self as analysis, Analysis, check_rate, placed};
use teachtree_base::channels::ChannelSpec;
use teachtree_base::error::{ErrorKind, InputError};
use teachtree_engine::evaluator::evaluate;
use teachtree_engine::runs::Leaves;
use teachtree_frames::OpenedLog;
use teachtree_frames::frames::Frames;
use teachtree_language::Rules;
use teachtree_language::graph::{Graph, lower};
use teachtree_report as report;

/// The frames that the rules read, and the leaves of their trees.
#[derive(Clone, Debug)]
pub struct Run {
    /// The frames of the log; runs of other rules that read the same channels share them.
    pub frames: Arc<Frames>,
    /// The leaves of each gap-free stretch.
    pub leaves: Vec<Leaves>,
}

/// The channels to derive of a log for rules: those that the rules read, first and in their order, then those of the keys of tasks and of the
/// reports. A raw channel that only a report reads may be missing in a log; its values are NaN then.
pub fn channels(rules: &Rules) -> Vec<ChannelSpec> {
    report::channels(rules)
}

/// The frames of a log, with the [`channels`] for rules.
///
/// # Errors
/// [`ErrorKind::Mismatch`]: the log lacks a channel that the rules require.
pub fn frames(rules: &Rules, opened: &OpenedLog) -> Result<Frames, Error> {
    opened.frames(&channels(rules)).map_err(mismatch)
}

fn mismatch(error: InputError) -> Error {
    Error::new(error, ErrorKind::Mismatch)
}

/// Evaluates rules over frames that have their channels; `graph` is what the rules were lowered to.
///
/// # Errors
/// The frames come too slowly for a duration of the rules.
pub fn leaves(rules: &Rules, graph: &Graph, frames: &Frames) -> Result<Vec<Leaves>, InputError> {
    let rate_hz = frames.layout.rate_hz;
    check_rate(rules, rate_hz)?;
    evaluate(graph, frames).map_err(|error| placed(error, rules, rate_hz))
}

impl Run {
    /// Evaluates rules over a log.
    ///
    /// # Errors
    /// [`ErrorKind::Mismatch`]: the log lacks a channel, or is sampled too slowly for a duration of the rules.
    pub fn new(rules: &Rules, opened: &OpenedLog) -> Result<Self, Error> {
        Self::of_graph(rules, &lower(rules), opened)
    }

    fn of_graph(rules: &Rules, graph: &Graph, opened: &OpenedLog) -> Result<Self, Error> {
        let frames = Arc::new(frames(rules, opened)?);
        let at_resample = |error: InputError| match &opened.resample_place {
            Some(place) => analysis::at_resample(error, rules, frames.layout.rate_hz, place),
            None => error,
        };
        let leaves = leaves(rules, graph, &frames).map_err(|error| mismatch(at_resample(error)))?;
        Ok(Self { frames, leaves })
    }

    /// Evaluates rules over frames that have their channels; `graph` is what the rules were lowered to.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn over(rules: &Rules, graph: &Graph, frames: Arc<Frames>) -> Result<Self, Error> {
        let leaves = leaves(rules, graph, &frames).map_err(mismatch)?;
        Ok(Self { frames, leaves })
    }

    /// Evaluates rules over a log, and finds segments and tasks. With a `binding`, primitives that cannot be detected are issues of the analysis.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn analyzed(rules: &Rules, opened: &OpenedLog, binding: bool) -> Result<(Self, Analysis), Error> {
        let graph = lower(rules);
        let run = Self::of_graph(rules, &graph, opened)?;
        let found = run.found(rules, &graph, opened, binding);
        Ok((run, found))
    }

    /// The same log by other rules: [`analyzed`](Self::analyzed), with the frames of this run where the rules read the same channels.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn again(&self, rules: &Rules, opened: &OpenedLog, binding: bool) -> Result<(Self, Analysis), Error> {
        let graph = lower(rules);
        let run = match channels(rules) == self.frames.channels {
            true => Self::over(rules, &graph, Arc::clone(&self.frames))?,
            false => Self::of_graph(rules, &graph, opened)?,
        };
        let found = run.found(rules, &graph, opened, binding);
        Ok((run, found))
    }

    fn found(&self, rules: &Rules, graph: &Graph, opened: &OpenedLog, binding: bool) -> Analysis {
        let mut found = analysis::analyze(rules, &self.frames, &self.leaves);
        analysis::explain_by_motion(&mut found, rules, &self.frames, &*self.frames);
        if binding {
            // A foreign log may lack channels; which primitives that hides is part of its analysis.
            let contents = LogContents::new(opened, binding);
            let tracks = observability::tracks(graph, &self.frames, &contents);
            found.issues.extend(observability::issues(&tracks, &self.frames));
            found.unmeasured = observability::unmeasured_tasks(rules, graph, &self.frames, &contents);
        }
        found
    }
}
