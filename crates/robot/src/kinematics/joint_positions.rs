//! The joint positions of a finger, and solutions of its inverse kinematics.

/// Maximum number of degrees of freedom of a finger.
pub const MAX_DOFS: usize = 8;
/// The maximum residual of a reached point, m.
pub const REACHED_M: f64 = 1e-6;

/// Joint positions of one finger, in the order of its degrees of freedom from the palm out.
pub type JointPositions = [f64; MAX_DOFS];

/// A solution of the inverse kinematics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IkSolution {
    /// The angles, within the ranges.
    pub angles: JointPositions,
    /// The distance of the tip from the point, m.
    pub miss: f64,
    /// The quality at these angles.
    pub measure: f64,
}
