//! Keeps the two hands of a robot apart where they work at the same time. Where the mapped grasps bring hands or arms too near to each other, two grasps at a
//! time, one of each hand, are chosen anew with their paths.
//!
//! Both hands follow their tasks by inverse kinematics alone ([`Rollout`]). Where they are too near, the paths of both are first led past each other or begun later;
//! then one hand waits for the other one, and fingers open less. If that is not enough, other grasps of both hands are compared at some of the steps at which
//! both hold an object, or at which they are too near, first with the hands alone, then with their arms in every posture. An object that is inserted into a hole may also be turned about the
//! axis of the hole. The best pairs are checked on their whole paths, with the same changes of paths. The best change is taken, and the next pair of grasps is
//! selected, until nothing is too near or no change is better.

mod paths;

use super::change::{Change, THROUGH_M, cost};
use super::grasp_pair::{Candidate, GraspPair, LimbSteps, best_pairs, of_many_kinds};
use super::hand_planner::{HandPlanner, tip_radius};
use super::insertion_yaw;
use super::lift_over::{goes_through, lift};
use super::moving::{FollowedPath, Moving};
use super::resolved_grasp::ResolvedGrasp;
use super::rollout::{Conflicts, HandledObject, Near, Occupied, Rollout, Unreachable, are_apart, place_of, too_near};
use super::schedule::{HandPlans, groups};
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

/// Maximum number of changes in a group of tasks, and of attempts for one pair of grasps.
const CHANGES: usize = 8;
const TRIES: usize = 3;
/// Numbers of sampled steps at which pairs of grasps are compared: steps at which the limbs are too near, and those at which both hands hold.
const NEAR_STEPS: usize = 12;
const HELD_STEPS: usize = 8;
/// Number of turns that are tried for an object in a hole: multiples of this part of a full turn.
const TURNS: u32 = 12;
/// Maximum number of samples of commands that all choices of a grasp hold together.
const MOST_SAMPLES: usize = 1_500_000;
/// Largest increase of the summed missing distance of hands with which a pair is accepted, m.
const SLIGHT_M: f64 = 0.02;
/// Pairs of grasps are checked with their arms, several at a time, until `ENOUGH` pairs have a summed missing distance of at most `AS_GOOD_M`, m, or
/// `WITH_ARMS` grasps were checked: in `push_together`, arms reach only half of the grasps.
const WITH_ARMS: usize = 160;
const AT_ONCE: usize = 8;
const ENOUGH: usize = 4;
const AS_GOOD_M: f64 = 0.01;
/// Pairs that are checked on their whole paths: their maximum number, the number in parallel, and the maximum number with the same grasp.
const WHOLE_PATHS: usize = 8;
const WHOLE_PATHS_AT_ONCE: usize = 2;
const WHOLE_PATHS_PER_GRASP: usize = 2;
/// Largest share of the missing distance that a change may leave to be accepted.
const BETTER: f64 = 0.9;

/// A grasp of each hand: the index of its task, and of the grasp in the task.
type Grasps = [(usize, usize); 2];

/// For the choices of grasps that were checked with their arms, by hand and index: the hand with its arm at the steps, in each posture; `None` for a posture that
/// cannot follow.
type LimbsOfChoices = BTreeMap<(usize, usize), Vec<Option<LimbSteps>>>;

