//! Makes a motion of a goal: draws the variation of this operator, computes the path, and refuses impossible goals.

use super::collide::{CollideMotion, vector_to};
use super::cooperation::FollowMotion;
use super::goals::{Bring, Carry, Close, Collide, Cooperation, Goal, Jam, Open, Press, Reach, Slip, Step, Turn};
use super::grips::{HandGrip, body, refused};
use super::guarded_motion::{CLOSED_BELOW_M, CloseMotion, GuardedMove, WallPressMotion};
use super::hand::{Motion, Performer};
use super::insertion::{FIRM, InsertionMotion};
use super::jam::{JamMotion, SQUEEZE};
use super::motion::{Transport, TurnMotion, duration};
use super::perturbations::Perturbation;
use super::press::PressMotion;
use super::slip::SlipMotion;
use super::variation::Variation;
use crate::sockets::{SocketSite, places};
use crate::{STEP_S, TouchLaw, World};
use nalgebra::{Isometry3, Point3, Vector3};
use teachtree_base::error::InputError;
use teachtree_base::hands::Finger;
use teachtree_base::short_number::ShortNumber;

/// The minimum squeeze of a carrying grip, as a multiple of the force that friction needs.
const CARRIED: f64 = 1.5;
/// That multiple for an object that is pressed against a body and moved along it, where friction acts too.
const HELD_ALONG: f64 = 1.25;
/// A reach that ends nearer to its grip than this approaches it straight, m.
const AT_IT_M: f64 = 0.020;
/// An operator who misses a hole misses it by half its radius plus this, m.
const MISSED_M: f64 = 0.003;

impl<'a> Performer<'a> {
    /// Refuses goals that cannot be performed.
    pub(super) fn check(&self, goal: &Goal, world: &World) -> Result<(), InputError> {
        match goal {
            Goal::Reach(reach) => {
                HandGrip::new(&reach.grip, self.scene, self.operator, self.hand, world)?;
                positive("speed", reach.speed.0, 5.0, "m/s")?;
            }
            Goal::Close(close) => {
                positive("speed", close.speed.0, 1.0, "m/s")?;
                positive("force", close.force.0, TouchLaw::default().ceiling, "N")?;
            }
            Goal::Carry(carry) => {
                positive("speed", carry.speed.0, 5.0, "m/s")?;
                positive("distance", carry.distance.0, 10.0, "m")?;
                direction("along", carry.along)?;
                if let Some(until) = &carry.until {
                    body(self.scene, &until.contact)?;
                }
                if let Some(press) = &carry.press {
                    direction("toward", press.toward)?;
                    body(self.scene, &press.against)?;
                }
            }
            Goal::Bring(bring) => positive("speed", bring.speed.0, 5.0, "m/s")?,
            Goal::Insert(insert) => {
                positive("speed", insert.speed.0, 1.0, "m/s")?;
                positive("depth", insert.depth.0, 1.0, "m")?;
                self.place(&insert.socket)?;
            }
            Goal::Withdraw(withdraw) => {
                positive("speed", withdraw.speed.0, 1.0, "m/s")?;
                positive("above", withdraw.above.0, 1.0, "m")?;
                self.place(&withdraw.socket)?;
            }
            Goal::Turn(turn) => {
                positive("speed", turn.speed.0, 20.0, "rad/s")?;
                positive("angle (or its opposite)", turn.angle.0.abs(), 6.0, "rad")?;
                direction("about", turn.about)?;
            }
            Goal::Press(press) => {
                direction("toward", press.toward)?;
                positive("force", press.force.0, 20.0, "N")?;
                positive("time", press.time.0, 60.0, "s")?;
                positive("distance", press.distance.0, 10.0, "m")?;
            }
            Goal::Open(open) => positive("speed", open.speed.0, 1.0, "m/s")?,
            Goal::Hold(time) => positive("hold", time.0, 60.0, "s")?,
            Goal::Slip(slip) => positive("distance", slip.distance.0, 10.0, "m")?,
            Goal::Jam(jam) => {
                positive("beside", jam.beside.0, 1.0, "m")?;
                positive("force", jam.force.0, 20.0, "N")?;
                positive("time", jam.time.0, 60.0, "s")?;
                positive("speed", jam.speed.0, 1.0, "m/s")?;
                self.place(&jam.socket)?;
            }
            Goal::Collide(collide) => {
                positive("overshoot", collide.overshoot.0, 0.1, "m")?;
                positive("back", collide.back.0, 1.0, "m")?;
                positive("pause", collide.pause.0, 60.0, "s")?;
                positive("speed", collide.speed.0, 5.0, "m/s")?;
                body(self.scene, &collide.with)?;
            }
            Goal::Wait(phase) => self.phase_of_other(phase)?,
            Goal::Cooperation(together) => {
                if !(0.0..=1.5).contains(&together.share) {
                    return Err(refused(format!("has share {}, expected 0 to 1.5", together.share)));
                }
                if together.force.0 != 0.0 {
                    direction("toward", together.toward)?;
                    positive("force", together.force.0, 20.0, "N")?;
                }
                match (&together.until, together.time) {
                    (Some(phase), None) => self.phase_of_other(phase)?,
                    (None, Some(time)) => positive("time", time.0, 60.0, "s")?,
                    _ => {
                        return Err(refused(
                            "has a step `together` without an end, expected one of `until` and `time`".into(),
                        ));
                    }
                }
            }
        }
        Ok(())
    }

