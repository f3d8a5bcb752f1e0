//! A grasp that was found: the pose of the palm and the joint positions of the fingers.

use super::clearance::Clearance;
use crate::kinematics::joint_positions::JointPositions;
use crate::model::hand::HandModel;
use nalgebra::Isometry3;
use teachtree_base::hands::Finger;
use teachtree_command::GraspCriterion;

/// Maximum number of grasps within reach of the arm that are checked for clearance.
const CHECKED: usize = 12;

/// Returns the number of places on the object's path at which hand or arm collide with this grasp; `None` if the arm cannot follow.
pub type Reach<'a> = dyn Fn(&GraspCandidate) -> Option<usize> + 'a;

/// A palm pose with the fingers on their contacts.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspCandidate {
    /// The pose of the palm in the frame of the object.
    pub object_from_palm: Isometry3<f64>,
    /// W; for a gripper the measure of `two_finger`.
    pub measure: f64,
    /// The share by which friction may be smaller than assumed before the contacts no longer hold.
    pub friction_margin: f64,
    /// The fingers that touch, in the order of the contacts.
    pub fingers: Vec<FingerPlacement>,
    /// Joint positions of the fingers that do not touch.
    pub idle: Vec<(Finger, JointPositions)>,
    /// The opening of the jaws of a gripper, m.
    pub opening: Option<f64>,
    /// The gaps, on the exact shapes.
    pub clearance: Clearance,
}

/// A finger on its contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FingerPlacement {
    /// Which finger.
    pub finger: Finger,
    /// Its angles, in the order of its degrees of freedom.
    pub angles: JointPositions,
    /// `w / L³`; nothing for a jaw.
    pub manipulability: f64,
    /// Freedom from joint limits, 0 to 1.
    pub freedom: f64,
    /// Angle between the direction of its pad and the direction into the surface, rad.
    pub pad_angle: f64,
    /// The alignment of the pad with the surface, 0 to 1.
    pub alignment: f64,
    /// Distance of its tip from the contact, m.
    pub miss: f64,
}

impl GraspCandidate {
    /// The degrees of freedom of the hand in a robot's list, set to this grasp in `q`.
    pub fn set(&self, hand: &HandModel, q: &mut [f64]) {
        let touching = self.fingers.iter().map(|held| (held.finger, held.angles));
        for (finger, angles) in touching.chain(self.idle.iter().copied()) {
            let Some(model) = hand.finger(finger) else { continue };
            for (dof, angle) in model.dofs.iter().zip(angles) {
                if let Some(value) = q.get_mut(*dof) {
                    *value = angle;
                }
            }
        }
    }

    /// Returns the joint positions of a finger; `None` for a finger that the grasp does not have.
    pub(crate) fn angles(&self, finger: Finger) -> Option<JointPositions> {
        let touching = self.fingers.iter().map(|held| (held.finger, held.angles));
        touching.chain(self.idle.iter().copied()).find(|(which, _)| *which == finger).map(|(_, angles)| angles)
    }
}

impl FingerPlacement {
    /// The measure of this finger.
    pub fn measure(&self, criterion: GraspCriterion) -> f64 {
        let measure = self.manipulability * self.freedom;
        match criterion {
            GraspCriterion::Quality => measure * self.alignment,
            GraspCriterion::Manipulability => measure,
        }
    }
}

/// Returns the first of some ordered grasps without collisions of the arm, else the one of the first [`CHECKED`] with the fewest. Each grasp comes with its number
/// of places with collisions.
pub(super) fn clearest(grasps: impl Iterator<Item = (usize, GraspCandidate)>) -> Option<(usize, GraspCandidate)> {
    let mut best: Option<(usize, GraspCandidate)> = None;
    for (met, grasp) in grasps.take(CHECKED) {
        if best.as_ref().is_none_or(|(least, _)| met < *least) {
            best = Some((met, grasp));
        }
        if met == 0 {
            break;
        }
    }
    best
}

/// The geometric mean of the measures of fingers.
pub(super) fn geometric_mean(fingers: &[FingerPlacement], criterion: GraspCriterion) -> f64 {
    let product: f64 = fingers.iter().map(|finger| finger.measure(criterion)).product();
    product.powf(1.0 / fingers.len().max(1) as f64)
}
