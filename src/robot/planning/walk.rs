//! What a hand with its arm does in a group of tasks, by inverse kinematics alone: its shapes step by step, to be held against those of the other hand.

use super::hand_planner::{HandPlanner, Place};
use super::moving::Moving;
use super::schedule::EASED_S;
use super::time_scale::{Part, TimeScale};
use crate::base::error::InputError;
use crate::base::scene::Scene;
use crate::command::Task;
use crate::robot::kinematics::limb_gap::{PlacedShape, limb_gap, placed};
use crate::robot::model::robot::Robot;
use std::collections::BTreeMap;

/// Arms that are so far apart leave room for each other, m: what controllers deviate from their ways is less.
pub(super) const ROOM_M: f64 = 0.005;
/// Arms are looked at this often, s, first at every so many of these steps: most pairs that meet do so for longer.
const STEP_S: f64 = 0.02;
const STRIDES: [usize; 2] = [16, 1];

/// What a hand does in a group of tasks, step by step of its own time.
pub(super) struct Walk {
    /// The posture in which its arm begins.
    pub(super) arm: BTreeMap<String, f64>,
    /// The planner of the hand, before the first task.
    pub(super) planner: HandPlanner,
    parts: Vec<Part>,
    begins_s: f64,
    steps: Vec<Vec<PlacedShape>>,
}

/// A step at which two walks come near to each other.
pub(super) struct Near {
    /// The step of each.
    pub(super) steps: [usize; 2],
    /// By how much they are nearer than they should be, m.
    pub(super) by: f64,
}

impl Walk {
    /// The walks of the hand of a task, one from each of the best postures, so many at most, from which its arm can go it.
    pub(super) fn all(
        tasks: &[Task],
        number: usize,
        robot: &Robot,
        scene: &Scene,
        most: usize,
    ) -> Result<Vec<Self>, InputError> {
        let side = tasks[number].track;
        let place = |object: &str| {
            let first = tasks.iter().find(|task| task.object == object).map(Task::taken_at);
            first.or_else(|| scene.bodies.get(object).map(|body| body.pose()))
        };
        let begun = Moving::begin(side, &robot.limb(side)?, tasks, scene, &place)?;
        let mut different: Vec<Moving> = Vec::new();
        for hand in begun {
            // A joint that is turned all the way round is where it was.
            let same = |other: &Moving| {
                hand.q.iter().zip(&other.q).all(|(a, b)| (a - b).sin().abs() < 1e-3 && (a - b).cos() > 0.0)
            };
            if !different.iter().any(same) {
                different.push(hand);
            }
        }
        Ok(different.into_iter().filter_map(|hand| Self::of(hand, tasks, &place)).take(most).collect())
    }

    /// The walk of a hand; `None` for one that the arm cannot go.
    fn of(mut hand: Moving, tasks: &[Task], place: &Place<'_>) -> Option<Self> {
        let arm = hand.planner.hand.arm.iter().map(|dof| (hand.limb.tree.dofs[*dof].name.clone(), hand.q[*dof]));
        let arm = arm.collect();
        let group: Vec<usize> = (0..tasks.len()).collect();
        let planner = hand.planner.clone();
        let made = hand.planner.plans(tasks, &group, &hand.limb, hand.palm, place, &mut |_, from_s| from_s).ok()?;
        let parts = made.plans.iter().flat_map(|(_, plan)| plan.parts()).collect();
        let (mut steps, mut done_s) = (Vec::new(), 0.0);
        for (number, plan) in &made.plans {
            let own_s = |step: usize| made.begins_s + step as f64 * STEP_S - done_s;
            while own_s(steps.len()) <= plan.duration() {
                let own_s = own_s(steps.len());
                hand.advance((*number, plan, own_s), done_s + own_s).ok()?;
                let poses = hand.limb.tree.forward_kinematics(&hand.q);
                let poses: Vec<_> = poses.iter().map(|pose| hand.root * pose).collect();
                steps.push(placed(&hand.limb.tree, &poses));
            }
            done_s += plan.duration();
        }
        Some(Self { arm, planner, parts, begins_s: made.begins_s, steps })
    }

    /// Its shapes at a step.
    pub(super) fn at(&self, step: usize) -> &[PlacedShape] {
        self.steps.get(step).or(self.steps.last()).map_or(&[], Vec::as_slice)
    }

    /// The time in its plans at a step, s.
    pub(super) fn own_s(&self, step: usize) -> f64 {
        self.begins_s + step as f64 * STEP_S
    }

    /// The smallest gap to the hand of another walk, m; as soon as it is no more than `least`, that is the answer.
    pub(super) fn gap(&self, other: &Self, least: f64) -> f64 {
        let walks = [self, other];
        let time = time_of(&walks);
        let all = (time.over() / STEP_S) as usize;
        let mut gap = f64::INFINITY;
        for step in STRIDES.into_iter().flat_map(|stride| (0..=all).step_by(stride)) {
            let [one, other] = steps(&walks, &time, step);
            gap = limb_gap(self.at(one), walks[1].at(other), gap).map_or(gap, |found| found.gap);
            if gap <= least {
                break;
            }
        }
        gap
    }

    /// The steps at which two walks are nearer to each other than `room`, m.
    pub(super) fn near(&self, other: &Self, room: f64) -> Vec<Near> {
        let walks = [self, other];
        let time = time_of(&walks);
        let all = (time.over() / STEP_S) as usize;
        let near = (0..=all).filter_map(|step| {
            let steps = steps(&walks, &time, step);
            let found = limb_gap(self.at(steps[0]), other.at(steps[1]), room)?;
            Some(Near { steps, by: room - found.gap })
        });
        near.collect()
    }
}

/// The time scale of two walks.
fn time_of(walks: &[&Walk; 2]) -> TimeScale {
    TimeScale::of(&walks.map(|walk| walk.parts.clone()), EASED_S)
}

/// The step of each of two walks at a step of the time of both.
fn steps(walks: &[&Walk; 2], time: &TimeScale, step: usize) -> [usize; 2] {
    [0, 1].map(|hand| {
        let since_s = (time.at(hand, step as f64 * STEP_S) - walks[hand].begins_s).max(0.0);
        (since_s / STEP_S).round() as usize
    })
}
