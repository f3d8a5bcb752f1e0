//! The distance by which fingers open before and after a grasp. An opened finger bends elsewhere than a closed one, and its middle link may enter the object.

use super::candidate::GraspCandidate;
use super::clearance::Shapes;
use super::grasp_request::{CLEAR_M, Contact};
use crate::kinematics::finger::FingerModel;
use crate::kinematics::joint_positions::JointPositions;
use crate::model::hand::HandModel;
use nalgebra::{Point3, Vector3};

/// Distance by which fingers open, m.
pub(crate) const OPENED_M: f64 = 0.018;
/// Smaller openings for fingers without room for the usual one, m.
pub(crate) const NARROWER_M: [f64; 3] = [0.012, 0.008, 0.005];

/// Returns the center of an opened fingertip, palm frame: as far along the outward normal of the object from its contact as the finger reaches, up to `opens`, m.
pub(crate) fn opened_tip(model: &FingerModel, closed: Point3<f64>, normal: &Vector3<f64>, opens: f64) -> Point3<f64> {
    model.posture(&model.ik(closed + normal * opens).angles).tip
}

/// Returns the largest opening at which the links of a hand are clear of the object, m, or the one with the smallest overlap; `None` for the usual one, and for
/// jaws.
pub(super) fn clear_opening(
    hand: &HandModel,
    shapes: &Shapes,
    contacts: &[Contact],
    found: &GraspCandidate,
) -> Option<f64> {
    let palm = &found.object_from_palm;
    let overlap = |opens: f64| {
        let touching = contacts.iter().filter_map(|contact| {
            let model = hand.finger(contact.finger)?;
            let closed = palm.inverse_transform_point(&(contact.point + contact.normal * model.radius));
            let open = opened_tip(model, closed, &palm.inverse_transform_vector(&contact.normal), opens);
            Some((model, model.ik(open).angles))
        });
        let idle = found.idle.iter().filter_map(|(finger, angles)| Some((hand.finger(*finger)?, *angles)));
        let fingers: Vec<(&FingerModel, JointPositions)> = touching.chain(idle).collect();
        -shapes.clearance(palm, &fingers).object
    };
    let mut least = (OPENED_M, if hand.jaws.is_some() { 0.0 } else { overlap(OPENED_M) });
    for opens in NARROWER_M {
        if least.1 <= CLEAR_M {
            break;
        }
        let found = overlap(opens);
        if found < least.1 {
            least = (opens, found);
        }
    }
    (least.0 < OPENED_M).then_some(least.0)
}
