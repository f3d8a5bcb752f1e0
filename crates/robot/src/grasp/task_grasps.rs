//! Maps commands to a robot: finds the palm pose and the finger angles for each grasp of each task.
//!
//! One pose is chosen for a grasp and kept along its trajectory. Bodies around the object when it is grasped and released are obstacles.

use super::bimanual_grasp::{HandProblem, grasp_pair};
use super::candidate::{GraspCandidate, Reach};
use super::clearance::Shapes;
use super::grasp_planner::GraspPlanner;
use super::grasp_request::{Contact, GraspRequest, Obstacle};
use super::hand_obstacles::{bodies, meeting};
use super::held_path::{FEW, MANY, way};
use super::no_grasp::NoGrasp;
use super::obstacles::{SUNK_M, around, to_blame};
use super::opening::clear_opening;
use super::search::apart;
use crate::kinematics::arm_distance::PlacedShape;
use crate::kinematics::surroundings::Surroundings;
use crate::model::gripper::Jaws;
use crate::model::hand::HandModel;
use crate::model::robot::Robot;
use nalgebra::{Isometry3, Point3, Vector3};
use std::collections::BTreeMap;
use std::sync::OnceLock;
use teachtree_base::error::InputError;
use teachtree_base::hands::Finger;
use teachtree_base::pose::pose_array;
use teachtree_base::scene::{Body, Scene};
use teachtree_command::{self as command, Commands, GraspCriterion, MappedFinger, MappedGrasp, Task};
use teachtree_description::shape::CollisionShape;

/// Number of starts of the arm's inverse kinematics, and steps of each, that decide whether it reaches a pose.
const REACH_STARTS: usize = 48;
const REACH_STEPS: usize = 100;
/// Grasps with which palm and arm keep this distance from fixed bodies are preferred, m: controllers deviate from their paths.
const ROOM_M: f64 = 0.003;
/// Maximum number of different grasps that are checked for one with more room; its measure must be at least the share `WORTH` of the best one's.
const CHECKED: usize = 64;
const WORTH: f64 = 0.3;
/// Largest displacement and rotation of an object by a hand that fumbles for it, m and rad.
const NUDGED_M: f64 = 0.040;
const NUDGED_RAD: f64 = 0.35;
/// Maximum number of alternatives of a grasp, and the smallest difference between them, m (a turn counts as in the search).
const ALTERNATIVES: usize = 256;
const APART_M: f64 = 0.012;

/// A grasp without room beside the other hand: its indices, those of the other hand's grasp, and the reason.
pub(crate) struct BlockedGrasp {
    pub(crate) grasp: (usize, usize),
    pub(crate) other: (usize, usize),
    pub(crate) why: String,
}

/// Maps every grasp of commands, and notes the reason where an object cannot be held.
///
/// If two hands hold one object at the same time, the first hand is an obstacle for the second. If that leaves no room, both grasps are changed. If that is not
/// enough, the grasp is returned as crowded. `progress` receives the part that is done, 0 to 1.
///
/// # Errors
/// A hand that the robot does not have, an object that the scene does not have.
pub(crate) fn map(
    commands: &mut Commands,
    robot: &Robot,
    scene: &Scene,
    criterion: GraspCriterion,
    progress: &mut dyn FnMut(f64),
) -> Result<Vec<BlockedGrasp>, InputError> {
    let mut crowded = Vec::new();
    commands.robot = Some(robot.name.clone());
    let tasks = &mut commands.tasks;
    let holders =
        tasks.iter().enumerate().map(|(number, task)| GraspContext::new(number, task, robot, scene, criterion));
    let holders = holders.collect::<Result<Vec<GraspContext<'_>>, InputError>>()?;
    for (task, holder) in tasks.iter_mut().zip(&holders) {
        holder.give(task);
    }
    let count: usize = tasks.iter().map(|task| task.grasps.len()).sum();
    let mut done = 0;
    for number in 0..tasks.len() {
        for grasp in 0..tasks[number].grasps.len() {
            progress(f64::from(done) / count as f64);
            done += 1;
            let others = meeting(tasks, (number, grasp));
            let taken = bodies(tasks, &others, robot);
            let held = match (holders[number].hold(&tasks[number], grasp, &taken), &others[..]) {
                (Err(why), &[other]) if !taken.is_empty() => {
                    give_way(tasks, &holders, [other, (number, grasp)]).ok_or(why)
                }
                (held, _) => held,
            };
            match held {
                Ok(held) => held.note(&mut tasks[number], grasp),
                Err(why) => {
                    let why = holders[number].explained(&why, &tasks[number], grasp, &taken);
                    let alone = || holders[number].hold(&tasks[number], grasp, &[]).ok();
                    let beside = others.first().filter(|_| others.len() == 1 && !taken.is_empty());
                    match beside.and_then(|other| Some((*other, alone()?))) {
                        Some((other, alone)) => {
                            alone.note(&mut tasks[number], grasp);
                            crowded.push(BlockedGrasp { grasp: (number, grasp), other, why });
                        }
                        None => tasks[number].grasps[grasp].infeasible = Some(why),
                    }
                }
            }
        }
    }
    Ok(crowded)
}

