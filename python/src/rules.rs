//! Rules: what they are loaded from, and the loaded ones.

use crate::analysis::Analysis;
use crate::error::{diagnostics, to_python};
use crate::log::Log;
use crate::wait::released;
use pyo3::prelude::*;
use pyo3::types::PyList;
use std::path::PathBuf;
use std::sync::Arc;

/// What can be detected in a track: its name, the primitives that can, and those that cannot by reason.
type Detectable = (String, Vec<String>, Vec<(String, Vec<String>)>);

/// What rules are loaded from.
#[pyclass(frozen, module = "teachtree._teachtree")]
pub struct RulesOptions(teachtree::RulesOptions);

#[pymethods]
impl RulesOptions {
    #[new]
    #[pyo3(signature = (files, texts, hand=None, params=vec![]))]
    fn new(
        files: Vec<PathBuf>,
        texts: Vec<(String, String)>,
        hand: Option<PathBuf>,
        params: Vec<(String, String)>,
    ) -> Self {
        let options = files.into_iter().fold(teachtree::Rules::options(), |options, file| options.file(file));
        let options = texts.into_iter().fold(options, |options, (name, text)| options.text(name, text));
        let options = hand.into_iter().fold(options, |options, hand| options.hand_file(hand));
        Self(params.into_iter().fold(options, |options, (name, value)| options.param(name, value)))
    }

    /// All errors and warnings.
    fn check<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let options = self.0.clone();
        diagnostics(py, &released(py, move || options.check())?)
    }

    /// Loads the rules without a log.
    fn load(&self, py: Python<'_>) -> PyResult<Rules> {
        let options = self.0.clone();
        released(py, move || options.load())?.map(Rules).map_err(|error| to_python(py, &error))
    }

    /// Loads the rules for a log.
    fn for_log(&self, py: Python<'_>, log: &Log) -> PyResult<Rules> {
        let (options, log) = (self.0.clone(), log.0.clone());
        released(py, move || options.for_log(&log))?.map(Rules).map_err(|error| to_python(py, &error))
    }

    /// Loads the rules for a log and runs them over it.
    fn analyze(&self, py: Python<'_>, log: &Log) -> PyResult<Analysis> {
        let (options, log) = (self.0.clone(), log.0.clone());
        let found = released(py, move || options.for_log(&log)?.analyze(&log))?;
        found.map(|found| Analysis(Arc::new(found))).map_err(|error| to_python(py, &error))
    }
}

/// Loaded rules.
#[pyclass(frozen, module = "teachtree._teachtree")]
pub struct Rules(pub teachtree::Rules);

#[pymethods]
impl Rules {
    /// Runs the rules over a log, as they were loaded.
    fn analyze(&self, py: Python<'_>, log: &Log) -> PyResult<Analysis> {
        let (rules, log) = (self.0.clone(), log.0.clone());
        let found = released(py, move || rules.analyze(&log))?;
        found.map(|found| Analysis(Arc::new(found))).map_err(|error| to_python(py, &error))
    }

    /// The files that were read and are not shipped ones.
    #[getter]
    fn own_files(&self) -> Vec<String> {
        self.0.own_files().map(str::to_string).collect()
    }

    /// The files that were read, in order.
    #[getter]
    fn files(&self) -> Vec<String> {
        self.0.files().map(str::to_string).collect()
    }

    /// The names of the primitives.
    #[getter]
    fn primitives(&self) -> Vec<String> {
        self.0.primitives().map(str::to_string).collect()
    }

    /// The names of the tasks, by priority.
    #[getter]
    fn tasks(&self) -> Vec<String> {
        self.0.tasks().map(str::to_string).collect()
    }

    /// The SHA-256 of all texts and params, its first 32 hexadecimal digits.
    #[getter]
    fn digest(&self) -> String {
        self.0.digest()
    }

    /// The trees as a picture.
    fn svg(&self) -> String {
        self.0.svg()
    }

    /// What the rules can detect in a log: for each track its primitives, and those that it cannot, by reason.
    fn observability(&self, py: Python<'_>, log: &Log) -> PyResult<Vec<Detectable>> {
        let (rules, log) = (self.0.clone(), log.0.clone());
        let found = released(py, move || rules.observability(&log))?.map_err(|error| to_python(py, &error))?;
        let cannot = |track: &teachtree::TrackObservability| {
            track.undetectable.iter().map(|lack| (lack.reason.clone(), lack.primitives.clone())).collect()
        };
        Ok(found
            .tracks
            .iter()
            .map(|track| (track.track.to_string(), track.detectable.clone(), cannot(track)))
            .collect())
    }
}
