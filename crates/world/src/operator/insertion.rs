//! Putting an object into a socket and pulling it out again, as operators do it: by eye above the rim, by feeling on it, giving way inside.

use super::grips::HandGrip;
use super::guarded_motion::EASING;
use super::sensor_history::SensorSample;
use crate::sockets::SocketSite;
use crate::{STEP_S, World};
use nalgebra::{ComplexField, Point3, Vector3};

/// How fast the eye brings the plug over the axis, 1/s, and at most, m/s.
pub(super) const BY_EYE: f64 = 3.0;
pub(super) const BY_EYE_AT_MOST: f64 = 0.030;
/// How fast the hand gives way to a force from the side, m/s per N, and is drawn to the axis, 1/s, while the plug is in.
const YIELDING: f64 = 0.020;
const CENTRING: f64 = 1.0;
/// Nearer to the rim than this, m, the hand goes down only as well as it has aimed.
pub(super) const CAREFUL_M: f64 = 0.003;
/// Less deep than this, m, it eases off at this force, N: a peg that is pressed on the rim tilts. The longer it is tried, the harder, N/s.
const SHALLOW_M: f64 = 0.004;
const LIGHT: f64 = 0.2;
const HARDER: f64 = 0.01;
/// Who does not find the hole in this time, s, lifts the plug for that time, s, at this speed, m/s, and goes on.
const TRYING_S: f64 = 2.0;
const LIFTING_S: f64 = 0.4;
const LIFTING: f64 = 0.025;
/// While the plug searches on the rim the error of the aim fades with this time constant, s, and the hand circles with this frequency, Hz, by
/// this share of the error that it had.
const FINDING_S: f64 = 0.5;
const CIRCLING_HZ: f64 = 1.5;
const CIRCLING: f64 = 0.5;
/// Who has missed the hole feels the rim for this long, s, before the hand is lifted.
const PUZZLED_S: f64 = 0.35;
/// A plug that is in and does not move on for this long, s, is in as far as it goes; the operator gives up after `PATIENCE_S`.
const STUCK_S: f64 = 0.4;
const PATIENCE_S: f64 = 20.0;
/// Who puts a plug into a hole holds it at least as tight as this, N, and turns the hand against its tilt: this fast, 1/s, and at most, rad/s.
pub(super) const FIRM: f64 = 1.5;
const RIGHTING: f64 = 2.5;
const RIGHTING_AT_MOST: f64 = 0.6;
/// Slower than this, m/s, is not moving on.
const STUCK: f64 = 0.001;

/// An object on its way into a socket, or out of it.
pub(super) struct InsertionMotion {
    pub(super) place: SocketSite,
    /// The height of the plug over the rim at which the way ends, m; negative inside.
    pub(super) to: f64,
    /// m/s.
    pub(super) speed: f64,
    /// How far beside the axis the hand aims, m.
    pub(super) error: Vector3<f64>,
    /// Whether it misses the hole altogether.
    pub(super) misses: bool,
    /// For how long the rim has been searched, s.
    pub(super) searched: f64,
    /// The time on the rim in this try, s; after `TRYING_S` the plug is lifted.
    pub(super) tried: f64,
    /// For how long the way has not gone on, s; the time since the start, s, and the height before, m.
    pub(super) stuck: f64,
    pub(super) time: f64,
    pub(super) before: Option<f64>,
}

impl InsertionMotion {
    /// The velocity that is wanted now, m/s, and whether the way is over.
    pub(super) fn step(
        &mut self,
        grip: &HandGrip,
        world: &World,
        felt: &SensorSample,
        reflex: &SensorSample,
    ) -> (Vector3<f64>, bool) {
        let seen = world.observation();
        let Some(plug) = self.place.plug(grip.object, &seen.bodies) else { return (Vector3::zeros(), true) };
        self.time += STEP_S;
        let way = plug.axis * (self.to - plug.height).signum();
        let going_in = self.to < 0.0;
        let inside = plug.height < -0.0005;
        let force = reflex.total();
        let across = |vector: Vector3<f64>| vector - plug.axis * vector.dot(&plug.axis);

        let mut aim = 1.0;
        let beside = if inside {
            -YIELDING * across(force) - CENTRING * plug.beside
        } else if going_in {
            if felt.touching(grip.object, self.place.body) {
                self.searched += STEP_S;
                self.tried += STEP_S;
            }
            let fading = if self.misses { 1.0 } else { ComplexField::exp(-self.searched / FINDING_S) };
            let off = self.error * fading + self.circle(&plug.axis) * fading.sqrt() - plug.beside;
            if plug.height < CAREFUL_M {
                aim = (1.0 - off.norm() / CAREFUL_M).clamp(0.0, 1.0);
            }
            let by_eye = off * BY_EYE;
            by_eye * (BY_EYE_AT_MOST / by_eye.norm()).min(1.0)
        } else {
            Vector3::zeros()
        };
        // A hand eases off when it meets more than it likes, or more than its grip can carry.
        let shallow = going_in && plug.height > -SHALLOW_M;
        let limit = if shallow {
            (LIGHT + HARDER * self.searched).min(EASING)
        } else {
            grip.squeeze.map_or(EASING, |squeeze| squeeze.clamp(LIGHT, EASING))
        };
        let weight = if going_in { 0.0 } else { grip.weight };
        let met = (force.dot(&way) - weight) / limit;
        let speed = self.speed.min(0.010 + 3.0 * (self.to - plug.height).abs());
        let mut wanted = way * speed * aim * (2.0 - met.max(0.0)).clamp(-1.0, 1.0) + beside;

        if self.tried > TRYING_S && !inside && !self.misses {
            wanted = beside - way * LIFTING;
            self.tried += STEP_S;
            if self.tried > TRYING_S + LIFTING_S {
                self.tried = 0.0;
            }
        }
        let moved = self.before.map_or(f64::INFINITY, |before| (plug.height - before).abs() / STEP_S);
        self.before = Some(plug.height);
        self.stuck = if inside && going_in && moved < STUCK { self.stuck + STEP_S } else { 0.0 };
        let arrived = if going_in { plug.height <= self.to } else { plug.height >= self.to };
        let over =
            arrived || self.stuck > STUCK_S || self.time > PATIENCE_S || self.misses && self.searched > PUZZLED_S;
        (wanted, over)
    }

    /// How the hand turns to set the plug upright: angular velocity, rad/s, and the point about which it turns.
    pub(super) fn righting(&self, grip: &HandGrip, world: &World) -> Option<(Vector3<f64>, Point3<f64>)> {
        let seen = world.observation();
        let plug = self.place.plug(grip.object, &seen.bodies)?;
        let middle = Point3::from(seen.bodies.get(grip.object)?.pose.translation.vector);
        let upright = (middle - plug.point).try_normalize(1e-6)?;
        let turn = upright.cross(&plug.axis) * RIGHTING;
        // About the fingers, so that the plug swings over the hole and not the hand over the plug.
        Some((turn * (RIGHTING_AT_MOST / turn.norm().max(1e-9)).min(1.0), middle))
    }

    /// The circle on which the hand searches, m; as large as the error that is to be found.
    fn circle(&self, axis: &Vector3<f64>) -> Vector3<f64> {
        let turned = std::f64::consts::TAU * CIRCLING_HZ * self.searched;
        let across = axis.cross(&self.error);
        CIRCLING * ComplexField::sin(turned) * across
    }
}
