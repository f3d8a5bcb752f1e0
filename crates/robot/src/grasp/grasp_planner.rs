//! The planner of grasps: from demonstrated contacts to a grasp of a robot's hand.

use super::candidate::{FingerPlacement, GraspCandidate, Reach, clearest, geometric_mean};
use super::clearance::Shapes;
use super::cost::{Cost, SearchEffort};
use super::friction_margin::friction_margin;
use super::grasp_request::GraspRequest;
use super::no_grasp::NoGrasp;
use super::{search, seeds, spheres, two_finger};
use crate::kinematics::finger::FingerModel;
use crate::kinematics::joint_positions::{JointPositions, REACHED_M};
use crate::model::hand::HandModel;
use crate::parallel;
use nalgebra::{Isometry3, Point3, Vector6};
use teachtree_base::hands::Finger;
use teachtree_command::GraspCriterion;

/// Additional clearance of the search if the exact shapes overlap although its spheres do not, m.
const AWAY_M: [f64; 2] = [0.001, 0.003];
/// Number of the best poses that are tilted, and number of candidates that are kept.
const LEANT: usize = 3;
const CANDIDATES: usize = 40;
/// The minimum distance between candidates, m.
const APART_M: f64 = 0.005;
/// For alternative grasps: number of poses, their minimum distance, m, and steps of improvement.
const SPREAD: usize = 600;
const SPREAD_M: f64 = 0.010;
const IMPROVED: usize = 12;
/// Number of poses that are evaluated together.
const AT_ONCE: usize = 32;
/// Pushing contacts do not determine a pose, and the best poses are alike: poses on the way to them are candidates too.
const PUSHING: [usize; 3] = [IMPROVED, 3, 0];

/// A smaller margin of friction counts like this one, so that grasps of such contacts still differ by their poses.
const LEAST_FRICTION: f64 = 0.05;

/// The exact shapes about a grasp, and the margin of friction of its contacts.
struct CheckedShapes {
    shapes: Shapes,
    friction: f64,
}

/// Data of a hand that are computed once, for all grasps.
#[derive(Clone, Debug)]
pub struct GraspPlanner<'a> {
    hand: &'a HandModel,
    beads: spheres::HandSpheres,
    postures: Vec<seeds::HandPosture>,
    criterion: GraspCriterion,
}

impl<'a> GraspPlanner<'a> {
    /// A planner for a hand, which chooses grasps by their quality.
    pub fn new(hand: &'a HandModel) -> Self {
        Self::with_criterion(hand, GraspCriterion::default())
    }

    /// A planner for a hand, which chooses grasps by this criterion; a gripper has its own.
    pub fn with_criterion(hand: &'a HandModel, criterion: GraspCriterion) -> Self {
        Self { hand, beads: spheres::HandSpheres::new(hand), postures: seeds::postures(hand), criterion }
    }

    /// The criterion by which it chooses.
    pub fn criterion(&self) -> GraspCriterion {
        self.criterion
    }

