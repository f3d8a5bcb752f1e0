//! The robot in the world: commands in, a recording of what the robot did and a verdict on each task out.
//!
//! Every millisecond the plan gives targets, the arm's inverse kinematics follows the palm, the controllers give torques, the robot's
//! dynamics and the world's bodies move, and fingertips press on bodies by the law of the virtual environment. Only fingertips touch.

use super::executor::{Executor, beginning};
use super::log::Log;
use super::plan::Plan;
use super::righting::Righting;
use super::trace::{FingerForce, Moment, Trace};
use super::tree::Robot;
use crate::base::error::InputError;
use crate::base::hands::{Finger, Side};
use crate::base::quantity::Quantity;
use crate::base::recording::Recording;
use crate::base::scene::{Hand, Scene};
use crate::command::{Commands, Task, axis_of_its_hole};
use crate::world::{Fingertips, STEP_S, World};
use nalgebra::{Isometry3, Vector3};

/// The scene comes to rest for this many steps before the robot begins, and after a task.
const SETTLING: usize = 300;
/// Where the object must end, m, to be where the person left it.
pub const WITHIN_M: f64 = 0.005;
/// The same of its turn, rad.
pub const WITHIN_RAD: f64 = 3.0 * std::f64::consts::PI / 180.0;
/// One step in so many is recorded: 250 a second.
pub const RECORDED: usize = 4;
/// And one in so many is traced: 100 a second.
const TRACED: usize = 10;
/// No simulation is longer, s.
const LONGEST_S: f64 = 600.0;

/// What came of a task.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Its name.
    pub task: String,
    /// The object.
    pub object: String,
    /// How far the object is from where the person left it, m.
    pub off: f64,
    /// How far it is turned from there, rad; about the axis of a hole that it is in as it should, it may be.
    pub turned: f64,
    /// The largest distance of the palm from where it was to be, m.
    pub palm_error: f64,
    /// The largest force of a fingertip, N.
    pub largest_force: f64,
    /// The mean over time and fingers of how far the fingertip forces are from the commanded ones while held, N.
    pub force_error: f64,
    /// Whether the object is where the person left it.
    pub done: bool,
}

/// What a robot made of commands.
#[derive(Clone, Debug)]
pub struct Performance {
    /// As a person's recording.
    pub recording: Recording,
    /// Of each task.
    pub outcomes: Vec<Outcome>,
    /// How it moved and pressed.
    pub trace: Trace,
}

