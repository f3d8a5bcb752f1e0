//! Searching: a hand that feels its object stand on the rim, where it should go into a hole, presses lightly and moves it in a spiral until it drops in.
//!
//! On the rim the object stays behind what is wanted of it, while fingertips feel that something else carries it; a real hand knows both by touch. Then
//! the plan waits. Along the axis the hand follows the object and presses with a small force; across it, it brings the object's plug point along a
//! [`Spiral`]; its tilt is kept. (A force in one direction, a place in the others: M. H. Raibert and J. J. Craig, *Hybrid Position/Force Control of
//! Manipulators*, 1981.) When the object has dropped, the plan goes on from there. When it gets stuck on the rim again, so does the spiral.

use super::mapping::from_seven;
use super::plan::Target;
use super::righting::holds;
use super::spiral::Spiral;
use crate::base::geometry::across;
use crate::base::scene::Scene;
use crate::command::{Opening, Task, hole_of};
use nalgebra::{Isometry3, Vector3};
use std::fmt;

/// A hole is looked for so far about the place where it is expected, m.
pub const WITHIN_M: f64 = 0.004;
/// The way between turns of the spiral as a share of the clearance to every side; twice that is the most. Its bounds, m, and what it is where the
/// clearance is not known, m.
const PITCH: f64 = 1.5;
const PITCH_M: [f64; 2] = [0.000_1, 0.001];
const UNKNOWN_M: f64 = 0.000_25;
/// How fast it goes, m/s; slower where the object sticks and lags behind, down to this share when by so much, m.
const SPEED: f64 = 0.020;
const LEAST: f64 = 0.2;
const LAGS_M: f64 = 0.000_5;
/// How fast the hand goes farther to bring along what sticks, 1/s, how far at most, m, and how fast it is displaced, m/s.
const PULLS: f64 = 5.0;
const PULLS_M: f64 = 0.005;
const HASTE: f64 = 0.040;
/// An object stands on the rim when it is this much higher than it should be, m, and so much less of it is carried by the hand than before, N.
const STANDS_M: f64 = 0.002;
const CARRIED_N: f64 = 0.4;
/// It has dropped in when it is so much lower than it stood, m.
const DROPS_M: f64 = 0.001;
/// The hand presses with this, N, and follows the object along the axis this fast, 1/s.
const PRESSES_N: f64 = 0.5;
const FOLLOWS: f64 = 10.0;
/// What the hand carries is measured when the object is to be higher than this over the rim, m; forces are averaged over about these times, s.
const ABOVE_M: f64 = 0.0045;
const CARRYING_S: f64 = 0.2;
const FEELING_S: f64 = 0.02;
/// How fast the displacement is forgotten when the object has been let go or has dropped in, 1/s.
const FORGOTTEN: f64 = 4.0;

/// What came of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Searched {
    /// The hole was so far from where it was expected, m.
    Found(f64),
    /// It was not within this distance of there, m.
    NotWithin(f64),
}

/// As a person is told it.
impl fmt::Display for Searched {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Found(off) => write!(to, "hole found {:.1} mm from where it was expected", off * 1e3),
            Self::NotWithin(within) => write!(to, "hole not found within {:.1} mm", within * 1e3),
        }
    }
}

/// What a hand feels of its object.
#[derive(Clone, Copy, Debug)]
pub(super) struct Felt {
    /// Where it is, reference frame.
    pub(super) object: Isometry3<f64>,
    /// The force of all fingertips on it, reference frame, N.
    pub(super) force: Vector3<f64>,
}

/// How a hand puts the object of one task into its hole.
pub(super) struct Searching {
    hole: Option<Opening>,
    spiral: Spiral,
    state: State,
    searched: Option<Searched>,
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
struct Seen {
    height: f64,
    wanted_height: f64,
    beside: Vector3<f64>,
}

impl Searching {
    /// For the hole into which a task puts its object, if there is one.
    pub(super) fn new(task: &Task, scene: &Scene) -> Self {
        let into = |name: &str| task.into.as_ref().filter(|into| into.body == name).map(|into| from_seven(&into.pose));
        let inserts = task.segments.iter().rfind(|segment| segment.primitive == "Insert");
        let end = inserts.and_then(|segment| segment.object.last());
        let hole = end.and_then(|end| hole_of(scene, &task.object, &from_seven(end), &into));
        let clearance = hole.and_then(|hole| hole.clearance);
        let pitch = clearance.map_or(UNKNOWN_M, |clearance| (PITCH * clearance).clamp(PITCH_M[0], PITCH_M[1]));
        Self {
            hole,
            spiral: Spiral::new(pitch, WITHIN_M),
            state: State::Going,
            searched: None,
            aside: Vector3::zeros(),
            along: 0.0,
            pulls: Vector3::zeros(),
            carries: 0.0,
            now: 0.0,
        }
    }

