//! Insertion of an object into a socket and its extraction: visual alignment above the rim, search by touch on the rim, and compliance inside.

use super::grips::HandGrip;
use super::guarded_motion::EASING;
use super::sensor_history::SensorSample;
use crate::sockets::SocketSite;
use crate::{STEP_S, World};
use nalgebra::{ComplexField, Point3, Vector3};

/// The gain (1/s) and the maximum speed (m/s) of the visual alignment of the plug with the axis.
pub(super) const BY_EYE: f64 = 3.0;
pub(super) const BY_EYE_AT_MOST: f64 = 0.030;
/// While the plug is in: the admittance of the hand for lateral forces, m/s per N, and the gain towards the axis, 1/s.
const YIELDING: f64 = 0.020;
const CENTRING: f64 = 1.0;
/// Below this height over the rim, m, the hand descends only as far as it is aligned.
pub(super) const CAREFUL_M: f64 = 0.003;
/// Above this depth, m, the hand slows down at this force, N, because a peg that is pressed on the rim tilts. The force grows with the time of the try, N/s.
const SHALLOW_M: f64 = 0.004;
const LIGHT: f64 = 0.2;
const HARDER: f64 = 0.01;
/// An operator who does not find the hole in this time (s) lifts the plug for a time (s) at a speed (m/s) and continues.
const TRYING_S: f64 = 2.0;
const LIFTING_S: f64 = 0.4;
const LIFTING: f64 = 0.025;
/// During the search on the rim the error of the aim decays with this time constant, s. The hand circles with this frequency, Hz; the radius is this share of
/// the initial error.
const FINDING_S: f64 = 0.5;
const CIRCLING_HZ: f64 = 1.5;
const CIRCLING: f64 = 0.5;
/// The time on the rim before an operator who has missed the hole lifts the hand, s.
const PUZZLED_S: f64 = 0.35;
/// An inserted plug that does not move for this time, s, is fully inserted; the operator gives up after `PATIENCE_S`.
const STUCK_S: f64 = 0.4;
const PATIENCE_S: f64 = 20.0;
/// The minimum grip force during an insertion, N; and the gain (1/s) and maximum rate (rad/s) with which the hand corrects the tilt of the plug.
pub(super) const FIRM: f64 = 1.5;
const RIGHTING: f64 = 2.5;
const RIGHTING_AT_MOST: f64 = 0.6;
/// The speed below which a plug does not move, m/s.
const STUCK: f64 = 0.001;

/// An insertion or extraction.
pub(super) struct InsertionMotion {
    pub(super) place: SocketSite,
    /// The height of the plug over the rim at which the motion ends, m; negative inside.
    pub(super) to: f64,
    /// Speed, m/s.
    pub(super) speed: f64,
    /// The error of the hand's aim across the axis, m.
    pub(super) error: Vector3<f64>,
    /// Whether it misses the hole.
    pub(super) misses: bool,
    /// The time of the search on the rim, s.
    pub(super) searched: f64,
    /// The time on the rim in this try, s; after `TRYING_S` the plug is lifted.
    pub(super) tried: f64,
    /// The time without progress, s; the time since the start, s; and the previous height, m.
    pub(super) stuck: f64,
    pub(super) time: f64,
    pub(super) before: Option<f64>,
}

impl InsertionMotion {
    /// Returns the desired velocity, m/s, and whether the motion is over.
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
        // The hand slows down at a force above its limit, or above the friction of its grip.
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

    /// Returns the rotation of the hand that aligns the plug with the axis: angular velocity, rad/s, and its center.
    pub(super) fn righting(&self, grip: &HandGrip, world: &World) -> Option<(Vector3<f64>, Point3<f64>)> {
        let seen = world.observation();
        let plug = self.place.plug(grip.object, &seen.bodies)?;
        let middle = Point3::from(seen.bodies.get(grip.object)?.pose.translation.vector);
        let upright = (middle - plug.point).try_normalize(1e-6)?;
        let turn = upright.cross(&plug.axis) * RIGHTING;
        // The center is between the fingers, so that the plug moves over the hole and not the hand over the plug.
        Some((turn * (RIGHTING_AT_MOST / turn.norm().max(1e-9)).min(1.0), middle))
    }

    /// Returns the displacement of the hand on its search circle, m; the radius is that of the error.
    fn circle(&self, axis: &Vector3<f64>) -> Vector3<f64> {
        let turned = std::f64::consts::TAU * CIRCLING_HZ * self.searched;
        let across = axis.cross(&self.error);
        CIRCLING * ComplexField::sin(turned) * across
    }
}