/// Simulates the commands of one hand in a scene.
///
/// # Errors
/// Commands of a hand that the robot does not have or of both hands, grasps that could not be mapped, poses out of the arm's reach.
pub fn simulate(
    commands: &Commands,
    robot: &Robot,
    scene: &Scene,
    progress: &mut dyn FnMut(f64),
) -> Result<Performance, InputError> {
    let side = commanded_side(commands)?;
    let limb = robot.limb(side)?;
    let lacks = || InputError::new("commands", "are of no hand of the robot");
    let hand = limb.hands.get(&side).cloned().ok_or_else(lacks)?;
    // The scene has the robot's hand in place of the person's.
    let taught_radius = scene.hands.get(&side).map_or(0.010, |hand| hand.tip_radius.0);
    let mut scene = scene.clone();
    let fingers: Vec<Finger> = hand.fingers.iter().map(|finger| finger.finger).collect();
    let tip_radius = hand.fingers.first().map_or(0.007, |finger| finger.radius);
    scene.hands = [(side, Hand { fingers, tip_radius: Quantity(tip_radius) })].into_iter().collect();
    let mut world = World::new(&scene, Fingertips::default())?;
    let gravity = Vector3::from(scene.gravity.map(|part| part.0));
    let mut executor: Option<Executor> = None;
    let mut log = Log::new(&scene, world.observation());
    let mut outcomes = Vec::new();
    let mut trace = Trace { limb: limb.clone(), side, scene: scene.clone(), moments: Vec::new() };
    let mut elapsed = 0_usize;
    let whole: f64 = commands.tasks.iter().map(Task::duration_s).sum::<f64>().max(1e-3);
    let mut done_s = 0.0;
    for (number, task) in commands.tasks.iter().enumerate() {
        let at_task = |message: String| InputError::new(format!("task {} ({})", number + 1, task.task), message);
        let body = scene
            .bodies
            .get_index_of(&task.object)
            .ok_or_else(|| at_task(format!("is about `{}`, which is no body of the scene", task.object)))?;
        let found = world.observation().bodies[body].pose;
        let palm = executor.as_ref().map(Executor::wanted_palm);
        let mut plan = Plan::new(task, &hand, &found, palm.as_ref(), taught_radius).map_err(at_task)?;
        if plan.duration() > LONGEST_S {
            return Err(at_task(format!("takes {:.0} s, at most {LONGEST_S} s are simulated", plan.duration())));
        }
        let mut begins_s = 0.0;
        let runs = match &mut executor {
            Some(runs) => runs,
            None => {
                let (made, from_s) = beginning(&limb, &hand, &plan, gravity).map_err(at_task)?;
                begins_s = from_s;
                let (runs, still) = (executor.insert(made), plan.at(from_s));
                for _ in 0..SETTLING {
                    runs.step(&still, &mut world);
                }
                runs
            }
        };
        begins_s = runs.slow_down(&mut plan, begins_s);
        let mut righting = Righting::default();
        let (mut palm_error, mut largest_force, mut force_errors) = (0.0_f64, 0.0_f64, (0.0, 0.0));
        let steps = ((plan.duration() - begins_s) / STEP_S).round() as usize;
        for step in 0..=steps + SETTLING {
            let time = (begins_s + step as f64 * STEP_S).min(plan.duration());
            let mut target = plan.at(time);
            righting.apply(&mut target, &world.observation().bodies[body].pose, STEP_S);
            runs.step(&target, &mut world);
            if step.is_multiple_of(RECORDED) {
                log.record(world.observation());
            }
            palm_error = palm_error.max((runs.palm().translation.vector - target.palm.translation.vector).norm());
            let seen = world.observation();
            for (index, tip) in seen.hands[0].tips.iter().enumerate() {
                let force = tip.force_on(body);
                largest_force = largest_force.max(force.norm());
                let wanted = target.tips.iter().find(|(finger, ..)| *finger == hand.fingers[index].finger);
                if let Some((.., wanted)) = wanted.filter(|(.., wanted)| wanted.norm() > 0.05) {
                    force_errors = (force_errors.0 + (force - wanted).norm(), force_errors.1 + 1.0);
                }
            }
            if step.is_multiple_of(TRACED) {
                let object = seen.bodies[body].pose;
                let forces = seen.hands[0].tips.iter().map(|tip| {
                    let wanted = target.tips.iter().find(|(finger, ..)| *finger == tip.finger);
                    let wanted = wanted.map_or_else(Vector3::zeros, |(.., force)| *force);
                    let [wanted, exerted] =
                        [wanted, tip.force_on(body)].map(|force| object.inverse_transform_vector(&force));
                    FingerForce { finger: tip.finger, wanted, exerted }
                });
                trace.moments.push(Moment {
                    time_s: elapsed as f64 * STEP_S,
                    task: number,
                    primitive: plan.primitive(time).to_string(),
                    q: runs.motion.q.iter().copied().collect(),
                    root: runs.motion.root,
                    bodies: seen.bodies.iter().map(|body| body.pose).collect(),
                    forces: forces.collect(),
                });
            }
            elapsed += 1;
            if step.is_multiple_of(500) {
                progress(((done_s + time.min(task.duration_s())) / whole).min(1.0));
            }
        }
        done_s += task.duration_s();
        let end = world.observation().bodies[body].pose;
        let wanted = plan.taught_end();
        let off = (end.translation.vector - wanted.translation.vector).norm();
        // What is in a hole may have turned about its axis.
        let axis = |pose: &Isometry3<f64>| axis_of_its_hole(&scene, &task.object, &scene.bodies[body], pose);
        let turned = match (axis(&end), axis(&wanted)) {
            (Some(axis), Some(_)) => {
                let own = |pose: &Isometry3<f64>| pose.inverse_transform_vector(&axis);
                own(&end).angle(&own(&wanted))
            }
            _ => end.rotation.angle_to(&wanted.rotation),
        };
        outcomes.push(Outcome {
            task: task.task.clone(),
            object: task.object.clone(),
            off,
            turned,
            palm_error,
            largest_force,
            force_error: force_errors.0 / f64::max(force_errors.1, 1.0),
            done: off <= WITHIN_M && turned <= WITHIN_RAD,
        });
    }
    Ok(Performance { recording: log.finish(&scene), outcomes, trace })
}

/// The hand that commands are for: one, the same for all tasks.
pub(super) fn commanded_side(commands: &Commands) -> Result<Side, InputError> {
    let refuse = |message: String| InputError::new("commands", message);
    let Some(first) = commands.tasks.first() else { return Err(refuse("have no tasks, nothing is to be done".into())) };
    if commands.tasks.iter().any(|task| task.track != first.track) {
        return Err(refuse(
            "are of both hands, wanted those of one: coordination of two arms is not simulated yet".into(),
        ));
    }
    Side::from_name(&first.track).ok_or_else(|| refuse(format!("are of no hand: `{}`", first.track)))
}
