//! Which labels can occur in the tracks of hands: those that leaves give, and what relabeling rules make of them. What tasks and rules ask
//! for beyond that never comes.

use super::leaves_with_sides;
use crate::codes;
use crate::rules::{
    Label, Labels, Pattern, PrimitiveId, RelabelKind, RelabelRule, Repetition, Rules, TaskId, TreeScope,
};
use std::collections::{BTreeMap, BTreeSet};
use teachtree_base::diagnostic::Diagnostic;

/// Maximum number of relabeling rules, and of primitives, for which these lints run.
const MAX_RULES: usize = 400;

/// The labels that can occur.
#[derive(Clone, Debug)]
pub struct OccurringLabels<'a> {
    rules: &'a Rules,
    /// Those that the tree over both hands gives.
    coordination: BTreeSet<Label>,
    /// In the track of a hand when tasks are recognized.
    pub hands: BTreeSet<Label>,
}

/// Why a rule never changes anything.
#[derive(Clone, Debug, PartialEq)]
enum Obstacle {
    /// None of these labels occurs.
    MissingLabels(Labels),
    /// The label is not one of a coordination.
    NotInBoth(Label),
    /// Neighbors would have to have the same label.
    SameNeighbors,
    /// Shorter runs do not settle; the settling time, s.
    BelowSettlingTime(f64),
    /// The rule replaces a label with itself.
    NoChange,
    /// The rule excludes the labels that it requires.
    SelfExclusion,
}

impl<'a> OccurringLabels<'a> {
    /// Finds them; `None` when no hand has a tree, or when it is too much work.
    pub fn new(rules: &'a Rules) -> Option<Self> {
        if rules.relabels.len().max(rules.primitives.len()) > MAX_RULES {
            return None;
        }
        let of = |scope| {
            let mut given = BTreeSet::new();
            rules.tree(scope).into_iter().for_each(|tree| leaves_with_sides(&tree.root, &mut given));
            given
        };
        rules.tree(TreeScope::EachHand)?;
        let coordination = of(TreeScope::BothHands);
        let leaves = of(TreeScope::EachHand).union(&coordination).copied().collect();
        let mut all = Self { rules, coordination, hands: BTreeSet::new() };
        all.hands = all.rewritten(leaves, None);
        Some(all)
    }

    /// The labels that can occur while the rules of a task, or of none, are applied.
    pub fn during(&self, task: Option<TaskId>) -> BTreeSet<Label> {
        if task.is_some() { self.rewritten(self.hands.clone(), task) } else { self.hands.clone() }
    }

    /// These labels, and what the rules of a task make of them.
    fn rewritten(&self, mut labels: BTreeSet<Label>, task: Option<TaskId>) -> BTreeSet<Label> {
        let mut rules: Vec<&RelabelRule> = self.rules.relabels.iter().filter(|rule| rule.task == task).collect();
        loop {
            let before = rules.len();
            rules.retain(|rule| {
                let acts = self.obstacle(rule, &labels).is_none();
                labels.extend(rule.kind.becomes().filter(|_| acts));
                !acts
            });
            if rules.len() == before {
                return labels;
            }
        }
    }

