//! Two hands on one object: if the best grasp of one leaves no room for the other, both grasps are changed.
//!
//! Pairs of poses that are good for one hand each are tried, those with the least penetration first. The pose of one hand after the other is then improved by
//! gradient descent with the other hand as an obstacle, until both are grasps.

use super::candidate::{GraspCandidate, Reach};
use super::grasp_planner::GraspPlanner;
use super::grasp_request::{GraspRequest, Obstacle};
use super::hand_obstacles::body;
use crate::kinematics::joint_positions::JointPositions;
use crate::model::hand::HandModel;
use nalgebra::Isometry3;
use teachtree_base::hands::Finger;
use teachtree_base::scene::Body;

/// Number of pairs that are improved, rounds of each, and steps of each hand in a round.
const PAIRS: usize = 24;
const ROUNDS: usize = 5;
const STEPS: usize = 25;

/// One of the two hands, with its request.
pub(crate) struct HandProblem<'a> {
    pub(crate) hand: &'a HandModel,
    pub(crate) planner: &'a GraspPlanner<'a>,
    pub(crate) request: &'a GraspRequest<'a>,
    /// The grasps that the arm can carry along the path of the object.
    pub(crate) reach: &'a Reach<'a>,
}

/// Grasps of two hands that leave room for each other, with the fewest collisions of hands and arms on the path of the object.
pub(crate) fn grasp_pair([one, other]: [&HandProblem<'_>; 2]) -> Option<[GraspCandidate; 2]> {
    let (of_one, of_other) = (one.planner.candidates(one.request).ok()?, other.planner.candidates(other.request).ok()?);
    let mut pairs: Vec<(f64, Isometry3<f64>, Isometry3<f64>)> = Vec::new();
    for first in &of_one {
        let (own, _) = one.planner.improved(one.request, first, 0).ok()?;
        let there = one.as_obstacle(first)?;
        for second in &of_other {
            let (cost, _) = other.planner.improved(&other.around(&there), second, 0).ok()?;
            pairs.push((own + cost, *first, *second));
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best: Option<(usize, [GraspCandidate; 2])> = None;
    for (_, first, second) in pairs.into_iter().take(PAIRS) {
        let Some((met, pair)) = give_way([one, other], [first, second]) else { continue };
        if best.as_ref().is_none_or(|(least, _)| met < *least) {
            best = Some((met, pair));
        }
        if met == 0 {
            break;
        }
    }
    best.map(|(_, pair)| pair)
}

/// Improves a pair of poses in turns. Returns the first pair that leaves room, with its number of collisions.
fn give_way(
    [one, other]: [&HandProblem<'_>; 2],
    [mut first, mut second]: [Isometry3<f64>; 2],
) -> Option<(usize, [GraspCandidate; 2])> {
    for _ in 0..ROUNDS {
        let there = one.as_obstacle(&first)?;
        (_, second) = other.planner.improved(&other.around(&there), &second, STEPS).ok()?;
        let there = other.as_obstacle(&second)?;
        (_, first) = one.planner.improved(&one.around(&there), &first, STEPS).ok()?;
        let there = one.as_obstacle(&first)?;
        let (held, beside) = (one.planner.at(one.request, &first), other.planner.at(&other.around(&there), &second));
        if let (Ok(held), Ok(beside)) = (held, beside)
            && let Some(met) = (one.reach)(&held)
            && let Some(met_beside) = (other.reach)(&beside)
        {
            return Some((met + met_beside, [held, beside]));
        }
    }
    None
}

impl HandProblem<'_> {
    /// Returns the hand at a pose as an obstacle.
    fn as_obstacle(&self, pose: &Isometry3<f64>) -> Option<Body> {
        let angles: Vec<(Finger, JointPositions)> = self.planner.angles(self.request, pose).ok()?;
        Some(body(self.hand, pose, &angles))
    }

    /// Returns the request with another hand as an obstacle.
    fn around<'b>(&'b self, there: &'b Body) -> GraspRequest<'b> {
        let mut request: GraspRequest<'b> = self.request.clone();
        request.obstacles.push(Obstacle { object_from_obstacle: Isometry3::identity(), body: there });
        request
    }
}
