//! Grasp mapping: taught contact points in, palm pose and finger angles of a robot hand out.
//!
//! Over the pose of the palm in the frame of the object, the geometric mean of the fingers' measures is made as large as possible
//! (docs/sources.md, Grasp mapping; the chapter's section 2.6 only says that the pose maximises manipulability at the taught contact points):
//!
//! ```text
//! W(T) = (Π_i w_i / L_i³ · p_i)^(1/n)        w: Yoshikawa's manipulability, L: length of the finger, p: freedom from joint limits
//! ```
//!
//! with every fingertip ball touching its contact point. Hand, object and obstacles must be clear of each other, fingers uncrossed and pads
//! turned to the surface; what is violated costs its square, and what is out of reach costs its distance, so that the search has a slope
//! everywhere. At the end all of it is checked on the exact shapes. A gripper, whose jaws have no manipulability, is mapped in closed form (`pinch`).

mod beads;
mod clearance;
mod cost;
mod pinch;
mod search;
mod slope;
mod starts;
mod surroundings;

pub use clearance::Clearance;

use super::hand::{Angles, FingerModel, HandModel, MAX_DOFS, REACHED_M};
use crate::base::hands::Finger;
use crate::base::scene::Body;
use crate::command::FRICTION;
use clearance::Shapes;
use cost::Cost;
use nalgebra::{Isometry3, Point3, Vector3, Vector6};

/// A pad that grasps may look past the surface normal by this angle, rad (80 degrees).
pub const LARGEST_PAD_ANGLE: f64 = 80.0 * std::f64::consts::PI / 180.0;
/// One that only pushes by this one, rad (95 degrees: the end of the finger).
pub const LARGEST_PUSHING_ANGLE: f64 = 95.0 * std::f64::consts::PI / 180.0;
/// Where the exact shapes overlap although the balls of the search do not, the search goes on this much farther away, m.
const AWAY_M: [f64; 2] = [0.001, 0.003];
/// So many of the best poses are leant over, and so many candidates are kept.
const LEANT: usize = 3;
const CANDIDATES: usize = 40;
/// These differ by more than this, m.
const APART_M: f64 = 0.005;
/// Shapes are clear of each other when they overlap by no more than this, m.
pub const CLEAR_M: f64 = 1e-4;

/// Where one finger touched the object; object frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Which finger.
    pub finger: Finger,
    /// The point of the object's surface.
    pub point: Point3<f64>,
    /// Unit normal out of the object.
    pub normal: Vector3<f64>,
}

/// A body that the hand must not touch, and where it is.
#[derive(Clone, Debug)]
pub struct Obstacle<'a> {
    /// The pose in the frame of the object.
    pub object_from_obstacle: Isometry3<f64>,
    /// Its shape.
    pub body: &'a Body,
}

/// What is to be held, and where.
#[derive(Clone, Debug)]
pub struct Wanted<'a> {
    /// The taught contacts, at most one a finger.
    pub contacts: Vec<Contact>,
    /// The object.
    pub object: &'a Body,
    /// What else is there while it is held.
    pub obstacles: Vec<Obstacle<'a>>,
}

/// How often a search looked at a pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effort {
    /// The cost of a pose.
    pub costs: u64,
    /// The cost and its slope.
    pub slopes: u64,
    /// Only what the fingers miss, and a step that brings them nearer.
    pub fits: u64,
}

/// A palm pose with the fingers on their contacts.
#[derive(Clone, Debug, PartialEq)]
pub struct Grasp {
    /// The pose of the palm in the frame of the object.
    pub object_from_palm: Isometry3<f64>,
    /// W; of a gripper what `pinch` says.
    pub measure: f64,
    /// The fingers that touch, in the order of the contacts.
    pub fingers: Vec<Held>,
    /// Angles of the fingers that do not touch.
    pub idle: Vec<(Finger, Angles)>,
    /// How far the jaws of a gripper are open, m.
    pub opening: Option<f64>,
    /// The gaps, on the exact shapes.
    pub clearance: Clearance,
}

/// A finger on its contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held {
    /// Which finger.
    pub finger: Finger,
    /// Its angles, in the order of its degrees of freedom.
    pub angles: Angles,
    /// `w / L³`; nothing for a jaw.
    pub manipulability: f64,
    /// Freedom from joint limits, 0 to 1.
    pub freedom: f64,
    /// Angle between the way its pad looks and the way into the surface, rad.
    pub pad_angle: f64,
    /// How far its tip stays away from the contact, m.
    pub miss: f64,
}

