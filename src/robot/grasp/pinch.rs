//! Grasps of a gripper: the jaws on the line between their contacts, and the palm turned about that line so that it has the most room.
//!
//! A jaw goes one way only, so that there is no manipulability to be made large. A grasp is measured by
//!
//! ```text
//! W = 4 u (1 - u) · (Π_i 1 - tan α_i / μ)^(1/n) · (Π_k g_k / (g_k + L))^(1/2)        all of it ours
//! ```
//!
//! the freedom of the opening from its limits (u: share by which the jaws are open), how squarely they stand to the surface within the friction
//! cone (α: angle between the line and the normal, μ: friction), and the room of the palm (g: its gaps to the object and to whatever else
//! is there, L: how far the jaws stand out of it). The first two are the same all about the line; the third one and what is in the way choose the turn.
//!
//! A jaw that pushes alone stands on the line of the normal, the other one open beyond the object, and how far it is opened itself is chosen too.

use super::clearance::Shapes;
use super::{Contact, Failure, Grasp, Held, Wanted};
use crate::base::hands::Finger;
use crate::command::FRICTION;
use crate::robot::hand::{Angles, FingerModel, HandModel};
use crate::robot::jaws::{Jaw, Jaws};
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use std::f64::consts::TAU;

/// So many turns about the line are looked at: every 3 degrees.
const TURNS: usize = 120;
/// A jaw that pushes alone is opened by one of these shares.
const ALONE: [f64; 6] = [0.5, 0.6, 0.7, 0.8, 0.9, 0.95];
/// The ball of a jaw that does not touch is this far from everything, m.
const BEHIND_M: f64 = 0.002;
/// Measures that differ by less are alike, and the first one is taken: not what rounding makes of them.
const ALIKE: f64 = 1e-9;

/// The best pose of the palm for a gripper among those that an arm can bring it to.
pub(super) fn best(
    hand: &HandModel,
    jaws: &Jaws,
    wanted: &Wanted<'_>,
    reachable: &dyn Fn(&Isometry3<f64>) -> bool,
) -> Result<Grasp, Failure> {
    let shapes = Shapes::new(hand, wanted);
    let (mut found, mut in_the_way): (Vec<Grasp>, Option<(f64, String)>) = (Vec::new(), None);
    for pinch in pinches(jaws, &wanted.contacts)? {
        for turn in 0..TURNS {
            let pose = pinch.pose(jaws, turn as f64 / TURNS as f64 * TAU);
            match pinch.check(hand, jaws, &pose, &shapes) {
                Ok(grasp) => found.push(grasp),
                Err((overlap, who)) if in_the_way.as_ref().is_none_or(|(least, _)| overlap < *least) => {
                    in_the_way = Some((overlap, who));
                }
                Err(_) => {}
            }
        }
    }
    found.sort_by(|a, b| (b.measure / ALIKE).round().total_cmp(&(a.measure / ALIKE).round()));
    let nothing = match (found.is_empty(), in_the_way) {
        (true, Some((overlap, who))) => Failure::InTheWay(overlap, who),
        _ => Failure::ArmOutOfReach,
    };
    found.into_iter().find(|grasp| reachable(&grasp.object_from_palm)).ok_or(nothing)
}

/// Jaws on a line in the frame of the object.
struct Pinch {
    /// From the thumb to the other jaw.
    along: Unit<Vector3<f64>>,
    /// Where a jaw is: its place on the palm's line, and the centre of its ball.
    at: (f64, Point3<f64>),
    /// The thumb and the other jaw: share of its opening, and if it touches, how far the line leans from the normal there, rad.
    stands: [(Jaw, f64, Option<f64>); 2],
    /// What of the measure does not depend on the turn.
    measure: f64,
}

/// How jaws can stand on contacts.
fn pinches(jaws: &Jaws, contacts: &[Contact]) -> Result<Vec<Pinch>, Failure> {
    if let Some(contact) = contacts.iter().find(|contact| jaws.jaw(contact.finger).is_none()) {
        return Err(Failure::Lacks(contact.finger));
    }
    let on = jaws.pair.map(|jaw| contacts.iter().find(|contact| contact.finger == jaw.finger));
    let centre = |jaw: &Jaw, contact: &Contact| contact.point + contact.normal * jaw.radius;
    let [thumb, other] = &jaws.pair;
    match on {
        [Some(one), Some(two)] => {
            let centres = [centre(thumb, one), centre(other, two)];
            let way = centres[1] - centres[0];
            let opening = way.norm() - thumb.radius - other.radius;
            let [least, most] = jaws.range();
            let share = jaws.share(opening);
            // Contacts that do not oppose each other are no question of how far the jaws open.
            let along = Unit::try_new(way, 1e-6).ok_or(Failure::TooNarrow(opening, least))?;
            let leans = [(one, along.into_inner()), (two, -along.into_inner())]
                .map(|(contact, inward)| inward.angle(&-contact.normal));
            if let Some((contact, lean)) = [one, two].into_iter().zip(leans).find(|(_, lean)| squarely(*lean) <= 0.0) {
                return Err(Failure::SlipsOff(contact.finger, lean));
            }
            match share {
                _ if opening > most => return Err(Failure::TooWide(opening, most)),
                _ if opening < least => return Err(Failure::TooNarrow(opening, least)),
                _ => {}
            }
            let stands = [(*thumb, share, Some(leans[0])), (*other, share, Some(leans[1]))];
            let measure = freedom(share) * (squarely(leans[0]) * squarely(leans[1])).sqrt();
            Ok(vec![Pinch { along, at: (thumb.place(share), centres[0]), stands, measure }])
        }
        [Some(contact), None] | [None, Some(contact)] => {
            let is_thumb = contact.finger == Finger::Thumb;
            // The thumb presses along the line, the other one against it.
            let along = Unit::new_normalize(if is_thumb { -contact.normal } else { contact.normal });
            let alone = |share: f64| {
                let jaw = if is_thumb { thumb } else { other };
                let stands = jaws.pair.map(|it| match (it.finger == contact.finger, jaws.geared) {
                    (true, _) => (it, share, Some(0.0)),
                    (false, true) => (it, share, None),
                    (false, false) => (it, 1.0, None),
                });
                Pinch { along, at: (jaw.place(share), centre(jaw, contact)), stands, measure: freedom(share) }
            };
            Ok(ALONE.into_iter().map(alone).collect())
        }
        [None, None] => Err(Failure::Lacks(Finger::Thumb)),
    }
}

