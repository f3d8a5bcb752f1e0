//! A body that moves: its mass, its motion, and what fingertips do to it.
//!
//! The damping of fingertips that hold a body is taken implicitly, so that a light body may be held by many without a finer step. A damper d
//! between a fingertip and the point p of a body pushes with `f - d Δv(p)`: f is its force at the velocities before the step, Δv(p) is what the
//! step adds to the body's velocity at p. With J the map from the body's velocity to that of p, a step of length dt is
//!
//! ```text
//! (M + Σ Jᵀ d dt J) Δv = dt Σ Jᵀ f + impulses of gravity and other bodies
//! ```
//!
//! which is the equation of the body with a point mass `d dt` fixed at each p, without weight. For this one step the body is given
//! those masses, so that its contacts with other bodies are solved in the same equation.

use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};

/// A body that moves; everything in the reference frame but what is said to be in the body's.
#[derive(Clone)]
pub(super) struct BodyDynamics {
    mass: f64,
    com_in_body: Point3<f64>,
    inertia_in_body: Matrix3<f64>,
    /// Now, and before the last step.
    now: Motion,
    before: Motion,
    /// What acts during the next step, N and N m about the center of mass.
    force: Vector3<f64>,
    torque: Vector3<f64>,
    /// The point masses of the next step: their sum, first moment and inertia about the body's center of mass.
    held: f64,
    moment: Vector3<f64>,
    inertia: Matrix3<f64>,
}

/// Motion of the center of mass.
#[derive(Clone, Copy)]
struct Motion {
    com: Point3<f64>,
    velocity: Vector3<f64>,
    spin: Vector3<f64>,
}

/// A body with its point masses.
pub(super) struct LumpedMass {
    /// kg.
    pub(super) mass: f64,
    /// Body frame.
    pub(super) com: Point3<f64>,
    /// About that center, body frame, kg m².
    pub(super) inertia: Matrix3<f64>,
}

impl BodyDynamics {
    /// A body at rest.
    pub(super) fn new(mass: f64, com_in_body: Point3<f64>, inertia_in_body: Matrix3<f64>, com: Point3<f64>) -> Self {
        let rest = Motion { com, velocity: Vector3::zeros(), spin: Vector3::zeros() };
        Self {
            mass,
            com_in_body,
            inertia_in_body,
            now: rest,
            before: rest,
            force: Vector3::zeros(),
            torque: Vector3::zeros(),
            held: 0.0,
            moment: Vector3::zeros(),
            inertia: Matrix3::zeros(),
        }
    }

    /// Its center of mass, body frame.
    pub(super) fn com_in_body(&self) -> Point3<f64> {
        self.com_in_body
    }

    /// Velocity of its material at a point, m/s.
    pub(super) fn velocity_at(&self, point: Point3<f64>) -> Vector3<f64> {
        self.now.velocity + self.now.spin.cross(&(point - self.now.com))
    }

    /// Angular velocity, rad/s.
    pub(super) fn spin(&self) -> Vector3<f64> {
        self.now.spin
    }

    /// What the last step added to the velocity of the material that was at `point` before it, m/s.
    pub(super) fn change_at(&self, point: Point3<f64>) -> Vector3<f64> {
        let arm = point - self.before.com;
        self.now.velocity - self.before.velocity + (self.now.spin - self.before.spin).cross(&arm)
    }

    /// How fast the material at `point` answers to an impulse, along the impulse's unit direction, 1/kg.
    pub(super) fn mobility(&self, point: Point3<f64>, along: Vector3<f64>, rotation: &UnitQuaternion<f64>) -> f64 {
        let lever = rotation.inverse_transform_vector(&(point - self.now.com).cross(&along));
        let turned = self.inertia_in_body.try_inverse().map_or(0.0, |inverse| lever.dot(&(inverse * lever)));
        1.0 / self.mass + turned
    }

    /// Lets a force at a point and a torque act during the next step.
    pub(super) fn push(&mut self, force: Vector3<f64>, point: Point3<f64>, torque: Vector3<f64>) {
        self.force += force;
        self.torque += (point - self.now.com).cross(&force) + torque;
    }

    /// Fixes a mass, kg, to a point for the next step.
    pub(super) fn hold(&mut self, point: Point3<f64>, mass: f64) {
        let arm = point - self.now.com;
        self.held += mass;
        self.moment += mass * arm;
        self.inertia += mass * about(&arm);
    }

    /// The body with the point masses of the next step; `None` when there are none.
    pub(super) fn lumped(&self, rotation: &UnitQuaternion<f64>) -> Option<LumpedMass> {
        (self.held > 0.0).then(|| {
            let mass = self.mass + self.held;
            let offset = self.offset();
            let to_body = rotation.inverse().to_rotation_matrix();
            let added = self.inertia - mass * about(&offset);
            LumpedMass {
                mass,
                com: self.com_in_body + to_body * offset,
                inertia: self.inertia_in_body + to_body * added * to_body.transpose(),
            }
        })
    }

    /// Velocity of the center of mass with the point masses, m/s.
    pub(super) fn lumped_velocity(&self) -> Vector3<f64> {
        self.now.velocity + self.now.spin.cross(&self.offset())
    }

    /// What acts during the next step, N and N m about the center of mass with the point masses; they have no weight.
    pub(super) fn load(&self, gravity: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        let force = self.force + gravity * self.mass;
        (force, self.torque - self.offset().cross(&force))
    }

    /// Takes over the velocities of a step, that of the center of mass with the point masses, and forgets what acted.
    pub(super) fn answered(&mut self, lumped_velocity: Vector3<f64>, spin: Vector3<f64>, com: Point3<f64>) {
        // Where the body was before: what the step did to it was solved there.
        let velocity = lumped_velocity - spin.cross(&self.offset());
        self.before = self.now;
        self.now = Motion { com, velocity, spin };
        (self.force, self.torque) = (Vector3::zeros(), Vector3::zeros());
        (self.held, self.moment, self.inertia) = (0.0, Vector3::zeros(), Matrix3::zeros());
    }

    /// How far the point masses draw the center of mass.
    fn offset(&self) -> Vector3<f64> {
        self.moment / (self.mass + self.held)
    }
}

/// Inertia of 1 kg at `arm` about the origin.
fn about(arm: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::from_diagonal_element(arm.norm_squared()) - arm * arm.transpose()
}
