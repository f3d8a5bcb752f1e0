//! Peg search: a hand whose object stands on the rim of its hole presses lightly and moves the object along a spiral until it drops in.
//!
//! On the rim the object lags behind its target, and the fingertips carry less of its weight; a real hand can sense both. The plan then waits. Along the
//! axis the hand follows the object and presses with a small force. Across the axis, it moves the object's plug point along a [`SpiralPath`] and keeps the
//! tilt. (Force control in one direction, position control in the others: M. H. Raibert and J. J. Craig, *Hybrid Position/Force Control of Manipulators*,
//! 1981.) When the object has dropped, the plan continues from there. When the object stands on the rim again, the spiral continues.

use super::spiral_path::SpiralPath;
use crate::control::behavior::{Behavior, HandObservation, Progress, SearchResult, holds};
use crate::planning::plan::Target;
use nalgebra::{Isometry3, Vector3};
use teachtree_base::geometry::perpendiculars;
use teachtree_base::meaning::Meaning;
use teachtree_base::pose::pose_from_array;
use teachtree_base::scene::Scene;
use teachtree_command::{HoleGeometry, Task, hole_of};

/// The radius of the search about the expected position of a hole, m.
pub const WITHIN_M: f64 = 0.004;

/// Gains and thresholds of the search; ours, tuned on the tight shipped holes with offsets of up to 4 mm (docs/robot.md, Peg search).
#[derive(Clone, Copy, Debug)]
struct Gains {
    /// The pitch of the spiral, as a multiple of the clearance to each side; less than 2.
    pitch: f64,
    /// The bounds of the pitch, m, and the pitch for an unknown clearance, m.
    pitch_m: [f64; 2],
    unknown_pitch_m: f64,
    /// The speed of the spiral, m/s. An object that lags by `lags_m` (m) slows it to the share `least_speed`.
    speed_m_s: f64,
    least_speed: f64,
    lags_m: f64,
    /// The gain (1/s) and the limit (m) of the extra displacement that moves a stuck object.
    pulls: f64,
    pulls_m: f64,
    /// The maximum speed of the displacement, m/s.
    haste_m_s: f64,
    /// An object stands on the rim when it is this much above its target, m, and the force with which the hand carries it has decreased by `carried_n`, N.
    stands_m: f64,
    carried_n: f64,
    /// The object has dropped in when it is this much lower than on the rim, m.
    drops_m: f64,
    /// The pressing force, N, and the gain with which the hand follows the object along the axis, 1/s.
    presses_n: f64,
    follows: f64,
    /// The carried force is measured while the target of the object is higher than this above the rim, m.
    above_m: f64,
    /// The time constants of the carried force and of the current force, s.
    carrying_s: f64,
    feeling_s: f64,
    /// The rate at which the displacement decays after the object is released or has dropped in, 1/s.
    forgotten: f64,
}

impl Default for Gains {
    fn default() -> Self {
        Self {
            pitch: 1.5,
            pitch_m: [0.000_1, 0.001],
            unknown_pitch_m: 0.000_25,
            speed_m_s: 0.020,
            least_speed: 0.2,
            lags_m: 0.000_5,
            pulls: 5.0,
            pulls_m: 0.005,
            haste_m_s: 0.040,
            stands_m: 0.002,
            carried_n: 0.4,
            drops_m: 0.001,
            presses_n: 0.5,
            follows: 10.0,
            above_m: 0.0045,
            carrying_s: 0.2,
            feeling_s: 0.02,
            forgotten: 4.0,
        }
    }
}

/// The searches of a hand, one for each task.
pub(crate) struct PegSearch {
    tasks: Vec<Search>,
}

impl PegSearch {
    /// Returns the searches of all tasks, before any has begun.
    pub(super) fn new(tasks: &[Task], scene: &Scene) -> Self {
        Self { tasks: tasks.iter().map(|task| Search::new(task, scene)).collect() }
    }
}

impl Behavior for PegSearch {
    /// Displaces a target across the axis of the hole and along it.
    fn apply(&mut self, sensed: &HandObservation<'_>, target: &mut Target, dt_s: f64) -> Progress {
        let Some(search) = self.tasks.get_mut(sensed.task) else { return Progress::Continue };
        if search.apply(target, sensed, dt_s) { Progress::Wait } else { Progress::Continue }
    }

    fn searched(&self, task: usize) -> Option<SearchResult> {
        self.tasks.get(task)?.searched
    }
}

/// The search for the hole of one task.
struct Search {
    gains: Gains,
    hole: Option<HoleGeometry>,
    spiral: SpiralPath,
    state: State,
    searched: Option<SearchResult>,
    /// The displacement of the hand across the axis from the expected position of the hole, and along the axis, m.
    aside: Vector3<f64>,
    along: f64,
    /// The extra displacement beyond the spiral that moves a stuck object, m.
    pulls: Vector3<f64>,
    /// The force along the axis with which the hand carries the object, and the current force, N.
    carries: f64,
    now: f64,
}

#[derive(Clone, Copy, PartialEq)]
enum State {
    Going,
    /// The height of the object on the rim above its target, m.
    Feeling(f64),
    Lost,
}

