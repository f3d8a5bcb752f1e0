//! Leaves out the beginning of a hand's first way, where arms would go through each other on it: from where people's hands come, arms need not be able to be.

use crate::command::Task;

/// The first way of a task in which the hand stands where this share of it is gone, until it goes on from there; `None` for a task that begins with a touch.
pub(super) fn begun_late(task: &Task, share: f64) -> Option<Task> {
    let way = task.segments.iter().take_while(|segment| !segment.touching);
    let samples: Vec<_> =
        way.flat_map(|segment| segment.hand.iter().copied().zip(segment.object.iter().copied())).collect();
    let from = (share * samples.len().checked_sub(1)? as f64).round() as usize;
    let (hand, object) = samples[from];
    let mut task = task.clone();
    let way = task.segments.iter_mut().take_while(|segment| !segment.touching);
    let places = way.flat_map(|segment| segment.hand.iter_mut().zip(&mut segment.object));
    places.take(from).for_each(|place| (*place.0, *place.1) = (hand, object));
    Some(task)
}
