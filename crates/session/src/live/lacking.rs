//! Finds the primitives that rules cannot detect in a live log because it lacks channels, before the first label.

use crate::log_contents::LogContents;
use crate::observability::{issues, tracks_of_contents};
use crate::run::channels;
use crate::{Log, LogInternals, Rules, RulesInternals};
use std::collections::BTreeSet;
use teachtree_language::graph::lower;
use teachtree_language::rules::{Label, Rules as RuleSet};
use teachtree_logs::issue::Issue;

/// Returns issues for the primitives that cannot be detected in this log; none if the beginning is too short for an analysis. Primitives of
/// failures are omitted, because most logs lack channels for some of them.
pub fn undetectable(beginning: &Log, rules: &Rules) -> Vec<Issue> {
    let Ok(opened) = beginning.opened() else { return Vec::new() };
    let Ok(frames) = opened.frames(&channels(rules.set())) else { return Vec::new() };
    let contents = LogContents::new(opened, beginning.binding().is_some());
    let mut tracks = tracks_of_contents(&lower(rules.set()), &frames, &contents);
    let failures = signs_of_failures(rules.set());
    for track in &mut tracks {
        for lack in &mut track.undetectable {
            lack.primitives.retain(|primitive| !failures.contains(primitive));
        }
        track.undetectable.retain(|lack| !lack.primitives.is_empty());
    }
    issues(&tracks, &frames)
}

/// Returns the primitives by which failures are recognized and that no other task names.
fn signs_of_failures(rules: &RuleSet) -> BTreeSet<String> {
    let keys = |failure: bool| {
        let tasks = rules.tasks.iter().filter(move |task| task.failure == failure);
        tasks.flat_map(|task| &task.keys).map(|key| &key.label)
    };
    let is_sign = |label: &Label| {
        keys(true).any(|pattern| pattern.covers(*label)) && !keys(false).any(|pattern| pattern.label.covers(*label))
    };
    rules.labels().filter(is_sign).map(|label| rules.label_name(label)).collect()
}
