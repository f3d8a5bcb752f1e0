//! The extension module `teachtree._teachtree`: what the Python package does in Rust.
//!
//! The classes here are thin; the package beside it (folder `teachtree`) gives them defaults, types and documentation. Every call that takes long
//! releases the interpreter's lock (`wait`), errors become exceptions of `teachtree` (`error`), tables cross by the Arrow C interface (`arrow`).

mod analysis;
mod arrow;
mod error;
mod live;
mod log;
mod rules;
mod tables;
mod wait;

use pyo3::prelude::*;
use std::ffi::OsString;
use std::path::PathBuf;

/// The recordings that paths stand for.
#[pyfunction]
#[pyo3(signature = (paths, binding=None))]
fn recordings(py: Python<'_>, paths: Vec<PathBuf>, binding: Option<PathBuf>) -> PyResult<Vec<PathBuf>> {
    wait::released(py, move || teachtree::recordings(&paths, binding.as_deref()))?
        .map_err(|found| error::to_python(py, &found))
}

/// A binding, a scene, rule files, a hand model, params, and the expected tasks.
type Settings = (Option<PathBuf>, Option<PathBuf>, Vec<PathBuf>, Option<String>, Vec<(String, String)>, Option<String>);

/// The settings of `teachtree.yaml` for a log; with a binding of one's own, without what belongs to that of the file.
#[pyfunction]
fn project_settings(py: Python<'_>, log: PathBuf, has_binding: bool) -> PyResult<Settings> {
    let settings = wait::released(py, move || teachtree::ProjectSettings::of_log(&log))?
        .map_err(|found| error::to_python(py, &found))?;
    let settings = if has_binding { settings.without_binding() } else { settings };
    let [binding, scene] = [settings.binding, settings.scene].map(|setting| setting.map(|setting| setting.value));
    let rules = settings.rules.map_or_else(Vec::new, |rules| rules.value);
    let params = settings.params.into_iter().map(|(param, setting)| (param, setting.value)).collect();
    let [hand_file, expect] = [settings.hand_file, settings.expect].map(|setting| setting.map(|setting| setting.value));
    Ok((binding, scene, rules, hand_file, params, expect))
}

/// Runs the command line; the exit status.
#[pyfunction]
fn command_line(py: Python<'_>, words: Vec<OsString>) -> u8 {
    // Not on another thread: the command line has its own way to end on Ctrl-C.
    py.detach(|| teachtree::command_line_of(words))
}

#[pymodule]
fn _teachtree(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<log::Log>()?;
    module.add_class::<rules::RulesOptions>()?;
    module.add_class::<rules::Rules>()?;
    module.add_class::<analysis::Analysis>()?;
    module.add_class::<live::Calibration>()?;
    module.add_class::<live::Live>()?;
    module.add_class::<arrow::Table>()?;
    module.add_function(wrap_pyfunction!(recordings, module)?)?;
    module.add_function(wrap_pyfunction!(project_settings, module)?)?;
    module.add_function(wrap_pyfunction!(command_line, module)?)?;
    Ok(())
}
