//! The motion of a hand with its arm in a group of tasks, by inverse kinematics alone: its shapes at each step, for comparison with those of the other hand.

use super::hand_planner::HandPlanner;
use super::moving::{FollowedPath, Moving};
use super::plan::Plan;
use super::schedule::{EASED_S, HandPlans, first_to_touch};
use super::time_scale::{Part, TimeScale};
use crate::kinematics::arm_distance::{PlacedShape, PlacedShapes, arm_distance, arm_distance_until, nearer, placed};
use crate::kinematics::surroundings::{SUNK_M, Surroundings};
use crate::model::hand::HandModel;
use crate::model::robot::Robot;
use nalgebra::{Isometry3, Vector3};
use std::collections::BTreeMap;
use std::sync::Arc;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::scene::Scene;
use teachtree_command::Task;
use teachtree_description::shape::{CollisionShape, solids};

/// Gap with which arms leave room for each other, m: controllers deviate less from their paths.
pub(super) const ROOM_M: f64 = 0.005;
/// Interval at which the gap of arms is computed, s. The first pass takes every 16th step: most pairs that collide do so for longer.
const STEP_S: f64 = 0.02;
const STRIDES: [usize; 2] = [16, 1];

/// Steps of the arm between sampled times, s.
const COARSE_S: f64 = 0.1;

/// Smallest gap between a hand and an object that the other hand handles, m: during an insertion, fingers are near both objects.
const BESIDE_M: f64 = 0.003;

/// A search for the missing distance ends early only with this margin for rounding, m.
const ROUNDING_M: f64 = 1e-9;

/// Largest motion of limbs that is allowed between two comparisons, m.
const LOOK_M: f64 = 0.1;

/// Additional weight of a millimeter of penetration over a millimeter of missing distance.
const DEEPER: f64 = 4.0;

/// Summed missing distance up to which hands count as apart, m: each step at which they just touch adds [`ROOM_M`].
const CLEAR_M: f64 = 0.05;

/// Penetrations of hands up to this depth, m, are not reported: the controllers deviate from their paths by as much.
const REPORTED_M: f64 = 0.001;

/// A hand, with or without its arm, and its object at a step; reference frame.
#[derive(Clone, Debug)]
pub(super) struct Occupied {
    pub(super) limb: PlacedShapes,
    /// The shapes of the object; empty for an object of both hands while this hand is on a path without it.
    pub(super) object: PlacedShapes,
    /// Whether the hand may touch the object of the other hand: both handle the same object, and this hand is at it.
    shares: bool,
}

impl Occupied {
    /// Returns a hand with its arm and its object at a time of its plan, s.
    fn of_limb(hand: &Moving, plan: &Plan<'_>, own_s: f64, object: &HandledObject) -> Self {
        let poses = hand.limb.tree.forward_kinematics(&hand.q);
        let poses: Vec<_> = poses.iter().map(|pose| hand.root * pose).collect();
        Self::new(placed(&hand.limb.tree, &poses), plan, own_s, object)
    }

    /// Returns a hand without its arm, and its object, at a time of its plan, s.
    pub(super) fn of_hand(hand: &HandModel, plan: &Plan<'_>, own_s: f64, object: &HandledObject) -> Self {
        Self::new(plan.at(own_s).shapes(hand).into_iter().collect(), plan, own_s, object)
    }

    fn new(limb: PlacedShapes, plan: &Plan<'_>, own_s: f64, object: &HandledObject) -> Self {
        let shares = object.is_shared && !plan.is_away(own_s);
        let pose = plan.at(own_s).object;
        let solids = object.solids.iter().filter(|_| shares || !object.is_shared);
        let object = solids.map(|solid| PlacedShape::new(0, solid.moved(&pose))).collect();
        Self { limb, object, shares }
    }

    /// Returns the missing distance between two limbs, or a limb and the object of the other one, m; a penetration has a larger weight. If it exceeds `most`, the
    /// result is any value above `most`.
    pub(super) fn too_near(&self, other: &Self, most: f64) -> f64 {
        let by = |ours: &PlacedShapes, theirs: &PlacedShapes, room: f64| {
            // The gap at which it is `most`.
            let least = if most < room { room - most } else { (room - most) / (1.0 + DEEPER) };
            let found = arm_distance_until(ours, theirs, room, least - ROUNDING_M);
            found.map_or(0.0, |found| room - found.gap + DEEPER * (-found.gap).max(0.0))
        };
        let touched = |one: &Self, other: &Self| {
            if one.shares && other.shares { 0.0 } else { by(&one.limb, &other.object, BESIDE_M) }
        };
        let limbs = by(&self.limb, &other.limb, ROOM_M);
        if limbs > most { limbs } else { limbs.max(touched(self, other)).max(touched(other, self)) }
    }

