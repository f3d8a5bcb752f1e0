//! A teleoperated hand: converts the inputs of a device or a page to fingertip targets, once a millisecond.
//!
//! There are two kinds of inputs. *Tracked* fingertips have measured positions: targets are interpolated between messages, so that a slow device does not
//! shake a held object. A *led* palm has the position of a pointer: the palm follows at the speed of a hand, and the fingers close from both sides until they
//! reach their force, at any position of the object between them.

use crate::simulation::{HandState, HandTarget, STEP_S};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use teachtree_base::hands::{Finger, Side};
use teachtree_base::pose::slerp;
use teachtree_base::scene::{Hand, Scene};

/// The largest force that is displayed to a person, N: beyond it the magnets of the paper's device let go.
pub const MOST_FORCE_N: f64 = 5.0;
/// Number of steps without a message after which targets stay and no force is displayed.
pub const WATCHDOG_STEPS: u64 = 100;
/// Maximum distance of an input from the origin, m.
pub const FARTHEST_M: f64 = 5.0;

/// Maximum speed of the targets of tracked fingertips, m/s; their maximum speed while they approach a hand at another position, m/s; and the distance at which
/// this approach ends, m.
const FASTEST: f64 = 3.0;
const CATCHING_UP: f64 = 0.4;
const CAUGHT_M: f64 = 0.004;
/// Maximum number of steps over which a message is spread.
const MOST_SPREAD: u64 = 60;

/// A led palm: maximum speed, m/s; gain, 1/s; maximum acceleration, m/s²; maximum angular speed, rad/s; and its gain, 1/s.
const PALM_SPEED: f64 = 0.5;
const PALM_RATE: f64 = 11.0;
const PALM_ACCELERATION: f64 = 3.5;
const TURN_SPEED: f64 = 1.6;
const TURN_RATE: f64 = 9.0;
/// The forces at which the palm stops: on the way down, in other directions, and when it presses, N.
const LANDING_N: f64 = 0.3;
const MEETING_N: f64 = 0.6;
const PRESSING_N: f64 = 2.5;

/// The speeds at which fingers close and open, m/s.
const CLOSING: f64 = 0.07;
const OPENING: f64 = 0.12;
/// The gain (m/s per N) and the maximum speed (m/s) of the force control of a finger in contact.
const TIGHTENING: f64 = 0.03;
const TIGHTEST: f64 = 0.03;
/// The force with which a side waits for the other one, N, and the minimum force of a side in contact, N.
const WAITING_N: f64 = 0.05;
const MET_N: f64 = 0.02;
/// The minimum force of a grasp, as a multiple of the object's weight; it applies to all inputs.
const STRONG: f64 = 1.2;
/// The distance of the fingertips below the palm, m, and the distances between fingers of one side, m.
const BELOW_PALM_M: f64 = 0.100;
const FINGERS_APART_M: f64 = 0.024;
const TWO_FINGERS_APART_M: f64 = 0.028;
/// The gap between two sides that close without an object, m.
const LEFT_OPEN_M: f64 = 0.002;
/// The distance of the opened fingers from the widest object, m, and the bounds of their distance from the middle of the hand, m.
const BESIDE_M: f64 = 0.018;
const OPENED_M: (f64, f64) = (0.045, 0.100);

/// An input for a hand; reference frame.
#[derive(Clone, Debug, PartialEq)]
pub enum HandInput {
    /// Tracked fingertips, in the order of the scene, and the palm, if known.
    Tips {
        /// Centers of the fingertips, m.
        tips: Vec<Point3<f64>>,
        /// The palm.
        palm: Option<Isometry3<f64>>,
    },
    /// A led palm, and whether the fingers close.
    Palm {
        /// The palm.
        palm: Isometry3<f64>,
        /// Whether the fingers close, or open.
        closes: bool,
        /// The closing force of the thumb and of all other fingers together, N.
        squeeze: f64,
        /// Whether the hand presses after a contact.
        presses: bool,
    },
}

