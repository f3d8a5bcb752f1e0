//! Grasps of a gripper: the jaws are on the line between their contacts, and the palm is turned about that line for the largest clearance.
//!
//! A jaw has at most one degree of freedom, so its manipulability is zero. The measure of a grasp is
//!
//! ```text
//! W = 4 u (1 - u) · (Π_i (1 - tan α_i / μ) cos β_i)^(1/2) · (Π_k g_k / (g_k + L))^(1/2)        all of it ours
//! ```
//!
//! the distance of the opening from its limits (u: share by which the jaws are open), the alignment of the jaws with the surface normals within the friction cone (α:
//! angle between the line and the normal, μ: friction), the alignment of the pads of turning jaws (β: angle between pad and line), and the clearance of the palm (g:
//! its gaps to the object and to obstacles, L: length of the jaws beyond the palm). All factors but the last are the same at all turns about the line; the last one
//! and collisions decide the turn.

use super::candidate::{FingerPlacement, GraspCandidate, Reach, clearest};
use super::clearance::Shapes;
use super::grasp_request::{Contact, GraspRequest};
use super::no_grasp::NoGrasp;
use crate::kinematics::finger::FingerModel;
use crate::kinematics::joint_positions::JointPositions;
use crate::model::gripper::{Jaw, JawStance, Jaws};
use crate::model::hand::HandModel;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use std::f64::consts::TAU;
use teachtree_command::FRICTION;

/// Number of rotations about the line that are evaluated: every 3 degrees.
const TURNS: usize = 120;
/// Measures that differ by less are equal, and the first one is taken, so that rounding does not affect the result.
const ALIKE: f64 = 1e-9;

/// Returns the best pose of the palm for a gripper among those that an arm can reach, and the number of places with collisions of palm or arm.
pub(super) fn best(
    hand: &HandModel,
    jaws: &Jaws,
    request: &GraspRequest<'_>,
    reach: &Reach<'_>,
) -> Result<(usize, GraspCandidate), NoGrasp> {
    let found = all(hand, jaws, request)?;
    let reached = found.into_iter().filter_map(|grasp| Some((reach(&grasp)?, grasp)));
    clearest(reached).ok_or(NoGrasp::ArmOutOfReach)
}

/// Returns all evaluated poses of the palm for a gripper without collision, best first.
pub(super) fn all(hand: &HandModel, jaws: &Jaws, request: &GraspRequest<'_>) -> Result<Vec<GraspCandidate>, NoGrasp> {
    let two_finger = TwoFingerGrasp::new(jaws, &request.contacts)?;
    let shapes = Shapes::new(hand, request);
    let (mut found, mut in_the_way): (Vec<GraspCandidate>, Option<(f64, String)>) = (Vec::new(), None);
    for turn in 0..TURNS {
        match two_finger.grasp(hand, &two_finger.pose(turn as f64 / TURNS as f64 * TAU), &shapes) {
            Ok(grasp) => found.push(grasp),
            Err((overlap, who)) if in_the_way.as_ref().is_none_or(|(least, _)| overlap < *least) => {
                in_the_way = Some((overlap, who));
            }
            Err(_) => {}
        }
    }
    found.sort_by(|a, b| (b.measure / ALIKE).round().total_cmp(&(a.measure / ALIKE).round()));
    match in_the_way {
        Some((overlap, who)) if found.is_empty() => Err(NoGrasp::InTheWay(overlap, who)),
        _ => Ok(found),
    }
}

/// Jaws on their line in the frame of the object.
struct TwoFingerGrasp<'a> {
    jaws: &'a Jaws,
    /// The direction from the thumb to the other jaw.
    along: Unit<Vector3<f64>>,
    /// The center of the thumb's ball.
    thumb: Point3<f64>,
    /// The opening, m, and its share of the range.
    opening: f64,
    share: f64,
    stance: JawStance,
    /// The angle between the line and the normal at each jaw, rad, and these normals.
    leans: [f64; 2],
    normals: [Vector3<f64>; 2],
}

