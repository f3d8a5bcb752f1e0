//! The robot in the world: commands in, a recording of what the robot did and a verdict on each task out.
//!
//! Every millisecond the plans give targets, the arms' inverse kinematics follows the palms, the controllers give torques, the robot's
//! dynamics and the world's bodies move, and fingertips press on bodies by the law of the virtual environment. Only fingertips touch.
//! Tasks of both hands that overlap run by one clock ([`super::clock`]).

use super::clock::Pace;
use super::doer::{Doer, Place};
use super::executor::Executor;
use super::falls::Falls;
use super::firmness::Firmness;
use super::log::Log;
use super::mapping::from_seven;
use super::passing::{Nearest, look};
use super::plan::{Plan, Target};
use super::profile::{Forces, Profile};
use super::righting::{Righting, holds};
use super::searching::{Felt, Searched, Searching};
use super::stage::{Stage, sides, stages};
use super::trace::{FingerForce, Limb, Moment, Stance, Trace};
use super::tree::Robot;
use crate::base::error::InputError;
use crate::base::hands::{Finger, Side};
use crate::base::quantity::Quantity;
use crate::base::recording::Recording;
use crate::base::scene::{Hand, Scene};
use crate::command::{Commands, Task, hole_of};
use crate::world::{Fingertips, Observation, STEP_S, World};
use nalgebra::{Isometry3, Translation3, Vector3};

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
/// Forces that are commanded above this are compared with what is exerted, N.
const COMPARED_N: f64 = 0.05;

/// What came of a task.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Its name.
    pub task: String,
    /// The hand that did it.
    pub side: Side,
    /// The object.
    pub object: String,
    /// How far the object is from where the person left it, m; when another hand took it on, from where that one left it.
    pub off: f64,
    /// How far it is turned from there, rad; about the axis of a hole that it is in as it should, it may be.
    pub turned: f64,
    /// How far it leans from how it stood there, rad.
    pub leaning: f64,
    /// How fast it still moves when it is looked at, m/s.
    pub speed: f64,
    /// The largest distance of the palm from where it was to be, m.
    pub palm_error: f64,
    /// The largest force of a fingertip, N.
    pub largest_force: f64,
    /// The mean over time and fingers of how far the fingertip forces are from the commanded ones while held, N.
    pub force_error: f64,
    /// How contact forces were beside their profile.
    pub forces: Forces,
    /// What came of feeling for a hole that was not where it was expected; `None` where that was not needed.
    pub searched: Option<Searched>,
    /// When the object fell off for good, s of the recording: it is far below everything then, and nothing more is done with it.
    pub fell_s: Option<f64>,
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
    /// Where its two arms came nearest to each other; `None` for one.
    pub nearest: Option<Nearest>,
    /// How it moved and pressed.
    pub trace: Trace,
}

/// A hand that performs: what it is, and what it remembers from one step to the next.
struct Performer {
    doer: Doer,
    righting: Righting,
    firmness: Firmness,
    target: Target,
}

/// What is gathered about a task while it is performed.
#[derive(Clone, Copy, Default)]
struct Tally {
    palm_error: f64,
    largest_force: f64,
    force_errors: (f64, f64),
    profile: Profile,
}

/// Simulates commands in a scene. What has fallen off is not waited for: the tasks about it end, and with the last of them the recording.
///
/// # Errors
/// Commands of a hand that the robot does not have, grasps that could not be mapped, poses out of the arm's reach.
pub fn simulate(
    commands: &Commands,
    robot: &Robot,
    scene: &Scene,
    progress: &mut dyn FnMut(f64),
) -> Result<Performance, InputError> {
    simulate_seeing(commands, robot, scene, &Vector3::zeros(), progress)
}

