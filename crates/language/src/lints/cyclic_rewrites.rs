//! Relabeling rules that undo each other: what one makes of a segment between its neighbors, the other makes into what it was.
//!
//! Rules are applied until nothing changes, so two such rules go on until the rounds are given up.

use super::labels::{OccurringLabels, covered};
use crate::codes;
use crate::rules::{Label, Labels, RelabelKind, RelabelRule, Rules, TaskId, TreeScope};
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::diagnostic::Diagnostic;

/// Maximum number of pairs of rules that are examined.
const MAX_PAIRS: usize = 100_000;

/// Two rules that undo each other.
#[derive(Clone, Debug)]
pub struct CyclicRewrite {
    /// The rules, as positions in [`Rules::relabels`].
    pub pair: [usize; 2],
    /// Segments of which they change one forth and back.
    pub segments: Labels,
    /// The bounds of its duration, s: at least the first, less than the second.
    pub lasting_s: (f64, f64),
    /// The warning.
    pub finding: Diagnostic,
}

/// A rule that changes single segments.
struct Rule<'a> {
    what: &'a Labels,
    /// The neighbors that it asks for.
    between: Option<&'a (Labels, Labels)>,
    shorter_s: f64,
    becomes: Label,
}

/// Warns of pairs of rules of which one stands in the `named` files.
pub fn cyclic_rewrites(rules: &Rules, named: &BTreeSet<u32>) -> Vec<CyclicRewrite> {
    let Some(occurring) = OccurringLabels::new(rules) else { return Vec::new() };
    let settle_s = rules.tree(TreeScope::EachHand).and_then(|tree| tree.settle.as_ref()).map_or(0.0, |one| one.value);
    let all: Vec<(usize, &RelabelRule, Rule)> =
        rules.relabels.iter().enumerate().filter_map(|(at, rule)| Some((at, rule, single(rule)?))).collect();
    let pairs = all.iter().enumerate().flat_map(|(at, one)| all.iter().skip(at + 1).map(move |other| (one, other)));
    let mut during: BTreeMap<Option<TaskId>, BTreeSet<Label>> = BTreeMap::new();
    let mut found = Vec::new();
    for ((one_at, one, first), (other_at, other, second)) in pairs.take(MAX_PAIRS) {
        let concerns = named.contains(&one.span.file) || named.contains(&other.span.file);
        // The second rule restores the label that the first one replaced.
        let (was, made) = (second.becomes, first.becomes);
        let covers = |patterns: &Labels, label: Label| patterns.iter().any(|pattern| pattern.covers(label));
        if one.task != other.task || !concerns || was == made {
            continue;
        }
        if !covers(first.what, was) || !covers(second.what, made) {
            continue;
        }
        let limit_s = first.shorter_s.min(second.shorter_s);
        let labels = during.entry(one.task).or_insert_with(|| occurring.during(one.task));
        let occurs = labels.contains(&was) || labels.contains(&made);
        if !occurs || limit_s <= settle_s {
            continue;
        }
        let Some(segments) = around(was, made, [first, second], labels) else { continue };
        let row = |middle: Label| {
            let names = segments.iter().map(|label| if *label == was { middle } else { *label });
            names.map(|label| format!("`{}`", rules.label_name(label))).collect::<Vec<_>>().join(", ")
        };
        let [was_name, made_name] = [was, made].map(|label| rules.label_name(label));
        let finding = Diagnostic::warning(codes::UNDOING_RULES, "two rules undo each other")
            .at(other.span, format!("this makes `{was_name}` of `{made_name}` …"))
            .at(one.span, format!("… and this makes `{made_name}` of `{was_name}` again"))
            .note(format!("for instance {} becomes {}, and back, until relabeling is stopped", row(was), row(made)))
            .help("give one of them other neighbors, or remove it");
        let lasting_s = (settle_s, limit_s);
        found.push(CyclicRewrite { pair: [*one_at, *other_at], segments, lasting_s, finding });
    }
    found
}

fn single(rule: &RelabelRule) -> Option<Rule<'_>> {
    match &rule.kind {
        RelabelKind::Between { what, between, becomes, .. } => {
            let shorter_s = rule.kind.shorter_time().map_or(f64::INFINITY, |limit| limit.value);
            Some(Rule { what, between: Some(between), shorter_s, becomes: *becomes })
        }
        RelabelKind::Become { what, becomes } => {
            Some(Rule { what, between: None, shorter_s: f64::INFINITY, becomes: *becomes })
        }
        RelabelKind::BetweenInHands { .. } | RelabelKind::Sequence { .. } | RelabelKind::Separate { .. } => None,
    }
}

/// A segment with neighbors that both rules ask for and neither changes; alone when they ask for none.
fn around(was: Label, made: Label, rules: [&Rule; 2], labels: &BTreeSet<Label>) -> Option<Labels> {
    let asked: Vec<_> = rules.iter().filter_map(|rule| rule.between).collect();
    if asked.is_empty() {
        return Some(vec![was]);
    }
    let changed = |label: &Label| {
        let anywhere = rules.iter().filter(|rule| rule.between.is_none());
        anywhere.into_iter().any(|rule| rule.what.iter().any(|pattern| pattern.covers(*label)))
    };
    let neighbor = |side: fn(&(Labels, Labels)) -> &Labels| {
        let fits = |label: &Label| {
            *label != was && *label != made && !changed(label) && {
                let only = BTreeSet::from([*label]);
                asked.iter().all(|between| !covered(side(between), &only).is_empty())
            }
        };
        labels.iter().copied().find(|label| fits(label))
    };
    Some(vec![neighbor(|between| &between.0)?, was, neighbor(|between| &between.1)?])
}
