//! Keeps the two hands of a robot apart where they work at the same time: where the mapped grasps bring hands or arms nearer to each other than they should be,
//! one grasp after the other is chosen anew.
//!
//! Both hands go through their tasks by inverse kinematics alone ([`Walk`]). At the steps at which they are too near, each hand has a grasp: other grasps, with
//! the ways to them and from them as demonstrated and along the hand's own axis, are held against the other hand at those steps first, without the arm; the
//! best of them with the arm and at all steps. What keeps the hands apart best is taken, and the next grasp is looked for, until nothing is too near or nothing
//! better is found. A hand that takes less good a grasp for that has the best measure among those that are apart.

use super::hand_planner::{HandPlanner, TIP_RADIUS_M};
use super::lifted::goes_through;
use super::own_axis::{Way, turn};
use super::resolved_grasp::ResolvedGrasp;
use super::schedule::{HandPlans, groups};
use super::walk::{Near, ROOM_M, Walk};
use crate::base::error::InputError;
use crate::base::hands::Side;
use crate::base::scene::Scene;
use crate::command::{Commands, Task};
use crate::robot::grasp::mapping::{Held, alternatives};
use crate::robot::kinematics::limb_gap::limb_gap;
use crate::robot::model::robot::Robot;
use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

/// At most so many grasps are changed in a group of tasks.
const CHANGES: usize = 6;
/// Alternatives are looked at without the arm at so many of the steps that are too near.
const LOOKED_AT: usize = 12;
/// So many of each hand are looked at with the arm, in so many postures.
const WALKED: usize = 6;
const POSTURES: usize = 3;
/// So many are looked at with other ways.
const WITH_WAYS: usize = 32;
/// A change that leaves more than this share of what was too near is none.
const BETTER: f64 = 0.9;

/// Chooses grasps of commands anew where both hands would be too near to each other.
///
/// # Errors
/// A hand that the robot does not have, an object that the scene does not have.
pub(super) fn keep(commands: &mut Commands, robot: &Robot, scene: &Scene) -> Result<(), InputError> {
    if robot.hands.len() < 2 {
        return Ok(());
    }
    for (number, group) in groups(&commands.tasks).into_iter().enumerate() {
        let tasks: Vec<Task> = group.iter().map(|task| commands.tasks[*task].clone()).collect();
        let Some(mut pair) = Pair::new(tasks, robot, scene)? else { continue };
        let changed = pair.keep_apart()?;
        if !changed {
            continue;
        }
        for (task, made) in group.into_iter().zip(&pair.tasks) {
            commands.tasks[task] = made.clone();
        }
        // Later groups begin where the hands are.
        for walk in pair.walks.iter().filter(|_| number == 0) {
            let first = commands.tasks.iter_mut().find(|task| task.track == walk.planner.side);
            let mapped = first.and_then(|task| task.grasps.first_mut()).and_then(|grasp| grasp.mapped.as_mut());
            mapped.into_iter().for_each(|mapped| mapped.arm.clone_from(&walk.arm));
        }
    }
    Ok(())
}

/// Two hands in a group of tasks.
struct Pair<'a> {
    robot: &'a Robot,
    scene: &'a Scene,
    tasks: Vec<Task>,
    walks: [Walk; 2],
    limbs: [Robot; 2],
    near: Vec<Near>,
    /// Other ways to take hold for the grasps that were looked at, by task and grasp.
    alternatives: BTreeMap<(usize, usize), Vec<Held>>,
}

/// Tasks with a grasp of a hand chosen anew.
struct Choice {
    tasks: Vec<Task>,
    /// How much of the hand is too near, m, at the steps that were looked at.
    near: f64,
    measure: f64,
}

/// A grasp of a hand that is changed.
struct Change {
    hand: usize,
    /// What stays too near, m in all.
    left: f64,
    measure: f64,
    walk: Walk,
    tasks: Vec<Task>,
    near: Vec<Near>,
}

