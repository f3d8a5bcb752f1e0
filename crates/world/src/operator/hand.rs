//! One hand that follows its script: goals become motions, which adapt to sensed forces and seen poses.

use super::collide::CollideMotion;
use super::cooperation::{FollowMotion, PartnerHand};
use super::failures::{Failure, with_failure};
use super::goals::{Goal, Step};
use super::grips::{HandGrip, tucked};
use super::guarded_motion::{CloseMotion, GuardedMove, LANDING};
use super::insertion::InsertionMotion;
use super::jam::JamMotion;
use super::motion::{LagFilter, Transport, TurnMotion};
use super::perturbations::{Perturbation, with_perturbations};
use super::press::PressMotion;
use super::rng::{HandTremor, Rng};
use super::sensor_history::{SensorHistory, SensorSample};
use super::slip::SlipMotion;
use super::{Operator, Script};
use crate::{HandTarget, STEP_S, World};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use teachtree_base::error::InputError;
use teachtree_base::hands::Side;
use teachtree_base::scene::{Hand, Scene};

/// The delay of a reflex, s: a finger stops closing, or a hand yields, this long after the force that triggers it. A reaction is slower.
const REFLEX_S: f64 = 0.025;
/// The maximum reaction time, s.
const SLOWEST_S: f64 = 1.0;
/// The admittance of a hand that holds an object still, m/s per N of force beyond the weight.
const YIELDING: f64 = 0.015;
/// The gain (m/s per N) and the maximum speed (m/s) with which the fingers correct a squeeze.
const TIGHTENING: f64 = 0.010;
const TIGHTEST: f64 = 0.010;

/// The first random stream for an operator's strength; each hand has its own stream.
const STRENGTH_STREAM: u64 = 4;
/// The maximum duration of a motion, s.
const PATIENCE_S: f64 = 25.0;
/// Maximum time for which a hand stands still or waits for the other hand, s.
const LONGEST_WAIT_S: f64 = 120.0;
/// A hand without contact with its object for this time (s) has lost the object and returns for it; and the maximum number of returns.
const LOST_S: f64 = 0.2;
const RETRIES: usize = 3;
/// The factor of the squeeze after an object was lost.
const FIRMER: f64 = 1.5;
/// The maximum distance of an object in reach from the palm, m.
const OUT_OF_REACH_M: f64 = 0.4;

/// A hand that follows its script.
pub(crate) struct Performer<'a> {
    pub(super) side: Side,
    /// Index of the hand in the scene.
    index: usize,
    pub(super) hand: &'a Hand,
    pub(super) scene: &'a Scene,
    pub(super) operator: &'a Operator,
    /// The script as this operator performs it, and the index of the next step.
    pub(super) steps: Vec<Step>,
    pub(super) next: usize,
    /// The current step, by its index in the written script.
    pub(super) doing: Option<usize>,
    pub(super) chance: Rng,
    /// The factors of this operator's speeds and squeezes relative to the script.
    pub(super) pace: f64,
    pub(super) strength: f64,
    shaking: HandTremor,
    pub(super) senses: SensorHistory,
    /// The reaction time in steps of the world.
    reaction: usize,
    time: f64,
    /// The current motion, and its duration so far, s.
    motion: Motion,
    since: f64,
    pub(super) palm: Isometry3<f64>,
    /// Fingertip targets in the palm's frame.
    pub(super) tips: Vec<Point3<f64>>,
    glide: LagFilter,
    /// The grip in use.
    pub(super) grip: HandGrip,
    /// The horizontal direction in which the hand approached the grip, unit or zero.
    pub(super) came: Vector3<f64>,
    /// The time without contact with the held object, s, and the number of returns for it.
    empty: f64,
    retries: usize,
}

/// The events at the beginning of a step of the script.
#[derive(Default)]
pub(crate) struct StepStart {
    /// A phase of the script.
    pub(crate) phase: Option<String>,
    /// A perturbation.
    pub(crate) perturbation: Option<Perturbation>,
    /// A failure on purpose.
    pub(crate) failure: Option<Failure>,
    /// Whether the object was lost and the hand returns for it.
    pub(crate) lost: bool,
    /// The index of the previous step in the script, if it took too long and was abandoned.
    pub(crate) left_undone: Option<usize>,
    /// The index of the previous step in the script and the body at which it should have ended, if it went its whole distance without touching that body.
    pub(crate) unmet: Option<(usize, String)>,
}

