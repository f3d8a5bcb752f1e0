//! The inverse kinematics of a finger: the center of its tip to a point, palm frame.
//!
//! The inverse has a closed form for fingers whose first two joints meet at right angles and whose others bend in the plane of the second
//! (docs/sources.md, Hand): with the last joint coupled, or with it free, when it is scanned for the best measure. Other fingers are solved by damped
//! least squares.

use super::finger::FingerModel;
use super::joint_positions::{IkSolution, JointPositions, MAX_DOFS, REACHED_M};
use nalgebra::{Matrix3, Point3};

/// Number of least-squares iterations from each start, and their damping, m.
const ITERATIONS: usize = 60;
const DAMPED_M: f64 = 2e-3;

impl FingerModel {
    /// Returns joint positions that move the center of the tip to a point. Of several solutions it returns the best one by [`Self::measure`], and for a point
    /// out of reach joint positions near it.
    pub fn ik(&self, point: Point3<f64>) -> IkSolution {
        match &self.closed {
            Some(closed) => closed.ik(point, &self.ranges),
            None => self.reach_numerically(point),
        }
    }

    /// Like [`Self::ik`], for a point near one with a known solution.
    pub(crate) fn reach_near(&self, point: Point3<f64>, known: &IkSolution) -> IkSolution {
        match &self.closed {
            Some(closed) => closed.reach_near(point, &self.ranges, known),
            None => self.approach(point, known.angles),
        }
    }

    /// Returns the smallest distance of the tip from a point, m, for messages about unreachable points.
    pub fn ik_residual(&self, point: Point3<f64>) -> f64 {
        let mut starts = vec![self.ik(point).angles];
        starts.extend(self.starts());
        starts.iter().map(|start| self.approach(point, *start).miss).fold(f64::INFINITY, f64::min)
    }

    fn reach_numerically(&self, point: Point3<f64>) -> IkSolution {
        let mut best: Option<(IkSolution, f64)> = None;
        for start in self.starts() {
            let found = self.approach(point, start);
            let value = if found.miss < REACHED_M { found.measure } else { -found.miss };
            if best.is_none_or(|(_, other)| value > other) {
                best = Some((found, value));
            }
        }
        let nothing = IkSolution { angles: [0.0; MAX_DOFS], miss: f64::INFINITY, measure: 0.0 };
        best.map_or(nothing, |(reached, _)| reached)
    }

    /// Returns the start positions: the middle of the ranges, and a third of them to each side.
    fn starts(&self) -> Vec<JointPositions> {
        [0.5, 0.2, 0.8]
            .iter()
            .map(|share| {
                let mut angles = [0.0; MAX_DOFS];
                for (angle, [low, high]) in angles.iter_mut().zip(&self.ranges) {
                    *angle = low + share * (high - low);
                }
                angles
            })
            .collect()
    }

    /// Solves by damped least squares within the ranges.
    fn approach(&self, point: Point3<f64>, start: JointPositions) -> IkSolution {
        let mut angles = start;
        let mut posture = self.posture(&angles);
        let mut miss = (point - posture.tip).norm();
        let mut damping = DAMPED_M;
        for _ in 0..ITERATIONS {
            if miss < REACHED_M * 0.1 {
                break;
            }
            let jacobian = self.jacobian(&posture);
            let square: Matrix3<f64> = &jacobian * jacobian.transpose() + Matrix3::identity() * damping * damping;
            let Some(inverse) = square.try_inverse() else { break };
            let step = jacobian.transpose() * (inverse * (point - posture.tip));
            let mut next = angles;
            for ((angle, change), [low, high]) in next.iter_mut().zip(step.iter()).zip(&self.ranges) {
                *angle = (*angle + change.clamp(-0.3, 0.3)).clamp(*low, *high);
            }
            let next_posture = self.posture(&next);
            let next_miss = (point - next_posture.tip).norm();
            if next_miss < miss {
                (angles, posture, miss) = (next, next_posture, next_miss);
                damping = (damping * 0.5).max(1e-6);
            } else if damping > 1.0 {
                break;
            } else {
                damping *= 4.0;
            }
        }
        IkSolution { angles, miss, measure: self.measure(&angles) }
    }
}