    /// Returns a lower bound of the distance by which points of both limbs and their objects can move until [`Occupied::too_near`] is above zero, m, at most
    /// [`LOOK_M`]; negative if it is above zero. Zero if a shape is a piece of a mesh, whose gaps are upper bounds.
    fn room(&self, other: &Self) -> f64 {
        if [self, other].iter().any(|it| it.limb.iter().chain(it.object.iter()).any(PlacedShape::is_piece)) {
            return 0.0;
        }
        let gap = |ours: &PlacedShapes, theirs: &PlacedShapes, room: f64| {
            arm_distance(ours, theirs, room + LOOK_M).map_or(LOOK_M, |found| found.gap - room)
        };
        let touched = |one: &Self, other: &Self| {
            if one.shares && other.shares { LOOK_M } else { gap(&one.limb, &other.object, BESIDE_M) }
        };
        gap(&self.limb, &other.limb, ROOM_M).min(touched(self, other)).min(touched(other, self))
    }

    /// Returns an upper bound of the displacement of any point of limb and object since `before`, m; infinite if the object is another one.
    fn displacement(&self, before: &Self) -> f64 {
        if self.shares == before.shares && self.object.len() == before.object.len() {
            self.limb.displacement(&before.limb).max(self.object.displacement(&before.object))
        } else {
            f64::INFINITY
        }
    }

    /// Whether this limb and its object leave room for a hand on a path that is displaced by `by`, m.
    pub(super) fn leaves_room(&self, hand: &[PlacedShape], by: &Vector3<f64>) -> bool {
        let moved: Vec<PlacedShape> = hand.iter().map(|shape| shape.shifted(by)).collect();
        !nearer(&moved, &self.limb, ROOM_M) && !nearer(&moved, &self.object, BESIDE_M)
    }
}

/// The pose of an object at the start of tasks, reference frame.
pub(super) fn place_of(tasks: &[Task], scene: &Scene, object: &str) -> Option<Isometry3<f64>> {
    let first = first_to_touch(tasks.iter().filter(|task| task.object == object));
    first.map(Task::grasp_pose).or_else(|| scene.bodies.get(object).map(|body| body.pose()))
}

/// The object of a task.
pub(super) struct HandledObject {
    /// Its frame.
    solids: Vec<CollisionShape>,
    /// Whether the other hand handles the object too.
    is_shared: bool,
}

impl HandledObject {
    pub(super) fn of(tasks: &[Task], number: usize, scene: &Scene) -> Self {
        let task = &tasks[number];
        let is_shared = tasks.iter().any(|other| other.track != task.track && other.object == task.object);
        Self { solids: scene.bodies.get(&task.object).map(solids).unwrap_or_default(), is_shared }
    }
}

/// The motion of a hand in a group of tasks, in steps of its own time.
#[derive(Clone)]
pub(super) struct Rollout {
    /// The start posture of its arm.
    pub(super) arm: BTreeMap<String, f64>,
    /// The planner of the hand, before the first task.
    pub(super) planner: HandPlanner,
    /// The parts of its plans, slowed down as the arm requires, and the duration of each in the plan, s. Steps are at times of the plans.
    parts: Vec<Part>,
    planned_s: Vec<f64>,
    begins_s: f64,
    steps: Arc<[Occupied]>,
    /// For each step, a bound of the displacement since the step before, m.
    displacements: Arc<[f64]>,
    /// The number of steps at which the hand or its arm penetrates a fixed body.
    pub(super) meets: usize,
}

/// Hands or arms that go through each other in tasks that are done at the same time.
#[derive(Clone, Debug, PartialEq)]
pub struct Crossing {
    /// The indices of the tasks.
    pub tasks: Vec<usize>,
    /// Largest penetration, m.
    pub depth_m: f64,
}

/// An arm that cannot follow its tasks. The two hands are not kept apart in their group.
#[derive(Clone, Debug, PartialEq)]
pub struct Unreachable {
    /// The hand of the arm.
    pub side: Side,
    /// The reason.
    pub why: String,
}

/// What is left of conflicts of the two arms after mapping.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Conflicts {
    /// Hands or arms that still go through each other.
    pub crossings: Vec<Crossing>,
    /// Arms that cannot follow their tasks.
    pub unreachable: Vec<Unreachable>,
}

