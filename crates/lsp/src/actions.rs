//! Edits that are proposed: the fixes that diagnostics carry, and the one style.

use super::findings;
use super::uri;
use super::workspace::Workspace;
use super::{Answer, RequestError};
use lsp_types::{CodeAction, CodeActionKind, CodeActionParams, Range, TextEdit, Uri, WorkspaceEdit};
use teachtree_language::format::format;

/// The fixes of what is found in a range.
pub fn fixes(workspace: &mut Workspace, params: &CodeActionParams) -> Vec<CodeAction> {
    let wanted = params.context.only.as_ref();
    if wanted.is_some_and(|kinds| !kinds.contains(&CodeActionKind::QuickFix) && !kinds.contains(&CodeActionKind::Empty))
    {
        return Vec::new();
    }
    let path = uri::path_of(params.text_document.uri.as_ref());
    let mut actions: Vec<CodeAction> = Vec::new();
    for rule_set in workspace.rule_sets() {
        for finding in &rule_set.survey.diagnostics {
            let Some(fix) = &finding.fix else { continue };
            let (file, diagnostic) = findings::shown(workspace, &rule_set, finding);
            let Some(place) = workspace.location(&rule_set, fix.span) else { continue };
            let near = touches(diagnostic.range, params.range) || touches(place.range, params.range);
            let own = rule_set.path(fix.span.file).is_some_and(|path| !workspace.library.holds(path));
            if file != path || !near || !own {
                continue;
            }
            let edit = TextEdit { range: place.range, new_text: fix.replacement.clone() };
            let changes = std::iter::once((place.uri, vec![edit])).collect();
            let action = CodeAction {
                title: finding.help.first().cloned().unwrap_or_else(|| format!("write `{}`", fix.replacement)),
                kind: Some(CodeActionKind::QuickFix),
                diagnostics: Some(vec![diagnostic]),
                is_preferred: Some(true),
                edit: Some(WorkspaceEdit { changes: Some(changes), ..WorkspaceEdit::default() }),
                ..CodeAction::default()
            };
            if !actions.contains(&action) {
                actions.push(action);
            }
        }
    }
    actions
}

fn touches(one: Range, other: Range) -> bool {
    let before =
        |one: Range, other: Range| (one.end.line, one.end.character) < (other.start.line, other.start.character);
    !before(one, other) && !before(other, one)
}

/// The edits that bring an open file into the one style: of the lines between the first and the last that differ. The ends of lines stay
/// what they are.
pub fn style(workspace: &Workspace, uri: &Uri) -> Answer<Vec<TextEdit>> {
    let Some(document) = workspace.open.get(&uri::path_of(uri.as_ref())) else {
        return Err(RequestError::failed("this file is not open"));
    };
    let formatted = format(&document.text).map_err(|findings| {
        let first = findings.first().map_or("", |finding| finding.message.as_str());
        RequestError::failed(format!("a file with syntax errors is not formatted: {first}"))
    })?;
    let end = if document.text.contains("\r\n") { "\r\n" } else { "\n" };
    let old: Vec<&str> = document.text.split_inclusive('\n').collect();
    let new: Vec<String> = formatted
        .split_inclusive('\n')
        .map(|line| line.strip_suffix('\n').map_or(line.into(), |line| format!("{line}{end}")))
        .collect();
    let same = old.iter().zip(&new).take_while(|(old, new)| *old == *new).count();
    let rest = old.len().min(new.len()) - same;
    let same_behind = old.iter().rev().zip(new.iter().rev()).take(rest).take_while(|(old, new)| *old == *new).count();
    let changed = old.get(same..old.len() - same_behind).unwrap_or_default();
    let written = new.get(same..new.len() - same_behind).unwrap_or_default();
    if changed.is_empty() && written.is_empty() {
        return Ok(Vec::new());
    }
    let lines = super::lines::Lines::new(&document.text);
    let start: usize = old.iter().take(same).map(|line| line.len()).sum();
    let behind = start + changed.iter().map(|line| line.len()).sum::<usize>();
    let at = |offset| lines.position(&document.text, offset);
    Ok(vec![TextEdit { range: Range { start: at(start), end: at(behind) }, new_text: written.concat() }])
}
