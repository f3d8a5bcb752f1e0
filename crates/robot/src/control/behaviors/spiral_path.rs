//! The spiral along which a hand feels for a hole: Archimedean, from the middle outwards, at one speed.
//!
//! It covers a disc: no place in it is farther from the way than half the pitch. So a hole of some clearance, which lets a peg in that is so far beside
//! its axis, is met when the pitch is less than twice the clearance (S. R. Chhatpar and M. S. Branicky, *Search Strategies for Peg-in-Hole Assemblies with
//! Position Uncertainty*, IROS 2001).

use std::f64::consts::TAU;

/// A place on a spiral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpiralPath {
    pitch: f64,
    within: f64,
    angle: f64,
}

impl SpiralPath {
    /// The middle of a spiral with this way between its turns, m, that covers a disc of the radius `within`, m.
    pub const fn new(pitch: f64, within: f64) -> Self {
        Self { pitch, within, angle: 0.0 }
    }

    /// Where it is, m.
    pub fn place(&self) -> [f64; 2] {
        let radius = self.radius();
        [radius * self.angle.cos(), radius * self.angle.sin()]
    }

    /// Goes on by a way, m; `false` when the disc is covered.
    pub fn advance(&mut self, way: f64) -> bool {
        // The arc is √(r² + (p/2π)²) long per angle, which changes much near the middle: it is taken half way.
        let per_angle = |angle: f64| self.pitch / TAU * angle.hypot(1.0);
        let half_way = self.angle + 0.5 * way / per_angle(self.angle);
        self.angle += way / per_angle(half_way);
        // At its beginning the last turn is then inside of the edge by half a pitch at most.
        self.radius() < self.within + self.pitch / 2.0
    }

    fn radius(&self) -> f64 {
        self.pitch * self.angle / TAU
    }
}
