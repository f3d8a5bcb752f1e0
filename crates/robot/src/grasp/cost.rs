//! The cost of a pose of the palm: smaller is better, and it has a gradient everywhere.
//!
//! ```text
//! cost(T) = -ln W(T)  +  Σ (overlap / 2 mm)²  +  Σ (pad angle beyond / 0.1)²  +  Σ (crossing / 2 mm)²
//! ```
//!
//! W is without the factor of the contacts' friction, which is the same at all poses. Beyond 2 mm, the cost of an overlap is linear. A finger that cannot reach has
//! the smallest measure, and costs 0.4 for each missing mm.

use super::candidate::FingerPlacement;
use super::clearance_field::{ConvexPart, PalmFramePart, parts};
use super::gradient::{ContactFinger, FollowerFinger, PointGradient, twist};
use super::grasp_request::{Contact, GraspRequest, LARGEST_PAD_ANGLE, LARGEST_PUSHING_ANGLE};
use super::no_grasp::NoGrasp;
use super::pad_alignment::pad_alignment;
use super::penalty::{MARGIN_M, measure_cost, price, price_slope};
use super::spheres::{HandSpheres, SphereRow, placed};
use crate::kinematics::joint_positions::{JointPositions, MAX_DOFS, REACHED_M};
use crate::model::hand::HandModel;
use nalgebra::{Isometry3, Matrix3x6, Matrix6, Point3, Vector3, Vector6};
use std::cell::Cell;
use teachtree_base::hands::Finger;
use teachtree_command::GraspCriterion;

/// An idle finger follows a touching one, with its second joint opened by one of these angles, rad.
const LIFTED: [f64; 2] = [0.2, 0.45];

/// Smallest distance of the tips of adjacent fingers, in the order of their bases, m.
const UNCROSSED_M: f64 = 0.004;

/// The capsules of one finger, palm frame.
type SphereRows = Vec<SphereRow>;

/// Number of evaluations of a search.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SearchEffort {
    /// The cost of a pose.
    pub costs: u64,
    /// The cost and its gradient.
    pub slopes: u64,
    /// Only the missing distances of the fingers, and a step that reduces them.
    pub fits: u64,
}

/// The cost of poses for one grasp.
pub(super) struct Cost<'a> {
    hand: &'a HandModel,
    beads: &'a HandSpheres,
    contacts: Vec<(usize, Contact, Point3<f64>)>,
    /// Indices of the fingers that do not touch.
    idle: Vec<usize>,
    /// Largest angle of pads from the surface normal, rad.
    pub(super) largest_pad_angle: f64,
    criterion: GraspCriterion,
    /// Additional clearance, m.
    away: f64,
    parts: Vec<ConvexPart>,
    /// The number of the object's parts.
    own: usize,
    effort: Cell<SearchEffort>,
}

impl<'a> Cost<'a> {
    pub(super) fn new(
        hand: &'a HandModel,
        beads: &'a HandSpheres,
        request: &GraspRequest<'_>,
        criterion: GraspCriterion,
    ) -> Result<Self, NoGrasp> {
        let mut contacts = Vec::new();
        for contact in &request.contacts {
            let index = hand.fingers.iter().position(|finger| finger.finger == contact.finger);
            let index = index.ok_or(NoGrasp::Lacks(contact.finger))?;
            let tip = contact.point + contact.normal * hand.fingers[index].radius;
            contacts.push((index, *contact, tip));
        }
        let idle = (0..hand.fingers.len()).filter(|index| !contacts.iter().any(|(used, ..)| used == index)).collect();
        let (parts, own) = parts(request);
        let opposed = request.contacts.iter().any(|contact| contact.finger == Finger::Thumb);
        let largest_pad_angle = if opposed { LARGEST_PAD_ANGLE } else { LARGEST_PUSHING_ANGLE };
        let effort = Cell::default();
        Ok(Self { hand, beads, contacts, idle, largest_pad_angle, criterion, away: 0.0, parts, own, effort })
    }

