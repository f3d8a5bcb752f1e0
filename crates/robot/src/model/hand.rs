//! A hand: a palm, the arm that carries it, its fingers, and the jaws of a gripper.

use super::gripper::Jaws;
use crate::kinematics::arm_ik::Arm;
use crate::kinematics::finger::{FingerModel, FingerSpec};
use crate::kinematics::joint_positions::JointPositions;
use std::collections::BTreeSet;
use teachtree_base::hands::Finger;
use teachtree_description::shape::CollisionShape;
use teachtree_description::tree::KinematicTree;

/// Length of a human thumb and fingers, m (docs/sources.md, Hand: base set).
const THUMB_M: f64 = 0.118;
const FINGER_M: f64 = 0.110;

/// A hand of a tree.
#[derive(Clone, Debug)]
pub struct HandModel {
    /// Index of the palm's link.
    pub palm: usize,
    /// Degrees of freedom between the root and the palm, nearest to the root first; empty for a hand without an arm.
    pub arm: Vec<usize>,
    /// The fingers, in the order of the file.
    pub fingers: Vec<FingerModel>,
    /// Shapes of the palm and, on an arm, of all links that are fixed to it, palm frame.
    pub palm_solids: Vec<CollisionShape>,
    /// The jaws of a gripper; `None` for another hand.
    pub jaws: Option<Jaws>,
}

/// Builds the hand of a robot on this palm with these fingertips.
///
/// # Errors
/// The invalid finger, and the reason.
pub(crate) fn build(
    tree: &KinematicTree,
    palm: usize,
    specs: &[FingerSpec],
) -> Result<HandModel, (Option<Finger>, String)> {
    if specs.is_empty() {
        return Err((None, "has no fingers".into()));
    }
    let mut arm: Vec<usize> =
        tree.joints_above(palm).filter_map(|link| tree.links[link].joint.as_ref().map(|joint| joint.dof)).collect();
    arm.reverse();
    let mut seen = BTreeSet::new();
    arm.retain(|dof| seen.insert(*dof));
    let mut fingers = Vec::new();
    for spec in specs {
        fingers.push(FingerModel::new(tree, palm, spec).map_err(|message| (Some(spec.finger), message))?);
    }
    let jaws = Jaws::of(&mut fingers, &tree.links[palm].solids, &tree.dofs);
    let jaws = jaws.map_err(|(finger, message)| (Some(finger), message))?;
    if jaws.is_none() {
        let fixed = fingers.iter().find(|model| model.dofs.is_empty());
        fixed.map_or(Ok(()), |model| Err((Some(model.finger), "does not move".into())))?;
        share_nothing(&fingers)?;
    }
    let palm_solids = if arm.is_empty() { tree.links[palm].solids.clone() } else { moved_with(tree, palm) };
    Ok(HandModel { palm, arm, fingers, palm_solids, jaws })
}

/// Returns the shapes of all links that are rigidly connected to the palm, palm frame.
fn moved_with(tree: &KinematicTree, palm: usize) -> Vec<CollisionShape> {
    let poses = tree.forward_kinematics(&vec![0.0; tree.dofs.len()]);
    // Rigidly connected links form a group; its link nearest to the root represents it.
    let first = |mut link: usize| {
        while link != 0 && tree.links[link].joint.is_none() {
            link = tree.links[link].parent;
        }
        link
    };
    let fixed = (0..tree.links.len()).filter(|link| first(*link) == first(palm));
    let solids = fixed.flat_map(|link| {
        let palm_from_link = poses[palm].inverse() * poses[link];
        tree.links[link].solids.iter().map(move |solid| solid.moved(&palm_from_link))
    });
    solids.collect()
}

/// Refuses fingers that share a degree of freedom.
fn share_nothing(fingers: &[FingerModel]) -> Result<(), (Option<Finger>, String)> {
    for (index, finger) in fingers.iter().enumerate() {
        let shared = |other: &&FingerModel| other.dofs.iter().any(|dof| finger.dofs.contains(dof));
        if let Some(other) = fingers[..index].iter().find(shared) {
            let message =
                format!("shares a degree of freedom with {}, which only the two jaws of a gripper may", other.finger);
            return Err((Some(finger.finger), message));
        }
    }
    Ok(())
}

impl HandModel {
    /// Returns the arm that carries the hand on its tree.
    pub fn arm_on<'a>(&'a self, tree: &'a KinematicTree) -> Arm<'a> {
        Arm { tree, palm: self.palm, dofs: &self.arm }
    }

    /// Returns the shapes of palm and fingers where the fingers have these joint positions, palm frame.
    pub(crate) fn solids(&self, angles: impl Fn(&FingerModel) -> JointPositions) -> Vec<CollisionShape> {
        let mut solids = self.palm_solids.clone();
        for finger in &self.fingers {
            solids.extend(finger.solids(&finger.posture(&angles(finger))).map(|(_, solid)| solid));
        }
        solids
    }

    /// Whether every fingertip is a flat pad.
    pub fn has_flat_pads(&self) -> bool {
        self.fingers.iter().all(|finger| finger.pad_radius.is_some())
    }

    /// Returns the opening of a gripper at these values of the robot's degrees of freedom, m; `None` for another hand.
    pub fn opening(&self, q: &[f64]) -> Option<f64> {
        let jaws = self.jaws.as_ref()?;
        let [thumb, other] = [0, 1].map(|index| self.finger(jaws.pair[index].finger));
        let (thumb, other) = (thumb?, other?);
        let tip = |finger: &FingerModel| finger.posture(&finger.angles(q)).tip;
        Some((tip(other) - tip(thumb)).norm() - thumb.radius - other.radius)
    }

    /// Returns its scale relative to a human hand: the mean over its fingers of their length over that of the base set (docs/sources.md, Hand). It is 1 for a
    /// gripper.
    pub fn scale(&self) -> f64 {
        if self.jaws.is_some() {
            return 1.0;
        }
        let over =
            |finger: &FingerModel| finger.length / if finger.finger == Finger::Thumb { THUMB_M } else { FINGER_M };
        self.fingers.iter().map(over).sum::<f64>() / self.fingers.len() as f64
    }

    /// Returns the finger of this name.
    pub fn finger(&self, finger: Finger) -> Option<&FingerModel> {
        self.fingers.iter().find(|model| model.finger == finger)
    }
}
