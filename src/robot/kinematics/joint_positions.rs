//! The joint positions of a finger, and what an inverse of its kinematics found.

/// No finger has more degrees of freedom.
pub const MAX_DOFS: usize = 8;
/// A point is reached when it is missed by less than this, m.
pub const REACHED_M: f64 = 1e-6;

/// Angles of one finger, in the order of its degrees of freedom from the palm out.
pub type Angles = [f64; MAX_DOFS];

/// What an inverse found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reached {
    /// The angles, within the ranges.
    pub angles: Angles,
    /// How far the tip stays away from the point, m.
    pub miss: f64,
    /// The measure at these angles.
    pub measure: f64,
}
