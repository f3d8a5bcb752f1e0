//! The fingertip contact law: the haptic interface of the paper (sections 2.3, 3.1; docs/sources.md, Contacts; every constant but the
//! friction coefficients and the ceiling is ours).
//!
//! A fingertip is a ball that overlaps a body by the depth δ. With the outward normal n of the body and the tangential stretch s of a
//! bristle whose far end is anchored in the body,
//!
//! ```text
//! f_n = max(0, K_n δ + C_n dδ/dt)                      pushes the body along -n
//! f_t = K_t s + C_t ds/dt                               while |f_t| ≤ μ_s f_n: the tip sticks
//! f_t = μ_d f_n along the stretch, anchor dragged       after that: the tip slips, until |f_t| ≤ μ_d f_n again
//! τ   = K_τ θ + C_τ dθ/dt about n, |τ| ≤ ⅔ μ r f_n      the same bristle for the twist of the soft pad of radius r
//! ```
//!
//! and |f| never exceeds the ceiling. While a tip sticks, the damping that both directions have in common, min(C_n, C_t), is that of the body's
//! velocity at the end of the step ([`super::body_dynamics`]): many tips on a light body damp it as they should, and never shake it.

use nalgebra::{Isometry3, Point3, Vector3};

/// Constants of the law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchLaw {
    /// K_n, N/m.
    pub stiffness: f64,
    /// C_n, N s/m.
    pub damping: f64,
    /// K_t, N/m.
    pub tangential_stiffness: f64,
    /// C_t, N s/m.
    pub tangential_damping: f64,
    /// μ_s.
    pub static_friction: f64,
    /// μ_d.
    pub dynamic_friction: f64,
    /// Radius of the pad's patch, m: what a twist works on.
    pub patch_radius: f64,
    /// The largest force, N: above it the magnet of the haptic device lets go.
    pub ceiling: f64,
}

impl Default for TouchLaw {
    fn default() -> Self {
        Self {
            stiffness: 1000.0,
            damping: 5.0,
            tangential_stiffness: 700.0,
            tangential_damping: 3.5,
            static_friction: 1.0,
            dynamic_friction: 0.5,
            patch_radius: 0.004,
            ceiling: 5.0,
        }
    }
}

/// The state of the contact between one fingertip and one body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bristle {
    /// The anchor of the bristle, body frame.
    anchor_in_body: Point3<f64>,
    /// The normal of the step before, body frame: it stands in when the center of the ball lies on the surface.
    normal_in_body: Vector3<f64>,
    /// Twist of the tip against the body about the normal, rad.
    twist: f64,
    /// Whether the tip slips, and whether the patch does.
    slips: bool,
    spins: bool,
    /// Whether the last step's damping was taken explicitly.
    explicit: bool,
}

/// A fingertip overlapping a body, reference frame.
pub(super) struct Overlap {
    /// The depth of the overlap, m, positive.
    pub(super) depth: f64,
    /// The point of the body's surface where the forces act.
    pub(super) point: Point3<f64>,
    /// Unit normal out of the body; `None` when it is not defined.
    pub(super) normal: Option<Vector3<f64>>,
    /// Velocity of the tip against the body's material at the point, m/s.
    pub(super) velocity: Vector3<f64>,
    /// Angular velocity of the tip against the body, rad/s.
    pub(super) spin: Vector3<f64>,
    /// The body's pose.
    pub(super) world_from_body: Isometry3<f64>,
}

/// The wrench of a fingertip on a body, reference frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Touch {
    /// Force on the body, N.
    pub(super) force: Vector3<f64>,
    /// Torque on the body, N m.
    pub(super) torque: Vector3<f64>,
    /// Unit normal out of the body.
    pub(super) normal: Vector3<f64>,
    /// The damping that is to be taken implicitly, N s/m: the force becomes [`TouchLaw::answered`] when the body has moved.
    pub(super) damping: f64,
}

impl Bristle {
    /// Whether damping is left that is taken explicitly.
    pub(super) fn is_explicit(&self) -> bool {
        self.explicit
    }
}

impl TouchLaw {
    /// The law of a flat pad, a disc of this radius (m) of the same material: along the surface and for a twist it is per area as stiff as a fingertip per area
    /// of its patch (an elastic foundation; K. L. Johnson, Contact Mechanics, 1985, section 4.3). Along the normal it gives way as a fingertip does, since what
    /// is behind it does. It is damped in all directions alike, so that all of it can be taken implicitly.
    pub fn with_pad(&self, radius: f64) -> Self {
        let tangential_stiffness = self.tangential_stiffness * (radius / self.patch_radius).powi(2);
        Self { tangential_stiffness, tangential_damping: self.damping, patch_radius: radius, ..*self }
    }