    fn cost_of(&self, request: &GraspRequest<'_>) -> Result<Cost<'_>, NoGrasp> {
        Cost::new(self.hand, &self.beads, request, self.criterion)
    }

    fn shapes(&self, request: &GraspRequest<'_>) -> CheckedShapes {
        CheckedShapes { shapes: Shapes::new(self.hand, request), friction: friction_margin(&request.contacts) }
    }

    /// The hand.
    pub fn hand(&self) -> &HandModel {
        self.hand
    }

    /// Finds the best pose of the palm.
    ///
    /// # Errors
    /// The finger that cannot reach, with the missing distance, or the obstacle, at the best pose.
    pub fn map(&self, request: &GraspRequest<'_>) -> Result<GraspCandidate, NoGrasp> {
        self.map_where(request, &|_| Some(0)).map(|(_, found)| found)
    }

    /// Like [`Self::map`], among palm poses, frame of the object, that an arm can reach; poses without collisions are preferred. Also returns the number of places with
    /// collisions.
    ///
    /// # Errors
    /// As [`Self::map`].
    pub fn map_where(&self, request: &GraspRequest<'_>, reach: &Reach<'_>) -> Result<(usize, GraspCandidate), NoGrasp> {
        match &self.hand.jaws {
            Some(jaws) => two_finger::best(self.hand, jaws, request, reach),
            None => self.search(&mut self.cost_of(request)?, request, reach),
        }
    }

    /// Like [`Self::map`], with the number of evaluations.
    ///
    /// # Errors
    /// A finger that the hand does not have.
    pub fn map_counted(
        &self,
        request: &GraspRequest<'_>,
    ) -> Result<(Result<GraspCandidate, NoGrasp>, SearchEffort), NoGrasp> {
        let mut cost = self.cost_of(request)?;
        let found = self.search(&mut cost, request, &|_| Some(0)).map(|(_, found)| found);
        Ok((found, cost.effort()))
    }

    /// Returns the cost of a pose of the palm in the search, and its gradient by a translation along x, y and z of the object's frame (1/m) and a rotation about them
    /// through the object's origin (1/rad).
    ///
    /// # Errors
    /// A finger that the hand does not have.
    pub fn cost(
        &self,
        request: &GraspRequest<'_>,
        object_from_palm: &Isometry3<f64>,
    ) -> Result<(f64, Vector6<f64>), NoGrasp> {
        Ok(self.cost_of(request)?.with_slope(object_from_palm, &Point3::origin()))
    }

    fn search(
        &self,
        cost: &mut Cost<'_>,
        request: &GraspRequest<'_>,
        reach: &Reach<'_>,
    ) -> Result<(usize, GraspCandidate), NoGrasp> {
        let shapes = self.shapes(request);
        let mut failure = None;
        for wide in [false, true] {
            let poses = search::best_poses(cost, &seeds::starts(self.hand, &self.postures, request, wide));
            let reached = poses.into_iter().filter_map(|pose| {
                let mut found = self.check(&pose, cost, &shapes);
                for away in AWAY_M {
                    if matches!(found, Err(NoGrasp::InTheWay(..))) {
                        cost.keep_away(away);
                        found = self.check(&search::polished(cost, &pose), cost, &shapes);
                    }
                }
                cost.keep_away(0.0);
                let why = match found {
                    Ok(grasp) => match reach(&grasp) {
                        Some(met) => return Some((met, grasp)),
                        None => NoGrasp::ArmOutOfReach,
                    },
                    Err(why) => why,
                };
                failure.get_or_insert(why);
                None
            });
            if let Some(found) = clearest(reached) {
                return Ok(found);
            }
        }
        Err(failure.unwrap_or(NoGrasp::ArmOutOfReach))
    }

    /// Returns the grasp at a given pose of the palm, if the pose is feasible.
    ///
    /// # Errors
    /// The reason why the pose is not feasible.
    pub fn at(&self, request: &GraspRequest<'_>, object_from_palm: &Isometry3<f64>) -> Result<GraspCandidate, NoGrasp> {
        self.check(object_from_palm, &self.cost_of(request)?, &self.shapes(request))
    }

    /// Improves a pose locally.
    ///
    /// # Errors
    /// The reason why the improved pose is not feasible.
    pub fn polish(
        &self,
        request: &GraspRequest<'_>,
        object_from_palm: &Isometry3<f64>,
    ) -> Result<GraspCandidate, NoGrasp> {
        let cost = self.cost_of(request)?;
        let pose = search::polished(&cost, object_from_palm);
        self.check(&pose, &cost, &self.shapes(request))
    }

    /// Searches without start poses, by differential evolution: the slow reference for tests. `chance` returns random numbers from 0 to 1.
    ///
    /// # Errors
    /// The reason why the best pose is not feasible.
    pub fn search_everywhere(
        &self,
        request: &GraspRequest<'_>,
        generations: usize,
        chance: &mut dyn FnMut() -> f64,
    ) -> Result<GraspCandidate, NoGrasp> {
        let cost = self.cost_of(request)?;
        let pose = search::everywhere(&cost, generations, chance);
        self.check(&pose, &cost, &self.shapes(request))
    }

    /// Returns start poses of the palm for searches in which another hand moves too, cheapest first, feasible or not: the results of a search, and the best ones tilted
    /// to all sides.
    ///
    /// # Errors
    /// A finger that the hand does not have.
    pub fn candidates(&self, request: &GraspRequest<'_>) -> Result<Vec<Isometry3<f64>>, NoGrasp> {
        let cost = self.cost_of(request)?;
        let mut poses = search::best_poses(&cost, &seeds::starts(self.hand, &self.postures, request, false));
        let leant: Vec<Isometry3<f64>> =
            poses.iter().take(LEANT).flat_map(|pose| search::leant(&cost, request, pose)).collect();
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

    /// Returns grasps that differ from each other, whether or not an arm can reach them.
    ///
    /// # Errors
    /// A finger that the hand does not have, contacts that jaws cannot take.
    pub(super) fn grasps(&self, request: &GraspRequest<'_>) -> Result<Vec<GraspCandidate>, NoGrasp> {
        if let Some(jaws) = &self.hand.jaws {
            return two_finger::all(self.hand, jaws, request);
        }
        let cost = || {
            let mut cost = self.cost_of(request)?;
            cost.keep_away(AWAY_M[0]);
            Ok(cost)
        };
        let shapes = self.shapes(request);
        let starts = seeds::starts(self.hand, &self.postures, request, true);
        let spread = search::spread(&cost()?, &starts, SPREAD, SPREAD_M);
        let pushes = request.contacts.iter().all(|contact| contact.finger != Finger::Thumb);
        let steps = if pushes { &PUSHING[..] } else { &[IMPROVED] };
        let improved = |poses: &&[Isometry3<f64>]| -> Result<Vec<GraspCandidate>, NoGrasp> {
            let cost = cost()?;
            let pairs = poses.iter().flat_map(|pose| steps.iter().map(move |steps| (pose, *steps)));
            let improved = pairs.map(|(pose, steps)| search::improved(&cost, pose, steps).1);
            Ok(improved.filter_map(|pose| self.check(&pose, &cost, &shapes).ok()).collect())
        };
        let parts: Vec<&[Isometry3<f64>]> = spread.chunks(AT_ONCE).collect();
        let grasps: Result<Vec<Vec<GraspCandidate>>, NoGrasp> = parallel::each(&parts, improved).into_iter().collect();
        Ok(grasps?.into_iter().flatten().collect())
    }

    /// Improves a pose by a number of steps; returns it with its cost: the measure, violations, and clearances that are too small.
    ///
    /// # Errors
    /// A finger that the hand does not have.
    pub fn improved(
        &self,
        request: &GraspRequest<'_>,
        pose: &Isometry3<f64>,
        steps: usize,
    ) -> Result<(f64, Isometry3<f64>), NoGrasp> {
        let mut cost = self.cost_of(request)?;
        cost.keep_away(AWAY_M[1]);
        Ok(search::improved(&cost, pose, steps))
    }

    /// Returns the angles of every finger at a pose: at its contact or as near as possible, or out of the way.
    ///
    /// # Errors
    /// A finger that the hand does not have.
    pub fn angles(
        &self,
        request: &GraspRequest<'_>,
        pose: &Isometry3<f64>,
    ) -> Result<Vec<(Finger, JointPositions)>, NoGrasp> {
        let cost = self.cost_of(request)?;
        let touching = cost.fingers(pose).into_iter().map(|held| (held.finger, held.angles));
        Ok(touching.chain(cost.idle(pose)).collect())
    }

    /// Returns the measure of the pose that copies the demonstrated one: the hand half closed in the middle of its ranges, over the demonstrated contacts. The search
    /// is compared with it. `None` if the fingers do not reach, and for a gripper, which does not copy a hand.
    pub fn copied(&self, request: &GraspRequest<'_>) -> Option<f64> {
        if self.hand.jaws.is_some() {
            return None;
        }
        self.measure(request, &seeds::laid_over(self.hand, request)?)
    }

    /// Returns the measure of a pose of the palm without regard to obstacles; `None` if the fingers do not reach.
    pub fn measure(&self, request: &GraspRequest<'_>, object_from_palm: &Isometry3<f64>) -> Option<f64> {
        let fingers = self.cost_of(request).ok()?.fingers(object_from_palm);
        let reached = fingers.iter().all(|held| held.miss < REACHED_M);
        reached.then(|| self.quality(&fingers, friction_margin(&request.contacts)))
    }

    /// Returns the measure of fingers at contacts with this margin of friction. Contacts that push, or whose measured points cannot hold, have a measure too.
    fn quality(&self, fingers: &[FingerPlacement], friction: f64) -> f64 {
        let opposed = fingers.iter().any(|held| held.finger == Finger::Thumb) && fingers.len() > 1;
        let factor = match self.criterion {
            GraspCriterion::Quality if opposed => friction.max(LEAST_FRICTION),
            _ => 1.0,
        };
        geometric_mean(fingers, self.criterion) * factor
    }

    fn check(
        &self,
        pose: &Isometry3<f64>,
        cost: &Cost<'_>,
        checked: &CheckedShapes,
    ) -> Result<GraspCandidate, NoGrasp> {
        let fingers = cost.fingers(pose);
        let farthest = fingers.iter().max_by(|a, b| a.miss.total_cmp(&b.miss));
        if let Some(held) = farthest.filter(|held| held.miss >= REACHED_M) {
            return Err(NoGrasp::OutOfReach(held.finger, cost.ik_residual(pose, held.finger)));
        }
        if let Some(held) = fingers.iter().find(|held| held.pad_angle > cost.largest_pad_angle + 1e-3) {
            return Err(NoGrasp::PadTurnedAway(held.finger, held.pad_angle));
        }
        let idle = cost.idle(pose);
        let all: Vec<(&FingerModel, JointPositions)> = self
            .hand
            .fingers
            .iter()
            .filter_map(|model| {
                let touching = fingers.iter().find(|held| held.finger == model.finger).map(|held| held.angles);
                let angles = touching.or_else(|| idle.iter().find(|(it, _)| *it == model.finger).map(|(_, it)| *it))?;
                Some((model, angles))
            })
            .collect();
        let clearance = checked.shapes.clearance(pose, &all);
        if let Some((overlap, who)) = clearance.worst_overlap() {
            return Err(NoGrasp::InTheWay(overlap, who));
        }
        Ok(GraspCandidate {
            object_from_palm: *pose,
            measure: self.quality(&fingers, checked.friction),
            friction_margin: checked.friction,
            fingers,
            idle,
            opening: None,
            clearance,
        })
    }
}
