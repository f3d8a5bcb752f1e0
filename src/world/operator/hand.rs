//! One hand that follows its script: goals become motions, and what is felt and seen shapes them under way.

use super::motion::{Glide, Transport, bump, duration, minimum_jerk};
use super::senses::{Glimpse, Senses};
use super::variation::{Chance, Shaking};
use super::{Carry, Close, Goal, Grip, Open, Operator, Reach, Script, Step, Variation};
use crate::base::error::InputError;
use crate::base::hands::{Finger, Side};
use crate::base::scene::Scene;
use crate::world::{HandTarget, STEP_S, World};
use nalgebra::{Isometry3, Point3, Vector3};
use std::collections::VecDeque;

/// The palm is above the middle of the contact points by this, m.
const PALM_ABOVE_M: f64 = 0.100;
/// A finger stops closing this long after it felt enough, s: a reflex, faster than a reaction.
const REFLEX_S: f64 = 0.025;
/// Fingers that find nothing stop this far below the surface, m.
const CLOSED_BELOW_M: f64 = 0.020;
/// The hand is slower than this when it expects a contact, m/s.
const ARRIVING: f64 = 0.015;
/// It is faster by this for every metre that is left, 1/s.
const SLOWING: f64 = 3.0;
/// Speed at which a lost contact is sought, m/s.
const SEEKING: f64 = 0.025;
/// How fast the hand follows a force that is too large or too small while it moves, m/s per N.
const FOLLOWING: f64 = 0.006;
/// A moving hand eases off when it meets more than this, N, or more than the weight of what it handles, and turns back at three times as much.
const EASING: f64 = 0.5;
/// How fast a hand that stays gives way to what it feels beyond the weight it holds, m/s per N.
const YIELDING: f64 = 0.015;
/// How fast the fingers correct a squeeze, m/s per N.
const TIGHTENING: f64 = 0.010;

/// A hand that follows its script.
pub(in crate::world) struct Performer<'a> {
    side: Side,
    /// Index of the hand in the scene.
    hand: usize,
    scene: &'a Scene,
    operator: &'a Operator,
    tip_radius: f64,
    fingers: &'a [Finger],
    steps: VecDeque<&'a Step>,
    chance: Chance,
    /// Today's speeds over those of the script.
    pace: f64,
    shaking: Shaking,
    senses: Senses,
    time: f64,
    /// What it does, and for how long, s.
    motion: Motion,
    since: f64,
    palm: Isometry3<f64>,
    /// Fingertip targets in the palm's frame.
    tips: Vec<Point3<f64>>,
    glide: Glide,
    /// The grip in use.
    grip: Option<Held>,
    /// The direction in which the hand came to the grip, horizontal, unit or zero.
    came: Vector3<f64>,
}

/// A grip as the hand knows it.
#[derive(Clone)]
struct Held {
    object: usize,
    /// Weight of the object, N, as a hand knows it that has lifted it before.
    weight: f64,
    palm_in_object: Isometry3<f64>,
    /// For each finger of the hand: contact point and unit normal out of the object, palm frame; `None` for a finger that is not used.
    contacts: Vec<Option<(Point3<f64>, Vector3<f64>)>>,
    /// The squeeze to keep, N.
    squeeze: Option<f64>,
}

enum Motion {
    /// Stays until this time is over, s.
    Still(f64),
    Transport(Transport),
    Closing {
        delays: Vec<f64>,
        stopped: Vec<bool>,
        share: Vec<f64>,
        speed: f64,
        overrun: Vector3<f64>,
    },
    Guided(Guided),
}

/// A straight way that is guided by touch.
struct Guided {
    along: Vector3<f64>,
    speed: f64,
    distance: f64,
    gone: f64,
    /// The body that ends it, and the distance at which it does.
    until: Option<(usize, f64)>,
    press: Option<Pressing>,
}

