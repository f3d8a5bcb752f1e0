//! Keeps the two hands of a robot apart where they work at the same time: where the mapped grasps bring hands or arms nearer to each other than they should be,
//! two grasps at a time are chosen anew, with their ways.
//!
//! Both hands go through their tasks by inverse kinematics alone ([`Walk`]). Where they are too near, each hand has a grasp, and the ways of both are led past each
//! other or begun later; then one hand waits for the other one, and fingers open by less. Where that is not enough, other grasps of both, and of what goes into a
//! hole also those that are turned about it, are held against each other at some of the steps at which both hold, first the hands alone, then with their arms in
//! every posture. The best pairs go all their ways, in the same manner. What keeps the hands apart best is taken, and the next pair of grasps is looked for, until
//! nothing is too near or nothing better is found.

use super::beside::{Aside, Passing};
use super::change::Change;
use super::couple::{Couple, of_many_kinds};
use super::hand_planner::{HandPlanner, tip_radius};
use super::in_hole;
use super::late_start::begun_late;
use super::lifted::{goes_through, lift};
use super::moving::Moving;
use super::own_axis::{Way, turn};
use super::precedence::orders;
use super::resolved_grasp::ResolvedGrasp;
use super::schedule::{HandPlans, groups};
use super::walk::{Crossing, HandledObject, Near, Occupied, Walk, place_of, too_near, total};
use crate::grasp::task_grasps::{Alternatives, TaskGrasp};
use crate::kinematics::surroundings::{SUNK_M, Surroundings};
use crate::model::robot::Robot;
use crate::parallel;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::scene::Scene;
use teachtree_command::{Commands, Task};

/// At most so many changes are tried in a group of tasks, and so many of one pair of grasps.
const CHANGES: usize = 8;
const TRIES: usize = 3;
/// Pairs are looked at at so many of the steps at which both hands hold, and at so many of those among them that are too near.
const LOOKED_AT: usize = 8;
const TIGHT: usize = 12;
/// What goes into a hole is turned by multiples of this part of a turn.
const TURNS: u32 = 12;
/// So many samples of commands are kept for choices of a grasp in all.
const MOST_SAMPLES: usize = 1_500_000;
/// Of each grasp so many pairs are kept.
const ALIKE: usize = 16;
/// Hands that are nearer by no more than this in all, m, may be taken where the present ones are farther.
const SLIGHT_M: f64 = 0.02;
/// For each place on its ways, and each step, at which a grasp goes through more than the present one does, it counts as nearer by this, m.
const THROUGH_M: f64 = 0.002;
/// So many grasps are looked at with their arms, those of so many pairs at once, until so many pairs are as good as apart, by this, m in all.
const WALKED: usize = 80;
const AT_ONCE: usize = 8;
const ENOUGH: usize = 4;
const AS_GOOD_M: f64 = 0.01;
/// So many pairs go all their ways, two at once, each grasp in so many of them, until one is as good as clear.
const GONE: usize = 6;
const GONE_AT_ONCE: usize = 2;
const GONE_ALIKE: usize = 2;
/// A pair is as good as clear that is too near by less than this, m, summed over steps of 20 ms, at each of which 5 mm count where hands just touch.
const CLEAR_M: f64 = 0.05;
/// The first way of a hand is left out in so many parts.
const LATE: u32 = 4;
/// Fingers that have no room to open as far as usual open by one of these, m.
const OPENS_M: [f64; 3] = [0.012, 0.008, 0.005];
/// So many ways are gone before or after what the other hand does meanwhile.
const WAITS: usize = 4;
/// A change that leaves more than this share of what was too near is none.
const BETTER: f64 = 0.9;

/// A grasp of each hand, as its task and the grasp of that.
type Grasps = [(usize, usize); 2];

