//! A stage: tasks of both hands that a person did at the same time, planned together and run by one clock. A task that nothing else overlaps is a stage
//! of its own, planned when the one before is over and the object is seen where it is.

use super::clock::{Clock, Part};
use super::plan::{Found, Plan};
use super::tree::Robot;
use crate::base::error::InputError;
use crate::base::hands::Side;
use crate::command::{Commands, Task};
use nalgebra::Isometry3;

/// With two hands the clock changes its speed within this time before and after, s.
const EASED_S: f64 = 0.1;
/// Tasks that overlap by less were done one after the other, s.
const OVERLAP_S: f64 = 0.02;

/// Indices of the tasks of each stage.
pub(super) fn stages(tasks: &[Task]) -> Vec<Vec<usize>> {
    let mut stages: Vec<(f64, Vec<usize>)> = Vec::new();
    for (number, task) in tasks.iter().enumerate() {
        match stages.last_mut() {
            Some((end_s, those)) if task.start_s < *end_s - OVERLAP_S => {
                *end_s = end_s.max(task.end_s);
                those.push(number);
            }
            _ => stages.push((task.end_s, vec![number])),
        }
    }
    stages.into_iter().map(|(_, those)| those).collect()
}

/// Where the object of a task is found by its hand, when it is at `object` as the stage begins: what another task of the stage has brought onto the
/// taught way is there afterwards.
pub(super) fn found(tasks: &[Task], stage: &[usize], number: usize, object: &Isometry3<f64>) -> Found {
    let same = || stage.iter().filter(|other| tasks[**other].object == tasks[number].object);
    // Whoever touches it first finds it there; before that a person may have dropped it elsewhere, which is left out.
    let touched_s = |other: &&usize| {
        let touch = tasks[**other].segments.iter().find(|segment| segment.touching);
        touch.map_or(f64::INFINITY, |segment| segment.taught_start_s)
    };
    let first = same().min_by(|a, b| touched_s(a).total_cmp(&touched_s(b)));
    let off = first.map_or_else(Isometry3::identity, |first| object * tasks[*first].taken_at().inverse());
    let until_s = same().filter(|other| **other != number).filter_map(|other| tasks[*other].first_moved_s());
    Found { off, until_s: until_s.fold(f64::INFINITY, f64::min) }
}

/// What one hand does in a stage: the indices of its tasks and their plans, one after the other.
pub(super) type Plans<'a> = Vec<(usize, Plan<'a>)>;

/// A stage as it is performed.
pub(super) struct Stage<'a> {
    /// Of each hand.
    pub(super) hands: Vec<Plans<'a>>,
    pub(super) clock: Clock,
}

impl<'a> Stage<'a> {
    /// The stage of hands with their plans.
    pub(super) fn new(hands: Vec<Plans<'a>>) -> Self {
        let parts = |plans: &Plans<'_>| plans.iter().flat_map(|(_, plan)| plan.parts()).collect();
        let parts: Vec<Vec<Part>> = hands.iter().map(parts).collect();
        let together = parts.iter().filter(|parts| !parts.is_empty()).count() > 1;
        Self { hands, clock: Clock::of(&parts, if together { EASED_S } else { 0.0 }) }
    }

    /// When the first hand begins that does anything, s of the clock, when of its own plans each begins at `from_s`.
    pub(super) fn begins_s(&self, from_s: &[f64]) -> f64 {
        let busy = from_s.iter().enumerate().filter(|(place, _)| !self.hands[*place].is_empty());
        busy.map(|(place, from_s)| self.clock.when(place, *from_s)).fold(f64::INFINITY, f64::min)
    }

    /// What a hand does at a time of the clock, or would have done `from_s` at first: its task, the plan and the time in it; `None` for one that does nothing.
    pub(super) fn at(&self, hand: usize, clock_s: f64, from_s: f64) -> Option<(usize, &Plan<'a>, f64)> {
        let mut own = self.clock.at(hand, clock_s).max(from_s);
        let plans = self.hands.get(hand)?;
        for (number, plan) in plans {
            if own <= plan.duration() {
                return Some((*number, plan, own));
            }
            own -= plan.duration();
        }
        plans.last().map(|(number, plan)| (*number, plan, plan.duration()))
    }

    /// Where the person left an object in the end, as the last of the tasks about it says.
    pub(super) fn taught_end(&self, tasks: &[Task], object: &str) -> Isometry3<f64> {
        let about = self.hands.iter().flatten().filter(|(number, _)| tasks[*number].object == object);
        let last = about.max_by(|a, b| tasks[a.0].end_s.total_cmp(&tasks[b.0].end_s));
        last.map_or_else(Isometry3::identity, |(_, plan)| plan.taught_end())
    }
}

/// What is wrong with a task, by its number.
pub(super) fn at_task(tasks: &[Task], number: usize, message: String) -> InputError {
    InputError::new(format!("task {} ({})", number + 1, tasks[number].task), message)
}

/// The hands that commands are for, each once, in order.
///
/// # Errors
/// No task, or one of no hand; commands that were made for another robot.
pub(super) fn sides(commands: &Commands, robot: &Robot) -> Result<Vec<Side>, InputError> {
    let refuse = |message: String| InputError::new("commands", message);
    if commands.tasks.is_empty() {
        return Err(refuse("have no tasks, nothing is to be done".into()));
    }
    if let Some(other) = commands.robot.as_ref().filter(|other| **other != robot.name) {
        let help = "make them again for this one: `teachtree command LOG --robot ROBOT -o COMMANDS`";
        return Err(refuse(format!("are for the robot `{other}`, this one is `{}`", robot.name)).help(help));
    }
    let side =
        |task: &Task| Side::from_name(&task.track).ok_or_else(|| refuse(format!("are of no hand: `{}`", task.track)));
    let mut sides = commands.tasks.iter().map(side).collect::<Result<Vec<Side>, InputError>>()?;
    sides.sort();
    sides.dedup();
    Ok(sides)
}
