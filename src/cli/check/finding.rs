//! Findings of rule files and YAML files in one form, with their places.

use teachtree_base::diagnostic::{Diagnostic, Severity, Sources, Span};
use teachtree_base::error::InputError;

/// The code of errors of YAML files.
pub const INPUT: &str = "input";

/// A place in a file; lines and columns count from 1, columns in characters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    pub file: String,
    pub start: (usize, usize),
    pub end: (usize, usize),
}

/// An error or a warning.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    pub code: String,
    pub severity: Severity,
    pub message: String,
    /// Places with their labels, the main one first.
    pub labels: Vec<(Place, String)>,
    pub notes: Vec<String>,
    pub help: Vec<String>,
    /// What a text is replaced by.
    pub fix: Option<(Place, String)>,
}

impl Finding {
    /// A finding in rule files, of which `first` is the first one. A file that cannot be read has no lines; the finding is at its beginning.
    pub fn of_rules(found: &Diagnostic, sources: &Sources, first: &str) -> Self {
        let place = |span: Span| {
            let (start, end) = sources.lines_and_columns(span);
            let file = sources.files.get(span.file as usize).map_or(String::new(), |file| file.name.clone());
            Place { file, start, end }
        };
        let mut labels: Vec<(Place, String)> =
            found.labels.iter().map(|label| (place(label.span), label.text.clone())).collect();
        if labels.is_empty() {
            let file = found.file.as_deref().unwrap_or(first).to_string();
            labels.push((Place { file, start: (1, 1), end: (1, 1) }, String::new()));
        }
        Self {
            code: found.code.to_string(),
            severity: found.severity,
            message: found.message.clone(),
            labels,
            notes: found.notes.clone(),
            help: found.help.clone(),
            fix: found.fix.as_ref().map(|fix| (place(fix.span), fix.replacement.clone())),
        }
    }

    /// The error of a YAML file, at its line.
    pub fn of_yaml(error: &InputError) -> Self {
        let (file, line, column) = error.file_line_column();
        let at = (line.unwrap_or(1), column.unwrap_or(1));
        Self {
            code: INPUT.into(),
            severity: Severity::Error,
            message: error.message.clone(),
            labels: vec![(Place { file: file.into(), start: at, end: at }, String::new())],
            notes: Vec::new(),
            help: error.help.iter().cloned().collect(),
            fix: None,
        }
    }

    /// The main place.
    pub fn place(&self) -> Option<&Place> {
        self.labels.first().map(|(place, _)| place)
    }

    /// The message with its notes and advice, a line each.
    pub fn lines(&self) -> String {
        let lines = std::iter::once(&self.message).chain(&self.notes).chain(&self.help);
        lines.map(String::as_str).collect::<Vec<_>>().join("\n")
    }
}

/// A rule set or a YAML file with its findings.
pub struct CheckedInput {
    pub name: String,
    pub findings: Vec<Finding>,
}

/// The findings of all inputs, once each: several rule sets use the same files.
pub fn distinct(checked: &[CheckedInput]) -> Vec<&Finding> {
    let mut distinct: Vec<&Finding> = Vec::new();
    for finding in checked.iter().flat_map(|input| &input.findings) {
        if !distinct.contains(&finding) {
            distinct.push(finding);
        }
    }
    distinct
}
