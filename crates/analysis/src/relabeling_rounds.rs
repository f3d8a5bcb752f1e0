//! Rounds of relabeling: before recognition on whole lanes, after it within the spans of the named tasks.
//! In each round the rules are applied in order, until a round changes nothing.

use super::interval_labels::IntervalLabels;
use super::labeled_span::LabeledSpan;
use super::measures::Measures;
use super::relabel::{in_hands, in_lane, separated_in_hands};
use super::tasks::NamedSpan;
use std::collections::BTreeMap;
use teachtree_base::hands::Side;
use teachtree_language::rules::{RelabelKind, RelabelRule, Rules, TaskId};

/// Maximum number of rounds. If they do not suffice, two rules undo each other.
///
/// A round rewrites every match of every rule, so rules that end need a few rounds only.
pub const MAX_ROUNDS: usize = 100;

/// Repeats rounds until one changes nothing. A round says which rules changed something; those of the last one are
/// returned, so that nothing is returned when the end was reached.
fn repeat_to_fixpoint(mut round: impl FnMut() -> Vec<usize>) -> Vec<usize> {
    let mut changing = Vec::new();
    for _ in 0..MAX_ROUNDS {
        changing = round();
        if changing.is_empty() {
            break;
        }
    }
    changing
}

/// Applies the rules that are for no task. Returns the rules that could not be finished.
pub(super) fn relabel_stretch(
    rules: &Rules,
    stretch: &mut IntervalLabels,
    measures: &BTreeMap<Side, Measures>,
) -> Vec<usize> {
    repeat_to_fixpoint(|| {
        let mut changing = Vec::new();
        for (at, rule) in of_task(rules, None) {
            if let RelabelKind::Separate { what, without } = &rule.kind {
                if stretch.separate(at, what, without) {
                    // The lanes are fresh: the rules before this one come first again.
                    return vec![at];
                }
                continue;
            }
            let mut changed = false;
            for (side, lane) in &mut stretch.hands {
                changed |= measures.get(side).is_some_and(|measures| apply_in_lane(lane, at, rule, measures));
            }
            if let Some(of_hands) = both(measures) {
                let mut hands = stretch.hands.values_mut();
                if let (Some(left), Some(right)) = (hands.next(), hands.next()) {
                    let frames = separated_in_hands([left, right], rule, of_hands);
                    changed |= apply_in_hands([left, right], at, rule, of_hands);
                    if stretch.give_back(at, &frames) {
                        return vec![at];
                    }
                }
            }
            changing.extend(changed.then_some(at));
        }
        changing
    })
}

/// Applies the rules of the named tasks, each within the spans of its task. A rule over both hands looks at tasks of the
/// same name that share time. Returns the rules that could not be finished.
pub(super) fn relabel_tasks(
    rules: &Rules,
    named: &mut BTreeMap<Side, Vec<NamedSpan>>,
    measures: &BTreeMap<Side, Measures>,
) -> Vec<usize> {
    repeat_to_fixpoint(|| {
        let mut changing = Vec::new();
        for (at, rule) in rules.relabels.iter().enumerate().filter(|(_, rule)| rule.task.is_some()) {
            let changed = if let (RelabelKind::BetweenInHands { .. }, Some(of_hands)) = (&rule.kind, both(measures)) {
                let mut hands =
                    named.values_mut().map(|spans| spans.iter_mut().filter(|named| named.task == rule.task));
                let (left, right) = (hands.next().into_iter().flatten(), hands.next().into_iter().flatten());
                apply_in_tasks(left.collect(), right.collect(), at, rule, of_hands)
            } else {
                let mut changed = false;
                for (side, spans) in named.iter_mut() {
                    let Some(measures) = measures.get(side) else { continue };
                    for span in spans.iter_mut().filter(|named| named.task == rule.task) {
                        changed |= apply_in_lane(&mut span.pieces, at, rule, measures);
                    }
                }
                changed
            };
            changing.extend(changed.then_some(at));
        }
        changing
    })
}

fn of_task(rules: &Rules, task: Option<TaskId>) -> impl Iterator<Item = (usize, &RelabelRule)> {
    rules.relabels.iter().enumerate().filter(move |(_, rule)| rule.task == task)
}

/// The labels of both hands, left first.
fn both<'a, 'm>(measures: &'m BTreeMap<Side, Measures<'a>>) -> Option<[&'m Measures<'a>; 2]> {
    Some([measures.get(&Side::Left)?, measures.get(&Side::Right)?])
}

fn apply_in_lane(lane: &mut Vec<LabeledSpan>, at: usize, rule: &RelabelRule, measures: &Measures) -> bool {
    let rewritten = in_lane(lane, at, rule, measures);
    let changed = rewritten.is_some();
    if let Some(rewritten) = rewritten {
        *lane = rewritten;
    }
    changed
}

/// Applies a rule over both hands to all pairs of their tasks.
fn apply_in_tasks(
    mut left: Vec<&mut NamedSpan>,
    mut right: Vec<&mut NamedSpan>,
    at: usize,
    rule: &RelabelRule,
    measures: [&Measures; 2],
) -> bool {
    let mut changed = false;
    for one in &mut left {
        for other in &mut right {
            changed |= apply_in_hands([&mut one.pieces, &mut other.pieces], at, rule, measures);
        }
    }
    changed
}

fn apply_in_hands(
    [left, right]: [&mut Vec<LabeledSpan>; 2],
    at: usize,
    rule: &RelabelRule,
    measures: [&Measures; 2],
) -> bool {
    let Some([new_left, new_right]) = in_hands([left, right], at, rule, measures) else {
        return false;
    };
    *left = new_left;
    *right = new_right;
    true
}
