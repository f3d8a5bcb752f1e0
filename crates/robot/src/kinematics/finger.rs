//! A finger as a chain from the palm to the center of its fingertip ball: forward kinematics, Jacobian, manipulability.
//!
//! Everything here is in the frame of the palm; lengths are m, angles rad.

use super::closed_form::ClosedFormFinger;
use super::joint_positions::{JointPositions, MAX_DOFS};
use nalgebra::{Isometry3, Matrix3, Matrix3xX, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use teachtree_base::hands::Finger;
use teachtree_description::shape::CollisionShape;
use teachtree_description::tree::{JointKind, KinematicTree};

/// A fingertip of a robot file.
#[derive(Clone, Debug)]
pub(crate) struct FingerSpec {
    pub(crate) finger: Finger,
    pub(crate) link: usize,
    pub(crate) tip: Point3<f64>,
    pub(crate) radius: f64,
    pub(crate) pad: Unit<Vector3<f64>>,
    /// Radius of a flat pad, m.
    pub(crate) pad_radius: Option<f64>,
    pub(crate) force: f64,
}

impl FingerSpec {
    /// Returns the fingertip with link indices shifted by `base`.
    pub(crate) fn shifted(&self, base: usize) -> Self {
        Self { link: self.link + base, ..self.clone() }
    }
}

/// A finger from the palm to its tip.
#[derive(Clone, Debug)]
pub struct FingerModel {
    /// The name of the finger.
    pub finger: Finger,
    /// Indices of its degrees of freedom in the robot, from the palm out.
    pub dofs: Vec<usize>,
    /// Their ranges.
    pub ranges: Vec<[f64; 2]>,
    /// Radius of the fingertip ball, m.
    pub radius: f64,
    /// Radius of a flat pad, m; `None` for a soft fingertip.
    pub pad_radius: Option<f64>,
    /// The largest force of the tip, N.
    pub force: f64,
    /// Length from the first bending joint to the center of the ball, m; the scale of quality measures.
    pub length: f64,
    /// Index of the link with the tip.
    pub tip_link: usize,
    /// Center of the ball, frame of that link.
    pub tip_in_link: Point3<f64>,
    pub(crate) spec: FingerSpec,
    steps: Vec<FingerJoint>,
    tip: Point3<f64>,
    pad: Vector3<f64>,
    solids: Vec<(usize, CollisionShape)>,
    /// The first of the shapes of the link with the tip.
    first_of_tip: usize,
    pub(super) closed: Option<ClosedFormFinger>,
}

/// A joint of a finger.
#[derive(Clone, Debug)]
struct FingerJoint {
    before_from_joint: Isometry3<f64>,
    axis: Unit<Vector3<f64>>,
    kind: JointKind,
    local: usize,
    ratio: f64,
}

/// The pose of a finger, palm frame.
#[derive(Clone, Debug)]
pub struct FingerPose {
    /// Poses of its joints' frames.
    pub joints: Vec<Isometry3<f64>>,
    /// Center of the tip.
    pub tip: Point3<f64>,
    /// The direction in which its pad looks, unit.
    pub pad: Vector3<f64>,
}

impl FingerModel {
    pub(crate) fn new(tree: &KinematicTree, palm: usize, spec: &FingerSpec) -> Result<Self, String> {
        // The links from the palm to the tip.
        let mut path = vec![];
        let mut at = spec.link;
        while at != palm {
            if at == 0 {
                return Err("is not connected to the palm".into());
            }
            path.push(at);
            at = tree.links[at].parent;
        }
        path.reverse();
        let mut steps: Vec<FingerJoint> = Vec::new();
        let mut dofs: Vec<usize> = Vec::new();
        let mut solids = Vec::new();
        let mut first_of_tip = 0;
        let mut fixed = Isometry3::identity();
        for &link in &path {
            let link = &tree.links[link];
            fixed *= link.parent_from_joint;
            if let Some(joint) = &link.joint {
                let local = dofs.iter().position(|dof| *dof == joint.dof).unwrap_or_else(|| {
                    dofs.push(joint.dof);
                    dofs.len() - 1
                });
                let (axis, kind, ratio) = (joint.axis, joint.kind, joint.ratio);
                steps.push(FingerJoint { before_from_joint: fixed, axis, kind, local, ratio });
                fixed = Isometry3::identity();
            }
            first_of_tip = solids.len();
            if let Some(step) = steps.len().checked_sub(1) {
                solids.extend(link.solids.iter().map(|solid| (step, solid.moved(&fixed))));
            }
        }
        if dofs.len() > MAX_DOFS {
            return Err(format!("has {} degrees of freedom, at most {MAX_DOFS} are supported", dofs.len()));
        }
        let ranges: Vec<[f64; 2]> = dofs.iter().map(|&dof: &usize| tree.dofs[dof].range).collect();
        let mut finger = Self {
            finger: spec.finger,
            dofs,
            first_of_tip,
            ranges,
            radius: spec.radius,
            pad_radius: spec.pad_radius,
            force: spec.force,
            length: 0.0,
            tip_link: spec.link,
            tip_in_link: spec.tip,
            spec: spec.clone(),
            steps,
            tip: fixed * spec.tip,
            pad: fixed * spec.pad.into_inner(),
            solids,
            closed: None,
        };
        let rest = finger.posture(&[0.0; MAX_DOFS]);
        let origin = |index: usize| rest.joints.get(index).map(|pose| Point3::from(pose.translation.vector));
        // From the first joint after those that meet in one point.
        let first = (1..rest.joints.len())
            .find(|&index| origin(index).zip(origin(0)).is_some_and(|(here, start)| (here - start).norm() > 1e-6))
            .map_or(0, |index| index - 1);
        let points: Vec<Point3<f64>> =
            (first..rest.joints.len()).filter_map(origin).chain(std::iter::once(rest.tip)).collect();
        finger.length = points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
        if finger.length < 1e-4 && finger.dofs.len() > 1 {
            return Err("has no length".into());
        }
        let turns = finger.steps.iter().all(|step| step.kind == JointKind::Revolute);
        let joints: Vec<(Point3<f64>, Vector3<f64>)> = finger
            .steps
            .iter()
            .zip(&rest.joints)
            .map(|(step, pose)| (pose.translation.vector.into(), pose.rotation * step.axis.into_inner()))
            .collect();
        let drives: Vec<(usize, f64)> = finger.steps.iter().map(|step| (step.local, step.ratio)).collect();
        finger.closed = turns.then(|| ClosedFormFinger::of(&joints, &drives, rest.tip, &finger.ranges)).flatten();
        Ok(finger)
    }

    /// Whether its only motion is to slide along a line.
    pub fn slides(&self) -> bool {
        self.dofs.len() == 1 && self.steps.iter().all(|step| step.kind == JointKind::Prismatic)
    }

    /// Whether the inverse has a closed form.
    pub fn is_closed(&self) -> bool {
        self.closed.is_some()
    }

    /// The joint angles of the finger among those of the robot.
    pub fn angles(&self, q: &[f64]) -> JointPositions {
        let mut angles = [0.0; MAX_DOFS];
        for (angle, dof) in angles.iter_mut().zip(&self.dofs) {
            *angle = q.get(*dof).copied().unwrap_or(0.0);
        }
        angles
    }

    /// Returns the pose of the finger at these angles.
    pub fn posture(&self, angles: &JointPositions) -> FingerPose {
        let mut joints = Vec::with_capacity(self.steps.len());
        let mut pose = Isometry3::identity();
        for step in &self.steps {
            let moved = angles[step.local] * step.ratio;
            pose *= step.before_from_joint;
            match step.kind {
                JointKind::Revolute => pose.rotation *= UnitQuaternion::from_axis_angle(&step.axis, moved),
                JointKind::Prismatic => pose *= Translation3::from(step.axis.into_inner() * moved),
            }
            joints.push(pose);
        }
        FingerPose { tip: pose * self.tip, pad: pose * self.pad, joints }
    }

    /// Returns the shapes of its links in a pose, palm frame, each with the index of the joint that moves it.
    pub fn solids(&self, posture: &FingerPose) -> impl Iterator<Item = (usize, CollisionShape)> {
        self.solids.iter().filter_map(|(step, solid)| Some((*step, solid.moved(posture.joints.get(*step)?))))
    }

    /// Whether the shape of this index may touch a held object. Such a shape is a piece of the mesh of the link with the tip; the fingertip ball need not
    /// protrude from it.
    pub(crate) fn touches(&self, shape: usize) -> bool {
        let is_piece = |(_, shape): &(usize, CollisionShape)| matches!(shape, CollisionShape::Piece(..));
        shape >= self.first_of_tip && self.solids.get(shape).is_some_and(is_piece)
    }

    /// Returns the 3 × n Jacobian of the tip position, palm frame: a column for each degree of freedom, m/rad or m/m.
    pub fn jacobian(&self, posture: &FingerPose) -> Matrix3xX<f64> {
        let mut jacobian = Matrix3xX::zeros(self.dofs.len());
        for (step, pose) in self.steps.iter().zip(&posture.joints) {
            let axis = pose.rotation * step.axis.into_inner() * step.ratio;
            let column = match step.kind {
                JointKind::Revolute => axis.cross(&(posture.tip.coords - pose.translation.vector)),
                JointKind::Prismatic => axis,
            };
            let mut whole = jacobian.column_mut(step.local);
            whole += column;
        }
        jacobian
    }

    /// Returns Yoshikawa's manipulability over the cube of the finger's length: `sqrt(det(J Jᵀ)) / L³`. It is 0 for a finger that cannot move its tip in all
    /// directions, such as a jaw.
    pub fn manipulability(&self, angles: &JointPositions) -> f64 {
        if self.dofs.len() < 3 {
            return 0.0;
        }
        let jacobian = self.jacobian(&self.posture(angles));
        let square: Matrix3<f64> = &jacobian * jacobian.transpose();
        square.determinant().max(0.0).sqrt() / self.length.powi(3)
    }

    /// Returns the margin of the joints to their limits, 0 at a limit and 1 in the middle of all ranges: `Π min(4u, 1)^(1/n)` with
    /// `u = (q-q⁻)(q⁺-q)/(q⁺-q⁻)²` (docs/sources.md, Grasp mapping).
    pub fn joint_limit_margin(&self, angles: &JointPositions) -> f64 {
        let product: f64 = self
            .ranges
            .iter()
            .zip(angles)
            .map(|([low, high], angle)| {
                (4.0 * (angle - low) * (high - angle) / ((high - low) * (high - low))).clamp(0.0, 1.0)
            })
            .product();
        product.powf(1.0 / self.ranges.len() as f64)
    }

    /// Returns the quality of one finger: manipulability times joint-limit margin.
    pub fn measure(&self, angles: &JointPositions) -> f64 {
        self.manipulability(angles) * self.joint_limit_margin(angles)
    }

    /// Adds to `joints` the gradient of a quantity by the finger's degrees of freedom. `slope` is its gradient by the position of a point that a joint moves.
    pub(crate) fn pull(
        &self,
        posture: &FingerPose,
        joint: usize,
        at: &Point3<f64>,
        slope: &Vector3<f64>,
        joints: &mut JointPositions,
    ) {
        for (step, pose) in self.steps.iter().zip(&posture.joints).take(joint + 1) {
            let axis = pose.rotation * step.axis.into_inner() * step.ratio;
            joints[step.local] += match step.kind {
                JointKind::Revolute => axis.dot(&(at.coords - pose.translation.vector).cross(slope)),
                JointKind::Prismatic => axis.dot(slope),
            };
        }
    }

    /// Like `pull`, where `slope` is the gradient by a rotation of the finger's last link, per rad.
    pub(crate) fn turn(&self, posture: &FingerPose, slope: &Vector3<f64>, joints: &mut JointPositions) {
        for (step, pose) in self.steps.iter().zip(&posture.joints).filter(|(step, _)| step.kind == JointKind::Revolute)
        {
            joints[step.local] += (pose.rotation * step.axis.into_inner()).dot(slope) * step.ratio;
        }
    }
}
