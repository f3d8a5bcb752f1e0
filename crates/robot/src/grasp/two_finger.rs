//! Grasps of a gripper: the jaws on the line between their contacts, and the palm turned about that line so that it has the most room.
//!
//! A jaw has one degree of freedom at most, so that there is no manipulability to be made large. A grasp is measured by
//!
//! ```text
//! W = 4 u (1 - u) · (Π_i (1 - tan α_i / μ) cos β_i)^(1/2) · (Π_k g_k / (g_k + L))^(1/2)        all of it ours
//! ```
//!
//! the freedom of the opening from its limits (u: share by which the jaws are open), how squarely they stand to the surface within the friction
//! cone (α: angle between the line and the normal, μ: friction), how squarely the pads of turning jaws face each other (β: angle between pad and line), and the room of the palm (g: its gaps to the object and to whatever else
//! is there, L: how far the jaws stand out of it). All but the last are the same all about the line; that one and what is in the way choose the turn.

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
/// Measures that differ by less are alike, and the first one is taken: not what rounding makes of them.
const ALIKE: f64 = 1e-9;

/// The best pose of the palm for a gripper among those that an arm can bring it to, and at how many places palm or arm meet something then.
pub(super) fn best(
    hand: &HandModel,
    jaws: &Jaws,
    request: &GraspRequest<'_>,
    reach: &Reach<'_>,
) -> Result<(usize, GraspCandidate), NoGrasp> {
    let found = all(hand, jaws, request)?;
    let reached = found.into_iter().filter_map(|grasp| Some((reach(&grasp.object_from_palm)?, grasp)));
    clearest(reached).ok_or(NoGrasp::ArmOutOfReach)
}

/// All evaluated poses of the palm for a gripper without collision, best first.
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
    /// From the thumb to the other jaw.
    along: Unit<Vector3<f64>>,
    /// The centre of the thumb's ball.
    thumb: Point3<f64>,
    /// How far the jaws are open, m, and the share.
    opening: f64,
    share: f64,
    stance: JawStance,
    /// How far the line leans from the normal at each jaw, rad; and these normals.
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
        // How far jaws open is not a question where contacts do not oppose each other.
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

    /// The palm turned about the line.
    fn pose(&self, turn: f64) -> Isometry3<f64> {
        let Self { stance, along, .. } = self;
        let object_from_line = Rotation3::from_axis_angle(along, turn) * frame(along, &across(along, &Vector3::z()));
        let palm_from_line = frame(&stance.along, &across(&stance.along, &stance.middle.coords));
        let rotation = UnitQuaternion::from_rotation_matrix(&(object_from_line * palm_from_line.inverse()));
        Isometry3::from_parts(Translation3::from(self.thumb.coords - rotation * stance.thumb.coords), rotation)
    }

    /// The grasp at a pose, or the worst overlap, m, and between whom.
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
        // The gap to what is not there is infinite.
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

/// How squarely a jaw stands to a surface from whose normal its line leans: 1 for upright, 0 at the edge of the friction cone and beyond.
fn squarely(lean: f64) -> f64 {
    if lean < FRICTION.atan() { 1.0 - lean.tan() / FRICTION } else { 0.0 }
}

/// A unit vector across another one, as near as may be to a third.
fn across(along: &Unit<Vector3<f64>>, near: &Vector3<f64>) -> Unit<Vector3<f64>> {
    let part = |vector: &Vector3<f64>| Unit::try_new(vector - along.into_inner() * along.dot(vector), 1e-6);
    [*near, Vector3::x(), Vector3::y()].iter().find_map(part).unwrap_or_else(Vector3::z_axis)
}

/// The rotation whose first two axes are these.
fn frame(along: &Unit<Vector3<f64>>, across: &Unit<Vector3<f64>>) -> Rotation3<f64> {
    let third = along.cross(across);
    Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[along.into_inner(), across.into_inner(), third]))
}
