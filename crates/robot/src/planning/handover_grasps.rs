//! Grasps for handing an object from one hand to the other: both grasps, their paths, and the postures of the arms are chosen so that the arms do not go
//! through each other.
//!
//! Pairs of grasps are checked in the order of their measures: first the hands alone, closed on the object, and opened on their paths while the other one
//! holds it; then both arms, which follow their tasks by inverse kinematics, in every posture in which they can begin. The time scale of both hands
//! determines which of their steps are simultaneous, so that a pair is judged by gaps alone: those between the arms, and those to fixed bodies. The first pair with
//! enough room is taken, otherwise the pair with the most room, or the previous grasps if all pairs collide.

use super::axial_retreat::{Leg, offsets, turn};
use super::bimanual_separation;
use super::hand_planner::tip_radius;
use super::lift_over::lift;
use super::resolved_grasp::ResolvedGrasp;
use super::rollout::{Conflicts, ROOM_M, Rollout};
use super::schedule::groups;
use crate::grasp::held_path::held;
use crate::grasp::task_grasps::{self, Alternatives, BlockedGrasp, TaskGrasp, meetings};
use crate::kinematics::arm_distance::{PlacedShape, nearer};
use crate::model::robot::Robot;
use crate::parallel;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::sync::OnceLock;
use teachtree_base::error::InputError;
use teachtree_base::scene::Scene;
use teachtree_command::{Commands, GraspCriterion, Task};
use teachtree_description::shape::SHORT_M;

/// Distance from the object up to which paths are checked, m, and the number of places.
const NEAR_M: f64 = 0.16;
const PLACES: usize = 8;
/// Maximum number of pairs that are checked with their arms, and of those that are checked in parallel.
const PAIRS: usize = 60;
const AT_ONCE: usize = 2;
/// Missing distance that counts for each step at which a hand or an arm penetrates a fixed body, m.
const THROUGH_M: f64 = 1e-4;
/// Hands that grasp or release an object within this time of each other act together, s.
const TOGETHER_S: f64 = 0.3;
/// Progress when every grasp is mapped, and when the grasps of hand-overs are chosen.
const MAPPED_MET: [f64; 2] = [0.2, 0.5];

/// Maps every grasp of commands by its quality, as [`map_by`] does.
///
/// # Errors
/// As [`map_by`].
pub fn map(commands: &mut Commands, robot: &Robot, scene: &Scene) -> Result<Conflicts, InputError> {
    map_by(commands, robot, scene, GraspCriterion::default(), &mut |_| {})
}

/// Maps every grasp of commands by a criterion, and notes the reason where an object cannot be held. If one hand gives an object to the other, both grasps are
/// chosen together. Returns the conflicts of the two arms that are left. `progress` receives the part that is done, 0 to 1.
///
/// # Errors
/// A hand that the robot does not have, an object that the scene does not have.
pub fn map_by(
    commands: &mut Commands,
    robot: &Robot,
    scene: &Scene,
    criterion: GraspCriterion,
    progress: &mut dyn FnMut(f64),
) -> Result<Conflicts, InputError> {
    let alone = commands.tasks.iter().all(|task| task.track == commands.tasks[0].track);
    let [mapped, met] = if alone { [1.0, 1.0] } else { MAPPED_MET };
    let crowded = task_grasps::map(commands, robot, scene, criterion, &mut |part| progress(mapped * part))?;
    for task in &mut commands.tasks {
        let (Some(hand), Some(object)) = (robot.hands.get(&task.track), scene.bodies.get(&task.object)) else {
            continue;
        };
        let radius = tip_radius(scene, task.track);
        let grips = task.grasps.iter().map(|grasp| ResolvedGrasp::new(grasp, robot, hand, radius));
        if let Ok(grips) = grips.collect::<Result<Vec<_>, String>>() {
            lift(task, hand, &grips, object, scene);
        }
    }
    let others = Alternatives::new(&commands.tasks, robot, scene);
    progress(mapped);
    for pair in meetings(&commands.tasks) {
        let Some(meeting) = Meeting::new(&commands.tasks, robot, scene, pair) else { continue };
        if let Some(chosen) = meeting.chosen(&others)? {
            for ((number, _), (task, arm)) in pair.into_iter().zip(chosen) {
                let first = commands.tasks.iter().position(|it| it.track == task.track).unwrap_or(number);
                commands.tasks[number] = task;
                let mapped = commands.tasks[first].grasps.first_mut().and_then(|grasp| grasp.mapped.as_mut());
                mapped.into_iter().for_each(|mapped| mapped.arm = arm.clone());
            }
        }
    }
    let conflicts =
        bimanual_separation::keep(commands, robot, scene, &others, &mut |part| progress(met + (1.0 - met) * part))?;
    for BlockedGrasp { grasp: (number, grasp), other, why } in crowded {
        let closed = [(number, grasp), other].map(|(number, grasp)| {
            let task = &commands.tasks[number];
            let radius = tip_radius(scene, task.track);
            let hand = robot.hands.get(&task.track)?;
            let grip = ResolvedGrasp::new(&task.grasps[grasp], robot, hand, radius).ok()?;
            let [closed, _] = grip.shapes(hand);
            Some(closed)
        });
        if !matches!(closed, [Some(ours), Some(theirs)] if !nearer(&ours, &theirs, SHORT_M)) {
            let grasp = &mut commands.tasks[number].grasps[grasp];
            (grasp.mapped, grasp.infeasible) = (None, Some(why));
        }
    }
    Ok(conflicts)
}

