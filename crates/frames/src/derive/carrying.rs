//! The object that a hand carries where no channel shows a touch: the one that moves with it.
//!
//! A carry begins when an object moves with the fingertips of a hand in its reach. It continues, independent of the distance of other objects, and however long
//! the hand pauses, until the fingertips are [`LEFT_BY`] farther from the object, or until another object moves with them and this one does not.

use super::motion::{Motion, slopes, vector};
use crate::clean::preprocess::{CleanLog, State};
use nalgebra::Vector3;
use teachtree_base::hands::{Finger, Side};

/// A slower object does not move, m/s.
const MOVES: f64 = 0.010;
/// The largest difference of two velocities of what moves together, as a share of the larger one: a hand that turns an object moves otherwise than its origin.
const TOGETHER: f64 = 0.5;
/// A hand carries nothing that is farther away than this from its fingertips, m: objects have handles.
const REACH: f64 = 0.200;
/// Fingertips that have got this much farther from an object have let it go, m: fingers that open stay nearer.
const LEFT_BY: f64 = 0.040;

/// A hand without a channel of touch, and the objects around it.
pub struct Carrying<'a> {
    motions: &'a [Motion<'a>],
    /// The objects, as indices in the scene, with the radius of the ball that holds each, m.
    objects: Vec<(usize, f64)>,
    /// The mean of the fingertips, m, and its velocity, m/s, reference frame.
    position: [Vec<f64>; 3],
    velocity: [Vec<f64>; 3],
}

impl<'a> Carrying<'a> {
    /// `None` of a hand without fingertips in the log, and where there are no two objects to choose from.
    pub fn new(
        measured: &CleanLog,
        motions: &'a [Motion<'a>],
        side: Side,
        fingers: &[Finger],
        objects: &[usize],
    ) -> Option<Self> {
        let tips: Vec<[&[f64]; 3]> = fingers
            .iter()
            .filter(|finger| **finger != Finger::Palm)
            .filter_map(|finger| measured.vec3(&format!("{side}.{finger}.position")))
            .collect();
        if tips.is_empty() || objects.len() < 2 {
            return None;
        }
        let means: Vec<Vector3<f64>> = (0..measured.len())
            .map(|frame| tips.iter().map(|tip| vector(tip, frame)).sum::<Vector3<f64>>() / tips.len() as f64)
            .collect();
        let position = [0, 1, 2].map(|axis| means.iter().map(|mean| mean[axis]).collect::<Vec<f64>>());
        let velocity = slopes(measured, position.each_ref().map(Vec::as_slice));
        let radius =
            |body: &usize| measured.scene.bodies.get_index(*body).map_or(0.0, |(_, body)| body.bounding_radius());
        let objects = objects.iter().map(|body| (*body, radius(body))).collect();
        Some(Self { motions, objects, position, velocity })
    }

    /// The state in which the hand carries an object at a frame, from the state at the frame before; `None` where it carries none. `nearest` chooses among
    /// several objects.
    pub fn carried(&self, frame: usize, was: State, nearest: impl Fn(&[usize]) -> Option<usize>) -> Option<State> {
        let held = was.which.filter(|body| was.on && self.way(frame, *body) < was.way + LEFT_BY);
        let target = was.which.filter(|body| self.moves_along(frame, *body));
        let moving = || -> Vec<usize> {
            let bodies = self.objects.iter().map(|(body, _)| *body);
            bodies.filter(|body| self.moves_along(frame, *body)).collect()
        };
        let begun = || target.or_else(|| nearest(&moving()));
        match (held, target) {
            (Some(_), Some(_)) => Some(was),
            (Some(_), None) => Some(begun().map_or(was, |body| self.begins(frame, body))),
            (None, _) => begun().map(|body| self.begins(frame, body)),
        }
    }

    fn begins(&self, frame: usize, body: usize) -> State {
        State { on: true, which: Some(body), way: self.way(frame, body) }
    }

    /// Returns the distance of the fingertips' mean from the origin of an object, m.
    fn way(&self, frame: usize, body: usize) -> f64 {
        let origin = self.motions.get(body).map_or_else(Vector3::zeros, |motion| motion.position(frame));
        (vector(&self.position, frame) - origin).norm()
    }

    /// Whether an object in reach moves, and the fingertips with it.
    fn moves_along(&self, frame: usize, body: usize) -> bool {
        let object = self.motions.get(body).map_or_else(Vector3::zeros, |motion| motion.velocity(frame));
        let speed = object.norm();
        if speed < MOVES {
            return false;
        }
        let hand = vector(&self.velocity, frame);
        let radius = self.objects.iter().find(|(it, _)| *it == body).map_or(0.0, |(_, radius)| *radius);
        (hand - object).norm() <= TOGETHER * speed.max(hand.norm()) && self.way(frame, body) < radius + REACH
    }
}
