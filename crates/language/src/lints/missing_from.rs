//! A new primitive that a `from` does not name: `from` names leaves, and lists that were written before do not name the new one. A branch that goes
//! on by what it gave itself (`from(Move, Approach)` in a branch that gives Move and Approach) does not recognize its own state after the new leaf.
//!
//! A branch that only tests how it was entered, or that always returns the new leaf, causes no warning.

use super::leaves;
use crate::codes;
use crate::resolve::Resolver;
use crate::rules::{Branch, Choice, Consequent, Expr, ExprKind, Label};
use std::collections::BTreeSet;
use teachtree_base::diagnostic::Diagnostic;

impl Resolver {
    /// Warns where an extension brings a new primitive into a branch whose later choices ask whether the leaf before was one of the
    /// branch's own, while nothing anywhere asks for the new one.
    pub(super) fn missing_from(&mut self) {
        let mut findings = Vec::new();
        let mut asked: BTreeSet<usize> = BTreeSet::new();
        for latch in &self.rules.latches {
            asked.extend(listed(&latch.set).chain(listed(&latch.clear)));
        }
        for tree in &self.rules.trees {
            collect_asked(&tree.root, &mut asked);
        }
        for tree in &self.rules.trees {
            // The author of the tree knows the declarations of the same file.
            let home = tree.span.file;
            let is_new = |at: usize| {
                !asked.contains(&at) && self.rules.primitives.get(at).is_some_and(|new| new.span.file != home)
            };
            self.missing_from_in(&tree.root, home, &is_new, &mut findings);
        }
        self.findings.extend(findings);
    }

    fn missing_from_in(
        &self,
        branch: &Branch,
        home: u32,
        is_new: &dyn Fn(usize) -> bool,
        findings: &mut Vec<Diagnostic>,
    ) {
        let own: BTreeSet<usize> =
            branch.choices.iter().filter_map(gives).map(|label| label.primitive.index()).collect();
        for (at, choice) in branch.choices.iter().enumerate() {
            if let Consequent::Branch(below) = &choice.then {
                self.missing_from_in(below, home, is_new, findings);
            }
            if choice.span.file == home {
                continue;
            }
            let later = branch.choices.get(at + 1..).unwrap_or_default();
            for new in leaves_of(choice).into_iter().filter(|new| is_new(*new)) {
                let asks = |condition: &&Expr| listed(condition).any(|leaf| leaf != new && own.contains(&leaf));
                let next = later.iter().find_map(|choice| Some((choice, choice.condition.as_ref().filter(asks)?)));
                if let Some((next, condition)) = next {
                    findings.push(self.missing_from_warning(new, choice, next, condition));
                }
            }
        }
    }

    fn missing_from_warning(&self, new: usize, choice: &Choice, next: &Choice, condition: &Expr) -> Diagnostic {
        let name = self.rules.primitives.get(new).map_or("", |primitive| primitive.name.as_str());
        let leaf = gives(next).map_or("…".to_string(), |label| self.rules.label_name(label));
        Diagnostic::warning(codes::FORGOTTEN_FROM, format!("this branch does not define the leaf after `{name}`"))
            .at(choice.span, format!("on the frame after, the leaf before is `{name}`"))
            .at(condition.span, "this tests for other leaves")
            .help(format!("name the leaf that may follow it, such as `from({name}) and … => {leaf}` after it"))
    }
}

/// The primitives that `from` lists in a condition.
fn listed(condition: &Expr) -> impl Iterator<Item = usize> + use<> {
    let mut found = Vec::new();
    condition.walk(&mut |part| {
        if let ExprKind::From { labels, .. } = &part.kind {
            found.extend(labels.iter().map(|label| label.primitive.index()));
        }
    });
    found.into_iter()
}

/// What any condition asks for; a leaf that only asks for itself says nothing about what comes after it.
fn collect_asked(branch: &Branch, asked: &mut BTreeSet<usize>) {
    for choice in &branch.choices {
        let leaves = leaves_of(choice);
        let own = leaves.first().filter(|_| leaves.len() == 1);
        asked.extend(choice.condition.iter().flat_map(listed).filter(|leaf| Some(leaf) != own));
        if let Consequent::Branch(below) = &choice.then {
            collect_asked(below, asked);
        }
    }
}

/// The primitives that a choice may lead to.
fn leaves_of(choice: &Choice) -> BTreeSet<usize> {
    let mut found = BTreeSet::new();
    match &choice.then {
        Consequent::Branch(below) => leaves(below, &mut found),
        _ => found.extend(gives(choice).map(|label| label.primitive.index())),
    }
    found
}

/// The primitive that a choice gives itself.
fn gives(choice: &Choice) -> Option<Label> {
    match choice.then {
        Consequent::Primitive(label) => Some(label),
        _ => None,
    }
}
