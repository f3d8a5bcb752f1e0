//! The agent of one hand: its model, its current segment, and its state from one step to the next.

use crate::control::behavior::{Behavior, GripForceTotals, HandObservation, Progress, SearchResult, holds};
use crate::control::behaviors::behaviors;
use crate::control::executor::Executor;
use crate::model::robot::Robot;
use crate::planning::hand_planner::{HandPlanner, PoseLookup};
use crate::planning::plan::{Plan, PlannedForce, Target};
use crate::planning::schedule::HandPlans;
use nalgebra::{Isometry3, Vector3};
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::meaning::Meaning;
use teachtree_base::pose::pose_from_array;
use teachtree_base::scene::Scene;
use teachtree_command::Task;
use teachtree_world::{HandMotion, HandMover, Observation, STEP_S, TipWrench};

/// The agent of one hand.
pub(super) struct HandAgent<'t> {
    pub(super) planner: HandPlanner,
    pub(super) executor: Executor,
    /// The current target, with the corrections of the behaviors.
    pub(super) target: Target,
    /// The currently planned forces, without corrections.
    pub(super) planned: Vec<PlannedForce>,
    /// The currently planned pose of the palm, without corrections.
    pub(super) planned_palm: Isometry3<f64>,
    /// The current part of a task; `None` for an idle hand.
    pub(super) doing: Option<ActiveSegment<'t>>,
    behaviors: Vec<Box<dyn Behavior>>,
    /// Index of the hand in the scene.
    place: usize,
}

/// A part of a task.
#[derive(Clone, Copy, Debug)]
pub(super) struct ActiveSegment<'t> {
    /// Index of the task.
    pub(super) task: usize,
    /// Index of its object among the bodies.
    pub(super) body: usize,
    /// The primitive.
    pub(super) primitive: &'t str,
    /// The action of the hand.
    pub(super) does: Meaning,
    /// Index of the segment while the planned forces equal the commanded ones.
    pub(super) holds_in: Option<usize>,
    /// Whether the object is lost; the hand then ignores it.
    pub(super) lost: bool,
    /// The transform from the demonstrated pose of the hole to its seen pose.
    hole_off: Option<Isometry3<f64>>,
}

impl<'t> HandAgent<'t> {
    /// Returns the agent of a side before its first task. `scene` has the operator's hands; the torques of motors are delayed by `motor_delay` steps.
    ///
    /// # Errors
    /// As [`HandPlanner::begin`].
    pub(super) fn begin(
        (place, side): (usize, Side),
        limb: &Robot,
        tasks: &[Task],
        scene: &Scene,
        see: &PoseLookup<'_>,
        motor_delay: usize,
    ) -> Result<Self, InputError> {
        let (planner, mut starts, target) = HandPlanner::begin(side, limb, tasks, scene, see)?;
        let executor = Executor::new(limb.clone(), planner.hand.clone(), starts.swap_remove(0), scene.gravity());
        let executor = executor.with_motor_delay(motor_delay);
        let planned_palm = target.palm;
        let (planned, behaviors) = (Vec::new(), Vec::new());
        Ok(Self { planner, executor, target, planned, planned_palm, doing: None, behaviors, place })
    }

