//! Peg search: a hand that feels its object stand on the rim, where it should go into a hole, presses lightly and moves it in a spiral until it drops in.
//!
//! On the rim the object stays behind its target, while fingertips feel that something else carries it; a real hand knows both by touch. Then
//! the plan waits. Along the axis the hand follows the object and presses with a small force; across it, it brings the object's plug point along a
//! [`SpiralPath`]; its tilt is kept. (A force in one direction, a place in the others: M. H. Raibert and J. J. Craig, *Hybrid Position/Force Control of
//! Manipulators*, 1981.) When the object has dropped, the plan goes on from there. When it gets stuck on the rim again, so does the spiral.

use super::spiral_path::SpiralPath;
use crate::control::behavior::{Behavior, HandObservation, Progress, SearchResult, holds};
use crate::planning::plan::Target;
use nalgebra::{Isometry3, Vector3};
use teachtree_base::geometry::perpendiculars;
use teachtree_base::meaning::Meaning;
use teachtree_base::pose::pose_from_array;
use teachtree_base::scene::Scene;
use teachtree_command::{HoleGeometry, Task, hole_of};

/// A hole is looked for so far about the place where it is expected, m.
pub const WITHIN_M: f64 = 0.004;

/// Gains and thresholds of the search; ours, tuned on the tight shipped holes with offsets of up to 4 mm (docs/robot.md, Peg search).
#[derive(Clone, Copy, Debug)]
struct Gains {
    /// The way between turns of the spiral as a share of the clearance to every side; twice that is the most.
    pitch: f64,
    /// Its bounds, m, and what it is where the clearance is not known, m.
    pitch_m: [f64; 2],
    unknown_pitch_m: f64,
    /// The speed of the spiral, m/s; slower where the object sticks and lags behind, down to this share when by so much, m.
    speed_m_s: f64,
    least_speed: f64,
    lags_m: f64,
    /// How fast the hand goes farther to bring along what sticks, 1/s, and how far at most, m.
    pulls: f64,
    pulls_m: f64,
    /// How fast the hand is displaced at most, m/s.
    haste_m_s: f64,
    /// An object stands on the rim when it is this much higher than it should be, m, and so much less of it is carried by the hand than before, N.
    stands_m: f64,
    carried_n: f64,
    /// It has dropped in when it is so much lower than it stood, m.
    drops_m: f64,
    /// The hand presses with this, N, and follows the object along the axis this fast, 1/s.
    presses_n: f64,
    follows: f64,
    /// What the hand carries is measured when the object is to be higher than this over the rim, m.
    above_m: f64,
    /// Time constants of what the hand carries and of what it feels, s.
    carrying_s: f64,
    feeling_s: f64,
    /// How fast the displacement is forgotten when the object has been let go or has dropped in, 1/s.
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
    /// The searches before any.
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

/// How a hand puts the object of one task into its hole.
struct Search {
    gains: Gains,
    hole: Option<HoleGeometry>,
    spiral: SpiralPath,
    state: State,
    searched: Option<SearchResult>,
    /// What the hand is displaced by: across the axis from where the hole is expected, and along it, m.
    aside: Vector3<f64>,
    along: f64,
    /// How much farther than the spiral it goes to bring along what sticks, m.
    pulls: Vector3<f64>,
    /// The force along the axis that carries the object, and the one now, N.
    carries: f64,
    now: f64,
}

#[derive(Clone, Copy, PartialEq)]
enum State {
    Going,
    /// The object stood so high over the rim, m.
    Feeling(f64),
    Lost,
}

/// Where an object is, beside where it should be, seen along the axis of its hole, m.
struct HoleOffset {
    height: f64,
    wanted_height: f64,
    beside: Vector3<f64>,
}

impl Search {
    /// For the hole into which a task puts its object, if there is one.
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

    /// Displaces a target; whether the plan is to wait. `dt` is the step, s.
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

    /// Goes on with the spiral; where the hand is to be displaced to.
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
