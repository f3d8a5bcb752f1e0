//! Warnings: likely mistakes in rule sets that have no errors.

pub mod choices;
pub mod conditions;
pub mod cyclic_rewrites;
pub mod durations;
pub mod labels;
mod missing_from;
mod proof;
mod quotients;
pub mod suppressions;
pub mod tasks;

use super::codes;
use super::ops::TemporalOperator;
use super::resolve::{Resolver, ValueKind};
use super::rules::{Branch, Consequent, Constant, Expr, ExprKind, Hand, Label, PrimitiveId, Rules, TreeScope};
use std::collections::BTreeSet;
use teachtree_base::diagnostic::{Diagnostic, Severity};

impl Resolver {
    /// Adds the warnings.
    pub(super) fn lints(&mut self, named: &BTreeSet<u32>) {
        if self.findings.iter().any(|finding| finding.severity == Severity::Error) || self.names.incomplete {
            return;
        }
        // A file without a tree is a part for others.
        let (missing, reported) = labels::missing_labels(&self.rules, named);
        if !self.rules.trees.is_empty() {
            self.unused_values(named);
            self.unused_primitives(named, &reported);
            self.meanings_left_out(named);
        }
        self.racing_latches();
        self.missing_from();
        let dead: Vec<Diagnostic> =
            choices::dead_choices(&self.rules, named).into_iter().map(|dead| dead.finding).collect();
        let reported: Vec<_> = dead.iter().filter_map(Diagnostic::place).collect();
        let idle = conditions::idle_conditions(&self.rules, named, &reported);
        let idle: Vec<Diagnostic> = idle.into_iter().map(|(_, finding)| finding).collect();
        let short = durations::short_durations(&self.rules, named);
        let zero = quotients::zero_divisors(&self.rules, named);
        let hidden = tasks::hidden_tasks(&self.rules, named);
        let undoing =
            cyclic_rewrites::cyclic_rewrites(&self.rules, named).into_iter().map(|undoing| undoing.finding).collect();
        self.findings.extend([dead, idle, short, zero, hidden, missing, undoing].into_iter().flatten());
    }

    fn unused_values(&mut self, named: &BTreeSet<u32>) {
        let unused: Vec<Diagnostic> = self
            .names
            .values
            .iter()
            .filter(|(name, value)| named.contains(&value.span.file) && !self.used.contains(*name))
            .map(|(name, value)| {
                let kind = match value.what {
                    ValueKind::Param => "param",
                    ValueKind::Signal => "signal",
                    ValueKind::Latch => "latch",
                };
                Diagnostic::warning(codes::UNUSED, format!("the {kind} `{name}` is never used"))
                    .at(value.span, "nothing reads it")
            })
            .collect();
        self.findings.extend(unused);
    }

    /// A primitive that no leaf gives and no rule rewrites to, unless a finding about its use is `reported` already.
    fn unused_primitives(&mut self, named: &BTreeSet<u32>, reported: &BTreeSet<PrimitiveId>) {
        let mut given: BTreeSet<usize> = reported.iter().map(|primitive| primitive.index()).collect();
        for tree in &self.rules.trees {
            leaves(&tree.root, &mut given);
        }
        for rule in &self.rules.relabels {
            given.extend(rule.kind.becomes().map(|becomes| becomes.primitive.index()));
        }
        let unused: Vec<Diagnostic> = self
            .rules
            .primitives
            .iter()
            .enumerate()
            .filter(|(at, primitive)| named.contains(&primitive.span.file) && !given.contains(at))
            .map(|(_, primitive)| {
                Diagnostic::warning(codes::UNUSED, format!("the primitive `{}` never occurs", primitive.name))
                    .at(primitive.span, "no leaf gives it and no rule rewrites to it")
            })
            .collect();
        self.findings.extend(unused);
    }

    /// Primitives without a meaning among others that have one: a robot that carries out the others cannot carry out these.
    fn meanings_left_out(&mut self, named: &BTreeSet<u32>) {
        let primitives = &self.rules.primitives;
        if primitives.iter().all(|primitive| primitive.does.is_none()) {
            return;
        }
        let left_out = primitives.iter().zip((0..).map(PrimitiveId)).filter(|(primitive, id)| {
            named.contains(&primitive.span.file) && primitive.is.is_none() && self.rules.meaning(*id).is_none()
        });
        let findings: Vec<Diagnostic> = left_out
            .map(|(primitive, _)| {
                let name = &primitive.name;
                Diagnostic::warning(codes::NO_MEANING, format!("no action is declared for `{name}`"))
                    .at(primitive.span, "a robot cannot carry it out")
                    .help(format!("declare a kind, such as `{name} is Translate`, or an action: `{name} does carry`"))
            })
            .collect();
        self.findings.extend(findings);
    }