impl HandInput {
    /// Whether all numbers are in range.
    fn is_sane(&self, fingers: usize) -> bool {
        let near = |point: &Vector3<f64>| point.iter().all(|part| part.is_finite() && part.abs() <= FARTHEST_M);
        let pose = |pose: &Isometry3<f64>| {
            near(&pose.translation.vector) && pose.rotation.coords.iter().all(|part| part.is_finite())
        };
        match self {
            Self::Tips { tips, palm } => {
                tips.len() == fingers && tips.iter().all(|tip| near(&tip.coords)) && palm.as_ref().is_none_or(pose)
            }
            Self::Palm { palm, squeeze, .. } => pose(palm) && squeeze.is_finite(),
        }
    }
}

/// A teleoperated hand of the scene.
#[derive(Clone)]
pub(super) struct TeleopHand {
    fingers: Vec<Finger>,
    tip_radius: f64,
    /// The positions of the opened fingers, palm frame, and their distance from the middle, m.
    opened: Vec<Vector3<f64>>,
    opening: f64,
    /// The last input, and its age in steps.
    input: Option<HandInput>,
    age: u64,
    /// The interval between messages, in steps. A late message counts for some more, so that targets do not jump when the next one is in time.
    interval: u64,
    /// The steps over which the targets move to the tracked positions, and whether they have arrived.
    spread: u64,
    caught: bool,
    palm: Isometry3<f64>,
    /// The velocity of a led palm, m/s.
    velocity: Vector3<f64>,
    /// The distance by which each finger of a led palm has closed, m.
    closed: Vec<f64>,
    tips: Vec<Point3<f64>>,
}

impl TeleopHand {
    /// Returns the hand at its start: opened, in front of and above the objects, on its side.
    pub(super) fn new(scene: &Scene, side: Side, hand: &Hand) -> Self {
        let tip_radius = hand.tip_radius.0;
        let opening = opening(scene, tip_radius);
        let others = hand.fingers.iter().filter(|finger| **finger != Finger::Thumb).count();
        let apart = if others == 2 { TWO_FINGERS_APART_M } else { FINGERS_APART_M };
        let across = if side == Side::Right { 1.0 } else { -1.0 };
        let mut other = 0.0;
        let place = |finger: &Finger| {
            if *finger == Finger::Thumb {
                return Vector3::new(0.0, -opening, -BELOW_PALM_M);
            }
            let x = across * apart * (other - (others as f64 - 1.0) / 2.0);
            other += 1.0;
            Vector3::new(x, opening, -BELOW_PALM_M)
        };
        let opened: Vec<Vector3<f64>> = hand.fingers.iter().map(place).collect();
        let palm = Isometry3::translation_from(start(scene, across));
        let tips = opened.iter().map(|tip| palm * Point3::from(*tip)).collect();
        Self {
            fingers: hand.fingers.clone(),
            tip_radius,
            closed: vec![0.0; opened.len()],
            opened,
            opening,
            input: None,
            age: WATCHDOG_STEPS,
            interval: 1,
            spread: 1,
            caught: false,
            palm,
            velocity: Vector3::zeros(),
            tips,
        }
    }

    /// Takes an input and ignores one with numbers out of range.
    pub(super) fn take(&mut self, input: HandInput) -> bool {
        if !input.is_sane(self.fingers.len()) {
            return false;
        }
        if self.is_silent() {
            self.caught = false;
        }
        self.interval = self.age.max(self.interval * 9 / 10).clamp(1, MOST_SPREAD);
        self.spread = self.interval;
        self.age = 0;
        self.input = Some(input);
        true
    }

    /// Whether no input has arrived within the time of the watchdog.
    pub(super) const fn is_silent(&self) -> bool {
        self.age >= WATCHDOG_STEPS
    }

    /// Drops the input: the hand stays until the next one.
    pub(super) fn let_be(&mut self) {
        self.input = None;
        self.age = WATCHDOG_STEPS;
        self.caught = false;
        self.velocity = Vector3::zeros();
    }

    /// Returns the target of a led palm.
    pub(super) const fn palm(&self) -> &Isometry3<f64> {
        &self.palm
    }

    /// Returns the targets of the next step from the sensed forces; `weight` is the weight of the touched object, N.
    pub(super) fn target(&mut self, felt: &HandState, weight: f64) -> HandTarget {
        // A hand without inputs keeps its pose and its grasp.
        let is_silent = self.is_silent();
        self.age = self.age.saturating_add(1);
        match self.input.clone() {
            Some(HandInput::Tips { tips, palm }) if !is_silent => self.follow(&tips, palm),
            Some(HandInput::Palm { palm, closes, squeeze, presses }) => {
                if is_silent {
                    self.velocity = Vector3::zeros();
                } else {
                    self.lead(&palm, felt, weight, presses);
                }
                self.close(closes, squeeze.clamp(0.1, MOST_FORCE_N).max(STRONG * weight).min(MOST_FORCE_N), felt);
            }
            _ => {}
        }
        HandTarget { palm: self.palm, tips: self.tips.clone() }
    }

