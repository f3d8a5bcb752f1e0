//! What a simulated robot did, 100 times a second: what its pictures and plots are made of.

use super::tree::Robot;
use crate::base::hands::{Finger, Side};
use crate::base::scene::Scene;
use nalgebra::{Isometry3, Vector3};

/// A robot's motion through all tasks.
#[derive(Clone, Debug)]
pub struct Trace {
    /// The hand that moved, with what carries it.
    pub limb: Robot,
    /// Which hand.
    pub side: Side,
    /// Where it was.
    pub scene: Scene,
    /// In order of time.
    pub moments: Vec<Moment>,
}

/// One instant.
#[derive(Clone, Debug)]
pub struct Moment {
    /// Since the beginning, s.
    pub time_s: f64,
    /// Index of the task.
    pub task: usize,
    /// What is being done.
    pub primitive: String,
    /// Values of the limb's degrees of freedom, rad or m.
    pub q: Vec<f64>,
    /// Where the limb's root is, reference frame.
    pub root: Isometry3<f64>,
    /// Where the scene's bodies are, in their order, reference frame.
    pub bodies: Vec<Isometry3<f64>>,
    /// Forces on the task's object, in the order of the hand's fingers.
    pub forces: Vec<FingerForce>,
}

/// A fingertip's force on the object, frame of the object, N.
#[derive(Clone, Copy, Debug)]
pub struct FingerForce {
    /// Which.
    pub finger: Finger,
    /// As commanded.
    pub wanted: Vector3<f64>,
    /// As it is.
    pub exerted: Vector3<f64>,
}
