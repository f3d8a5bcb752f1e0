//! Trees: their choices are resolved, extensions are spliced in, and then each branch is checked as a whole.

mod conditions;
mod extensions;
pub mod gaps;

use super::codes;
use super::resolve::Resolver;
use super::rules::{Branch, Choice, Consequent, Hand, Tree, TreeScope};
use super::syntax;
use super::types::Scope;
use std::collections::BTreeMap;
use teachtree_base::diagnostic::{Diagnostic, Span};
use teachtree_base::hands::Side;
use teachtree_base::units::Dimension;

/// A tree in the making.
struct Draft {
    tree: Tree,
    /// Whether every choice could be read; if not, nothing is said about what is missing.
    whole: bool,
}

impl Resolver {
    /// Checks the trees and everything that extends them.
    pub(super) fn trees(&mut self, trees: &[&syntax::Tree], extends: &[&syntax::Extension]) {
        let mut drafts: Vec<Draft> = Vec::new();
        let mut rejected: Vec<Draft> = Vec::new();
        for tree in trees {
            let draft = self.draft(tree);
            let scope = draft.tree.scope;
            if let Some(first) = drafts.iter().map(|draft| &draft.tree).find(|other| other.name == tree.name.text) {
                self.declared_twice("tree", &tree.name, first.span);
                rejected.push(draft);
            } else if let Some(first) = drafts.iter().map(|draft| &draft.tree).find(|other| other.scope == scope) {
                let whom = if tree.each_hand { "each hand" } else { "both hands" };
                self.report(
                    Diagnostic::error(codes::SECOND_TREE, format!("there is a tree for {whom} already"))
                        .at(tree.name.span, "this is the second one")
                        .at(first.span, "this is the first one")
                        .help(format!("add to it with `extend {} first {{ … }}`", first.name)),
                );
                self.names.broken.insert(tree.name.text.clone());
                rejected.push(draft);
            } else {
                drafts.push(draft);
            }
        }
        self.extend_trees(&mut drafts, extends);
        for draft in drafts.iter().chain(&rejected) {
            let mut names = BTreeMap::new();
            self.check_branch(&draft.tree.root, draft, &mut names);
            if draft.whole {
                self.check_gaps(&draft.tree);
                self.check_stay(&draft.tree.root);
            }
        }
        self.rules.trees = drafts.into_iter().map(|draft| draft.tree).collect();
    }

    fn draft(&mut self, tree: &syntax::Tree) -> Draft {
        let scope = if tree.each_hand { Scope::HAND } else { Scope::SHARED }.with_memory();
        let mut whole = true;
        let settle = tree.settle.as_ref().and_then(|settle| {
            let settle = self.constant(settle, Some(Dimension::TIME), Scope::SHARED)?;
            self.want_duration(&settle)?;
            Some(settle)
        });
        let choices = self.tree_choices(&tree.choices, scope, &mut whole);
        let span = tree.name.span;
        let root = Branch { choices, span: tree.head };
        let scope = if tree.each_hand { TreeScope::EachHand } else { TreeScope::BothHands };
        Draft { tree: Tree { name: tree.name.text.clone(), scope, settle, root, span }, whole }
    }

    fn tree_choices(&mut self, choices: &[syntax::Choice], scope: Scope, whole: &mut bool) -> Vec<Choice> {
        let choice = |choice: &syntax::Choice| match &choice.then {
            syntax::Consequent::EachSide(label) => self.each_side(choice, label, scope, whole),
            _ => self.tree_choice(choice, scope, whole).into_iter().collect(),
        };
        choices.iter().flat_map(choice).collect()
    }

    /// `main => MainGrasp(side)`: a choice of the left hand, then one of the right; bare names in the condition are those of the hand.
    fn each_side(
        &mut self,
        choice: &syntax::Choice,
        label: &syntax::Label,
        scope: Scope,
        whole: &mut bool,
    ) -> Vec<Choice> {
        if scope.hand == Hand::This {
            let name = &label.name.text;
            self.report(
                Diagnostic::error(codes::WRONG_SIDE, format!("`{name}(side)` is used in the tree of a single hand"))
                    .at(label.span, "a choice of the left hand and one of the right")
                    .help("only a tree `for left, right` chooses between the hands"),
            );
            *whole = false;
            return Vec::new();
        }
        if choice.condition.is_none() {
            let name = &label.name.text;
            self.report(
                Diagnostic::error(codes::WRONG_SIDE, format!("`{name}(side)` is used after `else`"))
                    .at(label.span, "`else` holds for the left hand, and the right one is never tried")
                    .help(format!("say which: `{name}(left)` or `{name}(right)`")),
            );
            *whole = false;
            return Vec::new();
        }
        let mut choices = Vec::new();
        for side in Side::BOTH {
            let then = syntax::Consequent::Primitive(syntax::Label { side: Some(side), ..label.clone() });
            let of_side = syntax::Choice { then, ..choice.clone() };
            let scope = scope.of(Hand::Named(side));
            // What is wrong with the first is wrong with both.
            match self.tree_choice(&of_side, scope, whole) {
                Some(choice) => choices.push(choice),
                None => break,
            }
        }
        choices
    }

