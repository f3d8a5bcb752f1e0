//! Diagnostics for editors: each with its place, code, message and fix.

use super::library::Library;
use super::workspace::{RuleSet, Workspace};
use super::{FileValidator, uri};
use lsp_types::{CodeDescription, Diagnostic, DiagnosticRelatedInformation, DiagnosticSeverity, Position, Range, Uri};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use teachtree_base::diagnostic::{Diagnostic as Finding, Severity, Span};
use teachtree_base::error::InputError;

/// The diagnostics of all that is open, by file; an open file without any has an empty list. One that several files bring up is reported once.
pub fn all(workspace: &mut Workspace, validate: FileValidator) -> BTreeMap<PathBuf, Vec<Diagnostic>> {
    let mut by_file: BTreeMap<PathBuf, Vec<Diagnostic>> = BTreeMap::new();
    for (path, document) in &workspace.others {
        let found = validate(path, &document.text);
        by_file.insert(path.clone(), found.iter().map(|error| of_other(error, path, &document.text)).collect());
    }
    by_file.extend(workspace.open.keys().map(|path| (path.clone(), Vec::new())));
    for rule_set in workspace.rule_sets() {
        for finding in &rule_set.survey.diagnostics {
            let (path, diagnostic) = shown(workspace, &rule_set, finding);
            let known = by_file.entry(path).or_default();
            if !known.contains(&diagnostic) {
                known.push(diagnostic);
            }
        }
    }
    by_file
}

/// The finding of a file other than rules: from its place to the end of the line.
fn of_other(error: &InputError, path: &Path, text: &str) -> Diagnostic {
    let (file, line, column) = error.file_line_column();
    // A robot file may name others: what is wrong with one of them is shown at the beginning.
    let is_own = Path::new(file) == path;
    let (line, column) = if is_own { (line, column) } else { (None, None) };
    let line = line.unwrap_or(1).saturating_sub(1);
    let shown = text.lines().nth(line).unwrap_or_default();
    let units = |text: &str| u32::try_from(text.encode_utf16().count()).unwrap_or(u32::MAX);
    let before: String = shown.chars().take(column.unwrap_or(1).saturating_sub(1)).collect();
    let at = |character| Position { line: u32::try_from(line).unwrap_or(u32::MAX), character };
    let mut message = if is_own { error.message.clone() } else { format!("{}: {}", error.place, error.message) };
    if let Some(help) = &error.help {
        message.push_str("\nhelp: ");
        message.push_str(help);
    }
    Diagnostic {
        range: Range { start: at(units(&before)), end: at(units(shown)) },
        severity: Some(DiagnosticSeverity::Error),
        source: Some("teachtree".into()),
        message: message.into(),
        ..Diagnostic::default()
    }
}

/// A finding as an editor shows it, and in which file.
pub fn shown(workspace: &Workspace, rule_set: &RuleSet, finding: &Finding) -> (PathBuf, Diagnostic) {
    let span = place(&workspace.library, rule_set, finding);
    // A file that could not be read at all is none of the sources.
    let path = rule_set.path(span.file).unwrap_or(&rule_set.root).to_path_buf();
    let mut message = finding.message.clone();
    for line in finding.labels.first().map(|label| &label.text).into_iter().chain(&finding.notes) {
        message.push('\n');
        message.push_str(line);
    }
    for help in &finding.help {
        message.push_str("\nhelp: ");
        message.push_str(help);
    }
    let page = workspace.library.page(finding.code);
    if page.is_none() {
        // Nothing to click on: say where the page is.
        message.push_str(&format!("\n`teachtree check --explain {}` explains it", finding.code));
    }
    let related = finding.labels.iter().filter(|label| label.span != span).filter_map(|label| {
        Some(DiagnosticRelatedInformation {
            location: workspace.location(rule_set, label.span)?,
            message: label.text.clone(),
        })
    });
    let related: Vec<_> = related.collect();
    let diagnostic = Diagnostic {
        range: rule_set.range(span),
        severity: Some(match finding.severity {
            Severity::Error => DiagnosticSeverity::Error,
            Severity::Warning => DiagnosticSeverity::Warning,
        }),
        code: Some(finding.code.to_string().into()),
        code_description: page.map(|page| CodeDescription { href: Uri::from(uri::uri_of(&page)) }),
        source: Some("teachtree".into()),
        message: message.into(),
        related_information: (!related.is_empty()).then_some(related),
        ..Diagnostic::default()
    };
    (path, diagnostic)
}

/// Where a finding is shown: at its first place in a file of the user, else at the beginning of the file that was asked for.
fn place(library: &Library, rule_set: &RuleSet, finding: &Finding) -> Span {
    let is_users = |path: Option<&Path>| path.is_some_and(|path| !library.holds(path));
    let asked_for = (0..).zip(&rule_set.paths).find(|(_, path)| is_users(path.as_deref())).map_or(0, |(file, _)| file);
    let places = finding.labels.iter().map(|label| label.span);
    let own = places.clone().find(|span| is_users(rule_set.path(span.file)));
    // Without a place in the user's files, a place in a shipped file is taken.
    let any = places.into_iter().next().filter(|_| !is_users(rule_set.path(asked_for)));
    own.or(any).unwrap_or(Span { file: asked_for, start: 0, end: 0 })
}