/// Freedom of an opening from its limits: 1 half open, 0 at both.
fn freedom(share: f64) -> f64 {
    (4.0 * share * (1.0 - share)).clamp(0.0, 1.0)
}

/// How squarely a jaw stands to a surface from whose normal its line leans: 1 for upright, 0 at the edge of the friction cone and beyond.
fn squarely(lean: f64) -> f64 {
    if lean < FRICTION.atan() { 1.0 - lean.tan() / FRICTION } else { 0.0 }
}

impl Pinch {
    /// The palm turned about the line.
    fn pose(&self, jaws: &Jaws, turn: f64) -> Isometry3<f64> {
        let object_from_line =
            Rotation3::from_axis_angle(&self.along, turn) * frame(&self.along, &across(&self.along, &Vector3::z()));
        let palm_from_line = frame(&jaws.along, &across(&jaws.along, &jaws.middle.coords));
        let rotation = UnitQuaternion::from_rotation_matrix(&(object_from_line * palm_from_line.inverse()));
        let (place, centre) = self.at;
        let in_palm = jaws.middle + jaws.along.into_inner() * place;
        Isometry3::from_parts(Translation3::from(centre.coords - rotation * in_palm.coords), rotation)
    }

    /// How far the balls of the jaws are apart, m.
    fn opening(&self) -> f64 {
        let [(thumb, by, _), (other, by_other, _)] = &self.stands;
        other.place(*by_other) - thumb.place(*by) - thumb.radius - other.radius
    }

    /// The grasp at a pose, or the worst overlap, m, and between whom.
    fn check(
        &self,
        hand: &HandModel,
        jaws: &Jaws,
        pose: &Isometry3<f64>,
        shapes: &Shapes,
    ) -> Result<Grasp, (f64, String)> {
        let all = self.stands.iter().filter_map(|(jaw, share, _)| Some((hand.finger(jaw.finger)?, jaw.angles(*share))));
        let all: Vec<(&FingerModel, Angles)> = all.collect();
        let mut clearance = shapes.clearance(pose, &all);
        // Of a jaw that does not touch the ball is in the way as well.
        for (jaw, share, _) in self.stands.iter().filter(|(.., lean)| lean.is_none()) {
            let centre = pose * (jaws.middle + jaws.along.into_inner() * jaw.place(*share));
            let [object, obstacles] = shapes.ball(&centre, jaw.radius + BEHIND_M);
            clearance.object = clearance.object.min(object);
            clearance.obstacles = clearance.obstacles.min(obstacles);
        }
        if let Some(overlap) = clearance.worst_overlap() {
            return Err(overlap);
        }
        // Of what is not there the gap is infinite.
        let room = shapes.palm(pose).map(|gap| if gap.is_finite() { gap / (gap + jaws.out).max(1e-9) } else { 1.0 });
        let touching = self.stands.iter().filter_map(|(jaw, share, lean)| {
            Some(Held {
                finger: jaw.finger,
                angles: jaw.angles(*share),
                manipulability: 0.0,
                freedom: freedom(*share),
                pad_angle: (*lean)?,
                miss: 0.0,
            })
        });
        let idle = self.stands.iter().filter(|(.., lean)| lean.is_none());
        Ok(Grasp {
            object_from_palm: *pose,
            measure: self.measure * (room[0] * room[1]).sqrt(),
            fingers: touching.collect(),
            idle: idle.map(|(jaw, share, _)| (jaw.finger, jaw.angles(*share))).collect(),
            opening: Some(self.opening()),
            clearance,
        })
    }
}

/// A unit vector across another one, as near as may be to a third.
fn across(along: &Unit<Vector3<f64>>, near: &Vector3<f64>) -> Unit<Vector3<f64>> {
    let part = |vector: &Vector3<f64>| Unit::try_new(vector - along.into_inner() * along.dot(vector), 1e-6);
    let axes = [*near, Vector3::x(), Vector3::y()];
    axes.iter().find_map(part).unwrap_or_else(Vector3::z_axis)
}

/// The rotation whose first two axes are these.
fn frame(along: &Unit<Vector3<f64>>, across: &Unit<Vector3<f64>>) -> Rotation3<f64> {
    let third = along.cross(across);
    Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[along.into_inner(), across.into_inner(), third]))
}
