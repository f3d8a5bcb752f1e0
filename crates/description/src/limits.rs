//! Limits of robot descriptions, whichever format they have.

/// A joint that says nothing of its acceleration comes up to its speed in this time, s.
pub const SPEEDS_UP_S: f64 = 0.25;
/// No robot has more links.
pub const MAX_LINKS: usize = 256;
/// No link has more shapes.
pub const MAX_SOLIDS: usize = 64;
/// No robot has more meshes.
pub const MAX_MESHES: usize = 512;