/// Returns the pairs of grasps of two hands that hold the same object at the same time, as task and grasp, each pair once.
pub(crate) fn meetings(tasks: &[Task]) -> Vec<[(usize, usize); 2]> {
    let grasps = tasks.iter().enumerate().flat_map(|(number, task)| (0..task.grasps.len()).map(move |at| (number, at)));
    let pairs = grasps.flat_map(|one| meeting(tasks, one).into_iter().map(move |other| [one, other]));
    pairs.filter(|[one, other]| one < other).collect()
}

/// The result of a search for grasps.
type Search = Result<Vec<TaskGrasp>, InputError>;

/// Alternatives for each grasp of mapped commands by the criterion of that grasp, best first; they differ from each other. It is not checked whether the arm can
/// follow them. They are computed on first use.
pub(crate) struct Alternatives<'a> {
    robot: &'a Robot,
    scene: &'a Scene,
    /// By the indices of the task and its grasp.
    found: BTreeMap<(usize, usize), OnceLock<Search>>,
}

impl<'a> Alternatives<'a> {
    /// Returns the alternatives of all grasps of tasks, not computed yet.
    pub(crate) fn new(tasks: &[Task], robot: &'a Robot, scene: &'a Scene) -> Self {
        let places =
            tasks.iter().enumerate().flat_map(|(number, task)| (0..task.grasps.len()).map(move |at| (number, at)));
        Self { robot, scene, found: places.map(|place| (place, OnceLock::new())).collect() }
    }

    /// Returns the alternatives of a grasp of a task; `number` is the index of the task among all tasks.
    ///
    /// # Errors
    /// As [`map`].
    pub(crate) fn of(&self, task: &Task, (number, grasp): (usize, usize)) -> Result<&[TaskGrasp], InputError> {
        let Some(found) = self.found.get(&(number, grasp)) else { return Ok(&[]) };
        let search = || {
            let criterion = task.grasps[grasp].mapped.as_ref().map(|mapped| mapped.criterion).unwrap_or_default();
            Ok(GraspContext::new(number, task, self.robot, self.scene, criterion)?.alternatives(task, grasp))
        };
        found.get_or_init(search).as_deref().map_err(Clone::clone)
    }
}

/// Finds grasps of two hands on one object that leave room for each other: the first one is noted again, the second one returned.
fn give_way(
    tasks: &mut [Task],
    holders: &[GraspContext<'_>],
    [first, second]: [(usize, usize); 2],
) -> Option<TaskGrasp> {
    // Jaws have no continuous set of poses to adjust.
    if [first, second].iter().any(|(number, _)| holders[*number].hand.jaws.is_some()) {
        return None;
    }
    let alone = holders[second.0].hold(&tasks[second.0], second.1, &[]).ok()?;
    let mut request = [first, second].map(|(number, grasp)| holders[number].request(&tasks[number], grasp, &[]));
    request[1].contacts = alone.contacts;
    let ways = [first, second].map(|(number, grasp)| holders[number].way(&tasks[number], grasp, FEW));
    let reach = [0, 1].map(|which| {
        let (holder, way) = (&holders[[first, second][which].0], &ways[which]);
        move |found: &GraspCandidate| holder.met(way, found)
    });
    let one = |which: usize| {
        let GraspContext { hand, planner, .. } = &holders[[first, second][which].0];
        HandProblem { hand, planner, request: &request[which], reach: &reach[which] }
    };
    let [again, beside] = grasp_pair([&one(0), &one(1)])?;
    let [again, beside] = [(first, 0, again), (second, 1, beside)]
        .map(|((number, _), which, found)| holders[number].held(&request[which], &found));
    again.note(&mut tasks[first.0], first.1);
    Some(beside)
}

/// The hand of a task and its object.
struct GraspContext<'a> {
    robot: &'a Robot,
    hand: &'a HandModel,
    planner: GraspPlanner<'a>,
    object: &'a Body,
    scene: &'a Scene,
    /// The fixed bodies, and the same with the distance that palm and arm keep from them.
    fixed: Surroundings,
    surroundings: Surroundings,
    /// The shapes of the object.
    shapes: Shapes,
}