/// The same by a robot that sees every object this far from where it is, reference frame, m.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_seeing(
    commands: &Commands,
    robot: &Robot,
    scene: &Scene,
    off: &Vector3<f64>,
    progress: &mut dyn FnMut(f64),
) -> Result<Performance, InputError> {
    let sight = Translation3::from(*off);
    let seen = |world: &World, object: &str| {
        let body = scene.bodies.get_index_of(object)?;
        world.observation().bodies.get(body).map(|body| sight * body.pose)
    };
    let tasks = &commands.tasks;
    let sides = sides(commands, robot)?;
    let limbs = sides.iter().map(|&side| robot.limb(side)).collect::<Result<Vec<Robot>, InputError>>()?;
    let with_robot = with_hands(scene, &sides, &limbs);
    let mut world = World::new(&with_robot, Fingertips::default())?;
    let gravity = gravity_of(scene);
    let (mut performers, mut executors) = (Vec::new(), Vec::new());
    for (&side, limb) in sides.iter().zip(&limbs) {
        let (doer, runs, target) = Doer::begin(side, limb, tasks, scene, &|object| seen(&world, object))?;
        executors.push(runs);
        performers.push(Performer { doer, righting: Righting::new(gravity), firmness: Firmness::default(), target });
    }
    let scene = with_robot;
    for _ in 0..SETTLING {
        for (place, (runs, performer)) in executors.iter_mut().zip(&performers).enumerate() {
            runs.aim(&performer.target, &exerted(world.observation(), place));
        }
        world.step_moved(&mut executors);
    }
    let mut log = Log::new(&scene, world.observation());
    let limbs = sides.into_iter().zip(limbs).map(|(side, robot)| Limb { side, robot }).collect();
    let mut trace = Trace { limbs, scene: scene.clone(), moments: Vec::new() };
    let mut outcomes: Vec<Option<Outcome>> = vec![None; tasks.len()];
    let mut searches: Vec<Searching> = tasks.iter().map(|task| Searching::new(task, &scene)).collect();
    let mut elapsed = 0_usize;
    let mut nearest = None;
    let mut falls = Falls::new(&scene, &gravity);
    let body_of = |number: usize| scene.bodies.get_index_of(&tasks[number].object).unwrap_or_default();
    let lost = |falls: &Falls, number: &usize| falls.fell_s(body_of(*number)).is_some();
    let stages = stages(tasks);
    let lasts = |stage: &[usize]| stage.iter().map(|number| tasks[*number].duration_s()).fold(0.0, f64::max);
    let whole: f64 = stages.iter().map(|stage| lasts(stage)).sum::<f64>().max(1e-3);
    let mut done_s = 0.0;
    for together in &stages {
        let numbers: Vec<usize> = together.iter().copied().filter(|number| !lost(&falls, number)).collect();
        let numbers = numbers.as_slice();
        let (stage, from_s) = plan(tasks, numbers, &mut performers, &executors, &|object| seen(&world, object))?;
        let begins_s = stage.begins_s(&from_s);
        for performer in &mut performers {
            (performer.righting, performer.firmness) = (Righting::new(gravity), Firmness::default());
        }
        let tally = |task| Tally { profile: Profile::of(task), ..Tally::default() };
        let mut tallies: Vec<Tally> = tasks.iter().map(tally).collect();
        let steps = ((stage.clock.duration() - begins_s) / STEP_S).round() as usize;
        let (mut step, mut pace) = (0, Pace::default());
        while step <= steps + SETTLING + (pace.waited_s() / STEP_S) as usize
            && !numbers.iter().all(|number| lost(&falls, number))
        {
            let time = begins_s + (step as f64 * STEP_S - pace.waited_s());
            let now: Vec<Option<(usize, &Plan<'_>, f64)>> =
                from_s.iter().enumerate().map(|(place, from_s)| stage.at(place, time, *from_s)).collect();
            let seen = |name: &str| {
                let body = scene.bodies.get_index_of(name)?;
                Some(sight * world.observation().bodies[body].pose)
            };
            let mut waits = false;
            for (place, (performer, now)) in performers.iter_mut().zip(&now).enumerate() {
                let Some((number, plan, own)) = now else { continue };
                performer.target = plan.at(*own);
                if lost(&falls, number) {
                    continue;
                }
                // What two hands push neither of them goes about: it would turn away before the other one.
                let alike = |other: &usize| tasks[*other].object == tasks[*number].object;
                let alone = |other: &usize| tasks[*other].track == tasks[*number].track;
                performer.target.pushed &= numbers.iter().filter(|other| alike(other)).all(alone);
                // The hole is where its body is, which need not be where the person's was; what is not known of it is felt.
                let task = &tasks[*number];
                let off =
                    task.into.as_ref().and_then(|into| Some(seen(&into.body)? * from_seven(&into.pose).inverse()));
                if let Some(off) = &off {
                    performer.target.lean(off, plan.leans(*own));
                }
                let Some(object) = seen(&task.object) else { continue };
                let felt = Felt { object, force: force_on(&task.object, world.observation(), &scene, place) };
                let (off, inserts) = (off.unwrap_or_else(Isometry3::identity), plan.primitive(*own) == "Insert");
                waits |= searches[*number].apply(&mut performer.target, &felt, &off, inserts, STEP_S);
            }
            let held: Vec<Option<&str>> = performers
                .iter()
                .zip(&now)
                .map(|(performer, now)| {
                    now.filter(|(number, ..)| !lost(&falls, number))
                        .filter(|_| holds(&performer.target) || performer.target.pushed)
                        .map(|(number, ..)| tasks[number].object.as_str())
                })
                .collect();
            for (place, (performer, runs)) in performers.iter_mut().zip(&mut executors).enumerate() {
                if let Some((number, ..)) = now[place].filter(|(number, ..)| !lost(&falls, number)) {
                    let (object, body) = (tasks[number].object.as_str(), body_of(number));
                    let shared = held.iter().enumerate().any(|(other, held)| other != place && *held == Some(object));
                    let pose = sight * world.observation().bodies[body].pose;
                    performer.righting.apply(&mut performer.target, &pose, shared, STEP_S);
                    let tips = &world.observation().hands[place].tips;
                    performer.firmness.apply(&mut performer.target, &performer.doer.hand, tips, body, STEP_S);
                }
                runs.aim(&performer.target, &exerted(world.observation(), place));
            }
            world.step_moved(&mut executors);
            let seen = world.observation();
            falls.look(seen, elapsed as f64 * STEP_S);
            if step.is_multiple_of(RECORDED) {
                log.record(seen);
            }
            for (place, (performer, runs)) in performers.iter().zip(&executors).enumerate() {
                let Some((number, plan, own)) = now[place] else { continue };
                let body = body_of(number);
                tallies[number].note(performer, runs, seen, place, body);
                if step.is_multiple_of(TRACED) {
                    trace.moments.push(Moment {
                        time_s: elapsed as f64 * STEP_S,
                        task: number,
                        limb: place,
                        primitive: plan.primitive(own).to_string(),
                        stances: executors.iter().map(stance).collect(),
                        bodies: seen.bodies.iter().map(|body| body.pose).collect(),
                        forces: forces(&performer.target, seen, place, body),
                    });
                }
            }
            if step.is_multiple_of(TRACED) {
                look(&executors, elapsed as f64 * STEP_S, &mut nearest);
            }
            elapsed += 1;
            step += 1;
            pace.go_on(waits, STEP_S);
            if step.is_multiple_of(500) {
                progress(((done_s + (step as f64 * STEP_S).min(lasts(together))) / whole).min(1.0));
            }
        }
        done_s += lasts(together);
        // Those whose object is lost already are told of too.
        for &number in together {
            let task = &tasks[number];
            let Some(by) = performers.iter().find(|performer| performer.doer.side.name() == task.track) else {
                continue;
            };
            let end = stage.taught_end(tasks, &task.object);
            let (searched, fell_s) = (searches[number].searched(), falls.fell_s(body_of(number)));
            let judged = tallies[number].judge(task, by, searched, &end, &scene, world.observation());
            outcomes[number] = Some(Outcome { fell_s, done: judged.done && fell_s.is_none(), ..judged });
        }
    }
    let outcomes = outcomes.into_iter().flatten().collect();
    Ok(Performance { recording: log.finish(&scene), outcomes, nearest, trace })
}

/// The scene with the robot's hands in place of the person's.
fn with_hands(scene: &Scene, sides: &[Side], limbs: &[Robot]) -> Scene {
    let mut scene = scene.clone();
    let hands = sides.iter().zip(limbs).filter_map(|(side, limb)| {
        let hand = limb.hands.get(side)?;
        let fingers: Vec<Finger> = hand.fingers.iter().map(|finger| finger.finger).collect();
        let tip_radius = hand.fingers.first().map_or(0.007, |finger| finger.radius);
        Some((*side, Hand { fingers, tip_radius: Quantity(tip_radius) }))
    });
    scene.hands = hands.collect();
    scene
}

fn gravity_of(scene: &Scene) -> Vector3<f64> {
    Vector3::from(scene.gravity.map(|part| part.0))
}

/// The plans of a stage for hands that are where they are, and when of its own plans each begins, s.
fn plan<'a>(
    tasks: &'a [Task],
    numbers: &[usize],
    performers: &mut [Performer],
    executors: &[Executor],
    place: &Place<'_>,
) -> Result<(Stage<'a>, Vec<f64>), InputError> {
    let (mut hands, mut begins) = (Vec::new(), Vec::new());
    for (performer, runs) in performers.iter_mut().zip(executors) {
        // As slow as the arm needs it.
        let mut q = runs.wanted();
        let stretch = &mut |plan: &mut Plan<'a>, from_s: f64| runs.slow_down(plan, from_s, &mut q);
        let (plans, from_s) = performer.doer.plans(tasks, numbers, runs.robot(), runs.wanted_palm(), place, stretch)?;
        hands.push(plans);
        begins.push(from_s);
    }
    Ok((Stage::new(hands), begins))
}