    /// The law of a fingertip with `by` times the stiffness, damping and force limit.
    #[must_use]
    pub fn scaled(&self, by: f64) -> Self {
        Self {
            stiffness: self.stiffness * by,
            damping: self.damping * by,
            tangential_stiffness: self.tangential_stiffness * by,
            tangential_damping: self.tangential_damping * by,
            ceiling: self.ceiling * by,
            ..*self
        }
    }

    /// The damping of a tip that sticks which is the same in all directions, N s/m.
    fn common_damping(&self) -> f64 {
        self.damping.min(self.tangential_damping)
    }

    /// The force on the body after all, N, when the step has changed the velocity of the body's material by `change`, m/s: the damping of a tip that
    /// sticks is that of the body's new velocity. What the fingertip feels neither pulls nor exceeds the ceiling.
    pub(super) fn answered(&self, touch: &Touch, change: Vector3<f64>) -> Vector3<f64> {
        if touch.damping == 0.0 {
            return touch.force;
        }
        let force = touch.force - touch.damping * change;
        let force = force - touch.normal * force.dot(&touch.normal).max(0.0);
        force * (self.ceiling / force.norm()).min(1.0)
    }

    /// Computes one step of the law: returns force and torque on the body, and updates the state.
    pub(super) fn touch(&self, before: Option<Bristle>, overlap: &Overlap, dt: f64) -> (Touch, Bristle) {
        let body = &overlap.world_from_body;
        let normal = overlap.normal.or(before.map(|bristle| body * bristle.normal_in_body)).unwrap_or_else(Vector3::z);
        let fresh = Bristle {
            anchor_in_body: body.inverse_transform_point(&overlap.point),
            normal_in_body: body.inverse_transform_vector(&normal),
            twist: 0.0,
            slips: false,
            spins: false,
            explicit: false,
        };
        let mut bristle = Bristle { normal_in_body: fresh.normal_in_body, ..before.unwrap_or(fresh) };

        // Normal force: a spring and a damper that cannot pull.
        let deepening = -overlap.velocity.dot(&normal);
        let pressed = (self.stiffness * overlap.depth + self.damping * deepening).max(0.0);

        // Friction: stretch of the bristle and its rate, in the tangent plane.
        let tangential = |vector: Vector3<f64>| vector - normal * vector.dot(&normal);
        let stretch = tangential(overlap.point - body * bristle.anchor_in_body);
        let mut friction = self.tangential_stiffness * stretch + self.tangential_damping * tangential(overlap.velocity);
        let (limit, slips) = self.limit(friction.norm(), pressed, bristle.slips);
        bristle.slips = slips;
        if slips {
            friction = friction.normalize() * limit;
            let anchor = overlap.point - friction / self.tangential_stiffness;
            bristle.anchor_in_body = body.inverse_transform_point(&anchor);
        }

        // Twist about the normal: the same law for a disc of the patch's radius.
        let radius2 = self.patch_radius * self.patch_radius / 2.0;
        let (twist_stiffness, twist_damping) = (self.tangential_stiffness * radius2, self.tangential_damping * radius2);
        let spin = overlap.spin.dot(&normal);
        bristle.twist += spin * dt;
        let mut twisting = twist_stiffness * bristle.twist + twist_damping * spin;
        let (limit, spins) = self.limit(twisting.abs(), pressed * self.patch_radius * 2.0 / 3.0, bristle.spins);
        bristle.spins = spins;
        if spins {
            twisting = limit.copysign(twisting);
            bristle.twist = twisting / twist_stiffness;
        }

        let force = friction - normal * pressed;
        let scale = (self.ceiling / force.norm()).min(1.0);
        let damping = if pressed > 0.0 && !slips && scale == 1.0 { self.common_damping() } else { 0.0 };
        bristle.explicit = pressed > 0.0 && damping == 0.0;
        (Touch { force: force * scale, torque: normal * twisting * scale, normal, damping }, bristle)
    }

    /// The largest friction at this pressure, and whether the trial value slips: it takes μ_s to start slipping, μ_d to go on.
    fn limit(&self, trial: f64, pressed: f64, slipping: bool) -> (f64, bool) {
        let holds = if slipping { self.dynamic_friction } else { self.static_friction };
        (self.dynamic_friction * pressed, trial > holds * pressed)
    }
}