/// A grasp that was found.
#[derive(Clone)]
pub(crate) struct TaskGrasp {
    mapped: MappedGrasp,
    /// The contacts, assigned to fingers.
    contacts: Vec<Contact>,
}

impl<'a> GraspContext<'a> {
    fn new(
        number: usize,
        task: &Task,
        robot: &'a Robot,
        scene: &'a Scene,
        criterion: GraspCriterion,
    ) -> Result<Self, InputError> {
        let refuse = |message: String| InputError::new(format!("task {} ({})", number + 1, task.task), message);
        let side = task.track;
        let hand = robot
            .hands
            .get(&side)
            .ok_or_else(|| refuse(format!("is of the {side} hand, which robot `{}` does not have", robot.name)))?;
        let object = scene
            .bodies
            .get(&task.object)
            .ok_or_else(|| refuse(format!("is about `{}`, which is not a body of the scene", task.object)))?;
        let fixed = Surroundings::sunk(scene, SUNK_M);
        let surroundings = fixed.clone().with_room(ROOM_M);
        let planner = GraspPlanner::with_criterion(hand, criterion);
        let shapes = Shapes::new(hand, &GraspRequest { contacts: Vec::new(), object, obstacles: Vec::new() });
        Ok(Self { robot, hand, planner, object, scene, fixed, surroundings, shapes })
    }

    /// Converts the operator's task to a gripper.
    fn give(&self, task: &mut Task) {
        let operator = self.scene.hands.get(&task.track);
        if let (Some(jaws), Some(operator)) = (&self.hand.jaws, operator) {
            jaws.take_over(task, self.hand, self.object, operator.tip_radius.0);
        }
    }

    /// Returns the request with `others` as obstacles, frame of the object.
    fn request<'b>(&'b self, task: &Task, grasp: usize, others: &'b [Body]) -> GraspRequest<'b> {
        let obstacles = around(task, grasp, self.scene, others).into_iter().map(|it| it.obstacle).collect();
        let contacts = task.grasps[grasp].contacts.iter().map(contact).collect();
        GraspRequest { contacts, object: self.object, obstacles }
    }

    /// Returns the path of the held object, and its pose before the operator nudged it, which the robot does not repeat.
    fn way(&self, task: &Task, grasp: usize, between: usize) -> Vec<Isometry3<f64>> {
        let mut way = way(task, grasp, between);
        let stood = self.object.pose();
        let nudged = |first: &Isometry3<f64>| {
            let moved = stood.inverse() * first;
            moved.translation.vector.norm() < NUDGED_M && moved.rotation.angle() < NUDGED_RAD
        };
        if way.first().is_some_and(nudged) {
            way.insert(0, stood);
        }
        way
    }

    /// Returns the number of places on the path of the object at which palm, fingers or arm collide with a fixed body, or the arm with itself, in the best posture;
    /// `None` if the arm cannot follow the path. A hand without an arm has no collisions.
    fn met(&self, way: &[Isometry3<f64>], found: &GraspCandidate) -> Option<usize> {
        let (robot, hand) = (self.robot, self.hand);
        if hand.arm.is_empty() {
            return Some(0);
        }
        let way: Vec<Isometry3<f64>> = way.iter().map(|object| object * found.object_from_palm).collect();
        let q = vec![0.0; robot.tree.dofs.len()];
        let (arm, root) = (hand.arm_on(&robot.tree), Isometry3::identity());
        let postures = arm.postures_along(&root, &way, &q, (REACH_STARTS, REACH_STEPS), &self.surroundings);
        let mut least: Option<usize> = None;
        for met in postures.map(|posture| posture.met) {
            least = Some(least.map_or(met, |least| least.min(met)));
            if met == 0 {
                break;
            }
        }
        let mut fingers: Vec<CollisionShape> = Vec::new();
        for finger in &hand.fingers {
            let posture = found.angles(finger.finger).map(|angles| finger.posture(&angles));
            fingers.extend(posture.iter().flat_map(|posture| finger.solids(posture)).map(|(_, solid)| solid));
        }
        let placed = |solids: &[CollisionShape], palm: &Isometry3<f64>| {
            solids.iter().map(|solid| PlacedShape::new(hand.palm, solid.moved(palm))).collect::<Vec<PlacedShape>>()
        };
        let meets = |palm: &&Isometry3<f64>| {
            self.surroundings.meet_any(&placed(&hand.palm_solids, palm)) || self.fixed.meet_any(&placed(&fingers, palm))
        };
        Some(least? + way.iter().filter(meets).count())
    }