    /// Adds a clearance from everything but the contacts, m.
    pub(super) fn keep_away(&mut self, away: f64) {
        self.away = away;
    }

    /// The evaluations since its creation.
    pub(super) fn effort(&self) -> SearchEffort {
        self.effort.get()
    }

    fn count(&self, add: impl Fn(&mut SearchEffort)) {
        let mut effort = self.effort.get();
        add(&mut effort);
        self.effort.set(effort);
    }

    /// Returns the fingers at their contacts at a pose.
    pub(super) fn fingers(&self, pose: &Isometry3<f64>) -> Vec<FingerPlacement> {
        let held = self.contacts.iter().map(|(index, contact, tip)| {
            let finger = &self.hand.fingers[*index];
            let reached = finger.ik(pose.inverse_transform_point(tip));
            let posture = finger.posture(&reached.angles);
            let pad_angle = (pose.rotation * posture.pad).angle(&-contact.normal);
            FingerPlacement {
                finger: finger.finger,
                angles: reached.angles,
                manipulability: finger.manipulability(&reached.angles),
                freedom: finger.joint_limit_margin(&reached.angles),
                pad_angle,
                alignment: pad_alignment(pad_angle.cos(), self.largest_pad_angle).0,
                miss: reached.miss,
            }
        });
        held.collect()
    }

    /// Returns the distance of a finger from its contact at a pose, m.
    pub(super) fn ik_residual(&self, pose: &Isometry3<f64>, finger: Finger) -> f64 {
        let hand = self.hand;
        let contact = self.contacts.iter().find(|(index, ..)| hand.fingers[*index].finger == finger);
        contact.map_or(0.0, |(index, _, tip)| hand.fingers[*index].ik_residual(pose.inverse_transform_point(tip)))
    }

    /// Returns the postures of the idle fingers at a pose.
    pub(super) fn idle(&self, pose: &Isometry3<f64>) -> Vec<(Finger, JointPositions)> {
        let scene = self.seen_from(pose);
        let touching: Vec<(usize, JointPositions)> = self
            .contacts
            .iter()
            .map(|(index, _, tip)| (*index, self.hand.fingers[*index].ik(pose.inverse_transform_point(tip)).angles))
            .collect();
        let idle = self.idle.iter().map(|&index| {
            let idle = self.idle_posture(index, &touching, &scene);
            (self.hand.fingers[index].finger, idle.angles)
        });
        idle.collect()
    }

    /// Returns the posture of an idle finger with the lowest cost: that of the nearest touching finger, lifted off, or stretched, half bent or curled.
    fn idle_posture(&self, index: usize, touching: &[(usize, JointPositions)], scene: &[PalmFramePart]) -> IdleFinger {
        let finger = &self.hand.fingers[index];
        let mut best = IdleFinger { angles: [0.0; MAX_DOFS], bars: Vec::new(), cost: f64::INFINITY, follows: None };
        let neighbor = touching
            .iter()
            .filter(|(other, _)| {
                let other = &self.hand.fingers[*other];
                other.finger != Finger::Thumb && finger.finger != Finger::Thumb && other.dofs.len() == finger.dofs.len()
            })
            .min_by_key(|(other, _)| other.abs_diff(index));
        for (other, followed) in neighbor.into_iter() {
            for lift in LIFTED {
                let mut angles = *followed;
                for (joint, ([low, high], angle)) in finger.ranges.iter().zip(&mut angles).enumerate() {
                    *angle = match joint {
                        0 => (low + high) / 2.0,
                        1 => (*angle - lift).clamp(*low, *high),
                        _ => *angle,
                    };
                }
                let bars: SphereRows = placed(&self.beads.fingers[index], &finger.posture(&angles)).collect();
                let cost = self.idle_cost(scene, index, &bars, best.cost);
                if cost < best.cost {
                    best = IdleFinger { angles, bars, cost, follows: Some(*other) };
                }
                if cost == 0.0 {
                    return best;
                }
            }
        }
        for (angles, bars) in &self.beads.idle[index] {
            let cost = self.idle_cost(scene, index, bars, best.cost);
            if cost < best.cost {
                best = IdleFinger { angles: *angles, bars: bars.clone(), cost, follows: None };
            }
            if cost == 0.0 {
                break;
            }
        }
        best
    }