/// The force of a hand on a body.
fn force_on(name: &str, seen: &Observation, scene: &Scene, hand: usize) -> Vector3<f64> {
    let body = scene.bodies.get_index_of(name).unwrap_or_default();
    seen.hands[hand].tips.iter().map(|tip| tip.force_on(body)).sum()
}

/// The forces of a hand's fingertips.
fn exerted(seen: &Observation, hand: usize) -> Vec<Vector3<f64>> {
    seen.hands[hand].tips.iter().map(|tip| tip.touches.iter().map(|touch| touch.force).sum()).collect()
}

fn stance(runs: &Executor) -> Stance {
    Stance { q: runs.motion.q.iter().copied().collect(), root: runs.motion.root }
}

/// Commanded and exerted forces on a task's object, in its frame.
fn forces(target: &Target, seen: &Observation, hand: usize, body: usize) -> Vec<FingerForce> {
    let object = seen.bodies[body].pose;
    let forces = seen.hands[hand].tips.iter().map(|tip| {
        let wanted = target.tips.iter().find(|(finger, ..)| *finger == tip.finger);
        let wanted = wanted.map_or_else(Vector3::zeros, |(.., force)| *force);
        let [wanted, exerted] = [wanted, tip.force_on(body)].map(|force| object.inverse_transform_vector(&force));
        FingerForce { finger: tip.finger, wanted, exerted }
    });
    forces.collect()
}

