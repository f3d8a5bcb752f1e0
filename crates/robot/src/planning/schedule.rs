//! The schedule of a group of tasks: tasks of both hands that the operator did at the same time are planned together and run on one time scale. A task that
//! overlaps no other is a group of its own, planned after the previous group has ended, from the actual pose of the object.

use super::plan::{ObjectOffset, Plan};
use super::time_scale::{Part, TimeScale};
use crate::model::robot::Robot;
use nalgebra::Isometry3;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_command::{Commands, Task};

/// With two hands, the time before and after a change of speed over which the time scale changes, s.
pub(super) const EASED_S: f64 = 0.1;
/// Tasks that overlap by less than this are consecutive, s.
const OVERLAP_S: f64 = 0.02;

/// Returns the indices of the tasks of each group, in order.
pub(crate) fn groups(tasks: &[Task]) -> Vec<Vec<usize>> {
    let mut groups: Vec<(f64, Vec<usize>)> = Vec::new();
    for (number, task) in tasks.iter().enumerate() {
        match groups.last_mut() {
            Some((end_s, those)) if task.start_s < *end_s - OVERLAP_S => {
                *end_s = end_s.max(task.end_s);
                those.push(number);
            }
            _ => groups.push((task.end_s, vec![number])),
        }
    }
    groups.into_iter().map(|(_, those)| those).collect()
}

/// Returns the task that touches its object first, or the first task if none does. An earlier displacement of the object is not part of the commands.
pub(super) fn first_to_touch<'t>(tasks: impl Iterator<Item = &'t Task>) -> Option<&'t Task> {
    let touched_s = |task: &Task| {
        let touch = task.segments.iter().find(|segment| segment.touching);
        touch.map_or(f64::INFINITY, |segment| segment.demonstrated_start_s)
    };
    tasks.min_by(|a, b| touched_s(a).total_cmp(&touched_s(b)))
}

/// Returns the task that touches its object last.
pub(super) fn last_to_touch<'t>(tasks: impl Iterator<Item = &'t Task>) -> Option<&'t Task> {
    let touched_s = |task: &Task| {
        let touch = task.segments.iter().rfind(|segment| segment.touching);
        touch.map_or(f64::NEG_INFINITY, |segment| segment.demonstrated_start_s + segment.duration_s)
    };
    tasks.max_by(|a, b| touched_s(a).total_cmp(&touched_s(b)))
}

/// Returns where the hand of a task finds its object, if the object is at `object` when the group begins: the hand that touches it first finds it there. After
/// another task of the group has brought it onto the demonstrated path, it is there.
pub(crate) fn found(tasks: &[Task], group: &[usize], number: usize, object: &Isometry3<f64>) -> ObjectOffset {
    let same = || group.iter().filter(|other| tasks[**other].object == tasks[number].object);
    let first = first_to_touch(same().map(|other| &tasks[*other]));
    let off = first.map_or_else(Isometry3::identity, |first| object * first.grasp_pose().inverse());
    let until_s = same().filter(|other| **other != number).filter_map(|other| tasks[*other].first_moved_s());
    let touch = first.and_then(|first| Some((first, first.segments.iter().find(|segment| segment.touching)?)));
    let stands = touch.map_or((Isometry3::identity(), f64::NEG_INFINITY), |(first, touch)| {
        (first.grasp_pose(), touch.demonstrated_start_s)
    });
    ObjectOffset { off, until_s: until_s.fold(f64::INFINITY, f64::min), stands }
}

/// The plans of one hand in a group.
#[derive(Default)]
pub(crate) struct HandPlans<'a> {
    /// The indices of its tasks and their plans, one after the other.
    pub(crate) plans: Vec<(usize, Plan<'a>)>,
    /// The start time within the plans, s.
    pub(crate) begins_s: f64,
}

impl<'a> HandPlans<'a> {
    /// The parts of all its plans, in order.
    pub(crate) fn parts(&self) -> Vec<Part> {
        self.plans.iter().flat_map(|(_, plan)| plan.parts()).collect()
    }

    /// Returns the task, the plan and the time in it at a time of the hand's plans, s; `None` for an idle hand.
    pub(crate) fn at(&self, mut own_s: f64) -> Option<(usize, &Plan<'a>, f64)> {
        for (number, plan) in &self.plans {
            if own_s <= plan.duration() {
                return Some((*number, plan, own_s));
            }
            own_s -= plan.duration();
        }
        self.plans.last().map(|(number, plan)| (*number, plan, plan.duration()))
    }
}

/// The schedule of a group.
pub(crate) struct Schedule<'a> {
    /// The plans of each hand.
    hands: Vec<HandPlans<'a>>,
    /// From the time of the group to the time of each hand.
    pub(crate) time: TimeScale,
}

impl<'a> Schedule<'a> {
    /// Returns the schedule of hands with their plans.
    pub(crate) fn new(hands: Vec<HandPlans<'a>>) -> Self {
        let parts: Vec<Vec<Part>> = hands.iter().map(HandPlans::parts).collect();
        let together = parts.iter().filter(|parts| !parts.is_empty()).count() > 1;
        Self { hands, time: TimeScale::of(&parts, if together { EASED_S } else { 0.0 }) }
    }

    /// Returns the start time of the first hand with a task, s.
    pub(crate) fn begins_s(&self) -> f64 {
        let busy = self.hands.iter().enumerate().filter(|(_, hand)| !hand.plans.is_empty());
        busy.map(|(place, hand)| self.time.when(place, hand.begins_s)).fold(f64::INFINITY, f64::min)
    }

    /// Returns the task, the plan and the time in it of a hand at a time, s; `None` for an idle hand.
    pub(crate) fn at(&self, hand: usize, time_s: f64) -> Option<(usize, &Plan<'a>, f64)> {
        let hand_plans = self.hands.get(hand)?;
        hand_plans.at(self.time.at(hand, time_s).max(hand_plans.begins_s))
    }

    /// Returns the final pose of an object, from the last task with it.
    pub(crate) fn demonstrated_end(&self, tasks: &[Task], object: &str) -> Isometry3<f64> {
        let about =
            self.hands.iter().flat_map(|hand| &hand.plans).filter(|(number, _)| tasks[*number].object == object);
        let last = about.max_by(|a, b| tasks[a.0].end_s.total_cmp(&tasks[b.0].end_s));
        last.map_or_else(Isometry3::identity, |(_, plan)| plan.demonstrated_end())
    }
}

/// An error about a task, by its number.
pub(crate) fn at_task(tasks: &[Task], number: usize, message: String) -> InputError {
    InputError::new(format!("task {} ({})", number + 1, tasks[number].task), message)
}

/// Returns the hands of commands, each once, in order.
///
/// # Errors
/// No tasks; a task without a hand; commands for another robot.
pub(crate) fn sides(commands: &Commands, robot: &Robot) -> Result<Vec<Side>, InputError> {
    let refuse = |message: String| InputError::new("commands", message);
    if commands.tasks.is_empty() {
        return Err(refuse("have no tasks, expected at least one".into()));
    }
    if let Some(other) = commands.robot.as_ref().filter(|other| **other != robot.name) {
        let help = "make them again for this one: `teachtree retarget LOG --robot ROBOT -o COMMANDS`";
        return Err(refuse(format!("are for the robot `{other}`, this one is `{}`", robot.name)).help(help));
    }
    let mut sides: Vec<Side> = commands.tasks.iter().map(|task| task.track).collect();
    sides.sort();
    sides.dedup();
    Ok(sides)
}
