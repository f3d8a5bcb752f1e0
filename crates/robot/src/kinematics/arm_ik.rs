//! The arm's inverse kinematics: for a pose of the palm, and along a path.

use super::surroundings::{ArmLinks, Surroundings};
use nalgebra::{Isometry3, Matrix6, Vector6};
use teachtree_description::tree::KinematicTree;

/// The damping of the steps near singularities, and the maximum step of a joint, rad or m.
const DAMPING: f64 = 1e-5;
const STEP: f64 = 0.2;
/// The accepted error along a path. It admits a path on which a joint just reaches its limit.
const REACHED: PoseError = PoseError { m: 1e-3, rad: 1e-2 };
/// The maximum error of an exactly reached pose, m and rad.
const EXACT: f64 = 1e-7;
/// A joint within this distance (rad or m) of its limit counts as at the limit.
const AT_LIMIT: f64 = 1e-3;
/// Postures that differ by less are the same, rad or m.
const SAME: f64 = 1e-4;
/// The search for a pose ends after this many iterations without a decrease of the error to the share `PROGRESS`: a joint is at its limit.
const STALLED: usize = 15;
const PROGRESS: f64 = 0.99;
/// Irrational increments distribute the start postures evenly.
const STEPS: [f64; 6] = [0.618_034, 0.754_878, 0.569_840, 0.430_160, 0.819_173, 0.671_044];
/// Number of iterations from one pose of a path to the next.
const FOLLOWING: usize = 12;

/// An arm: a palm on a tree of links and the degrees of freedom that move it.
#[derive(Clone, Copy, Debug)]
pub struct Arm<'a> {
    /// The links and joints.
    pub tree: &'a KinematicTree,
    /// Index of the palm's link.
    pub palm: usize,
    /// The degrees of freedom between the root and the palm.
    pub dofs: &'a [usize],
}

/// A posture from which an arm can move its palm along a path.
#[derive(Clone, Debug)]
pub struct PathPosture {
    /// The values of all degrees of freedom.
    pub q: Vec<f64>,
    /// Number of poses of the path at which its links collide with the surroundings or each other.
    pub met: usize,
    /// The largest distance of a joint from the middle of its range over all poses, 1 at a limit.
    pub off_middle: f64,
}

/// The pose at which an arm fails to follow a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathFailure {
    /// Index of the first pose of the path that the palm does not reach.
    pub pose: usize,
    /// The remaining error of the palm pose.
    pub missing: PoseError,
    /// The degree of freedom that is at its limit at this pose, if any.
    pub at_limit: Option<usize>,
}

/// The error between two poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseError {
    /// The distance of the origins, m.
    pub m: f64,
    /// The angle between them, rad.
    pub rad: f64,
}

impl PoseError {
    /// Whether both parts are at most those of `most`.
    pub fn is_within(&self, most: &Self) -> bool {
        self.m <= most.m && self.rad <= most.rad
    }
}