    fn tree_choice(&mut self, choice: &syntax::Choice, scope: Scope, whole: &mut bool) -> Option<Choice> {
        let condition = choice.condition.as_ref().map(|condition| self.condition(condition, scope, "a choice takes"));
        let then = match &choice.then {
            syntax::Consequent::Primitive(label) | syntax::Consequent::EachSide(label) => {
                let label = self.label(label, true);
                *whole &= label.is_some();
                label.map(Consequent::Primitive)
            }
            syntax::Consequent::Stay => Some(Consequent::Stay),
            syntax::Consequent::Separate => {
                if scope.hand == Hand::This {
                    self.report(
                        Diagnostic::error(codes::SEPARATE_HAND, "`separate` is used in the tree of a single hand")
                            .at(choice.span, "there is nothing to separate here")
                            .help("only a tree `for left, right` may leave the hands to their own trees"),
                    );
                }
                Some(Consequent::Separate)
            }
            syntax::Consequent::Branch(below) => {
                Some(Consequent::Branch(Branch { choices: self.tree_choices(below, scope, whole), span: choice.span }))
            }
            syntax::Consequent::Broken => {
                *whole = false;
                None
            }
        };
        let condition = match condition {
            Some(None) => {
                *whole = false;
                return None;
            }
            Some(condition) => condition,
            None => None,
        };
        Some(Choice {
            name: choice.name.as_ref().map(|name| name.text.clone()),
            condition,
            then: then?,
            span: choice.span,
        })
    }

    /// Names once in a tree, and `else` last.
    fn check_branch(&mut self, branch: &Branch, draft: &Draft, names: &mut BTreeMap<String, Span>) {
        let mut otherwise: Option<Span> = None;
        for choice in &branch.choices {
            if let Some(first) = otherwise {
                self.report(
                    Diagnostic::error(codes::AFTER_ELSE, "this choice is never reached")
                        .at(choice.span, "it is after `else`")
                        .at(first, "this takes every frame")
                        .help("move it up"),
                );
                return;
            }
            if choice.condition.is_none() {
                otherwise = Some(choice.span);
            }
            if let Some(name) = &choice.name {
                match names.get(name) {
                    // The two choices of `(side)`.
                    Some(first) if *first == choice.span => {}
                    Some(first) => {
                        let word = syntax::Name { text: name.clone(), span: choice.span };
                        let first = *first;
                        self.declared_twice(&format!("choice in `{}`", draft.tree.name), &word, first);
                    }
                    None => {
                        names.insert(name.clone(), choice.span);
                    }
                }
            }
            if let Consequent::Branch(below) = &choice.then {
                self.check_branch(below, draft, names);
            }
        }
    }

    /// No branch may leave frames without a choice.
    fn check_gaps(&mut self, tree: &Tree) {
        let finding = |gap: gaps::Gap| {
            let finding = Diagnostic::error(codes::NOT_EXHAUSTIVE, "this branch leaves frames without a choice")
                .at(gap.branch.span, "possibly none of its choices holds");
            let finding = match gap.frame {
                Some(frame) => finding.note(format!("for instance on a frame where {}", frame.text())),
                None => finding,
            };
            finding.help("end it with `else => …`")
        };
        let findings: Vec<Diagnostic> = gaps::gaps(&self.rules, tree).into_iter().map(finding).collect();
        self.findings.extend(findings);
    }

    /// `stay` must not be taken while there is nothing to stay with.
    fn check_stay(&mut self, branch: &Branch) {
        for choice in &branch.choices {
            let holds = choice.condition.as_ref().map_or(Some(true), conditions::at_start);
            if holds == Some(false) {
                continue;
            }
            match &choice.then {
                Consequent::Stay => {
                    self.report(
                        Diagnostic::error(
                            codes::STAY_FROM_NONE,
                            "`stay` can be reached before any primitive has begun",
                        )
                        .at(choice.span, "on the first frame there is no primitive to stay with")
                        .help("put a choice `from(none) => …` before it"),
                    );
                }
                Consequent::Branch(below) => self.check_stay(below),
                Consequent::Primitive(_) | Consequent::Separate => {}
            }
            if holds == Some(true) {
                return;
            }
        }
    }
}