impl<'a> Pair<'a> {
    /// `None` where not both hands have something to do, or where one of them cannot do it: that is refused later, with its reason.
    fn new(tasks: Vec<Task>, robot: &'a Robot, scene: &'a Scene) -> Result<Option<Self>, InputError> {
        let of = |side: Side| tasks.iter().position(|task| task.track == side);
        let [Some(left), Some(right)] = [Side::Left, Side::Right].map(of) else { return Ok(None) };
        let walk = |number: usize| Walk::all(&tasks, number, robot, scene, 1).ok()?.into_iter().next();
        let [Some(one), Some(other)] = [walk(left), walk(right)] else { return Ok(None) };
        let limbs = [robot.limb(Side::Left)?, robot.limb(Side::Right)?];
        let near = one.near(&other, ROOM_M);
        Ok(Some(Self { robot, scene, walks: [one, other], limbs, near, tasks, alternatives: BTreeMap::new() }))
    }

    /// Whether anything was changed.
    fn keep_apart(&mut self) -> Result<bool, InputError> {
        let mut changed = false;
        for _ in 0..CHANGES {
            let before = total(&self.near);
            if before == 0.0 {
                break;
            }
            let changes = [self.change(0)?, self.change(1)?];
            let better = |a: &Change, b: &Change| (a.left, -a.measure).partial_cmp(&(b.left, -b.measure));
            let best = changes.into_iter().flatten().min_by(|a, b| better(a, b).unwrap_or(Ordering::Equal));
            let Some(best) = best.filter(|change| change.left < BETTER * before) else { break };
            self.walks[best.hand] = best.walk;
            (self.tasks, self.near, changed) = (best.tasks, best.near, true);
        }
        Ok(changed)
    }

    /// The best change of a grasp of a hand, the first one that leaves nothing too near.
    fn change(&mut self, hand: usize) -> Result<Option<Change>, InputError> {
        let mut best: Option<Change> = None;
        let choices = self.choices(hand)?;
        for Choice { tasks, measure, .. } in choices {
            let number = tasks.iter().position(|task| task.track == self.walks[hand].planner.side).unwrap_or(0);
            let walks = Walk::all(&tasks, number, self.robot, self.scene, POSTURES).unwrap_or_default();
            for walk in walks {
                let other = &self.walks[1 - hand];
                let near = if hand == 0 { walk.near(other, ROOM_M) } else { other.near(&walk, ROOM_M) };
                let left = total(&near);
                if best.as_ref().is_none_or(|best| left < best.left) {
                    best = Some(Change { hand, left, measure, walk, tasks: tasks.clone(), near });
                }
                if left == 0.0 {
                    return Ok(best);
                }
            }
        }
        Ok(best)
    }

    /// Tasks with other grasps of a hand where it is too near to the other one, those first that are least so.
    fn choices(&mut self, hand: usize) -> Result<Vec<Choice>, InputError> {
        let Some((number, grasp)) = self.at(hand, &self.tasks) else { return Ok(Vec::new()) };
        if let Entry::Vacant(entry) = self.alternatives.entry((number, grasp)) {
            entry.insert(alternatives(&self.tasks, self.robot, self.scene, (number, grasp))?);
        }
        let others = &self.alternatives[&(number, grasp)];
        let step = self.near.len().div_ceil(LOOKED_AT).max(1);
        let looked_at: Vec<&Near> = self.near.iter().step_by(step).collect();
        let choice = |tasks: Vec<Task>| {
            let near = self.nearness(hand, &tasks, &looked_at)?;
            let measure = tasks[number].grasps[grasp].mapped.as_ref().map_or(0.0, |mapped| mapped.measure);
            Some(Choice { tasks, near, measure })
        };
        let sort = |choices: &mut Vec<Choice>| {
            choices.sort_by(|a, b| a.near.total_cmp(&b.near).then(b.measure.total_cmp(&a.measure)));
        };
        let with = |held: Option<&Held>| {
            let mut tasks = self.tasks.clone();
            held.into_iter().for_each(|held| held.clone().note(&mut tasks[number], grasp));
            tasks
        };
        let present = std::iter::once(None).chain(others.iter().map(Some));
        let mut choices: Vec<Choice> = present.filter_map(|held| choice(with(held))).collect();
        sort(&mut choices);
        choices.truncate(WITH_WAYS);
        let turned = choices.iter().flat_map(|it| self.turned(&it.tasks, number, grasp, hand));
        let turned: Vec<Choice> = turned.filter_map(choice).collect();
        choices.extend(turned);
        sort(&mut choices);
        // What takes hold or lets go on worse a way than before drags the object along.
        let allowed = self.goes_through(hand, &self.tasks[number], grasp);
        let as_good = |it: &Choice| self.goes_through(hand, &it.tasks[number], grasp) <= allowed;
        Ok(choices.into_iter().filter(as_good).take(WALKED).collect())
    }