/// Chooses grasps of commands anew where both hands would be too near to each other. Returns where they still go through each other, and the arms that
/// cannot follow their tasks. `progress` receives the part that is done, 0 to 1.
///
/// # Errors
/// A hand that the robot does not have, an object that the scene does not have.
pub(super) fn keep(
    commands: &mut Commands,
    robot: &Robot,
    scene: &Scene,
    others: &Alternatives<'_>,
    progress: &mut dyn FnMut(f64),
) -> Result<Conflicts, InputError> {
    let mut conflicts = Conflicts::default();
    if robot.hands.len() < 2 {
        return Ok(conflicts);
    }
    let limbs = [robot.limb(Side::Left)?, robot.limb(Side::Right)?];
    let groups = groups(&commands.tasks);
    let count = groups.len() as f64;
    for (number, group) in groups.into_iter().enumerate() {
        let tasks: Vec<Task> = group.iter().map(|task| commands.tasks[*task].clone()).collect();
        let of_others = commands.tasks.iter().enumerate().filter(|(other, _)| !group.contains(other));
        let elsewhere = of_others.map(|(_, task)| task.object.clone()).collect();
        let alternatives = GroupAlternatives { group: &group, others };
        let mut pair = match Pair::new(tasks, (robot, limbs.clone()), scene, alternatives, elsewhere, number == 0) {
            Ok(pair) => pair,
            Err(unreachable) => {
                conflicts.unreachable.extend(unreachable);
                continue;
            }
        };
        let changed = pair.keep_apart(&mut |part| progress((number as f64 + part) / count))?;
        conflicts.crossings.extend(pair.rollouts[0].crossing(&pair.rollouts[1], &pair.near, &group));
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
        for rollout in &pair.rollouts {
            let first = commands.tasks.iter_mut().find(|task| task.track == rollout.planner.side);
            let mapped = first.and_then(|task| task.grasps.first_mut()).and_then(|grasp| grasp.mapped.as_mut());
            mapped.into_iter().for_each(|mapped| mapped.arm.clone_from(&rollout.arm));
        }
    }
    Ok(conflicts)
}

/// The alternatives of the grasps of a group; `group` contains the indices of its tasks among all tasks.
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
    rollouts: [Rollout; 2],
    followed: [FollowedPath; 2],
    limbs: [Robot; 2],
    near: Vec<Near>,
    /// The objects of tasks in other groups.
    elsewhere: BTreeSet<String>,
    /// Whether the hands begin with these tasks. Their postures are free then; otherwise the best postures are assumed.
    begins: bool,
}

/// A task with a new choice of one of its grasps.
struct Choice {
    task: Task,
    measure: f64,
    /// The hand, without its arm, at each sampled step.
    stands: Vec<Occupied>,
}

impl<'a> Pair<'a> {
    /// Returns two hands that follow these tasks.
    ///
    /// # Errors
    /// An arm that cannot follow its tasks; `None` if a hand has no task.
    fn new(
        tasks: Vec<Task>,
        (robot, limbs): (&'a Robot, [Robot; 2]),
        scene: &'a Scene,
        alternatives: GroupAlternatives<'a>,
        elsewhere: BTreeSet<String>,
        begins: bool,
    ) -> Result<Self, Option<Unreachable>> {
        let of = |side: Side| tasks.iter().position(|task| task.track == side).ok_or(None);
        let rollout = |side: Side| {
            let first = Rollout::first(&tasks, of(side)?, robot, scene);
            first.map_err(|why| Some(Unreachable { side, why }))
        };
        of(Side::Right)?;
        let both = parallel::each(&[Side::Left, Side::Right], |side| rollout(*side)).into_iter();
        let [(one, ours), (other, theirs)] =
            both.collect::<Result<Vec<_>, _>>()?.try_into().map_err(|_| None::<Unreachable>)?;
        let (near, rollouts, followed) = (one.near(&other), [one, other], [ours, theirs]);
        Ok(Self { robot, scene, alternatives, rollouts, followed, limbs, near, tasks, elsewhere, begins })
    }

    /// Returns whether anything was changed.
    fn keep_apart(&mut self, progress: &mut dyn FnMut(f64)) -> Result<bool, InputError> {
        let mut tries: BTreeMap<Grasps, usize> = BTreeMap::new();
        let mut changed = false;
        for step in 0..CHANGES {
            progress(step as f64 / CHANGES as f64);
            let Some(grasps) = self.nearest(&tries) else { break };
            let before = cost(&self.near, &self.rollouts);
            // First the paths are led past each other. If that is not enough, grasps are chosen anew and led past each other again.
            let tried = tries.entry(grasps).or_default();
            *tried += 1;
            let anew = *tried == 2;
            if anew && are_apart(&self.near) {
                *tried = TRIES;
                continue;
            }
            let change = self.change(grasps, anew)?.filter(|change| change.cost() < BETTER * before);
            let Some(Change { tasks, rollouts, near, .. }) = change else {
                if anew {
                    tries.insert(grasps, TRIES);
                }
                continue;
            };
            for (task, (number, _)) in tasks.into_iter().zip(grasps) {
                self.tasks[number] = task;
            }
            (self.rollouts, self.near, changed) = (rollouts, near, true);
        }
        Ok(changed)
    }

    /// Returns the grasps of both hands with the largest missing distance among those with attempts left.
    fn nearest(&self, tries: &BTreeMap<Grasps, usize>) -> Option<Grasps> {
        let plans = self.both_plans(&self.tasks, &self.rollouts)?;
        let mut sums: BTreeMap<Grasps, f64> = BTreeMap::new();
        for near in &self.near {
            *sums.entry(self.grasps_at(&plans, near.steps)?).or_default() += near.by;
        }
        let left = sums.into_iter().filter(|(grasps, _)| tries.get(grasps).is_none_or(|tries| *tries < TRIES));
        left.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(grasps, _)| grasps)
    }