    /// Returns its plans for a group of tasks, slowed to the limits of its arm, and resets its behaviors.
    ///
    /// # Errors
    /// A task that cannot be planned.
    pub(super) fn plan(
        &mut self,
        tasks: &'t [Task],
        group: &[usize],
        scene: &Scene,
        see: &PoseLookup<'_>,
    ) -> Result<HandPlans<'t>, InputError> {
        self.behaviors = behaviors(&self.planner.hand, tasks, scene);
        let mut q = self.executor.wanted();
        let (limb, root) = (self.executor.robot(), self.executor.motion.root);
        let mut planner = self.planner.clone();
        let stretch = &mut |plan: &mut Plan<'t>, from_s: f64| self.planner.slow_down(limb, &root, plan, from_s, &mut q);
        let plans = planner.plans(tasks, group, limb, self.executor.wanted_palm(), see, stretch)?;
        self.planner = planner;
        Ok(plans)
    }

    /// Sets the target to that of a plan at a time of the plan, s; `lost` returns whether a body is lost.
    pub(super) fn follow(
        &mut self,
        now: Option<(usize, &Plan<'t>, f64)>,
        tasks: &[Task],
        bodies: &[usize],
        see: &PoseLookup<'_>,
        lost: &dyn Fn(usize) -> bool,
    ) {
        self.doing = None;
        let Some((number, plan, own_s)) = now else { return };
        let (task, body) = (&tasks[number], bodies[number]);
        self.target = plan.at(own_s);
        self.planned = plan.forces(own_s, &self.target);
        // The hole moves with its body, whose pose may differ from the demonstration. The peg search corrects the remaining error.
        let hole_off =
            task.into.as_ref().and_then(|into| Some(see(&into.body)? * pose_from_array(&into.pose).inverse()));
        let lost = lost(body);
        if let Some(off) = hole_off.filter(|_| !lost) {
            self.target.blend_toward(&off, plan.leans(own_s));
        }
        self.planned_palm = self.target.palm;
        let (primitive, does) = plan.primitive(own_s);
        let holds_in = plan.commands_forces(own_s);
        self.doing = Some(ActiveSegment { task: number, body, primitive, does, holds_in, lost, hole_off });
    }

    /// Returns the current part of a task whose object is not lost.
    pub(super) fn at_work(&self) -> Option<ActiveSegment<'t>> {
        self.doing.filter(|doing| !doing.lost)
    }

    /// Returns the body that it holds or pushes.
    pub(super) fn holds(&self) -> Option<usize> {
        self.at_work().filter(|_| holds(&self.target) || self.target.pushed).map(|doing| doing.body)
    }

    /// Returns the number of its behaviors.
    pub(super) fn n_behaviors(&self) -> usize {
        self.behaviors.len()
    }

    /// Applies a behavior to the target; `object` is the seen pose of the object, and `shared` is whether another hand holds it too.
    pub(super) fn behave(
        &mut self,
        behavior: usize,
        object: Isometry3<f64>,
        shared: bool,
        seen: &Observation,
    ) -> Progress {
        let (Some(doing), Some(behavior)) = (self.at_work(), self.behaviors.get_mut(behavior)) else {
            return Progress::Continue;
        };
        let sensed = HandObservation {
            task: doing.task,
            object,
            body: doing.body,
            tips: &seen.hands[self.place].tips,
            hole_off: doing.hole_off.unwrap_or_else(Isometry3::identity),
            inserts: doing.does == Meaning::Insert,
            shared,
        };
        behavior.apply(&sensed, &mut self.target, STEP_S)
    }

    /// Sets the motor commands for the target.
    pub(super) fn actuate(&mut self, seen: &Observation) {
        let tips = &seen.hands[self.place].tips;
        let forces: Vec<Vector3<f64>> =
            tips.iter().map(|tip| tip.touches.iter().map(|touch| touch.force).sum()).collect();
        self.executor.set_target(&self.target, &forces);
    }

    /// Returns the current grip force after the behaviors; `None` if the hand holds nothing.
    pub(super) fn grip(&self) -> Option<GripForceTotals> {
        self.behaviors.iter().find_map(|behavior| behavior.grip())
    }

    /// Returns the result of a search in a task.
    pub(super) fn searched(&self, task: usize) -> Option<SearchResult> {
        self.behaviors.iter().find_map(|behavior| behavior.searched(task))
    }
}

impl HandMover for HandAgent<'_> {
    fn moved(&self) -> HandMotion {
        self.executor.moved()
    }

    fn advance(&mut self, pushed: &[TipWrench], dt: f64) {
        self.executor.advance(pushed, dt);
    }
}
