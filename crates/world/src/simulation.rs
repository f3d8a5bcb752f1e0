//! The virtual environment: takes the commands of the hands and returns their sensory input, every millisecond.
//!
//! A fingertip of the scene is dragged to the device's target by the virtual coupling, a spring and damper on a light ball without weight, so
//! that a target inside an object squeezes it. Forces on bodies follow [`TouchLaw`]; bodies follow rapier. A haptic device would drive
//! [`World::step`] as the operators do; nothing else moves the world.

use super::bodies::{Bodies, BodyContact, BodyWrench};
use super::screw_thread::{ScrewThread, threads};
use super::sockets::places;
use super::touch::{Bristle, Overlap, Touch, TouchLaw};
use nalgebra::{Isometry3, Point3, Vector3};
use teachtree_base::error::InputError;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::scene::Scene;
use teachtree_base::short_number::ShortNumber;

/// The step of the world, s.
pub const STEP_S: f64 = 0.001;
/// A step is divided when the sum of damping × step × mobility over the touches of a body that are damped explicitly, those that slip, exceeds this.
const MAX_DAMPED: f64 = 0.5;
/// Maximum number of parts of a step.
const MAX_SUBSTEPS: usize = 16;

/// The virtual coupling between the device's target and the fingertip ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// Stiffness, N/m: of the order of a finger's.
    pub stiffness: f64,
    /// Damping, N s/m; critical for the mass below.
    pub damping: f64,
    /// Mass of the ball, kg; it has no weight.
    pub mass: f64,
    /// The maximum force of the spring, N: the device displays no larger force.
    pub ceiling: f64,
}

impl Default for Coupling {
    fn default() -> Self {
        Self { stiffness: 300.0, damping: 4.9, mass: 0.02, ceiling: 5.0 }
    }
}

/// Constants of the fingertips.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fingertips {
    /// The contact law.
    pub touch: TouchLaw,
    /// The virtual coupling.
    pub coupling: Coupling,
}

impl Fingertips {
    /// Fingertips with `by` times the stiffness, mass and force limits: `by` times the forces cause the same motion.
    #[must_use]
    pub fn scaled(&self, by: f64) -> Self {
        let Coupling { stiffness, damping, mass, ceiling } = self.coupling;
        let coupling =
            Coupling { stiffness: stiffness * by, damping: damping * by, mass: mass * by, ceiling: ceiling * by };
        Self { touch: self.touch.scaled(by), coupling }
    }
}

/// The target of a hand.
#[derive(Clone, Debug, PartialEq)]
pub struct HandTarget {
    /// The palm, reference frame; fingertips turn with it.
    pub palm: Isometry3<f64>,
    /// The centers of the fingertip balls in the order of the scene, m, reference frame.
    pub tips: Vec<Point3<f64>>,
}

/// The sensory input at one instant; all values are in the reference frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Time since the first step, s.
    pub time_s: f64,
    /// The hands of the scene, in its order.
    pub hands: Vec<HandState>,
    /// The bodies of the scene, in its order.
    pub bodies: Vec<BodyState>,
    /// The pairs of bodies that can touch: each object with every fixed body and every later object.
    pub contacts: Vec<BodyContact>,
}

/// A hand.
#[derive(Clone, Debug, PartialEq)]
pub struct HandState {
    /// The side of the hand.
    pub side: Side,
    /// The palm, where the device holds it.
    pub palm: Isometry3<f64>,
    /// The fingertips in the order of the scene.
    pub tips: Vec<TipState>,
}

/// A fingertip.
#[derive(Clone, Debug, PartialEq)]
pub struct TipState {
    /// The name of the finger.
    pub finger: Finger,
    /// Center of the ball, m.
    pub position: Point3<f64>,
    /// Its velocity, m/s.
    pub velocity: Vector3<f64>,
    /// The bodies that it touches, in scene order.
    pub touches: Vec<TipTouch>,
}

/// A fingertip on a body, as the mean over the last step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipTouch {
    /// Index of the body in the scene.
    pub body: usize,
    /// Force of the fingertip on the body, N.
    pub force: Vector3<f64>,
    /// Unit normal out of the body.
    pub normal: Vector3<f64>,
}

/// A body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyState {
    /// `world_from_body`.
    pub pose: Isometry3<f64>,
    /// Velocity of the body's origin, m/s.
    pub velocity: Vector3<f64>,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vector3<f64>,
}

