//! A hand that does its share of each stage: where it begins, and its plans from where it is.

use super::executor::{Executor, beginning};
use super::hand::HandModel;
use super::plan::{Plan, Target};
use super::stage::{Plans, at_task, found, stages};
use super::tree::Robot;
use crate::base::error::InputError;
use crate::base::hands::Side;
use crate::base::scene::Scene;
use crate::command::Task;
use nalgebra::{Isometry3, Vector3};

/// Where an object is, reference frame; `None` for what is no body of the scene.
pub(super) type Place<'a> = dyn Fn(&str) -> Option<Isometry3<f64>> + 'a;

/// A hand, what it was taught with, and whether it has begun.
pub(super) struct Doer {
    pub(super) side: Side,
    pub(super) hand: HandModel,
    /// Radius of the person's fingertips, m.
    taught_radius: f64,
    /// Its first task, and when of the plan of that it begins, s, until that plan is made.
    fresh: Option<(usize, f64)>,
}

impl Doer {
    /// A hand before its first task, with the robot that moves it and what that is to do first.
    pub(super) fn begin(
        side: Side,
        limb: &Robot,
        tasks: &[Task],
        scene: &Scene,
        place: &Place<'_>,
    ) -> Result<(Self, Executor, Target), InputError> {
        let lacks = || InputError::new("commands", "are of no hand of the robot");
        let hand = limb.hands.get(&side).cloned().ok_or_else(lacks)?;
        let taught_radius = scene.hands.get(&side).map_or(0.010, |hand| hand.tip_radius.0);
        let number = tasks.iter().position(|task| task.track == side.name()).ok_or_else(lacks)?;
        let stages = stages(tasks);
        let stage = stages.iter().find(|stage| stage.contains(&number)).map_or(&[][..], Vec::as_slice);
        let mut doer = Self { side, hand, taught_radius, fresh: None };
        let plan = doer.plan(tasks, stage, number, limb, None, place)?;
        let gravity = Vector3::from(scene.gravity.map(|part| part.0));
        let (runs, from_s) =
            beginning(limb, &doer.hand, &plan, gravity).map_err(|message| at_task(tasks, number, message))?;
        doer.fresh = Some((number, from_s));
        let target = plan.at(from_s);
        Ok((doer, runs, target))
    }

    /// Its plans of a stage, one after the other, for a palm that is at `palm`, each stretched by `stretch` from when it begins, s; that returns when that is
    /// afterwards. And when of them it begins, s.
    pub(super) fn plans<'t>(
        &mut self,
        tasks: &'t [Task],
        stage: &[usize],
        limb: &Robot,
        palm: Isometry3<f64>,
        place: &Place<'_>,
        stretch: &mut dyn FnMut(&mut Plan<'t>, f64) -> f64,
    ) -> Result<(Plans<'t>, f64), InputError> {
        // A hand that has not begun is where its first task lets it begin, unless that one is not done.
        let fresh = self.fresh.take_if(|(number, _)| stage.contains(number));
        let mut palm = fresh.is_none().then_some(palm);
        let mut plans: Plans<'t> = Vec::new();
        let mut begins_s = 0.0;
        for &number in stage.iter().filter(|number| tasks[**number].track == self.side.name()) {
            let mut plan = self.plan(tasks, stage, number, limb, palm.as_ref(), place)?;
            let from_s =
                stretch(&mut plan, fresh.filter(|(first, _)| *first == number).map_or(0.0, |(_, from_s)| from_s));
            if plans.is_empty() {
                begins_s = from_s;
            }
            palm = Some(plan.at(plan.duration()).palm);
            plans.push((number, plan));
        }
        Ok((plans, begins_s))
    }

    fn plan<'t>(
        &self,
        tasks: &'t [Task],
        stage: &[usize],
        number: usize,
        limb: &Robot,
        palm: Option<&Isometry3<f64>>,
        place: &Place<'_>,
    ) -> Result<Plan<'t>, InputError> {
        let object = &tasks[number].object;
        let lacks = || at_task(tasks, number, format!("is about `{object}`, which is no body of the scene"));
        if let Some(into) = tasks[number].into.as_ref().filter(|into| place(&into.body).is_none()) {
            return Err(at_task(tasks, number, format!("goes into `{}`, which is no body of the scene", into.body)));
        }
        let found = found(tasks, stage, number, &place(object).ok_or_else(lacks)?);
        let plan = Plan::new(&tasks[number], limb, &self.hand, found, palm, self.taught_radius);
        plan.map_err(|message| at_task(tasks, number, message))
    }
}
