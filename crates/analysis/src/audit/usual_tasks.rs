//! Finds the tasks that most recordings of a set have, and the recordings that lack one of them. Tasks are compared by name, since recordings may
//! handle different objects.

use super::{FEWEST_HALVES, Facts, Finding, FindingKind, ORDERED, Step, finding};
use crate::UNKNOWN;
use std::collections::BTreeMap;

/// A task that most recordings of a set have.
struct UsualTask {
    /// The usual minimum number of occurrences per recording.
    times: usize,
    /// The number of recordings with at least `times` occurrences.
    recordings: usize,
}

/// Returns the number of recordings that have each task.
pub fn counts(recordings: &[Facts]) -> BTreeMap<String, usize> {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for task in recordings.iter().flat_map(|facts| times(facts.tasks.iter()).into_keys()) {
        *counts.entry(task.into()).or_default() += 1;
    }
    counts
}

/// Returns the number of occurrences of each task.
fn times<'a>(steps: impl Iterator<Item = &'a Step>) -> BTreeMap<&'a str, usize> {
    let mut times: BTreeMap<&str, usize> = BTreeMap::new();
    for step in steps {
        *times.entry(&step.what).or_default() += 1;
    }
    times
}

/// Returns the recordings that lack a usual task or have fewer occurrences of it than most. Recordings with an expectation are left out.
pub(super) fn lacking(recordings: &[&Facts]) -> Vec<(usize, Finding)> {
    let usual = usual(recordings);
    let all = recordings.len();
    let finding_of = |(at, facts): (usize, &&Facts)| {
        if facts.has_expectation {
            return None;
        }
        let has = times(facts.compared_tasks());
        let times = |task: &str| has.get(task).copied().unwrap_or_default();
        let lacks: Vec<(&str, &UsualTask)> = usual
            .iter()
            .filter(|(task, usual)| times(task) < usual.times)
            .map(|(task, usual)| (*task, usual))
            .collect();
        if lacks.is_empty() {
            return None;
        }
        let words = |(task, usual): &(&str, &UsualTask)| {
            let most = format!("which {} of {all} recordings have", usual.recordings);
            match usual.times {
                1 => format!("lacks {task}, {most}"),
                wanted => format!("has {task} {}, {most} {}", often(times(task)), often(wanted)),
            }
        };
        let others: Vec<&str> = has.keys().copied().filter(|task| !usual.contains_key(task)).collect();
        let instead = if others.is_empty() { String::new() } else { format!("; has {} instead", others.join(", ")) };
        let message = format!("{}{instead}", lacks.iter().map(words).collect::<Vec<_>>().join("; "));
        Some(finding(at, FindingKind::LacksTask, message))
    };
    recordings.iter().enumerate().filter_map(finding_of).collect()
}

fn often(times: usize) -> String {
    match times {
        0 => "never".into(),
        1 => "once".into(),
        2 => "twice".into(),
        times => format!("{times} times"),
    }
}

/// Returns the tasks that more than half of the recordings have. The count of a task is the one that nearly all recordings share, or 1 if there is
/// none.
fn usual<'a>(recordings: &[&'a Facts]) -> BTreeMap<&'a str, UsualTask> {
    let all = recordings.len();
    if all < FEWEST_HALVES {
        return BTreeMap::new();
    }
    let mut by_task: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (task, times) in recordings.iter().flat_map(|facts| times(facts.compared_tasks())) {
        by_task.entry(task).or_default().push(times);
    }
    let usual = |times: Vec<usize>| {
        let having = |wanted: usize| times.iter().filter(|times| **times >= wanted).count();
        let exactly = |wanted: usize| times.iter().filter(|times| **times == wanted).count();
        let repeated = times.iter().copied().filter(|it| *it > 1 && exactly(*it) as f64 >= ORDERED * all as f64).max();
        let least = repeated.unwrap_or(1);
        (having(1) * 2 > all).then(|| UsualTask { times: least, recordings: having(least) })
    };
    let named = by_task.into_iter().filter(|(task, _)| *task != UNKNOWN);
    named.filter_map(|(task, times)| Some((task, usual(times)?))).collect()
}
