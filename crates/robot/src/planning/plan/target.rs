//! What a plan commands at an instant: the palm, the fingertips and the object.

use super::super::interpolation::share_of;
use super::super::resolved_grasp::resting;
use crate::kinematics::arm_distance::PlacedShape;
use crate::kinematics::finger::FingerModel;
use crate::kinematics::joint_positions::JointPositions;
use crate::model::hand::HandModel;
use nalgebra::{Isometry3, Point3, Vector3};
use teachtree_base::hands::Finger;

/// The target at one instant; reference frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// The palm.
    pub palm: Isometry3<f64>,
    /// The participating fingertips: finger, center, force on the object.
    pub tips: Vec<(Finger, Point3<f64>, Vector3<f64>)>,
    /// The joint positions of the idle fingers.
    pub idle: Vec<(Finger, JointPositions)>,
    /// The pose of the object.
    pub object: Isometry3<f64>,
    /// Whether the object can move freely to its target: it hangs in the hand, or is pushed with no body beside it.
    pub free: bool,
    /// Whether fingers push the object without a thumb.
    pub pushed: bool,
}

impl Target {
    /// Moves the target by a share of a displacement.
    pub fn blend_toward(&mut self, off: &Isometry3<f64>, share: f64) {
        let part = share_of(off, share);
        self.palm = part * self.palm;
        self.object = part * self.object;
        for (_, tip, force) in &mut self.tips {
            (*tip, *force) = (part * *tip, part * *force);
        }
    }

    /// Returns the fingers of a hand at the target.
    pub(in crate::planning) fn fingers(&self, hand: &HandModel) -> FingerPostures {
        let posture = |finger: &FingerModel| {
            let angles = self.angles(finger);
            (finger.finger, angles, finger.posture(&angles).tip)
        };
        hand.fingers.iter().map(posture).collect()
    }

    /// Returns the shapes of a hand at the target, reference frame.
    pub(in crate::planning) fn shapes(&self, hand: &HandModel) -> Vec<PlacedShape> {
        let solids = hand.solids(|finger| self.angles(finger));
        solids.iter().map(|shape| PlacedShape::new(0, shape.moved(&self.palm))).collect()
    }

    /// Returns the angles of a finger, with its tip at the target, or idle.
    pub fn angles(&self, finger: &FingerModel) -> JointPositions {
        if let Some((_, tip, _)) = self.tips.iter().find(|(which, ..)| *which == finger.finger) {
            return finger.ik(self.palm.inverse_transform_point(tip)).angles;
        }
        let idle = self.idle.iter().find(|(which, _)| *which == finger.finger);
        idle.map_or_else(|| resting(&finger.ranges), |(_, angles)| *angles)
    }
}

/// The fingers of a hand: joint positions, and the center of the tip, palm frame, m.
pub(in crate::planning) type FingerPostures = Vec<(Finger, JointPositions, Point3<f64>)>;
