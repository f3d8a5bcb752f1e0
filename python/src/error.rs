//! Errors as exceptions of the package, with all that they know as attributes.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use teachtree::{Diagnostic, Error, Severity};

/// The exception for an error.
pub fn to_python(py: Python<'_>, error: &Error) -> PyErr {
    let kind = format!("{:?}", error.kind()).to_lowercase();
    let made = diagnostics(py, error.diagnostics()).and_then(|found| {
        let build = py.import("teachtree._errors")?.getattr("build")?;
        build.call1((kind, error.place(), error.message(), error.help(), error.to_string(), found))
    });
    made.map_or_else(|failed| failed, PyErr::from_value)
}

/// An exception of the package about something that only Python passes in.
pub fn raised(py: Python<'_>, kind: &str, place: &str, message: &str, help: Option<&str>) -> PyErr {
    let advice = help.map_or(String::new(), |help| format!("\n  help: {help}"));
    let rendered = format!("{place}: {message}{advice}");
    let made = py
        .import("teachtree._errors")
        .and_then(|module| module.getattr("build")?.call1((kind, place, message, help, rendered, PyList::empty(py))));
    made.map_or_else(|failed| failed, PyErr::from_value)
}

/// Diagnostics as the arguments of `teachtree.Diagnostic`.
pub fn diagnostics<'py>(py: Python<'py>, found: &[Diagnostic]) -> PyResult<Bound<'py, PyList>> {
    let list = PyList::empty(py);
    for one in found {
        let (start, end) = one.range().unzip();
        let place = |at: Option<teachtree::Position>| at.map(|at| (at.line, at.column));
        let fields = PyDict::new(py);
        fields.set_item("code", one.code())?;
        fields.set_item("severity", if one.severity() == Severity::Error { "error" } else { "warning" })?;
        fields.set_item("message", one.message())?;
        fields.set_item("file", one.file())?;
        fields.set_item("start", place(start))?;
        fields.set_item("end", place(end))?;
        fields.set_item("notes", one.notes().to_vec())?;
        fields.set_item("help", one.help().to_vec())?;
        fields.set_item("rendered", one.to_string())?;
        list.append(fields)?;
    }
    Ok(list)
}