    /// Returns the shapes to avoid, in the frame of the palm.
    fn seen_from(&self, object_from_palm: &Isometry3<f64>) -> Vec<PalmFramePart> {
        self.parts.iter().map(|part| part.seen_from(object_from_palm)).collect()
    }

    /// The cost of a pose.
    pub(super) fn of(&self, pose: &Isometry3<f64>) -> f64 {
        self.count(|effort| effort.costs += 1);
        self.evaluate(pose, None)
    }

    /// Returns the cost of a pose, and its gradient by a translation of the palm (1/m) and a rotation about a point (1/rad), frame of the object.
    pub(super) fn with_slope(&self, pose: &Isometry3<f64>, about: &Point3<f64>) -> (f64, Vector6<f64>) {
        self.count(|effort| effort.slopes += 1);
        let mut slope = Vector6::zeros();
        let cost = self.evaluate(pose, Some((about, &mut slope)));
        (cost, slope)
    }

    fn evaluate(&self, pose: &Isometry3<f64>, slope: Option<(&Point3<f64>, &mut Vector6<f64>)>) -> f64 {
        let hand = self.hand;
        let mut cost = 0.0;
        let share = 1.0 / self.contacts.len().max(1) as f64;
        let palm_from_object = pose.inverse();
        let scene = self.seen_from(pose);
        let mut pushes: Option<Vec<PointGradient>> = slope.is_some().then(Vec::new);
        let mut bars: [SphereRows; 6] = Default::default();
        let mut touching: Vec<ContactFinger<'_>> = Vec::with_capacity(self.contacts.len());
        let mut angles: Vec<(usize, JointPositions)> = Vec::with_capacity(self.contacts.len());
        for (index, contact, tip) in &self.contacts {
            let finger = &hand.fingers[*index];
            let target = palm_from_object * tip;
            let reached = finger.ik(target);
            let posture = finger.posture(&reached.angles);
            cost += share * measure_cost(reached.measure, reached.miss);
            let into = -(palm_from_object * contact.normal);
            let (pad_cost, pad_slope) = self.pad(posture.pad.dot(&into), share);
            cost += pad_cost;
            if let Some(place) = bars.get_mut(*index) {
                place.extend(placed(&self.beads.fingers[*index], &posture));
                cost += place.iter().map(|bar| self.overlap(&scene, *index, bar, pushes.as_mut())).sum::<f64>();
            }
            touching.push(ContactFinger::new(*index, finger, target, reached, posture, into, pad_slope));
            angles.push((*index, reached.angles));
        }
        let mut following: Vec<FollowerFinger> = Vec::new();
        for &index in &self.idle {
            let idle = self.idle_posture(index, &angles, &scene);
            cost += idle.cost;
            following.extend(idle.follows.map(|follows| FollowerFinger { index, follows, angles: idle.angles }));
            if pushes.is_some() && idle.cost > 0.0 {
                for bar in &idle.bars {
                    self.overlap(&scene, index, bar, pushes.as_mut());
                }
            }
            if let Some(place) = bars.get_mut(index) {
                *place = idle.bars;
            }
        }
        cost += self.palm(&scene, &palm_from_object, &mut pushes);
        // Pairs of fingers.
        for (first, one) in bars.iter().enumerate() {
            for (second, other) in bars.iter().enumerate().skip(first + 1) {
                cost += fingers_overlap((first, one), (second, other), &mut pushes);
            }
        }
        // Adjacent fingers do not cross.
        let mut before: Option<usize> = None;
        for at in 0..touching.len() {
            let Some(base) = touching[at].base().filter(|_| touching[at].finger.finger != Finger::Thumb) else {
                continue;
            };
            if let Some(before) = before
                && let Some(lateral) = touching[before].base().and_then(|other| (base - other).try_normalize(1e-6))
            {
                let crossed = UNCROSSED_M - (touching[at].target - touching[before].target).dot(&lateral);
                if crossed > 0.0 {
                    cost += price(crossed);
                    let slope = lateral * price_slope(crossed);
                    touching[at].target_slope -= slope;
                    touching[before].target_slope += slope;
                }
            }
            before = Some(at);
        }
        if let Some((about, slope)) = slope {
            *slope = twist(pose, about, &pushes.unwrap_or_default(), touching, &following, hand, share);
        }
        cost
    }

