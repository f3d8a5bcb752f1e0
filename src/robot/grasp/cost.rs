//! What a pose of the palm costs: the smaller the better, with a slope everywhere.
//!
//! ```text
//! cost(T) = -ln W(T)  +  Σ (overlap / 2 mm)²  +  Σ (pad angle beyond / 0.1)²  +  Σ (crossing / 2 mm)²
//! ```
//!
//! An overlap of more than 2 mm counts in proportion. A finger that cannot reach counts as the smallest measure there is, and 0.4 for each mm that is missing.

use super::beads::{Balls, placed};
use super::{Contact, Failure, Held, LARGEST_PAD_ANGLE, LARGEST_PUSHING_ANGLE, Mapper, NO_ANGLES, Wanted};
use crate::base::geometry::pose;
use crate::base::hands::Finger;
use crate::base::scene::{Body, Shape};
use crate::robot::hand::{Angles, FingerModel, REACHED_M};
use nalgebra::{Isometry3, Matrix3x4, Matrix3x6, Matrix6, Point3, Vector3, Vector6};

/// No measure counts for less.
const SMALLEST: f64 = 1e-3;
/// What a metre that is missing costs.
const PER_METRE: f64 = 400.0;
/// Shapes are kept this far apart while searching, m, and an overlap of this much costs 1.
const MARGIN_M: f64 = 0.0008;
const OVERLAP_M: f64 = 0.002;
/// How far an obstacle may be from the object to matter, m: more than a hand's length.
const FAR_M: f64 = 0.4;

/// A finger that does not touch goes with one that does, with its second joint opened by one of these, rad.
const LIFTED: [f64; 2] = [0.2, 0.45];

/// A convex part of something that is in the way.
struct Part {
    part_from_object: Isometry3<f64>,
    centre: Point3<f64>,
    shape: Shape,
}

/// The same, seen from a palm.
struct Seen {
    part_from_palm: Matrix3x4<f64>,
    shape: Shape,
    away: f64,
}

/// The cost of poses for one grasp.
pub(super) struct Cost<'a> {
    mapper: &'a Mapper<'a>,
    contacts: Vec<(usize, Contact, Point3<f64>)>,
    /// Indices of the fingers that do not touch.
    idle: Vec<usize>,
    /// How far pads may look away, rad.
    pub(super) largest_pad_angle: f64,
    /// Kept free beyond what is needed, m.
    away: f64,
    parts: Vec<Part>,
    /// How many of the parts are the object's.
    own: usize,
}

impl<'a> Cost<'a> {
    pub(super) fn new(mapper: &'a Mapper<'a>, wanted: &Wanted<'_>) -> Result<Self, Failure> {
        let hand = mapper.hand;
        let mut contacts = Vec::new();
        for contact in &wanted.contacts {
            let index = hand.fingers.iter().position(|finger| finger.finger == contact.finger);
            let index = index.ok_or(Failure::Lacks(contact.finger))?;
            let tip = contact.point + contact.normal * hand.fingers[index].radius;
            contacts.push((index, *contact, tip));
        }
        let idle = (0..hand.fingers.len()).filter(|index| !contacts.iter().any(|(used, ..)| used == index)).collect();
        let mut parts = parts(wanted.object, &Isometry3::identity());
        let own = parts.len();
        for obstacle in &wanted.obstacles {
            for part in self::parts(obstacle.body, &obstacle.object_from_obstacle) {
                let near = Seen {
                    part_from_palm: part.part_from_object.to_homogeneous().fixed_view::<3, 4>(0, 0).into(),
                    shape: part.shape,
                    away: 0.0,
                };
                if near.distance(&Point3::origin()) < FAR_M {
                    parts.push(part);
                }
            }
        }
        let opposed = wanted.contacts.iter().any(|contact| contact.finger == Finger::Thumb);
        let largest_pad_angle = if opposed { LARGEST_PAD_ANGLE } else { LARGEST_PUSHING_ANGLE };
        Ok(Self { mapper, contacts, idle, largest_pad_angle, away: 0.0, parts, own })
    }

    /// Keeps this much farther away from everything but the contacts, m.
    pub(super) fn keep_away(&mut self, away: f64) {
        self.away = away;
    }

