//! A hand: each finger as a chain from the palm to the centre of its fingertip ball, with forward and inverse kinematics.
//!
//! The inverse has a closed form for fingers whose first two joints meet at right angles and whose others bend in the plane of the second
//! (docs/sources.md, Hand): with the last joint coupled, or with it free, when it is scanned for the best measure. Other fingers are solved by damped
//! least squares. Everything here is in the frame of the palm; lengths are m, angles rad.

use super::closed::Closed;
use super::jaws::Jaws;
use super::tree::{Dof, Kind, Robot, Solid};
use crate::base::hands::Finger;
use nalgebra::{Isometry3, Matrix3, Matrix3xX, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use std::collections::BTreeSet;

/// No finger has more degrees of freedom.
pub const MAX_DOFS: usize = 8;
/// A point is reached when it is missed by less than this, m.
pub const REACHED_M: f64 = 1e-6;
/// Length of a person's thumb and fingers, m (docs/sources.md, Hand: base set).
const THUMB_M: f64 = 0.118;
const FINGER_M: f64 = 0.110;
/// Iterations of the least squares, from each start, and their damping, m.
const ITERATIONS: usize = 60;
const DAMPED_M: f64 = 2e-3;

/// Angles of one finger, in the order of its degrees of freedom from the palm out.
pub type Angles = [f64; MAX_DOFS];

/// What a robot file says of a fingertip.
#[derive(Clone, Debug)]
pub(super) struct FingerSpec {
    pub(super) finger: Finger,
    pub(super) link: usize,
    pub(super) tip: Point3<f64>,
    pub(super) radius: f64,
    pub(super) pad: Unit<Vector3<f64>>,
    pub(super) force: f64,
}

impl FingerSpec {
    /// The same on a robot in which the links begin at `base`.
    pub(super) fn shifted(&self, base: usize) -> Self {
        Self { link: self.link + base, ..self.clone() }
    }
}

/// A hand of a robot.
#[derive(Clone, Debug)]
pub struct HandModel {
    /// Index of the palm's link.
    pub palm: usize,
    /// Degrees of freedom between the root and the palm, nearest to the root first; empty for a hand without an arm.
    pub arm: Vec<usize>,
    /// The fingers, in the order of the file.
    pub fingers: Vec<FingerModel>,
    /// Shapes of the palm, palm frame.
    pub palm_solids: Vec<Solid>,
    /// What its two fingers are together when it is a gripper.
    pub jaws: Option<Jaws>,
}

/// A finger from the palm to its tip.
#[derive(Clone, Debug)]
pub struct FingerModel {
    /// Which finger.
    pub finger: Finger,
    /// Indices of its degrees of freedom in the robot, from the palm out.
    pub dofs: Vec<usize>,
    /// Their ranges.
    pub ranges: Vec<[f64; 2]>,
    /// Radius of the fingertip ball, m.
    pub radius: f64,
    /// The largest force of the tip, N.
    pub force: f64,
    /// Length from the joint about which it bends first to the centre of the ball, m; what measures are scaled by.
    pub length: f64,
    /// Index of the link with the tip.
    pub tip_link: usize,
    /// Centre of the ball, frame of that link.
    pub tip_in_link: Point3<f64>,
    pub(super) spec: FingerSpec,
    steps: Vec<Step>,
    tip: Point3<f64>,
    pad: Vector3<f64>,
    solids: Vec<(usize, Solid)>,
    closed: Option<Closed>,
}

/// A joint of a finger.
#[derive(Clone, Debug)]
struct Step {
    before_from_joint: Isometry3<f64>,
    axis: Unit<Vector3<f64>>,
    kind: Kind,
    local: usize,
    ratio: f64,
}

/// What an inverse found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reached {
    /// The angles, within the ranges.
    pub angles: Angles,
    /// How far the tip stays away from the point, m.
    pub miss: f64,
    /// The measure at these angles.
    pub measure: f64,
}

/// Where a finger is, palm frame.
#[derive(Clone, Debug)]
pub struct Posture {
    /// Poses of its joints' frames.
    pub joints: Vec<Isometry3<f64>>,
    /// Centre of the tip.
    pub tip: Point3<f64>,
    /// The direction in which its pad looks, unit.
    pub pad: Vector3<f64>,
}

