//! What a simulated robot did, 100 times a second: what its pictures and plots are made of.

use crate::model::robot::Robot;
use nalgebra::{Isometry3, Vector3};
use teachtree_base::hands::{Finger, Side};
use teachtree_base::meaning::Meaning;
use teachtree_base::scene::Scene;

/// A robot's motion through all tasks.
#[derive(Clone, Debug)]
pub struct Trace {
    /// The hands that moved.
    pub limbs: Vec<Limb>,
    /// Where it was.
    pub scene: Scene,
    /// In order of time.
    pub moments: Vec<TraceSample>,
}

/// A hand with what carries it.
#[derive(Clone, Debug)]
pub struct Limb {
    /// Which hand.
    pub side: Side,
    /// Its links.
    pub robot: Robot,
}

/// How a limb stands.
#[derive(Clone, Debug)]
pub struct LimbPose {
    /// Values of its degrees of freedom, rad or m.
    pub q: Vec<f64>,
    /// Where its root is, reference frame.
    pub root: Isometry3<f64>,
}

/// One instant of a task.
#[derive(Clone, Debug)]
pub struct TraceSample {
    /// Since the beginning, s.
    pub time_s: f64,
    /// Index of the task.
    pub task: usize,
    /// Index of its object among the scene's bodies.
    pub object: usize,
    /// Index of the limb that does it.
    pub limb: usize,
    /// The primitive.
    pub primitive: String,
    /// What the hand does.
    pub does: Meaning,
    /// How every limb stands.
    pub stances: Vec<LimbPose>,
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
    /// The demonstrated force; `None` if it was not measured.
    pub demonstrated: Option<Vector3<f64>>,
    /// The commanded force, without the part that the slip reflex adds.
    pub commanded: Vector3<f64>,
    /// As it is.
    pub exerted: Vector3<f64>,
}