/// Chooses grasps of commands anew where both hands would be too near to each other. Returns where they go through each other all the same. `progress` receives the
/// part that is done, 0 to 1.
///
/// # Errors
/// A hand that the robot does not have, an object that the scene does not have.
pub(super) fn keep(
    commands: &mut Commands,
    robot: &Robot,
    scene: &Scene,
    others: &Alternatives<'_>,
    progress: &mut dyn FnMut(f64),
) -> Result<Vec<Crossing>, InputError> {
    let mut crossings = Vec::new();
    if robot.hands.len() < 2 {
        return Ok(crossings);
    }
    let groups = groups(&commands.tasks);
    let count = groups.len() as f64;
    for (number, group) in groups.into_iter().enumerate() {
        let tasks: Vec<Task> = group.iter().map(|task| commands.tasks[*task].clone()).collect();
        let of_others = commands.tasks.iter().enumerate().filter(|(other, _)| !group.contains(other));
        let elsewhere = of_others.map(|(_, task)| task.object.clone()).collect();
        let alternatives = GroupAlternatives { group: &group, others };
        let Some(mut pair) = Pair::new(tasks, robot, scene, alternatives, elsewhere, number == 0)? else { continue };
        let changed = pair.keep_apart(&mut |part| progress((number as f64 + part) / count))?;
        crossings.extend(pair.walks[0].crossing(&pair.walks[1], &pair.near, &group));
        if !changed {
            continue;
        }
        for (task, made) in group.iter().zip(&pair.tasks) {
            commands.tasks[*task] = made.clone();
        }
        // Later groups begin where the hands are.
        if number > 0 {
            continue;
        }
        for walk in &pair.walks {
            let first = commands.tasks.iter_mut().find(|task| task.track == walk.planner.side);
            let mapped = first.and_then(|task| task.grasps.first_mut()).and_then(|grasp| grasp.mapped.as_mut());
            mapped.into_iter().for_each(|mapped| mapped.arm.clone_from(&walk.arm));
        }
    }
    Ok(crossings)
}

/// The alternatives of grasps of a group, whose tasks have these numbers among all tasks.
#[derive(Clone, Copy)]
struct GroupAlternatives<'a> {
    group: &'a [usize],
    others: &'a Alternatives<'a>,
}

/// Two hands in a group of tasks.
struct Pair<'a> {
    robot: &'a Robot,
    scene: &'a Scene,
    alternatives: GroupAlternatives<'a>,
    tasks: Vec<Task>,
    walks: [Walk; 2],
    limbs: [Robot; 2],
    near: Vec<Near>,
    /// The objects of tasks of other groups, before and after.
    elsewhere: BTreeSet<String>,
    /// Whether the hands begin with these tasks: their postures are free then, and otherwise the best ones are taken to be theirs.
    begins: bool,
}

/// A task with one of its grasps chosen anew.
struct Choice {
    task: Task,
    measure: f64,
    /// The hand, without its arm, at each of the steps that are looked at.
    stands: Vec<Occupied>,
}

impl<'a> Pair<'a> {
    /// `None` where not both hands have something to do, or where one of them cannot do it: that is refused later, with its reason.
    fn new(
        tasks: Vec<Task>,
        robot: &'a Robot,
        scene: &'a Scene,
        alternatives: GroupAlternatives<'a>,
        elsewhere: BTreeSet<String>,
        begins: bool,
    ) -> Result<Option<Self>, InputError> {
        let of = |side: Side| tasks.iter().position(|task| task.track == side);
        let [Some(left), Some(right)] = [Side::Left, Side::Right].map(of) else { return Ok(None) };
        let walk = |number: usize| Walk::all(&tasks, number, robot, scene, 1).ok()?.into_iter().next();
        let [Some(one), Some(other)] = [walk(left), walk(right)] else { return Ok(None) };
        let limbs = [robot.limb(Side::Left)?, robot.limb(Side::Right)?];
        let near = one.near(&other);
        Ok(Some(Self { robot, scene, alternatives, walks: [one, other], limbs, near, tasks, elsewhere, begins }))
    }

    /// Whether anything was changed.
    fn keep_apart(&mut self, progress: &mut dyn FnMut(f64)) -> Result<bool, InputError> {
        let mut tries: BTreeMap<Grasps, usize> = BTreeMap::new();
        let mut changed = false;
        for step in 0..CHANGES {
            progress(step as f64 / CHANGES as f64);
            let Some(grasps) = self.nearest(&tries) else { break };
            let before = total(&self.near);
            // They are led past each other, then chosen anew if that is not enough, and led past each other again.
            let tried = tries.entry(grasps).or_default();
            *tried += 1;
            let anew = *tried == 2;
            if anew && before < CLEAR_M {
                *tried = TRIES;
                continue;
            }
            let change = self.change(grasps, anew)?.filter(|change| change.cost() < BETTER * before);
            let Some(Change { tasks, walks, near, .. }) = change else {
                if anew {
                    tries.insert(grasps, TRIES);
                }
                continue;
            };
            for (task, (number, _)) in tasks.into_iter().zip(grasps) {
                self.tasks[number] = task;
            }
            (self.walks, self.near, changed) = (walks, near, true);
        }
        Ok(changed)
    }