/// A step at which two rollouts come near to each other.
pub(super) struct Near {
    /// The step of each rollout.
    pub(super) steps: [usize; 2],
    /// The missing distance, m, by [`Occupied::too_near`].
    pub(super) by: f64,
}

impl Rollout {
    /// Returns the rollouts of the hand of a task, one from each posture from which its arm can follow the task, the best one first.
    pub(super) fn all(tasks: &[Task], number: usize, robot: &Robot, scene: &Scene) -> Result<Vec<Self>, InputError> {
        let begun = Self::begun(tasks, number, robot, scene)?;
        Ok(begun.into_iter().filter_map(|hand| Self::of(hand, tasks, scene, FollowedPath::Whole).ok()).collect())
    }

    /// Returns the rollout of the hand of a task from the best posture from which its arm can follow its whole path, or the path to the releases.
    ///
    /// # Errors
    /// The reason why the arm cannot follow from the best posture.
    pub(super) fn first(
        tasks: &[Task],
        number: usize,
        robot: &Robot,
        scene: &Scene,
    ) -> Result<(Self, FollowedPath), String> {
        let begun = Self::begun(tasks, number, robot, scene).map_err(|error| error.message)?;
        let mut first = None;
        for followed in [FollowedPath::Whole, FollowedPath::ToReleases] {
            for hand in &begun {
                match Self::of(hand.clone(), tasks, scene, followed) {
                    Ok(rollout) => return Ok((rollout, followed)),
                    Err(why) => first = first.or(Some(why)),
                }
            }
        }
        Err(first.unwrap_or_else(|| "no start posture reaches the first target".into()))
    }

    /// Returns the hand of a task at its start, in each posture in which its arm can begin, the best one first.
    pub(super) fn begun(
        tasks: &[Task],
        number: usize,
        robot: &Robot,
        scene: &Scene,
    ) -> Result<Vec<Moving>, InputError> {
        let side = tasks[number].track;
        let place = |object: &str| place_of(tasks, scene, object);
        let begun = Moving::begin(side, &robot.limb(side)?, tasks, scene, &place)?;
        let mut different: Vec<Moving> = Vec::new();
        for hand in begun {
            // Angles that differ by a full turn are equal.
            let same = |other: &Moving| {
                hand.q.iter().zip(&other.q).all(|(a, b)| (a - b).sin().abs() < 1e-3 && (a - b).cos() > 0.0)
            };
            if !different.iter().any(same) {
                different.push(hand);
            }
        }
        Ok(different)
    }

    /// Returns the rollout of a hand.
    ///
    /// # Errors
    /// The reason why the arm cannot follow.
    pub(super) fn of(mut hand: Moving, tasks: &[Task], scene: &Scene, followed: FollowedPath) -> Result<Self, String> {
        let place = |object: &str| place_of(tasks, scene, object);
        let arm = hand.planner.hand.arm.iter().map(|dof| (hand.limb.tree.dofs[*dof].name.clone(), hand.q[*dof]));
        let arm = arm.collect();
        let group: Vec<usize> = (0..tasks.len()).collect();
        let planner = hand.planner.clone();
        let made = hand.planner.plans(tasks, &group, &hand.limb, hand.palm, &place, &mut |_, from_s| from_s);
        let mut made = made.map_err(|error| error.message)?;
        let (planned_s, begins_s) = (made.parts().iter().map(|part| part.needs_s).collect(), made.begins_s);
        let (mut steps, mut done_s): (Vec<Occupied>, f64) = (Vec::new(), 0.0);
        for (number, plan) in &mut made.plans {
            let object = HandledObject::of(tasks, *number, scene);
            let own_s = |step: usize| begins_s + step as f64 * STEP_S - done_s;
            let (from_s, duration) = (own_s(steps.len()), plan.duration());
            let mut too_fast: Vec<f64> = Vec::new();
            while own_s(steps.len()) <= duration {
                let own_s = own_s(steps.len());
                let before = hand.q.clone();
                hand.advance(plan, own_s)
                    .or_else(|missed| followed.accept(missed))
                    .map_err(|missed| missed.to_string())?;
                too_fast.push(planner.too_fast(&hand.limb, &before, &hand.q, STEP_S));
                steps.push(Occupied::of_limb(&hand, plan, own_s, &object));
            }
            let mut too_fast = too_fast.into_iter();
            plan.slow_down(from_s, &mut |_, _| too_fast.next().unwrap_or(1.0));
            done_s += duration;
        }
        let steps: Arc<[Occupied]> = steps.into();
        let parts = made.parts();
        if steps.is_empty() {
            Err("its plans have no steps".into())
        } else {
            let fixed = Surroundings::sunk(scene, SUNK_M);
            let meets = steps.iter().filter(|step| fixed.meet_any(step.limb.iter())).count();
            let displaced = steps.windows(2).map(|steps| steps[1].displacement(&steps[0]));
            let displacements = std::iter::once(0.0).chain(displaced).collect();
            Ok(Self { arm, planner, parts, planned_s, begins_s, steps, displacements, meets })
        }
    }