pub(super) enum Motion {
    /// Waits for this time, s.
    Still(f64),
    Transport(Transport),
    Turn(TurnMotion),
    Close(CloseMotion),
    GuardedMove(GuardedMove),
    Insertion(InsertionMotion),
    Press(PressMotion),
    Slip(SlipMotion),
    Jam(JamMotion),
    Collide(CollideMotion),
    /// Waits until the other hand begins this phase.
    Waiting(String),
    Cooperation(FollowMotion),
}

impl<'a> Performer<'a> {
    /// Returns the hand of this side before its first step.
    ///
    /// # Errors
    /// Names in the script that the scene does not have; numbers that cannot be performed.
    pub(crate) fn new(
        scene: &'a Scene,
        operator: &'a Operator,
        side: Side,
        script: &'a Script,
        world: &World,
        seed: u64,
    ) -> Result<Self, InputError> {
        let keys = format!("operator `{}`, hands.{side}", operator.name);
        let (index, _, hand) = scene
            .hands
            .get_full(&side)
            .ok_or_else(|| InputError::new(&keys, format!("has a script, but the scene has no {side} hand")))?;
        let at = |error: InputError, what: String| {
            let of_grip = error.place.starts_with("grips.");
            let place = if of_grip {
                format!("operator `{}`, {}", operator.name, error.place)
            } else {
                format!("{keys}.{what}")
            };
            InputError { place, ..error }
        };
        let grip = HandGrip::new(&script.start.grip, scene, operator, hand, world)
            .map_err(|error| at(error, "start".into()))?;
        let variation = &operator.variation;
        let mut chance = Rng::new(seed, side.index() as u64);
        let reaction = steps(variation.reaction.0.clamp(0.0, SLOWEST_S));
        let perturbed = with_perturbations(operator, script, side, seed);
        let mut performer = Self {
            side,
            index,
            hand,
            scene,
            operator,
            steps: with_failure(scene, operator, side, seed, perturbed)?,
            doing: None,
            next: 0,
            pace: chance.factor(variation.pace),
            strength: Rng::new(seed, STRENGTH_STREAM + side.index() as u64).between(variation.strength),
            shaking: HandTremor::new(&variation.tremor, &mut chance),
            chance,
            senses: SensorHistory::new(reaction.max(steps(REFLEX_S)), operator.force_scale),
            reaction,
            time: 0.0,
            motion: Motion::Still(0.0),
            since: 0.0,
            palm: Isometry3::identity(),
            tips: hand.fingers.iter().map(|&finger| tucked(finger, side) * operator.hands_scale).collect(),
            glide: LagFilter::default(),
            grip,
            came: Vector3::zeros(),
            empty: 0.0,
            retries: 0,
        };
        for step in &script.steps {
            performer.check(&step.goal, world).map_err(|error| at(error, format!("steps.{}", step.written)))?;
        }
        let grip = performer.grip.clone();
        (performer.palm, performer.tips) = performer.posture(&grip, &script.start, world);
        Ok(performer)
    }

    /// Returns the side of the hand.
    pub(crate) fn side(&self) -> Side {
        self.side
    }

    /// Returns the index of the hand in the scene.
    pub(crate) fn index(&self) -> usize {
        self.index
    }

    /// Returns the number of steps of the script that have not begun.
    pub(crate) fn remaining(&self) -> usize {
        self.steps.len() - self.next
    }

    /// Returns the current target of the device.
    pub(crate) fn target(&self) -> HandTarget {
        let mut palm = self.palm;
        palm.translation.vector += self.shaking.at(self.time);
        HandTarget { palm, tips: self.tips.iter().map(|tip| palm * tip).collect() }
    }

    /// Returns the position of the palm without tremor, m.
    pub(crate) fn stands_at(&self) -> Vector3<f64> {
        self.palm.translation.vector
    }

