//! A robot as a tree of links: forward kinematics and Jacobians over its degrees of freedom, coupled joints included.
//!
//! INVARIANT (parents first): the parent of a link stands before it. A coupled joint turns by `ratio` times a degree of freedom that
//! another joint turns by once, so a column of a Jacobian is a sum over the joints of that degree of freedom.

use super::mesh::Mesh;
use super::shape::CollisionShape;
use nalgebra::{DVector, Isometry3, Matrix3, Matrix6xX, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use std::sync::Arc;

/// Links and the degrees of freedom that move them.
#[derive(Clone, Debug, Default)]
pub struct KinematicTree {
    /// The links, parents first; the first one stands still.
    pub links: Vec<Link>,
    /// What can be driven, in the order of the file.
    pub dofs: Vec<Dof>,
}

/// A rigid link and the joint by which it hangs.
#[derive(Clone, Debug)]
pub struct Link {
    /// The name in the file; with the name of the part before it, `right_hand/palm`, in an assembly.
    pub name: String,
    /// Index of the parent; the first link's is itself.
    pub parent: usize,
    /// The joint's frame at rest, in the frame of the parent.
    pub parent_from_joint: Isometry3<f64>,
    /// The joint; `None` for a link that is fixed to its parent.
    pub joint: Option<Joint>,
    /// Mass, kg.
    pub mass: f64,
    /// Center of mass, link frame, m.
    pub centre: Point3<f64>,
    /// Inertia about the center of mass, link frame, kg m^2.
    pub inertia: Matrix3<f64>,
    /// What it is made of, link frame.
    pub solids: Vec<CollisionShape>,
    /// What it looks like, link frame; `None` where its shapes are drawn.
    pub look: Option<Arc<Mesh>>,
}

impl Link {
    /// Its pose at these values of the degrees of freedom, in the frame in which its parent's is `parent`.
    fn pose(&self, parent: &Isometry3<f64>, q: &[f64]) -> Isometry3<f64> {
        let value = |joint: &Joint| q.get(joint.dof).copied().unwrap_or(0.0);
        let motion = self.joint.as_ref().map_or_else(Isometry3::identity, |joint| joint.motion(value(joint)));
        parent * self.parent_from_joint * motion
    }

    /// A link without mass, joint or place: the first of its robot until it is put on another.
    pub fn massless(name: &str, solids: Vec<CollisionShape>) -> Self {
        Self {
            name: name.into(),
            parent: 0,
            parent_from_joint: Isometry3::identity(),
            joint: None,
            mass: 0.0,
            centre: Point3::origin(),
            inertia: Matrix3::zeros(),
            solids,
            look: None,
        }
    }
}

/// A joint.
#[derive(Clone, Debug)]
pub struct Joint {
    /// The name in the file.
    pub name: String,
    /// Whether it turns or slides.
    pub kind: JointKind,
    /// The axis, frame of the joint.
    pub axis: Unit<Vector3<f64>>,
    /// Index of the degree of freedom that drives it.
    pub dof: usize,
    /// How far it moves for one unit of the degree of freedom; 1 unless it is coupled.
    pub ratio: f64,
}

/// Forms of joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about its axis; rad and N m.
    Revolute,
    /// Slides along its axis; m and N.
    Prismatic,
}

/// A degree of freedom: what a motor drives. Units are those of a revolute joint, and after `or` those of a prismatic one.
#[derive(Clone, Debug, PartialEq)]
pub struct Dof {
    /// The name of the joint that it moves by once.
    pub name: String,
    /// The smallest and the largest position, rad or m.
    pub range: [f64; 2],
    /// The largest torque or force of its motor, N m or N.
    pub torque: f64,
    /// The largest speed, rad/s or m/s.
    pub speed: f64,
    /// The largest acceleration, rad/s² or m/s².
    pub acceleration: f64,
    /// The largest jerk, rad/s³ or m/s³; infinite where none is given.
    pub jerk: f64,
    /// Inertia of its motor at the joint, kg m² or kg.
    pub armature: f64,
    /// Viscous friction, N m s/rad or N s/m.
    pub damping: f64,
    /// Dry friction, N m or N.
    pub friction: f64,
}

impl Dof {
    /// The value nearest to `value` within the range.
    pub fn clamp(&self, value: f64) -> f64 {
        value.clamp(self.range[0], self.range[1])
    }
}

