//! The observers of a simulation. To add one, write a file in `observers`, and name it here: as a module, a field, and in the two functions.

pub mod arm_clearance;
mod causes;
mod drop_detection;
pub mod force_tolerance;
pub mod judge;
pub mod recorder;
mod tracer;

use super::observer::Observer;
use super::trace::Limb;
use arm_clearance::ArmClearance;
use causes::Causes;
use drop_detection::DropDetection;
use force_tolerance::ForceTolerance;
use judge::Judge;
use recorder::Recorder;
use teachtree_base::scene::Scene;
use teachtree_command::Task;
use teachtree_world::Observation;
use tracer::Tracer;

/// All observers.
pub(super) struct Observers {
    pub(super) drops: DropDetection,
    pub(super) recorder: Recorder,
    pub(super) judge: Judge,
    pub(super) forces: ForceTolerance,
    pub(super) tracer: Tracer,
    pub(super) clearance: ArmClearance,
    pub(super) causes: Causes,
}

impl Observers {
    /// Returns the observers of a robot's limbs in a scene that has come to rest.
    pub(super) fn new(limbs: Vec<Limb>, scene: &Scene, tasks: &[Task], seen: &Observation) -> Self {
        Self {
            drops: DropDetection::new(scene),
            recorder: Recorder::new(&limbs, scene, seen),
            judge: Judge::new(tasks.len()),
            forces: ForceTolerance::new(tasks),
            clearance: ArmClearance::new(scene, &limbs, tasks.len()),
            tracer: Tracer::new(limbs, scene),
            causes: Causes::new(scene, tasks.len()),
        }
    }

    /// Returns all observers, in the order in which they receive a step.
    pub(super) fn all(&mut self) -> [&mut dyn Observer; 7] {
        let Self { drops, recorder, judge, forces, tracer, clearance, causes } = self;
        [drops, recorder, judge, forces, tracer, clearance, causes]
    }
}
