//! Simulates a robot that executes commands; returns a recording of the robot and a verdict on each task.
//!
//! Every millisecond the plans give targets, behaviors correct them, inverse kinematics follows the palms, and the controllers give torques. Then the robot's
//! dynamics and the world's bodies advance, and fingertips press on bodies by the law of the virtual environment. Only fingertips have contacts.
//! Tasks of both hands that overlap run on one time scale ([`crate::planning::time_scale`]).

use super::cell_variation::CellVariation;
use super::hand_agent::HandAgent;
use super::observer::Step;
use super::observers::Observers;
use super::observers::arm_clearance::{ACCEPTED_M, Collision, MinDistances};
use super::observers::judge::{Findings, TaskOutcome};
use super::pose_sensor::PoseSensor;
use super::trace::{Limb, Trace};
use crate::control::behavior::Progress;
use crate::model::robot::Robot;
use crate::planning::schedule::{Schedule, at_task, groups, sides};
use crate::planning::time_scale::Pause;
use nalgebra::Isometry3;
use teachtree_base::error::InputError;
use teachtree_base::hands::{Finger, Side};
use teachtree_base::quantity::Quantity;
use teachtree_base::recording::Recording;
use teachtree_base::scene::{Hand, Scene};
use teachtree_command::{Commands, Task};
use teachtree_world::{STEP_S, World};

/// The scene comes to rest for this many steps before the robot begins, and after a task.
const SETTLING: usize = 300;
/// Number of steps from one progress report to the next.
const REPORTED: usize = 500;

/// The result of a simulation.
#[derive(Clone, Debug)]
pub struct Performance {
    /// The recording, in the form of the operator's recording.
    pub recording: Recording,
    /// The outcome of each task.
    pub outcomes: Vec<TaskOutcome>,
    /// The minimum distances between its links, and between links and bodies.
    pub nearest: MinDistances,
    /// The collisions of its links, one for each pair, in order of time.
    pub collisions: Vec<Collision>,
    /// The motion and forces of the robot.
    pub trace: Trace,
}

/// Simulates commands in a scene. The tasks of an object that has fallen off end at once, and the recording ends with the last task.
///
/// # Errors
/// Commands of a hand that the robot does not have, grasps that could not be mapped, poses out of the arm's reach.
pub fn simulate(
    commands: &Commands,
    robot: &Robot,
    scene: &Scene,
    progress: &mut dyn FnMut(f64),
) -> Result<Performance, InputError> {
    simulate_varied(commands, robot, scene, &CellVariation::default(), progress)
}

/// Like [`simulate`], in a cell that differs from the scene by `variation`. The plans are those for the scene; the robot knows objects by their measured poses only.
///
/// # Errors
/// As [`simulate`]; an object that the variation puts into another body.
pub fn simulate_varied(
    commands: &Commands,
    robot: &Robot,
    scene: &Scene,
    variation: &CellVariation,
    progress: &mut dyn FnMut(f64),
) -> Result<Performance, InputError> {
    simulate_within(commands, robot, scene, variation, Extent::Whole, progress)
}

/// How much of the commands is simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// All tasks.
    Whole,
    /// All tasks until one is not done.
    UntilNotDone,
    /// The same, or until a link penetrates something by more than [`ACCEPTED_M`].
    UntilFault,
}

/// Like [`simulate_varied`]; ends early as `extent` says. The result then has the tasks that were performed.
///
/// # Errors
/// As [`simulate_varied`].
pub fn simulate_within(
    commands: &Commands,
    robot: &Robot,
    scene: &Scene,
    variation: &CellVariation,
    extent: Extent,
    progress: &mut dyn FnMut(f64),
) -> Result<Performance, InputError> {
    let mut simulation = Simulation::begin(commands, robot, scene, variation, extent)?;
    let groups = groups(&commands.tasks);
    let lasts = |group: &[usize]| group.iter().map(|task| commands.tasks[*task].duration_s()).fold(0.0, f64::max);
    let whole_s: f64 = groups.iter().map(|group| lasts(group)).sum::<f64>().max(1e-3);
    let mut done_s = 0.0;
    for group in &groups {
        let lasts_s = lasts(group);
        simulation.perform(group, &mut |since_s| progress(((done_s + since_s.min(lasts_s)) / whole_s).min(1.0)))?;
        done_s += lasts_s;
        if simulation.is_over(group) {
            break;
        }
    }
    Ok(simulation.finish())
}

