//! Ground truth: the primitives and tasks of each hand, computed from the noise-free states of the world, including later ones. It follows the definitions
//! of the primitives (docs/sources.md, C1 to C20) on its own physical facts and shares nothing with the rules. An object is held if the squeeze can carry
//! its weight, contacts are those of the solver, and motions are displacements that exceed tremor. Intervals shorter than a human act are removed on both
//! sides of a change.

mod coordination;
mod events;
mod facts;
mod failures;
mod labels;
mod series;
mod tasks;
mod world_state;

pub(super) use events::contact_events;
pub(super) use world_state::WorldState;

use facts::Facts;
use std::ops::Range;
use teachtree_base::hands::Side;
use teachtree_base::scene::Scene;

/// Whether a task of the truth can end with this primitive.
pub fn ends_task(label: &str) -> bool {
    matches!(label, "Release" | "Drop" | "Miss")
}

/// Whether a hand starts a new task between two primitives of the truth.
pub fn sets_out(before: &str, after: &str) -> bool {
    ends_task(before) && matches!(after, "Move" | "Approach")
}

/// The ground truth of all hands at every moment.
pub(super) struct Truth {
    /// The hands, in the order of the scene.
    pub(super) hands: Vec<HandTruth>,
    /// The coordination of two hands; empty without coordination.
    pub(super) both: Option<Vec<String>>,
}

/// The ground truth of a hand at every moment.
pub(super) struct HandTruth {
    /// The primitive.
    pub(super) labels: Vec<String>,
    /// The task; empty outside of tasks.
    pub(super) tasks: Vec<String>,
    /// The index of the beginning of each task, and its name.
    pub(super) begun: Vec<(usize, &'static str)>,
}

/// The options of the ground truth.
pub(super) struct TruthOptions {
    /// Strength of the hands, as [`Operator::force_scale`](super::Operator::force_scale).
    pub(super) force_scale: f64,
    /// The bodies with which contacts are collisions; `None` for a truth without failures.
    pub(super) obstacles: Option<Vec<usize>>,
}

impl Default for TruthOptions {
    fn default() -> Self {
        Self { force_scale: 1.0, obstacles: None }
    }
}

/// Returns the ground truth of the kept part of the recording. Tasks do not depend on moments outside of it. Failures replace the primitives of the hands.
pub(super) fn truth(scene: &Scene, moments: &[WorldState], kept: &Range<usize>, options: &TruthOptions) -> Truth {
    let facts_of = |hand| facts::facts(scene, hand, moments, options.force_scale);
    let facts: Vec<Vec<Facts>> = (0..scene.hands.len()).map(facts_of).collect();
    let mut labels: Vec<Vec<&'static str>> = facts.iter().map(|facts| labels::labels(facts)).collect();
    let sides: Vec<Side> = scene.hands.keys().copied().collect();
    let both = match (facts.as_slice(), labels.as_slice(), sides.as_slice()) {
        ([one, other], [of_one, of_other], &[first, second]) => {
            let hands = [
                coordination::HandTimeline { side: first, facts: one, labels: of_one },
                coordination::HandTimeline { side: second, facts: other, labels: of_other },
            ];
            Some(coordination::coordination(&hands))
        }
        _ => None,
    };
    for own in &mut labels {
        let coordinated = both.iter().flatten().zip(own).filter(|(both, _)| !both.is_empty());
        coordinated.for_each(|(both, own)| *own = both);
    }
    if let Some(obstacles) = &options.obstacles {
        for (hand, own) in labels.iter_mut().enumerate() {
            failures::relabel(own, &failures::failures(scene, hand, moments, &facts[hand], obstacles));
        }
    }
    let hands = facts.iter().zip(&labels).map(|(facts, labels)| of_hand(&facts[kept.clone()], &labels[kept.clone()]));
    let text = |labels: Vec<&'static str>| labels[kept.clone()].iter().map(|name| (*name).to_string()).collect();
    Truth { hands: hands.collect(), both: both.map(text) }
}

fn of_hand(facts: &[Facts], labels: &[&'static str]) -> HandTruth {
    let mut tasks = vec![String::new(); labels.len()];
    let mut begun = Vec::new();
    for (span, task) in tasks::tasks(labels, facts) {
        if !task.is_empty() {
            begun.push((span.start, task));
        }
        tasks[span].fill(task.to_string());
    }
    HandTruth { labels: labels.iter().map(|name| (*name).to_string()).collect(), tasks, begun }
}
