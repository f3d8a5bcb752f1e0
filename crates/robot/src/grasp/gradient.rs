//! The gradient of the cost of a pose.
//!
//! Costs act at points like forces: spheres of fingers and points of the palm are pushed, tips are drawn to their contacts. A push on a sphere turns the joints
//! below it; the joints follow the target of the tip by the inverse kinematics of the finger; the target is fixed to the object and moves relative to the palm. All
//! of them add up to one force and one moment on the palm. Only the inverse kinematics of a finger is differentiated numerically.

use super::penalty::measure_cost;
use crate::kinematics::finger::{FingerModel, FingerPose};
use crate::kinematics::joint_positions::{IkSolution, JointPositions, MAX_DOFS};
use crate::model::hand::HandModel;
use nalgebra::{Isometry3, Point3, Vector3, Vector6};

/// The step of the numerical derivative of a finger's inverse kinematics, m.
const DIFFERENCE_M: f64 = 1e-6;

/// The gradient of the cost by the position of a point; palm frame.
pub(super) struct PointGradient {
    /// The finger and the joint that move it; `None` for the palm.
    pub(super) on: Option<(usize, usize)>,
    /// Whether the pushing shape is fixed to the object; otherwise it moves with the palm.
    pub(super) outside: bool,
    pub(super) at: Point3<f64>,
    /// 1/m.
    pub(super) slope: Vector3<f64>,
}

/// A finger at its contact.
pub(super) struct ContactFinger<'a> {
    index: usize,
    pub(super) finger: &'a FingerModel,
    /// The target of its tip, palm frame.
    pub(super) target: Point3<f64>,
    /// The gradient of the cost by the target, without the effect of its joints, 1/m.
    pub(super) target_slope: Vector3<f64>,
    reached: IkSolution,
    posture: FingerPose,
    /// The direction into the surface, palm frame, and the derivative of the cost by the cosine between it and the pad.
    into: Vector3<f64>,
    pad_slope: f64,
    joint_slope: JointPositions,
}

/// An idle finger that follows a touching one.
pub(super) struct FollowerFinger {
    pub(super) index: usize,
    pub(super) follows: usize,
    pub(super) angles: JointPositions,
}

impl PointGradient {
    /// A push on a point of the palm by a shape that is fixed to the object.
    pub(super) fn of_palm(at: Point3<f64>, slope: Vector3<f64>) -> Self {
        Self { on: None, outside: true, at, slope }
    }
}

impl<'a> ContactFinger<'a> {
    pub(super) fn new(
        index: usize,
        finger: &'a FingerModel,
        target: Point3<f64>,
        reached: IkSolution,
        posture: FingerPose,
        into: Vector3<f64>,
        pad_slope: f64,
    ) -> Self {
        let target_slope = Vector3::zeros();
        Self { index, finger, target, target_slope, reached, posture, into, pad_slope, joint_slope: [0.0; MAX_DOFS] }
    }

    /// The position of its first joint.
    pub(super) fn base(&self) -> Option<Point3<f64>> {
        self.posture.joints.first().map(|pose| pose.translation.vector.into())
    }

    /// Returns the gradient of the cost by the target, with the effect of its joints; `share` is the weight of its measure.
    fn followed(&self, share: f64) -> Vector3<f64> {
        let near = self.finger.reach_near(self.target, &self.reached);
        let here = measure_cost(near.measure, near.miss);
        let by_axis = |axis: usize| {
            let beside = self.target + Vector3::ith(axis, DIFFERENCE_M);
            let there = self.finger.reach_near(beside, &self.reached);
            let joints: f64 = self
                .joint_slope
                .iter()
                .zip(there.angles.iter().zip(&near.angles))
                .map(|(slope, (there, here))| slope * (there - here))
                .sum();
            (share * (measure_cost(there.measure, there.miss) - here) + joints) / DIFFERENCE_M
        };
        self.target_slope + Vector3::from_fn(|axis, _| by_axis(axis))
    }
}

/// Returns the gradient of the cost by a translation (1/m) and a rotation (1/rad) of the palm about a point; frame of the object.
pub(super) fn twist(
    object_from_palm: &Isometry3<f64>,
    about: &Point3<f64>,
    pushes: &[PointGradient],
    mut touching: Vec<ContactFinger<'_>>,
    following: &[FollowerFinger],
    hand: &HandModel,
    share: f64,
) -> Vector6<f64> {
    let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
    for push in pushes {
        if push.outside {
            force += push.slope;
            moment += push.at.coords.cross(&push.slope);
        }
        let Some((index, joint)) = push.on else { continue };
        let followed = following.iter().find(|follower| follower.index == index);
        let by = followed.map_or(index, |follower| follower.follows);
        let Some(it) = touching.iter_mut().find(|it| it.index == by) else { continue };
        if let Some(FollowerFinger { angles, .. }) = followed {
            let finger = &hand.fingers[index];
            let mut joints = [0.0; MAX_DOFS];
            finger.pull(&finger.posture(angles), joint, &push.at, &push.slope, &mut joints);
            // Its first joint stays in the middle, and the second one at its limit.
            let kept = if finger.ranges.get(1).is_some_and(|[low, _]| angles[1] <= *low) { 2 } else { 1 };
            it.joint_slope.iter_mut().zip(joints).skip(kept).for_each(|(slope, more)| *slope += more);
        } else {
            it.finger.pull(&it.posture, joint, &push.at, &push.slope, &mut it.joint_slope);
        }
    }
    for it in &mut touching {
        if it.pad_slope != 0.0 {
            moment -= it.into.cross(&it.posture.pad) * it.pad_slope;
            let turning = it.posture.pad.cross(&it.into) * it.pad_slope;
            it.finger.turn(&it.posture, &turning, &mut it.joint_slope);
        }
        let slope = it.followed(share);
        force -= slope;
        moment -= it.target.coords.cross(&slope);
    }
    let force = object_from_palm.rotation * force;
    let arm = object_from_palm.translation.vector - about.coords;
    let moment = object_from_palm.rotation * moment + arm.cross(&force);
    Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
}