    /// Advances by a step of the world. Returns the events that begin, or `None` at the end of the script.
    ///
    /// # Errors
    /// None after [`Self::new`] has checked the script.
    pub(crate) fn advance(&mut self, world: &World, other: &PartnerHand) -> Result<Option<StepStart>, InputError> {
        self.time += STEP_S;
        self.since += STEP_S;
        self.senses.record(world.observation(), self.index, self.grip.object);
        let mut begun = StepStart::default();
        let over = self.perform(world, other);
        begun.lost = self.goes_back(world);
        let patient = matches!(self.motion, Motion::Still(_) | Motion::Waiting(_) | Motion::Cooperation(_));
        let gives_up = self.since > if patient { LONGEST_WAIT_S } else { PATIENCE_S };
        if over || begun.lost || gives_up {
            begun.unmet = self.unmet().filter(|_| over && !begun.lost);
            begun.left_undone = self.doing.take().filter(|_| gives_up && !over && !begun.lost);
            let Some(step) = self.steps.get(self.next).cloned() else {
                return Ok((begun.left_undone.is_some() || begun.unmet.is_some()).then_some(begun));
            };
            self.next += 1;
            (begun.phase, begun.perturbation) = (step.phase.clone(), step.perturbation);
            begun.failure = step.failure;
            (self.since, self.doing) = (0.0, Some(step.written).filter(|_| !step.added));
            self.motion = self.begin(&step, world)?;
        }
        self.keep_squeeze();
        Ok(Some(begun))
    }

    /// Returns the finished step and the body at which it should have ended, if it did not touch that body.
    fn unmet(&self) -> Option<(usize, String)> {
        let Motion::GuardedMove(guided) = &self.motion else { return None };
        let (body, _) = self.scene.bodies.get_index(guided.unmet()?)?;
        Some((self.doing?, body.clone()))
    }

    /// Returns whether the held object is lost. The next step is then the reach before the last closing.
    fn goes_back(&mut self, world: &World) -> bool {
        let holding = self.grip.squeeze.is_some() && !matches!(self.motion, Motion::Close(_));
        let feels =
            self.senses.steps_ago(0).is_some_and(|felt| felt.tips.iter().any(|force| *force != Vector3::zeros()));
        self.empty = if holding && !feels { self.empty + STEP_S } else { 0.0 };
        if self.empty < LOST_S || self.retries >= RETRIES {
            return false;
        }
        let position = world.observation().bodies.get(self.grip.object).map(|body| body.pose.translation.vector);
        if position.is_some_and(|position| (position - self.palm.translation.vector).norm() > OUT_OF_REACH_M) {
            // The object fell off the table: the script ends.
            (self.next, self.grip.squeeze) = (self.steps.len(), None);
            return true;
        }
        let before = self.steps.get(..self.next).unwrap_or(&[]);
        let close = before.iter().rposition(|step| matches!(step.goal, Goal::Close(_))).unwrap_or(0);
        let reach = before.iter().take(close).rposition(|step| matches!(step.goal, Goal::Reach(_)));
        let Some(reach) = reach else { return false };
        // A failure occurs only once.
        let mut at = 0..self.next;
        self.steps.retain(|step| !at.next().is_some_and(|at| at > reach && step.added));
        (self.next, self.empty, self.grip.squeeze) = (reach, 0.0, None);
        self.retries += 1;
        self.strength *= FIRMER;
        true
    }