    /// Moves the targets towards tracked fingertips.
    fn follow(&mut self, tips: &[Point3<f64>], palm: Option<Isometry3<f64>>) {
        let most = STEP_S * if self.caught { FASTEST } else { CATCHING_UP };
        let mut farthest: f64 = 0.0;
        for (at, to) in self.tips.iter_mut().zip(tips) {
            let way = to - *at;
            farthest = farthest.max(way.norm());
            let step = way / self.spread as f64;
            *at += step * (most / step.norm()).min(1.0);
        }
        self.caught |= farthest < CAUGHT_M;
        let middle = tips.iter().map(|tip| tip.coords).sum::<Vector3<f64>>() / tips.len().max(1) as f64;
        let to = palm.unwrap_or_else(|| Isometry3::translation_from(middle + Vector3::z() * BELOW_PALM_M));
        let part = 1.0 / self.spread as f64;
        let way = to.translation.vector - self.palm.translation.vector;
        self.palm.translation.vector += way * part * (most / (way.norm() * part)).min(1.0);
        self.palm.rotation = slerp(&self.palm.rotation, &to.rotation, part);
        self.spread = self.spread.saturating_sub(1).max(1);
        // A palm that is led later begins with the current fingers.
        for (closed, (tip, opened)) in self.closed.iter_mut().zip(self.tips.iter().zip(&self.opened)) {
            let in_palm = self.palm.inverse_transform_point(tip);
            *closed = (self.opening - in_palm.y * opened.y.signum()).clamp(0.0, 2.0 * self.opening);
        }
    }

    /// Moves the palm towards its target at the speed of a hand. Contact forces slow it down and stop it.
    fn lead(&mut self, to: &Isometry3<f64>, felt: &HandState, weight: f64, presses: bool) {
        let way = to.translation.vector - self.palm.translation.vector;
        let wanted = way * (PALM_RATE).min(PALM_SPEED / way.norm().max(1e-9));
        let wanted = match way.try_normalize(1e-6) {
            Some(along) => {
                let pressed: f64 =
                    felt.tips.iter().flat_map(|tip| &tip.touches).map(|touch| touch.force.dot(&along)).sum();
                let most = match presses {
                    true => PRESSING_N + weight,
                    false if along.z < -0.3 => LANDING_N,
                    false => MEETING_N + weight,
                };
                wanted * (2.0 * (most - pressed) / most).clamp(-0.1, 1.0)
            }
            None => wanted,
        };
        let change = wanted - self.velocity;
        // Braking is not limited, so that the palm does not push a touched body.
        let most = if wanted.norm() < self.velocity.norm() { 4.0 } else { 1.0 } * PALM_ACCELERATION * STEP_S;
        self.velocity += change * (most / change.norm().max(1e-12)).min(1.0);
        self.palm.translation.vector += self.velocity * STEP_S;
        let turn = (to.rotation * self.palm.rotation.inverse()).scaled_axis();
        let turn = turn * (TURN_RATE).min(TURN_SPEED / turn.norm().max(1e-9)) * STEP_S;
        self.palm.rotation = UnitQuaternion::new(turn) * self.palm.rotation;
        self.palm.rotation.renormalize_fast();
    }

