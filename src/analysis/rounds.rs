//! Rounds of relabelling: before recognition on whole lanes, after it within the spans of the named tasks.
//! In each round the rules are applied in order, until a round changes nothing.

use super::lane::Piece;
use super::relabel::{in_hands, in_lane};
use super::stretch::Stretch;
use super::tasks::Named;
use crate::base::hands::Side;
use crate::language::rules::{Relabel, RelabelKind, Rules, TaskId};
use std::collections::BTreeMap;

/// How many rounds there are at most: when they do not suffice, two rules undo each other.
///
/// A round rewrites every match of every rule, so rules that end need a few rounds only.
pub const MAX_ROUNDS: usize = 100;

/// Repeats rounds until one changes nothing. A round says which rules changed something; those of the last one are
/// returned, so that nothing is returned when the end was reached.
fn to_fixpoint(mut round: impl FnMut() -> Vec<usize>) -> Vec<usize> {
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
pub(super) fn before_recognition(rules: &Rules, stretch: &mut Stretch, rate_hz: f64) -> Vec<usize> {
    to_fixpoint(|| {
        let mut changing = Vec::new();
        for (at, rule) in of_task(rules, None) {
            if let RelabelKind::Separate { what, without } = &rule.kind {
                if stretch.separate(at, *what, without) {
                    // The lanes are fresh: the rules before this one come first again.
                    return vec![at];
                }
                continue;
            }
            let mut changed = apply_in_lanes(stretch.hands.values_mut(), at, rule, rate_hz);
            let mut hands = stretch.hands.values_mut();
            if let (Some(left), Some(right)) = (hands.next(), hands.next()) {
                changed |= apply_in_hands([left, right], at, rule, rate_hz);
            }
            changing.extend(changed.then_some(at));
        }
        changing
    })
}

/// Applies the rules of the named tasks, each within the spans of its task. A rule over both hands looks at tasks of the
/// same name that share time. Returns the rules that could not be finished.
pub(super) fn of_tasks(rules: &Rules, named: &mut BTreeMap<Side, Vec<Named>>, rate_hz: f64) -> Vec<usize> {
    to_fixpoint(|| {
        let mut changing = Vec::new();
        for (at, rule) in rules.relabels.iter().enumerate().filter(|(_, rule)| rule.task.is_some()) {
            let changed = if matches!(rule.kind, RelabelKind::BetweenInHands { .. }) {
                let mut hands =
                    named.values_mut().map(|spans| spans.iter_mut().filter(|named| named.task == rule.task));
                let (left, right) = (hands.next().into_iter().flatten(), hands.next().into_iter().flatten());
                apply_in_tasks(left.collect(), right.collect(), at, rule, rate_hz)
            } else {
                let spans = named.values_mut().flatten().filter(|named| named.task == rule.task);
                apply_in_lanes(spans.map(|named| &mut named.pieces), at, rule, rate_hz)
            };
            changing.extend(changed.then_some(at));
        }
        changing
    })
}

fn of_task(rules: &Rules, task: Option<TaskId>) -> impl Iterator<Item = (usize, &Relabel)> {
    rules.relabels.iter().enumerate().filter(move |(_, rule)| rule.task == task)
}

fn apply_in_lanes<'a>(
    lanes: impl Iterator<Item = &'a mut Vec<Piece>>,
    at: usize,
    rule: &Relabel,
    rate_hz: f64,
) -> bool {
    let mut changed = false;
    for lane in lanes {
        if let Some(rewritten) = in_lane(lane, at, rule, rate_hz) {
            *lane = rewritten;
            changed = true;
        }
    }
    changed
}

/// Applies a rule over both hands to all pairs of their tasks.
fn apply_in_tasks(
    mut left: Vec<&mut Named>,
    mut right: Vec<&mut Named>,
    at: usize,
    rule: &Relabel,
    rate_hz: f64,
) -> bool {
    let mut changed = false;
    for one in &mut left {
        for other in &mut right {
            changed |= apply_in_hands([&mut one.pieces, &mut other.pieces], at, rule, rate_hz);
        }
    }
    changed
}

fn apply_in_hands([left, right]: [&mut Vec<Piece>; 2], at: usize, rule: &Relabel, rate_hz: f64) -> bool {
    let Some([new_left, new_right]) = in_hands([left, right], at, rule, rate_hz) else {
        return false;
    };
    *left = new_left;
    *right = new_right;
    true
}
