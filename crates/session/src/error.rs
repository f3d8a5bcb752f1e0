//! The error of the public interface, and diagnostics of rule files as data.

use std::fmt;
use std::sync::Arc;
use teachtree_base::diagnostic::{Diagnostic as RuleDiagnostic, Severity, Sources, render};
use teachtree_base::error::{ErrorKind, InputError};

/// Why something could not be done.
///
/// `Display` writes the whole error as the command line does: place, message and help, or the diagnostics with the lines of the rules
/// that they are about. `Debug` writes the same, so a `main` that returns an error prints it for its user.
#[derive(Clone)]
pub struct Error(Box<Inner>);

#[derive(Clone)]
struct Inner {
    kind: ErrorKind,
    input: InputError,
    diagnostics: Vec<Diagnostic>,
}

impl Error {
    /// The errors of rule files.
    pub(crate) fn rules(diagnostics: Vec<Diagnostic>) -> Self {
        let input = match diagnostics.as_slice() {
            [] => InputError::new("rules", "the rules cannot be loaded"),
            [first, rest @ ..] => {
                let more = if rest.is_empty() { String::new() } else { format!(" (and {} more errors)", rest.len()) };
                let place = first.place();
                let place = if place.is_empty() { "rules".to_string() } else { place };
                let input = InputError::new(place, format!("{}{more}", first.message()));
                first.help().first().map_or(input.clone(), |help| input.help(help.as_str()))
            }
        };
        Self(Box::new(Inner { kind: ErrorKind::Rules, input, diagnostics }))
    }

    /// What the error is about.
    pub fn kind(&self) -> ErrorKind {
        self.0.kind
    }

    /// Where it was found: `demo.csv`, `demo.csv row 12 column right.thumb.force.x`, `scene.yaml:4:7`.
    pub fn place(&self) -> &str {
        &self.0.input.place
    }

    /// What was expected and what was found: one line, lower case, without a full stop.
    pub fn message(&self) -> &str {
        &self.0.input.message
    }

    /// What to do about it, if anything can be advised.
    pub fn help(&self) -> Option<&str> {
        self.0.input.help.as_deref()
    }

    /// The errors of the rule files, in the order of files and lines; empty for errors of another kind than [`ErrorKind::Rules`].
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.0.diagnostics
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.diagnostics.is_empty() {
            return self.0.input.fmt(f);
        }
        f.write_str(self.rendered(false).trim_end())
    }
}

impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        let cause = self.0.input.cause.as_ref()?;
        Some(cause.as_ref())
    }
}

/// A place in a text: line and column, both counted from 1, columns in characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position {
    /// The line.
    pub line: usize,
    /// The column.
    pub column: usize,
}

/// An error or a warning about rule files.
///
/// `Display` draws it with the lines that it is about, over several lines.
#[derive(Clone, Debug)]
pub struct Diagnostic {
    found: RuleDiagnostic,
    sources: Arc<Sources>,
}

impl Diagnostic {
    /// The diagnostics of a severity, of these files.
    pub(crate) fn all(found: &[RuleDiagnostic], sources: &Arc<Sources>, severity: Severity) -> Vec<Self> {
        let of_it = found.iter().filter(|found| found.severity == severity);
        of_it.map(|found| Self { found: found.clone(), sources: Arc::clone(sources) }).collect()
    }

    /// The code, such as `E201`; docs/reference/codes.md explains each.
    pub fn code(&self) -> &str {
        self.found.code
    }

    /// Whether it is an error or a warning.
    pub fn severity(&self) -> Severity {
        self.found.severity
    }

    /// What is wrong: one line that stands alone, lower case, without a full stop, the author's words in backticks.
    pub fn message(&self) -> &str {
        &self.found.message
    }

    /// The file as the user named it, or `rules/contact.rules` for a shipped one; `None` for a diagnostic without a place.
    pub fn file(&self) -> Option<&str> {
        let file = self.found.place()?.file;
        self.sources.files.get(file as usize).map(|source| source.name.as_str())
    }

    /// The range of the text in [`file`](Self::file): its first character, and one past its last.
    pub fn range(&self) -> Option<(Position, Position)> {
        let span = self.found.place()?;
        let at = |(line, column)| Position { line, column };
        let (start, end) = self.sources.lines_and_columns(span);
        Some((at(start), at(end)))
    }

    /// Why it is so.
    pub fn notes(&self) -> &[String] {
        &self.found.notes
    }

    /// What to do about it.
    pub fn help(&self) -> &[String] {
        &self.found.help
    }

    fn place(&self) -> String {
        self.found.place().map_or(String::new(), |span| self.sources.place(span))
    }

    fn rendered(&self, color: bool) -> String {
        render(std::slice::from_ref(&self.found), &self.sources, color)
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.rendered(false).trim_end())
    }
}

/// The methods of [`Error`] for the other crates of the workspace; not a part of the public interface.
#[doc(hidden)]
pub trait ErrorInternals: Sized {
    /// An error about an input; `kind` is its kind unless the error has one already.
    fn new(input: InputError, kind: ErrorKind) -> Self;
    /// A bug: something that this library was to hold does not hold.
    fn internal(message: &str) -> Self;
    /// The whole text for a terminal, ending in a line break; diagnostics are colored when `color`.
    fn rendered(&self, color: bool) -> String;
    /// The error without its diagnostics.
    fn into_input(self) -> InputError;
}

impl ErrorInternals for Error {
    fn new(input: InputError, kind: ErrorKind) -> Self {
        let kind = input.kind.unwrap_or(kind);
        Self(Box::new(Inner { kind, input, diagnostics: Vec::new() }))
    }

    fn internal(message: &str) -> Self {
        let input = InputError::new("teachtree", message).help("this is a bug of teachtree; please report it");
        Self::new(input, ErrorKind::Internal)
    }

    fn rendered(&self, color: bool) -> String {
        if self.0.diagnostics.is_empty() {
            return format!("error: {}\n", self.0.input);
        }
        self.0.diagnostics.iter().map(|diagnostic| diagnostic.rendered(color)).collect()
    }

    fn into_input(self) -> InputError {
        self.0.input
    }
}
