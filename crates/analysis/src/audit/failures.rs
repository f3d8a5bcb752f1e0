//! Failures of recordings, and expected tasks that they lack, by their outcomes.

use super::{Facts, Finding, FindingKind};
use crate::outcome::{Outcome, OutcomeReason, ReasonKind};
use std::collections::BTreeMap;

/// The tasks that failed, those that let an object fall, intended or not, and the expected tasks that are missing.
pub(super) fn findings(outcome: &Outcome) -> Vec<Finding> {
    let finding = |reason: &OutcomeReason| {
        let kind = match reason.kind {
            ReasonKind::Failed | ReasonKind::LetFall => FindingKind::Failure,
            ReasonKind::Missing => FindingKind::LacksTask,
            _ => return None,
        };
        let what = match reason.kind {
            ReasonKind::LetFall => "it fell from opened jaws",
            _ => "no later attempt succeeded",
        };
        let message = match (kind, reason.track, &reason.task) {
            (FindingKind::Failure, Some(track), Some(task)) => {
                format!("{track} {task}{}: {what}", reason.subject.suffix())
            }
            _ => reason.message.clone(),
        };
        Some(Finding { track: reason.track, span_s: reason.span_s, ..Finding::new(kind, message) })
    };
    outcome.reasons.iter().filter_map(finding).collect()
}

/// The names of the tasks that failed.
pub(super) fn tasks(outcome: &Outcome) -> Vec<String> {
    let is_failed = |reason: &&OutcomeReason| matches!(reason.kind, ReasonKind::Failed | ReasonKind::LetFall);
    let failed = outcome.reasons.iter().filter(is_failed);
    failed.filter_map(|reason| reason.task.clone()).collect()
}

/// Returns the number of recordings with each failed task.
pub fn counts(recordings: &[Facts]) -> BTreeMap<String, usize> {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for facts in recordings {
        let mut failures: Vec<&String> = facts.failures.iter().collect();
        failures.sort_unstable();
        failures.dedup();
        failures.into_iter().for_each(|task| *counts.entry(task.clone()).or_default() += 1);
    }
    counts
}