    /// Returns the grasp of each hand at its step.
    fn grasps_at(&self, plans: &[HandPlans<'_>; 2], steps: [usize; 2]) -> Option<Grasps> {
        let at = |hand: usize| {
            let (number, plan, own_s) = plans[hand].at(self.rollouts[hand].own_s(steps[hand]))?;
            Some((number, plan.grasp(own_s)))
        };
        Some([at(0)?, at(1)?])
    }

    /// Returns the best change of a pair of grasps, or of the paths of the present grasps; `None` if no change is better. Pairs are compared where both hands hold and,
    /// if no change of these is clear, also where one of them comes or goes.
    fn change(&self, grasps: Grasps, anew: bool) -> Result<Option<Change>, InputError> {
        let mut best: Option<Change> = None;
        for steps in self.steps(grasps).into_iter().flatten().take(if anew { 2 } else { 1 }) {
            let both = parallel::each(&[0, 1], |&hand| self.choices(hand, grasps[hand], &steps, anew));
            let choices = both.into_iter().collect::<Result<Vec<_>, _>>()?;
            let grasp_pairs: Vec<GraspPair> =
                of_many_kinds(self.with_arms(grasps, &steps, &choices), WHOLE_PATHS_PER_GRASP);
            for grasp_pairs in grasp_pairs[..grasp_pairs.len().min(WHOLE_PATHS)].chunks(WHOLE_PATHS_AT_ONCE) {
                let changes = parallel::each(grasp_pairs, |grasp_pair| {
                    let tasks = [0, 1].map(|hand| choices[hand][grasp_pair.choices[hand]].task.clone());
                    self.gone(grasps, tasks, grasp_pair)
                });
                for change in changes.into_iter().flatten() {
                    if best.as_ref().is_none_or(|best| change.cost() < best.cost()) {
                        best = Some(change);
                    }
                }
                if best.as_ref().is_some_and(Change::is_clear) {
                    return Ok(best);
                }
            }
        }
        Ok(best)
    }

    /// Returns two lists of some of the steps at which one hand at least has its grasp of these: those at which both hands hold, where the limbs are too near and
    /// anywhere; and all at which the limbs are too near, with those at which both hands hold.
    fn steps(&self, grasps: Grasps) -> Option<[Vec<[usize; 2]>; 2]> {
        let plans = self.both_plans(&self.tasks, &self.rollouts)?;
        let holds = |hand: usize, step: usize| {
            plans[hand].at(self.rollouts[hand].own_s(step)).is_some_and(|(_, plan, own_s)| plan.holds(own_s))
        };
        let of_these = |steps: &[usize; 2]| {
            self.grasps_at(&plans, *steps).is_some_and(|at| (0..2).any(|hand| at[hand] == grasps[hand]))
        };
        let both_hold = |steps: &[usize; 2]| (0..2).all(|hand| holds(hand, steps[hand])) && of_these(steps);
        let held: Vec<[usize; 2]> =
            self.rollouts[0].together(&self.rollouts[1]).into_iter().filter(both_hold).collect();
        let near: BTreeSet<[usize; 2]> = self.near.iter().map(|near| near.steps).collect();
        let near: Vec<[usize; 2]> = near.into_iter().filter(of_these).collect();
        let tight: Vec<[usize; 2]> = near.iter().copied().filter(both_hold).collect();
        let some = |steps: &[[usize; 2]], most: usize| -> Vec<[usize; 2]> {
            steps.iter().step_by(steps.len().div_ceil(most).max(1)).copied().collect()
        };
        Some([tight, near].map(|near| [some(&near, NEAR_STEPS), some(&held, HELD_STEPS)].concat()))
    }

    /// Returns the present grasp of a task and, with `anew`, other grasps, each also with the object turned about the axis of its hole.
    fn choices(
        &self,
        hand: usize,
        (number, grasp): (usize, usize),
        steps: &[[usize; 2]],
        anew: bool,
    ) -> Result<Vec<Choice>, InputError> {
        let present = &self.tasks[number];
        let noted = |held: &TaskGrasp| {
            let mut task = present.clone();
            held.clone().note(&mut task, grasp);
            self.lifted(hand, task)
        };
        let GroupAlternatives { group, others } = self.alternatives;
        let others = if anew { others.of(present, (group[number], grasp))? } else { &[] };
        // Long tasks allow fewer choices within the limit of samples.
        let samples: usize = present.segments.iter().map(|segment| segment.object.len()).sum();
        let most = (MOST_SAMPLES / samples.max(1)).max(TURNS as usize);
        let mut upright = vec![present.clone()];
        upright.extend(parallel::each(&others[..others.len().min(most - 1)], noted));
        let may_turn = anew && !self.elsewhere.contains(&present.object);
        let angles = (1..TURNS).filter(|_| may_turn).map(|turn| f64::from(turn) / f64::from(TURNS) * TAU);
        let angles = angles.map(|angle| if angle > TAU / 2.0 { angle - TAU } else { angle });
        let turns: Vec<(f64, &Task)> = angles
            .flat_map(|angle| upright.iter().take(most / TURNS as usize).map(move |task| (angle, task)))
            .collect();
        let turned = parallel::each(&turns, |&(angle, task)| {
            insertion_yaw::turned(task, (&self.tasks, number), self.scene, angle)
        });
        let choice = |task: &Task| {
            let tasks = self.with(&[(number, task)]);
            let plans = self.plans(hand, &tasks, &self.rollouts[hand])?;
            let object = HandledObject::of(&tasks, number, self.scene);
            let stands = steps.iter().filter_map(|steps| {
                let (_, plan, own_s) = plans.at(self.rollouts[hand].own_s(steps[hand]))?;
                Some(Occupied::of_hand(&self.rollouts[hand].planner.hand, plan, own_s, &object))
            });
            let measure = task.grasps[grasp].mapped.as_ref().map_or(0.0, |mapped| mapped.measure);
            Some((measure, stands.collect::<Vec<Occupied>>()))
        };
        let all: Vec<Task> = upright.iter().cloned().chain(turned.into_iter().flatten()).collect();
        let made = parallel::each(&all, choice);
        let made = all.into_iter().zip(made).filter_map(|(task, made)| Some((task, made?)));
        Ok(made.map(|(task, (measure, stands))| Choice { task, measure, stands }).collect())
    }

    /// Returns the best pairs of choices by their hands alone, no nearer than the present hands with arms; each choice is in few of them. A choice whose path
    /// penetrates more than that of the present grasp would drag the object along, and is ranked lower. Choices whose limbs are known to reach nothing are left out.
    fn grasp_pairs(
        &self,
        grasps: Grasps,
        steps: &[[usize; 2]],
        choices: &[Vec<Choice>],
        known: &LimbsOfChoices,
    ) -> Vec<GraspPair> {
        let [Some(one), Some(other)] = [0, 1].map(|hand| choices[hand].first()) else { return Vec::new() };
        // If only the arms are too near, hands may come nearer than at present.
        let hands = too_near(one.stands.iter().zip(&other.stands), f64::INFINITY).unwrap_or(f64::INFINITY);
        let limbs =
            |steps: &[usize; 2]| self.rollouts[0].at(steps[0]).too_near(self.rollouts[1].at(steps[1]), f64::INFINITY);
        let present = hands.max(steps.iter().map(limbs).sum()).max(SLIGHT_M);
        let fixed = Surroundings::sunk(self.scene, SUNK_M);
        let through = [0, 1].map(|hand| {
            let counts = parallel::each(&choices[hand], |it| {
                let meets = it.stands.iter().filter(|stand| fixed.meet_any(stand.limb.iter())).count();
                self.goes_through(hand, &it.task, grasps[hand].1).saturating_add(meets)
            });
            let allowed = counts.first().copied().unwrap_or(0);
            let is_out_of_reach =
                |choice: usize| known.get(&(hand, choice)).is_some_and(|it| it.iter().all(Option::is_none));
            let through = |(choice, count): (usize, usize)| {
                if is_out_of_reach(choice) { f64::INFINITY } else { count.saturating_sub(allowed) as f64 * THROUGH_M }
            };
            counts.into_iter().enumerate().map(through).collect::<Vec<f64>>()
        });
        let candidates = [0, 1].map(|hand| {
            let all = choices[hand].iter().zip(&through[hand]);
            all.map(|(choice, through)| Candidate {
                stands: &choice.stands,
                through: *through,
                measure: choice.measure,
            })
            .collect::<Vec<_>>()
        });
        best_pairs(&candidates, present)
    }

    /// Returns the pairs of choices that both arms can follow, with the missing distance in their best postures.
    fn with_arms(&self, grasps: Grasps, steps: &[[usize; 2]], choices: &[Vec<Choice>]) -> Vec<GraspPair> {
        let mut limbs = LimbsOfChoices::new();
        loop {
            let known = limbs.len();
            let pairs = self.grasp_pairs(grasps, steps, choices, &limbs);
            let (reached, is_enough) = self.reached(grasps, steps, choices, &pairs, &mut limbs);
            // Choices that an arm does not reach make room for others.
            if is_enough || limbs.len() == known {
                return reached;
            }
        }
    }

    /// Returns those of the pairs that both arms can follow, with the missing distance in their best postures, and whether they are enough. Adds the limbs of their
    /// choices.
    fn reached(
        &self,
        grasps: Grasps,
        steps: &[[usize; 2]],
        choices: &[Vec<Choice>],
        pairs: &[GraspPair],
        limbs: &mut LimbsOfChoices,
    ) -> (Vec<GraspPair>, bool) {
        let fixed = Surroundings::sunk(self.scene, SUNK_M);
        let mut reached: Vec<GraspPair> = Vec::new();
        for grasp_pairs in pairs.chunks(AT_ONCE) {
            let new = grasp_pairs.iter().flat_map(|grasp_pair| [0, 1].map(|hand| (hand, grasp_pair.choices[hand])));
            let new: BTreeSet<(usize, usize)> = new.filter(|choice| !limbs.contains_key(choice)).collect();
            let new: Vec<(usize, usize)> = new.into_iter().take(WITH_ARMS.saturating_sub(limbs.len())).collect();
            let gone = parallel::each(&new, |&(hand, choice)| {
                let tasks = self.with(&[(grasps[hand].0, &choices[hand][choice].task)]);
                let times: Vec<f64> = steps.iter().map(|steps| self.rollouts[hand].own_s(steps[hand])).collect();
                let begun = self.begun(hand, &tasks).into_iter();
                let stands = begun.map(|begun| Rollout::stands(begun, &tasks, self.scene, self.followed[hand], &times));
                stands.map(|stands| stands.map(|stands| LimbSteps::new(stands, &fixed))).collect()
            });
            limbs.extend(new.into_iter().zip(gone));
            for grasp_pair in grasp_pairs {
                let own = [0, 1].map(|hand| limbs.get(&(hand, grasp_pair.choices[hand])));
                let [Some(ours), Some(theirs)] = own else { continue };
                reached.extend(grasp_pair.in_best_postures(ours, theirs));
            }
            let apart = reached.iter().filter(|grasp_pair| grasp_pair.left <= AS_GOOD_M).copied().collect();
            if of_many_kinds(apart, WHOLE_PATHS_PER_GRASP).len() >= ENOUGH || limbs.len() >= WITH_ARMS {
                return (reached, true);
            }
        }
        (reached, false)
    }

    /// Returns all tasks, with replacements for some of them.
    fn with(&self, exchanged: &[(usize, &Task)]) -> Vec<Task> {
        let mut tasks = self.tasks.clone();
        exchanged.iter().for_each(|(number, task)| tasks[*number] = (*task).clone());
        tasks
    }

    /// A hand at its start, in all postures in which its arm can begin.
    fn begun(&self, hand: usize, tasks: &[Task]) -> Vec<Moving> {
        let side = self.rollouts[hand].planner.side;
        let number = tasks.iter().position(|task| task.track == side).unwrap_or(0);
        let mut begun = Rollout::begun(tasks, number, self.robot, self.scene).unwrap_or_default();
        if !self.begins {
            begun.truncate(1);
        }
        begun
    }

    /// A hand at its start, in the possible posture that is nearest to that of a rollout.
    fn begun_like(&self, hand: usize, tasks: &[Task], rollout: &Rollout) -> Option<Moving> {
        let side = rollout.planner.side;
        let place = |object: &str| place_of(tasks, self.scene, object);
        let near = Moving::begin_near(side, &self.limbs[hand], tasks, self.scene, &place, &rollout.arm);
        near.or_else(|| rollout.like(self.begun(hand, tasks)))
    }

    /// The tasks of the other hand.
    fn others(&self, task: &Task) -> impl Iterator<Item = &Task> {
        self.tasks.iter().filter(|other| other.track != task.track)
    }

    /// Whether a hand begins with a task.
    fn is_first(&self, number: usize) -> bool {
        let of_same = |task: &Task| task.track == self.tasks[number].track;
        self.begins && self.tasks.iter().position(of_same) == Some(number)
    }

    /// Returns a task with the paths of all its grasps lifted.
    fn lifted(&self, hand: usize, mut task: Task) -> Task {
        let grips = (0..task.grasps.len()).map(|grasp| self.grip(hand, &task, grasp)).collect::<Option<Vec<_>>>();
        if let (Some(grips), Some(object)) = (grips, self.scene.bodies.get(&task.object)) {
            lift(&mut task, &self.rollouts[hand].planner.hand, &grips, object, self.scene);
        }
        task
    }

    /// Returns the number of places on its paths at which a hand penetrates the object or a fixed body.
    fn goes_through(&self, hand: usize, task: &Task, grasp: usize) -> usize {
        let model = &self.rollouts[hand].planner.hand;
        let Some(object) = self.scene.bodies.get(&task.object) else { return 0 };
        let grip = self.grip(hand, task, grasp);
        grip.map_or(usize::MAX, |grip| goes_through(task, grasp, model, &grip, object, self.scene))
    }

    /// A grasp of a task of a hand.
    fn grip(&self, hand: usize, task: &Task, grasp: usize) -> Option<ResolvedGrasp> {
        let radius = tip_radius(self.scene, task.track);
        ResolvedGrasp::new(&task.grasps[grasp], &self.limbs[hand], &self.rollouts[hand].planner.hand, radius).ok()
    }

    /// The plans of both hands.
    fn both_plans<'t>(&self, tasks: &'t [Task], rollouts: &[Rollout; 2]) -> Option<[HandPlans<'t>; 2]> {
        Some([self.plans(0, tasks, &rollouts[0])?, self.plans(1, tasks, &rollouts[1])?])
    }

    /// The plans of a hand with the start of its rollout.
    fn plans<'t>(&self, hand: usize, tasks: &'t [Task], rollout: &Rollout) -> Option<HandPlans<'t>> {
        let place = |object: &str| place_of(tasks, self.scene, object);
        let group: Vec<usize> = (0..tasks.len()).collect();
        let mut planner: HandPlanner = rollout.planner.clone();
        let palm = nalgebra::Isometry3::identity();
        planner.plans(tasks, &group, &self.limbs[hand], palm, &place, &mut |_, from_s| from_s).ok()
    }
}
