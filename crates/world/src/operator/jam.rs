//! Jams: the plug point is moved by eye to a point beside the axis, then down until the fingers feel the rim. From then on the felt force controls the press.

use super::grips::HandGrip;
use super::guarded_motion::{FOLLOWING, SEEKING};
use super::insertion::{BY_EYE, BY_EYE_AT_MOST, CAREFUL_M};
use super::sensor_history::SensorSample;
use crate::sockets::SocketSite;
use crate::{STEP_S, World};
use nalgebra::{Isometry3, Vector3};

/// The time of the press counts while the force is at least this share of the intended force. A press that does not reach it is given up after its
/// time and `PATIENCE_S`, s.
const PRESSED: f64 = 0.7;
const PATIENCE_S: f64 = 6.0;
/// Maximum force of the press over the squeeze of the fingers: with a larger force the object slips.
const MAX_OVER_SQUEEZE: f64 = 1.4;
/// Squeeze of a grip that presses, over the force of the press.
pub(super) const SQUEEZE: f64 = 0.8;

/// An object that is moved to the rim, then pressed on it.
pub(super) struct JamMotion {
    pub(super) place: SocketSite,
    /// Vector from the axis to the point of the rim, m.
    pub(super) beside: Vector3<f64>,
    /// Speed along the axis until the rim is felt, m/s.
    pub(super) speed: f64,
    /// Force along the axis, N.
    pub(super) force: f64,
    /// Duration of the press, s.
    pub(super) time: f64,
    /// Time since the rim was felt, and time with enough force, s.
    pub(super) felt_s: f64,
    pub(super) pressed_s: f64,
}

impl JamMotion {
    /// The velocity of the palm for the next step, m/s, and whether the press is over.
    pub(super) fn step(
        &mut self,
        grip: &HandGrip,
        world: &World,
        felt: &SensorSample,
        palm: &Isometry3<f64>,
    ) -> (Vector3<f64>, bool) {
        let Some(plug) = self.place.plug(grip.object, &world.observation().bodies) else {
            return (Vector3::zeros(), true);
        };
        if self.felt_s == 0.0 && !felt.touching(grip.object, self.place.body) {
            let off = self.beside - plug.beside;
            let by_eye = off * BY_EYE;
            let aim = if plug.height < CAREFUL_M { (1.0 - off.norm() / CAREFUL_M).clamp(0.0, 1.0) } else { 1.0 };
            let down = self.speed.min(0.010 + 3.0 * plug.height.max(0.0)) * aim;
            return (by_eye * (BY_EYE_AT_MOST / by_eye.norm()).min(1.0) - plug.axis * down, false);
        }
        self.felt_s += STEP_S;
        let pushed = -felt.total().dot(&plug.axis);
        if pushed >= PRESSED * self.force {
            self.pressed_s += STEP_S;
        }
        let wanted = self.force.min(MAX_OVER_SQUEEZE * felt.squeeze(grip, palm));
        let speed = (FOLLOWING * (wanted - pushed)).clamp(-SEEKING, SEEKING);
        (-plug.axis * speed, self.pressed_s >= self.time || self.felt_s > self.time + PATIENCE_S)
    }
}