/// The hand of a robot on this palm with these fingertips.
///
/// # Errors
/// The finger that cannot be, and why.
pub(super) fn build(robot: &Robot, palm: usize, specs: &[FingerSpec]) -> Result<HandModel, (Option<Finger>, String)> {
    if specs.is_empty() {
        return Err((None, "has no fingers".into()));
    }
    let mut arm: Vec<usize> =
        robot.joints_above(palm).filter_map(|link| robot.links[link].joint.as_ref().map(|joint| joint.dof)).collect();
    arm.reverse();
    let mut seen = BTreeSet::new();
    arm.retain(|dof| seen.insert(*dof));
    let mut fingers = Vec::new();
    for spec in specs {
        fingers.push(FingerModel::new(robot, palm, spec).map_err(|message| (Some(spec.finger), message))?);
    }
    let palm_solids = robot.links[palm].solids.clone();
    let jaws = Jaws::of(&mut fingers, &palm_solids, &robot.dofs);
    let jaws = jaws.map_err(|(finger, message)| (Some(finger), message))?;
    if jaws.is_none() {
        share_nothing(&fingers)?;
    }
    Ok(HandModel { palm, arm, fingers, palm_solids, jaws })
}

/// Each finger of a hand moves by itself.
fn share_nothing(fingers: &[FingerModel]) -> Result<(), (Option<Finger>, String)> {
    for (index, finger) in fingers.iter().enumerate() {
        let shared = |other: &&FingerModel| other.dofs.iter().any(|dof| finger.dofs.contains(dof));
        if let Some(other) = fingers[..index].iter().find(shared) {
            let message = format!("shares a degree of freedom with {}, which only jaws that slide may", other.finger);
            return Err((Some(finger.finger), message));
        }
    }
    Ok(())
}

impl HandModel {
    /// How far the jaws of a gripper are open at these values of the robot's degrees of freedom, m; `None` for another hand.
    pub fn opening(&self, q: &[f64]) -> Option<f64> {
        let [thumb, other] = self.jaws.as_ref()?.pair.map(|jaw| self.finger(jaw.finger));
        let (thumb, other) = (thumb?, other?);
        let tip = |finger: &FingerModel| finger.posture(&finger.angles(q)).tip;
        Some((tip(other) - tip(thumb)).norm() - thumb.radius - other.radius)
    }

    /// How large it is beside a person's hand: the mean over its fingers of their length over that of the base set (docs/sources.md, Hand). A gripper is not
    /// like a hand, and 1.
    pub fn scale(&self) -> f64 {
        if self.jaws.is_some() {
            return 1.0;
        }
        let over =
            |finger: &FingerModel| finger.length / if finger.finger == Finger::Thumb { THUMB_M } else { FINGER_M };
        self.fingers.iter().map(over).sum::<f64>() / self.fingers.len() as f64
    }

    /// The finger of this name.
    pub fn finger(&self, finger: Finger) -> Option<&FingerModel> {
        self.fingers.iter().find(|model| model.finger == finger)
    }
}

