//! The judge: measures the final error of each task's object against the demonstration, and the tracking of palm and fingertips.

use super::arm_clearance::ACCEPTED_M;
use super::force_tolerance::Forces;
use crate::control::behavior::SearchResult;
use crate::simulation::cause::Cause;
use crate::simulation::observer::{Observer, Step};
use nalgebra::{Isometry3, Vector3};
use teachtree_base::hands::Side;
use teachtree_base::scene::Scene;
use teachtree_command::{HoleGeometry, Task, hole_of};
use teachtree_world::Observation;

/// Maximum distance between the final positions of the object, m.
pub const WITHIN_M: f64 = 0.005;
/// Maximum angle between the final orientations of the object, rad.
pub const WITHIN_RAD: f64 = 3.0 * std::f64::consts::PI / 180.0;

/// The outcome of a task.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskOutcome {
    /// The name of the task.
    pub task: String,
    /// The hand that performed it.
    pub side: Side,
    /// The object.
    pub object: String,
    /// The distance of the object from its final position in the demonstration, m. If another hand took it over, from the position at the handover. Play in a
    /// hole does not count.
    pub off: f64,
    /// The angle from that orientation, rad. An object that is correctly in a hole may turn about the axis of the hole.
    pub turned: f64,
    /// The tilt from that orientation, rad.
    pub leaning: f64,
    /// The speed of the object when it is judged, m/s.
    pub speed: f64,
    /// The largest distance of the palm from its planned path, m. The planned path is the commanded path, moved with the seen poses of objects and holes,
    /// without the corrections of behaviors.
    pub palm_error: f64,
    /// The largest force of a fingertip, N.
    pub largest_force: f64,
    /// The comparison of the contact forces with the commanded ones.
    pub forces: Forces,
    /// The result of the search for a hole; `None` if no search was needed.
    pub searched: Option<SearchResult>,
    /// The time at which the object fell far below the scene, s of the recording. No later command moves it.
    pub fell_s: Option<f64>,
    /// Maximum penetration depth of the links during the task, m.
    pub collision_m: f64,
    /// Whether the object is at the operator's final pose.
    pub done: bool,
    /// The causes of the failure, in order of time; empty for a success.
    pub causes: Vec<Cause>,
}

/// The verdict on a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The object is at the operator's final pose.
    Done,
    /// The object is there, but a link exceeded the accepted penetration depth: a real robot would have been stopped.
    DoneWithCollisions,
    /// The object is elsewhere.
    NotDone,
}

impl Verdict {
    /// Returns the name of the verdict in text and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::DoneWithCollisions => "done with collisions",
            Self::NotDone => "not done",
        }
    }
}

impl TaskOutcome {
    /// Returns the verdict on the task.
    pub fn verdict(&self) -> Verdict {
        match (self.done, self.collides()) {
            (false, _) => Verdict::NotDone,
            (true, true) => Verdict::DoneWithCollisions,
            (true, false) => Verdict::Done,
        }
    }

    /// Whether a link exceeded the accepted penetration depth.
    pub fn collides(&self) -> bool {
        self.collision_m > ACCEPTED_M
    }
}

/// The measurements of each task while it is performed.
pub(in crate::simulation) struct Judge {
    tasks: Vec<Tally>,
}

/// The measurements of a task.
#[derive(Clone, Copy, Default)]
struct Tally {
    palm_error: f64,
    largest_force: f64,
}

/// The results of other observers for a task.
pub(in crate::simulation) struct Findings {
    pub(in crate::simulation) side: Side,
    pub(in crate::simulation) searched: Option<SearchResult>,
    pub(in crate::simulation) fell_s: Option<f64>,
    pub(in crate::simulation) forces: Forces,
    pub(in crate::simulation) collision_m: f64,
    pub(in crate::simulation) causes: Vec<Cause>,
}

impl Judge {
    /// Returns the judge of `tasks` tasks, before any step.
    pub(in crate::simulation) fn new(tasks: usize) -> Self {
        Self { tasks: vec![Tally::default(); tasks] }
    }

    /// Returns the outcome of a task, given with its number. `wanted` is the final pose of its object, the body of this index.
    pub(in crate::simulation) fn outcome(
        &self,
        (number, task): (usize, &Task),
        body: usize,
        found: Findings,
        wanted: &Isometry3<f64>,
        scene: &Scene,
        seen: &Observation,
    ) -> TaskOutcome {
        let tally = &self.tasks[number];
        let end = seen.bodies[body].pose;
        let now = |name: &str| scene.bodies.get_index_of(name).map(|body| seen.bodies[body].pose);
        let hole = |pose: &Isometry3<f64>| hole_of(scene, &task.object, pose, &now);
        let (off, turned) = match (hole(&end), hole(wanted)) {
            (Some(hole), Some(_)) => apart_in(&hole, &end, wanted),
            _ => ((end.translation.vector - wanted.translation.vector).norm(), end.rotation.angle_to(&wanted.rotation)),
        };
        let up = wanted.rotation.inverse() * Vector3::z();
        let done = off <= WITHIN_M && turned <= WITHIN_RAD && found.fell_s.is_none();
        TaskOutcome {
            task: task.task.clone(),
            side: found.side,
            object: task.object.clone(),
            off,
            turned,
            leaning: (end.rotation * up).angle(&Vector3::z()),
            speed: seen.bodies[body].velocity.norm(),
            palm_error: tally.palm_error,
            largest_force: tally.largest_force,
            forces: found.forces,
            searched: found.searched,
            fell_s: found.fell_s,
            collision_m: found.collision_m,
            done,
            causes: if done { Vec::new() } else { found.causes },
        }
    }
}

/// Returns the distance (m) and angle (rad) between two poses of an object in its hole. A turn about the axis of the hole and a displacement across it within
/// the clearance do not count.
fn apart_in(hole: &HoleGeometry, end: &Isometry3<f64>, wanted: &Isometry3<f64>) -> (f64, f64) {
    let way = end * hole.plug - wanted * hole.plug;
    let along = way.dot(&hole.axis);
    let beside = ((way - hole.axis * along).norm() - 2.0 * hole.clearance.unwrap_or(0.0)).max(0.0);
    let own = |pose: &Isometry3<f64>| pose.inverse_transform_vector(&hole.axis);
    (along.hypot(beside), own(end).angle(&own(wanted)))
}

impl Observer for Judge {
    fn observe(&mut self, step: &Step<'_>) {
        for (hand, felt) in step.hands.iter().zip(&step.seen.hands) {
            let Some(doing) = hand.doing else { continue };
            let tally = &mut self.tasks[doing.task];
            let off = (hand.executor.palm().translation.vector - hand.planned_palm.translation.vector).norm();
            tally.palm_error = tally.palm_error.max(off);
            for tip in &felt.tips {
                tally.largest_force = tally.largest_force.max(tip.force_on(doing.body).norm());
            }
        }
    }
}
