//! Rigid bodies: the scene's bodies in rapier. Forces on bodies go in, poses, velocities and contact forces come out; the only file
//! that names rapier.
//!
//! A contact is rapier's damped spring (60 Hz, overdamped: a 50 g cube sinks 0.07 mm into its base) with Coulomb friction.
//! The force of a contact over a step is its impulse divided by the step. INVARIANT (millimetre world): rapier's lengths are scaled so that
//! tolerances are micrometres, and nothing ever sleeps.

use super::convert;
use super::shapes::{Solid, isometry};
use crate::base::error::InputError;
use crate::base::scene::{Role, Scene};
use nalgebra::{Isometry3, Point3, Vector3};
use rapier3d::dynamics::{FrictionModel, RigidBodyBuilder, RigidBodyHandle};
use rapier3d::geometry::{ColliderBuilder, ContactManifold};
use rapier3d::pipeline::PhysicsWorld;

/// No scene may have more bodies.
const MAX_BODIES: usize = 64;
/// rapier's tolerances are for metres; ours are for centimetres: errors below 50 µm, contacts predicted 0.2 mm ahead.
const LENGTH_UNIT: f64 = 0.01;
/// Sweeps over all contacts per step, so that stacks and corners converge.
const SWEEPS: usize = 4;

/// The force between two bodies over the last step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyContact {
    /// Index of the first body in the scene.
    pub body: usize,
    /// Index of the other body in the scene.
    pub other: usize,
    /// Force of `other` on `body`, N, reference frame; the mean over the last step.
    pub force: Vector3<f64>,
    /// Unit normal from `other` to `body`, reference frame, weighted by force; zero without contact.
    pub normal: Vector3<f64>,
}

/// The scene's bodies, in its order.
pub(super) struct Bodies {
    physics: PhysicsWorld,
    handles: Vec<RigidBodyHandle>,
    /// What is moved and what stands still.
    movable: Vec<bool>,
    solids: Vec<Solid>,
    /// Where the bodies are, `world_from_body`: asked for many times a step.
    poses: Vec<Isometry3<f64>>,
}

impl Bodies {
    /// The bodies of a scene at their starting poses.
    ///
    /// # Errors
    /// A body that cannot be simulated: no shape, no mass, a size or number out of range.
    pub(super) fn new(scene: &Scene) -> Result<Self, InputError> {
        if scene.bodies.len() > MAX_BODIES {
            let message = format!("has {} bodies, at most {MAX_BODIES} are simulated", scene.bodies.len());
            return Err(InputError::new("scene", message));
        }
        let mut physics = PhysicsWorld::new();
        physics.gravity = convert::vector(Vector3::from(scene.gravity.map(|part| part.0)));
        let parameters = &mut physics.integration_parameters;
        parameters.length_unit = LENGTH_UNIT;
        parameters.num_internal_pgs_iterations = SWEEPS;
        // INVARIANT (friction is read): one inner step, so that the friction impulse that rapier keeps is that of the whole step.
        parameters.num_solver_iterations = 1;
        // One friction force and one twist for each manifold: exact for a sliding block. (Friction at each corner by itself is
        // turned out of the direction of sliding by the block's inertia; a cube then slides with 0.37 instead of 0.4.)
        parameters.friction_model = FrictionModel::Simplified;
        parameters.normalized_max_linear_velocity = f64::MAX;
        // Contact data are read every step: they must be those of this step.
        parameters.contact_recycling = false;
        parameters.contact_clustering = false;
        let mut bodies =
            Self { physics, handles: Vec::new(), movable: Vec::new(), solids: Vec::new(), poses: Vec::new() };
        for (index, (name, body)) in scene.bodies.iter().enumerate() {
            let refuse = |message: String| InputError::new(format!("body `{name}`"), message);
            let solid = Solid::new(name, body)?;
            let pose = isometry(body.position.map(|length| length.0), body.rotation).map_err(refuse)?;
            if !(0.0..=10.0).contains(&body.friction) {
                return Err(refuse(format!("has friction {}, wanted 0 to 10", body.friction)));
            }
            let movable = body.role == Role::Object;
            let builder =
                if movable { RigidBodyBuilder::dynamic().can_sleep(false) } else { RigidBodyBuilder::fixed() };
            let handle = bodies.physics.insert_body(builder.pose(convert::pose(&pose)));
            let density = if movable {
                let mass = body.mass.map(|mass| mass.0).ok_or_else(|| refuse("is an object without mass".into()))?;
                if !(1e-4..=1e3).contains(&mass) {
                    return Err(refuse(format!("has a mass of {mass} kg, wanted 0.1 g to 1000 kg")));
                }
                mass / solid.volume()
            } else {
                0.0
            };
            for part in solid.parts() {
                let collider = ColliderBuilder::new(part.shape.clone())
                    .position(convert::pose(&part.body_from_part))
                    .density(density)
                    .friction(body.friction)
                    .user_data(index as u128);
                bodies.physics.insert_collider(collider, Some(handle));
            }
            bodies.handles.push(handle);
            bodies.movable.push(movable);
            bodies.solids.push(solid);
            bodies.poses.push(pose);
        }
        Ok(bodies)
    }