    /// The fingers on their contacts at a pose.
    pub(super) fn fingers(&self, pose: &Isometry3<f64>) -> Vec<Held> {
        let held = self.contacts.iter().map(|(index, contact, tip)| {
            let finger = &self.mapper.hand.fingers[*index];
            let reached = finger.reach(pose.inverse_transform_point(tip));
            let posture = finger.posture(&reached.angles);
            Held {
                finger: finger.finger,
                angles: reached.angles,
                manipulability: finger.manipulability(&reached.angles),
                freedom: finger.freedom(&reached.angles),
                pad_angle: (pose.rotation * posture.pad).angle(&-contact.normal),
                miss: reached.miss,
            }
        });
        held.collect()
    }

    /// How far a finger stays from its contact at a pose, m.
    pub(super) fn miss(&self, pose: &Isometry3<f64>, finger: Finger) -> f64 {
        let hand = self.mapper.hand;
        let contact = self.contacts.iter().find(|(index, ..)| hand.fingers[*index].finger == finger);
        contact.map_or(0.0, |(index, _, tip)| hand.fingers[*index].miss(pose.inverse_transform_point(tip)))
    }

    /// What the fingers that do not touch do at a pose.
    pub(super) fn idle(&self, pose: &Isometry3<f64>) -> Vec<(Finger, Angles)> {
        let scene = self.seen_from(pose);
        let touching: Vec<(usize, Angles)> = self
            .contacts
            .iter()
            .map(|(index, _, tip)| {
                (*index, self.mapper.hand.fingers[*index].reach(pose.inverse_transform_point(tip)).angles)
            })
            .collect();
        let idle = self.idle.iter().map(|&index| {
            let (angles, ..) = self.idle_posture(index, &touching, &scene);
            (self.mapper.hand.fingers[index].finger, angles)
        });
        idle.collect()
    }

    /// The posture of an idle finger that is least in the way, its balls, and what it costs. It goes with the nearest finger that touches,
    /// lifted off; or it is stretched, half bent or curled.
    fn idle_posture(&self, index: usize, touching: &[(usize, Angles)], scene: &[Seen]) -> (Angles, Balls, f64) {
        let finger = &self.mapper.hand.fingers[index];
        let mut best = (NO_ANGLES, Vec::new(), f64::INFINITY);
        let neighbour = touching
            .iter()
            .filter(|(other, _)| {
                let other = &self.mapper.hand.fingers[*other];
                other.finger != Finger::Thumb && finger.finger != Finger::Thumb && other.dofs.len() == finger.dofs.len()
            })
            .min_by_key(|(other, _)| other.abs_diff(index));
        for lift in if neighbour.is_some() { &LIFTED[..] } else { &[] } {
            let mut angles = neighbour.map_or(NO_ANGLES, |(_, angles)| *angles);
            for (joint, ([low, high], angle)) in finger.ranges.iter().zip(&mut angles).enumerate() {
                *angle = match joint {
                    0 => (low + high) / 2.0,
                    1 => (*angle - lift).clamp(*low, *high),
                    _ => *angle,
                };
            }
            let balls = placed(&self.mapper.beads.fingers[index], &finger.posture(&angles));
            let cost = balls.iter().map(|ball| overlap(scene, ball)).sum();
            if cost < best.2 {
                best = (angles, balls, cost);
            }
            if cost == 0.0 {
                return best;
            }
        }
        for (angles, balls) in &self.mapper.beads.idle[index] {
            let cost = balls.iter().map(|ball| overlap(scene, ball)).sum();
            if cost < best.2 {
                best = (*angles, balls.clone(), cost);
            }
            if cost == 0.0 {
                break;
            }
        }
        best
    }

    /// What is in the way, seen from the palm.
    fn seen_from(&self, object_from_palm: &Isometry3<f64>) -> Vec<Seen> {
        let seen = |part: &Part| Seen {
            part_from_palm: (part.part_from_object * object_from_palm).to_homogeneous().fixed_view::<3, 4>(0, 0).into(),
            shape: part.shape,
            away: 0.0,
        };
        let mut scene: Vec<Seen> = self.parts.iter().map(seen).collect();
        for part in &mut scene {
            part.away = self.away;
        }
        scene
    }

