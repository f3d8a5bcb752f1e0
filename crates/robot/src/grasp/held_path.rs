//! The path of an object while a grasp holds it, with its times.

use nalgebra::Isometry3;
use teachtree_base::pose::{PoseArray, pose_from_array};
use teachtree_command::Task;

/// Number of places on the path of the object, after the first, to which the arm must be able to bring the palm: a few for each of many grasps, and more for a
/// grasp that is chosen. Between few places an arm may seem to change from one posture to another.
pub(super) const FEW: usize = 15;
pub(super) const MANY: usize = 90;

/// Returns the poses at which the object is grasped and released, and `between` of them, in order; reference frame.
pub(super) fn way(task: &Task, grasp: usize, between: usize) -> Vec<Isometry3<f64>> {
    let held = task.segments.iter().filter(|segment| segment.touching && segment.grasp == Some(grasp));
    let poses: Vec<&PoseArray> = held.flat_map(|segment| &segment.object).collect();
    let Some(last) = poses.len().checked_sub(1) else { return Vec::new() };
    (0..=between).map(|at| pose_from_array(poses[at * last / between])).collect()
}

/// Returns the start and the end of the contact of a grasp, s of the recording.
pub(crate) fn held(task: &Task, grasp: usize) -> Option<[f64; 2]> {
    let mut touching = task.segments.iter().filter(|segment| segment.touching && segment.grasp == Some(grasp));
    let first = touching.next()?;
    let last = touching.next_back().unwrap_or(first);
    Some([first.demonstrated_start_s, last.demonstrated_start_s + last.duration_s])
}
