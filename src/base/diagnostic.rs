//! Diagnostics about rule files: what was found, where, and what to do. Passes return them; nothing here prints.

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

/// A rule file as it was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// The name shown to people: the path as the user wrote it, or `rules/contact.rules` for a shipped file.
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
    /// The smallest span that holds both; both are of one file.
    #[must_use]
    pub fn to(self, other: Self) -> Self {
        Self { file: self.file, start: self.start.min(other.start), end: self.end.max(other.end) }
    }
}

impl Sources {
    /// The text at a span; empty for a span of no file.
    pub fn text(&self, span: Span) -> &str {
        self.files
            .get(span.file as usize)
            .and_then(|source| source.text.get(span.start as usize..span.end as usize))
            .unwrap_or("")
    }

    /// Line and column of both ends of a span, counted from 1, columns in characters; the end is one past the last.
    pub fn lines_and_columns(&self, span: Span) -> ((usize, usize), (usize, usize)) {
        let text = self.files.get(span.file as usize).map_or("", |source| source.text.as_str());
        let at = |offset: u32| {
            let head = text.get(..offset as usize).unwrap_or(text);
            (head.matches('\n').count() + 1, head.rsplit('\n').next().unwrap_or("").chars().count() + 1)
        };
        (at(span.start), at(span.end))
    }

    /// `rules/contact.rules:12:5` for the start of a span (line and column counted from 1, columns in characters).
    pub fn place(&self, span: Span) -> String {
        let Some(source) = self.files.get(span.file as usize) else {
            return String::new();
        };
        let ((line, column), _) = self.lines_and_columns(span);
        format!("{}:{line}:{column}", source.name)
    }
}

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The rules cannot run.
    Error,
    /// The rules run, but hardly as meant.
    Warning,
}

/// One finding.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// The code: E1 syntax, E2 names, E3 dimensions, E4 trees, E7 limits; W for warnings.
    pub code: &'static str,
    /// How bad it is.
    pub severity: Severity,
    /// One line that stands alone: lower case, no full stop, the author's words in backticks.
    pub message: String,
    /// The places, the primary one first.
    pub labels: Vec<Label>,
    /// Why.
    pub notes: Vec<String>,
    /// What to do.
    pub help: Vec<String>,
    /// An edit that mends it.
    pub fix: Option<Fix>,
}

/// A place with what is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// The place.
    pub span: Span,
    /// What this piece is.
    pub text: String,
}

/// An edit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fix {
    /// What to replace.
    pub span: Span,
    /// By what.
    pub replacement: String,
}

impl Diagnostic {
    /// An error without a place yet.
    pub fn error(code: &'static str, message: impl Into<String>) -> Self {
        let (labels, notes, help) = (Vec::new(), Vec::new(), Vec::new());
        Self { code, severity: Severity::Error, message: message.into(), labels, notes, help, fix: None }
    }

    /// A warning without a place yet.
    pub fn warning(code: &'static str, message: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::error(code, message) }
    }

    /// Adds a place; the first one added is the primary one.
    #[must_use]
    pub fn at(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: text.into() });
        self
    }

    /// Says why.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    /// Says what to do.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help.push(help.into());
        self
    }

    /// Says what to do, with the edit that does it.
    #[must_use]
    pub fn fix(mut self, help: impl Into<String>, span: Span, replacement: impl Into<String>) -> Self {
        self.help.insert(0, help.into());
        self.fix = Some(Fix { span, replacement: replacement.into() });
        self
    }

    /// Where it is, for sorting: the primary place; findings without a place come first.
    pub fn place(&self) -> Option<Span> {
        self.labels.first().map(|label| label.span)
    }
}
