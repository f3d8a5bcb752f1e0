//! Turns an object about the axis of its hole while it is carried there. Its angle in the hole is free, so the hand can approach from another side with the
//! demonstrated contacts.

use super::schedule::last_to_touch;
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use teachtree_base::easing::minimum_jerk;
use teachtree_base::meaning::Meaning;
use teachtree_base::pose::{pose_array, pose_from_array};
use teachtree_base::scene::Scene;
use teachtree_command::{Task, hole_of};

/// Largest tilt of an axis that counts as upright, rad: a turn about it does not shift the weight to other fingers.
const UPRIGHT_RAD: f64 = 0.1;

/// Returns a task, to be the one with this index among all tasks, with its object turned by an angle, rad, while it is carried to the hole; `None` without an
/// insertion, for a hole that is not upright, or if another task handles the object too.
pub(super) fn turned(task: &Task, (tasks, number): (&[Task], usize), scene: &Scene, angle: f64) -> Option<Task> {
    if tasks.iter().enumerate().any(|(other, it)| other != number && it.object == task.object) {
        return None;
    }
    let inserts = task.segments.iter().position(|segment| segment.does == Meaning::Insert)?;
    let carries = task.segments[..inserts].iter().rposition(|segment| segment.does == Meaning::Carry)?;
    let now = |body: &str| {
        let moved = last_to_touch(tasks.iter().filter(|other| other.object == body)).and_then(left_at);
        moved.or_else(|| scene.bodies.get(body).map(|body| body.pose()))
    };
    let object = left_at(task)?;
    let hole = hole_of(scene, &task.object, &object, &now)?;
    let leans = hole.axis.angle(&scene.up());
    if scene.up() != Vector3::zeros() && leans.min(std::f64::consts::PI - leans) > UPRIGHT_RAD {
        return None;
    }
    let axis = Unit::new_normalize(object.inverse_transform_vector(&hole.axis));
    let plug = Translation3::from(hole.plug.coords);
    let turn = |share: f64| plug * UnitQuaternion::from_axis_angle(&axis, angle * share) * plug.inverse();
    let mut task = task.clone();
    for (at, segment) in task.segments.iter_mut().enumerate().skip(carries) {
        let last = segment.object.len().saturating_sub(1).max(1) as f64;
        for (sample, pose) in segment.object.iter_mut().enumerate() {
            let share = if at == carries { minimum_jerk(sample as f64 / last) } else { 1.0 };
            *pose = pose_array(&(pose_from_array(pose) * turn(share)));
        }
    }
    Some(task)
}

/// Returns the final pose of the object of a task, reference frame.
fn left_at(task: &Task) -> Option<Isometry3<f64>> {
    let last = task.segments.iter().rfind(|segment| segment.touching)?;
    last.object.last().map(pose_from_array)
}