/// Why there is no grasp.
#[derive(Clone, Debug, PartialEq)]
pub enum Failure {
    /// The hand has no such finger.
    Lacks(Finger),
    /// Of the best pose, the finger that stays farthest from its contact, and how far, m.
    OutOfReach(Finger, f64),
    /// Every finger reaches, but hand, object, obstacles and fingers are not clear of each other: the worst overlap, m, and between whom.
    InTheWay(f64, String),
    /// The arm cannot bring the palm to any pose that was found.
    ArmOutOfReach,
    /// Every finger reaches, but a pad looks away from the surface: by this angle, rad.
    PadTurnedAway(Finger, f64),
    /// Nothing touches against the thumb, or no thumb against what touches: there is nothing to be held between jaws.
    OneSided,
    /// Jaws do not open as far as they must: so far, m, and at most as far.
    TooWide(f64, f64),
    /// Jaws do not close as far as they must: so far, m, and at least as far.
    TooNarrow(f64, f64),
    /// The line between the jaws leans from the surface at one of them by this angle, rad, and friction does not hold it there.
    SlipsOff(Finger, f64),
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Lacks(finger) => write!(f, "the hand has no {finger} finger"),
            Self::OutOfReach(finger, miss) => {
                write!(f, "{finger} cannot reach its contact: {:.1} mm are missing", miss * 1e3)
            }
            Self::InTheWay(overlap, who) => write!(f, "{who} are in each other's way by {:.1} mm", overlap * 1e3),
            Self::ArmOutOfReach => f.write_str("the arm cannot bring the palm there"),
            Self::PadTurnedAway(finger, angle) => {
                write!(f, "the pad of {finger} looks {:.0} degrees past the surface", angle.to_degrees())
            }
            Self::OneSided => f.write_str(
                "a gripper holds between thumb and fingers, and here only one side touches: it does not push",
            ),
            Self::TooWide(wanted, most) => {
                let [wanted, most] = [wanted, most].map(|opening| opening * 1e3);
                let missing = wanted - most;
                write!(f, "the jaws open to {most:.1} mm, and {wanted:.1} mm are wanted: {missing:.1} mm are missing")
            }
            Self::TooNarrow(wanted, least) => {
                let [wanted, least] = [wanted, least].map(|opening| opening * 1e3);
                let over = least - wanted;
                write!(f, "the jaws close to {least:.1} mm, and {wanted:.1} mm are wanted: {over:.1} mm remain open")
            }
            Self::SlipsOff(finger, angle) => {
                let [angle, most] = [*angle, FRICTION.atan()].map(|angle| angle.to_degrees().round());
                write!(
                    f,
                    "the {finger} jaw slips off: the line between the jaws leans by {angle} degrees there, and friction holds up to {most}"
                )
            }
        }
    }
}

/// What is known of a hand before any grasp: made once, used for all.
#[derive(Clone, Debug)]
pub struct Mapper<'a> {
    hand: &'a HandModel,
    beads: beads::HandBeads,
    postures: Vec<starts::Posing>,
}

impl<'a> Mapper<'a> {
    /// The mapper of a hand.
    pub fn new(hand: &'a HandModel) -> Self {
        Self { hand, beads: beads::HandBeads::new(hand), postures: starts::postures(hand) }
    }

    /// The hand.
    pub fn hand(&self) -> &HandModel {
        self.hand
    }

    /// Finds the best pose of the palm.
    ///
    /// # Errors
    /// Which finger cannot reach and by how much, or what is in the way, at the best pose that was found.
    pub fn map(&self, wanted: &Wanted<'_>) -> Result<Grasp, Failure> {
        self.map_where(wanted, &|_| true)
    }

    /// The same among poses of the palm, frame of the object, that an arm can bring it to.
    ///
    /// # Errors
    /// As [`Self::map`].
    pub fn map_where(
        &self,
        wanted: &Wanted<'_>,
        reachable: &dyn Fn(&Isometry3<f64>) -> bool,
    ) -> Result<Grasp, Failure> {
        match &self.hand.jaws {
            Some(jaws) => pinch::best(self.hand, jaws, wanted, reachable),
            None => self.search(&mut Cost::new(self, wanted)?, wanted, reachable),
        }
    }

