//! Compares the relabeling rules of two rule sets: whether both make the same changes in the same order.
//!
//! Rules are applied in rounds, one after the other, so an additional rule or another order may change the matches of later rules. A rule of
//! the extension counts as inactive only if it never matches: it requires a new primitive, or an earlier rule has rewritten all of its
//! matches and no rule in between creates a new match.

use super::Finding;
use super::labels::{CommonLabels, Names};
use crate::rules::{Constant, RelabelKind, RelabelRule, Repetition, Rules, TreeScope};
use std::collections::BTreeMap;
use teachtree_base::units::Dimension;

/// The effect of a rule as long as no new primitive occurs.
#[derive(Clone, Debug, PartialEq, Eq)]
enum RewriteEffect {
    Between { what: RewriteTarget, between: (Names, Names), becomes: String },
    InHands { what: RewriteTarget, one: (Names, Names), other: (Names, Names), becomes: Option<String> },
    Become { what: Names, becomes: String },
    Sequence { elements: Vec<(Names, Repetition)>, becomes: String },
    Separate { what: Names, without: Names },
}

/// The segments that are rewritten between two neighbors.
#[derive(Clone, Debug, PartialEq, Eq)]
struct RewriteTarget {
    labels: Names,
    run: bool,
    shorter: Option<(Dimension, u64)>,
}

/// A rule that may have an effect.
#[derive(PartialEq)]
struct ActiveRule<'r> {
    text: &'r str,
    effect: RewriteEffect,
    place: String,
}

/// The rules for all tasks, and the rules per task, that may have an effect without a new primitive.
struct Scopes<'r> {
    general: Vec<ActiveRule<'r>>,
    of_task: BTreeMap<&'r str, Vec<ActiveRule<'r>>>,
}

impl<'r> Scopes<'r> {
    /// `coordinated`: whether a tree labels both hands without a new primitive.
    fn new(shared: &CommonLabels<'r>, coordinated: bool) -> Self {
        let mut scopes = Self { general: Vec::new(), of_task: BTreeMap::new() };
        for rule in &shared.rules.relabels {
            let Some(effect) = effect(&rule.kind, shared, coordinated) else { continue };
            let acting = ActiveRule { text: &rule.text, effect, place: shared.rules.sources.place(rule.span) };
            match task_of(rule, shared.rules) {
                None => scopes.general.push(acting),
                Some(task) => scopes.of_task.entry(task).or_default().push(acting),
            }
        }
        scopes
    }
}

/// Returns the rules of the extension that may have an effect without a new primitive, and the rules of the base that the extension changes.
pub fn acts(base: &Rules, extended: &CommonLabels) -> Vec<Finding> {
    // A tree that only the extension has is checked separately: without a new primitive it has no effect, or it is a finding.
    let coordinated = base.tree(TreeScope::BothHands).is_some();
    let (mut ours, mut theirs) =
        (Scopes::new(&CommonLabels::all(base), coordinated), Scopes::new(extended, coordinated));
    let mut findings = Vec::new();
    let general = CommonRules::new(&ours.general, &theirs.general, None, &mut findings);
    for task in &base.tasks {
        let (ours, theirs) = (ours.of_task.remove(task.name.as_str()), theirs.of_task.remove(task.name.as_str()));
        CommonRules::new(&ours.unwrap_or_default(), &theirs.unwrap_or_default(), Some(&general), &mut findings);
    }
    // The remaining rules belong to tasks that the base lacks: these need a new primitive, or are findings.
    findings
}

/// The rules of the extension that equal those of the base, in order.
struct CommonRules<'a>(Vec<&'a RewriteEffect>);