impl TipState {
    /// Force of this fingertip on a body, N; zero when it does not touch it.
    pub fn force_on(&self, body: usize) -> Vector3<f64> {
        self.touches.iter().filter(|touch| touch.body == body).map(|touch| touch.force).sum()
    }
}

impl Observation {
    /// Force of `other` on `body`, N, and the normal from `other` to `body`; zero for bodies that do not touch.
    pub fn contact(&self, body: usize, other: usize) -> (Vector3<f64>, Vector3<f64>) {
        let found = self.contacts.iter().find_map(|contact| match (contact.body, contact.other) {
            pair if pair == (body, other) => Some((contact.force, contact.normal)),
            pair if pair == (other, body) => Some((-contact.force, -contact.normal)),
            _ => None,
        });
        found.unwrap_or_default()
    }
}

/// A mover of fingertips that replaces the virtual coupling: a robot.
pub trait Mover {
    /// Returns the current motion of a hand, by its index in the scene.
    fn hand(&self, hand: usize) -> HandMotion;
    /// Advances by `dt` seconds under the wrenches of bodies on the fingertips, by hand and finger.
    fn advance(&mut self, pushed: &[Vec<TipWrench>], dt: f64);
}

/// A mover of one hand.
pub trait HandMover {
    /// Returns the current motion of the hand.
    fn moved(&self) -> HandMotion;
    /// Advances by `dt` seconds under the wrenches of bodies on the fingertips, by finger.
    fn advance(&mut self, pushed: &[TipWrench], dt: f64);
}

/// The hands of a scene, in its order.
impl<H: HandMover> Mover for Vec<H> {
    fn hand(&self, hand: usize) -> HandMotion {
        self[hand].moved()
    }

    fn advance(&mut self, pushed: &[Vec<TipWrench>], dt: f64) {
        for (hand, pushed) in self.iter_mut().zip(pushed) {
            hand.advance(pushed, dt);
        }
    }
}

/// The motion of a hand under a [`Mover`]; reference frame.
#[derive(Clone, Debug, PartialEq)]
pub struct HandMotion {
    /// The palm.
    pub palm: Isometry3<f64>,
    /// The fingertips in the order of the scene.
    pub tips: Vec<TipMotion>,
}

/// The motion of a fingertip under a [`Mover`]; reference frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipMotion {
    /// Center of the ball, m.
    pub position: Point3<f64>,
    /// Its velocity, m/s.
    pub velocity: Vector3<f64>,
    /// Its angular velocity, rad/s.
    pub spin: Vector3<f64>,
}

/// The wrench of bodies on a fingertip; reference frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TipWrench {
    /// Force on the fingertip, N.
    pub force: Vector3<f64>,
    /// Torque on it about the center of its ball, N m.
    pub torque: Vector3<f64>,
}

/// A fingertip with the state of its contact law.
#[derive(Clone)]
struct Tip {
    target: Point3<f64>,
    bristles: Vec<Option<Bristle>>,
}

/// The virtual environment. A clone has the same future as the original.
#[derive(Clone)]
pub struct World {
    bodies: Bodies,
    fingertips: Fingertips,
    tip_radius: Vec<f64>,
    /// The contact law of each fingertip, by hand and finger.
    laws: Vec<Vec<TouchLaw>>,
    tips: Vec<Vec<Tip>>,
    threads: Vec<ScrewThread>,
    steps: u64,
    /// The contacts of this part of the step, until the bodies have moved.
    touching: Vec<TipContact>,
    /// The wrenches of bodies on the fingertips in this part, by hand and finger.
    pushed: Vec<Vec<TipWrench>>,
    observation: Observation,
}

/// A fingertip that touches a body.
#[derive(Clone)]
struct TipContact {
    hand: usize,
    finger: usize,
    body: usize,
    point: Point3<f64>,
    touch: Touch,
}

