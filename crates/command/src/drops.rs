//! Removes whole tasks without an effect: brushes, and pick-ups of an object that was lost before the same hand picked it up again (the paper, section 2.1:
//! inadvertent human error is compensated). The next attempt takes over the approach of a removed task.

use super::episodes::{BRUSH_S, STAYS_M};
use super::schema::{Omission, Segment, Task};
use super::series::pose_array;
use nalgebra::Vector3;
use teachtree_analysis::UNKNOWN;
use teachtree_base::hands::Side;
use teachtree_base::meaning::Meaning;
use teachtree_base::pose::pose_from_array;

/// Maximum rotation of an object that keeps its orientation, rad.
const STANDS_RAD: f64 = 0.35;
/// Maximum rotation of an object by a brush, rad.
const STAYS_RAD: f64 = 0.1;
/// Maximum displacement of an object that slips during its lift, m.
const SLIPS_M: f64 = 0.040;
/// Maximum displacement of a held object relative to the hand, m. An object that slips farther was lost.
const KEPT_M: f64 = 0.010;
/// The actions of a hand during the lift of a slipping object: the object falls, slides, or is pushed by the fingers that lose it.
const LIFTS: [Meaning; 6] =
    [Meaning::Close, Meaning::Carry, Meaning::Place, Meaning::Slide, Meaning::Push, Meaning::Open];
/// Maximum time between consecutive segments, s.
const NEXT_S: f64 = 0.02;

/// Leaves out tasks in which no finger touched for long enough to take part, and brushes.
pub(super) fn without_brushes(tasks: Vec<Task>) -> Vec<Task> {
    let is_left_out: Vec<bool> = tasks.iter().map(|task| task.grasps.is_empty() || is_brush(task, &tasks)).collect();
    let (mut kept, mut brushes) = (Vec::new(), Vec::new());
    for (task, is_left_out) in tasks.into_iter().zip(is_left_out) {
        if is_left_out { brushes.push(task) } else { kept.push(task) }
    }
    for brush in brushes {
        let (before, after): (Vec<&mut Task>, Vec<&mut Task>) =
            kept.iter_mut().filter(|task| task.track == brush.track).partition(|task| task.start_s < brush.start_s);
        if let Some(near) = after.into_iter().next().or(before.into_iter().next_back()) {
            near.left_out.push(left_out(&brush, 0, "failed try"));
        }
    }
    kept
}

/// Whether a hand with a named task only brushes an object: briefly, in no task that a rule names, and without a change of the object's orientation.
fn is_brush(task: &Task, tasks: &[Task]) -> bool {
    let touches = || task.segments.iter().filter(|segment| segment.touching);
    let lasts = touches().filter(|segment| segment.does != Meaning::Open).map(|segment| segment.duration_s);
    let first = touches().next().and_then(|first| first.object.first()).map(pose_from_array);
    let last = touches().next_back().and_then(|last| last.object.last()).map(pose_from_array);
    let stays = first.zip(last).is_none_or(|(first, last)| {
        let moved = (last.translation.vector - first.translation.vector).norm();
        moved < STAYS_M && first.rotation.angle_to(&last.rotation) < STAYS_RAD
    });
    let is_taught = |other: &Task| other.track == task.track && other.task != UNKNOWN && !other.grasps.is_empty();
    let is_short = task.task == UNKNOWN && lasts.sum::<f64>() < BRUSH_S;
    is_short && stays && tasks.iter().any(is_taught)
}

/// Returns the segments of a task from one on as omissions.
fn left_out(task: &Task, from: usize, why: &str) -> Omission {
    let segments = &task.segments[from.min(task.segments.len())..];
    let primitives = segments.iter().map(|segment| segment.primitive.clone()).collect();
    let start_s = segments.first().filter(|_| from > 0).map_or(task.start_s, |first| first.demonstrated_start_s);
    Omission { primitives, start_s, end_s: task.end_s, why: why.into() }
}

/// Leaves out tasks that only carried and dropped an object, or lost it while lifting, if the same hand picks the object up again and its orientation
/// has not changed. `meant` contains the hands and end times of tasks with an intended fall.
pub(super) fn without_drops(tasks: Vec<Task>, meant: &[(Side, f64)]) -> Vec<Task> {
    let was_meant = |task: &Task| meant.contains(&(task.track, task.end_s));
    let mut kept: Vec<Task> = Vec::new();
    for mut task in tasks {
        while let Some(last) = kept.iter().rposition(|before| before.track == task.track)
            && !was_meant(&kept[last])
            && (dropped(&kept[last], &task) || lost(&kept[last], &task))
        {
            let before = kept.remove(last);
            take_over(before, &mut task);
        }
        kept.push(task);
    }
    // A task that has taken over the approach of another one begins with it.
    kept.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
    kept
}

