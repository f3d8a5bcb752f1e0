//! The planner of one hand: its start, and its plans of each group of tasks from the current pose.

use super::plan::pace::insertions;
use super::plan::{FingerPostures, Plan, Target};
use super::schedule::{HandPlans, at_task, first_to_touch, found, groups};
use super::start::Start;
use crate::kinematics::surroundings::{SUNK_M, Surroundings};
use crate::model::hand::HandModel;
use crate::model::robot::Robot;
use nalgebra::{Isometry3, Vector3};
use std::collections::BTreeMap;
use std::sync::Arc;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::scene::{Role, Scene};
use teachtree_command::Task;
use teachtree_description::shape::solids;

/// Iterations of the inverse kinematics at each step of a plan, and the largest share of the joints' speed that the arm uses.
const FOLLOWING: usize = 12;
const UNHURRIED: f64 = 0.7;
/// The help text for an arm that cannot follow its path.
const ELSEWHERE: &str = "place the arm elsewhere, by `at:` and `turned:` in the robot file, or the objects in the scene; or take an arm that reaches farther";
/// Interval at which the path through all tasks is sampled to choose the start of the arm, s.
const WAY_S: f64 = 0.1;
/// Radius of the demonstrated fingertips where the scene has none for the hand, m.
const TIP_RADIUS_M: f64 = 0.010;

/// Radius of the demonstrated fingertips of a hand, m.
pub(super) fn tip_radius(scene: &Scene, side: Side) -> f64 {
    scene.hands.get(&side).map_or(TIP_RADIUS_M, |hand| hand.tip_radius.0)
}

/// Returns the pose of an object, reference frame; `None` for a name that is not a body of the scene.
pub(crate) type PoseLookup<'a> = dyn Fn(&str) -> Option<Isometry3<f64>> + 'a;

/// The planner of a hand.
#[derive(Clone)]
pub(crate) struct HandPlanner {
    pub(crate) side: Side,
    pub(crate) hand: HandModel,
    /// Radius of the demonstrated fingertips, m.
    demonstrated_radius: f64,
    /// The shapes of which paths that were not demonstrated must be clear.
    scene: Arc<Scene>,
    /// Its first task, and the start time within the plan of that task, s, until that plan is made.
    fresh: Option<(usize, f64)>,
    /// Its fingers at the end of its last plan.
    fingers: FingerPostures,
}

impl HandPlanner {
    /// Returns the planner of a hand before its first task, the possible starts of its robot (the first one is preferred), and its first target.
    ///
    /// # Errors
    /// A hand that the robot does not have, or that has no task; a first task that cannot be planned, or whose path the arm cannot follow.
    pub(crate) fn begin(
        side: Side,
        limb: &Robot,
        tasks: &[Task],
        scene: &Scene,
        place: &PoseLookup<'_>,
    ) -> Result<(Self, Vec<Start>, Target), InputError> {
        let groups = groups(tasks);
        let (mut planner, number, plan) = Self::before(side, limb, tasks, &groups, scene, place)?;
        let (mut starts, from_s) = Start::of_plan(limb, &planner.hand, &plan, &Surroundings::fixed(scene))
            .map_err(|message| at_task(tasks, number, message).help(ELSEWHERE))?;
        let has_more = tasks.iter().skip(number + 1).any(|task| task.track == side);
        if has_more && starts.len() > 1 && plan.arm().is_empty() {
            let way = planner.whole_way(tasks, &groups, (number, &plan, from_s), limb, place);
            let arm = planner.hand.arm_on(&limb.tree);
            starts.sort_by_cached_key(|start| !arm.follows(&start.root, &way, &start.q));
        }
        planner.fresh = Some((number, from_s));
        let target = plan.at(from_s);
        Ok((planner, starts, target))
    }

    /// Returns the planner of a hand before its first task, its start in the posture that its arm reaches from this one (by the names of joints), and its first target;
    /// `None` if the arm cannot follow the whole path of its first task from there.
    pub(crate) fn begin_near(
        side: Side,
        limb: &Robot,
        tasks: &[Task],
        scene: &Scene,
        place: &PoseLookup<'_>,
        arm: &BTreeMap<String, f64>,
    ) -> Option<(Self, Start, Target)> {
        let (mut planner, number, plan) = Self::before(side, limb, tasks, &groups(tasks), scene, place).ok()?;
        let start = Start::near(limb, &planner.hand, &plan, arm)?;
        planner.fresh = Some((number, 0.0));
        let target = plan.at(0.0);
        Some((planner, start, target))
    }