    /// A latch that `from` sets after a time that does not outlast the settling: the leaf that sets it may never settle.
    fn racing_latches(&mut self) {
        let mut findings = Vec::new();
        for latch in &self.rules.latches {
            let scope = if latch.per_hand { TreeScope::EachHand } else { TreeScope::BothHands };
            let Some(settle) = self.rules.tree(scope).and_then(|tree| tree.settle.as_ref()) else { continue };
            let Some((place, lasting)) = waits_for_from(&latch.set) else { continue };
            if lasting.is_some_and(|lasting| lasting.value > settle.value) {
                continue;
            }
            let message = lasting.map_or("at once".to_string(), |lasting| format!("after {} s", lasting.value));
            findings.push(
                Diagnostic::warning(
                    codes::LATCH_RACES_SETTLING,
                    format!("the latch `{}` may be set before its leaf settles", latch.name),
                )
                .at(place.span, format!("it is set {message}"))
                .at(settle.span, format!("a leaf settles after {} s", settle.value))
                .note("a leaf that ends when it sets the latch vanishes when it did not last as long as the settling")
                .help("let `for` take longer than the settling"),
            );
        }
        self.findings.extend(findings);
    }
}

/// The primitives of the leaves.
fn leaves(branch: &Branch, given: &mut BTreeSet<usize>) {
    let mut labels = BTreeSet::new();
    leaves_with_sides(branch, &mut labels);
    given.extend(labels.iter().map(|label| label.primitive.index()));
}

/// The labels of the leaves.
fn leaves_with_sides(branch: &Branch, given: &mut BTreeSet<Label>) {
    for choice in &branch.choices {
        match &choice.then {
            Consequent::Primitive(label) => {
                given.insert(*label);
            }
            Consequent::Branch(below) => leaves_with_sides(below, given),
            Consequent::Stay | Consequent::Separate => {}
        }
    }
}

/// Every expression of signals, latches and trees, with whose it is.
fn expressions(rules: &Rules) -> Vec<(&Expr, Hand)> {
    fn choices<'a>(branch: &'a Branch, this: Hand, all: &mut Vec<(&'a Expr, Hand)>) {
        for choice in &branch.choices {
            all.extend(choice.condition.iter().map(|condition| (condition, this)));
            if let Consequent::Branch(below) = &choice.then {
                choices(below, this, all);
            }
        }
    }
    let whose = |per_hand: bool| if per_hand { Hand::This } else { Hand::Shared };
    let mut all: Vec<(&Expr, Hand)> = Vec::new();
    all.extend(rules.signals.iter().map(|signal| (&signal.expr, whose(signal.per_hand))));
    for latch in &rules.latches {
        all.extend([&latch.set, &latch.clear].map(|condition| (condition, whose(latch.per_hand))));
    }
    for tree in &rules.trees {
        choices(&tree.root, whose(tree.scope == TreeScope::EachHand), &mut all);
    }
    all
}

/// The part of a set condition that waits for a leaf: all of it when it is `from(…)` alone, else `(… from(…) …) for d` with its duration.
fn waits_for_from(set: &Expr) -> Option<(&Expr, Option<&Constant>)> {
    fn window(expr: &Expr) -> Option<(&Expr, Option<&Constant>)> {
        match &expr.kind {
            ExprKind::Temporal(TemporalOperator::For(duration), inner) if reads_from(inner) => {
                Some((expr, Some(duration)))
            }
            ExprKind::And(parts) | ExprKind::Or(parts) => parts.iter().find_map(window),
            _ => None,
        }
    }
    if matches!(set.kind, ExprKind::From { .. }) { Some((set, None)) } else { window(set) }
}

fn reads_from(expr: &Expr) -> bool {
    let mut reads = false;
    expr.walk(&mut |part| reads |= matches!(part.kind, ExprKind::From { .. }));
    reads
}