impl Joint {
    /// What the joint does at this value of its degree of freedom.
    pub fn motion(&self, value: f64) -> Isometry3<f64> {
        let moved = value * self.ratio;
        match self.kind {
            JointKind::Revolute => {
                Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&self.axis, moved))
            }
            JointKind::Prismatic => {
                Isometry3::from_parts((self.axis.into_inner() * moved).into(), UnitQuaternion::identity())
            }
        }
    }

    /// The velocity of a point that it moves (m/s) and the angular velocity (rad/s) for one unit of its degree of freedom a second, where the link that hangs on it has
    /// this pose.
    fn velocity(&self, pose: &Isometry3<f64>, point: &Point3<f64>) -> [Vector3<f64>; 2] {
        let axis = pose.rotation * self.axis.into_inner() * self.ratio;
        match self.kind {
            JointKind::Revolute => [axis.cross(&(point - pose.translation.vector).coords), axis],
            JointKind::Prismatic => [axis, Vector3::zeros()],
        }
    }
}

impl KinematicTree {
    /// The poses of all links, `root_from_link`, at these values of the degrees of freedom.
    pub fn forward_kinematics(&self, q: &[f64]) -> Vec<Isometry3<f64>> {
        let mut poses: Vec<Isometry3<f64>> = Vec::with_capacity(self.links.len());
        for (index, link) in self.links.iter().enumerate() {
            let parent = if index == 0 { Isometry3::identity() } else { poses[link.parent] };
            poses.push(link.pose(&parent, q));
        }
        poses
    }

    /// The links from the root to a link, in this order.
    pub fn chain(&self, link: usize) -> Vec<usize> {
        let mut chain = vec![link];
        while let Some(&at) = chain.last().filter(|at| **at != 0) {
            chain.push(self.links[at].parent);
        }
        chain.reverse();
        chain
    }

    /// Writes the poses of the links of a chain, `root_from_link`, at these values of the degrees of freedom.
    pub fn chain_poses(&self, chain: &[usize], q: &[f64], poses: &mut Vec<Isometry3<f64>>) {
        poses.clear();
        for &link in chain {
            let parent = poses.last().copied().unwrap_or_else(Isometry3::identity);
            poses.push(self.links[link].pose(&parent, q));
        }
    }

    /// The Jacobian of the origin of the last link of a chain whose links have these poses, as that of [`Self::jacobian`]: one column for each of `dofs`.
    pub fn chain_jacobian(&self, chain: &[usize], poses: &[Isometry3<f64>], dofs: &[usize]) -> Matrix6xX<f64> {
        let mut jacobian = Matrix6xX::zeros(dofs.len());
        let Some(end) = poses.last() else { return jacobian };
        for (&link, pose) in chain.iter().zip(poses).rev() {
            let Some(joint) = &self.links[link].joint else { continue };
            let Some(column) = dofs.iter().position(|dof| *dof == joint.dof) else { continue };
            let [linear, angular] = joint.velocity(pose, &Point3::from(end.translation.vector));
            let mut column = jacobian.column_mut(column);
            for row in 0..3 {
                column[row] += linear[row];
                column[row + 3] += angular[row];
            }
        }
        jacobian
    }

    /// The joints from the root to a link, nearest to the link first, as indices of links.
    pub fn joints_above(&self, link: usize) -> impl Iterator<Item = usize> {
        let mut at = Some(link);
        std::iter::from_fn(move || {
            let here = at?;
            at = (here != 0).then(|| self.links[here].parent);
            Some(here)
        })
        .filter(|&index| self.links[index].joint.is_some())
    }

    /// The Jacobian of a point that is fixed to a link: rows are the velocity of the point (m/s) and the angular velocity (rad/s) in the
    /// frame of the root, one column a degree of freedom. `poses` come from [`Self::forward_kinematics`], the point is in the frame of the root.
    pub fn jacobian(&self, poses: &[Isometry3<f64>], link: usize, point: Point3<f64>) -> Matrix6xX<f64> {
        let mut jacobian = Matrix6xX::zeros(self.dofs.len());
        for index in self.joints_above(link) {
            let Some(joint) = &self.links[index].joint else { continue };
            let [linear, angular] = joint.velocity(&poses[index], &point);
            let mut column = jacobian.column_mut(joint.dof);
            for row in 0..3 {
                column[row] += linear[row];
                column[row + 3] += angular[row];
            }
        }
        jacobian
    }

    /// Index of a link by name.
    pub fn link(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|link| link.name == name)
    }

    /// Index of a degree of freedom by name.
    pub fn dof(&self, name: &str) -> Option<usize> {
        self.dofs.iter().position(|dof| dof.name == name)
    }

    /// How many joints there are, coupled ones included.
    pub fn n_joints(&self) -> usize {
        self.links.iter().filter(|link| link.joint.is_some()).count()
    }

    /// The middle of every range.
    pub fn middle(&self) -> DVector<f64> {
        DVector::from_iterator(self.dofs.len(), self.dofs.iter().map(|dof| (dof.range[0] + dof.range[1]) / 2.0))
    }
}