    /// Closes the fingers until each side reaches its force, or opens them.
    fn close(&mut self, closes: bool, squeeze: f64, felt: &HandState) {
        let rotation = self.palm.rotation;
        let inward = |opened: &Vector3<f64>| rotation * Vector3::new(0.0, -opened.y.signum(), 0.0);
        let feels: Vec<f64> = felt
            .tips
            .iter()
            .zip(&self.opened)
            .map(|(tip, opened)| tip.touches.iter().map(|touch| touch.force.dot(&inward(opened))).sum())
            .collect();
        let is_thumb = |finger: usize| self.fingers.get(finger) == Some(&Finger::Thumb);
        let met =
            |thumb: bool| feels.iter().enumerate().any(|(finger, felt)| is_thumb(finger) == thumb && *felt > MET_N);
        let sides = [met(false), met(true)];
        let others = (0..feels.len()).filter(|finger| !is_thumb(*finger)).count().max(1) as f64;
        // The distance by which each side has closed, at its farthest finger.
        let nearest = |closed: &[f64], thumb: bool| {
            let side = closed.iter().enumerate().filter(|(finger, _)| is_thumb(*finger) == thumb);
            self.opening - side.map(|(_, closed)| *closed).fold(0.0, f64::max)
        };
        let gap = nearest(&self.closed, true) + nearest(&self.closed, false) - 2.0 * self.tip_radius;
        let mut closed = std::mem::take(&mut self.closed);
        for (finger, closed) in closed.iter_mut().enumerate() {
            let thumb = is_thumb(finger);
            if !closes {
                *closed = (*closed - OPENING * STEP_S).max(0.0);
                continue;
            }
            let felt = feels.get(finger).copied().unwrap_or_default();
            let share = if thumb { squeeze } else { squeeze / others };
            let wanted = if sides[usize::from(!thumb)] { share } else { WAITING_N };
            let speed = if felt > MET_N {
                (TIGHTENING * (wanted - felt)).clamp(-TIGHTEST, TIGHTEST)
            } else if gap > LEFT_OPEN_M {
                CLOSING
            } else {
                0.0
            };
            *closed = (*closed + speed * STEP_S).clamp(0.0, 2.0 * self.opening);
        }
        self.closed = closed;
        for (tip, (opened, closed)) in self.tips.iter_mut().zip(self.opened.iter().zip(&self.closed)) {
            let at = opened - Vector3::new(0.0, opened.y.signum() * closed, 0.0);
            *tip = self.palm * Point3::from(at);
        }
    }
}

/// Poses without rotation.
trait FromTranslation {
    fn translation_from(at: Vector3<f64>) -> Self;
}

impl FromTranslation for Isometry3<f64> {
    fn translation_from(at: Vector3<f64>) -> Self {
        Self::from_parts(at.into(), UnitQuaternion::identity())
    }
}

/// Returns half of the smallest and largest extents of the objects along each axis at the start, m, about each object's position.
fn extents(scene: &Scene) -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>)> {
    use teachtree_base::scene::Shape;
    scene.bodies.values().filter(|body| body.role == teachtree_base::scene::Role::Object).map(|body| {
        let at = Vector3::from(body.position.map(|length| length.0));
        let turned = teachtree_base::pose::directed(body.rotation, 1e-6).unwrap_or_default();
        let mut half = Vector3::zeros();
        for part in &body.parts {
            let own = match part.shape {
                Shape::Box(edges) => Vector3::from(edges.map(|edge| edge.0 / 2.0)),
                Shape::Cylinder([radius, height]) => Vector3::new(radius.0, radius.0, height.0 / 2.0),
                Shape::Ball(radius) => Vector3::from_element(radius.0),
            };
            let turn = turned * teachtree_base::pose::directed(part.turned, 1e-6).unwrap_or_default();
            let around = turn.to_rotation_matrix().matrix().abs() * own;
            let middle = turned * Vector3::from(part.at.map(|length| length.0));
            half = half.sup(&(middle.abs() + around));
        }
        (at, half)
    })
}

/// Returns the distance of opened fingers from the middle of the hand, m: beside the widest object that a hand can span.
fn opening(scene: &Scene, tip_radius: f64) -> f64 {
    let spanned = OPENED_M.1 - BESIDE_M - tip_radius;
    let widths = extents(scene).map(|(_, half)| half.x.min(half.y)).filter(|half| *half <= spanned);
    (widths.fold(0.0, f64::max) + BESIDE_M + tip_radius).clamp(OPENED_M.0, OPENED_M.1)
}

/// Returns the start pose of a palm: in front of the objects and above them, on the side of the hand.
fn start(scene: &Scene, across: f64) -> Vector3<f64> {
    let count = extents(scene).count().max(1) as f64;
    let middle = extents(scene).map(|(at, _)| at).sum::<Vector3<f64>>() / count;
    let top = extents(scene).map(|(at, half)| at.z + half.z).fold(0.0, f64::max);
    Vector3::new(middle.x + 0.11 * across, middle.y - 0.13, top + BELOW_PALM_M + 0.09)
}