impl<'a> TwoFingerGrasp<'a> {
    fn new(jaws: &'a Jaws, contacts: &[Contact]) -> Result<Self, NoGrasp> {
        if let Some(contact) = contacts.iter().find(|contact| jaws.jaw(contact.finger).is_none()) {
            return Err(NoGrasp::Lacks(contact.finger));
        }
        let on = [&jaws.pair[0], &jaws.pair[1]]
            .map(|jaw| Some((jaw, contacts.iter().find(|contact| contact.finger == jaw.finger)?)));
        let [Some((thumb, one)), Some((other, two))] = on else { return Err(NoGrasp::OneSided) };
        let centres = [(thumb, one), (other, two)].map(|(jaw, contact)| contact.point + contact.normal * jaw.radius);
        let way = centres[1] - centres[0];
        let opening = way.norm() - thumb.radius - other.radius;
        let [least, most] = jaws.range();
        let along = Unit::try_new(way, 1e-6).ok_or(NoGrasp::TooNarrow(opening, least))?;
        let leans = [(one, along.into_inner()), (two, -along.into_inner())]
            .map(|(contact, inward)| inward.angle(&-contact.normal));
        // Contacts that do not oppose each other have no opening.
        if let Some((contact, lean)) = [one, two].into_iter().zip(leans).find(|(_, lean)| squarely(*lean) <= 0.0) {
            return Err(NoGrasp::SlipsOff(contact.finger, lean));
        }
        if opening > most {
            return Err(NoGrasp::TooWide(opening, most));
        }
        if opening < least {
            return Err(NoGrasp::TooNarrow(opening, least));
        }
        let (share, normals) = (jaws.share(opening), [one.normal, two.normal]);
        Ok(Self { jaws, along, thumb: centres[0], opening, share, stance: jaws.stance(share), leans, normals })
    }

    /// Returns the pose of the palm turned about the line.
    fn pose(&self, turn: f64) -> Isometry3<f64> {
        let Self { stance, along, .. } = self;
        let object_from_line = Rotation3::from_axis_angle(along, turn) * frame(along, &across(along, &Vector3::z()));
        let palm_from_line = frame(&stance.along, &across(&stance.along, &stance.middle.coords));
        let rotation = UnitQuaternion::from_rotation_matrix(&(object_from_line * palm_from_line.inverse()));
        Isometry3::from_parts(Translation3::from(self.thumb.coords - rotation * stance.thumb.coords), rotation)
    }

    /// Returns the grasp at a pose, or the largest overlap, m, and the pair.
    fn grasp(&self, hand: &HandModel, pose: &Isometry3<f64>, shapes: &Shapes) -> Result<GraspCandidate, (f64, String)> {
        let angles = |jaw: &Jaw| Some((hand.finger(jaw.finger)?, jaw.angles(self.share)));
        let all: Vec<(&FingerModel, JointPositions)> = self.jaws.pair.iter().filter_map(angles).collect();
        let clearance = shapes.clearance(pose, &all);
        if let Some(overlap) = clearance.worst_overlap() {
            return Err(overlap);
        }
        let free = (4.0 * self.share * (1.0 - self.share)).clamp(0.0, 1.0);
        let stand = self.leans.map(squarely);
        let facing = self.stance.askew.map(|askew| askew.cos().max(0.0));
        // Without obstacles the gap is infinite.
        let out = self.jaws.out;
        let room = shapes.palm(pose).map(|gap| if gap.is_finite() { gap / (gap + out).max(1e-9) } else { 1.0 });
        let placement = |index: usize| -> Option<FingerPlacement> {
            let jaw = &self.jaws.pair[index];
            let angles = jaw.angles(self.share);
            let pad = pose.rotation * hand.finger(jaw.finger)?.posture(&angles).pad;
            Some(FingerPlacement {
                finger: jaw.finger,
                angles,
                manipulability: 0.0,
                freedom: free,
                pad_angle: pad.angle(&-self.normals[index]),
                alignment: stand[index] * facing[index],
                miss: 0.0,
            })
        };
        let fingers = [0, 1].into_iter().filter_map(placement);
        Ok(GraspCandidate {
            object_from_palm: *pose,
            friction_margin: stand[0].min(stand[1]),
            measure: free * (stand[0] * stand[1] * facing[0] * facing[1]).sqrt() * (room[0] * room[1]).sqrt(),
            fingers: fingers.collect(),
            idle: Vec::new(),
            opening: Some(self.opening),
            clearance,
        })
    }
}

/// Returns the alignment of a jaw with a surface: 1 along the normal, 0 at the edge of the friction cone and beyond.
fn squarely(lean: f64) -> f64 {
    if lean < FRICTION.atan() { 1.0 - lean.tan() / FRICTION } else { 0.0 }
}

/// Returns a unit vector perpendicular to `along`, as near as possible to `near`.
fn across(along: &Unit<Vector3<f64>>, near: &Vector3<f64>) -> Unit<Vector3<f64>> {
    let part = |vector: &Vector3<f64>| Unit::try_new(vector - along.into_inner() * along.dot(vector), 1e-6);
    [*near, Vector3::x(), Vector3::y()].iter().find_map(part).unwrap_or_else(Vector3::z_axis)
}

/// Returns the rotation with these first two axes.
fn frame(along: &Unit<Vector3<f64>>, across: &Unit<Vector3<f64>>) -> Rotation3<f64> {
    let third = along.cross(across);
    Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[along.into_inner(), across.into_inner(), third]))
}
