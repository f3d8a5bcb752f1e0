//! The pace of an insertion, from rest to rest. The inserting hand and the hand that moves the object with the hole use the same pace. With different paces,
//! one hand would pull out the object that the other one inserts.

use super::segments::ends_s;
use teachtree_base::meaning::Meaning;
use teachtree_base::scene::Scene;
use teachtree_command::Task;

/// Returns the completed share of the path at a share of the time.
pub(super) fn eased(share: f64) -> f64 {
    share - (std::f64::consts::TAU * share).sin() / std::f64::consts::TAU
}

/// Returns the intervals (s of the recording) in which other hands of a group insert something into a task's object.
pub(in crate::planning) fn insertions(tasks: &[Task], group: &[usize], number: usize, scene: &Scene) -> Vec<[f64; 2]> {
    let task = &tasks[number];
    let Some(body) = scene.bodies.get(&task.object) else { return Vec::new() };
    let enters = |other: &&Task| body.sockets.values().any(|socket| socket.takes(&other.object));
    let others = group.iter().map(|other| &tasks[*other]).filter(|other| other.track != task.track);
    let of = |other: &Task| -> Vec<[f64; 2]> {
        let segments = other.segments.iter().enumerate().filter(|(_, segment)| segment.does == Meaning::Insert);
        segments.map(|(at, segment)| [segment.demonstrated_start_s, ends_s(&other.segments, at)]).collect()
    };
    others.filter(enters).flat_map(of).collect()
}

/// Returns the completed share of the path at a share of the time, for an object that is held from `from` to `to` (times of the recording) while
/// something is inserted into it.
pub(super) fn beside(share: f64, [from, to]: [f64; 2], insertions: &[[f64; 2]]) -> f64 {
    let time = from + (to - from) * share;
    let Some([begins, ends]) = insertions.iter().find(|[begins, ends]| *begins < time && time < *ends) else {
        return share;
    };
    let paced = begins + (ends - begins) * eased((time - begins) / (ends - begins));
    if to > from { ((paced - from) / (to - from)).clamp(0.0, 1.0) } else { share }
}
