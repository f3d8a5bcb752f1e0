//! The tracer: makes the trace of a simulation.

use crate::planning::plan::PlannedForce;
use crate::simulation::hand_agent::HandAgent;
use crate::simulation::observer::{Observer, Step};
use crate::simulation::trace::{FingerForce, Limb, LimbPose, Trace, TraceSample};
use nalgebra::Vector3;
use teachtree_base::scene::Scene;
use teachtree_world::{BodyState, TipState};

/// Number of steps from one traced step to the next: 100 are traced in a second.
const TRACED: usize = 10;

/// The trace so far.
pub(in crate::simulation) struct Tracer {
    pub(in crate::simulation) trace: Trace,
}

impl Tracer {
    /// The trace of limbs in a scene before any step.
    pub(in crate::simulation) fn new(limbs: Vec<Limb>, scene: &Scene) -> Self {
        Self { trace: Trace { limbs, scene: scene.clone(), moments: Vec::new() } }
    }
}

impl Observer for Tracer {
    fn observe(&mut self, step: &Step<'_>) {
        if !step.in_group.is_multiple_of(TRACED) {
            return;
        }
        for (limb, (hand, felt)) in step.hands.iter().zip(&step.seen.hands).enumerate() {
            let Some(doing) = hand.doing else { continue };
            self.trace.moments.push(TraceSample {
                time_s: step.time_s(),
                task: doing.task,
                object: doing.body,
                limb,
                primitive: doing.primitive.to_string(),
                does: doing.does,
                stances: step.hands.iter().map(stance).collect(),
                bodies: step.seen.bodies.iter().map(|body| body.pose).collect(),
                forces: forces(&hand.planned, &felt.tips, doing.body, &step.seen.bodies[doing.body]),
            });
        }
    }
}

fn stance(hand: &HandAgent<'_>) -> LimbPose {
    let motion = &hand.executor.motion;
    LimbPose { q: motion.q.iter().copied().collect(), root: motion.root }
}

/// Demonstrated, commanded and exerted forces on a task's object, in its frame.
fn forces(planned: &[PlannedForce], tips: &[TipState], body: usize, object: &BodyState) -> Vec<FingerForce> {
    let forces = tips.iter().map(|tip| {
        let exerted = object.pose.inverse_transform_vector(&tip.force_on(body));
        let nothing =
            PlannedForce { finger: tip.finger, commanded: Vector3::zeros(), demonstrated: Some(Vector3::zeros()) };
        let planned = planned.iter().copied().find(|planned| planned.finger == tip.finger).unwrap_or(nothing);
        let PlannedForce { finger, commanded, demonstrated } = planned;
        FingerForce { finger, demonstrated, commanded, exerted }
    });
    forces.collect()
}
