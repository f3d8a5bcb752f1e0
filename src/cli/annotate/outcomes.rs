//! Success fields: the outcomes of recordings, where they are known, for the fields by which training programs see them.

use std::collections::BTreeMap;
use std::fmt::Display;
use teachtree_analysis::outcome::OutcomeKind;
use teachtree_session::{Analysis, AnalysisInternals};

/// The most recordings that a line names.
const NAMED: usize = 10;

/// For each row of a recording, whether the task has succeeded in the state that the action of the row leads to, which is that of the next row. `None` where
/// the outcome is unknown.
pub(super) fn success_rows(analysis: &Analysis) -> Option<Vec<bool>> {
    let found = analysis.found();
    match analysis.outcome().result {
        OutcomeKind::Success => {
            let end = found.success_end()?.min(found.rows);
            Some((1..=found.rows).map(|next| next >= end).collect())
        }
        OutcomeKind::Failure => Some(vec![false; found.rows]),
        OutcomeKind::Unknown => None,
    }
}

/// `2 successes, 1 failure`.
pub(super) fn counts<K>(successes: &BTreeMap<K, Vec<bool>>) -> String {
    let succeeded = successes.values().filter(|rows| rows.contains(&true)).count();
    let failed = successes.len() - succeeded;
    let (one, other) = (if succeeded == 1 { "" } else { "es" }, if failed == 1 { "" } else { "s" });
    format!("{succeeded} success{one}, {failed} failure{other}")
}

/// The line about recordings whose field in the set contradicts their outcome, and the treatment of the field; empty without such recordings.
pub(super) fn contradictions<K: Display + Ord>(
    field: &str,
    names: &[K],
    successes: &BTreeMap<K, Vec<bool>>,
    what: &str,
) -> String {
    if names.is_empty() {
        return String::new();
    }
    let outcome = |name: &K| {
        let is_success = successes.get(name).is_some_and(|rows| rows.contains(&true));
        format!("{name} ({})", if is_success { OutcomeKind::Success } else { OutcomeKind::Failure })
    };
    format!("`{field}` contradicts the outcome of {}; {what}\n", named(names, outcome))
}

/// `3 recordings: 0, 4, 7`.
pub(super) fn named<K>(names: &[K], name: impl Fn(&K) -> String) -> String {
    let recordings = if names.len() == 1 { "recording" } else { "recordings" };
    let mut shown: Vec<String> = names.iter().take(NAMED).map(name).collect();
    shown.extend(names.len().checked_sub(NAMED).filter(|more| *more > 0).map(|more| format!("{more} more")));
    format!("{} {recordings}: {}", names.len(), shown.join(", "))
}
