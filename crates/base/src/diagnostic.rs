//! Diagnostics about rule files: the finding, its places, and the fix. Passes return diagnostics; nothing here prints.

mod render;

pub use render::render;

/// A place in a source file, in bytes: `[start, end)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Span {
    /// Index of the file in [`Sources`].
    pub file: u32,
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

/// A rule file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// The name in messages: the path as the user wrote it, or `rules/contact.rules` for a shipped file.
    pub name: String,
    /// The text.
    pub text: String,
}

/// All files of a rule set, in the order of reading.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sources {
    /// The files; a span's `file` is an index here.
    pub files: Vec<Source>,
}

impl Span {
    /// Returns the smallest span that contains both; both are in one file.
    #[must_use]
    pub fn to(self, other: Self) -> Self {
        Self { file: self.file, start: self.start.min(other.start), end: self.end.max(other.end) }
    }
}

impl Sources {
    /// Returns the text at a span; empty if the file does not exist.
    pub fn text(&self, span: Span) -> &str {
        self.files
            .get(span.file as usize)
            .and_then(|source| source.text.get(span.start as usize..span.end as usize))
            .unwrap_or("")
    }

    /// Returns the text behind a span, up to the end of its last line.
    pub fn rest_of_line(&self, span: Span) -> &str {
        let source = self.files.get(span.file as usize);
        let rest = source.and_then(|source| source.text.get(span.end as usize..));
        rest.and_then(|rest| rest.lines().next()).unwrap_or("")
    }

    /// Returns line and column of both ends of a span, from 1, columns in characters; the end is one past the last.
    pub fn lines_and_columns(&self, span: Span) -> ((usize, usize), (usize, usize)) {
        let text = self.files.get(span.file as usize).map_or("", |source| source.text.as_str());
        let at = |offset: u32| {
            let head = text.get(..offset as usize).unwrap_or(text);
            (head.matches('\n').count() + 1, head.rsplit('\n').next().unwrap_or("").chars().count() + 1)
        };
        (at(span.start), at(span.end))
    }

    /// Formats the start of a span as `rules/contact.rules:12:5` (line and column from 1, columns in characters).
    pub fn place(&self, span: Span) -> String {
        let Some(source) = self.files.get(span.file as usize) else {
            return String::new();
        };
        let ((line, column), _) = self.lines_and_columns(span);
        format!("{}:{line}:{column}", source.name)
    }
}

/// The severity of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The rules cannot run.
    Error,
    /// The rules run, but probably not as intended.
    Warning,
}

/// One finding.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// The code: E1 syntax, E2 names, E3 dimensions, E4 trees, E7 limits; W for warnings.
    pub code: &'static str,
    /// The severity of a finding.
    pub severity: Severity,
    /// One self-contained line: lower case, no full stop, the author's words in backticks.
    pub message: String,
    /// The file that it is about, where no place is in it because it cannot be read.
    pub file: Option<String>,
    /// The places, the primary one first.
    pub labels: Vec<Label>,
    /// Reasons.
    pub notes: Vec<String>,
    /// Fixes, in words.
    pub help: Vec<String>,
    /// An edit that fixes it.
    pub fix: Option<Fix>,
}

/// A place with a text about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// The place.
    pub span: Span,
    /// The text.
    pub text: String,
}

/// An edit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fix {
    /// The replaced span.
    pub span: Span,
    /// The new text.
    pub replacement: String,
}

impl Diagnostic {
    /// Creates an error without a place.
    pub fn error(code: &'static str, message: impl Into<String>) -> Self {
        let (labels, notes, help) = (Vec::new(), Vec::new(), Vec::new());
        Self { code, severity: Severity::Error, message: message.into(), file: None, labels, notes, help, fix: None }
    }

    /// Creates a warning without a place.
    pub fn warning(code: &'static str, message: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::error(code, message) }
    }

    /// Names the file that it is about.
    #[must_use]
    pub fn in_file(mut self, file: impl Into<String>) -> Self {
        self.file = Some(file.into());
        self
    }

    /// Adds a place; the first one added is the primary one.
    #[must_use]
    pub fn at(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: text.into() });
        self
    }

    /// Adds a reason.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    /// Adds a fix in words.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help.push(help.into());
        self
    }

    /// Adds a fix in words, with the edit.
    #[must_use]
    pub fn fix(mut self, help: impl Into<String>, span: Span, replacement: impl Into<String>) -> Self {
        self.help.insert(0, help.into());
        self.fix = Some(Fix { span, replacement: replacement.into() });
        self
    }

    /// Returns the primary place, for sorting; findings without a place come first.
    pub fn place(&self) -> Option<Span> {
        self.labels.first().map(|label| label.span)
    }
}