impl World {
    /// Returns the world of a scene before its first step, with bodies at their initial poses. The fingertips start at their first targets.
    ///
    /// # Errors
    /// A body or hand of the scene that cannot be simulated, at its keys in the scene, `bodies.cube.mass`.
    pub fn new(scene: &Scene, fingertips: Fingertips) -> Result<Self, InputError> {
        let bodies = Bodies::new(scene)?;
        let mut hands = Vec::new();
        let mut tips = Vec::new();
        let mut tip_radius = Vec::new();
        for (&side, hand) in &scene.hands {
            let refuse = |key: &str, message: String| InputError::new(format!("hands.{side}.{key}"), message);
            if hand.fingers.contains(&Finger::Palm) {
                let message = "found `palm`, expected fingertips only: a palm is not simulated";
                return Err(refuse("fingers", message.into()));
            }
            if !(1e-4..=0.1).contains(&hand.tip_radius.0) {
                let found = ShortNumber(hand.tip_radius.0);
                return Err(refuse("tip_radius", format!("found {found} m, expected 0.1 mm to 100 mm")));
            }
            let tip = |&finger| TipState {
                finger,
                position: Point3::origin(),
                velocity: Vector3::zeros(),
                touches: Vec::new(),
            };
            hands.push(HandState { side, palm: Isometry3::identity(), tips: hand.fingers.iter().map(tip).collect() });
            tips.push(
                hand.fingers
                    .iter()
                    .map(|_| Tip { target: Point3::origin(), bristles: vec![None; bodies.len()] })
                    .collect(),
            );
            tip_radius.push(hand.tip_radius.0);
        }
        let contacts = bodies.pairs();
        let laws = tips.iter().map(|tips: &Vec<Tip>| vec![fingertips.touch; tips.len()]).collect();
        let observation = Observation { time_s: 0.0, hands, bodies: Vec::new(), contacts };
        let pushed = tips.iter().map(|tips: &Vec<Tip>| vec![TipWrench::default(); tips.len()]).collect();
        let mut world = Self {
            bodies,
            fingertips,
            tip_radius,
            laws,
            tips,
            threads: threads(&places(scene)),
            steps: 0,
            touching: Vec::new(),
            pushed,
            observation,
        };
        world.observe_bodies();
        Ok(world)
    }

    /// Gives a finger of a hand, by its index in the scene, a flat pad of this radius, m, in place of a fingertip's patch.
    pub fn set_pad(&mut self, hand: usize, finger: Finger, radius: f64) {
        let own = self.observation.hands[hand].tips.iter().zip(&mut self.laws[hand]);
        for (_, law) in own.filter(|(tip, _)| tip.finger == finger) {
            *law = self.fingertips.touch.with_pad(radius);
        }
    }

    /// Returns the current observation.
    pub fn observation(&self) -> &Observation {
        &self.observation
    }

    /// Returns the distance between the surfaces of two bodies of the scene, m; 0 when they touch.
    pub fn gap(&self, body: usize, other: usize) -> f64 {
        if body >= self.bodies.len() || other >= self.bodies.len() {
            return f64::INFINITY;
        }
        let (pose, other_pose) = (self.bodies.pose(body), self.bodies.pose(other));
        self.bodies.solid(body).gap(&pose, self.bodies.solid(other), &other_pose)
    }

    /// Returns the point of a body's surface nearest to `point`, and the outward unit normal there; both in the body frame.
    pub fn surface(&self, body: usize, point_in_body: Point3<f64>) -> Option<(Point3<f64>, Vector3<f64>)> {
        (body < self.bodies.len()).then(|| self.bodies.solid(body).surface(point_in_body))
    }

    /// Advances by [`STEP_S`] towards the targets of the hands, in scene order. A missing or infinite target leaves that hand or fingertip where it
    /// was commanded to be before.
    pub fn step(&mut self, targets: &[HandTarget]) -> &Observation {
        let substeps = self.substeps();
        let dt = STEP_S / substeps as f64;
        let plans = self.plans(targets);
        self.forget_forces();
        for substep in 0..substeps {
            for (hand, plan) in plans.iter().enumerate() {
                for finger in 0..plan.velocities.len() {
                    self.touch_tip(hand, finger, plan.spin, dt);
                }
            }
            self.step_bodies(dt, substep + 1 == substeps);
            self.answer(1.0 / substeps as f64);
            for (hand, plan) in plans.iter().enumerate() {
                for (finger, target_velocity) in plan.velocities.iter().enumerate() {
                    self.step_tip(hand, finger, *target_velocity, dt);
                }
            }
        }
        for (state, plan) in self.observation.hands.iter_mut().zip(&plans) {
            state.palm = plan.palm;
        }
        self.end_step()
    }