    /// Returns the planner of a hand before its first task, the index of that task, and its plan.
    fn before<'t>(
        side: Side,
        limb: &Robot,
        tasks: &'t [Task],
        groups: &[Vec<usize>],
        scene: &Scene,
        place: &PoseLookup<'_>,
    ) -> Result<(Self, usize, Plan<'t>), InputError> {
        let lacks = || InputError::new("commands", "are of no hand of the robot");
        let hand = limb.hands.get(&side).cloned().ok_or_else(lacks)?;
        let demonstrated_radius = tip_radius(scene, side);
        let number = tasks.iter().position(|task| task.track == side).ok_or_else(lacks)?;
        let group = groups.iter().find(|group| group.contains(&number)).map_or(&[][..], Vec::as_slice);
        let planner = Self {
            side,
            hand,
            demonstrated_radius,
            scene: Arc::new(scene.clone()),
            fresh: None,
            fingers: FingerPostures::new(),
        };
        let plan = planner.plan(tasks, group, number, limb, None, place)?;
        Ok((planner, number, plan))
    }

    /// Returns its consecutive plans of a group of tasks, for a palm at `palm`. `stretch(plan, t)` retimes a plan from the time `t` on, s, and
    /// returns the new `t`.
    ///
    /// # Errors
    /// A task that cannot be planned.
    pub(crate) fn plans<'t>(
        &mut self,
        tasks: &'t [Task],
        group: &[usize],
        limb: &Robot,
        palm: Isometry3<f64>,
        place: &PoseLookup<'_>,
        stretch: &mut dyn FnMut(&mut Plan<'t>, f64) -> f64,
    ) -> Result<HandPlans<'t>, InputError> {
        // Before its start, a hand is at the start of its first task, if that task is executed.
        let fresh = self.fresh.take_if(|(number, _)| group.contains(number));
        let mut palm = fresh.is_none().then_some(palm);
        let mut made = HandPlans::default();
        for &number in group.iter().filter(|number| tasks[**number].track == self.side) {
            let mut plan = self.plan(tasks, group, number, limb, palm.as_ref(), place)?;
            let from_s =
                stretch(&mut plan, fresh.filter(|(first, _)| *first == number).map_or(0.0, |(_, from_s)| from_s));
            if made.plans.is_empty() {
                made.begins_s = from_s;
            }
            let last = plan.at(plan.duration());
            (palm, self.fingers) = (Some(last.palm), last.fingers(&self.hand));
            made.plans.push((number, plan));
        }
        Ok(made)
    }

    /// Stretches a plan from a time on, s, until the arm can follow it from `q`, which is updated; returns the stretched time, s. `root` is the pose of the robot's
    /// root.
    pub(crate) fn slow_down(
        &self,
        limb: &Robot,
        root: &Isometry3<f64>,
        plan: &mut Plan<'_>,
        from_s: f64,
        q: &mut [f64],
    ) -> f64 {
        if self.hand.arm.is_empty() {
            return from_s;
        }
        plan.slow_down(from_s, &mut |palm, dt| {
            let before = q.to_vec();
            self.hand.arm_on(&limb.tree).inverse_kinematics(root, palm, q, FOLLOWING);
            self.too_fast(limb, &before, q, dt)
        })
    }

    /// Returns the factor by which the arm exceeds its speed from one posture to another within a time, s.
    pub(super) fn too_fast(&self, limb: &Robot, before: &[f64], q: &[f64], dt: f64) -> f64 {
        let speed = |dof: &usize| (q[*dof] - before[*dof]).abs() / dt / (UNHURRIED * limb.tree.dofs[*dof].speed);
        self.hand.arm.iter().map(speed).fold(0.0, f64::max)
    }

    /// Returns the path of the palm from a time of the plan of its first task on, s, through all of its tasks, with each object at its demonstrated pose. The path ends
    /// before a task that cannot be planned.
    fn whole_way(
        &self,
        tasks: &[Task],
        groups: &[Vec<usize>],
        (number, plan, from_s): (usize, &Plan<'_>, f64),
        limb: &Robot,
        place: &PoseLookup<'_>,
    ) -> Vec<Isometry3<f64>> {
        let palms = |plan: &Plan<'_>, from_s: f64| -> Vec<Isometry3<f64>> {
            let times = (0..).map(|at| from_s + f64::from(at) * WAY_S).take_while(|time| *time <= plan.duration());
            times.map(|time| plan.at(time).palm).collect()
        };
        let mut way = palms(plan, from_s);
        for (later, task) in tasks.iter().enumerate().skip(number + 1).filter(|(_, task)| task.track == self.side) {
            let group = groups.iter().find(|group| group.contains(&later)).map_or(&[][..], Vec::as_slice);
            let first = first_to_touch(group.iter().map(|at| &tasks[*at]).filter(|it| it.object == task.object));
            let taken = |object: &str| {
                first.filter(|first| first.object == object).map_or_else(|| place(object), |it| Some(it.grasp_pose()))
            };
            let Ok(plan) = self.plan(tasks, group, later, limb, way.last(), &taken) else { break };
            way.extend(palms(&plan, 0.0));
        }
        way
    }

    fn plan<'t>(
        &self,
        tasks: &'t [Task],
        group: &[usize],
        number: usize,
        limb: &Robot,
        palm: Option<&Isometry3<f64>>,
        place: &PoseLookup<'_>,
    ) -> Result<Plan<'t>, InputError> {
        let object = &tasks[number].object;
        let lacks = || at_task(tasks, number, format!("is about `{object}`, which is not a body of the scene"));
        if let Some(into) = tasks[number].into.as_ref().filter(|into| place(&into.body).is_none()) {
            return Err(at_task(tasks, number, format!("goes into `{}`, which is not a body of the scene", into.body)));
        }
        let found = found(tasks, group, number, &place(object).ok_or_else(lacks)?);
        let insertions = insertions(tasks, group, number, &self.scene);
        let plan = Plan::new(&tasks[number], limb, &self.hand, found, insertions, palm, self.demonstrated_radius);
        let mut plan = plan.map_err(|message| at_task(tasks, number, message))?;
        plan.before.clone_from(&self.fingers);
        if self.scene.up() != Vector3::zeros() {
            let others = self.scene.bodies.iter().filter(|(_, body)| body.role == Role::Object);
            let others = others.filter_map(|(name, body)| Some((body, place(name)?)));
            let others = others.flat_map(|(body, at)| solids(body).into_iter().map(move |solid| solid.moved(&at)));
            let surroundings = Surroundings::sunk(&self.scene, SUNK_M).with(others);
            let arm = (!self.hand.arm.is_empty()).then(|| self.hand.arm_on(&limb.tree));
            plan.lift(&self.hand, &self.scene.up(), &surroundings, arm.as_ref());
        }
        Ok(plan)
    }
}