    /// Returns the best grasp with `others` as obstacles, frame of the object.
    fn hold(&self, task: &Task, grasp: usize, others: &[Body]) -> Result<TaskGrasp, NoGrasp> {
        let request = self.request(task, grasp, others);
        let ways = [FEW, MANY].map(|between| self.way(task, grasp, between));
        let (found, contacts) = self.found(&request, &ways)?;
        Ok(self.held(&GraspRequest { contacts, ..request }, &found))
    }

    fn held(&self, request: &GraspRequest<'_>, found: &GraspCandidate) -> TaskGrasp {
        TaskGrasp { mapped: self.mapped(request, found), contacts: request.contacts.clone() }
    }

    /// Returns grasps that differ from each other, best first.
    fn alternatives(&self, task: &Task, grasp: usize) -> Vec<TaskGrasp> {
        let request = self.request(task, grasp, &[]);
        let kept = self.distinct_grasps(&request).into_iter();
        kept.map(|(found, contacts)| self.held(&GraspRequest { contacts, ..request.clone() }, &found)).collect()
    }

    /// Returns grasps that differ from each other, best first, with the contacts assigned to fingers.
    fn distinct_grasps(&self, request: &GraspRequest<'_>) -> Vec<(GraspCandidate, Vec<Contact>)> {
        let mut found = Vec::new();
        for contacts in self.contact_orders(&request.contacts) {
            let by = GraspRequest { contacts, ..request.clone() };
            let grasps = self.planner.grasps(&by).unwrap_or_default();
            found.extend(grasps.into_iter().map(|candidate| (candidate, by.contacts.clone())));
        }
        found.sort_by(|(a, _), (b, _)| b.measure.total_cmp(&a.measure));
        let mut kept: Vec<(GraspCandidate, Vec<Contact>)> = Vec::new();
        for (candidate, contacts) in found {
            let pose = &candidate.object_from_palm;
            let differs = |(other, by): &(GraspCandidate, Vec<Contact>)| {
                *by != contacts || apart(pose, &other.object_from_palm) > APART_M
            };
            if kept.len() < ALTERNATIVES && kept.iter().all(differs) {
                kept.push((candidate, contacts));
            }
        }
        kept
    }

    /// Returns the contacts, and the same with the fingers in reverse order if that differs: the order of pushing fingers, or of those opposite the thumb, does not
    /// matter.
    fn contact_orders(&self, contacts: &[Contact]) -> Vec<Vec<Contact>> {
        let other = match &self.hand.jaws {
            Some(jaws) => swapped_jaws(jaws, contacts),
            None => reversed_fingers(contacts),
        };
        let same = |contact: &Contact| contacts.contains(contact);
        let differs = !other.iter().all(same);
        std::iter::once(contacts.to_vec()).chain(differs.then_some(other)).collect()
    }

    /// Returns the best grasp with which the object can be moved along its path, with hand and arm clear where possible, and the contacts assigned to fingers. A
    /// different grasp with more room is taken if its measure is at least the share `WORTH` of the best one's. `ways` are a few places of the path, and many.
    fn found(
        &self,
        request: &GraspRequest<'_>,
        [few, many]: &[Vec<Isometry3<f64>>; 2],
    ) -> Result<(GraspCandidate, Vec<Contact>), NoGrasp> {
        let (_, mut found, mut contacts) = self.reached(request, &|found| self.met(few, found))?;
        let mut least = self.met(many, &found).unwrap_or(usize::MAX);
        if least > 0 {
            let worth = |(other, _): &(GraspCandidate, Vec<Contact>)| other.measure >= WORTH * found.measure;
            let others: Vec<_> = self.distinct_grasps(request).into_iter().filter(worth).take(CHECKED).collect();
            for (other, by) in others {
                let met = || self.met(many, &other).filter(|met| *met < least);
                let Some(met) = self.met(few, &other).and_then(|_| met()) else { continue };
                (least, found, contacts) = (met, other, by);
                if met == 0 {
                    break;
                }
            }
        }
        Ok((found, contacts))
    }

    /// Returns the best grasp with the fewest collisions in either order of the contacts, and their number of places.
    fn reached(
        &self,
        request: &GraspRequest<'_>,
        reach: &Reach<'_>,
    ) -> Result<(usize, GraspCandidate, Vec<Contact>), NoGrasp> {
        let mut best: Result<(usize, GraspCandidate, Vec<Contact>), NoGrasp> = Err(NoGrasp::ArmOutOfReach);
        for (at, contacts) in self.contact_orders(&request.contacts).into_iter().enumerate() {
            let by = GraspRequest { contacts, ..request.clone() };
            match (self.planner.map_where(&by, reach), &best) {
                (Ok((met, found)), Ok((least, ..))) if met < *least => best = Ok((met, found, by.contacts)),
                (Ok((met, found)), Err(_)) => best = Ok((met, found, by.contacts)),
                (Err(why), Err(_)) if at == 0 => best = Err(why),
                _ => {}
            }
            if matches!(best, Ok((0, ..))) {
                break;
            }
        }
        best
    }

