//! Ground truth: what a hand really did, from the world without noise and with the future known. It follows the definitions of the primitives
//! (PAPER.md section 3) on physical facts of its own and shares nothing with the rules: held means that the squeeze could carry the object's
//! weight, contacts are those that the solver made, motions are displacements that outlast tremor, and what is shorter than a human act is
//! taken out on both sides of a change.

mod events;
mod facts;
mod labels;
mod moment;
mod series;
mod tasks;

pub(super) use events::contact_events;
pub(super) use moment::Moment;

use crate::base::scene::Scene;
use std::ops::Range;

/// What a hand did at every moment.
pub(super) struct Truth {
    /// The primitive.
    pub(super) labels: Vec<String>,
    /// The task; empty where it was at none.
    pub(super) tasks: Vec<String>,
    /// Where each task begins, and what it is called.
    pub(super) begun: Vec<(usize, &'static str)>,
}

/// What a hand did in the part of the recording that is kept; nothing outside of it makes a task.
pub(super) fn truth(scene: &Scene, hand: usize, moments: &[Moment], kept: Range<usize>) -> Truth {
    let facts = facts::facts(scene, hand, moments);
    let labels = labels::labels(&facts);
    let (facts, labels) = (&facts[kept.clone()], &labels[kept]);
    let mut tasks = vec![String::new(); labels.len()];
    let mut begun = Vec::new();
    for (span, task) in tasks::tasks(labels, facts) {
        if !task.is_empty() {
            begun.push((span.start, task));
        }
        tasks[span].fill(task.to_string());
    }
    Truth { labels: labels.iter().map(|name| (*name).to_string()).collect(), tasks, begun }
}