/// The two grasps of a hand-over.
struct Meeting<'a> {
    /// The tasks of their group, and the indices of the two tasks in it.
    tasks: Vec<&'a Task>,
    places: [(usize, usize); 2],
    /// The indices of the two tasks among all tasks.
    pair: [(usize, usize); 2],
    /// Whether the first hand gives the object; otherwise it takes it.
    first_gives: bool,
    robot: &'a Robot,
    scene: &'a Scene,
}

/// A grasp with the hand at the object, closed and opened, frame of the object, and its paths.
struct Choice {
    measure: f64,
    closed: Vec<PlacedShape>,
    opened: Vec<PlacedShape>,
    ways: Vec<Ways>,
}

/// Paths to and from a grasp: the task with them, the places on them at which the hand is near, and the rollouts of the arm.
struct Ways {
    task: Task,
    near: [Vec<Vector3<f64>>; 2],
    rollouts: OnceLock<Vec<ArmMotion>>,
}

/// A rollout, and what its penetrations of fixed bodies count, m.
struct ArmMotion {
    rollout: Rollout,
    through: f64,
}

impl ArmMotion {
    /// Returns the gap to the other arm up to [`ROOM_M`], less what penetrations of fixed bodies count, m; any value up to `least` if it is not larger.
    fn room(&self, other: &Self, least: f64) -> f64 {
        let through = self.through + other.through;
        if least + through >= ROOM_M {
            return least;
        }
        self.rollout.gap(&other.rollout, least + through).min(ROOM_M) - through
    }
}

/// A task, and the start posture of its arm.
type Chosen = (Task, BTreeMap<String, f64>);

impl<'a> Meeting<'a> {
    /// Returns `None` if no hand gives the object to the other one, or if a hand has had a task before, which determines the posture of its arm.
    fn new(tasks: &'a [Task], robot: &'a Robot, scene: &'a Scene, pair: [(usize, usize); 2]) -> Option<Self> {
        let numbers = groups(tasks).into_iter().next()?;
        let [one, other] = pair.map(|(number, grasp)| held(&tasks[number], grasp).unwrap_or_default());
        let gives = |from: [f64; 2], to: [f64; 2]| (0..2).all(|end| from[end] + TOGETHER_S < to[end]);
        let first_gives = gives(one, other);
        if !first_gives && !gives(other, one) {
            return None;
        }
        let place = |(number, grasp)| Some((numbers.iter().position(|it| *it == number)?, grasp));
        let places = [place(pair[0])?, place(pair[1])?];
        let tasks = numbers.iter().map(|number| &tasks[*number]).collect();
        Some(Self { tasks, places, pair, first_gives, robot, scene })
    }

    /// Returns the tasks with grasps that leave room; `None` if the mapped grasps do, or if no others are better.
    fn chosen(&self, others: &Alternatives<'_>) -> Result<Option<[Chosen; 2]>, InputError> {
        let mapped = [0, 1].map(|hand| self.choice(hand, None));
        let mut apart = SHORT_M;
        if let [Some(one), Some(other)] = &mapped {
            let rollouts = [self.rollouts(0, &one.ways[0]).first(), self.rollouts(1, &other.ways[0]).first()];
            // An arm that cannot follow its path is refused later, with the reason.
            let [Some(one), Some(other)] = rollouts else { return Ok(None) };
            apart = one.room(other, 0.0).max(SHORT_M);
            if apart >= ROOM_M {
                return Ok(None);
            }
        }
        let mut choices: Vec<Vec<Choice>> = Vec::new();
        for (hand, mapped) in mapped.into_iter().enumerate() {
            let others = others.of(self.tasks[self.places[hand].0], self.pair[hand])?.iter();
            let others = others.filter_map(|held| self.choice(hand, Some(held.clone())));
            choices.push(mapped.into_iter().chain(others).collect());
        }
        let pairs = choices[0].iter().flat_map(|one| choices[1].iter().map(move |other| [one, other]));
        let beside = |[one, other]: &[&Choice; 2]| leave_room(&one.closed, &other.closed);
        let mut pairs: Vec<[&Choice; 2]> = pairs.filter(beside).collect();
        let measure = |pair: &[&Choice; 2]| pair[0].measure * pair[1].measure;
        pairs.sort_by(|a, b| measure(b).total_cmp(&measure(a)));
        let mut ways = pairs.into_iter().flat_map(|pair| self.free_ways(pair)).take(PAIRS).peekable();
        let mut best: Option<(f64, [Chosen; 2])> = None;
        while ways.peek().is_some() {
            let ways: Vec<[&Ways; 2]> = ways.by_ref().take(AT_ONCE).collect();
            let least = best.as_ref().map_or(apart, |(room, _)| *room);
            for found in parallel::each(&ways, |ways| self.best_of(*ways, least)).into_iter().flatten() {
                if best.as_ref().is_none_or(|(room, _)| found.0 > *room) {
                    best = Some(found);
                }
                if best.as_ref().is_some_and(|(room, _)| *room >= ROOM_M) {
                    return Ok(best.map(|(_, chosen)| chosen));
                }
            }
        }
        Ok(best.map(|(_, chosen)| chosen))
    }

