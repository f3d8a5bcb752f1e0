//! Tasks that are made of tasks: `task assemble = peg_in_hole+, turn_screw`.

use super::codes;
use super::resolve::Resolver;
use super::rules::{Composite, Part, TaskId};
use super::syntax;
use teachtree_base::diagnostic::{Diagnostic, Span};

/// Earlier ones that each is compared with.
const MAX_COMPARED: usize = 1000;

impl Resolver {
    /// Notes their names, before those are looked up.
    pub(super) fn composite_names(&mut self, composites: &[(&syntax::Composite, Span)]) {
        for (composite, _) in composites {
            let name = &composite.name;
            match self.composites.get(&name.text) {
                Some(first) => {
                    let first = *first;
                    self.declared_twice("task", name, first);
                }
                None => {
                    self.composites.insert(name.text.clone(), name.span);
                }
            }
        }
    }

    /// Checks them; the tasks of primitives are known.
    pub(super) fn composites(&mut self, composites: &[(&syntax::Composite, Span)]) {
        for (composite, span) in composites {
            let name = &composite.name;
            if self.composites.get(&name.text) != Some(&name.span) {
                continue;
            }
            if let Some(task) = self.rules.tasks.iter().find(|task| task.name == name.text) {
                let first = task.span;
                self.declared_twice("task", name, first);
                continue;
            }
            let parts: Vec<Option<Part>> = composite.parts.iter().map(|(task, many)| self.part(task, *many)).collect();
            let Some(parts) = parts.into_iter().collect::<Option<Vec<Part>>>() else { continue };
            let doubled = parts.windows(2).position(|two| match two {
                [one, next] => one.task == next.task && (one.many || next.many),
                _ => false,
            });
            if let Some((name, _)) = doubled.and_then(|at| composite.parts.get(at + 1)) {
                let text = &name.text;
                self.report(
                    Diagnostic::error(codes::SAME_PARTS, format!("`{text}+` has another `{text}` beside it"))
                        .at(name.span, "the end of the run is ambiguous")
                        .help(format!("`{text}+` alone is one or more of them")),
                );
                continue;
            }
            self.warn_hidden_composite(name, &parts);
            self.rules.composites.push(Composite {
                name: name.text.clone(),
                parts,
                failure: composite.failure,
                span: *span,
            });
        }
    }

    fn part(&mut self, name: &syntax::Name, many: bool) -> Option<Part> {
        let at = self.rules.tasks.iter().position(|task| task.name == name.text);
        let Some(at) = at.and_then(|at| u32::try_from(at).ok()) else {
            let known = self.rules.tasks.iter().map(|task| task.name.clone()).collect();
            self.unknown("task", &name.text, name.span, |_| known);
            return None;
        };
        Some(Part { task: TaskId(at), many })
    }

    /// Warns of one that begins with all tasks of an earlier one: that takes them. How many its last one may be does not matter.
    fn warn_hidden_composite(&mut self, name: &syntax::Name, parts: &[Part]) {
        let takes = |earlier: &&Composite| {
            let last = earlier.parts.len().saturating_sub(1);
            let mut pairs = earlier.parts.iter().zip(parts).enumerate();
            let same = pairs.all(|(at, (one, own))| one.task == own.task && (at == last || one.many || !own.many));
            earlier.parts.len() <= parts.len() && same
        };
        if let Some(earlier) = self.rules.composites.iter().take(MAX_COMPARED).find(takes) {
            let (taker, span) = (earlier.name.clone(), earlier.span);
            self.report(
                Diagnostic::warning(codes::HIDDEN_TASK, format!("no tasks remain for `{}`", name.text))
                    .at(name.span, "declared after the other one")
                    .at(span, format!("`{taker}` takes them"))
                    .help("declare it before the other one"),
            );
        }
    }
}
