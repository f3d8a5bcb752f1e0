//! What speaks for a choice that `learn` wrote or changed: a comment at the end of its line.

use super::rules::{Branch, Choice, Consequent, Rules};
use teachtree_base::diagnostic::Span;

/// How the comment begins.
pub const EVIDENCE: &str = "// learned: ";

/// The evidence for a choice below `root`: behind its condition, or behind its leaf or opening brace. `None` without such a comment, and where another choice
/// begins on the line, since the comment may be about that one.
pub fn evidence(rules: &Rules, root: &Branch, choice: &Choice) -> Option<String> {
    let condition = choice.condition.as_ref().map_or(choice.span, |condition| condition.span);
    [condition, choice.span].into_iter().find_map(|end| {
        let (_, evidence) = evidence_in(rules.sources.rest_of_line(end))?;
        let lines = |span: Span| rules.sources.lines_and_columns(span);
        let line = lines(end).1.0;
        let mut is_shared = false;
        walk(root, &mut |other| {
            is_shared |= other.span != choice.span && other.span.file == end.file && lines(other.span).0.0 == line;
        });
        (!is_shared).then(|| evidence.to_string())
    })
}

/// The evidence in a line, behind the byte at which its comment begins.
pub fn evidence_in(line: &str) -> Option<(usize, &str)> {
    let (before, evidence) = line.split_once(EVIDENCE)?;
    Some((before.len(), evidence.trim()))
}

fn walk(branch: &Branch, visit: &mut dyn FnMut(&Choice)) {
    for choice in &branch.choices {
        visit(choice);
        if let Consequent::Branch(below) = &choice.then {
            walk(below, visit);
        }
    }
}