    /// Returns the cost of a pad with this cosine to the direction into the surface, and its derivative; `share` is the weight of a finger.
    fn pad(&self, cosine: f64, share: f64) -> (f64, f64) {
        let beyond = (self.largest_pad_angle.cos() + 0.01 - cosine).max(0.0);
        let (alignment, slope) = match self.criterion {
            GraspCriterion::Quality => pad_alignment(cosine, self.largest_pad_angle),
            GraspCriterion::Manipulability => (1.0, 0.0),
        };
        ((beyond / 0.1).powi(2) - share * alignment.ln(), -200.0 * beyond - share * slope / alignment)
    }

    /// Returns the cost of the palm.
    fn palm(
        &self,
        scene: &[PalmFramePart],
        palm_from_object: &Isometry3<f64>,
        pushes: &mut Option<Vec<PointGradient>>,
    ) -> f64 {
        let mut cost = 0.0;
        let beads = &self.beads;
        let kept = MARGIN_M + self.away;
        for part in scene {
            let (middle, around) = &beads.about_palm;
            if part.distance(middle) > around + kept {
                continue;
            }
            for point in &beads.palm {
                let over = kept - part.distance(point);
                if over > 0.0 {
                    cost += price(over);
                    if let Some(pushes) = pushes {
                        pushes.push(PointGradient::of_palm(*point, part.out(point) * -price_slope(over)));
                    }
                }
            }
        }
        // A shape may be inside the palm although no sampled point of the palm is near it.
        for part in self.parts.iter().take(self.own) {
            let centre = palm_from_object * part.centre;
            for (pose, half) in &beads.palm_boxes {
                let p = pose.inverse_transform_point(&centre);
                let depths = half - p.coords.abs();
                let depth = depths.min();
                if depth > 0.0 {
                    cost += price(depth);
                    if let Some(pushes) = pushes {
                        let axis = depths.imin();
                        let out = pose.rotation * Vector3::ith(axis, 1.0_f64.copysign(p[axis]));
                        pushes.push(PointGradient::of_palm(centre, out * price_slope(depth)));
                    }
                }
            }
        }
        cost
    }

    /// Returns the cost of a capsule of a finger that overlaps a body or comes too near to it; `pushes` receives its gradient at each sphere.
    fn overlap(
        &self,
        scene: &[PalmFramePart],
        finger: usize,
        bar: &SphereRow,
        mut pushes: Option<&mut Vec<PointGradient>>,
    ) -> f64 {
        let mut cost = 0.0;
        let kept = MARGIN_M + self.away;
        let (middle, around) = bar.around();
        let own = if bar.touches { self.own } else { 0 };
        for part in scene.iter().skip(own).filter(|part| part.distance(&middle) < around + kept) {
            for ball in bar.balls() {
                let over = bar.radius + kept - part.distance(&ball);
                if over > 0.0 {
                    cost += price(over);
                    if let Some(pushes) = &mut pushes {
                        let slope = part.out(&ball) * -price_slope(over);
                        pushes.push(PointGradient { on: Some((finger, bar.joint)), outside: true, at: ball, slope });
                    }
                }
            }
        }
        cost
    }

