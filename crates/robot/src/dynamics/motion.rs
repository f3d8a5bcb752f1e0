//! Motion of a robot under torques: rigid links in reduced coordinates.
//!
//! ```text
//! (M + dt D) q̈ = τ - h - D q̇ - F_c tanh(q̇ / v_0) + Σ Jᵀ w        D: viscous friction, F_c: dry friction, w: wrenches on links
//! M = Σ m J_vᵀ J_v + J_ωᵀ I J_ω + armature                          over the links, at their centers of mass
//! h = Σ J_vᵀ m (a - g) + J_ωᵀ (I α + ω × I ω)                       with accelerations at q̈ = 0
//! ```
//!
//! Steps are semi-implicit. A joint that meets its limit stops there. The root may be carried about by hand (`root`), without inertia.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Isometry3, Matrix3, Point3, Vector3};
use teachtree_description::tree::{JointKind, KinematicTree};

/// The speed above which dry friction is nearly constant, rad/s.
const FULL_FRICTION: f64 = 0.02;

/// A robot in motion.
#[derive(Clone, Debug)]
pub struct Motion {
    /// The pose of the root, `world_from_root`.
    pub root: Isometry3<f64>,
    /// Velocity of the root, m/s, reference frame.
    pub root_velocity: Vector3<f64>,
    /// Angular velocity of the root, rad/s, reference frame.
    pub root_spin: Vector3<f64>,
    /// Values of the degrees of freedom.
    pub q: DVector<f64>,
    /// Their rates.
    pub rates: DVector<f64>,
    gravity: Vector3<f64>,
}

/// The terms that depend on configuration and rates; computed once a step.
pub struct DynamicsTerms {
    /// Poses of the links, reference frame.
    pub poses: Vec<Isometry3<f64>>,
    /// Velocities of the links' origins and angular velocities.
    pub velocities: Vec<(Vector3<f64>, Vector3<f64>)>,
    /// The mass matrix.
    pub mass: DMatrix<f64>,
    /// Torques that hold the robot against gravity.
    pub gravity: DVector<f64>,
    bias: DVector<f64>,
    factor: Option<Cholesky<f64, Dyn>>,
}

impl Motion {
    /// Returns a robot at rest.
    pub fn new(root: Isometry3<f64>, q: DVector<f64>, gravity: Vector3<f64>) -> Self {
        let rates = DVector::zeros(q.len());
        Self { root, root_velocity: Vector3::zeros(), root_spin: Vector3::zeros(), q, rates, gravity }
    }