    /// Advances by [`STEP_S`] with fingertips under a mover that replaces the virtual coupling.
    pub fn step_moved(&mut self, mover: &mut dyn Mover) -> &Observation {
        let substeps = self.substeps();
        let dt = STEP_S / substeps as f64;
        self.forget_forces();
        for substep in 0..substeps {
            for hand in 0..self.tips.len() {
                let moved = mover.hand(hand);
                self.observation.hands[hand].palm = moved.palm;
                for (finger, tip) in moved.tips.iter().enumerate().take(self.tips[hand].len()) {
                    let state = &mut self.observation.hands[hand].tips[finger];
                    (state.position, state.velocity) = (tip.position, tip.velocity);
                    self.touch_tip(hand, finger, tip.spin, dt);
                }
            }
            self.step_bodies(dt, substep + 1 == substeps);
            self.answer(1.0 / substeps as f64);
            mover.advance(&self.pushed, dt);
        }
        self.end_step()
    }

    fn forget_forces(&mut self) {
        for contact in &mut self.observation.contacts {
            (contact.force, contact.normal) = (Vector3::zeros(), Vector3::zeros());
        }
        for tip in self.observation.hands.iter_mut().flat_map(|hand| &mut hand.tips) {
            tip.touches.clear();
        }
    }

    fn step_bodies(&mut self, dt: f64, last: bool) {
        self.step_threads(dt);
        self.bodies.step(dt);
        self.bodies.add_impulses(&mut self.observation.contacts);
        if last || !self.threads.is_empty() {
            self.observe_bodies();
        }
    }

    fn end_step(&mut self) -> &Observation {
        for contact in &mut self.observation.contacts {
            contact.force /= STEP_S;
            contact.normal = contact.normal.try_normalize(1e-12).unwrap_or_default();
        }
        for touch in self.observation.hands.iter_mut().flat_map(|hand| &mut hand.tips).flat_map(|tip| &mut tip.touches)
        {
            touch.normal = touch.normal.try_normalize(1e-12).unwrap_or_default();
        }
        self.steps += 1;
        self.observation.time_s = self.steps as f64 * STEP_S;
        &self.observation
    }

    /// Turns targets into the velocities and the spin with which they are reached at the end of the step.
    fn plans(&mut self, targets: &[HandTarget]) -> Vec<HandPlan> {
        let first = self.steps == 0;
        let mut plans = Vec::with_capacity(self.tips.len());
        for (index, (tips, state)) in self.tips.iter_mut().zip(&mut self.observation.hands).enumerate() {
            let target = targets.get(index);
            let palm = target.map(|target| target.palm).filter(is_finite).unwrap_or(state.palm);
            let spin = (palm.rotation * state.palm.rotation.inverse()).scaled_axis() / STEP_S;
            let mut velocities = Vec::with_capacity(tips.len());
            for (finger, (tip, tip_state)) in tips.iter_mut().zip(&mut state.tips).enumerate() {
                let wanted = target
                    .and_then(|target| target.tips.get(finger))
                    .filter(|point| point.coords.iter().all(|part| part.is_finite()));
                let wanted = wanted.copied().unwrap_or(tip.target);
                if first {
                    (tip.target, tip_state.position) = (wanted, wanted);
                }
                velocities.push((wanted - tip.target) / STEP_S);
            }
            plans.push(HandPlan { palm, spin: if first { Vector3::zeros() } else { spin }, velocities });
        }
        plans
    }

    /// Returns the number of parts of the next step that keeps the stiffest body stable.
    fn substeps(&self) -> usize {
        let mut damped = vec![0.0; self.bodies.len()];
        for ((tips, laws), state) in self.tips.iter().zip(&self.laws).zip(&self.observation.hands) {
            for ((tip, law), state) in tips.iter().zip(laws).zip(&state.tips) {
                for touch in &state.touches {
                    if tip.bristles[touch.body].is_some_and(|bristle| bristle.is_explicit()) {
                        let mobility = self.bodies.mobility(touch.body, state.position, touch.normal);
                        damped[touch.body] += law.damping * STEP_S * mobility;
                    }
                }
            }
        }
        let most = damped.into_iter().fold(0.0, f64::max);
        ((most / MAX_DAMPED).ceil() as usize).clamp(1, MAX_SUBSTEPS)
    }

