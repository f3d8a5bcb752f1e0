//! Changes of the paths of two hands with chosen grasps: they are led past each other, begun later or along the hand's own axis, wait for the other hand, and
//! fingers open less.

use super::{BETTER, Grasps, Pair};
use crate::grasp::opening::NARROWER_M;
use crate::planning::axial_retreat::{Leg, turn};
use crate::planning::change::{Change, THROUGH_M};
use crate::planning::delayed_start::begun_late;
use crate::planning::detour::{Aside, Passing};
use crate::planning::grasp_pair::GraspPair;
use crate::planning::precedence::{belong_together, orders};
use crate::planning::rollout::{Near, Rollout, total};
use teachtree_command::Task;

/// Number of parts in which the first path of a hand is shortened.
const LATE: u32 = 4;
/// Maximum number of paths that are followed before or after the simultaneous motion of the other hand.
const WAITS: usize = 4;

impl Pair<'_> {
    /// Returns the change when both hands follow their whole paths with these tasks, from these postures, and are led past each other, over the object and fixed
    /// bodies; `None` if an arm cannot follow.
    pub(super) fn gone(&self, grasps: Grasps, tasks: [Task; 2], grasp_pair: &GraspPair) -> Option<Change> {
        let mut change = self.led_apart(grasps, tasks, grasp_pair)?;
        for hand in [1, 0] {
            let lifted = self.lifted(hand, change.tasks[hand].clone());
            let met = [&change.tasks[hand], &lifted].map(|task| self.goes_through(hand, task, grasps[hand].1));
            if met[1] < met[0] {
                self.take(grasps, hand, lifted, (met[0] - met[1]) as f64 * THROUGH_M, &mut change);
            }
        }
        Some(change)
    }

    /// Returns the change when both hands follow their whole paths with these tasks, from these postures, and are led past each other.
    fn led_apart(&self, grasps: Grasps, tasks: [Task; 2], grasp_pair: &GraspPair) -> Option<Change> {
        let all = |tasks: &[Task; 2]| self.with(&[(grasps[0].0, &tasks[0]), (grasps[1].0, &tasks[1])]);
        let rollout = |hand: usize| {
            let begun = self.begun(hand, &all(&tasks)).into_iter().nth(grasp_pair.postures[hand])?;
            Rollout::of(begun, &all(&tasks), self.scene, self.followed[hand]).ok()
        };
        let rollouts = [rollout(0)?, rollout(1)?];
        let near = rollouts[0].near(&rollouts[1]);
        let mut change = Change { tasks, rollouts, near, through: grasp_pair.through };
        let beginning = [1, 0].into_iter().filter(|hand| self.is_first(grasps[*hand].0));
        for (hand, part) in beginning.flat_map(|hand| (1..=LATE).map(move |part| (hand, part))) {
            if change.near.is_empty() {
                return Some(change);
            }
            if let Some(late) = begun_late(&change.tasks[hand], f64::from(part) / f64::from(LATE)) {
                self.take(grasps, hand, late, 0.0, &mut change);
            }
        }
        for hand in [1, 0] {
            for aside in [Aside::Level, Aside::Upward] {
                let allowed = self.goes_through(hand, &change.tasks[hand], grasps[hand].1);
                let led = self.led_past(hand, grasps[hand], &all(&change.tasks), &change.rollouts, aside);
                let led = led.filter(|task| self.goes_through(hand, task, grasps[hand].1) <= allowed);
                let turned = self.turned(&change.tasks[hand], grasps[hand].1, hand);
                for task in led.into_iter().chain(turned.into_iter().filter(|_| aside == Aside::Upward)) {
                    if change.near.is_empty() {
                        return Some(change);
                    }
                    self.take(grasps, hand, task, 0.0, &mut change);
                }
            }
        }
        self.let_wait(grasps, &mut change);
        for (hand, opens) in [1, 0].into_iter().flat_map(|hand| NARROWER_M.map(|opens| (hand, opens))) {
            if change.near.is_empty() {
                return Some(change);
            }
            // The object of the other hand is not exactly where it is expected.
            let mut task = change.tasks[hand].clone();
            if self.others(&task).any(|other| other.object == task.object) {
                continue;
            }
            let allowed = self.goes_through(hand, &task, grasps[hand].1);
            let Some(mapped) = task.grasps[grasps[hand].1].mapped.as_mut() else { continue };
            mapped.opens = Some(opens);
            if self.goes_through(hand, &task, grasps[hand].1) <= allowed {
                self.take(grasps, hand, task, 0.0, &mut change);
            }
        }
        for hand in [1, 0] {
            if !change.near.is_empty() {
                let tasks = change.tasks.clone();
                change.take_nearest(
                    hand,
                    self.begun(hand, &all(&tasks)),
                    (&tasks, 0.0),
                    &all(&tasks),
                    self.scene,
                    self.followed[hand],
                );
            }
        }
        Some(change)
    }

    /// Takes a task of a hand that begins as at present, if that reduces the cost; `gain` is what it gains on its path, m.
    fn take(&self, grasps: Grasps, hand: usize, task: Task, gain: f64, change: &mut Change) {
        let mut tasks = change.tasks.clone();
        tasks[hand] = task;
        let all = self.with(&[(grasps[0].0, &tasks[0]), (grasps[1].0, &tasks[1])]);
        let as_now = self.begun_like(hand, &all, &change.rollouts[hand]);
        change.take_nearest(hand, as_now, (&tasks, gain), &all, self.scene, self.followed[hand]);
    }

    /// Lets one hand wait for the other on paths without the object, if that reduces the missing distance.
    fn let_wait(&self, grasps: Grasps, change: &mut Change) {
        for _ in 0..WAITS {
            let before = total(&change.near);
            let mut best: Option<(usize, Task, Rollout, Vec<Near>)> = None;
            for (hand, task) in change.tasks.iter().enumerate().filter(|_| before > 0.0) {
                let shared = self.others(task).any(|other| belong_together(self.scene, &task.object, &other.object));
                let mut tasks = self.with(&[(grasps[1 - hand].0, &change.tasks[1 - hand]), (grasps[hand].0, task)]);
                for (way, precedence) in orders(task, shared) {
                    let own = &mut tasks[grasps[hand].0].segments[way.clone()];
                    own.iter_mut().for_each(|segment| segment.precedence = Some(precedence));
                    if let Some(plans) = self.plans(hand, &tasks, &change.rollouts[hand]) {
                        let rollout = change.rollouts[hand].at_times_of(&plans);
                        let least = best.as_ref().map_or(BETTER * before, |best| total(&best.3));
                        if let Some(near) = rollout.near_to(&change.rollouts[1 - hand], hand, least) {
                            best = Some((hand, tasks[grasps[hand].0].clone(), rollout, near));
                        }
                    }
                    tasks[grasps[hand].0].segments[way.clone()].clone_from_slice(&task.segments[way]);
                }
            }
            let Some((hand, task, rollout, near)) = best else { return };
            (change.tasks[hand], change.rollouts[hand], change.near) = (task, rollout, near);
        }
    }

    /// Returns the task of a grasp with its paths led past the other hand.
    fn led_past(
        &self,
        hand: usize,
        at: (usize, usize),
        tasks: &[Task],
        rollouts: &[Rollout; 2],
        aside: Aside,
    ) -> Option<Task> {
        let plans = self.both_plans(tasks, rollouts)?;
        let passing = Passing { rollouts: rollouts.each_ref(), plans: plans.each_ref(), up: self.scene.up() };
        passing.led_past(hand, &tasks[at.0], at, aside)
    }

    /// Returns the task with the approach, the retreat, or both along the hand's own axis, if that adds no penetration.
    fn turned(&self, task: &Task, grasp: usize, hand: usize) -> Vec<Task> {
        let Some(grip) = self.grip(hand, task, grasp) else { return Vec::new() };
        let mut made = vec![task.clone()];
        for way in [Leg::Approach, Leg::Retreat] {
            for mut task in made.clone() {
                if turn(&mut task, grasp, &grip, way) {
                    made.push(task);
                }
            }
        }
        let allowed = self.goes_through(hand, task, grasp);
        made.into_iter().skip(1).filter(|task| self.goes_through(hand, task, grasp) <= allowed).collect()
    }
}
