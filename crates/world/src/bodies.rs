//! Rigid bodies: the scene's bodies in rapier. Forces on bodies go in, poses, velocities and contact forces come out; the only file
//! that names rapier.
//!
//! A contact is rapier's damped spring (60 Hz, overdamped: a 50 g cube sinks 0.07 mm into its base) with Coulomb friction.
//! The force of a contact over a step is its impulse divided by the step. INVARIANT (millimeter world): rapier's lengths are scaled so that
//! tolerances are micrometres, and nothing ever sleeps.

use super::body_dynamics::BodyDynamics;
use super::conversion;
use super::rolling_contact;
use super::shapes::{Aabb, Solid, isometry};
use nalgebra::{Isometry3, Point3, Vector3};
use parry3d::mass_properties::MassProperties;
use rapier3d::dynamics::{FrictionModel, RigidBodyBuilder, RigidBodyHandle};
use rapier3d::geometry::{ColliderBuilder, ContactManifold, NarrowPhase};
use rapier3d::pipeline::PhysicsWorld;
use teachtree_base::error::InputError;
use teachtree_base::scene::{Role, Scene};
use teachtree_base::short_number::ShortNumber;

/// Maximum number of bodies of a scene.
const MAX_BODIES: usize = 64;
/// rapier's tolerances are for meters; ours are for centimeters: errors below 50 µm, contacts predicted 0.2 mm ahead.
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

/// What acts on a body during a step; reference frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyWrench {
    /// Force, N, and the point where it acts.
    pub(super) force: Vector3<f64>,
    pub(super) point: Point3<f64>,
    /// Torque, N m.
    pub(super) torque: Vector3<f64>,
    /// Damping that is taken implicitly, N s/m, the same in all directions.
    pub(super) damping: f64,
}

/// The scene's bodies, in its order.
#[derive(Clone)]
pub(super) struct Bodies {
    physics: Physics,
    gravity: Vector3<f64>,
    handles: Vec<RigidBodyHandle>,
    /// The bodies that move, with what rapier holds of each.
    moving: Vec<Option<MovingBody>>,
    solids: Vec<Solid>,
    /// A cache of the poses, `world_from_body`.
    poses: Vec<Isometry3<f64>>,
    /// The bounding boxes at these poses.
    rooms: Vec<Aabb>,
}

/// The state of rapier. A clone has no pipeline buffers, which are empty between two steps.
struct Physics(PhysicsWorld);

impl Clone for Physics {
    fn clone(&self) -> Self {
        let from = &self.0;
        let mut to = PhysicsWorld::new();
        to.gravity = from.gravity;
        to.integration_parameters = from.integration_parameters;
        to.islands = from.islands.clone();
        to.broad_phase = from.broad_phase.clone();
        to.narrow_phase = from.narrow_phase.clone();
        to.bodies = from.bodies.clone();
        to.colliders = from.colliders.clone();
        to.impulse_joints = from.impulse_joints.clone();
        to.multibody_joints = from.multibody_joints.clone();
        to.soft_bodies = from.soft_bodies.clone();
        Self(to)
    }
}

/// A moving body, and its mass in rapier without point masses.
#[derive(Clone)]
struct MovingBody {
    body: BodyDynamics,
    alone: MassProperties,
    /// Whether its mass in rapier includes the point masses of fingertips.
    lumped: bool,
}

