//! Logs: files, buffers of numbers, Arrow tables.

use crate::arrow;
use crate::error::{raised, to_python};
use crate::wait::released;
use pyo3::buffer::PyBuffer;
use pyo3::prelude::*;
use std::path::PathBuf;
use teachtree::{Column, LogOptions, Scene};

/// A recording.
#[pyclass(frozen, module = "teachtree._teachtree")]
pub struct Log(pub teachtree::Log);

/// What a scene is given by.
#[derive(Default)]
struct LogInputs {
    binding: Option<PathBuf>,
    scene: Option<PathBuf>,
    text: Option<String>,
    /// Whether `teachtree.yaml` counts.
    by_project: bool,
}

impl LogInputs {
    fn options(&self) -> LogOptions {
        let options = teachtree::Log::options();
        let options = if self.by_project { options.by_project() } else { options };
        let options = self.binding.iter().fold(options, |options, path| options.binding(path));
        self.scene.iter().fold(options, |options, path| options.scene(path))
    }

    fn of_columns(&self, name: String, columns: Vec<Column>) -> Result<teachtree::Log, teachtree::Error> {
        let scene = self.text.as_deref().map(|text| Scene::parse("scene", text)).transpose()?;
        self.options().from_columns(name, columns, scene.as_ref())
    }
}

#[pymethods]
impl Log {
    /// Opens a file or folder.
    #[staticmethod]
    #[pyo3(signature = (path, binding=None, scene=None, by_project=true))]
    fn open(
        py: Python<'_>,
        path: PathBuf,
        binding: Option<PathBuf>,
        scene: Option<PathBuf>,
        by_project: bool,
    ) -> PyResult<Self> {
        let given = LogInputs { binding, scene, text: None, by_project };
        released(py, move || given.options().open(path))?.map(Self).map_err(|error| to_python(py, &error))
    }

    /// A log of columns: title, unit, and a contiguous buffer of doubles or a list of texts.
    #[staticmethod]
    #[pyo3(signature = (name, columns, binding=None, scene=None, scene_text=None))]
    fn from_columns(
        py: Python<'_>,
        name: String,
        columns: Vec<(String, String, Bound<'_, PyAny>)>,
        binding: Option<PathBuf>,
        scene: Option<PathBuf>,
        scene_text: Option<String>,
    ) -> PyResult<Self> {
        let mut taken = Vec::with_capacity(columns.len());
        for (title, unit, values) in columns {
            taken.push(match PyBuffer::<f64>::get(&values) {
                Ok(buffer) => Column::new(title, &unit, buffer.to_vec(py)?),
                Err(_) => Column::texts(title, values.extract::<Vec<String>>()?),
            });
        }
        let given = LogInputs { binding, scene, text: scene_text, by_project: false };
        released(py, move || given.of_columns(name, taken))?.map(Self).map_err(|error| to_python(py, &error))
    }

    /// A log of a table of whatever library, by its `__arrow_c_stream__`.
    #[staticmethod]
    #[pyo3(signature = (name, table, units, binding=None, scene=None, scene_text=None))]
    fn from_arrow(
        py: Python<'_>,
        name: String,
        table: &Bound<'_, PyAny>,
        units: std::collections::BTreeMap<String, String>,
        binding: Option<PathBuf>,
        scene: Option<PathBuf>,
        scene_text: Option<String>,
    ) -> PyResult<Self> {
        let stream = arrow::stream_of(table)?;
        let given = LogInputs { binding, scene, text: scene_text, by_project: false };
        let place = name.clone();
        let made = released(py, move || {
            let columns = arrow::columns(stream, &units)?;
            Ok::<_, arrow::ColumnError>(given.of_columns(name, columns))
        })?;
        match made {
            Ok(log) => log.map(Self).map_err(|error| to_python(py, &error)),
            Err(arrow::ColumnError { column, message, help }) => {
                let place = if column.is_empty() { place } else { format!("{place} column {column}") };
                Err(raised(py, "format", &place, &message, help))
            }
        }
    }

    /// Reads the rows into memory.
    fn read(&self, py: Python<'_>) -> PyResult<()> {
        let log = self.0.clone();
        released(py, move || log.read())?.map_err(|error| to_python(py, &error))
    }

    /// The path or name as it was given.
    #[getter]
    fn name(&self) -> String {
        self.0.name()
    }

    /// The hands that it measures, `left` first.
    #[getter]
    fn hands(&self) -> Vec<String> {
        self.0.hands().into_iter().map(|side| teachtree::TrackId::Hand(side).to_string()).collect()
    }

    /// The hand model for the log, and why it is loaded where none is named with the rules.
    #[getter]
    fn hand_model(&self) -> Option<String> {
        self.0.hand_model()
    }
}