impl Tally {
    fn note(&mut self, performer: &Performer, runs: &Executor, seen: &Observation, hand: usize, body: usize) {
        let target = &performer.target;
        self.profile.note(target, &performer.doer.hand, &seen.hands[hand].tips, body);
        let off = (runs.palm().translation.vector - target.palm.translation.vector).norm();
        self.palm_error = self.palm_error.max(off);
        for tip in &seen.hands[hand].tips {
            let force = tip.force_on(body);
            self.largest_force = self.largest_force.max(force.norm());
            let wanted = target.tips.iter().find(|(finger, ..)| *finger == tip.finger);
            if let Some((.., wanted)) = wanted.filter(|(.., wanted)| wanted.norm() > COMPARED_N) {
                self.force_errors = (self.force_errors.0 + (force - wanted).norm(), self.force_errors.1 + 1.0);
            }
        }
    }

    /// What came of a task whose object was to end at `wanted`.
    fn judge(
        &self,
        task: &Task,
        by: &Performer,
        searched: Option<Searched>,
        wanted: &Isometry3<f64>,
        scene: &Scene,
        seen: &Observation,
    ) -> Outcome {
        let body = scene.bodies.get_index_of(&task.object).unwrap_or_default();
        let end = seen.bodies[body].pose;
        let off = (end.translation.vector - wanted.translation.vector).norm();
        // What is in a hole may have turned about its axis.
        let now = |name: &str| scene.bodies.get_index_of(name).map(|body| seen.bodies[body].pose);
        let axis = |pose: &Isometry3<f64>| hole_of(scene, &task.object, pose, &now).map(|hole| hole.axis);
        let turned = match (axis(&end), axis(wanted)) {
            (Some(axis), Some(_)) => {
                let own = |pose: &Isometry3<f64>| pose.inverse_transform_vector(&axis);
                own(&end).angle(&own(wanted))
            }
            _ => end.rotation.angle_to(&wanted.rotation),
        };
        let up = wanted.rotation.inverse() * Vector3::z();
        Outcome {
            task: task.task.clone(),
            side: by.doer.side,
            object: task.object.clone(),
            off,
            turned,
            leaning: (end.rotation * up).angle(&Vector3::z()),
            speed: seen.bodies[body].velocity.norm(),
            palm_error: self.palm_error,
            largest_force: self.largest_force,
            force_error: self.force_errors.0 / f64::max(self.force_errors.1, 1.0),
            forces: self.profile.judge(),
            searched,
            fell_s: None,
            done: off <= WITHIN_M && turned <= WITHIN_RAD,
        }
    }
}
