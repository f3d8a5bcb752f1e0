//! The Archimedean spiral of a search for a hole, from the middle outwards, at constant speed.
//!
//! The spiral covers a disc: each point of the disc is within half the pitch of the spiral. A peg enters a hole if its distance from the axis is less than the
//! clearance, so the spiral finds the hole if its pitch is less than twice the clearance (S. R. Chhatpar and M. S. Branicky, *Search Strategies for Peg-in-Hole
//! Assemblies with Position Uncertainty*, IROS 2001).

use std::f64::consts::TAU;

/// A place on a spiral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpiralPath {
    pitch: f64,
    within: f64,
    angle: f64,
}

impl SpiralPath {
    /// Returns the start of a spiral with this pitch (m) that covers a disc of the radius `within` (m).
    pub const fn new(pitch: f64, within: f64) -> Self {
        Self { pitch, within, angle: 0.0 }
    }

    /// Returns the current point, m.
    pub fn place(&self) -> [f64; 2] {
        let radius = self.radius();
        [radius * self.angle.cos(), radius * self.angle.sin()]
    }

    /// Advances by a distance, m; returns `false` when the disc is covered.
    pub fn advance(&mut self, way: f64) -> bool {
        // The arc length per angle is √(r² + (p/2π)²). It changes fast near the middle, so it is evaluated half way.
        let per_angle = |angle: f64| self.pitch / TAU * angle.hypot(1.0);
        let half_way = self.angle + 0.5 * way / per_angle(self.angle);
        self.angle += way / per_angle(half_way);
        // The last turn then begins at most half a pitch inside the edge.
        self.radius() < self.within + self.pitch / 2.0
    }

    fn radius(&self) -> f64 {
        self.pitch * self.angle / TAU
    }
}