    /// The cost of a pose.
    pub(super) fn of(&self, pose: &Isometry3<f64>) -> f64 {
        let hand = self.mapper.hand;
        let mut cost = 0.0;
        let share = 1.0 / self.contacts.len().max(1) as f64;
        let palm_from_object = pose.inverse();
        let scene = self.seen_from(pose);
        let mut strings: [Balls; 6] = Default::default();
        let mut tips = [None; 6];
        let mut touching: Vec<(usize, Angles)> = Vec::with_capacity(self.contacts.len());
        for (index, contact, tip) in &self.contacts {
            let finger: &FingerModel = &hand.fingers[*index];
            let target = palm_from_object * tip;
            let reached = finger.reach(target);
            let posture = finger.posture(&reached.angles);
            let measure = if reached.miss < REACHED_M { reached.measure } else { 0.0 };
            cost += share * (-measure.max(SMALLEST).ln() + PER_METRE * reached.miss);
            let into = -(palm_from_object * contact.normal);
            let beyond = (self.largest_pad_angle.cos() + 0.01 - posture.pad.dot(&into)).max(0.0);
            cost += (beyond / 0.1).powi(2);
            let balls = placed(&self.mapper.beads.fingers[*index], &posture);
            cost += balls.iter().map(|ball| overlap(&scene, ball)).sum::<f64>();
            if let Some(place) = strings.get_mut(*index) {
                *place = balls;
            }
            if let (Some(place), Some(base)) = (tips.get_mut(*index), posture.joints.first()) {
                *place = Some((target, Point3::from(base.translation.vector), finger.finger));
            }
            touching.push((*index, reached.angles));
        }
        for &index in &self.idle {
            let (_, balls, idle_cost) = self.idle_posture(index, &touching, &scene);
            cost += idle_cost;
            if let Some(place) = strings.get_mut(index) {
                *place = balls;
            }
        }
        // The palm.
        cost += self.mapper.beads.palm.iter().map(|point| overlap(&scene, &(*point, 0.0))).sum::<f64>();
        cost += self.in_palm(&palm_from_object);
        // Fingers and fingers.
        for (first, one) in strings.iter().enumerate() {
            for other in strings.iter().skip(first + 1) {
                cost += strings_overlap(one, other);
            }
        }
        // Fingers that stand side by side do not cross.
        let mut before: Option<(Point3<f64>, Point3<f64>)> = None;
        for (tip, base, _) in tips.iter().flatten().filter(|(.., finger)| *finger != Finger::Thumb) {
            if let Some((tip1, base1)) = before
                && let Some(lateral) = (base - base1).try_normalize(1e-6)
            {
                let crossed = (0.004 - (tip - tip1).dot(&lateral)).max(0.0);
                cost += price(crossed);
            }
            before = Some((*tip, *base));
        }
        cost
    }

