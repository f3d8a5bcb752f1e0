//! The tolerance of contact forces: what the operator pressed with, as far as a robot may be from it.
//!
//! A task keeps its profile when
//! - each fingertip presses into the surface as it is asked to, within [`WITHIN_N`] or [`WITHIN`] of that, for [`MOSTLY`] of the time in which it is asked to;
//! - the total force of the hand on the object is as near to the one that is asked for, for as long; of that, the shares count of what the fingers press with;
//! - no fingertip presses harder than the hardest that was demonstrated, times [`FIRMER`] and [`WITHIN_N`] more, nor than the hand may.
//!
//! What is asked for is what was demonstrated, more firmly where the hand feels the object about to slip (`grip_force`).

use crate::base::hands::Finger;
use crate::command::Task;
use crate::robot::model::hand::HandModel;
use crate::robot::planning::plan::Target;
use crate::robot::simulation::observer::{Observer, Step};
use crate::world::TipState;
use nalgebra::Vector3;

/// Forces may be this much off, N, or this share of what is asked for.
pub const WITHIN_N: f64 = 0.3;
/// The share.
pub const WITHIN: f64 = 0.3;
/// For at least this share of the time.
pub const MOSTLY: f64 = 0.9;
/// A hand that feels slip may press this many times as hard as the hardest that was demonstrated.
pub const FIRMER: f64 = 2.5;
/// Less than this is not asked for, N.
const ASKED_N: f64 = 0.05;

/// How a task's forces were beside those that it asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Forces {
    /// The share of the time, over all fingers, in which one pressed as it was asked to.
    pub fingers: f64,
    /// The share of the time in which the total force was as it was asked for.
    pub total: f64,
    /// How hard the fingertip pressed that did so most above what it might, or least below, N.
    pub largest: f64,
    /// How hard that one might, N.
    pub allowed: f64,
    /// Whether no fingertip pressed harder than it might.
    pub below: bool,
}

impl Forces {
    /// Whether all of the profile is kept.
    pub fn kept(&self) -> bool {
        self.below && self.fingers >= MOSTLY && self.total >= MOSTLY
    }
}

/// The forces of each task.
pub(in crate::robot::simulation) struct ForceTolerance {
    tasks: Vec<Tally>,
}

impl ForceTolerance {
    /// The forces of tasks before any step.
    pub(in crate::robot::simulation) fn new(tasks: &[Task]) -> Self {
        Self { tasks: tasks.iter().map(Tally::of).collect() }
    }

    /// Returns how the forces of a task were.
    pub(in crate::robot::simulation) fn judge(&self, task: usize) -> Forces {
        self.tasks[task].judge()
    }
}

impl Observer for ForceTolerance {
    fn look(&mut self, step: &Step<'_>) {
        for (hand, felt) in step.hands.iter().zip(&step.seen.hands) {
            if let Some(doing) = hand.doing {
                self.tasks[doing.task].note(&hand.target, &hand.planner.hand, &felt.tips, doing.body);
            }
        }
    }
}

/// Gathers forces while a task is performed.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    fingers: Share,
    total: Share,
    /// How hard the worst fingertip pressed, and how hard it might, N.
    worst: Option<[f64; 2]>,
    hardest_demonstrated: f64,
}

/// How often something was so.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    so: usize,
    of: usize,
}

impl Share {
    fn note(&mut self, so: bool) {
        self.of += 1;
        self.so += usize::from(so);
    }

    fn value(self) -> f64 {
        if self.of == 0 { 1.0 } else { self.so as f64 / self.of as f64 }
    }
}

impl Tally {
    /// The profile of a task.
    fn of(task: &Task) -> Self {
        let tips = task.segments.iter().flat_map(|segment| &segment.tips).flat_map(|tip| &tip.force);
        let hardest_demonstrated = tips.map(|force| Vector3::from(*force).norm()).fold(0.0, f64::max);
        Self { hardest_demonstrated, ..Self::default() }
    }

    fn allowed(&self) -> f64 {
        self.hardest_demonstrated * FIRMER + WITHIN_N
    }

    /// A step of it: the fingertips on `body` beside those of the target.
    fn note(&mut self, target: &Target, hand: &HandModel, tips: &[TipState], body: usize) {
        let (mut asked_of_all, mut total, mut sum) = (Vector3::zeros(), Vector3::zeros(), 0.0);
        for tip in tips {
            let exerted = tip.force_on(body);
            total += exerted;
            let limit = hand.finger(tip.finger).map_or(f64::INFINITY, |finger| finger.force).min(self.allowed());
            if self.worst.is_none_or(|[pressed, might]| exerted.norm() - limit > pressed - might) {
                self.worst = Some([exerted.norm(), limit]);
            }
            let Some(asked) = asked(target, tip.finger).filter(|asked| asked.norm() > ASKED_N) else { continue };
            asked_of_all += asked;
            sum += asked.norm();
            let touch = tip.touches.iter().find(|touch| touch.body == body);
            let inward = touch.map_or_else(|| asked.normalize(), |touch| -touch.normal);
            let (wanted, pressed) = (asked.dot(&inward), exerted.dot(&inward));
            self.fingers.note((pressed - wanted).abs() <= WITHIN_N.max(WITHIN * wanted));
        }
        if sum > ASKED_N {
            self.total.note((total - asked_of_all).norm() <= WITHIN_N.max(WITHIN * sum));
        }
    }

    /// What came of it.
    fn judge(&self) -> Forces {
        let [largest, allowed] = self.worst.unwrap_or([0.0, self.allowed()]);
        Forces { fingers: self.fingers.value(), total: self.total.value(), largest, allowed, below: largest <= allowed }
    }
}

fn asked(target: &Target, finger: Finger) -> Option<Vector3<f64>> {
    target.tips.iter().find(|(other, ..)| *other == finger).map(|(.., force)| *force)
}