    /// Returns kinematics and mass matrix of the current configuration; `dt` is the step of the implicit friction, s.
    pub fn posture(&self, tree: &KinematicTree, dt: f64) -> DynamicsTerms {
        let n = tree.dofs.len();
        let mut poses: Vec<Isometry3<f64>> = Vec::with_capacity(tree.links.len());
        let mut velocities: Vec<(Vector3<f64>, Vector3<f64>)> = Vec::with_capacity(tree.links.len());
        // Accelerations at q̈ = 0, linear and angular.
        let mut accelerations: Vec<(Vector3<f64>, Vector3<f64>)> = Vec::with_capacity(tree.links.len());
        let mut axes: Vec<Vector3<f64>> = Vec::with_capacity(tree.links.len());
        for (index, link) in tree.links.iter().enumerate() {
            let (parent, (velocity, spin), (acceleration, turning)) = if index == 0 {
                (self.root, (self.root_velocity, self.root_spin), (Vector3::zeros(), Vector3::zeros()))
            } else {
                (poses[link.parent], velocities[link.parent], accelerations[link.parent])
            };
            let at_joint = parent * link.parent_from_joint;
            let arm = at_joint.translation.vector - parent.translation.vector;
            let mut here = (velocity + spin.cross(&arm), spin);
            let mut change = (acceleration + turning.cross(&arm) + spin.cross(&spin.cross(&arm)), turning);
            let mut pose = at_joint;
            let mut axis = Vector3::zeros();
            if let Some(joint) = &link.joint {
                let rate = self.rates[joint.dof] * joint.ratio;
                axis = at_joint.rotation * joint.axis.into_inner();
                pose = at_joint * joint.motion(self.q[joint.dof]);
                match joint.kind {
                    JointKind::Revolute => {
                        change.1 += spin.cross(&(axis * rate));
                        here.1 += axis * rate;
                    }
                    JointKind::Prismatic => {
                        let way = pose.translation.vector - at_joint.translation.vector;
                        change.0 +=
                            turning.cross(&way) + spin.cross(&spin.cross(&way)) + 2.0 * spin.cross(&(axis * rate));
                        here.0 += spin.cross(&way) + axis * rate;
                    }
                }
                axis *= joint.ratio;
            }
            poses.push(pose);
            velocities.push(here);
            accelerations.push(change);
            axes.push(axis);
        }
        let mut mass = DMatrix::zeros(n, n);
        let (mut bias, mut gravity) = (DVector::zeros(n), DVector::zeros(n));
        let mut columns: Vec<(usize, Vector3<f64>, Vector3<f64>)> = Vec::with_capacity(16);
        for (index, link) in tree.links.iter().enumerate().filter(|(_, link)| link.mass > 0.0) {
            let centre = poses[index] * link.centre;
            let turn = poses[index].rotation.to_rotation_matrix();
            let inertia: Matrix3<f64> = turn * link.inertia * turn.transpose();
            let arm = centre - Point3::from(poses[index].translation.vector);
            let (_, spin) = velocities[index];
            let (acceleration, turning) = accelerations[index];
            let at_centre = acceleration + turning.cross(&arm) + spin.cross(&spin.cross(&arm));
            let torque = inertia * turning + spin.cross(&(inertia * spin));
            columns.clear();
            for above in tree.joints_above(index) {
                let Some(joint) = &tree.links[above].joint else { continue };
                let column = match joint.kind {
                    JointKind::Revolute => {
                        (axes[above].cross(&(centre.coords - poses[above].translation.vector)), axes[above])
                    }
                    JointKind::Prismatic => (axes[above], Vector3::zeros()),
                };
                columns.push((joint.dof, column.0, column.1));
            }
            for (dof, linear, angular) in &columns {
                bias[*dof] += linear.dot(&(link.mass * at_centre)) + angular.dot(&torque);
                gravity[*dof] -= linear.dot(&(link.mass * self.gravity));
                for (other, other_linear, other_angular) in &columns {
                    mass[(*dof, *other)] +=
                        link.mass * linear.dot(other_linear) + angular.dot(&(inertia * other_angular));
                }
            }
        }
        for (index, dof) in tree.dofs.iter().enumerate() {
            mass[(index, index)] += dof.armature.max(1e-6);
        }
        let mut damped = mass.clone();
        for (index, dof) in tree.dofs.iter().enumerate() {
            // Implicit in the steep part of friction.
            damped[(index, index)] += dt * (dof.damping + dof.friction / FULL_FRICTION);
        }
        bias += &gravity;
        DynamicsTerms { poses, velocities, mass, gravity, bias, factor: Cholesky::new(damped) }
    }

    /// Advances by `dt` (s) under motor torques and external generalized forces.
    pub fn step(
        &mut self,
        tree: &KinematicTree,
        posture: &DynamicsTerms,
        torques: &DVector<f64>,
        outside: &DVector<f64>,
        dt: f64,
    ) {
        let mut force = torques + outside - &posture.bias;
        for (index, dof) in tree.dofs.iter().enumerate() {
            let rate = self.rates[index];
            force[index] -= dof.damping * rate + dof.friction * (rate / FULL_FRICTION).tanh();
        }
        let Some(factor) = &posture.factor else { return };
        let acceleration = factor.solve(&force);
        self.rates += acceleration * dt;
        for (index, dof) in tree.dofs.iter().enumerate() {
            let next = self.q[index] + self.rates[index] * dt;
            let held = dof.clamp(next);
            if held != next {
                self.rates[index] = 0.0;
            }
            self.q[index] = held;
        }
    }
}

impl DynamicsTerms {
    /// Returns position, velocity and angular velocity of a point that is fixed to a link, reference frame.
    pub fn point(&self, link: usize, in_link: Point3<f64>) -> (Point3<f64>, Vector3<f64>, Vector3<f64>) {
        let point = self.poses[link] * in_link;
        let (velocity, spin) = self.velocities[link];
        (point, velocity + spin.cross(&(point.coords - self.poses[link].translation.vector)), spin)
    }

    /// Adds the effect of a force (N) at a point and a torque (N m) on a link to generalized forces; reference frame.
    pub fn add_wrench(
        &self,
        tree: &KinematicTree,
        link: usize,
        point: Point3<f64>,
        (force, torque): (Vector3<f64>, Vector3<f64>),
        to: &mut DVector<f64>,
    ) {
        for above in tree.joints_above(link) {
            let Some(joint) = &tree.links[above].joint else { continue };
            let axis = self.poses[above].rotation * joint.axis.into_inner() * joint.ratio;
            to[joint.dof] += match joint.kind {
                JointKind::Revolute => {
                    axis.dot(&((point.coords - self.poses[above].translation.vector).cross(&force) + torque))
                }
                JointKind::Prismatic => axis.dot(&force),
            };
        }
    }
}