    /// Returns the hand with its arm at times of its plans, s; `None` if the arm cannot follow them.
    pub(super) fn stands(
        mut hand: Moving,
        tasks: &[Task],
        scene: &Scene,
        followed: FollowedPath,
        times: &[f64],
    ) -> Option<Vec<Occupied>> {
        let place = |object: &str| place_of(tasks, scene, object);
        let group: Vec<usize> = (0..tasks.len()).collect();
        let made = hand.planner.plans(tasks, &group, &hand.limb, hand.palm, &place, &mut |_, from_s| from_s).ok()?;
        let mut stands: Vec<Option<Occupied>> = vec![None; times.len()];
        let mut done_s = 0.0;
        for (number, plan) in &made.plans {
            let object = HandledObject::of(tasks, *number, scene);
            let is_last = made.plans.last().is_some_and(|(last, _)| last == number);
            let within = |time: f64| time >= done_s && (time < done_s + plan.duration() || is_last);
            let coarse = (0..).map(|step| made.begins_s.max(done_s) + f64::from(step) * COARSE_S);
            let coarse = coarse.take_while(|time| *time <= done_s + plan.duration()).map(|time| (time, None));
            let wanted =
                times.iter().enumerate().filter(|(_, time)| within(**time)).map(|(at, time)| (*time, Some(at)));
            let mut all: Vec<(f64, Option<usize>)> = coarse.chain(wanted).collect();
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (time, wanted) in all {
                let own_s = (time.max(made.begins_s) - done_s).min(plan.duration());
                hand.advance(plan, own_s).or_else(|missed| followed.accept(missed)).ok()?;
                if let Some(at) = wanted {
                    stands[at] = Some(Occupied::of_limb(&hand, plan, own_s, &object));
                }
            }
            done_s += plan.duration();
        }
        stands.into_iter().collect()
    }

    /// Returns the start posture that is nearest to the one of this rollout.
    pub(super) fn like(&self, begun: Vec<Moving>) -> Option<Moving> {
        // Angles that differ by a full turn are equal.
        let far = |hand: &Moving| {
            let dofs = hand.planner.hand.arm.iter().map(|dof| (&hand.limb.tree.dofs[*dof].name, hand.q[*dof]));
            dofs.map(|(name, at)| self.arm.get(name).map_or(0.0, |own| 1.0 - (own - at).cos())).sum::<f64>()
        };
        begun.into_iter().min_by(|a, b| far(a).total_cmp(&far(b)))
    }

    /// Returns the same rollout with the times of these plans.
    pub(super) fn at_times_of(&self, plans: &HandPlans<'_>) -> Self {
        let parts = plans.parts().into_iter().zip(&self.parts);
        let parts = parts.map(|(at, own)| Part { demonstrated: at.demonstrated, ..*own }).collect();
        Self { parts, ..self.clone() }
    }

    /// Returns the time of its plans at a time of its parts, s, which may be slower.
    fn planned_at(&self, own_s: f64) -> f64 {
        let (mut slow_s, mut planned_s) = (0.0, 0.0);
        for (part, takes_s) in self.parts.iter().zip(&self.planned_s) {
            if own_s < slow_s + part.needs_s {
                return planned_s + takes_s * (own_s - slow_s) / part.needs_s;
            }
            (slow_s, planned_s) = (slow_s + part.needs_s, planned_s + takes_s);
        }
        planned_s
    }

    /// Returns its limb at a step; after the last step it stands still.
    pub(super) fn at(&self, step: usize) -> &Occupied {
        &self.steps[step.min(self.steps.len() - 1)]
    }

    /// Returns a bound of the displacement of any point between two steps, m.
    fn displacement(&self, from: usize, to: usize) -> f64 {
        let last = self.steps.len() - 1;
        let [from, to] = [from.min(to), from.max(to)].map(|step| step.min(last));
        self.displacements[from + 1..=to].iter().sum()
    }

    /// Returns the time of its plans at a step, s.
    pub(super) fn own_s(&self, step: usize) -> f64 {
        self.begins_s + step as f64 * STEP_S
    }