    /// The same as [`Self::map`], and what it took.
    ///
    /// # Errors
    /// A finger that the hand does not have.
    pub fn map_counted(&self, wanted: &Wanted<'_>) -> Result<(Result<Grasp, Failure>, Effort), Failure> {
        let mut cost = Cost::new(self, wanted)?;
        let found = self.search(&mut cost, wanted, &|_| true);
        Ok((found, cost.effort()))
    }

    /// What a pose of the palm costs a search, and how that changes with a shift of the palm along x, y and z of the object's frame, a metre, and with
    /// a turn about them through the object's origin, a rad.
    ///
    /// # Errors
    /// A finger that the hand does not have.
    pub fn cost(&self, wanted: &Wanted<'_>, object_from_palm: &Isometry3<f64>) -> Result<(f64, Vector6<f64>), Failure> {
        Ok(Cost::new(self, wanted)?.with_slope(object_from_palm, &Point3::origin()))
    }

    fn search(
        &self,
        cost: &mut Cost<'_>,
        wanted: &Wanted<'_>,
        reachable: &dyn Fn(&Isometry3<f64>) -> bool,
    ) -> Result<Grasp, Failure> {
        let shapes = Shapes::new(self.hand, wanted);
        let mut failure = None;
        for wide in [false, true] {
            for pose in search::best_poses(cost, &starts::starts(self, wanted, wide)) {
                let mut found = self.check(&pose, cost, &shapes);
                for away in AWAY_M {
                    if matches!(found, Err(Failure::InTheWay(..))) {
                        cost.keep_away(away);
                        found = self.check(&search::polished(cost, &pose), cost, &shapes);
                    }
                }
                cost.keep_away(0.0);
                match found {
                    Ok(grasp) if reachable(&grasp.object_from_palm) => return Ok(grasp),
                    Ok(_) => {
                        failure.get_or_insert(Failure::ArmOutOfReach);
                    }
                    Err(found) => {
                        failure.get_or_insert(found);
                    }
                }
            }
        }
        Err(failure.unwrap_or(Failure::ArmOutOfReach))
    }

