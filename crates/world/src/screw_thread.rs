//! Threads: the forces between a screw and its nut. Both flanks are springs and dampers that cannot pull, with play between them:
//!
//! ```text
//! e   = h - p φ / 2π                            how far the screw is off the middle of its helix, along the axis
//! F   = -K (e - ½ play) - C de/dt               the upper flank, ≤ 0, when e > ½ play; the lower one, ≥ 0, when e < -½ play
//! τ   = -F p / 2π                               the flank is inclined: what the screw gains along the axis it loses about it
//! τ_f = -(K_f θ + C_f dφ/dt), |τ_f| ≤ limit     friction: a bristle for the turn, dragged along when it slips
//! ```
//!
//! with h the height of the plug point above the rim, φ the angle of the screw about the axis and p the pitch: right-handed, a turn
//! counter-clockwise seen from outside raises the screw by p. Guidance across the axis is left to the walls of the hole. Every constant is ours.

use super::simulation::BodyState;
use super::sockets::SocketSite;
use nalgebra::{Point3, Vector3};
use std::f64::consts::{PI, TAU};

/// Play along the axis, m.
const PLAY_M: f64 = 0.001;
/// K, N/m, and C, N s/m, of a flank.
const STIFFNESS: f64 = 5000.0;
const DAMPING: f64 = 10.0;
/// K_f, N m/rad, C_f, N m s/rad, and the largest friction, N m.
const TWIST_STIFFNESS: f64 = 0.5;
const TWIST_DAMPING: f64 = 0.002;
const FRICTION: f64 = 0.003;

/// One screw in one thread.
#[derive(Clone)]
pub(super) struct ScrewThread {
    place: SocketSite,
    object: usize,
    pitch: f64,
    engaged: Option<Engagement>,
}

/// The state while the screw is in.
#[derive(Clone)]
struct Engagement {
    /// Angle about the axis, unwrapped, rad, and as it was measured last.
    angle: f64,
    measured: f64,
    /// Height at angle 0 in the middle of the play, m.
    origin: f64,
    /// The friction's bristle, rad.
    twist: f64,
}

/// The wrench of a thread on its screw, reference frame.
pub(super) struct ThreadWrench {
    pub(super) force: Vector3<f64>,
    pub(super) torque: Vector3<f64>,
    pub(super) point: Point3<f64>,
    /// Unit normal of the flank that is pressed, towards the screw; zero for none.
    pub(super) normal: Vector3<f64>,
}

/// The threads of a scene's sockets.
pub(super) fn threads(places: &[SocketSite]) -> Vec<ScrewThread> {
    let threaded = places.iter().filter_map(|place| place.socket.pitch.map(|pitch| (place, pitch.0)));
    threaded
        .flat_map(|(place, pitch)| {
            let thread = move |(object, _): &(usize, Point3<f64>)| ScrewThread {
                place: place.clone(),
                object: *object,
                pitch,
                engaged: None,
            };
            place.plugs.iter().map(thread)
        })
        .collect()
}

impl ScrewThread {
    /// Index of the screw, and of the body with the thread.
    pub(super) fn bodies(&self) -> (usize, usize) {
        (self.object, self.place.body)
    }

    /// Returns the wrench on the screw during the next `dt` seconds; `None` while the screw is out.
    pub(super) fn step(&mut self, bodies: &[BodyState], dt: f64) -> Option<ThreadWrench> {
        let plug = self.place.plug(self.object, bodies).filter(|plug| self.place.holds(plug));
        let Some(plug) = plug else {
            self.engaged = None;
            return None;
        };
        let (screw, holder) = (bodies.get(self.object)?, bodies.get(self.place.body)?);
        let measured = angle_about(&plug.axis, holder, screw);
        // It enters, or is found, in the middle of its play.
        let engaged = self.engaged.get_or_insert(Engagement { angle: 0.0, measured, origin: plug.height, twist: 0.0 });
        engaged.angle += (measured - engaged.measured + PI).rem_euclid(TAU) - PI;
        engaged.measured = measured;

        // Flanks.
        let lead = self.pitch / TAU;
        let off = plug.height - engaged.origin - lead * engaged.angle;
        let spin = (screw.angular_velocity - holder.angular_velocity).dot(&plug.axis);
        let at_plug =
            screw.velocity + screw.angular_velocity.cross(&(plug.point - Point3::from(screw.pose.translation.vector)));
        let rate = at_plug.dot(&plug.axis) - lead * spin;
        let beyond = off.abs() - PLAY_M / 2.0;
        let pressed = if beyond > 0.0 { (STIFFNESS * beyond + DAMPING * rate * off.signum()).max(0.0) } else { 0.0 };
        let along = -pressed * off.signum();

        // Friction.
        engaged.twist += spin * dt;
        let mut friction = TWIST_STIFFNESS * engaged.twist + TWIST_DAMPING * spin;
        if friction.abs() > FRICTION {
            friction = FRICTION.copysign(friction);
            engaged.twist = friction / TWIST_STIFFNESS;
        }
        Some(ThreadWrench {
            force: plug.axis * along,
            torque: plug.axis * (-along * lead - friction),
            point: plug.point,
            normal: if pressed > 0.0 { plug.axis * along.signum() } else { Vector3::zeros() },
        })
    }
}

/// The angle of a screw about an axis, rad, against its holder: the twist of its rotation about the axis.
fn angle_about(axis: &Vector3<f64>, holder: &BodyState, screw: &BodyState) -> f64 {
    let turned = holder.pose.rotation.inverse() * screw.pose.rotation;
    let axis_in_holder = holder.pose.rotation.inverse() * axis;
    let along = turned.imag().dot(&axis_in_holder);
    2.0 * nalgebra::RealField::atan2(along, turned.w)
}