impl<'a> CommonRules<'a> {
    /// Reports each additional rule that may have an effect, and each difference from the rules of the base. In the spans of a task, the rules for all
    /// tasks are applied first, until nothing changes.
    fn new(
        ours: &[ActiveRule],
        theirs: &'a [ActiveRule],
        before: Option<&CommonRules>,
        findings: &mut Vec<Finding>,
    ) -> Self {
        let mut open = ours.iter();
        let mut next = open.next();
        // The kept rules, and for each other rule the number of kept rules before it.
        let (mut kept, mut others): (Vec<&RewriteEffect>, Vec<(usize, &ActiveRule)>) = (Vec::new(), Vec::new());
        for rule in theirs {
            match next {
                Some(known) if (known.text, &known.effect) == (rule.text, &rule.effect) => {
                    kept.push(&rule.effect);
                    next = open.next();
                }
                _ => others.push((kept.len(), rule)),
            }
        }
        if let Some(known) = next {
            let what = format!("the rule `{}` is gone, does something else or comes elsewhere", known.text);
            findings.push(Finding { what, place: known.place.clone() });
            return Self(kept);
        }
        for (at, rule) in others {
            let RewriteEffect::Between { what, between, .. } = &rule.effect else {
                findings.push(may_act(rule));
                continue;
            };
            let taken = |rules: &[&RewriteEffect], then: &[&RewriteEffect]| {
                (0..rules.len()).any(|at| {
                    let (earlier, later) = (rules.get(at), rules.get(at + 1..).unwrap_or_default());
                    let earlier = earlier.and_then(|effect| Pattern::all_taken(effect, what, between));
                    earlier
                        .is_some_and(|pattern| !later.iter().chain(then).any(|effect| pattern.may_be_made_by(effect)))
                })
            };
            let in_round = taken(kept.get(..at).unwrap_or_default(), &[]);
            // A rule that separates the hands restores their original tracks, without the changes of earlier rules.
            let before = before.filter(|before| !before.0.iter().any(|effect| effect.separates()));
            if !in_round && !before.is_some_and(|before| taken(&before.0, &kept)) {
                findings.push(may_act(rule));
            }
        }
        Self(kept)
    }
}

fn may_act(rule: &ActiveRule) -> Finding {
    Finding { what: format!("the rule `{}` may act without a new primitive", rule.text), place: rule.place.clone() }
}

/// The segments that a rule removes, and their required neighbors.
struct Pattern<'a> {
    what: &'a Names,
    before: &'a Names,
    after: &'a Names,
}

impl<'a> Pattern<'a> {
    /// Returns the pattern whose segments a rule rewrites completely, if it covers all matches of another rule. A rule with a bound leaves longer segments,
    /// and these become shorter when other rules change a part of them.
    fn all_taken(effect: &'a RewriteEffect, wanted: &RewriteTarget, (before, after): &(Names, Names)) -> Option<Self> {
        let RewriteEffect::Between { what, between, becomes } = effect else { return None };
        let covers = wanted.labels.is_subset(&what.labels)
            && before.is_subset(&between.0)
            && after.is_subset(&between.1)
            && (what.run || !wanted.run);
        // The result of the rule must not match again. In a run, all neighbors are rewritten together; a single segment can become the neighbor of
        // another one.
        let becomes_neighbor = !what.run && (between.0.contains(becomes) || between.1.contains(becomes));
        let leaves_none = what.shorter.is_none() && !what.labels.contains(becomes) && !becomes_neighbor;
        (covers && leaves_none).then_some(Self { what: &what.labels, before: &between.0, after: &between.1 })
    }

    /// Whether a rule may create a match: by rewriting a segment to a label of the pattern, or by rewriting its neighbor to a required one.
    fn may_be_made_by(&self, effect: &RewriteEffect) -> bool {
        // The neighbors of the rewritten segments; `None` for any.
        let anything = (None, None);
        let (rewritten, becomes, (before, after)) = match effect {
            RewriteEffect::Between { what, between, becomes } => {
                (what.labels.clone(), becomes, (Some(between.0.clone()), Some(between.1.clone())))
            }
            RewriteEffect::InHands { what, one, other, becomes: Some(becomes) } => {
                let either = |one: &Names, other: &Names| Some(one.union(other).cloned().collect());
                (what.labels.clone(), becomes, (either(&one.0, &other.0), either(&one.1, &other.1)))
            }
            RewriteEffect::Become { what, becomes } => (what.clone(), becomes, anything),
            RewriteEffect::Sequence { elements, becomes } => (all_of(elements), becomes, anything),
            // A change by one of these rules ends the round.
            RewriteEffect::InHands { becomes: None, .. } | RewriteEffect::Separate { .. } => return false,
        };
        let meets = |neighbors: Option<Names>| neighbors.is_none_or(|neighbors| !neighbors.is_disjoint(self.what));
        let as_neighbor =
            |side: &Names, next: Option<Names>| side.contains(becomes) && meets(next) && !rewritten.is_subset(side);
        self.what.contains(becomes) || as_neighbor(self.before, after) || as_neighbor(self.after, before)
    }
}

impl RewriteEffect {
    /// Whether the rule separates the hands.
    const fn separates(&self) -> bool {
        matches!(self, Self::InHands { becomes: None, .. } | Self::Separate { .. })
    }
}

