//! Renders diagnostics as text with their source lines. No other file uses `annotate-snippets`.

use super::{Diagnostic, Severity, Sources, Span};
use annotate_snippets::{AnnotationKind, Group, Level, Patch, Renderer, Snippet};
use std::ops::Range;

/// Edits of lines longer than this, in bytes, are not rendered. (The library trims snippets of such lines.)
const LONGEST_EDIT: usize = 400;
/// Source lines kept above and below the spans of a report, so that the cost does not depend on the length of the file.
const CONTEXT_LINES: usize = 3;

/// Renders all diagnostics as one text, each followed by a blank line; with terminal colors if `color`.
pub fn render(diagnostics: &[Diagnostic], sources: &Sources, color: bool) -> String {
    let renderer = if color { Renderer::styled() } else { Renderer::plain() };
    let mut text = String::new();
    for diagnostic in diagnostics {
        text.push_str(&renderer.render(&groups(diagnostic, sources)));
        text.push_str("\n\n");
    }
    text
}

/// Builds the report of one diagnostic: the finding with its places, then the edit.
fn groups<'a>(diagnostic: &'a Diagnostic, sources: &'a Sources) -> Vec<Group<'a>> {
    let level = match diagnostic.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
    };
    let mut report = Group::with_title(level.primary_title(&diagnostic.message).id(diagnostic.code));

    // One snippet per file, in the order in which the labels name the files.
    let mut files: Vec<u32> = Vec::new();
    for label in &diagnostic.labels {
        if !files.contains(&label.span.file) {
            files.push(label.span.file);
        }
    }
    for file in files {
        let labels = || diagnostic.labels.iter().enumerate().filter(|(_, label)| label.span.file == file);
        let Some(window) = Window::over(sources, labels().map(|(_, label)| label.span)) else {
            continue;
        };
        let mut snippet = window.snippet();
        for (place, label) in labels() {
            let kind = if place == 0 { AnnotationKind::Primary } else { AnnotationKind::Context };
            snippet = snippet.annotation(kind.span(window.range(label.span)).label(label.text.as_str()));
        }
        report = report.element(snippet);
    }
    for note in &diagnostic.notes {
        report = report.element(Level::NOTE.message(note.as_str()));
    }

    // The first help belongs to the edit, if that changes visible text.
    let fix = diagnostic.fix.as_ref().and_then(|fix| Some((fix, Window::over(sources, [fix.span].into_iter())?)));
    let fix = fix.filter(|(_, window)| window.text.lines().all(|line| line.len() <= LONGEST_EDIT));
    let mut help = diagnostic.help.iter();
    let Some((fix, window)) = fix else {
        let report = help.fold(report, |report, help| report.element(Level::HELP.message(help.as_str())));
        return vec![report];
    };
    let title = help.next().map_or("", String::as_str);
    let report = help.fold(report, |report, help| report.element(Level::HELP.message(help.as_str())));
    let patch = Patch::new(window.range(fix.span), fix.replacement.as_str());
    let edit = Level::HELP.secondary_title(title).element(window.snippet().patch(patch));
    vec![report, edit]
}

/// The part of a file that a snippet needs.
struct Window<'a> {
    name: &'a str,
    text: &'a str,
    /// Start of the part in the file, in bytes, and its line from 1.
    start: usize,
    line: usize,
}

impl<'a> Window<'a> {
    /// Returns the lines around these spans of one file; `None` if the file is unknown or there is no span.
    fn over(sources: &'a Sources, spans: impl Iterator<Item = Span> + Clone) -> Option<Self> {
        let file = spans.clone().next()?.file;
        let source = sources.files.get(file as usize)?;
        let text = source.text.as_str();
        let first = floor_boundary(text, spans.clone().map(|span| span.start as usize).min()?);
        let last = floor_boundary(text, spans.map(|span| span.end as usize).max()?);
        let start = text.get(..first)?.rmatch_indices('\n').nth(CONTEXT_LINES).map_or(0, |(at, _)| at + 1);
        let end = text.get(last..)?.match_indices('\n').nth(CONTEXT_LINES).map_or(text.len(), |(at, _)| last + at + 1);
        let line = text.get(..start)?.matches('\n').count() + 1;
        Some(Self { name: &source.name, text: text.get(start..end)?, start, line })
    }

    fn snippet<T: Clone>(&self) -> Snippet<'a, T> {
        Snippet::source(self.text).path(self.name).line_start(self.line)
    }

    /// Converts a span of the file to one of the window.
    fn range(&self, span: Span) -> Range<usize> {
        let inside = |at: u32| floor_boundary(self.text, (at as usize).saturating_sub(self.start));
        let start = inside(span.start);
        start..inside(span.end).max(start)
    }
}

/// Returns the last character boundary at or before `at`.
fn floor_boundary(text: &str, at: usize) -> usize {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}
