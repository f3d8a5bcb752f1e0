//! The trace of a simulated robot, at 100 Hz, for pictures and plots.

use crate::model::robot::Robot;
use nalgebra::{Isometry3, Vector3};
use teachtree_base::hands::{Finger, Side};
use teachtree_base::meaning::Meaning;
use teachtree_base::scene::Scene;

/// A robot's motion through all tasks.
#[derive(Clone, Debug)]
pub struct Trace {
    /// The limbs: each hand with the arm that carries it.
    pub limbs: Vec<Limb>,
    /// The scene.
    pub scene: Scene,
    /// The instants, in order of time.
    pub moments: Vec<TraceSample>,
}

/// A hand with its arm.
#[derive(Clone, Debug)]
pub struct Limb {
    /// The side of the hand.
    pub side: Side,
    /// The links.
    pub robot: Robot,
}

/// The configuration of a limb.
#[derive(Clone, Debug)]
pub struct LimbPose {
    /// Values of its degrees of freedom, rad or m.
    pub q: Vec<f64>,
    /// The pose of its root, reference frame.
    pub root: Isometry3<f64>,
}

/// One instant of a task.
#[derive(Clone, Debug)]
pub struct TraceSample {
    /// The time since the beginning, s.
    pub time_s: f64,
    /// Index of the task.
    pub task: usize,
    /// Index of its object among the scene's bodies.
    pub object: usize,
    /// Index of the limb that performs the task.
    pub limb: usize,
    /// The primitive.
    pub primitive: String,
    /// The action of the hand.
    pub does: Meaning,
    /// The configuration of every limb.
    pub stances: Vec<LimbPose>,
    /// The poses of the scene's bodies, in their order, reference frame.
    pub bodies: Vec<Isometry3<f64>>,
    /// Forces on the task's object, in the order of the hand's fingers.
    pub forces: Vec<FingerForce>,
}

/// A fingertip's force on the object, frame of the object, N.
#[derive(Clone, Copy, Debug)]
pub struct FingerForce {
    /// The finger.
    pub finger: Finger,
    /// The demonstrated force; `None` if it was not measured.
    pub demonstrated: Option<Vector3<f64>>,
    /// The commanded force, without the part that the slip reflex adds.
    pub commanded: Vector3<f64>,
    /// The exerted force.
    pub exerted: Vector3<f64>,
}
