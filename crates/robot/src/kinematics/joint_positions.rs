//! The joint positions of a finger, and what an inverse of its kinematics found.

/// No finger has more degrees of freedom.
pub const MAX_DOFS: usize = 8;
/// A point is reached when it is missed by less than this, m.
pub const REACHED_M: f64 = 1e-6;

/// Joint positions of one finger, in the order of its degrees of freedom from the palm out.
pub type JointPositions = [f64; MAX_DOFS];

/// What an inverse found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IkSolution {
    /// The angles, within the ranges.
    pub angles: JointPositions,
    /// How far the tip stays away from the point, m.
    pub miss: f64,
    /// The measure at these angles.
    pub measure: f64,
}
