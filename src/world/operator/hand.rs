//! One hand that follows its script: goals become motions, and what is felt and seen shapes them under way.

use super::grips::{Held, body, refused, tucked};
use super::guided::{Closing, Guided, Pressing};
use super::motion::{Glide, Transport, duration};
use super::senses::Senses;
use super::variation::{Chance, Shaking};
use super::{Carry, Close, Goal, Open, Operator, Reach, Script, Step, Variation};
use crate::base::error::InputError;
use crate::base::hands::{Finger, Side};
use crate::base::scene::{Hand, Scene};
use crate::world::{HandTarget, STEP_S, World};
use nalgebra::{Isometry3, Point3, Vector3};
use std::collections::VecDeque;

/// A finger stops closing, and a hand gives way, this long after it felt enough, s: a reflex, faster than a reaction.
const REFLEX_S: f64 = 0.025;
/// No reaction is slower, s.
const SLOWEST_S: f64 = 1.0;
/// How fast a hand that holds something still gives way to what it feels beyond the weight, m/s per N.
const YIELDING: f64 = 0.015;
/// How fast the fingers correct a squeeze, m/s per N, and at most, m/s.
const TIGHTENING: f64 = 0.010;
const TIGHTEST: f64 = 0.010;

/// A hand that follows its script.
pub(in crate::world) struct Performer<'a> {
    side: Side,
    /// Index of the hand in the scene.
    index: usize,
    hand: &'a Hand,
    scene: &'a Scene,
    operator: &'a Operator,
    steps: VecDeque<&'a Step>,
    chance: Chance,
    /// Today's speeds over those of the script.
    pace: f64,
    shaking: Shaking,
    senses: Senses,
    /// Steps of the world from feeling to acting.
    reaction: usize,
    time: f64,
    /// What it does, and for how long, s.
    motion: Motion,
    since: f64,
    palm: Isometry3<f64>,
    /// Fingertip targets in the palm's frame.
    tips: Vec<Point3<f64>>,
    glide: Glide,
    /// The grip in use.
    grip: Held,
    /// The direction in which the hand came to the grip, horizontal, unit or zero.
    came: Vector3<f64>,
}

enum Motion {
    /// Stays until this time is over, s.
    Still(f64),
    Transport(Transport),
    Closing(Closing),
    Guided(Guided),
}

impl<'a> Performer<'a> {
    /// The hand of this side, about to begin.
    ///
    /// # Errors
    /// Names in the script that the scene does not have; numbers that cannot be performed.
    pub(in crate::world) fn new(
        scene: &'a Scene,
        operator: &'a Operator,
        side: Side,
        script: &'a Script,
        world: &World,
        seed: u64,
    ) -> Result<Self, InputError> {
        let place = format!("operator `{}`, {side} hand", operator.name);
        let (index, _, hand) = scene
            .hands
            .get_full(&side)
            .ok_or_else(|| InputError::new(&place, format!("has a script, but the scene has no {side} hand")))?;
        let at = |error: InputError, what: String| InputError { place: format!("{place}, {what}"), ..error };
        let grip =
            Held::new(&script.start.grip, scene, operator, hand, world).map_err(|error| at(error, "start".into()))?;
        let variation = &operator.variation;
        let mut chance = Chance::new(seed, side.index() as u64);
        let reaction = steps(variation.reaction.0.clamp(0.0, SLOWEST_S));
        let mut performer = Self {
            side,
            index,
            hand,
            scene,
            operator,
            steps: script.steps.iter().collect(),
            pace: chance.factor(variation.pace),
            shaking: Shaking::new(&variation.tremor, &mut chance),
            chance,
            senses: Senses::new(reaction.max(steps(REFLEX_S))),
            reaction,
            time: 0.0,
            motion: Motion::Still(0.0),
            since: 0.0,
            palm: Isometry3::identity(),
            tips: hand.fingers.iter().map(|&finger| tucked(finger, side)).collect(),
            glide: Glide::default(),
            grip,
            came: Vector3::zeros(),
        };
        for (number, step) in script.steps.iter().enumerate() {
            performer.check(&step.goal, world).map_err(|error| at(error, format!("step {}", number + 1)))?;
        }
        let grip = performer.grip.clone();
        (performer.palm, performer.tips) = performer.posture(&grip, &script.start, world);
        Ok(performer)
    }