impl Bodies {
    /// The bodies of a scene at their starting poses.
    ///
    /// # Errors
    /// A body that cannot be simulated: no shape, no mass, a size or number out of range; at its keys in the scene, `bodies.cube.mass`.
    pub(super) fn new(scene: &Scene) -> Result<Self, InputError> {
        if scene.bodies.len() > MAX_BODIES {
            let message = format!("has {} bodies, at most {MAX_BODIES} are simulated", scene.bodies.len());
            return Err(InputError::new("bodies", message));
        }
        let mut physics = PhysicsWorld::new();
        physics.narrow_phase = NarrowPhase::with_query_dispatcher(rolling_contact::dispatcher());
        // Point masses have no weight: weights are among the forces that we hand over.
        physics.gravity = conversion::vector(Vector3::zeros());
        let gravity = Vector3::from(scene.gravity.map(|part| part.0));
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
        let mut bodies = Self {
            physics: Physics(physics),
            gravity,
            handles: Vec::new(),
            moving: Vec::new(),
            solids: Vec::new(),
            poses: Vec::new(),
            rooms: Vec::new(),
        };
        for (index, (name, body)) in scene.bodies.iter().enumerate() {
            let refuse = |key: &str, message: String| InputError::new(format!("bodies.{name}{key}"), message);
            let solid = Solid::new(name, body)?;
            let pose = isometry(body.position.map(|length| length.0), body.rotation);
            let pose = pose.map_err(|message| refuse(".rotation", message))?;
            if !(0.0..=10.0).contains(&body.friction) {
                return Err(refuse(".friction", format!("found {}, expected 0 to 10", ShortNumber(body.friction))));
            }
            let movable = body.role == Role::Object;
            let builder =
                if movable { RigidBodyBuilder::dynamic().can_sleep(false) } else { RigidBodyBuilder::fixed() };
            let mut moving = None;
            let builder = if movable {
                let lacks = || refuse("", "is an object without mass, expected one such as `mass: 50 g`".into());
                let mass = body.mass.map(|mass| mass.0).ok_or_else(lacks)?;
                if !(1e-4..=1e3).contains(&mass) {
                    return Err(refuse(".mass", format!("found {} kg, expected 0.1 g to 1000 kg", ShortNumber(mass))));
                }
                let alone = mass_properties(&solid, mass / solid.volume());
                let com = conversion::our_point(alone.local_com);
                let inertia = conversion::our_matrix(alone.reconstruct_inertia_matrix());
                let body = BodyDynamics::new(alone.mass(), com, inertia, pose * com);
                moving = Some(MovingBody { body, alone, lumped: false });
                builder.additional_mass_properties(alone)
            } else {
                builder
            };
            let handle = bodies.physics.0.insert_body(builder.pose(conversion::pose(&pose)));
            for part in solid.parts() {
                let collider = ColliderBuilder::new(part.shape.clone())
                    .position(conversion::pose(&part.body_from_part))
                    .density(0.0)
                    .friction(body.friction)
                    .user_data(index as u128);
                bodies.physics.0.insert_collider(collider, Some(handle));
            }
            bodies.handles.push(handle);
            bodies.moving.push(moving);
            bodies.rooms.push(solid.room(&pose));
            bodies.solids.push(solid);
            bodies.poses.push(pose);
        }
        Ok(bodies)
    }

    /// Returns the number of bodies.
    pub(super) fn len(&self) -> usize {
        self.handles.len()
    }

    /// Whether this body moves.
    pub(super) fn is_movable(&self, body: usize) -> bool {
        self.moving[body].is_some()
    }

    /// The shape of a body.
    pub(super) fn solid(&self, body: usize) -> &Solid {
        &self.solids[body]
    }

    /// Whether a point of the reference frame is surely farther from a body than this, m.
    pub(super) fn is_farther(&self, body: usize, point: &Point3<f64>, reach: f64) -> bool {
        self.rooms[body].is_farther(point, reach)
    }

    /// The pose of a body, `world_from_body`.
    pub(super) fn pose(&self, body: usize) -> Isometry3<f64> {
        self.poses[body]
    }

    /// Velocity of a body's material at a point, m/s, both in the reference frame.
    pub(super) fn velocity_at(&self, body: usize, point: Point3<f64>) -> Vector3<f64> {
        self.moving[body].as_ref().map_or_else(Vector3::zeros, |moving| moving.body.velocity_at(point))
    }

    /// Angular velocity of a body, rad/s, reference frame.
    pub(super) fn angular_velocity(&self, body: usize) -> Vector3<f64> {
        self.moving[body].as_ref().map_or_else(Vector3::zeros, |moving| moving.body.spin())
    }

    /// What the last step added to the velocity of the body's material that was at `point` before it, m/s, reference frame.
    pub(super) fn change_at(&self, body: usize, point: Point3<f64>) -> Vector3<f64> {
        self.moving[body].as_ref().map_or_else(Vector3::zeros, |moving| moving.body.change_at(point))
    }

    /// Returns the mobility of a body's material at `point` along a unit direction, 1/kg, reference frame.
    pub(super) fn mobility(&self, body: usize, point: Point3<f64>, along: Vector3<f64>) -> f64 {
        self.moving[body].as_ref().map_or(0.0, |moving| moving.body.mobility(point, along, &self.poses[body].rotation))
    }