    /// Returns the cost of the capsules of an idle finger; it stops adding where the sum reaches `best`.
    fn idle_cost(&self, scene: &[PalmFramePart], finger: usize, bars: &[SphereRow], best: f64) -> f64 {
        let mut cost = 0.0;
        for bar in bars {
            cost += self.overlap(scene, finger, bar, None);
            if cost >= best {
                break;
            }
        }
        cost
    }

    /// Returns a pose that brings the fingers nearer to their contacts, by a Gauss–Newton step on the missing distances alone, and the missing distance before it, m.
    pub(super) fn nearer(&self, pose: &Isometry3<f64>) -> (f64, Isometry3<f64>) {
        self.count(|effort| effort.fits += 1);
        let mut square = Matrix6::identity() * 1e-7;
        let mut right = Vector6::zeros();
        let mut missed = 0.0;
        for (index, _, tip) in &self.contacts {
            let finger = &self.hand.fingers[*index];
            let target = pose.inverse_transform_point(tip);
            let reached = finger.ik(target);
            missed += reached.miss;
            let at = finger.posture(&reached.angles).tip;
            // The palm moves by (t, ω) in its own frame, and the tip moves with it.
            let r = at.coords;
            let mut rows = Matrix3x6::zeros();
            rows.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
            rows.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-r.cross_matrix()));
            square += rows.transpose() * rows;
            right += rows.transpose() * (target - at);
        }
        let step = square.cholesky().filter(|_| missed > REACHED_M).map(|factor| factor.solve(&right));
        let Some(step) = step else { return (missed, *pose) };
        let shift: Vector3<f64> = step.fixed_rows::<3>(0).into();
        let turn: Vector3<f64> = step.fixed_rows::<3>(3).into();
        // Long steps are shortened, since the linearization holds nearby only.
        let cut = (0.5 / turn.norm().max(1e-9)).min(0.05 / shift.norm().max(1e-9)).min(1.0);
        (missed, pose * Isometry3::new(shift * cut, turn * cut))
    }

    /// The middle of the contacts, the scale of the search about it, and the contacts in the object's frame.
    pub(super) fn middle(&self) -> Point3<f64> {
        let sum: Vector3<f64> = self.contacts.iter().map(|(.., tip)| tip.coords).sum();
        Point3::from(sum / self.contacts.len().max(1) as f64)
    }
}

/// An idle finger: its angles, its capsules, the cost of their overlaps, and the finger that it follows.
struct IdleFinger {
    angles: JointPositions,
    bars: SphereRows,
    cost: f64,
    follows: Option<usize>,
}

/// Returns the cost of the overlap of two fingers.
fn fingers_overlap(
    (first, one): (usize, &[SphereRow]),
    (second, other): (usize, &[SphereRow]),
    pushes: &mut Option<Vec<PointGradient>>,
) -> f64 {
    let mut cost = 0.0;
    for a in one {
        for b in other {
            let least = a.radius + b.radius + MARGIN_M / 2.0;
            let ((here, around), (there, about)) = (a.around(), b.around());
            let near = around + about + MARGIN_M;
            if (here - there).norm_squared() > near * near || a.gap2(b) > least * least {
                continue;
            }
            for ball in a.balls() {
                for other in b.balls() {
                    let way = ball - other;
                    let distance2 = way.norm_squared();
                    if distance2 >= least * least {
                        continue;
                    }
                    let distance = distance2.sqrt();
                    cost += price(least - distance);
                    if let Some(pushes) = pushes {
                        let slope = way * (price_slope(least - distance) / distance.max(1e-9));
                        let push = |finger, joint, at, slope| PointGradient {
                            on: Some((finger, joint)),
                            outside: false,
                            at,
                            slope,
                        };
                        pushes.push(push(first, a.joint, ball, -slope));
                        pushes.push(push(second, b.joint, other, slope));
                    }
                }
            }
        }
    }
    cost
}
