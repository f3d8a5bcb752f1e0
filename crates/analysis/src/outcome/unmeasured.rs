//! Tasks that a recording cannot show, because the rules cannot detect their keys in it.

use crate::TrackId;
use std::collections::BTreeSet;
use teachtree_language::rules::{Composite, Pattern, Rules, Task};

/// A task that the rules cannot detect in a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnmeasuredTask {
    /// Its name.
    pub task: String,
    /// Whether it is a failure.
    pub failure: bool,
    /// The keys that cannot be detected, with the reasons: `Insert: the scene has no socket`.
    pub reason: String,
}

/// Primitives that a track cannot show, and why.
pub type Undetectable<'a> = (TrackId, &'a [String], &'a str);

/// The tasks that cannot be detected on the track of any hand.
pub fn unmeasured(rules: &Rules, hands: &[TrackId], undetectable: &[Undetectable]) -> Vec<UnmeasuredTask> {
    let of_task = |task: &Task| {
        let hands: Vec<String> =
            hands.iter().map(|hand| lacking(rules, task, *hand, undetectable)).collect::<Option<_>>()?;
        let reason = hands.into_iter().collect::<BTreeSet<_>>().into_iter().collect::<Vec<_>>().join("; ");
        (!reason.is_empty()).then(|| UnmeasuredTask { task: task.name.clone(), failure: task.failure, reason })
    };
    let mut unmeasured: Vec<UnmeasuredTask> = rules.tasks.iter().filter_map(of_task).collect();
    // A task that is made of tasks needs all of them.
    let of_composite = |whole: &Composite| {
        let mut parts = whole.parts.iter().filter_map(|part| rules.tasks.get(part.task.index()));
        let part = parts.find_map(|part| unmeasured.iter().find(|it| it.task == part.name))?;
        Some(UnmeasuredTask { task: whole.name.clone(), failure: whole.failure, reason: part.reason.clone() })
    };
    let composites: Vec<UnmeasuredTask> = rules.composites.iter().filter_map(of_composite).collect();
    unmeasured.extend(composites);
    unmeasured
}

/// The keys that a hand's track lacks, where the task cannot be found without them.
fn lacking(rules: &Rules, task: &Task, hand: TrackId, undetectable: &[Undetectable]) -> Option<String> {
    let reason = |key: &Pattern| {
        let labels: Vec<String> =
            rules.labels().filter(|label| key.covers(*label)).map(|label| rules.label_name(label)).collect();
        let reasons: Vec<&str> = labels
            .iter()
            .map(|name| {
                let own = undetectable.iter().filter(|(track, ..)| *track == hand || *track == TrackId::Both);
                own.into_iter().find(|(_, primitives, _)| primitives.contains(name)).map(|(.., reason)| *reason)
            })
            .collect::<Option<_>>()?;
        Some(format!("{}: {}", labels.first()?, reasons.first()?))
    };
    let reasons: Vec<Option<String>> = task.keys.iter().map(|key| reason(&key.label)).collect();
    let is_lost = if task.all_keys { reasons.iter().any(Option::is_some) } else { reasons.iter().all(Option::is_some) };
    let reasons: BTreeSet<String> = reasons.into_iter().flatten().collect();
    (is_lost && !reasons.is_empty()).then(|| reasons.into_iter().collect::<Vec<_>>().join(", "))
}
