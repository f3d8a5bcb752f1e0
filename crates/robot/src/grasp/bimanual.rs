//! Two hands on one object: when the best grasp of one leaves no room for the other, both give way.
//!
//! Pairs of poses that are good for one hand each are looked at, those that are least in each other's way first; then one hand after the other goes
//! down its own slope with the other one in the way, until both are grasps.

use super::candidate::{GraspCandidate, Reach};
use super::hand_obstacles::body;
use super::mapper::Mapper;
use super::problem::{Obstacle, Wanted};
use crate::kinematics::joint_positions::JointPositions;
use crate::model::hand::HandModel;
use nalgebra::Isometry3;
use teachtree_base::hands::Finger;
use teachtree_base::scene::Body;

/// So many pairs are improved, so many times, by so many steps of each hand.
const PAIRS: usize = 24;
const ROUNDS: usize = 5;
const STEPS: usize = 25;

/// One of the two hands, and what it wants to hold.
pub(crate) struct One<'a> {
    pub(crate) hand: &'a HandModel,
    pub(crate) mapper: &'a Mapper<'a>,
    pub(crate) wanted: &'a Wanted<'a>,
    /// Where the arm can bring the palm.
    pub(crate) reach: &'a Reach<'a>,
}

/// Grasps of two hands that leave room for each other.
pub(crate) fn both([one, other]: [&One<'_>; 2]) -> Option<[GraspCandidate; 2]> {
    let (of_one, of_other) = (one.mapper.candidates(one.wanted).ok()?, other.mapper.candidates(other.wanted).ok()?);
    let mut pairs: Vec<(f64, Isometry3<f64>, Isometry3<f64>)> = Vec::new();
    for first in &of_one {
        let (own, _) = one.mapper.improved(one.wanted, first, 0).ok()?;
        let there = one.there(first)?;
        for second in &of_other {
            let (cost, _) = other.mapper.improved(&other.around(&there), second, 0).ok()?;
            pairs.push((own + cost, *first, *second));
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    pairs.into_iter().take(PAIRS).find_map(|(_, first, second)| give_way([one, other], [first, second]))
}

/// Improves a pair of poses in turns.
fn give_way([one, other]: [&One<'_>; 2], [mut first, mut second]: [Isometry3<f64>; 2]) -> Option<[GraspCandidate; 2]> {
    for _ in 0..ROUNDS {
        let there = one.there(&first)?;
        (_, second) = other.mapper.improved(&other.around(&there), &second, STEPS).ok()?;
        let there = other.there(&second)?;
        (_, first) = one.mapper.improved(&one.around(&there), &first, STEPS).ok()?;
        let there = one.there(&first)?;
        let (held, beside) = (one.mapper.at(one.wanted, &first), other.mapper.at(&other.around(&there), &second));
        if let (Ok(held), Ok(beside)) = (held, beside)
            && (one.reach)(&first).is_some()
            && (other.reach)(&second).is_some()
        {
            return Some([held, beside]);
        }
    }
    None
}

impl One<'_> {
    /// The hand at a pose, as something that is in the way.
    fn there(&self, pose: &Isometry3<f64>) -> Option<Body> {
        let angles: Vec<(Finger, JointPositions)> = self.mapper.angles(self.wanted, pose).ok()?;
        Some(body(self.hand, pose, &angles))
    }

    /// What it wants with another hand in the way.
    fn around<'b>(&'b self, there: &'b Body) -> Wanted<'b> {
        let mut wanted: Wanted<'b> = self.wanted.clone();
        wanted.obstacles.push(Obstacle { object_from_obstacle: Isometry3::identity(), body: there });
        wanted
    }
}