impl FingerModel {
    fn new(robot: &Robot, palm: usize, spec: &FingerSpec) -> Result<Self, String> {
        // The links from the palm to the tip.
        let mut path = vec![];
        let mut at = spec.link;
        while at != palm {
            if at == 0 {
                return Err("does not hang on the palm".into());
            }
            path.push(at);
            at = robot.links[at].parent;
        }
        path.reverse();
        let mut steps: Vec<Step> = Vec::new();
        let mut dofs: Vec<usize> = Vec::new();
        let mut solids = Vec::new();
        let mut fixed = Isometry3::identity();
        for &link in &path {
            let link = &robot.links[link];
            fixed *= link.parent_from_joint;
            if let Some(joint) = &link.joint {
                let local = dofs.iter().position(|dof| *dof == joint.dof).unwrap_or_else(|| {
                    dofs.push(joint.dof);
                    dofs.len() - 1
                });
                let (axis, kind, ratio) = (joint.axis, joint.kind, joint.ratio);
                steps.push(Step { before_from_joint: fixed, axis, kind, local, ratio });
                fixed = Isometry3::identity();
            }
            if let Some(step) = steps.len().checked_sub(1) {
                solids.extend(link.solids.iter().map(|solid| (step, solid.moved(&fixed))));
            }
        }
        if dofs.is_empty() {
            return Err("does not move".into());
        }
        if dofs.len() > MAX_DOFS {
            return Err(format!("has {} degrees of freedom, at most {MAX_DOFS} are supported", dofs.len()));
        }
        let ranges: Vec<[f64; 2]> = dofs.iter().map(|&dof: &usize| robot.dofs[dof].range).collect();
        let mut finger = Self {
            finger: spec.finger,
            dofs,
            ranges,
            radius: spec.radius,
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
        if finger.length < 1e-4 && !finger.slides() {
            return Err("has no length".into());
        }
        let turns = finger.steps.iter().all(|step| step.kind == Kind::Turns);
        let joints: Vec<(Point3<f64>, Vector3<f64>)> = finger
            .steps
            .iter()
            .zip(&rest.joints)
            .map(|(step, pose)| (pose.translation.vector.into(), pose.rotation * step.axis.into_inner()))
            .collect();
        let drives: Vec<(usize, f64)> = finger.steps.iter().map(|step| (step.local, step.ratio)).collect();
        finger.closed = turns.then(|| Closed::of(&joints, &drives, rest.tip, &finger.ranges)).flatten();
        Ok(finger)
    }

    /// Whether all that it can do is to slide along a line.
    pub fn slides(&self) -> bool {
        self.dofs.len() == 1 && self.steps.iter().all(|step| step.kind == Kind::Slides)
    }

    /// Whether the inverse has a closed form.
    pub fn is_closed(&self) -> bool {
        self.closed.is_some()
    }

    /// The joint angles of the finger among those of the robot.
    pub fn angles(&self, q: &[f64]) -> Angles {
        let mut angles = [0.0; MAX_DOFS];
        for (angle, dof) in angles.iter_mut().zip(&self.dofs) {
            *angle = q.get(*dof).copied().unwrap_or(0.0);
        }
        angles
    }

    /// Where the finger is at these angles.
    pub fn posture(&self, angles: &Angles) -> Posture {
        let mut joints = Vec::with_capacity(self.steps.len());
        let mut pose = Isometry3::identity();
        for step in &self.steps {
            let moved = angles[step.local] * step.ratio;
            pose *= step.before_from_joint;
            match step.kind {
                Kind::Turns => pose.rotation *= UnitQuaternion::from_axis_angle(&step.axis, moved),
                Kind::Slides => pose *= Translation3::from(step.axis.into_inner() * moved),
            }
            joints.push(pose);
        }
        Posture { tip: pose * self.tip, pad: pose * self.pad, joints }
    }

    /// The shapes of its links in a posture, palm frame, with the number of the joint that each hangs at.
    pub fn solids(&self, posture: &Posture) -> impl Iterator<Item = (usize, Solid)> {
        self.solids.iter().filter_map(|(step, solid)| Some((*step, solid.moved(posture.joints.get(*step)?))))
    }

    /// The Jacobian of the tip: 3 rows, m/s, palm frame; a column a degree of freedom.
    pub fn jacobian(&self, posture: &Posture) -> Matrix3xX<f64> {
        let mut jacobian = Matrix3xX::zeros(self.dofs.len());
        for (step, pose) in self.steps.iter().zip(&posture.joints) {
            let axis = pose.rotation * step.axis.into_inner() * step.ratio;
            let column = match step.kind {
                Kind::Turns => axis.cross(&(posture.tip.coords - pose.translation.vector)),
                Kind::Slides => axis,
            };
            let mut whole = jacobian.column_mut(step.local);
            whole += column;
        }
        jacobian
    }

    /// Yoshikawa's manipulability over the cube of the finger's length: `sqrt(det(J Jᵀ)) / L³`. Nothing for a finger that cannot go all ways, such as a jaw.
    pub fn manipulability(&self, angles: &Angles) -> f64 {
        if self.dofs.len() < 3 {
            return 0.0;
        }
        let jacobian = self.jacobian(&self.posture(angles));
        let square: Matrix3<f64> = &jacobian * jacobian.transpose();
        square.determinant().max(0.0).sqrt() / self.length.powi(3)
    }

    /// How free the joints are of their limits, 0 at a limit and 1 in the middle of all ranges: `Π min(4u, 1)^(1/n)` with
    /// `u = (q-q⁻)(q⁺-q)/(q⁺-q⁻)²` (docs/sources.md, Grasp mapping).
    pub fn freedom(&self, angles: &Angles) -> f64 {
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

    /// The measure of one finger: manipulability times freedom.
    pub fn measure(&self, angles: &Angles) -> f64 {
        self.manipulability(angles) * self.freedom(angles)
    }

    /// Angles that bring the centre of the tip to a point, the best by [`Self::measure`] where there are several; for a point out of
    /// reach, angles that bring it near.
    pub fn reach(&self, point: Point3<f64>) -> Reached {
        match &self.closed {
            Some(closed) => closed.reach(point, &self.ranges),
            None => self.reach_numerically(point),
        }
    }

    /// The same for a point that is next to one whose solution is known.
    pub(super) fn reach_near(&self, point: Point3<f64>, known: &Reached) -> Reached {
        match &self.closed {
            Some(closed) => closed.reach_near(point, &self.ranges, known),
            None => self.approach(point, known.angles),
        }
    }

    /// Adds to `joints` how something changes with the finger's degrees of freedom, when it changes by `slope` with the place of a point that hangs at a
    /// joint.
    pub(super) fn pull(
        &self,
        posture: &Posture,
        joint: usize,
        at: &Point3<f64>,
        slope: &Vector3<f64>,
        joints: &mut Angles,
    ) {
        for (step, pose) in self.steps.iter().zip(&posture.joints).take(joint + 1) {
            let axis = pose.rotation * step.axis.into_inner() * step.ratio;
            joints[step.local] += match step.kind {
                Kind::Turns => axis.dot(&(at.coords - pose.translation.vector).cross(slope)),
                Kind::Slides => axis.dot(slope),
            };
        }
    }

    /// The same of what changes by `slope` with a turn of the finger's last link, a rad.
    pub(super) fn turn(&self, posture: &Posture, slope: &Vector3<f64>, joints: &mut Angles) {
        for (step, pose) in self.steps.iter().zip(&posture.joints).filter(|(step, _)| step.kind == Kind::Turns) {
            joints[step.local] += (pose.rotation * step.axis.into_inner()).dot(slope) * step.ratio;
        }
    }

    /// The nearest that the tip can come to a point, m: what to say of a finger that cannot reach.
    pub fn miss(&self, point: Point3<f64>) -> f64 {
        let mut starts = vec![self.reach(point).angles];
        starts.extend(self.starts());
        starts.iter().map(|start| self.approach(point, *start).miss).fold(f64::INFINITY, f64::min)
    }

    fn reach_numerically(&self, point: Point3<f64>) -> Reached {
        let mut best: Option<(Reached, f64)> = None;
        for start in self.starts() {
            let found = self.approach(point, start);
            let value = if found.miss < REACHED_M { found.measure } else { -found.miss };
            if best.is_none_or(|(_, other)| value > other) {
                best = Some((found, value));
            }
        }
        let nothing = Reached { angles: [0.0; MAX_DOFS], miss: f64::INFINITY, measure: 0.0 };
        best.map_or(nothing, |(reached, _)| reached)
    }

    /// Angles to start from: the middle of the ranges, and a third to either side.
    fn starts(&self) -> Vec<Angles> {
        [0.5, 0.2, 0.8]
            .iter()
            .map(|share| {
                let mut angles = [0.0; MAX_DOFS];
                for (angle, [low, high]) in angles.iter_mut().zip(&self.ranges) {
                    *angle = low + share * (high - low);
                }
                angles
            })
            .collect()
    }

    /// Damped least squares within the ranges.
    fn approach(&self, point: Point3<f64>, start: Angles) -> Reached {
        let mut angles = start;
        let mut posture = self.posture(&angles);
        let mut miss = (point - posture.tip).norm();
        let mut damping = DAMPED_M;
        for _ in 0..ITERATIONS {
            if miss < REACHED_M * 0.1 {
                break;
            }
            let jacobian = self.jacobian(&posture);
            let square: Matrix3<f64> = &jacobian * jacobian.transpose() + Matrix3::identity() * damping * damping;
            let Some(inverse) = square.try_inverse() else { break };
            let step = jacobian.transpose() * (inverse * (point - posture.tip));
            let mut next = angles;
            for ((angle, change), [low, high]) in next.iter_mut().zip(step.iter()).zip(&self.ranges) {
                *angle = (*angle + change.clamp(-0.3, 0.3)).clamp(*low, *high);
            }
            let next_posture = self.posture(&next);
            let next_miss = (point - next_posture.tip).norm();
            if next_miss < miss {
                (angles, posture, miss) = (next, next_posture, next_miss);
                damping = (damping * 0.5).max(1e-6);
            } else if damping > 1.0 {
                break;
            } else {
                damping *= 4.0;
            }
        }
        Reached { angles, miss, measure: self.measure(&angles) }
    }

    /// The ranges of its degrees of freedom in a robot's list.
    pub fn dofs_of<'a>(&'a self, robot: &'a Robot) -> impl Iterator<Item = &'a Dof> {
        self.dofs.iter().map(|&dof| &robot.dofs[dof])
    }
}

impl Solid {
    /// The same in the frame in which its own frame is `pose`.
    pub fn moved(&self, pose: &Isometry3<f64>) -> Self {
        match *self {
            Self::Capsule(from, to, radius) => Self::Capsule(pose * from, pose * to, radius),
            Self::Box(at, half) => Self::Box(pose * at, half),
        }
    }
}