impl Arm<'_> {
    /// Moves the palm to a pose by damped least squares and returns the remaining error. `q` has the start values of all degrees of freedom; only those of the
    /// arm change. `root` is the pose of the root; both poses are in the reference frame.
    pub fn inverse_kinematics(
        &self,
        root: &Isometry3<f64>,
        palm: &Isometry3<f64>,
        q: &mut [f64],
        iterations: usize,
    ) -> PoseError {
        let root_from_palm = root.inverse() * palm;
        let chain = self.tree.chain(self.palm);
        let mut missing = PoseError { m: f64::INFINITY, rad: f64::INFINITY };
        let mut poses = Vec::with_capacity(chain.len());
        let (mut least, mut stalled) = (f64::INFINITY, 0);
        for _ in 0..=iterations {
            self.tree.chain_poses(&chain, q, &mut poses);
            let Some(pose) = poses.last() else { break };
            let way = root_from_palm.translation.vector - pose.translation.vector;
            let turn = (root_from_palm.rotation * pose.rotation.inverse()).scaled_axis();
            missing = PoseError { m: way.norm(), rad: turn.norm() };
            let error = missing.m.hypot(missing.rad);
            stalled = if error < PROGRESS * least { 0 } else { stalled + 1 };
            least = least.min(error);
            if missing.m < EXACT && missing.rad < EXACT || stalled == STALLED {
                break;
            }
            let jacobian = self.tree.chain_jacobian(&chain, &poses, self.dofs);
            let mut square = Matrix6::identity() * DAMPING;
            for column in jacobian.column_iter() {
                for (at, mut sum) in square.column_iter_mut().enumerate() {
                    (0..6).for_each(|row| sum[row] += column[row] * column[at]);
                }
            }
            let Some(factor) = square.cholesky() else { break };
            let weights = factor.solve(&Vector6::new(way.x, way.y, way.z, turn.x, turn.y, turn.z));
            for (&dof, column) in self.dofs.iter().zip(jacobian.column_iter()) {
                q[dof] = self.tree.dofs[dof].clamp(q[dof] + column.dot(&weights).clamp(-STEP, STEP));
            }
        }
        missing
    }

    /// Searches postures from which the arm can move the palm along a whole path, from several fixed start postures. Joints outside the arm keep their values
    /// in
    /// `q`.
    pub fn postures_along(
        &self,
        root: &Isometry3<f64>,
        way: &[Isometry3<f64>],
        q: &[f64],
        (starts, iterations): (usize, usize),
        surroundings: &Surroundings,
    ) -> impl Iterator<Item = PathPosture> {
        let mut begun: Vec<Vec<f64>> = Vec::new();
        let links = ArmLinks::new(self.tree, self.palm);
        let looked_at = move |q: &[f64]| {
            let mut poses = self.tree.forward_kinematics(q);
            poses.iter_mut().for_each(|pose| *pose = root * *pose);
            (usize::from(surroundings.meet(&links, &poses)), self.off_middle(q))
        };
        (0..starts).filter_map(move |index| {
            let (first, rest) = way.split_first()?;
            let mut tried = self.start(q, index);
            if !self.inverse_kinematics(root, first, &mut tried, iterations).is_within(&REACHED) {
                return None;
            }
            // Starts that converge to the same posture have the same result.
            let same = |other: &Vec<f64>| tried.iter().zip(other).all(|(one, other)| (one - other).abs() < SAME);
            if begun.iter().any(same) {
                return None;
            }
            begun.push(tried.clone());
            let begins = tried.clone();
            let (mut met, mut off_middle) = looked_at(&tried);
            let reaches = rest.iter().all(|palm| {
                let missing = self.inverse_kinematics(root, palm, &mut tried, FOLLOWING);
                let (meets, off) = looked_at(&tried);
                (met, off_middle) = (met + meets, off_middle.max(off));
                missing.is_within(&REACHED)
            });
            reaches.then_some(PathPosture { q: begins, met, off_middle })
        })
    }

    /// Returns the pose at which the arm fails to follow a path. Tries the same start postures as [`Self::postures_along`] and returns the failure of the one
    /// that gets farthest. `None` if the arm can follow the path or the path is empty.
    pub fn missed_along(
        &self,
        root: &Isometry3<f64>,
        way: &[Isometry3<f64>],
        q: &[f64],
        (starts, iterations): (usize, usize),
    ) -> Option<PathFailure> {
        let mut farthest: Option<PathFailure> = None;
        for index in 0..starts {
            let mut tried = self.start(q, index);
            let mut missed = None;
            for (pose, palm) in way.iter().enumerate() {
                let iterations = if pose == 0 { iterations } else { FOLLOWING };
                let missing = self.inverse_kinematics(root, palm, &mut tried, iterations);
                if !missing.is_within(&REACHED) {
                    let at_limit = self.dofs.iter().copied().find(|&dof| {
                        let range = self.tree.dofs[dof].range;
                        range.iter().any(|limit| (tried[dof] - limit).abs() < AT_LIMIT)
                    });
                    missed = Some(PathFailure { pose, missing, at_limit });
                    break;
                }
            }
            let missed = missed?;
            let is_farther = |other: &PathFailure| {
                missed.pose > other.pose || missed.pose == other.pose && missed.missing.m < other.missing.m
            };
            if farthest.as_ref().is_none_or(is_farther) {
                farthest = Some(missed);
            }
        }
        farthest
    }

    /// Returns the start values of all degrees of freedom for the inverse kinematics. Those outside the arm are taken from `q`.
    fn start(&self, q: &[f64], index: usize) -> Vec<f64> {
        let mut start = q.to_vec();
        for (place, &dof) in self.dofs.iter().enumerate() {
            let [low, high] = self.tree.dofs[dof].range;
            let share = ((index * 7 + 3) as f64 * STEPS[place % STEPS.len()]).fract();
            start[dof] = low + (0.15 + 0.7 * share) * (high - low);
        }
        start
    }

    /// Whether the palm can follow a path from a posture `q` at its beginning; `root` is the pose of the root.
    pub(crate) fn follows(&self, root: &Isometry3<f64>, way: &[Isometry3<f64>], q: &[f64]) -> bool {
        let mut q = q.to_vec();
        way.iter().all(|palm| self.inverse_kinematics(root, palm, &mut q, FOLLOWING).is_within(&REACHED))
    }

    /// Returns the largest distance of a joint from the middle of its range, 1 at a limit.
    fn off_middle(&self, q: &[f64]) -> f64 {
        let off = self.dofs.iter().map(|&dof| {
            let [low, high] = self.tree.dofs[dof].range;
            ((2.0 * q[dof] - low - high) / (high - low)).abs()
        });
        off.fold(0.0, f64::max)
    }
}