    /// Moves one fingertip by `dt` (s) under the wrench of bodies on it.
    fn step_tip(&mut self, hand: usize, finger: usize, target_velocity: Vector3<f64>, dt: f64) {
        let tip = &mut self.tips[hand][finger];
        let state = &mut self.observation.hands[hand].tips[finger];
        let coupling = &self.fingertips.coupling;
        tip.target += target_velocity * dt;
        let pull = coupling.stiffness * (tip.target - state.position);
        let pull = pull * (coupling.ceiling / pull.norm()).min(1.0);
        let drag = coupling.damping * (target_velocity - state.velocity);
        state.velocity += (pull + drag + self.pushed[hand][finger].force) / coupling.mass * dt;
        state.position += state.velocity * dt;
    }

    /// Applies the contact forces of a fingertip for the next `dt` (s).
    fn touch_tip(&mut self, hand: usize, finger: usize, spin: Vector3<f64>, dt: f64) {
        let radius = self.tip_radius[hand];
        let tip = &mut self.tips[hand][finger];
        let state = &self.observation.hands[hand].tips[finger];
        for (body, bristle) in tip.bristles.iter_mut().enumerate() {
            if self.bodies.is_farther(body, &state.position, radius) {
                *bristle = None;
                continue;
            }
            let world_from_body = self.bodies.pose(body);
            let tip_in_body = world_from_body.inverse_transform_point(&state.position);
            let Some(nearest) = self.bodies.solid(body).within(tip_in_body, radius) else {
                *bristle = None;
                continue;
            };
            let depth = radius - nearest.distance;
            let point = world_from_body * nearest.point;
            let overlap = Overlap {
                depth,
                point,
                normal: nearest.normal.map(|normal| world_from_body * normal),
                velocity: state.velocity - self.bodies.velocity_at(body, point),
                spin: spin - self.bodies.angular_velocity(body),
                world_from_body,
            };
            let (touch, next) = self.laws[hand][finger].touch(*bristle, &overlap, dt);
            *bristle = Some(next);
            let push = BodyWrench { force: touch.force, point, torque: touch.torque, damping: touch.damping };
            self.bodies.push(body, &push, dt);
            self.touching.push(TipContact { hand, finger, body, point, touch });
        }
    }

    /// Computes the wrenches on the fingertips after the bodies have moved; `share` is the weight of this part in the step's mean force.
    fn answer(&mut self, share: f64) {
        self.pushed.iter_mut().flatten().for_each(|pushed| *pushed = TipWrench::default());
        for TipContact { hand, finger, body, point, touch } in self.touching.drain(..) {
            let force = self.laws[hand][finger].answered(&touch, self.bodies.change_at(body, point));
            let state = &mut self.observation.hands[hand].tips[finger];
            let pushed = &mut self.pushed[hand][finger];
            pushed.force -= force;
            pushed.torque -= touch.torque + (point - state.position).cross(&force);
            match state.touches.iter_mut().find(|known| known.body == body) {
                Some(known) => {
                    known.force += share * force;
                    known.normal += touch.normal;
                }
                None => state.touches.push(TipTouch { body, force: share * force, normal: touch.normal }),
            }
        }
    }

    /// Applies the forces of threads on their screws for the next `dt` (s).
    fn step_threads(&mut self, dt: f64) {
        for thread in &mut self.threads {
            let Some(grip) = thread.step(&self.observation.bodies, dt) else { continue };
            let (screw, nut) = thread.bodies();
            let push = BodyWrench { force: grip.force, point: grip.point, torque: grip.torque, damping: 0.0 };
            self.bodies.push(screw, &push, dt);
            for contact in &mut self.observation.contacts {
                // A thread is a contact like any other: force and normal are those on the screw.
                let sign = match (contact.body, contact.other) {
                    pair if pair == (screw, nut) => 1.0,
                    pair if pair == (nut, screw) => -1.0,
                    _ => continue,
                };
                contact.force += sign * grip.force * dt;
                contact.normal += sign * grip.normal * grip.force.norm() * dt;
            }
        }
    }

    fn observe_bodies(&mut self) {
        let bodies = &self.bodies;
        self.observation.bodies.clear();
        self.observation.bodies.extend((0..bodies.len()).map(|body| {
            let pose = bodies.pose(body);
            let velocity = bodies.velocity_at(body, pose.translation.vector.into());
            BodyState { pose, velocity, angular_velocity: bodies.angular_velocity(body) }
        }));
    }
}

/// The motion of a hand during a step.
struct HandPlan {
    palm: Isometry3<f64>,
    spin: Vector3<f64>,
    velocities: Vec<Vector3<f64>>,
}

fn is_finite(pose: &Isometry3<f64>) -> bool {
    pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|part| part.is_finite())
}