    /// A pose moved so that the fingers come nearer to their contacts: Gauss and Newton's step on what each finger misses, without a look at
    /// anything else.
    pub(super) fn nearer(&self, pose: &Isometry3<f64>) -> Isometry3<f64> {
        let mut square = Matrix6::identity() * 1e-7;
        let mut right = Vector6::zeros();
        let mut missed = false;
        for (index, _, tip) in &self.contacts {
            let finger = &self.mapper.hand.fingers[*index];
            let target = pose.inverse_transform_point(tip);
            let reached = finger.reach(target);
            missed |= reached.miss > REACHED_M;
            let at = finger.posture(&reached.angles).tip;
            // The palm moves by (t, ω) in its own frame: the tip goes along.
            let r = at.coords;
            let mut rows = Matrix3x6::zeros();
            rows.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
            rows.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-r.cross_matrix()));
            square += rows.transpose() * rows;
            right += rows.transpose() * (target - at);
        }
        let Some(step) = square.cholesky().filter(|_| missed).map(|factor| factor.solve(&right)) else { return *pose };
        let shift: Vector3<f64> = step.fixed_rows::<3>(0).into();
        let turn: Vector3<f64> = step.fixed_rows::<3>(3).into();
        // Far steps are cut: what a finger misses is only known nearby.
        let cut = (0.5 / turn.norm().max(1e-9)).min(0.05 / shift.norm().max(1e-9)).min(1.0);
        pose * Isometry3::new(shift * cut, turn * cut)
    }

    /// What it costs that the object is in the palm where no point of the palm is near.
    fn in_palm(&self, palm_from_object: &Isometry3<f64>) -> f64 {
        let mut cost = 0.0;
        for part in self.parts.iter().take(self.own) {
            let centre = palm_from_object * part.centre;
            for (pose, half) in &self.mapper.beads.palm_boxes {
                let p = pose.inverse_transform_point(&centre);
                let depth = (half - p.coords.abs()).min();
                if depth > 0.0 {
                    cost += price(depth);
                }
            }
        }
        cost
    }

    /// The middle of the contacts, the scale of the search about it, and the fingers' touch in the object's frame.
    pub(super) fn middle(&self) -> Point3<f64> {
        let sum: Vector3<f64> = self.contacts.iter().map(|(.., tip)| tip.coords).sum();
        Point3::from(sum / self.contacts.len().max(1) as f64)
    }
}

/// What an overlap costs: its square, and less steep where the search has far to go.
fn price(over: f64) -> f64 {
    let over = over / OVERLAP_M;
    if over < 1.0 { over * over } else { 2.0 * over - 1.0 }
}

/// What a ball of the hand costs that overlaps something.
fn overlap(scene: &[Seen], (centre, radius): &(Point3<f64>, f64)) -> f64 {
    let mut cost = 0.0;
    for part in scene {
        let over = radius + MARGIN_M + part.away - part.distance(centre);
        if over > 0.0 {
            cost += price(over);
        }
    }
    cost
}

fn strings_overlap(one: &[(Point3<f64>, f64)], other: &[(Point3<f64>, f64)]) -> f64 {
    // A ball about the other string keeps most of this one away from it.
    let (Some((first, _)), Some((last, thickest))) = (other.first(), other.last()) else { return 0.0 };
    let centre = nalgebra::center(first, last);
    let around =
        other.iter().map(|(ball, radius)| (ball - centre).norm_squared().sqrt() + radius).fold(*thickest, f64::max);
    let mut cost = 0.0;
    for (a, radius_a) in one {
        if (a - centre).norm_squared() > (around + radius_a) * (around + radius_a) {
            continue;
        }
        for (b, radius_b) in other {
            let least = radius_a + radius_b + MARGIN_M / 2.0;
            let distance2 = (a - b).norm_squared();
            if distance2 < least * least {
                cost += price(least - distance2.sqrt());
            }
        }
    }
    cost
}

fn parts(body: &Body, object_from_body: &Isometry3<f64>) -> Vec<Part> {
    let part = |part: &crate::base::scene::Part| {
        let object_from_part = object_from_body * pose(part.at.map(|at| at.0), part.turned);
        Part {
            part_from_object: object_from_part.inverse(),
            centre: object_from_part.translation.vector.into(),
            shape: part.shape,
        }
    };
    body.parts.iter().map(part).collect()
}

impl Seen {
    /// Signed distance to the surface, m, negative inside.
    fn distance(&self, point: &Point3<f64>) -> f64 {
        let p = self.part_from_palm * point.to_homogeneous();
        match self.shape {
            Shape::Ball(radius) => p.norm() - radius.0,
            Shape::Box([x, y, z]) => {
                let over = Vector3::new(p.x.abs() - x.0 / 2.0, p.y.abs() - y.0 / 2.0, p.z.abs() - z.0 / 2.0);
                let inside = over.max();
                if inside <= 0.0 { inside } else { over.sup(&Vector3::zeros()).norm() }
            }
            Shape::Cylinder([radius, height]) => {
                let (round, flat) = (p.x.hypot(p.y) - radius.0, p.z.abs() - height.0 / 2.0);
                let inside = round.max(flat);
                if inside <= 0.0 { inside } else { round.max(0.0).hypot(flat.max(0.0)) }
            }
        }
    }
}
