//! The language service of the text editor in the studio: findings, hover and completion, called directly.

use super::hover::hover;
use super::recording::Recording;
use super::workspace::{RuleSet, Spot};
use super::{completion, lines::Lines, uri};
use lsp_types::{CompletionItemTextEdit, Contents, Documentation, Position};
use std::path::Path;
use std::rc::Rc;
use teachtree_base::diagnostic::{Diagnostic, Source, Sources, Span};
use teachtree_language::{self as language, Request};

/// The most completions that are proposed.
const MAX_PROPOSALS: usize = 60;

/// The language service for rule files and all files that they use.
pub struct LanguageService(Rc<RuleSet>);

/// What may be written at a place.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Proposal {
    /// What is written.
    pub label: String,
    /// Its kind or type; empty where there is nothing to be said.
    pub detail: String,
    /// Its comment.
    pub doc: String,
    /// How much of what stands before the place is replaced, in units of UTF-16.
    pub replaces: u32,
}

impl LanguageService {
    /// Looks at rules.
    pub fn new(request: &Request) -> Self {
        let survey = language::survey(request);
        let place = |source: &Source| {
            let path = Path::new(&source.name);
            path.is_file().then(|| uri::real(path))
        };
        let paths = survey.sources.files.iter().map(place).collect();
        let lines = survey.sources.files.iter().map(|source| Lines::new(&source.text)).collect();
        let root = request.files.first().cloned().unwrap_or_default();
        Self(Rc::new(RuleSet { root, survey, paths, lines }))
    }

    /// Whether there is no error.
    pub fn is_sound(&self) -> bool {
        self.0.survey.sound
    }

    /// The files.
    pub fn sources(&self) -> &Sources {
        &self.0.survey.sources
    }

    /// Errors and warnings, by file and place.
    pub fn findings(&self) -> &[Diagnostic] {
        &self.0.survey.diagnostics
    }

    /// A place in a file: line from 0, column from 0 in units of UTF-16.
    fn spot(&self, file: &str, line: u32, character: u32) -> Option<Spot> {
        let at = self.sources().files.iter().position(|source| source.name == file)?;
        let file = u32::try_from(at).ok()?;
        let offset = self.0.offset(file, Position { line, character });
        Some(Spot { rule_set: Rc::clone(&self.0), file, offset })
    }

    /// What is known of the name or sign at a place, as Markdown.
    pub fn hover(&self, file: &str, line: u32, character: u32) -> Option<String> {
        match hover(&self.spot(file, line, character)?, &mut Recording::default())?.contents {
            Contents::MarkupContent(content) => Some(content.value),
            _ => None,
        }
    }

    /// What may be written at a place; names before the words of the language, those that begin as what is written.
    pub fn proposals(&self, file: &str, line: u32, character: u32) -> Vec<Proposal> {
        let Some(spot) = self.spot(file, line, character) else { return Vec::new() };
        let text = self.0.text(spot.file).get(..spot.offset as usize).unwrap_or_default();
        let mut items = completion::complete(&spot);
        items.sort_by(|a, b| a.sort_text.cmp(&b.sort_text));
        let proposals = items.into_iter().filter_map(|item| {
            let Some(CompletionItemTextEdit::TextEdit(edit)) = &item.text_edit else { return None };
            let begun = self.0.offset(spot.file, edit.range.start);
            let begun = text.get(begun as usize..)?;
            let fits = item.label.starts_with(begun) && item.label != begun;
            fits.then(|| Proposal {
                detail: item.detail.unwrap_or_default(),
                doc: match item.documentation {
                    Some(Documentation::String(doc)) => doc,
                    Some(Documentation::MarkupContent(doc)) => doc.value,
                    None => String::new(),
                },
                replaces: u32::try_from(begun.encode_utf16().count()).unwrap_or(0),
                label: item.label,
            })
        });
        proposals.take(MAX_PROPOSALS).collect()
    }

    /// Where a finding begins and ends: lines from 1, columns in characters from 1.
    pub fn place(&self, span: Span) -> ((usize, usize), (usize, usize)) {
        self.sources().lines_and_columns(span)
    }
}
