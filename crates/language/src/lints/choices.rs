//! Choices of a tree that are never taken: what is asked before them and on the way to them leaves them no frame.
//!
//! It is decided on the conditions (`formula`), so each finding holds on every log; what cannot be decided is not reported.

use super::proof::{Prover, Requirement};
use crate::codes;
use crate::formula::{Frame, label};
use crate::rules::{Branch, Choice, Consequent, Expr, Hand, Rules, TreeScope};
use std::collections::BTreeSet;
use teachtree_base::diagnostic::{Diagnostic, Span};

/// A choice that is never taken.
#[derive(Clone, Debug)]
pub struct DeadChoice {
    /// Its start.
    pub choice: Span,
    /// The warning.
    pub finding: Diagnostic,
    /// A frame that it seems to be for, when there is one, and the condition of the choice that takes it.
    pub taken: Option<(Frame, Span)>,
}

/// Warns of choices in the `named` files that are never taken. An extension that takes all frames from a choice of the tree itself is
/// meant to.
pub fn dead_choices(rules: &Rules, named: &BTreeSet<u32>) -> Vec<DeadChoice> {
    let mut lint = Choices { prover: Prover::new(rules), rules, above: Vec::new(), findings: Vec::new() };
    let mut findings = Vec::new();
    for tree in &rules.trees {
        lint.prover.this = if tree.scope == TreeScope::EachHand { Hand::This } else { Hand::Shared };
        let mut before = BTreeSet::from(["none".to_string()]);
        leaves(&tree.root, rules, &mut before);
        lint.prover.before = before.into();
        lint.branch(&tree.root);
        let concerns = |dead: &DeadChoice| {
            let extended = dead.finding.labels.iter().any(|label| label.span.file != dead.choice.file);
            named.contains(&dead.choice.file) && (dead.choice.file != tree.span.file || !extended)
        };
        findings.extend(lint.findings.drain(..).filter(concerns));
    }
    findings
}

/// Adds the leaves of a branch as they are known on the frame after.
fn leaves(branch: &Branch, rules: &Rules, found: &mut BTreeSet<String>) {
    for choice in &branch.choices {
        match &choice.then {
            Consequent::Primitive(given) => {
                found.insert(label(*given, rules));
            }
            Consequent::Separate => {
                found.insert("separate".into());
            }
            Consequent::Stay => {}
            Consequent::Branch(below) => leaves(below, rules, found),
        }
    }
}

