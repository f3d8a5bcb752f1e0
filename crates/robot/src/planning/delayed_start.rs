//! Shortens the first path of a hand where the arms would go through each other at its beginning: people's hands come from where robots' arms have no room.

use teachtree_base::pose::pose_from_array;
use teachtree_command::Task;

/// Largest displacement with which an object counts as standing still, m and rad.
const STANDS: (f64, f64) = (0.001, 0.02);

/// Returns a task whose hand waits at `share` of its first path until the path continues there; `None` for a task that begins with a touch. Only the part of
/// the path counts on which the object stands still: the other hand may move it.
pub fn begun_late(task: &Task, share: f64) -> Option<Task> {
    let way = task.segments.iter().take_while(|segment| !segment.touching);
    let samples = way.flat_map(|segment| segment.hand.iter().zip(&segment.object));
    let object = pose_from_array(task.segments.first()?.object.first()?);
    let stands = |pose: &[f64; 7]| {
        let moved = object.inv_mul(&pose_from_array(pose));
        moved.translation.vector.norm() < STANDS.0 && moved.rotation.angle() < STANDS.1
    };
    let samples: Vec<_> = samples.take_while(|(_, object)| stands(object)).map(|(hand, _)| *hand).collect();
    let from = (share * samples.len().checked_sub(1)? as f64).round() as usize;
    let mut task = task.clone();
    let way = task.segments.iter_mut().take_while(|segment| !segment.touching);
    way.flat_map(|segment| &mut segment.hand).take(from).for_each(|hand| *hand = samples[from]);
    Some(task)
}