/// The offset of an object from its target, across and along the axis of its hole, m.
struct HoleOffset {
    height: f64,
    wanted_height: f64,
    beside: Vector3<f64>,
}

impl Search {
    /// Returns the search of a task; it does nothing if the task has no hole.
    fn new(task: &Task, scene: &Scene) -> Self {
        let into =
            |name: &str| task.into.as_ref().filter(|into| into.body == name).map(|into| pose_from_array(&into.pose));
        let inserts = task.segments.iter().rfind(|segment| segment.does == Meaning::Insert);
        let end = inserts.and_then(|segment| segment.object.last());
        let hole = end.and_then(|end| hole_of(scene, &task.object, &pose_from_array(end), &into));
        let clearance = hole.and_then(|hole| hole.clearance);
        let gains = Gains::default();
        let [low, high] = gains.pitch_m;
        let pitch = clearance.map_or(gains.unknown_pitch_m, |clearance| (gains.pitch * clearance).clamp(low, high));
        Self {
            gains,
            hole,
            spiral: SpiralPath::new(pitch, WITHIN_M),
            state: State::Going,
            searched: None,
            aside: Vector3::zeros(),
            along: 0.0,
            pulls: Vector3::zeros(),
            carries: 0.0,
            now: 0.0,
        }
    }

    /// Displaces a target and returns whether the plan waits. `dt` is the step, s.
    fn apply(&mut self, target: &mut Target, sensed: &HandObservation<'_>, dt: f64) -> bool {
        let Some(hole) = self.hole else { return false };
        let (off, force) = (&sensed.hole_off, sensed.force());
        let axis = off.rotation * hole.axis;
        if sensed.inserts && holds(target) {
            let from_rim = |object: &Isometry3<f64>| object * hole.plug - off * hole.rim;
            let (wanted, is) = (from_rim(&target.object), from_rim(&sensed.object));
            let (height, wanted_height) = (is.dot(&axis), wanted.dot(&axis));
            let beside = is - wanted - axis * (height - wanted_height);
            self.feel(&HoleOffset { height, wanted_height, beside }, force.dot(&axis), &axis, dt);
        } else if force == Vector3::zeros() {
            self.aside *= 1.0 - self.gains.forgotten * dt;
            self.along *= 1.0 - self.gains.forgotten * dt;
        }
        let by = self.aside + axis * self.along;
        target.palm.translation.vector += by;
        target.object.translation.vector += by;
        target.tips.iter_mut().for_each(|(_, tip, _)| *tip += by);
        let feels = matches!(self.state, State::Feeling(_));
        if feels {
            let press = axis * (self.gains.presses_n / target.tips.len().max(1) as f64);
            target.tips.iter_mut().for_each(|(.., force)| *force -= press);
        }
        feels
    }

    fn feel(&mut self, seen: &HoleOffset, force: f64, axis: &Vector3<f64>, dt: f64) {
        self.now += (force - self.now) * (dt / self.gains.feeling_s).min(1.0);
        if seen.wanted_height > self.gains.above_m {
            self.carries += (force - self.carries) * (dt / self.gains.carrying_s).min(1.0);
        }
        let behind = seen.height - seen.wanted_height;
        let high = behind - self.along > self.gains.stands_m && seen.height > -WITHIN_M;
        match self.state {
            State::Going if high && self.carries - self.now > self.gains.carried_n => {
                self.state = State::Feeling(seen.height)
            }
            State::Feeling(stood) if seen.height < stood - self.gains.drops_m => {
                self.state = State::Going;
                self.pulls = Vector3::zeros();
                self.searched = Some(SearchResult::Found(seen.beside.norm()));
            }
            _ => {}
        }
        let follow = (behind - self.along) * (self.gains.follows * dt).min(1.0);
        let to = match (self.state, self.searched) {
            (State::Feeling(_), _) => {
                self.along += follow;
                self.advance_spiral(seen, axis, dt)
            }
            (State::Lost, _) => {
                self.along += follow;
                Vector3::zeros()
            }
            // Where the hole has it.
            (State::Going, Some(SearchResult::Found(_))) => {
                self.along *= 1.0 - self.gains.forgotten * dt;
                seen.beside
            }
            (State::Going, _) => Vector3::zeros(),
        };
        let way = to - self.aside;
        self.aside += way * (self.gains.haste_m_s * dt / way.norm().max(1e-12)).min(1.0);
    }

    /// Advances the spiral and returns the new displacement of the hand.
    fn advance_spiral(&mut self, seen: &HoleOffset, axis: &Vector3<f64>, dt: f64) -> Vector3<f64> {
        let [one, other] = perpendiculars(axis);
        let [x, y] = self.spiral.place();
        let place = one * x + other * y;
        let lag = place - seen.beside;
        self.pulls += lag * (self.gains.pulls * dt);
        self.pulls *= (self.gains.pulls_m / self.pulls.norm().max(1e-12)).min(1.0);
        let share = (1.0 - lag.norm() / self.gains.lags_m).clamp(self.gains.least_speed, 1.0);
        if !self.spiral.advance(self.gains.speed_m_s * share * dt) {
            self.state = State::Lost;
            self.searched = Some(SearchResult::NotWithin(WITHIN_M));
        }
        place + self.pulls
    }
}