/// A simulation at a step.
struct Simulation<'t> {
    tasks: &'t [Task],
    /// The varied scene with the robot's hands, and the index of each task's object among its bodies.
    scene: Scene,
    bodies: Vec<usize>,
    /// The sensor of the objects' poses.
    sensor: PoseSensor,
    world: World,
    hands: Vec<HandAgent<'t>>,
    step: usize,
    observers: Observers,
    outcomes: Vec<Option<TaskOutcome>>,
    extent: Extent,
}

impl<'t> Simulation<'t> {
    /// Returns the simulation with the hands at their first targets in a scene at rest.
    fn begin(
        commands: &'t Commands,
        robot: &Robot,
        scene: &Scene,
        variation: &CellVariation,
        extent: Extent,
    ) -> Result<Self, InputError> {
        let tasks = &commands.tasks;
        let sides = sides(commands, robot)?;
        let limbs = sides.iter().map(|&side| robot.limb(side)).collect::<Result<Vec<Robot>, InputError>>()?;
        let own = with_hands(&variation.scene(scene, tasks)?, &sides, &limbs);
        let mut world = World::new(&own, variation.fingertips())?;
        for (place, (side, limb)) in sides.iter().zip(&limbs).enumerate() {
            for finger in limb.hands.get(side).iter().flat_map(|hand| &hand.fingers) {
                if let Some(radius) = finger.pad_radius {
                    world.set_pad(place, finger.finger, radius);
                }
            }
        }
        let mut sensor = PoseSensor::new(variation, world.observation());
        let see = |object: &str| measured(&own, &sensor, object);
        let motor_delay = variation.motor_delay_steps();
        let mut hands = Vec::new();
        for (place, (&side, limb)) in sides.iter().zip(&limbs).enumerate() {
            hands.push(HandAgent::begin((place, side), limb, tasks, scene, &see, motor_delay)?);
        }
        let mut bodies = Vec::new();
        for (number, task) in tasks.iter().enumerate() {
            let lacks =
                || at_task(tasks, number, format!("is about `{}`, which is not a body of the scene", task.object));
            bodies.push(own.bodies.get_index_of(&task.object).ok_or_else(lacks)?);
        }
        for _ in 0..SETTLING {
            hands.iter_mut().for_each(|hand| hand.actuate(world.observation()));
            sensor.measure(world.step_moved(&mut hands));
        }
        let limbs = sides.into_iter().zip(limbs).map(|(side, robot)| Limb { side, robot }).collect();
        let observers = Observers::new(limbs, &own, tasks, world.observation());
        let outcomes = vec![None; tasks.len()];
        Ok(Self { tasks, scene: own, bodies, sensor, world, hands, step: 0, observers, outcomes, extent })
    }

    /// Performs a group of tasks, and judges them; `progress` receives the simulated time, s.
    fn perform(&mut self, group: &[usize], progress: &mut dyn FnMut(f64)) -> Result<(), InputError> {
        let there: Vec<usize> = group.iter().copied().filter(|task| !self.is_lost(*task)).collect();
        let schedule = self.plan(&there)?;
        let begins_s = schedule.begins_s();
        let steps = ((schedule.time.duration() - begins_s) / STEP_S).round() as usize;
        let (mut step, mut pause) = (0, Pause::default());
        while step <= steps + SETTLING + (pause.waited_s() / STEP_S) as usize
            && !there.iter().all(|task| self.is_lost(*task))
            && !self.is_over(group)
        {
            self.follow(&schedule, begins_s + (step as f64 * STEP_S - pause.waited_s()), &there);
            let waits = self.behave();
            self.hands.iter_mut().for_each(|hand| hand.actuate(self.world.observation()));
            self.sensor.measure(self.world.step_moved(&mut self.hands));
            self.observe(step);
            step += 1;
            pause.advance(waits, STEP_S);
            if step.is_multiple_of(REPORTED) {
                progress(step as f64 * STEP_S);
            }
        }
        self.judge(group, &schedule);
        Ok(())
    }

    /// Whether the simulation ends early in or after a group of tasks.
    fn is_over(&self, group: &[usize]) -> bool {
        let failed = |task: &usize| {
            let not_done = self.outcomes[*task].as_ref().is_some_and(|outcome| !outcome.done);
            let collides = || self.observers.clearance.depth_m(*task) > ACCEPTED_M;
            not_done || self.is_lost(*task) || self.extent == Extent::UntilFault && collides()
        };
        self.extent != Extent::Whole && group.iter().any(failed)
    }

    /// Whether the object of a task is lost.
    fn is_lost(&self, task: usize) -> bool {
        self.observers.drops.fell_s(self.bodies[task]).is_some()
    }