    /// Why a rule never changes anything in tracks of these labels; `None` when it may.
    fn obstacle(&self, rule: &RelabelRule, labels: &BTreeSet<Label>) -> Option<Obstacle> {
        match &rule.kind {
            RelabelKind::Between { what, run, between, becomes, .. } => {
                let shorter = rule.kind.shorter_time().map(|limit| limit.value);
                self.between((what, *run, shorter), between, Some(*becomes), labels)
            }
            RelabelKind::BetweenInHands { what, run, one, other, becomes, .. } => {
                let shorter = rule.kind.shorter_time().map(|limit| limit.value);
                let of = |between| self.between((what, *run, shorter), between, *becomes, labels);
                // A change of one hand's label suffices.
                match [of(one), of(other)] {
                    [Some(Obstacle::NoChange), other] | [other, Some(Obstacle::NoChange)] => other,
                    [one, other] => one.or(other),
                }
            }
            RelabelKind::Become { what, becomes } => match covered(what, labels).as_slice() {
                [] => Some(Obstacle::MissingLabels(what.clone())),
                found => found.iter().all(|label| label == becomes).then_some(Obstacle::NoChange),
            },
            RelabelKind::Sequence { elements, becomes } => sequence(elements, *becomes, labels),
            RelabelKind::Separate { what, without } => {
                // Where rules give both hands one label, that is the label of the coordination; what another rule gave back to them too.
                let rules = || self.rules.relabels.iter().filter(|rule| rule.task.is_none());
                let gives_back = |rule: &&RelabelRule| rule.kind.becomes().is_none();
                let own = labels.iter().copied().filter(|_| rules().filter(gives_back).count() > 1);
                let all = self
                    .coordination
                    .iter()
                    .copied()
                    .chain(rules().filter_map(|rule| rule.kind.becomes()))
                    .chain(own)
                    .collect();
                match covered(what, &all).as_slice() {
                    _ if self.coordination.is_empty() => what.first().map(|what| Obstacle::NotInBoth(*what)),
                    [] => what.first().map(|what| Obstacle::NotInBoth(*what)),
                    found => {
                        let excluded = |label: &Label| without.iter().any(|other| other.covers(*label));
                        found.iter().all(excluded).then_some(Obstacle::SelfExclusion)
                    }
                }
            }
        }
    }

    fn between(
        &self,
        (what, run, shorter): (&Labels, bool, Option<f64>),
        between: &(Labels, Labels),
        becomes: Option<Label>,
        labels: &BTreeSet<Label>,
    ) -> Option<Obstacle> {
        let all = [what, &between.0, &between.1];
        let [inner, before, after] = all.map(|patterns| covered(patterns, labels));
        for (patterns, found) in all.into_iter().zip([&inner, &before, &after]) {
            if found.is_empty() {
                return Some(Obstacle::MissingLabels(patterns.clone()));
            }
        }
        // Labels between others have settled; rules only extend them.
        let settle = self.rules.tree(TreeScope::EachHand).and_then(|tree| tree.settle.as_ref());
        if let (Some(settle), Some(shorter)) = (settle, shorter)
            && shorter <= settle.value
        {
            return Some(Obstacle::BelowSettlingTime(settle.value));
        }
        let fits = |inner: &Label, neighbors: &[Label]| neighbors.iter().any(|label| label != inner);
        let starts = inner.iter().filter(|label| fits(label, &before));
        let ends = |label: &Label| fits(label, &after);
        // A run of two labels may begin with one and end with the other.
        let found: Vec<Label> = if run && inner.len() > 1 {
            if starts.count() > 0 && inner.iter().any(ends) { inner } else { Vec::new() }
        } else {
            starts.filter(|label| ends(label)).copied().collect()
        };
        if found.is_empty() {
            return Some(Obstacle::SameNeighbors);
        }
        found.iter().all(|label| Some(*label) == becomes).then_some(Obstacle::NoChange)
    }
}

/// The labels for which patterns stand.
pub fn covered(patterns: &[Label], labels: &BTreeSet<Label>) -> Vec<Label> {
    labels.iter().filter(|label| patterns.iter().any(|pattern| pattern.covers(**label))).copied().collect()
}

/// Whether labels, neighbors different, can stand in a sequence so that one of them changes.
fn sequence(elements: &[(Labels, Repetition)], becomes: Label, labels: &BTreeSet<Label>) -> Option<Obstacle> {
    let found: Vec<Vec<Label>> = elements.iter().map(|(patterns, _)| covered(patterns, labels)).collect();
    for ((patterns, repeat), found) in elements.iter().zip(&found) {
        if found.is_empty() && *repeat != Repetition::ZeroOrMore {
            return Some(Obstacle::MissingLabels(patterns.clone()));
        }
    }
    // How far it is, whether this element has been there, what stands there last, and whether anything would change.
    let mut open: Vec<(usize, bool, Option<Label>, bool)> = vec![(0, false, None, false)];
    let mut seen: BTreeSet<(usize, bool, Option<Label>, bool)> = open.iter().copied().collect();
    let mut ends = false;
    while let Some((at, been, last, changes)) = open.pop() {
        let (Some((_, repeat)), Some(found)) = (elements.get(at), found.get(at)) else {
            if changes {
                return None;
            }
            ends |= last.is_some();
            continue;
        };
        let next = found.iter().filter(|label| last != Some(**label) && (!been || *repeat != Repetition::Once));
        let mut states: Vec<_> = next.map(|label| (at, true, Some(*label), changes || *label != becomes)).collect();
        if been || *repeat == Repetition::ZeroOrMore {
            states.push((at + 1, false, last, changes));
        }
        open.extend(states.into_iter().filter(|state| seen.insert(*state)));
    }
    Some(if ends { Obstacle::NoChange } else { Obstacle::SameNeighbors })
}