/// Whether a task ended with the object in the air, and this one picks it up again.
fn dropped(before: &Task, task: &Task) -> bool {
    let ends = before.segments.iter().rev().map(|segment| segment.does);
    ends.take(2).eq([Meaning::Open, Meaning::Carry]) && before.grasps.len() == 1 && stands(before, task)
}

/// Whether task `before` lifted an object slightly without setting it down and `task` picks it up again in the same place.
fn lost(before: &Task, task: &Task) -> bool {
    let has = |meaning: Meaning| before.segments.iter().any(|segment| segment.does == meaning);
    let touches = before.segments.iter().filter(|segment| segment.touching);
    let only_lifts = { touches }.all(|segment| LIFTS.contains(&segment.does));
    let way = task.grasp_pose().translation.vector - before.grasp_pose().translation.vector;
    is_on_the_spot(task)
        && only_lifts
        && !set_down(before)
        && has(Meaning::Close)
        && has(Meaning::Carry)
        && way.norm() < SLIPS_M
        && stands(before, task)
}

/// Whether the hand touches the object without a motion away from it before: it only approaches again, or does not even let go.
fn is_on_the_spot(task: &Task) -> bool {
    task.segments.iter().take_while(|segment| !segment.touching).all(|segment| segment.does == Meaning::Approach)
}

/// Whether the object was set down before the release: it stands still, and the fingers hold it where they grasped it. A lost object slips in the
/// fingers instead.
fn set_down(task: &Task) -> bool {
    let holds = |segment: &&Segment| segment.touching && !matches!(segment.does, Meaning::Close | Meaning::Open);
    let mut held = task.segments.iter().filter(holds);
    let Some(first) = held.next() else { return false };
    let last = held.next_back().unwrap_or(first);
    let slipped =
        first.hand.first().zip(last.hand.last()).map(|(from, to)| (Vector3::from(*to) - Vector3::from(*from)).norm());
    matches!(last.does, Meaning::Place | Meaning::Slide) && slipped.is_some_and(|slipped| slipped < KEPT_M)
}

/// Whether two tasks have the same object, and its orientation has not changed.
fn stands(before: &Task, task: &Task) -> bool {
    let turned = before.grasp_pose().rotation.angle_to(&task.grasp_pose().rotation);
    before.object == task.object && turned < STANDS_RAD
}

/// Adds a task to the omissions of the next one, which takes over its approach if it is made on the spot.
fn take_over(mut before: Task, task: &mut Task) {
    let free = |task: &Task| task.segments.iter().take_while(|segment| !segment.touching).count();
    let from = if is_on_the_spot(task) { free(&before) } else { 0 };
    let left = left_out(&before, from, "dropped");
    task.left_out = before.left_out.drain(..).chain([left]).chain(task.left_out.drain(..)).collect();
    if from == 0 {
        return;
    }
    let own: Vec<Segment> = task.segments.drain(..free(task)).collect();
    let own_s = own.last().map_or(0.0, |last| last.start_s + last.duration_s);
    let grasp = task.segments.first().and_then(|segment| segment.grasp);
    let way: Vec<Segment> = before.segments.drain(..from).map(|segment| Segment { grasp, ..segment }).collect();
    let takes_s = way.last().map_or(0.0, |last| last.start_s + last.duration_s);
    task.segments.iter_mut().for_each(|segment| segment.start_s += takes_s - own_s);
    task.segments.splice(..0, way);
    task.start_s = before.start_s;
}

/// Adapts an approach that comes from an omitted attempt, or precedes a pause: it leads to the pose of the object at the touch and ends just before it, because
/// the other hand may have moved the object.
pub(super) fn lead_to_the_touch(task: &mut Task) {
    for at in 1..task.segments.len() {
        let (ways, touch) = task.segments.split_at_mut(at);
        let (Some(last), touch) = (ways.last(), &touch[0]) else { continue };
        let later_s = touch.demonstrated_start_s - (last.demonstrated_start_s + last.duration_s);
        let (Some(from), Some(to)) = (last.object.last(), touch.object.first()) else { continue };
        if last.touching || !touch.touching || later_s < NEXT_S {
            continue;
        }
        let moved = pose_from_array(to) * pose_from_array(from).inverse();
        for segment in ways.iter_mut().rev().take_while(|segment| !segment.touching) {
            segment.demonstrated_start_s += later_s;
            for object in &mut segment.object {
                *object = pose_array(&(moved * pose_from_array(object)));
            }
        }
    }
}