    /// The grasps of both hands that are too near by most, of those that were not tried often enough.
    fn nearest(&self, tries: &BTreeMap<Grasps, usize>) -> Option<Grasps> {
        let plans = self.both_plans(&self.tasks, &self.walks)?;
        let mut sums: BTreeMap<Grasps, f64> = BTreeMap::new();
        for near in &self.near {
            *sums.entry(self.grasps_at(&plans, near.steps)?).or_default() += near.by;
        }
        let left = sums.into_iter().filter(|(grasps, _)| tries.get(grasps).is_none_or(|tries| *tries < TRIES));
        left.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(grasps, _)| grasps)
    }

    /// The grasp of each hand at a step of each.
    fn grasps_at(&self, plans: &[HandPlans<'_>; 2], steps: [usize; 2]) -> Option<Grasps> {
        let at = |hand: usize| {
            let (number, plan, own_s) = plans[hand].at(self.walks[hand].own_s(steps[hand]))?;
            Some((number, plan.grasp(own_s)))
        };
        Some([at(0)?, at(1)?])
    }

    /// The best change of a pair of grasps, or of the ways of the present ones; `None` where there is none.
    fn change(&self, grasps: Grasps, anew: bool) -> Result<Option<Change>, InputError> {
        let Some(steps) = self.steps(grasps) else { return Ok(None) };
        let choices = [self.choices(0, grasps[0], &steps, anew)?, self.choices(1, grasps[1], &steps, anew)?];
        let mut best: Option<Change> = None;
        let couples: Vec<Couple> = of_many_kinds(self.with_arms(grasps, &steps, &choices), GONE_ALIKE);
        for couples in couples[..couples.len().min(GONE)].chunks(GONE_AT_ONCE) {
            let changes = parallel::each(couples, |couple| {
                let tasks = [0, 1].map(|hand| choices[hand][couple.choices[hand]].task.clone());
                self.gone(grasps, tasks, couple)
            });
            for change in changes.into_iter().flatten() {
                if best.as_ref().is_none_or(|best| change.cost() < best.cost()) {
                    best = Some(change);
                }
            }
            if best.as_ref().is_some_and(|best| best.cost() < CLEAR_M) {
                break;
            }
        }
        Ok(best)
    }

    /// Some of the steps at which both hands hold with these grasps, those first that are too near.
    fn steps(&self, grasps: Grasps) -> Option<Vec<[usize; 2]>> {
        let plans = self.both_plans(&self.tasks, &self.walks)?;
        let holds = |hand: usize, step: usize| {
            plans[hand].at(self.walks[hand].own_s(step)).is_some_and(|(_, plan, own_s)| plan.holds(own_s))
        };
        let both_hold = |steps: &[usize; 2]| {
            (0..2).all(|hand| holds(hand, steps[hand])) && self.grasps_at(&plans, *steps) == Some(grasps)
        };
        let held: Vec<[usize; 2]> = self.walks[0].together(&self.walks[1]).into_iter().filter(both_hold).collect();
        let near: BTreeSet<[usize; 2]> = self.near.iter().map(|near| near.steps).collect();
        let tight: Vec<[usize; 2]> = held.iter().filter(|steps| near.contains(*steps)).copied().collect();
        let some = |steps: &[[usize; 2]], most: usize| -> Vec<[usize; 2]> {
            steps.iter().step_by(steps.len().div_ceil(most).max(1)).copied().collect()
        };
        Some([some(&tight, TIGHT), some(&held, LOOKED_AT)].concat())
    }

    /// The present grasp of a task and, if they are to be chosen anew, others, each also with the object turned about the hole into which it goes.
    fn choices(
        &self,
        hand: usize,
        (number, grasp): (usize, usize),
        steps: &[[usize; 2]],
        anew: bool,
    ) -> Result<Vec<Choice>, InputError> {
        let present = &self.tasks[number];
        let noted = |held: TaskGrasp| {
            let mut task = present.clone();
            held.note(&mut task, grasp);
            self.lifted(hand, task)
        };
        let GroupAlternatives { group, others } = self.alternatives;
        let others = if anew { others.of(present, (group[number], grasp))? } else { &[] };
        // Long tasks leave room for fewer of them.
        let samples: usize = present.segments.iter().map(|segment| segment.object.len()).sum();
        let most = (MOST_SAMPLES / samples.max(1)).max(TURNS as usize);
        let upright = std::iter::once(present.clone()).chain(others.iter().cloned().map(noted));
        let upright: Vec<Task> = upright.take(most).collect();
        let may_turn = anew && !self.elsewhere.contains(&present.object);
        let angles = (1..TURNS).filter(|_| may_turn).map(|turn| f64::from(turn) / f64::from(TURNS) * TAU);
        let angles = angles.map(|angle| if angle > TAU / 2.0 { angle - TAU } else { angle });
        let turned: Vec<Task> = angles
            .flat_map(|angle| upright.iter().take(most / TURNS as usize).map(move |task| (angle, task)))
            .filter_map(|(angle, task)| in_hole::turned(&self.with(&[(number, task)]), number, self.scene, angle))
            .collect();
        let choice = |task: &Task| {
            let tasks = self.with(&[(number, task)]);
            let plans = self.plans(hand, &tasks, &self.walks[hand])?;
            let object = HandledObject::of(&tasks, number, self.scene);
            let stands = steps.iter().filter_map(|steps| {
                let (_, plan, own_s) = plans.at(self.walks[hand].own_s(steps[hand]))?;
                Some(Occupied::of_hand(&self.walks[hand].planner.hand, plan, own_s, &object))
            });
            let measure = task.grasps[grasp].mapped.as_ref().map_or(0.0, |mapped| mapped.measure);
            Some((measure, stands.collect::<Vec<Occupied>>()))
        };
        let all: Vec<Task> = upright.into_iter().chain(turned).collect();
        let made = parallel::each(&all, choice);
        let made = all.into_iter().zip(made).filter_map(|(task, made)| Some((task, made?)));
        Ok(made.map(|(task, (measure, stands))| Choice { task, measure, stands }).collect())
    }

    /// The best pairs of choices where hands alone are looked at, no nearer than the present limbs; each choice is in few of them. What takes hold or lets go on
    /// worse a way than the present grasp would drag the object along, and comes later.
    fn couples(&self, grasps: Grasps, steps: &[[usize; 2]], choices: &[Vec<Choice>; 2]) -> Vec<Couple> {
        let [Some(one), Some(other)] = [0, 1].map(|hand| choices[hand].first()) else { return Vec::new() };
        // Where only the arms are too near, hands may be nearer than now.
        let hands = too_near(&one.stands, &other.stands, f64::INFINITY).unwrap_or(f64::INFINITY);
        let limbs = |steps: &[usize; 2]| self.walks[0].at(steps[0]).too_near(self.walks[1].at(steps[1]));
        let present = hands.max(steps.iter().map(limbs).sum()).max(SLIGHT_M);
        let fixed = Surroundings::sunk(self.scene, SUNK_M);
        let through = [0, 1].map(|hand| {
            let counts = parallel::each(&choices[hand], |it| {
                let meets = it.stands.iter().filter(|stand| fixed.meet_any(&stand.limb)).count();
                self.goes_through(hand, &it.task, grasps[hand].1).saturating_add(meets)
            });
            let allowed = counts.first().copied().unwrap_or(0);
            counts.into_iter().map(|count| count.saturating_sub(allowed) as f64 * THROUGH_M).collect::<Vec<f64>>()
        });
        let ones: Vec<usize> = (0..choices[0].len()).collect();
        let couples = parallel::each(&ones, |&one| {
            let mut couples: Vec<Couple> = Vec::new();
            let mut most = present;
            for (other, right) in choices[1].iter().enumerate() {
                let left = &choices[0][one];
                let (through, measure) = (through[0][one] + through[1][other], left.measure * right.measure);
                let Some(left) = too_near(&left.stands, &right.stands, most - through) else { continue };
                let choices = [one, other];
                couples.push(Couple { choices, left: left + through, through, measure, postures: [0; 2] });
                if couples.len() == 2 * ALIKE {
                    couples.sort_by(Couple::order);
                    couples.truncate(ALIKE);
                    most = couples.last().map_or(most, |last| last.left);
                }
            }
            couples
        });
        of_many_kinds(couples.into_iter().flatten().collect(), ALIKE)
    }

    /// Pairs of choices that both arms can go, with what is too near in their best postures.
    fn with_arms(&self, grasps: Grasps, steps: &[[usize; 2]], choices: &[Vec<Choice>; 2]) -> Vec<Couple> {
        // For each choice, the limb at the steps, in every posture.
        let mut limbs: BTreeMap<(usize, usize), Vec<Option<Vec<Occupied>>>> = BTreeMap::new();
        let mut reached: Vec<Couple> = Vec::new();
        for couples in self.couples(grasps, steps, choices).chunks(AT_ONCE) {
            let new = couples.iter().flat_map(|couple| [0, 1].map(|hand| (hand, couple.choices[hand])));
            let new: BTreeSet<(usize, usize)> = new.filter(|choice| !limbs.contains_key(choice)).collect();
            let new: Vec<(usize, usize)> = new.into_iter().take(WALKED.saturating_sub(limbs.len())).collect();
            let gone = parallel::each(&new, |&(hand, choice)| {
                let tasks = self.with(&[(grasps[hand].0, &choices[hand][choice].task)]);
                let times: Vec<f64> = steps.iter().map(|steps| self.walks[hand].own_s(steps[hand])).collect();
                let begun = self.begun(hand, &tasks).into_iter();
                begun.map(|begun| Walk::stands(begun, &tasks, self.scene, &times)).collect()
            });
            limbs.extend(new.into_iter().zip(gone));
            for couple in couples {
                let own = [0, 1].map(|hand| limbs.get(&(hand, couple.choices[hand])));
                let [Some(ours), Some(theirs)] = own else { continue };
                let mut best = Couple { left: f64::INFINITY, ..*couple };
                for (one, ours) in ours.iter().enumerate().filter_map(|(at, it)| Some((at, it.as_ref()?))) {
                    for (other, theirs) in theirs.iter().enumerate().filter_map(|(at, it)| Some((at, it.as_ref()?))) {
                        if let Some(left) = too_near(ours, theirs, best.left).filter(|left| *left < best.left) {
                            (best.left, best.postures) = (left, [one, other]);
                        }
                    }
                }
                if best.left.is_finite() {
                    best.left += couple.through;
                    reached.push(best);
                }
            }
            let apart = reached.iter().filter(|couple| couple.left <= AS_GOOD_M).count();
            if apart >= ENOUGH || limbs.len() >= WALKED {
                break;
            }
        }
        reached
    }

    /// What is left too near when both hands go all their ways with these tasks, from these postures, and are led past each other; `None` where an arm cannot go.
    fn gone(&self, grasps: Grasps, tasks: [Task; 2], couple: &Couple) -> Option<Change> {
        let all = |tasks: &[Task; 2]| self.with(&[(grasps[0].0, &tasks[0]), (grasps[1].0, &tasks[1])]);
        let walk = |hand: usize| {
            let begun = self.begun(hand, &all(&tasks)).into_iter().nth(couple.postures[hand])?;
            Walk::of(begun, &all(&tasks), self.scene)
        };
        let walks = [walk(0)?, walk(1)?];
        let near = walks[0].near(&walks[1]);
        let mut change = Change { tasks, walks, near, through: couple.through };
        let beginning = [1, 0].into_iter().filter(|hand| self.is_first(grasps[*hand].0));
        for (hand, part) in beginning.flat_map(|hand| (1..=LATE).map(move |part| (hand, part))) {
            if change.near.is_empty() {
                return Some(change);
            }
            if let Some(late) = begun_late(&change.tasks[hand], f64::from(part) / f64::from(LATE)) {
                self.take(grasps, hand, late, &mut change);
            }
        }
        for hand in [1, 0] {
            for aside in [Aside::Level, Aside::Upward] {
                let allowed = self.goes_through(hand, &change.tasks[hand], grasps[hand].1);
                let led = self.led_past(hand, grasps[hand], &all(&change.tasks), &change.walks, aside);
                let led = led.filter(|task| self.goes_through(hand, task, grasps[hand].1) <= allowed);
                let turned = self.turned(&change.tasks[hand], grasps[hand].1, hand);
                for task in led.into_iter().chain(turned.into_iter().filter(|_| aside == Aside::Upward)) {
                    if change.near.is_empty() {
                        return Some(change);
                    }
                    self.take(grasps, hand, task, &mut change);
                }
            }
        }
        self.let_wait(grasps, &mut change);
        for (hand, opens) in [1, 0].into_iter().flat_map(|hand| OPENS_M.map(|opens| (hand, opens))) {
            if change.near.is_empty() {
                return Some(change);
            }
            // What the other hand holds is not exactly where it is expected.
            let mut task = change.tasks[hand].clone();
            if self.others(&task).any(|other| other.object == task.object) {
                continue;
            }
            let allowed = self.goes_through(hand, &task, grasps[hand].1);
            let Some(mapped) = task.grasps[grasps[hand].1].mapped.as_mut() else { continue };
            mapped.opens = Some(opens);
            if self.goes_through(hand, &task, grasps[hand].1) <= allowed {
                self.take(grasps, hand, task, &mut change);
            }
        }
        for hand in [1, 0] {
            if !change.near.is_empty() {
                let tasks = change.tasks.clone();
                change.take_nearest(hand, self.begun(hand, &all(&tasks)), &tasks, &all(&tasks), self.scene);
            }
        }
        Some(change)
    }

    /// Takes a task of a hand that begins as now, where that leaves less too near.
    fn take(&self, grasps: Grasps, hand: usize, task: Task, change: &mut Change) {
        let mut tasks = change.tasks.clone();
        tasks[hand] = task;
        let all = self.with(&[(grasps[0].0, &tasks[0]), (grasps[1].0, &tasks[1])]);
        let as_now = self.begun_like(hand, &all, &change.walks[hand]);
        change.take_nearest(hand, as_now, &tasks, &all, self.scene);
    }

    /// Lets one hand wait for the other on ways without the object, where that helps.
    fn let_wait(&self, grasps: Grasps, change: &mut Change) {
        for _ in 0..WAITS {
            let before = total(&change.near);
            let mut best: Option<(usize, Task, Walk, Vec<Near>)> = None;
            for (hand, task) in change.tasks.iter().enumerate().filter(|_| before > 0.0) {
                let shared = self.others(task).any(|other| self.belong_together(&task.object, &other.object));
                let mut tasks = self.with(&[(grasps[1 - hand].0, &change.tasks[1 - hand]), (grasps[hand].0, task)]);
                for (way, precedence) in orders(task, shared) {
                    let own = &mut tasks[grasps[hand].0].segments[way.clone()];
                    own.iter_mut().for_each(|segment| segment.precedence = Some(precedence));
                    if let Some(plans) = self.plans(hand, &tasks, &change.walks[hand]) {
                        let walk = change.walks[hand].at_times_of(&plans);
                        let near = walk.near_to(&change.walks[1 - hand], hand);
                        let least = best.as_ref().map_or(BETTER * before, |best| total(&best.3));
                        if total(&near) < least {
                            best = Some((hand, tasks[grasps[hand].0].clone(), walk, near));
                        }
                    }
                    tasks[grasps[hand].0].segments[way.clone()].clone_from_slice(&task.segments[way]);
                }
            }
            let Some((hand, task, walk, near)) = best else { return };
            (change.tasks[hand], change.walks[hand], change.near) = (task, walk, near);
        }
    }

    /// The task of a grasp of a hand, of all tasks, with its ways led past the other hand.
    fn led_past(
        &self,
        hand: usize,
        at: (usize, usize),
        tasks: &[Task],
        walks: &[Walk; 2],
        aside: Aside,
    ) -> Option<Task> {
        let plans = self.both_plans(tasks, walks)?;
        let passing = Passing { walks: walks.each_ref(), plans: plans.each_ref(), up: self.scene.up() };
        passing.led_past(hand, &tasks[at.0], at, aside)
    }

    /// All tasks, some of them exchanged.
    fn with(&self, exchanged: &[(usize, &Task)]) -> Vec<Task> {
        let mut tasks = self.tasks.clone();
        exchanged.iter().for_each(|(number, task)| tasks[*number] = (*task).clone());
        tasks
    }

    /// A hand before its walks, in all postures in which its arm can begin.
    fn begun(&self, hand: usize, tasks: &[Task]) -> Vec<Moving> {
        let side = self.walks[hand].planner.side;
        let number = tasks.iter().position(|task| task.track == side).unwrap_or(0);
        let mut begun = Walk::begun(tasks, number, self.robot, self.scene).unwrap_or_default();
        if !self.begins {
            begun.truncate(1);
        }
        begun
    }

    /// A hand before its walks, in the posture in which its arm can begin that is most like that of a walk.
    fn begun_like(&self, hand: usize, tasks: &[Task], walk: &Walk) -> Option<Moving> {
        let side = walk.planner.side;
        let place = |object: &str| place_of(tasks, self.scene, object);
        let near = Moving::begin_near(side, &self.limbs[hand], tasks, self.scene, &place, &walk.arm);
        near.or_else(|| walk.like(self.begun(hand, tasks)))
    }

    /// The tasks of the other hand.
    fn others(&self, task: &Task) -> impl Iterator<Item = &Task> {
        self.tasks.iter().filter(|other| other.track != task.track)
    }

    /// Whether two objects are the same, or one of them has a hole for the other one, be it in it already or not: what is in it moves with it.
    fn belong_together(&self, one: &str, other: &str) -> bool {
        let takes = |body: &str, object: &str| {
            self.scene.bodies.get(body).is_some_and(|body| body.sockets.values().any(|socket| socket.takes(object)))
        };
        one == other || takes(one, other) || takes(other, one)
    }

    /// Whether a hand begins with a task.
    fn is_first(&self, number: usize) -> bool {
        let of_same = |task: &Task| task.track == self.tasks[number].track;
        self.begins && self.tasks.iter().position(of_same) == Some(number)
    }

    /// A task with the ways of all its grasps lifted.
    fn lifted(&self, hand: usize, mut task: Task) -> Task {
        let grips = (0..task.grasps.len()).map(|grasp| self.grip(hand, &task, grasp)).collect::<Option<Vec<_>>>();
        if let (Some(grips), Some(object)) = (grips, self.scene.bodies.get(&task.object)) {
            lift(&mut task, &self.walks[hand].planner.hand, &grips, object, self.scene);
        }
        task
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
        let radius = tip_radius(self.scene, task.track);
        ResolvedGrasp::new(&task.grasps[grasp], &self.limbs[hand], &self.walks[hand].planner.hand, radius).ok()
    }

    /// The same task with the ways to a grasp and from it along the hand's own axis, one of them or both, where that goes through no more.
    fn turned(&self, task: &Task, grasp: usize, hand: usize) -> Vec<Task> {
        let Some(grip) = self.grip(hand, task, grasp) else { return Vec::new() };
        let mut made = vec![task.clone()];
        for way in [Way::There, Way::Away] {
            for mut task in made.clone() {
                if turn(&mut task, grasp, &grip, way) {
                    made.push(task);
                }
            }
        }
        let allowed = self.goes_through(hand, task, grasp);
        made.into_iter().skip(1).filter(|task| self.goes_through(hand, task, grasp) <= allowed).collect()
    }

    /// The plans of both hands.
    fn both_plans<'t>(&self, tasks: &'t [Task], walks: &[Walk; 2]) -> Option<[HandPlans<'t>; 2]> {
        Some([self.plans(0, tasks, &walks[0])?, self.plans(1, tasks, &walks[1])?])
    }

    /// The plans of a hand that begins as its walk does.
    fn plans<'t>(&self, hand: usize, tasks: &'t [Task], walk: &Walk) -> Option<HandPlans<'t>> {
        let place = |object: &str| place_of(tasks, self.scene, object);
        let group: Vec<usize> = (0..tasks.len()).collect();
        let mut planner: HandPlanner = walk.planner.clone();
        let palm = nalgebra::Isometry3::identity();
        planner.plans(tasks, &group, &self.limbs[hand], palm, &place, &mut |_, from_s| from_s).ok()
    }
}