    /// Refuses a phase that the other hand never begins.
    fn phase_of_other(&self, phase: &str) -> Result<(), InputError> {
        let others = self.operator.hands.iter().filter(|(side, _)| **side != self.side);
        let mut phases = others.flat_map(|(_, script)| &script.steps).filter_map(|step| step.phase.as_deref());
        if phases.clone().any(|other| other == phase) {
            return Ok(());
        }
        let known: Vec<_> = phases.by_ref().map(|phase| format!("`{phase}`")).collect();
        let known = if known.is_empty() { "none".into() } else { known.join(", ") };
        Err(refused(format!("waits for the phase `{phase}` of the other hand, which has {known}")))
    }

    pub(super) fn variation(&self) -> &'a Variation {
        &self.operator.variation
    }

    /// Returns palm and fingertips at the end of a reach, without variation.
    pub(super) fn posture(&self, grip: &HandGrip, reach: &Reach, world: &World) -> (Isometry3<f64>, Vec<Point3<f64>>) {
        let mut palm = grip.palm(world);
        palm.translation.vector += Vector3::from(reach.offset.map(|length| length.0));
        (palm, grip.opened(reach.opened.0, self.hand, self.side))
    }

    pub(super) fn begin(&mut self, step: &Step, world: &World) -> Result<Motion, InputError> {
        Ok(match &step.goal {
            Goal::Reach(reach) => self.begin_reach(reach, world)?,
            Goal::Close(close) => self.begin_close(close),
            Goal::Carry(carry) => self.begin_carry(carry, world)?,
            Goal::Bring(bring) => self.begin_bring(bring, world),
            Goal::Insert(insert) => {
                self.begin_plugging(&insert.socket, -insert.depth.0, insert.speed.0, step.perturbation, world)?
            }
            Goal::Withdraw(withdraw) => {
                self.begin_plugging(&withdraw.socket, withdraw.above.0, withdraw.speed.0, None, world)?
            }
            Goal::Turn(turn) => self.begin_turn(turn, world)?,
            Goal::Press(press) => self.begin_press(press)?,
            Goal::Open(open) => self.begin_open(open),
            Goal::Hold(time) => Motion::Still(time.0 * self.chance.factor(self.variation().pace / 2.0)),
            Goal::Slip(slip) => self.begin_slip(slip, world),
            Goal::Jam(jam) => self.begin_jam(jam, world)?,
            Goal::Collide(collide) => self.begin_collide(collide, world)?,
            Goal::Wait(phase) => {
                self.hold_firmly();
                Motion::Waiting(phase.clone())
            }
            Goal::Cooperation(together) => self.begin_together(together),
        })
    }

    fn begin_reach(&mut self, reach: &Reach, world: &World) -> Result<Motion, InputError> {
        let variation = self.variation();
        let grip = HandGrip::new(&reach.grip, self.scene, self.operator, self.hand, world)?;
        let (mut to_palm, to_tips) = self.posture(&grip, reach, world);
        let horizontal = |vector: Vector3<f64>| Vector3::new(vector.x, vector.y, 0.0);
        self.came = horizontal(to_palm.translation.vector - self.palm.translation.vector)
            .try_normalize(1e-3)
            .unwrap_or_default();
        to_palm.translation.vector +=
            Vector3::new(self.chance.either_way(), self.chance.either_way(), 0.0) * variation.aim.0;
        let closes =
            matches!(self.steps.get(self.next), Some(Step { goal: Goal::Close(_), .. })) && grip.is_opposed(self.hand);
        if closes {
            // Operators compensate for their overrun: the fingers touch the object half way through it.
            to_palm.translation.vector -= self.came * variation.overrun.0 / 2.0;
        }
        let way = to_palm.translation.vector - self.palm.translation.vector;
        let fingers = self.tips.iter().zip(&to_tips).map(|(from, to)| (to - from).norm()).fold(0.0, f64::max);
        // The path is straight near an object, so that the fingers do not collide with it.
        let at_it = reach.offset.iter().all(|part| part.0.abs() < AT_IT_M);
        let curved = if at_it { 1.0 / 24.0 } else { 1.0 / 6.0 };
        let arch = self.across(way) * variation.path.0.min(way.norm() * curved) * self.chance.either_way();
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
        // The squeeze for a carried object exceeds the minimum.
        let force = if opposed { (force * self.strength).max(CARRIED * self.grip.weight / 2.0) } else { force };
        self.grip.squeeze = (opposed && !close.unchecked).then_some(force);
        // Only a hand that closes around an object overruns; a hand that places its fingers on a surface stops first.
        let further = if opposed { variation.overrun.0 * (0.75 + 0.5 * self.chance.share()) } else { 0.0 };
        Motion::Close(CloseMotion {
            delays: self.delays(variation.arrival.0),
            stopped: self.grip.contacts.iter().map(Option::is_none).collect(),
            share: self.hand.fingers.iter().map(share).collect(),
            speed: close.speed.0 * self.pace,
            overrun: self.came * further,
            overrun_time: variation.overrun_time.0,
            below: if close.unchecked { self.grip.half_width() } else { CLOSED_BELOW_M },
        })
    }

    fn begin_open(&mut self, open: &Open) -> Motion {
        self.grip.squeeze = None;
        // The forces decrease together: a finger with a larger force moves farther. Delays are shorter than when closing.
        let pressed: Vec<f64> = match self.senses.steps_ago(0) {
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
            // Paths arch only upwards: a carried object may be near the ground.
            let arch = Vector3::new(arch.x, arch.y, arch.z.abs());
            return Ok(self.transport(to_palm, self.tips.clone(), Vec::new(), arch, duration(distance, speed)));
        }
        let until =
            carry.until.as_ref().map(|until| body(self.scene, &until.contact).map(|body| (body, until.within.0)));
        let until = until.transpose()?;
        if let (Some(squeeze), Some(press)) = (&mut self.grip.squeeze, &carry.press) {
            *squeeze = squeeze.max(HELD_ALONG * press.force.0);
        }
        let press = match &carry.press {
            None => None,
            Some(press) => Some(WallPressMotion {
                against: body(self.scene, &press.against)?,
                toward: direction("toward", press.toward)?,
                force: press.force.0,
                waver: press.waver.0 * (0.75 + 0.5 * self.chance.share()) * self.chance.either_way().signum(),
                span: until.map_or(distance, |(until, _)| world.gap(self.grip.object, until).min(distance)).max(STEP_S),
                wavered: 0.0,
            }),
        };
        Ok(Motion::GuardedMove(GuardedMove { along, speed, distance, gone: 0.0, until, has_met: false, press }))
    }

    fn begin_bring(&mut self, bring: &Bring, world: &World) -> Motion {
        let speed = bring.speed.0 * self.pace_now();
        let object = self.object(world);
        let aim = Vector3::new(self.chance.either_way(), self.chance.either_way(), 0.0) * self.variation().aim.0;
        let way = Vector3::from(bring.to.map(|part| part.0)) - object + aim;
        let mut to_palm = self.palm;
        to_palm.translation.vector += way;
        let arch = self.across(way) * self.variation().path.0.min(way.norm() / 6.0) * self.chance.either_way();
        let arch = Vector3::new(arch.x, arch.y, arch.z.abs());
        self.transport(to_palm, self.tips.clone(), Vec::new(), arch, duration(way.norm(), speed))
    }

    fn begin_plugging(
        &mut self,
        socket: &str,
        to: f64,
        speed: f64,
        perturbation: Option<Perturbation>,
        world: &World,
    ) -> Result<Motion, InputError> {
        let place = self.place(socket)?;
        self.hold_firmly();
        let misses = perturbation == Some(Perturbation::RetryAtRim);
        let away =
            if misses { 0.5 * place.socket.radius.0 + MISSED_M } else { self.variation().aim.0 * self.chance.share() };
        let axis = place.plug(self.grip.object, &world.observation().bodies).map_or_else(Vector3::z, |plug| plug.axis);
        let error = self.across(axis).try_normalize(1e-6).unwrap_or_default() * away;
        let speed = speed * self.pace_now();
        Ok(Motion::Insertion(InsertionMotion {
            place,
            to,
            speed,
            error,
            misses,
            searched: 0.0,
            tried: 0.0,
            stuck: 0.0,
            time: 0.0,
            before: None,
        }))
    }

    fn begin_turn(&mut self, turn: &Turn, world: &World) -> Result<Motion, InputError> {
        let speed = turn.speed.0 * self.pace_now();
        Ok(Motion::Turn(TurnMotion {
            from_palm: self.palm,
            centre: self.object(world).into(),
            axis: nalgebra::Unit::new_unchecked(direction("about", turn.about)?),
            angle: turn.angle.0,
            duration: duration(turn.angle.0.abs(), speed),
        }))
    }

    fn begin_press(&mut self, press: &Press) -> Result<Motion, InputError> {
        let pace = self.variation().pace;
        let force = press.force.0 * self.chance.factor(pace / 2.0);
        let time = press.time.0 * self.chance.factor(pace / 2.0);
        if let Some(squeeze) = &mut self.grip.squeeze {
            *squeeze = squeeze.max(force);
        }
        let toward = direction("toward", press.toward)?;
        Ok(Motion::Press(PressMotion { toward, force, time, left: press.distance.0, pressed: None }))
    }

    fn begin_slip(&mut self, slip: &Slip, world: &World) -> Motion {
        let height = self.object(world).z - self.palm.translation.vector.z;
        let squeeze = self.grip.squeeze.take().unwrap_or_default();
        Motion::Slip(SlipMotion { distance: slip.distance.0, squeeze, height, catching: None, empty: 0.0 })
    }

    fn begin_jam(&mut self, jam: &Jam, world: &World) -> Result<Motion, InputError> {
        let place = self.place(&jam.socket)?;
        self.hold_firmly();
        if let Some(squeeze) = &mut self.grip.squeeze {
            *squeeze = squeeze.max(SQUEEZE * jam.force.0);
        }
        let axis = place.plug(self.grip.object, &world.observation().bodies).map_or_else(Vector3::z, |plug| plug.axis);
        let beside = self.across(axis).try_normalize(1e-6).unwrap_or_default() * jam.beside.0;
        let speed = jam.speed.0 * self.pace_now();
        let (force, time) = (jam.force.0, jam.time.0);
        Ok(Motion::Jam(JamMotion { place, beside, speed, force, time, felt_s: 0.0, pressed_s: 0.0 }))
    }

    fn begin_collide(&mut self, collide: &Collide, world: &World) -> Result<Motion, InputError> {
        let obstacle = body(self.scene, &collide.with)?;
        let (along, gap) = if self.grip.squeeze.is_some() {
            let toward = vector_to(world, obstacle, self.object(world).into());
            (Vector3::new(toward.x, toward.y, 0.0), world.gap(self.grip.object, obstacle))
        } else {
            let toward = self.tips.iter().map(|tip| vector_to(world, obstacle, self.palm * tip));
            let nearest = toward.min_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or_default();
            (nearest, nearest.norm() - self.hand.tip_radius.0)
        };
        let (distance, back) = (gap.max(0.0) + collide.overshoot.0, collide.back.0);
        let speed = collide.speed.0 * self.pace_now();
        Ok(Motion::Collide(CollideMotion {
            from: self.palm.translation.vector,
            along: along.try_normalize(1e-6).unwrap_or_default(),
            distance,
            back,
            durations: [duration(distance, speed), collide.pause.0, duration(back, speed)],
        }))
    }

    /// Raises the squeeze for assembly, or for holding an object for the other hand.
    fn hold_firmly(&mut self) {
        if let Some(squeeze) = &mut self.grip.squeeze {
            *squeeze = squeeze.max(FIRM);
        }
    }

    fn begin_together(&mut self, together: &Cooperation) -> Motion {
        let factor = self.chance.factor(self.variation().pace / 4.0);
        Motion::Cooperation(FollowMotion {
            share: together.share,
            push: Vector3::from(together.toward).try_normalize(1e-6).unwrap_or_default() * together.force.0,
            until: together.until.clone(),
            duration: together.time.map_or(f64::INFINITY, |time| time.0 * factor),
            before: None,
        })
    }

    /// Returns the socket of this name.
    fn place(&self, name: &str) -> Result<SocketSite, InputError> {
        let places = places(self.scene);
        let known: Vec<_> = places.iter().map(|place| format!("`{}`", place.name)).collect();
        places.into_iter().find(|place| place.name == name).ok_or_else(|| {
            refused(format!(
                "names the socket `{name}`, the scene has {}",
                if known.is_empty() { "none".into() } else { known.join(", ") }
            ))
        })
    }

    /// Returns the position of the gripped object.
    fn object(&self, world: &World) -> Vector3<f64> {
        world
            .observation()
            .bodies
            .get(self.grip.object)
            .map_or_else(Vector3::zeros, |body| body.pose.translation.vector)
    }

    /// Returns a motion from the current pose.
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

    /// Returns the factor of this motion's speed relative to the script.
    fn pace_now(&mut self) -> f64 {
        self.pace * self.chance.factor(self.variation().pace / 4.0)
    }

    /// Returns the delay of each finger, s.
    fn delays(&mut self, latest: f64) -> Vec<f64> {
        self.hand.fingers.iter().map(|_| latest * self.chance.share()).collect()
    }

    /// Returns a random direction perpendicular to a path.
    fn across(&mut self, way: Vector3<f64>) -> Vector3<f64> {
        let some = self.chance.direction();
        way.try_normalize(1e-6).map_or(some, |along| some - along * some.dot(&along))
    }
}

fn positive(what: &str, value: f64, most: f64, unit: &str) -> Result<(), InputError> {
    if value > 0.0 && value <= most {
        return Ok(());
    }
    Err(refused(format!("has {what} {} {unit}, expected more than 0 and at most {most} {unit}", ShortNumber(value))))
}

fn direction(what: &str, vector: [f64; 3]) -> Result<Vector3<f64>, InputError> {
    let found = Vector3::from(vector).try_normalize(1e-6).filter(|vector| vector.iter().all(|part| part.is_finite()));
    found.ok_or_else(|| refused(format!("has {what} {vector:?}, expected a direction that is not zero")))
}