    /// Returns the postures of two arms on their paths with the most room, or the first with enough, and that room, m; `None` if it is at most `least`.
    fn best_of(&self, ways: [&Ways; 2], least: f64) -> Option<(f64, [Chosen; 2])> {
        let mut best = None;
        let mut least = least;
        let [ones, others] = [0, 1].map(|hand| self.rollouts(hand, ways[hand]));
        for [one, other] in ones.iter().flat_map(|one| others.iter().map(move |other| [one, other])) {
            let room = one.room(other, least);
            if room > least {
                let chosen = |hand: usize, motion: &ArmMotion| (ways[hand].task.clone(), motion.rollout.arm.clone());
                (least, best) = (room, Some((room, [chosen(0, one), chosen(1, other)])));
            }
            if room >= ROOM_M {
                break;
            }
        }
        best
    }

    /// Returns a grasp, by default the mapped one, with its paths: as demonstrated, and along the hand's own axis.
    fn choice(&self, hand: usize, other: Option<TaskGrasp>) -> Option<Choice> {
        let (number, grasp) = self.places[hand];
        let mut task = self.tasks[number].clone();
        if let Some(held) = other {
            held.note(&mut task, grasp);
        }
        let measure = task.grasps[grasp].mapped.as_ref()?.measure;
        let model = self.robot.hands.get(&task.track)?;
        let radius = tip_radius(self.scene, task.track);
        let grip = ResolvedGrasp::new(&task.grasps[grasp], self.robot, model, radius).ok()?;
        let [closed, opened] = grip.shapes(model);
        let mut tasks = vec![task];
        for way in [Leg::Approach, Leg::Retreat] {
            for mut task in tasks.clone() {
                if turn(&mut task, grasp, &grip, way) {
                    tasks.push(task);
                }
            }
        }
        let near = |task: &Task, way: Leg| {
            let near = || offsets(task, grasp, way).into_iter().map(|(off, _)| off).filter(|off| off.norm() < NEAR_M);
            near().step_by(near().count().div_ceil(PLACES).max(1)).collect()
        };
        let ways = tasks.into_iter().map(|task| Ways {
            near: [Leg::Approach, Leg::Retreat].map(|way| near(&task, way)),
            task,
            rollouts: OnceLock::new(),
        });
        Some(Choice { measure, closed, opened, ways: ways.collect() })
    }

    /// Returns the paths of two grasps on which each opened hand leaves room for the other hand that holds the object.
    fn free_ways<'c>(&self, pair: [&'c Choice; 2]) -> Vec<[&'c Ways; 2]> {
        // The receiving hand approaches the giving hand, which then retreats.
        let comes = [!self.first_gives, self.first_gives];
        let leaves = [self.first_gives, !self.first_gives];
        let free = |hand: usize, ways: &Ways| {
            let other = &pair[1 - hand].closed;
            [comes[hand], leaves[hand]].iter().zip(&ways.near).filter(|(looked, _)| **looked).all(|(_, near)| {
                near.iter().all(|off| {
                    let there: Vec<PlacedShape> = pair[hand].opened.iter().map(|shape| shape.shifted(off)).collect();
                    leave_room(&there, other)
                })
            })
        };
        // Other paths stay as demonstrated.
        let [ones, others] = [0, 1].map(|hand| {
            let concerns = |at: &usize| (comes[hand] || at & 1 == 0) && (leaves[hand] || at & 2 == 0);
            let ways = pair[hand].ways.iter().enumerate().filter(move |(at, _)| concerns(at)).map(|(_, ways)| ways);
            ways.filter(|ways| free(hand, ways)).collect::<Vec<_>>()
        });
        ones.into_iter().flat_map(|one| others.iter().map(move |other| [one, *other])).collect()
    }

    /// Returns the rollouts of an arm; the first one starts from its default posture.
    fn rollouts<'c>(&self, hand: usize, ways: &'c Ways) -> &'c [ArmMotion] {
        let (number, _) = self.places[hand];
        ways.rollouts.get_or_init(|| {
            let mut tasks: Vec<Task> = self.tasks.iter().map(|task| (*task).clone()).collect();
            tasks[number] = ways.task.clone();
            let all = Rollout::all(&tasks, number, self.robot, self.scene).unwrap_or_default().into_iter();
            all.map(|rollout| ArmMotion { through: rollout.meets as f64 * THROUGH_M, rollout }).collect()
        })
    }
}

/// Whether hands are clear of each other.
fn leave_room(ours: &[PlacedShape], theirs: &[PlacedShape]) -> bool {
    !nearer(ours, theirs, ROOM_M)
}
