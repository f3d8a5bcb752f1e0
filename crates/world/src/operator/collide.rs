//! Collisions: a straight motion into a body of the environment, which overshoots the contact, then a retreat.

use crate::World;
use nalgebra::{Point3, Vector3};
use teachtree_base::easing::minimum_jerk;

/// A motion of the palm into a body and back.
pub(super) struct CollideMotion {
    /// Start of the palm, m.
    pub(super) from: Vector3<f64>,
    /// Direction, unit.
    pub(super) along: Vector3<f64>,
    /// Lengths of the motion and of the retreat, m.
    pub(super) distance: f64,
    pub(super) back: f64,
    /// Durations of the motion, of the pause and of the retreat, s.
    pub(super) durations: [f64; 3],
}

impl CollideMotion {
    /// Position of the palm `time` seconds after the start, m.
    pub(super) fn at(&self, time: f64) -> Vector3<f64> {
        let [motion, pause, retreat] = self.durations;
        let forward = self.distance * minimum_jerk(time / motion);
        let backward = self.back * minimum_jerk((time - motion - pause) / retreat);
        self.from + self.along * (forward - backward)
    }

    /// Whether the retreat has ended `time` seconds after the start.
    pub(super) fn is_over(&self, time: f64) -> bool {
        time >= self.durations.iter().sum()
    }
}

/// The vector from a point to the nearest point of a body's surface, m.
pub(super) fn vector_to(world: &World, body: usize, point: Point3<f64>) -> Vector3<f64> {
    let Some(state) = world.observation().bodies.get(body) else { return Vector3::zeros() };
    let nearest = world.surface(body, state.pose.inverse_transform_point(&point));
    nearest.map_or_else(Vector3::zeros, |(surface, _)| state.pose * surface - point)
}
