//! A grasp for a plan: with the fingertips at their contacts, and opened.

use crate::grasp::opening::{OPENED_M, opened_tip};
use crate::kinematics::arm_distance::PlacedShape;
use crate::kinematics::joint_positions::JointPositions;
use crate::model::hand::HandModel;
use crate::model::robot::Robot;
use nalgebra::{Isometry3, Point3, Vector3};
use std::collections::BTreeMap;
use teachtree_base::hands::Finger;
use teachtree_base::pose::pose_from_array;
use teachtree_base::short_number::ShortNumber;
use teachtree_command::GraspSpec;
use teachtree_description::shape::CollisionShape;

/// Joints are written with six decimals, rad or m.
const ROUNDED: f64 = 1e-5;

/// A mapped grasp, palm frame.
pub(crate) struct ResolvedGrasp {
    pub(crate) object_from_palm: Isometry3<f64>,
    /// Finger, center of the tip at its contact, and center of the opened tip.
    pub(crate) tips: Vec<(Finger, Point3<f64>, Point3<f64>)>,
    /// The middle of the contacts, object frame.
    pub(crate) middle: Vector3<f64>,
    /// The postures of the idle fingers.
    pub(crate) idle: Vec<(Finger, JointPositions)>,
    /// The degrees of freedom of the arm whose values the commands give.
    pub(crate) arm: Vec<(usize, f64)>,
}

impl ResolvedGrasp {
    /// Returns the resolved grasp of a mapped grasp; `demonstrated_radius` is that of the demonstrated fingertips, m.
    ///
    /// # Errors
    /// A grasp that was not mapped, or not to this hand.
    pub(crate) fn new(
        grasp: &GraspSpec,
        limb: &Robot,
        hand: &HandModel,
        demonstrated_radius: f64,
    ) -> Result<Self, String> {
        let Some(mapped) = &grasp.mapped else {
            return Err(grasp.infeasible.clone().unwrap_or_else(|| "has a grasp without a robot's hand".into()));
        };
        let fingers: Vec<usize> = hand.fingers.iter().flat_map(|finger| finger.dofs.iter().copied()).collect();
        for (part, dofs, values) in [("hand", &fingers, &mapped.joints), ("arm", &hand.arm, &mapped.arm)] {
            check(limb, part, dofs, values)?;
        }
        let object_from_palm = pose_from_array(&mapped.object_from_palm);
        let mut tips = Vec::new();
        let mut middle = Vector3::zeros();
        for contact in &grasp.contacts {
            let finger = contact.finger;
            let model = hand.finger(finger).ok_or_else(|| format!("the hand has no {finger} finger"))?;
            let (point, normal) = (Point3::from(contact.point), Vector3::from(contact.normal));
            let closed = object_from_palm.inverse_transform_point(&(point + normal * model.radius));
            let outward = object_from_palm.inverse_transform_vector(&normal);
            let open = opened_tip(model, closed, &outward, mapped.opens.unwrap_or(OPENED_M));
            tips.push((finger, closed, open));
            middle += (point + normal * demonstrated_radius).coords;
        }
        if tips.is_empty() {
            return Err("has a grasp without contacts".into());
        }
        middle /= tips.len() as f64;
        let others = hand.fingers.iter().filter(|model| tips.iter().all(|(finger, ..)| *finger != model.finger));
        let idle = others.map(|model| {
            let mut angles = resting(&model.ranges);
            for (angle, dof) in angles.iter_mut().zip(&model.dofs) {
                *angle = mapped.joints.get(&limb.tree.dofs[*dof].name).copied().unwrap_or(*angle);
            }
            (model.finger, angles)
        });
        let arm = hand.arm.iter().filter_map(|dof| Some((*dof, *mapped.arm.get(&limb.tree.dofs[*dof].name)?)));
        Ok(Self { object_from_palm, idle: idle.collect(), tips, middle, arm: arm.collect() })
    }

    /// Returns the shapes of the hand in this grasp, closed and opened, frame of the object.
    pub(crate) fn shapes(&self, hand: &HandModel) -> [Vec<PlacedShape>; 2] {
        [false, true].map(|opened| {
            let shapes = hand.solids(|finger| {
                let tip = self.tips.iter().find(|(which, ..)| *which == finger.finger);
                let idle = self.idle.iter().find(|(which, _)| *which == finger.finger);
                match (tip, idle) {
                    (Some((_, closed, open)), _) => finger.ik(if opened { *open } else { *closed }).angles,
                    (_, Some((_, angles))) => *angles,
                    _ => resting(&finger.ranges),
                }
            });
            shapes.iter().map(|shape| PlacedShape::new(0, shape.moved(&self.object_from_palm))).collect()
        })
    }

    /// Returns the shapes of the opened hand with its fingertip balls, frame of the object.
    pub(crate) fn opened(&self, hand: &HandModel) -> Vec<PlacedShape> {
        let [_, mut shapes] = self.shapes(hand);
        for (finger, _, open) in &self.tips {
            let radius = hand.finger(*finger).map_or(0.0, |model| model.radius);
            let middle = self.object_from_palm * open;
            shapes.push(PlacedShape::new(0, CollisionShape::Capsule(middle, middle, radius)));
        }
        shapes
    }

    /// Whether two fingertips hold an object: it hangs between them as on a hinge, unless they are flat pads.
    pub(crate) fn is_pinch(&self) -> bool {
        self.tips.len() == 2 && self.tips.iter().any(|(finger, ..)| *finger == Finger::Thumb)
    }
}

/// Joint positions of a finger without a contact: slightly bent.
pub(crate) fn resting(ranges: &[[f64; 2]]) -> JointPositions {
    let mut angles = JointPositions::default();
    for (index, ([low, high], angle)) in ranges.iter().zip(&mut angles).enumerate() {
        *angle = if index == 0 { (low + high) / 2.0 } else { low + 0.12 * (high - low) };
    }
    angles
}

/// Refuses values of unknown joints, and values out of range.
fn check(limb: &Robot, part: &str, dofs: &[usize], values: &BTreeMap<String, f64>) -> Result<(), String> {
    for (name, value) in values {
        let mut of_part = dofs.iter().map(|dof| &limb.tree.dofs[*dof]);
        let Some(dof) = of_part.find(|dof| dof.name == *name) else {
            return Err(format!(
                "has a grasp with the joint `{name}`, which the {part} of `{}` does not have",
                limb.name
            ));
        };
        let [low, high] = dof.range;
        if !(low - ROUNDED..=high + ROUNDED).contains(value) {
            let found = ShortNumber(*value);
            return Err(format!("has a grasp with the joint `{name}` at {found}, expected {low:.3} to {high:.3}"));
        }
    }
    Ok(())
}
