//! The way of an object while a grasp holds it, and when.

use nalgebra::Isometry3;
use teachtree_base::pose::{PoseArray, pose_from_array};
use teachtree_command::Task;

/// The arm must bring the palm to so many places on the way of the object after the first.
const BETWEEN: usize = 15;

/// Where the object is taken, where it is let go, and some places between, in order; reference frame.
pub(super) fn way(task: &Task, grasp: usize) -> Vec<Isometry3<f64>> {
    let held = task.segments.iter().filter(|segment| segment.touching && segment.grasp == Some(grasp));
    let poses: Vec<&PoseArray> = held.flat_map(|segment| &segment.object).collect();
    let Some(last) = poses.len().checked_sub(1) else { return Vec::new() };
    (0..=BETWEEN).map(|at| pose_from_array(poses[at * last / BETWEEN])).collect()
}

/// From when to when a grasp touches, s of the recording.
pub(crate) fn held(task: &Task, grasp: usize) -> Option<[f64; 2]> {
    let mut touching = task.segments.iter().filter(|segment| segment.touching && segment.grasp == Some(grasp));
    let first = touching.next()?;
    let last = touching.next_back().unwrap_or(first);
    Some([first.demonstrated_start_s, last.demonstrated_start_s + last.duration_s])
}