    /// The grasp at a given pose of the palm, when it is one.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn at(&self, wanted: &Wanted<'_>, object_from_palm: &Isometry3<f64>) -> Result<Grasp, Failure> {
        self.check(object_from_palm, &Cost::new(self, wanted)?, &Shapes::new(self.hand, wanted))
    }

    /// Improves a pose that is near a good one, without looking elsewhere.
    ///
    /// # Errors
    /// What is wrong with the pose that was found.
    pub fn polish(&self, wanted: &Wanted<'_>, object_from_palm: &Isometry3<f64>) -> Result<Grasp, Failure> {
        let cost = Cost::new(self, wanted)?;
        let pose = search::polished(&cost, object_from_palm);
        self.check(&pose, &cost, &Shapes::new(self.hand, wanted))
    }

    /// A long search that knows nothing of where to begin, by differential evolution: the reference for tests. `chance` gives numbers
    /// from 0 to 1.
    ///
    /// # Errors
    /// What is wrong with the best pose that was found.
    pub fn search_everywhere(
        &self,
        wanted: &Wanted<'_>,
        generations: usize,
        chance: &mut dyn FnMut() -> f64,
    ) -> Result<Grasp, Failure> {
        let cost = Cost::new(self, wanted)?;
        let pose = search::everywhere(&cost, generations, chance);
        self.check(&pose, &cost, &Shapes::new(self.hand, wanted))
    }

    /// Poses of the palm to begin with when something else moves as well, cheapest first, whether or not they are grasps: where a search ends, and the
    /// best of those leant over to all sides.
    ///
    /// # Errors
    /// A finger that the hand does not have.
    pub fn candidates(&self, wanted: &Wanted<'_>) -> Result<Vec<Isometry3<f64>>, Failure> {
        let cost = Cost::new(self, wanted)?;
        let mut poses = search::best_poses(&cost, &starts::starts(self, wanted, false));
        let leant: Vec<Isometry3<f64>> =
            poses.iter().take(LEANT).flat_map(|pose| search::leant(&cost, wanted, pose)).collect();
        poses.extend(leant);
        let mut ranked: Vec<(f64, Isometry3<f64>)> = poses.into_iter().map(|pose| (cost.of(&pose), pose)).collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut kept: Vec<Isometry3<f64>> = Vec::new();
        for (_, pose) in ranked {
            if kept.len() < CANDIDATES && kept.iter().all(|other| search::apart(&pose, other) > APART_M) {
                kept.push(pose);
            }
        }
        Ok(kept)
    }

    /// A pose after so many steps of improvement, and what it costs: the measure, and whatever is violated or not well clear.
    ///
    /// # Errors
    /// A finger that the hand does not have.
    pub fn improved(
        &self,
        wanted: &Wanted<'_>,
        pose: &Isometry3<f64>,
        steps: usize,
    ) -> Result<(f64, Isometry3<f64>), Failure> {
        let mut cost = Cost::new(self, wanted)?;
        cost.keep_away(AWAY_M[1]);
        Ok(search::improved(&cost, pose, steps))
    }

    /// The angles of every finger at a pose: on its contact or as near as it comes, or out of the way.
    ///
    /// # Errors
    /// A finger that the hand does not have.
    pub fn angles(&self, wanted: &Wanted<'_>, pose: &Isometry3<f64>) -> Result<Vec<(Finger, Angles)>, Failure> {
        let cost = Cost::new(self, wanted)?;
        let touching = cost.fingers(pose).into_iter().map(|held| (held.finger, held.angles));
        Ok(touching.chain(cost.idle(pose)).collect())
    }

    /// The pose that copies the person's: the hand half closed in the middle of its ranges, laid over the taught contacts. What it is
    /// worth without any search is what the search is compared with; `None` where the fingers do not reach, and for a gripper, which is no copy of a hand.
    pub fn copied(&self, wanted: &Wanted<'_>) -> Option<f64> {
        if self.hand.jaws.is_some() {
            return None;
        }
        self.measure(wanted, &starts::laid_over(self, wanted)?)
    }

    /// The measure of a pose of the palm, whether or not something is in the way; `None` where the fingers do not reach.
    pub fn measure(&self, wanted: &Wanted<'_>, object_from_palm: &Isometry3<f64>) -> Option<f64> {
        let fingers = Cost::new(self, wanted).ok()?.fingers(object_from_palm);
        let reached = fingers.iter().all(|held| held.miss < REACHED_M);
        reached.then(|| geometric_mean(&fingers))
    }

    fn check(&self, pose: &Isometry3<f64>, cost: &Cost<'_>, shapes: &Shapes) -> Result<Grasp, Failure> {
        let fingers = cost.fingers(pose);
        let farthest = fingers.iter().max_by(|a, b| a.miss.total_cmp(&b.miss));
        if let Some(held) = farthest.filter(|held| held.miss >= REACHED_M) {
            return Err(Failure::OutOfReach(held.finger, cost.miss(pose, held.finger)));
        }
        if let Some(held) = fingers.iter().find(|held| held.pad_angle > cost.largest_pad_angle + 1e-3) {
            return Err(Failure::PadTurnedAway(held.finger, held.pad_angle));
        }
        let idle = cost.idle(pose);
        let all: Vec<(&FingerModel, Angles)> = self
            .hand
            .fingers
            .iter()
            .filter_map(|model| {
                let touching = fingers.iter().find(|held| held.finger == model.finger).map(|held| held.angles);
                let angles = touching.or_else(|| idle.iter().find(|(it, _)| *it == model.finger).map(|(_, it)| *it))?;
                Some((model, angles))
            })
            .collect();
        let clearance = shapes.clearance(pose, &all);
        if let Some((overlap, who)) = clearance.worst_overlap() {
            return Err(Failure::InTheWay(overlap, who));
        }
        Ok(Grasp {
            object_from_palm: *pose,
            measure: geometric_mean(&fingers),
            fingers,
            idle,
            opening: None,
            clearance,
        })
    }
}

impl Grasp {
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
}

impl Held {
    /// The measure of this finger.
    pub fn measure(&self) -> f64 {
        self.manipulability * self.freedom
    }
}

fn geometric_mean(fingers: &[Held]) -> f64 {
    let product: f64 = fingers.iter().map(Held::measure).product();
    product.powf(1.0 / fingers.len().max(1) as f64)
}

/// Angles where there are none.
const NO_ANGLES: Angles = [0.0; MAX_DOFS];
