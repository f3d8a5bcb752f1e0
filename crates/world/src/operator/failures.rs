//! Failures on purpose: the seed selects a failure and a hand, and the script of this hand gets the steps of the failure, with or without a second
//! attempt. Failures have their own random streams, so they do not change other recordings.

mod plan;
mod steps;

pub(crate) use plan::obstacles;
pub use plan::{Failure, FailurePlan};

use super::goals::{Carry, Goal, Open, Step};
use super::perturbations::PerturbedScript;
use super::rng::Rng;
use super::{Operator, Script};
use std::ops::Range;
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::quantity::Quantity;
use teachtree_base::scene::{Body, Role, Scene};

/// Random streams, after those of the perturbations: the first one selects the failure, the second one its details.
const STREAM: u64 = 128;

/// The steps of a hand with the failure of a seed, if the seed selects this hand.
///
/// # Errors
/// The scene lacks the obstacle.
pub(super) fn with_failure(
    scene: &Scene,
    operator: &Operator,
    side: Side,
    seed: u64,
    steps: Vec<Step>,
) -> Result<Vec<Step>, InputError> {
    let Some(plan) = &operator.failures else { return Ok(steps) };
    plan.check_obstacle(scene, &operator.name)?;
    let drawn = plan.draw(operator, &mut Rng::new(seed, STREAM), seed).filter(|(_, hand)| *hand == side);
    let Some((failure, _)) = drawn else { return Ok(steps) };
    let script = PerturbedScript { operator, chance: Rng::new(seed, STREAM + 1), steps };
    let mut failing = FailingScript { scene, plan, side, script };
    failing.add(failure);
    Ok(failing.script.steps)
}

/// A script to which a failure is added.
struct FailingScript<'a> {
    scene: &'a Scene,
    plan: &'a FailurePlan,
    side: Side,
    script: PerturbedScript<'a>,
}

impl FailingScript<'_> {
    /// Replaces steps by others: goals, each with the failure that begins with it.
    fn replace(&mut self, range: Range<usize>, goals: Vec<(Goal, Option<Failure>)>) {
        let steps = goals.into_iter().map(|(goal, failure)| Step { failure, ..Step::added(goal) });
        self.script.steps.splice(range, steps);
    }

    /// The goals of the script's own steps in a range, for a second attempt.
    fn again(&self, range: Range<usize>) -> Vec<(Goal, Option<Failure>)> {
        let own = self.script.steps[range].iter().filter(|step| !step.added);
        own.map(|step| (step.goal.clone(), None)).collect()
    }

    /// The index of the first own step from `from` on that opens the hand.
    fn opening(&self, from: usize) -> Option<usize> {
        let steps = self.script.steps.iter().enumerate().skip(from);
        steps.filter(|(_, step)| !step.added).find(|(_, step)| matches!(step.goal, Goal::Open(_))).map(|(at, _)| at)
    }

    /// Whether another hand waits for a phase that begins in these steps.
    fn is_awaited(&self, range: Range<usize>) -> bool {
        let mut phases = self.script.steps[range].iter().filter_map(|step| step.phase.as_ref());
        phases.any(|phase| self.others().any(|script| script.steps.iter().any(|step| waits_for(step, phase))))
    }

    /// The scripts of the other hands.
    fn others(&self) -> impl Iterator<Item = &Script> {
        self.script.operator.hands.iter().filter(|(side, _)| **side != self.side).map(|(_, script)| script)
    }

    /// The body that the grip of a step holds.
    fn object(&self, grip: &str) -> Option<&Body> {
        let grip = self.script.operator.grips.get(grip)?;
        self.scene.bodies.get(&grip.object)
    }

    /// Whether the operator gives up instead of trying again.
    fn gives_up(&mut self) -> bool {
        self.script.chance.share() < 0.5
    }

    /// The first support of the scene.
    fn support(&self) -> Option<&String> {
        self.scene.bodies.iter().find(|(_, body)| body.role == Role::Support).map(|(name, _)| name)
    }
}

/// Whether a step waits for a phase of the other hand.
fn waits_for(step: &Step, phase: &str) -> bool {
    match &step.goal {
        Goal::Wait(awaited) => awaited == phase,
        Goal::Cooperation(along) => along.until.as_deref() == Some(phase),
        _ => false,
    }
}

/// A motion straight up, m and m/s.
fn up(distance: f64, speed: f64) -> Goal {
    let (distance, speed) = (Quantity(distance), Quantity(speed));
    Goal::Carry(Carry { along: [0.0, 0.0, 1.0], distance, speed, until: None, press: None })
}

/// A pause, s.
const fn hold(time: f64) -> Goal {
    Goal::Hold(Quantity(time))
}

/// An opening of the fingers, m and m/s.
const fn open(by: f64, speed: f64) -> Goal {
    Goal::Open(Open { by: Quantity(by), speed: Quantity(speed) })
}