    /// Returns the smallest gap to the hand of another rollout, m, or the first gap of at most `least`.
    pub(super) fn gap(&self, other: &Self, least: f64) -> f64 {
        let rollouts = [self, other];
        let time = time_of(&rollouts);
        let all = (time.over() / STEP_S) as usize;
        let mut gap = f64::INFINITY;
        for step in STRIDES.into_iter().flat_map(|stride| (0..=all).step_by(stride)) {
            let [one, other] = steps(&rollouts, &time, step);
            gap = arm_distance(&self.at(one).limb, &rollouts[1].at(other).limb, gap).map_or(gap, |found| found.gap);
            if gap <= least {
                break;
            }
        }
        gap
    }

    /// Returns the simultaneous steps of two rollouts, in order.
    pub(super) fn together(&self, other: &Self) -> Vec<[usize; 2]> {
        let rollouts = [self, other];
        let time = time_of(&rollouts);
        let all = (time.over() / STEP_S) as usize;
        (0..=all).map(|step| steps(&rollouts, &time, step)).collect()
    }

    /// Returns the penetration of two rollouts of these tasks at the steps `near`; `None` if they do not penetrate each other.
    pub(super) fn crossing(&self, other: &Self, near: &[Near], tasks: &[usize]) -> Option<Crossing> {
        let gap = |near: &Near| arm_distance(&self.at(near.steps[0]).limb, &other.at(near.steps[1]).limb, -REPORTED_M);
        let depth_m = near.iter().filter_map(gap).map(|found| -found.gap).fold(0.0, f64::max);
        (depth_m > 0.0).then(|| Crossing { tasks: tasks.to_vec(), depth_m })
    }

    /// As [`Rollout::near`], for the rollout of the hand with this index; steps are in the order of the hands. `None` if their sum is at least `below`, m.
    pub(super) fn near_to(&self, other: &Self, hand: usize, below: f64) -> Option<Vec<Near>> {
        if hand == 0 { self.near_below(other, below) } else { other.near_below(self, below) }
    }

    /// Returns the steps at which two rollouts are too near to each other.
    pub(super) fn near(&self, other: &Self) -> Vec<Near> {
        self.near_below(other, f64::INFINITY).unwrap_or_default()
    }

    fn near_below(&self, other: &Self, below: f64) -> Option<Vec<Near>> {
        let (mut near, mut sum) = (Vec::new(), 0.0);
        // The steps of the last comparison, and how far points can move from there before anything is too near, m.
        let (mut last, mut room) = ([0, 0], 0.0);
        for steps in self.together(other) {
            if sum >= below {
                return None;
            }
            room -= self.displacement(last[0], steps[0]) + other.displacement(last[1], steps[1]) + ROUNDING_M;
            last = steps;
            if room > 0.0 {
                continue;
            }
            let by = self.at(steps[0]).too_near(other.at(steps[1]), below - sum);
            if by == 0.0 {
                room = self.at(steps[0]).room(other.at(steps[1]));
            } else {
                near.push(Near { steps, by });
                sum += by;
            }
        }
        (sum < below).then_some(near)
    }
}

/// The time scale of two rollouts.
fn time_of(rollouts: &[&Rollout; 2]) -> TimeScale {
    TimeScale::of(&rollouts.map(|rollout| rollout.parts.clone()), EASED_S)
}

/// The step of each of two rollouts at a step of the time of both.
fn steps(rollouts: &[&Rollout; 2], time: &TimeScale, step: usize) -> [usize; 2] {
    [0, 1].map(|hand| {
        let planned_s = rollouts[hand].planned_at(time.at(hand, step as f64 * STEP_S));
        let since_s = (planned_s - rollouts[hand].begins_s).max(0.0);
        (since_s / STEP_S).round() as usize
    })
}

/// Returns the missing distance of hands, m, summed over steps, by [`Occupied::too_near`]; `None` above `most`.
pub(super) fn too_near<'a>(steps: impl Iterator<Item = (&'a Occupied, &'a Occupied)>, most: f64) -> Option<f64> {
    let mut sum = 0.0;
    for (one, other) in steps {
        if most < 0.0 {
            return None;
        }
        sum += one.too_near(other, most - sum);
        if sum > most {
            return None;
        }
    }
    Some(sum)
}

/// Returns the summed missing distance, m, by [`Occupied::too_near`].
pub(super) fn total(near: &[Near]) -> f64 {
    near.iter().map(|near| near.by).sum()
}

/// Whether hands count as apart: they are too near to each other for a few steps at most, and never penetrate each other.
pub(super) fn are_apart(near: &[Near]) -> bool {
    total(near) < CLEAR_M && near.iter().all(|near| near.by <= ROOM_M)
}