    /// At how many places on its ways a hand goes through the object or a fixed body.
    fn goes_through(&self, hand: usize, task: &Task, grasp: usize) -> usize {
        let model = &self.walks[hand].planner.hand;
        let Some(object) = self.scene.bodies.get(&task.object) else { return 0 };
        let grip = self.grip(hand, task, grasp);
        grip.map_or(usize::MAX, |grip| goes_through(task, grasp, model, &grip, object, self.scene))
    }

    /// A grasp of a task of a hand.
    fn grip(&self, hand: usize, task: &Task, grasp: usize) -> Option<ResolvedGrasp> {
        let radius = self.scene.hands.get(&task.track).map_or(TIP_RADIUS_M, |hand| hand.tip_radius.0);
        ResolvedGrasp::new(&task.grasps[grasp], &self.limbs[hand], &self.walks[hand].planner.hand, radius).ok()
    }

    /// The same tasks with the ways to a grasp and from it along the hand's own axis: one of them, or both.
    fn turned(&self, tasks: &[Task], number: usize, grasp: usize, hand: usize) -> Vec<Vec<Task>> {
        let Some(grip) = self.grip(hand, &tasks[number], grasp) else { return Vec::new() };
        let mut made = vec![tasks.to_vec()];
        for way in [Way::There, Way::Away] {
            for mut tasks in made.clone() {
                if turn(&mut tasks[number], grasp, &grip, way) {
                    made.push(tasks);
                }
            }
        }
        made.split_off(1)
    }

    /// The task of a hand and its grasp where it is too near for the longest time.
    fn at(&self, hand: usize, tasks: &[Task]) -> Option<(usize, usize)> {
        let walk = &self.walks[hand];
        let made = self.plans(walk, hand, tasks)?;
        let mut counts: Vec<((usize, usize), f64)> = Vec::new();
        for near in &self.near {
            let (number, plan, own_s) = plan_at(&made, walk.own_s(near.steps[hand]))?;
            let at = (number, plan.grasp(own_s));
            match counts.iter_mut().find(|(known, _)| *known == at) {
                Some((_, by)) => *by += near.by,
                None => counts.push((at, near.by)),
            }
        }
        counts.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(at, _)| at)
    }

    fn plans<'t>(&self, walk: &Walk, hand: usize, tasks: &'t [Task]) -> Option<HandPlans<'t>> {
        let place = |object: &str| {
            let first = tasks.iter().find(|task| task.object == object).map(Task::taken_at);
            first.or_else(|| self.scene.bodies.get(object).map(|body| body.pose()))
        };
        let group: Vec<usize> = (0..tasks.len()).collect();
        let mut planner: HandPlanner = walk.planner.clone();
        let palm = nalgebra::Isometry3::identity();
        planner.plans(tasks, &group, &self.limbs[hand], palm, &place, &mut |_, from_s| from_s).ok()
    }

    /// How much nearer than it should be a hand with these tasks is to the other one at some steps, m in all, without its arm; `None` for tasks that cannot be
    /// planned.
    fn nearness(&self, hand: usize, tasks: &[Task], steps: &[&Near]) -> Option<f64> {
        let walk = &self.walks[hand];
        let made = self.plans(walk, hand, tasks)?;
        let mut near = 0.0;
        for step in steps {
            let (_, plan, own_s) = plan_at(&made, walk.own_s(step.steps[hand]))?;
            let own = plan.at(own_s).shapes(&walk.planner.hand);
            let other = self.walks[1 - hand].at(step.steps[1 - hand]);
            near += limb_gap(&own, other, ROOM_M).map_or(0.0, |found| ROOM_M - found.gap);
        }
        Some(near)
    }
}

/// What is too near, m in all.
fn total(near: &[Near]) -> f64 {
    near.iter().map(|near| near.by).sum()
}

/// The plan at a time of all, s, the number of its task, and the time in it.
fn plan_at<'p, 't>(made: &'p HandPlans<'t>, mut own_s: f64) -> Option<(usize, &'p super::plan::Plan<'t>, f64)> {
    let last = made.plans.len().checked_sub(1)?;
    for (index, (number, plan)) in made.plans.iter().enumerate() {
        if own_s <= plan.duration() || index == last {
            return Some((*number, plan, own_s.min(plan.duration())));
        }
        own_s -= plan.duration();
    }
    None
}
