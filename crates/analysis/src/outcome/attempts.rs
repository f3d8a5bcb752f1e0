//! Attempts: which of a hand's tasks are repetitions of a failed one.
//!
//! An attempt begins when the hand regains the object after a failed task of the same object and target. Tasks without a name are neither failures
//! nor successes; they belong to the attempt in which they are.

use crate::{Subject, TaskSpan, Track, UNKNOWN};

impl TaskSpan {
    /// Returns whether the task has a name and is not a failure.
    pub fn is_success(&self) -> bool {
        !self.failure && self.task != UNKNOWN
    }
}

/// Whether a later task has the object and the target of a failed one. The log may lack the object of either, and the target of a failure: a jam on the
/// rim of a hole is not in it. A success without a target is elsewhere than a failure with one.
pub(super) fn repeats(failed: &Subject, later: &Subject, is_success: bool) -> bool {
    let same = |one: &Option<String>, other: &Option<String>| one.is_none() || other.is_none() || one == other;
    let has_target = later.partner.is_some() || failed.partner.is_none() || !is_success;
    same(&failed.object, &later.object) && same(&failed.partner, &later.partner) && has_target
}

/// Numbers the attempts of each track, from 1.
pub fn number(tracks: &mut [Track]) {
    for track in tracks {
        for at in 0..track.tasks.len() {
            let attempt =
                track.tasks.get(at).map_or(1, |task| attempt(task, track.tasks.get(..at).unwrap_or_default()));
            track.tasks.get_mut(at).into_iter().for_each(|task| task.attempt = attempt);
        }
    }
}

/// The attempt of a task after these. The last one that it repeats, or that has its object and target, decides.
fn attempt(task: &TaskSpan, before: &[TaskSpan]) -> usize {
    // A success without a target is elsewhere than a task with one.
    let is_elsewhere =
        |other: &TaskSpan| other.is_success() && other.subject.partner.is_none() && task.subject.partner.is_some();
    let is_same = |other: &&TaskSpan| {
        other.task != UNKNOWN && !is_elsewhere(other) && repeats(&other.subject, &task.subject, task.is_success())
    };
    let last = before.iter().rev().find(is_same);
    last.filter(|last| last.failure).map_or(1, |last| last.attempt + 1)
}