/// Warns of what tasks and rules in the `named` files ask for though it never comes, and returns the primitives that it reported.
pub fn missing_labels(rules: &Rules, named: &BTreeSet<u32>) -> (Vec<Diagnostic>, BTreeSet<PrimitiveId>) {
    let Some(occurring) = OccurringLabels::new(rules) else { return Default::default() };
    let mut reported = BTreeSet::new();
    let mut findings = Vec::new();
    let mut lacks = |pattern: &Pattern| {
        let lacks = !occurring.hands.iter().any(|label| pattern.covers(*label));
        lacks.then(|| {
            reported.insert(pattern.label.primitive);
            format!("`{}`", rules.label_name(pattern.label))
        })
    };
    for task in &rules.tasks {
        let ends = if task.first == task.last { vec![&task.first] } else { vec![&task.first, &task.last] };
        for end in ends.into_iter().filter(|_| named.contains(&task.span.file)) {
            if let Some(name) = lacks(end) {
                let word = if *end == task.first { "begins" } else { "ends" };
                let message = format!("the task `{}` {word} with {name}, which nothing gives", task.name);
                findings.push(
                    Diagnostic::warning(codes::MISSING_LABEL, message)
                        .at(task.span, "no leaf of a tree gives it and no rule rewrites to it"),
                );
            }
        }
        for key in task.keys.iter().filter(|key| named.contains(&key.span.file)) {
            if let Some(name) = lacks(&key.label) {
                let message = format!("the task `{}` requires {name}, which nothing gives", task.name);
                let others = !task.all_keys && task.keys.len() > 1;
                let text = "no leaf of a tree gives it and no rule rewrites to it";
                let finding = Diagnostic::warning(codes::MISSING_LABEL, message).at(key.span, text);
                findings.push(if others { finding } else { finding.note("so the task names nothing") });
            }
        }
    }
    let mut during: BTreeMap<Option<TaskId>, BTreeSet<Label>> = BTreeMap::new();
    for rule in rules.relabels.iter().filter(|rule| named.contains(&rule.span.file)) {
        let labels = during.entry(rule.task).or_insert_with(|| occurring.during(rule.task));
        let Some(obstacle) = occurring.obstacle(rule, labels) else { continue };
        if let Obstacle::MissingLabels(labels) = &obstacle {
            reported.extend(labels.iter().map(|label| label.primitive));
        }
        let text = obstacle.text(rules);
        findings.push(
            Diagnostic::warning(codes::IDLE_RELABEL, "this rule never changes anything")
                .at(rule.span, text)
                .help("correct its pattern, or remove it"),
        );
    }
    (findings, reported)
}

impl Obstacle {
    fn text(&self, rules: &Rules) -> String {
        match self {
            Self::MissingLabels(labels) => {
                let names: Vec<String> = labels.iter().map(|label| format!("`{}`", rules.label_name(*label))).collect();
                format!("nothing gives {}", names.join(" or "))
            }
            Self::NotInBoth(label) => format!("no tree over both hands gives `{}`", rules.label_name(*label)),
            Self::SameNeighbors => "neighbors never have the same label: they would be one segment".into(),
            Self::BelowSettlingTime(seconds) => {
                format!(
                    "a segment between two others has lasted at least as long as the settling, {} ms",
                    seconds * 1e3
                )
            }
            Self::NoChange => "its pattern finds the label that it gives".into(),
            Self::SelfExclusion => "its pattern excludes the coordination that it looks for".into(),
        }
    }
}
