//! Rules that run on a log while it is being made.

use crate::error::to_python;
use crate::log::Log;
use crate::rules::Rules;
use crate::wait::released;
use pyo3::buffer::PyBuffer;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use teachtree::{LiveEvent, Scene};

/// What is learned from the beginning of a log.
#[pyclass(frozen, module = "teachtree._teachtree")]
pub struct Calibration(teachtree::Calibration);

#[pymethods]
impl Calibration {
    /// Learns from a log; `whole`: from all of it, as its analysis does.
    #[new]
    fn new(py: Python<'_>, rules: &Rules, log: &Log, whole: bool) -> PyResult<Self> {
        let (rules, log) = (rules.0.clone(), log.0.clone());
        let learned = released(py, move || match whole {
            true => teachtree::Calibration::of_whole(&log, &rules),
            false => teachtree::Calibration::of(&log, &rules),
        })?;
        learned.map(Self).map_err(|error| to_python(py, &error))
    }

    /// Reads the text of a calibration file.
    #[staticmethod]
    fn parse(py: Python<'_>, name: &str, text: &str) -> PyResult<Self> {
        teachtree::Calibration::parse(name, text).map(Self).map_err(|error| to_python(py, &error))
    }

    /// The text of a calibration file.
    fn text(&self, py: Python<'_>) -> PyResult<String> {
        self.0.text().map_err(|error| to_python(py, &error))
    }

    /// Frames per second.
    #[getter]
    fn rate_hz(&self) -> f64 {
        self.0.rate_hz()
    }
}

/// A log that is being made.
#[pyclass(module = "teachtree._teachtree")]
pub struct Live {
    /// `None` once it has ended.
    live: Option<teachtree::Live>,
    /// The memory of a row.
    row: Vec<f64>,
}

impl Live {
    fn running(&mut self) -> PyResult<(&mut teachtree::Live, &mut Vec<f64>)> {
        let Self { live, row } = self;
        live.as_mut().map(|live| (live, row)).ok_or_else(|| PyRuntimeError::new_err("this live log has ended"))
    }
}

/// Events as their JSON.
fn lines(events: &[LiveEvent]) -> Vec<String> {
    events.iter().map(LiveEvent::json).collect()
}

#[pymethods]
impl Live {
    #[new]
    fn new(
        py: Python<'_>,
        rules: &Rules,
        columns: Vec<String>,
        scene_text: &str,
        calibration: &Calibration,
        confidence: bool,
    ) -> PyResult<Self> {
        let made = Scene::parse("scene", scene_text)
            .and_then(|scene| teachtree::Live::new(&rules.0, &columns, &scene, &calibration.0));
        let live = made.map_err(|error| to_python(py, &error))?;
        let live = if confidence { live.with_confidence() } else { live };
        Ok(Self { live: Some(live), row: Vec::with_capacity(columns.len()) })
    }

    /// Takes a row, a buffer of doubles or a sequence of numbers; the events as JSON.
    ///
    /// The interpreter's lock is kept: a row takes microseconds, giving the lock away takes as long.
    fn push(&mut self, py: Python<'_>, values: &Bound<'_, PyAny>) -> PyResult<Vec<String>> {
        let (live, row) = self.running()?;
        match PyBuffer::<f64>::get(values) {
            Ok(buffer) => {
                row.resize(buffer.item_count(), 0.0);
                buffer.copy_to_slice(py, row)?;
            }
            Err(_) => *row = values.extract()?,
        }
        live.push(row).map(|events| lines(&events)).map_err(|error| to_python(py, &error))
    }

    /// Ends the log; the remaining events as JSON.
    fn finish(&mut self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.running()?;
        let events = self.live.take().map_or(Ok(vec![]), teachtree::Live::finish);
        events.map(|events| lines(&events)).map_err(|error| to_python(py, &error))
    }

    /// By how much segments and tasks lag behind the newest row, s.
    #[getter]
    fn lag_s(&mut self) -> PyResult<Option<f64>> {
        Ok(self.running()?.0.lag_s())
    }
}