    /// Continues the motion and returns whether it is over.
    fn perform(&mut self, world: &World, other: &PartnerHand) -> bool {
        let reflex = self.senses.steps_ago(steps(REFLEX_S));
        let felt = self.senses.steps_ago(self.reaction);
        let mut wanted = Vector3::zeros();
        let over = match &mut self.motion {
            Motion::Still(duration) => {
                wanted = yielding(reflex, &self.grip);
                self.since >= *duration
            }
            Motion::Waiting(phase) => {
                wanted = yielding(reflex, &self.grip);
                other.has_begun(self.side, phase)
            }
            Motion::Cooperation(along) => {
                self.palm.translation.vector += other.shift;
                wanted = reflex.map_or(wanted, |reflex| along.step(self.since, &self.grip, reflex));
                along.until.as_ref().is_some_and(|phase| other.has_begun(self.side, phase))
                    || self.since >= along.duration
            }
            Motion::Transport(transport) => {
                (self.palm, self.tips) = transport.at(self.since);
                transport.is_over(self.since)
            }
            Motion::Close(closing) => {
                closing.step(self.since, &self.grip, reflex, self.hand.tip_radius.0, &mut self.tips, &mut self.palm)
            }
            Motion::GuardedMove(guided) => {
                let over;
                (wanted, over) = match felt.zip(reflex) {
                    Some((felt, reflex)) => guided.step(&self.grip, world, felt, reflex, &mut self.palm),
                    None => (wanted, false),
                };
                over
            }
            Motion::Insertion(plugging) => {
                if let Some((turn, about)) = plugging.righting(&self.grip, world) {
                    let turn = UnitQuaternion::from_scaled_axis(turn * STEP_S);
                    self.palm.translation.vector = about.coords + turn * (self.palm.translation.vector - about.coords);
                    self.palm.rotation = turn * self.palm.rotation;
                }
                let over;
                (wanted, over) = match felt.zip(reflex) {
                    Some((felt, reflex)) => plugging.step(&self.grip, world, felt, reflex),
                    None => (wanted, false),
                };
                over
            }
            Motion::Press(pressing) => {
                let over;
                (wanted, over) = felt.map_or((wanted, false), |felt| pressing.step(&self.grip, felt));
                over
            }
            Motion::Turn(turning) => {
                self.palm = turning.at(self.since);
                self.since >= turning.duration
            }
            Motion::Jam(jamming) => {
                let over;
                (wanted, over) = felt.map_or((wanted, false), |felt| jamming.step(&self.grip, world, felt, &self.palm));
                over
            }
            Motion::Collide(colliding) => {
                self.palm.translation.vector = colliding.at(self.since);
                colliding.is_over(self.since)
            }
            Motion::Slip(slipping) => {
                reflex.is_some_and(|reflex| slipping.step(&mut self.grip, world, reflex, &self.palm, &mut self.tips))
            }
        };
        // A guided motion blends into the next one without a stop.
        let velocity = self.glide.towards(wanted, STEP_S);
        if !matches!(self.motion, Motion::Transport(_) | Motion::Turn(_) | Motion::Collide(_)) {
            self.palm.translation.vector += velocity * STEP_S;
        }
        over
    }

    /// Corrects the squeeze of holding fingers by the sensed forces.
    fn keep_squeeze(&mut self) {
        if matches!(self.motion, Motion::Close(_) | Motion::Slip(_)) {
            return;
        }
        let (Some(felt), Some(wanted)) = (self.senses.steps_ago(self.reaction), self.grip.squeeze) else { return };
        let squeeze = felt.squeeze(&self.grip, &self.palm);
        let inwards = (TIGHTENING * (wanted - squeeze)).clamp(-TIGHTEST, TIGHTEST) * STEP_S;
        for (finger, contact) in self.grip.contacts.iter().enumerate() {
            let Some((_, normal)) = contact else { continue };
            self.tips[finger] -= normal * inwards;
            // A running transport includes the correction.
            if let Motion::Transport(transport) = &mut self.motion {
                transport.from_tips[finger] -= normal * inwards;
                transport.to_tips[finger] -= normal * inwards;
            }
        }
    }
}

/// Returns the velocity with which a holding hand yields to forces beyond the weight, m/s: a hand does not press on an object that it has set down.
fn yielding(felt: Option<&SensorSample>, grip: &HandGrip) -> Vector3<f64> {
    let Some((felt, _)) = felt.zip(grip.squeeze) else { return Vector3::zeros() };
    let force = felt.total();
    let usual = if force.z < 0.0 { grip.weight.min(LANDING) } else { grip.weight };
    -YIELDING * force * (1.0 - usual / force.norm().max(usual))
}

/// Returns a time in steps of the world.
fn steps(time_s: f64) -> usize {
    (time_s / STEP_S).round() as usize
}
