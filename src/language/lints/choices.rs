//! Choices of a tree that are never taken: what is asked before them and on the way to them leaves them no frame.
//!
//! It is decided on the conditions (`formula`), so what is told holds on every log; what cannot be decided is not told.

use super::proof::{Asked, Prover};
use crate::base::diagnostic::{Diagnostic, Span};
use crate::language::codes;
use crate::language::formula::label;
use crate::language::rules::{Branch, Choice, Hand, Rules, Then, TreeScope};
use std::collections::BTreeSet;

/// Warns of choices in the `named` files that are never taken. An extension that takes all frames from a choice of the tree itself is
/// meant to.
pub fn dead_choices(rules: &Rules, named: &BTreeSet<u32>) -> Vec<Diagnostic> {
    let mut lint = Choices { prover: Prover::new(rules), above: Vec::new(), findings: Vec::new() };
    let mut findings = Vec::new();
    for tree in &rules.trees {
        lint.prover.this = if tree.scope == TreeScope::EachHand { Hand::This } else { Hand::Nobody };
        lint.prover.before = tree.root.ways().iter().filter_map(|way| leaf(&way.choice.then, rules)).collect();
        lint.prover.before.insert("none".into());
        lint.branch(&tree.root);
        let concerns = |(dead, finding): &(Span, Diagnostic)| {
            let extended = finding.labels.iter().any(|label| label.span.file != dead.file);
            named.contains(&dead.file) && (dead.file != tree.span.file || !extended)
        };
        findings.extend(lint.findings.drain(..).filter(concerns).map(|(_, finding)| finding));
    }
    findings
}

/// A leaf as it is known on the frame after.
fn leaf(then: &Then, rules: &Rules) -> Option<String> {
    match then {
        Then::Primitive(given) => Some(label(*given, rules)),
        Then::Separate => Some("separate".into()),
        Then::Stay | Then::Branch(_) => None,
    }
}

struct Choices<'a> {
    prover: Prover<'a>,
    /// What was asked of the choices before and above, with whether it is above.
    above: Vec<(Asked<'a>, bool)>,
    /// What is never taken, and the warning.
    findings: Vec<(Span, Diagnostic)>,
}

impl<'a> Choices<'a> {
    fn branch(&mut self, branch: &'a Branch) {
        let start = self.above.len();
        for (at, choice) in branch.choices.iter().enumerate() {
            // The last choice of a branch is taken whenever the others are not.
            let next = branch.choices.get(at + 1);
            let (Some(condition), Some(next)) = (&choice.condition, next) else {
                self.below(choice);
                continue;
            };
            let Some(asked) = self.prover.asked(condition, true) else { break };
            if self.is_impossible(&asked) {
                let finding = self.never(choice, asked);
                self.findings.push((head(choice), finding));
                continue;
            }
            let not = Asked { wanted: false, ..asked.clone() };
            let always = self.is_impossible(&not);
            self.above.push((asked, true));
            self.below(choice);
            self.above.pop();
            if always {
                let finding = self.always(not, next);
                self.findings.push((head(next), finding));
                break;
            }
            self.above.push((not, false));
        }
        self.above.truncate(start);
    }

    fn below(&mut self, choice: &'a Choice) {
        if let Then::Branch(below) = &choice.then {
            self.branch(below);
        }
    }

    fn is_impossible(&mut self, last: &Asked<'a>) -> bool {
        let all = self.above.iter().map(|(asked, _)| asked).chain([last]);
        let all: Vec<_> = all.map(|asked| (&asked.formula, asked.wanted)).collect();
        self.prover.is_impossible(&all)
    }

    /// Of what was asked before, what leaves no frame for the `last` condition to come out as wanted.
    fn why(&mut self, last: &Asked<'a>) -> Vec<(Asked<'a>, Option<bool>)> {
        let above = self.above.iter().map(|(asked, above)| (asked.clone(), Some(*above)));
        let all = above.chain([(last.clone(), None)]).collect();
        self.prover.least(all, |(asked, _): &(Asked<'a>, Option<bool>)| (&asked.formula, asked.wanted))
    }

    fn never(&mut self, choice: &Choice, last: Asked<'a>) -> Diagnostic {
        let why = self.why(&last);
        let reason = self.prover.reason(&why.iter().map(|(asked, _)| asked.clone()).collect::<Vec<_>>());
        let place = last.expr.span;
        let mut finding = Diagnostic::warning(codes::NEVER_TAKEN, format!("{} is never taken", named(choice)));
        let earlier = why.iter().filter(|(_, above)| *above == Some(false)).count();
        if why.len() == 1 {
            finding = self.prover.alone(finding, &last);
        } else {
            finding = finding.at(place, "no frame that gets here has this");
        }
        for (asked, above) in why.iter().filter_map(|(asked, above)| Some((asked, (*above)?))) {
            let text = match (above, earlier) {
                (true, _) => "every frame on this way has this",
                (false, 1) => "this takes every such frame before",
                (false, _) => "this takes some of them before",
            };
            finding = finding.at(asked.expr.span, text);
        }
        if let Some(reason) = reason {
            finding = finding.note(reason);
        }
        finding.help(if earlier > 0 {
            "move it up, in front of what takes its frames, or remove it"
        } else {
            "change one of the conditions, or remove this choice"
        })
    }

    fn always(&mut self, not: Asked<'a>, next: &Choice) -> Diagnostic {
        let why = self.why(&not);
        let reason = self.prover.reason(&why.iter().map(|(asked, _)| asked.clone()).collect::<Vec<_>>());
        let mut finding = Diagnostic::warning(codes::ALWAYS_TAKEN, "nothing behind this choice is ever taken");
        finding = if why.len() == 1 {
            self.prover.alone(finding, &not)
        } else {
            finding.at(not.expr.span, "every frame that gets here has this")
        };
        for (asked, above) in why.iter().filter_map(|(asked, above)| Some((asked, (*above)?))) {
            let text = if above { "every frame on this way has this" } else { "this takes the others before" };
            finding = finding.at(asked.expr.span, text);
        }
        finding = finding.at(head(next), "never taken");
        if let Some(reason) = reason {
            finding = finding.note(reason);
        }
        finding.help("write `else` for this condition and remove what is behind it, or change the condition")
    }
}

fn named(choice: &Choice) -> String {
    choice.name.as_ref().map_or("this choice".to_string(), |name| format!("the choice `{name}`"))
}

/// Where a choice begins.
fn head(choice: &Choice) -> Span {
    choice.condition.as_ref().map_or(choice.span, |condition| condition.span)
}
