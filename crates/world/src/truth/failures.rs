//! Failures: computed from contacts, forces, poses and depths of the world, with the future known. They share nothing with the rules.

mod collision;
mod drop;
mod jam;
mod miss;
mod slip;

use super::facts::Facts;
use super::series::runs;
use super::world_state::WorldState;
use crate::sockets::{SocketSite, places};
use std::ops::Range;
use teachtree_base::scene::Scene;

/// A failure of a hand: its primitive and its time, ms.
pub(super) struct FailureInterval {
    name: &'static str,
    span: Range<usize>,
}

/// The inputs of all failures.
struct FailureInputs<'a> {
    scene: &'a Scene,
    hand: usize,
    moments: &'a [WorldState],
    facts: &'a [Facts],
    places: &'a [SocketSite],
    /// The bodies with which contacts are collisions.
    obstacles: &'a [usize],
}

/// The failures of a hand.
pub(super) fn failures(
    scene: &Scene,
    hand: usize,
    moments: &[WorldState],
    facts: &[Facts],
    obstacles: &[usize],
) -> Vec<FailureInterval> {
    let inputs = FailureInputs { scene, hand, moments, facts, places: &places(scene), obstacles };
    let named = |name, spans: Vec<Range<usize>>| spans.into_iter().map(move |span| FailureInterval { name, span });
    // Where failures overlap, a later one in this list replaces an earlier one.
    named("Slip", slip::slips(&inputs))
        .chain(named("Bump", collision::collisions(&inputs, false)))
        .chain(named("Collision", collision::collisions(&inputs, true)))
        .chain(named("Jam", jam::jams(&inputs)))
        .chain(named("Miss", miss::misses(&inputs)))
        .chain(named("Drop", drop::drops(&inputs)))
        .collect()
}

/// Replaces the primitives of a hand by its failures.
pub(super) fn relabel(labels: &mut [&'static str], failures: &[FailureInterval]) {
    for failure in failures {
        labels[failure.span.clone()].fill(failure.name);
    }
    // Fingers that leave a falling object one after the other do not release it. An object that slips out of them is dropped.
    for run in runs(labels) {
        let before = run.start.checked_sub(1).map(|at| labels[at]);
        if let (Some(before), Some(&"Drop"), "Release" | "Slip") = (before, labels.get(run.end), labels[run.start]) {
            labels[run].fill(before);
        }
    }
}

/// Stretches in which a condition holds.
fn spans(series: &[bool]) -> impl Iterator<Item = Range<usize>> {
    runs(series).into_iter().filter(|run| series[run.start])
}