    /// Lets a force (N) and a torque (N m) act on a body during the next step, the force at a point; reference frame. With a `damping`, N s/m, that
    /// force becomes `force - damping × change_at(point)`: it is taken implicitly over the next `dt` seconds.
    pub(super) fn push(&mut self, body: usize, push: &BodyWrench, dt: f64) {
        let Some(moving) = &mut self.moving[body] else { return };
        moving.body.push(push.force, push.point, push.torque);
        if push.damping > 0.0 {
            moving.body.hold(push.point, push.damping * dt);
        }
    }

    /// Advances by `dt` seconds under gravity, contacts and what was pushed since the last step.
    pub(super) fn step(&mut self, dt: f64) {
        self.physics.0.integration_parameters.dt = dt;
        for ((moving, handle), pose) in self.moving.iter_mut().zip(&self.handles).zip(&self.poses) {
            let Some(moving) = moving else { continue };
            let rigid = &mut self.physics.0.bodies[*handle];
            let lumped = moving.body.lumped(&pose.rotation);
            if moving.lumped || lumped.is_some() {
                moving.lumped = lumped.is_some();
                let properties = lumped.map_or(moving.alone, |lumped| {
                    let inertia = conversion::matrix(lumped.inertia);
                    MassProperties::with_inertia_matrix(conversion::point(lumped.com), lumped.mass, inertia)
                });
                rigid.set_additional_mass_properties(properties, false);
                rigid.set_linvel(conversion::vector(moving.body.lumped_velocity()), false);
            }
            let (force, torque) = moving.body.load(&self.gravity);
            rigid.reset_forces(false);
            rigid.reset_torques(false);
            rigid.add_force(conversion::vector(force), false);
            rigid.add_torque(conversion::vector(torque), false);
        }
        self.physics.0.step();
        for (body, moving) in self.moving.iter_mut().enumerate() {
            let Some(moving) = moving else { continue };
            let rigid = &self.physics.0.bodies[self.handles[body]];
            let pose = &mut self.poses[body];
            *pose = conversion::our_pose(rigid.position());
            self.rooms[body] = self.solids[body].room(pose);
            let com = *pose * moving.body.com_in_body();
            moving.body.answered(conversion::our_vector(rigid.linvel()), conversion::our_vector(rigid.angvel()), com);
        }
    }

    /// Adds to `contacts` (one entry per pair, see [`Self::pairs`]) the impulses of the last step, N s, as force times time.
    pub(super) fn add_impulses(&self, contacts: &mut [BodyContact]) {
        for pair in self.physics.0.narrow_phase.contact_pairs() {
            let owner = |collider| self.physics.0.colliders.get(collider).map(|collider| collider.user_data as usize);
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
                contact.normal += sign * pressed * conversion::our_vector(manifold.data.normal);
            }
        }
    }

    /// One empty contact for each pair of bodies that can touch: objects in scene order with every body that is fixed or comes later.
    pub(super) fn pairs(&self) -> Vec<BodyContact> {
        let pairs = (0..self.len()).filter(|&body| self.is_movable(body)).flat_map(|body| {
            (0..self.len())
                .filter(move |&other| other != body && (!self.is_movable(other) || other > body))
                .map(move |other| (body, other))
        });
        pairs
            .map(|(body, other)| BodyContact { body, other, force: Vector3::zeros(), normal: Vector3::zeros() })
            .collect()
    }
}

/// Mass, center and inertia of a solid of this density, kg/m³; body frame.
fn mass_properties(solid: &Solid, density: f64) -> MassProperties {
    let mut sum = MassProperties::default();
    for part in solid.parts() {
        sum += part.shape.mass_properties(density).transform_by(&conversion::pose(&part.body_from_part));
    }
    sum
}

/// Normal impulse, and impulse on the second body with friction, of a manifold; N s.
fn impulses(manifold: &ContactManifold) -> (f64, Vector3<f64>) {
    let active = manifold.data.solver_contacts.iter().map(|contact| contact.contact_indices()[0] as usize);
    let points: Vec<_> = active.filter_map(|index| manifold.points.get(index)).collect();
    let pressed: f64 = points.iter().map(|point| point.data.impulse).sum();
    // Each point carries the friction of the whole manifold on the first body.
    let friction =
        points.first().map(|point| conversion::our_vector(point.data.warmstart_tangent_world)).unwrap_or_default();
    (pressed, pressed * conversion::our_vector(manifold.data.normal) - friction)
}