    /// Returns the reason why a grasp cannot be held, and the obstacles that prevent it, found by leaving them out.
    fn explained(&self, why: &NoGrasp, task: &Task, grasp: usize, others: &[Body]) -> String {
        let around = around(task, grasp, self.scene, others);
        let way = self.way(task, grasp, FEW);
        let request = self.request(task, grasp, &[]);
        let reach = |found: &GraspCandidate| self.met(&way, found).map(|_| 0);
        let held_with =
            |obstacles: Vec<Obstacle<'_>>| self.reached(&GraspRequest { obstacles, ..request.clone() }, &reach).is_ok();
        match to_blame(&around, &held_with) {
            Some(blamed) => format!("{why}; it could be held without {blamed}"),
            None => why.to_string(),
        }
    }

    /// Returns a grasp in the form of commands.
    fn mapped(&self, request: &GraspRequest<'_>, found: &GraspCandidate) -> MappedGrasp {
        let mut q = vec![0.0; self.robot.tree.dofs.len()];
        found.set(self.hand, &mut q);
        let fingers = found.fingers.iter().map(|held| MappedFinger {
            finger: held.finger,
            manipulability: held.manipulability,
            freedom: held.freedom,
            pad_angle_deg: held.pad_angle.to_degrees(),
            alignment: Some(held.alignment),
        });
        MappedGrasp {
            object_from_palm: pose_array(&found.object_from_palm),
            joints: joints(self.robot, self.hand, &q),
            arm: BTreeMap::new(),
            criterion: self.planner.criterion(),
            measure: found.measure,
            friction_margin: Some(found.friction_margin),
            copied_measure: self.planner.copied(request),
            opening: found.opening,
            opens: clear_opening(self.hand, &self.shapes, &request.contacts, found),
            fingers: fingers.collect(),
        }
    }
}

impl TaskGrasp {
    /// Writes it into a task.
    pub(crate) fn note(self, task: &mut Task, grasp: usize) {
        rename(task, grasp, &self.contacts);
        task.grasps[grasp].mapped = Some(self.mapped);
        task.grasps[grasp].infeasible = None;
    }
}

fn contact(contact: &command::Contact) -> Contact {
    Contact { finger: contact.finger, point: Point3::from(contact.point), normal: Vector3::from(contact.normal) }
}

/// Returns the same contacts with the fingers in reverse order; the thumb stays.
fn reversed_fingers(contacts: &[Contact]) -> Vec<Contact> {
    let (mut turned, row): (Vec<Contact>, Vec<Contact>) =
        contacts.iter().partition(|contact| contact.finger == Finger::Thumb);
    let fingers = row.iter().map(|contact| contact.finger);
    turned.extend(row.iter().rev().zip(fingers).map(|(contact, finger)| Contact { finger, ..*contact }));
    turned
}

/// Returns the same contacts with the jaws exchanged.
fn swapped_jaws(jaws: &Jaws, contacts: &[Contact]) -> Vec<Contact> {
    contacts.iter().map(|contact| Contact { finger: jaws.opponent(contact.finger), ..*contact }).collect()
}

/// Reassigns the motion of a finger in a grasp to the finger that now has its contact.
fn rename(task: &mut Task, grasp: usize, contacts: &[Contact]) {
    let before: Vec<Contact> = task.grasps[grasp].contacts.iter().map(contact).collect();
    let now = |finger: Finger| {
        let point = before.iter().find(|contact| contact.finger == finger)?.point;
        contacts.iter().find(|contact| contact.point == point).map(|contact| contact.finger)
    };
    for contact in &mut task.grasps[grasp].contacts {
        contact.finger = now(contact.finger).unwrap_or(contact.finger);
    }
    for tip in task.segments.iter_mut().filter(|segment| segment.grasp == Some(grasp)).flat_map(|it| &mut it.tips) {
        tip.finger = now(tip.finger).unwrap_or(tip.finger);
    }
}

fn joints(robot: &Robot, hand: &HandModel, q: &[f64]) -> BTreeMap<String, f64> {
    let dofs = hand.fingers.iter().flat_map(|finger| &finger.dofs);
    dofs.map(|&dof| (robot.tree.dofs[dof].name.clone(), q[dof])).collect()
}