    /// Returns the schedule of tasks for the current poses of the hands.
    fn plan(&mut self, group: &[usize]) -> Result<Schedule<'t>, InputError> {
        let Self { tasks, scene, sensor, hands, .. } = self;
        let see = |object: &str| measured(scene, sensor, object);
        let plans = hands.iter_mut().map(|hand| hand.plan(tasks, group, scene, &see)).collect::<Result<_, _>>()?;
        Ok(Schedule::new(plans))
    }

    /// Gives each hand the target of its plan at a time of the schedule, s.
    fn follow(&mut self, schedule: &Schedule<'t>, time_s: f64, group: &[usize]) {
        let Self { tasks, scene, sensor, hands, bodies, observers, .. } = self;
        let see = |object: &str| measured(scene, sensor, object);
        let lost = |body: usize| observers.drops.fell_s(body).is_some();
        for (place, hand) in hands.iter_mut().enumerate() {
            hand.follow(schedule.at(place, time_s), tasks, bodies, &see, &lost);
            if let Some(doing) = hand.at_work() {
                // Fingers do not move around an object that two hands push: it would turn away from the other hand.
                let alike = |other: &&usize| tasks[**other].object == tasks[doing.task].object;
                let alone = |other: &usize| tasks[*other].track == tasks[doing.task].track;
                hand.target.pushed &= group.iter().filter(alike).all(alone);
            }
        }
    }

    /// Applies the behaviors to the targets, one after the other for all hands. Returns whether the plans wait.
    fn behave(&mut self) -> bool {
        let Self { world, sensor, hands, .. } = self;
        let seen = world.observation();
        let mut waits = false;
        for behavior in 0..hands.iter().map(HandAgent::n_behaviors).max().unwrap_or(0) {
            let held: Vec<Option<usize>> = hands.iter().map(HandAgent::holds).collect();
            for (place, hand) in hands.iter_mut().enumerate() {
                let Some(body) = hand.at_work().map(|doing| doing.body) else { continue };
                let shared = held.iter().enumerate().any(|(other, held)| other != place && *held == Some(body));
                let object = sensor.poses()[body];
                waits |= hand.behave(behavior, object, shared, seen) == Progress::Wait;
            }
        }
        waits
    }

    /// Passes a step, with its number in the group, to the observers.
    fn observe(&mut self, in_group: usize) {
        let step = Step { number: self.step, in_group, seen: self.world.observation(), hands: &self.hands };
        self.observers.all().into_iter().for_each(|observer| observer.observe(&step));
        self.step += 1;
    }

    /// Judges the tasks of a group, also those whose object was lost before.
    fn judge(&mut self, group: &[usize], schedule: &Schedule<'t>) {
        for &number in group {
            let (task, body) = (&self.tasks[number], self.bodies[number]);
            let Some(hand) = self.hands.iter().find(|hand| hand.planner.side == task.track) else { continue };
            let found = Findings {
                side: hand.planner.side,
                searched: hand.searched(number),
                fell_s: self.observers.drops.fell_s(body),
                forces: self.observers.forces.judge(number),
                collision_m: self.observers.clearance.depth_m(number),
                causes: self.observers.causes.of(number),
            };
            let end = schedule.demonstrated_end(self.tasks, &task.object);
            let seen = self.world.observation();
            let outcome = self.observers.judge.outcome((number, task), body, found, &end, &self.scene, seen);
            self.outcomes[number] = Some(outcome);
        }
    }

    fn finish(self) -> Performance {
        let Observers { recorder, tracer, clearance, .. } = self.observers;
        Performance {
            recording: recorder.finish(&self.scene),
            outcomes: self.outcomes.into_iter().flatten().collect(),
            nearest: clearance.nearest,
            collisions: clearance.collisions,
            trace: tracer.trace,
        }
    }
}

/// Returns the measured pose of an object, reference frame.
fn measured(scene: &Scene, sensor: &PoseSensor, object: &str) -> Option<Isometry3<f64>> {
    sensor.poses().get(scene.bodies.get_index_of(object)?).copied()
}

/// Returns the scene with the robot's hands in place of the operator's.
fn with_hands(scene: &Scene, sides: &[Side], limbs: &[Robot]) -> Scene {
    let mut scene = scene.clone();
    let hands = sides.iter().zip(limbs).filter_map(|(side, limb)| {
        let hand = limb.hands.get(side)?;
        let fingers: Vec<Finger> = hand.fingers.iter().map(|finger| finger.finger).collect();
        let tip_radius = hand.fingers.first()?.radius;
        Some((*side, Hand { fingers, tip_radius: Quantity(tip_radius) }))
    });
    scene.hands = hands.collect();
    scene
}
