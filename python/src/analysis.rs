//! Analyses: their forms, tables, explanations and scores.

use crate::arrow::Table;
use crate::error::{raised, to_python};
use crate::rules::Rules;
use crate::tables;
use crate::wait::released;
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;
use teachtree::{Error, Labels, Outcome, OutcomeReason, Question, Side, Style, TrackId};

/// An outcome: result, attempts, what is expected, whether it is there, the sentence, the reasons.
type OutcomeParts = (&'static str, usize, Option<String>, Option<bool>, String, Vec<ReasonParts>);

/// A reason: kind, track, task, start and end in s, message.
type ReasonParts = (&'static str, Option<String>, Option<String>, Option<f64>, Option<f64>, String);

/// What rules found in a log.
#[pyclass(frozen, module = "teachtree._teachtree")]
pub struct Analysis(pub Arc<teachtree::Analysis>);

impl Analysis {
    /// Does what may take long without the interpreter's lock.
    fn with<T: Send + 'static>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&teachtree::Analysis) -> Result<T, Error> + Send + 'static,
    ) -> PyResult<T> {
        let found = Arc::clone(&self.0);
        released(py, move || work(&found))?.map_err(|error| to_python(py, &error))
    }
}

/// A track by its name.
fn track(py: Python<'_>, name: &str) -> PyResult<TrackId> {
    let sides = [("left", TrackId::Hand(Side::Left)), ("right", TrackId::Hand(Side::Right)), ("both", TrackId::Both)];
    let found = sides.into_iter().find_map(|(known, who)| (known == name).then_some(who));
    found.ok_or_else(|| {
        raised(py, "argument", "track", &format!("expected `left`, `right` or `both`, found `{name}`"), None)
    })
}

#[pymethods]
impl Analysis {
    /// `teachtree.analysis/2`.
    fn json(&self) -> String {
        self.0.json()
    }

    /// The same on one line.
    fn json_line(&self) -> String {
        self.0.json_line()
    }

    /// The table of segments and tasks.
    fn csv(&self, py: Python<'_>) -> PyResult<String> {
        self.0.csv().map_err(|error| to_python(py, &error))
    }

    /// The timeline.
    #[pyo3(signature = (color=false, width=100))]
    fn text(&self, color: bool, width: usize) -> String {
        self.0.text(Style { color, unicode: true, width })
    }

    /// The report.
    fn html(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |found| found.html())
    }

    /// Segments after relabeling, or as the trees returned them.
    #[pyo3(signature = (raw=false))]
    fn segments(&self, py: Python<'_>, raw: bool) -> PyResult<Table> {
        tables::segments(&self.0, raw).map_err(|error| arrow_error(py, &error))
    }

    /// Tasks.
    fn tasks(&self, py: Python<'_>) -> PyResult<Table> {
        tables::tasks(&self.0).map_err(|error| arrow_error(py, &error))
    }

    /// Issues.
    fn issues(&self, py: Python<'_>) -> PyResult<Table> {
        tables::issues(&self.0).map_err(|error| arrow_error(py, &error))
    }

    /// Labels and signals, a row per frame.
    fn frames(&self, py: Python<'_>, signals: Vec<String>) -> PyResult<Table> {
        let made = self.with(py, move |found| {
            let signals: Vec<&str> = signals.iter().map(String::as_str).collect();
            Ok(tables::frames(&found.frames(&signals)?))
        })?;
        made.map_err(|error| arrow_error(py, &error))
    }

    /// Why tracks have their labels, as text and as JSON.
    #[pyo3(signature = (start_s, end_s, track_name=None, why_not=None))]
    fn explain(
        &self,
        py: Python<'_>,
        start_s: f64,
        end_s: f64,
        track_name: Option<&str>,
        why_not: Option<String>,
    ) -> PyResult<(String, String)> {
        let mut question = Question::between(start_s, end_s);
        if let Some(name) = track_name {
            question = question.track(track(py, name)?);
        }
        if let Some(primitive) = why_not {
            question = question.why_not(primitive);
        }
        self.with(py, move |found| {
            let explained = found.explain(&question)?;
            Ok((explained.to_string(), explained.json()))
        })
    }

    /// The score as text, JSON and SVG, and the warnings about the labels.
    #[pyo3(signature = (labels=None, track_name=None, map=None))]
    fn score(
        &self,
        py: Python<'_>,
        labels: Option<PathBuf>,
        track_name: Option<&str>,
        map: Option<String>,
    ) -> PyResult<(String, String, String, Vec<String>)> {
        let mut truth = labels.map_or_else(Labels::default, Labels::file);
        if let Some(name) = track_name {
            truth = truth.track(track(py, name)?);
        }
        if let Some(map) = map {
            truth = truth.map(map);
        }
        self.with(py, move |found| {
            let score = found.score(&truth)?;
            Ok((score.to_string(), score.json(), score.svg(), score.warnings().to_vec()))
        })
    }

    /// The result, the attempts, what is expected and whether it is there, the sentence, and the reasons: kind, track, task, start, end, message.
    #[getter]
    fn outcome(&self) -> OutcomeParts {
        let outcome = self.0.outcome();
        let sentence = outcome.sentence();
        let Outcome { result, attempts, expected, is_as_expected, reasons } = outcome;
        let reason = |reason: OutcomeReason| {
            let (start_s, end_s) = reason.span_s.map(|[start, end]| (start, end)).unzip();
            let track = reason.track.map(|track| track.to_string());
            (reason.kind.name(), track, reason.task, start_s, end_s, reason.message)
        };
        (result.name(), attempts, expected, is_as_expected, sentence, reasons.into_iter().map(reason).collect())
    }

    /// The same, expected to contain these tasks.
    fn expecting(&self, py: Python<'_>, tasks: String) -> PyResult<Self> {
        self.with(py, move |found| found.clone().expecting(&tasks)).map(|found| Self(Arc::new(found)))
    }

    /// The same with confidences.
    fn with_confidence(&self, py: Python<'_>) -> PyResult<Self> {
        self.with(py, |found| found.clone().with_confidence()).map(|found| Self(Arc::new(found)))
    }

    /// The rules that were run.
    #[getter]
    fn rules(&self) -> Rules {
        Rules(self.0.rules().clone())
    }

    /// Number of frames, frames per second, start and end in s.
    #[getter]
    fn span(&self) -> (usize, f64, f64, f64) {
        (self.0.frame_count(), self.0.rate_hz(), self.0.start_s(), self.0.end_s())
    }

    /// The tracks.
    #[getter]
    fn tracks(&self) -> Vec<String> {
        self.0.tracks().map(|track| track.who().to_string()).collect()
    }
}

/// A table that cannot be made: a bug.
fn arrow_error(py: Python<'_>, error: &arrow_schema::ArrowError) -> PyErr {
    raised(py, "internal", "teachtree", &error.to_string(), Some("this is a bug of teachtree; please report it"))
}