    /// Which hand it is.
    pub(in crate::world) fn side(&self) -> Side {
        self.side
    }

    /// Index of the hand in the scene.
    pub(in crate::world) fn index(&self) -> usize {
        self.index
    }

    /// How many steps of the script have not begun.
    pub(in crate::world) fn remaining(&self) -> usize {
        self.steps.len()
    }

    /// Where the device is now.
    pub(in crate::world) fn target(&self) -> HandTarget {
        let mut palm = self.palm;
        palm.translation.vector += self.shaking.at(self.time);
        HandTarget { palm, tips: self.tips.iter().map(|tip| palm * tip).collect() }
    }

    /// Lets a step of the world go by; `None` when the script is over, else the phase that begins, if one does.
    ///
    /// # Errors
    /// None after [`Self::new`] has checked the script.
    pub(in crate::world) fn advance(&mut self, world: &World) -> Result<Option<Option<&'a str>>, InputError> {
        self.time += STEP_S;
        self.since += STEP_S;
        self.senses.take_in(world.observation(), self.index, self.grip.object);
        let mut begun = None;
        if self.perform(world) {
            let Some(step) = self.steps.pop_front() else { return Ok(None) };
            begun = step.phase.as_deref();
            self.since = 0.0;
            self.motion = self.begin(&step.goal, world)?;
        }
        self.keep_squeeze();
        Ok(Some(begun))
    }

    /// Refuses what cannot be performed.
    fn check(&self, goal: &Goal, world: &World) -> Result<(), InputError> {
        match goal {
            Goal::Reach(reach) => {
                Held::new(&reach.grip, self.scene, self.operator, self.hand, world)?;
                positive("speed", reach.speed.0, 5.0)?;
            }
            Goal::Close(close) => {
                positive("speed", close.speed.0, 1.0)?;
                positive("force", close.force.0, 20.0)?;
            }
            Goal::Carry(carry) => {
                positive("speed", carry.speed.0, 5.0)?;
                positive("distance", carry.distance.0, 10.0)?;
                direction("along", carry.along)?;
                if let Some(until) = &carry.until {
                    body(self.scene, &until.contact)?;
                }
                if let Some(press) = &carry.press {
                    direction("toward", press.toward)?;
                    body(self.scene, &press.against)?;
                }
            }
            Goal::Open(open) => positive("speed", open.speed.0, 1.0)?,
            Goal::Hold(time) => positive("hold", time.0, 60.0)?,
        }
        Ok(())
    }

    fn variation(&self) -> &'a Variation {
        &self.operator.variation
    }

    /// Palm and fingertips at the end of a reach, without any variation.
    fn posture(&self, grip: &Held, reach: &Reach, world: &World) -> (Isometry3<f64>, Vec<Point3<f64>>) {
        let mut palm = grip.palm(world);
        palm.translation.vector += Vector3::from(reach.offset.map(|length| length.0));
        (palm, grip.opened(reach.opened.0, self.hand, self.side))
    }

    fn begin(&mut self, goal: &Goal, world: &World) -> Result<Motion, InputError> {
        Ok(match goal {
            Goal::Reach(reach) => self.begin_reach(reach, world)?,
            Goal::Close(close) => self.begin_close(close),
            Goal::Carry(carry) => self.begin_carry(carry, world)?,
            Goal::Open(open) => self.begin_open(open),
            Goal::Hold(time) => Motion::Still(time.0 * self.chance.factor(self.variation().pace / 2.0)),
        })
    }

    fn begin_reach(&mut self, reach: &Reach, world: &World) -> Result<Motion, InputError> {
        let variation = self.variation();
        let grip = Held::new(&reach.grip, self.scene, self.operator, self.hand, world)?;
        let (mut to_palm, to_tips) = self.posture(&grip, reach, world);
        let horizontal = |vector: Vector3<f64>| Vector3::new(vector.x, vector.y, 0.0);
        self.came = horizontal(to_palm.translation.vector - self.palm.translation.vector)
            .try_normalize(1e-3)
            .unwrap_or_default();
        to_palm.translation.vector +=
            Vector3::new(self.chance.either_way(), self.chance.either_way(), 0.0) * variation.aim.0;
        if matches!(self.steps.front(), Some(Step { goal: Goal::Close(_), .. })) && grip.is_opposed(self.hand) {
            // People reckon with their overrun: the fingers meet the object half way through it.
            to_palm.translation.vector -= self.came * variation.overrun.0 / 2.0;
        }
        let way = to_palm.translation.vector - self.palm.translation.vector;
        let fingers = self.tips.iter().zip(&to_tips).map(|(from, to)| (to - from).norm()).fold(0.0, f64::max);
        let arch = self.across(way) * variation.path.0.min(way.norm() / 6.0) * self.chance.either_way();
        let speed = reach.speed.0 * self.pace_now();
        self.grip = grip;
        Ok(self.transport(to_palm, to_tips, Vec::new(), arch, duration(way.norm().max(fingers), speed)))
    }

    fn begin_close(&mut self, close: &Close) -> Motion {
        let variation = self.variation();
        let force = close.force.0 * self.chance.factor(variation.squeeze);
        let opposed = self.grip.is_opposed(self.hand);
        let others = self.grip.used().saturating_sub(1).max(1) as f64;
        let share = |&finger: &Finger| if opposed && finger != Finger::Thumb { force / others } else { force };
        self.grip.squeeze = opposed.then_some(force);
        // Only a hand that closes around something still moves on; one that lays its fingers on stops first.
        let further = if opposed { variation.overrun.0 * (0.75 + 0.5 * self.chance.share()) } else { 0.0 };
        Motion::Closing(Closing {
            delays: self.delays(variation.arrival.0),
            stopped: self.grip.contacts.iter().map(Option::is_none).collect(),
            share: self.hand.fingers.iter().map(share).collect(),
            speed: close.speed.0 * self.pace,
            overrun: self.came * further,
            overrun_time: variation.overrun_time.0,
        })
    }

    fn begin_open(&mut self, open: &Open) -> Motion {
        self.grip.squeeze = None;
        // The forces fade together: a finger that presses harder goes further. Fingers leave more evenly than they arrive.
        let pressed: Vec<f64> = match self.senses.ago(0) {
            Some(felt) => felt.tips.iter().map(|force| force.norm()).collect(),
            None => vec![0.0; self.tips.len()],
        };
        let mean = pressed.iter().sum::<f64>() / self.grip.used().max(1) as f64;
        let to_tips =
            self.tips.iter().zip(&self.grip.contacts).zip(&pressed).map(|((tip, contact), pressed)| match contact {
                Some((_, normal)) if mean > 0.0 => tip + normal * open.by.0 * (pressed / mean).clamp(0.5, 2.0),
                Some((_, normal)) => tip + normal * open.by.0,
                None => *tip,
            });
        let to_tips = to_tips.collect();
        let delays = self.delays(self.variation().arrival.0 / 4.0);
        self.transport(self.palm, to_tips, delays, Vector3::zeros(), duration(open.by.0, open.speed.0 * self.pace))
    }

    fn begin_carry(&mut self, carry: &Carry, world: &World) -> Result<Motion, InputError> {
        let along = direction("along", carry.along)?;
        let speed = carry.speed.0 * self.pace_now();
        let distance = carry.distance.0;
        if carry.until.is_none() && carry.press.is_none() {
            let mut to_palm = self.palm;
            to_palm.translation.vector += along * distance;
            let arch = self.across(along) * self.variation().path.0.min(distance / 12.0) * self.chance.either_way();
            // Upwards only: what is carried may be near the ground.
            let arch = Vector3::new(arch.x, arch.y, arch.z.abs());
            return Ok(self.transport(to_palm, self.tips.clone(), Vec::new(), arch, duration(distance, speed)));
        }
        let until =
            carry.until.as_ref().map(|until| body(self.scene, &until.contact).map(|body| (body, until.within.0)));
        let until = until.transpose()?;
        let press = match &carry.press {
            None => None,
            Some(press) => Some(Pressing {
                against: body(self.scene, &press.against)?,
                toward: direction("toward", press.toward)?,
                force: press.force.0,
                waver: press.waver.0 * (0.75 + 0.5 * self.chance.share()) * self.chance.either_way().signum(),
                span: until.map_or(distance, |(until, _)| world.gap(self.grip.object, until).min(distance)).max(STEP_S),
                wavered: 0.0,
            }),
        };
        Ok(Motion::Guided(Guided { along, speed, distance, gone: 0.0, until, press }))
    }

    /// A motion from here.
    fn transport(
        &self,
        to_palm: Isometry3<f64>,
        to_tips: Vec<Point3<f64>>,
        delays: Vec<f64>,
        arch: Vector3<f64>,
        duration: f64,
    ) -> Motion {
        let (from_palm, from_tips) = (self.palm, self.tips.clone());
        Motion::Transport(Transport { from_palm, to_palm, from_tips, to_tips, delays, arch, duration })
    }

    /// Speeds of this motion over those of the script.
    fn pace_now(&mut self) -> f64 {
        self.pace * self.chance.factor(self.variation().pace / 4.0)
    }

    /// How late each finger starts, s.
    fn delays(&mut self, latest: f64) -> Vec<f64> {
        self.hand.fingers.iter().map(|_| latest * self.chance.share()).collect()
    }

    /// Some direction across a way.
    fn across(&mut self, way: Vector3<f64>) -> Vector3<f64> {
        let some = self.chance.direction();
        way.try_normalize(1e-6).map_or(some, |along| some - along * some.dot(&along))
    }

    /// Goes on with the motion; whether it is over.
    fn perform(&mut self, world: &World) -> bool {
        let reflex = self.senses.ago(steps(REFLEX_S));
        let mut wanted = Vector3::zeros();
        let over = match &mut self.motion {
            Motion::Still(duration) => {
                if let (Some(reflex), Some(_)) = (reflex, self.grip.squeeze) {
                    let force = reflex.total();
                    wanted = -YIELDING * force * (1.0 - self.grip.weight / force.norm().max(self.grip.weight));
                }
                self.since >= *duration
            }
            Motion::Transport(transport) => {
                (self.palm, self.tips) = transport.at(self.since);
                transport.is_over(self.since)
            }
            Motion::Closing(closing) => {
                closing.step(self.since, &self.grip, reflex, self.hand.tip_radius.0, &mut self.tips, &mut self.palm)
            }
            Motion::Guided(guided) => {
                let over;
                (wanted, over) = match self.senses.ago(self.reaction).zip(reflex) {
                    Some((felt, reflex)) => guided.step(&self.grip, world, felt, reflex, &mut self.palm),
                    None => (wanted, false),
                };
                over
            }
        };
        // A guided motion fades into what follows instead of stopping first.
        let velocity = self.glide.towards(wanted, STEP_S);
        if !matches!(self.motion, Motion::Transport(_)) {
            self.palm.translation.vector += velocity * STEP_S;
        }
        over
    }

    /// Fingers that hold something feel how hard, and correct it.
    fn keep_squeeze(&mut self) {
        if matches!(self.motion, Motion::Closing(_)) {
            return;
        }
        let (Some(felt), Some(wanted)) = (self.senses.ago(self.reaction), self.grip.squeeze) else { return };
        let pressed = felt
            .tips
            .iter()
            .zip(&self.grip.contacts)
            .filter_map(|(force, contact)| Some(-force.dot(&(self.palm * contact.as_ref()?.1))));
        let squeeze = pressed.sum::<f64>() / 2.0;
        let inwards = (TIGHTENING * (wanted - squeeze)).clamp(-TIGHTEST, TIGHTEST) * STEP_S;
        for (finger, contact) in self.grip.contacts.iter().enumerate() {
            let Some((_, normal)) = contact else { continue };
            self.tips[finger] -= normal * inwards;
            // A transport that is under way carries the correction along.
            if let Motion::Transport(transport) = &mut self.motion {
                transport.from_tips[finger] -= normal * inwards;
                transport.to_tips[finger] -= normal * inwards;
            }
        }
    }
}

/// This time in steps of the world.
fn steps(time_s: f64) -> usize {
    (time_s / STEP_S).round() as usize
}

fn positive(what: &str, value: f64, most: f64) -> Result<(), InputError> {
    if value > 0.0 && value <= most {
        return Ok(());
    }
    Err(refused(format!("has {what} {value} (SI), wanted more than 0 and at most {most}")))
}

fn direction(what: &str, vector: [f64; 3]) -> Result<Vector3<f64>, InputError> {
    let found = Vector3::from(vector).try_normalize(1e-6).filter(|vector| vector.iter().all(|part| part.is_finite()));
    found.ok_or_else(|| refused(format!("has {what} {vector:?}, wanted a direction that is not zero")))
}