fn all_of(elements: &[(Names, Repetition)]) -> Names {
    elements.iter().flat_map(|(names, _)| names.iter().cloned()).collect()
}

fn task_of<'r>(rule: &RelabelRule, rules: &'r Rules) -> Option<&'r str> {
    rule.task.and_then(|task| rules.tasks.get(task.index())).map(|task| task.name.as_str())
}

/// Returns the effect of a rule without new primitives; `None` if it has none.
fn effect(kind: &RelabelKind, shared: &CommonLabels, coordinated: bool) -> Option<RewriteEffect> {
    let names = |labels: &[crate::rules::Label]| shared.names(labels.iter().copied());
    let some = |labels: &[crate::rules::Label]| Some(names(labels)).filter(|names| !names.is_empty());
    let label = |label| shared.rules.label_name(label);
    let bound = |limit: &Option<Constant>| limit.as_ref().map(|limit| (limit.dimension, limit.value.to_bits()));
    let changes = |what: &Names, becomes: &str| what.iter().any(|name| name != becomes);
    Some(match kind {
        RelabelKind::Between { what, run, shorter, between, becomes } => {
            let what = RewriteTarget { labels: some(what)?, run: *run, shorter: bound(shorter) };
            let becomes = Some(label(*becomes)).filter(|becomes| changes(&what.labels, becomes))?;
            RewriteEffect::Between { what, between: (some(&between.0)?, some(&between.1)?), becomes }
        }
        RelabelKind::BetweenInHands { what, run, shorter, one, other, becomes } => {
            let what = RewriteTarget { labels: some(what)?, run: *run, shorter: bound(shorter) };
            let becomes = becomes.map(label);
            match &becomes {
                Some(becomes) if !changes(&what.labels, becomes) => return None,
                None if !coordinated => return None,
                _ => {}
            }
            let (one, other) = ((some(&one.0)?, some(&one.1)?), (some(&other.0)?, some(&other.1)?));
            RewriteEffect::InHands { what, one, other, becomes }
        }
        RelabelKind::Become { what, becomes } => {
            let (what, becomes) = (some(what)?, label(*becomes));
            changes(&what, &becomes).then_some(RewriteEffect::Become { what, becomes })?
        }
        RelabelKind::Sequence { elements, becomes } => {
            let mut old = Vec::new();
            for (labels, repeat) in elements {
                match some(labels) {
                    Some(names) => old.push((names, *repeat)),
                    // The element is optional and can be left out.
                    None if *repeat == Repetition::ZeroOrMore => {}
                    None => return None,
                }
            }
            let becomes = label(*becomes);
            changes(&all_of(&old), &becomes).then_some(RewriteEffect::Sequence { elements: old, becomes })?
        }
        RelabelKind::Separate { what, without } => {
            let what = some(what).filter(|_| coordinated)?;
            RewriteEffect::Separate { what, without: names(without) }
        }
    })
}

/// The text of a rule, its task and its effect.
type RuleEntry<'r> = (&'r str, Option<&'r str>, Option<RewriteEffect>);

fn all(rules: &Rules) -> Vec<RuleEntry<'_>> {
    let shared = CommonLabels::all(rules);
    let written = |rule: &RelabelRule| effect(&rule.kind, &shared, true);
    rules.relabels.iter().map(|rule| (rule.text.as_str(), task_of(rule, rules), written(rule))).collect()
}

/// Lists the differences between the rules.
pub fn differences(one: &Rules, other: &Rules) -> Vec<String> {
    let (ours, theirs) = (all(one), all(other));
    let mut left: Vec<&_> = theirs.iter().collect();
    let (mut lines, mut kept) = (Vec::new(), Vec::new());
    for rule in &ours {
        let same = |other: &RuleEntry| (other.0, other.1) == (rule.0, rule.1);
        match left.iter().position(|other| *other == rule).or_else(|| left.iter().position(|other| same(other))) {
            None => lines.push(format!("the rule `{}` is gone", rule.0)),
            Some(at) => {
                let other = left.remove(at);
                if other.2 != rule.2 {
                    lines.push(format!("the rule `{}` does something else", rule.0));
                }
                kept.push((rule.0, theirs.iter().position(|it| std::ptr::eq(it, other))));
            }
        }
    }
    let moved = kept.windows(2).filter_map(|two| match two {
        [(_, before), (text, at)] if at < before => Some(format!("the rule `{text}` comes earlier")),
        _ => None,
    });
    lines.extend(moved);
    lines.extend(left.iter().map(|(text, ..)| format!("the rule `{text}` is new")));
    lines
}