    /// What came of it; `None` when there was nothing to search.
    pub(super) fn searched(&self) -> Option<Searched> {
        self.searched
    }

    /// Displaces a target; whether the plan is to wait. `off` is by how much the hole is elsewhere than it was taught, as far as that is known, `inserts` whether
    /// the object is being put in, `dt` the step, s.
    pub(super) fn apply(
        &mut self,
        target: &mut Target,
        felt: &Felt,
        off: &Isometry3<f64>,
        inserts: bool,
        dt: f64,
    ) -> bool {
        let Some(hole) = self.hole else { return false };
        let axis = off.rotation * hole.axis;
        if inserts && holds(target) {
            let from_rim = |object: &Isometry3<f64>| object * hole.plug - off * hole.rim;
            let (wanted, is) = (from_rim(&target.object), from_rim(&felt.object));
            let (height, wanted_height) = (is.dot(&axis), wanted.dot(&axis));
            let beside = is - wanted - axis * (height - wanted_height);
            self.feel(&Seen { height, wanted_height, beside }, felt.force.dot(&axis), &axis, dt);
        } else if felt.force == Vector3::zeros() {
            self.aside *= 1.0 - FORGOTTEN * dt;
            self.along *= 1.0 - FORGOTTEN * dt;
        }
        let by = self.aside + axis * self.along;
        target.palm.translation.vector += by;
        target.object.translation.vector += by;
        target.tips.iter_mut().for_each(|(_, tip, _)| *tip += by);
        let feels = matches!(self.state, State::Feeling(_));
        if feels {
            let press = axis * (PRESSES_N / target.tips.len().max(1) as f64);
            target.tips.iter_mut().for_each(|(.., force)| *force -= press);
        }
        feels
    }

    fn feel(&mut self, seen: &Seen, force: f64, axis: &Vector3<f64>, dt: f64) {
        self.now += (force - self.now) * (dt / FEELING_S).min(1.0);
        if seen.wanted_height > ABOVE_M {
            self.carries += (force - self.carries) * (dt / CARRYING_S).min(1.0);
        }
        let behind = seen.height - seen.wanted_height;
        let high = behind - self.along > STANDS_M && seen.height > -WITHIN_M;
        match self.state {
            State::Going if high && self.carries - self.now > CARRIED_N => self.state = State::Feeling(seen.height),
            State::Feeling(stood) if seen.height < stood - DROPS_M => {
                self.state = State::Going;
                self.pulls = Vector3::zeros();
                self.searched = Some(Searched::Found(seen.beside.norm()));
            }
            _ => {}
        }
        let follow = (behind - self.along) * (FOLLOWS * dt).min(1.0);
        let to = match (self.state, self.searched) {
            (State::Feeling(_), _) => {
                self.along += follow;
                self.go_round(seen, axis, dt)
            }
            (State::Lost, _) => {
                self.along += follow;
                Vector3::zeros()
            }
            // Where the hole has it.
            (State::Going, Some(Searched::Found(_))) => {
                self.along *= 1.0 - FORGOTTEN * dt;
                seen.beside
            }
            (State::Going, _) => Vector3::zeros(),
        };
        let way = to - self.aside;
        self.aside += way * (HASTE * dt / way.norm().max(1e-12)).min(1.0);
    }

    /// Goes on with the spiral; where the hand is to be displaced to.
    fn go_round(&mut self, seen: &Seen, axis: &Vector3<f64>, dt: f64) -> Vector3<f64> {
        let [one, other] = across(axis);
        let [x, y] = self.spiral.place();
        let place = one * x + other * y;
        let lag = place - seen.beside;
        self.pulls += lag * (PULLS * dt);
        self.pulls *= (PULLS_M / self.pulls.norm().max(1e-12)).min(1.0);
        let share = (1.0 - lag.norm() / LAGS_M).clamp(LEAST, 1.0);
        if !self.spiral.go_on(SPEED * share * dt) {
            self.state = State::Lost;
            self.searched = Some(Searched::NotWithin(WITHIN_M));
        }
        place + self.pulls
    }
}