struct Choices<'a> {
    prover: Prover<'a>,
    rules: &'a Rules,
    /// The conditions of the choices before and above, each with whether it is above.
    above: Vec<(Requirement<'a>, bool)>,
    findings: Vec<DeadChoice>,
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
            let Some(requirement) = self.prover.requirement(condition, true) else { break };
            if self.is_impossible(&requirement) {
                let (finding, why) = self.never(choice, requirement.clone());
                let taken = self.taken(Some(&requirement), &why);
                self.report(choice, finding, taken);
                continue;
            }
            let not = Requirement { wanted: false, ..requirement.clone() };
            let always = self.is_impossible(&not);
            self.above.push((requirement, true));
            self.below(choice);
            self.above.pop();
            if always {
                let finding = self.always(not.clone(), next);
                self.above.push((not, false));
                let requirement =
                    next.condition.as_ref().and_then(|condition| self.prover.requirement(condition, true));
                let taken = self.taken(requirement.as_ref(), &[condition]);
                self.report(next, finding, taken);
                break;
            }
            self.above.push((not, false));
        }
        self.above.truncate(start);
    }

    fn below(&mut self, choice: &'a Choice) {
        if let Consequent::Branch(below) = &choice.then {
            self.branch(below);
        }
    }

    fn is_impossible(&mut self, last: &Requirement<'a>) -> bool {
        let all = self.above.iter().map(|(requirement, _)| requirement).chain([last]);
        let all: Vec<_> = all.map(|requirement| (&requirement.formula, requirement.wanted)).collect();
        self.prover.is_impossible(&all)
    }

    /// A frame on the way to here on which the `last` condition holds, if it can hold at all, with that of the earlier `takers` that takes
    /// it.
    fn taken(&mut self, last: Option<&Requirement<'a>>, takers: &[&'a Expr]) -> Option<(Frame, Span)> {
        for at in 0..self.above.len() {
            let (taker, false) = self.above.get(at)? else { continue };
            if !takers.iter().any(|expr| std::ptr::eq(*expr, taker.expr)) {
                continue;
            }
            let before = self.above.iter().take(at);
            let behind = self.above.iter().skip(at + 1).filter(|(_, above)| *above);
            let others = before.chain(behind).map(|(requirement, _)| (&requirement.formula, requirement.wanted));
            let last = last.iter().map(|last| (&last.formula, true));
            let all: Vec<_> = others.chain([(&taker.formula, true)]).chain(last).collect();
            if let Some(frame) = self.prover.frame(&all) {
                return Some((frame, taker.expr.span));
            }
        }
        None
    }

    fn report(&mut self, choice: &Choice, mut finding: Diagnostic, taken: Option<(Frame, Span)>) {
        if let Some((frame, taker)) = &taken {
            let place = self.rules.sources.place(*taker);
            finding = finding.note(format!("for instance, a frame where {} is taken at {place}", frame.text()));
        }
        self.findings.push(DeadChoice { choice: head(choice), finding, taken });
    }

    /// Returns the earlier conditions that exclude the wanted outcome of the `last` condition on all frames.
    fn why(&mut self, last: &Requirement<'a>) -> Vec<(Requirement<'a>, Option<bool>)> {
        let above = self.above.iter().map(|(requirement, above)| (requirement.clone(), Some(*above)));
        let all = above.chain([(last.clone(), None)]).collect();
        self.prover
            .least(all, |(requirement, _): &(Requirement<'a>, Option<bool>)| (&requirement.formula, requirement.wanted))
    }

    /// The warning, with the earlier conditions that are the reason.
    fn never(&mut self, choice: &Choice, last: Requirement<'a>) -> (Diagnostic, Vec<&'a Expr>) {
        let why = self.why(&last);
        let reason = self.prover.reason(&why.iter().map(|(requirement, _)| requirement.clone()).collect::<Vec<_>>());
        let place = last.expr.span;
        let mut finding = Diagnostic::warning(codes::NEVER_TAKEN, format!("{} is never taken", named(choice)));
        let earlier = why.iter().filter(|(_, above)| *above == Some(false)).count();
        if why.len() == 1 {
            finding = self.prover.alone(finding, &last);
        } else {
            finding = finding.at(place, "no frame that reaches this choice satisfies this");
        }
        for (requirement, above) in why.iter().filter_map(|(requirement, above)| Some((requirement, (*above)?))) {
            let text = match (above, earlier) {
                (true, _) => "every frame on this path satisfies this",
                (false, 1) => "this takes every such frame first",
                (false, _) => "this takes some of them first",
            };
            finding = finding.at(requirement.expr.span, text);
        }
        if let Some(reason) = reason {
            finding = finding.note(reason);
        }
        let finding = finding.help(if earlier > 0 {
            "move it up, before the choices that take its frames, or remove it"
        } else {
            "change one of the conditions, or remove this choice"
        });
        (
            finding,
            why.iter().filter(|(_, above)| *above == Some(false)).map(|(requirement, _)| requirement.expr).collect(),
        )
    }

    fn always(&mut self, not: Requirement<'a>, next: &Choice) -> Diagnostic {
        let why = self.why(&not);
        let reason = self.prover.reason(&why.iter().map(|(requirement, _)| requirement.clone()).collect::<Vec<_>>());
        let mut finding = Diagnostic::warning(codes::ALWAYS_TAKEN, "no choice after this one is ever taken");
        finding = if why.len() == 1 {
            self.prover.alone(finding, &not)
        } else {
            finding.at(not.expr.span, "every frame that reaches this choice satisfies this")
        };
        for (requirement, above) in why.iter().filter_map(|(requirement, above)| Some((requirement, (*above)?))) {
            let text = if above { "every frame on this path satisfies this" } else { "this takes the others first" };
            finding = finding.at(requirement.expr.span, text);
        }
        finding = finding.at(head(next), "never taken");
        if let Some(reason) = reason {
            finding = finding.note(reason);
        }
        finding.help("write `else` for this condition and remove the choices after it, or change the condition")
    }
}

fn named(choice: &Choice) -> String {
    choice.name.as_ref().map_or("this choice".to_string(), |name| format!("the choice `{name}`"))
}

/// Returns the start of a choice.
fn head(choice: &Choice) -> Span {
    choice.condition.as_ref().map_or(choice.span, |condition| condition.span)
}