struct Pressing {
    against: usize,
    toward: Vector3<f64>,
    force: f64,
    /// How far the hand wavers, m, signed, over this much of the way, m; and how far it has.
    waver: f64,
    span: f64,
    wavered: f64,
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
        let (hand, body) = scene
            .hands
            .get_index_of(&side)
            .zip(scene.hands.get(&side))
            .ok_or_else(|| InputError::new(&place, format!("has a script, but the scene has no {side} hand")))?;
        let variation = &operator.variation;
        let mut chance = Chance::new(seed, side.index() as u64);
        let mut performer = Self {
            side,
            hand,
            scene,
            operator,
            tip_radius: body.tip_radius.0,
            fingers: &body.fingers,
            steps: script.steps.iter().collect(),
            pace: chance.factor(variation.pace),
            shaking: Shaking::new(&variation.tremor, &mut chance),
            chance,
            senses: Senses::new((variation.reaction.0.clamp(0.0, 1.0) / STEP_S) as usize),
            time: 0.0,
            motion: Motion::Still(0.0),
            since: 0.0,
            palm: Isometry3::identity(),
            tips: body.fingers.iter().map(|&finger| tucked(finger, side)).collect(),
            glide: Glide::default(),
            grip: None,
            came: Vector3::zeros(),
        };
        for (number, step) in script.steps.iter().enumerate() {
            performer
                .check(&step.goal, world)
                .map_err(|error| InputError::new(format!("{place}, step {}", number + 1), error.message))?;
        }
        performer
            .check(&Goal::Reach(script.start.clone()), world)
            .map_err(|error| InputError::new(format!("{place}, start"), error.message))?;
        performer.start(&script.start, world)?;
        Ok(performer)
    }

    /// Which hand it is.
    pub(in crate::world) fn side(&self) -> Side {
        self.side
    }

    /// Index of the hand in the scene.
    pub(in crate::world) fn hand(&self) -> usize {
        self.hand
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

    /// Lets a step of the world go by; `None` when the script is over. Says which phase begins, if one does.
    pub(in crate::world) fn advance(&mut self, world: &World) -> Result<Option<Option<&'a str>>, InputError> {
        self.time += STEP_S;
        self.since += STEP_S;
        let object = self.grip.as_ref().map_or(usize::MAX, |grip| grip.object);
        self.senses.take_in(world.observation(), self.hand, object);
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
    fn check(&mut self, goal: &Goal, world: &World) -> Result<(), InputError> {
        match goal {
            Goal::Reach(reach) => {
                self.held(&reach.grip, world)?;
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
                    self.body(&until.contact)?;
                }
                if let Some(press) = &carry.press {
                    direction("toward", press.toward)?;
                    self.body(&press.against)?;
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

    fn body(&self, name: &str) -> Result<usize, InputError> {
        self.scene.bodies.get_index_of(name).ok_or_else(|| {
            let known: Vec<_> = self.scene.bodies.keys().map(|name| format!("`{name}`")).collect();
            InputError::new("", format!("names the body `{name}`, the scene has {}", known.join(", ")))
        })
    }

    /// A grip by its name, with the fingers of this hand.
    fn held(&self, name: &str, world: &World) -> Result<Held, InputError> {
        let refuse = |message: String| InputError::new("", message);
        let known = || self.operator.grips.keys().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        let grip: &Grip = self
            .operator
            .grips
            .get(name)
            .ok_or_else(|| refuse(format!("names the grip `{name}`, the operator has {}", known())))?;
        let object = self.body(&grip.object)?;
        if let Some(finger) = grip.contacts.keys().find(|finger| !self.fingers.contains(finger)) {
            return Err(refuse(format!(
                "the grip `{name}` uses the {finger}, which the {} hand of the scene does not have",
                self.side
            )));
        }
        if grip.contacts.is_empty() {
            return Err(refuse(format!("the grip `{name}` has no contacts, wanted at least one finger")));
        }
        let surface = |contact: &[crate::base::quantity::Length; 3]| {
            let point = Point3::from(contact.map(|length| length.0));
            world.surface(object, point).ok_or_else(|| refuse(format!("the grip `{name}` is on no body")))
        };
        let gravity = Vector3::from(self.scene.gravity.map(|part| part.0)).norm();
        let mass = self.scene.bodies.get_index(object).and_then(|(_, body)| body.mass).map_or(0.0, |mass| mass.0);
        let weight = (mass * gravity).max(1e-3);
        let middle =
            grip.contacts.values().map(|contact| Vector3::from(contact.map(|length| length.0))).sum::<Vector3<f64>>()
                / grip.contacts.len() as f64;
        let palm =
            grip.palm.map_or(middle + Vector3::z() * PALM_ABOVE_M, |palm| Vector3::from(palm.map(|length| length.0)));
        let palm_in_object = Isometry3::from_parts(palm.into(), nalgebra::UnitQuaternion::identity());
        let mut contacts = Vec::with_capacity(self.fingers.len());
        for finger in self.fingers {
            let contact = grip.contacts.get(finger).map(surface).transpose()?;
            contacts.push(contact.map(|(point, normal)| {
                (palm_in_object.inverse_transform_point(&point), palm_in_object.inverse_transform_vector(&normal))
            }));
        }
        Ok(Held { object, weight, palm_in_object, contacts, squeeze: None })
    }

    fn start(&mut self, reach: &Reach, world: &World) -> Result<(), InputError> {
        let held = self.held(&reach.grip, world)?;
        (self.palm, self.tips) = self.posture(&held, reach, world);
        self.grip = Some(held);
        Ok(())
    }

    /// Palm and fingertips at the end of a reach, without any variation.
    fn posture(&self, held: &Held, reach: &Reach, world: &World) -> (Isometry3<f64>, Vec<Point3<f64>>) {
        let object = world.observation().bodies.get(held.object).map_or_else(Isometry3::identity, |body| body.pose);
        let mut palm = object * held.palm_in_object;
        palm.translation.vector += Vector3::from(reach.offset.map(|length| length.0));
        (palm, self.opened(held, reach.opened.0))
    }

    /// The fingertips of a grip at this distance from the surface, palm frame.
    fn opened(&self, held: &Held, distance: f64) -> Vec<Point3<f64>> {
        let tips = self.fingers.iter().zip(&held.contacts);
        tips.map(|(&finger, contact)| match contact {
            Some((point, normal)) => point + normal * (self.tip_radius + distance),
            None => tucked(finger, self.side),
        })
        .collect()
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
        let held = self.held(&reach.grip, world)?;
        let (mut to_palm, to_tips) = self.posture(&held, reach, world);
        let aim = self.variation().aim.0;
        to_palm.translation.vector += Vector3::new(self.chance.either_way(), self.chance.either_way(), 0.0) * aim;
        let way = to_palm.translation.vector - self.palm.translation.vector;
        let across = self.chance.direction();
        let across = way.try_normalize(1e-6).map_or(across, |along| across - along * across.dot(&along));
        let arch = across * self.variation().path.0.min(way.norm() / 6.0) * self.chance.either_way();
        let fingers = self.tips.iter().zip(&to_tips).map(|(from, to)| (to - from).norm()).fold(0.0, f64::max);
        let pace = self.pace * self.chance.factor(self.variation().pace / 4.0);
        self.came = Vector3::new(way.x, way.y, 0.0).try_normalize(1e-3).unwrap_or_default();
        self.grip = Some(held);
        Ok(Motion::Transport(Transport {
            from_palm: self.palm,
            to_palm,
            from_tips: self.tips.clone(),
            delays: vec![0.0; to_tips.len()],
            to_tips,
            arch,
            duration: duration(way.norm(), reach.speed.0 * pace).max(duration(fingers, reach.speed.0 * pace)),
        }))
    }

    fn begin_close(&mut self, close: &Close) -> Motion {
        let force = close.force.0 * self.chance.factor(self.variation().squeeze);
        let Some(grip) = &mut self.grip else { return Motion::Still(0.0) };
        let used = grip.contacts.iter().map(Option::is_some);
        let thumb = self
            .fingers
            .iter()
            .zip(&grip.contacts)
            .any(|(&finger, contact)| finger == Finger::Thumb && contact.is_some());
        let others = used.clone().filter(|used| *used).count().saturating_sub(1);
        let opposed = thumb && others > 0;
        let share = self
            .fingers
            .iter()
            .map(|&finger| if opposed && finger != Finger::Thumb { force / others as f64 } else { force })
            .collect();
        grip.squeeze = opposed.then_some(force);
        let stopped = used.map(|used| !used).collect();
        // Only a hand that closes around something still moves on; one that lays its fingers on stops first.
        let overrun = if opposed {
            self.came * self.variation().overrun.0 * (0.75 + 0.5 * self.chance.share())
        } else {
            Vector3::zeros()
        };
        Motion::Closing { delays: self.delays(), stopped, share, speed: close.speed.0 * self.pace, overrun }
    }

    /// How late each finger starts, s.
    fn delays(&mut self) -> Vec<f64> {
        let latest = self.variation().arrival.0;
        self.fingers.iter().map(|_| latest * self.chance.share()).collect()
    }

    fn begin_open(&mut self, open: &Open) -> Motion {
        // Fingers leave more evenly than they arrive.
        let delays = self.delays().into_iter().map(|delay| delay / 4.0).collect();
        let Some(held) = &mut self.grip else { return Motion::Still(0.0) };
        held.squeeze = None;
        let held = held.clone();
        let to_tips = self.opened(&held, open.by.0);
        let way = self.tips.iter().zip(&to_tips).map(|(from, to)| (to - from).norm()).fold(0.0, f64::max);
        Motion::Transport(Transport {
            from_palm: self.palm,
            to_palm: self.palm,
            from_tips: self.tips.clone(),
            to_tips,
            delays,
            arch: Vector3::zeros(),
            duration: duration(way, open.speed.0 * self.pace),
        })
    }

    fn begin_carry(&mut self, carry: &Carry, world: &World) -> Result<Motion, InputError> {
        let along = direction("along", carry.along)?;
        let speed = carry.speed.0 * self.pace * self.chance.factor(self.variation().pace / 4.0);
        let distance = carry.distance.0;
        if carry.until.is_none() && carry.press.is_none() {
            let mut to_palm = self.palm;
            to_palm.translation.vector += along * distance;
            let across = self.chance.direction();
            let arch = (across - along * across.dot(&along))
                * self.variation().path.0.min(distance / 12.0)
                * self.chance.either_way();
            // Upwards only: what is carried may be near the ground.
            let arch = Vector3::new(arch.x, arch.y, arch.z.abs());
            let (from_tips, to_tips, delays) = (self.tips.clone(), self.tips.clone(), vec![0.0; self.tips.len()]);
            let duration = duration(distance, speed);
            return Ok(Motion::Transport(Transport {
                from_palm: self.palm,
                to_palm,
                from_tips,
                to_tips,
                delays,
                arch,
                duration,
            }));
        }
        let until = carry
            .until
            .as_ref()
            .map(|until| self.body(&until.contact).map(|body| (body, until.within.0)))
            .transpose()?;
        let object = self.grip.as_ref().map_or(usize::MAX, |grip| grip.object);
        let press = match &carry.press {
            None => None,
            Some(press) => Some(Pressing {
                against: self.body(&press.against)?,
                toward: direction("toward", press.toward)?,
                force: press.force.0,
                waver: press.waver.0 * (0.75 + 0.5 * self.chance.share()) * self.chance.either_way().signum(),
                span: until.map_or(distance, |(until, _)| world.gap(object, until).min(distance)).max(1e-3),
                wavered: 0.0,
            }),
        };
        Ok(Motion::Guided(Guided { along, speed, distance, gone: 0.0, until, press }))
    }

    /// Goes on with the motion; whether it is over.
    fn perform(&mut self, world: &World) -> bool {
        let mut wanted = Vector3::zeros();
        let over = match &mut self.motion {
            Motion::Still(duration) => {
                if let Some((grip, felt)) = self
                    .grip
                    .as_ref()
                    .filter(|grip| grip.squeeze.is_some())
                    .zip(self.senses.ago((REFLEX_S / STEP_S) as usize))
                {
                    let force = felt.total();
                    wanted = -YIELDING * force * (1.0 - grip.weight / force.norm().max(grip.weight));
                }
                self.since >= *duration
            }
            Motion::Transport(transport) => {
                (self.palm, self.tips) = transport.at(self.since);
                transport.is_over(self.since)
            }
            Motion::Closing { .. } => self.close(),
            Motion::Guided(guided) => {
                let reaction = (self.operator.variation.reaction.0.clamp(0.0, 1.0) / STEP_S) as usize;
                let senses = self.senses.ago(reaction).zip(self.senses.ago((REFLEX_S / STEP_S) as usize));
                match self.grip.as_ref().zip(senses) {
                    Some((grip, (felt, reflex))) => {
                        guided.guide(grip, world, felt, reflex, &mut wanted, &mut self.palm)
                    }
                    None => true,
                }
            }
        };
        // A guided motion fades into what follows instead of stopping first.
        let velocity = self.glide.towards(wanted, STEP_S);
        if !matches!(self.motion, Motion::Transport(_)) {
            self.palm.translation.vector += velocity * STEP_S;
        }
        over
    }

    /// Closes the fingers for another step; whether all have found their force and the hand has come to rest.
    fn close(&mut self) -> bool {
        let (time, Motion::Closing { delays, stopped, share, speed, overrun }) = (self.since, &mut self.motion) else {
            return true;
        };
        let Some(grip) = &self.grip else { return true };
        let felt = self.senses.ago((REFLEX_S / STEP_S) as usize);
        for (finger, contact) in grip.contacts.iter().enumerate() {
            let (Some((point, normal)), false) = (contact, stopped[finger]) else { continue };
            let below = -(self.tips[finger] - point).dot(normal) + self.tip_radius;
            let pressed =
                felt.and_then(|felt| felt.tips.get(finger)).map_or(0.0, |tip| -tip.dot(&(self.palm * normal)));
            if pressed >= share[finger] || below >= CLOSED_BELOW_M {
                stopped[finger] = true;
                continue;
            }
            let gathering = minimum_jerk((time - delays[finger]) / 0.1);
            // The last of the force is built up slowly.
            let easing = (1.0 - pressed / share[finger]).clamp(0.15, 1.0);
            self.tips[finger] -= normal * (*speed * gathering * easing * STEP_S);
        }
        let overrun_time = self.operator.variation.overrun_time.0.max(STEP_S);
        let step = minimum_jerk(time / overrun_time) - minimum_jerk((time - STEP_S) / overrun_time);
        self.palm.translation.vector += *overrun * step;
        stopped.iter().all(|stopped| *stopped) && (overrun.norm() == 0.0 || time >= overrun_time)
    }

    /// Fingers that hold something feel how hard, and correct it.
    fn keep_squeeze(&mut self) {
        if matches!(self.motion, Motion::Closing { .. }) {
            return;
        }
        let reaction = (self.operator.variation.reaction.0.clamp(0.0, 1.0) / STEP_S) as usize;
        let Some((grip, felt)) = self.grip.as_ref().zip(self.senses.ago(reaction)) else { return };
        let Some(wanted) = grip.squeeze else { return };
        let inwards = (TIGHTENING * (wanted - felt.squeeze()) * STEP_S).clamp(-1e-5, 1e-5);
        for (tip, contact) in self.tips.iter_mut().zip(&grip.contacts) {
            if let Some((_, normal)) = contact {
                *tip -= normal * inwards;
            }
        }
        // A transport that is under way carries the correction along.
        if let Motion::Transport(transport) = &mut self.motion {
            for (index, contact) in grip.contacts.iter().enumerate() {
                if let Some((_, normal)) = contact {
                    transport.from_tips[index] -= normal * inwards;
                    transport.to_tips[index] -= normal * inwards;
                }
            }
        }
    }
}

impl Guided {
    /// The velocity that is wanted now; moves the palm by the waver; whether the way is over.
    fn guide(
        &mut self,
        grip: &Held,
        world: &World,
        felt: &Glimpse,
        reflex: &Glimpse,
        wanted: &mut Vector3<f64>,
        palm: &mut Isometry3<f64>,
    ) -> bool {
        let (object, weight) = (grip.object, grip.weight);
        let left = self.distance - self.gone;
        let (gap, reached) = self.until.map_or((f64::INFINITY, false), |(until, within)| {
            let gap = world.gap(object, until) - within;
            (gap, felt.touching(object, until) || within > 0.0 && gap <= 0.0)
        });
        let expected = gap.min(left).max(0.0);
        let speed = self.speed.min(ARRIVING + SLOWING * expected);
        let met = reflex.total().dot(&self.along) / weight.max(EASING);
        *wanted = self.along * speed * (2.0 - met).clamp(-1.0, 1.0);
        if let Some(press) = &mut self.press {
            let towards = if felt.touching(object, press.against) {
                (FOLLOWING * (press.force - felt.total().dot(&press.toward))).clamp(-SEEKING, SEEKING)
            } else {
                SEEKING
            };
            *wanted += press.toward * towards;
            let waver = press.waver * bump(self.gone / press.span);
            palm.translation.vector += press.toward * (waver - press.wavered);
            press.wavered = waver;
        }
        self.gone += speed * STEP_S;
        left <= 0.0 || reached
    }
}

/// Where a fingertip is that is not used, palm frame, m: curled in, clear of what the others touch.
fn tucked(finger: Finger, side: Side) -> Point3<f64> {
    let [x, y, z] = match finger {
        Finger::Thumb => [-0.030, -0.030, -0.010],
        Finger::Index => [-0.030, 0.030, -0.010],
        Finger::Middle => [-0.010, 0.035, -0.010],
        Finger::Ring => [0.015, 0.030, 0.0],
        Finger::Little => [0.035, 0.020, 0.0],
        Finger::Palm => [0.0; 3],
    };
    Point3::new(if side == Side::Right { x } else { -x }, y, z)
}

fn positive(what: &str, value: f64, most: f64) -> Result<(), InputError> {
    if value > 0.0 && value <= most {
        return Ok(());
    }
    Err(InputError::new("", format!("has {what} {value} in SI, wanted more than 0 and at most {most}")))
}

fn direction(what: &str, vector: [f64; 3]) -> Result<Vector3<f64>, InputError> {
    let found = Vector3::from(vector).try_normalize(1e-6).filter(|vector| vector.iter().all(|part| part.is_finite()));
    found.ok_or_else(|| InputError::new("", format!("has {what} {vector:?}, wanted a direction that is not zero")))
}