    /// How many bodies there are.
    pub(super) fn len(&self) -> usize {
        self.handles.len()
    }

    /// Whether this body moves.
    pub(super) fn is_movable(&self, body: usize) -> bool {
        self.movable[body]
    }

    /// The shape of a body.
    pub(super) fn solid(&self, body: usize) -> &Solid {
        &self.solids[body]
    }

    /// The pose of a body, `world_from_body`.
    pub(super) fn pose(&self, body: usize) -> Isometry3<f64> {
        self.poses[body]
    }

    /// Velocity of a body's material at a point, m/s, both in the reference frame.
    pub(super) fn velocity_at(&self, body: usize, point: Point3<f64>) -> Vector3<f64> {
        convert::our_vector(self.physics.bodies[self.handles[body]].velocity_at_point(convert::point(point)))
    }

    /// Angular velocity of a body, rad/s, reference frame.
    pub(super) fn angular_velocity(&self, body: usize) -> Vector3<f64> {
        convert::our_vector(self.physics.bodies[self.handles[body]].angvel())
    }

    /// How fast a body's material at `point` answers to an impulse along the worst direction there, 1/kg: `1/m + |r|²/I_min`.
    pub(super) fn mobility_at(&self, body: usize, point: Point3<f64>) -> f64 {
        let body = &self.physics.bodies[self.handles[body]];
        let properties = body.mass_properties();
        let arm = convert::our_point(body.center_of_mass()) - point;
        let inverse_inertia = convert::our_vector(properties.local_mprops.inv_principal_inertia).max();
        properties.local_mprops.inv_mass + arm.norm_squared() * inverse_inertia
    }

    /// Lets a force (N) and a torque (N m) act on a body during the next step, the force at a point; reference frame.
    pub(super) fn push(&mut self, body: usize, force: Vector3<f64>, point: Point3<f64>, torque: Vector3<f64>) {
        let body = &mut self.physics.bodies[self.handles[body]];
        body.add_force_at_point(convert::vector(force), convert::point(point), true);
        body.add_torque(convert::vector(torque), true);
    }

    /// Advances by `dt` seconds under gravity, contacts and what was pushed since the last step.
    pub(super) fn step(&mut self, dt: f64) {
        self.physics.integration_parameters.dt = dt;
        self.physics.step();
        for &handle in &self.handles {
            let body = &mut self.physics.bodies[handle];
            body.reset_forces(false);
            body.reset_torques(false);
        }
        for (pose, handle) in self.poses.iter_mut().zip(&self.handles) {
            *pose = convert::our_pose(self.physics.bodies[*handle].position());
        }
    }

    /// Adds to `contacts` (one entry per pair, see [`Self::pairs`]) the impulses of the last step, N s, as force times time.
    pub(super) fn add_impulses(&self, contacts: &mut [BodyContact]) {
        for pair in self.physics.narrow_phase.contact_pairs() {
            let owner = |collider| self.physics.colliders.get(collider).map(|collider| collider.user_data as usize);
            let (Some(body1), Some(body2)) = (owner(pair.collider1), owner(pair.collider2)) else { continue };
            let Some(contact) = contacts.iter_mut().find(|contact| {
                (contact.body, contact.other) == (body1, body2) || (contact.body, contact.other) == (body2, body1)
            }) else {
                continue;
            };
            // The manifold's normal points from body 1 to body 2.
            let sign = if contact.body == body2 { 1.0 } else { -1.0 };
            for manifold in pair.solver_manifolds() {
                let (pressed, on_second) = impulses(manifold);
                contact.force += sign * on_second;
                contact.normal += sign * pressed * convert::our_vector(manifold.data.normal);
            }
        }
    }

    /// One empty contact for each pair of bodies that can touch: objects in scene order with every body that is fixed or comes later.
    pub(super) fn pairs(&self) -> Vec<BodyContact> {
        let pairs = (0..self.len()).filter(|&body| self.movable[body]).flat_map(|body| {
            (0..self.len())
                .filter(move |&other| other != body && (!self.movable[other] || other > body))
                .map(move |other| (body, other))
        });
        pairs
            .map(|(body, other)| BodyContact { body, other, force: Vector3::zeros(), normal: Vector3::zeros() })
            .collect()
    }
}

/// Normal impulse, and impulse on the second body with friction, of a manifold; N s.
fn impulses(manifold: &ContactManifold) -> (f64, Vector3<f64>) {
    let active = manifold.data.solver_contacts.iter().map(|contact| contact.contact_indices()[0] as usize);
    let points: Vec<_> = active.filter_map(|index| manifold.points.get(index)).collect();
    let pressed: f64 = points.iter().map(|point| point.data.impulse).sum();
    // Each point carries the friction of the whole manifold on the first body.
    let friction =
        points.first().map(|point| convert::our_vector(point.data.warmstart_tangent_world)).unwrap_or_default();
    (pressed, pressed * convert::our_vector(manifold.data.normal) - friction)
}
